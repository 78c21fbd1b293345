//! What the state folder contains, and how it is made smaller and checked.
//!
//! A blob is *in effect* if it is the last good output of an item, or a published file, of a manifest that is
//! still in the folder. It is *earlier* if only an earlier result has it, which is used again when an edit is
//! undone. All others are *garbage*. A collection removes garbage, and the least recently used earlier
//! results until the cache is small enough. It never removes what is in effect, and it holds the lock, so
//! that no build is running.
//!
//! A collection first writes the journal without the lines of the removed results, and then removes their
//! blobs: if it is killed in between, it leaves garbage, but no line without its blob.

use std::collections::{BTreeMap, HashMap, HashSet};
use std::path::Path;

use serde::{Deserialize, Serialize};

use crate::build::{BuildSession, Manifests, Published};
use crate::cancel::Cancel;
use crate::error::{Error, ErrorKind};
use crate::event::ItemName;
use crate::key::Digest;
use crate::parallel;
use crate::platform::path_text;
use crate::storage::{
    Blob, FOLDER, Journal, LockPurpose, LockRequest, LockTimeout, Retention, State, Tag, hash,
};

pub use crate::storage::Amount;

/// The contents of the state folder of some manifests.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Stats {
    /// The last good outputs.
    pub in_effect: Amount,
    /// The results of earlier builds.
    pub earlier: Amount,
    /// Blobs that no record names.
    pub garbage: Amount,
    /// Files that are being written, were left by a killed process, or are in scratch folders that were kept.
    pub temporary: Amount,
    /// The journal: its lines and bytes.
    pub journal: Amount,
    /// The share of each stage, the largest first. A blob that several stages made counts for each.
    pub stages: Vec<StageShare>,
}

/// The share of one stage in the cache.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct StageShare {
    /// The manifest's file name.
    pub manifest: String,
    /// The stage.
    pub stage: String,
    /// The last good outputs of its items.
    pub in_effect: Amount,
    /// The outputs of its items that only earlier results have.
    pub earlier: Amount,
}

/// Options of a collection.
#[derive(Clone, Copy, Debug, Default)]
pub struct CollectOptions {
    /// The size that the blobs may have afterwards; `None` removes only garbage.
    pub limit: Option<u64>,
    /// Whether only to report what would be removed.
    pub dry_run: bool,
    /// How long to wait for a running build.
    pub lock_timeout: LockTimeout,
}

/// The result of a collection: the blobs that it removed or would have removed, and those that remain.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Freed {
    /// Blobs that no record named.
    pub garbage: Amount,
    /// Results of earlier builds.
    pub earlier: Amount,
    /// Files that killed processes had left incomplete, and kept scratch folders.
    pub temporary: Amount,
    /// The remaining blobs.
    pub left: Amount,
    /// The last good outputs, which always remain and are also counted in `left`.
    pub in_effect: Amount,
}

/// The result of a check of every blob.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Verified {
    /// The blobs whose bytes have their digest.
    pub intact: Amount,
    /// The damaged blobs, which have been removed, and the blobs that should exist and do not.
    pub lost: Vec<LostBlob>,
}

/// A damaged or missing blob.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct LostBlob {
    /// The blob's digest.
    pub digest: Digest,
    /// Whether the blob's file had other bytes; if not, it did not exist.
    pub damaged: bool,
    /// The items whose last good output it is: the next build makes it again.
    pub items: Vec<ItemName>,
    /// The items of earlier results: made again when they are needed.
    pub earlier: Vec<ItemName>,
}

/// The contents of the state folder beside a manifest. Nothing is written, and a build may be running.
///
/// # Errors
/// If there is no state folder or it cannot be read.
pub fn stats(folder: &Path) -> Result<Stats, Error> {
    let state = read(folder)?;
    let inventory = Inventory::of(&state, folder);
    let (bytes, lines) = state.journal.size();
    Ok(Stats {
        in_effect: inventory.amount(|kind| kind == Holding::InEffect),
        earlier: inventory.amount(|kind| kind == Holding::Earlier),
        garbage: inventory.amount(|kind| kind == Holding::Garbage),
        temporary: state.store.temporary_files() + state.store.kept_files(),
        journal: Amount { count: lines, bytes },
        stages: inventory.shares(),
    })
}

