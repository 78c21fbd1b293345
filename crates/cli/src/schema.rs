//! `specula schema`: JSON Schemas, from the kinds, the models and the events themselves.

use engine::{EventLine, Kinds};

use crate::arguments::SchemaSubject;
use crate::{Exit, print};

pub(crate) fn run(subject: SchemaSubject, kinds: &Kinds) -> Exit {
    print::data(&text(subject, kinds))
}

/// The schema as a file holds it.
pub(crate) fn text(subject: SchemaSubject, kinds: &Kinds) -> String {
    let schema = match subject {
        SchemaSubject::Pipeline => kinds.schema(),
        SchemaSubject::Material => stages::material_schema(),
        SchemaSubject::Events => EventLine::schema(),
    };
    format!("{schema:#}\n")
}
