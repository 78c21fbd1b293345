//! `specula schema`: the JSON Schemas of manifests, material files, events and light probes.

use engine::{EventLine, Kinds};

use crate::arguments::SchemaSubject;
use crate::exit::Exit;
use crate::print;

pub(crate) fn run(subject: SchemaSubject, kinds: &Kinds) -> Exit {
    print::data(&text(subject, kinds))
}

/// The text of a schema file.
pub(crate) fn text(subject: SchemaSubject, kinds: &Kinds) -> String {
    let schema = match subject {
        SchemaSubject::Pipeline => kinds.schema(),
        SchemaSubject::Material => stages::material_schema(),
        SchemaSubject::Events => EventLine::schema(),
        SchemaSubject::Probes => probe_stages::probes_schema(),
    };
    format!("{schema:#}\n")
}
