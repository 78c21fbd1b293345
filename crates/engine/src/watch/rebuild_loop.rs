//! Finds builds that cause themselves.
//!
//! A change that is noticed while a build runs, or just after it, may come from that build: from a program
//! that a stage runs, or from a file of `out` that is a source by another name. If an item runs again and
//! again because of nothing but such changes, its watcher stops, until something else changes. It looks once
//! more after a while: a person may have saved a file just while it was built, each time.

use std::collections::{HashMap, VecDeque};
use std::time::{Duration, Instant};

use crate::ItemName;

/// An item may run so many times within [`PERIOD`] because of its own builds.
const MAX_RUNS: usize = 10;
const PERIOD: Duration = Duration::from_secs(10);

/// The runs of items in builds that may have caused each other.
#[derive(Debug, Default)]
pub(super) struct RebuildLoop {
    /// When each item ran, since the last change that no build can have made; and its place among them in the
    /// order of their first runs.
    runs: HashMap<ItemName, (usize, VecDeque<Instant>)>,
    /// When the last build ended.
    ended: Option<Instant>,
    /// Whether the watcher has stopped.
    is_stopped: bool,
    /// When to look once more.
    look_again: Option<Instant>,
}

/// Whether changes are to be built.
#[derive(Debug, PartialEq)]
pub(super) enum LoopCheck {
    /// They are.
    Build,
    /// They are not any more: this item has run too often because of its own builds.
    Stop(ItemName),
    /// They are not, because the watcher has stopped.
    Stopped,
}

impl RebuildLoop {
    /// Checks changes that are about to be built, the last of which came at a time. `latency` is the longest
    /// time that a change takes to be noticed.
    pub(super) fn check(&mut self, changed: Instant, latency: Duration) -> LoopCheck {
        if self.ended.is_none_or(|ended| changed > ended + latency) {
            *self = Self { ended: self.ended, ..Self::default() };
            return LoopCheck::Build;
        }
        if self.is_stopped {
            return LoopCheck::Stopped;
        }
        let now = Instant::now();
        for (_, runs) in self.runs.values_mut() {
            while runs.front().is_some_and(|run| *run + PERIOD < now) {
                runs.pop_front();
            }
        }
        // The first of them is the one that reads what changes.
        let too_often = self.runs.iter().filter(|(_, (_, runs))| runs.len() > MAX_RUNS);
        let Some((item, _)) = too_often.min_by_key(|(_, (place, _))| *place) else {
            return LoopCheck::Build;
        };
        (self.is_stopped, self.look_again) = (true, Some(now + PERIOD));
        LoopCheck::Stop(item.clone())
    }

    /// When to look once more, if the watcher has stopped.
    pub(super) fn look_again(&self) -> Option<Instant> {
        self.look_again
    }

    /// Whether it is time to look once more. The next time does not come before somebody changes something.
    pub(super) fn take_look(&mut self) -> bool {
        self.look_again.take_if(|time| *time <= Instant::now()).is_some()
    }

    /// A build has ended, in which these items ran, in this order.
    pub(super) fn build_ended(&mut self, ran: impl IntoIterator<Item = ItemName>) {
        let now = Instant::now();
        for item in ran {
            let place = self.runs.len();
            self.runs.entry(item).or_insert((place, VecDeque::new())).1.push_back(now);
        }
        self.ended = Some(now);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ItemKey;

    fn item() -> ItemName {
        ItemName { stage: "text".into(), key: ItemKey::default() }
    }

    #[test]
    fn an_item_that_runs_because_of_its_own_builds_is_found_after_ten_runs() {
        let mut builds = RebuildLoop::default();
        let latency = Duration::from_secs(1);
        for _ in 0..MAX_RUNS {
            assert_eq!(builds.check(Instant::now(), latency), LoopCheck::Build);
            builds.build_ended([item()]);
        }
        assert_eq!(builds.check(Instant::now(), latency), LoopCheck::Build);
        builds.build_ended([item()]);
        assert_eq!(builds.check(Instant::now(), latency), LoopCheck::Stop(item()));
        builds.build_ended([item()]);
        assert_eq!(builds.check(Instant::now(), latency), LoopCheck::Stopped);
        assert!(builds.look_again().is_some() && !builds.take_look());
        let later = Instant::now() + 2 * latency;
        assert_eq!(builds.check(later, latency), LoopCheck::Build, "somebody else's change");
        assert_eq!(
            builds.check(Instant::now(), latency),
            LoopCheck::Build,
            "the runs are counted from there"
        );
    }
}
