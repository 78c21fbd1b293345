//! Keeps a graph's outputs up to date: builds, and builds again when something that the graph reads changes.
//!
//! Events of the file system are only hints. Any hint that concerns the graph triggers a *pass*: the manifest
//! is read again if it changed, its sources are expanded again, and a build decides by contents what to run.
//! So a superfluous hint costs only a short check, but a missing one would leave outputs stale. These
//! measures prevent that:
//!
//! - The places that a graph depends on ([`mod@places`]) are recorded while it asks the disk, not guessed.
//! - If a pass watches more places than the one before it, another pass follows, which finds what happened
//!   between reading a place and watching it.
//! - Hints that arrive during a build stop the items that they make stale, and trigger another pass.
//! - A pass that hints triggered checks only what they name, so that an edit in a large project takes no
//!   longer than its own work. After a quiet time another pass checks everything, including the published
//!   files. It also follows if a build published into folders that were not watched before.
//! - If the system's event queue overflows, all watches are renewed and a pass follows.
//! - Folders from which no events arrive are polled instead ([`probe`], [`poller`]).
//!
//! A file that is still being written gives no hint until it is finished ([`unfinished`]). Exported files
//! that somebody removes are restored. A build that causes itself is found ([`rebuild_loop`]), and so is a
//! drive that is mounted ([`mounts`]). If the system refuses an operation, it is tried again after a pause
//! ([`backoff`]). A pass that no change triggered is reported only if it has news ([`event_buffer`]).

use std::collections::{BTreeSet, HashSet};
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use parking_lot::Mutex;

use crate::build::{BuildOptions, BuildSession, Built, WatchedBuild};
use crate::cancel::Cancel;
use crate::error::{Error, ErrorKind};
use crate::event::{Change, Changed, Event};
use crate::kinds::Kinds;
use crate::manifest::Diagnostics;
use crate::plan::{ManifestFile, Plan};
use crate::storage::{LockPurpose, LockTimeout, ReadKind, ReadSet, path_name};
use changes::{Hints, Wakeup};
use event_buffer::{EventBuffer, OutstandingErrors};
use manifest::{ManifestLoader, ManifestSnapshot};
use places::WatchedPlaces;
use rebuild_loop::{BuildTrace, LoopCheck, RebuildLoop};

mod backoff;
mod changes;
mod event_buffer;
mod listener;
mod manifest;
mod mounts;
mod places;
mod poller;
mod probe;
mod rebuild_loop;
mod unfinished;

pub(crate) use backoff::Backoff;
pub(crate) use changes::ChangeCollector;
pub(crate) use listener::WatchMessage;
#[cfg(test)]
pub(crate) use unfinished::WritePauses;

/// The time between two polls if no events arrive and the options do not set it.
const POLL: Duration = Duration::from_millis(500);

/// The first and the longest pause before a build that the system refused is tried again.
const RETRIES: [Duration; 2] = [Duration::from_secs(1), Duration::from_secs(60)];

/// If the places still change after so many looks at the manifest, the pass goes on: events will report the
/// changes.
const MOST_LOOKS: usize = 8;
/// The quiet time after an edit before a pass checks everything.
const CHECK_AFTER: Duration = Duration::from_secs(1);
/// How often the files that a running build has read are added to the watched places.
const PLACES_INTERVAL: Duration = Duration::from_millis(100);

/// How a watcher watches and builds.
#[derive(Clone, Debug)]
pub struct WatchOptions {
    /// The options of each build; the watcher sets `dry_run`, `lock_purpose` and `lock_timeout` itself, and
    /// forces nothing after the first build that was not stopped.
    pub build: BuildOptions,
    /// The quiet time after a change before it is built, so that files are complete. Up to 20 ms it is cut to
    /// 2 ms if every changed file was closed by its writer or renamed to its place.
    pub debounce: Duration,
    /// Poll the files this often instead of listening for events.
    pub poll: Option<Duration>,
    /// Return after the first rebuild that a change triggered, even if it failed.
    pub once: bool,
    /// The most memory for decoded artifacts, measured by their encoded bytes.
    pub memory: u64,
    /// The size that the cache is trimmed to while the watcher is idle.
    pub cache_limit: Option<u64>,
}

