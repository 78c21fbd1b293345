//! The file of a journal, read in pieces. Only its first two lines and its last bytes stay in memory, to
//! recognize it by.

use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};
use std::ops::Range;
use std::path::Path;

use parking_lot::Mutex;

use crate::storage::regular;

/// The number of last bytes that are compared with the file.
const OVERLAP: usize = 256;

/// The first two lines have at most this many bytes: a format and a name need less.
const LONGEST_HEAD: usize = 256;

/// The file is read in pieces of this size, or of a line if that is longer.
const PIECE: usize = 1 << 19;

/// The known part of the journal's file: its complete lines so far.
#[derive(Default)]
pub(super) struct Text {
    /// The first two lines.
    head: Vec<u8>,
    /// The last bytes.
    tail: Vec<u8>,
    length: u64,
    /// Whether the file continues with an incomplete line.
    torn: bool,
    /// The file, which is open as long as lines may be needed.
    file: Option<Mutex<File>>,
}

impl Text {
    /// A file that was read at another time.
    pub(super) fn resume(head: Vec<u8>, tail: Vec<u8>, length: u64) -> Self {
        Self { head, tail, length, ..Self::default() }
    }

    pub(super) fn length(&self) -> u64 {
        self.length
    }

    /// The first two lines, or as much as there is of them.
    pub(super) fn head(&self) -> &[u8] {
        &self.head
    }

    pub(super) fn tail(&self) -> &[u8] {
        &self.tail
    }

    pub(super) fn is_torn(&self) -> bool {
        self.torn
    }

    /// The bytes of a line; `None` if they cannot be read.
    pub(super) fn get(&self, range: &Range<u64>) -> Option<Vec<u8>> {
        let mut file = self.file.as_ref()?.lock();
        read_at(&mut file, range).ok()
    }

    /// Reads lines in the order of the file: it reads ahead, so that many are cheap.
    pub(super) fn window(&self) -> Window<'_> {
        Window { text: self, start: 0, bytes: Vec::new() }
    }

    /// Reads what was appended since, in pieces of complete lines with their places; returns whether the file
    /// is still the same. A missing file counts as an empty one.
    pub(super) fn read_appended(
        &mut self,
        path: &Path,
        mut each: impl FnMut(u64, &[u8]),
    ) -> io::Result<bool> {
        let (mut file, metadata) = match regular::open(path) {
            Err(error) if error.kind() == io::ErrorKind::NotFound && self.length == 0 => return Ok(true),
            opened => opened?,
        };
        if metadata.len() < self.length {
            return Ok(false);
        }
        let known_end = self.length - self.tail.len() as u64..self.length;
        if read_at(&mut file, &(0..self.head.len() as u64))? != self.head
            || read_at(&mut file, &known_end)? != self.tail
        {
            return Ok(false);
        }
        let mut piece = Vec::new();
        loop {
            let before = piece.len();
            (&mut file).take(PIECE as u64).read_to_end(&mut piece)?;
            let Some(end) = piece.iter().rposition(|byte| *byte == b'\n').map(|end| end + 1) else {
                if piece.len() == before {
                    break;
                }
                continue;
            };
            let lines = &piece[..end];
            self.add_to_head(lines);
            each(self.length, lines);
            self.length += end as u64;
            self.tail.extend_from_slice(&lines[end.saturating_sub(OVERLAP)..]);
            self.tail.drain(..self.tail.len().saturating_sub(OVERLAP));
            piece.drain(..end);
        }
        self.torn = !piece.is_empty();
        self.file = Some(Mutex::new(file));
        Ok(true)
    }

    pub(super) fn close(&mut self) {
        self.file = None;
    }

    fn add_to_head(&mut self, lines: &[u8]) {
        for line in lines.split_inclusive(|byte| *byte == b'\n') {
            let known = self.head.iter().filter(|byte| **byte == b'\n').count();
            if known == 2 || self.head.len() + line.len() > LONGEST_HEAD {
                return;
            }
            self.head.extend_from_slice(line);
        }
    }
}

fn read_at(file: &mut File, range: &Range<u64>) -> io::Result<Vec<u8>> {
    let length = range.end.saturating_sub(range.start);
    file.seek(SeekFrom::Start(range.start))?;
    let mut bytes = Vec::new();
    file.take(length).read_to_end(&mut bytes)?;
    if bytes.len() as u64 == length { Ok(bytes) } else { Err(io::ErrorKind::UnexpectedEof.into()) }
}

pub(super) struct Window<'a> {
    text: &'a Text,
    start: u64,
    bytes: Vec<u8>,
}

impl Window<'_> {
    /// The bytes of a line; `None` if they cannot be read.
    pub(super) fn get(&mut self, range: &Range<u64>) -> Option<&[u8]> {
        let is_inside = self.start <= range.start && range.end <= self.start + self.bytes.len() as u64;
        if !is_inside {
            let end = range.end.max(range.start.saturating_add(PIECE as u64).min(self.text.length));
            (self.start, self.bytes) = (range.start, self.text.get(&(range.start..end))?);
        }
        let start = usize::try_from(range.start - self.start).ok()?;
        self.bytes.get(start..start + usize::try_from(range.end - range.start).ok()?)
    }
}
