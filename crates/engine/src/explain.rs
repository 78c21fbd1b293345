//! Why an item would run or not, and what its last run did.

use serde::Serialize;

use crate::{Digest, Error, ItemName, Plan, Reason, Timestamp};

/// What is known about one item.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Explanation {
    /// The item.
    pub item: ItemName,
    /// Whether a build would run it now.
    pub would_run: bool,
    /// Why it would run: every difference from its last run. Empty where it would not.
    pub reasons: Vec<Reason>,
    /// What made the present result, or the failure of the last run; `None` where it never ran.
    pub last: Option<LastRun>,
    /// The files that it exports.
    pub files: Vec<ExportedFile>,
}

/// What a run did.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LastRun {
    /// When it began.
    pub started: Timestamp,
    /// How long it took.
    pub milliseconds: f64,
    /// The kind and its revision: `project-sh 3`.
    pub kind: String,
    /// Why it ran.
    pub reasons: Vec<Reason>,
    /// What it warned of.
    pub warnings: Vec<String>,
    /// What it noted.
    pub notes: Vec<String>,
    /// The artifacts that arrived.
    pub inputs: Vec<InputUsed>,
    /// The files and listings that it read.
    pub reads: Vec<FileRead>,
    /// Its parameters with defaults filled in, kind, revision and input digests: canonical JSON, as exported files
    /// hold it.
    pub recipe: String,
    /// The digests of its outputs; empty where it failed.
    pub results: Vec<Digest>,
    /// What happened and its causes, where it failed.
    pub failure: Option<Vec<String>>,
}

/// An artifact that a run used.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct InputUsed {
    /// The port where it arrived.
    pub port: String,
    /// The item that made it.
    pub item: ItemName,
    /// Its digest.
    pub digest: Digest,
}

/// A file or folder that a run read.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FileRead {
    /// The path, relative to the manifest's folder where it lies inside.
    pub path: String,
    /// Whether the names in a folder were read, not a file's content.
    pub listing: bool,
    /// The digest of what was read; `None` where it was looked for and not there.
    pub digest: Option<Digest>,
}

/// A file in `out`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ExportedFile {
    /// The path relative to `out`.
    pub file: String,
    /// The digest of what was published there last; `None` where nothing was.
    pub digest: Option<Digest>,
    /// Whether the file is there as it was published.
    pub intact: bool,
}

/// Explains the items of a stage, or the item that exports a file.
///
/// `target` is a stage's name, or a file of `out`: relative to `out`, relative to the current folder, or absolute.
/// Nothing is written, and a build may be at work.
///
/// # Errors
/// Where there is no such stage or file, or the records cannot be read.
pub fn explain(plan: &Plan, target: &str) -> Result<Vec<Explanation>, Error> {
    let _ = (plan, target);
    Err(Error::new(crate::ErrorKind::Io, "not written yet"))
}
