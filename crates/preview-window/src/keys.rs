//! The table of key bindings, from which the help is drawn and in which input is looked up.

use std::sync::LazyLock;

use eframe::egui::{Key, Modifiers};

use crate::state::Action;
use preview::List;
use preview::Mode;
use preview::{Aim, Arrangement};

/// A key with its modifiers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) struct Chord {
    pub(crate) key: Key,
    pub(crate) shift: bool,
    pub(crate) command: bool,
}

#[derive(Clone, Debug)]
pub(crate) struct Binding {
    pub(crate) chord: Chord,
    /// The heading of the binding in the help.
    pub(crate) group: &'static str,
    /// The description of the binding in the help.
    pub(crate) name: String,
    pub(crate) action: Action,
}

/// The pointer's actions, for the help.
pub(crate) const POINTER: [(&str, &str); 7] = [
    ("left drag", "turn the camera"),
    ("right drag, or with Shift", "turn the light"),
    ("the same on a circular light", "move it"),
    ("wheel", "zoom"),
    ("drag the divider", "move the split"),
    ("double click", "reset the camera"),
    ("Tab", "next control"),
];

impl Chord {
    const fn plain(key: Key) -> Self {
        Self { key, shift: false, command: false }
    }

    const fn shift(key: Key) -> Self {
        Self { shift: true, ..Self::plain(key) }
    }

    const fn command(key: Key) -> Self {
        Self { command: true, ..Self::plain(key) }
    }

    const fn command_shift(key: Key) -> Self {
        Self { command: true, ..Self::shift(key) }
    }

    /// The chord's name in the help.
    pub(crate) fn name(self) -> String {
        let key = match self.key {
            Key::ArrowLeft => "left",
            Key::ArrowRight => "right",
            Key::ArrowUp => "up",
            Key::ArrowDown => "down",
            Key::Comma => "comma",
            Key::Period => "period",
            Key::Questionmark => "?",
            Key::Minus => "-",
            Key::Equals => "=",
            Key::OpenBracket => "[",
            key => key.name(),
        };
        let command = if cfg!(target_os = "macos") { "Cmd " } else { "Ctrl " };
        let held = [(self.command, command), (self.shift, "Shift ")];
        held.into_iter().filter(|(held, _)| *held).map(|(_, name)| name).collect::<String>() + key
    }

    /// Whether a press is this chord. Keys are found by their letter, `?` with or without Shift. Digits and
    /// the keys after them are found by their place as well, because with Shift, and on French keyboards
    /// without it, they type another character.
    fn is(self, key: Key, place: Option<Key>, held: Modifiers) -> bool {
        let by_place = MODE_KEYS.contains(&self.key) || self.key == Key::Num0;
        (self.key == key || by_place && place == Some(self.key))
            && self.command == held.command
            && !held.alt
            && (self.shift == held.shift || self.key == Key::Questionmark)
    }
}

/// The action of a key press: by the key's letter, its place if that is known, and the modifiers.
pub(crate) fn action(key: Key, place: Option<Key>, held: Modifiers) -> Option<&'static Action> {
    // On German keyboards `?` is at the place of `-`: what a key types comes before its place.
    let find = |place| bindings().iter().find(|binding| binding.chord.is(key, place, held));
    find(None).or_else(|| find(place)).map(|binding| &binding.action)
}

/// Whether an action repeats while its key is held down.
pub(crate) fn repeats(action: &Action) -> bool {
    matches!(
        action,
        Action::Orbit(_)
            | Action::TurnLight(_)
            | Action::ZoomBy(_)
            | Action::ExposeBy(_)
            | Action::MoveDivider(_)
            | Action::Step(..)
    )
}

/// Whether a key belongs to the focused widget, if there is one.
pub(crate) fn is_of_widgets(key: Key) -> bool {
    matches!(key, Key::ArrowLeft | Key::ArrowRight | Key::ArrowUp | Key::ArrowDown)
}

/// Every key, in the order of the help.
pub(crate) fn bindings() -> &'static [Binding] {
    static TABLE: LazyLock<Vec<Binding>> = LazyLock::new(table);
    &TABLE
}