/// Removes garbage from the state folder beside a manifest, and the oldest earlier results until the blobs
/// are within the limit. `waiting` is called with a description of another process that holds the lock, if
/// the wait becomes noticeable.
///
/// # Errors
/// If there is no state folder, another process holds the lock, or the folder cannot be written.
pub fn collect(folder: &Path, options: &CollectOptions, waiting: &dyn Fn(String)) -> Result<Freed, Error> {
    let state = read(folder)?;
    let temporary = state.store.temporary_files() + state.store.kept_files();
    let (freed, state) = if options.dry_run {
        (Collection::of(&Inventory::of(&state, folder), options.limit).freed, state)
    } else {
        drop(state);
        let mut state =
            State::open(lock(folder, LockPurpose::Collect, options.lock_timeout, waiting)?, None)?;
        state.store.remove_kept();
        (state.collect(folder, options.limit)?, state)
    };
    drop(state);
    Ok(Freed { temporary, ..freed })
}

/// Reads every blob of the state folder beside a manifest, and removes those whose bytes do not have their
/// digest. The next build makes those in effect again. Builds may run meanwhile: the lock is held only for
/// removing.
///
/// # Errors
/// If there is no state folder, a blob cannot be read, or a damaged one cannot be removed.
pub fn verify(folder: &Path, timeout: LockTimeout, waiting: &dyn Fn(String)) -> Result<Verified, Error> {
    let state = read(folder)?;
    let inventory = Inventory::of(&state, folder);
    let blobs = inventory.blobs.iter().collect::<Vec<_>>();
    let checked = parallel::map(blobs.len(), &|index| {
        let place = state.store.path(*blobs[index].0);
        match hash(&place) {
            Ok(found) => Ok(Some(found == *blobs[index].0)),
            // A collection removed it meanwhile.
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => Ok(None),
            Err(error) => Err(Error::io(&error, "read", &place)),
        }
    });
    let mut verified = Verified::default();
    let mut lost = Vec::new();
    for ((digest, bytes), found) in blobs.into_iter().zip(checked) {
        match found? {
            Some(true) => verified.intact.add(*bytes),
            Some(false) => lost.push((*digest, true)),
            None => {}
        }
    }
    if !lost.is_empty() {
        let state = State::open(lock(folder, LockPurpose::Verify, timeout, waiting)?, None)?;
        for (digest, _) in &lost {
            // It is read once more: a build may have made it again meanwhile.
            state.store.get(*digest)?;
        }
    }
    let elsewhere = inventory.items.iter().filter(|made| made.shared.is_some());
    let elsewhere = elsewhere.flat_map(|made| &made.outputs).map(|blob| blob.digest).collect::<HashSet<_>>();
    let is_missing =
        |digest: &&Digest| !inventory.blobs.contains_key(*digest) && !elsewhere.contains(*digest);
    let missing = inventory.in_effect.iter().filter(is_missing);
    lost.extend(missing.map(|digest| (*digest, false)));
    lost.sort_unstable();
    verified.lost = lost.into_iter().map(|(digest, damaged)| inventory.lost(digest, damaged)).collect();
    Ok(verified)
}

impl BuildSession {
    /// Makes the cache of a manifest's folder smaller if builds of this session may have made it larger than
    /// the limit; to be called when there is nothing else to do. The folder is not examined before enough has
    /// been stored for that; a large journal is compacted. If another process holds the lock, nothing is done
    /// until the next call.
    ///
    /// A cache that is too large is made a tenth smaller than necessary, so that this does not happen after
    /// every build.
    ///
    /// # Errors
    /// If the state folder cannot be written.
    pub fn trim(&self, folder: &Path, limit: u64) -> Result<Freed, Error> {
        let mut saved = self.saved.lock();
        let is_large = saved.journal.as_ref().is_some_and(Journal::is_large);
        if (saved.stored < saved.room && !is_large) || !folder.join(FOLDER).is_dir() {
            return Ok(Freed::default());
        }
        let lock = match lock(folder, LockPurpose::Watch, LockTimeout::NONE, &|_| {}) {
            Err(error) if error.kind() == ErrorKind::Locked => return Ok(Freed::default()),
            lock => lock?,
        };
        let journal = saved.journal.take();
        let mut state = self.pool.install(|| State::open(lock, journal))?;
        if state.journal.is_large() {
            let retention = Retention::of(&state.journal, folder);
            state.journal.compact_to(retention)?;
        }
        let size = Inventory::of(&state, folder).amount(|_| true).bytes;
        let freed = if size > limit {
            state.collect(folder, Some(limit - limit / 10))?
        } else {
            Freed { left: Amount { count: 0, bytes: size }, ..Freed::default() }
        };
        let spare = limit.saturating_sub(freed.left.bytes) + 1;
        // If the last good outputs alone are about as large, there is little to remove before more has been
        // added.
        saved.room = if freed.in_effect.bytes > limit - limit / 10 { limit / 10 } else { spare };
        saved.stored = 0;
        saved.journal = state.close();
        Ok(freed)
    }
}

