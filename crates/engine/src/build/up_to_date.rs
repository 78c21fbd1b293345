//! Whether an item's result is in the cache, and if not, why not.
//!
//! An item is up to date if there is a record with its key, the files that the record names still have the
//! same contents, and its outputs are in the store. The latest record is checked first, then the results of
//! earlier keys and contents, so that undoing an edit runs nothing.

use std::collections::{HashMap, HashSet};
use std::path::{Path, PathBuf};

use serde_json::Value;

use super::arrivals::Arrival;
use super::running::{ChangedPaths, Dependencies, Dependent};
use crate::event::{ItemName, Reason};
use crate::key::{Digest, ItemKey};
use crate::kinds::{Decoder, Product};
use crate::plan::{ItemIndex, Plan, Selection};
use crate::storage::{
    Blob, Disk, LatestRecord, Presence, Read, ReadKind, Record, State, Subject, Tag, canonical, kind_name,
    look_up, modified, path_name, short, subject,
};
use crate::{parallel, platform};

mod gone;
mod inputs;
mod restored;
mod shared;

/// Facts about a stage that are computed once.
pub(crate) struct StageInfo {
    pub(crate) parameters: Value,
    parameters_text: String,
    pub(crate) revision: u32,
    pub(crate) shows_keys: bool,
    /// The processor, for a kind whose results depend on it.
    pub(crate) processor: Option<&'static str>,
    /// The artifact's type and the decoder that the first consumer declares.
    pub(crate) artifact: Option<(&'static str, Option<Decoder>)>,
    /// The names of the ports that take many items.
    pub(crate) many: HashSet<String>,
    /// For each connected port, the place of the exported file that it takes; see [`Plan::files_taken`].
    pub(crate) files_taken: Vec<Option<usize>>,
    /// The places of the exported files that consumers take.
    pub(crate) files_read: Vec<usize>,
}

pub(crate) struct UpToDateCheck<'a> {
    pub(crate) plan: &'a Plan,
    pub(crate) state: &'a State,
    pub(crate) disk: &'a Disk,
    pub(crate) stages: Vec<StageInfo>,
    /// The folder of the manifest.
    pub(crate) folder: &'a Path,
    manifest: String,
    selected: &'a Selection,
    /// The latest record of each item; if empty, each is looked up when needed.
    latest: Vec<Option<LatestRecord<'a>>>,
    /// For each item, whether its result was in the cache when the build began.
    current: Vec<bool>,
    /// The items as an earlier build left them, as far as nothing has changed since.
    known: Option<KnownItems>,
    /// Results that a shared cache has of items whose own are out of date.
    shared: HashMap<ItemIndex, Record>,
    has_shared: bool,
    /// The items for which the shared cache was asked in vain.
    missed: HashSet<ItemIndex>,
    /// Whether outputs that are perhaps only in a shared cache do not count.
    pub(crate) all_local: bool,
}

/// The items as an earlier build of the plan left them, so that they do not need to be checked again.
#[derive(Clone)]
pub(crate) struct KnownItems {
    /// For each item, whether it is as that build left it, with its result and its files.
    pub(crate) complete: Vec<bool>,
    /// The items that read files; others may be among them.
    pub(crate) readers: Vec<ItemIndex>,
}

/// Whether an item's result is in the cache.
pub(crate) enum Freshness {
    Current {
        outputs: Vec<Blob>,
        /// The record of the run that made them, if that is not the latest record.
        restored: Option<Box<Record>>,
        /// The server where the result was found in this build, if it was one of another machine.
        host: Option<String>,
    },
    Run,
}

impl<'a> UpToDateCheck<'a> {
    /// Reads the records of the items, and checks the files that the records of selected stages name.
    pub(crate) fn new(plan: &'a Plan, state: &'a State, disk: &'a Disk, selected: &'a Selection) -> Self {
        let mut check = Self::with_records(plan, state, disk, selected, None);
        let readers = Dependent::without_build(check.readers());
        check.check_files(&readers, None, &|| false);
        check
    }

