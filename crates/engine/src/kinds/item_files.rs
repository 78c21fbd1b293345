//! The files that a running item names, and the record of what it read.

use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use parking_lot::Mutex;

use super::failure::Failure;
use crate::key::Digest;
use crate::platform::path_text;
use crate::storage::{
    BrokenLink, Files, OpenFile, Read, ReadKind, leads_to, lies_in, listing_digest, normal,
};

/// What to do about a file that another program is writing.
pub(crate) const WHEN_WRITTEN: &str = "build again when it is complete";

/// What to do to read a file that the same manifest exports.
pub(crate) const HOW_TO_READ_EXPORTS: &str =
    "connect the stage that makes the file instead, or move the file";

/// The files that a running item has access to. The engine records which of them the item reads.
pub struct ItemFiles<'a> {
    files: &'a dyn Files,
    pub(super) source: Option<PathBuf>,
    pub(super) folder: Option<PathBuf>,
    /// The folder for exports.
    pub(super) out: Option<PathBuf>,
    pub(super) scratch: PathBuf,
    /// Where the scratch folder goes if the item fails and somebody wants to see it.
    pub(crate) kept: Option<PathBuf>,
    pub(crate) reads: Arc<Mutex<Vec<Read>>>,
    /// Whether the item was stopped while it read.
    is_interrupted: AtomicBool,
}

impl<'a> ItemFiles<'a> {
    /// The files of an item without a source, with the system's folder for scratch folders.
    pub(super) fn new(files: &'a dyn Files) -> Self {
        Self {
            files,
            source: None,
            folder: None,
            out: None,
            scratch: std::env::temp_dir(),
            kept: None,
            reads: Arc::default(),
            is_interrupted: AtomicBool::new(false),
        }
    }

    /// The source file or folder of this item.
    ///
    /// # Errors
    /// If the stage has no source.
    pub fn source(&self) -> Result<&Path, Failure> {
        self.source.as_deref().ok_or_else(|| Failure::new("this stage has no source"))
    }

    /// The content of a file. A relative path is taken from the folder of the item's source, or, if it has
    /// none, from the manifest's.
    ///
    /// The engine records the file: the item reruns when its content changes. A file that another program
    /// writes meanwhile is read again until it no longer changes.
    ///
    /// # Errors
    /// If the file cannot be read, or is in the folder for exports; the message names it.
    pub fn read(&self, path: &Path) -> Result<Arc<Vec<u8>>, Failure> {
        let path = self.resolve(path);
        if let Err(failure) = self.check_not_exported(&path) {
            self.record(Read::of(path, ReadKind::Content, None));
            return Err(failure);
        }
        let bytes = self.files.read(&path);
        let digest = bytes.as_ref().ok().map(|bytes| Digest::of(bytes));
        self.record(Read::of(path.clone(), ReadKind::Content, digest));
        if bytes.as_ref().is_err_and(|error| error.kind() == std::io::ErrorKind::Interrupted) {
            self.is_interrupted.store(true, Ordering::Relaxed);
            return Err(Failure::cancelled());
        }
        bytes.map_err(|error| unreadable(&path, error))
    }

    /// A file, for [`Kind::check_source`](crate::kinds::kind::Kind::check_source), which reads a part of it;
    /// relative paths as for [`ItemFiles::read`].
    ///
    /// The engine does not know what is read, so it takes an item for outdated whose run opened a file.
    ///
    /// # Errors
    /// If the file cannot be opened; the message names it.
    pub fn open(&self, path: &Path) -> Result<Box<dyn OpenFile>, Failure> {
        let path = self.resolve(path);
        let file = self.files.open(&path);
        self.record(Read::of(path.clone(), ReadKind::Content, None));
        file.map_err(|error| unreadable(&path, error))
    }

    /// The names in a folder, sorted, each with whether it is a folder; recorded as by [`ItemFiles::read`].
    ///
    /// # Errors
    /// If the folder cannot be read, or is in the folder for exports; the message names it.
    pub fn list(&self, path: &Path) -> Result<Vec<(String, bool)>, Failure> {
        let path = self.resolve(path);
        if let Err(failure) = self.check_not_exported(&path) {
            self.record(Read::of(path, ReadKind::Names, None));
            return Err(failure);
        }
        let names = self.files.list(&path);
        let digest = names.as_ref().ok().map(|names| listing_digest(names));
        self.record(Read::of(path.clone(), ReadKind::Names, digest));
        names.map_err(|error| Failure::from(error).context(format!("cannot read folder {}", path_text(path))))
    }

