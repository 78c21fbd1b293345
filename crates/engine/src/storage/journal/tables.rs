//! The present state that the lines of a journal describe, as sorted tables without pointers: they are read
//! from the index and searched without decoding, and an item takes some hundred bytes. Of what only `explain`
//! and a run need, they contain the place of the line.

use std::collections::HashMap;
use std::ops::Range;

use bytemuck::{Pod, Zeroable};
use serde::Deserialize;

use super::line::{Subject, Tag};
use crate::key::Digest;
use crate::platform::Stamp;
use crate::storage::files::ReadKind;
use crate::storage::record::FileRead;
use crate::storage::store::Blob;

/// For one key, at most this many results are remembered, with different contents of the files read.
const RESULTS: usize = 8;

/// The place of a line.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
pub(super) struct Location {
    /// The subject, most significant byte first.
    subject: [u8; 16],
    /// The offset of its content in the file.
    offset: u64,
    length: u32,
    /// The letter of its tag.
    tag: u32,
    /// The check of the line, which differs if the text does.
    check: u64,
}

impl Location {
    pub(super) fn new(tag: Tag, subject: Subject, content: &Range<u64>, check: u64) -> Self {
        let length = u32::try_from(content.end - content.start).unwrap_or(u32::MAX);
        Self { subject: subject.to_be_bytes(), offset: content.start, length, tag: tag as u32, check }
    }

    pub(super) fn subject(&self) -> Subject {
        Subject::from_be_bytes(self.subject)
    }

    pub(super) fn range(&self) -> Range<u64> {
        self.offset..self.offset.saturating_add(self.length.into())
    }
}

/// The latest record of an item.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
pub(super) struct ItemEntry {
    line: Location,
    key: [u8; 32],
    manifest: u32,
    kind: u32,
    outputs: Span,
    reads: Span,
    milliseconds: f32,
    flags: u32,
}

/// Some consecutive rows of another table: the first, and how many.
#[repr(C)]
#[derive(Clone, Copy, Default, Pod, Zeroable)]
struct Span {
    first: u32,
    count: u32,
}

impl Span {
    fn range(self) -> Range<usize> {
        self.first as usize..self.first as usize + self.count as usize
    }
}

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
pub(super) struct ReadEntry {
    digest: [u8; 32],
    path: u32,
    flags: u32,
}

/// The stamp and digest of a file: recorded when it was hashed, or when it was published.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
pub(super) struct FileEntry {
    line: Location,
    stamp: Stamp,
    digest: [u8; 32],
    flags: u64,
}

/// Whether the line's content has the shape that its tag requires.
const UNDERSTOOD: u32 = 1;
const GONE: u32 = 2;
const FAILED: u32 = 4;
const WARNED: u32 = 8;
const SHARED: u32 = 16;
const NAMES: u32 = 2;
const THERE: u32 = 4;
const LOOKUP: u32 = 8;
const SETTLED: u32 = 2;

/// A row of a table that is sorted by subject.
pub(super) trait SubjectRow: Pod {
    fn line(&self) -> &Location;
}

macro_rules! entries {
    ($($entry:ident),*) => { $(impl SubjectRow for $entry { fn line(&self) -> &Location { &self.line } })* };
}
entries!(ItemEntry, FileEntry);

impl SubjectRow for Location {
    fn line(&self) -> &Location {
        self
    }
}

/// The change that a line makes to the tables.
pub(super) enum Update {
    Item(Location, Option<ItemFields>),
    Result(Location),
    Stamp(Location, Option<FileFields>),
    Published(Location, Option<FileFields>),
    Publishing(Location),
    /// Revokes what earlier lines say.
    Nothing(Location),
}

impl Update {
    /// The update of a line with this content.
    pub(super) fn of(tag: Tag, line: Location, json: &[u8]) -> Self {
        match tag {
            Tag::Result => Self::Result(line),
            _ if json == b"null" => Self::Nothing(line),
            Tag::Item => Self::Item(line, serde_json::from_slice(json).ok()),
            Tag::Stamp => Self::Stamp(line, serde_json::from_slice(json).ok()),
            Tag::Published => Self::Published(line, serde_json::from_slice(json).ok()),
            Tag::Publishing => Self::Publishing(line),
        }
    }
}

#[derive(Deserialize)]
pub(super) struct ItemFields {
    manifest: String,
    key: Digest,
    kind: String,
    #[serde(default)]
    gone: bool,
    failure: Option<serde::de::IgnoredAny>,
    #[serde(default)]
    warnings: Vec<serde::de::IgnoredAny>,
    shared: Option<serde::de::IgnoredAny>,
    outputs: Vec<Blob>,
    reads: Vec<FileRead>,
    #[serde(default)]
    milliseconds: f64,
}

