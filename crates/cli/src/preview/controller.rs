//! Between the watcher and the window: reads what was built last and shows what is wanted of it.
//!
//! Everything comes as a [`PreviewMessage`], from the window, the watcher and Ctrl-C. Those that have come meanwhile are read before
//! anything is done: of several wishes the newest is answered.

use std::iter;
use std::sync::Arc;
use std::sync::mpsc::Receiver;
use std::time::Instant;

use ::preview::{Catalog, InitialView, PreviewUpdate, Subject, SubjectDetails};
use ::preview::{Picture, RenderError, Scene};
use engine::{Cancel, Error, Event, ItemName, Plan, ResultsSnapshot};
use stages::{PreviewCatalog, SceneCache};

use super::files::PreviewFiles;
use super::status::{BuildStatus, Message};
use super::subject::SubjectError;
use super::window::WindowRequest;
use super::{still, subject};
use crate::arguments::Backend;
use crate::print::{self, say};

/// Shows news in a window.
type Window = Box<dyn Fn(PreviewUpdate) + Send>;

/// What the controller hears.
#[cfg_attr(not(feature = "window"), allow(dead_code, reason = "a window sends some of these"))]
pub(crate) enum PreviewMessage {
    /// The watcher did something, at this moment.
    Event(Event, Instant),
    /// There is a window.
    Opened(Window),
    /// There is none and will be none: what it would have shown is drawn instead.
    NoWindow(Box<InitialView>),
    /// The window wants this.
    Wanted(Subject),
    /// The window's state is to be kept.
    Keep(String),
    /// A picture is to be kept.
    Keepsake(Subject, Picture),
    /// The window is to close, also one that is still to come.
    Close,
    /// Nothing more will come.
    End,
}

/// Who is shown something.
enum CommandOutput {
    /// Nobody yet.
    None,
    Window(Window),
    /// A file, in place of the window that would have had these settings.
    Still(Box<InitialView>),
}

/// What is to be done once all letters are read.
#[derive(Default)]
struct Tasks {
    /// To read the manifest again.
    plan: bool,
    /// To see what was built.
    shelf: bool,
    /// To show what is wanted even where it was shown already.
    show: bool,
    message: Option<Message>,
    state: Option<String>,
    pictures: Vec<(Subject, Picture)>,
    end: bool,
}

/// See the module.
pub(crate) struct PreviewController<'a> {
    opening: &'a WindowRequest<'a>,
    /// Stops the watcher: without a window, once there is a still.
    cancel: &'a Cancel,
    keepsakes: PreviewFiles,
    start: Instant,
    audience: CommandOutput,
    closing: bool,
    /// Whether the watcher has done what it can until something changes.
    built: bool,
    gazette: BuildStatus,
    showcase: Option<PreviewCatalog>,
    /// What was built of the showcase's plan.
    shelf: Option<Result<ResultsSnapshot, Error>>,
    gallery: SceneCache,
    wanted: Option<Subject>,
    /// The items that what is wanted is made of; the last of them reflects.
    ancestry: Vec<ItemName>,
    shown: Option<(Subject, Scene, SubjectDetails)>,
    /// Why what is wanted cannot be shown.
    amiss: Vec<String>,
    told: Told,
}

/// What the window was told last.
#[derive(Default)]
struct Told {
    catalogue: Catalog,
    status: String,
    failure: Vec<String>,
}

impl<'a> PreviewController<'a> {
    pub(crate) fn new(opening: &'a WindowRequest<'a>, cancel: &'a Cancel) -> Self {
        Self {
            opening,
            cancel,
            keepsakes: PreviewFiles::beside(opening.manifest),
            start: Instant::now(),
            audience: CommandOutput::None,
            closing: false,
            built: false,
            gazette: BuildStatus::default(),
            showcase: None,
            shelf: None,
            gallery: SceneCache::default(),
            wanted: None,
            ancestry: Vec::new(),
            shown: None,
            amiss: Vec::new(),
            told: Told::default(),
        }
    }

    /// Works until [`PreviewMessage::End`].
    pub(crate) fn run(mut self, letters: &Receiver<PreviewMessage>) {
        while let Ok(letter) = letters.recv() {
            if self.answer(iter::once(letter).chain(letters.try_iter())) {
                return;
            }
        }
    }

    /// Reads letters and does what they ask for; whether nothing more will come.
    fn answer(&mut self, letters: impl IntoIterator<Item = PreviewMessage>) -> bool {
        let mut tasks = Tasks::default();
        letters.into_iter().for_each(|letter| self.take(letter, &mut tasks));
        let end = tasks.end;
        self.act(tasks);
        end
    }

