//! Files that are dragged over the window and dropped on it.

use std::path::PathBuf;

use eframe::egui::{Align2, HoveredFile, Rect, RichText, Stroke, Ui};

use crate::notices::over;
use crate::state::Action;
use crate::theme;

/// The names of at most this many files are shown while they are dragged.
const NAMED: usize = 6;

/// The files that were dropped since the last frame.
pub(crate) fn dropped(ui: &Ui) -> Option<Action> {
    let files: Vec<PathBuf> =
        ui.input(|input| input.raw.dropped_files.iter().map(|file| file.path().into()).collect());
    (!files.is_empty()).then_some(Action::Drop(files))
}

/// Says what happens to the files that are dragged over the window, if there are some.
pub(crate) fn hovering(ui: &Ui, picture: Rect) {
    let files = ui.input(|input| input.raw.hovered_files.clone());
    if files.is_empty() {
        return;
    }
    over(ui, "dragged files", picture, Align2::CENTER_CENTER, Stroke::new(2.0, theme::STRONG), |ui| {
        ui.label(RichText::new("Drop to show").heading().color(theme::STRONG));
        for name in files.iter().filter_map(name).take(NAMED) {
            ui.label(name);
        }
        if files.len() > NAMED {
            ui.label(RichText::new(format!("and {} more", files.len() - NAMED)).color(theme::WEAK));
        }
    });
}

fn name(file: &HoveredFile) -> Option<String> {
    Some(file.path.as_ref()?.file_name()?.to_string_lossy().into_owned())
}
