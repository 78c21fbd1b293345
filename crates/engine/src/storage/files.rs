//! The files of the outside world: as items read them, and their present digests.

use std::ffi::OsStr;
use std::fs;
use std::io::{self, BufRead, Cursor, Seek};
use std::path::{Component, Path, PathBuf};
use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::programs::SearchPath;
use super::regular::hash;
use crate::key::Digest;
use crate::platform::path_text;
use crate::timestamp::Timestamp;

/// The files of the outside world.
pub trait Files: Send + Sync {
    /// The content of a file.
    ///
    /// # Errors
    /// If the file cannot be read.
    fn read(&self, path: &Path) -> io::Result<Arc<Vec<u8>>>;

    /// A file, of which perhaps only a part is read.
    ///
    /// # Errors
    /// If the file cannot be opened.
    fn open(&self, path: &Path) -> io::Result<Box<dyn OpenFile>> {
        Ok(Box::new(Cursor::new(self.read(path)?.to_vec())))
    }

    /// The names in a folder, sorted, each with whether it is a folder.
    ///
    /// # Errors
    /// If the folder cannot be read.
    fn list(&self, path: &Path) -> io::Result<Vec<(String, bool)>>;

    /// Whether the path is a folder.
    fn is_folder(&self, path: &Path) -> bool;

    /// The file that PATH finds for a program's name.
    fn find_program(&self, name: &OsStr) -> Option<PathBuf> {
        SearchPath::current().find(name)
    }
}

/// An open file, of which any part can be read.
pub trait OpenFile: BufRead + Seek {}

impl<T: BufRead + Seek> OpenFile for T {}

/// What an item asked of a path.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(from = "ReadFields", into = "ReadFields")]
pub enum ReadKind {
    /// A file's content.
    Content,
    /// The names in a folder.
    Names,
    /// Which file PATH finds for a program. The path is the program's name in the manifest's folder, where
    /// no such file needs to be.
    Lookup,
}

/// The form of a [`ReadKind`] in JSON, which is older than look-ups.
#[derive(Serialize, Deserialize)]
struct ReadFields {
    listing: bool,
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    lookup: bool,
}

impl From<ReadFields> for ReadKind {
    fn from(fields: ReadFields) -> Self {
        match fields {
            ReadFields { lookup: true, .. } => Self::Lookup,
            ReadFields { listing: true, .. } => Self::Names,
            _ => Self::Content,
        }
    }
}

impl From<ReadKind> for ReadFields {
    fn from(kind: ReadKind) -> Self {
        Self { listing: kind == ReadKind::Names, lookup: kind == ReadKind::Lookup }
    }
}

/// Something that an item asked the outside world, and the answer.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Read {
    /// The path as the item resolved it.
    pub path: PathBuf,
    /// What was asked of the path.
    pub kind: ReadKind,
    /// The digest of the content, of the names (joined by newlines) or of the path that was found; `None` if
    /// there was nothing.
    pub digest: Option<Digest>,
    /// The file that a look-up found.
    pub found: Option<PathBuf>,
}

impl Read {
    /// The read of a file's content, or of the names in a folder.
    pub(crate) fn of(path: PathBuf, kind: ReadKind, digest: Option<Digest>) -> Self {
        Self { path, kind, digest, found: None }
    }

    /// The read of where PATH leads for a program, in the eyes of a manifest's folder.
    pub(crate) fn lookup(folder: &Path, name: &OsStr, found: Option<PathBuf>) -> Self {
        let digest = found.as_deref().map(|found| found_digest(folder, found));
        Self { path: folder.join(name), kind: ReadKind::Lookup, digest, found }
    }
}

/// The prefix of the names of the files by which a watcher tests whether events arrive. They are hidden, so
/// that no glob matches them.
pub(crate) const PROBE_PREFIX: &str = ".specula-probe-";

/// Whether a name is that of a watcher's probe file.
pub(crate) fn is_probe(name: &OsStr) -> bool {
    name.to_str().is_some_and(|name| name.starts_with(PROBE_PREFIX))
}

/// The names in a folder, sorted, each with whether it is a folder.
pub(crate) fn list(path: &Path) -> io::Result<Vec<(String, bool)>> {
    let mut names = Vec::new();
    for entry in fs::read_dir(path)? {
        let entry = entry?;
        // A watcher's own file, which exists only for a moment.
        if is_probe(&entry.file_name()) {
            continue;
        }
        names.push((entry.file_name().to_string_lossy().into_owned(), entry.path().is_dir()));
    }
    names.sort_unstable();
    Ok(names)
}

pub(crate) fn listing_digest(names: &[(String, bool)]) -> Digest {
    let mut hasher = blake3::Hasher::new();
    for (name, folder) in names {
        hasher.update(name.as_bytes()).update(if *folder { b"/\n" } else { b"\n" });
    }
    Digest(*hasher.finalize().as_bytes())
}

/// When a file or folder was modified, by its file system.
pub(crate) fn modified(path: &Path) -> Option<Timestamp> {
    fs::metadata(path).and_then(|metadata| metadata.modified()).ok().map(Timestamp::of)
}

/// The file that PATH finds now for the path of a look-up.
pub(crate) fn look_up(path: &Path) -> Option<PathBuf> {
    SearchPath::current().find(path.file_name()?)
}

/// The digest of the file that a look-up found: of its name in records, so that a project has the same one
/// wherever its folder is.
fn found_digest(folder: &Path, found: &Path) -> Digest {
    Digest::of(path_name(folder, found).as_bytes())
}

