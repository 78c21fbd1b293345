//! The journal: everything that the engine remembers, as lines that are only ever appended.
//!
//! A line is `CHECK TAG KEY JSON`: 16 hex digits of the BLAKE3 digest of the rest, a letter for what it is, 32 hex
//! digits that name its subject, and the content. Of the lines on one subject the last holds, but of [`Tag::Result`]
//! the last few. A line whose check fails (a torn tail, a damaged disk) is ignored. When most lines are out of date
//! the file is written anew beside itself and renamed. The first line names the format; that line's shape never
//! changes.
//!
//! Lines are indexed when the journal is opened and parsed when they are asked for. What a build appends it does not
//! see itself: what it does cannot depend on the order in which its items finish.

use std::collections::HashMap;
use std::fs::{self, File, OpenOptions};
use std::io::{self, Write};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use rayon::prelude::*;
use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::{Digest, Error, ErrorKind, platform};

/// Raised when an older version would misunderstand the journal or the folder.
pub(crate) const FORMAT: u32 = 1;

/// So many results are remembered for one key and different contents of the files read.
const RESULTS: usize = 8;

/// What a line is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[repr(u8)]
pub(crate) enum Tag {
    /// The result in effect, or the failure, of an item.
    Item = b'i',
    /// A result, by its key.
    Result = b'r',
    /// The digest of a file, with the stamp that it had.
    Stamp = b's',
    /// A published file.
    Published = b'p',
    /// A folder that a build publishes into at this time.
    Publishing = b'o',
}

impl Tag {
    fn of(letter: u8) -> Option<Self> {
        [Self::Item, Self::Result, Self::Stamp, Self::Published, Self::Publishing]
            .into_iter()
            .find(|tag| *tag as u8 == letter)
    }
}

/// The subject of a line: a digest, cut short.
pub(crate) type Subject = u128;

/// The subject that is named by some parts.
pub(crate) fn subject(parts: &[&str]) -> Subject {
    let mut hasher = blake3::Hasher::new();
    for part in parts {
        hasher.update(&(part.len() as u64).to_le_bytes()).update(part.as_bytes());
    }
    short(Digest(*hasher.finalize().as_bytes()))
}

/// The subject that a digest names.
pub(crate) fn short(digest: Digest) -> Subject {
    digest.0[..16].iter().fold(0, |value, byte| value << 8 | Subject::from(*byte))
}

/// A line to append.
pub(crate) struct Line {
    tag: Tag,
    subject: Subject,
    json: String,
}

impl Line {
    /// A line with some content; `None` takes back what earlier lines say.
    pub(crate) fn new<T: Serialize>(tag: Tag, subject: Subject, content: Option<&T>) -> Self {
        let json = serde_json::to_string(&content).unwrap_or_else(|_| "null".into());
        Self { tag, subject, json }
    }

    fn write(&self, buffer: &mut Vec<u8>) {
        write_line(buffer, self.tag as u8, self.subject, self.json.as_bytes());
    }
}

fn write_line(buffer: &mut Vec<u8>, tag: u8, subject: Subject, json: &[u8]) {
    let start = buffer.len();
    buffer.extend_from_slice(&[b' '; CHECK + 1]);
    let _ = write!(buffer, "{} {subject:032x} ", char::from(tag));
    buffer.extend_from_slice(json);
    let check = check(&buffer[start + CHECK + 1..]);
    buffer[start..start + CHECK].copy_from_slice(&check);
    buffer.push(b'\n');
}

const CHECK: usize = 16;
const SUBJECT: usize = 32;

fn check(rest: &[u8]) -> [u8; CHECK] {
    let mut check = [0; CHECK];
    check.copy_from_slice(&blake3::hash(rest).to_hex().as_bytes()[..CHECK]);
    check
}

/// The journal as it was when it was opened, and where to append.
pub(crate) struct Journal {
    path: PathBuf,
    text: Vec<u8>,
    latest: HashMap<(Tag, Subject), Range<usize>>,
    results: HashMap<Subject, Vec<Range<usize>>>,
    end: Option<Mutex<End>>,
}

