//! A parsed TOML text in which every key and value has its place.
//!
//! The `toml` crate recovers from syntax errors, so that all of them are reported; of each line only the
//! first is, because the others mostly follow from it. A text with syntax errors is not interpreted further.
//!
//! Memory is bounded: a text longer than [`Document::MAX_BYTES`] is refused, and the parser refuses values
//! that are nested deeper than 80 levels.

use std::cell::OnceCell;
use std::collections::{HashMap, HashSet};
use std::ops::Range;

use toml::de::{DeTable, DeValue};

use super::diagnostic::{Diagnostic, Diagnostics};

/// A TOML value and its byte range in the text.
#[derive(Clone, Debug, PartialEq)]
pub struct Value {
    /// The byte range.
    pub span: Range<usize>,
    /// The value.
    pub kind: ValueKind,
}

/// The type and content of a [`Value`].
#[derive(Clone, Debug, PartialEq)]
pub enum ValueKind {
    /// `true` or `false`.
    Boolean(bool),
    /// A whole number.
    Integer(i64),
    /// A number with a point or exponent, `inf`, `nan`.
    Float(f64),
    /// A string.
    String(String),
    /// An array.
    Array(Vec<Value>),
    /// A table, inline or under a header.
    Table(Table),
    /// A date or time, which no key accepts.
    Datetime(String),
}

/// A table's entries, in the order of the text.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Table {
    /// The byte range of the table or its header.
    pub span: Range<usize>,
    /// The entries.
    pub entries: Vec<Entry>,
}

/// A key and its value.
#[derive(Clone, Debug, PartialEq)]
pub struct Entry {
    /// The key.
    pub key: String,
    /// The byte range of the key.
    pub key_span: Range<usize>,
    /// The value.
    pub value: Value,
}

impl Table {
    /// The entry of a key.
    pub fn get(&self, key: &str) -> Option<&Entry> {
        self.entries.iter().find(|entry| entry.key == key)
    }

    /// Parses a TOML text.
    ///
    /// # Errors
    /// If the text has syntax errors or numbers that are too large: the first of each line, in order of
    /// place.
    pub fn parse(text: &str) -> Result<Self, Vec<Diagnostic>> {
        let (parsed, found) = DeTable::parse_recoverable(text);
        let mut errors = Vec::new();
        let table = table_of(parsed.get_ref(), 0..0, &mut errors);
        let found = found.iter().map(|error| (error.span().unwrap_or(0..0), error.message())).collect();
        errors.extend(syntax_errors(text, found, &table));
        if errors.is_empty() { Ok(table) } else { Err(errors) }
    }

    /// The table of a JSON object, without its null entries; `None` if it is no object, or has values that no
    /// TOML text has.
    pub(crate) fn from_json(value: &serde_json::Value) -> Option<Self> {
        let given = value.as_object()?.iter().filter(|(_, value)| !value.is_null());
        let entries = given.map(|(key, value)| {
            Some(Entry { key: key.clone(), key_span: 0..0, value: Value::from_json(value)? })
        });
        Some(Self { span: 0..0, entries: entries.collect::<Option<_>>()? })
    }
}

impl Table {
    /// A TOML text of the same content, without its comments and places. Equal tables give equal texts,
    /// whatever the order of their entries.
    pub fn text(&self) -> String {
        self.plain().to_string()
    }

    fn plain(&self) -> toml::Table {
        self.entries.iter().map(|entry| (entry.key.clone(), entry.value.plain())).collect()
    }
}

impl Value {
    fn from_json(value: &serde_json::Value) -> Option<Self> {
        use serde_json::Value as Json;
        let kind = match value {
            Json::Null => return None,
            Json::Bool(value) => ValueKind::Boolean(*value),
            Json::Number(number) => match number.as_i64() {
                Some(integer) => ValueKind::Integer(integer),
                None => ValueKind::Float(number.as_f64()?),
            },
            Json::String(text) => ValueKind::String(text.clone()),
            Json::Array(values) => {
                ValueKind::Array(values.iter().map(Self::from_json).collect::<Option<_>>()?)
            }
            Json::Object(_) => ValueKind::Table(Table::from_json(value)?),
        };
        Some(Self { span: 0..0, kind })
    }

