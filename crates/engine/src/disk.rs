//! The digests of files, as one build sees them.
//!
//! A file is hashed again only if its stamp differs from that of its last hashing, or if that stamp was too
//! recent to be trusted. A file that an item reads is hashed by [`Context::read`](crate::Context::read) from
//! the same bytes that the item gets.

use std::collections::{HashMap, HashSet};
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use parking_lot::{Mutex, MutexGuard};
use serde::Serialize;

use crate::files::digest_now;
use crate::journal::{Journal, Line, Tag, subject};
use crate::platform::Stamp;
use crate::reader::Reader;
use crate::regular::hash_until;
use crate::{Cancel, Digest, Read, parallel};

/// The files on disk as one build sees them.
pub(crate) struct Disk {
    /// The file system's time when the build began.
    now: i64,
    digests: Mutex<HashMap<(PathBuf, bool), Option<Digest>>>,
    /// All files that items read, or would read again.
    reads: Arc<ReadSet>,
    cancel: Cancel,
}

/// The files and (`true`) folder listings that the items of a build read, now or in their last runs.
#[derive(Default)]
pub(crate) struct ReadSet(Mutex<HashSet<(PathBuf, bool)>>);

impl ReadSet {
    /// All of them so far, locked.
    pub(crate) fn places(&self) -> MutexGuard<'_, HashSet<(PathBuf, bool)>> {
        self.0.lock()
    }
}

#[derive(Serialize)]
struct Stamped {
    stamp: Stamp,
    digest: Digest,
}

impl Disk {
    /// Adds the files that items read to `reads`. Once `cancel` is cancelled, files can no longer be read.
    pub(crate) fn new(now: i64, reads: Arc<ReadSet>, cancel: &Cancel) -> Self {
        Self { now, digests: Mutex::default(), reads, cancel: cancel.clone() }
    }

    /// The digest of a file's content or a folder's listing at present; `None` if it cannot be read.
    ///
    /// Each is read at most once in a build.
    pub(crate) fn digest(&self, path: &Path, listing: bool, journal: &Journal) -> Option<Digest> {
        let place = (path.to_path_buf(), listing);
        if let Some(known) = self.digests.lock().get(&place) {
            return *known;
        }
        let (digest, line) = self.digest_and_line(path, listing, journal);
        self.digests.lock().insert(place, digest);
        // Without the line the next build hashes the file again; nothing else depends on it.
        let _ = journal.append(&line.into_iter().collect::<Vec<_>>());
        digest
    }

    /// Reads these files and folders again when they are asked for next.
    pub(crate) fn invalidate(&self, is_affected: impl Fn(&Path, bool) -> bool) {
        self.digests.lock().retain(|(path, listing), _| !is_affected(path, *listing));
    }

    /// Adds files and listings that items read in their last runs.
    pub(crate) fn add_reads(&self, places: impl IntoIterator<Item = (PathBuf, bool)>) {
        self.reads.places().extend(places);
    }

    /// Computes the digests of many files and folders in parallel, before [`Disk::digest`] is asked for them.
    pub(crate) fn hash_all(&self, places: Vec<(PathBuf, bool)>, journal: &Journal) {
        let hashed = parallel::map(places.len(), &|index| {
            let (path, listing) = &places[index];
            self.digest_and_line(path, *listing, journal)
        });
        let mut lines = Vec::new();
        let mut digests = self.digests.lock();
        for (place, (digest, line)) in places.into_iter().zip(hashed) {
            digests.insert(place, digest);
            lines.extend(line);
        }
        drop(digests);
        let _ = journal.append(&lines);
    }

    /// The files on disk as a running item of this build sees them.
    pub(crate) fn reader(&self) -> Reader {
        Reader::new(self.now, &self.cancel)
    }

    /// The lines that record the digests of the files that an item read.
    pub(crate) fn stamps_of(&self, reader: &Reader, reads: &[Read]) -> Vec<Line> {
        let stamped = reads.iter().filter(|read| !read.listing).filter_map(|read| {
            let stamp = reader.stamp(&read.path)?;
            stamp.is_settled(self.now).then_some((&read.path, Stamped { stamp, digest: read.digest? }))
        });
        stamped.map(|(path, stamped)| line(path, &stamped)).collect()
    }

    fn digest_and_line(
        &self,
        path: &Path,
        listing: bool,
        journal: &Journal,
    ) -> (Option<Digest>, Option<Line>) {
        if listing {
            return (digest_now(path, true), None);
        }
        let Ok(metadata) = fs::metadata(path) else { return (None, None) };
        let stamp = Stamp::of(&metadata);
        if let Some((_, digest)) = journal.stamped(stamp_subject(path)).filter(|(known, _)| *known == stamp) {
            return (Some(digest), None);
        }
        let Ok(digest) = hash_until(path, &|| self.cancel.is_cancelled()) else { return (None, None) };
        let same = fs::metadata(path).is_ok_and(|after| Stamp::of(&after) == stamp);
        let line = (same && stamp.is_settled(self.now)).then(|| line(path, &Stamped { stamp, digest }));
        (Some(digest), line)
    }
}

/// The subject of a file's stamp.
pub(crate) fn stamp_subject(path: &Path) -> u128 {
    subject(&[&path.to_string_lossy()])
}

fn line(path: &Path, stamped: &Stamped) -> Line {
    Line::new(Tag::Stamp, stamp_subject(path), Some(stamped))
}
