//! Between the watcher and the window or page: reads the results of the last build, and shows the subject
//! that is wanted.
//!
//! The view, the watcher and Ctrl-C all send a [`PreviewMessage`]. The controller reads all the messages
//! that are there before it acts: of several requests for a subject it answers the latest.

use std::iter;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::mpsc::Receiver;
use std::time::Instant;

use ::preview::{
    Aim, Catalog, Light, List, Object, Picture, PreviewUpdate, Scene, Subject, SubjectDetails, SubjectRequest,
};
use engine::{Error, Event, ItemIndex, ItemName, Plan, ResultsSnapshot, Wanted};
use stages::{PreviewCatalog, SceneCache};

use super::dropped::{self, DroppedProject, Shown};
use super::files::PreviewFiles;
use super::material_edit::MaterialEdits;
use super::project::{self, Project};
use super::request::{ViewPlace, ViewRequest};
use super::status::{BuildStatus, Toast};
use super::subject;
use super::subject::SubjectError;
use super::watched::WatchedProject;
use crate::print::say;

pub(crate) use edits::MaterialEdit;

/// Sends updates to a window or a page.
type View = Box<dyn Fn(PreviewUpdate) + Send>;

pub(crate) enum PreviewMessage {
    /// An event of the watcher, and when it came.
    Event(Event, Instant),
    /// A view is open.
    Opened(View),
    Show(Subject),
    /// The watcher begins with the project of this manifest.
    Watched(PathBuf),
    Dropped(Vec<PathBuf>),
    /// Show what was shown before files were dropped.
    ReturnFromDropped,
    SaveState(String),
    SavePicture(Subject, Picture),
    Edit(String, MaterialEdit),
    /// Say how a turn of the light would be written to the manifest.
    ProposeLight(Aim),
    /// Write a turn of the light to the manifest, if these lines still say what changes.
    SaveLight(Aim, Vec<String>),
    /// Close the view, even if it has not opened yet.
    Close,
    /// No other message follows.
    End,
}

/// The work that is left to do after all messages are read.
#[derive(Default)]
struct PendingWork {
    /// Read the manifest again.
    load_plan: bool,
    /// Read the results of the last build.
    load_results: bool,
    /// Show the subject even if it is shown already.
    show: bool,
    toast: Option<Toast>,
    dropped: Vec<PathBuf>,
    return_from_dropped: bool,
    state: Option<String>,
    pictures: Vec<(Subject, Picture)>,
    /// The edits in order, but of several values to show only the last.
    edits: Vec<(String, MaterialEdit)>,
    proposed_light: Option<Aim>,
    saved_light: Option<edits::SavedLight>,
    /// Read the file of the shown material again.
    read_material: bool,
    end: bool,
}

/// The controller of a preview; see the module's documentation.
pub(crate) struct PreviewController<'a> {
    request: &'a ViewRequest<'a>,
    watched: &'a WatchedProject,
    project: Project,
    /// Whether the watcher of the project in the window has not begun.
    awaits_watcher: bool,
    /// The projects before files were dropped, each with its subject; the last is the latest.
    before: Vec<(Project, Option<Subject>)>,
    /// The folder for projects of files.
    cache: PathBuf,
    files: PreviewFiles,
    start: Instant,
    view: Option<View>,
    closing: bool,
    status: BuildStatus,
    catalog: Option<PreviewCatalog>,
    /// The results of the catalog's plan.
    results: Option<Result<ResultsSnapshot, Error>>,
    scenes: SceneCache,
    edits: MaterialEdits,
    /// The subject to show.
    wanted: Option<Subject>,
    /// The items that the wanted subject depends on.
    ancestry: Vec<ItemName>,
    /// The items that the scene of the wanted subject is read from: environment, material, mesh and
    /// reflection.
    parts: Vec<ItemName>,
    /// The items of the wanted subject that the watcher builds first.
    goes_first: Wanted,
    shown: Option<(Subject, Scene, SubjectDetails)>,
    /// A turn of the light that was written, until a scene has it, and the light that was shown without it.
    written_light: Option<(Aim, Option<Arc<Light>>)>,
    /// Why dropped files cannot be shown.
    dropped_error: Vec<String>,
    /// Why the wanted subject cannot be shown.
    error: Vec<String>,
    sent: Sent,
}

