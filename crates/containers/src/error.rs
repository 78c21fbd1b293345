//! The one error of this crate: a kind, what happened, and where.

use std::fmt;

use sh::Stopped;

/// The kind of an error: of the bytes, or of the request.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum ErrorKind {
    /// The file has no bytes.
    Empty,
    /// The file is a Git LFS pointer to what it should be.
    GitLfsPointer,
    /// The content is not in a format that is read here.
    UnknownFormat,
    /// The bytes end before the data does.
    Truncated,
    /// The bytes contradict themselves or the format.
    Damaged,
    /// The declared size is over the limit, or more than the bytes can hold.
    TooLarge,
    /// The file is sound but uses something that is not read here.
    Unsupported,
    /// The file has no layer of the wanted name.
    NoSuchLayer,
    /// The file has no material of the wanted name, or several and no name was given.
    NoSuchMaterial,
    /// The value cannot be written in this format.
    Unwritable,
    /// The reading was stopped by its caller.
    Stopped,
}

/// Why bytes could not be read or written: a kind, what happened and, outermost first, where.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Error {
    kind: ErrorKind,
    message: String,
    context: Vec<String>,
}

impl Error {
    pub(crate) fn new(kind: ErrorKind, message: impl Into<String>) -> Self {
        Self { kind, message: message.into(), context: Vec::new() }
    }

    pub(crate) fn stopped(stopped: Stopped) -> Self {
        Self::new(ErrorKind::Stopped, stopped.to_string())
    }

    pub(crate) fn truncated(message: impl Into<String>) -> Self {
        Self::new(ErrorKind::Truncated, message)
    }

    pub(crate) fn damaged(message: impl Into<String>) -> Self {
        Self::new(ErrorKind::Damaged, message)
    }

    pub(crate) fn unsupported(message: impl Into<String>) -> Self {
        Self::new(ErrorKind::Unsupported, message)
    }

    /// Returns the error as one that happened in `place`.
    #[must_use]
    pub fn within(mut self, place: impl Into<String>) -> Self {
        self.context.push(place.into());
        self
    }

    /// The kind of this error.
    pub fn kind(&self) -> ErrorKind {
        self.kind
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for place in self.context.iter().rev() {
            write!(f, "{place}: ")?;
        }
        f.write_str(&self.message)
    }
}

impl std::error::Error for Error {}
