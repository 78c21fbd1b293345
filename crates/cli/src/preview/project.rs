//! The project of a preview of files: a manifest for them in the user's cache.
//!
//! The same files have the same project, so that what was made for them once is there the next time. Light or
//! materials of the sample stand in for those that are not named.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use engine::Digest;

use crate::arguments::MANIFEST;
use crate::assets::Assets;
use crate::exit::Exit;
use crate::init::write_new;
use crate::{print, sample, standard_pipeline};

/// The folders of the sample whose files stand in for what is not named.
const ENVIRONMENTS: &str = "assets/environments";
const MATERIALS: &str = "assets/materials";

/// The manifest for some files, relative to the current folder if it is to be kept.
///
/// # Errors
/// If a file is of no use.
pub(super) fn manifest_to_keep(files: &[PathBuf]) -> Result<String, Exit> {
    let mut assets = named(files)?;
    if assets.environments.is_empty() {
        assets.environments = sample_files(ENVIRONMENTS, Path::new(""));
    }
    if assets.materials.is_empty() {
        assets.materials = sample_files(MATERIALS, Path::new(""));
    }
    Ok(standard_pipeline::preview(&assets, Path::new("")))
}

/// Writes the project, and returns its manifest.
///
/// # Errors
/// If a file is of no use, or the project cannot be written.
pub(super) fn prepare(files: &[PathBuf]) -> Result<PathBuf, Exit> {
    let failed = |error: io::Error| {
        print::error(&["cannot prepare a project for these files".into(), error.to_string()], None);
        Exit::System
    };
    let absolute: Result<Vec<_>, _> = files.iter().map(std::path::absolute).collect();
    let assets = named(&absolute.map_err(failed)?)?;
    let cache = dirs::cache_dir().unwrap_or_else(std::env::temp_dir).join("specula").join("preview");
    let name = Digest::of(standard_pipeline::preview(&assets, Path::new("")).as_bytes()).to_string();
    write(assets, &cache.join(&name[..16])).map_err(failed)
}

fn named(files: &[PathBuf]) -> Result<Assets, Exit> {
    Assets::named(files).map_err(|error| {
        let help =
            "name images (.exr, .hdr), material files (.toml, measured BRDFs), glTF meshes, or one manifest";
        print::error(&[error], Some(help));
        Exit::Usage
    })
}

fn write(mut assets: Assets, folder: &Path) -> io::Result<PathBuf> {
    for (list, of) in [(&mut assets.environments, ENVIRONMENTS), (&mut assets.materials, MATERIALS)] {
        if list.is_empty() {
            *list = sample_files(of, folder);
            for (path, bytes) in sample::in_folder(of) {
                write_new(&folder.join(path), bytes)?;
            }
        }
    }
    fs::create_dir_all(folder)?;
    let (manifest, text) = (folder.join(MANIFEST), standard_pipeline::preview(&assets, folder));
    // A watcher of another window need not read it again.
    if fs::read(&manifest).ok().as_deref() != Some(text.as_bytes()) {
        engine::replace_file(&manifest, text.as_bytes())?;
    }
    Ok(manifest)
}

/// The files of one of the sample's folders, below another folder.
fn sample_files(of: &str, folder: &Path) -> Vec<PathBuf> {
    sample::in_folder(of).map(|(path, _)| folder.join(path)).collect()
}
