//! The manifest's text as declarations: the keys of each stage, not yet checked against its kind and the
//! other stages.

use std::ops::Range;

use crate::manifest::{Diagnostic, Document, Entry, Table, Value, ValueKind, unexpected, unknown_keys};

/// The keys of a stage that the engine owns; all others are its kind's parameters.
pub(crate) const OWNED: [&str; 6] = ["kind", "source", "input", "inputs", "per", "path"];

/// The version of the manifest's schema that this program reads.
pub(crate) const SCHEMA: i64 = 1;

/// A value with its place in the text.
#[derive(Clone, Debug)]
pub(crate) struct Written<T> {
    pub(crate) span: Range<usize>,
    pub(crate) value: T,
}

/// A key's value. An invalid one has been reported, and must not be reported as missing too.
#[derive(Clone, Debug)]
pub(crate) enum Key<T> {
    Absent,
    Invalid,
    Given(Written<T>),
}

impl<T> Key<T> {
    pub(crate) fn given(&self) -> Option<&Written<T>> {
        match self {
            Self::Given(written) => Some(written),
            _ => None,
        }
    }

    pub(crate) fn is_absent(&self) -> bool {
        matches!(self, Self::Absent)
    }
}

/// `[stage.NAME]` and its entries.
#[derive(Clone, Debug)]
pub(crate) struct Declaration {
    pub(crate) name: Written<String>,
    /// The place of the table's header.
    pub(crate) header: Range<usize>,
    pub(crate) kind: Key<String>,
    /// Paths and globs; after a `!`, those that are left out.
    pub(crate) source: Key<Vec<Written<String>>>,
    /// The short form: the stage for the first port.
    pub(crate) input: Key<String>,
    /// Names of ports and of stages.
    pub(crate) inputs: Key<Vec<(Written<String>, Written<String>)>>,
    pub(crate) per: Key<Vec<Written<String>>>,
    pub(crate) path: Key<String>,
    pub(crate) parameters: Table,
}

#[derive(Clone, Debug)]
pub(crate) struct Manifest {
    pub(crate) out: Key<String>,
    /// The stages, in the order of the text.
    pub(crate) stages: Vec<Declaration>,
}

impl Manifest {
    /// Reads the declarations. `None` if the schema has another version, because then nothing else can be
    /// checked.
    pub(crate) fn parse(document: &Document, errors: &mut Vec<Diagnostic>) -> Option<Self> {
        let table = &document.table;
        match table.get("schema").map(|entry| &entry.value) {
            Some(Value { kind: ValueKind::Integer(SCHEMA), .. }) => {}
            Some(value @ Value { kind: ValueKind::Integer(number), .. }) => {
                let error = Diagnostic::at(value.span.clone(), format!("unknown schema {number}"));
                errors.push(
                    error
                        .expected(format!("expected {SCHEMA}"))
                        .help("this manifest is for another version of Specula"),
                );
                return None;
            }
            Some(value) => errors.push(unexpected(value, &SCHEMA.to_string())),
            None => errors.push(
                Diagnostic::at(0..0, "\"schema\" is missing")
                    .expected(format!("expected schema = {SCHEMA} on the first line")),
            ),
        }
        unknown_keys(table, &["schema", "out", "stage"].map(String::from), errors);
        let out = string(table, "out", errors);
        let stages = match table.get("stage") {
            Some(Entry { value: Value { kind: ValueKind::Table(stages), .. }, .. })
                if !stages.entries.is_empty() =>
            {
                stages.entries.iter().map(|entry| declaration(entry, errors)).collect()
            }
            Some(entry) if !matches!(entry.value.kind, ValueKind::Table(_)) => {
                errors.push(
                    Diagnostic::at(entry.value.span.clone(), "\"stage\" is not a table of stages")
                        .expected("expected [stage.NAME]"),
                );
                Vec::new()
            }
            _ => {
                let end = document.text.trim_end().len();
                errors
                    .push(Diagnostic::at(end..end, "there are no stages").expected("expected [stage.NAME]"));
                Vec::new()
            }
        };
        Some(Self { out, stages })
    }
}

