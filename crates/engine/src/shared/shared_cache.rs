//! A cache of results that several machines share, as the engine sees it: a trait of a few calls. Crate
//! `remote` implements it for servers of the Remote Execution API.

use std::fmt::Debug;
use std::path::PathBuf;
use std::sync::Arc;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::executor::ExecutorOptions;
use super::shared_blob::SharedBlob;

/// The result that is stored under an action.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SharedResult {
    /// The engine's description of the result.
    pub description: Vec<u8>,
    /// The outputs, in order.
    pub outputs: Vec<SharedBlob>,
}

/// A question for the result of an item.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Question {
    /// The item, among those of its list.
    pub item: String,
    /// The action under which the result is stored.
    pub action: Vec<u8>,
}

/// A result to store. Its outputs are read when they are sent, so that few are in memory at a time.
pub struct Upload {
    /// The list that the item belongs to, as in [`SharedCache::find`].
    pub list: Vec<u8>,
    /// The item, among those of the list.
    pub item: String,
    /// The actions and what is stored under each; the last one has the outputs.
    pub entries: Vec<(Vec<u8>, Vec<u8>)>,
    /// The outputs of the result.
    pub outputs: UploadOutputs,
}

/// The outputs of a result to store.
pub enum UploadOutputs {
    /// The outputs are on this machine.
    Here {
        /// The number of outputs.
        count: usize,
        /// Reads the output of an index; `None` if it is gone.
        read: Box<dyn Fn(usize) -> Option<Vec<u8>> + Send>,
    },
    /// The outputs are on the server, which made them.
    There(Vec<SharedBlob>),
}

/// What a build had of the cache.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, JsonSchema)]
pub struct Traffic {
    /// The calls made.
    pub calls: u64,
    /// The bytes of outputs received.
    pub received: u64,
    /// The bytes of outputs sent.
    pub sent: u64,
}

/// A cache on another machine. Calls block; they come from several threads at once.
///
/// An implementation that cannot reach its server answers as an empty cache would, and says why in
/// [`SharedCache::trouble`].
pub trait SharedCache: Debug + Send + Sync {
    /// Where the cache is, for messages: `cache.studio:8980`.
    fn host(&self) -> String;

    /// The result that is stored under each action; `None` if none is. `list` names what the items have in
    /// common, so that an implementation may find many results at once.
    fn find(&self, list: &[u8], questions: &[Question]) -> Vec<Option<SharedResult>>;

    /// Reads blobs, and gives each to `each` with its index, in any order and few at a time; `None` if it is
    /// not there any more. Stops early once `each` returns false.
    fn read(&self, blobs: &[SharedBlob], each: &mut dyn FnMut(usize, Option<Vec<u8>>) -> bool);

    /// Stores a result, at some time before [`SharedCache::finish`] returns.
    fn store(&self, upload: Upload);

    /// Waits for what is still to be sent, unless `stop` returns true. Returns the traffic since the last
    /// call.
    fn finish(&self, stop: &dyn Fn() -> bool) -> Traffic;

    /// The first trouble since the last call, if there was any.
    fn trouble(&self) -> Option<Trouble>;
}

/// A trouble with a cache.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Trouble {
    /// What happened.
    pub message: String,
    /// Whether the cache is not used any more.
    pub is_lost: bool,
}

/// How a build uses a shared cache.
#[derive(Clone, Debug)]
pub struct SharedCacheOptions {
    /// The cache.
    pub cache: Arc<dyn SharedCache>,
    /// The version of the program: one of another version finds none of our results.
    pub version: String,
    /// The name of this machine, for those who use its results.
    pub machine: String,
    /// Whether everything that is found is received; if not, only what this build needs.
    pub download_all: bool,
    /// Whether a build without the cache is an error.
    pub is_required: bool,
    /// The machines that run items; `None`: all run here.
    pub executor: Option<ExecutorOptions>,
    /// The folders of programs (PATH), which items read beside the files of the project.
    pub programs: Vec<PathBuf>,
}

/// The place of the outputs of a record that came from a shared cache.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Shared {
    pub(crate) host: String,
    /// The machine that made the outputs.
    pub(crate) machine: String,
    pub(crate) blobs: Vec<SharedBlob>,
}

impl Shared {
    /// The origin of the outputs, for people.
    pub(crate) fn origin(&self) -> SharedOrigin {
        SharedOrigin { host: self.host.clone(), machine: self.machine.clone() }
    }
}

/// The shared cache that a result came from.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct SharedOrigin {
    /// The cache: `cache.studio:8980`.
    pub host: String,
    /// The machine whose run made the result.
    pub machine: String,
}
