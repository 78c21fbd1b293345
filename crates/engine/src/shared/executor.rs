//! Other machines that run items, as the engine sees them: a trait of a few calls. Crate `remote` implements
//! it for servers of the Remote Execution API.

use std::fmt::Debug;
use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::shared_blob::SharedBlob;

/// A file that a program finds in its folder.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct InputFile {
    /// Its place in the folder, with `/` between folders, without `.` and `..`.
    pub path: String,
    /// Its content.
    pub blob: SharedBlob,
    /// Whether it is a program.
    pub is_program: bool,
}

/// A run of Specula on another machine, in a folder of its own.
pub struct RemoteRun<'a> {
    /// Specula's arguments.
    pub arguments: Vec<String>,
    /// The files of the folder, beside the program itself.
    pub files: Vec<InputFile>,
    /// Reads the content of one of these files, in case the server does not have it; `None` if it is gone, or
    /// has changed.
    pub read: &'a (dyn Fn(usize) -> Option<Vec<u8>> + Sync),
    /// The files that it makes, as places in its folder. It may leave out some of them.
    pub outputs: Vec<String>,
    /// What the machine must be, such as `("container-image", "docker://...")`.
    pub properties: Vec<(String, String)>,
    /// Whether it has to run, even if the server knows what it made before.
    pub is_fresh: bool,
}

/// What a run on another machine left.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RemoteEnd {
    /// What it made of [`RemoteRun::outputs`], in order.
    pub outputs: Vec<Option<SharedBlob>>,
    /// Its exit code.
    pub exit_code: i32,
    /// The end of what it wrote to standard error.
    pub message: String,
    /// The machine, as far as the server names it.
    pub worker: String,
    /// Whether the server knew what it makes, and nothing ran.
    pub is_known: bool,
}

/// Why there is no run.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum RemoteError {
    /// It was asked to stop.
    Stopped,
    /// Its files are too large to be sent.
    TooLarge(String),
    /// The content of this input could not be read any more.
    InputGone(usize),
    /// The server or its workers cannot run it.
    Impossible(String),
}

/// Machines that run items. Calls block; they come from several threads at once.
pub trait Executor: Debug + Send + Sync {
    /// Where the server is, for messages: `cluster.studio:8980`.
    fn host(&self) -> String;

    /// Whether the server can be used at present.
    fn is_available(&self) -> bool;

    /// Why the server cannot be used, if that was not asked before.
    fn trouble(&self) -> Option<String>;

    /// The name of bytes on the server.
    fn blob(&self, bytes: &[u8]) -> SharedBlob;

    /// Runs Specula on another machine. The server stops it soon after `stop` returns true.
    ///
    /// # Errors
    /// If it did not run to its end. A run that fails is none.
    fn run(&self, run: &RemoteRun<'_>, stop: &dyn Fn() -> bool) -> Result<RemoteEnd, RemoteError>;
}

/// How a build lets other machines run its items.
#[derive(Clone, Debug)]
pub struct ExecutorOptions {
    /// The machines.
    pub executor: Arc<dyn Executor>,
    /// How many items run there at a time.
    pub jobs: usize,
    /// An item that reads more bytes of files runs here.
    pub most_bytes: u64,
}

/// Where an item ran, in a build that lets items run elsewhere.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Place {
    /// Here.
    Here {
        /// Why.
        because: String,
    },
    /// On another machine.
    Worker {
        /// The server that had it run.
        host: String,
        /// The machine, if the server names it.
        name: String,
    },
}
