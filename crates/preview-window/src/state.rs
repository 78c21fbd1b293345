//! The state of the window and its changes: [`State::update`] carries out the user's actions,
//! [`State::apply`] the program's updates. Neither draws nor waits, so that tests need no window.

use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;
use std::sync::Arc;

use brdf::Value;
use envmap::ToneMap;
use preview::{
    Aim, Arrangement, Background, Catalog, FormField, Framing, InitialView, List, MaterialForm, Mode, Named,
    PreviewUpdate, Scene, Subject, SubjectDetails, SubjectRequest, ViewSettings,
};
use sphere::Direction;

use crate::material_editor::MaterialEditor;

/// An action of the user. Angles are changes in radians.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Action {
    Choose(List, String),
    /// Chooses the next (+1) or the previous (-1) entry, around the ends.
    Step(List, isize),
    Mode(Mode),
    Second(Mode),
    Swap,
    Arrange(Arrangement),
    /// Switches to an arrangement, or from it to one mode.
    Toggle(Arrangement),
    Divider(f32),
    MoveDivider(f32),
    Amplify(f32),
    /// Multiplies the amplification by this power of two.
    AmplifyBy(i32),
    Background(Background),
    StepBackground(isize),
    Expose(f64),
    ExposeBy(f64),
    Tone(ToneMap),
    NextTone,
    TurnLight(Aim),
    /// Moves a disk of the light in a direction of the light's frame.
    MoveDisk(usize, Direction),
    /// Turns the light back, and moves its disks back.
    ResetLight,
    /// Asks how the turned light would be written to the manifest.
    SaveLight,
    Orbit(Aim),
    /// Multiplies the magnification.
    ZoomBy(f64),
    ResetCamera,
    SetParameter(FormField, Value),
    /// Ends a step of [`Action::SetParameter`].
    EndDrag,
    Undo,
    Redo,
    Revert,
    SaveMaterial,
    /// Drops the unsaved values in favour of those that the file has now.
    LoadFile,
    /// Keeps the unsaved values, to be written over those that the file has now.
    KeepValues,
    ToggleLists,
    ToggleInspector,
    /// Hides both panels, or shows both.
    TogglePanels,
    ToggleHelp,
    ToggleFullscreen,
    /// Closes the help, else cancels screenshots, else removes the toasts, else hides the failure.
    Dismiss,
    HideFailure,
    ShowFailure,
    Screenshot,
    /// Files were dropped on the window.
    Drop(Vec<PathBuf>),
    /// Goes back to what was shown before files were dropped.
    ReturnFromDropped,
    /// Closes the window, if necessary after a question.
    Close,
    Answer(Answer),
}

/// Something that the window does after an action or an update.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Effect {
    /// Requests a subject from the host.
    Show(Subject),
    /// Asks the host to show files.
    ShowFiles(Vec<PathBuf>),
    /// Asks the host for what was shown before.
    ReturnFromDropped,
    Screenshot,
    CancelScreenshots,
    /// Shows a material with these values, or with those of its file.
    EditMaterial(String, Option<MaterialForm>),
    SaveMaterial(String, MaterialForm),
    /// Saves several materials, and closes when all are saved.
    SaveAndClose(Vec<(String, MaterialForm)>),
    /// Shows materials with the values of their files, and closes.
    DiscardAndClose(Vec<String>),
    /// Asks the host how this turn of the light would be written.
    ProposeLight(Aim),
    /// Writes a turn of the light, as these lines of the dialog say.
    SaveLight(Aim, Vec<String>),
    Fullscreen(bool),
    Close,
}

/// A question that waits for an answer.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Dialog {
    /// The window is to close, and these materials have values that are not saved.
    Unsaved(Vec<String>),
    /// Whether to write a turn of the light to the manifest: the question, and what changes.
    SaveLight { turn: Aim, lines: Vec<String> },
}

/// The answer to a [`Dialog`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Answer {
    Save,
    Discard,
    Cancel,
}

/// A message that disappears after a while.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Toast {
    pub(crate) title: String,
    pub(crate) lines: Vec<String>,
    /// When the toast disappears, in seconds of the window's clock; `None` until it was drawn.
    pub(crate) until: Option<f64>,
}

#[derive(Clone, Debug)]
pub(crate) struct ShownScene {
    pub(crate) subject: Subject,
    pub(crate) scene: Arc<Scene>,
    pub(crate) framing: Framing,
    pub(crate) details: SubjectDetails,
    /// A number of its own for every scene, in order.
    pub(crate) scene_id: u64,
    /// The number of the first scene of this subject since it was chosen.
    pub(crate) first_scene_id: u64,
}

