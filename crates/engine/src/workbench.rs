//! What stays between the builds of one process, so that a watcher's next build begins warm.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use rayon::{ThreadPool, ThreadPoolBuilder};

use crate::disk::Noted;
use crate::memory::Memory;
use crate::{Error, ErrorKind};

/// The threads of a process's builds, and what they remember from one build to the next.
///
/// It holds no lock: between its builds another process may build in the same folder.
pub struct Workbench {
    pub(crate) pool: ThreadPool,
    /// What the items of the last build read, and of the one under way.
    noted: Mutex<(Arc<Noted>, Arc<Noted>)>,
    pub(crate) memory: Memory,
}

impl Workbench {
    /// A bench with this number of threads (`None`: one per processor) that keeps decoded artifacts of at most so many
    /// encoded bytes in memory, those that were used last: decoded they may take some times that. With 0 each is let go
    /// as soon as no item of the build needs it any more.
    ///
    /// # Errors
    /// Where threads cannot be started.
    pub fn new(jobs: Option<usize>, memory: u64) -> Result<Self, Error> {
        // 0 stands for the number of available cores.
        let built = ThreadPoolBuilder::new().num_threads(jobs.unwrap_or(0)).build();
        let pool =
            built.map_err(|error| Error::new(ErrorKind::Io, format!("cannot start threads: {error}")))?;
        Ok(Self { pool, noted: Mutex::default(), memory: Memory::new(memory) })
    }

    /// A build begins: what it notes here is what its items read.
    pub(crate) fn begin_noting(&self) -> Arc<Noted> {
        let noted = Arc::<Noted>::default();
        self.latest().1 = Arc::clone(&noted);
        noted
    }

    /// The build has noted all.
    pub(crate) fn end_noting(&self) {
        let mut latest = self.latest();
        latest.0 = std::mem::take(&mut latest.1);
    }

    /// What the items of the last builds read, as far as that is known: what a watcher attends to.
    pub(crate) fn noted(&self) -> [Arc<Noted>; 2] {
        let latest = self.latest();
        [Arc::clone(&latest.0), Arc::clone(&latest.1)]
    }

    fn latest(&self) -> MutexGuard<'_, (Arc<Noted>, Arc<Noted>)> {
        self.noted.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
