//! Questions over the window, which wait for an answer: whether to save before closing, and whether to write
//! the light.

use eframe::egui::{Button, Frame, Id, Modal, RichText, ScrollArea, Ui};

use crate::state::{Action, Answer, Dialog};
use crate::theme;

/// The widest dialog, and the gaps around its content, in points.
const WIDEST: f32 = 560.0;
const AROUND: f32 = 60.0;

/// The height of the question, the buttons and the gaps around a dialog.
const BESIDE_LINES: f32 = 150.0;

/// Draws a dialog and collects the answer. Enter presses the button that has the keyboard, at first the first
/// one; Tab goes to the next. Escape is [`Action::Dismiss`].
pub(crate) fn dialog(ui: &Ui, dialog: &Dialog, actions: &mut Vec<Action>) {
    let (question, lines) = text(dialog);
    let buttons: &[(Answer, &str)] = match dialog {
        Dialog::Unsaved(_) => {
            &[(Answer::Save, "Save"), (Answer::Discard, "Discard"), (Answer::Cancel, "Cancel (Esc)")]
        }
        Dialog::SaveLight { .. } => &[(Answer::Save, "Write"), (Answer::Cancel, "Cancel (Esc)")],
    };
    let window = ui.ctx().content_rect();
    let frame = Frame::popup(ui.style()).inner_margin(14);
    Modal::new(Id::unique("dialog")).frame(frame).show(ui.ctx(), |ui| {
        ui.set_max_width((window.width() - AROUND).clamp(120.0, WIDEST));
        ui.label(RichText::new(question).heading().color(theme::STRONG));
        let most = (window.height() - BESIDE_LINES).max(40.0);
        ScrollArea::vertical()
            .max_height(most)
            .show(ui, |ui| lines.iter().for_each(|line| _ = ui.label(line)));
        ui.add_space(8.0);
        ui.horizontal(|ui| {
            let drawn = buttons.iter().map(|(answer, name)| (*answer, ui.add(Button::new(*name))));
            let drawn = drawn.collect::<Vec<_>>();
            if let Some((_, first)) = drawn.first()
                && !drawn.iter().any(|(_, button)| button.has_focus())
            {
                first.request_focus();
                ui.ctx().request_repaint();
            }
            let clicked = drawn.iter().filter(|(_, button)| button.clicked());
            actions.extend(clicked.map(|(answer, _)| Action::Answer(*answer)));
        });
    });
}

/// The question, and the lines below it.
fn text(dialog: &Dialog) -> (String, Vec<String>) {
    match dialog {
        Dialog::Unsaved(materials) => {
            let question = match &materials[..] {
                [material] => format!("Save the changes of {material}?"),
                materials => format!("Save the changes of {} materials?", materials.len()),
            };
            let names = materials.iter().filter(|_| materials.len() > 1).cloned();
            let lost =
                "They are not written to a file yet, and are lost if you close the window without saving.";
            (question, names.chain([lost.to_owned()]).collect())
        }
        Dialog::SaveLight { lines, .. } => match lines.split_first() {
            Some((question, lines)) => (question.clone(), lines.to_vec()),
            None => ("Write the light?".into(), Vec::new()),
        },
    }
}
