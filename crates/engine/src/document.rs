//! A parsed TOML text whose every key and value knows its place.
//!
//! The `toml` crate recovers from errors of syntax, so that all of them are told; a line's first is told alone, because
//! the others mostly follow from it. A text with such errors is not looked at further: what it means is anyone's guess.
//!
//! Memory is bounded: a text is refused past [`Document::MAX_BYTES`], and the parser refuses values nested deeper
//! than 80.

use std::cell::OnceCell;
use std::collections::{HashMap, HashSet};
use std::ops::Range;

use toml::de::{DeTable, DeValue};

use crate::{Diagnostic, Diagnostics};

/// A TOML value and its byte range in the text.
#[derive(Clone, Debug, PartialEq)]
pub struct Value {
    /// The byte range.
    pub span: Range<usize>,
    /// The value.
    pub kind: ValueKind,
}

/// What a [`Value`] is.
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
    /// A date or time, which no key of Specula takes.
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
    /// Every fault of syntax, in order of its place, but one a line; numbers that are too large.
    pub fn parse(text: &str) -> Result<Self, Vec<Diagnostic>> {
        let (parsed, errors) = DeTable::parse_recoverable(text);
        let mut faults = Vec::new();
        let table = table_of(parsed.get_ref(), 0..0, &mut faults);
        let errors = errors.iter().map(|error| (error.span().unwrap_or(0..0), error.message())).collect();
        faults.extend(syntax_faults(text, errors, &table));
        if faults.is_empty() { Ok(table) } else { Err(faults) }
    }
}

/// A TOML file's text and what it says.
#[derive(Clone, Debug, PartialEq)]
pub struct Document {
    /// The file's name, for people.
    pub file: String,
    /// The text that the spans refer to, without a byte order mark.
    pub text: String,
    /// What it says.
    pub table: Table,
}

impl Document {
    /// The largest text that is read: 1 MiB.
    pub const MAX_BYTES: usize = 1 << 20;

    /// Parses the bytes of a file.
    ///
    /// # Errors
    /// Every fault of syntax; bytes that are not UTF-8 (the first place); a text past [`Document::MAX_BYTES`].
    pub fn parse(file: impl Into<String>, bytes: &[u8]) -> Result<Self, Diagnostics> {
        let file = file.into();
        if bytes.len() > Self::MAX_BYTES {
            let fault = Diagnostic::of_file(format!("the file is larger than {} bytes", Self::MAX_BYTES));
            return Err(Diagnostics::new(file, "", vec![fault.expected("expected a text file")]));
        }
        let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
        let text = std::str::from_utf8(bytes).map_err(|error| not_utf8(&file, bytes, error.valid_up_to()))?;
        match Table::parse(text) {
            Ok(table) => Ok(Self { file, text: text.into(), table }),
            Err(faults) => Err(Diagnostics::new(file, text, faults)),
        }
    }

    /// Diagnostics that were found in this document.
    pub fn faults(&self, faults: Vec<Diagnostic>) -> Diagnostics {
        Diagnostics::new(&self.file, &self.text, faults)
    }
}

fn not_utf8(file: &str, bytes: &[u8], place: usize) -> Diagnostics {
    // Up to the place the lossy text has the same bytes, and there a replacement character of three.
    let text = String::from_utf8_lossy(bytes);
    let fault = Diagnostic::at(place..place + 3, format!("byte 0x{:02x} is not UTF-8", bytes[place]))
        .expected("expected UTF-8 text")
        .help(match bytes {
            [0xff, 0xfe, ..] | [0xfe, 0xff, ..] => "this looks like UTF-16: save the file as UTF-8",
            _ => "save the file as UTF-8",
        });
    Diagnostics::new(file, text, vec![fault])
}

