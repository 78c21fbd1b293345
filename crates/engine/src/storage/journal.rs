//! The journal: everything that the engine records, as lines that are only ever appended.
//!
//! A line is `CHECK TAG KEY JSON`: 16 hex digits of the BLAKE3 digest of the rest, a letter for its tag, 32
//! hex digits that name its subject, and the content. A line replaces earlier lines on the same subject; of
//! [`Tag::Result`] the last few remain. A line with a wrong check (a torn tail, a damaged disk) is ignored.
//! When the file has twice as many lines as it needs, it is compacted: written again without those that are
//! outdated or no longer kept, and renamed. The first line names the format; its shape never changes. The
//! second is a random name of the file since its last compaction, with the number of lines that it began
//! with.
//!
//! What every build needs is in tables ([`tables`]), which are also in a file beside the journal, the index:
//! when the journal is opened, only the lines appended since are read. Everything else is read when it is
//! needed. A build does not see the lines that it appends itself: what it does cannot depend on the order in
//! which its items finish. A process that builds repeatedly keeps the tables in memory and reads the lines
//! that were appended since, by whichever process.

use std::fs::{File, OpenOptions};
use std::hash::{BuildHasher, RandomState};
use std::io::{self, BufWriter, Write};
use std::ops::Range;
use std::path::{Path, PathBuf};

use parking_lot::Mutex;
use serde::de::DeserializeOwned;

use line::{CHECK, HEAD, check, write_line};
use tables::{Tables, Update};
use text::Text;

use super::regular::replace_through;
use crate::error::{Error, ErrorKind};
use crate::key::Digest;
use crate::parallel;
use crate::platform::{Stamp, path_text};
pub(crate) use line::{Line, Subject, Tag, short, subject};
#[cfg(test)]
pub(crate) use retention::OTHERS;

pub(crate) use retention::Retention;
pub(crate) use tables::{LatestRecord, PublishedStamp};

mod index;
mod line;
mod retention;
mod tables;
mod text;

/// To be raised when an older version would misunderstand the journal or the folder.
pub(crate) const FORMAT: u32 = 1;

/// The index is written again when more than this many lines are not in it, plus one for so many that are.
const UNINDEXED: u64 = 1000;
const UNINDEXED_OF: u64 = 16;

/// The tag of the second line, which names the file since its last compaction.
const WRITING: u8 = b'w';

/// The journal as it was when it was opened, and where to append.
pub(crate) struct Journal {
    path: PathBuf,
    text: Text,
    tables: Tables,
    /// The lines in the file, outdated ones included.
    lines: u64,
    /// The lines that the index covers.
    indexed: u64,
    /// Whether no other process has written to it since it was saved.
    unchanged: bool,
    appender: Option<Mutex<Appender>>,
}

/// A line that is not outdated.
pub(crate) struct LiveLine {
    pub(crate) tag: Tag,
    pub(crate) subject: Subject,
    range: Range<u64>,
}

impl LiveLine {
    /// The line's place in the file: a later line has a greater one.
    pub(crate) fn place(&self) -> u64 {
        self.range.start
    }
}

struct Appender {
    file: File,
    length: u64,
    /// Whether half a line may be at the end.
    torn: bool,
}

impl Journal {
    /// Opens a journal for reading; if the file does not exist, it is empty.
    ///
    /// # Errors
    /// If it cannot be read or has a newer format.
    pub(crate) fn read(path: &Path) -> Result<Self, Error> {
        let broken = |error: io::Error| Error::io(&error, "read", path);
        if let Some((covered, tables)) = index::read(&index_of(path)) {
            let index::Covered { head, tail, length, lines } = covered;
            let text = Text::resume(head, tail, length);
            let mut journal = Self {
                path: path.into(),
                text,
                tables,
                lines,
                indexed: lines,
                unchanged: false,
                appender: None,
            };
            // Errors of the journal itself are found below, when all of it is read.
            if journal.read_appended().is_ok_and(|same| same) {
                check_format(journal.text.head(), path)?;
                return Ok(journal);
            }
        }
        let (text, tables) = (Text::default(), Tables::default());
        let mut journal =
            Self { path: path.into(), text, tables, lines: 0, indexed: 0, unchanged: false, appender: None };
        journal.read_appended().map_err(broken)?;
        check_format(journal.text.head(), path)?;
        Ok(journal)
    }