#[derive(Clone, Debug, Default)]
pub(crate) struct State {
    pub(crate) settings: ViewSettings,
    pub(crate) catalog: Catalog,
    pub(crate) shown: Option<ShownScene>,
    /// The editors of the materials that were shown, by name, or why a material cannot be edited.
    pub(crate) editors: BTreeMap<String, Result<MaterialEditor, String>>,
    pub(crate) status: String,
    pub(crate) toasts: Vec<Toast>,
    pub(crate) failure: Option<Vec<String>>,
    /// Whether the failure is only in the status line.
    pub(crate) failure_hidden: bool,
    pub(crate) help: bool,
    pub(crate) dialog: Option<Dialog>,
    /// The materials that are being saved before the window closes.
    closing: BTreeSet<String>,
    pub(crate) taking_screenshot: bool,
    pub(crate) fullscreen: bool,
    /// The environment whose disks were moved, and where they are now.
    moved_disks: Option<(String, Vec<Direction>)>,
    /// A turn of the light that the next scene has of its own.
    saved_turn: Option<Aim>,
    /// The scene in the window as it was built.
    built: Option<Arc<Scene>>,
    scene_count: u64,
    /// The subject chosen last. If the catalog lacks it, the settings name the nearest subject instead.
    wanted: Subject,
    /// The subject on the command line, until another is chosen.
    request: SubjectRequest,
}

/// How long a toast stays, in seconds, and the time added for each line.
const TOAST: f64 = 5.0;
const TOAST_LINE: f64 = 1.0;
/// The most toasts at once.
const TOASTS: usize = 4;

impl State {
    /// The state of a new window.
    pub(crate) fn new(view: InitialView) -> Self {
        let (settings, note) = view.settings();
        let wanted = settings.subject.clone();
        let mut state = Self { settings, wanted, request: view.request, ..Self::default() };
        if let Some(note) = note {
            state.toast(note, Vec::new());
        }
        state
    }

    /// The settings for the next window.
    pub(crate) fn to_json(&self) -> String {
        ViewSettings { subject: self.wanted.clone(), ..self.settings.clone() }.to_json()
    }

    /// Carries out an action of the user.
    pub(crate) fn update(&mut self, action: Action) -> Option<Effect> {
        if self.dialog.is_some() {
            return match action {
                Action::Answer(answer) => self.answer(answer),
                Action::Dismiss => self.answer(Answer::Cancel),
                _ => None,
            };
        }
        let first = self.first_mode();
        let settings = &mut self.settings;
        match action {
            Action::Choose(list, name) => return self.choose(list, name),
            Action::Step(list, by) => {
                let (names, chosen) = list.of(&self.catalog, &settings.subject);
                let name = stepped(names, &chosen.to_owned(), by)?.clone();
                return self.choose(list, name);
            }
            Action::Mode(mode) => settings.mode = Some(mode),
            Action::Second(mode) => {
                settings.second = mode;
                if settings.arrangement == Arrangement::One {
                    settings.arrangement = Arrangement::Split;
                }
            }
            Action::Swap => (settings.mode, settings.second) = (Some(settings.second), first),
            Action::Arrange(arrangement) => settings.arrangement = arrangement,
            Action::Toggle(arrangement) => {
                let already = settings.arrangement == arrangement;
                settings.arrangement = if already { Arrangement::One } else { arrangement };
            }
            Action::Divider(at) => settings.divider = at,
            Action::MoveDivider(by) => settings.divider += by,
            Action::Amplify(amplify) => settings.amplify = amplify,
            Action::AmplifyBy(by) => settings.amplify *= (by as f32).exp2(),
            Action::Background(background) => settings.background = background,
            Action::StepBackground(by) => {
                settings.background = *stepped(Background::ALL, &settings.background, by)?;
            }
            Action::Expose(exposure) => settings.exposure = exposure,
            Action::ExposeBy(by) => settings.exposure = thirds(settings.exposure + by),
            Action::Tone(tone) => settings.tone = tone,
            Action::NextTone => settings.tone = *stepped(ToneMap::ALL, &settings.tone, 1)?,
            Action::TurnLight(by) => settings.light = turned(settings.light, by),
            Action::MoveDisk(disk, direction) => self.move_disk(disk, direction),
            Action::ResetLight => {
                settings.light = ViewSettings::default().light;
                if self.moved_disks.take().is_some() {
                    self.show_scene();
                }
            }
            Action::SaveLight if self.shown.is_none() => return None,
            Action::SaveLight if settings.light == Aim::default() => {
                self.toast("the light is not turned".into(), Vec::new());
            }
            Action::SaveLight => return Some(Effect::ProposeLight(settings.light)),
            Action::Orbit(by) => settings.camera = turned(settings.camera, by),
            Action::ZoomBy(factor) => settings.zoom *= factor,
            Action::ResetCamera => {
                let first = ViewSettings::default();
                (settings.camera, settings.zoom) = (first.camera, first.zoom);
            }
            Action::SetParameter(field, value) => return self.edit(|editor| editor.set(field, &value)),
            Action::EndDrag => return self.edit(MaterialEditor::end_drag),
            Action::Undo => return self.edit(MaterialEditor::undo),
            Action::Redo => return self.edit(MaterialEditor::redo),
            Action::Revert => return self.edit(MaterialEditor::revert),
            Action::SaveMaterial => return self.save_material(),
            Action::LoadFile => return self.load_file(),
            Action::KeepValues => return self.edit(MaterialEditor::keep),
            Action::ToggleLists => settings.lists = !settings.lists,
            Action::ToggleInspector => settings.inspector = !settings.inspector,
            Action::TogglePanels => {
                let any = settings.lists || settings.inspector;
                (settings.lists, settings.inspector) = (!any, !any);
            }
            Action::ToggleHelp => self.help = !self.help,
            Action::ToggleFullscreen => {
                self.fullscreen = !self.fullscreen;
                return Some(Effect::Fullscreen(self.fullscreen));
            }
            Action::Dismiss => {
                if self.help {
                    self.help = false;
                } else if self.taking_screenshot {
                    return Some(Effect::CancelScreenshots);
                } else if !self.toasts.is_empty() {
                    self.toasts.clear();
                } else {
                    self.failure_hidden = true;
                }
            }
            Action::HideFailure => self.failure_hidden = true,
            Action::ShowFailure => self.failure_hidden = false,
            Action::Screenshot => return self.shown.is_some().then_some(Effect::Screenshot),
            Action::Drop(files) => return Some(Effect::ShowFiles(files)),
            Action::ReturnFromDropped => return Some(Effect::ReturnFromDropped),
            Action::Close => return self.close(),
            Action::Answer(_) => return None,
        }
        self.settings = std::mem::take(&mut self.settings).within_bounds();
        None
    }

