//! Keeps a graph's outputs fresh: builds, and builds again when something changes that the graph reads.
//!
//! What is heard of the disk are hints, no more. Any hint that concerns the graph leads to a *pass*: the manifest is
//! read again where it changed, its sources are expanded afresh, and a build decides by contents what to run. So a
//! hint too many costs a short look, and only one that never comes could do harm. Against that:
//!
//! - The places that a graph depends on ([`places`]) are recorded while it asks the disk, not guessed.
//! - Where a pass comes to attend to more than the one before, another follows: what happened between reading a place
//!   and attending to it is found then.
//! - Hints that come during a build stop what they make stale, and lead to another pass.
//! - A pass that hints lead to looks only at what they name, so that an edit of a large project takes no longer than its own
//!   work. Once it is quiet, another looks at everything, also at what was published.
//! - A queue that overflowed leads to new watches and a pass.
//! - Folders from which events do not arrive are looked at instead ([`probe`], [`poller`]).
//!
//! A file that is still being written makes no hint before it is finished ([`unfinished`]). What the system refuses is
//! tried again after a pause ([`backoff`]), and a pass that no change asked for is reported only if it has something
//! new to say ([`hush`]).

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use changes::{Hints, Woken};
use event_buffer::{EventBuffer, OutstandingErrors};
use manifest::{ManifestLoader, ManifestSnapshot};
use places::Places;

use crate::disk::ReadSet;
use crate::record::path_name;
use crate::{
    BuildOptions, BuildSession, Cancel, Change, Changed, Diagnostics, Error, ErrorKind, Event, Kinds,
    LockPurpose, LockTimeout, Plan, Summary,
};

mod backoff;
mod changes;
mod event_buffer;
mod listener;
mod manifest;
mod places;
mod poller;
mod probe;
mod unfinished;

pub(crate) use backoff::Backoff;
pub(crate) use changes::ChangeCollector;
pub(crate) use listener::Heard;
pub(crate) use probe::is_probe;
#[cfg(test)]
pub(crate) use unfinished::WritePauses;

/// The time between two looks where events do not arrive and the options say nothing.
const POLL: Duration = Duration::from_millis(500);

/// The first and the longest pause before a build that the system refused is tried again.
const RETRIES: [Duration; 2] = [Duration::from_secs(1), Duration::from_secs(60)];

/// A disk that gives way to no two equal looks is taken as it is; what changes is heard.
const MOST_LOOKS: usize = 8;
/// The quiet time after an edit before everything is looked at.
const CHECK_AFTER: Duration = Duration::from_secs(1);
/// How often it is looked what a build has read by then.
const PULSE: Duration = Duration::from_millis(100);

/// What a watcher is asked to do.
#[derive(Clone, Debug)]
pub struct WatchOptions {
    /// How each build is done; `dry_run`, `lock_purpose` and `lock_timeout` are the watcher's own.
    pub build: BuildOptions,
    /// The quiet time after a change before it is acted on, so that a file is written to its end.
    pub debounce: Duration,
    /// To look at the files this often rather than to listen for events.
    pub poll: Option<Duration>,
    /// To return after the first rebuild that a change caused, also if it could not go on.
    pub once: bool,
    /// Decoded artifacts of at most so many encoded bytes are kept in memory.
    pub memory: u64,
    /// The size that the cache is trimmed to when nothing is to be done.
    pub cache_limit: Option<u64>,
}

/// Builds, then builds again whenever a file changes that the graph reads, until `cancel` is cancelled.
///
/// Events come one at a time, from the calling thread. A fault of the manifest and an error of a build are told as
/// events; the watcher goes on. What the system refuses (a full disk, a folder that cannot be written) is tried again
/// after a pause, at first a second and then longer and longer up to a minute, and without a word as long as nothing
/// comes of it. What follows an [`Event::Noticed`] is a build's events up to its end, also where nothing
/// was to be done, or [`Event::Rejected`] or [`Event::BuildError`] where nothing can be built; a look that nobody asked for
/// tells nothing unless it finds something to do.
///
/// # Errors
/// Where threads cannot be started, or a stage was asked for that the first sound manifest does not have.
pub fn watch(
    manifest: &Path,
    kinds: &Kinds,
    options: &WatchOptions,
    cancel: &Cancel,
    events: &(dyn Fn(Event) + Sync),
) -> Result<(), Error> {
    let attention = ChangeCollector::new(options.debounce, options.poll, POLL);
    Watcher::new(manifest, kinds, options, cancel, events, attention)?.run()
}