/// The faults of the parser's errors: the first of each line, with duplicates named.
fn syntax_faults(text: &str, mut errors: Vec<(Range<usize>, &str)>, table: &Table) -> Vec<Diagnostic> {
    let known = Known::new(text, table);
    for (span, _) in &mut errors {
        *span = text.floor_char_boundary(span.start)..text.ceil_char_boundary(span.end.max(span.start));
    }
    errors.sort_by_key(|(span, _)| span.start);
    let mut lines = HashSet::new();
    let mut faults = Vec::new();
    // The keys of a table that is defined twice are duplicates too: they are passed over until the next header.
    let mut twice = false;
    let mut place = 0;
    for (span, message) in errors {
        let start = known.line_start(span.start);
        twice = twice && !text[place..span.start].contains("\n[");
        place = span.start;
        let duplicate = message == "duplicate key";
        if (twice && duplicate) || !lines.insert(start) {
            continue;
        }
        let header = text[start..].trim_start().starts_with('[');
        faults.push(match duplicate {
            true => duplicate_fault(&known, span, header),
            false => syntax_fault(text, span, message),
        });
        twice |= duplicate && header;
    }
    if faults.len() > Diagnostics::SHOWN
        && let Some(first) = faults.first_mut()
    {
        first.help.get_or_insert_with(|| "is this a TOML file?".into());
    }
    faults
}

/// Where keys and headers stand: what the faults of thousands of duplicates ask again and again.
struct Known<'a> {
    text: &'a str,
    table: &'a Table,
    /// Where each line begins.
    lines: Vec<usize>,
    /// The first line, counted from 0, of each header.
    headers: OnceCell<HashMap<&'a str, usize>>,
    /// The places of each key, in any table.
    keys: OnceCell<HashMap<&'a str, Vec<usize>>>,
}

impl<'a> Known<'a> {
    fn new(text: &'a str, table: &'a Table) -> Self {
        let lines = [0].into_iter().chain(text.match_indices('\n').map(|(newline, _)| newline + 1));
        Self { text, table, lines: lines.collect(), headers: OnceCell::new(), keys: OnceCell::new() }
    }

    /// The line of a place, counted from 0.
    fn line(&self, place: usize) -> usize {
        self.lines.partition_point(|start| *start <= place).saturating_sub(1)
    }

    fn line_start(&self, place: usize) -> usize {
        self.lines[self.line(place)]
    }

    /// The header in the line of a place, and the first line before that has the same.
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

    /// The line where a key stands last before a place.
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
        let before = places.partition_point(|known| *known < place).checked_sub(1)?;
        Some(self.line(places[before]))
    }
}

