//! How long work took, without the other work that its thread did meanwhile.
//!
//! A thread that waits for parts of an item on other threads helps them: it may run whole other items. Their
//! time is not the item's own.

use std::cell::Cell;
use std::time::{Duration, Instant};

thread_local! {
    /// The time that this thread spent on other work since the innermost work began.
    static OTHER: Cell<Duration> = const { Cell::new(Duration::ZERO) };
}

/// Does some work, and returns its own time.
pub(crate) fn own_time<T>(work: impl FnOnce() -> T) -> (T, Duration) {
    let around = OTHER.take();
    let clock = Instant::now();
    let done = work();
    let took = clock.elapsed();
    let own = took.saturating_sub(OTHER.replace(around + took));
    (done, own)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_time_of_other_work_on_the_thread_does_not_count() {
        let rest = |milliseconds| std::thread::sleep(Duration::from_millis(milliseconds));
        let (inner, outer) = own_time(|| {
            rest(10);
            let (deeper, inner) = own_time(|| own_time(|| rest(200)).1);
            rest(10);
            (deeper, inner)
        });
        assert!(inner.0 >= Duration::from_millis(200) && inner.1 < Duration::from_millis(150), "{inner:?}");
        assert!(outer >= Duration::from_millis(20) && outer < Duration::from_millis(150), "{outer:?}");
    }
}
