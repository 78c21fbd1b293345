//! The panels without a window: what is drawn, and what input does.

mod dialog;
mod layout;

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use eframe::egui::{
    Context, DroppedFile, DroppedFileHandle, Event, FullOutput, HoveredFile, Id, Key, Modifiers,
    PointerButton, Pos2, RawInput, Shape, ViewportId, pos2,
};

use brdf::Value;

use super::*;
use crate::keyboard::Keyboard;
use crate::keys::{POINTER, bindings};
use crate::material_editor::MaterialEditor;
use crate::renderer_adapter::FrameImage;
use crate::state::Effect;
use crate::{testkit, theme};
use preview::{
    Aim, Arrangement, Catalog, Cpu, Export, FormSection, InitialView, List, MaterialForm, Mode, Picture,
    PreviewUpdate, Subject, SubjectDetails, ViewSettings,
};

/// A window's panels without a window.
struct Session {
    context: Context,
    state: State,
    error_meter: ErrorMeter,
    pointer: Pointer,
    size: [f32; 2],
    /// The picture on the screen.
    shown: Option<RenderedFrame>,
    keyboard: Keyboard,
    render_error: Option<RenderError>,
    effects: Vec<Effect>,
}

/// The contents of a frame.
struct Drawn {
    texts: Vec<(String, Rect)>,
    /// When the next frame is due.
    repaint_after: Duration,
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
        let mut state = State::new(InitialView::default());
        state.apply(PreviewUpdate::Catalog(Catalog {
            environments: names(&["beach", "studio"]),
            materials: names(&["chrome", "gold"]),
            meshes: names(&["sphere", "plane"]),
            pairs: [(0, 0), (0, 1), (1, 0), (1, 1)].into(),
        }));
        let subject = state.settings.subject.clone();
        let details = SubjectDetails {
            exports: vec![Export { name: "export-shrm, ktx2".into(), bytes: 1_230_000 }],
            notes: vec!["gold was cut".into()],
        };
        state.apply(PreviewUpdate::Scene { subject, scene: testkit::scene(), details });
        let error_meter = ErrorMeter::new(Box::new(Cpu::new()), || ()).unwrap();
        Self {
            context,
            state,
            error_meter,
            pointer: Pointer::default(),
            size,
            shown: None,
            keyboard: Keyboard::default(),
            render_error: None,
            effects: Vec::new(),
        }
    }

    /// A window with the picture of its settings.
    fn with_picture(size: [f32; 2]) -> Self {
        let mut session = Self::new(size);
        session.show();
        session
    }

    /// Shows the picture of the current settings.
    fn show(&mut self) {
        let shown = self.state.shown.as_ref().unwrap();
        let of = self.state.settings.shot(&shown.scene, shown.framing, [64, 40]).of(&shown.scene);
        let picture = Picture { size: of.size, codes: Vec::new(), radiance: Vec::new(), relative_rms: None };
        self.shown = Some(RenderedFrame {
            image: FrameImage::Codes(Arc::new(picture)),
            size: of.size,
            scene_id: shown.scene_id,
            of,
            full: true,
            seconds: 0.0123,
            renderer: "a pencil".into(),
            fallback_reason: None,
            light_samples: 0,
            unfinished: false,
            relative_rms: Some(0.5),
        });
    }

    /// Draws a frame with these events and carries out their actions.
    fn frame(&mut self, events: Vec<Event>) -> Drawn {
        self.frame_of(RawInput { events, ..RawInput::default() })
    }

    /// Draws a frame with this input and carries out its actions.
    fn frame_of(&mut self, input: RawInput) -> Drawn {
        let screen_rect = Some(Rect::from_min_size(Pos2::ZERO, self.size.into()));
        let input = RawInput { screen_rect, ..input };
        let (mut actions, mut picture) = (Vec::new(), [0; 2]);
        let Self { context, state, error_meter, pointer, shown, keyboard, render_error, .. } = self;
        let output: FullOutput = context.run_ui(input, |ui| {
            actions = keyboard.pressed(ui.ctx());
            let layout = PanelLayout {
                state,
                error_meter,
                frame: shown.as_ref().map(|frame| (TextureId::User(1), frame)),
                is_current: shown.is_some(),
                render_error: render_error.as_ref(),
                adapter_name: "adapter",
            };
            picture = layout.draw(ui, pointer, &mut actions);
        });
        keyboard.end_frame(context);
        self.effects.extend(actions.into_iter().filter_map(|action| self.state.update(action)));
        let mut texts = Vec::new();
        for clipped in &output.shapes {
            collect_texts(&clipped.shape, &mut texts);
        }
        let repaint_after = output.viewport_output[&ViewportId::ROOT].repaint_delay;
        output.drop_without_applying_deltas();
        Drawn { texts, repaint_after, picture }
    }

    /// Draws until the layout is stable.
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
        self.click_at(at);
    }

    fn click_at(&mut self, at: Pos2) {
        let button = |pressed| {
            let (button, modifiers) = (PointerButton::Primary, Modifiers::NONE);
            Event::PointerButton { pos: at, button, pressed, modifiers }
        };
        self.frame(vec![Event::PointerMoved(at)]);
        self.frame(vec![button(true)]);
        self.frame(vec![button(false)]);
    }
}