    /// Whether the path is a folder; relative paths as for [`ItemFiles::read`].
    ///
    /// The answer is recorded as a reading of the folder's names, or of a folder that does not exist.
    pub fn is_folder(&self, path: &Path) -> bool {
        let path = self.resolve(path);
        let is_folder = self.files.is_folder(&path);
        let names = if is_folder { self.files.list(&path).ok() } else { None };
        let digest = names.map(|names| listing_digest(&names));
        self.record(Read::of(path, ReadKind::Names, digest));
        is_folder
    }

    /// The file that PATH finds for a program's name.
    ///
    /// The look-up is recorded: the item reruns when PATH finds another file, or none. The content of the
    /// file is not: see [`ItemFiles::read`].
    ///
    /// # Errors
    /// If PATH finds no file of this name that can be run.
    pub fn find_program(&self, name: &OsStr) -> Result<PathBuf, Failure> {
        let found = self.files.find_program(name);
        let folder = self.folder.as_deref().unwrap_or(Path::new(""));
        self.record(Read::lookup(folder, name, found.clone()));
        found.ok_or_else(|| Failure::new(format!("there is no program {:?} in PATH", path_text(name))))
    }

    /// Checks that a path is not in the folder for exports, links followed: an item that reads a file there
    /// is not ordered after the stage that makes the file.
    ///
    /// # Errors
    /// If it is; the message names it.
    pub fn check_not_exported(&self, path: &Path) -> Result<(), Failure> {
        let path = self.resolve(path);
        if self.out.as_ref().is_none_or(|out| !lies_in(&path, out, leads_to)) {
            return Ok(());
        }
        let message = format!("{} is inside \"out\", the folder for exports", path_text(path));
        Err(Failure::new(message).help(HOW_TO_READ_EXPORTS))
    }

    /// Whether a path is the folder for exports, as it is spelled.
    pub fn is_out(&self, path: &Path) -> bool {
        self.out.as_ref().is_some_and(|out| normal(&self.resolve(path)) == normal(out))
    }

    /// Whether a folder contains the folder for exports or the manifest, links followed.
    pub fn contains_exports(&self, folder: &Path) -> bool {
        let folder = self.resolve(folder);
        [&self.out, &self.folder].into_iter().flatten().any(|inside| lies_in(inside, &folder, leads_to))
    }

    /// The file that a path names: relative paths as for [`ItemFiles::read`].
    pub fn resolve(&self, path: &Path) -> PathBuf {
        match self.source.as_deref().and_then(Path::parent).or(self.folder.as_deref()) {
            Some(folder) if path.is_relative() => folder.join(path),
            _ => path.to_path_buf(),
        }
    }

    /// An existing folder, in which a kind that runs another program creates a folder of its own and removes
    /// it again.
    ///
    /// Whatever a killed build leaves there is removed by the next build.
    pub fn scratch(&self) -> &Path {
        &self.scratch
    }

    /// Where the item's scratch folder goes if the item fails, for people who want to see it. An earlier one
    /// may be there. `None`: the folder is removed.
    pub fn kept_scratch(&self) -> Option<&Path> {
        self.kept.as_deref()
    }

    /// The reads so far, in order.
    pub fn reads(&self) -> Vec<Read> {
        self.reads.lock().clone()
    }

    /// Whether the item was stopped while it read.
    pub(super) fn is_interrupted(&self) -> bool {
        self.is_interrupted.load(Ordering::Relaxed)
    }

    fn record(&self, read: Read) {
        let mut reads = self.reads.lock();
        if !reads.contains(&read) {
            reads.push(read);
        }
    }
}

/// The failure of a file that cannot be read.
fn unreadable(path: &Path, error: std::io::Error) -> Failure {
    let is_busy = error.kind() == std::io::ErrorKind::ResourceBusy;
    let failure = match BrokenLink::on_the_way_to(path) {
        Some(link) => Failure::new(link.to_string()),
        None => Failure::from(error),
    };
    let failure = failure.context(format!("cannot read {}", path_text(path)));
    if is_busy { failure.help(WHEN_WRITTEN) } else { failure }
}

