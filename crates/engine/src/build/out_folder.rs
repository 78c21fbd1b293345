//! Whether files can be published into `out` at all: one error before anything runs, instead of one for each
//! item.

use std::fs::{self, Metadata};
use std::io;
use std::path::Path;

use crate::error::{Error, ErrorKind};
use crate::plan::Plan;
use crate::platform::path_text;
use crate::storage::normal;

/// Checks that `out` is a folder, or can become one.
///
/// # Errors
/// If it, or a folder that it lies in, is a file or a link that leads to no folder.
pub(crate) fn check(plan: &Plan) -> Result<(), Error> {
    let exports = plan.items.iter().any(|item| !item.files.is_empty());
    // The folder of a trial build is the engine's own.
    let folder = plan.manifest.parent().filter(|_| exports);
    let inside = folder.and_then(|folder| plan.out.strip_prefix(folder).ok());
    let Some((folder, inside)) = folder.zip(inside) else { return Ok(()) };
    let mut place = folder.to_path_buf();
    for name in inside.components() {
        place.push(name);
        let found = match fs::symlink_metadata(&place) {
            Ok(found) => found,
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(()),
            Err(error) => return Err(Error::io(&error, "look at", &place)),
        };
        if !found.is_dir() && !place.is_dir() {
            let shown = path_text(place.strip_prefix(folder).unwrap_or(&place));
            return Err(match fs::read_link(&place) {
                Ok(target) => not_a_folder_behind(&shown, &place, &target, folder),
                Err(_) => not_a_folder(&format!("{shown} is {}", kind(&found)), plan),
            });
        }
    }
    Ok(())
}

fn not_a_folder(what: &str, plan: &Plan) -> Error {
    let message = format!("{what}, not a folder for exports");
    Error::new(ErrorKind::Io, message).with_help(format!(
        "move it away or delete it, or set another folder as out in {}",
        plan.manifest_name()
    ))
}

/// The error of a link that leads to no folder.
fn not_a_folder_behind(shown: &str, place: &Path, target: &Path, folder: &Path) -> Error {
    let why = match fs::metadata(place) {
        Ok(found) => format!("is {}, not a folder", kind(&found)),
        Err(error) if error.kind() == io::ErrorKind::NotFound => "does not exist".into(),
        Err(error) => format!("cannot be followed: {error}"),
    };
    let end = normal(&place.with_file_name("").join(target));
    let help = if end.starts_with(folder) && why == "does not exist" {
        format!("create the folder {}, or remove the link", path_text(end))
    } else if end.starts_with(folder) {
        "remove the link".into()
    } else {
        // When the target exists, such a link is refused too.
        "remove the link: out is a folder inside the manifest's folder; to keep exports on another disk, mount \
         the disk there"
            .into()
    };
    let message = format!("{shown} is a link to {}, which {why}", path_text(target));
    Error::new(ErrorKind::Io, message).with_help(help)
}

fn kind(found: &Metadata) -> &'static str {
    if found.is_file() { "a file" } else { "a device, a socket or a pipe" }
}
