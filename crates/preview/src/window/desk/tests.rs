//! The desk without a window: what is drawn, and what input does to it.

use std::time::Duration;

use eframe::egui::{FullOutput, Key, Modifiers, PointerButton, Pos2, RawInput, Shape, ViewportId, pos2};

use super::*;
use crate::window::keys::{POINTER, bindings};
use crate::window::settings::Arrangement;
use crate::window::state::{Effect, List};
use crate::window::{Catalogue, Export, Facts, News, Subject, Wish, testkit, theme};
use crate::{Cpu, Mode};

/// A window that is none.
struct Session {
    context: Context,
    state: State,
    judge: Judge,
    pointer: Pointer,
    size: [f32; 2],
    refused: Option<RenderError>,
    effects: Vec<Effect>,
}

/// What was drawn in a frame.
struct Drawn {
    texts: Vec<(String, Rect)>,
    /// When there is something to draw again.
    again: Duration,
    picture: [u32; 2],
}

impl Drawn {
    fn has(&self, text: &str) -> bool {
        self.texts.iter().any(|(drawn, _)| drawn.contains(text))
    }

    fn place(&self, text: &str) -> Pos2 {
        let found = self.texts.iter().find(|(drawn, _)| drawn == text);
        found.unwrap_or_else(|| panic!("{text} is not drawn: {:?}", self.texts)).1.center()
    }
}

impl Session {
    fn new(size: [f32; 2]) -> Self {
        let context = Context::default();
        theme::set(&context);
        let names = |names: &[&str]| names.iter().map(ToString::to_string).collect();
        let mut state = State::new(None, Wish::default());
        state.hear(
            News::Catalogue(Catalogue {
                environments: names(&["beach", "studio"]),
                materials: names(&["chrome", "gold"]),
                meshes: names(&["sphere", "plane"]),
            }),
            0.0,
        );
        let subject = state.settings.subject.clone();
        let facts = Facts {
            exports: vec![Export { name: "export-shrm, ktx2".into(), bytes: 1_230_000 }],
            notes: vec!["gold was cut".into()],
        };
        state.hear(News::Scene { subject, scene: testkit::scene(), facts }, 0.0);
        let judge = Judge::new(Box::new(Cpu::new()), || ()).unwrap();
        Self { context, state, judge, pointer: Pointer::default(), size, refused: None, effects: Vec::new() }
    }

    /// Draws a frame with these events, and does what they do.
    fn frame(&mut self, events: Vec<Event>) -> Drawn {
        let size = self.size.into();
        let input = RawInput {
            screen_rect: Some(Rect::from_min_size(Pos2::ZERO, size)),
            events,
            ..RawInput::default()
        };
        let (mut actions, mut picture) = (Vec::new(), [0; 2]);
        let Self { context, state, judge, pointer, refused, .. } = self;
        let output: FullOutput = context.run_ui(input, |ui| {
            actions = pressed(ui.ctx());
            let desk = Desk { state, judge, seen: None, refused: refused.as_ref(), adapter: "adapter" };
            picture = desk.draw(ui, pointer, &mut actions);
        });
        self.effects.extend(actions.into_iter().filter_map(|action| self.state.update(action)));
        let mut texts = Vec::new();
        for clipped in &output.shapes {
            gather(&clipped.shape, &mut texts);
        }
        let again = output.viewport_output[&ViewportId::ROOT].repaint_delay;
        output.drop_without_applying_deltas();
        Drawn { texts, again, picture }
    }

    /// Draws until it stays the same.
    fn settle(&mut self) -> Drawn {
        for _ in 0..4 {
            self.frame(Vec::new());
        }
        self.frame(Vec::new())
    }

    fn press(&mut self, key: Key, modifiers: Modifiers) {
        let event = |pressed| Event::Key { key, physical_key: Some(key), pressed, repeat: false, modifiers };
        self.frame(vec![event(true), event(false)]);
    }

    fn click(&mut self, text: &str) {
        let at = self.settle().place(text);
        let button = |pressed| {
            let (button, modifiers) = (PointerButton::Primary, Modifiers::NONE);
            Event::PointerButton { pos: at, button, pressed, modifiers }
        };
        self.frame(vec![Event::PointerMoved(at)]);
        self.frame(vec![button(true)]);
        self.frame(vec![button(false)]);
    }
}

fn gather(shape: &Shape, texts: &mut Vec<(String, Rect)>) {
    match shape {
        Shape::Vec(shapes) => shapes.iter().for_each(|shape| gather(shape, texts)),
        Shape::Text(text) => texts.push((text.galley.text().to_owned(), shape.visual_bounding_rect())),
        _ => {}
    }
}

#[test]
fn a_click_in_a_list_asks_for_its_subject() {
    let mut session = Session::new([1280.0, 800.0]);
    session.click("gold");
    let wanted = Subject { environment: "beach".into(), material: "gold".into(), mesh: "sphere".into() };
    assert_eq!(session.effects, [Effect::Show(wanted)]);
    assert!(session.settle().has("loading beach, gold, sphere"));
}