/// The latest updates that were sent.
#[derive(Default)]
struct Sent {
    catalog: Catalog,
    status: String,
    failure: Vec<String>,
}

impl<'a> PreviewController<'a> {
    pub(crate) fn new(request: &'a ViewRequest<'a>, watched: &'a WatchedProject) -> Self {
        Self {
            request,
            watched,
            project: request.project.clone(),
            awaits_watcher: false,
            before: Vec::new(),
            cache: project::cache_folder(),
            files: PreviewFiles::beside(&request.project.manifest).with_screenshots(request.screenshots),
            start: Instant::now(),
            view: None,
            closing: false,
            status: BuildStatus::default(),
            catalog: None,
            results: None,
            scenes: SceneCache::default(),
            edits: MaterialEdits::default(),
            wanted: None,
            ancestry: Vec::new(),
            parts: Vec::new(),
            goes_first: Wanted::default(),
            shown: None,
            written_light: None,
            dropped_error: Vec::new(),
            error: Vec::new(),
            sent: Sent::default(),
        }
    }

    /// The items that the watcher is to build first: those of the subject that is shown, or is to be.
    pub(crate) fn goes_first(&self) -> Wanted {
        self.goes_first.clone()
    }

    /// Works until [`PreviewMessage::End`].
    pub(crate) fn run(mut self, messages: &Receiver<PreviewMessage>) {
        while let Ok(message) = messages.recv() {
            if self.handle_all(iter::once(message).chain(messages.try_iter())) {
                return;
            }
        }
    }

    /// Reads messages and then acts; returns whether no other message follows.
    fn handle_all(&mut self, messages: impl IntoIterator<Item = PreviewMessage>) -> bool {
        let mut work = PendingWork::default();
        messages.into_iter().for_each(|message| self.handle(message, &mut work));
        let end = work.end;
        self.act(work);
        end
    }

    fn handle(&mut self, message: PreviewMessage, work: &mut PendingWork) {
        match message {
            PreviewMessage::Event(event, at) => self.handle_event(&event, at, work),
            PreviewMessage::Opened(view) => {
                self.view = Some(view);
                self.sent = Sent::default();
                self.edits.reopened();
                if self.closing {
                    self.send(PreviewUpdate::Close);
                }
                (work.load_plan, work.load_results, work.show) = (true, true, true);
            }
            PreviewMessage::Show(subject) => {
                work.show = true;
                self.dropped_error.clear();
                self.wanted = Some(subject);
            }
            PreviewMessage::Watched(manifest) => {
                if self.project.manifest == manifest {
                    (self.awaits_watcher, self.status) = (false, BuildStatus::default());
                }
            }
            PreviewMessage::Dropped(files) => work.dropped.extend(files),
            PreviewMessage::ReturnFromDropped => work.return_from_dropped = true,
            PreviewMessage::SaveState(state) => work.state = Some(state),
            PreviewMessage::Edit(material, edit) => {
                let is_show = |edit: &MaterialEdit| matches!(edit, MaterialEdit::Show(_));
                let replaced = |last: &mut (String, MaterialEdit)| {
                    last.0 == material && is_show(&last.1) && is_show(&edit)
                };
                work.edits.pop_if(replaced);
                work.edits.push((material, edit));
            }
            PreviewMessage::ProposeLight(turn) => work.proposed_light = Some(turn),
            PreviewMessage::SaveLight(turn, lines) => {
                work.saved_light = Some(edits::SavedLight { turn, lines })
            }
            PreviewMessage::SavePicture(subject, picture) => work.pictures.push((subject, picture)),
            PreviewMessage::Close => {
                self.closing = true;
                self.send(PreviewUpdate::Close);
            }
            PreviewMessage::End => work.end = true,
        }
    }