    /// Reads the records of the items; but if something is `known`, only when they are needed.
    pub(crate) fn with_records(
        plan: &'a Plan,
        state: &'a State,
        disk: &'a Disk,
        selected: &'a Selection,
        known: Option<KnownItems>,
    ) -> Self {
        let folder = plan.manifest.parent().unwrap_or(Path::new("."));
        let manifest = plan.manifest_name();
        let (stages, latest, current) = (stage_infos(plan), Vec::new(), Vec::new());
        let (shared, missed) = (HashMap::new(), HashSet::new());
        let mut check = Self {
            plan,
            state,
            disk,
            stages,
            folder,
            manifest,
            selected,
            latest,
            current,
            known,
            shared,
            has_shared: false,
            missed,
            all_local: false,
        };
        if check.known.is_none() {
            let latest = |item: usize| state.journal.latest(check.subject(item));
            check.latest = parallel::map(plan.items.len(), &latest);
        }
        check
    }

    /// The items that read files in their last runs; others may be among them.
    pub(crate) fn readers(&self) -> Vec<ItemIndex> {
        match &self.known {
            Some(known) => known.readers.clone(),
            None => {
                let reads = |item: &ItemIndex| {
                    self.latest(*item).is_some_and(|latest| latest.reads().next().is_some())
                };
                (0..self.plan.items.len()).filter(reads).collect()
            }
        }
    }

    /// Checks the files that the records name, and finds the items whose results are in the cache. Of the
    /// items that are known from an earlier build, only those that depend on `changes` are checked. Once
    /// `stop` returns true, the rest is left out.
    pub(crate) fn check_files(
        &mut self,
        readers: &Dependent<Vec<ItemIndex>>,
        changes: Option<&ChangedPaths>,
        stop: &(dyn Fn() -> bool + Sync),
    ) {
        let mut known = self.known.take();
        let (mut places, mut read) = (HashSet::new(), HashSet::new());
        for &item in readers.items() {
            for (path, kind, _) in self.latest(item).iter().flat_map(LatestRecord::reads) {
                let path = self.folder.join(path);
                if let Some(known) = &mut known {
                    known.complete[item] &= !changes.is_some_and(|changes| changes.affect(&path, kind));
                }
                if known.as_ref().is_none_or(|known| !known.complete[item]) {
                    read.insert((path.clone(), kind));
                }
                places.insert((path, kind));
            }
        }
        self.known = known;
        self.disk.add_reads(places);
        self.disk.hash_all(read.into_iter().collect::<Vec<(PathBuf, ReadKind)>>(), &self.state.journal);
        let asked = if self.known.is_some() { 0 } else { self.plan.items.len() };
        let store = self.state.store.presence(asked);
        // Stage by stage, because keys contain the digests of inputs; the items of a stage in parallel.
        let mut current = Vec::with_capacity(self.plan.items.len());
        for stage in self.plan.items.chunk_by(|one, other| one.stage == other.stage) {
            let first = current.len();
            let is_current = |index: usize| !stop() && self.is_current_after(first + index, &current, &store);
            let found = parallel::map(stage.len(), &is_current);
            current.extend(found);
        }
        self.current = current;
    }

