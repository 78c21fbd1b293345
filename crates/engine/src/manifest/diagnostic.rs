//! What is wrong with a manifest or another text file: each error with its place, what was expected and what
//! to do.

use std::borrow::Cow;
use std::fmt;
use std::ops::Range;

use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde::{Serialize, Serializer};

/// One error of a text file.
#[derive(Clone, Debug, PartialEq)]
pub struct Diagnostic {
    /// What is wrong, in one sentence without a full stop.
    pub message: String,
    /// The place: a byte range of the text.
    pub span: Option<Range<usize>>,
    /// What was expected there, shown at the place.
    pub expected: Option<String>,
    /// What to do, for example the nearest spelling.
    pub help: Option<String>,
}

impl Diagnostic {
    /// An error at a place.
    pub fn at(span: Range<usize>, message: impl Into<String>) -> Self {
        Self { message: message.into(), span: Some(span), expected: None, help: None }
    }

    /// An error of the file as a whole: it does not exist or cannot be read.
    pub fn of_file(message: impl Into<String>) -> Self {
        Self { message: message.into(), span: None, expected: None, help: None }
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

/// All errors of one file.
#[derive(Clone, Debug, PartialEq)]
pub struct Diagnostics {
    /// The file's name, for messages.
    pub file: String,
    /// The file's text, which the spans refer to.
    pub text: String,
    /// The errors in order of their place.
    pub errors: Vec<Diagnostic>,
}

impl Diagnostics {
    /// The number of errors that are shown, the first in order of their place; the others are counted.
    pub const SHOWN: usize = 50;

    /// Sorts the errors of a file by their place.
    pub fn new(file: impl Into<String>, text: impl Into<String>, mut errors: Vec<Diagnostic>) -> Self {
        errors.sort_by_key(|error| error.span.as_ref().map(|span| span.start));
        errors.dedup();
        Self { file: file.into(), text: text.into(), errors }
    }

    /// The errors that are shown.
    pub fn shown(&self) -> &[Diagnostic] {
        &self.errors[..self.errors.len().min(Self::SHOWN)]
    }

    /// The number of errors that are not shown.
    pub fn more(&self) -> usize {
        self.errors.len() - self.shown().len()
    }
}

impl fmt::Display for Diagnostics {
    /// A line for each error that is shown: `pipeline.toml:3:1: unknown key "sorce"; did you mean "source"?`
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (index, diagnostic) in self.shown().iter().enumerate() {
            if index > 0 {
                writeln!(f)?;
            }
            f.write_str(&self.file)?;
            if let Some(span) = &diagnostic.span {
                let (line, column) = line_and_column(&self.text, span.start);
                write!(f, ":{line}:{column}")?;
            }
            write!(f, ": {}", diagnostic.message)?;
            for more in diagnostic.expected.iter().chain(&diagnostic.help) {
                write!(f, "; {more}")?;
            }
        }
        match self.more() {
            0 => Ok(()),
            1 => write!(f, "\n... and 1 more error"),
            more => write!(f, "\n... and {more} more errors"),
        }
    }
}

impl std::error::Error for Diagnostics {}

/// The errors of one file, with lines and columns instead of the text.
#[derive(Serialize, JsonSchema)]
struct PlacedDiagnostics<'a> {
    /// The file's name.
    file: &'a str,
    /// The first 50 errors in order of their place.
    errors: Vec<PlacedDiagnostic<'a>>,
    /// The number of further errors.
    more: usize,
}

/// An error with its line and column.
#[derive(Serialize, JsonSchema)]
struct PlacedDiagnostic<'a> {
    /// What is wrong, in one sentence without a full stop.
    message: &'a str,
    /// The line, counted from 1; `null` if the error is of the file as a whole.
    line: Option<usize>,
    /// The column in characters, counted from 1.
    column: Option<usize>,
    /// The bytes of the file that the error is about: the first, and the one after the last.
    span: Option<[usize; 2]>,
    /// What was expected there.
    expected: Option<&'a str>,
    /// What to do, for example the nearest spelling.
    help: Option<&'a str>,
}

impl Serialize for Diagnostics {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let errors = self.shown().iter().map(|diagnostic| {
            let place = diagnostic.span.as_ref().map(|span| line_and_column(&self.text, span.start));
            PlacedDiagnostic {
                message: &diagnostic.message,
                line: place.map(|(line, _)| line),
                column: place.map(|(_, column)| column),
                span: diagnostic.span.as_ref().map(|span| [span.start, span.end]),
                expected: diagnostic.expected.as_deref(),
                help: diagnostic.help.as_deref(),
            }
        });
        PlacedDiagnostics { file: &self.file, errors: errors.collect(), more: self.more() }
            .serialize(serializer)
    }
}

impl JsonSchema for Diagnostics {
    fn schema_name() -> Cow<'static, str> {
        "Diagnostics".into()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        PlacedDiagnostics::json_schema(generator)
    }
}

/// The line and column (in characters) of a byte in a text, each counted from 1.
pub fn line_and_column(text: &str, byte: usize) -> (usize, usize) {
    let before = &text.as_bytes()[..byte.min(text.len())];
    let start = before.iter().rposition(|&byte| byte == b'\n').map_or(0, |newline| newline + 1);
    let line = before.iter().filter(|&&byte| byte == b'\n').count() + 1;
    // Continuation bytes of UTF-8 do not count.
    let column = before[start..].iter().filter(|&&byte| byte & 0xc0 != 0x80).count() + 1;
    (line, column)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_count_characters() {
        assert_eq!(line_and_column("a\nä=1", 0), (1, 1));
        assert_eq!(line_and_column("a\nä=1", 2), (2, 1));
        assert_eq!(line_and_column("a\nä=1", 4), (2, 2));
        assert_eq!(line_and_column("a\r\nb", 3), (2, 1));
        assert_eq!(line_and_column("", 9), (1, 1));
    }

    #[test]
    fn errors_are_sorted_by_their_place() {
        let diagnostics = vec![
            Diagnostic::at(2..3, "second").expected("expected b").help("write b"),
            Diagnostic::at(0..1, "first"),
            Diagnostic::of_file("whole"),
        ];
        let text = Diagnostics::new("a.toml", "a\nb", diagnostics).to_string();
        assert_eq!(text, "a.toml: whole\na.toml:1:1: first\na.toml:2:1: second; expected b; write b");
    }

    #[test]
    fn the_first_errors_are_shown_and_the_others_counted() {
        let counted = |count: usize| {
            let errors =
                (0..count).rev().map(|at| Diagnostic::at(at..at + 1, format!("error {at}"))).collect();
            let diagnostics = Diagnostics::new("a.toml", "a\n".repeat(count), errors);
            assert_eq!(diagnostics.errors.len(), count);
            let json = serde_json::to_value(&diagnostics).unwrap();
            assert_eq!(json["errors"].as_array().unwrap().len(), count.min(Diagnostics::SHOWN));
            assert_eq!(json["more"], count.saturating_sub(Diagnostics::SHOWN));
            let text = diagnostics.to_string();
            let lines = text.lines().map(str::to_owned).collect::<Vec<_>>();
            assert!(lines[0].ends_with(": error 0") && lines[49].ends_with(": error 49"), "{text}");
            lines[50..].to_vec()
        };
        assert_eq!(counted(50), [""; 0]);
        assert_eq!(counted(51), ["... and 1 more error"]);
        assert_eq!(counted(5000), ["... and 4950 more errors"]);
    }
}