/// The digest of the present answer, whatever stamps are; `None` if there is nothing or it cannot be read.
pub(crate) fn digest_now(path: &Path, kind: ReadKind) -> Option<Digest> {
    match kind {
        ReadKind::Content => hash(path).ok(),
        ReadKind::Names => list(path).ok().map(|names| listing_digest(&names)),
        ReadKind::Lookup => {
            look_up(path).map(|found| found_digest(path.parent().unwrap_or(Path::new("")), &found))
        }
    }
}

/// A path as records contain it: relative to the manifest's folder if it is inside, with `/` between folders.
pub(crate) fn path_name(folder: &Path, path: &Path) -> String {
    match path.strip_prefix(folder) {
        Ok(inside) => slashed(inside),
        // Records have the same separator everywhere.
        Err(_) if cfg!(windows) => path_text(path).replace('\\', "/"),
        Err(_) => path.to_string_lossy().into_owned(),
    }
}

/// A path with `/` between its parts.
pub(crate) fn slashed(path: &Path) -> String {
    path.components().map(|part| part.as_os_str().to_string_lossy()).collect::<Vec<_>>().join("/")
}

/// At most this many links are followed, as on Linux.
pub(crate) const MAX_LINKS: usize = 40;

/// Where a path leads when links are followed, as far as it exists; the rest stays as it is written.
pub(crate) fn leads_to(path: &Path) -> PathBuf {
    fn walk(mut here: PathBuf, path: &Path, links: &mut usize) -> PathBuf {
        for part in path.components() {
            match part {
                Component::Normal(name) => {
                    here.push(name);
                    if *links < MAX_LINKS
                        && let Ok(target) = fs::read_link(&here)
                    {
                        *links += 1;
                        here.pop();
                        here = walk(here, &target, links);
                    }
                }
                Component::ParentDir => _ = here.pop(),
                Component::CurDir => {}
                Component::RootDir | Component::Prefix(_) => here.push(part),
            }
        }
        here
    }
    walk(PathBuf::new(), path, &mut 0)
}

/// Whether a path lies in a folder, or is the folder, as it is spelled or where links lead.
pub(crate) fn lies_in(path: &Path, folder: &Path, leads_to: impl Fn(&Path) -> PathBuf) -> bool {
    normal(path).starts_with(normal(folder)) || leads_to(path).starts_with(leads_to(folder))
}

/// The path without `.` and `..`, computed without asking the disk.
pub(crate) fn normal(path: &Path) -> PathBuf {
    let mut normal = PathBuf::new();
    for part in path.components() {
        match part {
            Component::CurDir => {}
            Component::ParentDir => _ = normal.pop(),
            part => normal.push(part),
        }
    }
    normal
}

#[cfg(test)]
mod tests {
    use super::*;

    #[cfg(unix)]
    #[test]
    fn links_are_followed_as_far_as_they_exist() {
        use std::os::unix::fs::symlink;
        let folder = tempfile::tempdir().unwrap();
        let folder = folder.path().canonicalize().unwrap();
        fs::create_dir_all(folder.join("tools/deep")).unwrap();
        symlink("out/a", folder.join("dangling")).unwrap();
        symlink("../dangling", folder.join("tools/twice")).unwrap();
        symlink(folder.join("tools/deep"), folder.join("deep")).unwrap();
        symlink("endless", folder.join("endless")).unwrap();
        for (path, expected) in [
            ("tools/x", "tools/x"),
            ("dangling", "out/a"),
            ("dangling/b/../c.txt", "out/a/c.txt"),
            ("tools/twice/b", "out/a/b"),
            ("deep/../x", "tools/x"),
            ("missing/../x", "x"),
        ] {
            assert_eq!(leads_to(&folder.join(path)), folder.join(expected), "{path}");
        }
        assert!(leads_to(&folder.join("endless/x")).starts_with(&folder));
        assert!(lies_in(&folder.join("tools/twice/b"), &folder.join("out"), leads_to));
        assert!(lies_in(&folder.join("deep/../out"), &folder.join("out"), leads_to), "as it is spelled");
        assert!(!lies_in(&folder.join("output"), &folder.join("out"), leads_to));
    }

    #[test]
    fn paths_inside_are_relative() {
        assert_eq!(path_name(Path::new("/a/b"), Path::new("/a/b/c/d.exr")), "c/d.exr");
        assert_eq!(path_name(Path::new("/a/b"), Path::new("/a/c.exr")), "/a/c.exr");
    }

    #[test]
    fn what_was_asked_is_stored_as_before_there_were_look_ups() {
        for (kind, json) in [
            (ReadKind::Content, r#"{"listing":false}"#),
            (ReadKind::Names, r#"{"listing":true}"#),
            (ReadKind::Lookup, r#"{"listing":false,"lookup":true}"#),
        ] {
            assert_eq!(serde_json::to_string(&kind).unwrap(), json);
            assert_eq!(serde_json::from_str::<ReadKind>(json).unwrap(), kind);
        }
    }

    #[test]
    fn a_look_up_in_the_projects_folder_does_not_depend_on_where_that_is() {
        let look_up = |folder: &str, found: &str| {
            Read::lookup(folder.as_ref(), "grade".as_ref(), Some(found.into())).digest
        };
        assert_eq!(look_up("/a", "/a/bin/grade"), look_up("/b/c", "/b/c/bin/grade"));
        assert_ne!(look_up("/a", "/a/bin/grade"), look_up("/a", "/a/other/grade"));
        assert_ne!(look_up("/a", "/usr/bin/grade"), look_up("/a", "/bin/grade"));
    }
}
