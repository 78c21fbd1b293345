//! The state folder `.specula` beside the manifest: the lock, the journal, the store.
//!
//! ```text
//! .specula/
//!   .gitignore   "*": the folder ignores itself
//!   lock         locked by the running build; the system frees it when the process ends, however it ends
//!   holder       who holds the lock, for people
//!   journal      all records
//!   index        the tables of the journal, so that builds do not need to read it
//!   blobs/ab/... results by digest
//!   tmp/         blobs that are being written and items' scratch folders; at the start of a build it contains
//!                only what a killed build left
//! ```

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::{fs, io};

use super::journal::{Journal, Retention};
use super::lock::{Lock, LockRequest};
use super::regular::{check_own, create_folder, links_in};
use super::store::Store;
use crate::error::{Error, ErrorKind};
use crate::platform::path_text;

/// The name of the state folder.
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
    /// Opens the folder beside a manifest for reading: nothing is written, and a build may be running.
    ///
    /// # Errors
    /// If it cannot be read, or was written by a newer version.
    pub(crate) fn read(beside: &Path) -> Result<Self, Error> {
        let folder = beside.join(FOLDER);
        check(&folder)?;
        let journal = Journal::read(&folder.join("journal"))?;
        Ok(Self { journal, store: Arc::new(Store::new(&folder)), now: i64::MIN / 2, _lock: None })
    }

    /// Locks the folder beside a manifest, and creates it if it does not exist.
    pub(crate) fn lock(beside: &Path, request: &LockRequest<'_>) -> Result<Lock, Error> {
        let folder = beside.join(FOLDER);
        check(&folder)?;
        Lock::take(&folder, request)
    }

    /// Opens a locked folder for a build. `saved` is its journal as [`State::close`] returned it.
    ///
    /// # Errors
    /// If it cannot be written, or was written by a newer version.
    pub(crate) fn open(lock: Lock, saved: Option<Journal>) -> Result<Self, Error> {
        let folder = lock.folder();
        let beside = folder.parent().unwrap_or(folder);
        let retention = |journal: &Journal| Retention::of(journal, beside);
        let journal = Journal::write(&folder.join("journal"), saved, retention)?;
        let now = lock.announce()?;
        write_ignore(folder)?;
        let store = Store::new(folder);
        store.prepare()?;
        Ok(Self { journal, store: Arc::new(store), now, _lock: Some(lock) })
    }

    /// Frees the lock, and returns the journal for the next build.
    pub(crate) fn close(self) -> Option<Journal> {
        self.journal.close()
    }
}

/// Creates the state folder beside a manifest, with a `.gitignore` that excludes it, for files that a program
/// keeps there itself.
///
/// # Errors
/// If it cannot be created, or something in it is not what it should be, such as a link.
pub fn prepare_state_folder(beside: &Path) -> Result<PathBuf, Error> {
    let folder = beside.join(FOLDER);
    check(&folder)?;
    create_folder(&folder).map_err(|error| Error::io(&error, "create", &folder))?;
    write_ignore(&folder)?;
    Ok(folder)
}

fn write_ignore(folder: &Path) -> Result<(), Error> {
    let ignore = folder.join(".gitignore");
    if ignore.exists() {
        return Ok(());
    }
    fs::write(&ignore, "*\n").map_err(|error| Error::io(&error, "write", &ignore))
}

/// Refuses a state folder that would lead a build to files elsewhere, or make it wait forever: the folder may
/// have come with a project from someone else.
fn check(folder: &Path) -> Result<(), Error> {
    let refuse = |path: &Path, why: io::Error| {
        let message = format!("{} cannot be used: {why}", path_text(path));
        let help = format!("delete {} to rebuild everything", path_text(folder));
        Err(Error::new(ErrorKind::BadState, message).with_help(help))
    };
    let folders = ["", "blobs", "tmp", "kept"].map(|name| (name, true));
    let files = ["lock", "holder", "journal", "index", ".gitignore"].map(|name| (name, false));
    for (name, is_folder) in folders.into_iter().chain(files) {
        let path = if name.is_empty() { folder.to_path_buf() } else { folder.join(name) };
        if let Err(why) = check_own(&path, is_folder) {
            return refuse(&path, why);
        }
    }
    match links_in(&folder.join("blobs")).first() {
        Some(link) => refuse(link, io::Error::other("it is a link, not a folder")),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cancel::Cancel;
    use crate::storage::lock::{LockPurpose, LockTimeout};

    fn lock(beside: &Path) -> Result<State, Error> {
        let (purpose, timeout) = (LockPurpose::Build, LockTimeout::NONE);
        let request = LockRequest { purpose, timeout, cancel: &Cancel::default(), waiting: &|_| {} };
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

    /// Each of these would have led a build to write or remove files somewhere else.
    #[cfg(unix)]
    #[test]
    fn links_and_pipes_in_the_folder_are_refused_and_not_followed() {
        let elsewhere = tempfile::tempdir().unwrap();
        let precious = elsewhere.path().join("precious");
        for name in ["", "blobs", "blobs/ab", "tmp", "kept", "journal", "lock", "holder", ".gitignore"] {
            for target in [elsewhere.path(), &precious, &elsewhere.path().join("new")] {
                fs::write(&precious, "precious").unwrap();
                let folder = tempfile::tempdir().unwrap();
                let link = folder.path().join(FOLDER).join(name);
                let link = if name.is_empty() { folder.path().join(FOLDER) } else { link };
                fs::create_dir_all(link.parent().unwrap()).unwrap();
                std::os::unix::fs::symlink(target, &link).unwrap();
                let error = lock(folder.path()).err().unwrap();
                assert_eq!(error.kind(), ErrorKind::BadState, "{name}");
                assert!(error.to_string().contains("it is a link"), "{error}");
                assert_eq!(State::read(folder.path()).err().unwrap().kind(), ErrorKind::BadState);
                assert!(prepare_state_folder(folder.path()).is_err());
                assert_eq!(fs::read_to_string(&precious).unwrap(), "precious");
                assert_eq!(fs::read_dir(elsewhere.path()).unwrap().count(), 1);
            }
        }
        for name in ["journal", "lock", "holder", ".gitignore"] {
            let folder = tempfile::tempdir().unwrap();
            fs::create_dir(folder.path().join(FOLDER)).unwrap();
            let pipe = folder.path().join(FOLDER).join(name);
            assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
            let error = lock(folder.path()).err().unwrap();
            assert!(error.to_string().contains("it is a pipe, not a file"), "{error}");
        }
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