    fn plain(&self) -> toml::Value {
        match &self.kind {
            ValueKind::Boolean(value) => (*value).into(),
            ValueKind::Integer(value) => (*value).into(),
            ValueKind::Float(value) => (*value).into(),
            // A date has no place in a stage's parameters: its text is refused as the date would be.
            ValueKind::String(value) | ValueKind::Datetime(value) => value.clone().into(),
            ValueKind::Array(values) => values.iter().map(Self::plain).collect::<Vec<_>>().into(),
            ValueKind::Table(table) => table.plain().into(),
        }
    }
}

/// A TOML file's text and its content.
#[derive(Clone, Debug, PartialEq)]
pub struct Document {
    /// The file's name, for messages.
    pub file: String,
    /// The text that the spans refer to, without a byte order mark.
    pub text: String,
    /// The content.
    pub table: Table,
}

impl Document {
    /// The size of the largest text that is read: 1 MiB.
    pub const MAX_BYTES: usize = 1 << 20;

    /// Parses the bytes of a file.
    ///
    /// # Errors
    /// If the text has syntax errors, is not UTF-8 or is longer than [`Document::MAX_BYTES`].
    pub fn parse(file: impl Into<String>, bytes: &[u8]) -> Result<Self, Diagnostics> {
        let file = file.into();
        if bytes.len() > Self::MAX_BYTES {
            let error = Diagnostic::of_file(format!("the file is larger than {} bytes", Self::MAX_BYTES));
            return Err(Diagnostics::new(file, "", vec![error.expected("expected a text file")]));
        }
        let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
        let text = std::str::from_utf8(bytes).map_err(|error| not_utf8(&file, bytes, error.valid_up_to()))?;
        match Table::parse(text) {
            Ok(table) => Ok(Self { file, text: text.into(), table }),
            Err(errors) => Err(Diagnostics::new(file, text, errors)),
        }
    }

    /// The errors of this document.
    pub fn diagnostics(&self, errors: Vec<Diagnostic>) -> Diagnostics {
        Diagnostics::new(&self.file, &self.text, errors)
    }
}

fn not_utf8(file: &str, bytes: &[u8], place: usize) -> Diagnostics {
    // Up to this place the lossy text has the same bytes, and there a replacement character of three bytes.
    let text = String::from_utf8_lossy(bytes);
    let error = Diagnostic::at(place..place + 3, format!("byte 0x{:02x} is not UTF-8", bytes[place]))
        .expected("expected UTF-8 text")
        .help(match bytes {
            [0xff, 0xfe, ..] | [0xfe, 0xff, ..] => "this looks like UTF-16: save the file as UTF-8",
            _ => "save the file as UTF-8",
        });
    Diagnostics::new(file, text, vec![error])
}

/// The errors that the parser found: the first of each line, with the names of duplicates.
fn syntax_errors(text: &str, mut found: Vec<(Range<usize>, &str)>, table: &Table) -> Vec<Diagnostic> {
    let lines = Lines::new(text, table);
    for (span, _) in &mut found {
        *span = text.floor_char_boundary(span.start)..text.ceil_char_boundary(span.end.max(span.start));
    }
    found.sort_by_key(|(span, _)| span.start);
    let mut reported = HashSet::new();
    let mut errors = Vec::new();
    // The keys of a table that is defined twice are duplicates too: they are skipped until the next header.
    let mut twice = false;
    let mut place = 0;
    for (span, message) in found {
        let start = lines.line_start(span.start);
        twice = twice && !text[place..span.start].contains("\n[");
        place = span.start;
        let is_duplicate = message == "duplicate key";
        if (twice && is_duplicate) || !reported.insert(start) {
            continue;
        }
        let header = text[start..].trim_start().starts_with('[');
        errors.push(match is_duplicate {
            true => duplicate(&lines, span, header),
            false => syntax_error(text, span, message),
        });
        twice |= is_duplicate && header;
    }
    if errors.len() > Diagnostics::SHOWN
        && let Some(first) = errors.first_mut()
    {
        first.help.get_or_insert_with(|| "is this a TOML file?".into());
    }
    errors
}

