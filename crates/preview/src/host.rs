//! The interface between what shows a preview and the program around it.

use std::path::PathBuf;

#[cfg(doc)]
use crate::PreviewUpdate;
use crate::{Aim, MaterialForm, Picture, Subject};

/// The program around a view of a preview: a window, or a page in a browser. It is called on threads of the
/// view, so no method may block.
pub trait Host: Send {
    /// Requests a subject in place of the one requested before. The host answers with
    /// [`PreviewUpdate::Scene`] or [`PreviewUpdate::Failure`].
    fn show(&mut self, subject: &Subject);

    /// Shows files that were dropped on the view: environments, materials, meshes. The host answers with
    /// [`PreviewUpdate::Choose`] and a catalog that has them beside what is shown, or with a failure.
    fn dropped(&mut self, files: Vec<PathBuf>);

    /// Shows what was shown before files were dropped.
    fn return_from_dropped(&mut self);

    /// Saves the window's settings, JSON, for [`crate::InitialView::state`] of the next window. Called a
    /// moment after the last change, and when the window closes.
    fn keep_state(&mut self, json: &str);

    /// Saves a picture of a subject. The host reports the file or the error as a [`PreviewUpdate::Toast`].
    fn screenshot(&mut self, subject: &Subject, picture: Picture);

    /// Shows a material with other values of its parameters, or with those of its file. Nothing is written.
    /// The host answers with [`PreviewUpdate::Scene`] or [`PreviewUpdate::Failure`].
    fn edit_material(&mut self, material: &str, form: Option<&MaterialForm>);

    /// Writes the values of a material's parameters to its file, unless that has changed since the last
    /// [`PreviewUpdate::Material`]. The host answers with that and
    /// [`PreviewUpdate::MaterialSaved`], and reports an error as a [`PreviewUpdate::Toast`].
    fn save_material(&mut self, material: &str, form: &MaterialForm);

    /// Finds how the manifest would have the light turned further as the view turns it. Nothing is written.
    /// The host answers with [`PreviewUpdate::LightEdit`], or reports why it cannot be written as a
    /// [`PreviewUpdate::Toast`].
    fn propose_light(&mut self, turn: Aim);

    /// Writes the turn of a [`PreviewUpdate::LightEdit`] to the manifest, if what changes is still what its
    /// lines say. The host answers with [`PreviewUpdate::LightSaved`], or reports an error as a
    /// [`PreviewUpdate::Toast`].
    fn save_light(&mut self, turn: Aim, lines: &[String]);

    /// The view has closed.
    fn closed(&mut self);
}
