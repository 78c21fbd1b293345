//! The manifest as every command finds and loads it.

use std::path::{Path, PathBuf};

use engine::{Kinds, Plan};

use crate::arguments::{MANIFEST, ManifestArgument};
use crate::command_error::CommandError;

/// If the manifest has its usual name and does not exist here, names the nearest one around this folder.
pub(crate) fn find(manifest: &mut PathBuf) {
    if manifest != Path::new(MANIFEST) || manifest.exists() {
        return;
    }
    let folder = std::env::current_dir().unwrap_or_default();
    let found = (1..folder.ancestors().count()).map(|up| {
        let mut path: PathBuf = std::iter::repeat_n("..", up).collect();
        path.push(MANIFEST);
        path
    });
    if let Some(found) = found.into_iter().find(|path| path.exists()) {
        *manifest = found;
    }
}

/// The plan of a manifest.
pub(crate) fn load(argument: &ManifestArgument, kinds: &Kinds) -> Result<Plan, CommandError> {
    let manifest = &argument.manifest;
    Plan::load(manifest, kinds).map_err(|diagnostics| {
        let is_absent = !manifest.exists() && !manifest.with_file_name(MANIFEST).exists();
        let help = is_absent.then_some("`specula init` writes a starter manifest");
        CommandError::manifest(diagnostics).with_help(help)
    })
}
