//! A slot for work to do: only the latest request counts.

use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// A slot for one request, which one thread takes.
#[derive(Debug)]
pub(crate) struct LatestValue<T> {
    inside: Mutex<Inside<T>>,
    changed: Condvar,
}

#[derive(Debug)]
struct Inside<T> {
    value: Option<T>,
    /// How many values there have been.
    count: u64,
    ended: bool,
}

impl<T> LatestValue<T> {
    pub(crate) fn new() -> Self {
        let inside = Inside { value: None, count: 0, ended: false };
        Self { inside: Mutex::new(inside), changed: Condvar::new() }
    }

    /// Stores a value. It replaces one that was not taken yet; one that was taken becomes stale.
    pub(crate) fn put(&self, value: T) {
        let mut inside = self.inside();
        inside.value = Some(value);
        inside.count += 1;
        self.changed.notify_all();
    }

    /// Ends the queue: all that was taken is stale, and [`LatestValue::take`] returns `None`.
    pub(crate) fn end(&self) {
        self.inside().ended = true;
        self.changed.notify_all();
    }

    /// Waits for a value. Its number tells [`LatestValue::is_stale`] which one it is.
    pub(crate) fn take(&self) -> Option<(u64, T)> {
        let mut inside = self.inside();
        loop {
            if inside.ended {
                return None;
            }
            if let Some(value) = inside.value.take() {
                return Some((inside.count, value));
            }
            inside = self.changed.wait(inside).unwrap_or_else(PoisonError::into_inner);
        }
    }

    /// Whether a newer value was stored, or the end was reached.
    pub(crate) fn is_stale(&self, number: u64) -> bool {
        let inside = self.inside();
        inside.ended || inside.count != number
    }

    /// Whether [`LatestValue::end`] was called.
    pub(crate) fn has_ended(&self) -> bool {
        self.inside().ended
    }

    /// Waits until a value is stale, but at most for `timeout`; returns whether it is stale.
    pub(crate) fn becomes_stale(&self, number: u64, timeout: Duration) -> bool {
        let until = Instant::now() + timeout;
        let mut inside = self.inside();
        while !inside.ended && inside.count == number {
            let left = until.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return false;
            }
            let waited = self.changed.wait_timeout(inside, left);
            inside = waited.unwrap_or_else(PoisonError::into_inner).0;
        }
        true
    }

    fn inside(&self) -> MutexGuard<'_, Inside<T>> {
        self.inside.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_latest_value_is_taken() {
        let latest = LatestValue::new();
        for value in 1..=3 {
            latest.put(value);
        }
        let (number, value) = latest.take().unwrap();
        assert_eq!(value, 3);
        assert!(!latest.is_stale(number));
        latest.put(4);
        assert!(latest.is_stale(number) && latest.becomes_stale(number, Duration::from_secs(60)));
        let (number, _) = latest.take().unwrap();
        assert!(!latest.becomes_stale(number, Duration::from_millis(1)));
    }

    #[test]
    fn the_end_wakes_a_waiting_thread() {
        let latest: LatestValue<u32> = LatestValue::new();
        std::thread::scope(|scope| {
            let waiting = scope.spawn(|| latest.take());
            latest.end();
            assert_eq!(waiting.join().unwrap(), None);
        });
        assert!(latest.is_stale(0));
    }
}