    fn take(&mut self, letter: PreviewMessage, tasks: &mut Tasks) {
        match letter {
            PreviewMessage::Event(event, at) => self.hear(&event, at, tasks),
            PreviewMessage::Opened(window) => {
                self.audience = CommandOutput::Window(window);
                self.told = Told::default();
                if self.closing {
                    self.tell(PreviewUpdate::Close);
                }
                (tasks.plan, tasks.shelf, tasks.show) = (true, true, true);
            }
            PreviewMessage::NoWindow(settings) => {
                self.audience = CommandOutput::Still(settings);
                // What a window was told that is gone is told again.
                (self.told, self.shown) = (Told::default(), None);
                (tasks.plan, tasks.shelf) = (true, true);
            }
            PreviewMessage::Wanted(subject) => {
                tasks.show = true;
                self.wanted = Some(subject);
            }
            PreviewMessage::Keep(state) => tasks.state = Some(state),
            PreviewMessage::Keepsake(subject, picture) => tasks.pictures.push((subject, picture)),
            PreviewMessage::Close => {
                self.closing = true;
                self.tell(PreviewUpdate::Close);
            }
            PreviewMessage::End => tasks.end = true,
        }
    }

    fn hear(&mut self, event: &Event, at: Instant, tasks: &mut Tasks) {
        let now = at.saturating_duration_since(self.start).as_secs_f64() * 1e3;
        if let Some(message) = self.gazette.hear(event, now) {
            tasks.message = Some(message);
        }
        match event {
            Event::Planned { .. } => (self.built, tasks.plan) = (false, true),
            // It is shown before its exports are written.
            Event::Finished { item, .. } | Event::UpToDate { item } => {
                tasks.shelf |= self.ancestry.last() == Some(item);
            }
            Event::Ended(summary) => (self.built, tasks.shelf) = (!summary.cancelled, true),
            Event::Rejected { .. } | Event::BuildError { .. } => self.built = true,
            _ => {}
        }
    }

    fn act(&mut self, tasks: Tasks) {
        if let Some(state) = &tasks.state
            && let Err(error) = self.keepsakes.keep_state(state)
        {
            say!("warning: the window's state cannot be kept: {error}");
        }
        for (subject, picture) in &tasks.pictures {
            let (title, line) = match self.keepsakes.keep_picture(subject, picture) {
                Ok(file) => ("kept the picture", file.display().to_string()),
                Err(error) => ("the picture was not kept", error.to_string()),
            };
            self.tell(PreviewUpdate::Toast { title: title.into(), lines: vec![line] });
        }
        if tasks.end || matches!(self.audience, CommandOutput::None) {
            return;
        }
        if tasks.plan {
            self.read_plan();
        }
        if tasks.plan || tasks.shelf {
            self.shelf = self.showcase.as_ref().map(|showcase| ResultsSnapshot::open(showcase.plan()));
        }
        if tasks.plan || tasks.shelf || tasks.show {
            self.amiss = self.show(tasks.show).err().unwrap_or_default();
        }
        self.tell_state();
        if let Some(Message { title, lines }) = tasks.message {
            self.tell(PreviewUpdate::Toast { title, lines });
        }
        if matches!(self.audience, CommandOutput::Still(_)) && self.built && !self.opening.goes_on_without {
            self.cancel.cancel();
        }
    }

    /// Where the manifest has faults, the watcher tells them, and what it was stays.
    fn read_plan(&mut self) {
        let Ok(plan) = Plan::load(self.opening.manifest, self.opening.kinds) else { return };
        let showcase = PreviewCatalog::among(plan, self.opening.stages);
        let catalogue = showcase.catalogue();
        if self.told.catalogue != catalogue {
            // For what is no longer there the window wants something else.
            self.wanted.take_if(|wanted| subject::check(&showcase, &subject::wish(wanted)).is_err());
            self.told.catalogue = catalogue.clone();
            self.tell(PreviewUpdate::Catalog(catalogue));
        }
        self.showcase = Some(showcase);
    }