    /// Whether the result of an item is in the cache, given that of the items before it.
    fn is_current_after(&self, item: ItemIndex, current: &[bool], store: &Presence<'_>) -> bool {
        let this = &self.plan.items[item];
        let is_asked_for = self.selected.has(item) && !self.is_forced(item);
        if !is_asked_for || !this.inputs.iter().flatten().all(|input| current[*input]) {
            return false;
        }
        let is_valid = |latest: LatestRecord<'_>| {
            !latest.is_gone()
                && latest.key() == self.key(item, |input| self.latest_outputs(input))
                && self.is_valid(item, latest.has_failed(), latest.outputs(), latest.reads())
                && (self.is_elsewhere(latest.is_shared())
                    || latest.outputs().iter().all(|blob| store.has(blob)))
        };
        self.is_known_complete(item) || self.latest(item).is_some_and(is_valid)
    }

    /// Whether outputs that came from a shared cache, or not, need not be here.
    fn is_elsewhere(&self, is_shared: bool) -> bool {
        is_shared && !self.all_local
    }

    fn is_known_complete(&self, item: ItemIndex) -> bool {
        self.known.as_ref().is_some_and(|known| known.complete[item])
    }

    /// The items as an earlier build left them; `None` if everything was checked.
    pub(crate) fn known(&self) -> Option<&KnownItems> {
        self.known.as_ref()
    }

    /// Whether an earlier build completed an item and nothing has changed since.
    pub(crate) fn is_complete(&self, item: ItemIndex) -> bool {
        self.current[item] && self.is_known_complete(item)
    }

    /// The outputs that the latest record of an item has.
    fn latest_outputs(&self, item: ItemIndex) -> &'a [Blob] {
        self.unfiltered_latest(item).map_or(&[], |latest| latest.outputs())
    }

    pub(crate) fn name(&self, item: ItemIndex) -> ItemName {
        self.plan.item_name(item)
    }

    /// The latest record of a selected item, as far as every build needs it.
    pub(crate) fn latest(&self, item: ItemIndex) -> Option<LatestRecord<'a>> {
        self.unfiltered_latest(item).filter(|_| self.selected.has(item))
    }

    fn unfiltered_latest(&self, item: ItemIndex) -> Option<LatestRecord<'a>> {
        match self.latest.get(item) {
            Some(latest) => *latest,
            None => self.state.journal.latest(self.subject(item)),
        }
    }

    /// The latest record of a selected item in full, read from the journal.
    pub(crate) fn record(&self, item: ItemIndex) -> Option<Record> {
        self.latest(item).and_then(|_| self.state.journal.get(Tag::Item, self.subject(item)))
    }

    /// Whether an item runs even if its result is in a cache.
    pub(crate) fn is_forced(&self, item: ItemIndex) -> bool {
        self.selected.is_forced(item)
    }

    /// Whether the result of an item was in the cache when the build began.
    pub(crate) fn is_current(&self, item: ItemIndex) -> bool {
        self.current[item]
    }

    /// The subject of an item's latest record.
    pub(crate) fn subject(&self, item: ItemIndex) -> Subject {
        let item = &self.plan.items[item];
        item_subject(&self.manifest, &self.plan.stages[item.stage].name, &item.key)
    }

    pub(crate) fn is_of(&self, item: ItemIndex, record: &Record) -> bool {
        record.item == self.name(item) && record.manifest == self.manifest
    }

    /// The source as records contain it.
    pub(crate) fn source(&self, item: ItemIndex) -> Option<String> {
        self.plan.items[item].source.as_deref().map(|source| path_name(self.folder, source))
    }

    /// Where the drive of an item's source is mounted, as records contain it.
    pub(crate) fn mount(&self, item: ItemIndex) -> Option<String> {
        self.mount_of(self.plan.items[item].source.as_deref()?)
    }

    /// Where the drive of a path is mounted: `.` if it is that of the manifest's folder. `None` if the system
    /// does not say, or while the folder is moved away.
    fn mount_of(&self, path: &Path) -> Option<String> {
        let [mount, folder] = platform::mount_points([path, self.folder])?;
        Some(if mount == folder { ".".into() } else { path_name(self.folder, &mount) })
    }

    /// The files that the latest record of an item depends on.
    pub(crate) fn recorded_dependencies(&self, item: ItemIndex) -> Dependencies {
        self.dependencies(self.latest(item).iter().flat_map(LatestRecord::reads))
    }

    /// The files that a record with these reads depends on.
    pub(crate) fn dependencies<'r>(
        &self,
        reads: impl Iterator<Item = (&'r str, ReadKind, Option<Digest>)>,
    ) -> Dependencies {
        let read = |(path, kind, digest)| Read::of(self.folder.join(path), kind, digest);
        Dependencies::recorded(reads.map(read).collect())
    }

    /// Whether a result with this key is in the cache; that of an item that is forced does not count.
    pub(crate) fn freshness(&self, item: &Dependent<ItemIndex>, key: Digest) -> Freshness {
        self.freshness_of(*item.items(), key)
    }

    /// Whether a result with this key is in the cache, after [`UpToDateCheck::check_files`] looked at files.
    fn freshness_of(&self, item: ItemIndex, key: Digest) -> Freshness {
        if self.is_forced(item) {
            return Freshness::Run;
        }
        let is_stored = |outputs: &[Blob]| outputs.iter().all(|blob| self.state.store.has(blob));
        let latest = self.latest(item).filter(|latest| !latest.is_gone() && latest.key() == key);
        let latest = latest
            .filter(|latest| self.is_valid(item, latest.has_failed(), latest.outputs(), latest.reads()));
        if let Some(latest) =
            latest.filter(|latest| self.is_elsewhere(latest.is_shared()) || is_stored(latest.outputs()))
        {
            let outputs = latest.outputs().to_vec();
            return Freshness::Current { outputs, restored: None, host: self.shared_host(item) };
        }
        let results = self.state.journal.results::<Record>(short(key));
        let mut results = results.filter(|record| record.key == key).collect::<Vec<_>>();
        // Its own result is more specific than one of another item with the same inputs.
        results.sort_by_key(|record| !self.is_of(item, record));
        let is_good = |record: &Record| {
            self.is_valid(item, record.failure.is_some(), &record.outputs, record.reads())
                && (self.is_elsewhere(record.shared.is_some()) || is_stored(&record.outputs))
        };
        let shared = || self.shared.get(&item).filter(|record| record.key == key).cloned();
        match results.into_iter().find(is_good).or_else(shared) {
            Some(record) => {
                let (outputs, host) = (record.outputs.clone(), self.shared_host(item));
                Freshness::Current { outputs, restored: Some(Box::new(record)), host }
            }
            None => Freshness::Run,
        }
    }

    /// Every difference from the latest record.
    ///
    /// `outputs` returns those of an item, if they are known yet.
    pub(crate) fn reasons<'o>(
        &self,
        item: ItemIndex,
        outputs: impl Fn(ItemIndex) -> Option<&'o [Blob]>,
    ) -> Vec<Reason> {
        let Some(record) = self.record(item) else { return vec![Reason::NeverBuilt] };
        let mut reasons = Vec::new();
        if record.failure.is_some() {
            reasons.push(Reason::FailedBefore);
        }
        reasons.extend(self.revisions(item, &record));
        self.differing_inputs(item, &record, outputs, &mut reasons);
        self.differing_files(item, &record, &mut reasons);
        if self.is_forced(item) {
            reasons.push(Reason::Forced);
        }
        if reasons.is_empty() {
            reasons.push(if record.gone { Reason::Returned } else { Reason::ResultLost });
        }
        reasons
    }

    /// The differences of kind and parameters from a record.
    pub(crate) fn revisions(&self, item: ItemIndex, record: &Record) -> Vec<Reason> {
        let stage = self.plan.items[item].stage;
        let info = &self.stages[stage];
        let kind = kind_name(self.plan.stages[stage].kind.name(), info.revision);
        let mut reasons = Vec::new();
        if kind != record.kind_name() {
            reasons.push(Reason::Kind { old: record.kind_name(), new: kind });
        }
        differing_parameters(&record.parameters, &info.parameters, &mut reasons);
        reasons
    }

    /// Whether a record of these outputs and reads, if its outputs are in the store, has the result that the
    /// item would make now.
    fn is_valid<'r>(
        &self,
        item: ItemIndex,
        failed: bool,
        outputs: &[Blob],
        mut reads: impl Iterator<Item = (&'r str, ReadKind, Option<Digest>)>,
    ) -> bool {
        // An artifact is one output; an export has one for each of its files.
        !failed
            && outputs.len() == self.plan.items[item].files.len().max(1)
            && reads.all(|(path, kind, digest)| self.current_digest(path, kind) == digest)
    }

    /// The digest of the present answer to what was asked of a path.
    pub(crate) fn current_digest(&self, path: &str, kind: ReadKind) -> Option<Digest> {
        self.disk.digest(&self.folder.join(path), kind, &self.state.journal)
    }

    /// The file that PATH finds now for a program's name, named as records do.
    pub(crate) fn program(&self, name: &str) -> Option<String> {
        look_up(&self.folder.join(name)).map(|found| path_name(self.folder, &found))
    }

    fn differing_inputs<'o>(
        &self,
        item: ItemIndex,
        record: &Record,
        outputs: impl Fn(ItemIndex) -> Option<&'o [Blob]>,
        reasons: &mut Vec<Reason>,
    ) {
        let shows_keys = self.stages[self.plan.items[item].stage].shows_keys;
        let digest = |arrival: Arrival<'_>| self.arriving(arrival, outputs(arrival.from)?);
        let now = self.arrivals(item).map(|arrival| (arrival.port, self.name(arrival.from), digest(arrival)));
        let now = now.collect::<Vec<_>>();
        let ports =
            now.iter().map(|(port, ..)| *port).chain(record.inputs.iter().map(|used| used.port.as_str()));
        let mut seen = HashSet::new();
        for port in ports.filter(|port| seen.insert(*port)) {
            let old = record.inputs.iter().filter(|used| used.port == port).collect::<Vec<_>>();
            let new = now.iter().filter(|(other, ..)| *other == port).collect::<Vec<_>>();
            let same = old.len() == new.len()
                && old.iter().zip(&new).all(|(used, (_, name, digest))| {
                    Some(used.digest) == *digest && (!shows_keys || used.item == *name)
                });
            if same {
                continue;
            }
            let before = old.iter().map(|used| (&used.item, used.digest)).collect::<HashMap<_, _>>();
            for (_, name, digest) in &new {
                let old = before.get(name).copied();
                let (port, item) = (port.to_owned(), name.clone());
                if digest.is_none() {
                    reasons.push(Reason::Awaits { port, item });
                } else if old != *digest {
                    reasons.push(Reason::Input { port, item, old, new: *digest });
                }
            }
            let after = new.iter().map(|(_, name, _)| name).collect::<HashSet<_>>();
            for used in old.iter().filter(|used| !after.contains(&used.item)) {
                let (port, item) = (port.to_owned(), used.item.clone());
                reasons.push(Reason::Input { port, item, old: Some(used.digest), new: None });
            }
        }
    }

    fn differing_files(&self, item: ItemIndex, record: &Record, reasons: &mut Vec<Reason>) {
        for read in &record.reads {
            let new = self.current_digest(&read.path, read.kind);
            if new == read.digest {
                continue;
            }
            reasons.push(if read.kind == ReadKind::Lookup {
                Reason::Program {
                    name: read.path.clone(),
                    old: read.found.clone(),
                    new: self.program(&read.path),
                }
            } else {
                Reason::File {
                    path: read.path.clone(),
                    old: read.digest,
                    new,
                    old_time: read.modified,
                    new_time: modified(&self.folder.join(&read.path)),
                }
            });
        }
        let source = self.source(item);
        if let Some(path) = source.filter(|source| record.source.as_ref() != Some(source)) {
            let is_folder = self.folder.join(&path).is_dir();
            let new = self.current_digest(&path, if is_folder { ReadKind::Names } else { ReadKind::Content });
            let new_time = modified(&self.folder.join(&path));
            reasons.push(Reason::File { path, old: None, new, old_time: None, new_time });
        }
    }
}

