//! What is sent to another machine that runs an item, and what comes back.
//!
//! The machine finds a folder with `item.json` (an [`ItemRequest`]), the input artifacts in `artifacts/`
//! under their digests, and the files that the item may read: those of the manifest's folder under their own
//! names in `files/`, others in `elsewhere/`. It leaves `outputs/report.json` (an [`ItemReport`]) and the
//! outputs `outputs/0`, `outputs/1` and so on. Equal requests are equal bytes, whoever makes them: nothing in
//! them names a machine, a person or a time.

use std::path::{Component, Path};

use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::key::{Digest, ItemKey};
use crate::storage::{Blob, FileRead, ReadKind};

/// To be raised when a request or report would be misunderstood by other versions.
pub(crate) const FORMAT: u32 = 2;

/// The places of the description, of the files that it reads and of the report in an item's folder.
pub(crate) const ITEM: &str = "item.json";
pub(crate) const FILES: &str = "files";
pub(crate) const REPORT: &str = "outputs/report.json";

pub(crate) fn artifact_place(digest: Digest) -> String {
    format!("artifacts/{digest}")
}

pub(crate) fn output_place(index: usize) -> String {
    format!("outputs/{index}")
}

/// The place of a file that the item reads under this name, which is that of records.
pub(crate) fn file_place(name: &str) -> String {
    let path = Path::new(name);
    let is_inside = path.components().all(|part| matches!(part, Component::Normal(_)));
    if is_inside && !name.is_empty() {
        return format!("{FILES}/{name}");
    }
    let folder = Digest::of(name.as_bytes()).to_string();
    let file = path.file_name().map_or_else(|| "file".into(), |file| file.to_string_lossy());
    format!("elsewhere/{}/{file}", &folder[..16])
}

#[derive(Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct ItemRequest {
    pub(crate) format: u32,
    /// The version of the program: a run needs the same.
    pub(crate) version: String,
    pub(crate) kind: String,
    pub(crate) revision: u32,
    /// The parameters as the manifest has them: TOML.
    pub(crate) parameters: String,
    /// The parameters with defaults filled in, to be compared with what the other machine makes of them.
    pub(crate) canonical: Value,
    pub(crate) inputs: Vec<PortInputs>,
    /// The item's key, for a kind that shows names.
    pub(crate) key: Option<ItemKey>,
    pub(crate) source: Option<String>,
    /// The folder for exports, of which the item reads nothing.
    pub(crate) out: String,
    /// The processor, for a kind whose results depend on it.
    pub(crate) processor: Option<String>,
    /// The recipe, for a kind that exports files.
    pub(crate) recipe: Option<String>,
    /// The files that the item may read, sorted by name.
    pub(crate) files: Vec<KnownFile>,
    /// The folders whose names the item may read.
    pub(crate) folders: Vec<KnownFolder>,
}

#[derive(Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct PortInputs {
    pub(crate) port: String,
    pub(crate) items: Vec<InputArtifact>,
}

#[derive(Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct InputArtifact {
    /// The key of the item that made the artifact, for a kind that shows names; otherwise empty.
    pub(crate) key: ItemKey,
    #[serde(rename = "type")]
    pub(crate) type_name: String,
    pub(crate) digest: Digest,
}

/// A file that the item may read.
#[derive(Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct KnownFile {
    pub(crate) name: String,
    /// The digest of the file's content; `None` if it does not exist.
    pub(crate) digest: Option<Digest>,
}

/// A folder whose names the item may read.
#[derive(Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct KnownFolder {
    pub(crate) name: String,
    /// The names in the folder, each with whether it is a folder; `None` if the folder does not exist.
    pub(crate) entries: Option<Vec<(String, bool)>>,
}

#[derive(Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct ItemReport {
    pub(crate) end: ItemEnd,
    pub(crate) milliseconds: f64,
    pub(crate) warnings: Vec<String>,
    pub(crate) notes: Vec<String>,
    pub(crate) reads: Vec<FileRead>,
}

#[derive(Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum ItemEnd {
    Made(Vec<Blob>),
    /// The item reads what was not sent: the names of files and folders, and what is asked of each.
    Needs(Vec<(String, ReadKind)>),
    Failed {
        chain: Vec<String>,
        help: Option<String>,
        /// Whether the machine is the cause, not the item.
        system_error: bool,
    },
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_stay_in_the_folder_of_the_run() {
        assert_eq!(file_place("maps/sky.exr"), "files/maps/sky.exr");
        for name in ["../sky.exr", "/library/sky.exr", "maps/../../sky.exr", "", "/"] {
            let place = file_place(name);
            assert!(place.starts_with("elsewhere/") && !place.contains(".."), "{name:?}: {place}");
        }
        assert!(file_place("/library/sky.exr").ends_with("/sky.exr"));
        assert_ne!(file_place("/a/sky.exr"), file_place("/b/sky.exr"));
    }
}
