//! The text of a journal. What was read last is in memory; what lies before is read again where it is asked for, so that
//! a process which keeps a journal all day keeps only where its lines are.

use std::borrow::Cow;
use std::fs::{self, File};
use std::io::{self, Read, Seek, SeekFrom};
use std::ops::Range;
use std::path::Path;
use std::sync::{Mutex, PoisonError};

use crate::regular;

/// So much of what is known is compared with the file: the last lines.
const OVERLAP: usize = 256;

/// The bytes of the file as far as they are known.
#[derive(Default)]
pub(super) struct Text {
    /// The first two lines.
    head: Vec<u8>,
    /// The last bytes.
    tail: Vec<u8>,
    /// Where what is in memory begins.
    start: usize,
    recent: Vec<u8>,
    /// Open while what is not in memory may be asked for.
    file: Option<Mutex<File>>,
}

impl Text {
    /// The text of a file; where there is none, nothing.
    pub(super) fn read(path: &Path) -> io::Result<Self> {
        match fs::read(path) {
            Ok(recent) => {
                let mut text = Self { head: head(&recent).to_vec(), ..Self::default() };
                text.end_with(&recent);
                Ok(Self { recent, ..text })
            }
            Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(Self::default()),
            Err(error) => Err(error),
        }
    }

    /// A text that is being written, of which the first two lines are.
    pub(super) fn that_begins(head: &[u8]) -> Self {
        let mut text = Self { head: head.to_vec(), ..Self::default() };
        text.pass_over(head);
        text
    }

    pub(super) fn len(&self) -> usize {
        self.start + self.recent.len()
    }

    /// The first two lines, or what there is of them.
    pub(super) fn head(&self) -> &[u8] {
        &self.head
    }

    pub(super) fn ends_with_a_line(&self) -> bool {
        self.tail.ends_with(b"\n")
    }

    /// What was read last, and where it begins.
    pub(super) fn recent(&self) -> (usize, &[u8]) {
        (self.start, &self.recent)
    }

    /// Some bytes; `None` where they cannot be read.
    pub(super) fn get(&self, range: &Range<usize>) -> Option<Cow<'_, [u8]>> {
        if let Some(begin) = range.start.checked_sub(self.start) {
            return self.recent.get(begin..begin + range.len()).map(Cow::Borrowed);
        }
        let mut file = self.file.as_ref()?.lock().unwrap_or_else(PoisonError::into_inner);
        let mut bytes = vec![0; range.len()];
        file.seek(SeekFrom::Start(range.start as u64)).ok()?;
        file.read_exact(&mut bytes).ok()?;
        Some(Cow::Owned(bytes))
    }

    /// Reads what was appended since; whether the file still is the one that is known.
    pub(super) fn take_up(&mut self, path: &Path) -> io::Result<bool> {
        let known = self.len();
        let (mut file, _) = regular::open(path)?;
        if file.metadata()?.len() < known as u64 {
            return Ok(false);
        }
        let mut first = vec![0; self.head.len()];
        file.read_exact(&mut first)?;
        let mut last = Vec::new();
        file.seek(SeekFrom::Start((known - self.tail.len()) as u64))?;
        file.read_to_end(&mut last)?;
        if first != self.head || !last.starts_with(&self.tail) {
            return Ok(false);
        }
        let appended = last.split_off(self.tail.len());
        self.end_with(&appended);
        self.recent.extend_from_slice(&appended);
        self.file = Some(Mutex::new(file));
        Ok(true)
    }

    /// Lets go of what is in memory, and of the file.
    pub(super) fn rest(&mut self) {
        (self.start, self.recent, self.file) = (self.len(), Vec::new(), None);
    }

    /// Knows more bytes without keeping them.
    pub(super) fn pass_over(&mut self, bytes: &[u8]) {
        self.end_with(bytes);
        self.start += bytes.len();
    }

    fn end_with(&mut self, appended: &[u8]) {
        self.tail.extend_from_slice(&appended[appended.len().saturating_sub(OVERLAP)..]);
        self.tail.drain(..self.tail.len().saturating_sub(OVERLAP));
    }
}

/// The first two lines: the format, and the name of this writing.
fn head(text: &[u8]) -> &[u8] {
    let mut ends = text.iter().enumerate().filter(|(_, byte)| **byte == b'\n');
    ends.nth(1).map_or(text, |(end, _)| &text[..=end])
}