    fn handle_event(&mut self, event: &Event, at: Instant, work: &mut PendingWork) {
        if self.awaits_watcher {
            // It is of the project before.
            return;
        }
        let now = at.saturating_duration_since(self.start).as_secs_f64() * 1e3;
        if let Some(toast) = self.status.update(event, now) {
            work.toast = Some(toast);
        }
        match event {
            Event::Planned { .. } => work.load_plan = true,
            // Light and material are shown before their maps are made, and these before they are exported.
            Event::Finished { item, .. } | Event::UpToDate { item, .. } => {
                work.load_results |= self.parts.contains(item);
            }
            Event::Ended(_) => work.load_results = true,
            _ => {}
        }
    }

    fn act(&mut self, mut work: PendingWork) {
        if let Some(state) = &work.state
            && let Err(error) = self.files.save_state(state)
        {
            say!("warning: cannot save the window's state: {error}");
        }
        for (subject, picture) in &work.pictures {
            let (title, line) = match self.files.save_picture(subject, picture) {
                Ok(file) => ("saved the picture", crate::working_folder::name(&file)),
                Err(error) => ("the picture was not saved", error.to_string()),
            };
            self.send(PreviewUpdate::Toast { title: title.into(), lines: vec![line] });
        }
        let is_edited = !work.edits.is_empty();
        self.edit_materials(&mut work);
        self.edit_light(&mut work);
        if work.end {
            for file in self.edits.unsaved() {
                say!("warning: the changes of {} were not saved", crate::working_folder::name(file));
            }
        }
        if work.end || self.view.is_none() {
            return;
        }
        self.change_project(&mut work);
        if work.load_plan {
            self.load_plan();
        }
        if work.load_plan || work.load_results {
            self.results = self.catalog.as_ref().map(|catalog| ResultsSnapshot::open(catalog.plan()));
        }
        if work.load_plan || work.load_results || work.show || is_edited {
            self.error = self.show(&work).err().unwrap_or_default();
        }
        self.send_status();
        if let Some(Toast { title, lines }) = work.toast {
            self.send(PreviewUpdate::Toast { title, lines });
        }
    }

    /// Goes over to the project of the files that were dropped, or back to the one before.
    fn change_project(&mut self, work: &mut PendingWork) {
        let files = std::mem::take(&mut work.dropped);
        let mut changes = Vec::new();
        if !files.is_empty() {
            changes.push(self.show_dropped(&files));
        }
        if work.return_from_dropped {
            changes.push(self.return_from_dropped());
        }
        for change in changes {
            match change {
                Ok(toast) => (work.toast, work.show) = (Some(toast), true),
                Err(lines) => self.dropped_error = lines,
            }
        }
    }

    fn show_dropped(&mut self, files: &[PathBuf]) -> Result<Toast, Vec<String>> {
        let shown =
            Shown { project: &self.project, catalog: self.catalog.as_ref(), subject: self.wanted.as_ref() };
        let DroppedProject { project, chosen, toast } = dropped::project_of(files, &shown, &self.cache)?;
        let before = (self.project.clone(), self.wanted.clone());
        self.open(project, chosen)?;
        self.before.push(before);
        say!("{}; {}", toast.title, toast.lines.join("; "));
        Ok(toast)
    }

    fn return_from_dropped(&mut self) -> Result<Toast, Vec<String>> {
        self.dropped_error.clear();
        let Some((project, subject)) = self.before.pop() else {
            return Ok(Toast { title: "no files were dropped".into(), lines: Vec::new() });
        };
        let title = format!("back to {}", dropped::name_of(&project));
        let chosen = subject.as_ref().map(subject::request).unwrap_or_default();
        if let Err(lines) = self.open(project.clone(), chosen) {
            self.before.push((project, subject));
            return Err(lines);
        }
        say!("{title}");
        Ok(Toast { title, lines: Vec::new() })
    }

