//! The lock on a state folder: only one process at a time writes there, and the others learn which.
//!
//! The system frees the lock when its process ends, however it ends. A watcher holds it only while it builds,
//! so another process waits a little before it gives up.

use std::fmt;
use std::fs::{self, File, OpenOptions, TryLockError};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use serde::{Deserialize, Serialize};

use super::regular::{create_folder, read_file};
use crate::cancel::Cancel;
use crate::error::{Error, ErrorKind};
use crate::platform;
use crate::platform::path_text;
use crate::timestamp::Timestamp;

/// The purpose for which a process holds the lock, for the processes that wait.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum LockPurpose {
    /// A build.
    #[default]
    Build,
    /// A build of the watcher.
    Watch,
    /// A collection, which makes the cache smaller.
    Collect,
    /// A check of the cache, which removes damaged results.
    Verify,
    /// The removal of published files that no manifest exports any more.
    Prune,
}

impl fmt::Display for LockPurpose {
    /// The command as users know it.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Build => "specula build",
            Self::Watch => "specula watch",
            Self::Collect => "specula cache gc",
            Self::Verify => "specula cache verify",
            Self::Prune => "specula prune",
        })
    }
}

/// How long to wait while another process holds the lock.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LockTimeout(
    /// The longest wait; `None` means as long as it takes.
    pub Option<Duration>,
);

impl LockTimeout {
    /// No wait at all.
    pub const NONE: Self = Self(Some(Duration::ZERO));
    /// A wait as long as it takes.
    pub const ENDLESS: Self = Self(None);
}

impl Default for LockTimeout {
    /// Ten seconds: many times what a watcher's rebuild takes, and short enough for a user to wait.
    fn default() -> Self {
        Self(Some(Duration::from_secs(10)))
    }
}

/// Waits shorter than this are not reported.
const UNREPORTED: Duration = Duration::from_millis(250);

/// The purpose of a lock, and how to wait for it.
pub(crate) struct LockRequest<'a> {
    pub(crate) purpose: LockPurpose,
    pub(crate) timeout: LockTimeout,
    pub(crate) cancel: &'a Cancel,
    /// Called once with a description of the holder, when the wait becomes noticeable.
    pub(crate) waiting: &'a dyn Fn(String),
}

pub(crate) struct Lock {
    folder: PathBuf,
    purpose: LockPurpose,
    file: File,
}

impl Drop for Lock {
    /// Closing the file would be enough, except for a child process that was just started and still has it
    /// open.
    fn drop(&mut self) {
        let _ = self.file.unlock();
    }
}

#[derive(Serialize, Deserialize)]
struct Holder {
    process: u32,
    since: Timestamp,
    #[serde(default, alias = "errand")]
    purpose: LockPurpose,
}

impl Lock {
    /// Locks a state folder, and creates it if it does not exist.
    ///
    /// # Errors
    /// If another process holds the lock for longer than the timeout, the request is cancelled meanwhile, or
    /// the folder cannot be written.
    pub(crate) fn take(folder: &Path, request: &LockRequest<'_>) -> Result<Self, Error> {
        let begun = Instant::now();
        let mut pause = Duration::from_millis(2);
        let mut reported = false;
        loop {
            if let Some(file) = try_lock(folder)? {
                return Ok(Self { folder: folder.to_path_buf(), purpose: request.purpose, file });
            }
            let waited = begun.elapsed();
            if request.cancel.is_cancelled() {
                let message = format!("stopped while it waited for {}", holder(folder));
                return Err(Error::new(ErrorKind::Cancelled, message));
            }
            if request.timeout.0.is_some_and(|limit| waited >= limit) {
                let message = format!("{} is already running in {}", holder(folder), path_text(folder));
                return Err(
                    Error::new(ErrorKind::Locked, message).with_help("wait for it, or stop that process")
                );
            }
            if waited >= UNREPORTED && !std::mem::replace(&mut reported, true) {
                (request.waiting)(holder(folder));
            }
            std::thread::sleep(pause);
            pause = (pause * 2).min(Duration::from_millis(50));
        }
    }

    pub(crate) fn folder(&self) -> &Path {
        &self.folder
    }

