//! The last good result of each item, to be read while nothing runs.

use std::sync::Arc;

use crate::build::{arriving, failure_of, file_sizes, item_subject};
use crate::error::Error;
use crate::key::Digest;
use crate::kinds::{Failure, Handle, Product, is_left_out};
use crate::parallel;
use crate::plan::{ItemIndex, Plan};
use crate::storage::{Blob, BlobFile, Record, State, Store, Tag};

/// The latest results of a plan's items, as they were recorded when the snapshot was opened.
///
/// The result of an item that failed is its last good one; that of an item whose sources have changed since
/// is the one before the change. Nothing is checked, run or written, and a build may be running. New results
/// appear in the next snapshot.
///
/// Results stay in the cache as long as a record names them. If one is removed after the snapshot was opened,
/// its handle fails.
pub struct ResultsSnapshot {
    store: Arc<Store>,
    items: Vec<Option<ItemResult>>,
}

struct ItemResult {
    record: Record,
    /// The artifact; `None` for an item that exports files.
    handle: Option<Arc<Handle>>,
}

impl ResultsSnapshot {
    /// Reads the records of a plan's items. If nothing was built yet, the snapshot is empty.
    ///
    /// # Errors
    /// If the state folder cannot be read, or was written by a newer version.
    pub fn open(plan: &Plan) -> Result<Self, Error> {
        let State { journal, store, .. } = State::read(&plan.state)?;
        let manifest = plan.manifest_name();
        let result_of = |index: usize| {
            let item = &plan.items[index];
            let stage = &plan.stages[item.stage];
            let subject = item_subject(&manifest, &stage.name, &item.key);
            // Another kind may have made another artifact.
            let latest = journal.latest(subject).filter(|latest| latest.kind() == stage.kind.name())?;
            let fits = latest.outputs().iter().all(|blob| store.has(blob));
            let record: Record = journal.get(Tag::Item, subject)?;
            let handle = match (&stage.product, &record.outputs[..]) {
                (Product::Artifact(type_name), [Blob { digest, .. }]) => {
                    Some(Arc::new(handle(&store, type_name, *digest)))
                }
                (Product::Files(_), files) if files.len() == item.files.len() => None,
                _ => return None,
            };
            fits.then_some(ItemResult { record, handle })
        };
        let items = parallel::map(plan.items.len(), &result_of);
        Ok(Self { store, items })
    }

    /// The artifact of an item: the same handle each time, which reads, checks and decodes it on first use.
    /// `None` if the item never made one, its result is no longer in the cache, or it exports files.
    pub fn get(&self, item: ItemIndex) -> Option<Arc<Handle>> {
        self.result(item)?.handle.clone()
    }

    /// The sizes in bytes of the files that an item exports, in the order of [`crate::plan::Item::files`];
    /// empty if there are none. 0 for a file that it leaves out.
    pub fn file_sizes(&self, item: ItemIndex) -> Vec<u64> {
        let result = self.result(item).filter(|result| result.handle.is_none());
        result.map_or_else(Vec::new, |result| file_sizes(&result.record.outputs))
    }

    /// The digest of a file that an item exports, by its place in [`crate::plan::Item::files`]; `None` if
    /// there is none.
    pub fn file_digest(&self, item: ItemIndex, file: usize) -> Option<Digest> {
        let result = self.result(item).filter(|result| result.handle.is_none())?;
        let blob = result.record.outputs.get(file)?;
        (!is_left_out(blob.digest)).then_some(blob.digest)
    }

    /// The contents of a file with such a digest, from the cache: whatever became of the copy that was
    /// published.
    ///
    /// # Errors
    /// If it is damaged or no longer there.
    pub fn read_file(&self, digest: Digest) -> Result<Vec<u8>, Failure> {
        read(&self.store, "file", digest)
    }

    /// The notes of the run that made the result; empty if the last run failed, so that the result is older.
    pub fn notes(&self, item: ItemIndex) -> &[String] {
        self.good(item).map_or(&[], |record| &record.notes)
    }

    /// The warnings of that run.
    pub fn warnings(&self, item: ItemIndex) -> &[String] {
        self.good(item).map_or(&[], |record| &record.warnings)
    }

    /// Whether an item's result was made from the present results of its inputs. It was not if one of them
    /// was made again since then, or if the last run failed.
    pub fn is_consistent(&self, plan: &Plan, item: ItemIndex) -> bool {
        let this = &plan.items[item];
        let files = plan.files_taken(&plan.stages[this.stage]);
        let made = |from: ItemIndex, file: Option<usize>| {
            let product = &plan.stages[plan.items[from].stage].product;
            arriving(product, file, &self.result(from)?.record)
        };
        let ports = this.inputs.iter().zip(files);
        let inputs = ports.flat_map(|(items, file)| items.iter().map(move |from| (*from, file)));
        let inputs = inputs.map(|(from, file)| made(from, file));
        let used = |record: &Record| record.inputs.iter().map(|used| Some(used.digest)).eq(inputs);
        self.good(item).is_some_and(used)
    }

    fn good(&self, item: ItemIndex) -> Option<&Record> {
        self.result(item).map(|result| &result.record).filter(|record| record.failure.is_none())
    }

    fn result(&self, item: ItemIndex) -> Option<&ItemResult> {
        self.items.get(item)?.as_ref()
    }
}

/// A handle on a stored artifact. A damaged one is left to the next build, which holds the lock.
fn handle(store: &Arc<Store>, type_name: &'static str, digest: Digest) -> Handle {
    let store = Arc::clone(store);
    Handle::new(type_name, digest, move || read(&store, "artifact", digest))
}

/// Reads what is stored.
fn read(store: &Store, what: &str, digest: Digest) -> Result<Vec<u8>, Failure> {
    match store.read(digest) {
        Ok(BlobFile::Intact(bytes)) => Ok(bytes),
        Ok(BlobFile::Damaged) => {
            Err(Failure::new(format!("the stored {what} {digest} is damaged")).help("build again"))
        }
        Ok(BlobFile::Missing) => {
            Err(Failure::new(format!("the stored {what} {digest} is gone")).help("build again"))
        }
        Err(error) => Err(failure_of(error)),
    }
}