impl State {
    /// Removes what exceeds a limit.
    fn collect(&mut self, folder: &Path, limit: Option<u64>) -> Result<Freed, Error> {
        let collection = Collection::of(&Inventory::of(self, folder), limit);
        if !collection.lines.is_empty() {
            let lines = &collection.lines;
            self.journal.compact(|held| held.tag != Tag::Result || !lines.contains(&held.place()))?;
        }
        collection.blobs.iter().for_each(|digest| self.store.remove(*digest));
        Ok(collection.freed)
    }
}

pub(crate) fn read(folder: &Path) -> Result<State, Error> {
    let state = folder.join(FOLDER);
    if !state.exists() {
        let message = format!("there is no cache: {} does not exist", path_text(state));
        return Err(Error::new(ErrorKind::UnknownTarget, message)
            .with_help("run a build first, or name another manifest with --manifest"));
    }
    State::read(folder)
}

fn lock(
    folder: &Path,
    purpose: LockPurpose,
    timeout: LockTimeout,
    waiting: &dyn Fn(String),
) -> Result<crate::storage::Lock, Error> {
    State::lock(folder, &LockRequest { purpose, timeout, cancel: &Cancel::default(), waiting })
}

/// Why a blob is kept, or that it is not.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Holding {
    InEffect,
    Earlier,
    Garbage,
}

#[derive(Deserialize)]
struct RecordOutputs {
    manifest: String,
    item: ItemName,
    outputs: Vec<Blob>,
    #[serde(default)]
    gone: bool,
    /// Whether a shared cache has them.
    #[serde(default)]
    shared: Option<serde::de::IgnoredAny>,
}

/// Every blob, and the records that name it.
struct Inventory {
    /// The blobs on disk, with their sizes there.
    blobs: HashMap<Digest, u64>,
    in_effect: HashSet<Digest>,
    /// The blobs of results.
    remembered: HashSet<Digest>,
    /// The latest records.
    items: Vec<RecordOutputs>,
    /// The results, the least recently used first, each with the place of its line.
    results: Vec<(u64, RecordOutputs)>,
}

impl Inventory {
    fn of(state: &State, folder: &Path) -> Self {
        let mut manifests = Manifests::new(folder, None);
        let items = state.journal.contents::<RecordOutputs>(Tag::Item).into_iter().map(|(_, made)| made);
        let items = items.filter(|made| !made.gone && manifests.has(&made.manifest)).collect::<Vec<_>>();
        let results = state.journal.results_by_age::<RecordOutputs>();
        let mut in_effect = digests(&items).collect::<HashSet<_>>();
        let ledger = state.journal.contents::<Published>(Tag::Published);
        let lines = ledger.iter().map(|(_, line)| line);
        in_effect.extend(lines.filter(|line| manifests.has(&line.manifest)).map(|line| line.digest));
        let remembered = results.iter().flat_map(|(_, made)| digests(std::slice::from_ref(made))).collect();
        Self { blobs: state.store.blobs(), in_effect, remembered, items, results }
    }

    fn holding(&self, digest: Digest) -> Holding {
        if self.in_effect.contains(&digest) {
            Holding::InEffect
        } else if self.remembered.contains(&digest) {
            Holding::Earlier
        } else {
            Holding::Garbage
        }
    }

    fn amount(&self, counts: impl Fn(Holding) -> bool) -> Amount {
        let mut amount = Amount::default();
        self.blobs
            .iter()
            .filter(|(digest, _)| counts(self.holding(**digest)))
            .for_each(|(_, bytes)| amount.add(*bytes));
        amount
    }