    /// Opens a journal for reading and appending; the caller holds the lock. If `saved` is the journal of
    /// this file as it was some time ago, only the lines appended since are read.
    ///
    /// # Errors
    /// The errors of [`Journal::read`], and an error if the file cannot be written.
    pub(crate) fn write(
        path: &Path,
        saved: Option<Self>,
        retention: impl FnOnce(&Self) -> Retention,
    ) -> Result<Self, Error> {
        let saved = saved.filter(|saved| saved.path == path);
        // Errors of a saved journal are found when the file is read again.
        let reopened = saved.and_then(|mut saved| {
            let before = saved.text.length();
            let is_same = saved.read_appended().is_ok_and(|same| same);
            saved.unchanged = saved.text.length() == before;
            is_same.then_some(saved)
        });
        let mut journal = reopened.map_or_else(|| Self::read(path), Ok)?;
        if !journal.is_whole() {
            let retention = retention(&journal);
            journal.compact_to(retention)?;
        } else if journal.is_overgrown() {
            let retention = retention(&journal);
            // It can wait: a full disk is not a reason not to build.
            let _ = journal.compact_to(retention);
        }
        journal.open_to_append()?;
        Ok(journal)
    }

    /// Compacts the file to what `retention` keeps.
    pub(crate) fn compact_to(&mut self, mut retention: Retention) -> Result<(), Error> {
        self.compact(|line| retention.keeps(line.tag, line.subject))
    }

    /// The journal for the next build of this process, with the lines appended by this one and its file
    /// closed; the lock is still held. Writes the index if many lines are not in it. `None` if the file has
    /// been replaced.
    pub(crate) fn close(mut self) -> Option<Self> {
        self.appender = None;
        if !self.read_appended().is_ok_and(|same| same) {
            return None;
        }
        self.save_index();
        self.text.close();
        Some(self)
    }

    /// Whether it was saved, and no other process has written to it since.
    pub(crate) fn is_unchanged(&self) -> bool {
        self.unchanged
    }

    /// The bytes and lines of the file when it was read.
    pub(crate) fn size(&self) -> (u64, u64) {
        (self.text.length(), self.lines)
    }