    /// Applies an update from the program.
    pub(crate) fn apply(&mut self, update: PreviewUpdate) -> Option<Effect> {
        match update {
            PreviewUpdate::Catalog(catalog) => return self.set_catalog(catalog),
            PreviewUpdate::Choose(parts) => {
                let SubjectRequest { environment, material, mesh, .. } = &parts;
                for (list, name) in List::ALL.into_iter().zip([environment, material, mesh]) {
                    if let Some(name) = name {
                        list.chosen(&mut self.wanted).clone_from(name);
                    }
                }
                self.request = parts;
            }
            PreviewUpdate::Scene { subject, scene, details } => {
                if subject == self.settings.subject {
                    self.scene_count += 1;
                    let scene_id = self.scene_count;
                    let same = self.shown.as_ref().filter(|shown| shown.subject == subject);
                    let first_scene_id = same.map_or(scene_id, |shown| shown.first_scene_id);
                    let (framing, scene) = (scene.framing(), Arc::new(scene));
                    self.built = Some(Arc::clone(&scene));
                    self.turn_back();
                    self.shown =
                        Some(ShownScene { subject, scene, framing, details, scene_id, first_scene_id });
                    if self.moved_disks.is_some() {
                        self.show_scene();
                    }
                }
            }
            PreviewUpdate::Material { material, form, edited } => match self.editors.get_mut(&material) {
                Some(Ok(editor)) if editor.is_edited() || form.is_ok() => editor.follow(form),
                _ => {
                    let editor = form.map(|form| MaterialEditor::new(form, edited));
                    self.editors.insert(material, editor);
                }
            },
            PreviewUpdate::MaterialSaved { material, saved } => return self.saved(&material, saved),
            PreviewUpdate::LightEdit { turn, lines } => {
                self.dialog.get_or_insert(Dialog::SaveLight { turn, lines });
            }
            PreviewUpdate::LightSaved(turn) => self.saved_turn = Some(turn),
            PreviewUpdate::Status(line) => self.status = line,
            PreviewUpdate::Toast { title, lines } => self.toast(title, lines),
            PreviewUpdate::Failure(failure) => {
                // The same failure stays hidden, also if it means something else for the picture now.
                self.failure_hidden &= details(&failure) == details(&self.failure);
                self.failure = failure;
            }
            PreviewUpdate::Close => return Some(Effect::Close),
        }
        None
    }

