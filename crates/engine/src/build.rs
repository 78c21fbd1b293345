//! The build: runs the items that are out of date and publishes their files.

mod arrivals;
mod cause;
mod forecast;
mod heard;
mod item_request;
mod ledger;
pub(crate) mod out_folder;
mod outcome;
mod publish;
mod removal_cause;
mod reporter;
mod retention;
mod run;
mod run_elsewhere;
mod run_item;
mod runner;
mod running;
mod scheduler;
mod session;
mod shared_results;
mod up_to_date;

use std::collections::HashSet;
use std::path::PathBuf;
use std::sync::Arc;

use crate::cancel::Cancel;
use crate::error::{Error, ErrorKind};
use crate::event::{Event, Summary};
use crate::plan::{ItemIndex, Plan, Selection, Wanted};
use crate::shared::{SharedCacheOptions, Trouble};
use crate::storage::{Disk, Lock, LockPurpose, LockRequest, LockTimeout, State};
use publish::sweep;
use removal_cause::RemovalCauses;
use reporter::BuildReporter;
use run::RunContext;
use runner::{Elsewhere, Runner, WatchedFirst};
use running::{ChangedPaths, RunningBuild};
use scheduler::{Scheduler, event_of};
use session::LastBuild;
use shared_results::SharedBlobs;
use up_to_date::KnownItems;

pub(crate) use arrivals::{arriving, file_sizes, has_made};
pub(crate) use forecast::{Forecast, forecast, forecast_causes};
pub(crate) use heard::{HeardChanges, WatchedBuild};
pub(crate) use ledger::{Fate, Others, Published};
pub(crate) use publish::{Publisher, is_temporary};
pub(crate) use retention::Manifests;
pub(crate) use run::failure_of;
pub use run_item::run_item;
pub use session::{BuildSession, WORKER};
pub(crate) use session::{PathSet, WatchedChanges};
pub(crate) use up_to_date::{UpToDateCheck, item_subject};

/// Options of a build.
#[derive(Clone, Debug, Default)]
pub struct BuildOptions {
    /// The stages and items (`map [sky, gold]`) to build, with everything that they need; empty means all
    /// stages.
    pub stages: Vec<String>,
    /// Whether these stages and items run even if they are up to date; what they need does not.
    pub force: bool,
    /// The number of threads; `None` means the number of available cores.
    pub jobs: Option<usize>,
    /// Whether items that do not depend on a failed item still run.
    pub keep_going: bool,
    /// Whether only to report what would run and why; nothing is written.
    pub dry_run: bool,
    /// The purpose that other processes are shown if they find the folder locked.
    pub lock_purpose: LockPurpose,
    /// How long to wait while another process has the folder locked.
    pub lock_timeout: LockTimeout,
    /// The only files and folders, absolute, that have changed since the last build of the session; `None` if
    /// any may have. The build checks only the items that depend on them: every other item is as that build
    /// left it, with its files, and no event names it. If the session cannot know that (another plan, or
    /// another process that built since), the build checks everything nevertheless.
    pub changed: Option<Vec<PathBuf>>,
    /// Whether the warnings of results that are up to date are reported again.
    pub repeat_warnings: bool,
    /// The items that somebody looks at, which go first.
    pub wanted: Wanted,
    /// Whether the scratch folders of items that fail here are kept, for people who want to see them.
    pub keep_scratch: bool,
    /// The cache that other machines share with this one.
    pub shared: Option<SharedCacheOptions>,
    /// Whether every result has to be in this folder, also those that are perhaps only in a shared cache: a
    /// preview looks at results in the middle of the graph.
    pub all_local: bool,
}

/// Builds once: [`BuildSession::build`] with threads of its own, and nothing is kept in memory afterwards.
///
/// # Errors
/// The errors of [`BuildSession::build`], and an error if threads cannot be started.
pub fn build(
    plan: &Plan,
    options: &BuildOptions,
    cancel: &Cancel,
    events: &(dyn Fn(Event) + Sync),
) -> Result<Summary, Error> {
    BuildSession::new(options.jobs, 0)?.build(plan, options, cancel, events)
}