fn declaration(entry: &Entry, errors: &mut Vec<Diagnostic>) -> Declaration {
    let plain = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
    if entry.key.is_empty() || !entry.key.chars().all(plain) {
        errors.push(
            Diagnostic::at(entry.key_span.clone(), format!("{:?} cannot be the name of a stage", entry.key))
                .expected("expected only the characters A-Z, a-z, 0-9, _ and -"),
        );
    }
    let name = Written { span: entry.key_span.clone(), value: entry.key.clone() };
    let ValueKind::Table(table) = &entry.value.kind else {
        errors.push(not_a(&entry.value, "a table", &format!("[stage.{}]", entry.key)));
        return Declaration {
            name,
            header: entry.value.span.clone(),
            kind: Key::Invalid,
            source: Key::Invalid,
            input: Key::Invalid,
            inputs: Key::Invalid,
            per: Key::Invalid,
            path: Key::Invalid,
            parameters: Table::default(),
        };
    };
    let kind = string(table, "kind", errors);
    if kind.is_absent() {
        let error = Diagnostic::at(table.span.clone(), format!("stage {:?} has no kind", entry.key));
        errors.push(error.expected("expected kind = \"...\""));
    }
    let input = string(table, "input", errors);
    let inputs = connections(table, errors);
    if let (Some(entry), false) = (table.get("inputs"), input.is_absent()) {
        errors.push(
            Diagnostic::at(entry.key_span.clone(), "\"input\" and \"inputs\" exclude each other")
                .expected("expected only one of them")
                .help("\"input\" connects the first port, \"inputs\" connects ports by name"),
        );
    }
    let own = |entry: &&Entry| !OWNED.contains(&entry.key.as_str());
    Declaration {
        name,
        header: table.span.clone(),
        kind,
        source: one_or_more(table, "source", errors),
        input,
        inputs,
        per: words(table, "per", errors),
        path: string(table, "path", errors),
        parameters: Table {
            span: table.span.clone(),
            entries: table.entries.iter().filter(own).cloned().collect(),
        },
    }
}

/// The error of a value that does not have the type that its key needs.
fn not_a(value: &Value, wanted: &str, example: &str) -> Diagnostic {
    unexpected(value, wanted).expected(format!("expected {example}"))
}

fn string(table: &Table, key: &str, errors: &mut Vec<Diagnostic>) -> Key<String> {
    match table.get(key) {
        None => Key::Absent,
        Some(entry) => match text(&entry.value) {
            Some(written) => Key::Given(written),
            None => {
                errors.push(not_a(&entry.value, "a string", &format!("{key} = \"...\"")));
                Key::Invalid
            }
        },
    }
}

/// A string, or an array of them.
fn one_or_more(table: &Table, key: &str, errors: &mut Vec<Diagnostic>) -> Key<Vec<Written<String>>> {
    match table.get(key) {
        Some(entry) if matches!(entry.value.kind, ValueKind::Array(_)) => words(table, key, errors),
        _ => match string(table, key, errors) {
            Key::Given(written) => Key::Given(Written { span: written.span.clone(), value: vec![written] }),
            Key::Absent => Key::Absent,
            Key::Invalid => Key::Invalid,
        },
    }
}

fn words(table: &Table, key: &str, errors: &mut Vec<Diagnostic>) -> Key<Vec<Written<String>>> {
    let Some(entry) = table.get(key) else { return Key::Absent };
    let all = match &entry.value.kind {
        ValueKind::Array(values) => values.iter().map(text).collect::<Option<Vec<_>>>(),
        _ => None,
    };
    match all {
        Some(value) => Key::Given(Written { span: entry.value.span.clone(), value }),
        None => {
            errors.push(not_a(&entry.value, "an array of strings", &format!("{key} = [\"...\"]")));
            Key::Invalid
        }
    }
}

fn connections(table: &Table, errors: &mut Vec<Diagnostic>) -> Key<Vec<(Written<String>, Written<String>)>> {
    let Some(entry) = table.get("inputs") else { return Key::Absent };
    let ValueKind::Table(ports) = &entry.value.kind else {
        let error = not_a(&entry.value, "a table", "inputs = { PORT = \"STAGE\" }");
        errors.push(match &entry.value.kind {
            ValueKind::String(stage) => error.help(format!("input = {stage:?} connects the first port")),
            _ => error,
        });
        return Key::Invalid;
    };
    let before = errors.len();
    let mut value = Vec::new();
    for entry in &ports.entries {
        match text(&entry.value) {
            Some(stage) => {
                value.push((Written { span: entry.key_span.clone(), value: entry.key.clone() }, stage));
            }
            None => errors.push(unexpected(&entry.value, "the name of a stage")),
        }
    }
    if errors.len() > before { Key::Invalid } else { Key::Given(Written { span: ports.span.clone(), value }) }
}

fn text(value: &Value) -> Option<Written<String>> {
    match &value.kind {
        ValueKind::String(text) => Some(Written { span: value.span.clone(), value: text.clone() }),
        _ => None,
    }
}
