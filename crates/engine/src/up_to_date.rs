//! Whether an item's result is at hand, and if not, why not.
//!
//! An item is up to date when there is a record with its key whose reads are what the files hold now, and whose
//! outputs are in the store. The record in effect (of the last build) is asked first, then the results of earlier
//! keys and contents, so that an edit which is taken back runs nothing.

use std::collections::{HashMap, HashSet};
use std::path::{Path, PathBuf};

use rayon::prelude::*;
use serde_json::Value;

use crate::disk::{Disk, modified};
use crate::journal::{Effect, Line, Subject, Tag, short, subject};
use crate::kind::Decoder;
use crate::record::{KeyHasher, Record, canonical, kind_name, path_name};
use crate::running::{Changes, Seen};
use crate::state::State;
use crate::store::{Blob, Presence};
use crate::{Digest, Error, FileRead, InputUsed, ItemIndex, ItemKey, ItemName, Plan, Product, Read, Reason};

/// What is worked out once for a stage.
pub(crate) struct StageFacts {
    pub(crate) parameters: Value,
    parameters_text: String,
    pub(crate) revision: u32,
    pub(crate) shows_keys: bool,
    /// The artifact's type and the decoder that the first consumer declares.
    pub(crate) artifact: Option<(&'static str, Option<Decoder>)>,
    /// The names of the ports that take many.
    pub(crate) many: HashSet<String>,
}

/// Judges the items of a plan.
pub(crate) struct UpToDateCheck<'a> {
    pub(crate) plan: &'a Plan,
    pub(crate) state: &'a State,
    pub(crate) disk: &'a Disk,
    pub(crate) stages: Vec<StageFacts>,
    /// The folder of the manifest.
    pub(crate) folder: &'a Path,
    manifest: String,
    selected: &'a [bool],
    /// The record in effect of each item; empty: each is looked up when it is asked for.
    effects: Vec<Option<Effect<'a>>>,
    /// Whether its result was at hand when the build began.
    current: Vec<bool>,
    /// What an earlier build left, as far as nothing has changed since.
    known: Option<Known>,
}

/// What is known of the items of a plan without looking.
#[derive(Clone)]
pub(crate) struct Known {
    /// Whether an item is as an earlier build left it, its result and its files.
    pub(crate) settled: Vec<bool>,
    /// The items that read files, and perhaps others.
    pub(crate) readers: Vec<ItemIndex>,
}

/// What is known of an item's result.
pub(crate) enum Freshness {
    /// It is at hand.
    Current {
        /// The outputs.
        outputs: Vec<Blob>,
        /// The record that made them, where it is not the one in effect.
        restored: Option<Box<Record>>,
    },
    /// It has to be made.
    Run,
}

impl<'a> UpToDateCheck<'a> {
    /// Reads the records of the items, and looks at the files that those of selected stages name.
    pub(crate) fn new(plan: &'a Plan, state: &'a State, disk: &'a Disk, selected: &'a [bool]) -> Self {
        let mut judge = Self::with_records(plan, state, disk, selected, None);
        let readers = judge.readers();
        judge.look(&readers, None, &|| false);
        judge
    }

    /// Reads the records of the items; but if something is `known`, only when they are asked for.
    pub(crate) fn with_records(
        plan: &'a Plan,
        state: &'a State,
        disk: &'a Disk,
        selected: &'a [bool],
        known: Option<Known>,
    ) -> Self {
        let folder = plan.manifest.parent().unwrap_or(Path::new("."));
        let manifest = manifest_name(plan);
        let (stages, effects, current) = (stage_facts(plan), Vec::new(), Vec::new());
        let mut judge =
            Self { plan, state, disk, stages, folder, manifest, selected, effects, current, known };
        if judge.known.is_none() {
            let items = (0..plan.items.len()).into_par_iter();
            judge.effects = items.map(|item| state.journal.effect(judge.subject(item))).collect();
        }
        judge
    }

    /// The items that read files in their last runs, and perhaps others.
    pub(crate) fn readers(&self) -> Vec<ItemIndex> {
        match &self.known {
            Some(known) => known.readers.clone(),
            None => {
                let reads = |item: &ItemIndex| {
                    self.effect(*item).is_some_and(|effect| effect.reads().next().is_some())
                };
                (0..self.plan.items.len()).filter(reads).collect()
            }
        }
    }