    /// Shows another project, with these parts of the subject chosen.
    ///
    /// # Errors
    /// If it is not valid, or has nothing to show; then the project stays that it was.
    fn open(&mut self, project: Project, chosen: SubjectRequest) -> Result<(), Vec<String>> {
        let plan = Plan::load(&project.manifest, self.request.kinds)
            .map_err(|errors| errors.to_string().lines().map(str::to_owned).collect::<Vec<_>>())?;
        let plan_catalog = PreviewCatalog::among(plan, &project.stages);
        if plan_catalog.is_empty() {
            return Err(subject::nothing_to_preview(&project.manifest, &project.stages).lines());
        }
        self.check_edits(&plan_catalog)?;
        self.files = PreviewFiles::beside(&project.manifest).with_screenshots(self.request.screenshots);
        self.watched.change(project.clone());
        (self.project, self.awaits_watcher) = (project, true);
        self.status = BuildStatus::default();
        self.dropped_error.clear();
        let catalog = plan_catalog.catalog();
        let now = self.wanted.take().unwrap_or_default();
        let mut wanted = now.clone();
        let parts = [&chosen.environment, &chosen.material, &chosen.mesh];
        for (list, name) in List::ALL.into_iter().zip(parts) {
            if let Some(name) = name {
                list.chosen(&mut wanted).clone_from(name);
            }
        }
        self.wanted = Some(catalog.nearest(&wanted, &chosen, &now));
        self.send(PreviewUpdate::Choose(chosen));
        self.sent.catalog = catalog.clone();
        self.send(PreviewUpdate::Catalog(catalog));
        self.results = Some(ResultsSnapshot::open(plan_catalog.plan()));
        self.catalog = Some(plan_catalog);
        Ok(())
    }

    /// If the manifest has errors, the watcher reports them, and the catalog stays as it was.
    fn load_plan(&mut self) {
        let Ok(plan) = Plan::load(&self.project.manifest, self.request.kinds) else { return };
        let plan_catalog = PreviewCatalog::among(plan, &self.project.stages);
        let catalog = plan_catalog.catalog();
        if self.sent.catalog != catalog {
            // If the wanted subject is gone, the window asks for another one.
            self.wanted.take_if(|wanted| subject::check(&plan_catalog, &subject::request(wanted)).is_err());
            self.sent.catalog = catalog.clone();
            self.send(PreviewUpdate::Catalog(catalog));
        }
        self.catalog = Some(plan_catalog);
    }

    /// Shows the wanted subject, unless it is shown already and not requested again.
    ///
    /// # Errors
    /// If the subject cannot be shown.
    fn show(&mut self, work: &PendingWork) -> Result<(), Vec<String>> {
        let Some(catalog) = &self.catalog else { return Ok(()) };
        self.ancestry.clear();
        self.parts.clear();
        if catalog.is_empty() {
            let Project { manifest, stages, .. } = &self.project;
            return Err(subject::nothing_to_preview(manifest, stages).lines());
        }
        let (Some(subject), Some(results)) = (self.wanted.clone(), &self.results) else { return Ok(()) };
        let results = results.as_ref().map_err(|error| error.chain().to_vec())?;
        let entry = subject::entry(catalog, &subject.environment, &subject.material);
        let entry = entry.map_err(SubjectError::lines)?;
        let plan = catalog.plan();
        let name = |item: &ItemIndex| plan.item_name(*item);
        self.ancestry.extend(entry.ancestry.iter().map(name));
        self.parts.extend(catalog.parts(entry, &subject.mesh).iter().map(name));
        self.goes_first.set(catalog.items(entry, &subject.mesh).iter().map(name).collect());
        if let Some(view) = &self.view {
            let file = catalog.material_file(entry);
            let update = self.edits.follow(&subject.material, file, work.load_plan || work.read_material);
            update.into_iter().for_each(view);
        }
        let edited = self.edits.material(&subject.material, || catalog.material(results, entry))?;
        let scene = match &edited {
            Some(edited) => self.scenes.edited(catalog, results, entry, &subject.mesh, edited),
            None => self.scenes.scene(catalog, results, entry, &subject.mesh),
        };
        let scene = match scene {
            Ok(scene) => scene,
            // The build that runs may make what is missing.
            Err(_) if self.status.is_building() => return Ok(()),
            Err(failure) => {
                let mut lines = vec![format!("{} cannot be shown", subject::describe(&subject))];
                lines.extend(failure.chain);
                lines.extend(failure.help.map(|help| format!("hint: {help}")));
                return Err(lines);
            }
        };
        let details = catalog.facts(results, entry);
        let is_shown = self.shown.as_ref().is_some_and(|(shown, shown_scene, shown_details)| {
            *shown == subject && is_same(shown_scene, &scene) && *shown_details == details
        });
        if is_shown && !work.show {
            return Ok(());
        }
        self.shown = Some((subject.clone(), scene.clone(), details.clone()));
        if let Some(view) = &self.view {
            // Every view begins with these; made here, they do not make it wait. A page asks for its maps.
            let _ = scene.light.exposure();
            if self.request.place == ViewPlace::Window {
                let looks = scene.objects.iter().map(|object| &object.look);
                looks.filter(|look| look.has_maps()).for_each(|look| _ = look.local());
            }
            let is_turned = catalog.is_light_turned(results, entry);
            let written = self.written_light.take_if(|(_, before)| {
                is_turned && before.as_ref().is_none_or(|before| !Arc::ptr_eq(before, &scene.light))
            });
            if let Some((turn, _)) = written {
                view(PreviewUpdate::LightSaved(turn));
            }
            view(PreviewUpdate::Scene { subject, scene, details });
        }
        Ok(())
    }

