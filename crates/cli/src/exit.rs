//! Exit codes: a build script reads them.

use std::process::ExitCode;

/// How a command ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Exit {
    /// 0: the command did what it was asked to do.
    Success = 0,
    /// 1: items failed, and their last good outputs stay; or a check found a source with errors, damage in
    /// the cache, a stale or altered file, or outputs that differ.
    Failed = 1,
    /// 2: the command line is not valid, or names something that does not exist.
    Usage = 2,
    /// 3: the manifest or `specula.toml` has errors, or the manifest does not exist; nothing ran.
    Manifest = 3,
    /// 4: a system error: a folder that cannot be written, a full disk, another process at work in the
    /// folder, no display for a window. This code wins if items failed for other reasons too.
    System = 4,
    /// 130: stopped by Ctrl-C. Ctrl-C is the usual end of `watch` and of the preview's window: they exit with
    /// 0.
    Interrupted = 130,
}

impl Exit {
    /// The table for `--help`.
    pub(crate) const HELP: &'static str = "Exit codes:
  0    success
  1    items failed, and their last good outputs stay; or a check found a source with errors,
       damage, a stale or altered file, or outputs that differ
  2    the command line is not valid, or names something that does not exist
  3    the manifest or specula.toml has errors, or the manifest does not exist; nothing
       ran
  4    a system error, even if items failed for other reasons too: a folder that cannot be
       written, a full disk, another process at work, no display
  130  stopped by Ctrl-C; watch and the preview's window exit with 0 instead";
}

impl From<Exit> for ExitCode {
    fn from(exit: Exit) -> Self {
        Self::from(exit as u8)
    }
}
