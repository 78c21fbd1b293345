//! Errors of a whole build, as opposed to one item: the state folder, the lock, the disk, the request itself.

use std::fmt;
use std::io;
use std::path::Path;

use crate::platform::{HeldOpen, MarkedReadOnly, path_text};

/// What went wrong, for exit codes and tests.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum ErrorKind {
    /// The state folder `.specula` is not what it should be.
    BadState,
    /// The state folder was written by a newer version.
    NewerState,
    /// Another process has the state folder locked.
    Locked,
    /// The command was cancelled while it waited for another process.
    Cancelled,
    /// A requested stage or file does not exist.
    UnknownTarget,
    /// A file or folder that was not published is in the place of one that has to be.
    FileInTheWay,
    /// The disk, or the user's share of it, is full.
    DiskFull,
    /// A path that has to be written is read-only or not permitted.
    ReadOnly,
    /// Any other error of the file system.
    Io,
}

impl ErrorKind {
    /// Whether the system is the cause, not the project or the request, so that the same build may succeed
    /// later.
    pub(crate) fn is_of_system(self) -> bool {
        match self {
            Self::BadState | Self::NewerState | Self::Locked | Self::DiskFull | Self::ReadOnly | Self::Io => {
                true
            }
            Self::Cancelled | Self::UnknownTarget | Self::FileInTheWay => false,
        }
    }
}

/// Why a build or an explanation failed: a kind, a chain of messages and what to do.
#[derive(Clone, Debug, PartialEq)]
pub struct Error {
    kind: ErrorKind,
    chain: Vec<String>,
    help: Option<String>,
}

impl Error {
    pub(crate) fn new(kind: ErrorKind, message: impl Into<String>) -> Self {
        Self { kind, chain: vec![message.into()], help: None }
    }

    /// The error of a file operation: what was to be done, with which path, and the system's message.
    pub(crate) fn io(error: &io::Error, doing: &str, path: &Path) -> Self {
        let kind = classify(error);
        let help = match kind {
            _ if is::<MarkedReadOnly>(error) => {
                Some("check it out of version control, or remove its read-only mark, and build again")
            }
            _ if is::<HeldOpen>(error) => Some("close the file in that program, and build again"),
            ErrorKind::DiskFull => {
                Some("free some space on that disk and build again; the earlier outputs are intact")
            }
            ErrorKind::ReadOnly => Some("make the folder writable, or build in a copy of the project"),
            _ => None,
        };
        let cause = match error.kind() {
            _ if kind == ErrorKind::DiskFull => format!("the disk is full: {error}"),
            io::ErrorKind::ReadOnlyFilesystem => format!("the folder is read-only: {error}"),
            _ => error.to_string(),
        };
        let chain = vec![format!("cannot {doing} {}", path_text(path)), cause];
        Self { kind, chain, help: help.map(str::to_owned) }
    }

    #[must_use]
    pub(crate) fn because(mut self, cause: impl Into<String>) -> Self {
        self.chain.push(cause.into());
        self
    }

    #[must_use]
    pub(crate) fn with_help(mut self, help: impl Into<String>) -> Self {
        self.help = Some(help.into());
        self
    }

    /// What went wrong.
    pub fn kind(&self) -> ErrorKind {
        self.kind
    }

    /// What happened, then its causes.
    pub fn chain(&self) -> &[String] {
        &self.chain
    }

    /// What to do.
    pub fn help(&self) -> Option<&str> {
        self.help.as_deref()
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.chain.join(": "))
    }
}

impl std::error::Error for Error {}

/// Whether an error of the system was made from this one.
fn is<E: std::error::Error + 'static>(error: &io::Error) -> bool {
    error.get_ref().is_some_and(|inner| inner.is::<E>())
}

fn classify(error: &io::Error) -> ErrorKind {
    match error.kind() {
        io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded => ErrorKind::DiskFull,
        io::ErrorKind::ReadOnlyFilesystem | io::ErrorKind::PermissionDenied => ErrorKind::ReadOnly,
        _ => ErrorKind::Io,
    }
}