impl Session {
    fn picture(&self) -> Rect {
        self.context.viewport(|last| last.prev_pass.widgets.get(Id::unique("picture")).unwrap().rect)
    }

    /// The controls above the picture.
    fn controls(&self) -> Vec<Rect> {
        let below = self.picture().top();
        self.context.viewport(|last| {
            let widgets = last.prev_pass.widgets.layers().flat_map(|(_, widgets)| widgets);
            let controls = widgets.filter(|widget| widget.sense.senses_click() || widget.sense.senses_drag());
            controls.map(|widget| widget.rect).filter(|rect| rect.center().y < below).collect()
        })
    }
}

fn collect_texts(shape: &Shape, texts: &mut Vec<(String, Rect)>) {
    match shape {
        Shape::Vec(shapes) => shapes.iter().for_each(|shape| collect_texts(shape, texts)),
        Shape::Text(text) => texts.push((text.galley.text().to_owned(), shape.visual_bounding_rect())),
        _ => {}
    }
}

/// If Shift is released before the key, the key is released with another letter: it is no longer down.
#[test]
fn a_key_released_with_another_letter_is_no_longer_down() {
    let mut session = Session::new([1280.0, 800.0]);
    let event = |key, pressed, modifiers| {
        vec![Event::Key { key, physical_key: Some(Key::Slash), pressed, repeat: false, modifiers }]
    };
    for open in [true, false, true] {
        session.frame(event(Key::Questionmark, true, Modifiers::SHIFT));
        assert_eq!(session.state.help, open);
        session.frame(event(Key::Questionmark, true, Modifiers::SHIFT));
        assert_eq!(session.state.help, open, "the key is held down");
        session.frame(event(Key::Slash, false, Modifiers::NONE));
    }
}

#[test]
fn a_click_in_a_list_requests_its_subject() {
    let mut session = Session::new([1280.0, 800.0]);
    session.click("gold");
    let wanted = Subject { environment: "beach".into(), material: "gold".into(), mesh: "sphere".into() };
    assert_eq!(session.effects, [Effect::Show(wanted)]);
    assert!(session.settle().has("loading beach, gold, sphere"));
}

#[test]
fn every_key_of_the_table_does_its_action_and_each_does_something() {
    /// Everything that a key may change.
    fn changeable(state: &State) -> (ViewSettings, [bool; 5], usize, Option<MaterialEditor>) {
        let State { help, failure_hidden, fullscreen, taking_screenshot, toasts, .. } = state;
        let flags = [*help, *failure_hidden, *fullscreen, *taking_screenshot, state.dialog.is_some()];
        let editor = state.editors["chrome"].clone().ok();
        (state.settings.clone(), flags, toasts.len(), editor)
    }
    let mut session = Session::new([1280.0, 800.0]);
    let mut first = session.state.clone();
    // Nothing has its default value, and there is something to close.
    let aim = Aim { yaw: 1.0, pitch: 0.5 };
    let settings = ViewSettings { light: aim, camera: aim, zoom: 2.0, exposure: 1.0, ..first.settings };
    first.settings = settings;
    first.apply(PreviewUpdate::Failure(Some(vec!["no".into()])));
    first.failure_hidden = true;
    first.toast("saved".into(), Vec::new());
    first.apply(material(4.0));
    for exponent in [5.0, 6.0] {
        first.update(Action::SetParameter(testkit::EXPONENT, Value::Number(exponent)));
        first.update(Action::EndDrag);
    }
    first.update(Action::Undo);
    for binding in bindings() {
        session.state = first.clone();
        let before = changeable(&session.state);
        session.effects.clear();
        let mut expected = session.state.clone();
        let effect = expected.update(binding.action.clone());
        let chord = binding.chord;
        let held =
            Modifiers { shift: chord.shift, command: chord.command, ctrl: chord.command, ..Modifiers::NONE };
        session.press(chord.key, held);
        let after = changeable(&session.state);
        assert_eq!(after, changeable(&expected), "{}", binding.name);
        assert_eq!(session.effects, Vec::from_iter(effect), "{}", binding.name);
        assert!(after != before || !session.effects.is_empty(), "{} does nothing", binding.name);
    }
}

