//! The journal: everything that the engine remembers, as lines that are only ever appended.
//!
//! A line is `CHECK TAG KEY JSON`: 16 hex digits of the BLAKE3 digest of the rest, a letter for what it is, 32 hex
//! digits that name its subject, and the content. Of the lines on one subject the last holds, but of [`Tag::Result`]
//! the last few. A line whose check fails (a torn tail, a damaged disk) is ignored. When it has grown to twice its
//! size the file is written anew beside itself, without what is out of date or forgotten, and renamed. The first line
//! names the format; that line's shape never changes. The second names this writing of the file and says how many lines
//! it began with.
//!
//! Lines are indexed when the journal is opened and parsed when they are asked for. What a build appends it does not
//! see itself: what it does cannot depend on the order in which its items finish. A process that builds again and again
//! keeps the journal, its index and what was parsed but not its text, and takes it up with what has been appended since
//! by whoever.

use std::any::Any;
use std::collections::HashMap;
use std::fs::{self, File, OpenOptions};
use std::hash::{BuildHasher, RandomState};
use std::io::{self, BufWriter, Write};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use rayon::prelude::*;
use serde::Serialize;
use serde::de::DeserializeOwned;
use text::Text;

use crate::regular::write_new;
use crate::retention::Retention;
use crate::{Digest, Error, ErrorKind, platform};

mod text;

/// Raised when an older version would misunderstand the journal or the folder.
pub(crate) const FORMAT: u32 = 1;

/// So many results are remembered for one key and different contents of the files read.
const RESULTS: usize = 8;

/// The letter of the line that names a writing of the file.
const WRITING: u8 = b'w';

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

/// The length of what stands before the content.
const HEAD: usize = CHECK + 1 + 2 + SUBJECT + 1;

fn check(rest: &[u8]) -> [u8; CHECK] {
    let mut check = [0; CHECK];
    check.copy_from_slice(&blake3::hash(rest).to_hex().as_bytes()[..CHECK]);
    check
}

/// The journal as it was when it was opened, and where to append.
pub(crate) struct Journal {
    path: PathBuf,
    text: Text,
    latest: HashMap<(Tag, Subject), Latest>,
    results: HashMap<Subject, Vec<Range<usize>>>,
    /// The lines in the text, those out of date among them.
    lines: usize,
    end: Option<Mutex<End>>,
}

/// The last line on a subject.
struct Latest {
    range: Range<usize>,
    /// What it says, once [`Journal::known`] was asked.
    known: OnceLock<Arc<dyn Any + Send + Sync>>,
}

/// What can be known to all who ask.
pub(crate) trait Known: DeserializeOwned + Any + Send + Sync {}

impl<T: DeserializeOwned + Any + Send + Sync> Known for T {}

/// A line that holds.
pub(crate) struct Held {
    pub(crate) tag: Tag,
    pub(crate) subject: Subject,
    range: Range<usize>,
}

