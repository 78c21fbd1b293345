//! What of a result is stored in a shared cache, and how it is found and checked.
//!
//! A result is found by its [`action`]: the item's key, and the files that it reads with their digests. Which
//! files an item reads is known only after it ran. So an action names at first the item's source alone; if
//! the item reads further files, what is stored under that action are their names, and the result is stored
//! under an action that names all of them. The result is that of equal contents, whoever made it.
//!
//! Nothing is believed. A stored description must fit the item (its key, its reads, the number of its
//! outputs), and each blob must have the digest that the description gives; otherwise the item runs. What
//! fails at the other end costs one warning, and the build goes on without.

use std::collections::{BTreeSet, HashMap};
use std::path::{Component, Path, PathBuf};
use std::sync::Arc;

use parking_lot::Mutex;
use serde::{Deserialize, Serialize};

use crate::event::ItemName;
use crate::key::Digest;
use crate::plan::Plan;
use crate::shared::{Shared, SharedBlob, SharedCache};
use crate::storage::{Blob, FileRead, Journal, LatestRecord, ReadKind, Record, Store, Tag};
use crate::timestamp::Timestamp;

/// To be raised when the descriptions that are stored would be misunderstood by other versions.
const FORMAT: u32 = 2;

/// Names of further files are followed this often before an item runs.
pub(crate) const ROUNDS: usize = 4;

/// An item that read more files than this is not looked for.
pub(crate) const MOST_READS: usize = 4096;

/// The files that an action names: path, what is asked of it, digest of the answer.
pub(crate) type NamedFiles = BTreeSet<(String, ReadKind, Option<Digest>)>;

/// An action: the canonical text of everything that a result depends on.
pub(crate) fn action(version: &str, key: Digest, files: &NamedFiles) -> Vec<u8> {
    let text = serde_json::json!({ "specula": FORMAT, "version": version, "key": key, "files": files });
    text.to_string().into_bytes()
}

/// The name of the list of a stage's results: the same in every copy of a project.
pub(crate) fn list(version: &str, plan: &Plan, stage: usize) -> Vec<u8> {
    let stages = plan.stages.iter().map(|stage| stage.name.as_str()).collect::<Vec<_>>();
    let (manifest, stage) = (plan.manifest_name(), stages[stage]);
    let text = serde_json::json!({
        "specula": FORMAT, "version": version, "manifest": manifest, "stages": stages, "stage": stage,
    });
    text.to_string().into_bytes()
}

/// The engine's description that is stored under an action.
#[derive(Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Description {
    /// The item reads further files: their paths, and what is asked of each.
    Reads(Vec<(String, ReadKind)>),
    /// The action has this result.
    Result(Box<ResultDescription>),
}

/// A result, as far as another machine needs it.
#[derive(Serialize, Deserialize)]
pub(crate) struct ResultDescription {
    key: Digest,
    machine: String,
    manifest: String,
    item: ItemName,
    version: String,
    kind: String,
    revision: u32,
    reads: Vec<FileRead>,
    outputs: Vec<Blob>,
    started: Timestamp,
    milliseconds: f64,
    warnings: Vec<String>,
    notes: Vec<String>,
}

impl ResultDescription {
    pub(crate) fn of(record: &Record, machine: &str) -> Self {
        let reads = record.reads.iter().map(|read| FileRead { modified: None, ..read.clone() });
        Self {
            key: record.key,
            machine: machine.into(),
            manifest: record.manifest.clone(),
            item: record.item.clone(),
            version: record.version.clone(),
            kind: record.kind.clone(),
            revision: record.revision,
            reads: reads.collect(),
            outputs: record.outputs.clone(),
            started: record.started,
            milliseconds: record.milliseconds,
            warnings: record.warnings.clone(),
            notes: record.notes.clone(),
        }
    }

    /// The record of an item that has this result; `None` if it does not fit the key or its blobs.
    pub(crate) fn record(
        self,
        key: Digest,
        host: &str,
        blobs: Vec<SharedBlob>,
        like: Record,
    ) -> Option<Record> {
        let fits = self.key == key
            && self.kind == like.kind
            && self.revision == like.revision
            && self.outputs.len() == blobs.len()
            && self.outputs.iter().zip(&blobs).all(|(output, blob)| output.bytes == blob.bytes);
        fits.then(|| Record {
            // The maker of the result.
            manifest: self.manifest,
            item: self.item,
            version: self.version,
            reads: self.reads,
            outputs: self.outputs,
            started: self.started,
            milliseconds: self.milliseconds,
            warnings: self.warnings,
            notes: self.notes,
            shared: Some(Shared { host: host.into(), machine: self.machine, blobs }),
            ..like
        })
    }
}

/// The blobs that are on a server and perhaps not here, for the store.
#[derive(Debug)]
pub(crate) struct SharedBlobs {
    cache: Arc<dyn SharedCache>,
    known: Mutex<HashMap<Digest, SharedBlob>>,
}

impl SharedBlobs {
    pub(crate) fn new(cache: Arc<dyn SharedCache>) -> Self {
        Self { cache, known: Mutex::default() }
    }