/// A watcher at work.
pub(crate) struct Watcher<'a> {
    manifest: PathBuf,
    options: &'a WatchOptions,
    build: BuildOptions,
    cancel: &'a Cancel,
    events: &'a (dyn Fn(Event) + Sync),
    bench: BuildSession,
    draft: ManifestLoader<'a>,
    attention: ChangeCollector,
    /// The faults that were told and stand.
    rejected: Option<Diagnostics>,
    /// The errors of builds that were told and stand.
    outstanding: OutstandingErrors,
    /// The pauses before what the system refused is tried again.
    pub(crate) retry: Backoff,
    /// What changed that the pass at work answers.
    changed: BTreeSet<PathBuf>,
    /// Whether that is all that can have changed since the build before.
    is_all: bool,
    /// So long after a build that looked only at what had changed, everything is looked at.
    pub(crate) check_after: Duration,
    /// Whether a build has been done.
    has_built: bool,
    /// Whether a change was noticed that no build has answered yet.
    owes: bool,
}

/// What a pass came to.
struct Passed {
    /// Whether there was a build and it was not stopped: it went to its end, or could not go on.
    has_ended: bool,
    /// Whether the system kept it from making all that it should: it is tried again without a change.
    is_refused: bool,
    /// Whether the disk has to be looked at again, because not everything was attended to before.
    again: bool,
    /// Whether only what had changed was looked at.
    is_partial: bool,
}

impl<'a> Watcher<'a> {
    pub(crate) fn new(
        manifest: &Path,
        kinds: &'a Kinds,
        options: &'a WatchOptions,
        cancel: &'a Cancel,
        events: &'a (dyn Fn(Event) + Sync),
        attention: ChangeCollector,
    ) -> Result<Self, Error> {
        let absolute = std::path::absolute(manifest).unwrap_or_else(|_| manifest.into());
        let mut bench = BuildSession::new(options.build.jobs, options.memory)?;
        bench.pending = Some(attention.pending());
        Ok(Self {
            // Diagnostics name the file as it was given.
            draft: ManifestLoader::new(manifest.into(), kinds),
            manifest: absolute,
            options,
            build: BuildOptions {
                dry_run: false,
                lock_purpose: LockPurpose::Watch,
                lock_timeout: LockTimeout::ENDLESS,
                ..options.build.clone()
            },
            cancel,
            events,
            bench,
            attention,
            rejected: None,
            outstanding: OutstandingErrors::default(),
            retry: Backoff::new(RETRIES[0], RETRIES[1]),
            changed: BTreeSet::new(),
            is_all: false,
            check_after: CHECK_AFTER,
            has_built: false,
            owes: false,
        })
    }

    pub(crate) fn run(mut self) -> Result<(), Error> {
        let mut is_asked_for = true;
        loop {
            let passed = self.pass(is_asked_for)?;
            if self.cancel.is_cancelled() {
                return Ok(());
            }
            // Where another pass follows at once, an edit of this moment would be built and not be noticed.
            if !passed.again {
                self.tell_way();
            }
            if passed.has_ended {
                if self.options.once && self.owes {
                    return Ok(());
                }
                self.owes = false;
            }
            if !self.wait(&passed) {
                return Ok(());
            }
            is_asked_for = self.notice();
            // What happened before everything was attended to is not among the hints.
            self.is_all &= !passed.again;
            if is_asked_for {
                self.retry.reset();
            }
        }
    }

