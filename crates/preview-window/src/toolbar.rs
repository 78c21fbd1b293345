//! The toolbar above the picture: modes, background, exposure and tone curve, in one row. What has no room in
//! a narrow window is in a menu.

use eframe::egui::containers::menu::{MenuButton, MenuConfig};
use eframe::egui::{Align, Button, ComboBox, Layout, PopupCloseBehavior, Slider, TextWrapMode, Ui};

use crate::inspector::missing;
use crate::numbers;
use crate::state::{Action, State};
use preview::{Arrangement, Mode, Named, ViewSettings};

pub(crate) fn toolbar(ui: &mut Ui, state: &State, actions: &mut Vec<Action>) {
    ui.style_mut().wrap_mode = Some(TextWrapMode::Extend);
    ui.horizontal(|ui| {
        modes(ui, state, actions);
        let parts: Vec<Part> =
            Part::ALL.into_iter().filter(|part| part.is_of(state.settings.arrangement)).collect();
        let all: f32 = parts.iter().map(|part| part.width()).sum();
        let mut room = ui.available_width();
        if all > room {
            room -= MENU;
        }
        let fitting = parts.iter().take_while(|part| {
            room -= part.width();
            room >= 0.0
        });
        let (shown, hidden) = parts.split_at(fitting.count());
        for part in shown {
            part.draw(ui, state, Place::Row, actions);
        }
        if !hidden.is_empty() {
            ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
                let stays = MenuConfig::new().close_behavior(PopupCloseBehavior::CloseOnClickOutside);
                MenuButton::new("more").config(stays).ui(ui, |ui| {
                    for part in hidden {
                        part.draw(ui, state, Place::Menu, actions);
                    }
                });
            });
        }
    });
}

/// The width of the button of the menu.
const MENU: f32 = 60.0;

/// A part of the toolbar that moves into the menu if there is no room for it.
#[derive(Clone, Copy)]
enum Part {
    Second,
    Amplification,
    Exposure,
    Background,
    Tone,
    Panels,
}

/// Where a part is drawn.
#[derive(Clone, Copy, PartialEq)]
enum Place {
    Row,
    Menu,
}

impl Part {
    /// The parts in the order in which they have room.
    const ALL: [Self; 6] =
        [Self::Second, Self::Amplification, Self::Exposure, Self::Background, Self::Tone, Self::Panels];

    fn is_of(self, arrangement: Arrangement) -> bool {
        match self {
            Self::Second => arrangement != Arrangement::One,
            Self::Amplification => arrangement == Arrangement::Difference,
            _ => true,
        }
    }

    /// The most that the part takes, with the space beside it.
    fn width(self) -> f32 {
        match self {
            Self::Second => 180.0,
            Self::Amplification | Self::Exposure => 228.0,
            Self::Background | Self::Tone => 128.0,
            Self::Panels => 300.0,
        }
    }

    fn draw(self, ui: &mut Ui, state: &State, place: Place, actions: &mut Vec<Action>) {
        let settings = &state.settings;
        match self {
            Self::Second => {
                let chosen = choose_mode(ui, "second mode", place, state, settings.second);
                actions.extend(chosen.map(Action::Second));
            }
            Self::Amplification => {
                let mut amplify = settings.amplify;
                let slider =
                    Slider::new(&mut amplify, ViewSettings::AMPLIFICATIONS).logarithmic(true).max_decimals(0);
                let slider = ui.add(slider.prefix("x "));
                if slider.on_hover_text("Amplification of the difference (A)").changed() {
                    actions.push(Action::Amplify(amplify));
                }
            }
            Self::Exposure => {
                let mut exposure = settings.exposure;
                let slider = Slider::new(&mut exposure, ViewSettings::EXPOSURES)
                    .custom_formatter(|value, _| numbers::stops(value))
                    .custom_parser(|text| text.trim_end_matches("stops").trim().parse().ok());
                if ui.add(slider).on_hover_text("Exposure (E, Shift E, 0)").changed() {
                    actions.push(Action::Expose(exposure));
                }
            }
            Self::Background => {
                let chosen = choose_named(ui, "background", place, settings.background);
                actions.extend(chosen.map(Action::Background));
            }
            Self::Tone => {
                actions.extend(choose_named(ui, "tone curve", place, settings.tone).map(Action::Tone));
            }
            Self::Panels => panels(ui, state, place, actions),
        }
    }
}

fn modes(ui: &mut Ui, state: &State, actions: &mut Vec<Action>) {
    actions.extend(choose_mode(ui, "mode", Place::Row, state, state.first_mode()).map(Action::Mode));
    for (arrangement, name, explained) in [
        (Arrangement::One, "one", "One mode"),
        (Arrangement::Split, "split", "Two modes side by side (S)"),
        (Arrangement::Difference, "difference", "The absolute difference of two modes (D)"),
    ] {
        let button = Button::selectable(state.settings.arrangement == arrangement, name);
        if ui.add(button).on_hover_text(explained).clicked() {
            actions.push(Action::Arrange(arrangement));
        }
    }
}

/// The buttons of panels: on the right of the row, the last one first, or below each other in the menu.
fn panels(ui: &mut Ui, state: &State, place: Place, actions: &mut Vec<Action>) {
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
    if place == Place::Row {
        buttons.reverse();
    }
    let add = |ui: &mut Ui| {
        for (on, name, explained, action) in buttons {
            if ui.add(Button::selectable(on, name)).on_hover_text(explained).clicked() {
                actions.push(action);
            }
        }
    };
    match place {
        Place::Menu => add(ui),
        Place::Row => {
            ui.with_layout(Layout::right_to_left(Align::Center), add);
        }
    }
}

/// A drop-down list of modes, in which those that the scene does not offer are grey.
fn choose_mode(ui: &mut Ui, name: &str, place: Place, state: &State, now: Mode) -> Option<Mode> {
    let missing = |mode| state.shown.as_ref().and_then(|shown| missing(&shown.scene, mode));
    choose(ui, name, place, &Mode::ALL, now, Mode::label, missing)
}

/// A drop-down list of the values of a setting. Returns a new choice.
fn choose_named<T: Named>(ui: &mut Ui, name: &str, place: Place, now: T) -> Option<T> {
    choose(ui, name, place, T::ALL, now, T::name, |_| None)
}

/// A drop-down list, or in the menu a menu of its own. What is missing for a value makes it grey. Returns a
/// new choice.
fn choose<T: Copy + PartialEq>(
    ui: &mut Ui,
    name: &str,
    place: Place,
    all: &[T],
    now: T,
    label: impl Fn(T) -> &'static str,
    missing: impl Fn(T) -> Option<&'static str>,
) -> Option<T> {
    let mut chosen = now;
    let entries = |ui: &mut Ui| {
        for &one in all {
            let why = missing(one);
            let entry = ui.add_enabled(why.is_none(), Button::selectable(one == now, label(one)));
            if entry.on_disabled_hover_text(why.unwrap_or_default()).clicked() {
                chosen = one;
            }
        }
    };
    let capital = name[..1].to_uppercase() + &name[1..];
    match place {
        Place::Row => {
            let list = ComboBox::from_id_salt(name).width(104.0).selected_text(label(now));
            list.show_ui(ui, entries).response.on_hover_text(capital);
        }
        Place::Menu => {
            ui.menu_button(capital, entries);
        }
    }
    (chosen != now).then_some(chosen)
}
