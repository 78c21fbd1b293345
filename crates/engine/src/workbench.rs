//! What stays between the builds of one process, so that a watcher's next build begins warm.

use std::collections::BTreeSet;
use std::path::PathBuf;
use std::sync::{Mutex, PoisonError};

use rayon::{ThreadPool, ThreadPoolBuilder};

use crate::memory::Memory;
use crate::{Error, ErrorKind};

/// The threads of a process's builds, and what they remember from one build to the next.
///
/// It holds no lock: between its builds another process may build in the same folder.
pub struct Workbench {
    pub(crate) pool: ThreadPool,
    /// The files and (`true`) listings that the items of the last build read.
    places: Mutex<BTreeSet<(PathBuf, bool)>>,
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
        Ok(Self { pool, places: Mutex::default(), memory: Memory::new(memory) })
    }

    /// Remembers what the items of a build read.
    pub(crate) fn remember_places(&self, places: BTreeSet<(PathBuf, bool)>) {
        *self.places.lock().unwrap_or_else(PoisonError::into_inner) = places;
    }

    /// The files and (`true`) listings that the items of the last build read: what a watcher attends to.
    pub(crate) fn places(&self) -> BTreeSet<(PathBuf, bool)> {
        self.places.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }
}