/// The lines of keys and headers, collected once, because there may be thousands of duplicates.
struct Lines<'a> {
    text: &'a str,
    table: &'a Table,
    starts: Vec<usize>,
    /// The first line, counted from 0, of each header.
    headers: OnceCell<HashMap<&'a str, usize>>,
    /// The places of each key, in all tables.
    keys: OnceCell<HashMap<&'a str, Vec<usize>>>,
}

impl<'a> Lines<'a> {
    fn new(text: &'a str, table: &'a Table) -> Self {
        let starts = [0].into_iter().chain(text.match_indices('\n').map(|(newline, _)| newline + 1));
        Self { text, table, starts: starts.collect(), headers: OnceCell::new(), keys: OnceCell::new() }
    }

    /// The line of a place, counted from 0.
    fn line(&self, place: usize) -> usize {
        self.starts.partition_point(|start| *start <= place).saturating_sub(1)
    }

    fn line_start(&self, place: usize) -> usize {
        self.starts[self.line(place)]
    }

    /// The header on the line of a place, and the first earlier line with the same header.
    fn header(&self, place: usize) -> (&'a str, Option<usize>) {
        let headers = self.headers.get_or_init(|| {
            let mut headers = HashMap::new();
            for (line, text) in self.text.lines().enumerate() {
                headers.entry(text.trim()).or_insert(line);
            }
            headers
        });
        let header = self.text[self.line_start(place)..].lines().next().unwrap_or_default().trim();
        (header, headers.get(header).copied().filter(|first| *first < self.line(place)))
    }

    /// The line of the last occurrence of a key before a place.
    fn key_before(&self, key: &str, place: usize) -> Option<usize> {
        let keys = self.keys.get_or_init(|| {
            let mut keys = HashMap::<_, Vec<_>>::new();
            let mut open = vec![self.table];
            while let Some(table) = open.pop() {
                for entry in &table.entries {
                    keys.entry(entry.key.as_str()).or_default().push(entry.key_span.start);
                    if let ValueKind::Table(inner) = &entry.value.kind {
                        open.push(inner);
                    }
                }
            }
            keys.values_mut().for_each(|places| places.sort_unstable());
            keys
        });
        let places = keys.get(key)?;
        let before = places.partition_point(|start| *start < place).checked_sub(1)?;
        Some(self.line(places[before]))
    }
}

fn syntax_error(text: &str, span: Range<usize>, message: &str) -> Diagnostic {
    let missing = span.is_empty() && message.starts_with("string values must be quoted");
    if missing && text[span.start..].trim_start_matches([' ', '\t', '\r']).starts_with(['\n', '#']) {
        return Diagnostic::at(span, "a value is missing")
            .expected("expected a string, a number, true or false, an array or a table");
    }
    match message.split_once(", expected ") {
        Some((message, "literal string")) => {
            Diagnostic::at(span, message).expected("expected a quoted string, a number, true or false")
        }
        Some((message, expected)) => {
            Diagnostic::at(span, message).expected(format!("expected {}", expected.replace(", ", " or ")))
        }
        None => Diagnostic::at(span, message),
    }
}

fn duplicate(lines: &Lines<'_>, span: Range<usize>, header: bool) -> Diagnostic {
    let key = &lines.text[span.clone()];
    let (error, first) = if header {
        let (header, first) = lines.header(span.start);
        let message = match header.strip_prefix("[stage.") {
            Some(_) => format!("two stages are named {key:?}"),
            None => format!("the table {header} appears twice"),
        };
        (Diagnostic::at(span, message).expected("expected another name"), first)
    } else {
        let first = lines.key_before(key, span.start);
        (Diagnostic::at(span, format!("the key {key:?} appears twice in its table")), first)
    };
    match first {
        Some(line) => error.help(format!("the first is on line {}", line + 1)),
        None => error,
    }
}

