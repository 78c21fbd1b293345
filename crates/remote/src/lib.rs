//! The cache that machines share, on a server of Bazel's Remote Execution API: BuildBuddy, Buildbarn,
//! NativeLink, BuildGrid, buildbox-casd.
//!
//! [`RemoteCache`] is the engine's [`engine::SharedCache`]. An action of the engine becomes a `Command` whose
//! last argument is the action's text, and an `Action` with that command and an empty input root; the digest
//! of the `Action` finds an `ActionResult` with the engine's description in `stdout_raw` and the outputs as
//! files named `0`, `1` and so on.
//!
//! [`RemoteExecutor`] is the engine's [`engine::Executor`]: an item runs on a worker of the server as
//! `specula run-item item.json`, in an input root that has everything that it needs.
//!
//! Many calls are in flight at once. Blobs of up to [`BATCH`] bytes together share a call; larger ones are
//! streams, compressed by Zstandard if the server offers that. Every blob's SHA-256 is checked.
//!
//! The first error that is not an answer ends all use of the server for a minute, and
//! [`engine::SharedCache::trouble`] says it once: a build never waits for a server that does not answer more
//! than its time limit and its retries. If the server is full or refuses to store, results are still found,
//! and none is stored.

#![cfg(feature = "client")]

mod address;
mod blobs;
mod cache;
mod connection;
mod executor;
mod lists;
mod options;
mod protocol;
mod sending;
mod uploader;

pub use address::{Address, AddressError};
pub use blobs::BATCH;
pub use cache::RemoteCache;
pub use connection::ConnectionError;
pub use executor::{Program, RemoteExecutor};
pub use options::{RemoteOptions, TlsFiles, UploadChoice};
