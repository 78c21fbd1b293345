//! What the window knows and what becomes of it: [`State::update`] for what the designer does, [`State::hear`] for what
//! the program tells. Neither draws nor waits, so that all of it is tested without a window.

use std::sync::Arc;

use preview::{Aim, Arrangement, Backdrop, Tone, ViewSettings};
use preview::{Catalog, PreviewUpdate, Subject, SubjectDetails, SubjectRequest};
use preview::{Framing, InitialView, List, Mode, Scene};

/// What the designer does. Angles in radians, and by how much.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Action {
    Choose(List, String),
    /// To the next (+1) or the one before (-1), around the ends.
    Step(List, isize),
    Mode(Mode),
    Second(Mode),
    Swap,
    Arrange(Arrangement),
    /// To that arrangement, or from it to one mode.
    Toggle(Arrangement),
    Divider(f32),
    MoveDivider(f32),
    Amplify(f32),
    /// Twice as strong for every one.
    AmplifyBy(i32),
    Background(Backdrop),
    StepBackground(isize),
    Expose(f64),
    ExposeBy(f64),
    Tone(Tone),
    NextTone,
    TurnLight(Aim),
    ResetLight,
    Orbit(Aim),
    /// This many times larger.
    ZoomBy(f64),
    ResetCamera,
    ToggleLists,
    ToggleInspector,
    /// Both panels away, or both back.
    TogglePanels,
    ToggleHelp,
    ToggleFullscreen,
    /// What is over the picture: the help first, then a picture that is being kept, then toasts, then the failure.
    Dismiss,
    /// The failure away.
    PutAside,
    /// The failure again, after it was put aside.
    ShowFailure,
    Screenshot,
    Close,
}

/// What the window does after an action or news.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Effect {
    /// Asks the host for a subject.
    Show(Subject),
    Screenshot,
    /// Gives up the pictures that are to be kept.
    GiveUp,
    Fullscreen(bool),
    Close,
}

/// A message that goes by itself.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Toast {
    pub(crate) title: String,
    pub(crate) lines: Vec<String>,
    /// When it goes, in seconds of the window's clock; not known until it was drawn.
    pub(crate) until: Option<f64>,
}

/// The scene that is seen.
#[derive(Clone, Debug)]
pub(crate) struct Shown {
    pub(crate) subject: Subject,
    pub(crate) scene: Arc<Scene>,
    pub(crate) framing: Framing,
    pub(crate) facts: SubjectDetails,
    /// Another for every scene that came.
    pub(crate) edition: u64,
    /// The first edition of this subject since it was chosen.
    pub(crate) since: u64,
}

/// What the window knows.
#[derive(Clone, Debug, Default)]
pub(crate) struct State {
    pub(crate) settings: ViewSettings,
    pub(crate) catalogue: Catalog,
    pub(crate) shown: Option<Shown>,
    pub(crate) status: String,
    pub(crate) toasts: Vec<Toast>,
    pub(crate) failure: Option<Vec<String>>,
    /// Whether the failure was put aside; it stays in the status line.
    pub(crate) failure_aside: bool,
    pub(crate) help: bool,
    /// Whether a picture to keep is being drawn.
    pub(crate) keeping: bool,
    pub(crate) fullscreen: bool,
    editions: u64,
    /// What was asked for last. The settings name what stands in for it where that is not there.
    wanted: Subject,
    /// What was asked for at first, until something is chosen.
    wish: SubjectRequest,
}

/// How long a toast stays, in seconds, and more for every line.
const TOAST: f64 = 5.0;
const TOAST_LINE: f64 = 1.0;
/// More toasts than this at once are no news.
const TOASTS: usize = 4;

impl State {
    /// What a window begins with.
    pub(crate) fn new(view: InitialView) -> Self {
        let (settings, note) = view.settings();
        let wanted = settings.subject.clone();
        let mut state = Self { settings, wanted, wish: view.request, ..Self::default() };
        if let Some(note) = note {
            state.toast(note, Vec::new());
        }
        state
    }

