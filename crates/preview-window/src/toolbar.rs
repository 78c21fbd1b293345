//! The toolbar above the picture: modes, background, exposure and tone curve.

use eframe::egui::{Align, Button, ComboBox, Layout, Response, Slider, TextWrapMode, Ui, vec2};

use crate::numbers;
use crate::state::{Action, State};
use preview::{Arrangement, Mode, Named, ViewSettings};

pub(crate) fn toolbar(ui: &mut Ui, state: &State, actions: &mut Vec<Action>) {
    ui.style_mut().wrap_mode = Some(TextWrapMode::Extend);
    ui.horizontal_wrapped(|ui| {
        let settings = &state.settings;
        modes(ui, state, actions);
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

/// The width of a slider with its number, and that of all buttons on the right.
const SLIDER: f32 = 220.0;
const BUTTONS: f32 = 300.0;

fn row(ui: &mut Ui) {
    ui.end_row();
    let height = ui.spacing().interact_size.y;
    ui.set_row_height(height);
}

/// Adds a slider, in a new row if it does not fit: unlike other controls, sliders do not wrap by themselves.
fn slide(ui: &mut Ui, slider: Slider<'_>) -> Response {
    if ui.available_size_before_wrap().x < SLIDER {
        row(ui);
    }
    ui.add(slider)
}

fn modes(ui: &mut Ui, state: &State, actions: &mut Vec<Action>) {
    let settings = &state.settings;
    actions.extend(choose(ui, "mode", &Mode::ALL, state.first_mode(), Mode::label).map(Action::Mode));
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
    actions.extend(choose(ui, "second mode", &Mode::ALL, settings.second, Mode::label).map(Action::Second));
    if settings.arrangement == Arrangement::Difference {
        let mut amplify = settings.amplify;
        let slider =
            Slider::new(&mut amplify, ViewSettings::AMPLIFICATIONS).logarithmic(true).max_decimals(0);
        if slide(ui, slider.prefix("x ")).on_hover_text("Amplification of the difference (A)").changed() {
            actions.push(Action::Amplify(amplify));
        }
    }
}

fn picture(ui: &mut Ui, settings: &ViewSettings, actions: &mut Vec<Action>) {
    actions.extend(choose_named(ui, "background", settings.background).map(Action::Background));
    let mut exposure = settings.exposure;
    let slider = Slider::new(&mut exposure, ViewSettings::EXPOSURES)
        .custom_formatter(|value, _| numbers::stops(value))
        .custom_parser(|text| text.trim_end_matches("stops").trim().parse().ok());
    let slider = slide(ui, slider).on_hover_text("Exposure (E, Shift E, 0)");
    if slider.changed() {
        actions.push(Action::Expose(exposure));
    }
    actions.extend(choose_named(ui, "tone curve", settings.tone).map(Action::Tone));
}

/// The buttons on the right; the last comes first if they are laid out from the right.
fn panels(ui: &mut Ui, state: &State, from_right: bool, actions: &mut Vec<Action>) {
    let settings = &state.settings;
    let mut buttons = [
        (false, "screenshot", "Save the picture as a file (P)", Action::Screenshot),
        (settings.lists, "lists", "Environments, materials, meshes (L)", Action::ToggleLists),
        (
            settings.inspector,
            "inspector",
            "Statistics of the scene, if there is room for them (I)",
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

/// A drop-down list of the values of a setting. Returns a new choice.
fn choose_named<T: Named>(ui: &mut Ui, name: &str, now: T) -> Option<T> {
    choose(ui, name, T::ALL, now, T::name)
}

/// A drop-down list. Returns a new choice.
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