struct End {
    file: File,
    length: u64,
    /// Whether half a line may stand at the end.
    torn: bool,
}

impl Journal {
    /// Opens a journal to read; one that is not there is empty.
    ///
    /// # Errors
    /// Where it cannot be read or has a newer format.
    pub(crate) fn read(path: &Path) -> Result<Self, Error> {
        let text = match fs::read(path) {
            Ok(text) => text,
            Err(error) if error.kind() == io::ErrorKind::NotFound => Vec::new(),
            Err(error) => return Err(Error::io(&error, "read", path)),
        };
        check_format(&text, path)?;
        let mut journal =
            Self { path: path.into(), text, latest: HashMap::new(), results: HashMap::new(), end: None };
        journal.index();
        Ok(journal)
    }

    /// Opens a journal to read and append; the caller holds the lock.
    ///
    /// # Errors
    /// As [`Journal::read`], and where it cannot be written.
    pub(crate) fn write(path: &Path) -> Result<Self, Error> {
        let mut journal = Self::read(path)?;
        let kept = journal.latest.len() + journal.results.values().map(Vec::len).sum::<usize>();
        let lines = journal.text.iter().filter(|byte| **byte == b'\n').count();
        let is_whole = journal.text.ends_with(b"\n") && journal.text.starts_with(header().as_bytes());
        if !is_whole {
            journal.compact()?;
        } else if lines > 2 * kept + 1000 {
            // It can wait: a full disk is no reason not to build.
            let _ = journal.compact();
        }
        let opened = OpenOptions::new().append(true).open(path);
        let file = opened.map_err(|error| Error::io(&error, "write", path))?;
        journal.end = Some(Mutex::new(End { file, length: journal.text.len() as u64, torn: false }));
        Ok(journal)
    }

    /// What the last line of a tag on a subject says.
    pub(crate) fn get<T: DeserializeOwned>(&self, tag: Tag, subject: Subject) -> Option<T> {
        self.latest.get(&(tag, subject)).and_then(|range| self.parse(range))
    }

    /// What the lines of a tag say, in no order.
    pub(crate) fn all<T: DeserializeOwned + Send>(&self, tag: Tag) -> Vec<T> {
        let lines = self.latest.par_iter().filter(|((other, _), _)| *other == tag);
        lines.filter_map(|(_, range)| self.parse(range)).collect()
    }

    /// The subjects of a tag, each with what its last line says, in no order.
    pub(crate) fn subjects<T: DeserializeOwned>(&self, tag: Tag) -> Vec<(Subject, T)> {
        let lines = self.latest.iter().filter(|((other, _), _)| *other == tag);
        lines.filter_map(|((_, subject), range)| Some((*subject, self.parse(range)?))).collect()
    }

    /// The last few results of a key, the newest first.
    pub(crate) fn results<T: DeserializeOwned>(&self, subject: Subject) -> impl Iterator<Item = T> {
        let ranges = self.results.get(&subject).map_or(&[][..], Vec::as_slice);
        ranges.iter().rev().filter_map(|range| self.parse(range))
    }

    /// Appends lines, all or (should the process be killed or the disk be full) the first few.
    ///
    /// # Errors
    /// Where the file cannot be written.
    pub(crate) fn append(&self, lines: &[Line]) -> Result<(), Error> {
        let Some(end) = &self.end else { return Ok(()) };
        if lines.is_empty() {
            return Ok(());
        }
        let mut end = end.lock().unwrap_or_else(PoisonError::into_inner);
        // What is left of a line must not swallow the next one.
        let mut buffer = if end.torn { vec![b'\n'] } else { Vec::new() };
        lines.iter().for_each(|line| line.write(&mut buffer));
        if let Err(error) = end.file.write_all(&buffer) {
            // Windows cannot shorten a file that is open for appending.
            if end.file.set_len(end.length).is_err() {
                end.length = end.file.metadata().map_or(end.length, |metadata| metadata.len());
                end.torn = true;
            }
            return Err(Error::io(&error, "write", &self.path));
        }
        end.length += buffer.len() as u64;
        end.torn = false;
        Ok(())
    }