fn syntax_fault(text: &str, span: Range<usize>, message: &str) -> Diagnostic {
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

fn duplicate_fault(known: &Known<'_>, span: Range<usize>, header: bool) -> Diagnostic {
    let key = &known.text[span.clone()];
    let (fault, first) = if header {
        let (header, first) = known.header(span.start);
        let message = match header.strip_prefix("[stage.") {
            Some(_) => format!("two stages are named {key:?}"),
            None => format!("the table {header} is there twice"),
        };
        (Diagnostic::at(span, message).expected("expected another name"), first)
    } else {
        let first = known.key_before(key, span.start);
        (Diagnostic::at(span, format!("the key {key:?} is there twice in its table")), first)
    };
    match first {
        Some(line) => fault.help(format!("the first is in line {}", line + 1)),
        None => fault,
    }
}

fn table_of(parsed: &DeTable<'_>, span: Range<usize>, faults: &mut Vec<Diagnostic>) -> Table {
    let mut entries: Vec<_> = parsed
        .iter()
        .map(|(key, value)| Entry {
            key: key.get_ref().to_string(),
            key_span: key.span(),
            value: value_of(value.get_ref(), value.span(), faults),
        })
        .collect();
    entries.sort_by_key(|entry| entry.key_span.start);
    Table { span, entries }
}

fn value_of(parsed: &DeValue<'_>, span: Range<usize>, faults: &mut Vec<Diagnostic>) -> Value {
    let kind = match parsed {
        DeValue::Boolean(value) => ValueKind::Boolean(*value),
        DeValue::String(text) => ValueKind::String(text.to_string()),
        DeValue::Datetime(value) => ValueKind::Datetime(value.to_string()),
        DeValue::Integer(number) => match i64::from_str_radix(number.as_str(), number.radix()) {
            Ok(number) => ValueKind::Integer(number),
            Err(_) => {
                faults.push(too_large(&span, number.as_str(), "a whole number of 64 bits"));
                ValueKind::Integer(0)
            }
        },
        DeValue::Float(number) => match number.as_str().parse::<f64>() {
            Ok(value) if value.is_finite() || !number.as_str().contains(|c: char| c.is_ascii_digit()) => {
                ValueKind::Float(value)
            }
            _ => {
                faults.push(too_large(&span, number.as_str(), "a number of double precision"));
                ValueKind::Float(0.0)
            }
        },
        DeValue::Array(values) => ValueKind::Array(
            values.iter().map(|value| value_of(value.get_ref(), value.span(), faults)).collect(),
        ),
        DeValue::Table(table) => ValueKind::Table(table_of(table, span.clone(), faults)),
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
        let faults = Document::parse("x.toml", text.as_bytes())
            .map_or_else(|faults| shown(&faults), |_| String::new());
        expected.assert_eq(&faults);
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
    fn all_errors_of_syntax_are_told() {
        check(
            "a = \nb = yes\nd = \"open\ne = [1 2]\nf = 1e999\ng = 99999999999999999999\nh = 1 2\n= 3\n[x\n",
            expect![[r#"
                1:5 a value is missing | expected a string, a number, true or false, an array or a table
                2:5 string values must be quoted | expected a quoted string, a number, true or false
                3:10 invalid basic string | expected `"`
                4:6 string values must be quoted | expected a quoted string, a number, true or false
                5:5 1e999 is too large | expected a number of double precision
                6:5 99999999999999999999 is too large | expected a whole number of 64 bits
                7:5 string values must be quoted | expected a quoted string, a number, true or false
                8:1 unquoted keys cannot be empty | expected letters or numbers or `-` or `_`
                9:3 unclosed table | expected `]`
            "#]],
        );
    }

    #[test]
    fn an_open_header_hides_the_rest() {
        // The parser gives up its recovery here.
        check(
            "a = \n[x\nc = yes\n",
            expect![[r#"
            1:5 a value is missing | expected a string, a number, true or false, an array or a table
            2:3 unclosed table | expected `]`
        "#]],
        );
    }

    #[test]
    fn a_table_or_key_that_is_there_twice_is_named_once() {
        check(
            "[stage.a]\nkind = \"x\"\n[stage.b]\n[stage.a]\nkind = \"y\"\nz = 1\n[q]\nr = 1\n\nr = 2\n",
            expect![[r#"
                4:8 two stages are named "a" | expected another name | the first is in line 1
                10:1 the key "r" is there twice in its table | the first is in line 8
            "#]],
        );
    }

    #[test]
    fn bytes_that_are_no_text_are_placed() {
        let faults = Document::parse("x.toml", b"a = 1\nb = \"caf\xe9\"\n").unwrap_err();
        expect![[r#"
            2:9 byte 0xe9 is not UTF-8 | expected UTF-8 text | save the file as UTF-8
        "#]]
        .assert_eq(&shown(&faults));
        let faults = Document::parse("x.toml", b"\xff\xfea\0=\x001\0").unwrap_err();
        expect![[r#"
            1:1 byte 0xff is not UTF-8 | expected UTF-8 text | this looks like UTF-16: save the file as UTF-8
        "#]]
        .assert_eq(&shown(&faults));
        let faults = Document::parse("x.toml", &vec![b'#'; Document::MAX_BYTES + 1]).unwrap_err();
        expect![[r#"
            - the file is larger than 1048576 bytes | expected a text file
        "#]]
        .assert_eq(&shown(&faults));
        assert!(Document::parse("x.toml", &vec![b'#'; Document::MAX_BYTES]).is_ok());
    }

    #[test]
    fn a_binary_file_does_not_flood() {
        let faults = Document::parse("x.toml", "=\n".repeat(1000).as_bytes()).unwrap_err();
        assert_eq!(faults.faults.len(), 1000);
        let text = faults.to_string();
        let lines = text.lines().collect::<Vec<_>>();
        assert_eq!((lines.len(), lines[50]), (51, "... and 950 more faults"));
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
