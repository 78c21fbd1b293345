//! The files of the outside world: as items read them, and their present digests.

use std::fs;
use std::io::{self, BufRead, Cursor, Seek};
use std::path::{Component, Path, PathBuf};
use std::sync::Arc;

use crate::regular::hash;
use crate::watch::is_probe;
use crate::{Digest, Timestamp};

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
}

/// An open file, of which any part can be read.
pub trait OpenFile: BufRead + Seek {}

impl<T: BufRead + Seek> OpenFile for T {}

/// A file or folder listing that an item read.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Read {
    /// The path as the item resolved it.
    pub path: PathBuf,
    /// Whether the names in a folder were read, not a file's content.
    pub listing: bool,
    /// The digest of the content or of the listing (names joined by newlines); `None` if it did not exist.
    pub digest: Option<Digest>,
}

/// The names in a folder, sorted, each with whether it is a folder.
///
/// # Errors
/// If it cannot be read.
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

/// The digest of a folder's listing.
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

/// The digest of a file's content or a folder's listing, whatever its stamp is; `None` if it cannot be read.
pub(crate) fn digest_now(path: &Path, listing: bool) -> Option<Digest> {
    if listing { list(path).ok().map(|names| listing_digest(&names)) } else { hash(path).ok() }
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
