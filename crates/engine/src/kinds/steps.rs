//! The steps of an item's work, which are counted for its progress.

use std::sync::atomic::{AtomicUsize, Ordering};

use super::failure::Failure;
use super::reporter::Reporter;

/// The steps of an item's work, or of a part of it.
///
/// A kind that knows about how many blocks its work has counts them here: people see which share of a long
/// item is done. Steps beyond the given number add nothing.
///
/// # Example: a part of the work has steps of its own
/// ```
/// # use engine::{Failure, Reporter, Steps};
/// fn work(reporter: &Reporter) -> Result<(), Failure> {
///     let steps = Steps::new(reporter, 3);
///     steps.step()?; // A third is done.
///     let part = steps.part(2, 100); // The rest has 100 steps.
///     (0..100).try_for_each(|_| part.step())
/// }
/// ```
pub struct Steps<'a> {
    reporter: &'a Reporter,
    /// The share before the first step, and that of all steps.
    shares: [f64; 2],
    total: usize,
    done: AtomicUsize,
}

impl<'a> Steps<'a> {
    /// All of an item's work.
    pub fn new(reporter: &'a Reporter, total: usize) -> Self {
        Self { reporter, shares: [0.0, 1.0], total, done: AtomicUsize::new(0) }
    }

    /// The next `count` steps as work that has steps of its own.
    pub fn part(&self, count: usize, total: usize) -> Self {
        let done = self.done.fetch_add(count, Ordering::Relaxed);
        let [from, to] = [done, done + count].map(|done| self.share(done));
        Self { reporter: self.reporter, shares: [from, to - from], total, done: AtomicUsize::new(0) }
    }

    /// Counts a step; to be called before it or after it, at least ten times a second.
    ///
    /// # Errors
    /// The errors of [`Reporter::check_cancelled`].
    pub fn step(&self) -> Result<(), Failure> {
        let done = self.done.fetch_add(1, Ordering::Relaxed) + 1;
        self.reporter.progress(self.share(done));
        self.reporter.check_cancelled()
    }

    /// Counts a step, and says whether to stop: for kernels that ask this before each of their blocks.
    pub fn stop(&self) -> bool {
        self.step().is_err()
    }

    /// The reporter of the item that takes the steps.
    pub fn reporter(&self) -> &'a Reporter {
        self.reporter
    }

    /// The share of the item's work after so many steps.
    fn share(&self, done: usize) -> f64 {
        let [from, width] = self.shares;
        from + width * done.min(self.total) as f64 / self.total.max(1) as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cancel::Cancel;

    #[test]
    fn steps_of_parts_add_up_to_the_whole() {
        let cancel = Cancel::default();
        let reporter = Reporter::new(cancel.clone());
        let share = || reporter.share_done();
        let steps = Steps::new(&reporter, 4);
        assert!(!steps.stop());
        assert_eq!(share(), 0.25);
        let part = steps.part(2, 8);
        assert_eq!(share(), 0.25);
        part.step().unwrap();
        assert_eq!(share(), 0.3125);
        // Of a part whose number of steps was too low.
        (0..20).for_each(|_| part.step().unwrap());
        assert_eq!(share(), 0.75);
        let empty = steps.part(1, 0);
        assert_eq!(share(), 0.75);
        empty.step().unwrap();
        steps.step().unwrap();
        assert_eq!(share(), 1.0);
        cancel.cancel();
        assert!(steps.stop() && steps.step().unwrap_err().cancelled);
    }
}