/// The keys of the modes; `0` between them resets the exposure.
const MODE_KEYS: [Key; Mode::ALL.len()] = [
    Key::Num1,
    Key::Num2,
    Key::Num3,
    Key::Num4,
    Key::Num5,
    Key::Num6,
    Key::Num7,
    Key::Num8,
    Key::Num9,
    Key::Minus,
    Key::Equals,
    Key::OpenBracket,
    Key::CloseBracket,
];

/// The angle of one press: 5 degrees.
const TURN: f64 = std::f64::consts::PI / 36.0;

#[rustfmt::skip]
fn table() -> Vec<Binding> {
    use Chord as C;
    let turn = |yaw: f64, pitch: f64| Aim { yaw: yaw * TURN, pitch: pitch * TURN };
    let mut table = Vec::new();
    let mut add = |group: &'static str, chord: Chord, name: &str, action: Action| {
        table.push(Binding { chord, group, name: name.to_owned(), action });
    };
    for (key, mode) in MODE_KEYS.into_iter().zip(Mode::ALL) {
        add("Mode", C::plain(key), mode.label(), Action::Mode(mode));
    }
    for (key, mode) in MODE_KEYS.into_iter().zip(Mode::ALL) {
        add("Mode", C::shift(key), mode.label(), Action::Second(mode));
    }
    let group = "Comparison";
    add(group, C::plain(Key::S), "split", Action::Toggle(Arrangement::Split));
    add(group, C::plain(Key::D), "difference", Action::Toggle(Arrangement::Difference));
    add(group, C::plain(Key::X), "swap both modes", Action::Swap);
    add(group, C::plain(Key::Comma), "move the divider left", Action::MoveDivider(-0.05));
    add(group, C::plain(Key::Period), "move the divider right", Action::MoveDivider(0.05));
    add(group, C::plain(Key::A), "amplify twice as much", Action::AmplifyBy(1));
    add(group, C::shift(Key::A), "amplify half as much", Action::AmplifyBy(-1));
    let group = "Subject";
    add(group, C::plain(Key::N), "next environment", Action::Step(List::Environments, 1));
    add(group, C::shift(Key::N), "previous environment", Action::Step(List::Environments, -1));
    add(group, C::plain(Key::M), "next material", Action::Step(List::Materials, 1));
    add(group, C::shift(Key::M), "previous material", Action::Step(List::Materials, -1));
    add(group, C::plain(Key::G), "next mesh", Action::Step(List::Meshes, 1));
    add(group, C::shift(Key::G), "previous mesh", Action::Step(List::Meshes, -1));
    add(group, C::plain(Key::Backspace), "back from dropped files", Action::ReturnFromDropped);
    let group = "Picture";
    add(group, C::plain(Key::E), "a third of a stop brighter", Action::ExposeBy(1.0 / 3.0));
    add(group, C::shift(Key::E), "a third of a stop darker", Action::ExposeBy(-1.0 / 3.0));
    add(group, C::plain(Key::Num0), "exposure 0", Action::Expose(0.0));
    add(group, C::plain(Key::T), "next tone curve", Action::NextTone);
    add(group, C::plain(Key::B), "next background", Action::StepBackground(1));
    add(group, C::shift(Key::B), "previous background", Action::StepBackground(-1));
    add(group, C::plain(Key::P), "save a screenshot", Action::Screenshot);
    let group = "Camera";
    add(group, C::plain(Key::ArrowLeft), "turn left", Action::Orbit(turn(-1.0, 0.0)));
    add(group, C::plain(Key::ArrowRight), "turn right", Action::Orbit(turn(1.0, 0.0)));
    add(group, C::plain(Key::ArrowUp), "higher", Action::Orbit(turn(0.0, 1.0)));
    add(group, C::plain(Key::ArrowDown), "lower", Action::Orbit(turn(0.0, -1.0)));
    add(group, C::plain(Key::Z), "zoom in", Action::ZoomBy(1.25));
    add(group, C::shift(Key::Z), "zoom out", Action::ZoomBy(0.8));
    add(group, C::plain(Key::Home), "reset the camera", Action::ResetCamera);
    let group = "Light";
    add(group, C::shift(Key::ArrowLeft), "yaw", Action::TurnLight(turn(-1.0, 0.0)));
    add(group, C::shift(Key::ArrowRight), "yaw", Action::TurnLight(turn(1.0, 0.0)));
    add(group, C::shift(Key::ArrowUp), "pitch", Action::TurnLight(turn(0.0, -1.0)));
    add(group, C::shift(Key::ArrowDown), "pitch", Action::TurnLight(turn(0.0, 1.0)));
    add(group, C::shift(Key::Home), "reset the light", Action::ResetLight);
    add(group, C::command_shift(Key::S), "write the light", Action::SaveLight);
    let group = "Material";
    add(group, C::command(Key::S), "save the material", Action::SaveMaterial);
    add(group, C::command(Key::Z), "undo", Action::Undo);
    add(group, C::command_shift(Key::Z), "redo", Action::Redo);
    add(group, C::command(Key::R), "revert to the file", Action::Revert);
    let group = "Window";
    add(group, C::plain(Key::L), "lists", Action::ToggleLists);
    add(group, C::plain(Key::I), "inspector", Action::ToggleInspector);
    add(group, C::plain(Key::H), "both panels", Action::TogglePanels);
    add(group, C::plain(Key::F), "full screen", Action::ToggleFullscreen);
    add(group, C::plain(Key::Questionmark), "this help", Action::ToggleHelp);
    add(group, C::plain(Key::F1), "this help", Action::ToggleHelp);
    add(group, C::plain(Key::Escape), "close what is over the picture", Action::Dismiss);
    add(group, C::plain(Key::W), "show the failure again", Action::ShowFailure);
    add(group, C::command(Key::Q), "close", Action::Close);
    table
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;
    use envmap::ToneMap;
    use preview::Background;

    const HELD: Modifiers = Modifiers::NONE;

    #[test]
    fn the_manual_names_every_key() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/preview.md");
        let manual = std::fs::read_to_string(path).unwrap();
        for Binding { chord, name, .. } in bindings() {
            let key = match chord.key {
                Key::ArrowLeft | Key::ArrowRight | Key::ArrowUp | Key::ArrowDown => "arrows".into(),
                key if MODE_KEYS.contains(&key) => "`1` ... `9`, `-`, `=`, `[`".into(),
                Key::Comma | Key::Period => "`,` `.`".into(),
                _ => format!("`{}`", Chord::plain(chord.key).name()),
            };
            let is_named = |line: &str| line.contains(&key) && (!chord.shift || line.contains("Shift"));
            assert!(manual.lines().any(is_named), "docs/preview.md names {} ({name})", chord.name());
        }
    }

    #[test]
    fn no_chord_does_two_things() {
        for (at, binding) in bindings().iter().enumerate() {
            let other = bindings()[..at].iter().find(|before| before.chord == binding.chord);
            assert!(other.is_none(), "{}: {} and {other:?}", binding.chord.name(), binding.name);
            assert!(!binding.name.is_empty() && !binding.chord.name().is_empty());
        }
    }

    #[test]
    fn every_chord_is_found_by_its_own_press_only() {
        for binding in bindings() {
            let Chord { key, shift, command } = binding.chord;
            let held = Modifiers { shift, command, ctrl: command, ..HELD };
            assert_eq!(action(key, Some(key), held), Some(&binding.action), "{}", binding.name);
            assert_eq!(action(key, None, held), Some(&binding.action), "{}", binding.name);
            assert_eq!(action(key, None, Modifiers { alt: true, ..held }), None, "{}", binding.name);
        }
        assert_eq!(action(Key::Y, None, HELD), None);
    }

    /// X11 and others send this for Shift+1 on American keyboards, and for ? on American and German ones.
    #[test]
    fn shifted_digits_are_found_by_their_place_and_letters_by_their_letter() {
        let shift = Modifiers { shift: true, ..HELD };
        assert_eq!(action(Key::Exclamationmark, Some(Key::Num1), shift), Some(&Action::Second(Mode::ALL[0])));
        assert_eq!(action(Key::Questionmark, Some(Key::Slash), shift), Some(&Action::ToggleHelp));
        assert_eq!(action(Key::Questionmark, Some(Key::Minus), shift), Some(&Action::ToggleHelp));
        assert_eq!(action(Key::Q, Some(Key::A), HELD), None, "a French keyboard has Q where others have A");
    }

    /// One action of each kind. The kinds that only the pointer causes share a name with that of a key. The
    /// match is exhaustive, so that a new kind cannot be forgotten.
    #[test]
    fn every_action_of_the_pointer_has_a_key() {
        let name = |action: &Action| match action {
            Action::Choose(..) | Action::Step(..) => "step",
            Action::Mode(_) => "mode",
            Action::Second(_) => "second",
            Action::Swap => "swap",
            Action::Arrange(_) | Action::Toggle(_) => "toggle",
            Action::Divider(_) | Action::MoveDivider(_) => "divider",
            Action::Amplify(_) | Action::AmplifyBy(_) => "amplify",
            Action::Background(_) | Action::StepBackground(_) => "background",
            Action::Expose(_) => "expose",
            Action::ExposeBy(_) => "expose by",
            Action::Tone(_) | Action::NextTone => "tone",
            Action::TurnLight(_) | Action::MoveDisk(..) => "light",
            Action::ResetLight => "reset light",
            Action::SaveLight => "save light",
            Action::Orbit(_) => "orbit",
            Action::ZoomBy(_) => "zoom",
            Action::ResetCamera => "reset camera",
            Action::SaveMaterial => "save",
            Action::Undo => "undo",
            Action::Redo => "redo",
            Action::Revert => "revert",
            // Controls of the inspector, which Tab reaches, have keys of their own.
            Action::SetParameter(..) | Action::EndDrag | Action::LoadFile | Action::KeepValues => "control",
            // Buttons of a dialog have the keyboard.
            Action::Answer(_) => "control",
            Action::ToggleLists => "lists",
            Action::ToggleInspector => "inspector",
            Action::TogglePanels => "panels",
            Action::ToggleHelp => "help",
            Action::ToggleFullscreen => "full screen",
            Action::Dismiss | Action::HideFailure => "dismiss",
            Action::ShowFailure => "failure",
            Action::Screenshot => "screenshot",
            Action::Drop(_) => "drop",
            Action::ReturnFromDropped => "return",
            Action::Close => "close",
        };
        let by_key: BTreeSet<&str> = bindings().iter().map(|binding| name(&binding.action)).collect();
        let aim = Aim::default();
        let all = [
            Action::Choose(List::Meshes, String::new()),
            Action::Mode(Mode::Mirror),
            Action::Second(Mode::Mirror),
            Action::Swap,
            Action::Arrange(Arrangement::One),
            Action::Divider(0.5),
            Action::Amplify(1.0),
            Action::Background(Background::Harmonics),
            Action::Expose(0.0),
            Action::ExposeBy(1.0),
            Action::Tone(ToneMap::Plain),
            Action::TurnLight(aim),
            Action::MoveDisk(0, sphere::Direction::Z),
            Action::ResetLight,
            Action::SaveLight,
            Action::Orbit(aim),
            Action::ZoomBy(2.0),
            Action::ResetCamera,
            Action::SaveMaterial,
            Action::Undo,
            Action::Redo,
            Action::Revert,
            Action::ToggleLists,
            Action::ToggleInspector,
            Action::TogglePanels,
            Action::ToggleHelp,
            Action::ToggleFullscreen,
            Action::Dismiss,
            Action::HideFailure,
            Action::ShowFailure,
            Action::Screenshot,
            Action::ReturnFromDropped,
            Action::Close,
        ];
        assert_eq!(by_key, all.iter().map(name).collect());
        for list in List::ALL {
            assert!(bindings().iter().any(|binding| binding.action == Action::Step(list, 1)), "{list:?}");
        }
        for mode in Mode::ALL {
            for action in [Action::Mode(mode), Action::Second(mode)] {
                assert!(bindings().iter().any(|binding| binding.action == action), "{action:?}");
            }
        }
    }
}
