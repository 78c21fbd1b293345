//! The tasks that are ready, the most urgent first.

use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::time::Duration;

use crate::build::up_to_date::UpToDateCheck;
use crate::kinds::Product;
use crate::plan::{ItemIndex, Stage};

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Task {
    Run(ItemIndex),
    Publish(ItemIndex),
    Fetch(ItemIndex),
    /// Ask other machines for the result.
    Find(ItemIndex),
}

/// What is wanted goes first, and what takes long goes last.
///
/// Of the rest, exports go before artifacts, and artifacts of later stages before those of earlier ones, so
/// that the inputs kept for them can be dropped soon.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Urgency {
    is_wanted: bool,
    /// How long the task takes, if that is noticed.
    long: Reverse<u32>,
    is_export: bool,
    stage: usize,
}

/// Milliseconds that nobody notices: what takes less is not worth a place of its own in the order.
const NOTICED: f64 = 32.0;

/// Doublings of [`NOTICED`] below which a task is short: a longer one does not start beside it. Both would
/// use all threads, so that neither ends sooner, and a thread that waits for parts of the short one could
/// begin the longer one and end that first.
const SHORT: u32 = 2;

/// Milliseconds of an item of a slow kind that never ran.
const SLOW: f64 = 1e4;

impl Urgency {
    fn of(item: ItemIndex, task: Task, check: &UpToDateCheck<'_>, wanted: &[bool]) -> Self {
        let stage = check.plan.items[item].stage;
        let Stage { kind, product, .. } = &check.plan.stages[stage];
        let milliseconds = match (task, check.latest(item)) {
            (Task::Run(_), Some(latest)) => latest.milliseconds(),
            (Task::Run(_), None) if kind.is_slow() => SLOW,
            _ => 0.0,
        };
        // In doublings: small differences are chance.
        let doublings = (milliseconds / NOTICED).max(1.0).log2() as u32;
        Self {
            is_wanted: wanted[item],
            long: Reverse(doublings),
            is_export: matches!(product, Product::Files(_)),
            stage,
        }
    }
}

/// The most urgent of some tasks.
#[derive(Clone, Copy)]
pub(super) struct FirstTask {
    pub(super) task: Task,
    pub(super) is_wanted: bool,
    pub(super) length: Length,
}

/// How long a task takes, in doublings of [`NOTICED`].
#[derive(Clone, Copy)]
pub(super) struct Length(u32);

impl Length {
    /// Whether a task does not start beside an item of another length that has run for so long. One that
    /// turns out not to be short is no longer waited for.
    pub(super) fn waits_for(self, other: Self, ran: Duration) -> bool {
        other.0 < SHORT.min(self.0) && 1e3 * ran.as_secs_f64() < NOTICED * f64::from(1 << SHORT)
    }
}

#[derive(Default)]
pub(super) struct Tasks(BinaryHeap<(Urgency, Reverse<ItemIndex>, Task)>);

impl Tasks {
    /// Adds a task of an item. Of equally urgent tasks, that of the earlier item goes first.
    pub(super) fn push(&mut self, item: ItemIndex, task: Task, check: &UpToDateCheck<'_>, wanted: &[bool]) {
        self.0.push((Urgency::of(item, task, check, wanted), Reverse(item), task));
    }

    /// Sorts the tasks again: other items are wanted.
    pub(super) fn want(&mut self, wanted: &[bool]) {
        let again = |(urgency, item, task): (Urgency, Reverse<ItemIndex>, Task)| {
            (Urgency { is_wanted: wanted[item.0], ..urgency }, item, task)
        };
        self.0 = std::mem::take(&mut self.0).into_iter().map(again).collect();
    }

    /// The most urgent task.
    pub(super) fn first(&self) -> Option<FirstTask> {
        let (urgency, _, task) = self.0.peek()?;
        Some(FirstTask { task: *task, is_wanted: urgency.is_wanted, length: Length(urgency.long.0) })
    }

    /// Takes the most urgent task.
    pub(super) fn pop(&mut self) -> Option<FirstTask> {
        let first = self.first();
        self.0.pop();
        first
    }
}
