//! What a preview shows: a manifest, or a project of files, which is a manifest for them in the user's cache.
//!
//! The folder of a project follows from its files, so that a second preview of them finds what the first
//! made. If no material is named, those of the glTF meshes are shown. Light or materials of the sample stand
//! in for those that are then missing.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use engine::{Digest, path_text};

use crate::arguments::MANIFEST;
use crate::assets::{self, Assets, Environments};
use crate::exit::Exit;
use crate::gltf_materials::GltfMaterials;
use crate::init::write_new;
use crate::standard_pipeline::{self, ImportParameters};
use crate::{print, recognise, sample};

/// The folders of the sample whose files stand in for what is not named.
const ENVIRONMENTS: &str = "assets/environments";
const MATERIALS: &str = "assets/materials";

/// Advice on the files that may be named, for whoever named others.
pub(super) const FILES: &str = "name images (.exr, .hdr), material files (.toml, measured BRDFs), presets such as copper, glTF meshes, or \
     one manifest";

/// A manifest and its stages that are watched and shown.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Project {
    pub(crate) manifest: PathBuf,
    /// The stages that are watched; an empty list means all.
    pub(crate) stages: Vec<String>,
    /// The files that the manifest was made for; none if the manifest is somebody's own.
    pub(crate) files: Vec<PathBuf>,
}

impl Project {
    /// The project of some files.
    pub(super) fn of_files(files: &[PathBuf]) -> Result<Self, Exit> {
        let failed = |error: io::Error| {
            print::error(&["cannot prepare a project for these files".into(), error.to_string()], None);
            Exit::System
        };
        let cache = cache_folder();
        let absolute = files.iter().map(|file| match assets::preset(file) {
            Some(preset) => written(cache.join("presets"), &format!("{}.toml", preset.name), preset.text),
            // A word that is no path is named as it was written, for the error.
            None if !file.exists() => Ok(file.clone()),
            None => std::path::absolute(file),
        });
        let assets = named(&absolute.collect::<io::Result<Vec<_>>>().map_err(failed)?)?;
        Self::of_assets(assets, &ImportParameters::default(), &cache).map_err(failed)
    }

    /// The project of files with absolute paths, in a folder of its own below `cache`.
    pub(super) fn of_assets(
        mut assets: Assets,
        parameters: &ImportParameters,
        cache: &Path,
    ) -> io::Result<Self> {
        let files = assets.files();
        let parameters = &with_layout(&mut assets, parameters);
        let name = Digest::of(standard_pipeline::preview(&assets, parameters, Path::new("")).as_bytes());
        let folder = cache.join(&name.to_string()[..16]);
        if assets.materials.is_empty() {
            let of_meshes = GltfMaterials::of(&assets.meshes, |mesh| mesh.to_string_lossy().into_owned());
            for (name, text) in of_meshes.files {
                assets.materials.push(written(folder.join(MATERIALS), &name, &text)?);
            }
        }
        for (list, of) in [(&mut assets.environments, ENVIRONMENTS), (&mut assets.materials, MATERIALS)] {
            if list.is_empty() {
                *list = sample_files(of, &folder);
                for (path, bytes) in sample::in_folder(of) {
                    write_new(&folder.join(path), bytes)?;
                }
            }
        }
        fs::create_dir_all(&folder)?;
        let manifest = folder.join(MANIFEST);
        let text = standard_pipeline::preview(&assets, parameters, &folder);
        // A watcher of another window need not read it again.
        if fs::read(&manifest).ok().as_deref() != Some(text.as_bytes()) {
            engine::replace_file(&manifest, text.as_bytes())?;
        }
        Ok(Self { manifest, stages: Vec::new(), files })
    }
}

/// A material file with this text in a folder of ours. A file that has the text already is left as it is.
fn written(folder: PathBuf, name: &str, text: &str) -> io::Result<PathBuf> {
    let file = folder.join(name);
    fs::create_dir_all(folder)?;
    if fs::read(&file).ok().as_deref() != Some(text.as_bytes()) {
        engine::replace_file(&file, text.as_bytes())?;
    }
    Ok(file)
}

/// The folder for projects of files: in the user's cache, or in the folder for temporary files if the user
/// has no cache that can be written to.
pub(super) fn cache_folder() -> PathBuf {
    let below = |folder: PathBuf| folder.join("specula").join("preview");
    let of_user = dirs::cache_dir().map(below).filter(|folder| is_writable(folder));
    of_user.unwrap_or_else(|| below(std::env::temp_dir()))
}

/// Whether files can be written into a folder, which is created if it does not exist.
fn is_writable(folder: &Path) -> bool {
    fs::create_dir_all(folder).and_then(|()| tempfile::tempfile_in(folder)).is_ok()
}

/// The manifest for some files, relative to the current folder if it is to be kept.
pub(super) fn manifest_to_keep(files: &[PathBuf]) -> Result<String, Exit> {
    if let Some(file) = files.iter().find(|file| assets::preset(file).is_some()) {
        let message = format!("--manifest names files, and {} is a preset", path_text(file));
        let help = "write `material = \"NAME\"` into a stage of the kind import-material, or write the file \
                    with `specula init --materials`";
        print::error(&[message], Some(help));
        return Err(Exit::Usage);
    }
    let mut assets = named(files)?;
    let parameters = with_layout(&mut assets, &ImportParameters::default());
    if assets.environments.is_empty() {
        assets.environments = sample_files(ENVIRONMENTS, Path::new(""));
    }
    if assets.materials.is_empty() {
        assets.materials = sample_files(MATERIALS, Path::new(""));
    }
    Ok(standard_pipeline::preview(&assets, &parameters, Path::new("")))
}

/// The parameters with the layout that the images' shapes and names show, if all of them show the same and no
/// other is named. Six faces become the source that they are together.
fn with_layout(assets: &mut Assets, parameters: &ImportParameters) -> ImportParameters {
    let mut parameters = parameters.clone();
    if parameters.environment.iter().any(|line| line.starts_with("layout")) {
        return parameters;
    }
    if let Some(Environments { layout: Some(layout), sources }) = recognise::one_layout(&assets.environments)
    {
        assets.environments = sources;
        parameters.environment.push(format!("layout = {}", toml::Value::from(layout)));
    }
    parameters
}

fn named(files: &[PathBuf]) -> Result<Assets, Exit> {
    Assets::named(files).map_err(|error| {
        print::error(&[error], Some(FILES));
        Exit::Usage
    })
}

/// The files of one of the sample's folders, below another folder.
fn sample_files(of: &str, folder: &Path) -> Vec<PathBuf> {
    sample::in_folder(of).map(|(path, _)| folder.join(path)).collect()
}