fn table_of(parsed: &DeTable<'_>, span: Range<usize>, errors: &mut Vec<Diagnostic>) -> Table {
    let mut entries: Vec<_> = parsed
        .iter()
        .map(|(key, value)| Entry {
            key: key.get_ref().to_string(),
            key_span: key.span(),
            value: value_of(value.get_ref(), value.span(), errors),
        })
        .collect();
    entries.sort_by_key(|entry| entry.key_span.start);
    Table { span, entries }
}

fn value_of(parsed: &DeValue<'_>, span: Range<usize>, errors: &mut Vec<Diagnostic>) -> Value {
    let kind = match parsed {
        DeValue::Boolean(value) => ValueKind::Boolean(*value),
        DeValue::String(text) => ValueKind::String(text.to_string()),
        DeValue::Datetime(value) => ValueKind::Datetime(value.to_string()),
        DeValue::Integer(number) => match i64::from_str_radix(number.as_str(), number.radix()) {
            Ok(number) => ValueKind::Integer(number),
            Err(_) => {
                errors.push(too_large(&span, number.as_str(), "a 64-bit whole number"));
                ValueKind::Integer(0)
            }
        },
        DeValue::Float(number) => match number.as_str().parse::<f64>() {
            Ok(value) if value.is_finite() || !number.as_str().contains(|c: char| c.is_ascii_digit()) => {
                ValueKind::Float(value)
            }
            _ => {
                errors.push(too_large(&span, number.as_str(), "a double-precision number"));
                ValueKind::Float(0.0)
            }
        },
        DeValue::Array(values) => ValueKind::Array(
            values.iter().map(|value| value_of(value.get_ref(), value.span(), errors)).collect(),
        ),
        DeValue::Table(table) => ValueKind::Table(table_of(table, span.clone(), errors)),
    };
    Value { span, kind }
}

fn too_large(span: &Range<usize>, number: &str, expected: &str) -> Diagnostic {
    let shown: String = number.chars().take(40).collect();
    Diagnostic::at(span.clone(), format!("{shown} is too large")).expected(format!("expected {expected}"))
}

#[cfg(test)]
mod tests {
    use expect_test::{Expect, expect};
    use proptest::prelude::*;

    use super::*;
    use crate::testkit::shown;

    fn check(text: &str, expected: Expect) {
        let errors = Document::parse("x.toml", text.as_bytes())
            .map_or_else(|errors| shown(&errors), |_| String::new());
        expected.assert_eq(&errors);
    }

    #[test]
    fn keys_and_values_know_their_places() {
        let text = "\u{feff}schema = 1\r\n[stage.a]\r\nq = { z = 0x1F, a = [\"é\", -inf] }\r\nb.c = 1e3\r\n";
        let document = Document::parse("x.toml", text.as_bytes()).unwrap();
        assert_eq!(document.text, &text[3..]);
        let at = |span: &Range<usize>| &document.text[span.clone()];
        let [schema, stage] = &document.table.entries[..] else { panic!("two entries") };
        assert_eq!((at(&schema.key_span), at(&schema.value.span)), ("schema", "1"));
        let ValueKind::Table(stages) = &stage.value.kind else { panic!("a table") };
        let ValueKind::Table(a) = &stages.get("a").unwrap().value.kind else { panic!("a table") };
        assert_eq!(at(&a.span), "[stage.a]");
        let ValueKind::Table(q) = &a.get("q").unwrap().value.kind else { panic!("a table") };
        assert_eq!(at(&q.span), "{ z = 0x1F, a = [\"é\", -inf] }");
        // In the order of the text, not of the alphabet.
        assert_eq!(q.entries.iter().map(|entry| entry.key.as_str()).collect::<Vec<_>>(), ["z", "a"]);
        assert_eq!(q.get("z").unwrap().value.kind, ValueKind::Integer(31));
        let ValueKind::Array(values) = &q.get("a").unwrap().value.kind else { panic!("an array") };
        assert_eq!(values[0].kind, ValueKind::String("é".into()));
        assert_eq!(values[1].kind, ValueKind::Float(f64::NEG_INFINITY));
        assert!(matches!(&a.get("b").unwrap().value.kind, ValueKind::Table(_)));
    }

