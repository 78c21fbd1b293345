//! Between the watcher and the window: reads what was built last and shows what is wanted of it.
//!
//! Everything comes as a [`Letter`], from the window, the watcher and Ctrl-C. Those that have come meanwhile are read before
//! anything is done: of several wishes the newest is answered.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::mpsc::Receiver;
use std::time::Instant;

use ::preview::window::{Catalogue, Facts, News, NewsSender, Subject, WindowSettings};
use ::preview::{Picture, RenderError, Scene};
use engine::{Cancel, Event, ItemName, Kinds, Plan, Shelf};
use stages::{Gallery, Showcase};

use super::gazette::{Gazette, Message};
use super::keepsakes::{self, Keepsakes};
use super::{still, subject};
use crate::arguments::Backend;
use crate::print::{self, say};

/// What the curator is told.
pub(crate) enum Letter {
    /// The watcher did something, at this moment.
    Event(Event, Instant),
    /// There is a window.
    Opened(NewsSender),
    /// There is none and will be none: what it would have shown is drawn instead.
    NoWindow(Box<WindowSettings>),
    /// The window wants this.
    Wanted(Subject),
    /// The window's state is to be kept.
    Keep(String),
    /// A picture is to be kept.
    Keepsake(Picture, PathBuf),
    /// The window is to close.
    Close,
    /// Nothing more will come.
    End,
}

/// Who is shown something.
enum Audience {
    /// Nobody yet.
    None,
    Window(NewsSender),
    /// A file, in place of the window that would have had these settings.
    Still(Box<WindowSettings>),
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
    pictures: Vec<(Picture, PathBuf)>,
    close: bool,
    /// A build went to its end.
    built: bool,
    end: bool,
}

/// See the module.
pub(crate) struct Curator<'a> {
    manifest: &'a Path,
    kinds: &'a Kinds,
    /// Stops the watcher: without a window, once there is a still.
    cancel: &'a Cancel,
    /// Whether the watcher goes on without a window.
    goes_on_without: bool,
    keepsakes: Keepsakes,
    start: Instant,
    audience: Audience,
    gazette: Gazette,
    showcase: Option<Showcase>,
    shelf: Option<Shelf>,
    gallery: Gallery,
    wanted: Option<Subject>,
    /// The item that reflects what is wanted.
    reflection: Option<ItemName>,
    shown: Option<(Subject, Scene, Facts)>,
    /// Why what is wanted cannot be shown.
    amiss: Vec<String>,
    told: Told,
}

/// What the window was told last.
#[derive(Default)]
struct Told {
    catalogue: Catalogue,
    status: String,
    failure: Vec<String>,
}

impl<'a> Curator<'a> {
    pub(crate) fn new(
        manifest: &'a Path,
        kinds: &'a Kinds,
        cancel: &'a Cancel,
        goes_on_without: bool,
    ) -> Self {
        Self {
            manifest,
            kinds,
            cancel,
            goes_on_without,
            keepsakes: Keepsakes::beside(manifest),
            start: Instant::now(),
            audience: Audience::None,
            gazette: Gazette::default(),
            showcase: None,
            shelf: None,
            gallery: Gallery::default(),
            wanted: None,
            reflection: None,
            shown: None,
            amiss: Vec::new(),
            told: Told::default(),
        }
    }

    /// Works until [`Letter::End`].
    pub(crate) fn run(mut self, letters: &Receiver<Letter>) {
        while let Ok(letter) = letters.recv() {
            let mut tasks = Tasks::default();
            self.take(letter, &mut tasks);
            while let Ok(letter) = letters.try_recv() {
                self.take(letter, &mut tasks);
            }
            let end = tasks.end;
            self.act(tasks);
            if end {
                return;
            }
        }
    }

    fn take(&mut self, letter: Letter, tasks: &mut Tasks) {
        match letter {
            Letter::Event(event, at) => self.hear(&event, at, tasks),
            Letter::Opened(window) => {
                self.audience = Audience::Window(window);
                self.told = Told::default();
                (tasks.plan, tasks.shelf, tasks.show) = (true, true, true);
            }
            Letter::NoWindow(settings) => {
                self.audience = Audience::Still(settings);
                (tasks.plan, tasks.shelf) = (true, true);
            }
            Letter::Wanted(subject) => {
                tasks.show = true;
                self.wanted = Some(subject);
            }
            Letter::Keep(state) => tasks.state = Some(state),
            Letter::Keepsake(picture, file) => tasks.pictures.push((picture, file)),
            Letter::Close => tasks.close = true,
            Letter::End => tasks.end = true,
        }
    }

    fn hear(&mut self, event: &Event, at: Instant, tasks: &mut Tasks) {
        let now = at.saturating_duration_since(self.start).as_secs_f64() * 1e3;
        if let Some(message) = self.gazette.hear(event, now) {
            tasks.message = Some(message);
        }
        match event {
            Event::Planned { .. } => tasks.plan = true,
            // It is shown before its exports are written.
            Event::Finished { item, .. } | Event::UpToDate { item } => {
                tasks.shelf |= self.reflection.as_ref() == Some(item);
            }
            Event::Ended(summary) => {
                tasks.shelf = true;
                tasks.built |= !summary.cancelled;
            }
            _ => {}
        }
    }

