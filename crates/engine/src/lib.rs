//! An incremental, content-addressed build of a graph of stages. It knows nothing of light.
//!
//! A *manifest* names *stages*; each has a *kind* (code that implements [`Kind`]), inputs and parameters.
//! [`Plan`] turns a manifest and the files that it matches into *items*; the scheduler runs those that are
//! out of date and publishes what they export. Everything that happens is reported as an [`Event`].

mod answers;
mod build;
mod cancel;
mod error;
mod event;
mod key;
mod kinds;
mod manifest;
mod own_time;
mod parallel;
mod plan;
mod platform;
mod shared;
mod storage;
#[cfg(test)]
mod testkit;
#[cfg(test)]
mod tests;
mod timestamp;
mod watch;

pub use answers::{
    ContentState, Determinism, Difference, Explanation, ExportedFile, FailedRun, FileState, FilesToVerify,
    InputOrigin, LastRun, MissingFile, Origin, OutVerification, Pruned, RecipeState, ResultsSnapshot,
    SourceError, SourceFile, Verification, check_sources, default_threads, determinism, explain, prune,
    verify, verify_out,
};
pub use build::{BuildOptions, BuildSession, WORKER, build, run_item};
pub use cancel::Cancel;
pub use error::{Error, ErrorKind};
pub use event::{Change, Changed, Event, EventLine, ItemName, Reason, RemovalCause, Summary, Work};
pub use key::{Digest, ItemKey};
pub use kinds::{
    Artifact, Configured, Context, DerivedValues, ErasedKind, ExportedFiles, Failure, Handle, Inputs,
    ItemFiles, Kind, Kinds, NamedPath, Output, Port, Product, RecipeReader, Reporter, Steps,
    stands_for_no_file,
};
pub use manifest::{
    Choice, Diagnostic, Diagnostics, Document, Entry, Field, Number, OrAuto, Parameter, Parameters, Range,
    Ranged, Table, Value, ValueKind, line_and_column, nearest, unexpected, unknown_keys, unknown_parameters,
};
pub use plan::{
    DiskFolders, Folders, Found, Graph, Item, ItemIndex, ManifestFile, Name, Plan, Source, Stage, StageIndex,
    Wanted, names_in_out,
};
pub use platform::{canonicalize, path_text};
pub use shared::{
    Executor, ExecutorOptions, InputFile, Place, Question, RemoteEnd, RemoteError, RemoteRun, SharedBlob,
    SharedCache, SharedCacheOptions, SharedOrigin, SharedResult, Traffic, Trouble, Upload, UploadOutputs,
};
pub use storage::{
    BrokenLink, Cause, FileRead, Files, FromCache, InputUsed, LockPurpose, LockTimeout, OpenFile, Read,
    ReadKind, prepare_state_folder, read_file, replace_file,
};
pub use timestamp::Timestamp;
pub use watch::{WatchOptions, watch};

pub use answers::cache;
#[doc(hidden)]
pub use serde_json;