impl BuildSession {
    /// Runs the items of a plan that are out of date and publishes the files of exporting stages into `out`.
    ///
    /// Events are reported one at a time, from the calling thread. The failure of an item is an event and
    /// counts in the summary; it is not an error of the build. With one job the order of the events is always
    /// the same, except for [`Event::Progress`]; with more, events of different items may change places, but
    /// the results are the same.
    ///
    /// # Errors
    /// If the build as a whole cannot go on: a stage is unknown, `out` is not a folder, another process holds
    /// the lock, the state folder is damaged beyond use or cannot be written.
    pub fn build(
        &self,
        plan: &Plan,
        options: &BuildOptions,
        cancel: &Cancel,
        events: &(dyn Fn(Event) + Sync),
    ) -> Result<Summary, Error> {
        let watcher = WatchedBuild { heard: HeardChanges::default(), removed: &mut HashSet::new() };
        self.build_while_watched(plan, options, cancel, events, watcher).map(|built| built.summary)
    }

    /// Builds for a watcher, which sends the changes that it hears of while the build runs. The failure of an
    /// item on a file that has changed since is not reported: the watcher will build again.
    pub(crate) fn build_while_watched(
        &self,
        plan: &Plan,
        options: &BuildOptions,
        cancel: &Cancel,
        events: &(dyn Fn(Event) + Sync),
        watcher: WatchedBuild<'_>,
    ) -> Result<Built, Error> {
        let reporter = BuildReporter::new(events);
        let mut selected = Selection::of(plan, &options.stages)?;
        if options.force {
            selected = selected.forced(plan, &options.stages)?;
        }
        out_folder::check(plan)?;
        events(Event::Planned {
            dry_run: options.dry_run,
            stages: selected.stages(plan),
            items: selected.items(),
        });
        self.report_warnings(plan, events);
        if options.dry_run {
            let summary = self.dry_run(plan, &selected, options.stages.is_empty(), events)?;
            return Ok(Built { summary: reporter.end(summary), failed_on: HashSet::new() });
        }
        self.run_items(plan, options, &selected, cancel, reporter, watcher)
    }

    /// Reports the warnings of a plan that were not reported for the last one.
    fn report_warnings(&self, plan: &Plan, events: &(dyn Fn(Event) + Sync)) {
        let mut reported = self.reported_warnings.lock();
        let messages = plan.warnings.errors.iter().map(|warning| warning.message.clone());
        let before = std::mem::replace(&mut *reported, messages.collect());
        let mut diagnostics = plan.warnings.clone();
        diagnostics.errors.retain(|warning| !before.contains(&warning.message));
        if !diagnostics.errors.is_empty() {
            events(Event::ManifestWarnings { diagnostics });
        }
    }

