//! Which results a shared cache has of items that are out of date.

use std::borrow::Cow;
use std::collections::HashSet;

use super::{Freshness, UpToDateCheck};
use crate::build::arrivals::Arrival;
use crate::build::shared_results::{
    Description, MOST_READS, NamedFiles, ROUNDS, SharedBlobs, action, list, may_ask_for,
};
use crate::key::Digest;
use crate::kinds::is_left_out;
use crate::plan::ItemIndex;
use crate::shared::{Question, SharedCacheOptions, SharedResult};
use crate::storage::{Blob, ReadKind, Record};
use crate::timestamp::Timestamp;

impl UpToDateCheck<'_> {
    /// The shared cache in which the result of an item was found in this build.
    pub(super) fn shared_host(&self, item: ItemIndex) -> Option<String> {
        Some(self.shared.get(&item)?.shared.as_ref()?.host.clone())
    }

    /// Looks for the results of items that are out of date in a shared cache, stage by stage, because keys
    /// contain the digests of inputs. An item whose inputs have to be made first is not looked for. Returns
    /// the blobs that this build needs: the files of the items found, and what those read that will run.
    pub(crate) fn find_shared(
        &mut self,
        options: &SharedCacheOptions,
        blobs: &SharedBlobs,
        stop: &(dyn Fn() -> bool + Sync),
    ) -> Vec<Digest> {
        self.has_shared = true;
        let mut known = Vec::<Option<Cow<'_, [Blob]>>>::with_capacity(self.plan.items.len());
        let mut needed = HashSet::new();
        for stage in self.plan.items.chunk_by(|one, other| one.stage == other.stage) {
            let first = known.len();
            let is_shared = self.plan.stages[stage[0].stage].configured.is_shared();
            let mut asked = Vec::new();
            for index in first..first + stage.len() {
                let inputs = || self.plan.items[index].inputs.iter().flatten().copied();
                if self.current[index] {
                    known.push(Some(Cow::Borrowed(self.latest_outputs(index))));
                    continue;
                }
                if !self.selected.has(index) || stop() || !inputs().all(|input| known[input].is_some()) {
                    known.push(None);
                    continue;
                }
                let key = self.key(index, |input| known[input].as_deref().unwrap_or_default());
                match self.freshness_of(index, key) {
                    Freshness::Current { outputs, .. } => known.push(Some(Cow::Owned(outputs))),
                    Freshness::Run => {
                        known.push(None);
                        if !self.is_forced(index) {
                            asked.push((index, key));
                        }
                    }
                }
            }
            if is_shared && !asked.is_empty() {
                self.missed.extend(asked.iter().map(|(item, _)| *item));
                for (item, record) in self.shared_records(&asked, options) {
                    self.missed.remove(&item);
                    known[item] = Some(Cow::Owned(record.outputs.clone()));
                    blobs.add(&record);
                    if options.download_all || !self.plan.items[item].files.is_empty() {
                        needed.extend(record.outputs.iter().map(|blob| blob.digest));
                    }
                    self.shared.insert(item, record);
                }
            }
            // What runs reads its inputs.
            for index in (first..first + stage.len()).filter(|index| known[*index].is_none()) {
                let of_selected = self.stored_arrivals(index).filter(|_| self.selected.has(index));
                let digest = |arrival: Arrival<'_>| self.arriving(arrival, known[arrival.from].as_deref()?);
                needed.extend(of_selected.filter_map(digest));
            }
        }
        needed
            .into_iter()
            .filter(|digest| !is_left_out(*digest) && !self.state.store.exists(*digest))
            .collect()
    }

    /// Whether a shared cache was asked in vain for an item, or for one of its inputs: then it is not asked
    /// for what comes after. `before` says so of the inputs as far as it was asked since the build began.
    pub(crate) fn is_missed(&self, item: ItemIndex, before: impl Fn(ItemIndex) -> bool) -> bool {
        let inputs = self.plan.items[item].inputs.iter().flatten().copied();
        inputs.chain([item]).any(|item| self.missed.contains(&item) || before(item))
    }

    /// Whether a shared cache may have the result of an item that it was not asked for when the build began,
    /// because some of its inputs had to be made first: then it is asked before the item runs.
    pub(crate) fn may_be_shared(&self, item: ItemIndex) -> bool {
        let this = &self.plan.items[item];
        let is_shared = self.plan.stages[this.stage].configured.is_shared();
        self.has_shared && is_shared && !this.inputs.is_empty() && !self.is_forced(item)
    }

    /// The result of one item with its key that a shared cache has.
    pub(crate) fn shared_record(
        &self,
        item: ItemIndex,
        key: Digest,
        options: &SharedCacheOptions,
    ) -> Option<Record> {
        self.shared_records(&[(item, key)], options).pop().map(|(_, record)| record)
    }

    /// The results of items of one stage with their keys that a shared cache has.
    fn shared_records(
        &self,
        asked: &[(ItemIndex, Digest)],
        options: &SharedCacheOptions,
    ) -> Vec<(ItemIndex, Record)> {
        let host = options.cache.host();
        let Some((first, _)) = asked.first() else { return Vec::new() };
        let list = list(&options.version, self.plan, self.plan.items[*first].stage);
        let mut found = Vec::new();
        let mut open =
            asked.iter().map(|(item, key)| (*item, *key, self.expected_reads(*item))).collect::<Vec<_>>();
        for _ in 0..ROUNDS {
            let questions = open.iter().map(|(item, key, files)| Question {
                item: self.plan.items[*item].key.to_string(),
                action: action(&options.version, *key, files),
            });
            let answers = options.cache.find(&list, &questions.collect::<Vec<_>>());
            let mut further = Vec::new();
            for ((item, key, mut files), answer) in open.into_iter().zip(answers) {
                let Some(SharedResult { description, outputs }) = answer else { continue };
                match serde_json::from_slice(&description) {
                    Ok(Description::Result(result)) => {
                        let record = result.record(key, &host, outputs, self.blank_record(item, key));
                        let is_good = |record: &Record| {
                            self.is_valid(item, false, &record.outputs, record.reads())
                                && record.reads().all(|(path, kind, digest)| {
                                    files.contains(&(path.to_owned(), kind, digest))
                                })
                        };
                        found.extend(record.filter(is_good).map(|record| (item, record)));
                    }
                    Ok(Description::Reads(names)) => {
                        let source = self.source(item);
                        let is_fine = |(path, _): &(String, ReadKind)| {
                            may_ask_for(path, source.as_deref(), &options.programs)
                        };
                        if names.len() > MOST_READS || !names.iter().all(is_fine) {
                            continue;
                        }
                        let before = files.len();
                        files.extend(names.into_iter().map(|(path, kind)| {
                            let digest = self.current_digest(&path, kind);
                            (path, kind, digest)
                        }));
                        if files.len() > before {
                            further.push((item, key, files));
                        }
                    }
                    Err(_) => {}
                }
            }
            open = further;
            if open.is_empty() {
                break;
            }
        }
        found
    }

    /// The reads that are expected of an item: its source, as a file and as a folder.
    pub(crate) fn expected_reads(&self, item: ItemIndex) -> NamedFiles {
        let source = self.source(item).into_iter();
        source
            .flat_map(|path| {
                [ReadKind::Content, ReadKind::Names].map(|kind| {
                    let digest = self.current_digest(&path, kind);
                    (path.clone(), kind, digest)
                })
            })
            .collect()
    }

    fn blank_record(&self, item: ItemIndex, key: Digest) -> Record {
        let stage = &self.plan.stages[self.plan.items[item].stage];
        let info = &self.stages[self.plan.items[item].stage];
        Record {
            manifest: self.plan.manifest_name(),
            item: self.name(item),
            gone: false,
            key,
            version: String::new(),
            kind: stage.kind.name().into(),
            revision: info.revision,
            parameters: info.parameters.clone(),
            source: self.source(item),
            mount: self.mount(item),
            inputs: Vec::new(),
            reads: Vec::new(),
            outputs: Vec::new(),
            started: Timestamp::now(),
            milliseconds: 0.0,
            reasons: Vec::new(),
            causes: Vec::new(),
            from_cache: None,
            place: None,
            shared: None,
            warnings: Vec::new(),
            notes: Vec::new(),
            failure: None,
        }
    }
}
