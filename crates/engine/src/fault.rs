//! What is wrong with a manifest or a material file: every fault with its place, expectation and remedy.

use std::ops::Range;

/// One fault of a text file.
#[derive(Clone, Debug, PartialEq)]
pub struct Fault {
    /// What is wrong, in one sentence without a full stop.
    pub message: String,
    /// The place: byte range in the text.
    pub span: Option<Range<usize>>,
    /// What was expected there, shown at the place.
    pub expected: Option<String>,
    /// What to do, for example the nearest spelling.
    pub help: Option<String>,
}

impl Fault {
    /// A fault at a place.
    pub fn at(span: Range<usize>, message: impl Into<String>) -> Self {
        Self { message: message.into(), span: Some(span), expected: None, help: None }
    }

    /// Adds what was expected.
    #[must_use]
    pub fn expected(mut self, expected: impl Into<String>) -> Self {
        self.expected = Some(expected.into());
        self
    }

    /// Adds what to do.
    #[must_use]
    pub fn help(mut self, help: impl Into<String>) -> Self {
        self.help = Some(help.into());
        self
    }
}

/// All faults of one file.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{file}: {} fault(s); the first: {}", faults.len(), faults.first().map_or("none", |f| f.message.as_str()))]
pub struct Faults {
    /// The file's name, for people.
    pub file: String,
    /// The file's text, which the spans refer to.
    pub text: String,
    /// The faults in order of their place.
    pub faults: Vec<Fault>,
}