    /// Waits until there is something to do; `false` where it is to stop.
    fn wait(&mut self, passed: &Passed) -> bool {
        let pause = match passed {
            Passed { again: true, .. } => Some(Duration::ZERO),
            Passed { is_refused: true, .. } => Some(self.retry.pause()),
            Passed { is_partial, .. } => {
                self.retry.reset();
                is_partial.then_some(self.check_after)
            }
        };
        let due = pause.map(|pause| Instant::now() + pause);
        if passed.again {
            // What changed is told before it is acted on.
            self.attention.look();
        } else if let Some(limit) = self.options.cache_limit {
            // What cannot be trimmed now is trimmed after another build.
            let _ = self.bench.trim(self.manifest.parent().unwrap_or(&self.manifest), limit);
        }
        loop {
            // What is to be told of the way becomes known in time, not by a hint.
            let pause = self.attention.is_proving().then(|| Instant::now() + Duration::from_millis(20));
            let until = [due, pause].into_iter().flatten().min();
            let woken = self.attention.wait(until, &|| self.cancel.is_cancelled());
            if !passed.again {
                self.tell_way();
            }
            match woken {
                Woken::Stopped => return false,
                Woken::Hints => return true,
                Woken::Due if due.is_some_and(|due| due <= Instant::now()) => return true,
                Woken::Due => {}
            }
        }
    }

    fn tell_way(&mut self) {
        if let Some(way) = self.attention.way() {
            (self.events)(way);
        }
    }

    /// Tells what changed; `false` where nothing that can be told did.
    fn notice(&mut self) -> bool {
        let hints = self.attention.act();
        let folder = self.manifest.parent().unwrap_or(&self.manifest);
        let changes = hints.paths.iter().filter_map(|(path, knew)| {
            let what = match (knew, path.exists()) {
                (false, true) => Changed::Appeared,
                (true, true) => Changed::Changed,
                (true, false) => Changed::Gone,
                (false, false) => return None,
            };
            Some(Change { path: path_name(folder, path), what })
        });
        let mut changes = changes.collect::<Vec<_>>();
        if hints.lost {
            changes.push(Change { path: ".".into(), what: Changed::Unknown });
        }
        changes.sort_unstable();
        self.changed = hints.paths.keys().cloned().collect();
        self.is_all = hints.are_all();
        if changes.is_empty() {
            return false;
        }
        self.owes = true;
        (self.events)(Event::Noticed { changes, milliseconds: hints.age().as_secs_f64() * 1e3 });
        true
    }

    /// Looks at the manifest and its sources and builds. One that was asked for tells all that it does; another only
    /// where it finds something to do.
    fn pass(&mut self, is_asked_for: bool) -> Result<Passed, Error> {
        let mut outlook = self.draft.look();
        for _ in 0..MOST_LOOKS {
            if !self.attention.attend(places(&self.manifest, &outlook, &self.bench)) {
                break;
            }
            outlook = self.draft.look();
        }
        let told = self.tell_faults(&outlook);
        let plan = outlook.plan.as_ref().filter(|plan| outlook.faults.is_none() || has_all_sources(plan));
        // Half a manifest is waited for as half of any other file is.
        let broken = outlook.faults.is_some().then(|| self.manifest.clone());
        let Some(plan) = plan else {
            self.attention.judge(&self.changed, &broken.into_iter().collect(), false);
            if let (true, false, Some(faults)) = (is_asked_for, told, outlook.faults) {
                // What was noticed has an answer.
                (self.events)(Event::Rejected { diagnostics: faults });
            }
            return Ok(Passed { has_ended: false, is_refused: false, again: false, is_partial: false });
        };
        let is_partial = is_asked_for && self.is_all;
        self.build.changed = is_partial.then(|| self.changed.iter().cloned().collect());
        let (built, again) = self.build(plan, &outlook, is_asked_for);
        match built {
            Ok(summary) => {
                self.has_built = true;
                let has_ended = !summary.cancelled;
                let failed = self.bench.failed_on.lock().iter().cloned().chain(broken).collect();
                self.attention.judge(&self.changed, &failed, has_ended);
                Ok(Passed {
                    has_ended,
                    is_refused: has_ended && summary.system_errors > 0,
                    again,
                    is_partial,
                })
            }
            Err(error) if error.kind() == ErrorKind::UnknownTarget && !self.has_built => Err(error),
            Err(error) => {
                let is_refused = error.kind().is_of_system();
                if is_asked_for || !self.outstanding.has(&error) {
                    let help = error.help().map(str::to_owned);
                    (self.events)(Event::BuildError { error: error.chain().to_vec(), help });
                    self.outstanding.hindered(error);
                }
                Ok(Passed { has_ended: true, is_refused, again, is_partial: false })
            }
        }
    }

