//! What is wrong with a manifest or a material file: every fault with its place, expectation and remedy.

use std::fmt;
use std::ops::Range;

use serde::ser::{Serialize, SerializeStruct, Serializer};

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

    /// A fault of the file as a whole: it is not there, or cannot be read.
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

/// All faults of one file.
#[derive(Clone, Debug, PartialEq)]
pub struct Faults {
    /// The file's name, for people.
    pub file: String,
    /// The file's text, which the spans refer to.
    pub text: String,
    /// The faults in order of their place.
    pub faults: Vec<Fault>,
}

impl Faults {
    /// The faults of a file, put in order of their place.
    pub fn new(file: impl Into<String>, text: impl Into<String>, mut faults: Vec<Fault>) -> Self {
        faults.sort_by_key(|fault| fault.span.as_ref().map(|span| span.start));
        faults.dedup();
        Self { file: file.into(), text: text.into(), faults }
    }
}

impl fmt::Display for Faults {
    /// A line for each fault: `pipeline.toml:3:1: unknown key "sorce"; did you mean "source"?`
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (index, fault) in self.faults.iter().enumerate() {
            if index > 0 {
                writeln!(f)?;
            }
            f.write_str(&self.file)?;
            if let Some(span) = &fault.span {
                let (line, column) = line_and_column(&self.text, span.start);
                write!(f, ":{line}:{column}")?;
            }
            write!(f, ": {}", fault.message)?;
            for more in fault.expected.iter().chain(&fault.help) {
                write!(f, "; {more}")?;
            }
        }
        Ok(())
    }
}

impl std::error::Error for Faults {}

impl Serialize for Faults {
    /// The file, and its faults with lines and columns in place of the text.
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let faults = self.faults.iter().map(|fault| Placed {
            place: fault.span.as_ref().map(|span| line_and_column(&self.text, span.start)),
            fault,
        });
        let mut object = serializer.serialize_struct("Faults", 2)?;
        object.serialize_field("file", &self.file)?;
        object.serialize_field("faults", &faults.collect::<Vec<_>>())?;
        object.end()
    }
}

/// A fault with its line and column.
struct Placed<'a> {
    fault: &'a Fault,
    place: Option<(usize, usize)>,
}

impl Serialize for Placed<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut object = serializer.serialize_struct("Fault", 5)?;
        object.serialize_field("message", &self.fault.message)?;
        object.serialize_field("line", &self.place.map(|(line, _)| line))?;
        object.serialize_field("column", &self.place.map(|(_, column)| column))?;
        object.serialize_field("expected", &self.fault.expected)?;
        object.serialize_field("help", &self.fault.help)?;
        object.end()
    }
}

/// The line and column (in characters) of a byte in a text, each counted from 1.
pub fn line_and_column(text: &str, byte: usize) -> (usize, usize) {
    let before = &text.as_bytes()[..byte.min(text.len())];
    let start = before.iter().rposition(|&byte| byte == b'\n').map_or(0, |newline| newline + 1);
    let line = before.iter().filter(|&&byte| byte == b'\n').count() + 1;
    // Bytes that continue a character do not count.
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
    fn faults_are_told_in_the_order_of_their_place() {
        let faults = vec![
            Fault::at(2..3, "second").expected("expected b").help("write b"),
            Fault::at(0..1, "first"),
            Fault::of_file("whole"),
        ];
        let text = Faults::new("a.toml", "a\nb", faults).to_string();
        assert_eq!(text, "a.toml: whole\na.toml:1:1: first\na.toml:2:1: second; expected b; write b");
    }
}