    /// Checks the items, runs those that are out of date, and publishes.
    fn run_items(
        &self,
        plan: &Plan,
        options: &BuildOptions,
        selected: &Selection,
        cancel: &Cancel,
        reporter: BuildReporter<'_>,
        watcher: WatchedBuild<'_>,
    ) -> Result<Built, Error> {
        let events = reporter.events;
        let Some(lock) = lock(plan, options, cancel, events)? else {
            let summary = Summary { skipped: selected.items(), cancelled: true, ..Summary::default() };
            return Ok(Built { summary: reporter.end(summary), failed_on: HashSet::new() });
        };
        let (state, before) = self.open(lock, plan, selected)?;
        sweep(&state, plan)?;
        let changes = options.changed.as_deref().map(ChangedPaths::new);
        let known = before.clone().filter(|_| changes.is_some());
        let is_known = known.is_some();
        let disk = Disk::new(state.now, self.begin_reads(), cancel);
        let running = Arc::new(RunningBuild::new(plan, selected, disk, &options.wanted));
        let disk = running.disk();
        self.begin(&running);
        let (mut check, publisher) = self.pool.install(|| {
            rayon::join(
                || UpToDateCheck::with_records(plan, &state, disk, selected, known.clone()),
                || match known {
                    Some(_) => Publisher::without_stale(plan, &state),
                    None => Publisher::new(plan, &state),
                },
            )
        });
        check.all_local = options.all_local;
        let readers = running.depend_all(check.readers(), |item| check.recorded_dependencies(item));
        let stop = || cancel.is_cancelled() || running.is_outdated();
        self.pool.install(|| check.check_files(&readers, changes.as_ref(), &stop));
        check.mark_gone()?;
        let shared_blobs = match &options.shared {
            Some(shared) => Some(self.find_shared(shared, &state, &mut check, &stop, events)?),
            None => None,
        };
        let context = RunContext {
            check: &check,
            publisher: &publisher,
            disk,
            cancel,
            memory: &self.memory,
            derived: &self.derived,
            running: &running,
            watched: self.watched.as_ref(),
            gate: Arc::default(),
            wanted: &options.wanted,
            repeat_warnings: options.repeat_warnings,
            shared: options.shared.as_ref(),
            shared_blobs: shared_blobs.as_deref(),
            keep_scratch: options.keep_scratch,
        };
        let runners = runners(&context, self.pool.current_num_threads());
        let mut scheduler = self.pool.install(|| {
            Scheduler::new(&context, selected, options.keep_going, runners, reporter, watcher.heard)
        });
        remove_gone(&context, selected, options.stages.is_empty(), &mut scheduler)?;
        let outcome = scheduler.finish_all(&self.pool, &self.wanted_pool);
        let failed_on = running.read_by(&scheduler.failed);
        self.end_reads();
        *watcher.removed = publisher.finish()?;
        outcome?;
        if !is_known {
            publisher.leftovers()?.into_iter().for_each(|event| scheduler.report(event));
        }
        if let Some(shared) = &options.shared {
            let traffic = shared.cache.finish(&|| cancel.is_cancelled());
            scheduler.summary.shared_traffic = Some(traffic);
            report_trouble(shared, events)?;
        }
        let before = check.known().or(before.as_ref());
        let complete = scheduler.complete_items(before.map(|known| &known.complete[..]));
        let handled = scheduler.handled_items().map(|item| (item, check.subject(item))).collect();
        let summary = reporter.end(scheduler.into_summary());
        // The rest is written for the next build after the end is reported, so that nobody waits for it.
        self.close(state, plan, selected, complete, readers.into_items(), handled);
        Ok(Built { summary, failed_on })
    }

    /// Opens the state folder, and finds the items that the last build left with complete results, if nobody
    /// has written there since and the plan and the selection are the same.
    fn open(
        &self,
        lock: Lock,
        plan: &Plan,
        selected: &Selection,
    ) -> Result<(State, Option<KnownItems>), Error> {
        let (journal, last_build) = {
            let mut saved = self.saved.lock();
            (saved.journal.take(), saved.last_build.take())
        };
        let state = self.pool.install(|| State::open(lock, journal))?;
        let last_build = last_build.filter(|_| state.journal.is_unchanged());
        let known = last_build.and_then(|last_build| last_build.known(plan, selected));
        Ok((state, known))
    }

    /// Looks for items that are out of date in a shared cache, and receives what this build needs of them.
    /// The store gets the rest from there if it is asked for it.
    fn find_shared(
        &self,
        options: &SharedCacheOptions,
        state: &State,
        check: &mut UpToDateCheck<'_>,
        stop: &(dyn Fn() -> bool + Sync),
        events: &(dyn Fn(Event) + Sync),
    ) -> Result<Arc<SharedBlobs>, Error> {
        let shared = Arc::new(SharedBlobs::new(Arc::clone(&options.cache)));
        shared.add_recorded(&state.journal);
        let needed = self.pool.install(|| check.find_shared(options, &shared, stop));
        shared.receive(&state.store, &needed, stop);
        let source = Arc::clone(&shared);
        state.store.connect(move |digest| source.get(digest));
        report_trouble(options, events)?;
        Ok(shared)
    }