pub(crate) fn item_subject(manifest: &str, stage: &str, key: &ItemKey) -> Subject {
    let mut parts = vec![manifest, stage];
    parts.extend(key.iter().flat_map(|(stage, stem)| [stage, stem]));
    subject(&parts)
}

fn stage_infos(plan: &Plan) -> Vec<StageInfo> {
    let mut info = Vec::with_capacity(plan.stages.len());
    for stage in plan.stages.iter() {
        let parameters = canonical(&stage.configured.canonical());
        info.push(StageInfo {
            parameters_text: parameters.to_string(),
            parameters,
            revision: stage.kind.revision(),
            shows_keys: stage.kind.shows_keys(),
            processor: stage.configured.processor(),
            artifact: match stage.product {
                Product::Artifact(name) => Some((name, None)),
                Product::Files(_) => None,
            },
            many: stage.ports.iter().filter(|port| port.many).map(|port| port.name.clone()).collect(),
            files_taken: plan.files_taken(stage),
            files_read: Vec::new(),
        });
        for ((name, from), file) in stage.inputs.iter().zip(plan.files_taken(stage)) {
            let read = &mut info[*from].files_read;
            read.extend(file.filter(|file| !read.contains(file)));
            let port = stage.ports.iter().find(|port| port.name == *name);
            if let (Some(port), Some((made, decoder))) = (port, &mut info[*from].artifact) {
                *decoder = decoder.or(port.decoder(made));
            }
        }
    }
    info
}

fn differing_parameters(old: &Value, new: &Value, reasons: &mut Vec<Reason>) {
    let (Some(old), Some(new)) = (old.as_object(), new.as_object()) else { return };
    let names = old.keys().chain(new.keys().filter(|name| !old.contains_key(*name)));
    for name in names {
        let value =
            |object: &serde_json::Map<String, Value>| object.get(name).cloned().unwrap_or(Value::Null);
        let (old, new) = (value(old), value(new));
        if old != new {
            reasons.push(Reason::Parameter { name: name.clone(), old, new });
        }
    }
}
