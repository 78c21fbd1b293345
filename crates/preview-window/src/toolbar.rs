//! The row above the picture: what it shows, and how.

use eframe::egui::{Align, Button, ComboBox, Layout, Response, Slider, TextWrapMode, Ui, vec2};

use crate::keys::label;
use crate::numbers;
use crate::state::{Action, State};
use preview::Mode;
use preview::{Arrangement, Backdrop, Tone, ViewSettings};

pub(crate) fn toolbar(ui: &mut Ui, state: &State, actions: &mut Vec<Action>) {
    ui.style_mut().wrap_mode = Some(TextWrapMode::Extend);
    ui.horizontal_wrapped(|ui| {
        let settings = &state.settings;
        modes(ui, settings, actions);
        picture(ui, settings, actions);
        let size = vec2(ui.available_size_before_wrap().x, ui.spacing().interact_size.y);
        if size.x >= BUTTONS {
            let right = Layout::right_to_left(Align::Center);
            ui.allocate_ui_with_layout(size, right, |ui| panels(ui, state, true, actions));
        } else {
            row(ui);
            panels(ui, state, false, actions);
        }
    });
}

/// What a slider with its number takes, and all buttons on the right.
const SLIDER: f32 = 220.0;
const BUTTONS: f32 = 300.0;

/// Begins another row.
fn row(ui: &mut Ui) {
    ui.end_row();
    let height = ui.spacing().interact_size.y;
    ui.set_row_height(height);
}

/// A slider, which unlike other controls does not know by itself that it belongs into the next row.
fn slide(ui: &mut Ui, slider: Slider<'_>) -> Response {
    if ui.available_size_before_wrap().x < SLIDER {
        row(ui);
    }
    ui.add(slider)
}

fn modes(ui: &mut Ui, settings: &ViewSettings, actions: &mut Vec<Action>) {
    actions.extend(choose(ui, "mode", &Mode::ALL, settings.mode, label).map(Action::Mode));
    for (arrangement, name, explained) in [
        (Arrangement::One, "one", "One mode"),
        (Arrangement::Split, "split", "Two modes side by side (S)"),
        (Arrangement::Difference, "difference", "The absolute difference of two modes (D)"),
    ] {
        let button = Button::selectable(settings.arrangement == arrangement, name);
        if ui.add(button).on_hover_text(explained).clicked() {
            actions.push(Action::Arrange(arrangement));
        }
    }
    if settings.arrangement == Arrangement::One {
        return;
    }
    actions.extend(choose(ui, "second mode", &Mode::ALL, settings.second, label).map(Action::Second));
    if settings.arrangement == Arrangement::Difference {
        let mut amplify = settings.amplify;
        let slider =
            Slider::new(&mut amplify, ViewSettings::AMPLIFICATIONS).logarithmic(true).max_decimals(0);
        if slide(ui, slider.prefix("x ")).on_hover_text("How many times stronger (A)").changed() {
            actions.push(Action::Amplify(amplify));
        }
    }
}

fn picture(ui: &mut Ui, settings: &ViewSettings, actions: &mut Vec<Action>) {
    let backdrop = choose(ui, "background", &Backdrop::ALL, settings.backdrop, Backdrop::label);
    actions.extend(backdrop.map(Action::Background));
    let mut exposure = settings.exposure;
    let slider = Slider::new(&mut exposure, ViewSettings::EXPOSURES)
        .custom_formatter(|value, _| numbers::stops(value))
        .custom_parser(|text| text.trim_end_matches("stops").trim().parse().ok());
    let slider = slide(ui, slider).on_hover_text("Exposure (E, Shift E, 0)");
    if slider.changed() {
        actions.push(Action::Expose(exposure));
    }
    actions.extend(choose(ui, "tone curve", &Tone::ALL, settings.tone, Tone::label).map(Action::Tone));
}

/// The buttons on the right, the last first where they are laid out from there.
fn panels(ui: &mut Ui, state: &State, from_right: bool, actions: &mut Vec<Action>) {
    let settings = &state.settings;
    let mut buttons = [
        (false, "screenshot", "Keep the picture as a file (P)", Action::Screenshot),
        (settings.lists, "lists", "Environments, materials, meshes (L)", Action::ToggleLists),
        (
            settings.inspector,
            "inspector",
            "Figures of what is seen, where there is room (I)",
            Action::ToggleInspector,
        ),
        (state.help, "?", "All keys (?)", Action::ToggleHelp),
    ];
    if from_right {
        buttons.reverse();
    }
    for (on, name, explained, action) in buttons {
        if ui.add(Button::selectable(on, name)).on_hover_text(explained).clicked() {
            actions.push(action);
        }
    }
}

/// A list that drops down; what is chosen there, where it is another.
fn choose<T: Copy + PartialEq>(
    ui: &mut Ui,
    name: &str,
    all: &[T],
    now: T,
    label: impl Fn(T) -> &'static str,
) -> Option<T> {
    let mut chosen = now;
    let list = ComboBox::from_id_salt(name).width(104.0).selected_text(label(now));
    let shown = list.show_ui(ui, |ui| {
        for &one in all {
            ui.selectable_value(&mut chosen, one, label(one));
        }
    });
    let capital = name[..1].to_uppercase() + &name[1..];
    shown.response.on_hover_text(capital);
    (chosen != now).then_some(chosen)
}