/// Builds, then builds again whenever a file that the graph reads changes, until `cancel` is cancelled.
///
/// Events come one at a time. Errors of the manifest and of a build are reported as events, and the watcher
/// goes on. If the system refuses an operation (a full disk, a folder that cannot be written), it is tried
/// again after a pause of a second, then of 2, 4 and so on up to a minute; tries that fail in the same way
/// are not reported. An [`Event::Noticed`] is followed by a build's events up to its end, even if nothing had
/// to be done, or by [`Event::Rejected`] or [`Event::BuildError`] if nothing can be built. A pass that no
/// change triggered reports nothing unless it finds something to do.
///
/// # Errors
/// If threads cannot be started, or if the first valid manifest does not have a stage that was asked for.
pub fn watch(
    manifest: &ManifestFile,
    kinds: &Kinds,
    options: &WatchOptions,
    cancel: &Cancel,
    events: &(dyn Fn(Event) + Sync),
) -> Result<(), Error> {
    let collector = ChangeCollector::new(options.debounce, options.poll, POLL);
    Watcher::new(manifest, kinds, options, cancel, events, collector)?.run()
}

pub(crate) struct Watcher<'a> {
    manifest: PathBuf,
    options: &'a WatchOptions,
    build: BuildOptions,
    cancel: &'a Cancel,
    events: &'a (dyn Fn(Event) + Sync),
    session: BuildSession,
    loader: ManifestLoader<'a>,
    collector: ChangeCollector,
    /// The errors of the manifest that were reported and still stand.
    rejected: Option<Diagnostics>,
    /// The errors of builds that were reported and still stand.
    outstanding: OutstandingErrors,
    /// The pauses before a build that the system refused is tried again.
    pub(crate) retry: Backoff,
    /// The changes that triggered the current pass.
    changed: BTreeSet<PathBuf>,
    /// Whether nothing else can have changed since the last build.
    is_all: bool,
    /// The time after a build that did not check everything until a pass does.
    pub(crate) check_after: Duration,
    /// The exported files, relative to `out`, that the last build removed.
    removed_by_build: HashSet<String>,
    /// Whether there was a build that did not fail as a whole.
    has_built: bool,
    /// Whether a change was reported and no build has ended since.
    has_unanswered_change: bool,
    /// The last valid plan.
    plan: Option<Plan>,
    rebuild_loop: RebuildLoop,
    /// The changes that such builds have made.
    held_changes: Hints,
}

#[derive(Clone, Default)]
struct PassResult {
    /// Whether there was a build and it was not stopped: it succeeded or failed.
    has_ended: bool,
    /// Whether the system refused something, so that the build is tried again without a change.
    needs_retry: bool,
    /// Whether another pass must follow at once, because some places were not watched before.
    must_repeat: bool,
    /// Whether something may be wrong that the pass did not check: it checked only the changes, or exported
    /// files were removed before their folder was watched.
    needs_check: bool,
}

impl<'a> Watcher<'a> {
    pub(crate) fn new(
        manifest: &ManifestFile,
        kinds: &'a Kinds,
        options: &'a WatchOptions,
        cancel: &'a Cancel,
        events: &'a (dyn Fn(Event) + Sync),
        collector: ChangeCollector,
    ) -> Result<Self, Error> {
        let mut session = BuildSession::new(options.build.jobs, options.memory)?;
        session.watched = Some(collector.watched_changes());
        let sender = collector.sender();
        cancel.when_cancelled(move || drop(sender.send(WatchMessage::Wake)));
        Ok(Self {
            loader: ManifestLoader::new(manifest.clone(), kinds),
            manifest: manifest.path.clone(),
            options,
            build: BuildOptions {
                dry_run: false,
                lock_purpose: LockPurpose::Watch,
                lock_timeout: LockTimeout::ENDLESS,
                ..options.build.clone()
            },
            cancel,
            events,
            session,
            collector,
            rejected: None,
            outstanding: OutstandingErrors::default(),
            retry: Backoff::new(RETRIES[0], RETRIES[1]),
            changed: BTreeSet::new(),
            is_all: false,
            check_after: CHECK_AFTER,
            removed_by_build: HashSet::new(),
            has_built: false,
            has_unanswered_change: false,
            plan: None,
            rebuild_loop: RebuildLoop::default(),
            held_changes: Hints::default(),
        })
    }

    pub(crate) fn run(mut self) -> Result<(), Error> {
        let mut is_triggered = true;
        loop {
            let result = self.pass(is_triggered)?;
            if self.cancel.is_cancelled() {
                return Ok(());
            }
            // If another pass follows at once, it builds an edit of this moment without reporting the change.
            if !result.must_repeat {
                self.report_mode();
            }
            if result.has_ended {
                if self.options.once && self.has_unanswered_change {
                    return Ok(());
                }
                self.has_unanswered_change = false;
            }
            let Some(hints) = self.next_changes(result.clone()) else { return Ok(()) };
            is_triggered = self.report_changes(hints);
            // Hints do not name what happened before everything was watched.
            self.is_all &= !result.must_repeat;
            if is_triggered {
                self.retry.reset();
            }
        }
    }

