//! The journal: everything that the engine remembers, as lines that are only ever appended.
//!
//! A line is `CHECK TAG KEY JSON`: 16 hex digits of the BLAKE3 digest of the rest, a letter for what it is, 32 hex
//! digits that name its subject, and the content. Of the lines on one subject the last holds, but of [`Tag::Result`]
//! the last few. A line whose check fails (a torn tail, a damaged disk) is ignored. When it has twice the lines that
//! are worth keeping, the file is written anew beside itself, without what is out of date or forgotten, and renamed. The first line
//! names the format; that line's shape never changes. The second names this writing of the file and says how many lines
//! it began with.
//!
//! What every build asks is in tables ([`tables`]), which a file beside the journal, the index, holds too: only what was
//! appended since is read when the journal is opened. The rest is read when it is asked for. What a build appends it does
//! not see itself: what it does cannot depend on the order in which its items finish. A process that builds again and
//! again keeps the tables, and takes the journal up with what has been appended since, whoever did that.

use std::fs::{self, File, OpenOptions};
use std::hash::{BuildHasher, RandomState};
use std::io::{self, BufWriter, Write};
use std::ops::Range;
use std::path::{Path, PathBuf};

use line::{CHECK, HEAD, check, write_line};
use parking_lot::Mutex;
use rayon::prelude::*;
use serde::de::DeserializeOwned;
use tables::{Fact, Tables};
use text::Text;

pub(crate) use line::{Line, Subject, Tag, short, subject};
#[cfg(test)]
pub(crate) use retention::OTHERS;
pub(crate) use retention::Retention;
pub(crate) use tables::{Effect, PublishedStamp};

use crate::platform::Stamp;
use crate::regular::write_new;
use crate::{Digest, Error, ErrorKind, platform};

mod index;
mod line;
mod retention;
mod tables;
mod text;

/// Raised when an older version would misunderstand the journal or the folder.
pub(crate) const FORMAT: u32 = 1;

/// The index is written anew when so many lines are not in it, and of those in it one in so many.
const UNINDEXED: u64 = 1000;
const UNINDEXED_OF: u64 = 16;

/// The letter of the line that names a writing of the file.
const WRITING: u8 = b'w';

/// The journal as it was when it was opened, and where to append.
pub(crate) struct Journal {
    path: PathBuf,
    text: Text,
    tables: Tables,
    /// The lines in the file, those out of date among them.
    lines: u64,
    /// Those that the index covers.
    indexed: u64,
    /// Whether nobody else has written to it since it was kept.
    as_kept: bool,
    end: Option<Mutex<End>>,
}

/// A line that holds.
pub(crate) struct Held {
    pub(crate) tag: Tag,
    pub(crate) subject: Subject,
    range: Range<u64>,
}

impl Held {
    /// Where it is in the file: a later line has a greater one.
    pub(crate) fn place(&self) -> u64 {
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
        let broken = |error: io::Error| Error::io(&error, "read", path);
        if let Some((covered, tables)) = index::read(&index_of(path)) {
            let index::Covered { head, tail, length, lines } = covered;
            let text = Text::known(head, tail, length);
            let mut journal =
                Self { path: path.into(), text, tables, lines, indexed: lines, as_kept: false, end: None };
            // What is wrong with the journal shows when all of it is read.
            if journal.take_up().is_ok_and(|same| same) {
                check_format(journal.text.head(), path)?;
                return Ok(journal);
            }
        }
        let (text, tables) = (Text::default(), Tables::default());
        let mut journal =
            Self { path: path.into(), text, tables, lines: 0, indexed: 0, as_kept: false, end: None };
        journal.take_up().map_err(broken)?;
        check_format(journal.text.head(), path)?;
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
        let taken_up = kept.and_then(|mut kept| {
            let before = kept.text.length();
            let is_same = kept.take_up().is_ok_and(|same| same);
            kept.as_kept = kept.text.length() == before;
            is_same.then_some(kept)
        });
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
        journal.end = Some(Mutex::new(End { file, length: journal.text.length(), torn: false }));
        Ok(journal)
    }