    /// Looks at the files that the records name, and finds the items whose results are at hand. Of what is known before,
    /// only that is looked at which changes concern. If `stop` says so, the rest is left.
    pub(crate) fn look(
        &mut self,
        readers: &[ItemIndex],
        changes: Option<&Changes>,
        stop: &(dyn Fn() -> bool + Sync),
    ) {
        let mut known = self.known.take();
        let (mut places, mut read) = (HashSet::new(), HashSet::new());
        for &item in readers {
            for (path, listing, _) in self.effect(item).iter().flat_map(Effect::reads) {
                let path = self.folder.join(path);
                if let Some(known) = &mut known {
                    known.settled[item] &= !changes.is_some_and(|changes| changes.concern(&path, listing));
                }
                if known.as_ref().is_none_or(|known| !known.settled[item]) {
                    read.insert((path.clone(), listing));
                }
                places.insert((path, listing));
            }
        }
        self.known = known;
        self.disk.note_places(places);
        self.disk.look_ahead(read.into_iter().collect::<Vec<(PathBuf, bool)>>(), &self.state.journal);
        let asked = if self.known.is_some() { 0 } else { self.plan.items.len() };
        let store = self.state.store.presence(asked);
        // Stage by stage, because keys hold what arrives; the items of a stage all at once.
        let mut current = Vec::with_capacity(self.plan.items.len());
        for stage in self.plan.items.chunk_by(|one, other| one.stage == other.stage) {
            let first = current.len();
            let is_current = |index: usize| !stop() && self.is_current_after(first + index, &current, &store);
            let found = (0..stage.len()).into_par_iter().map(is_current).collect::<Vec<_>>();
            current.extend(found);
        }
        self.current = current;
    }

