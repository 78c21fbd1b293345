//! Writes the light that the window has turned to the manifest. It is written only when the user has agreed
//! to what changes.

use std::path::PathBuf;

use ::preview::{Aim, Subject};
use engine::{Kinds, Plan, path_text};
use stages::{LightEdit, PreviewCatalog};

use super::dropped::name_of;
use super::material_edit::write;
use super::project::Project;
use super::subject::{self, SubjectError};

/// The question of the window and what changes, for the light of a subject that is turned further.
///
/// # Errors
/// If it cannot be written. Lines for a message.
pub(super) fn propose(
    project: &Project,
    kinds: &Kinds,
    subject: &Subject,
    turn: Aim,
) -> Result<Vec<String>, Vec<String>> {
    let (_, edit) = edit(project, kinds, subject, turn)?;
    Ok(lines(project, edit))
}

/// Writes what was proposed with these lines; returns the manifest.
///
/// # Errors
/// If the manifest has changed so that the lines are no longer true, or cannot be written. Lines for a
/// message.
pub(super) fn save(
    project: &Project,
    kinds: &Kinds,
    subject: &Subject,
    turn: Aim,
    proposed: &[String],
) -> Result<PathBuf, Vec<String>> {
    let (before, edit) = edit(project, kinds, subject, turn)?;
    let text = edit.text.clone();
    if lines(project, edit) != proposed || read(project)? != before {
        return Err(changed(project));
    }
    let cannot = |error| vec![format!("{}: {error}", path_text(&project.manifest))];
    write(&project.manifest, &text).map_err(cannot)?;
    Ok(project.manifest.clone())
}

/// The text of the manifest, and the edit of it.
fn edit(
    project: &Project,
    kinds: &Kinds,
    subject: &Subject,
    turn: Aim,
) -> Result<(String, LightEdit), Vec<String>> {
    if !project.files.is_empty() {
        return Err(vec![
            "there is no manifest to write to, because the files were opened without one".into(),
            "hint: `specula preview FILES --manifest` prints one to keep".into(),
        ]);
    }
    let text = read(project)?;
    let plan = Plan::load(&project.manifest, kinds).map_err(|errors| {
        let first = errors.to_string().lines().next().unwrap_or_default().to_owned();
        vec![first, "hint: fix the manifest first".into()]
    })?;
    if read(project)? != text {
        return Err(changed(project));
    }
    let catalog = PreviewCatalog::among(plan, &project.stages);
    let entry = subject::entry(&catalog, &subject.environment, &subject.material);
    let entry = entry.map_err(SubjectError::lines)?;
    let edit = catalog.with_turned_light(entry, turn, &text).map_err(|reason| vec![reason])?;
    Ok((text, edit))
}

fn lines(project: &Project, edit: LightEdit) -> Vec<String> {
    [vec![format!("Write the turned light to {}?", name_of(project))], edit.changes].concat()
}

fn changed(project: &Project) -> Vec<String> {
    vec![format!("{} has changed on the disk; write the light again", name_of(project))]
}

fn read(project: &Project) -> Result<String, Vec<String>> {
    let cannot = |error: String| vec![format!("{}: {error}", path_text(&project.manifest))];
    let bytes = engine::read_file(&project.manifest).map_err(|error| cannot(error.to_string()))?;
    String::from_utf8(bytes).map_err(|error| cannot(error.to_string()))
}