    /// The latest record of an item, as far as every build needs it.
    pub(crate) fn latest(&self, subject: Subject) -> Option<LatestRecord<'_>> {
        self.tables.latest(subject)
    }

    /// The latest records of all items, each with its subject.
    pub(crate) fn latest_records(&self) -> impl Iterator<Item = (Subject, LatestRecord<'_>)> {
        self.tables.latest_records()
    }

    /// The recorded stamp of a file and the digest that it had then.
    pub(crate) fn stamped(&self, subject: Subject) -> Option<(Stamp, Digest)> {
        self.tables.stamped(subject)
    }

    /// The ledger's line on a file, as far as every build needs it.
    pub(crate) fn published(&self, subject: Subject) -> Option<PublishedStamp> {
        self.tables.published(subject)
    }

    /// The content of the last line of a tag on a subject.
    pub(crate) fn get<T: DeserializeOwned>(&self, tag: Tag, subject: Subject) -> Option<T> {
        self.parse(&self.tables.line(tag, subject)?.range())
    }

    /// The subjects of a tag, in any order.
    pub(crate) fn subjects(&self, tag: Tag) -> impl Iterator<Item = Subject> {
        self.tables.lines(tag).map(tables::Location::subject)
    }

    /// The subjects of a tag, each with the content of its last line, in the order of the file.
    pub(crate) fn contents<T: DeserializeOwned>(&self, tag: Tag) -> Vec<(Subject, T)> {
        self.all(self.tables.lines(tag).collect()).map(|(line, content)| (line.subject(), content)).collect()
    }

    /// Some subjects of a tag, each with the content of its last line, in the order of the file.
    pub(crate) fn contents_of<T: DeserializeOwned>(
        &self,
        tag: Tag,
        subjects: &[Subject],
    ) -> Vec<(Subject, T)> {
        let lines = subjects.iter().filter_map(|subject| self.tables.line(tag, *subject));
        self.all(lines.collect()).map(|(line, content)| (line.subject(), content)).collect()
    }

    /// All results, the least recently used first, each with its place.
    pub(crate) fn results_by_age<T: DeserializeOwned>(&self) -> Vec<(u64, T)> {
        let all = self.all(self.tables.lines(Tag::Result).collect());
        all.map(|(line, content)| (line.range().start, content)).collect()
    }

    /// The last few results of a key, the newest first.
    pub(crate) fn results<T: DeserializeOwned>(&self, subject: Subject) -> impl Iterator<Item = T> {
        let lines = self.tables.results_of(subject).iter().rev();
        lines.filter_map(|line| self.parse(&line.range()))
    }

    /// The contents of some lines, in the order of the file.
    fn all<'a, T: DeserializeOwned>(
        &'a self,
        mut lines: Vec<&'a tables::Location>,
    ) -> impl Iterator<Item = (&'a tables::Location, T)> {
        lines.sort_unstable_by_key(|line| line.range().start);
        let mut window = self.text.window();
        lines.into_iter().filter_map(move |line| {
            let content = serde_json::from_slice(window.get(&line.range())?).ok()?;
            Some((line, content))
        })
    }

    /// Appends all lines, or (if the process is killed or the disk is full) the first few.
    pub(crate) fn append(&self, lines: &[Line]) -> Result<(), Error> {
        let Some(appender) = &self.appender else { return Ok(()) };
        if lines.is_empty() {
            return Ok(());
        }
        let mut appender = appender.lock();
        // A line must not continue the rest of a torn one.
        let mut buffer = if appender.torn { vec![b'\n'] } else { Vec::new() };
        lines.iter().for_each(|line| line.write(&mut buffer));
        if let Err(error) = appender.file.write_all(&buffer) {
            // Windows cannot shorten a file that is open for appending.
            if appender.file.set_len(appender.length).is_err() {
                appender.length = appender.file.metadata().map_or(appender.length, |metadata| metadata.len());
                appender.torn = true;
            }
            return Err(Error::io(&error, "write", &self.path));
        }
        appender.length += buffer.len() as u64;
        appender.torn = false;
        Ok(())
    }

    fn parse<T: DeserializeOwned>(&self, range: &Range<u64>) -> Option<T> {
        serde_json::from_slice(&self.text.get(range)?).ok()
    }

    /// Reads the lines that were appended since; returns whether the file is still the same.
    fn read_appended(&mut self) -> io::Result<bool> {
        let Self { text, tables, lines, path, .. } = self;
        let mut updates = Vec::new();
        let same = text.read_appended(path, |start, piece| {
            *lines += piece.iter().filter(|byte| **byte == b'\n').count() as u64;
            updates.extend(parse_piece(start, piece));
            // Entering many costs hardly more than entering a few.
            if updates.len() > 1 << 14 {
                tables.apply(std::mem::take(&mut updates));
            }
        });
        tables.apply(updates);
        same
    }

    fn save_index(&mut self) {
        if self.lines - self.indexed <= UNINDEXED + self.indexed / UNINDEXED_OF {
            return;
        }
        let covered = index::Covered {
            head: self.text.head().to_vec(),
            tail: self.text.tail().to_vec(),
            length: self.text.length(),
            lines: self.lines,
        };
        index::write(&index_of(&self.path), &covered, &self.tables);
        self.indexed = self.lines;
    }

    fn is_whole(&self) -> bool {
        !self.text.is_torn()
            && self.text.head().starts_with(header().as_bytes())
            && lines_at_first(self.text.head()).is_some()
    }

    fn is_overgrown(&self) -> bool {
        self.lines > self.limit()
    }

    /// Whether it will soon be compacted: better now, while nobody waits.
    pub(crate) fn is_large(&self) -> bool {
        4 * self.lines > 3 * self.limit()
    }

    /// The number of lines that it may have: twice those that a compaction keeps, and 1000.
    fn limit(&self) -> u64 {
        let rows = |tag| self.tables.lines(tag).count();
        let gone = self.tables.latest_records().filter(|(_, latest)| latest.is_gone()).count();
        let kept = Retention::most(rows(Tag::Item) - gone, gone, rows(Tag::Result), rows(Tag::Stamp));
        2 * (kept + rows(Tag::Published) + rows(Tag::Publishing)) as u64 + 1000
    }

    /// Writes the lines that are not outdated and that `keeps` accepts to a new file, and renames it. `keeps`
    /// is called from the newest line to the oldest.
    ///
    /// # Errors
    /// If the file cannot be written; it is unchanged then.
    pub(crate) fn compact(&mut self, mut keeps: impl FnMut(&LiveLine) -> bool) -> Result<(), Error> {
        let mut live = Vec::new();
        for tag in Tag::ALL {
            let lines = self.tables.lines(tag);
            live.extend(lines.map(|line| LiveLine { tag, subject: line.subject(), range: line.range() }));
        }
        live.sort_unstable_by_key(|line| std::cmp::Reverse(line.place()));
        live.retain(|line| keeps(line));
        live.reverse();
        let path = self.path.clone();
        let was_appending = self.appender.is_some();
        let replaced = replace_through(&path.with_extension("new"), &path, None, &mut |file| {
            self.copy(&live, file)?;
            // Not every file system replaces a file that is open.
            self.text.close();
            self.appender = None;
            Ok(())
        });
        drop(live);
        *self = Self::read(&path)?;
        if was_appending {
            self.open_to_append()?;
        }
        replaced.map_err(|error| Error::io(&error, "write", &path))
    }

    fn open_to_append(&mut self) -> Result<(), Error> {
        let file = OpenOptions::new().append(true).open(&self.path);
        let file = file.map_err(|error| Error::io(&error, "write", &self.path))?;
        self.appender = Some(Mutex::new(Appender { file, length: self.text.length(), torn: false }));
        Ok(())
    }

    /// Writes lines to another file.
    fn copy(&self, lines: &[LiveLine], file: File) -> io::Result<()> {
        let mut file = BufWriter::new(file);
        let mut buffer = header().into_bytes();
        write_line(&mut buffer, WRITING, new_name(), lines.len().to_string().as_bytes());
        file.write_all(&buffer)?;
        let mut window = self.text.window();
        for line in lines {
            let json = window.get(&line.range);
            let json = json.ok_or_else(|| io::Error::other("what it said before cannot be read again"))?;
            buffer.clear();
            write_line(&mut buffer, line.tag as u8, line.subject, json);
            file.write_all(&buffer)?;
        }
        file.flush()
    }
}