    /// Moves a disk of the light in the window. Nothing but the picture changes.
    fn move_disk(&mut self, disk: usize, direction: Direction) {
        let Some(shown) = &self.shown else { return };
        let mut directions: Vec<_> = shown.scene.light.disks().iter().map(|disk| disk.direction).collect();
        if let Some(moved) = directions.get_mut(disk) {
            *moved = direction;
            self.moved_disks = Some((shown.subject.environment.clone(), directions));
            self.show_scene();
        }
    }

    /// Shows the scene that was built last, with the disks of its light where they were moved. If the light
    /// has not as many disks now, they stay where they are.
    fn show_scene(&mut self) {
        let (Some(shown), Some(built)) = (&mut self.shown, &self.built) else { return };
        let moved = self.moved_disks.as_ref().filter(|(of, _)| *of == shown.subject.environment);
        let scene = moved.and_then(|(_, directions)| built.with_disks_at(directions));
        self.scene_count += 1;
        (shown.scene, shown.scene_id) = (scene.map_or_else(|| Arc::clone(built), Arc::new), self.scene_count);
    }

    /// Shows a message for a while.
    pub(crate) fn toast(&mut self, title: String, lines: Vec<String>) {
        self.toasts.push(Toast { title, lines, until: None });
        let extra = self.toasts.len().saturating_sub(TOASTS);
        self.toasts.drain(..extra);
    }

    /// Removes expired toasts and returns the seconds until the next one expires. `now` is the time of the
    /// frame in seconds of the window's clock; the time of a new toast starts with it.
    pub(crate) fn expire_toasts(&mut self, now: f64) -> Option<f64> {
        for toast in &mut self.toasts {
            toast.until.get_or_insert(now + TOAST + TOAST_LINE * toast.lines.len() as f64);
        }
        let left = |toast: &Toast| toast.until.map(|until| until - now);
        self.toasts.retain(|toast| left(toast).is_none_or(|left| left > 0.0));
        self.toasts.iter().filter_map(left).reduce(f64::min)
    }

    /// The names of the selected subject that the scene in the window lacks.
    pub(crate) fn missing(&self) -> Vec<&str> {
        let wanted = self.settings.subject.names();
        let shown = self.shown.as_ref().map(|shown| shown.subject.names());
        let is_there = |at: usize| shown.is_some_and(|shown| shown[at] == wanted[at]);
        let missing = (0..wanted.len()).filter(|at| !wanted[*at].is_empty() && !is_there(*at));
        missing.map(|at| wanted[at]).collect()
    }

    /// The first mode.
    pub(crate) fn first_mode(&self) -> Mode {
        let of_scene = || self.shown.as_ref().map_or(Mode::LocalShrm, |shown| shown.scene.first_mode());
        self.settings.mode.unwrap_or_else(of_scene)
    }