impl Held {
    /// Where it is in the file: a later line has a greater one.
    pub(crate) fn place(&self) -> usize {
        self.range.start
    }
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
        let text = Text::read(path).map_err(|error| Error::io(&error, "read", path))?;
        check_format(text.head(), path)?;
        let (latest, results) = (HashMap::new(), HashMap::new());
        let mut journal = Self { path: path.into(), text, latest, results, lines: 0, end: None };
        journal.index(0);
        Ok(journal)
    }

    /// Opens a journal to read and append; the caller holds the lock. Where `kept` is the journal of this file as it was
    /// some time ago, only what was appended since is read.
    ///
    /// # Errors
    /// As [`Journal::read`], and where it cannot be written.
    pub(crate) fn write(
        path: &Path,
        kept: Option<Self>,
        retention: impl FnOnce(&Self) -> Retention,
    ) -> Result<Self, Error> {
        let kept = kept.filter(|kept| kept.path == path);
        // Whatever is wrong with a journal that was kept shows when it is read anew.
        let taken_up = kept.and_then(|mut kept| kept.take_up().is_ok_and(|same| same).then_some(kept));
        let mut journal = taken_up.map_or_else(|| Self::read(path), Ok)?;
        if !journal.is_whole() {
            let retention = retention(&journal);
            journal.forget(retention)?;
        } else if journal.is_overgrown() {
            let retention = retention(&journal);
            // It can wait: a full disk is no reason not to build.
            let _ = journal.forget(retention);
        }
        let opened = OpenOptions::new().append(true).open(path);
        let file = opened.map_err(|error| Error::io(&error, "write", path))?;
        journal.end = Some(Mutex::new(End { file, length: journal.text.len() as u64, torn: false }));
        Ok(journal)
    }

    /// Writes the file anew with what is kept.
    ///
    /// # Errors
    /// As [`Journal::compact`].
    pub(crate) fn forget(&mut self, mut retention: Retention) -> Result<(), Error> {
        self.compact(|line| retention.keeps(line.tag, line.subject))
    }

    /// The journal as it can be kept without the lock: its file is not open, its text not in memory.
    pub(crate) fn rest(mut self) -> Self {
        self.end = None;
        self.text.rest();
        self
    }

    /// The bytes and lines of the file, as it was read.
    pub(crate) fn size(&self) -> (usize, usize) {
        (self.text.len(), self.lines)
    }

    /// What the last line of a tag on a subject says.
    pub(crate) fn get<T: DeserializeOwned>(&self, tag: Tag, subject: Subject) -> Option<T> {
        self.latest.get(&(tag, subject)).and_then(|line| self.parse(&line.range))
    }

    /// The same, parsed once for as long as the journal is kept: for what every build asks.
    pub(crate) fn known<T: Known>(&self, tag: Tag, subject: Subject) -> Option<Arc<T>> {
        self.latest.get(&(tag, subject)).and_then(|line| self.know(line))
    }

    /// What the lines of a tag say, in no order; parsed once.
    pub(crate) fn all<T: Known>(&self, tag: Tag) -> Vec<Arc<T>> {
        let lines = self.latest.par_iter().filter(|((other, _), _)| *other == tag);
        lines.filter_map(|(_, line)| self.know(line)).collect()
    }

    /// The subjects of a tag, each with what its last line says, in no order.
    pub(crate) fn subjects<T: DeserializeOwned + Send>(&self, tag: Tag) -> Vec<(Subject, T)> {
        let lines = self.latest.par_iter().filter(|((other, _), _)| *other == tag);
        lines.filter_map(|((_, subject), line)| Some((*subject, self.parse(&line.range)?))).collect()
    }

    /// The subjects of a tag, in no order.
    pub(crate) fn named(&self, tag: Tag) -> impl Iterator<Item = Subject> {
        self.latest.keys().filter(move |(other, _)| *other == tag).map(|(_, subject)| *subject)
    }

    /// Every result, the oldest first; each with its place.
    pub(crate) fn results_by_age<T: DeserializeOwned + Send>(&self) -> Vec<(usize, T)> {
        let mut ranges = self.results.values().flatten().cloned().collect::<Vec<_>>();
        ranges.sort_unstable_by_key(|range| range.start);
        let parsed = ranges.into_par_iter().filter_map(|range| Some((range.start, self.parse(&range)?)));
        parsed.collect()
    }

    /// The last few results of a key, the newest first.
    pub(crate) fn results<T: DeserializeOwned>(&self, subject: Subject) -> impl Iterator<Item = T> {
        let ranges = self.results.get(&subject).map_or(&[][..], Vec::as_slice);
        ranges.iter().rev().filter_map(|range| self.parse(range))
    }

    /// All results that are remembered, in no order.
    pub(crate) fn all_results<T: DeserializeOwned + Send>(&self) -> Vec<T> {
        self.results
            .par_iter()
            .flat_map_iter(|(_, ranges)| ranges.iter().filter_map(|range| self.parse(range)))
            .collect()
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
        serde_json::from_slice(&self.text.get(range)?).ok()
    }

    fn know<T: Known>(&self, line: &Latest) -> Option<Arc<T>> {
        let known = line.known.get().and_then(|known| Arc::clone(known).downcast().ok());
        known.or_else(|| {
            let parsed = Arc::new(self.parse::<T>(&line.range)?);
            // Where it is known as another type, it stays that.
            let _ = line.known.set(Arc::clone(&parsed) as _);
            Some(parsed)
        })
    }

    /// Reads what was appended since; whether this is still the same writing of the file.
    fn take_up(&mut self) -> io::Result<bool> {
        let known = self.text.len();
        let same = self.text.take_up(&self.path)?;
        if same {
            self.index(known);
        }
        Ok(same)
    }

    fn is_whole(&self) -> bool {
        self.text.ends_with_a_line()
            && self.text.head().starts_with(header().as_bytes())
            && lines_at_first(self.text.head()).is_some()
    }

    fn is_overgrown(&self) -> bool {
        lines_at_first(self.text.head()).is_none_or(|first| self.lines > 2 * first + 1000)
    }

    /// Whether it will soon be written anew: better now, where nobody waits.
    pub(crate) fn is_large(&self) -> bool {
        lines_at_first(self.text.head()).is_none_or(|first| 4 * self.lines > 3 * (2 * first + 1000))
    }

    /// Indexes the lines from a place on, which is in memory.
    fn index(&mut self, from: usize) {
        let (start, text) = self.text.recent();
        let text = &text[from - start..];
        // Whole lines, in pieces that are checked in parallel.
        let mut pieces = Vec::new();
        let mut begin = 0;
        while begin < text.len() {
            let rest = &text[begin..];
            let reach = rest.len().min(1 << 18);
            let end =
                rest[reach..].iter().position(|byte| *byte == b'\n').map_or(rest.len(), |at| reach + at + 1);
            pieces.push(begin..begin + end);
            begin += end;
        }
        let lines = pieces.into_par_iter().map(|piece| lines(text, piece)).collect::<Vec<_>>();
        self.lines += text.iter().filter(|byte| **byte == b'\n').count();
        self.latest.reserve(lines.iter().map(Vec::len).sum());
        for (tag, subject, json) in lines.into_iter().flatten() {
            let is_null = &text[json.clone()] == b"null";
            let range = from + json.start..from + json.end;
            if tag == Tag::Result {
                let results = self.results.entry(subject).or_default();
                // A result that came into effect again is told again.
                results.retain(|known| self.text.get(known) != self.text.get(&range));
                if results.len() == RESULTS {
                    results.remove(0);
                }
                results.push(range);
            } else if is_null {
                self.latest.remove(&(tag, subject));
            } else {
                self.latest.insert((tag, subject), Latest { range, known: OnceLock::new() });
            }
        }
    }

    /// Writes the lines that hold and that `keeps` wants beside the file, and renames. It is asked from the newest line to
    /// the oldest.
    ///
    /// # Errors
    /// Where the file cannot be written; it is as it was then.
    pub(crate) fn compact(&mut self, mut keeps: impl FnMut(&Held) -> bool) -> Result<(), Error> {
        let results = self.results.iter().flat_map(|(subject, ranges)| {
            ranges.iter().map(|range| Held { tag: Tag::Result, subject: *subject, range: range.clone() })
        });
        let latest = self.latest.iter().map(|((tag, subject), line)| Held {
            tag: *tag,
            subject: *subject,
            range: line.range.clone(),
        });
        let mut held = latest.chain(results).collect::<Vec<_>>();
        held.sort_unstable_by_key(|line| std::cmp::Reverse(line.place()));
        held.retain(|line| keeps(line));
        held.reverse();
        let temporary = self.path.with_extension("new");
        let written = self.copy(&held, &temporary).and_then(|copy| {
            let file = OpenOptions::new().append(true).open(&temporary)?;
            platform::replace(&temporary, &self.path)?;
            Ok((copy, file))
        });
        let ((text, ranges), file) = written.map_err(|error| {
            let _ = fs::remove_file(&temporary);
            Error::io(&error, "write", &self.path)
        })?;
        // Where it is open for appending, that was the file before.
        if let Some(end) = &self.end {
            let end = &mut *end.lock().unwrap_or_else(PoisonError::into_inner);
            *end = End { file, length: text.len() as u64, torn: false };
        }
        self.text = text;
        self.lines = held.len() + 2;
        let mut before = std::mem::take(&mut self.latest);
        self.results.clear();
        for (line, range) in held.into_iter().zip(ranges) {
            if line.tag == Tag::Result {
                self.results.entry(line.subject).or_default().push(range);
            } else {
                let name = (line.tag, line.subject);
                let known = before.remove(&name).map(|line| line.known).unwrap_or_default();
                self.latest.insert(name, Latest { range, known });
            }
        }
        Ok(())
    }

    /// Writes lines to a file of their own; returns its text and where the contents of the lines are in it. The text is
    /// not gathered in memory: a process that lives long would have to keep room for it.
    fn copy(&self, lines: &[Held], to: &Path) -> io::Result<(Text, Vec<Range<usize>>)> {
        let mut file = BufWriter::new(write_new(to, b"")?);
        let mut buffer = header().into_bytes();
        write_line(&mut buffer, WRITING, new_name(), lines.len().to_string().as_bytes());
        file.write_all(&buffer)?;
        let mut text = Text::that_begins(&buffer);
        let mut ranges = Vec::with_capacity(lines.len());
        for line in lines {
            let json = self.text.get(&line.range);
            let json = json.ok_or_else(|| io::Error::other("what it said before cannot be read again"))?;
            buffer.clear();
            write_line(&mut buffer, line.tag as u8, line.subject, &json);
            file.write_all(&buffer)?;
            ranges.push(text.len() + HEAD..text.len() + buffer.len() - 1);
            text.pass_over(&buffer);
        }
        file.flush()?;
        if !text.take_up(to)? {
            return Err(io::Error::other("it is not what was written"));
        }
        Ok((text, ranges))
    }
}