#[test]
fn every_key_of_the_table_does_its_action() {
    let mut session = Session::new([1280.0, 800.0]);
    let first = session.state.clone();
    for binding in bindings() {
        session.state = first.clone();
        session.effects.clear();
        let mut expected = session.state.clone();
        let effect = expected.update(binding.action.clone());
        let chord = binding.chord;
        let held =
            Modifiers { shift: chord.shift, command: chord.command, ctrl: chord.command, ..Modifiers::NONE };
        session.press(chord.key, held);
        assert_eq!(session.state.settings, expected.settings, "{}", binding.name);
        assert_eq!(session.state.help, expected.help, "{}", binding.name);
        assert_eq!(session.effects, Vec::from_iter(effect), "{}", binding.name);
    }
}

#[test]
fn the_help_lists_every_key_and_what_the_pointer_does() {
    let mut session = Session::new([1600.0, 1400.0]);
    session.press(Key::Questionmark, Modifiers::SHIFT);
    let drawn = session.settle();
    for binding in bindings() {
        assert!(drawn.has(&binding.chord.name()) && drawn.has(&binding.name), "{}", binding.name);
    }
    for (what, does) in POINTER {
        assert!(drawn.has(what) && drawn.has(does), "{what}");
    }
    session.press(Key::Escape, Modifiers::NONE);
    assert!(!session.settle().has("this help"));
}

#[test]
fn a_failure_lies_over_the_picture_and_leaves_it_its_place() {
    let mut session = Session::new([1280.0, 800.0]);
    let before = session.settle().picture;
    session.state.hear(News::Failure(Some(vec!["gold.toml:3: unknown key".into()])), 0.0);
    let drawn = session.settle();
    assert!(drawn.has("gold.toml:3: unknown key"));
    assert_eq!(drawn.picture, before);
    session.click("aside");
    let aside = session.settle();
    assert!(aside.has("failed: gold.toml:3: unknown key (W)"));
    session.press(Key::W, Modifiers::NONE);
    assert!(session.settle().has("This did not work"));
}

#[test]
fn the_inspector_tells_what_is_known_and_dots_until_then() {
    let mut session = Session::new([1280.0, 1400.0]);
    let drawn = session.settle();
    for text in ["export-shrm, ktx2", "1.23 MB", "gold was cut", "sRGB, 8 bits", "...", "local SHRM"] {
        assert!(drawn.has(text), "{text}: {:?}", drawn.texts);
    }
    session.press(Key::I, Modifiers::NONE);
    assert!(!session.settle().has("1.23 MB"));
}

#[test]
fn without_panels_the_picture_fills_the_width() {
    let mut session = Session::new([1280.0, 800.0]);
    assert!(session.settle().picture[0] < 1280);
    session.press(Key::H, Modifiers::NONE);
    assert_eq!(session.settle().picture[0], 1280);
}

#[test]
fn a_drag_on_the_picture_turns_the_camera_and_one_on_a_list_does_not() {
    let drag = |from: Pos2, button| {
        let press = |pos, pressed| Event::PointerButton { pos, button, pressed, modifiers: Modifiers::NONE };
        let to = from + vec2(30.0, 0.0);
        vec![Event::PointerMoved(from), press(from, true), Event::PointerMoved(to), press(to, false)]
    };
    let mut session = Session::new([1280.0, 800.0]);
    session.settle();
    let first = session.state.settings.clone();
    session.frame(drag(pos2(60.0, 400.0), PointerButton::Primary));
    assert_eq!(session.state.settings, first);
    session.frame(drag(pos2(500.0, 400.0), PointerButton::Primary));
    assert_ne!(session.state.settings.camera, first.camera);
    session.frame(drag(pos2(500.0, 400.0), PointerButton::Secondary));
    assert_ne!(session.state.settings.light, first.light);
}

#[test]
fn nothing_is_drawn_again_when_nothing_changes() {
    let mut session = Session::new([1280.0, 800.0]);
    assert_eq!(session.settle().again, Duration::MAX);
    session.state.hear(News::Failure(Some(vec!["no".into()])), 0.0);
    session.state.toast("kept".into(), vec!["there".into()], 0.0);
    session.state.update(Action::ToggleHelp);
    session.state.update(Action::Arrange(Arrangement::Difference));
    assert_eq!(session.settle().again, Duration::MAX);
}

#[test]
fn every_size_and_state_can_be_drawn() {
    for size in [[1.0, 1.0], [120.0, 90.0], [480.0, 320.0], [6000.0, 4000.0]] {
        let mut session = Session::new(size);
        session.settle();
        for action in [
            Action::Second(Mode::BruteForce),
            Action::Toggle(Arrangement::Difference),
            Action::ToggleHelp,
            Action::Step(List::Materials, 1),
            Action::TogglePanels,
        ] {
            session.state.update(action);
            session.settle();
        }
        session.refused = Some(RenderError::maps("too large"));
        session.state.hear(News::Failure(Some(vec!["a long line ".repeat(50); 40])), 0.0);
        session.settle();
        session.state.hear(News::Catalogue(Catalogue::default()), 0.0);
        let drawn = session.settle();
        assert!(drawn.picture[0] > 0 && drawn.picture[1] > 0);
    }
}

#[test]
fn edges_of_the_picture_lie_between_pixels() {
    let area = Rect::from_min_max(pos2(10.3, 20.0), pos2(110.9, 60.2));
    let (rect, size) = pixels(area, 1.5);
    assert_eq!(size, [150, 60]);
    assert!((rect.min.x * 1.5 - 16.0).abs() < 1e-4 && (rect.max.y * 1.5 - 90.0).abs() < 1e-4);
    assert_eq!(pixels(Rect::NOTHING, 1.0).1, [1, 1]);
}
