//! Results that were made before, or by another item or machine, as the latest records of items.

use super::UpToDateCheck;
use crate::error::Error;
use crate::event::Reason;
use crate::plan::ItemIndex;
use crate::shared::Shared;
use crate::storage::{Blob, Cause, FromCache, Line, Record, Tag, short, worth_keeping};
use crate::timestamp::Timestamp;

impl UpToDateCheck<'_> {
    /// The latest record of an item that has this result; the next run is compared with it. `reasons` are why
    /// the item would have run, `causes` why that changed, `outputs` returns those of an item.
    pub(crate) fn restored<'o>(
        &self,
        item: ItemIndex,
        found: &Record,
        reasons: Vec<Reason>,
        causes: &[Cause],
        outputs: impl Fn(ItemIndex) -> &'o [Blob],
    ) -> Record {
        let (maker, made_by) = found.maker();
        Record {
            manifest: self.plan.manifest_name(),
            item: self.name(item),
            gone: false,
            inputs: self.inputs(item, outputs),
            source: self.source(item),
            mount: self.mount(item),
            reasons,
            causes: worth_keeping(causes),
            from_cache: Some(FromCache {
                since: Timestamp::now(),
                item: maker.clone(),
                manifest: made_by.into(),
                shared: found.shared.as_ref().map(Shared::origin),
            }),
            ..found.clone()
        }
    }

    /// Writes the latest record of an item, which has the result of another record.
    ///
    /// # Errors
    /// If the journal cannot be written.
    pub(crate) fn record_restored(
        &self,
        item: ItemIndex,
        found: &Record,
        record: &Record,
    ) -> Result<(), Error> {
        // Written again, so that it counts as the most recently used result. If it is this item's own, the
        // text stays the same, so that it replaces the line before.
        let result = if self.is_of(item, found) { found } else { record };
        let again = Line::new(Tag::Result, short(record.key), Some(result));
        let line = Line::new(Tag::Item, self.subject(item), Some(record));
        self.state.journal.append(&[again, line])
    }
}
