//! What the window writes: values of materials, and a turn of the light.

use std::sync::Arc;

use ::preview::{Aim, MaterialForm, PreviewUpdate};

use stages::PreviewCatalog;

use super::{PendingWork, PreviewController};
use crate::preview::light_edit;

pub(crate) enum MaterialEdit {
    /// Show the material with these values, or with those of its file.
    Show(Option<MaterialForm>),
    /// Write these values to the material's file.
    Save(MaterialForm),
}

/// A turn of the light to write, and the lines that the user agreed to.
pub(super) struct SavedLight {
    pub(super) turn: Aim,
    pub(super) lines: Vec<String>,
}

impl PreviewController<'_> {
    /// Gives materials the values that the window set, and saves them.
    pub(super) fn edit_materials(&mut self, work: &mut PendingWork) {
        for (material, edit) in std::mem::take(&mut work.edits) {
            let form = match edit {
                MaterialEdit::Show(form) => {
                    self.edits.edit(&material, form);
                    continue;
                }
                MaterialEdit::Save(form) => form,
            };
            let result = self.edits.save(&material, form);
            let saved = result.is_ok();
            let (title, lines) = match result {
                Ok(file) => ("saved the material", vec![crate::working_folder::name(&file)]),
                Err(lines) => ("the material was not saved", lines),
            };
            // The file may have changed.
            work.read_material = true;
            self.send(PreviewUpdate::Toast { title: title.into(), lines });
            self.send(PreviewUpdate::MaterialSaved { material, saved });
        }
    }

    /// Checks that no unsaved values are of another file than the material of that name in a catalog.
    ///
    /// # Errors
    /// If there are some. Lines for a message.
    pub(super) fn check_edits(&self, catalog: &PreviewCatalog) -> Result<(), Vec<String>> {
        let file_of = |material: &str| Some(catalog.material_file(catalog.with_material(material)?));
        match self.edits.unsaved_of_another_file(file_of) {
            None => Ok(()),
            Some(material) => Err(vec![
                format!("{material} was replaced on the disk, and its values here are not saved"),
                "hint: save or revert them first".into(),
            ]),
        }
    }

    /// Says how a turned light would be written to the manifest, or writes it.
    pub(super) fn edit_light(&mut self, work: &mut PendingWork) {
        let (project, kinds, subject) = (&self.project, self.request.kinds, self.wanted.as_ref());
        let not_written = |lines| PreviewUpdate::Toast { title: "the light was not written".into(), lines };
        if let (Some(turn), Some(subject)) = (work.proposed_light, subject) {
            let proposed = light_edit::propose(project, kinds, subject, turn);
            self.send(match proposed {
                Ok(lines) => PreviewUpdate::LightEdit { turn, lines },
                Err(lines) => not_written(lines),
            });
        }
        let (Some(SavedLight { turn, lines }), Some(subject)) = (work.saved_light.take(), subject) else {
            return;
        };
        let written = match light_edit::save(project, kinds, subject, turn, &lines) {
            Ok(manifest) => manifest,
            Err(lines) => return self.send(not_written(lines)),
        };
        let shown = self.shown.as_ref().map(|(_, scene, _)| Arc::clone(&scene.light));
        self.written_light = Some((turn, shown));
        // The picture does not wait for the watcher.
        work.load_plan = true;
        let lines = vec![crate::working_folder::name(&written)];
        self.send(PreviewUpdate::Toast { title: "wrote the light".into(), lines });
    }
}
