//! A parsed TOML text whose every key and value knows its place.

use std::ops::Range;

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
}