    /// Waits until there is something to do, and returns the changes that are built next; `None` if the
    /// watcher was cancelled. Changes that a build has made itself do not count if that goes on and on.
    fn next_changes(&mut self, mut result: PassResult) -> Option<Hints> {
        loop {
            if !self.wait(&result) {
                return None;
            }
            let mut hints = self.collector.take_for_build();
            hints.merge(std::mem::take(&mut self.held_changes));
            let is_whole = hints.are_all() && !hints.paths.is_empty();
            if !is_whole || self.rebuild_loop.take_look() {
                return Some(hints);
            }
            match self.rebuild_loop.check(hints.paths.keys().map(PathBuf::as_path)) {
                LoopCheck::Build => return Some(hints),
                LoopCheck::Stopped => {}
                LoopCheck::Stop(item) => {
                    let folder = self.manifest.parent().unwrap_or(&self.manifest);
                    let files = hints.paths.keys().map(|path| path_name(folder, path)).collect();
                    (self.events)(Event::RebuildLoop { item, files });
                }
            }
            self.held_changes = hints;
            // Nothing is built because of time alone.
            result = PassResult::default();
        }
    }

    /// Waits until there is something to do; `false` if the watcher was cancelled.
    fn wait(&mut self, result: &PassResult) -> bool {
        let pause = match result {
            PassResult { must_repeat: true, .. } => Some(Duration::ZERO),
            PassResult { needs_retry: true, .. } => Some(self.retry.pause()),
            PassResult { needs_check, .. } => {
                self.retry.reset();
                needs_check.then_some(self.check_after)
            }
        };
        let due = pause.map(|pause| Instant::now() + pause);
        let due = due.into_iter().chain(self.rebuild_loop.look_again()).min();
        if result.must_repeat {
            // Changes are reported before they are built.
            self.collector.poll_now();
        } else if let Some(limit) = self.options.cache_limit {
            // If trimming fails, it is tried again after the next build.
            let _ = self.session.trim(self.manifest.parent().unwrap_or(&self.manifest), limit);
        }
        loop {
            // No hint comes when probes time out, so their state is checked from time to time.
            let pause = self.collector.is_probing().then(|| Instant::now() + Duration::from_millis(20));
            let until = [due, pause].into_iter().flatten().min();
            let wakeup = self.collector.wait(until, &|| self.cancel.is_cancelled());
            if !result.must_repeat {
                self.report_mode();
            }
            match wakeup {
                Wakeup::Stopped => return false,
                Wakeup::Hints => return true,
                Wakeup::Timeout if due.is_some_and(|due| due <= Instant::now()) => return true,
                Wakeup::Timeout => {}
            }
        }
    }

    /// Reports whether the watcher listens or polls, if that is known and has changed.
    fn report_mode(&mut self) {
        if let Some(event) = self.collector.mode_event() {
            (self.events)(event);
        }
    }

    /// Reports the changes that are built next; `false` if there are none that can be named.
    fn report_changes(&mut self, hints: Hints) -> bool {
        let folder = self.manifest.parent().unwrap_or(&self.manifest);
        let changes = hints.paths.iter().filter_map(|(path, existed)| {
            let what = match (existed, path.exists()) {
                (false, true) => Changed::Appeared,
                (true, true) => Changed::Changed,
                (true, false) => Changed::Gone,
                // It appeared and has gone.
                (false, false) => return None,
            };
            let name = path_name(folder, path);
            Some(Change { path: if name.is_empty() { ".".into() } else { name }, what })
        });
        let mut changes = changes.collect::<Vec<_>>();
        changes.extend(self.removed_outputs(&hints.removed_outputs));
        if hints.lost {
            changes.push(Change { path: ".".into(), what: Changed::Unknown });
        }
        changes.sort_unstable();
        self.changed = hints.paths.keys().cloned().collect();
        // If the project's folder is another one now, nothing is known of it.
        self.is_all = hints.are_all() && !hints.paths.keys().any(|path| folder.starts_with(path));
        if changes.is_empty() {
            return false;
        }
        self.has_unanswered_change = true;
        (self.events)(Event::Noticed { changes, milliseconds: hints.age().as_secs_f64() * 1e3 });
        true
    }

