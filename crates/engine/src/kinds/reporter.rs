//! What a running item reports, and whether it is to stop.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use parking_lot::Mutex;

use super::failure::Failure;
use super::gate::Gate;
use super::progress::ShareDone;
use crate::cancel::{Cancel, StaleFlag};

/// Takes what a running item reports: warnings, notes and progress. It also says whether the item is to stop.
#[derive(Default)]
pub struct Reporter {
    pub(super) cancel: Cancel,
    /// Whether a change has made the item stale.
    pub(crate) stale: Option<StaleFlag>,
    /// Where the item pauses while wanted items run.
    pub(crate) gate: Option<Arc<Gate>>,
    pub(crate) share: Arc<ShareDone>,
    warnings: Mutex<Vec<String>>,
    notes: Mutex<Vec<String>>,
    /// Whether the item was told to stop.
    was_stopped: AtomicBool,
}

impl Reporter {
    /// A reporter for an item that can be cancelled.
    pub fn new(cancel: Cancel) -> Self {
        Self { cancel, ..Self::default() }
    }

    /// Warns the user about something that they should check.
    pub fn warn(&self, message: impl Into<String>) {
        self.warnings.lock().push(message.into());
    }

    /// Reports a fact about the result to the user: the degree that was chosen, and why.
    pub fn note(&self, message: impl Into<String>) {
        self.notes.lock().push(message.into());
    }

    /// Reports that this share of the item's work is done, 0 to 1; a lower one than before is ignored. A
    /// person sees it if the item takes long. It may be called from any thread, and often; see
    /// [`Steps`](crate::kinds::steps::Steps) for work that is done in steps.
    pub fn progress(&self, share: f64) {
        self.share.raise(share);
    }

    /// Returns early from work that is no longer needed, and pauses while an item runs that somebody looks
    /// at. To be called at least ten times a second.
    ///
    /// # Errors
    /// [`Failure::cancelled`] if the build is cancelled, or the item's files, parameters or inputs have
    /// changed.
    pub fn check_cancelled(&self) -> Result<(), Failure> {
        let is_stopped = || self.cancel.is_cancelled() || self.is_stale();
        if let Some(gate) = &self.gate {
            gate.pass(is_stopped);
        }
        if !is_stopped() {
            return Ok(());
        }
        self.was_stopped.store(true, Ordering::Relaxed);
        Err(Failure::cancelled())
    }

    /// The share of the work that was reported as done.
    pub fn share_done(&self) -> f64 {
        self.share.get()
    }

    /// The warnings so far.
    pub fn warnings(&self) -> Vec<String> {
        self.warnings.lock().clone()
    }

    /// The notes so far.
    pub fn notes(&self) -> Vec<String> {
        self.notes.lock().clone()
    }

    /// Whether the item's files, parameters or inputs have changed.
    pub(crate) fn is_stale(&self) -> bool {
        self.stale.as_ref().is_some_and(StaleFlag::is_set)
    }

    /// Whether the item was told to stop.
    pub(super) fn was_stopped(&self) -> bool {
        self.was_stopped.load(Ordering::Relaxed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reports_are_kept_in_their_order() {
        let reporter = Reporter::default();
        reporter.warn("loud");
        reporter.note("two stars");
        reporter.note("three moons".to_owned());
        reporter.progress(0.5);
        reporter.progress(0.25);
        assert_eq!(reporter.warnings(), ["loud"]);
        assert_eq!(reporter.notes(), ["two stars", "three moons"]);
        assert_eq!(reporter.share_done(), 0.5);
    }

    #[test]
    fn an_item_stops_if_the_build_is_cancelled_or_the_item_is_stale() {
        let cancel = Cancel::default();
        let flags = Arc::from([AtomicBool::new(false), AtomicBool::new(false)]);
        let cancelled = Reporter::new(cancel.clone());
        let stale = Reporter { stale: Some(StaleFlag::new(&flags, 1)), ..Reporter::default() };
        for reporter in [&cancelled, &stale] {
            assert_eq!(reporter.check_cancelled(), Ok(()));
            assert!(!reporter.was_stopped());
        }
        cancel.cancel();
        flags[1].store(true, Ordering::Relaxed);
        for reporter in [&cancelled, &stale] {
            assert!(!reporter.was_stopped());
            assert_eq!(reporter.check_cancelled(), Err(Failure::cancelled()));
            assert!(reporter.was_stopped());
        }
        assert!(stale.is_stale() && !cancelled.is_stale());
    }
}
