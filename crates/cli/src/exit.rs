//! Exit codes: a build script reads them.

use std::process::ExitCode;

use engine::{Error, ErrorKind};

use crate::print;

/// How a command ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Exit {
    /// 0: everything that was asked for is there.
    Success = 0,
    /// 1: not all is as it should be: items failed, and their last good outputs stay; or a check found damage in the
    /// cache, a file that is stale or altered, outputs that differ.
    Failed = 1,
    /// 2: the command line cannot be understood, or names something that is not there.
    Usage = 2,
    /// 3: the manifest has errors or does not exist; nothing ran.
    Manifest = 3,
    /// 4: a system error: a folder that cannot be written, a full disk, another process at work there, no display for
    /// a window. Also where items failed because of one, whatever else failed.
    Machine = 4,
    /// 130: stopped by Ctrl-C. For `watch` and the window of `preview` that is the usual end, and 0.
    Interrupted = 130,
}

impl Exit {
    /// The table for `--help`.
    pub(crate) const HELP: &'static str = "Exit codes:
  0    everything that was asked for is there
  1    items failed, and their last good outputs stay; or a check found damage, a stale or
       altered file, or outputs that differ
  2    the command line cannot be understood, or names something that is not there
  3    the manifest has errors or does not exist; nothing ran
  4    a system error, whatever else failed: unwritable folder, full disk, another process at
       work, no display
  130  stopped by Ctrl-C; watch and a preview's window end so with 0";
}

impl From<Exit> for ExitCode {
    fn from(exit: Exit) -> Self {
        Self::from(exit as u8)
    }
}

/// Prints what stopped a whole command, and gives its exit code.
pub(crate) fn of_error(error: &Error) -> Exit {
    print::error(error.chain(), error.help());
    match error.kind() {
        ErrorKind::UnknownTarget => Exit::Usage,
        _ => Exit::Machine,
    }
}
