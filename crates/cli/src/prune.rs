//! `specula prune`: removes published files that no manifest exports any more.

use engine::{LockTimeout, Pruned, path_text, prune};
use serde_json::json;

use crate::arguments::{MANIFEST, QueryArguments};
use crate::cache::{folder, show_wait};
use crate::command_error::CommandError;
use crate::exit::Exit;
use crate::print;
use crate::quantity::count;

pub(crate) fn run(query: &QueryArguments, dry_run: bool) -> Result<Exit, CommandError> {
    let pruned = prune(folder(query), dry_run, LockTimeout::default(), &show_wait)?;
    Ok(match query.json {
        true => print::json(json!(pruned)),
        false => print::data(&describe(&pruned, dry_run)),
    })
}

/// The message of a build on files that no manifest exports any more, in one line.
pub(crate) fn leftovers(folder: &str, files: usize, published_by: &[String], manifest: &str) -> String {
    let of_manifest = if manifest == MANIFEST { String::new() } else { format!(" --manifest {manifest}") };
    let (are, them) = if files == 1 { ("is", "it") } else { ("are", "them") };
    format!(
        "{} in {folder} {are} no longer exported (published by {}): `specula prune{of_manifest}` removes {them}",
        count(files, "file"),
        published_by.join(", ")
    )
}

fn describe(pruned: &Pruned, dry_run: bool) -> String {
    let Pruned { removed, changed } = pruned;
    let verb = if dry_run { "would remove" } else { "removed" };
    let mut text = String::new();
    removed.iter().for_each(|file| text += &format!("{verb} {}\n", path_text(file)));
    changed.iter().for_each(|file| {
        text += &format!("kept {}: it has changed since it was published\n", path_text(file))
    });
    text += &match (removed.len(), changed.len()) {
        (0, 0) => "nothing to remove: the manifests here still export every published file\n".to_owned(),
        (removed, 0) => format!("{verb} {}\n", count(removed, "file")),
        (removed, kept) => format!("{verb} {}, kept {kept}\n", count(removed, "file")),
    };
    text
}
