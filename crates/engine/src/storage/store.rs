//! The content-addressed store: artifacts and exported files under the digest of their bytes.
//!
//! A blob is written to `tmp/` and renamed to `blobs/ab/cdef...`, so that a reader finds it complete or not
//! at all. Reading verifies the digest: a blob that was damaged by a crash or a bad disk is removed and made
//! again, so writing does not need to wait for the disk. A blob that no record names is garbage; nothing else
//! refers to it.

use std::collections::{HashMap, HashSet};
use std::hash::{BuildHasherDefault, Hasher};
use std::io::{self, Write as _};
use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use std::sync::atomic::{AtomicU64, Ordering};
use std::{fmt, fs};

use serde::{Deserialize, Serialize};

use super::regular::{create_folder, read_file, replace_through};
use crate::error::{Error, ErrorKind};
use crate::event::ItemName;
use crate::key::Digest;
use crate::{parallel, platform};

/// A stored output: its digest and size.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, bytemuck::Pod, bytemuck::Zeroable)]
pub(crate) struct Blob {
    pub(crate) digest: Digest,
    pub(crate) bytes: u64,
}

/// A number of files and their size.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Amount {
    /// How many there are.
    pub count: u64,
    /// The total size in bytes.
    pub bytes: u64,
}

impl Amount {
    pub(crate) fn add(&mut self, bytes: u64) {
        self.count += 1;
        self.bytes += bytes;
    }
}

impl std::ops::Add for Amount {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self { count: self.count + other.count, bytes: self.bytes + other.bytes }
    }
}

/// The bytes of a blob that are hashed or written between two questions whether to stop.
const AT_ONCE: usize = 1 << 23;

/// The bytes in parts; `None` once `stop` says to stop, but not before the first part.
fn parts<'b>(bytes: &'b [u8], stop: &'b dyn Fn() -> bool) -> impl Iterator<Item = Option<&'b [u8]>> {
    bytes.chunks(AT_ONCE).enumerate().map(move |(index, part)| (index == 0 || !stop()).then_some(part))
}

pub(crate) enum BlobFile {
    Intact(Vec<u8>),
    Damaged,
    Missing,
}

/// The blobs of a state folder.
#[derive(Debug)]
pub(crate) struct Store {
    folder: PathBuf,
    next: AtomicU64,
    /// The number of bytes that have been stored through this.
    stored: AtomicU64,
    /// Gets blobs that are not here from a shared cache.
    elsewhere: OnceLock<BlobSource>,
}

/// A function that gets blobs which are not here.
struct BlobSource(Box<dyn Fn(Digest) -> Option<Vec<u8>> + Send + Sync>);

impl fmt::Debug for BlobSource {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("BlobSource")
    }
}

/// Asked for at least this many blobs, the store lists its folders.
const LIST_FROM: usize = 4096;

/// The folder for the scratch folders of items that failed.
const KEPT: &str = "kept";

/// A hasher that returns the first bytes of a digest.
#[derive(Default)]
struct DigestHasher(u64);

impl Hasher for DigestHasher {
    fn write(&mut self, bytes: &[u8]) {
        if let Some(first) = bytes.first_chunk() {
            self.0 = u64::from_le_bytes(*first);
        }
    }

    fn finish(&self) -> u64 {
        self.0
    }
}

pub(crate) struct Presence<'a> {
    store: &'a Store,
    listed: Option<HashSet<Digest, BuildHasherDefault<DigestHasher>>>,
}

impl Presence<'_> {
    pub(crate) fn has(&self, blob: &Blob) -> bool {
        match &self.listed {
            Some(listed) => listed.contains(&blob.digest),
            None => self.store.has(blob),
        }
    }
}

impl Store {
    pub(crate) fn new(state: &Path) -> Self {
        Self {
            folder: state.to_path_buf(),
            next: AtomicU64::new(0),
            stored: AtomicU64::new(0),
            elsewhere: OnceLock::new(),
        }
    }

    /// Lets the store get blobs that are not here from a shared cache.
    pub(crate) fn connect(&self, get: impl Fn(Digest) -> Option<Vec<u8>> + Send + Sync + 'static) {
        let _ = self.elsewhere.set(BlobSource(Box::new(get)));
    }

    /// Whether a blob exists, by its name and size.
    pub(crate) fn has(&self, blob: &Blob) -> bool {
        fs::metadata(self.path(blob.digest)).is_ok_and(|metadata| metadata.len() == blob.bytes)
    }

    /// Whether a blob exists, by its name.
    pub(crate) fn exists(&self, digest: Digest) -> bool {
        fs::metadata(self.path(digest)).is_ok()
    }

    /// Stores bytes.
    ///
    /// # Errors
    /// If the file cannot be written; nothing is left of it then.
    pub(crate) fn put(&self, bytes: &[u8]) -> Result<Blob, Error> {
        self.put_until(bytes, &|| false)
    }

