//! The editor of the shown material, in the inspector: a slider or a colour for each of its parameters.

use brdf::{Absent, Parameter, Range, Value, ValueType};
use eframe::egui::text::{LayoutJob, TextFormat};
use eframe::egui::{Align, Button, DragValue, Label, Layout, RichText, Slider, TextStyle, Ui, UiBuilder};

use crate::material_editor::MaterialEditor;
use crate::state::{Action, State};
use crate::theme;
use preview::FormField;

/// The width of a slider without its number.
const SLIDER: f32 = 84.0;

/// Ranges that end above this have a logarithmic slider, and those whose ends are this far apart.
const MIN_LOGARITHMIC: f64 = 1e3;

pub(crate) fn editor(ui: &mut Ui, state: &State, actions: &mut Vec<Action>) {
    let material = &state.settings.subject.material;
    let Some(editor) = state.editors.get(material) else { return };
    let is_edited = matches!(editor, Ok(editor) if editor.is_edited());
    heading_with(ui, "Edit the material", if is_edited { "not saved" } else { "" });
    let editor = match editor {
        Ok(editor) => editor,
        Err(reason) => {
            ui.label(RichText::new(reason).small());
            return;
        }
    };
    buttons(ui, editor, actions);
    conflict(ui, editor, actions);
    // Layers have long headings.
    let is_alone = editor.form().sections.len() == 1;
    for (index, section) in editor.form().sections.iter().enumerate() {
        if !is_alone {
            ui.add_space(4.0);
        }
        ui.label(RichText::new(&section.heading).color(theme::STRONG));
        ui.scope(|ui| {
            ui.spacing_mut().item_spacing.y = 2.0;
            for (parameter, description) in section.parameters.iter().enumerate() {
                let field = FormField { section: index, parameter };
                if let Some(value) = editor.form().value(field) {
                    row(ui, field, description, value, actions);
                }
            }
        });
    }
    let rests = ui.input(|input| !input.pointer.any_down()) && !ui.ctx().text_edit_focused();
    let changes = actions.iter().any(|action| matches!(action, Action::SetParameter(..)));
    if rests && (editor.is_dragged() || changes) {
        actions.push(Action::EndDrag);
    }
    ui.add_space(4.0);
    ui.separator();
}

/// A heading, and a note about what is not saved. Nothing below it moves when the note appears.
pub(crate) fn heading_with(ui: &mut Ui, heading: &str, note: &str) {
    let mut text = LayoutJob::default();
    for (part, colour) in [(heading, theme::WEAK), (note, theme::REFLECTED)] {
        let format = TextFormat::simple(TextStyle::Small.resolve(ui.style()), colour);
        text.append(part, if text.is_empty() { 0.0 } else { 8.0 }, format);
    }
    ui.add(Label::new(text).truncate());
}

fn buttons(ui: &mut Ui, editor: &MaterialEditor, actions: &mut Vec<Action>) {
    let [undo, redo] = editor.steps();
    let is_edited = editor.is_edited();
    let buttons = [
        (
            is_edited && editor.conflict().is_none(),
            "save",
            "Write the values to the file (Ctrl S)",
            Action::SaveMaterial,
        ),
        (undo, "undo", "Undo (Ctrl Z)", Action::Undo),
        (redo, "redo", "Redo (Ctrl Shift Z)", Action::Redo),
        (is_edited, "revert", "Return to the values of the file (Ctrl R)", Action::Revert),
    ];
    ui.horizontal(|ui| {
        for (enabled, name, explained, action) in buttons {
            if ui.add_enabled(enabled, Button::new(name).small()).on_hover_text(explained).clicked() {
                actions.push(action);
            }
        }
    });
}

/// The choice if the file has changed while there are unsaved values.
fn conflict(ui: &mut Ui, editor: &MaterialEditor, actions: &mut Vec<Action>) {
    let Some(file) = editor.conflict() else { return };
    ui.label(RichText::new("The file has changed on the disk.").color(theme::FAILED));
    if let Err(reason) = file {
        ui.label(RichText::new(reason).small());
    }
    ui.horizontal(|ui| {
        let load = Button::new("load the file").small();
        if ui.add(load).on_hover_text("Drop the values that are not saved").clicked() {
            actions.push(Action::LoadFile);
        }
        let keep = Button::new("keep these values").small();
        let explained = "Keep the values that are not saved; saving writes them over those of the file";
        if ui.add_enabled(editor.can_keep(), keep).on_hover_text(explained).clicked() {
            actions.push(Action::KeepValues);
        }
    });
}

