//! `specula init`: a manifest for what is in a folder, a starter manifest, or the sample project.

use std::fs;
use std::io::{ErrorKind, IsTerminal, Write};
use std::path::Path;

use engine::{Kinds, path_text};
use stages::{ENGINES, Engine, PRESETS, Preset};

use crate::arguments::{MANIFEST, SchemaSubject};
use crate::assets::{Assets, Recognised};
use crate::exit::Exit;
use crate::gltf_materials::GltfMaterials;
use crate::print::say;
use crate::quantity::count;
use crate::standard_pipeline::STARTER_ENGINE;
use crate::{recognise, sample, schema, standard_pipeline, terminal};

/// The materials of a new project that has none, in its meshes neither; a test builds them.
const MATERIALS: [(&str, &[u8]); 2] = [
    ("assets/materials/chalk.toml", include_bytes!("starter/chalk.toml")),
    ("assets/materials/satin.toml", include_bytes!("starter/satin.toml")),
];

/// The folder of a new project's materials.
const MATERIAL_FOLDER: &str = "assets/materials";

/// The schemas that the first lines of the starter's files name, for editors.
const SCHEMAS: [(&str, SchemaSubject); 2] =
    [("pipeline.schema.json", SchemaSubject::Pipeline), ("material.schema.json", SchemaSubject::Material)];

/// The first line of a material file that editors find the schema by.
const MATERIAL_SCHEMA: &str = "#:schema ../../material.schema.json\n\n";

pub(crate) fn run(folder: &Path, engine: Option<&str>, sample: bool, materials: bool, kinds: &Kinds) -> Exit {
    let manifest = folder.join(MANIFEST);
    if materials {
        let text = |preset: &Preset| format!("{MATERIAL_SCHEMA}{}", preset.text).into_bytes();
        let files =
            PRESETS.iter().map(|preset| (format!("{MATERIAL_FOLDER}/{}.toml", preset.name), text(preset)));
        let [_, (schema, subject)] = SCHEMAS;
        let schema = (schema.to_owned(), schema::text(subject, kinds).into_bytes());
        // A new manifest brings the schema with it.
        let schema = manifest.exists().then_some(schema);
        if let Err(exit) = write_all(folder, files.chain(schema)) {
            return exit;
        }
        if manifest.exists() {
            return Exit::Success;
        }
    }
    if manifest.exists() {
        say!("error: {} already exists; nothing was written", path_text(manifest));
        return Exit::Usage;
    }
    let found = match sample {
        true => Recognised::default(),
        false => recognise::of_folder(Assets::found(folder), folder, kinds),
    };
    let mut files: Vec<(String, Vec<u8>)> = Vec::new();
    let mut add = |name: &str, text: &[u8]| files.push((name.to_owned(), text.to_vec()));
    let mut of_meshes = GltfMaterials::default();
    if sample {
        add(MANIFEST, sample::MANIFEST.as_bytes());
        sample::ASSETS.iter().for_each(|(path, bytes)| add(path, bytes));
    } else {
        let name = engine.map_or_else(asked, str::to_owned);
        let Some(engine) = named(&name) else {
            say!("error: there is no engine {name}");
            return Exit::Usage;
        };
        add(MANIFEST, standard_pipeline::starter(&found, folder, engine).as_bytes());
        if found.materials.is_empty() {
            of_meshes = GltfMaterials::of(&found.meshes, |mesh| {
                let path = mesh.strip_prefix(folder).unwrap_or(mesh).to_string_lossy().replace('\\', "/");
                if mesh.starts_with(folder) { format!("../../{path}") } else { path }
            });
            for (name, text) in &of_meshes.files {
                add(&format!("{MATERIAL_FOLDER}/{name}"), text.as_bytes());
            }
            if of_meshes.files.is_empty() {
                MATERIALS.iter().for_each(|(path, bytes)| add(path, bytes));
            }
        }
        SCHEMAS.iter().for_each(|(name, subject)| add(name, schema::text(*subject, kinds).as_bytes()));
    }
    if let Err(exit) = write_all(folder, files.into_iter()) {
        return exit;
    }
    for (file, reason) in found.left_out.iter().chain(&of_meshes.left_out) {
        say!("left out {}: {reason}", path_text(file));
    }
    if sample || !found.environments.is_empty() {
        if !sample {
            let Recognised { materials, meshes, .. } = &found;
            say!(
                "The manifest names {}, {} and {}.",
                count(found.environment_count(), "environment"),
                match (materials.len(), of_meshes.files.len()) {
                    (0, 0) => "2 materials of its own".into(),
                    (0, of_meshes) => format!("{} of glTF files", count(of_meshes, "material")),
                    (materials, _) => count(materials, "material"),
                },
                count(meshes.len(), "mesh file")
            );
        }
        say!("Next: `specula build`, or `specula preview` to see it.");
        return Exit::Success;
    }
    let environments = folder.join("assets").join("environments");
    if let Err(error) = fs::create_dir_all(&environments) {
        say!("error: cannot create {}: {error}", path_text(environments));
        return Exit::System;
    }
    say!(
        "Next: copy a lat-long .exr or .hdr image to {}, then run `specula build`.",
        path_text(environments)
    );
    Exit::Success
}

/// Writes those of some files, by their paths in the folder, that do not exist, and says which.
fn write_all(folder: &Path, files: impl Iterator<Item = (String, Vec<u8>)>) -> Result<(), Exit> {
    for (name, bytes) in files {
        let path = folder.join(name);
        match write_new(&path, &bytes) {
            Ok(true) => say!("wrote {}", path_text(path)),
            Ok(false) => say!("kept  {}", path_text(path)),
            Err(error) => {
                say!("error: cannot write {}: {error}", path_text(path));
                return Err(Exit::System);
            }
        }
    }
    Ok(())
}

fn named(name: &str) -> Option<&'static Engine> {
    ENGINES.iter().copied().find(|engine| engine.name == name)
}

/// The engine that somebody at a terminal names; without a terminal, the one that the starter names.
fn asked() -> String {
    if terminal::is_terminal() && std::io::stdin().is_terminal() {
        let names = ENGINES.iter().map(|engine| engine.name).collect::<Vec<_>>().join(", ");
        say!("Which engine loads the light? Type one of {names}, or nothing for {STARTER_ENGINE}:");
        let mut line = String::new();
        while std::io::stdin().read_line(&mut line).is_ok_and(|read| read > 0) {
            match line.trim() {
                "" => break,
                name if named(name).is_some() => return name.to_owned(),
                name => {
                    say!("There is no engine {name}. Type one of {names}, or nothing for {STARTER_ENGINE}:")
                }
            }
            line.clear();
        }
    }
    STARTER_ENGINE.to_owned()
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
