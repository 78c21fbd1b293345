//! Where items pause while others run that somebody looks at: at each
//! [`Reporter::check_cancelled`](crate::kinds::reporter::Reporter::check_cancelled).

use std::sync::Arc;
use std::time::Duration;

use parking_lot::{Condvar, Mutex};

/// A gate where other items pause while wanted ones run.
#[derive(Debug, Default)]
pub(crate) struct Gate {
    wanted: Mutex<usize>,
    opened: Condvar,
}

impl Gate {
    /// A wanted item is to run; until the guard is dropped, others pause.
    pub(crate) fn close(self: &Arc<Self>) -> ClosedGate {
        *self.wanted.lock() += 1;
        ClosedGate(Arc::clone(self))
    }

    /// Pauses while the gate is closed, unless `stop` says so.
    pub(crate) fn pass(&self, stop: impl Fn() -> bool) {
        let mut wanted = self.wanted.lock();
        while *wanted > 0 && !stop() {
            self.opened.wait_for(&mut wanted, Duration::from_millis(20));
        }
    }
}

/// Keeps a gate closed.
pub(crate) struct ClosedGate(Arc<Gate>);

impl Drop for ClosedGate {
    fn drop(&mut self) {
        *self.0.wanted.lock() -= 1;
        self.0.opened.notify_all();
    }
}