    fn parse<T: DeserializeOwned>(&self, range: &Range<usize>) -> Option<T> {
        serde_json::from_slice(&self.text[range.clone()]).ok()
    }

    fn index(&mut self) {
        // Whole lines, in pieces that are checked in parallel.
        let mut pieces = Vec::new();
        let mut start = 0;
        while start < self.text.len() {
            let rest = &self.text[start..];
            let reach = rest.len().min(1 << 18);
            let end =
                rest[reach..].iter().position(|byte| *byte == b'\n').map_or(rest.len(), |at| reach + at + 1);
            pieces.push(start..start + end);
            start += end;
        }
        let text = &self.text;
        let lines = pieces.into_par_iter().map(|piece| lines(text, piece)).collect::<Vec<_>>();
        self.latest.reserve(lines.iter().map(Vec::len).sum());
        for (tag, subject, json) in lines.into_iter().flatten() {
            if tag == Tag::Result {
                let results = self.results.entry(subject).or_default();
                if results.len() == RESULTS {
                    results.remove(0);
                }
                results.push(json);
            } else if &self.text[json.clone()] == b"null" {
                self.latest.remove(&(tag, subject));
            } else {
                self.latest.insert((tag, subject), json);
            }
        }
    }

    /// Writes the lines that hold beside the file, and renames.
    fn compact(&mut self) -> Result<(), Error> {
        let mut buffer = header().into_bytes();
        let results = self
            .results
            .iter()
            .flat_map(|(subject, ranges)| ranges.iter().map(|range| (Tag::Result, *subject, range.clone())));
        let latest = self.latest.iter().map(|((tag, subject), range)| (*tag, *subject, range.clone()));
        let mut kept = latest.chain(results).collect::<Vec<_>>();
        kept.sort_unstable_by_key(|(_, _, range)| range.start);
        for (tag, subject, range) in kept {
            write_line(&mut buffer, tag as u8, subject, &self.text[range]);
        }
        let temporary = self.path.with_extension("new");
        let written = fs::write(&temporary, &buffer).and_then(|()| platform::replace(&temporary, &self.path));
        written.map_err(|error| {
            let _ = fs::remove_file(&temporary);
            Error::io(&error, "write", &self.path)
        })?;
        self.text = buffer;
        self.latest.clear();
        self.results.clear();
        self.index();
        Ok(())
    }
}

fn header() -> String {
    format!("specula journal {FORMAT}\n")
}

/// A first line that is damaged is passed over, as any other; one of a newer version is not.
fn check_format(text: &[u8], path: &Path) -> Result<(), Error> {
    let first = text.split(|byte| *byte == b'\n').next().unwrap_or_default();
    let format = std::str::from_utf8(first).ok().and_then(|line| line.strip_prefix("specula journal "));
    match format.and_then(|format| format.parse::<u32>().ok()) {
        Some(format) if format > FORMAT => {
            let folder = path.parent().unwrap_or(path).display();
            let message =
                format!("{folder} was written by a newer version (format {format}, ours is {FORMAT})");
            Err(Error::new(ErrorKind::NewerState, message)
                .with_help(format!("use that version, or delete {folder} to build everything anew")))
        }
        _ => Ok(()),
    }
}