    /// Writes the file anew with what is kept.
    ///
    /// # Errors
    /// As [`Journal::compact`].
    pub(crate) fn forget(&mut self, mut retention: Retention) -> Result<(), Error> {
        self.compact(|line| retention.keeps(line.tag, line.subject))
    }

    /// The journal as it can be kept without the lock, which is still held: with what was appended, its file not open.
    /// The index is written if much is not in it. `None` if the file is no longer the one that is known.
    pub(crate) fn rest(mut self) -> Option<Self> {
        self.end = None;
        if !self.take_up().is_ok_and(|same| same) {
            return None;
        }
        self.save_index();
        self.text.close();
        Some(self)
    }

    /// Whether it was kept, and nobody else has written to it since.
    pub(crate) fn is_as_kept(&self) -> bool {
        self.as_kept
    }

    /// The bytes and lines of the file, as it was read.
    pub(crate) fn size(&self) -> (u64, u64) {
        (self.text.length(), self.lines)
    }

    /// What every build asks of the record in effect of an item.
    pub(crate) fn effect(&self, subject: Subject) -> Option<Effect<'_>> {
        self.tables.effect(subject)
    }

    /// The same of all items, by subject.
    pub(crate) fn effects(&self) -> impl Iterator<Item = (Subject, Effect<'_>)> {
        self.tables.effects()
    }

    /// The stamp and digest that a file had.
    pub(crate) fn stamped(&self, subject: Subject) -> Option<(Stamp, Digest)> {
        self.tables.stamped(subject)
    }

    /// What the ledger says of a file, as far as every build asks.
    pub(crate) fn published(&self, subject: Subject) -> Option<PublishedStamp> {
        self.tables.published(subject)
    }

    /// What the last line of a tag on a subject says.
    pub(crate) fn get<T: DeserializeOwned>(&self, tag: Tag, subject: Subject) -> Option<T> {
        self.parse(&self.tables.line(tag, subject)?.range())
    }

    /// The subjects of a tag, in no order.
    pub(crate) fn named(&self, tag: Tag) -> impl Iterator<Item = Subject> {
        self.tables.lines(tag).map(tables::Line::subject)
    }

    /// The subjects of a tag, each with what its last line says, in the order of the file.
    pub(crate) fn subjects<T: DeserializeOwned>(&self, tag: Tag) -> Vec<(Subject, T)> {
        self.all(self.tables.lines(tag).collect()).map(|(line, content)| (line.subject(), content)).collect()
    }

    /// The same of these subjects.
    pub(crate) fn subjects_among<T: DeserializeOwned>(
        &self,
        tag: Tag,
        subjects: &[Subject],
    ) -> Vec<(Subject, T)> {
        let lines = subjects.iter().filter_map(|subject| self.tables.line(tag, *subject));
        self.all(lines.collect()).map(|(line, content)| (line.subject(), content)).collect()
    }

    /// Every result, the oldest first; each with its place.
    pub(crate) fn results_by_age<T: DeserializeOwned>(&self) -> Vec<(u64, T)> {
        let all = self.all(self.tables.lines(Tag::Result).collect());
        all.map(|(line, content)| (line.range().start, content)).collect()
    }

    /// The last few results of a key, the newest first.
    pub(crate) fn results<T: DeserializeOwned>(&self, subject: Subject) -> impl Iterator<Item = T> {
        let lines = self.tables.results_of(subject).iter().rev();
        lines.filter_map(|line| self.parse(&line.range()))
    }

    /// What some lines say, in the order of the file.
    fn all<'a, T: DeserializeOwned>(
        &'a self,
        mut lines: Vec<&'a tables::Line>,
    ) -> impl Iterator<Item = (&'a tables::Line, T)> {
        lines.sort_unstable_by_key(|line| line.range().start);
        let mut window = self.text.window();
        lines.into_iter().filter_map(move |line| {
            let content = serde_json::from_slice(window.get(&line.range())?).ok()?;
            Some((line, content))
        })
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
        let mut end = end.lock();
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

    fn parse<T: DeserializeOwned>(&self, range: &Range<u64>) -> Option<T> {
        serde_json::from_slice(&self.text.get(range)?).ok()
    }

    /// Reads what was appended since; whether this is still the same writing of the file.
    fn take_up(&mut self) -> io::Result<bool> {
        let Self { text, tables, lines, path, .. } = self;
        let mut facts = Vec::new();
        let same = text.take_up(path, |start, piece| {
            *lines += piece.iter().filter(|byte| **byte == b'\n').count() as u64;
            facts.extend(facts_of(start, piece));
            // To enter many costs hardly more than to enter a few.
            if facts.len() > 1 << 14 {
                tables.enter(std::mem::take(&mut facts));
            }
        });
        tables.enter(facts);
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

    /// Whether it will soon be written anew: better now, where nobody waits.
    pub(crate) fn is_large(&self) -> bool {
        4 * self.lines > 3 * self.limit()
    }

    /// So many lines it may have: twice those that would be kept, and 1000.
    fn limit(&self) -> u64 {
        let rows = |tag| self.tables.lines(tag).count();
        let gone = self.tables.effects().filter(|(_, effect)| effect.is_gone()).count();
        let kept = Retention::most(rows(Tag::Item) - gone, gone, rows(Tag::Result), rows(Tag::Stamp));
        2 * (kept + rows(Tag::Published) + rows(Tag::Publishing)) as u64 + 1000
    }

    /// Writes the lines that hold and that `keeps` wants beside the file, and renames. It is asked from the newest line to
    /// the oldest.
    ///
    /// # Errors
    /// Where the file cannot be written; it is as it was then.
    pub(crate) fn compact(&mut self, mut keeps: impl FnMut(&Held) -> bool) -> Result<(), Error> {
        let mut held = Vec::new();
        for tag in Tag::ALL {
            let lines = self.tables.lines(tag);
            held.extend(lines.map(|line| Held { tag, subject: line.subject(), range: line.range() }));
        }
        held.sort_unstable_by_key(|line| std::cmp::Reverse(line.place()));
        held.retain(|line| keeps(line));
        held.reverse();
        let temporary = self.path.with_extension("new");
        let written = self.copy(&held, &temporary).and_then(|()| platform::replace(&temporary, &self.path));
        written.map_err(|error| {
            let _ = fs::remove_file(&temporary);
            Error::io(&error, "write", &self.path)
        })?;
        drop(held);
        let before = self.end.take();
        *self = Self::read(&self.path)?;
        // If it was open for appending, that was the file before.
        if before.is_some() {
            let file = OpenOptions::new().append(true).open(&self.path);
            let file = file.map_err(|error| Error::io(&error, "write", &self.path))?;
            self.end = Some(Mutex::new(End { file, length: self.text.length(), torn: false }));
        }
        Ok(())
    }

    /// Writes lines to a file of their own.
    fn copy(&self, lines: &[Held], to: &Path) -> io::Result<()> {
        let mut file = BufWriter::new(write_new(to, b"")?);
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

/// The index beside a journal.
fn index_of(path: &Path) -> PathBuf {
    path.with_file_name("index")
}

fn header() -> String {
    format!("specula journal {FORMAT}\n")
}

/// How many lines this writing of the file began with.
fn lines_at_first(head: &[u8]) -> Option<u64> {
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

/// What the lines of some text say, which begins at a place of the file. Lines are checked in parallel.
fn facts_of(start: u64, text: &[u8]) -> Vec<Fact> {
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
    let facts = pieces.into_par_iter().map(|piece| lines(start + piece.start as u64, &text[piece]));
    facts.collect::<Vec<_>>().into_iter().flatten().collect()
}

/// What the lines of a piece of text say whose check holds.
fn lines(start: u64, text: &[u8]) -> Vec<Fact> {
    let mut found = Vec::new();
    let mut start = start;
    for line in text.split_inclusive(|byte| *byte == b'\n') {
        let place = start;
        start += line.len() as u64;
        // A line without its end was torn, whatever its check says.
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
            found.push(Fact::of(tag, tables::Line::new(tag, subject, &content, check), &line[HEAD..]));
        }
    }
    found
}

#[cfg(test)]
mod tests;
