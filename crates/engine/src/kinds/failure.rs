//! Why an item has no output.

use std::error::Error;
use std::fmt;

/// Why an item has no output: a chain of messages, first what happened, then its causes.
#[derive(Clone, Debug, PartialEq)]
pub struct Failure {
    /// What happened, then its causes.
    pub chain: Vec<String>,
    /// What to do.
    pub help: Option<String>,
    /// Whether the item was stopped rather than failed.
    pub cancelled: bool,
    /// Whether the system is the cause, not the project: a disk is full, a folder cannot be written.
    pub system_error: bool,
}

impl Failure {
    /// A failure with one message: what happened, where, what was expected.
    pub fn new(message: impl Into<String>) -> Self {
        Self { chain: vec![message.into()], help: None, cancelled: false, system_error: false }
    }

    /// The failure of an item that was stopped.
    pub fn cancelled() -> Self {
        Self { cancelled: true, ..Self::new("cancelled") }
    }

    /// Puts a message before the chain: where it happened, or what was being done.
    #[must_use]
    pub fn context(mut self, message: impl Into<String>) -> Self {
        self.chain.insert(0, message.into());
        self
    }

    /// Adds what to do.
    #[must_use]
    pub fn help(mut self, help: impl Into<String>) -> Self {
        self.help = Some(help.into());
        self
    }

    /// Marks the system as the cause, not the project: for an error of the scratch folder, which the item
    /// created itself, or of starting a thread; not for an error of a file that the project names.
    #[must_use]
    pub fn system_error(mut self) -> Self {
        self.system_error = true;
        self
    }
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.chain.join(": "))
    }
}

impl<E: Error> From<E> for Failure {
    fn from(error: E) -> Self {
        let mut chain = vec![error.to_string()];
        let mut source = error.source();
        while let Some(cause) = source {
            chain.push(cause.to_string());
            source = cause.source();
        }
        Self { chain, help: None, cancelled: false, system_error: false }
    }
}
