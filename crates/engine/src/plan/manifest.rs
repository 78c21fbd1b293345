//! The manifest's text as declarations: what each stage says, before anyone asks what it means.

use std::ops::Range;

use crate::{Diagnostic, Document, Entry, Table, Value, ValueKind, unexpected, unknown_keys};

/// The keys of a stage that the engine owns; all others are its kind's parameters.
pub(crate) const OWNED: [&str; 6] = ["kind", "source", "input", "inputs", "per", "path"];

/// The number of the manifest's shape that this version reads.
pub(crate) const SCHEMA: i64 = 1;

/// Something that was written, and where.
#[derive(Clone, Debug)]
pub(crate) struct Written<T> {
    pub(crate) span: Range<usize>,
    pub(crate) value: T,
}

/// What became of a key: a key with a fault is told once and never called missing.
#[derive(Clone, Debug)]
pub(crate) enum Key<T> {
    Absent,
    Faulty,
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
    pub(crate) source: Key<String>,
    /// The short form: one stage for the first port.
    pub(crate) input: Key<String>,
    /// Port names and stage names.
    pub(crate) inputs: Key<Vec<(Written<String>, Written<String>)>>,
    pub(crate) per: Key<Vec<Written<String>>>,
    pub(crate) path: Key<String>,
    pub(crate) parameters: Table,
}

/// A manifest whose own keys are sound.
#[derive(Clone, Debug)]
pub(crate) struct Manifest {
    pub(crate) out: Key<String>,
    /// The stages, in the order of the text.
    pub(crate) stages: Vec<Declaration>,
}

impl Manifest {
    /// Reads the declarations. `None` where the shape is another version's: nothing else can then be said.
    pub(crate) fn parse(document: &Document, faults: &mut Vec<Diagnostic>) -> Option<Self> {
        let table = &document.table;
        match table.get("schema").map(|entry| &entry.value) {
            Some(Value { kind: ValueKind::Integer(SCHEMA), .. }) => {}
            Some(value @ Value { kind: ValueKind::Integer(number), .. }) => {
                let fault = Diagnostic::at(value.span.clone(), format!("schema {number} is not known"));
                faults.push(
                    fault
                        .expected(format!("expected {SCHEMA}"))
                        .help("this manifest was written for another version of the program"),
                );
                return None;
            }
            Some(value) => faults.push(unexpected(value, &SCHEMA.to_string())),
            None => faults.push(
                Diagnostic::at(0..0, "\"schema\" is missing")
                    .expected(format!("expected schema = {SCHEMA} in the first line")),
            ),
        }
        unknown_keys(table, &["schema", "out", "stage"].map(String::from), faults);
        let out = string(table, "out", faults);
        let stages = match table.get("stage") {
            Some(Entry { value: Value { kind: ValueKind::Table(stages), .. }, .. })
                if !stages.entries.is_empty() =>
            {
                stages.entries.iter().map(|entry| declaration(entry, faults)).collect()
            }
            Some(entry) if !matches!(entry.value.kind, ValueKind::Table(_)) => {
                faults.push(
                    Diagnostic::at(entry.value.span.clone(), "\"stage\" is not a table of stages")
                        .expected("expected [stage.NAME]"),
                );
                Vec::new()
            }
            _ => {
                let end = document.text.trim_end().len();
                faults
                    .push(Diagnostic::at(end..end, "there are no stages").expected("expected [stage.NAME]"));
                Vec::new()
            }
        };
        Some(Self { out, stages })
    }
}

