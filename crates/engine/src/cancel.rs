//! Flags that tell running work to stop.

use std::fmt;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use parking_lot::Mutex;

/// Asks running work to stop. Clones share one flag.
#[derive(Clone, Debug, Default)]
pub struct Cancel {
    flag: Arc<Flag>,
    parent: Option<Arc<Cancel>>,
}

/// Whether to stop, and what wakes those who wait without asking.
#[derive(Default)]
struct Flag {
    is_set: AtomicBool,
    wakers: Mutex<Vec<Box<dyn Fn() + Send + Sync>>>,
}

impl fmt::Debug for Flag {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.is_set.fmt(f)
    }
}

impl Cancel {
    /// Asks everyone who holds a clone to stop.
    pub fn cancel(&self) {
        self.flag.is_set.store(true, Ordering::SeqCst);
        self.flag.wakers.lock().iter().for_each(|wake| wake());
    }

    /// Calls `wake` when the work is to stop, perhaps more than once: for who waits and does not ask.
    pub(crate) fn when_cancelled(&self, wake: impl Fn() + Clone + Send + Sync + 'static) {
        if let Some(parent) = &self.parent {
            parent.when_cancelled(wake.clone());
        }
        self.flag.wakers.lock().push(Box::new(wake.clone()));
        if self.flag.is_set.load(Ordering::SeqCst) {
            wake();
        }
    }

    /// A flag for a part of the work, which stops with the whole or by itself.
    #[must_use]
    pub fn child(&self) -> Self {
        Self { flag: Arc::default(), parent: Some(Arc::new(self.clone())) }
    }

    /// Whether to stop.
    pub fn is_cancelled(&self) -> bool {
        self.flag.is_set.load(Ordering::Relaxed)
            || self.parent.as_ref().is_some_and(|parent| parent.is_cancelled())
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

    #[test]
    fn who_waits_is_woken_by_the_part_or_the_whole_also_if_it_comes_late() {
        let (whole, woken) = (Cancel::default(), Arc::new(AtomicBool::new(false)));
        let flag = Arc::clone(&woken);
        let wake = move || flag.store(true, Ordering::Relaxed);
        let is_woken = || woken.swap(false, Ordering::Relaxed);
        let [one, other] = [whole.child(), whole.child()];
        one.when_cancelled(wake.clone());
        other.cancel();
        assert!(!is_woken());
        one.cancel();
        assert!(is_woken());
        one.when_cancelled(wake.clone());
        assert!(is_woken());
        whole.child().when_cancelled(wake);
        whole.cancel();
        assert!(is_woken());
    }
}
