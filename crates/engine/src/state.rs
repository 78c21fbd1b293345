//! The state folder `.specula` beside the manifest: a lock, the journal, the store.
//!
//! ```text
//! .specula/
//!   .gitignore   "*": the folder ignores itself
//!   lock         locked by the build at work; the system frees it when the process ends, however it ends
//!   holder       who holds the lock, for people
//!   journal      what is remembered
//!   blobs/ab/... results by digest
//!   tmp/         blobs that are being written; what is here when a build begins is left over from a killed one
//! ```

use std::fs::{self, File, OpenOptions, TryLockError};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use serde::{Deserialize, Serialize};

use crate::journal::Journal;
use crate::store::Store;
use crate::{Error, ErrorKind, Timestamp, platform};

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

/// A locked file.
struct Lock(File);

impl Drop for Lock {
    /// Closing the file would do, but for a process that was begun a moment ago and still has it open.
    fn drop(&mut self) {
        let _ = self.0.unlock();
    }
}

#[derive(Serialize, Deserialize)]
struct Holder {
    process: u32,
    since: Timestamp,
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

    /// Opens the folder for a build, and makes it where it is not there.
    ///
    /// # Errors
    /// Where another build holds it, it cannot be written, or it was written by a newer version.
    pub(crate) fn lock(beside: &Path) -> Result<Self, Error> {
        let folder = beside.join(FOLDER);
        check_is_folder(&folder)?;
        fs::create_dir_all(&folder).map_err(|error| Error::io(&error, "create", &folder))?;
        let lock = lock(&folder)?;
        let journal = Journal::write(&folder.join("journal"))?;
        let now = announce(&folder)?;
        let ignore = folder.join(".gitignore");
        if !ignore.exists() {
            fs::write(&ignore, "*\n").map_err(|error| Error::io(&error, "write", &ignore))?;
        }
        let store = Store::new(&folder);
        store.prepare()?;
        Ok(Self { journal, store: Arc::new(store), now, _lock: Some(lock) })
    }
}

fn check_is_folder(folder: &PathBuf) -> Result<(), Error> {
    match fs::metadata(folder) {
        Ok(metadata) if !metadata.is_dir() => {
            let message = format!("{} is not a folder", folder.display());
            Err(Error::new(ErrorKind::BadState, message)
                .with_help("move it away: a folder of that name keeps the state of builds"))
        }
        _ => Ok(()),
    }
}

fn lock(folder: &Path) -> Result<Lock, Error> {
    let path = folder.join("lock");
    let opened = OpenOptions::new().write(true).create(true).truncate(false).open(&path);
    let file = opened.map_err(|error| Error::io(&error, "write", &path))?;
    match file.try_lock() {
        Ok(()) => Ok(Lock(file)),
        Err(TryLockError::WouldBlock) => {
            let holder = fs::read(folder.join("holder")).ok();
            let holder = holder.and_then(|text| serde_json::from_slice::<Holder>(&text).ok());
            let who = holder.map_or_else(String::new, |Holder { process, since }| {
                format!(" (process {process}, since {since})")
            });
            let message = format!("another build is at work in {}{who}", folder.display());
            Err(Error::new(ErrorKind::Locked, message)
                .with_help("wait for it, or stop that process: its lock goes with it"))
        }
        Err(TryLockError::Error(error)) => Err(Error::io(&error, "lock", &path)),
    }
}

/// Writes who holds the lock, and returns the file system's time.
fn announce(folder: &Path) -> Result<i64, Error> {
    let path = folder.join("holder");
    let holder = Holder { process: std::process::id(), since: Timestamp::now() };
    let text = serde_json::to_string(&holder).unwrap_or_default();
    let written = fs::write(&path, text).and_then(|()| fs::metadata(&path));
    let written = written.map_err(|error| Error::io(&error, "write", &path))?;
    Ok(platform::modified(&written))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_second_build_is_told_who_holds_the_lock() {
        let folder = tempfile::tempdir().unwrap();
        let first = State::lock(folder.path()).unwrap();
        let error = State::lock(folder.path()).err().unwrap();
        assert_eq!(error.kind(), ErrorKind::Locked);
        assert!(error.to_string().contains(&format!("process {}", std::process::id())), "{error}");
        State::read(folder.path()).unwrap();
        drop(first);
        State::lock(folder.path()).unwrap();
    }

    #[test]
    fn a_file_in_place_of_the_folder_is_named() {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join(FOLDER), "").unwrap();
        assert_eq!(State::lock(folder.path()).err().unwrap().kind(), ErrorKind::BadState);
        assert_eq!(State::read(folder.path()).err().unwrap().kind(), ErrorKind::BadState);
    }

    #[test]
    fn the_folder_ignores_itself_and_sweeps_what_a_killed_build_left() {
        let folder = tempfile::tempdir().unwrap();
        drop(State::lock(folder.path()).unwrap());
        let state = folder.path().join(FOLDER);
        assert_eq!(fs::read_to_string(state.join(".gitignore")).unwrap(), "*\n");
        fs::write(state.join("tmp/123-4"), "half").unwrap();
        drop(State::lock(folder.path()).unwrap());
        assert_eq!(fs::read_dir(state.join("tmp")).unwrap().count(), 0);
    }
}
