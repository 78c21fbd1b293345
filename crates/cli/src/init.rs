//! `specula init`: a starter manifest with two materials.

use std::fs;
use std::io::{ErrorKind, Write};
use std::path::Path;

use engine::Kinds;

use crate::arguments::SchemaSubject;
use crate::exit::Exit;
use crate::print::say;
use crate::schema;

/// The files of a new project; a test builds it.
const FILES: [(&str, &str); 3] = [
    ("pipeline.toml", include_str!("starter/pipeline.toml")),
    ("assets/materials/chalk.toml", include_str!("starter/chalk.toml")),
    ("assets/materials/satin.toml", include_str!("starter/satin.toml")),
];

/// The schemas that the first lines of those files name, for editors.
const SCHEMAS: [(&str, SchemaSubject); 2] =
    [("pipeline.schema.json", SchemaSubject::Pipeline), ("material.schema.json", SchemaSubject::Material)];

pub(crate) fn run(folder: &Path, kinds: &Kinds) -> Exit {
    if folder.join("pipeline.toml").exists() {
        say!("error: {} already exists; nothing was written", folder.join("pipeline.toml").display());
        return Exit::Usage;
    }
    let schemas = SCHEMAS.map(|(name, subject)| (name, schema::text(subject, kinds)));
    let schemas = schemas.iter().map(|(name, text)| (*name, text.as_str()));
    for (name, text) in FILES.into_iter().chain(schemas) {
        let path = folder.join(name);
        match write_new(&path, text) {
            Ok(true) => say!("wrote {}", path.display()),
            Ok(false) => say!("kept  {}", path.display()),
            Err(error) => {
                say!("error: cannot write {}: {error}", path.display());
                return Exit::System;
            }
        }
    }
    let environments = folder.join("assets").join("environments");
    if let Err(error) = fs::create_dir_all(&environments) {
        say!("error: cannot create {}: {error}", environments.display());
        return Exit::System;
    }
    say!("Next: copy a lat-long .exr or .hdr image to {}, then run `specula build`.", environments.display());
    Exit::Success
}

/// Writes a file unless it exists; returns whether it was written.
fn write_new(path: &Path, text: &str) -> std::io::Result<bool> {
    if let Some(parent) = path.parent() {
        fs::create_dir_all(parent)?;
    }
    match fs::File::create_new(path) {
        Ok(mut file) => file.write_all(text.as_bytes()).map(|()| true),
        Err(error) if error.kind() == ErrorKind::AlreadyExists => Ok(false),
        Err(error) => Err(error),
    }
}