fn header() -> String {
    format!("specula journal {FORMAT}\n")
}

/// How many lines this writing of the file began with.
fn lines_at_first(head: &[u8]) -> Option<usize> {
    let line = head.strip_suffix(b"\n")?.rsplit(|byte| *byte == b'\n').next()?;
    let intact =
        line.len() > HEAD && line[..CHECK] == check(&line[CHECK + 1..]) && line[CHECK + 1] == WRITING;
    intact.then(|| std::str::from_utf8(&line[HEAD..]).ok()?.parse().ok())?
}

/// A name that no other writing of a journal has.
fn new_name() -> Subject {
    let half = || Subject::from(RandomState::new().hash_one(std::process::id()));
    half() << 64 | half()
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
        if line.len() < HEAD || line[..CHECK] != check(&line[CHECK + 1..]) {
            continue;
        }
        let tag = Tag::of(line[CHECK + 1]);
        let subject = std::str::from_utf8(&line[CHECK + 3..HEAD - 1]).ok();
        let subject = subject.and_then(|subject| Subject::from_str_radix(subject, 16).ok());
        if let (Some(tag), Some(subject)) = (tag, subject) {
            found.push((tag, subject, place + HEAD..place + line.len()));
        }
    }
    found
}

#[cfg(test)]
mod tests;