    fn act(&mut self, tasks: Tasks) {
        if let Some(state) = &tasks.state
            && let Err(error) = self.keepsakes.keep_state(state)
        {
            say!("warning: the window's state cannot be kept: {error}");
        }
        for (picture, file) in &tasks.pictures {
            if let Err(error) = keepsakes::write_picture(file, picture) {
                let title = format!("{} cannot be written", file.display());
                self.tell(News::Toast { title, lines: vec![error.to_string()] });
            }
        }
        if tasks.close {
            self.tell(News::Close);
        }
        if tasks.end || matches!(self.audience, Audience::None) {
            return;
        }
        if tasks.plan {
            self.read_plan();
        }
        if tasks.plan || tasks.shelf {
            self.read_shelf();
        }
        if tasks.plan || tasks.shelf || tasks.show {
            self.show(tasks.show);
        }
        self.tell_state();
        if let Some(Message { title, lines }) = tasks.message {
            self.tell(News::Toast { title, lines });
        }
        if matches!(self.audience, Audience::Still(_)) && tasks.built && !self.goes_on_without {
            self.cancel.cancel();
        }
    }

    /// Where the manifest has faults, the watcher tells them, and what it was stays.
    fn read_plan(&mut self) {
        if let Ok(plan) = Plan::load(self.manifest, self.kinds) {
            let showcase = Showcase::of(plan);
            let catalogue = Catalogue {
                environments: showcase.environments().to_vec(),
                materials: showcase.materials().to_vec(),
                meshes: showcase.meshes(),
            };
            self.showcase = Some(showcase);
            if self.told.catalogue != catalogue {
                self.told.catalogue = catalogue.clone();
                self.tell(News::Catalogue(catalogue));
            }
        }
    }

    fn read_shelf(&mut self) {
        let Some(showcase) = &self.showcase else { return };
        match Shelf::open(showcase.plan()) {
            Ok(shelf) => self.shelf = Some(shelf),
            Err(error) => self.amiss = error.chain().to_vec(),
        }
    }

    /// Shows what is wanted, where it is not shown already or `anyway`.
    fn show(&mut self, anyway: bool) {
        if let Audience::Still(settings) = &self.audience {
            self.wanted = Some(settings.subject(self.told.catalogue.clone()));
        }
        let (Some(wanted), Some(showcase), Some(shelf)) = (&self.wanted, &self.showcase, &self.shelf) else {
            return;
        };
        let subject = wanted.clone();
        let exhibit = match subject::exhibit(showcase, &subject.environment, &subject.material) {
            Ok(exhibit) => exhibit,
            Err(amiss) => {
                self.reflection = None;
                self.amiss = vec![amiss.message, amiss.help];
                return;
            }
        };
        let plan = showcase.plan();
        let item = &plan.items[exhibit.reflection];
        self.reflection =
            Some(ItemName { stage: plan.stages[item.stage].name.clone(), key: item.key.clone() });
        let scene = match self.gallery.scene(showcase, shelf, exhibit, &subject.mesh) {
            Ok(scene) => scene,
            Err(failure) => {
                // What is not there yet is being made.
                self.amiss.clear();
                if !self.gazette.is_building() {
                    self.amiss.push(format!("{} cannot be shown", subject::told(&subject)));
                    self.amiss.extend(failure.chain);
                    self.amiss.extend(failure.help.map(|help| format!("hint: {help}")));
                }
                return;
            }
        };
        self.amiss.clear();
        let facts = showcase.facts(shelf, exhibit);
        let is_still = matches!(self.audience, Audience::Still(_));
        let is_shown = self.shown.as_ref().is_some_and(|(shown, other, told)| {
            *shown == subject && is_same(other, &scene) && (is_still || *told == facts)
        });
        if is_shown && !anyway {
            return;
        }
        self.shown = Some((subject.clone(), scene.clone(), facts.clone()));
        match &self.audience {
            Audience::None => {}
            Audience::Window(window) => {
                // The map that every window begins with is made here, where nobody waits for it.
                scene.objects.iter().for_each(|object| _ = object.look.local());
                window.send(News::Scene { subject, scene, facts });
            }
            Audience::Still(settings) => self.draw(settings, &subject, &scene),
        }
    }

    /// Draws the still that stands in for the window.
    fn draw(&self, settings: &WindowSettings, subject: &Subject, scene: &Scene) {
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
        match keepsakes::write_picture(&file, &drawn.picture) {
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
            self.tell(News::Status(status));
        }
        let mut failure = self.gazette.failures();
        failure.extend(self.amiss.iter().cloned());
        if self.told.failure != failure {
            self.told.failure.clone_from(&failure);
            if matches!(self.audience, Audience::Still(_)) && !self.amiss.is_empty() {
                print::error(&self.amiss, None);
            }
            self.tell(News::Failure((!failure.is_empty()).then_some(failure)));
        }
    }

    fn tell(&self, news: News) {
        if let Audience::Window(window) = &self.audience {
            window.send(news);
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
