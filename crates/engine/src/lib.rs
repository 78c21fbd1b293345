//! An incremental, content-addressed build of a graph of stages. It knows nothing of light.
//!
//! A *manifest* names *stages*; each has a *kind* (code that implements [`Kind`]), inputs and parameters.
//! [`Plan`] turns a manifest and the files that it matches into *items*; the scheduler runs those that are
//! out of date and publishes what they export. Everything that happens is reported as an [`Event`].

mod artifact;
mod broken_link;
mod build;
pub mod cache;
mod cancel;
mod cause;
mod check_sources;
mod choice;
mod context;
mod determinism;
mod diagnostic;
mod disk;
mod document;
mod error;
mod event;
mod executor;
mod explain;
mod failure;
mod files;
mod gate;
mod item_request;
mod journal;
mod key;
mod kind;
mod ledger;
mod lock;
mod memory;
mod names_in_out;
mod out_folder;
mod own_time;
mod parallel;
mod parameters;
mod plan;
mod platform;
mod programs;
mod progress;
mod prune;
mod publish;
mod range;
mod reader;
mod record;
mod regular;
mod removal_cause;
mod retention;
mod run;
mod run_elsewhere;
mod run_item;
mod running;
mod scheduler;
mod selection;
mod session;
mod shared_blob;
mod shared_cache;
mod shared_results;
mod snapshot;
mod spelling;
mod state;
mod steps;
mod store;
#[cfg(test)]
mod testkit;
#[cfg(test)]
mod tests;
mod timestamp;
mod up_to_date;
mod verify;
mod wanted;
mod watch;
mod writers;

pub use artifact::{Artifact, Handle};
pub use broken_link::BrokenLink;
pub use build::{BuildOptions, build};
pub use cancel::Cancel;
pub use check_sources::{SourceError, check_sources};
pub use choice::Choice;
pub use context::Context;
pub use determinism::{Determinism, Difference, FailedRun, default_threads, determinism};
pub use diagnostic::{Diagnostic, Diagnostics, line_and_column};
pub use document::{Document, Entry, Table, Value, ValueKind};
pub use error::{Error, ErrorKind};
pub use event::{Change, Changed, Event, EventLine, ItemName, Reason, RemovalCause, Summary, Work};
pub use executor::{Executor, ExecutorOptions, InputFile, Place, RemoteEnd, RemoteError, RemoteRun};
pub use explain::{Explanation, ExportedFile, FileState, InputOrigin, LastRun, explain};
pub use failure::Failure;
pub use files::{Files, OpenFile, Read, ReadKind};
pub use key::{Digest, ItemKey};
pub use kind::{
    Configured, ErasedKind, Kind, Kinds, LEFT_OUT, MapSizes, NamedPath, Output, Port, Product, RecipeReader,
};
pub use lock::{LockPurpose, LockTimeout};
pub use names_in_out::names_in_out;
pub use parameters::{Field, Parameter, Parameters, unexpected, unknown_keys};
pub use plan::{
    DiskFolders, Folders, Found, Graph, Item, ItemIndex, ManifestFile, Name, Plan, Source, Stage, StageIndex,
};
pub use prune::{Pruned, prune};
pub use range::{Number, OrAuto, Range, Ranged};
pub use record::{Cause, FileRead, FromCache, InputUsed};
pub use regular::{read_file, replace_file};
pub use run_item::run_item;
pub use session::{BuildSession, WORKER};
pub use shared_blob::SharedBlob;
pub use shared_cache::{
    Question, SharedCache, SharedCacheOptions, SharedOrigin, SharedResult, Traffic, Trouble, Upload,
    UploadOutputs,
};
pub use snapshot::ResultsSnapshot;
pub use spelling::nearest;
pub use state::prepare_state_folder;
pub use steps::Steps;
pub use timestamp::Timestamp;
pub use verify::{
    Content, FilesToVerify, MissingFile, Origin, OutVerification, Recipe, SourceFile, Verification, verify,
    verify_out,
};
pub use wanted::Wanted;
pub use watch::{WatchOptions, watch};

#[doc(hidden)]
pub use serde_json;