#[derive(Deserialize)]
pub(super) struct FileFields {
    digest: Digest,
    stamp: Option<Stamp>,
    #[serde(default)]
    settled: bool,
}

#[derive(Default)]
pub(super) struct Tables {
    pub(super) items: Vec<ItemEntry>,
    pub(super) stamps: Vec<FileEntry>,
    pub(super) files: Vec<FileEntry>,
    pub(super) publishing: Vec<Location>,
    /// The lines of results, sorted by subject; of one subject, the oldest first.
    pub(super) results: Vec<Location>,
    pub(super) blobs: Vec<Blob>,
    pub(super) reads: Vec<ReadEntry>,
    pub(super) names: NumberedTexts,
}

/// Recurring texts, by number.
#[derive(Default)]
pub(super) struct NumberedTexts {
    texts: Vec<Box<str>>,
    numbers: HashMap<Box<str>, u32>,
}

impl NumberedTexts {
    pub(super) fn iter(&self) -> impl Iterator<Item = &str> {
        self.texts.iter().map(|text| &**text)
    }

    fn get(&self, number: u32) -> &str {
        self.texts.get(number as usize).map_or("", |text| text)
    }

    pub(super) fn number(&mut self, text: &str) -> u32 {
        if let Some(known) = self.numbers.get(text) {
            return *known;
        }
        let number = self.texts.len() as u32;
        self.texts.push(text.into());
        self.numbers.insert(text.into(), number);
        number
    }
}

impl Tables {
    /// Applies the updates of lines, in the order of the file.
    pub(super) fn apply(&mut self, updates: Vec<Update>) {
        let (mut items, mut stamps, mut files) = (Vec::new(), Vec::new(), Vec::new());
        let (mut publishing, mut results) = (Vec::new(), Vec::new());
        for update in updates {
            match update {
                Update::Item(line, fields) => items.push(self.item_entry(line, fields)),
                Update::Stamp(line, fields) => stamps.push(file_entry(line, fields)),
                Update::Published(line, fields) => files.push(file_entry(line, fields)),
                Update::Publishing(line) => publishing.push(line),
                Update::Result(line) => results.push(line),
                // A location without a length revokes those before it.
                Update::Nothing(line) => {
                    let nothing = Location { length: 0, ..line };
                    match Tag::of(line.tag as u8) {
                        Some(Tag::Item) => items.push(ItemEntry { line: nothing, ..Zeroable::zeroed() }),
                        Some(Tag::Stamp) => stamps.push(FileEntry { line: nothing, ..Zeroable::zeroed() }),
                        Some(Tag::Published) => {
                            files.push(FileEntry { line: nothing, ..Zeroable::zeroed() });
                        }
                        Some(Tag::Publishing) => publishing.push(nothing),
                        Some(Tag::Result) | None => {}
                    }
                }
            }
        }
        merge(&mut self.items, items);
        merge(&mut self.stamps, stamps);
        merge(&mut self.files, files);
        merge(&mut self.publishing, publishing);
        self.merge_results(results);
        self.drop_unused();
    }

    fn item_entry(&mut self, line: Location, fields: Option<ItemFields>) -> ItemEntry {
        let Some(fields) = fields else { return ItemEntry { line, ..Zeroable::zeroed() } };
        let flag = |is: bool, flag: u32| if is { flag } else { 0 };
        let outputs = Span { first: self.blobs.len() as u32, count: fields.outputs.len() as u32 };
        self.blobs.extend(fields.outputs);
        let reads = Span { first: self.reads.len() as u32, count: fields.reads.len() as u32 };
        for read in fields.reads {
            self.reads.push(ReadEntry {
                digest: read.digest.map_or([0; 32], |digest| digest.0),
                path: self.names.number(&read.path),
                flags: flag(read.digest.is_some(), THERE)
                    | match read.kind {
                        ReadKind::Content => 0,
                        ReadKind::Names => NAMES,
                        ReadKind::Lookup => LOOKUP,
                    },
            });
        }
        ItemEntry {
            line,
            key: fields.key.0,
            manifest: self.names.number(&fields.manifest),
            kind: self.names.number(&fields.kind),
            outputs,
            reads,
            milliseconds: fields.milliseconds as f32,
            flags: UNDERSTOOD
                | flag(fields.gone, GONE)
                | flag(fields.failure.is_some(), FAILED)
                | flag(!fields.warnings.is_empty(), WARNED)
                | flag(fields.shared.is_some(), SHARED),
        }
    }

