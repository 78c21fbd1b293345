//! Globs of the command line, for shells that leave them as they are.

use std::fs;
use std::path::{Component, Path, PathBuf};

use globset::{GlobBuilder, GlobMatcher};

use crate::command_error::CommandError;

/// What makes a part of a path a glob.
const CHARACTERS: [char; 4] = ['*', '?', '[', '{'];

/// Whether a path has a character of globs; a file may still have it as its name.
pub(crate) fn is_glob(path: &Path) -> bool {
    path.to_string_lossy().contains(CHARACTERS)
}

/// The files that match a glob, sorted.
///
/// # Errors
/// If it is not a valid glob.
pub(crate) fn matching(glob: &Path) -> Result<Vec<PathBuf>, CommandError> {
    let (folder, rest) = parts(glob);
    let glob = matcher(&rest)?;
    let is_match = |file: &PathBuf| file.strip_prefix(&folder).is_ok_and(|file| glob.is_match(file));
    Ok(files_below(&folder).into_iter().filter(is_match).collect())
}

/// The folder before the first part of a glob with one of its characters, and the rest.
pub(crate) fn parts(glob: &Path) -> (PathBuf, String) {
    let is_plain = |part: &Component<'_>| !part.as_os_str().to_string_lossy().contains(CHARACTERS);
    let folder = glob.components().take_while(is_plain).collect::<PathBuf>();
    let rest = slashed(glob.strip_prefix(&folder).unwrap_or(glob));
    (if folder.as_os_str().is_empty() { ".".into() } else { folder }, rest)
}

/// A path without `.`, with slashes between its parts.
pub(crate) fn slashed(path: &Path) -> String {
    let parts = path.components().filter(|part| *part != Component::CurDir);
    parts.map(|part| part.as_os_str().to_string_lossy()).collect::<Vec<_>>().join("/")
}

/// What a glob matches, `*` within one part of a path.
///
/// # Errors
/// If it is not a valid glob.
pub(crate) fn matcher(glob: &str) -> Result<GlobMatcher, CommandError> {
    let glob = GlobBuilder::new(glob).literal_separator(true).build();
    glob.map(|glob| glob.compile_matcher()).map_err(|error| CommandError::usage([error.to_string()]))
}

/// The files below a folder, without those in hidden folders, sorted.
pub(crate) fn files_below(folder: &Path) -> Vec<PathBuf> {
    let (mut found, mut open) = (Vec::new(), vec![folder.to_path_buf()]);
    while let Some(folder) = open.pop() {
        for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
            let is_hidden = entry.file_name().to_string_lossy().starts_with('.');
            match entry.file_type() {
                Ok(kind) if kind.is_dir() && is_hidden => {}
                Ok(kind) if kind.is_dir() => open.push(entry.path()),
                _ => found.push(entry.path()),
            }
        }
    }
    found.sort_unstable();
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_glob_begins_at_its_first_special_part() {
        let check = |glob: &str, folder: &str, rest: &str| {
            assert_eq!(parts(Path::new(glob)), (folder.into(), rest.into()), "{glob}");
        };
        check("out/maps/*.exr", "out/maps", "*.exr");
        check("./out/**/a.exr", "./out", "**/a.exr");
        check("*.exr", ".", "*.exr");
        check("/srv/{a,b}/x.exr", "/srv", "{a,b}/x.exr");
    }
}