fn index_of(path: &Path) -> PathBuf {
    path.with_file_name("index")
}

fn header() -> String {
    format!("specula journal {FORMAT}\n")
}

/// The number of lines that the file had after its last compaction.
fn lines_at_first(head: &[u8]) -> Option<u64> {
    let line = head.strip_suffix(b"\n")?.rsplit(|byte| *byte == b'\n').next()?;
    let intact =
        line.len() > HEAD && line[..CHECK] == check(&line[CHECK + 1..]) && line[CHECK + 1] == WRITING;
    intact.then(|| std::str::from_utf8(&line[HEAD..]).ok()?.parse().ok())?
}

/// A name that no other journal has.
fn new_name() -> Subject {
    let half = || Subject::from(RandomState::new().hash_one(std::process::id()));
    half() << 64 | half()
}

/// Refuses the first line of a newer version. If that line is damaged, it is ignored as any other.
fn check_format(text: &[u8], path: &Path) -> Result<(), Error> {
    let first = text.split(|byte| *byte == b'\n').next().unwrap_or_default();
    let format = std::str::from_utf8(first).ok().and_then(|line| line.strip_prefix("specula journal "));
    match format.and_then(|format| format.parse::<u32>().ok()) {
        Some(format) if format > FORMAT => {
            let folder = path_text(path.parent().unwrap_or(path));
            let message =
                format!("{folder} was written by a newer version (format {format}, this one has {FORMAT})");
            Err(Error::new(ErrorKind::NewerState, message)
                .with_help(format!("use that version, or delete {folder} to rebuild everything")))
        }
        _ => Ok(()),
    }
}

/// The updates in a piece of the file. Lines are checked in parallel.
fn parse_piece(start: u64, text: &[u8]) -> Vec<Update> {
    let mut pieces = Vec::new();
    let mut begin = 0;
    while begin < text.len() {
        let rest = &text[begin..];
        let reach = rest.len().min(1 << 17);
        let end =
            rest[reach..].iter().position(|byte| *byte == b'\n').map_or(rest.len(), |at| reach + at + 1);
        pieces.push(begin..begin + end);
        begin += end;
    }
    let parse = |index: usize| {
        let piece = pieces[index].clone();
        lines(start + piece.start as u64, &text[piece])
    };
    parallel::map(pieces.len(), &parse).into_iter().flatten().collect()
}

/// The updates of the lines whose check is right.
fn lines(start: u64, text: &[u8]) -> Vec<Update> {
    let mut found = Vec::new();
    let mut start = start;
    for line in text.split_inclusive(|byte| *byte == b'\n') {
        let place = start;
        start += line.len() as u64;
        // A line without its end is torn, even if its check is right.
        let Some(line) = line.strip_suffix(b"\n") else { continue };
        if line.len() < HEAD || line[..CHECK] != check(&line[CHECK + 1..]) {
            continue;
        }
        let tag = Tag::of(line[CHECK + 1]);
        let hex = |bytes| std::str::from_utf8(bytes).ok();
        let subject = hex(&line[CHECK + 3..HEAD - 1]).and_then(|text| Subject::from_str_radix(text, 16).ok());
        let check = hex(&line[..CHECK]).and_then(|text| u64::from_str_radix(text, 16).ok());
        if let (Some(tag), Some(subject), Some(check)) = (tag, subject, check) {
            let content = place + HEAD as u64..place + line.len() as u64;
            found.push(Update::of(tag, tables::Location::new(tag, subject, &content, check), &line[HEAD..]));
        }
    }
    found
}

#[cfg(test)]
mod tests;
