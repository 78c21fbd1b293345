//! The manifest's text: a TOML document with places, the types of parameters, and errors that name where
//! they are.

mod choice;
mod diagnostic;
mod document;
mod parameters;
mod range;
mod spelling;

pub use choice::Choice;
pub use diagnostic::{Diagnostic, Diagnostics, line_and_column};
pub use document::{Document, Entry, Table, Value, ValueKind};
pub use parameters::{Field, Parameter, Parameters, unexpected, unknown_keys, unknown_parameters};
pub use range::{Number, OrAuto, Range, Ranged};
pub(crate) use spelling::Spelling;
pub use spelling::nearest;
