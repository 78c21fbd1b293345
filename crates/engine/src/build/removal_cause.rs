//! Why files are removed from `out`: what happened to the source or the stage that they were made from.

use std::collections::HashMap;
use std::fs;
use std::sync::OnceLock;

use parking_lot::Mutex;

use super::up_to_date::{UpToDateCheck, item_subject};
use crate::event::{ItemName, RemovalCause};
use crate::key::{Digest, ItemKey};
use crate::plan::{ItemIndex, Plan, StageIndex};
use crate::storage::{ReadKind, Record, Tag};

pub(crate) struct RemovalCauses<'a> {
    check: &'a UpToDateCheck<'a>,
    items: OnceLock<HashMap<ItemName, ItemIndex>>,
    /// What happened to the source stages, each with the stem of a file; `None` if the stage still has it.
    sources: Mutex<HashMap<(String, String), Option<RemovalCause>>>,
    new_sources: OnceLock<HashMap<(StageIndex, Digest), String>>,
}

impl<'a> RemovalCauses<'a> {
    pub(crate) fn new(check: &'a UpToDateCheck<'a>) -> Self {
        Self { check, items: OnceLock::new(), sources: Mutex::default(), new_sources: OnceLock::new() }
    }

    /// Why a file that an item has exported is removed.
    pub(crate) fn of(&self, item: &ItemName) -> RemovalCause {
        if let Some(known) = self.items().get(item) {
            return files_changed(self.check.plan, *known);
        }
        if !self.has_stage(&item.stage) {
            return self.stage_gone(&item.stage);
        }
        let mut parts = item.key.iter();
        let gone = parts.find_map(|(stage, stem)| self.source(stage, stem));
        gone.unwrap_or_else(|| RemovalCause::ItemsChanged { stage: item.stage.clone() })
    }

    fn items(&self) -> &HashMap<ItemName, ItemIndex> {
        let plan = self.check.plan;
        self.items.get_or_init(|| (0..plan.items.len()).map(|item| (plan.item_name(item), item)).collect())
    }

    fn has_stage(&self, name: &str) -> bool {
        self.check.plan.stages.iter().any(|stage| stage.name == name)
    }

    fn stage_gone(&self, stage: &str) -> RemovalCause {
        RemovalCause::StageGone { stage: stage.into(), manifest: self.check.plan.manifest_name() }
    }

    /// What happened to a source; `None` if its stage still has it.
    fn source(&self, stage: &str, stem: &str) -> Option<RemovalCause> {
        let part = (stage.to_owned(), stem.to_owned());
        if let Some(known) = self.sources.lock().get(&part) {
            return known.clone();
        }
        let found = self.find_source(stage, stem);
        self.sources.lock().insert(part, found.clone());
        found
    }

    fn find_source(&self, stage: &str, stem: &str) -> Option<RemovalCause> {
        let key = ItemKey::from_iter([(stage, stem)]);
        if self.items().contains_key(&ItemName { stage: stage.into(), key: key.clone() }) {
            return None;
        }
        if !self.has_stage(stage) {
            return Some(self.stage_gone(stage));
        }
        let check = self.check;
        let subject = item_subject(&check.plan.manifest_name(), stage, &key);
        let record = check.state.journal.get::<Record>(Tag::Item, subject);
        let Some(path) = record.as_ref().and_then(|record| record.source.clone()) else {
            // Without a record only its stem is known.
            return Some(RemovalCause::SourceDeleted { path: format!("source {stem} of stage {stage}") });
        };
        if fs::symlink_metadata(check.folder.join(&path)).is_ok() {
            return Some(RemovalCause::SourceExcluded { path, stage: stage.into() });
        }
        Some(match record.and_then(|record| self.renamed(stage, &record)) {
            Some(to) => RemovalCause::SourceRenamed { path, to },
            None => RemovalCause::SourceDeleted { path },
        })
    }

    /// The new file of a stage that has the content of a source that is gone.
    fn renamed(&self, stage: &str, record: &Record) -> Option<String> {
        let source = record.source.as_deref()?;
        let content = |(path, kind, _): &(&str, ReadKind, _)| *path == source && *kind == ReadKind::Content;
        let (.., digest) = record.reads().find(content)?;
        let stage = self.check.plan.stages.iter().position(|named| named.name == stage)?;
        self.new_sources().get(&(stage, digest?)).cloned()
    }

    /// The source files that no build has read yet, by stage and content.
    fn new_sources(&self) -> &HashMap<(StageIndex, Digest), String> {
        self.new_sources.get_or_init(|| {
            let (check, plan) = (self.check, self.check.plan);
            let is_new = |item: &ItemIndex| check.latest(*item).is_none_or(|latest| latest.is_gone());
            let sources = (0..plan.items.len()).filter(is_new).filter_map(|item| {
                let path = check.source(item)?;
                let digest = check.current_digest(&path, ReadKind::Content)?;
                Some(((plan.items[item].stage, digest), path))
            });
            sources.collect()
        })
    }
}

/// Why a file of an item that the plan has is removed.
pub(crate) fn files_changed(plan: &Plan, item: ItemIndex) -> RemovalCause {
    RemovalCause::FilesChanged { stage: plan.stages[plan.items[item].stage].name.clone() }
}
