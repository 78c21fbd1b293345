//! What the last build left of each item, to look at while nothing runs.

use std::sync::Arc;

use rayon::prelude::*;

use crate::journal::Tag;
use crate::record::Record;
use crate::run::failure_of;
use crate::state::State;
use crate::store::{Blob, Looked, Store};
use crate::up_to_date::item_subject;
use crate::{Digest, Error, Failure, Handle, ItemIndex, Plan, Product};

/// The results in effect of a plan's items, as the records had them when the shelf was opened.
///
/// Of an item that failed that is its last good result, of one whose sources have changed since the result of before:
/// nothing is judged, run or written, and a build may be at work. What a build brings into effect is on the next shelf.
///
/// Results stay in the cache for as long as a record names them. One that is removed after the shelf was opened fails
/// when its handle is asked.
pub struct ResultsSnapshot {
    items: Vec<Option<Kept>>,
}

/// What is kept of an item.
struct Kept {
    record: Record,
    /// The artifact; `None` of an item that exports files.
    handle: Option<Arc<Handle>>,
}

impl ResultsSnapshot {
    /// Reads the records of a plan's items. Where nothing was built yet the shelf is empty.
    ///
    /// # Errors
    /// Where the state folder cannot be read, or was written by a newer version.
    pub fn open(plan: &Plan) -> Result<Self, Error> {
        let State { journal, store, .. } = State::read(&plan.state)?;
        let manifest = plan.manifest_name();
        let items = plan.items.par_iter().map(|item| {
            let stage = &plan.stages[item.stage];
            let subject = item_subject(&manifest, &stage.name, &item.key);
            // Another kind may have made something else.
            let effect = journal.effect(subject).filter(|effect| effect.kind() == stage.kind.name())?;
            let fits = effect.outputs().iter().all(|blob| store.has(blob));
            let record: Record = journal.get(Tag::Item, subject)?;
            let handle = match (&stage.product, &record.outputs[..]) {
                (Product::Artifact(type_name), [Blob { digest, .. }]) => {
                    Some(Arc::new(handle(&store, type_name, *digest)))
                }
                (Product::Files(_), files) if files.len() == item.files.len() => None,
                _ => return None,
            };
            fits.then_some(Kept { record, handle })
        });
        Ok(Self { items: items.collect() })
    }

    /// The artifact of an item: the same handle each time, which reads, checks and decodes it when it is first asked.
    /// `None` where the item never made one, its result is gone from the cache, or it exports files.
    pub fn get(&self, item: ItemIndex) -> Option<Arc<Handle>> {
        self.kept(item)?.handle.clone()
    }

    /// The sizes in bytes of the files that an item exports, in the order of [`crate::Item::files`]; empty where there are
    /// none.
    pub fn file_sizes(&self, item: ItemIndex) -> Vec<u64> {
        let kept = self.kept(item).filter(|kept| kept.handle.is_none());
        kept.map_or_else(Vec::new, |kept| kept.record.outputs.iter().map(|blob| blob.bytes).collect())
    }

    /// The facts that the run noted which made what is kept; of a result that is older than the last run none is known.
    pub fn notes(&self, item: ItemIndex) -> &[String] {
        self.good(item).map_or(&[], |record| &record.notes)
    }

    /// What that run warned of.
    pub fn warnings(&self, item: ItemIndex) -> &[String] {
        self.good(item).map_or(&[], |record| &record.warnings)
    }

    /// Whether what is kept of an item was made of what is kept of those that arrive at it. It was not where one of them was
    /// made anew since then, and where the last run failed.
    pub fn is_abreast(&self, plan: &Plan, item: ItemIndex) -> bool {
        let arriving = plan.items[item].inputs.iter().flatten();
        let arriving = arriving.map(|from| self.get(*from).map(|handle| handle.digest()));
        let used = |record: &Record| record.inputs.iter().map(|used| Some(used.digest)).eq(arriving);
        self.good(item).is_some_and(used)
    }

    fn good(&self, item: ItemIndex) -> Option<&Record> {
        self.kept(item).map(|kept| &kept.record).filter(|record| record.failure.is_none())
    }

    fn kept(&self, item: ItemIndex) -> Option<&Kept> {
        self.items.get(item)?.as_ref()
    }
}

/// A handle on a stored artifact. A damaged one is left to the next build: it holds the lock.
fn handle(store: &Arc<Store>, type_name: &'static str, digest: Digest) -> Handle {
    let store = Arc::clone(store);
    Handle::new(type_name, digest, move || match store.look(digest) {
        Ok(Looked::Whole(bytes)) => Ok(bytes),
        Ok(Looked::Damaged) => {
            Err(Failure::new(format!("the stored artifact {digest} is damaged")).help("build again"))
        }
        Ok(Looked::Gone) => {
            Err(Failure::new(format!("the stored artifact {digest} is gone")).help("build again"))
        }
        Err(error) => Err(failure_of(error)),
    })
}
