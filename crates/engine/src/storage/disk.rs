//! The digests of files, as one build sees them.
//!
//! A file is hashed again only if its stamp differs from that of its last hashing, or if that stamp was too
//! recent to be trusted. A file that an item reads is hashed by
//! [`ItemFiles::read`](crate::kinds::ItemFiles::read) from the same bytes that the item gets.

use std::collections::{HashMap, HashSet};
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use parking_lot::{Mutex, MutexGuard};
use serde::Serialize;

use super::files::{Read, ReadKind, digest_now};
use super::journal::{Journal, Line, Tag, subject};
use super::reader::Reader;
use super::regular::hash_until;
use crate::cancel::Cancel;
use crate::key::Digest;
use crate::parallel;
use crate::platform::Stamp;

/// The files on disk as one build sees them.
pub(crate) struct Disk {
    /// The file system's time when the build began.
    now: i64,
    digests: Mutex<HashMap<(PathBuf, ReadKind), Option<Digest>>>,
    /// Everything that items read, or would read again.
    reads: Arc<ReadSet>,
    cancel: Cancel,
}

/// The places that the items of a build read, now or in their last runs.
#[derive(Default)]
pub(crate) struct ReadSet(Mutex<HashSet<(PathBuf, ReadKind)>>);

impl ReadSet {
    pub(crate) fn places(&self) -> MutexGuard<'_, HashSet<(PathBuf, ReadKind)>> {
        self.0.lock()
    }
}

#[derive(Serialize)]
struct Stamped {
    stamp: Stamp,
    digest: Digest,
}

impl Disk {
    /// Adds what items read to `reads`. Once `cancel` is cancelled, files can no longer be read.
    pub(crate) fn new(now: i64, reads: Arc<ReadSet>, cancel: &Cancel) -> Self {
        Self { now, digests: Mutex::default(), reads, cancel: cancel.clone() }
    }

    /// The digest of what a path has at present; `None` if that is nothing or cannot be read.
    ///
    /// Each question is asked at most once in a build.
    pub(crate) fn digest(&self, path: &Path, kind: ReadKind, journal: &Journal) -> Option<Digest> {
        let place = (path.to_path_buf(), kind);
        if let Some(known) = self.digests.lock().get(&place) {
            return *known;
        }
        let (digest, line) = self.digest_and_line(path, kind, journal);
        self.digests.lock().insert(place, digest);
        // Without the line the next build hashes the file again; nothing else depends on it.
        let _ = journal.append(&line.into_iter().collect::<Vec<_>>());
        digest
    }

    /// Asks again for what is affected, when it is asked for next.
    pub(crate) fn invalidate(&self, is_affected: impl Fn(&Path, ReadKind) -> bool) {
        self.digests.lock().retain(|(path, kind), _| !is_affected(path, *kind));
    }

    /// Adds what items read in their last runs.
    pub(crate) fn add_reads(&self, places: impl IntoIterator<Item = (PathBuf, ReadKind)>) {
        self.reads.places().extend(places);
    }

    /// Computes many digests in parallel, before [`Disk::digest`] is asked for them.
    pub(crate) fn hash_all(&self, places: Vec<(PathBuf, ReadKind)>, journal: &Journal) {
        let hashed = parallel::map(places.len(), &|index| {
            let (path, kind) = &places[index];
            self.digest_and_line(path, *kind, journal)
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
        let stamped = reads.iter().filter(|read| read.kind == ReadKind::Content).filter_map(|read| {
            let stamp = reader.stamp(&read.path)?;
            stamp.is_settled(self.now).then_some((&read.path, Stamped { stamp, digest: read.digest? }))
        });
        stamped.map(|(path, stamped)| line(path, &stamped)).collect()
    }

    fn digest_and_line(
        &self,
        path: &Path,
        kind: ReadKind,
        journal: &Journal,
    ) -> (Option<Digest>, Option<Line>) {
        if kind != ReadKind::Content {
            return (digest_now(path, kind), None);
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

pub(crate) fn stamp_subject(path: &Path) -> u128 {
    subject(&[&path.to_string_lossy()])
}

fn line(path: &Path, stamped: &Stamped) -> Line {
    Line::new(Tag::Stamp, stamp_subject(path), Some(stamped))
}
