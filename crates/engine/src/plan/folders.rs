//! What the plan asks of the file system: names in folders, and whether something is there. Tests answer from memory.

use std::cell::RefCell;
use std::collections::{BTreeMap, BTreeSet};
use std::ffi::OsString;
use std::io;
use std::path::{Path, PathBuf};

/// A name in a folder.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Name {
    /// The name, without its folder.
    pub name: OsString,
    /// What it names.
    pub found: Found,
    /// Whether it is a link. Links to folders are not followed below `**`, where they could lead in a circle.
    pub link: bool,
}

/// What a path leads to, links followed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Found {
    /// A file.
    File,
    /// A folder.
    Folder,
    /// A device, a pipe, or a link to nothing: never a source.
    Other,
}

/// The folders that sources are searched in.
pub trait Folders {
    /// The names in a folder, in any order.
    ///
    /// # Errors
    /// Where it cannot be read.
    fn list(&self, folder: &Path) -> io::Result<Vec<Name>>;

    /// What a path leads to; `None` where nothing is there.
    fn find(&self, path: &Path) -> Option<Found>;

    /// The same place without links; `None` if nothing is there, or if there are no links.
    fn real(&self, _: &Path) -> Option<PathBuf> {
        None
    }
}

/// The folders of the disk.
#[derive(Clone, Copy, Debug, Default)]
pub struct DiskFolders;

impl Folders for DiskFolders {
    fn list(&self, folder: &Path) -> io::Result<Vec<Name>> {
        let mut names = Vec::new();
        for entry in std::fs::read_dir(folder)? {
            let entry = entry?;
            // The listing itself knows the type on most file systems; only a link is followed.
            let own = entry.file_type()?;
            let found = if own.is_symlink() {
                self.find(&entry.path()).unwrap_or(Found::Other)
            } else {
                Found::of(own)
            };
            names.push(Name { name: entry.file_name(), found, link: own.is_symlink() });
        }
        Ok(names)
    }

    fn find(&self, path: &Path) -> Option<Found> {
        std::fs::metadata(path).ok().map(|metadata| Found::of(metadata.file_type()))
    }

    fn real(&self, path: &Path) -> Option<PathBuf> {
        std::fs::canonicalize(path).ok()
    }
}

/// What was asked of the disk: all that a plan depends on beside its manifest.
#[derive(Debug, Default)]
pub(crate) struct Asked {
    /// The folders that were listed, each with the names of links in it.
    pub(crate) listed: BTreeMap<PathBuf, BTreeSet<OsString>>,
    /// The paths that were looked for.
    pub(crate) looked_for: BTreeSet<PathBuf>,
}

/// The folders of the disk, and what was asked of them.
#[derive(Debug, Default)]
pub(crate) struct RecordingFolders(RefCell<Asked>);

impl RecordingFolders {
    /// What was asked.
    pub(crate) fn asked(self) -> Asked {
        self.0.into_inner()
    }
}

impl Folders for RecordingFolders {
    fn list(&self, folder: &Path) -> io::Result<Vec<Name>> {
        // What cannot be listed was asked for too.
        self.0.borrow_mut().listed.entry(folder.into()).or_default();
        let names = DiskFolders.list(folder)?;
        let links = names.iter().filter(|name| name.link).map(|name| name.name.clone());
        self.0.borrow_mut().listed.entry(folder.into()).or_default().extend(links);
        Ok(names)
    }

    fn find(&self, path: &Path) -> Option<Found> {
        self.0.borrow_mut().looked_for.insert(path.into());
        DiskFolders.find(path)
    }

    fn real(&self, path: &Path) -> Option<PathBuf> {
        // Not recorded: only the folder of exports is asked for, whose changes are the engine's own.
        DiskFolders.real(path)
    }
}

impl Found {
    fn of(kind: std::fs::FileType) -> Self {
        if kind.is_file() {
            Self::File
        } else if kind.is_dir() {
            Self::Folder
        } else {
            Self::Other
        }
    }
}
