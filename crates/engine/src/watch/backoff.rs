//! The pauses before something that failed is tried again.

use std::time::Duration;

/// Pauses that double from try to try, up to the longest.
#[derive(Debug)]
pub(crate) struct Backoff {
    first: Duration,
    longest: Duration,
    next: Duration,
}

impl Backoff {
    pub(crate) fn new(first: Duration, longest: Duration) -> Self {
        Self { first, longest, next: first }
    }

    /// The pause before the next try; the one after that will be twice as long.
    pub(super) fn pause(&mut self) -> Duration {
        let pause = self.next;
        self.next = (pause * 2).min(self.longest);
        pause
    }

    /// Begins with the first pause again.
    pub(super) fn reset(&mut self) {
        self.next = self.first;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pauses_double_up_to_the_longest_and_a_reset_begins_with_the_first() {
        let mut backoff = Backoff::new(Duration::from_secs(1), Duration::from_secs(60));
        let pauses =
            |backoff: &mut Backoff, count| (0..count).map(|_| backoff.pause().as_secs()).collect::<Vec<_>>();
        assert_eq!(pauses(&mut backoff, 9), [1, 2, 4, 8, 16, 32, 60, 60, 60]);
        backoff.reset();
        assert_eq!(pauses(&mut backoff, 2), [1, 2]);
    }
}