    #[test]
    fn all_syntax_errors_are_reported() {
        check(
            "a = \nb = yes\nd = \"open\ne = [1 2]\nf = 1e999\ng = 99999999999999999999\nh = 1 2\n= 3\n[x\n",
            expect![[r#"
                1:5 a value is missing | expected a string, a number, true or false, an array or a table
                2:5 string values must be quoted | expected a quoted string, a number, true or false
                3:10 invalid basic string | expected `"`
                4:6 string values must be quoted | expected a quoted string, a number, true or false
                5:5 1e999 is too large | expected a double-precision number
                6:5 99999999999999999999 is too large | expected a 64-bit whole number
                7:5 string values must be quoted | expected a quoted string, a number, true or false
                8:1 unquoted keys cannot be empty | expected letters or numbers or `-` or `_`
                9:3 unclosed table | expected `]`
            "#]],
        );
    }

    #[test]
    fn an_unclosed_header_hides_the_rest() {
        // The parser does not recover from this.
        check(
            "a = \n[x\nc = yes\n",
            expect![[r#"
            1:5 a value is missing | expected a string, a number, true or false, an array or a table
            2:3 unclosed table | expected `]`
        "#]],
        );
    }

    #[test]
    fn a_duplicate_table_or_key_is_reported_once() {
        check(
            "[stage.a]\nkind = \"x\"\n[stage.b]\n[stage.a]\nkind = \"y\"\nz = 1\n[q]\nr = 1\n\nr = 2\n",
            expect![[r#"
                4:8 two stages are named "a" | expected another name | the first is on line 1
                10:1 the key "r" appears twice in its table | the first is on line 8
            "#]],
        );
    }

    #[test]
    fn bytes_that_are_not_utf_8_are_reported_with_their_place() {
        let errors = Document::parse("x.toml", b"a = 1\nb = \"caf\xe9\"\n").unwrap_err();
        expect![[r#"
            2:9 byte 0xe9 is not UTF-8 | expected UTF-8 text | save the file as UTF-8
        "#]]
        .assert_eq(&shown(&errors));
        let errors = Document::parse("x.toml", b"\xff\xfea\0=\x001\0").unwrap_err();
        expect![[r#"
            1:1 byte 0xff is not UTF-8 | expected UTF-8 text | this looks like UTF-16: save the file as UTF-8
        "#]]
        .assert_eq(&shown(&errors));
        let errors = Document::parse("x.toml", &vec![b'#'; Document::MAX_BYTES + 1]).unwrap_err();
        expect![[r#"
            - the file is larger than 1048576 bytes | expected a text file
        "#]]
        .assert_eq(&shown(&errors));
        assert!(Document::parse("x.toml", &vec![b'#'; Document::MAX_BYTES]).is_ok());
    }

    #[test]
    fn a_binary_file_does_not_make_thousands_of_messages() {
        let found = Document::parse("x.toml", "=\n".repeat(1000).as_bytes()).unwrap_err();
        assert_eq!(found.errors.len(), 1000);
        let text = found.to_string();
        let lines = text.lines().collect::<Vec<_>>();
        assert_eq!((lines.len(), lines[50]), (51, "... and 950 more errors"));
        assert!(lines[0].ends_with("; is this a TOML file?"), "{text}");
        check(
            &"[".repeat(100_000),
            expect![[r#"
            1:3 unquoted keys cannot be empty | expected letters or numbers or `-` or `_`
        "#]],
        );
    }

    proptest! {
        #[test]
        fn no_text_makes_the_parser_panic(text in "[\\[\\]{}=\"'.,#a-c1é\n\r\u{0} -]{0,80}") {
            let _ = Document::parse("x.toml", text.as_bytes());
        }
    }
}
