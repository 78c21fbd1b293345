//! What stays between the builds of one process, so that a watcher's next build begins warm.

use rayon::{ThreadPool, ThreadPoolBuilder};

use crate::{Error, ErrorKind};

/// The threads of a process's builds, and what they remember from one build to the next.
///
/// It holds no lock: between its builds another process may build in the same folder.
pub struct Workbench {
    pub(crate) pool: ThreadPool,
}

impl Workbench {
    /// A bench with this number of threads (`None`: one per processor) that keeps decoded artifacts of at most so many
    /// encoded bytes in memory.
    ///
    /// # Errors
    /// Where threads cannot be started.
    pub fn new(jobs: Option<usize>, _memory: u64) -> Result<Self, Error> {
        // 0 stands for the number of available cores.
        let built = ThreadPoolBuilder::new().num_threads(jobs.unwrap_or(0)).build();
        let pool =
            built.map_err(|error| Error::new(ErrorKind::Io, format!("cannot start threads: {error}")))?;
        Ok(Self { pool })
    }
}