    /// Why the picture is by brute force, if the settings ask for a mode whose map does not exist, or not the
    /// difference that they ask for.
    pub(crate) fn why_brute_force(&self) -> Option<&'static str> {
        let scene = &self.shown.as_ref()?.scene;
        let show = self.settings.show(scene);
        let is_edited = self.is_edited(&self.settings.subject.material);
        let is_missing = |mode| show.modes().any(|shown| shown == mode) && !scene.offers(mode);
        let reason = match is_edited {
            _ if matches!(show, preview::Show::Difference { .. }) && show.modes().any(Mode::is_diagram) => {
                "the samples alone: there is no difference from a diagram"
            }
            true => "brute force until the material is saved and its maps are made",
            false if is_missing(Mode::Prefiltered) && scene.shows_light() => {
                "brute force: no cube with levels is exported"
            }
            false if scene.shows_light() => "brute force: there is no material in this pipeline",
            false if is_missing(Mode::Table) => "brute force: there is no BRDF table of this material",
            false if is_missing(Mode::Transfer) && scene.offers(Mode::Table) => {
                "brute force: there is no transfer of this mesh"
            }
            false if is_missing(Mode::Transfer) => "brute force: there is no BRDF table of this material",
            false if is_missing(Mode::Taps) => "brute force: the scale space or the taps are not made",
            false if scene.has_maps() || scene.offers(Mode::Taps) => {
                "brute force: there are no maps of this material under this light"
            }
            false => "brute force until the maps are made",
        };
        (scene.available(show) != show).then_some(reason)
    }

    /// Whether a material has values that are not saved.
    pub(crate) fn is_edited(&self, material: &str) -> bool {
        matches!(self.editors.get(material), Some(Ok(editor)) if editor.is_edited())
    }

    /// Whether the selected subject is being loaded.
    pub(crate) fn waits(&self) -> bool {
        self.failure.is_none() && !self.missing().is_empty()
    }

    pub(crate) fn title(&self) -> String {
        let Subject { environment, material, .. } = &self.settings.subject;
        let named = [environment, material].into_iter().filter(|name| !name.is_empty());
        let names: Vec<&str> = named.map(String::as_str).collect();
        if names.is_empty() {
            "Specula preview".into()
        } else {
            format!("Specula preview: {}", names.join(", "))
        }
    }

    /// Changes the editor of the selected material.
    fn edit(&mut self, change: impl FnOnce(&mut MaterialEditor)) -> Option<Effect> {
        let material = &self.settings.subject.material;
        let Some(Ok(editor)) = self.editors.get_mut(material) else { return None };
        let before = editor.edited().cloned();
        change(editor);
        let after = editor.edited().cloned();
        (before != after).then(|| Effect::EditMaterial(material.clone(), after))
    }

    fn save_material(&mut self) -> Option<Effect> {
        let material = &self.settings.subject.material;
        let Some(Ok(editor)) = self.editors.get_mut(material) else { return None };
        editor.save().map(|form| Effect::SaveMaterial(material.clone(), form))
    }

    fn load_file(&mut self) -> Option<Effect> {
        let material = &self.settings.subject.material;
        let editor = self.editors.remove(material)?.and_then(MaterialEditor::load);
        self.editors.insert(material.clone(), editor);
        Some(Effect::EditMaterial(material.clone(), None))
    }

    fn choose(&mut self, list: List, name: String) -> Option<Effect> {
        let chosen = list.chosen(&mut self.settings.subject);
        if *chosen == name {
            return None;
        }
        *chosen = name;
        (self.wanted, self.request) = (self.settings.subject.clone(), SubjectRequest::default());
        Some(Effect::Show(self.wanted.clone()))
    }

    fn set_catalog(&mut self, catalog: Catalog) -> Option<Effect> {
        let mut subject = catalog.nearest(&self.wanted, &self.request, &self.settings.subject);
        let changes = subject != self.settings.subject;
        self.catalog = catalog;
        if changes && let Some(reason) = self.why_replaced(&subject) {
            self.toast(reason, Vec::new());
        }
        for list in List::ALL {
            let wanted = list.chosen(&mut self.wanted);
            if wanted.is_empty() {
                wanted.clone_from(list.chosen(&mut subject));
            }
        }
        let exists = !subject.environment.is_empty();
        self.settings.subject = subject;
        (exists && (changes || self.shown.is_none())).then(|| Effect::Show(self.settings.subject.clone()))
    }

    /// Why this subject replaces the wanted one.
    fn why_replaced(&self, subject: &Subject) -> Option<String> {
        let mut missing = Vec::new();
        for list in List::ALL {
            let (names, wanted) = list.of(&self.catalog, &self.wanted);
            if !wanted.is_empty() && !names.iter().any(|name| name == wanted) {
                missing.push(wanted);
            }
        }
        if !missing.is_empty() {
            return Some(format!("{} is not in this pipeline", missing.join(", ")));
        }
        let Subject { environment, material, .. } = &self.wanted;
        let agrees = |wanted: &String, found: &String| wanted.is_empty() || wanted == found;
        let is_pair = agrees(environment, &subject.environment) && agrees(material, &subject.material);
        (!is_pair).then(|| format!("no stage reflects {environment} off {material}"))
    }
}

/// The lines of a failure below its headline, if it has some.
fn details(failure: &Option<Vec<String>>) -> Option<&[String]> {
    let lines = failure.as_deref()?;
    Some(if lines.len() > 1 { &lines[1..] } else { lines })
}

/// The entry that many steps after `from`, around the ends; the first if `from` is not in the list.
fn stepped<'a, T: PartialEq>(list: &'a [T], from: &T, by: isize) -> Option<&'a T> {
    let count = list.len().try_into().ok().filter(|count: &isize| *count > 0)?;
    match list.iter().position(|entry| entry == from) {
        Some(at) => list.get((isize::try_from(at).ok()? + by).rem_euclid(count) as usize),
        None => list.first(),
    }
}

fn turned(aim: Aim, by: Aim) -> Aim {
    Aim { yaw: aim.yaw + by.yaw, pitch: aim.pitch + by.pitch }
}

/// The nearest third of a stop, so that equally many steps up and down return to 0.
fn thirds(exposure: f64) -> f64 {
    (exposure * 3.0).round() / 3.0
}

mod saving;
#[cfg(test)]
mod tests;
