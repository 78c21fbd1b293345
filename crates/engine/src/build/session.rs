//! What one process keeps from one build to the next, so that a watcher's next build starts warm.

use std::collections::HashSet;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Weak};
use std::time::{Duration, Instant};

use parking_lot::{Mutex, MutexGuard};
use rayon::{ThreadPool, ThreadPoolBuilder};

use super::running::{ChangedPaths, RunningBuild};
use super::up_to_date::KnownItems;
use crate::error::{Error, ErrorKind};
use crate::plan::{Plan, Selection};
use crate::platform::{Identity, file_identity};
use crate::storage::{Journal, Memory, Read, ReadSet, open_for_writing};
use crate::timestamp::Timestamp;

/// The prefix of the names of a session's threads. Kinds run on them: their panics are caught there and
/// reported as failures of their items, so that a panic hook does not need to print them a second time.
pub const WORKER: &str = "specula worker";

/// The threads for the builds of a process, and what is kept from one build to the next.
///
/// It holds no lock: between its builds another process may build in the same folder.
pub struct BuildSession {
    pub(crate) pool: ThreadPool,
    /// Where wanted items run, beside all others; see `wanted.rs`.
    pub(crate) wanted_pool: ThreadPool,
    /// The files that the items of the last build read, and those that the running build has read so far.
    reads: Mutex<(Arc<ReadSet>, Arc<ReadSet>)>,
    pub(crate) memory: Memory,
    /// What kinds compute from artifacts.
    pub(crate) derived: Memory,
    pub(crate) saved: Mutex<SavedState>,
    /// What a watcher knows of files that programs write, if there is a watcher.
    pub(crate) watched: Option<WatchedChanges>,
    /// The build that runs, or the last one.
    running: Mutex<Weak<RunningBuild>>,
    pub(crate) reported_warnings: Mutex<Vec<String>>,
}

/// The most bytes of values that kinds compute from artifacts: they serve the items of one build already.
const DERIVED_BYTES: u64 = 128 << 20;

/// So many threads.
///
/// # Errors
/// If they cannot be started.
fn threads(name: &'static str, jobs: usize) -> Result<ThreadPool, Error> {
    let pool = ThreadPoolBuilder::new().num_threads(jobs);
    let built = pool.thread_name(move |index| format!("{WORKER} {name}{index}")).build();
    built.map_err(|error| Error::new(ErrorKind::Io, format!("cannot start threads: {error}")))
}

/// Paths that several threads share.
#[derive(Debug, Default)]
pub(crate) struct PathSet(Mutex<HashSet<PathBuf>>);

impl PathSet {
    pub(crate) fn lock(&self) -> MutexGuard<'_, HashSet<PathBuf>> {
        self.0.lock()
    }
}

/// What a watcher knows, while a build runs, of files that programs write.
pub(crate) struct WatchedChanges {
    /// The files that are still being written: nothing is made of them yet.
    pub(crate) unfinished: Arc<PathSet>,
    /// Whether programs may have begun to write without its notice, since a build looked for them.
    may_have_missed_writers: Arc<AtomicBool>,
    /// Whether the running build looks for programs that write.
    is_looking: AtomicBool,
    /// The files that programs had open for writing at the last look of this build, and when that was.
    looked: Mutex<Option<(Instant, HashSet<Identity>)>>,
    /// Reports a file that a program has open for writing to the watcher.
    report: Mutex<Box<dyn Fn(PathBuf) + Send>>,
}

impl WatchedChanges {
    pub(crate) fn new(
        unfinished: Arc<PathSet>,
        may_have_missed_writers: Arc<AtomicBool>,
        report: Box<dyn Fn(PathBuf) + Send>,
    ) -> Self {
        let (is_looking, looked, report) = (AtomicBool::new(false), Mutex::default(), Mutex::new(report));
        Self { unfinished, may_have_missed_writers, is_looking, looked, report }
    }

    fn begin(&self) {
        *self.looked.lock() = None;
        let is_needed = self.may_have_missed_writers.swap(false, Ordering::Relaxed);
        self.is_looking.fetch_or(is_needed, Ordering::Relaxed);
    }

    pub(crate) fn completed(&self) {
        self.is_looking.store(false, Ordering::Relaxed);
    }