    /// Shows what is wanted, where it is not shown already or `anyway`.
    ///
    /// # Errors
    /// Why it cannot be shown.
    fn show(&mut self, anyway: bool) -> Result<(), Vec<String>> {
        let Some(showcase) = &self.showcase else { return Ok(()) };
        self.ancestry.clear();
        if showcase.is_empty() {
            return Err(subject::nothing(self.opening.manifest, self.opening.stages).lines());
        }
        if let CommandOutput::Still(settings) = &self.audience {
            self.wanted = Some(settings.subject(&showcase.catalogue()));
        }
        let (Some(subject), Some(shelf)) = (self.wanted.clone(), &self.shelf) else { return Ok(()) };
        let shelf = shelf.as_ref().map_err(|error| error.chain().to_vec())?;
        let exhibit = subject::exhibit(showcase, &subject.environment, &subject.material);
        let exhibit = exhibit.map_err(SubjectError::lines)?;
        let plan = showcase.plan();
        self.ancestry.extend(exhibit.ancestry.iter().map(|item| {
            let item = &plan.items[*item];
            ItemName { stage: plan.stages[item.stage].name.clone(), key: item.key.clone() }
        }));
        let scene = match self.gallery.scene(showcase, shelf, exhibit, &subject.mesh) {
            Ok(scene) => scene,
            // What is not there yet is being made.
            Err(_) if self.gazette.is_building() => return Ok(()),
            Err(failure) => {
                let mut lines = vec![format!("{} cannot be shown", subject::told(&subject))];
                lines.extend(failure.chain);
                lines.extend(failure.help.map(|help| format!("hint: {help}")));
                return Err(lines);
            }
        };
        let facts = showcase.facts(shelf, exhibit);
        let is_still = matches!(self.audience, CommandOutput::Still(_));
        let is_shown = self.shown.as_ref().is_some_and(|(shown, other, told)| {
            *shown == subject && is_same(other, &scene) && (is_still || *told == facts)
        });
        if is_shown && !anyway {
            return Ok(());
        }
        self.shown = Some((subject.clone(), scene.clone(), facts.clone()));
        match &self.audience {
            CommandOutput::None => {}
            CommandOutput::Window(window) => {
                // The map that every window begins with is made here, where nobody waits for it.
                scene.objects.iter().for_each(|object| _ = object.look.local());
                window(PreviewUpdate::Scene { subject, scene, details: facts });
            }
            CommandOutput::Still(settings) => self.draw(settings, &subject, &scene),
        }
        Ok(())
    }

    /// Draws the still that stands in for the window.
    fn draw(&self, settings: &InitialView, subject: &Subject, scene: &Scene) {
        let file = self.keepsakes.still();
        let shot = settings.shot(scene.framing(), still::SIZE);
        let stop = || self.cancel.is_cancelled();
        let drawn = match still::draw(scene, &shot, Backend::Cpu, &stop) {
            Ok(drawn) => drawn,
            Err(RenderError::Cancelled) => return,
            Err(error) => {
                let message = format!("{} cannot be drawn", subject::told(subject));
                return print::error(&[message, error.to_string()], None);
            }
        };
        match self.keepsakes.keep_still(&drawn.picture) {
            Ok(()) => say!("{}", drawn.told(&file, subject, &shot)),
            Err(error) => {
                print::error(&[format!("cannot write {}", file.display()), error.to_string()], None)
            }
        }
    }

    /// The line of what goes on and the errors that stand, where they differ from what was told.
    fn tell_state(&mut self) {
        let status = self.gazette.status();
        if self.told.status != status {
            self.told.status.clone_from(&status);
            self.tell(PreviewUpdate::Status(status));
        }
        let mut failure = self.gazette.failures();
        failure.extend(self.amiss.iter().cloned());
        if !failure.is_empty() {
            failure.insert(0, self.headline().into());
        }
        if self.told.failure != failure {
            self.told.failure.clone_from(&failure);
            if matches!(self.audience, CommandOutput::Still(_)) && !self.amiss.is_empty() {
                print::error(&self.amiss, None);
            }
            self.tell(PreviewUpdate::Failure((!failure.is_empty()).then_some(failure)));
        }
    }

    /// What the errors that stand mean for the picture.
    fn headline(&self) -> &'static str {
        match (&self.shown, self.amiss.is_empty()) {
            (None, _) => "This did not work",
            (Some(_), false) => "This cannot be shown; the picture is the one before",
            (Some(_), true) if self.gazette.is_of(&self.ancestry) => {
                "This did not work; the picture is the last good one"
            }
            (Some(_), true) => "Something did not work that this picture is not made of",
        }
    }

    fn tell(&self, news: PreviewUpdate) {
        if let CommandOutput::Window(window) = &self.audience {
            window(news);
        }
    }
}

/// Whether two scenes are made of the same values.
fn is_same(one: &Scene, other: &Scene) -> bool {
    one.objects.len() == other.objects.len()
        && one
            .objects
            .iter()
            .zip(&other.objects)
            .all(|(one, other)| Arc::ptr_eq(&one.mesh, &other.mesh) && Arc::ptr_eq(&one.look, &other.look))
}

#[cfg(test)]
mod tests;