    /// Sends the status line and the errors, if they changed.
    fn send_status(&mut self) {
        let status = self.status.line();
        if self.sent.status != status {
            self.sent.status.clone_from(&status);
            self.send(PreviewUpdate::Status(status));
        }
        let mut failure = self.status.errors().lines();
        failure.extend(self.error.iter().chain(&self.dropped_error).cloned());
        if !failure.is_empty() {
            failure.insert(0, self.headline());
        }
        if self.sent.failure != failure {
            self.sent.failure.clone_from(&failure);
            self.send(PreviewUpdate::Failure((!failure.is_empty()).then_some(failure)));
        }
    }

    /// The headline that says what the errors mean for the picture, in any mode.
    fn headline(&self) -> String {
        let errors = self.status.errors();
        let headline = match (&self.shown, self.error.is_empty()) {
            _ if !self.dropped_error.is_empty() => "The dropped files cannot be shown",
            (None, _) if errors.rejects_manifest() && self.status.has_build() => {
                return self.manifest_has_errors("the last valid one is still being built");
            }
            (None, _) => "There is nothing to show",
            (Some(_), false) => "This cannot be shown; this is an earlier picture",
            (Some(_), true) if errors.rejects_manifest() => {
                return self.manifest_has_errors(match self.status.has_build() {
                    true => "the last valid one is still being built, and shown",
                    false => "the last valid one is still shown",
                });
            }
            (Some((_, scene, _)), true) if errors.affects(&self.ancestry) => match scene.has_maps() {
                true => "The build failed; this picture is the last good one",
                false => "The build failed; this picture shows earlier results",
            },
            (Some(_), true) => "A stage failed; this picture does not depend on it",
        };
        headline.into()
    }

    fn manifest_has_errors(&self, but: &str) -> String {
        format!("{} has errors; {but}", dropped::name_of(&self.project))
    }

    fn send(&self, update: PreviewUpdate) {
        if let Some(view) = &self.view {
            view(update);
        }
    }
}

/// Whether two scenes consist of the same values.
fn is_same(one: &Scene, other: &Scene) -> bool {
    let same_object = |(one, other): (&Object, &Object)| {
        let transfer = |object: &Object| object.transfer.as_ref().map(Arc::as_ptr);
        Arc::ptr_eq(&one.mesh, &other.mesh)
            && Arc::ptr_eq(&one.look, &other.look)
            && transfer(one) == transfer(other)
    };
    one.objects.len() == other.objects.len() && one.objects.iter().zip(&other.objects).all(same_object)
}

mod edits;
#[cfg(test)]
mod tests;
