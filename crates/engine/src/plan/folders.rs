//! What the plan asks of the file system: the names in folders, and whether a path exists. Tests answer from
//! memory.

use std::cell::RefCell;
use std::collections::{BTreeMap, BTreeSet};
use std::ffi::OsString;
use std::io;
use std::path::{Path, PathBuf};

use crate::platform::{canonicalize, folder_identity};
use crate::storage::{BrokenLink, leads_to, normal};

/// A name in a folder.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Name {
    /// The name, without its folder.
    pub name: OsString,
    /// What the name leads to, links followed.
    pub found: Found,
    /// Whether it is a link. `**` does not follow links to folders, because they could form a cycle.
    pub link: bool,
}

/// What a path leads to, links followed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Found {
    /// A file.
    File,
    /// A folder.
    Folder,
    /// A device or a pipe: never a source.
    Other,
    /// A link that leads to nothing, or to what cannot be looked at now: a source that cannot be read.
    Unreachable,
}

/// The folders that sources are searched in.
pub trait Folders {
    /// The names in a folder, in any order.
    ///
    /// # Errors
    /// If the folder cannot be read.
    fn list(&self, folder: &Path) -> io::Result<Vec<Name>>;

    /// What a path leads to; `None` if nothing is there.
    fn find(&self, path: &Path) -> Option<Found>;

    /// The path with all links resolved; `None` if nothing is there, or if this file system has no links.
    fn real(&self, _: &Path) -> Option<PathBuf> {
        None
    }

    /// The first link on the way to a path that cannot be followed.
    fn broken_link(&self, _: &Path) -> Option<BrokenLink> {
        None
    }

    /// Whether two paths lead to one folder, also if a drive is mounted in two places.
    fn are_one(&self, _: &Path, _: &Path) -> bool {
        false
    }

    /// Where a path leads, links followed as far as they exist.
    fn leads_to(&self, path: &Path) -> PathBuf {
        normal(path)
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
            // On most file systems the listing contains the type; only links are followed.
            let own = entry.file_type()?;
            let found = if own.is_symlink() {
                self.find(&entry.path()).unwrap_or(Found::Unreachable)
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
        canonicalize(path).ok()
    }

    fn broken_link(&self, path: &Path) -> Option<BrokenLink> {
        BrokenLink::on_the_way_to(path)
    }

    fn are_one(&self, one: &Path, other: &Path) -> bool {
        folder_identity(one).is_some_and(|one| folder_identity(other) == Some(one))
    }

    fn leads_to(&self, path: &Path) -> PathBuf {
        leads_to(path)
    }
}

/// The questions that were asked of the disk: everything that a plan depends on besides its manifest.
#[derive(Debug, Default)]
pub(crate) struct FolderQueries {
    /// The folders that were listed, each with the names of the links in it.
    pub(crate) listed: BTreeMap<PathBuf, BTreeSet<OsString>>,
    pub(crate) looked_for: BTreeSet<PathBuf>,
}

/// The folders of the disk, which record what was asked of them.
#[derive(Debug, Default)]
pub(crate) struct RecordingFolders(RefCell<FolderQueries>);

impl RecordingFolders {
    pub(crate) fn queries(self) -> FolderQueries {
        self.0.into_inner()
    }
}

impl Folders for RecordingFolders {
    fn list(&self, folder: &Path) -> io::Result<Vec<Name>> {
        // A folder that cannot be listed was asked for too.
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
        // Not recorded, nor is where paths lead: the folder for exports is the engine's own, and everything
        // else is listed or looked for as well.
        DiskFolders.real(path)
    }

    fn broken_link(&self, path: &Path) -> Option<BrokenLink> {
        DiskFolders.broken_link(path)
    }

    fn are_one(&self, one: &Path, other: &Path) -> bool {
        DiskFolders.are_one(one, other)
    }

    fn leads_to(&self, path: &Path) -> PathBuf {
        // Not recorded, as above; whoever asks for another path looks for it first.
        DiskFolders.leads_to(path)
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
