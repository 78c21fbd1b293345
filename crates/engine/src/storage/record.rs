//! The record of a run, and the key under which its result is found again.

use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};

use super::files::ReadKind;
use super::store::Blob;
use crate::event::{ItemName, Reason};
use crate::key::{Digest, ItemKey};
use crate::shared::{Place, Shared, SharedOrigin};
use crate::timestamp::Timestamp;

/// To be raised when the engine gives kinds something else for equal keys, or revisions begin anew.
const ENGINE_FORMAT: u32 = 2;

/// An item's result, or its failure: its inputs, its outputs, its messages, and why the item has it.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Record {
    /// The manifest's name and the item. They are not part of the key: another item may take over the result.
    pub(crate) manifest: String,
    pub(crate) item: ItemName,
    /// Whether the manifest no longer has the item; its outputs are kept for its return, as long as there is
    /// room.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub(crate) gone: bool,
    /// Everything that the result depends on except for the files read, which are known only after the run.
    pub(crate) key: Digest,
    /// The version of the program that ran the item. It is not part of the key.
    pub(crate) version: String,
    pub(crate) kind: String,
    pub(crate) revision: u32,
    pub(crate) parameters: Value,
    pub(crate) source: Option<String>,
    /// Where the drive of the source was mounted; `.` if it was that of the manifest's folder.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) mount: Option<String>,
    pub(crate) inputs: Vec<InputUsed>,
    pub(crate) reads: Vec<FileRead>,
    /// The item's outputs; for a failure, those of the last successful run.
    pub(crate) outputs: Vec<Blob>,
    pub(crate) started: Timestamp,
    pub(crate) milliseconds: f64,
    /// Why the item ran; for a result from the cache, why the item has it.
    pub(crate) reasons: Vec<Reason>,
    /// The causes of the rerun, if they are not the reasons themselves.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(crate) causes: Vec<Cause>,
    /// `None` if the item ran. Otherwise `version`, `started` and `milliseconds` are those of the run that
    /// made the result.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) from_cache: Option<FromCache>,
    /// Where the item ran, in a build that lets items run elsewhere.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) place: Option<Place>,
    /// Where the outputs are, if a shared cache had them: perhaps only there.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) shared: Option<Shared>,
    pub(crate) warnings: Vec<String>,
    pub(crate) notes: Vec<String>,
    pub(crate) failure: Option<Vec<String>>,
}

impl Record {
    /// Everything that the run read: the path, what was asked of it, and the digest of the answer.
    pub(crate) fn reads(&self) -> impl Iterator<Item = (&str, ReadKind, Option<Digest>)> {
        self.reads.iter().map(|read| (read.path.as_str(), read.kind, read.digest))
    }

    /// The item whose run made the result, and its manifest.
    pub(crate) fn maker(&self) -> (&ItemName, &str) {
        match &self.from_cache {
            Some(from) => (&from.item, &from.manifest),
            None => (&self.item, &self.manifest),
        }
    }

    pub(crate) fn kind_name(&self) -> String {
        kind_name(&self.kind, self.revision)
    }
}

/// An artifact that a run used.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct InputUsed {
    /// The port.
    pub port: String,
    /// The item that made the artifact.
    pub item: ItemName,
    /// The artifact's digest.
    pub digest: Digest,
}

/// Something that a run read: a file, the names in a folder, or where PATH leads.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FileRead {
    /// The path, relative to the manifest's folder if it is inside; for a look-up, the program's name.
    pub path: String,
    /// What was asked of the path: in JSON, `listing` and, for a look-up, `lookup`.
    #[serde(flatten)]
    pub kind: ReadKind,
    /// The digest of the answer; `None` if nothing was found.
    pub digest: Option<Digest>,
    /// The file that a look-up found, named as `path` is.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub found: Option<String>,
    /// When the file had been modified, by its file system; for people only, it is not part of a key.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub modified: Option<Timestamp>,
}

/// The origin of a result that an item has without a run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FromCache {
    /// Since when the item has the result.
    pub since: Timestamp,
    /// The item whose run made the result: this one earlier, or another one with the same inputs.
    pub item: ItemName,
    /// The manifest of the item whose run made the result: the manifests of one folder share the cache.
    pub manifest: String,
    /// The shared cache that had the result, and the machine that made it; `None` if it was made here.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub shared: Option<SharedOrigin>,
}

/// The cause of a rerun: the file, parameter or kind that changed first.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Cause {
    /// What was different.
    pub reason: Reason,
    /// The items through which the change came: first the item whose file, parameter or kind it was, last the
    /// item that is explained.
    pub chain: Vec<ItemName>,
}