#[test]
fn the_help_lists_every_key_and_what_the_pointer_does() {
    let mut session = Session::with_picture([1280.0, 800.0]);
    session.press(Key::Questionmark, Modifiers::SHIFT);
    let (drawn, picture) = (session.settle(), session.picture());
    let is_whole =
        |text: &str| drawn.texts.iter().any(|(drawn, at)| drawn == text && picture.contains_rect(*at));
    for binding in bindings().iter().filter(|binding| !matches!(binding.action, Action::Second(_))) {
        assert!(is_whole(&binding.chord.name()) && is_whole(&binding.name), "{}", binding.name);
    }
    assert!(is_whole("with Shift") && is_whole("second mode"));
    for (what, does) in POINTER {
        assert!(is_whole(what) && is_whole(does), "{what}");
    }
    session.press(Key::Escape, Modifiers::NONE);
    assert!(!session.settle().has("this help"));
}

#[test]
fn a_failure_covers_the_picture_and_does_not_move_it() {
    let mut session = Session::new([1280.0, 800.0]);
    let before = session.settle().picture;
    let failure = ["the build failed", "gold.toml:3: unknown key"].map(str::to_owned);
    session.state.apply(PreviewUpdate::Failure(Some(failure.into())));
    let drawn = session.settle();
    assert!(drawn.has("gold.toml:3: unknown key"));
    assert_eq!(drawn.picture, before);
    session.click("hide");
    let hidden = session.settle();
    assert!(hidden.has("failed: gold.toml:3: unknown key (W)"));
    session.press(Key::W, Modifiers::NONE);
    assert!(session.settle().has("the build failed"));
}

#[test]
fn the_inspector_shows_known_values_and_dots_for_others() {
    let mut session = Session::new([1280.0, 1400.0]);
    let drawn = session.settle();
    for text in ["export-shrm, ktx2", "1.23 MB", "gold was cut", "sRGB, 8 bits", "...", "local SHRM"] {
        assert!(drawn.has(text), "{text}: {:?}", drawn.texts);
    }
    session.press(Key::I, Modifiers::NONE);
    assert!(!session.settle().has("1.23 MB"));
}

/// The file of the shown material.
fn material(exponent: f64) -> PreviewUpdate {
    let form = Ok(testkit::phong_form(exponent));
    PreviewUpdate::Material { material: "chrome".into(), form, edited: None }
}

#[test]
fn dragging_a_slider_changes_its_parameter_and_is_one_step() {
    let mut session = Session::new([1280.0, 1400.0]);
    session.state.apply(material(4.0));
    let drawn = session.settle();
    assert!(drawn.has("exponent") && drawn.has("specular") && !drawn.has("not saved"), "{:?}", drawn.texts);
    // The slider is to the right of the number.
    let mut at = drawn.place("exponent");
    let is_number =
        |(text, place): &&(String, Rect)| text.starts_with('4') && (place.center().y - at.y).abs() < 8.0;
    at.x = drawn.texts.iter().find(is_number).unwrap().1.right() + 30.0;
    let button = |pos, pressed| {
        let (button, modifiers) = (PointerButton::Primary, Modifiers::NONE);
        Event::PointerButton { pos, button, pressed, modifiers }
    };
    session.frame(vec![Event::PointerMoved(at)]);
    session.frame(vec![button(at, true)]);
    for step in 1..4 {
        at.x += 5.0 * step as f32;
        session.frame(vec![Event::PointerMoved(at)]);
    }
    session.frame(vec![button(at, false)]);
    session.settle();
    let is_edit =
        |effect: &&Effect| matches!(effect, Effect::EditMaterial(material, Some(_)) if material == "chrome");
    assert!(session.effects.iter().filter(is_edit).count() >= 3, "{:?}", session.effects);
    assert!(session.state.is_edited("chrome"));
    let drawn = session.settle();
    assert!(drawn.has("not saved") && drawn.has("chrome *"));
    session.effects.clear();
    session.click("undo");
    assert_eq!(session.effects, [Effect::EditMaterial("chrome".into(), None)], "it was one step");
    assert!(!session.settle().has("not saved"));
    assert_eq!(session.settle().repaint_after, Duration::MAX);
}