    /// Writes who holds the lock, and returns the file system's time in nanoseconds since 1970.
    pub(crate) fn announce(&self) -> Result<i64, Error> {
        let path = self.folder.join("holder");
        let holder = Holder { process: std::process::id(), since: Timestamp::now(), purpose: self.purpose };
        let text = serde_json::to_string(&holder).unwrap_or_default();
        let written = fs::write(&path, text).and_then(|()| fs::metadata(&path));
        let written = written.map_err(|error| Error::io(&error, "write", &path))?;
        Ok(platform::modified(&written))
    }
}

/// The lock, if it is free. The file is opened again each time: the folder may have been deleted meanwhile.
fn try_lock(folder: &Path) -> Result<Option<File>, Error> {
    create_folder(folder).map_err(|error| Error::io(&error, "create", folder))?;
    let path = folder.join("lock");
    let opened = OpenOptions::new().write(true).create(true).truncate(false).open(&path);
    let file = opened.map_err(|error| Error::io(&error, "write", &path))?;
    match file.try_lock() {
        Ok(()) => Ok(Some(file)),
        Err(TryLockError::WouldBlock) => Ok(None),
        Err(TryLockError::Error(error)) => Err(Error::io(&error, "lock", &path)),
    }
}

/// A description of the holder: `specula watch (process 123, since 2026-03-01 09:30:05 UTC)`.
fn holder(folder: &Path) -> String {
    let holder = read_file(&folder.join("holder")).ok();
    match holder.and_then(|text| serde_json::from_slice::<Holder>(&text).ok()) {
        Some(Holder { process, since, purpose }) => format!("{purpose} (process {process}, since {since})"),
        None => "another process".into(),
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicUsize, Ordering};

    use super::*;

    fn request<'a>(timeout: LockTimeout, cancel: &'a Cancel, waiting: &'a dyn Fn(String)) -> LockRequest<'a> {
        LockRequest { purpose: LockPurpose::Collect, timeout, cancel, waiting }
    }

    #[test]
    fn a_second_process_learns_who_holds_the_lock_and_why() {
        let folder = tempfile::tempdir().unwrap();
        let cancel = Cancel::default();
        let request = request(LockTimeout::NONE, &cancel, &|_| panic!("it does not wait"));
        let first = Lock::take(folder.path(), &request).unwrap();
        let error = Lock::take(folder.path(), &request).err().unwrap();
        assert!(error.to_string().starts_with("another process is already running in "), "{error}");
        first.announce().unwrap();
        let error = Lock::take(folder.path(), &request).err().unwrap();
        assert_eq!(error.kind(), ErrorKind::Locked);
        let who = format!("specula cache gc (process {}, since 20", std::process::id());
        assert!(error.to_string().starts_with(&who), "{error}");
        drop(first);
        Lock::take(folder.path(), &request).unwrap();
    }

    #[test]
    fn a_wait_is_reported_once_and_ends_when_the_lock_is_free() {
        let folder = tempfile::tempdir().unwrap();
        let cancel = Cancel::default();
        let first = Lock::take(folder.path(), &request(LockTimeout::NONE, &cancel, &|_| {})).unwrap();
        let first = parking_lot::Mutex::new(Some(first));
        let reported = AtomicUsize::new(0);
        let free = |_| {
            reported.fetch_add(1, Ordering::Relaxed);
            drop(first.lock().take());
        };
        Lock::take(folder.path(), &request(LockTimeout::ENDLESS, &cancel, &free)).unwrap();
        assert_eq!(reported.into_inner(), 1);
    }

    #[test]
    fn a_wait_ends_when_it_is_cancelled() {
        let folder = tempfile::tempdir().unwrap();
        let cancel = Cancel::default();
        let _first = Lock::take(folder.path(), &request(LockTimeout::NONE, &cancel, &|_| {})).unwrap();
        let stop = |_| cancel.cancel();
        let error = Lock::take(folder.path(), &request(LockTimeout::ENDLESS, &cancel, &stop)).err().unwrap();
        assert_eq!(error.kind(), ErrorKind::Cancelled);
    }
}