    /// Remembers where the outputs of records of earlier builds are.
    pub(crate) fn add_recorded(&self, journal: &Journal) {
        let is_shared = |(subject, latest): (_, LatestRecord<'_>)| latest.is_shared().then_some(subject);
        let subjects = journal.latest_records().filter_map(is_shared).collect::<Vec<_>>();
        for (_, record) in journal.contents_of::<Record>(Tag::Item, &subjects) {
            self.add(&record);
        }
    }

    /// The name of a blob on the server, which `hash` finds out if it is not known; `None` if that has none.
    pub(crate) fn name_of(
        &self,
        digest: Digest,
        hash: impl FnOnce() -> Option<SharedBlob>,
    ) -> Option<SharedBlob> {
        if let Some(known) = self.known.lock().get(&digest) {
            return Some(*known);
        }
        let blob = hash()?;
        self.known.lock().insert(digest, blob);
        Some(blob)
    }

    /// Remembers where the outputs of a record are.
    pub(crate) fn add(&self, record: &Record) {
        let blobs = record.shared.iter().flat_map(|shared| &shared.blobs);
        self.known.lock().extend(record.outputs.iter().map(|output| output.digest).zip(blobs.copied()));
    }

    /// The bytes of a small blob that the server has just made.
    pub(crate) fn bytes(&self, blob: SharedBlob) -> Option<Vec<u8>> {
        let mut found = None;
        self.cache.read(&[blob], &mut |_, bytes| {
            found = bytes;
            true
        });
        found
    }

    /// A blob of the server; `None` if it is not there, or is not what it should be.
    pub(crate) fn get(&self, digest: Digest) -> Option<Vec<u8>> {
        let blob = *self.known.lock().get(&digest)?;
        self.bytes(blob).filter(|bytes| Digest::of(bytes) == digest)
    }

    /// Receives blobs into a store, few at a time. What cannot be received or stored is left out: it is asked
    /// for again when it is needed.
    pub(crate) fn receive(&self, store: &Store, digests: &[Digest], stop: &(dyn Fn() -> bool + Sync)) {
        let (digests, blobs): (Vec<_>, Vec<_>) = {
            let known = self.known.lock();
            digests.iter().filter_map(|digest| Some((*digest, *known.get(digest)?))).unzip()
        };
        self.cache.read(&blobs, &mut |index, bytes| {
            let good = bytes.filter(|bytes| Digest::of(bytes) == digests[index]);
            let is_stored = good.is_none_or(|bytes| store.put(&bytes).is_ok());
            is_stored && !stop()
        });
    }
}

/// Whether a server may ask for the digest of a file: it has to be in the manifest's folder, in that of the
/// item's source, or a program. Paths are those of records.
pub(crate) fn may_ask_for(path: &str, source: Option<&str>, programs: &[PathBuf]) -> bool {
    let path = Path::new(path);
    // On Windows `/a` and `C:a` are not absolute, and lead out of every folder all the same.
    let is_relative = !path.has_root() && !matches!(path.components().next(), Some(Component::Prefix(_)));
    // `a/../b` is inside, `a/../../b` is not.
    let mut depth = 0_i32;
    let is_plain = path.components().all(|part| {
        depth += match part {
            Component::Normal(_) => 1,
            Component::ParentDir if is_relative => -1,
            Component::ParentDir => i32::MIN / 2,
            _ => 0,
        };
        depth >= 0
    });
    let beside = source.and_then(|source| Path::new(source).parent());
    let is_beside = || beside.is_some_and(|folder| path.starts_with(folder));
    is_plain && (is_relative || is_beside() || is_in_one_of(path, programs))
}

/// Whether a file lies in one of these folders, and not deeper.
pub(crate) fn is_in_one_of(file: &Path, folders: &[PathBuf]) -> bool {
    file.parent().is_some_and(|folder| folders.iter().any(|known| known == folder))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_server_cannot_ask_for_files_of_others() {
        let programs = [PathBuf::from("/usr/bin")];
        for (path, source, expected) in [
            ("maps/a.exr", None, true),
            ("maps/../a.exr", None, true),
            ("../other/a.exr", None, false),
            ("maps/../../a.exr", None, false),
            ("/home/me/.ssh/id", Some("maps/a.gltf"), false),
            ("/library/a.bin", Some("/library/a.gltf"), true),
            ("/library/../a.bin", Some("/library/a.gltf"), false),
            ("/usr/bin/python3", None, true),
            ("/usr/bin/inner/python3", None, false),
        ] {
            assert_eq!(may_ask_for(path, source, &programs), expected, "{path}");
        }
    }

    #[test]
    fn an_action_holds_all_that_a_result_depends_on() {
        let files: NamedFiles = [("a.exr".to_owned(), ReadKind::Content, Some(Digest([1; 32])))].into();
        let text = action("1", Digest([2; 32]), &files);
        assert_eq!(text, action("1", Digest([2; 32]), &files));
        let others = [
            action("2", Digest([2; 32]), &files),
            action("1", Digest([3; 32]), &files),
            action("1", Digest([2; 32]), &NamedFiles::new()),
        ];
        assert!(others.iter().all(|other| *other != text));
    }
}
