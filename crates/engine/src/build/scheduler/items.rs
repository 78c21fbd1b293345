//! The items of a build as the scheduler sees them.

use std::sync::Arc;

use crate::event::ItemName;
use crate::kinds::Handle;
use crate::plan::{ItemIndex, Plan, Selection};
use crate::storage::{Blob, Cause};

#[derive(Clone, Debug, PartialEq)]
pub(super) enum Phase {
    /// The item waits for its inputs, or for its turn.
    Waiting,
    /// The item is being run or published, or its inputs are being fetched.
    Busy,
    Done,
    /// The item failed, or was skipped because of the named item.
    Failed(ItemName),
    Stopped,
}

/// An item as the scheduler sees it.
pub(super) struct Progress {
    pub(super) phase: Phase,
    /// The number of inputs that are not finished.
    pub(super) waiting: usize,
    /// The items that need its artifact.
    pub(super) consumers: Vec<ItemIndex>,
    /// The number of consumers that may still need the artifact.
    pub(super) users: usize,
    /// The number of inputs that have to be fetched before it can run.
    pub(super) missing: usize,
    /// The item's outputs, new or found; `None`: those of its latest record.
    pub(super) outputs: Option<Vec<Blob>>,
    pub(super) handle: Option<Arc<Handle>>,
    /// The consumers that cannot run before the artifact is fetched or made again.
    pub(super) fetchers: Vec<ItemIndex>,
    /// Whether its consumers know that it is finished.
    pub(super) announced: bool,
    /// Whether its stored result turned out to be lost.
    pub(super) lost: bool,
    /// The server where its result was found in this build, if another machine made that.
    pub(super) found_at: Option<String>,
    /// Whether other machines were asked in vain for its result, or for that of an item before it.
    pub(super) is_missed: bool,
    /// The causes of the change of its artifact in this build.
    pub(super) causes: Vec<Cause>,
    pub(super) ran: bool,
    /// The place where it runs, unless that refuses it.
    pub(super) place: usize,
    /// Why it does not run in the place before.
    pub(super) why_here: Option<String>,
}

impl Progress {
    /// An item of which nothing is known yet, but that it waits for so many inputs or is complete.
    fn new(waiting: usize, is_complete: bool) -> Self {
        Self {
            phase: Phase::Waiting,
            waiting,
            consumers: Vec::new(),
            users: 0,
            missing: 0,
            outputs: None,
            handle: None,
            fetchers: Vec::new(),
            announced: is_complete,
            lost: false,
            found_at: None,
            is_missed: false,
            causes: Vec::new(),
            ran: false,
            place: 0,
            why_here: None,
        }
    }
}

/// The items of a plan at the begin of a build, given for each whether nothing has to be done for it.
pub(super) fn items_of(plan: &Plan, selected: &Selection, is_complete: &[bool]) -> Vec<Progress> {
    let mut items = Vec::<Progress>::with_capacity(plan.items.len());
    for (index, item) in plan.items.iter().enumerate() {
        let mut waiting = 0;
        if selected.has(index) && !is_complete[index] {
            // Items come after those that they need.
            for input in distinct(item.inputs.iter().flatten().copied()) {
                items[input].consumers.push(index);
                items[input].users += 1;
                waiting += usize::from(!is_complete[input]);
            }
        }
        items.push(Progress::new(waiting, is_complete[index]));
    }
    items
}

pub(super) fn distinct(items: impl Iterator<Item = ItemIndex>) -> Vec<ItemIndex> {
    let mut all = items.collect::<Vec<_>>();
    all.sort_unstable();
    all.dedup();
    all
}