#[cfg(test)]
mod tests {
    use std::io;

    use super::*;

    /// A file `/project/sky/a.txt`; every other file is one of which the reading was stopped.
    struct OneFile;

    impl Files for OneFile {
        fn read(&self, path: &Path) -> io::Result<Arc<Vec<u8>>> {
            match path == Path::new("/project/sky/a.txt") {
                true => Ok(Arc::new(b"clear".to_vec())),
                false => Err(io::ErrorKind::Interrupted.into()),
            }
        }

        fn list(&self, path: &Path) -> io::Result<Vec<(String, bool)>> {
            match self.is_folder(path) {
                true => Ok(vec![("a.txt".into(), false)]),
                false => Err(io::ErrorKind::NotFound.into()),
            }
        }

        fn is_folder(&self, path: &Path) -> bool {
            path == Path::new("/project/sky")
        }

        fn find_program(&self, name: &OsStr) -> Option<PathBuf> {
            (name == "tool").then(|| PathBuf::from("/bin/tool"))
        }
    }

    fn files() -> ItemFiles<'static> {
        let mut files = ItemFiles::new(&OneFile);
        files.folder = Some("/project".into());
        files.out = Some("/project/out".into());
        files
    }

    #[test]
    fn a_relative_path_is_beside_the_source_or_else_beside_the_manifest() {
        let mut files = files();
        assert_eq!(files.source().unwrap_err().to_string(), "this stage has no source");
        assert_eq!(files.resolve(Path::new("a.txt")), Path::new("/project/a.txt"));
        files.source = Some("/project/sky/b.txt".into());
        assert_eq!(files.source().unwrap(), Path::new("/project/sky/b.txt"));
        assert_eq!(files.resolve(Path::new("a.txt")), Path::new("/project/sky/a.txt"));
        assert_eq!(files.resolve(Path::new("/a.txt")), Path::new("/a.txt"));
    }

    #[test]
    fn what_is_read_is_recorded_once() {
        let files = files();
        for _ in 0..2 {
            assert_eq!(**files.read(Path::new("sky/a.txt")).unwrap(), *b"clear");
            assert!(files.is_folder(Path::new("sky")));
            assert_eq!(files.list(Path::new("sky")).unwrap(), [("a.txt".to_owned(), false)]);
            assert!(!files.is_folder(Path::new("sea")));
            assert_eq!(files.find_program(OsStr::new("tool")).unwrap(), Path::new("/bin/tool"));
            assert!(files.find_program(OsStr::new("other")).is_err());
        }
        let reads = files.reads();
        let reads = reads.iter().map(|read| (read.path.as_path(), read.kind, read.digest.is_some()));
        assert_eq!(
            reads.collect::<Vec<_>>(),
            [
                (Path::new("/project/sky/a.txt"), ReadKind::Content, true),
                (Path::new("/project/sky"), ReadKind::Names, true),
                (Path::new("/project/sea"), ReadKind::Names, false),
                (Path::new("/project/tool"), ReadKind::Lookup, true),
                (Path::new("/project/other"), ReadKind::Lookup, false),
            ]
        );
    }

    #[test]
    fn the_folder_for_exports_is_not_read() {
        let files = files();
        let exported = Path::new("out/a.txt");
        let failure = files.read(exported).unwrap_err();
        let place = path_text("/project/out/a.txt");
        assert_eq!(failure.to_string(), format!("{place} is inside \"out\", the folder for exports"));
        assert_eq!(failure.help.as_deref(), Some(HOW_TO_READ_EXPORTS));
        assert_eq!(files.list(exported), Err(failure.clone()));
        assert_eq!(files.check_not_exported(exported), Err(failure));
        assert!(files.is_out(Path::new("sky/../out")) && !files.is_out(exported));
        assert!(files.contains_exports(Path::new("")) && !files.contains_exports(Path::new("sky")));
        assert!(files.reads().iter().all(|read| read.digest.is_none()));
    }

    #[test]
    fn a_reading_that_was_stopped_stops_the_item() {
        let files = files();
        assert!(!files.is_interrupted());
        assert_eq!(files.read(Path::new("sky/b.txt")), Err(Failure::cancelled()));
        assert!(files.is_interrupted());
    }
}