    /// Whether the result of an item is at hand, given that of those before it.
    fn is_current_after(&self, item: ItemIndex, current: &[bool], store: &Presence<'_>) -> bool {
        let this = &self.plan.items[item];
        if !self.selected[this.stage] || !this.inputs.iter().flatten().all(|input| current[*input]) {
            return false;
        }
        let is_good = |effect: Effect<'_>| {
            !effect.is_gone()
                && effect.key() == self.key(item, |input| self.digest_in_effect(input))
                && self.is_good_in_effect(item, effect)
                && effect.outputs().iter().all(|blob| store.has(blob))
        };
        self.is_known_settled(item) || self.effect(item).is_some_and(is_good)
    }

    fn is_known_settled(&self, item: ItemIndex) -> bool {
        self.known.as_ref().is_some_and(|known| known.settled[item])
    }

    /// What is known without looking; `None` if everything was looked at.
    pub(crate) fn known(&self) -> Option<&Known> {
        self.known.as_ref()
    }

    /// Whether an item is known, without looking, to be as an earlier build left it.
    pub(crate) fn is_settled(&self, item: ItemIndex) -> bool {
        self.current[item] && self.is_known_settled(item)
    }

    /// What an item made, by its record in effect.
    fn digest_in_effect(&self, item: ItemIndex) -> Digest {
        let made = self.effect_of(item).and_then(|effect| effect.outputs().first());
        made.map_or(Digest([0; 32]), |blob| blob.digest)
    }

    /// Marks the records of items that the manifest does not have any more.
    ///
    /// # Errors
    /// Where the journal cannot be written.
    pub(crate) fn mark_gone(&self) -> Result<(), Error> {
        let journal = &self.state.journal;
        let is_ours = |effect: &Effect<'_>| !effect.is_gone() && effect.manifest() == self.manifest;
        if self.known.is_some() {
            return Ok(());
        }
        let ours = journal.effects().filter(|(_, effect)| is_ours(effect));
        if ours.count() == self.effects.iter().flatten().filter(|effect| is_ours(effect)).count() {
            return Ok(());
        }
        let here = (0..self.plan.items.len()).into_par_iter().map(|item| self.subject(item));
        let here = here.collect::<HashSet<_>>();
        let ours = journal.effects().filter(|(subject, effect)| is_ours(effect) && !here.contains(subject));
        let gone = ours.filter_map(|(subject, _)| {
            let record = journal.get::<Record>(Tag::Item, subject)?;
            Some(Line::new(Tag::Item, subject, Some(&Record { gone: true, ..record })))
        });
        journal.append(&gone.collect::<Vec<_>>())
    }

    pub(crate) fn name(&self, item: ItemIndex) -> ItemName {
        item_name(self.plan, item)
    }

    /// What every build asks of the record in effect of an item of a selected stage.
    pub(crate) fn effect(&self, item: ItemIndex) -> Option<Effect<'a>> {
        self.effect_of(item).filter(|_| self.selected[self.plan.items[item].stage])
    }

    fn effect_of(&self, item: ItemIndex) -> Option<Effect<'a>> {
        match self.effects.get(item) {
            Some(effect) => *effect,
            None => self.state.journal.effect(self.subject(item)),
        }
    }

    /// The same record, read from the journal.
    pub(crate) fn record(&self, item: ItemIndex) -> Option<Record> {
        self.effect(item).and_then(|_| self.state.journal.get(Tag::Item, self.subject(item)))
    }

    /// Whether the result of an item was at hand when the build began.
    pub(crate) fn is_current(&self, item: ItemIndex) -> bool {
        self.current[item]
    }

    /// The subject of the record in effect.
    pub(crate) fn subject(&self, item: ItemIndex) -> Subject {
        let item = &self.plan.items[item];
        item_subject(&self.manifest, &self.plan.stages[item.stage].name, &item.key)
    }

    /// Whether a record is of this item.
    pub(crate) fn is_of(&self, item: ItemIndex, record: &Record) -> bool {
        record.item == self.name(item) && record.manifest == self.manifest
    }

    /// The source as records hold it.
    pub(crate) fn source(&self, item: ItemIndex) -> Option<String> {
        self.plan.items[item].source.as_deref().map(|source| path_name(self.folder, source))
    }

    /// The artifacts that arrive, given what each item made.
    pub(crate) fn inputs(&self, item: ItemIndex, digest: impl Fn(ItemIndex) -> Digest) -> Vec<InputUsed> {
        self.arrivals(item)
            .map(|(port, from)| InputUsed { port: port.into(), item: self.name(from), digest: digest(from) })
            .collect()
    }

    /// All that an item's result depends on but the files that it reads.
    pub(crate) fn key(&self, item: ItemIndex, digest: impl Fn(ItemIndex) -> Digest) -> Digest {
        let this = &self.plan.items[item];
        let stage = &self.plan.stages[this.stage];
        let facts = &self.stages[this.stage];
        let source = self.source(item);
        let mut hasher =
            KeyHasher::new(stage.kind.name(), facts.revision, &facts.parameters_text, source.as_deref());
        for ((port, _), items) in stage.inputs.iter().zip(&this.inputs) {
            hasher.text(port).number(items.len() as u64);
            for &from in items {
                let made = &self.plan.items[from];
                let artifact = self.stages[made.stage].artifact.map_or("", |(name, _)| name);
                hasher.text(artifact).digest(digest(from));
                if facts.shows_keys {
                    hasher.item_key(&made.key);
                }
            }
        }
        if facts.shows_keys {
            hasher.item_key(&this.key);
        }
        hasher.finish()
    }

    /// What the record in effect of an item rests on.
    pub(crate) fn seen_before(&self, item: ItemIndex) -> Seen {
        let reads = self.effect(item).into_iter().flat_map(|effect| effect.reads());
        let reads =
            reads.map(|(path, listing, digest)| Read { path: self.folder.join(path), listing, digest });
        Seen::before(reads.collect())
    }

    /// What a record rests on.
    pub(crate) fn seen(&self, record: &Record) -> Seen {
        let read = |read: &FileRead| Read {
            path: self.folder.join(&read.path),
            listing: read.listing,
            digest: read.digest,
        };
        Seen::before(record.reads.iter().map(read).collect())
    }

    /// Whether a result with this key is at hand.
    pub(crate) fn verdict(&self, item: ItemIndex, key: Digest) -> Freshness {
        let is_stored = |outputs: &[Blob]| outputs.iter().all(|blob| self.state.store.has(blob));
        let in_effect = self.effect(item).filter(|effect| !effect.is_gone() && effect.key() == key);
        let in_effect = in_effect.filter(|effect| self.is_good_in_effect(item, *effect));
        if let Some(effect) = in_effect.filter(|effect| is_stored(effect.outputs())) {
            return Freshness::Current { outputs: effect.outputs().to_vec(), restored: None };
        }
        let results = self.state.journal.results::<Record>(short(key));
        let mut results = results.filter(|record| record.key == key).collect::<Vec<_>>();
        // Its own result says more of it than one of another item for which everything is equal.
        results.sort_by_key(|record| !self.is_of(item, record));
        let is_stored = |record: &Record| is_stored(&record.outputs);
        match results.into_iter().find(|record| self.is_good(item, record) && is_stored(record)) {
            Some(record) => {
                Freshness::Current { outputs: record.outputs.clone(), restored: Some(Box::new(record)) }
            }
            None => Freshness::Run,
        }
    }

    /// Every difference from the record in effect.
    ///
    /// `digest` tells what an item made, where that is known yet.
    pub(crate) fn reasons(
        &self,
        item: ItemIndex,
        digest: impl Fn(ItemIndex) -> Option<Digest>,
    ) -> Vec<Reason> {
        let Some(record) = self.record(item) else { return vec![Reason::NeverBuilt] };
        let mut reasons = Vec::new();
        if record.failure.is_some() {
            reasons.push(Reason::FailedBefore);
        }
        reasons.extend(self.revisions(item, &record));
        self.differing_inputs(item, &record, digest, &mut reasons);
        self.differing_files(item, &record, &mut reasons);
        if reasons.is_empty() {
            reasons.push(if record.gone { Reason::Returned } else { Reason::ResultLost });
        }
        reasons
    }

    /// The differences of kind and parameters from a record.
    pub(crate) fn revisions(&self, item: ItemIndex, record: &Record) -> Vec<Reason> {
        let stage = self.plan.items[item].stage;
        let facts = &self.stages[stage];
        let kind = kind_name(self.plan.stages[stage].kind.name(), facts.revision);
        let mut reasons = Vec::new();
        if kind != record.kind_name() {
            reasons.push(Reason::Kind { old: record.kind_name(), new: kind });
        }
        differing_parameters(&record.parameters, &facts.parameters, &mut reasons);
        reasons
    }

    /// Whether a record, should its outputs be in the store, holds what the item would make now.
    fn is_good(&self, item: ItemIndex, record: &Record) -> bool {
        // An artifact is one output; the files of an export are as many as it names.
        let expected = self.plan.items[item].files.len().max(1);
        record.failure.is_none()
            && record.outputs.len() == expected
            && record.reads.iter().all(|read| self.now(read) == read.digest)
    }

    /// The same of the record in effect.
    fn is_good_in_effect(&self, item: ItemIndex, effect: Effect<'_>) -> bool {
        let expected = self.plan.items[item].files.len().max(1);
        let now =
            |path: &str, listing| self.disk.digest(&self.folder.join(path), listing, &self.state.journal);
        !effect.has_failed()
            && effect.outputs().len() == expected
            && effect.reads().all(|(path, listing, digest)| now(path, listing) == digest)
    }

    /// What a file or folder that was read holds now.
    pub(crate) fn now(&self, read: &FileRead) -> Option<Digest> {
        self.disk.digest(&self.folder.join(&read.path), read.listing, &self.state.journal)
    }

    fn arrivals(&self, item: ItemIndex) -> impl Iterator<Item = (&str, ItemIndex)> {
        let this = &self.plan.items[item];
        let ports = self.plan.stages[this.stage].inputs.iter().zip(&this.inputs);
        ports.flat_map(|((port, _), items)| items.iter().map(|from| (port.as_str(), *from)))
    }

    fn differing_inputs(
        &self,
        item: ItemIndex,
        record: &Record,
        digest: impl Fn(ItemIndex) -> Option<Digest>,
        reasons: &mut Vec<Reason>,
    ) {
        let shows_keys = self.stages[self.plan.items[item].stage].shows_keys;
        let now = self.arrivals(item).map(|(port, from)| (port, self.name(from), digest(from)));
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
            let new = self.now(read);
            if new != read.digest {
                reasons.push(Reason::File {
                    path: read.path.clone(),
                    old: read.digest,
                    new,
                    old_time: read.modified,
                    new_time: modified(&self.folder.join(&read.path)),
                });
            }
        }
        let source = self.source(item);
        if let Some(path) = source.filter(|source| record.source.as_ref() != Some(source)) {
            let listing = self.folder.join(&path).is_dir();
            let new = self.now(&FileRead { path: path.clone(), listing, digest: None, modified: None });
            let new_time = modified(&self.folder.join(&path));
            reasons.push(Reason::File { path, old: None, new, old_time: None, new_time });
        }
    }
}

