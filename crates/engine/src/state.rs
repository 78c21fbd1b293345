//! The state folder `.specula` beside the manifest: a lock, the journal, the store.
//!
//! ```text
//! .specula/
//!   .gitignore   "*": the folder ignores itself
//!   lock         locked by the build at work; the system frees it when the process ends, however it ends
//!   holder       who holds the lock, for people
//!   journal      what is remembered
//!   blobs/ab/... results by digest
//!   tmp/         blobs that are being written and items' scratch folders; what is here when a build begins is left
//!                over from a killed one
//! ```

use std::fs;
use std::path::Path;
use std::sync::Arc;

use crate::journal::Journal;
use crate::lock::{Lock, Request};
use crate::retention::Retention;
use crate::store::Store;
use crate::{Error, ErrorKind};

/// The folder's name.
pub(crate) const FOLDER: &str = ".specula";

/// An open state folder.
pub(crate) struct State {
    pub(crate) journal: Journal,
    pub(crate) store: Arc<Store>,
    /// The file system's time when the folder was opened, nanoseconds since 1970.
    pub(crate) now: i64,
    /// `None` when the folder is only read.
    _lock: Option<Lock>,
}

impl State {
    /// Opens the folder beside a manifest to look at it: nothing is written, and a build may be at work.
    ///
    /// # Errors
    /// Where it cannot be read, or was written by a newer version.
    pub(crate) fn read(beside: &Path) -> Result<Self, Error> {
        let folder = beside.join(FOLDER);
        check_is_folder(&folder)?;
        let journal = Journal::read(&folder.join("journal"))?;
        Ok(Self { journal, store: Arc::new(Store::new(&folder)), now: i64::MIN / 2, _lock: None })
    }

    /// Locks the folder beside a manifest, and makes it where it is not there.
    ///
    /// # Errors
    /// As [`Lock::take`].
    pub(crate) fn lock(beside: &Path, request: &Request<'_>) -> Result<Lock, Error> {
        let folder = beside.join(FOLDER);
        check_is_folder(&folder)?;
        Lock::take(&folder, request)
    }

    /// Opens a locked folder to work in it. `kept` is its journal as [`State::rest`] left it.
    ///
    /// # Errors
    /// Where it cannot be written, or was written by a newer version.
    pub(crate) fn open(lock: Lock, kept: Option<Journal>) -> Result<Self, Error> {
        let folder = lock.folder();
        let beside = folder.parent().unwrap_or(folder);
        let retention = |journal: &Journal| Retention::of(journal, beside);
        let journal = Journal::write(&folder.join("journal"), kept, retention)?;
        let now = lock.announce()?;
        let ignore = folder.join(".gitignore");
        if !ignore.exists() {
            fs::write(&ignore, "*\n").map_err(|error| Error::io(&error, "write", &ignore))?;
        }
        let store = Store::new(folder);
        store.prepare()?;
        Ok(Self { journal, store: Arc::new(store), now, _lock: Some(lock) })
    }

    /// Frees the lock, and keeps the journal for the next time.
    pub(crate) fn rest(self) -> Journal {
        self.journal.rest()
    }
}

fn check_is_folder(folder: &Path) -> Result<(), Error> {
    match fs::metadata(folder) {
        Ok(metadata) if !metadata.is_dir() => {
            let message = format!("{} is not a folder", folder.display());
            Err(Error::new(ErrorKind::BadState, message)
                .with_help("move it away: a folder of that name keeps the state of builds"))
        }
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Cancel, Errand, Patience};

    fn lock(beside: &Path) -> Result<State, Error> {
        let (errand, patience) = (Errand::Build, Patience::NONE);
        let request = Request { errand, patience, cancel: &Cancel::default(), waiting: &|_| {} };
        State::lock(beside, &request).and_then(|lock| State::open(lock, None))
    }

    #[test]
    fn a_folder_in_use_can_be_read_and_not_locked() {
        let folder = tempfile::tempdir().unwrap();
        let first = lock(folder.path()).unwrap();
        assert_eq!(lock(folder.path()).err().unwrap().kind(), ErrorKind::Locked);
        State::read(folder.path()).unwrap();
        drop(first);
        lock(folder.path()).unwrap();
    }

    #[test]
    fn a_file_in_place_of_the_folder_is_named() {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join(FOLDER), "").unwrap();
        assert_eq!(lock(folder.path()).err().unwrap().kind(), ErrorKind::BadState);
        assert_eq!(State::read(folder.path()).err().unwrap().kind(), ErrorKind::BadState);
    }

    #[test]
    fn the_folder_ignores_itself_and_sweeps_what_a_killed_build_left() {
        let folder = tempfile::tempdir().unwrap();
        drop(lock(folder.path()).unwrap());
        let state = folder.path().join(FOLDER);
        assert_eq!(fs::read_to_string(state.join(".gitignore")).unwrap(), "*\n");
        fs::write(state.join("tmp/123-4"), "half").unwrap();
        drop(lock(folder.path()).unwrap());
        assert_eq!(fs::read_dir(state.join("tmp")).unwrap().count(), 0);
    }
}
