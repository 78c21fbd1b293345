//! The messages of material files.

use std::ops::Range;

use brdf::{ParameterError, ValueType};
use engine::{Diagnostic, Diagnostics, Failure, Table, Value as Toml, ValueKind, nearest, unexpected};

/// All errors of a file, each on its own line.
pub(super) fn failure(errors: &Diagnostics) -> Failure {
    let mut chain = vec![format!("{}: {} errors", errors.file, errors.errors.len())];
    if errors.errors.len() == 1 {
        chain.clear();
    }
    chain.extend(errors.to_string().lines().map(str::to_owned));
    failure_of(chain)
}

pub(super) fn failure_of(chain: Vec<String>) -> Failure {
    Failure { chain, help: None, cancelled: false, system_error: false }
}

/// The expected form of a value, for messages and the manual.
pub(super) fn looks_like(value_type: &ValueType) -> String {
    match value_type {
        ValueType::Number(range) => range.words.to_owned(),
        ValueType::Colour(range) => {
            format!("a colour: [red, green, blue] or one number for a grey, each {}", range.words)
        }
        ValueType::Records(parameters) => {
            let names: Vec<_> = parameters.iter().map(|parameter| parameter.name).collect();
            format!("an array of tables {{ {} }}", names.join(", "))
        }
    }
}

/// The error of a value of the wrong form. These messages are single lines, so `expected` would only repeat
/// them.
pub(super) fn is_not(value: &Toml, expected: &str) -> Diagnostic {
    Diagnostic { expected: None, ..unexpected(value, expected) }
}

pub(super) fn with_nearest<'a>(
    error: Diagnostic,
    name: &str,
    names: impl Iterator<Item = &'a str>,
) -> Diagnostic {
    match nearest(&name.to_lowercase(), names) {
        Some(near) => error.help(format!("did you mean {near:?}?")),
        None => error,
    }
}

/// The place of a parameter that the kernel rejects: its value, or the table in which it is missing.
pub(super) fn place(error: &ParameterError, table: &Table) -> Range<usize> {
    let record = error.record.and_then(|(records, index)| match &table.get(records)?.value.kind {
        ValueKind::Array(items) => match &items.get(index)?.kind {
            ValueKind::Table(table) => Some(table),
            _ => None,
        },
        _ => None,
    });
    let table = record.unwrap_or(table);
    table.get(error.parameter).map_or(table.span.clone(), |entry| entry.value.span.clone())
}
