//! The causes of a rerun.
//!
//! An item reruns because an input changed, and that changed because of something further up. A cause is the
//! reason at the far end of such a chain: the file, parameter or kind that changed first.

use std::cell::LazyCell;
use std::collections::HashMap;

use super::up_to_date::UpToDateCheck;
use crate::event::Reason;
use crate::plan::ItemIndex;
use crate::storage::{Cause, Record};

/// At most this many causes of an item are followed: of a contact sheet of thousands of items, each with
/// another cause, the first few are named.
const MAX_CAUSES: usize = 8;

impl UpToDateCheck<'_> {
    /// The causes of an item's run for some reasons, given the causes of the change of each input.
    pub(crate) fn causes(
        &self,
        item: ItemIndex,
        reasons: &[Reason],
        of_input: impl Fn(ItemIndex) -> Vec<Cause>,
    ) -> Vec<Cause> {
        let name = self.name(item);
        let inputs = LazyCell::new(|| {
            let inputs = self.plan.items[item].inputs.iter().flatten();
            inputs.map(|input| (self.name(*input), *input)).collect::<HashMap<_, _>>()
        });
        let mut causes = Vec::<Cause>::new();
        for reason in reasons {
            let further = match reason {
                Reason::Awaits { item: from, .. } | Reason::Input { item: from, new: Some(_), .. } => {
                    inputs.get(from).map_or_else(Vec::new, |input| of_input(*input))
                }
                _ => Vec::new(),
            };
            let further = further.into_iter().map(|mut cause| {
                cause.chain.push(name.clone());
                cause
            });
            let mut further = further.collect::<Vec<_>>();
            if further.is_empty() {
                further.push(Cause { reason: reason.clone(), chain: vec![name.clone()] });
            }
            for cause in further {
                let known = |other: &Cause| {
                    other.reason == cause.reason && other.chain.first() == cause.chain.first()
                };
                if causes.len() < MAX_CAUSES && !causes.iter().any(known) {
                    causes.push(cause);
                }
            }
        }
        causes
    }

    pub(crate) fn last_causes(&self, item: ItemIndex) -> Vec<Cause> {
        self.record(item).map_or_else(Vec::new, |record| self.causes_of(item, &record))
    }

    pub(crate) fn causes_of(&self, item: ItemIndex, record: &Record) -> Vec<Cause> {
        if record.causes.is_empty() {
            // Each reason is a cause itself, or the record is older than causes are.
            self.causes(item, &record.reasons, |_| Vec::new())
        } else {
            record.causes.clone()
        }
    }
}