fn declaration(entry: &Entry, faults: &mut Vec<Diagnostic>) -> Declaration {
    let plain = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
    if entry.key.is_empty() || !entry.key.chars().all(plain) {
        faults.push(
            Diagnostic::at(entry.key_span.clone(), format!("{:?} cannot be the name of a stage", entry.key))
                .expected("expected a word of A-Z, a-z, 0-9, _ and -"),
        );
    }
    let name = Written { span: entry.key_span.clone(), value: entry.key.clone() };
    let ValueKind::Table(table) = &entry.value.kind else {
        let expected = format!("a table: [stage.{}]", entry.key);
        faults.push(unexpected(&entry.value, &expected));
        return Declaration {
            name,
            header: entry.value.span.clone(),
            kind: Key::Faulty,
            source: Key::Faulty,
            input: Key::Faulty,
            inputs: Key::Faulty,
            per: Key::Faulty,
            path: Key::Faulty,
            parameters: Table::default(),
        };
    };
    let kind = string(table, "kind", faults);
    if kind.is_absent() {
        let fault = Diagnostic::at(table.span.clone(), format!("stage {:?} has no kind", entry.key));
        faults.push(fault.expected("expected kind = \"...\""));
    }
    let input = string(table, "input", faults);
    let inputs = connections(table, faults);
    if let (Some(entry), false) = (table.get("inputs"), input.is_absent()) {
        faults.push(
            Diagnostic::at(entry.key_span.clone(), "\"input\" and \"inputs\" are both given")
                .expected("expected one of them")
                .help("\"input\" connects the first port, \"inputs\" connects ports by name"),
        );
    }
    let own = |entry: &&Entry| !OWNED.contains(&entry.key.as_str());
    Declaration {
        name,
        header: table.span.clone(),
        kind,
        source: string(table, "source", faults),
        input,
        inputs,
        per: words(table, "per", faults),
        path: string(table, "path", faults),
        parameters: Table {
            span: table.span.clone(),
            entries: table.entries.iter().filter(own).cloned().collect(),
        },
    }
}

fn string(table: &Table, key: &str, faults: &mut Vec<Diagnostic>) -> Key<String> {
    match table.get(key) {
        None => Key::Absent,
        Some(entry) => match text(&entry.value) {
            Some(written) => Key::Given(written),
            None => {
                faults.push(unexpected(&entry.value, &format!("a string: {key} = \"...\"")));
                Key::Faulty
            }
        },
    }
}

fn words(table: &Table, key: &str, faults: &mut Vec<Diagnostic>) -> Key<Vec<Written<String>>> {
    let Some(entry) = table.get(key) else { return Key::Absent };
    let all = match &entry.value.kind {
        ValueKind::Array(values) => values.iter().map(text).collect::<Option<Vec<_>>>(),
        _ => None,
    };
    match all {
        Some(value) => Key::Given(Written { span: entry.value.span.clone(), value }),
        None => {
            faults.push(unexpected(&entry.value, &format!("an array of strings: {key} = [\"...\"]")));
            Key::Faulty
        }
    }
}

fn connections(table: &Table, faults: &mut Vec<Diagnostic>) -> Key<Vec<(Written<String>, Written<String>)>> {
    let Some(entry) = table.get("inputs") else { return Key::Absent };
    let ValueKind::Table(ports) = &entry.value.kind else {
        let fault = unexpected(&entry.value, "a table: inputs = { PORT = \"STAGE\" }");
        faults.push(match &entry.value.kind {
            ValueKind::String(stage) => fault.help(format!("input = {stage:?} connects the first port")),
            _ => fault,
        });
        return Key::Faulty;
    };
    let before = faults.len();
    let mut value = Vec::new();
    for entry in &ports.entries {
        match text(&entry.value) {
            Some(stage) => {
                value.push((Written { span: entry.key_span.clone(), value: entry.key.clone() }, stage));
            }
            None => faults.push(unexpected(&entry.value, "the name of a stage, a string")),
        }
    }
    if faults.len() > before { Key::Faulty } else { Key::Given(Written { span: ports.span.clone(), value }) }
}

fn text(value: &Value) -> Option<Written<String>> {
    match &value.kind {
        ValueKind::String(text) => Some(Written { span: value.span.clone(), value: text.clone() }),
        _ => None,
    }
}
