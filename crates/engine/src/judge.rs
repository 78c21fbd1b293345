//! Whether an item's result is at hand, and if not, why not.
//!
//! An item is up to date when there is a record with its key whose reads are what the files hold now, and whose
//! outputs are in the store. The record in effect (of the last build) is asked first, then the results of earlier
//! keys and contents, so that an edit which is taken back runs nothing.

use std::collections::{HashMap, HashSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use rayon::prelude::*;
use serde::Deserialize;
use serde_json::Value;

use crate::disk::{Disk, modified};
use crate::journal::{Line, Subject, Tag, short, subject};
use crate::kind::Decoder;
use crate::record::{KeyHasher, Record, canonical, kind_name, path_name};
use crate::state::State;
use crate::store::Blob;
use crate::{Digest, Error, FileRead, InputUsed, ItemIndex, ItemKey, ItemName, Plan, Product, Reason};

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
pub(crate) struct Judge<'a> {
    pub(crate) plan: &'a Plan,
    pub(crate) state: &'a State,
    pub(crate) disk: &'a Disk,
    pub(crate) stages: Vec<StageFacts>,
    /// The folder of the manifest.
    pub(crate) folder: &'a Path,
    /// The record in effect of each selected item.
    records: Vec<Option<Arc<Record>>>,
    /// Whether its outputs were in the store when the build began.
    stored: Vec<bool>,
}

/// What is known of an item's result.
pub(crate) enum Verdict {
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

/// What a record says of its item.
#[derive(Deserialize)]
struct Standing {
    manifest: String,
    #[serde(default)]
    gone: bool,
}

impl<'a> Judge<'a> {
    /// Reads the records of the items that `selected` names, and looks at the files that they name.
    pub(crate) fn new(plan: &'a Plan, state: &'a State, disk: &'a Disk, selected: &[bool]) -> Self {
        let folder = plan.manifest.parent().unwrap_or(Path::new("."));
        let manifest = manifest_name(plan);
        let records = plan.items.par_iter().map(|item| {
            let stage = &plan.stages[item.stage].name;
            let place = item_subject(&manifest, stage, &item.key);
            selected[item.stage].then(|| state.journal.known::<Record>(Tag::Item, place)).flatten()
        });
        let records = records.collect::<Vec<_>>();
        let reads = records.iter().flatten().flat_map(|record| &record.reads);
        let places = reads.map(|read| (folder.join(&read.path), read.listing)).collect::<HashSet<_>>();
        disk.look_ahead(places.into_iter().collect::<Vec<(PathBuf, bool)>>(), &state.journal);
        // All at once, as items are judged one after the other.
        let is_stored = |record: &Option<Arc<Record>>| {
            record.as_ref().is_some_and(|record| record.outputs.iter().all(|blob| state.store.has(blob)))
        };
        let stored = records.par_iter().map(is_stored).collect();
        Self { plan, state, disk, stages: stage_facts(plan), folder, records, stored }
    }

    /// Marks the records of items that the manifest does not have any more.
    ///
    /// # Errors
    /// Where the journal cannot be written.
    pub(crate) fn mark_gone(&self) -> Result<(), Error> {
        let journal = &self.state.journal;
        let here = (0..self.plan.items.len()).into_par_iter().map(|item| self.subject(item));
        let here = here.collect::<HashSet<_>>();
        let manifest = manifest_name(self.plan);
        let others = journal.named(Tag::Item).filter(|subject| !here.contains(subject));
        let gone = others.filter_map(|subject| {
            let standing = journal.known::<Standing>(Tag::Item, subject)?;
            let goes = !standing.gone && standing.manifest == manifest;
            let record = goes.then(|| journal.get::<Record>(Tag::Item, subject)).flatten()?;
            Some(Line::new(Tag::Item, subject, Some(&Record { gone: true, ..record })))
        });
        journal.append(&gone.collect::<Vec<_>>())
    }

    pub(crate) fn name(&self, item: ItemIndex) -> ItemName {
        item_name(self.plan, item)
    }

    /// The record in effect.
    pub(crate) fn record(&self, item: ItemIndex) -> Option<&Arc<Record>> {
        self.records[item].as_ref()
    }

    /// The subject of the record in effect.
    pub(crate) fn subject(&self, item: ItemIndex) -> Subject {
        let item = &self.plan.items[item];
        item_subject(&manifest_name(self.plan), &self.plan.stages[item.stage].name, &item.key)
    }

    /// Whether a record is of this item.
    pub(crate) fn is_of(&self, item: ItemIndex, record: &Record) -> bool {
        record.item == self.name(item) && record.manifest == manifest_name(self.plan)
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

    /// Whether a result with this key is at hand.
    pub(crate) fn verdict(&self, item: ItemIndex, key: Digest) -> Verdict {
        let in_effect = self.record(item).filter(|record| !record.gone && record.key == key);
        if let Some(record) = in_effect.filter(|record| self.stored[item] && self.is_good(item, record)) {
            return Verdict::Current { outputs: record.outputs.clone(), restored: None };
        }
        let results = self.state.journal.results::<Record>(short(key));
        let mut results = results.filter(|record| record.key == key).collect::<Vec<_>>();
        // Its own result says more of it than one of another item for which everything is equal.
        results.sort_by_key(|record| !self.is_of(item, record));
        let is_stored = |record: &Record| record.outputs.iter().all(|blob| self.state.store.has(blob));
        match results.into_iter().find(|record| self.is_good(item, record) && is_stored(record)) {
            Some(record) => {
                Verdict::Current { outputs: record.outputs.clone(), restored: Some(Box::new(record)) }
            }
            None => Verdict::Run,
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
        reasons.extend(self.revisions(item, record));
        self.differing_inputs(item, record, digest, &mut reasons);
        self.differing_files(item, record, &mut reasons);
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
    parts.extend(key.0.iter().flat_map(|(stage, stem)| [stage.as_str(), stem.as_str()]));
    subject(&parts)
}

fn stage_facts(plan: &Plan) -> Vec<StageFacts> {
    let mut facts = Vec::with_capacity(plan.stages.len());
    for stage in &plan.stages {
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
                let place = port.types.iter().position(|taken| taken == made);
                *decoder = decoder.or(place.map(|place| port.decoders[place]));
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
