//! Files as a running item reads them: complete, and of one moment.
//!
//! Another program may write a file while it is read, so that half of the bytes are old and half are new. A
//! file that changed meanwhile is read again, after a pause for the writer. Its stamp shows the change; if
//! the stamp is so recent that a further change may not show, the bytes are compared with the file after the
//! read.

use std::collections::HashMap;
use std::fs;
use std::io::{self, BufReader, Read as _};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use parking_lot::Mutex;

use super::files::{Files, OpenFile, list};
use super::regular;
use super::regular::read_until;
use crate::cancel::Cancel;
use crate::platform::Stamp;
use crate::timestamp::Timestamp;

/// The files on disk as one running item sees them.
pub(crate) struct Reader {
    /// The file system's time when the build began.
    now: i64,
    cancel: Cancel,
    /// The stamps of the files that were read.
    stamps: Mutex<HashMap<PathBuf, Stamp>>,
}

impl Reader {
    /// Once `cancel` is cancelled, reads end with [`io::ErrorKind::Interrupted`].
    pub(crate) fn new(now: i64, cancel: &Cancel) -> Self {
        Self { now, cancel: cancel.clone(), stamps: Mutex::default() }
    }

    pub(crate) fn stamp(&self, path: &Path) -> Option<Stamp> {
        self.stamps.lock().get(path).copied()
    }

    pub(crate) fn modified(&self, path: &Path) -> Option<Timestamp> {
        self.stamp(path).as_ref().and_then(Stamp::modified)
    }
}

impl Files for Reader {
    fn read(&self, path: &Path) -> io::Result<Arc<Vec<u8>>> {
        let read = |path: &Path| read_until(path, &|| self.cancel.is_cancelled());
        let (bytes, stamp) = read_stable(path, self.now, read, std::thread::sleep)?;
        self.stamps.lock().insert(path.to_path_buf(), stamp);
        Ok(Arc::new(bytes))
    }

    fn open(&self, path: &Path) -> io::Result<Box<dyn OpenFile>> {
        let (file, _) = regular::open(path)?;
        Ok(Box::new(BufReader::new(file)))
    }

    fn list(&self, path: &Path) -> io::Result<Vec<(String, bool)>> {
        list(path)
    }

    fn is_folder(&self, path: &Path) -> bool {
        path.is_dir()
    }
}

/// A file is read at most this many times.
const TRIES: u32 = 8;

/// Reads a file until it does not change meanwhile; `pause` gives a writer time, a quarter of a second in
/// all.
fn read_stable(
    path: &Path,
    now: i64,
    mut read: impl FnMut(&Path) -> io::Result<Vec<u8>>,
    mut pause: impl FnMut(Duration),
) -> io::Result<(Vec<u8>, Stamp)> {
    let stamp = || fs::metadata(path).map(|metadata| Stamp::of(&metadata));
    for attempt in 0..TRIES {
        if attempt > 0 {
            pause(Duration::from_millis(1 << attempt));
        }
        let before = stamp()?;
        let bytes = match read(path) {
            // It grew.
            Err(error) if error.kind() == io::ErrorKind::ResourceBusy => continue,
            bytes => bytes?,
        };
        if (before.is_settled(now) || has_content(path, &bytes)?) && stamp()? == before {
            return Ok((bytes, before));
        }
    }
    let message = format!("it is being written: it changed each of the {TRIES} times it was read");
    Err(io::Error::new(io::ErrorKind::ResourceBusy, message))
}

fn has_content(path: &Path, mut bytes: &[u8]) -> io::Result<bool> {
    let (mut file, _) = regular::open(path)?;
    let mut buffer = vec![0; 1 << 16];
    loop {
        let length = match file.read(&mut buffer) {
            Ok(length) => length,
            Err(error) if error.kind() == io::ErrorKind::Interrupted => continue,
            Err(error) => return Err(error),
        };
        match bytes.split_at_checked(length) {
            Some((here, rest)) if *here == buffer[..length] => bytes = rest,
            _ => return Ok(false),
        }
        if length == 0 {
            return Ok(bytes.is_empty());
        }
    }
}

#[cfg(test)]
mod tests {
    use std::cell::Cell;
    use std::fs::File;

    use super::*;

    /// A file that another program changes during its first reads: the outcome, and the number of reads.
    fn read(times_written: u32, now: i64) -> (io::Result<Vec<u8>>, u32) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("text");
        fs::write(&path, "old, old").unwrap();
        let tries = Cell::new(0);
        let torn = |path: &Path| {
            tries.set(tries.get() + 1);
            let mut bytes = fs::read(path)?;
            if tries.get() <= times_written {
                // The length and the times stay the same: only contents differ.
                let time = fs::metadata(path)?.modified()?;
                let next = format!("n{0:03}{0:04}", tries.get());
                fs::write(path, &next)?;
                File::options().write(true).open(path)?.set_modified(time)?;
                bytes[4..].copy_from_slice(&next.as_bytes()[4..]);
            }
            Ok(bytes)
        };
        let read = read_stable(&path, now, torn, |_| {}).map(|(bytes, _)| bytes);
        (read, tries.get())
    }

    #[test]
    fn a_file_that_changed_meanwhile_is_read_again() {
        // As if the file were old enough for its stamp to be trusted, and as if it were not.
        for now in [i64::MAX, 0] {
            let (bytes, tries) = read(0, now);
            assert_eq!((bytes.unwrap().as_slice(), tries), (&b"old, old"[..], 1));
        }
        let (bytes, tries) = read(3, 0);
        assert_eq!((bytes.unwrap().as_slice(), tries), (&b"n0030003"[..], 4));
    }

    #[test]
    fn a_file_that_keeps_changing_is_reported_as_being_written() {
        let (error, tries) = read(u32::MAX, 0);
        let error = error.unwrap_err();
        assert_eq!((error.kind(), tries), (io::ErrorKind::ResourceBusy, TRIES));
        assert_eq!(error.to_string(), "it is being written: it changed each of the 8 times it was read");
    }

    #[test]
    fn a_file_is_compared_to_its_last_byte() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("text");
        let text = vec![7; 100_000];
        for length in [0, 1, 1 << 16, 100_000] {
            fs::write(&path, &text[..length]).unwrap();
            assert!(has_content(&path, &text[..length]).unwrap());
            assert!(!has_content(&path, &text[..length.saturating_sub(1)]).unwrap() || length == 0);
            assert!(!has_content(&path, &[&text[..length], &[7][..]].concat()).unwrap());
            let mut other = text[..length].to_vec();
            if let Some(last) = other.last_mut() {
                *last = 8;
                assert!(!has_content(&path, &other).unwrap());
            }
        }
    }
}