    /// Closes the state folder, and keeps for the next build which items are complete, and which of those
    /// that were checked (`readers`) or handled read files.
    fn close(
        &self,
        state: State,
        plan: &Plan,
        selected: &Selection,
        complete: Vec<bool>,
        mut readers: Vec<ItemIndex>,
        handled: Vec<(ItemIndex, u128)>,
    ) {
        let mut saved = self.saved.lock();
        saved.stored += state.store.stored();
        saved.journal = state.close();
        if let Some(journal) = &saved.journal {
            let reads =
                |subject| journal.latest(subject).is_some_and(|latest| latest.reads().next().is_some());
            readers.extend(handled.into_iter().filter(|(_, subject)| reads(*subject)).map(|(item, _)| item));
            readers.sort_unstable();
            readers.dedup();
            saved.last_build = Some(LastBuild::new(plan, selected, KnownItems { complete, readers }));
        }
    }
}

/// Locks the state folder; `None` if the build is cancelled while another process holds it.
fn lock(
    plan: &Plan,
    options: &BuildOptions,
    cancel: &Cancel,
    events: &(dyn Fn(Event) + Sync),
) -> Result<Option<Lock>, Error> {
    let waiting = |holder| {
        let limit = options.lock_timeout.0.map(|limit| limit.as_secs_f64() * 1e3);
        events(Event::Waiting { holder, limit_milliseconds: limit });
    };
    let (purpose, timeout) = (options.lock_purpose, options.lock_timeout);
    match State::lock(&plan.state, &LockRequest { purpose, timeout, cancel, waiting: &waiting }) {
        Err(error) if error.kind() == ErrorKind::Cancelled => Ok(None),
        lock => lock.map(Some),
    }
}

/// Removes the files of items that no longer exist, and reports why each went.
fn remove_gone(
    context: &RunContext<'_>,
    selected: &Selection,
    all: bool,
    scheduler: &mut Scheduler<'_, '_>,
) -> Result<(), Error> {
    let mut removals = Vec::new();
    let removed = context.publisher.remove_gone(context.check.plan, selected, all, &mut removals);
    let causes = RemovalCauses::new(context.check);
    for (item, event) in removals {
        scheduler.report(event_of(&item, event, || causes.of(&item)));
    }
    removed
}

/// The places where a build with so many threads runs its items, the preferred one first.
fn runners<'a>(context: &'a RunContext<'a>, jobs: usize) -> Vec<Box<dyn Runner<'a> + 'a>> {
    let here = WatchedFirst::new(context, jobs);
    let first_worker = here.workers();
    let elsewhere = context.shared.and_then(|shared| {
        let options = shared.executor.as_ref()?;
        let elsewhere = Elsewhere::new(context, options, shared.is_required, first_worker);
        Some(Box::new(elsewhere) as Box<dyn Runner<'a> + 'a>)
    });
    elsewhere.into_iter().chain([Box::new(here) as Box<dyn Runner<'a> + 'a>]).collect()
}

/// Reports what is wrong with a shared cache, if something is.
fn report_trouble(options: &SharedCacheOptions, events: &(dyn Fn(Event) + Sync)) -> Result<(), Error> {
    let Some(Trouble { message, is_lost }) = options.cache.trouble() else { return Ok(()) };
    if is_lost && options.is_required {
        let help = "without --remote-required a build continues without the cache";
        return Err(Error::new(ErrorKind::Io, message).with_help(help));
    }
    let message = if is_lost { format!("{message}; the build continues without it") } else { message };
    events(Event::SharedCache { host: options.cache.host(), message });
    Ok(())
}

/// What a build has made, for a watcher.
pub(crate) struct Built {
    pub(crate) summary: Summary,
    /// The files and folders that the items read which failed, except for those that failed because of the
    /// system.
    pub(crate) failed_on: HashSet<PathBuf>,
}