    /// Tells faults that are new, or that the old ones are mended; `false` where all is as it was.
    fn tell_faults(&mut self, outlook: &ManifestSnapshot) -> bool {
        if self.rejected == outlook.faults {
            return false;
        }
        self.rejected.clone_from(&outlook.faults);
        (self.events)(match &outlook.faults {
            Some(faults) => Event::Rejected { diagnostics: faults.clone() },
            None => Event::Accepted,
        });
        true
    }

    /// Builds, and attends meanwhile: what comes stops what it makes stale. Returns also whether places were attended to
    /// that were not before.
    fn build(
        &mut self,
        plan: &Plan,
        outlook: &ManifestSnapshot,
        is_asked_for: bool,
    ) -> (Result<Summary, Error>, bool) {
        let Self { manifest, attention, draft, bench, cancel, events, build, outstanding, .. } = self;
        let (bench, cancel) = (&*bench, *cancel);
        let teller = attention.teller();
        let has_ended = AtomicBool::new(false);
        let hush = EventBuffer::new(*events, is_asked_for, outstanding);
        std::thread::scope(|scope| {
            let attendant = scope.spawn(|| {
                let (mut is_more, mut during, mut known) = (false, Hints::default(), [0; 2]);
                loop {
                    let has_ended = || has_ended.load(Ordering::Acquire);
                    let woken = attention.wait(Some(Instant::now() + PULSE), &has_ended);
                    if woken == Woken::Hints {
                        let hints = attention.hints();
                        outdate(bench, draft, &hints, attention.places());
                        during.merge(hints);
                    }
                    // What is read becomes known by and by.
                    let noted = bench.read_sets();
                    let counts = noted.each_ref().map(|noted| noted.places().len());
                    let places_now = attention.places();
                    let is_known =
                        |noted: &Arc<ReadSet>| noted.places().iter().all(|place| places_now.have(place));
                    if known != counts && !noted.iter().all(is_known) {
                        is_more |= attention.attend(places(manifest, outlook, bench));
                    }
                    known = counts;
                    if woken == Woken::Stopped {
                        attention.give_back(during);
                        return is_more;
                    }
                }
            });
            let built = bench.build(plan, build, cancel, &|event| hush.tell(event));
            has_ended.store(true, Ordering::Release);
            // It waits for what it hears.
            let _ = teller.send(Heard::Nudge);
            let is_more = attendant.join().unwrap_or(true);
            (built, is_more)
        })
    }
}

/// Stops what a build under way does in vain.
fn outdate(bench: &BuildSession, draft: &mut ManifestLoader<'_>, hints: &Hints, places: &Places) {
    let mut paths = hints.paths.keys().cloned().collect::<Vec<_>>();
    if hints.lost {
        paths.extend(places.files.iter().cloned());
    }
    let ManifestSnapshot { plan, faults, .. } = draft.look();
    // Diagnostics are told by the next pass; until then the last good graph is right.
    bench.outdate(&paths, plan.filter(|_| faults.is_none()).as_ref());
}

/// All that the graph depends on, as far as it is known.
fn places(manifest: &Path, outlook: &ManifestSnapshot, bench: &BuildSession) -> Places {
    let out = outlook.plan.as_ref().map(|plan| plan.out.clone());
    let state = manifest.with_file_name(crate::state::FOLDER);
    let mut places = Places::of(manifest, out.into_iter().chain([state]).collect());
    places.add_search(&outlook.asked, outlook.sources.iter().cloned());
    let items = outlook.plan.iter().flat_map(|plan| plan.items.iter());
    let sources = items.filter_map(|item| Some((item.source.clone()?, false))).collect::<Vec<_>>();
    places.add_reads(&sources);
    bench.read_sets().iter().for_each(|noted| places.add_reads(&*noted.places()));
    places
}

fn has_all_sources(plan: &Plan) -> bool {
    plan.items.iter().filter_map(|item| item.source.as_ref()).all(|source| source.exists())
}