/// The lines of a piece of text whose check holds.
fn lines(text: &[u8], piece: Range<usize>) -> Vec<(Tag, Subject, Range<usize>)> {
    let mut found = Vec::new();
    let mut start = piece.start;
    for line in text[piece].split_inclusive(|byte| *byte == b'\n') {
        let place = start;
        start += line.len();
        // A line without its end was torn, whatever its check says.
        let Some(line) = line.strip_suffix(b"\n") else { continue };
        let head = CHECK + 1 + 2 + SUBJECT + 1;
        if line.len() < head || line[..CHECK] != check(&line[CHECK + 1..]) {
            continue;
        }
        let tag = Tag::of(line[CHECK + 1]);
        let subject = std::str::from_utf8(&line[CHECK + 3..head - 1]).ok();
        let subject = subject.and_then(|subject| Subject::from_str_radix(subject, 16).ok());
        if let (Some(tag), Some(subject)) = (tag, subject) {
            found.push((tag, subject, place + head..place + line.len()));
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    fn journal(path: &Path) -> Journal {
        let journal = Journal::write(path).unwrap();
        journal
            .append(&[
                Line::new(Tag::Item, 1, Some(&"one")),
                Line::new(Tag::Item, 2, Some(&"two")),
                Line::new(Tag::Item, 1, Some(&"uno")),
                Line::new(Tag::Published, 1, Some(&"file")),
            ])
            .unwrap();
        let results = (0..10).map(|n| Line::new(Tag::Result, 7, Some(&n))).collect::<Vec<_>>();
        journal.append(&results).unwrap();
        journal.append(&[Line::new::<()>(Tag::Published, 1, None)]).unwrap();
        journal
    }

    #[test]
    fn the_last_line_holds_and_of_results_the_last_eight() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("journal");
        drop(journal(&path));
        for _ in 0..2 {
            let mut read = Journal::write(&path).unwrap();
            assert_eq!(read.get::<String>(Tag::Item, 1).unwrap(), "uno");
            assert_eq!(read.get::<String>(Tag::Item, 2).unwrap(), "two");
            assert_eq!(read.get::<String>(Tag::Published, 1), None);
            assert_eq!(read.results::<u32>(7).collect::<Vec<_>>(), [9, 8, 7, 6, 5, 4, 3, 2]);
            read.compact().unwrap();
        }
        assert!(!path.with_extension("new").exists());
    }

    #[test]
    fn every_truncated_length_reads_as_a_prefix_and_can_be_appended_to() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("journal");
        drop(journal(&path));
        let whole = fs::read(&path).unwrap();
        for length in 0..whole.len() {
            fs::write(&path, &whole[..length]).unwrap();
            let opened = Journal::write(&path).unwrap();
            if let Some(one) = opened.get::<String>(Tag::Item, 1) {
                assert!(one == "one" || one == "uno");
            }
            opened.append(&[Line::new(Tag::Item, 3, Some(&"three"))]).unwrap();
            drop(opened);
            let again = Journal::read(&path).unwrap();
            assert_eq!(again.get::<String>(Tag::Item, 3).unwrap(), "three", "cut at {length}");
        }
    }

    #[test]
    fn half_a_line_that_cannot_be_taken_back_does_not_swallow_the_next() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("journal");
        let journal = journal(&path);
        let mut end = journal.end.as_ref().unwrap().lock().unwrap();
        end.file.write_all(b"0123456789abcdef i half").unwrap();
        end.torn = true;
        drop(end);
        for n in 3..5 {
            journal.append(&[Line::new(Tag::Item, n, Some(&n))]).unwrap();
        }
        let again = Journal::read(&path).unwrap();
        assert_eq!(again.get::<u32>(Tag::Item, 3), Some(3));
        assert_eq!(again.get::<u32>(Tag::Item, 4), Some(4));
    }

    #[test]
    fn every_damaged_byte_costs_at_most_its_own_line_and_the_next() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("journal");
        drop(journal(&path));
        let whole = fs::read(&path).unwrap();
        for at in (0..whole.len()).step_by(7) {
            let mut damaged = whole.clone();
            damaged[at] ^= 0x20;
            fs::write(&path, &damaged).unwrap();
            let opened = Journal::read(&path).unwrap();
            assert!(opened.results::<u32>(7).count() >= 6, "damaged at {at}");
        }
        fs::write(&path, [0xff; 5000]).unwrap();
        assert!(Journal::write(&path).unwrap().latest.is_empty());
    }

    #[test]
    fn a_newer_format_is_refused_and_left_alone() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("journal");
        fs::write(&path, "specula journal 2\nwhatever").unwrap();
        assert_eq!(Journal::write(&path).err().unwrap().kind(), ErrorKind::NewerState);
        assert_eq!(fs::read_to_string(&path).unwrap(), "specula journal 2\nwhatever");
    }
}