    /// Adds results, and keeps the last few of each key. One that was used again was written again, and
    /// counts once.
    fn merge_results(&mut self, added: Vec<Location>) {
        if added.is_empty() {
            return;
        }
        self.results.extend(added);
        self.results.sort_by_key(|line| line.subject);
        let mut kept = Vec::with_capacity(self.results.len());
        for group in self.results.chunk_by(|one, other| one.subject == other.subject) {
            let first = kept.len();
            for (index, line) in group.iter().enumerate() {
                if !group[index + 1..].iter().any(|later| later.check == line.check) {
                    kept.push(*line);
                }
            }
            let surplus = (kept.len() - first).saturating_sub(RESULTS);
            kept.drain(first..first + surplus);
        }
        self.results = kept;
    }

    /// Drops blobs, reads and names of outdated records once they outnumber the others.
    fn drop_unused(&mut self) {
        let used = |span: fn(&ItemEntry) -> Span| {
            self.items.iter().map(|entry| span(entry).count as usize).sum::<usize>()
        };
        let (blobs, reads) = (used(|entry| entry.outputs), used(|entry| entry.reads));
        if self.blobs.len() + self.reads.len() <= 2 * (blobs + reads) + 1000 {
            return;
        }
        let mut fresh = Self::default();
        for entry in &mut self.items {
            let outputs = Span { first: fresh.blobs.len() as u32, ..entry.outputs };
            fresh.blobs.extend(self.blobs.get(entry.outputs.range()).unwrap_or_default());
            let first = fresh.reads.len() as u32;
            for read in self.reads.get(entry.reads.range()).unwrap_or_default() {
                let path = fresh.names.number(self.names.get(read.path));
                fresh.reads.push(ReadEntry { path, ..*read });
            }
            entry.manifest = fresh.names.number(self.names.get(entry.manifest));
            entry.kind = fresh.names.number(self.names.get(entry.kind));
            (entry.outputs, entry.reads) = (outputs, Span { first, ..entry.reads });
        }
        (self.blobs, self.reads, self.names) = (fresh.blobs, fresh.reads, fresh.names);
    }

    /// Whether every row refers to existing rows, and the tables are sorted: they come from a file.
    pub(super) fn are_sound(&self) -> bool {
        let names = self.names.texts.len();
        let item = |entry: &ItemEntry| {
            entry.outputs.range().end <= self.blobs.len()
                && entry.reads.range().end <= self.reads.len()
                && (entry.flags & UNDERSTOOD == 0 || entry.manifest.max(entry.kind) < names as u32)
        };
        self.items.iter().all(item)
            && self.reads.iter().all(|read| (read.path as usize) < names)
            && is_sorted(&self.items)
            && is_sorted(&self.stamps)
            && is_sorted(&self.files)
            && is_sorted(&self.publishing)
            && self.results.is_sorted_by_key(|line| line.subject)
    }

    pub(super) fn line(&self, tag: Tag, subject: Subject) -> Option<&Location> {
        match tag {
            Tag::Item => find(&self.items, subject).map(SubjectRow::line),
            Tag::Stamp => find(&self.stamps, subject).map(SubjectRow::line),
            Tag::Published => find(&self.files, subject).map(SubjectRow::line),
            Tag::Publishing => find(&self.publishing, subject),
            Tag::Result => self.results_of(subject).last(),
        }
    }

    /// The results of a key, the oldest first.
    pub(super) fn results_of(&self, subject: Subject) -> &[Location] {
        let subject = subject.to_be_bytes();
        let first = self.results.partition_point(|line| line.subject < subject);
        let count = self.results[first..].iter().take_while(|line| line.subject == subject).count();
        &self.results[first..first + count]
    }

