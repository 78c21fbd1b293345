//! The tasks that are ready, the most urgent first.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use crate::up_to_date::UpToDateCheck;
use crate::{ItemIndex, Product};

/// A task of a worker.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Task {
    Run(ItemIndex),
    Publish(ItemIndex),
    Fetch(ItemIndex),
}

/// Exports go before artifacts, and artifacts of later stages before those of earlier ones, so that the
/// inputs kept for them can be dropped soon. Exports that took little time in their last run go first:
/// whoever waits for a map does not wait for the report.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Urgency {
    /// An artifact of this stage.
    Artifact(usize),
    /// Files: how long they took, and the stage.
    Export(Reverse<u32>, usize),
}

impl Urgency {
    fn of(item: ItemIndex, check: &UpToDateCheck<'_>) -> Self {
        let stage = check.plan.items[item].stage;
        match check.plan.stages[stage].product {
            Product::Artifact(_) => Self::Artifact(stage),
            Product::Files(_) => {
                let milliseconds = check.latest(item).map_or(0.0, |latest| latest.milliseconds());
                // In doublings, from what nobody notices on: small differences are chance.
                let doublings = (milliseconds / 32.0).max(1.0).log2() as u32;
                Self::Export(Reverse(doublings), stage)
            }
        }
    }
}

/// The tasks that are ready.
#[derive(Default)]
pub(super) struct Tasks(BinaryHeap<(Urgency, Reverse<ItemIndex>, Task)>);

impl Tasks {
    /// Adds a task of an item. Of equally urgent tasks, that of the earlier item goes first.
    pub(super) fn push(&mut self, item: ItemIndex, task: Task, check: &UpToDateCheck<'_>) {
        self.0.push((Urgency::of(item, check), Reverse(item), task));
    }

    /// Takes the most urgent task.
    pub(super) fn pop(&mut self) -> Option<Task> {
        self.0.pop().map(|(_, _, task)| task)
    }
}