/// The causes that a record needs to contain: those that are not its reasons.
pub(crate) fn worth_keeping(causes: &[Cause]) -> Vec<Cause> {
    if causes.iter().any(|cause| cause.chain.len() > 1) { causes.to_vec() } else { Vec::new() }
}

/// Kind and revision for messages: `project-sh 3`.
pub(crate) fn kind_name(kind: &str, revision: u32) -> String {
    format!("{kind} {revision}")
}

/// Hashes everything that a key depends on; each part is preceded by its length, so that neighbours cannot
/// run together.
pub(crate) struct KeyHasher(blake3::Hasher);

impl KeyHasher {
    pub(crate) fn new(kind: &str, revision: u32, parameters: &str, source: Option<&str>) -> Self {
        let mut hasher = Self(blake3::Hasher::new());
        hasher.number(u64::from(ENGINE_FORMAT)).text(kind).number(u64::from(revision)).text(parameters);
        hasher.number(u64::from(source.is_some())).text(source.unwrap_or_default());
        hasher
    }

    pub(crate) fn text(&mut self, text: &str) -> &mut Self {
        self.number(text.len() as u64);
        self.0.update(text.as_bytes());
        self
    }

    pub(crate) fn number(&mut self, number: u64) -> &mut Self {
        self.0.update(&number.to_le_bytes());
        self
    }

    pub(crate) fn digest(&mut self, digest: Digest) -> &mut Self {
        self.0.update(&digest.0);
        self
    }

    pub(crate) fn item_key(&mut self, key: &ItemKey) -> &mut Self {
        self.number(key.iter().len() as u64);
        for (stage, stem) in key.iter() {
            self.text(stage).text(stem);
        }
        self
    }

    pub(crate) fn finish(&self) -> Digest {
        Digest(*self.0.finalize().as_bytes())
    }
}

/// JSON with sorted keys, so that equal values are equal texts.
pub(crate) fn canonical(value: &Value) -> Value {
    match value {
        Value::Array(values) => values.iter().map(canonical).collect(),
        Value::Object(object) => {
            let mut entries = object.iter().collect::<Vec<_>>();
            entries.sort_unstable_by_key(|(name, _)| *name);
            Value::Object(entries.into_iter().map(|(name, value)| (name.clone(), canonical(value))).collect())
        }
        other => other.clone(),
    }
}

/// The recipe of an exported file: canonical JSON of kind, revision, parameters and, by port, the digests of
/// the direct inputs (one digest, or, for a port that takes many, a list in the order of their keys).
pub(crate) fn recipe(
    kind: &str,
    revision: u32,
    parameters: &Value,
    inputs: &[InputUsed],
    is_many: impl Fn(&str) -> bool,
) -> String {
    let mut ports = Map::new();
    for InputUsed { port, digest, .. } in inputs {
        let digest = Value::from(digest.to_string());
        if is_many(port) {
            let list = ports.entry(port.clone()).or_insert_with(|| Value::Array(Vec::new()));
            if let Value::Array(list) = list {
                list.push(digest);
            }
        } else {
            ports.insert(port.clone(), digest);
        }
    }
    let recipe =
        serde_json::json!({ "kind": kind, "revision": revision, "parameters": parameters, "inputs": ports });
    canonical(&recipe).to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_recipe_is_sorted_and_holds_no_names_of_items() {
        let used = |port: &str, stem: &str| InputUsed {
            port: port.into(),
            item: ItemName { stage: stem.into(), key: ItemKey::default() },
            digest: Digest([0xab; 32]),
        };
        let parameters = serde_json::from_str(r#"{"z":1,"a":{"y":2,"b":null}}"#).unwrap();
        let inputs = [used("one", "x"), used("all", "y"), used("all", "z")];
        let recipe = recipe("export", 3, &parameters, &inputs, |port| port == "all");
        let digest = "ab".repeat(32);
        assert_eq!(
            recipe,
            format!(
                r#"{{"inputs":{{"all":["{digest}","{digest}"],"one":"{digest}"}},"kind":"export","parameters":{{"a":{{"b":null,"y":2}},"z":1}},"revision":3}}"#
            )
        );
    }

    #[test]
    fn parts_of_a_key_do_not_run_together() {
        let key = |kind: &str, parameters: &str| KeyHasher::new(kind, 1, parameters, None).finish();
        assert_ne!(key("ab", "c"), key("a", "bc"));
        assert_ne!(
            KeyHasher::new("a", 1, "", None).finish(),
            KeyHasher::new("a", 1, "", Some("")).finish(),
            "a source without a name is still a source"
        );
    }
}
