//! The directories of a TIFF: which values a page has, and where they are (TIFF 6.0, section 2; BigTIFF).

use std::io::{Read, Seek};

use crate::file_part::{bytes_at, range};

pub(super) const SUBFILE_TYPE: u16 = 254;
pub(super) const OLD_SUBFILE_TYPE: u16 = 255;
pub(super) const WIDTH: u16 = 256;
pub(super) const HEIGHT: u16 = 257;
pub(super) const BITS_PER_SAMPLE: u16 = 258;
pub(super) const COMPRESSION: u16 = 259;
pub(super) const PHOTOMETRIC: u16 = 262;
pub(super) const STRIP_OFFSETS: u16 = 273;
pub(super) const ORIENTATION: u16 = 274;
pub(super) const SAMPLES_PER_PIXEL: u16 = 277;
pub(super) const ROWS_PER_STRIP: u16 = 278;
pub(super) const STRIP_BYTE_COUNTS: u16 = 279;
pub(super) const PLANAR_CONFIGURATION: u16 = 284;
pub(super) const COLOR_MAP: u16 = 320;
pub(super) const TILE_WIDTH: u16 = 322;
pub(super) const TILE_LENGTH: u16 = 323;
pub(super) const TILE_OFFSETS: u16 = 324;
pub(super) const TILE_BYTE_COUNTS: u16 = 325;
pub(super) const SUB_DIRECTORIES: u16 = 330;
pub(super) const EXTRA_SAMPLES: u16 = 338;
pub(super) const SAMPLE_FORMAT: u16 = 339;
pub(super) const XMP: u16 = 700;
pub(super) const ICC_PROFILE: u16 = 34675;

/// The most lines of a directory, where files have some tens: a damaged file has no end of them.
const MOST_ENTRIES: usize = 1024;

/// How a file writes its numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Numbers {
    pub(super) little_endian: bool,
    /// Bytes of an offset or a count: 4, or 8 in BigTIFF.
    pub(super) word: usize,
}

impl Numbers {
    pub(super) fn of(file: &mut (impl Read + Seek)) -> Option<Self> {
        let start = bytes_at(file, 0, 4)?;
        let little_endian = start[0] == b'I';
        let version = if little_endian { start[2] } else { start[3] };
        Some(Self { little_endian, word: if version == 43 { 8 } else { 4 } })
    }

    /// The number of the first `size` bytes of eight.
    fn decode(self, bytes: &[u8]) -> u64 {
        let digits = |number: u64, byte: &u8| number << 8 | u64::from(*byte);
        match self.little_endian {
            true => bytes.iter().rev().fold(0, digits),
            false => bytes.iter().fold(0, digits),
        }
    }

    /// A number of `size` bytes.
    pub(super) fn encode(self, number: u64, size: usize) -> Vec<u8> {
        match self.little_endian {
            true => number.to_le_bytes()[..size].to_vec(),
            false => number.to_be_bytes()[8 - size..].to_vec(),
        }
    }

    fn read(self, file: &mut (impl Read + Seek), at: usize, size: usize) -> Option<u64> {
        Some(self.decode(&bytes_at(file, at, size)?[..size]))
    }

    pub(super) fn offset(self, file: &mut (impl Read + Seek), at: usize) -> Option<usize> {
        usize::try_from(self.read(file, at, self.word)?).ok()
    }
}

/// One line of a directory: so many values of a type, and where they are.
#[derive(Clone, Copy, Debug)]
pub(super) struct Entry {
    pub(super) tag: u16,
    pub(super) kind: u16,
    count: usize,
    at: usize,
    /// The place of the entry itself.
    pub(super) place: usize,
}

/// Bytes of a value of each type.
fn size_of(kind: u16) -> usize {
    match kind {
        3 | 8 => 2,
        4 | 9 | 11 | 13 => 4,
        5 | 10 | 12 | 16 | 17 | 18 => 8,
        _ => 1,
    }
}

/// The values of one page, all of which are in the file.
#[derive(Clone, Debug)]
pub(super) struct Directory {
    pub(super) numbers: Numbers,
    pub(super) entries: Vec<Entry>,
    /// Where the next page's directory is, 0 after the last.
    pub(super) next: usize,
}

impl Directory {
    /// The directory at this place; `None` if it, or a value in it, is not all in the file of `length` bytes.
    pub(super) fn read(
        file: &mut (impl Read + Seek),
        numbers: Numbers,
        at: usize,
        length: usize,
    ) -> Option<Self> {
        let word = numbers.word;
        let head = if word == 8 { 8 } else { 2 };
        let count =
            usize::try_from(numbers.read(file, at, head)?).ok().filter(|count| *count <= MOST_ENTRIES)?;
        let size = 4 + 2 * word;
        let first = at.checked_add(head)?;
        let end = first.checked_add(count.checked_mul(size)?).filter(|&end| end <= length)?;
        let mut entries = Vec::new();
        for place in (first..end).step_by(size) {
            let tag = numbers.read(file, place, 2)? as u16;
            let kind = numbers.read(file, place + 2, 2)? as u16;
            let count = numbers.offset(file, place + 4)?;
            let bytes = count.checked_mul(size_of(kind))?;
            let value = place + 4 + word;
            let at = if bytes <= word { value } else { numbers.offset(file, value)? };
            at.checked_add(bytes).filter(|&end| end <= length)?;
            entries.push(Entry { tag, kind, count, at, place });
        }
        Some(Self { numbers, entries, next: numbers.offset(file, end).unwrap_or(0) })
    }

    fn entry(&self, tag: u16) -> Option<&Entry> {
        self.entries.iter().find(|entry| entry.tag == tag)
    }

    pub(super) fn has(&self, tag: u16) -> bool {
        self.entry(tag).is_some()
    }

    /// The unsigned integers of a tag; none if it is absent.
    pub(super) fn numbers(&self, file: &mut (impl Read + Seek), tag: u16) -> Vec<u64> {
        let Some(entry) = self.entry(tag) else { return Vec::new() };
        let size = size_of(entry.kind);
        let numbers = (0..entry.count).map_while(|i| self.numbers.read(file, entry.at + i * size, size));
        numbers.collect()
    }

    /// The first unsigned integer of a tag.
    pub(super) fn number(&self, file: &mut (impl Read + Seek), tag: u16) -> Option<u64> {
        let entry = self.entry(tag).filter(|entry| entry.count > 0)?;
        self.numbers.read(file, entry.at, size_of(entry.kind))
    }

    pub(super) fn bytes(&self, file: &mut (impl Read + Seek), tag: u16) -> Option<Vec<u8>> {
        let entry = self.entry(tag).filter(|entry| size_of(entry.kind) == 1)?;
        range(file, entry.at, entry.count)
    }
}