    /// The exported files and folders that somebody has removed, without those in a folder that was removed.
    fn removed_outputs(&self, removed: &BTreeSet<PathBuf>) -> Vec<Change> {
        let Some(plan) = self.plan.as_ref().filter(|plan| !removed.is_empty() && plan.state.exists()) else {
            return Vec::new();
        };
        let topmost = removed.iter().filter_map(|path| {
            let above = path.ancestors().take_while(|above| above.starts_with(&plan.out));
            above.take_while(|above| fs::symlink_metadata(above).is_err()).last()
        });
        let topmost = topmost.collect::<BTreeSet<_>>();
        let by_builds = &self.removed_by_build;
        let files = plan.items.iter().flat_map(|item| &item.files);
        let files = files.filter(|file| !by_builds.contains(*file)).map(|file| plan.out.join(file));
        let lost = files.flat_map(|file| {
            let above = file.ancestors().take_while(|above| above.starts_with(&plan.out));
            above.filter_map(|above| topmost.get(above).copied()).next()
        });
        let lost = lost.collect::<BTreeSet<_>>();
        let folder = self.manifest.parent().unwrap_or(&self.manifest);
        lost.into_iter().map(|path| Change { path: path_name(folder, path), what: Changed::Gone }).collect()
    }

    /// Loads the manifest, expands its sources and builds. A pass that a change triggered reports all that it
    /// does; another only if it finds something to do.
    fn pass(&mut self, is_triggered: bool) -> Result<PassResult, Error> {
        let mut snapshot = self.loader.load();
        for _ in 0..MOST_LOOKS {
            if !self.collector.watch(places(&self.manifest, &snapshot, &self.session)) {
                break;
            }
            snapshot = self.loader.load();
        }
        let has_reported = self.report_diagnostics(&snapshot);
        self.plan.clone_from(&snapshot.plan);
        let plan = snapshot.plan.as_ref();
        let plan = plan.filter(|plan| snapshot.diagnostics.is_none() || can_still_be_built(plan));
        // A manifest that is half written is waited for, as any other file is.
        let broken = snapshot.diagnostics.is_some().then(|| self.manifest.clone());
        let Some(plan) = plan else {
            self.collector.record_outcome(&self.changed, &broken.into_iter().collect(), false);
            if let (true, false, Some(diagnostics)) = (is_triggered, has_reported, snapshot.diagnostics) {
                // Each reported change has an answer.
                (self.events)(Event::Rejected { diagnostics });
            }
            return Ok(PassResult::default());
        };
        let is_partial = is_triggered && self.is_all;
        self.build.repeat_warnings = !self.has_built;
        self.build.changed = is_partial.then(|| self.changed.iter().cloned().collect());
        let (built, must_repeat) = self.build(plan, &snapshot, is_triggered);
        match built {
            Ok(Built { summary, failed_on }) => {
                self.has_built = true;
                // A change may have stopped the build that was asked for.
                self.build.force &= summary.cancelled;
                if let Some(watched) = self.session.watched.as_ref().filter(|_| !summary.cancelled) {
                    watched.completed();
                }
                let is_more = summary.published > 0 && self.collector.watch_outputs(plan);
                let needs_check = is_partial || is_more;
                let has_ended = !summary.cancelled;
                let failed = failed_on.into_iter().chain(broken).collect();
                self.collector.record_outcome(&self.changed, &failed, has_ended);
                let needs_retry = has_ended && summary.system_errors > 0;
                Ok(PassResult { has_ended, needs_retry, must_repeat, needs_check })
            }
            Err(error) if error.kind() == ErrorKind::UnknownTarget && !self.has_built => Err(error),
            Err(error) => {
                let needs_retry = error.kind().is_of_system();
                if is_triggered || !self.outstanding.has(&error) {
                    let help = error.help().map(str::to_owned);
                    (self.events)(Event::BuildError { error: error.chain().to_vec(), help });
                    self.outstanding.build_failed(error);
                }
                Ok(PassResult { has_ended: true, needs_retry, must_repeat, needs_check: false })
            }
        }
    }

    /// Reports new errors of the manifest, or that it is valid again; `false` if nothing changed.
    fn report_diagnostics(&mut self, snapshot: &ManifestSnapshot) -> bool {
        let event = diagnostics_event(&mut self.rejected, snapshot);
        let is_new = event.is_some();
        event.into_iter().for_each(self.events);
        is_new
    }