    /// [`Store::put`], which asks `stop` after each [`AT_ONCE`] bytes of a larger file.
    ///
    /// # Errors
    /// [`ErrorKind::Cancelled`] if it was stopped, or an error of [`Store::put`].
    pub(crate) fn put_until(&self, bytes: &[u8], stop: &dyn Fn() -> bool) -> Result<Blob, Error> {
        let stopped = || Error::new(ErrorKind::Cancelled, "storing a result was stopped");
        let digest = Digest::of_parts(parts(bytes, stop)).ok_or_else(stopped)?;
        let blob = Blob { digest, bytes: bytes.len() as u64 };
        if self.has(&blob) {
            return Ok(blob);
        }
        let number = self.next.fetch_add(1, Ordering::Relaxed);
        let temporary = self.temporary_folder().join(format!("{}-{number}", std::process::id()));
        let project = self.folder.parent();
        let place = self.path(blob.digest);
        let stored = replace_through(&temporary, &place, project, &mut |mut file| {
            parts(bytes, stop).try_for_each(|part| match part {
                Some(part) => file.write_all(part),
                None => Err(io::ErrorKind::Interrupted.into()),
            })
        });
        match stored {
            Err(error) if error.kind() == io::ErrorKind::Interrupted => return Err(stopped()),
            // Another item stored the same bytes, and somebody is reading them.
            Err(_) if self.has(&blob) => return Ok(blob),
            stored => stored.map_err(|error| Error::io(&error, "store a result in", &self.folder))?,
        }
        self.stored.fetch_add(blob.bytes, Ordering::Relaxed);
        Ok(blob)
    }

    pub(crate) fn stored(&self) -> u64 {
        self.stored.load(Ordering::Relaxed)
    }

    /// Every blob, with its size. One that is removed meanwhile may be missing.
    pub(crate) fn blobs(&self) -> HashMap<Digest, u64> {
        self.listed(true).collect()
    }

    /// Answers which blobs exist, for so many questions. For many the folders are listed, and only names
    /// count: asking the system for each file would take most of the time of a build that has nothing to do.
    /// A truncated blob is detected when it is read.
    pub(crate) fn presence(&self, asked: usize) -> Presence<'_> {
        let listed = || self.listed(false).map(|(digest, _)| digest).collect();
        Presence { store: self, listed: (asked >= LIST_FROM).then(listed) }
    }

    /// Every blob in the folders, and with `sizes` its size.
    fn listed(&self, sizes: bool) -> impl Iterator<Item = (Digest, u64)> {
        let folders = entries(&self.folder.join("blobs")).map(|entry| entry.path()).collect::<Vec<_>>();
        let blobs_of = |index: usize| {
            let first = folders[index].file_name().and_then(|name| name.to_str()).unwrap_or_default();
            let blobs = entries(&folders[index]).filter_map(|entry| {
                let digest = blake3::Hash::from_hex(first.to_owned() + entry.file_name().to_str()?).ok()?;
                let bytes = if sizes { entry.metadata().ok()?.len() } else { 0 };
                Some((Digest(*digest.as_bytes()), bytes))
            });
            blobs.collect::<Vec<_>>()
        };
        parallel::map(folders.len(), &blobs_of).into_iter().flatten()
    }

    /// The files that are being written, or were left by a killed build.
    pub(crate) fn temporary_files(&self) -> Amount {
        let sizes = entries(&self.temporary_folder()).filter_map(|entry| Some(entry.metadata().ok()?.len()));
        sizes.map(|bytes| Amount { count: 1, bytes }).fold(Amount::default(), |all, one| all + one)
    }

    /// The bytes of a blob; `None` if it does not exist or is damaged. A damaged one is removed. One that a
    /// shared cache has is received and stored.
    ///
    /// # Errors
    /// If the file exists and cannot be read, or what was received cannot be stored.
    pub(crate) fn get(&self, digest: Digest) -> Result<Option<Vec<u8>>, Error> {
        match self.read(digest)? {
            BlobFile::Intact(bytes) => return Ok(Some(bytes)),
            BlobFile::Damaged => {
                let place = self.path(digest);
                platform::remove(&place).map_err(|error| Error::io(&error, "remove the damaged", &place))?;
            }
            BlobFile::Missing => {}
        }
        let received = self.elsewhere.get().and_then(|elsewhere| elsewhere.0(digest));
        if let Some(bytes) = &received {
            self.put(bytes)?;
        }
        Ok(received)
    }

    /// Reads a blob and compares it with its digest; nothing is written.
    pub(crate) fn read(&self, digest: Digest) -> Result<BlobFile, Error> {
        let place = self.path(digest);
        match read_file(&place) {
            Ok(bytes) if Digest::of(&bytes) == digest => Ok(BlobFile::Intact(bytes)),
            Ok(_) => Ok(BlobFile::Damaged),
            Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(BlobFile::Missing),
            Err(error) => Err(Error::io(&error, "read", &place)),
        }
    }

    /// Removes a blob, for example one whose bytes are intact and cannot be decoded.
    pub(crate) fn remove(&self, digest: Digest) {
        let _ = platform::remove(&self.path(digest));
    }

    /// Creates the folders, and removes what a killed build left in them.
    pub(crate) fn prepare(&self) -> Result<(), Error> {
        let temporary_folder = self.temporary_folder();
        create_folder(&temporary_folder).map_err(|error| Error::io(&error, "create", &temporary_folder))?;
        for entry in entries(&temporary_folder) {
            let path = entry.path();
            let is_folder = entry.file_type().is_ok_and(|kind| kind.is_dir());
            let _ = if is_folder { fs::remove_dir_all(path) } else { fs::remove_file(path) };
        }
        Ok(())
    }

    /// The folder for unfinished files: blobs that are being written, and the scratch folders of running
    /// items.
    pub(crate) fn temporary_folder(&self) -> PathBuf {
        self.folder.join("tmp")
    }

    /// The place of an item's scratch folder that is kept: until the item fails again, or the cache is
    /// collected.
    pub(crate) fn kept_folder(&self, item: &ItemName) -> PathBuf {
        /// Longer names are cut, because paths have a greatest length.
        const MAX_NAME: usize = 60;
        let name = item.to_string();
        let words = name.split(|c: char| !c.is_ascii_alphanumeric() && c != '_');
        let plain = words.filter(|word| !word.is_empty()).collect::<Vec<_>>().join("-");
        let plain = plain.chars().take(MAX_NAME).collect::<String>();
        let digest = Digest::of(name.as_bytes()).to_string();
        self.folder.join(KEPT).join(format!("{plain}-{}", &digest[..8]))
    }

    /// The scratch folders that were kept.
    pub(crate) fn kept_files(&self) -> Amount {
        let mut amount = Amount::default();
        let mut open = vec![self.folder.join(KEPT)];
        while let Some(folder) = open.pop() {
            for entry in entries(&folder) {
                match entry.metadata() {
                    Ok(found) if found.is_dir() => open.push(entry.path()),
                    Ok(found) => amount = amount + Amount { count: 1, bytes: found.len() },
                    Err(_) => {}
                }
            }
        }
        amount
    }

    pub(crate) fn remove_kept(&self) {
        let _ = fs::remove_dir_all(self.folder.join(KEPT));
    }

    pub(crate) fn path(&self, digest: Digest) -> PathBuf {
        let name = digest.to_string();
        self.folder.join("blobs").join(&name[..2]).join(&name[2..])
    }
}