    /// The lines of a tag, by subject.
    pub(super) fn lines(&self, tag: Tag) -> Box<dyn Iterator<Item = &Location> + '_> {
        match tag {
            Tag::Item => Box::new(self.items.iter().map(SubjectRow::line)),
            Tag::Stamp => Box::new(self.stamps.iter().map(SubjectRow::line)),
            Tag::Published => Box::new(self.files.iter().map(SubjectRow::line)),
            Tag::Publishing => Box::new(self.publishing.iter()),
            Tag::Result => Box::new(self.results.iter()),
        }
    }

    pub(super) fn latest(&self, subject: Subject) -> Option<LatestRecord<'_>> {
        find(&self.items, subject).and_then(|entry| self.record_of(entry))
    }

    pub(super) fn latest_records(&self) -> impl Iterator<Item = (Subject, LatestRecord<'_>)> {
        self.items.iter().filter_map(|entry| Some((entry.line.subject(), self.record_of(entry)?)))
    }

    fn record_of<'a>(&'a self, entry: &'a ItemEntry) -> Option<LatestRecord<'a>> {
        (entry.flags & UNDERSTOOD != 0).then_some(LatestRecord { tables: self, entry })
    }

    pub(super) fn stamped(&self, subject: Subject) -> Option<(Stamp, Digest)> {
        let entry = find(&self.stamps, subject).filter(|entry| entry.flags & u64::from(THERE) != 0)?;
        Some((entry.stamp, Digest(entry.digest)))
    }

    pub(super) fn published(&self, subject: Subject) -> Option<PublishedStamp> {
        let entry = find(&self.files, subject).filter(|entry| entry.flags & u64::from(UNDERSTOOD) != 0)?;
        let flag = |flag: u32| entry.flags & u64::from(flag) != 0;
        Some(PublishedStamp {
            digest: Digest(entry.digest),
            stamp: (flag(THERE) && flag(SETTLED)).then_some(entry.stamp),
        })
    }
}

/// The latest record of an item, as far as every build needs it.
#[derive(Clone, Copy)]
pub(crate) struct LatestRecord<'a> {
    tables: &'a Tables,
    entry: &'a ItemEntry,
}

impl<'a> LatestRecord<'a> {
    pub(crate) fn manifest(&self) -> &'a str {
        self.tables.names.get(self.entry.manifest)
    }

    pub(crate) fn kind(&self) -> &'a str {
        self.tables.names.get(self.entry.kind)
    }

    pub(crate) fn key(&self) -> Digest {
        Digest(self.entry.key)
    }

    /// Whether the manifest no longer has the item.
    pub(crate) fn is_gone(&self) -> bool {
        self.entry.flags & GONE != 0
    }

    pub(crate) fn has_failed(&self) -> bool {
        self.entry.flags & FAILED != 0
    }

    pub(crate) fn has_warned(&self) -> bool {
        self.entry.flags & WARNED != 0
    }

    /// Whether the outputs came from a shared cache, and are perhaps only there.
    pub(crate) fn is_shared(&self) -> bool {
        self.entry.flags & SHARED != 0
    }

    pub(crate) fn milliseconds(&self) -> f64 {
        self.entry.milliseconds.into()
    }

    /// The item's outputs; for a failure, those of the last successful run.
    pub(crate) fn outputs(&self) -> &'a [Blob] {
        self.tables.blobs.get(self.entry.outputs.range()).unwrap_or_default()
    }

    /// Everything that the run read: the path as in the record, what was asked of it, and the digest of the
    /// answer.
    pub(crate) fn reads(&self) -> impl Iterator<Item = (&'a str, ReadKind, Option<Digest>)> + use<'a> {
        let tables = self.tables;
        let reads = tables.reads.get(self.entry.reads.range()).unwrap_or_default();
        reads.iter().map(|read| {
            let digest = (read.flags & THERE != 0).then_some(Digest(read.digest));
            let kind = match read.flags {
                flags if flags & LOOKUP != 0 => ReadKind::Lookup,
                flags if flags & NAMES != 0 => ReadKind::Names,
                _ => ReadKind::Content,
            };
            (tables.names.get(read.path), kind, digest)
        })
    }
}

/// The ledger's line on a file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct PublishedStamp {
    pub(crate) digest: Digest,
    /// The stamp that it had, if it is reliable.
    pub(crate) stamp: Option<Stamp>,
}

fn file_entry(line: Location, fields: Option<FileFields>) -> FileEntry {
    let Some(fields) = fields else { return FileEntry { line, ..Zeroable::zeroed() } };
    let flags = UNDERSTOOD
        | if fields.stamp.is_some() { THERE } else { 0 }
        | if fields.settled { SETTLED } else { 0 };
    let stamp = fields.stamp.unwrap_or(Zeroable::zeroed());
    FileEntry { line, stamp, digest: fields.digest.0, flags: flags.into() }
}

/// Enters rows, in the order of the file, into a sorted table. A row replaces earlier rows on the same
/// subject; one without a length revokes them.
fn merge<E: SubjectRow>(table: &mut Vec<E>, added: Vec<E>) {
    if added.is_empty() {
        return;
    }
    table.extend(added);
    // Stable, and fast if most of it is sorted already.
    table.sort_by_key(|entry| entry.line().subject);
    let mut kept = 0;
    for index in 0..table.len() {
        let is_last =
            table.get(index + 1).is_none_or(|next| next.line().subject != table[index].line().subject);
        if is_last && table[index].line().length > 0 {
            table[kept] = table[index];
            kept += 1;
        }
    }
    table.truncate(kept);
    if table.capacity() > 2 * table.len() + 1024 {
        table.shrink_to_fit();
    }
}