    fn shares(&self) -> Vec<StageShare> {
        let mut stages = BTreeMap::<(&str, &str), HashSet<Digest>>::new();
        for made in self.items.iter().chain(self.results.iter().map(|(_, made)| made)) {
            let place = (made.manifest.as_str(), made.item.stage.as_str());
            stages.entry(place).or_default().extend(digests(std::slice::from_ref(made)));
        }
        let shares = stages.into_iter().map(|((manifest, stage), blobs)| {
            let (manifest, stage) = (manifest.to_owned(), stage.to_owned());
            let (mut in_effect, mut earlier) = (Amount::default(), Amount::default());
            for digest in blobs {
                if let Some(bytes) = self.blobs.get(&digest) {
                    let of_stage = self.in_effect.contains(&digest);
                    if of_stage { &mut in_effect } else { &mut earlier }.add(*bytes);
                }
            }
            StageShare { manifest, stage, in_effect, earlier }
        });
        let mut shares = shares.collect::<Vec<_>>();
        shares.sort_by_key(|share| std::cmp::Reverse(share.in_effect.bytes + share.earlier.bytes));
        shares
    }

    fn lost(&self, digest: Digest, damaged: bool) -> LostBlob {
        let holds = |made: &RecordOutputs| made.outputs.iter().any(|blob| blob.digest == digest);
        let sorted = |mut items: Vec<ItemName>| {
            items.sort_unstable();
            items.dedup();
            items
        };
        let items = self.items.iter().filter(|made| holds(made)).map(|made| made.item.clone());
        let items = sorted(items.collect());
        let results = self.results.iter().map(|(_, made)| made).filter(|made| holds(made));
        let earlier = results.map(|made| made.item.clone()).filter(|item| !items.contains(item));
        LostBlob { digest, damaged, earlier: sorted(earlier.collect()), items }
    }
}

fn digests(made: &[RecordOutputs]) -> impl Iterator<Item = Digest> {
    made.iter().flat_map(|made| made.outputs.iter().map(|blob| blob.digest))
}

/// The lines and blobs that a collection removes.
struct Collection {
    /// The places of the results' lines.
    lines: HashSet<u64>,
    blobs: Vec<Digest>,
    freed: Freed,
}

impl Collection {
    fn of(inventory: &Inventory, limit: Option<u64>) -> Self {
        let mut freed =
            Freed { in_effect: inventory.amount(|kind| kind == Holding::InEffect), ..Freed::default() };
        let (mut lines, mut blobs) = (HashSet::new(), Vec::new());
        for (digest, bytes) in &inventory.blobs {
            if inventory.holding(*digest) == Holding::Garbage {
                freed.garbage.add(*bytes);
                blobs.push(*digest);
            }
        }
        // The number of remaining results that have each blob.
        let mut holders = HashMap::<Digest, usize>::new();
        for digest in inventory.results.iter().flat_map(|(_, made)| distinct(made)) {
            *holders.entry(digest).or_default() += 1;
        }
        let mut size = inventory.amount(|kind| kind != Holding::Garbage).bytes;
        for (place, made) in &inventory.results {
            let is_whole = made.outputs.iter().all(|blob| inventory.blobs.contains_key(&blob.digest));
            let is_earlier = made.outputs.iter().any(|blob| !inventory.in_effect.contains(&blob.digest));
            if is_whole && !(is_earlier && limit.is_some_and(|limit| size > limit)) {
                continue;
            }
            lines.insert(*place);
            for digest in distinct(made) {
                let others = holders.entry(digest).or_default();
                *others = others.saturating_sub(1);
                if *others == 0
                    && !inventory.in_effect.contains(&digest)
                    && let Some(bytes) = inventory.blobs.get(&digest)
                {
                    freed.earlier.add(*bytes);
                    size -= bytes;
                    blobs.push(digest);
                }
            }
        }
        let gone = freed.garbage + freed.earlier;
        let all = inventory.amount(|_| true);
        freed.left = Amount { count: all.count - gone.count, bytes: all.bytes - gone.bytes };
        Self { lines, blobs, freed }
    }
}

fn distinct(made: &RecordOutputs) -> HashSet<Digest> {
    digests(std::slice::from_ref(made)).collect()
}
