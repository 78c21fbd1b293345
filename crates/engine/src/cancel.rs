//! Flags that tell running work to stop.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Asks running work to stop. Clones share one flag.
#[derive(Clone, Debug, Default)]
pub struct Cancel {
    flag: Arc<AtomicBool>,
    parent: Option<Arc<Cancel>>,
}

impl Cancel {
    /// Asks everyone who holds a clone to stop.
    pub fn cancel(&self) {
        self.flag.store(true, Ordering::Relaxed);
    }

    /// A flag for a part of the work, which stops with the whole or by itself.
    #[must_use]
    pub fn child(&self) -> Self {
        Self { flag: Arc::default(), parent: Some(Arc::new(self.clone())) }
    }

    /// Whether to stop.
    pub fn is_cancelled(&self) -> bool {
        self.flag.load(Ordering::Relaxed) || self.parent.as_ref().is_some_and(|parent| parent.is_cancelled())
    }
}

/// Whether a change has made one item of a running build stale.
pub(crate) struct StaleFlag {
    flags: Arc<[AtomicBool]>,
    item: usize,
}

impl StaleFlag {
    pub(crate) fn new(flags: &Arc<[AtomicBool]>, item: usize) -> Self {
        Self { flags: Arc::clone(flags), item }
    }

    /// Whether the item is to stop.
    pub(crate) fn is_set(&self) -> bool {
        self.flags[self.item].load(Ordering::Relaxed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_part_stops_with_the_whole_or_by_itself() {
        let whole = Cancel::default();
        let [one, other] = [whole.child(), whole.child()];
        one.cancel();
        assert!(one.is_cancelled() && !other.is_cancelled() && !whole.is_cancelled());
        whole.clone().cancel();
        assert!(other.is_cancelled());
    }
}
