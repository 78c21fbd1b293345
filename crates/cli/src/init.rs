//! `specula init`: a manifest for what is in a folder, a starter manifest, or the sample project.

use std::fs;
use std::io::{ErrorKind, Write};
use std::path::Path;

use engine::Kinds;

use crate::arguments::{MANIFEST, SchemaSubject};
use crate::assets::{Assets, Recognised};
use crate::exit::Exit;
use crate::print::say;
use crate::quantity::count;
use crate::{recognise, sample, schema, standard_pipeline};

/// The materials of a new project that has none; a test builds them.
const MATERIALS: [(&str, &[u8]); 2] = [
    ("assets/materials/chalk.toml", include_bytes!("starter/chalk.toml")),
    ("assets/materials/satin.toml", include_bytes!("starter/satin.toml")),
];

/// The schemas that the first lines of the starter's files name, for editors.
const SCHEMAS: [(&str, SchemaSubject); 2] =
    [("pipeline.schema.json", SchemaSubject::Pipeline), ("material.schema.json", SchemaSubject::Material)];

pub(crate) fn run(folder: &Path, sample: bool, kinds: &Kinds) -> Exit {
    let manifest = folder.join(MANIFEST);
    if manifest.exists() {
        say!("error: {} already exists; nothing was written", manifest.display());
        return Exit::Usage;
    }
    let found = match sample {
        true => Recognised::default(),
        false => recognise::of_folder(Assets::found(folder), folder, kinds),
    };
    let mut files: Vec<(&str, Vec<u8>)> = Vec::new();
    let mut add = |name, text: &[u8]| files.push((name, text.to_vec()));
    if sample {
        add(MANIFEST, sample::MANIFEST.as_bytes());
        sample::ASSETS.iter().for_each(|(path, bytes)| add(path, bytes));
    } else {
        add(MANIFEST, standard_pipeline::starter(&found, folder).as_bytes());
        if found.materials.is_empty() {
            MATERIALS.iter().for_each(|(path, bytes)| add(path, bytes));
        }
        SCHEMAS.iter().for_each(|(name, subject)| add(name, schema::text(*subject, kinds).as_bytes()));
    }
    for (name, bytes) in files {
        let path = folder.join(name);
        match write_new(&path, &bytes) {
            Ok(true) => say!("wrote {}", path.display()),
            Ok(false) => say!("kept  {}", path.display()),
            Err(error) => {
                say!("error: cannot write {}: {error}", path.display());
                return Exit::System;
            }
        }
    }
    for (file, reason) in &found.left_out {
        say!("left out {}: {reason}", file.display());
    }
    if sample || !found.environments.is_empty() {
        if !sample {
            let Recognised { materials, meshes, .. } = &found;
            say!(
                "The manifest names {}, {} and {}.",
                count(found.environment_count(), "environment"),
                if materials.is_empty() {
                    "2 materials of its own".into()
                } else {
                    count(materials.len(), "material")
                },
                count(meshes.len(), "mesh file")
            );
        }
        say!("Next: `specula build`, or `specula preview` to look at it.");
        return Exit::Success;
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
pub(crate) fn write_new(path: &Path, bytes: &[u8]) -> std::io::Result<bool> {
    if let Some(parent) = path.parent() {
        fs::create_dir_all(parent)?;
    }
    match fs::File::create_new(path) {
        Ok(mut file) => file.write_all(bytes).map(|()| true),
        Err(error) if error.kind() == ErrorKind::AlreadyExists => Ok(false),
        Err(error) => Err(error),
    }
}
