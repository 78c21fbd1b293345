//! How much of a running item's work is done.

use std::sync::atomic::{AtomicU64, Ordering};

/// The share of an item's work that is done, 0 to 1. It never falls.
#[derive(Debug, Default)]
pub(crate) struct ShareDone(AtomicU64);

impl ShareDone {
    /// Raises the share to at least this.
    pub(crate) fn raise(&self, share: f64) {
        let share = if share > 0.0 { share.min(1.0) } else { 0.0 };
        // The bits of numbers that are not negative are in the order of the numbers.
        self.0.fetch_max(share.to_bits(), Ordering::Relaxed);
    }

    pub(crate) fn get(&self) -> f64 {
        f64::from_bits(self.0.load(Ordering::Relaxed))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_share_never_falls_and_ends_at_1() {
        let done = ShareDone::default();
        assert_eq!(done.get(), 0.0);
        let given = [0.25, 0.125, -3.0, f64::NAN, 0.5, 7.0, 0.75, f64::NEG_INFINITY];
        let seen = given.map(|share| {
            done.raise(share);
            done.get()
        });
        assert_eq!(seen, [0.25, 0.25, 0.25, 0.25, 0.5, 1.0, 1.0, 1.0]);
    }
}
