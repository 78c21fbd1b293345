//! Where a thread finds what it is to do: only the latest wish counts.

use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// A place for one wish, taken by one thread.
#[derive(Debug)]
pub(crate) struct LatestValue<T> {
    inside: Mutex<Inside<T>>,
    changed: Condvar,
}

#[derive(Debug)]
struct Inside<T> {
    wish: Option<T>,
    /// How many wishes there have been.
    count: u64,
    ended: bool,
}

impl<T> LatestValue<T> {
    pub(crate) fn new() -> Self {
        let inside = Inside { wish: None, count: 0, ended: false };
        Self { inside: Mutex::new(inside), changed: Condvar::new() }
    }

    /// Wishes; an earlier wish that was not taken yet is forgotten, one that was taken is stale.
    pub(crate) fn put(&self, wish: T) {
        let mut inside = self.inside();
        inside.wish = Some(wish);
        inside.count += 1;
        self.changed.notify_all();
    }

    /// Nothing more will be wished: all that is taken is stale, and [`LatestValue::take`] returns `None`.
    pub(crate) fn end(&self) {
        self.inside().ended = true;
        self.changed.notify_all();
    }

    /// Waits for a wish. With it comes its number, by which it is known to be stale.
    pub(crate) fn take(&self) -> Option<(u64, T)> {
        let mut inside = self.inside();
        loop {
            if inside.ended {
                return None;
            }
            if let Some(wish) = inside.wish.take() {
                return Some((inside.count, wish));
            }
            inside = self.changed.wait(inside).unwrap_or_else(PoisonError::into_inner);
        }
    }

    /// Whether something else is wanted by now.
    pub(crate) fn is_stale(&self, number: u64) -> bool {
        let inside = self.inside();
        inside.ended || inside.count != number
    }

    /// Whether nothing more will be wished.
    pub(crate) fn has_ended(&self) -> bool {
        self.inside().ended
    }

    /// Waits until something else is wanted, but no longer than `most`; says whether it is.
    pub(crate) fn becomes_stale(&self, number: u64, most: Duration) -> bool {
        let until = Instant::now() + most;
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
    fn only_the_latest_wish_is_found() {
        let mailbox = LatestValue::new();
        for wish in 1..=3 {
            mailbox.put(wish);
        }
        let (number, wish) = mailbox.take().unwrap();
        assert_eq!(wish, 3);
        assert!(!mailbox.is_stale(number));
        mailbox.put(4);
        assert!(mailbox.is_stale(number) && mailbox.becomes_stale(number, Duration::from_secs(60)));
        let (number, _) = mailbox.take().unwrap();
        assert!(!mailbox.becomes_stale(number, Duration::from_millis(1)));
    }

    #[test]
    fn an_end_wakes_whoever_waits() {
        let mailbox: LatestValue<u32> = LatestValue::new();
        std::thread::scope(|scope| {
            let waiting = scope.spawn(|| mailbox.take());
            mailbox.end();
            assert_eq!(waiting.join().unwrap(), None);
        });
        assert!(mailbox.is_stale(0));
    }
}
