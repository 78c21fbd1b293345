//! What other machines offer to a build: results that they made, and runs. Traits only; crate `remote` has
//! them.

mod executor;
mod shared_blob;
mod shared_cache;

pub use executor::{Executor, ExecutorOptions, InputFile, Place, RemoteEnd, RemoteError, RemoteRun};
pub use shared_blob::SharedBlob;
pub(crate) use shared_cache::Shared;
pub use shared_cache::{
    Question, SharedCache, SharedCacheOptions, SharedOrigin, SharedResult, Traffic, Trouble, Upload,
    UploadOutputs,
};