    /// What the next window is to begin with.
    pub(crate) fn kept(&self) -> String {
        ViewSettings { subject: self.wanted.clone(), ..self.settings.clone() }.write()
    }

    /// Does what the designer did.
    pub(crate) fn update(&mut self, action: Action) -> Option<Effect> {
        let settings = &mut self.settings;
        match action {
            Action::Choose(list, name) => return self.choose(list, name),
            Action::Step(list, by) => {
                let (names, chosen) = list.of(&self.catalogue, &settings.subject);
                let name = stepped(names, &chosen.to_owned(), by)?.clone();
                return self.choose(list, name);
            }
            Action::Mode(mode) => settings.mode = mode,
            Action::Second(mode) => {
                settings.second = mode;
                if settings.arrangement == Arrangement::One {
                    settings.arrangement = Arrangement::Split;
                }
            }
            Action::Swap => std::mem::swap(&mut settings.mode, &mut settings.second),
            Action::Arrange(arrangement) => settings.arrangement = arrangement,
            Action::Toggle(arrangement) => {
                let already = settings.arrangement == arrangement;
                settings.arrangement = if already { Arrangement::One } else { arrangement };
            }
            Action::Divider(at) => settings.divider = at,
            Action::MoveDivider(by) => settings.divider += by,
            Action::Amplify(amplify) => settings.amplify = amplify,
            Action::AmplifyBy(by) => settings.amplify *= (by as f32).exp2(),
            Action::Background(backdrop) => settings.backdrop = backdrop,
            Action::StepBackground(by) => {
                settings.backdrop = *stepped(&Backdrop::ALL, &settings.backdrop, by)?;
            }
            Action::Expose(exposure) => settings.exposure = exposure,
            Action::ExposeBy(by) => settings.exposure = thirds(settings.exposure + by),
            Action::Tone(tone) => settings.tone = tone,
            Action::NextTone => settings.tone = *stepped(&Tone::ALL, &settings.tone, 1)?,
            Action::TurnLight(by) => settings.light = turned(settings.light, by),
            Action::ResetLight => settings.light = ViewSettings::default().light,
            Action::Orbit(by) => settings.camera = turned(settings.camera, by),
            Action::ZoomBy(factor) => settings.zoom *= factor,
            Action::ResetCamera => {
                let first = ViewSettings::default();
                (settings.camera, settings.zoom) = (first.camera, first.zoom);
            }
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
                } else if self.keeping {
                    return Some(Effect::GiveUp);
                } else if !self.toasts.is_empty() {
                    self.toasts.clear();
                } else {
                    self.failure_aside = true;
                }
            }
            Action::PutAside => self.failure_aside = true,
            Action::ShowFailure => self.failure_aside = false,
            Action::Screenshot => return self.shown.is_some().then_some(Effect::Screenshot),
            Action::Close => return Some(Effect::Close),
        }
        self.settings = std::mem::take(&mut self.settings).within_bounds();
        None
    }

    /// Takes in what the program tells.
    pub(crate) fn hear(&mut self, news: PreviewUpdate) -> Option<Effect> {
        match news {
            PreviewUpdate::Catalog(catalogue) => return self.catalogued(catalogue),
            PreviewUpdate::Scene { subject, scene, facts } => {
                if subject == self.settings.subject {
                    self.editions += 1;
                    let edition = self.editions;
                    let same = self.shown.as_ref().filter(|shown| shown.subject == subject);
                    let since = same.map_or(edition, |shown| shown.since);
                    let (framing, scene) = (scene.framing(), Arc::new(scene));
                    self.shown = Some(Shown { subject, scene, framing, facts, edition, since });
                }
            }
            PreviewUpdate::Status(line) => self.status = line,
            PreviewUpdate::Toast { title, lines } => self.toast(title, lines),
            PreviewUpdate::Failure(failure) => {
                // The same failure again stays aside.
                self.failure_aside &= failure == self.failure;
                self.failure = failure;
            }
            PreviewUpdate::Close => return Some(Effect::Close),
        }
        None
    }

    /// Shows a message for a while.
    pub(crate) fn toast(&mut self, title: String, lines: Vec<String>) {
        self.toasts.push(Toast { title, lines, until: None });
        let extra = self.toasts.len().saturating_sub(TOASTS);
        self.toasts.drain(..extra);
    }

    /// Takes away what has been seen long enough; says in how many seconds the next goes. `now` is the time of a frame that
    /// draws, in seconds of the window's clock: what is new is seen from then on.
    pub(crate) fn pass(&mut self, now: f64) -> Option<f64> {
        for toast in &mut self.toasts {
            toast.until.get_or_insert(now + TOAST + TOAST_LINE * toast.lines.len() as f64);
        }
        let left = |toast: &Toast| toast.until.map(|until| until - now);
        self.toasts.retain(|toast| left(toast).is_none_or(|left| left > 0.0));
        self.toasts.iter().filter_map(left).reduce(f64::min)
    }

    /// What of the wanted subject is not there, by name: nothing where it is the one that is shown.
    pub(crate) fn missing(&self) -> Vec<&str> {
        let wanted = self.settings.subject.names();
        let shown = self.shown.as_ref().map(|shown| shown.subject.names());
        let is_there = |at: usize| shown.is_some_and(|shown| shown[at] == wanted[at]);
        let missing = (0..wanted.len()).filter(|at| !wanted[*at].is_empty() && !is_there(*at));
        missing.map(|at| wanted[at]).collect()
    }

    /// Whether the wanted subject is on its way.
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

    fn choose(&mut self, list: List, name: String) -> Option<Effect> {
        let chosen = list.chosen(&mut self.settings.subject);
        if *chosen == name {
            return None;
        }
        *chosen = name;
        (self.wanted, self.wish) = (self.settings.subject.clone(), SubjectRequest::default());
        Some(Effect::Show(self.wanted.clone()))
    }

    fn catalogued(&mut self, catalogue: Catalog) -> Option<Effect> {
        let mut subject = catalogue.nearest(&self.wanted, &self.wish, &self.settings.subject);
        let another = subject != self.settings.subject;
        self.catalogue = catalogue;
        if another && let Some(reason) = self.stands_in(&subject) {
            self.toast(reason, Vec::new());
        }
        for list in List::ALL {
            let wanted = list.chosen(&mut self.wanted);
            if wanted.is_empty() {
                wanted.clone_from(list.chosen(&mut subject));
            }
        }
        let there = !subject.environment.is_empty();
        self.settings.subject = subject;
        (there && (another || self.shown.is_none())).then(|| Effect::Show(self.settings.subject.clone()))
    }

    /// Why something else is shown than what is wanted.
    fn stands_in(&self, subject: &Subject) -> Option<String> {
        let mut missing = Vec::new();
        for list in List::ALL {
            let (names, wanted) = list.of(&self.catalogue, &self.wanted);
            if !wanted.is_empty() && !names.iter().any(|name| name == wanted) {
                missing.push(wanted);
            }
        }
        if !missing.is_empty() {
            return Some(format!("{} is not in this pipeline", missing.join(", ")));
        }
        let Subject { environment, material, .. } = &self.wanted;
        let goes = |wanted: &String, there: &String| wanted.is_empty() || wanted == there;
        let go_together = goes(environment, &subject.environment) && goes(material, &subject.material);
        (!go_together).then(|| format!("no stage reflects {environment} off {material}"))
    }
}

/// The entry that many steps on, around the ends; the first where `from` is not in the list.
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

/// The nearest third of a stop, so that as many steps back as forth lead to 0.
fn thirds(exposure: f64) -> f64 {
    (exposure * 3.0).round() / 3.0
}

#[cfg(test)]
mod tests;