fn is_sorted<E: SubjectRow>(table: &[E]) -> bool {
    table.is_sorted_by(|one, other| one.line().subject < other.line().subject)
}

/// The row of a subject. Subjects are digests, so the search starts where it would be if they were evenly
/// spread.
fn find<E: SubjectRow>(table: &[E], subject: Subject) -> Option<&E> {
    let at = |index: usize| table[index].line().subject();
    let guess = (((subject >> 64) * table.len() as u128) >> 64) as usize;
    let (mut first, mut last, mut step) = (guess, guess, 4);
    while first > 0 && at(first) > subject {
        first = first.saturating_sub(step);
        step *= 2;
    }
    step = 4;
    while last < table.len() && at(last) < subject {
        last = last.saturating_add(step).min(table.len());
        step *= 2;
    }
    let last = (last + 1).min(table.len());
    let found = table[first..last].binary_search_by_key(&subject, |entry| entry.line().subject());
    found.ok().map(|index| &table[first + index])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_subject_of_a_table_is_found_and_no_other() {
        // As evenly spread as digests, and as unevenly as a forged index may be.
        let even = |n: u64| super::super::subject(&[&n.to_string()]);
        let uneven = [|n: u64| n, |n: u64| n << 40, |n: u64| u64::MAX - (n << 50)];
        let uneven = uneven.map(|spread| move |n: u64| Subject::from(spread(n + 1)) << 64 | 7);
        let [one, two, three] = &uneven;
        let spreads: [&dyn Fn(u64) -> Subject; 4] = [&even, one, two, three];
        for (count, subject) in
            [0, 1, 2, 3, 10, 1000].into_iter().flat_map(|n| spreads.map(|spread| (n, spread)))
        {
            let mut table = Vec::new();
            let line = |n: u64| Location::new(Tag::Publishing, subject(n), &(n..n + 1), n);
            merge(&mut table, (0..count).rev().map(line).collect());
            assert_eq!(table.len() as u64, count);
            for n in 0..count {
                assert_eq!(find(&table, subject(n)).unwrap().offset, n);
                assert!(find(&table, subject(n) ^ 1).is_none());
            }
            assert!(find(&table, 0).is_none() && find(&table, Subject::MAX).is_none());
        }
    }

    #[test]
    fn of_several_rows_the_last_holds_and_one_can_be_taken_back() {
        let line = |n: u64, offset: u64, length: u64| {
            Location::new(Tag::Publishing, n.into(), &(offset..offset + length), 0)
        };
        let mut table = Vec::new();
        merge(&mut table, vec![line(2, 0, 1), line(1, 1, 1), line(2, 2, 1)]);
        merge(&mut table, vec![line(3, 3, 1), line(1, 4, 0), line(2, 5, 1)]);
        let rows = table.iter().map(|line| (line.subject(), line.offset)).collect::<Vec<_>>();
        assert_eq!(rows, [(2, 5), (3, 3)]);
    }

    #[test]
    fn what_is_no_longer_in_effect_does_not_pile_up() {
        let mut tables = Tables::default();
        for round in 0..2000_u64 {
            let json = serde_json::json!({
                "manifest": "pipeline.toml", "key": Digest([round as u8; 32]), "kind": "write",
                "outputs": [{ "digest": Digest([round as u8; 32]), "bytes": round }],
                "reads": [{ "path": format!("{round}.txt"), "listing": false, "digest": null }],
            });
            let subject = Subject::from(round % 3);
            let line = Location::new(Tag::Item, subject, &(round..round + 1), round);
            tables.apply(vec![Update::of(Tag::Item, line, json.to_string().as_bytes())]);
        }
        assert!(tables.blobs.len() < 1100 && tables.reads.len() < 1100 && tables.names.texts.len() < 1200);
        assert!(tables.are_sound());
        for (subject, round) in [(0, 1998), (1, 1999), (2, 1997)] {
            let latest = tables.latest(subject).unwrap();
            assert_eq!(latest.outputs()[0].bytes, round);
            assert_eq!(latest.reads().next().unwrap().0, format!("{round}.txt"));
            assert_eq!((latest.manifest(), latest.kind()), ("pipeline.toml", "write"));
        }
    }
}