    /// Whether a program is still writing one of these files. The watcher then builds again when it is
    /// finished.
    pub(crate) fn are_unfinished(
        &self,
        reads: &[Read],
        modified: impl Fn(&Path) -> Option<Timestamp>,
    ) -> bool {
        let unfinished = self.unfinished.lock();
        if !unfinished.is_empty() && reads.iter().any(|read| unfinished.contains(&read.path)) {
            return true;
        }
        drop(unfinished);
        if !self.is_looking.load(Ordering::Relaxed) {
            return false;
        }
        let is_recent = |read: &&Read| {
            modified(&read.path).is_some_and(|time| Timestamp::now().0.saturating_sub(time.0) < RECENT)
        };
        let recent = reads.iter().filter(is_recent).map(|read| read.path.as_path()).collect::<Vec<_>>();
        if recent.is_empty() {
            return false;
        }
        // One look at all programs serves many items.
        let mut looked = self.looked.lock();
        let last = looked.take().filter(|(time, _)| time.elapsed() < LOOK_INTERVAL);
        let (_, open) = looked.insert(last.unwrap_or_else(|| (Instant::now(), open_for_writing())));
        let is_open = |path: &&Path| file_identity(path).is_some_and(|file| open.contains(&file));
        let written = recent.into_iter().filter(is_open).map(Path::to_path_buf).collect::<Vec<_>>();
        drop(looked);
        for path in &written {
            self.unfinished.lock().insert(path.clone());
            (self.report.lock())(path.clone());
        }
        !written.is_empty()
    }
}

/// A file that was not written to for so many milliseconds is finished, even if a program has it open.
const RECENT: u64 = 30_000;

/// The time between two looks at the files that programs have open.
const LOOK_INTERVAL: Duration = Duration::from_millis(200);

/// The part of the state folder that is kept between two builds. Others may write there meanwhile, so it is
/// checked before it is used.
#[derive(Default)]
pub(crate) struct SavedState {
    /// The journal as the last build left it.
    pub(crate) journal: Option<Journal>,
    pub(crate) last_build: Option<LastBuild>,
    /// The bytes stored since the size of the cache was last computed.
    pub(crate) stored: u64,
    /// How many bytes may be stored before the size has to be computed again.
    pub(crate) room: u64,
}

/// The items of a plan that a build left with complete results and files.
pub(crate) struct LastBuild {
    plan: Plan,
    selected: Selection,
    known: KnownItems,
}

impl LastBuild {
    pub(crate) fn new(plan: &Plan, selected: &Selection, known: KnownItems) -> Self {
        Self { plan: plan.clone(), selected: selected.clone(), known }
    }

    /// The items, if the plan and the selection are the same.
    pub(crate) fn known(self, plan: &Plan, selected: &Selection) -> Option<KnownItems> {
        let is_same = self.plan.is_same(plan) && self.selected == *selected;
        is_same.then_some(self.known)
    }
}

impl BuildSession {
    /// A session with this number of threads (`None`: one per processor) that keeps decoded artifacts of at
    /// most `memory` encoded bytes in memory, the most recently used ones; decoded, they may take several
    /// times as much. With 0 each artifact is dropped as soon as no item of the build needs it any more.
    ///
    /// # Errors
    /// If threads cannot be started.
    pub fn new(jobs: Option<usize>, memory: u64) -> Result<Self, Error> {
        // 0 means the number of available cores.
        let (pool, wanted_pool) = (threads("", jobs.unwrap_or(0))?, threads("w", jobs.unwrap_or(0))?);
        Ok(Self {
            pool,
            wanted_pool,
            reads: Mutex::default(),
            memory: Memory::new(memory),
            derived: Memory::new(DERIVED_BYTES),
            saved: Mutex::default(),
            watched: None,
            running: Mutex::default(),
            reported_warnings: Mutex::default(),
        })
    }

    /// Reports to the running build that these files or folders (absolute) may have changed and, if that
    /// changed the graph, what the graph is now.
    ///
    /// If that makes anything stale, the build ends early: stale items stop at their next
    /// [`check_cancelled`](crate::kinds::Reporter::check_cancelled), the other running items finish, no item
    /// starts any more, and its summary is `cancelled`. If nothing is stale, or no build runs, nothing
    /// happens.
    pub fn outdate(&self, paths: &[PathBuf], plan: Option<&Plan>) {
        let running = self.running.lock().upgrade();
        if let Some(running) = running {
            running.outdate(&ChangedPaths::new(paths), plan);
        }
    }

    /// Makes a build the one that [`BuildSession::outdate`] reaches, as long as `running` is alive.
    pub(crate) fn begin(&self, running: &Arc<RunningBuild>) {
        self.watched.iter().for_each(WatchedChanges::begin);
        *self.running.lock() = Arc::downgrade(running);
    }

    pub(crate) fn begin_reads(&self) -> Arc<ReadSet> {
        let reads = Arc::<ReadSet>::default();
        self.reads.lock().1 = Arc::clone(&reads);
        reads
    }

    /// The build has ended: its set becomes that of the last build.
    pub(crate) fn end_reads(&self) {
        let mut latest = self.reads.lock();
        latest.0 = std::mem::take(&mut latest.1);
    }

    /// The files that the items of the last build and of the running one read, as far as that is known: a
    /// watcher watches them.
    pub(crate) fn read_sets(&self) -> [Arc<ReadSet>; 2] {
        let latest = self.reads.lock();
        [Arc::clone(&latest.0), Arc::clone(&latest.1)]
    }
}
