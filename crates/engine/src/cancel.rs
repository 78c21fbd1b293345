//! Flags that tell running work to stop.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Asks running work to stop. Clones share one flag.
#[derive(Clone, Debug, Default)]
pub struct Cancel(Arc<AtomicBool>);

impl Cancel {
    /// Asks everyone who holds a clone to stop.
    pub fn cancel(&self) {
        self.0.store(true, Ordering::Relaxed);
    }

    /// Whether to stop.
    pub fn is_cancelled(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}

/// Whether a change has made one item of a running build stale.
pub(crate) struct StaleFlag {
    /// The flags of all items of the build.
    flags: Arc<[AtomicBool]>,
    item: usize,
}

impl StaleFlag {
    /// The flag of an item of a build.
    pub(crate) fn new(flags: &Arc<[AtomicBool]>, item: usize) -> Self {
        Self { flags: Arc::clone(flags), item }
    }

    /// Whether the item is to stop.
    pub(crate) fn is_set(&self) -> bool {
        self.flags[self.item].load(Ordering::Relaxed)
    }
}