/// An item's name.
pub(crate) fn item_name(plan: &Plan, item: ItemIndex) -> ItemName {
    let item = &plan.items[item];
    ItemName { stage: plan.stages[item.stage].name.clone(), key: item.key.clone() }
}

/// The manifest's file name: several manifests may share a folder, and then its state.
pub(crate) fn manifest_name(plan: &Plan) -> String {
    plan.manifest.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

/// The subject of the record in effect of an item.
pub(crate) fn item_subject(manifest: &str, stage: &str, key: &ItemKey) -> Subject {
    let mut parts = vec![manifest, stage];
    parts.extend(key.iter().flat_map(|(stage, stem)| [stage, stem]));
    subject(&parts)
}

fn stage_facts(plan: &Plan) -> Vec<StageFacts> {
    let mut facts = Vec::with_capacity(plan.stages.len());
    for stage in plan.stages.iter() {
        let parameters = canonical(&stage.configured.canonical());
        facts.push(StageFacts {
            parameters_text: parameters.to_string(),
            parameters,
            revision: stage.kind.revision(),
            shows_keys: stage.kind.shows_keys(),
            artifact: match stage.product {
                Product::Artifact(name) => Some((name, None)),
                Product::Files(_) => None,
            },
            many: stage.ports.iter().filter(|port| port.many).map(|port| port.name.clone()).collect(),
        });
        for (name, from) in &stage.inputs {
            let port = stage.ports.iter().find(|port| port.name == *name);
            if let (Some(port), Some((made, decoder))) = (port, &mut facts[*from].artifact) {
                *decoder = decoder.or(port.decoder(made));
            }
        }
    }
    facts
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