    /// Builds and collects changes meanwhile, which stop the items that they make stale. Also returns whether
    /// places are watched now that were not watched before.
    fn build(
        &mut self,
        plan: &Plan,
        snapshot: &ManifestSnapshot,
        is_triggered: bool,
    ) -> (Result<Built, Error>, bool) {
        let Self { manifest, collector, loader, session, cancel, events, build, outstanding, .. } = self;
        let (session, cancel, rejected) = (&*session, *cancel, &mut self.rejected);
        let removed = &mut self.removed_by_build;
        let (sender, heard) = (collector.sender(), collector.heard_changes());
        let has_ended = AtomicBool::new(false);
        let buffer = EventBuffer::new(*events, is_triggered, outstanding);
        let trace = Mutex::new(BuildTrace::default());
        std::thread::scope(|scope| {
            let collecting = scope.spawn(|| {
                let (mut is_more, mut during, mut known) = (false, Hints::default(), [0; 2]);
                loop {
                    let has_ended = || has_ended.load(Ordering::Acquire);
                    let wakeup = collector.wait(Some(Instant::now() + PLACES_INTERVAL), &has_ended);
                    if wakeup == Wakeup::Hints {
                        let hints = collector.take();
                        let snapshot = outdate(session, loader, &hints, collector.places());
                        // The build goes on with the last valid manifest, and may take long. Half a manifest
                        // is waited for.
                        let is_whole = !collector.waits_for(manifest);
                        if is_whole && let Some(event) = diagnostics_event(rejected, &snapshot) {
                            buffer.report_now(event);
                        }
                        during.merge(hints);
                    }
                    // More files become known while items read them.
                    let noted = session.read_sets();
                    let counts = noted.each_ref().map(|noted| noted.places().len());
                    let places_now = collector.places();
                    let is_known =
                        |noted: &Arc<ReadSet>| noted.places().iter().all(|place| places_now.have(place));
                    if known != counts && !noted.iter().all(is_known) {
                        is_more |= collector.watch(places(manifest, snapshot, session));
                    }
                    known = counts;
                    if wakeup == Wakeup::Stopped {
                        collector.put_back(during);
                        return is_more;
                    }
                }
            });
            let report = |event: Event| {
                trace.lock().record(&event, plan);
                buffer.push(event);
            };
            let watcher = WatchedBuild { heard, removed };
            let built = session.build_while_watched(plan, build, cancel, &report, watcher);
            has_ended.store(true, Ordering::Release);
            // The collecting thread waits for messages.
            let _ = sender.send(WatchMessage::Wake);
            let is_more = collecting.join().unwrap_or(true);
            self.rebuild_loop.build_ended(std::mem::take(&mut *trace.lock()));
            (built, is_more)
        })
    }
}

/// The event of new errors of the manifest, or of its being valid again.
fn diagnostics_event(rejected: &mut Option<Diagnostics>, snapshot: &ManifestSnapshot) -> Option<Event> {
    if *rejected == snapshot.diagnostics {
        return None;
    }
    rejected.clone_from(&snapshot.diagnostics);
    Some(match &snapshot.diagnostics {
        Some(diagnostics) => Event::Rejected { diagnostics: diagnostics.clone() },
        None => Event::Accepted,
    })
}

/// Stops the items of the running build that changes make stale.
fn outdate(
    session: &BuildSession,
    loader: &mut ManifestLoader<'_>,
    hints: &Hints,
    places: &WatchedPlaces,
) -> ManifestSnapshot {
    let mut paths = hints.paths.keys().cloned().collect::<Vec<_>>();
    if hints.lost {
        paths.extend(places.files.iter().cloned());
    }
    let snapshot = loader.load();
    session.outdate(&paths, snapshot.plan.as_ref().filter(|_| snapshot.diagnostics.is_none()));
    snapshot
}

/// The places that the graph depends on, as far as they are known.
fn places(manifest: &Path, snapshot: &ManifestSnapshot, session: &BuildSession) -> WatchedPlaces {
    let out = snapshot.plan.as_ref().map(|plan| plan.out.clone());
    let state = manifest.with_file_name(crate::storage::FOLDER);
    let mut places = WatchedPlaces::of(manifest, out.into_iter().chain([state]).collect());
    places.add_search(&snapshot.queries, snapshot.sources.iter().cloned());
    let items = snapshot.plan.iter().flat_map(|plan| plan.items.iter());
    let sources =
        items.filter_map(|item| Some((item.source.clone()?, ReadKind::Content))).collect::<Vec<_>>();
    places.add_reads(&sources);
    session.read_sets().iter().for_each(|noted| places.add_reads(&*noted.places()));
    snapshot.plan.iter().for_each(|plan| _ = places.add_outputs(plan));
    places
}

/// Whether a plan whose manifest has errors now still has its folder and its sources.
fn can_still_be_built(plan: &Plan) -> bool {
    plan.state.exists()
        && plan.items.iter().filter_map(|item| item.source.as_ref()).all(|source| source.exists())
}
