//! When the progress of running items is reported: only of those that take long, and not too often.

use std::sync::Arc;
use std::time::Duration;

use crate::kinds::ShareDone;
use crate::plan::ItemIndex;

/// The progress of an item that takes less time is not reported.
const MIN_REPORTED: Duration = Duration::from_secs(1);

/// The least time between two reports on an item.
const INTERVAL: Duration = Duration::from_millis(100);

/// The least difference that is worth a report.
const STEP: f64 = 0.01;

#[derive(Default)]
pub(super) struct RunningItems(Vec<RunningItem>);

struct RunningItem {
    item: ItemIndex,
    done: Arc<ShareDone>,
    /// When the item is reported next, at the earliest.
    due: Duration,
    reported: f64,
}

impl RunningItems {
    /// An item starts to run now, and raises this share. Times are those of any one clock.
    pub(super) fn started(&mut self, item: ItemIndex, done: Arc<ShareDone>, now: Duration) {
        self.0.push(RunningItem { item, done, due: now + MIN_REPORTED, reported: 0.0 });
    }

    pub(super) fn ended(&mut self, item: ItemIndex) {
        self.0.retain(|running| running.item != item);
    }

    /// The items whose progress is to be reported now, and the shares of their work that are done.
    pub(super) fn due(&mut self, now: Duration) -> Vec<(ItemIndex, f64)> {
        let report = |running: &mut RunningItem| {
            let share = running.done.get();
            if now < running.due || share < running.reported + STEP {
                return None;
            }
            (running.due, running.reported) = (now + INTERVAL, share);
            Some((running.item, share))
        };
        self.0.iter_mut().filter_map(report).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(milliseconds: u64) -> Duration {
        Duration::from_millis(milliseconds)
    }

    #[test]
    fn long_items_are_reported_ten_times_a_second_and_short_ones_never() {
        let (mut running, long, short) = (RunningItems::default(), Arc::default(), Arc::default());
        running.started(7, Arc::clone(&long), at(500));
        running.started(8, Arc::clone(&short), at(600));
        let mut reports = Vec::new();
        for now in (500..=4500).step_by(20) {
            long.raise((now - 500) as f64 / 4000.0);
            short.raise(0.9);
            if now == 1580 {
                running.ended(8);
            }
            reports.extend(running.due(at(now)).into_iter().map(|(item, share)| (now, item, share)));
        }
        assert!(reports.iter().all(|(_, item, _)| *item == 7), "{reports:?}");
        assert_eq!(reports[0], (1500, 7, 0.25), "after a second");
        for pair in reports.windows(2) {
            assert!(pair[0].0 + 100 <= pair[1].0 && pair[0].2 < pair[1].2, "{pair:?}");
        }
        assert!(reports.len() == 31 && reports[30].2 == 1.0, "{reports:?}");
    }

    #[test]
    fn an_item_that_makes_no_progress_or_reports_none_is_silent() {
        let (mut running, done) = (RunningItems::default(), Arc::<ShareDone>::default());
        running.started(0, Arc::clone(&done), at(0));
        assert_eq!(running.due(at(5000)), []);
        done.raise(0.5);
        assert_eq!(running.due(at(5020)), [(0, 0.5)]);
        done.raise(0.505);
        assert_eq!(running.due(at(6000)), []);
    }
}
