//! Other machines that run items, as the engine sees them: a trait of a few calls. Crate `remote` implements
//! it for servers of the Remote Execution API.

use std::fmt::Debug;
use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::shared_blob::SharedBlob;

/// A file that a program finds in its folder.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct InputFile {
    /// The file's place in the folder, with `/` between folders, without `.` and `..`.
    pub path: String,
    /// The file's content.
    pub blob: SharedBlob,
    /// Whether the file is a program.
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
    /// The files that the run makes, as places in its folder. It may leave out some of them.
    pub outputs: Vec<String>,
    /// The properties that the machine must have, such as `("container-image", "docker://...")`.
    pub properties: Vec<(String, String)>,
    /// Whether the program has to run, even if the server knows what it made before.
    pub is_fresh: bool,
}

/// The result of a run on another machine.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RemoteEnd {
    /// The files of [`RemoteRun::outputs`], in order; `None` for each that the run did not make.
    pub outputs: Vec<Option<SharedBlob>>,
    /// The exit code of the run.
    pub exit_code: i32,
    /// The end of what the run wrote to standard error.
    pub message: String,
    /// The machine, as far as the server names it.
    pub worker: String,
    /// Whether the server knew the result, and nothing ran.
    pub is_known: bool,
}

/// Why there is no run.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum RemoteError {
    /// The run was asked to stop.
    Stopped,
    /// The files of the run are too large to be sent.
    TooLarge(String),
    /// The content of this input could not be read any more.
    InputGone(usize),
    /// The server or its workers cannot run the program.
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
    /// How many items run on the machines at a time.
    pub jobs: usize,
    /// The most bytes of files that an item on another machine reads; one that reads more runs here.
    pub most_bytes: u64,
}

/// Where an item ran, in a build that lets items run elsewhere.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Place {
    /// The item ran on the machine of the build.
    Here {
        /// Why the item ran on the machine of the build.
        because: String,
    },
    /// The item ran on another machine.
    Worker {
        /// The server that had it run.
        host: String,
        /// The machine, if the server names it.
        name: String,
    },
}