/// A parameter: its name on the left, its control on the right.
fn row(ui: &mut Ui, field: FormField, parameter: &Parameter, value: &Value, actions: &mut Vec<Action>) {
    // A control keeps its identity if another section gets more rows.
    let id = UiBuilder::new().id_salt((field.section, parameter.name));
    ui.scope_builder(id, |ui| {
        ui.horizontal(|ui| {
            ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
                let new = match (parameter.value_type, value) {
                    (ValueType::Number(range), Value::Number(number)) => {
                        slider(ui, range, *number).map(Value::Number)
                    }
                    (ValueType::Colour(range), Value::Colour(rgb)) => {
                        colour(ui, range, *rgb).map(Value::Colour)
                    }
                    _ => None,
                };
                if let Some(new) = new {
                    actions.push(Action::SetParameter(field, new));
                }
                ui.with_layout(Layout::left_to_right(Align::Center), |ui| {
                    ui.add(Label::new(parameter.name).truncate()).on_hover_text(explained(parameter));
                });
            });
        });
    });
}

/// `roughness: the width of the highlight; a number from 0.01 to 1`
fn explained(parameter: &Parameter) -> String {
    let Parameter { name, meaning, .. } = parameter;
    let range = match parameter.value_type {
        ValueType::Number(range) => format!("; {}", range.words),
        ValueType::Colour(range) => format!("; linear Rec. 709, each {}", range.words),
        ValueType::Records(_) => String::new(),
    };
    let default = match parameter.absent {
        Absent::Default(value) => format!("; default {value}"),
        Absent::Required | Absent::RequiredUnless(_) | Absent::Optional => String::new(),
    };
    format!("{name}: {meaning}{range}{default}")
}

/// Returns a new number.
fn slider(ui: &mut Ui, range: Range, mut number: f64) -> Option<f64> {
    let Range { least, most, .. } = range;
    ui.spacing_mut().slider_width = SLIDER;
    let is_wide = most > MIN_LOGARITHMIC || least > 0.0 && most / least > MIN_LOGARITHMIC;
    let slider = Slider::new(&mut number, least..=most).logarithmic(is_wide).smallest_positive(1e-3);
    let response = ui.add(slider.max_decimals(4));
    response.changed().then(|| if response.dragged() { rounded(number) } else { number })
}

/// Returns a new colour. The button shows the part of it below 1.
fn colour(ui: &mut Ui, range: Range, rgb: [f64; 3]) -> Option<[f64; 3]> {
    let mut new = rgb;
    ui.spacing_mut().item_spacing.x = 3.0;
    ui.spacing_mut().interact_size.x = 34.0;
    // They are laid out from the right.
    for channel in [2, 1, 0] {
        let speed = 0.005 * rgb[channel].abs().max(0.2);
        let drag =
            DragValue::new(&mut new[channel]).range(range.least..=range.most).speed(speed).max_decimals(3);
        let response = ui.add(drag);
        if response.dragged() && response.changed() {
            new[channel] = rounded(new[channel]);
        }
    }
    let shown = new.map(|channel| channel as f32);
    let mut picked = shown;
    if ui.color_edit_button_rgb(&mut picked).changed() {
        for channel in 0..3 {
            // The picker calculates with hue and value, which changes the last digits of all channels.
            if (picked[channel] - shown[channel]).abs() > 5e-4 {
                new[channel] = rounded(picked[channel].into());
            }
        }
    }
    (new != rgb).then_some(new)
}

/// A number with three digits: what a pointer sets is not more accurate.
fn rounded(number: f64) -> f64 {
    format!("{number:.2e}").parse().unwrap_or(number)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dragged_numbers_have_three_digits() {
        assert_eq!(
            [0.123_456, 12_345.0, 0.35, 0.0, -1.500_01].map(rounded),
            [0.123, 12_300.0, 0.35, 0.0, -1.5]
        );
    }

    #[test]
    fn a_parameter_is_explained_with_its_range_and_default() {
        let standard = brdf::MODELS.iter().find(|model| model.name == "standard").unwrap();
        let of = |name: &str| {
            explained(standard.parameters.iter().find(|parameter| parameter.name == name).unwrap())
        };
        assert_eq!(
            of("metallic"),
            "metallic: 0 for a dielectric, 1 for a metal, or between for a mixture; a number from 0 to 1; default 0"
        );
        assert!(of("base_color").contains("; linear Rec. 709, each a number from 0 to 1; "));
    }
}
