//! What is asked of a manifest beside building it: why an item ran, whether results hold, what the cache
//! has.

pub mod cache;
mod check_sources;
mod determinism;
mod explain;
mod prune;
mod snapshot;
mod verify;

pub use check_sources::{SourceError, check_sources};
pub use determinism::{Determinism, Difference, FailedRun, default_threads, determinism};
pub use explain::{Explanation, ExportedFile, FileState, InputOrigin, LastRun, explain};
pub use prune::{Pruned, prune};
pub use snapshot::ResultsSnapshot;
pub use verify::{
    ContentState, FilesToVerify, MissingFile, Origin, OutVerification, RecipeState, SourceFile, Verification,
    verify, verify_out,
};