#[test]
fn the_editor_shows_a_conflict_and_why_a_material_cannot_be_edited() {
    let mut session = Session::new([1280.0, 1400.0]);
    session.state.apply(material(4.0));
    session.state.update(Action::SetParameter(testkit::EXPONENT, Value::Number(5.0)));
    session.state.update(Action::EndDrag);
    session.click("save");
    let saved = Effect::SaveMaterial("chrome".into(), testkit::phong_form(5.0));
    assert_eq!(session.effects, [saved]);
    session.state.apply(material(9.0));
    assert!(session.settle().has("The file has changed on the disk."));
    session.click("keep these values");
    assert!(!session.settle().has("The file has changed") && session.state.is_edited("chrome"));
    session.state.apply(material(10.0));
    session.click("load the file");
    assert!(!session.settle().has("not saved"));
    let form = Err("gold.binary: a measured table has no parameters".to_owned());
    session.state.apply(PreviewUpdate::Material { material: "chrome".into(), form, edited: None });
    assert!(session.settle().has("a measured table has no parameters"));
}

/// The second light is behind the sphere as seen from the camera, a little above it.
#[test]
fn a_circular_light_in_the_background_is_dragged_by_itself() {
    let mut session = Session::new([1280.0, 800.0]);
    let (subject, details) = (session.state.settings.subject.clone(), SubjectDetails::default());
    session.state.apply(PreviewUpdate::Scene { subject, scene: testkit::lamps(), details });
    session.state.settings.zoom = 0.25;
    session.settle();
    let rect = session.picture();
    let toward = |session: &Session, disk: usize| {
        let shown = session.state.shown.as_ref().unwrap();
        let size = [rect.width() as u32, rect.height() as u32];
        let camera = session.state.settings.camera(shown.framing);
        let point = camera.eye() + shown.scene.light.disks()[disk].direction.vector() * 1e4;
        let clip = camera.projection(size) * point.extend(1.0);
        let at = [clip.x / clip.w, -clip.y / clip.w].map(|at| (at as f32 + 1.0) / 2.0);
        rect.min + rect.size() * vec2(at[0], at[1])
    };
    let drag = |from: Pos2, to: Pos2| {
        let right = |pos, pressed| Event::PointerButton {
            pos,
            button: PointerButton::Secondary,
            pressed,
            modifiers: Modifiers::NONE,
        };
        vec![Event::PointerMoved(from), right(from, true), Event::PointerMoved(to), right(to, false)]
    };
    let (from, turn) = (toward(&session, 1), session.state.settings.light);
    assert!(rect.contains(from), "{from} {rect}");
    let to = from + vec2(60.0, 30.0);
    session.frame(drag(from, to));
    assert!(toward(&session, 1).distance(to) < 1.0, "{} {to}", toward(&session, 1));
    assert_eq!(session.state.settings.light, turn);
    session.frame(drag(rect.center(), to));
    assert_ne!(session.state.settings.light, turn, "on the mesh all light turns");
    assert!(session.settle().has("Circular lights"));
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

/// The smallest window, and the sizes below which rows of controls wrap.
const SIZES: [[f32; 2]; 4] = [[720.0, 400.0], [800.0, 600.0], [960.0, 640.0], [1280.0, 800.0]];

#[test]
fn the_divider_and_the_captions_follow_the_picture_and_while_dragged_the_pointer() {
    let mut session = Session::with_picture([1280.0, 800.0]);
    session.state.update(Action::Second(Mode::Mirror));
    session.show();
    session.settle();
    let picture = session.picture();
    let x = |share: f32| picture.left() + share * picture.width();
    let left = |session: &mut Session| {
        let texts = session.settle().texts;
        let captions = |(text, at): &&(String, Rect)| text == "local SHRM" && picture.contains(at.center());
        texts.iter().find(captions).unwrap().1.right()
    };
    session.state.update(Action::Divider(0.8));
    let at = left(&mut session);
    assert!((x(0.45)..x(0.5)).contains(&at), "the picture has not changed yet: {at}");
    let button = |pos, pressed| {
        let (button, modifiers) = (PointerButton::Primary, Modifiers::NONE);
        Event::PointerButton { pos, button, pressed, modifiers }
    };
    let (from, to) = (pos2(x(0.5), picture.center().y), pos2(x(0.7), picture.center().y));
    session.frame(vec![Event::PointerMoved(from), button(from, true), Event::PointerMoved(to)]);
    assert!(
        (session.state.settings.divider - 0.7).abs() < 0.02,
        "the drag starts where the divider is drawn"
    );
    let at = left(&mut session);
    assert!((x(0.65)..x(0.7)).contains(&at), "{at}");
    session.frame(vec![button(to, false)]);
    session.show();
    let first = session.state.settings.camera;
    session.state.update(Action::Orbit(Aim { yaw: 1.0, pitch: 0.0 }));
    let turned = session.state.settings.camera;
    for _ in 0..2 {
        session.click_at(to);
    }
    assert_eq!(
        session.state.settings.camera, turned,
        "a double click on the divider does not reset the camera"
    );
    // After half a second a new double click may start.
    (0..30).for_each(|_| drop(session.frame(Vec::new())));
    for _ in 0..2 {
        session.click_at(to - vec2(60.0, 0.0));
    }
    assert_eq!(session.state.settings.camera, first);
}

#[test]
fn escape_in_a_text_field_or_a_drop_down_list_does_nothing_else() {
    let mut session = Session::with_picture([1280.0, 800.0]);
    session.state.apply(PreviewUpdate::Failure(Some(vec!["no".into()])));
    session.click("+0.00 stops");
    session.settle();
    assert!(session.context.text_edit_focused());
    session.press(Key::Escape, Modifiers::NONE);
    assert!(!session.context.text_edit_focused() && !session.state.failure_hidden);
    session.click("filmic");
    assert!(session.settle().has("plain"));
    session.press(Key::Escape, Modifiers::NONE);
    assert!(!session.settle().has("plain") && !session.state.failure_hidden);
    session.press(Key::Escape, Modifiers::NONE);
    assert!(session.state.failure_hidden);
}

#[test]
fn an_entry_that_a_key_chooses_is_scrolled_into_view() {
    let mut session = Session::with_picture([1280.0, 800.0]);
    let materials = (0..90).map(|number| format!("paint {number}")).collect();
    session.state.apply(PreviewUpdate::Catalog(Catalog { materials, ..session.state.catalog.clone() }));
    let drawn = session.settle();
    assert!(drawn.texts.iter().all(|(text, _)| text != "paint 89"), "it is below the visible part");
    session.press(Key::M, Modifiers::SHIFT);
    let drawn = session.settle();
    assert!(session.picture().y_range().contains(drawn.place("paint 89").y));
    assert_eq!(drawn.repaint_after, Duration::MAX);
}

/// A file as the system reports it.
#[derive(Debug)]
struct File(PathBuf);

impl DroppedFile for File {
    fn path(&self) -> &Path {
        &self.0
    }

    fn bytes(&self) -> Result<Vec<u8>, String> {
        Err("the window reads no files".into())
    }
}

#[test]
fn dragged_files_are_named_and_dropped_files_go_to_the_host_once() {
    let mut session = Session::with_picture([1280.0, 800.0]);
    let dragged = |name: &str| HoveredFile { path: Some(name.into()), ..HoveredFile::default() };
    let hovered_files = (0..8).map(|number| dragged(&format!("/light/sky{number}.hdr"))).collect();
    session.frame_of(RawInput { hovered_files, ..RawInput::default() });
    let hovered_files = (0..8).map(|number| dragged(&format!("/light/sky{number}.hdr"))).collect();
    let drawn = session.frame_of(RawInput { hovered_files, ..RawInput::default() });
    assert!(
        drawn.has("Drop to show") && drawn.has("sky0.hdr") && drawn.has("and 2 more"),
        "{:?}",
        drawn.texts
    );
    assert_eq!(session.effects, []);

    let files = ["/light/sky.hdr", "/gold.toml"].map(PathBuf::from);
    let dropped_files = files.iter().map(|file| Arc::new(File(file.clone())) as DroppedFileHandle).collect();
    session.frame_of(RawInput { dropped_files, ..RawInput::default() });
    assert!(!session.settle().has("Drop to show"));
    assert_eq!(session.effects, [Effect::ShowFiles(files.to_vec())]);
    session.press(Key::Backspace, Modifiers::NONE);
    assert_eq!(session.effects.pop(), Some(Effect::ReturnFromDropped));
}