fn entries(folder: &Path) -> impl Iterator<Item = fs::DirEntry> + use<> {
    fs::read_dir(folder).into_iter().flatten().flatten()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn listing_and_asking_find_the_same_blobs() {
        let folder = tempfile::tempdir().unwrap();
        let store = Store::new(folder.path());
        store.prepare().unwrap();
        let blobs = (0..300_u32).map(|n| store.put(&n.to_le_bytes()).unwrap()).collect::<Vec<_>>();
        blobs.iter().step_by(3).for_each(|blob| store.remove(blob.digest));
        fs::write(folder.path().join("blobs/stranger"), "").unwrap();
        for asked in [0, LIST_FROM] {
            let presence = store.presence(asked);
            assert_eq!(presence.listed.is_some(), asked > 0);
            for (n, blob) in blobs.iter().enumerate() {
                assert_eq!(presence.has(blob), !n.is_multiple_of(3));
            }
        }
        assert_eq!(store.blobs().len(), 200);
    }

    #[test]
    fn a_damaged_blob_is_removed() {
        let folder = tempfile::tempdir().unwrap();
        let store = Store::new(folder.path());
        store.prepare().unwrap();
        let blob = store.put(b"light").unwrap();
        assert!(store.has(&blob));
        assert_eq!(store.get(blob.digest).unwrap().unwrap(), b"light");
        assert_eq!(fs::read_dir(store.temporary_folder()).unwrap().count(), 0);

        fs::write(store.path(blob.digest), "lighu").unwrap();
        assert_eq!(store.get(blob.digest).unwrap(), None);
        assert!(!store.has(&blob));
        fs::write(store.path(blob.digest), "").unwrap();
        assert!(!store.has(&blob), "a crash of the machine may leave an empty file");
        store.put(b"light").unwrap();
        assert_eq!(store.get(blob.digest).unwrap().unwrap(), b"light");
    }

    #[test]
    fn a_large_result_that_is_not_wanted_any_more_leaves_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let store = Store::new(folder.path());
        store.prepare().unwrap();
        let (large, small) = (vec![1; 3 * AT_ONCE], vec![2; AT_ONCE]);
        for asked in 0..4_u32 {
            let left = std::cell::Cell::new(asked);
            let stop = || left.replace(left.get().saturating_sub(1)) == 0;
            let error = store.put_until(&large, &stop).unwrap_err();
            assert_eq!(error.kind(), ErrorKind::Cancelled);
            assert!(store.blobs().is_empty(), "{asked}");
            assert_eq!(fs::read_dir(store.temporary_folder()).unwrap().count(), 0);
        }
        let blob = store.put_until(&small, &|| true).unwrap();
        assert_eq!(blob.digest, Digest::of(&small), "what is stored at once is kept");
        assert_eq!(store.put(&large).unwrap().digest, Digest::of(&large));
    }
}
