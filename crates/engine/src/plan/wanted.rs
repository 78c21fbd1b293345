//! What somebody looks at: its items go first.
//!
//! Items that are wanted, and those that they need, are started before all others and on threads of their
//! own, so that nothing that runs already is in their way; the other items pause meanwhile (`gate.rs`). A
//! change that makes a wanted item stale stops the whole build, so that the next one begins with it.

use std::sync::Arc;

use parking_lot::Mutex;

use super::Plan;
use crate::event::ItemName;

/// The items that somebody looks at. Clones share them, and they may change while a build runs.
#[derive(Clone, Debug, Default)]
pub struct Wanted(Arc<Mutex<Items>>);

#[derive(Debug, Default)]
struct Items {
    names: Vec<ItemName>,
    version: u64,
}

impl Wanted {
    /// Makes these items wanted from now on, with all that they need, and no others.
    pub fn set(&self, names: Vec<ItemName>) {
        let mut items = self.0.lock();
        if items.names != names {
            items.names = names;
            items.version += 1;
        }
    }

    /// A number that changes when the items do.
    pub(crate) fn version(&self) -> u64 {
        self.0.lock().version
    }

    /// For each item of a plan, whether it is wanted or needed by one that is.
    pub(crate) fn among(&self, plan: &Plan) -> Vec<bool> {
        let mut wanted = vec![false; plan.items.len()];
        let items = self.0.lock();
        if items.names.is_empty() {
            return wanted;
        }
        // Items come after those that they need.
        for (index, item) in plan.items.iter().enumerate().rev() {
            let is_named =
                |name: &ItemName| name.key == item.key && name.stage == plan.stages[item.stage].name;
            if wanted[index] || items.names.iter().any(is_named) {
                wanted[index] = true;
                item.inputs.iter().flatten().for_each(|input| wanted[*input] = true);
            }
        }
        wanted
    }
}
