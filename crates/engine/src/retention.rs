//! Which lines of the journal outlive a compaction.
//!
//! Under a watcher every edit appends a result under a key that never comes again, and every new file a stamp. Kept are
//! the records in effect, the ledger, the results and stamps that those records lead to, and of the others the newest:
//! four results for each item and a thousand more. That is some hours of edits to take back, and a journal that opens
//! in little more time than one without a past, as a line has about a kilobyte. In memory only its index stays. What is forgotten only costs a rerun.

use std::collections::{HashMap, HashSet};
use std::path::Path;

use serde::Deserialize;

use crate::disk;
use crate::journal::{Journal, Subject, Tag, short};
use crate::{Digest, FileRead};

/// Earlier results for each item in effect, stamps that no record in effect needs, items that have gone.
const EARLIER: usize = 4;
const OTHERS: usize = 1000;

/// What a record says of the lines that it needs.
#[derive(Deserialize)]
struct Effect {
    key: Digest,
    manifest: String,
    reads: Vec<FileRead>,
    #[serde(default)]
    gone: bool,
}

/// Decides about line after line, the newest first.
pub(crate) struct Retention {
    results: HashSet<Subject>,
    stamps: HashSet<Subject>,
    /// Items that have gone, or whose manifest has.
    gone: HashSet<Subject>,
    other_results: usize,
    other_stamps: usize,
    other_items: usize,
}

impl Retention {
    /// What the journal of the manifests in a folder keeps.
    pub(crate) fn of(journal: &Journal, folder: &Path) -> Self {
        let mut manifests = Manifests::new(folder);
        let (mut results, mut stamps, mut gone) = (HashSet::new(), HashSet::new(), HashSet::new());
        for (subject, effect) in journal.subjects::<Effect>(Tag::Item) {
            if effect.gone || !manifests.has(&effect.manifest) {
                gone.insert(subject);
                continue;
            }
            results.insert(short(effect.key));
            let files = effect.reads.iter().filter(|read| !read.listing);
            stamps.extend(files.map(|read| disk::place(&folder.join(&read.path))));
        }
        let other_results = EARLIER * results.len() + OTHERS;
        Self { results, stamps, gone, other_results, other_stamps: OTHERS, other_items: OTHERS }
    }

    /// At most so many lines stay of so many records in effect, items that have gone, results and stamps.
    pub(crate) fn most(items: usize, gone: usize, results: usize, stamps: usize) -> usize {
        items + gone.min(OTHERS) + results.min((EARLIER + 1) * items + OTHERS) + stamps.min(items + OTHERS)
    }

    /// Whether a line stays; to be asked from the newest line to the oldest.
    pub(crate) fn keeps(&mut self, tag: Tag, subject: Subject) -> bool {
        let others = match tag {
            Tag::Published | Tag::Publishing => return true,
            // The newest result of a key in effect is the one in effect.
            Tag::Result if self.results.remove(&subject) => return true,
            Tag::Stamp if self.stamps.contains(&subject) => return true,
            Tag::Item if !self.gone.contains(&subject) => return true,
            Tag::Result => &mut self.other_results,
            Tag::Stamp => &mut self.other_stamps,
            Tag::Item => &mut self.other_items,
        };
        let keeps = *others > 0;
        *others = others.saturating_sub(1);
        keeps
    }
}

/// Which manifests are still in a folder.
pub(crate) struct Manifests<'a> {
    folder: &'a Path,
    known: HashMap<String, bool>,
}

impl<'a> Manifests<'a> {
    pub(crate) fn new(folder: &'a Path) -> Self {
        Self { folder, known: HashMap::new() }
    }

    pub(crate) fn has(&mut self, name: &str) -> bool {
        if let Some(known) = self.known.get(name) {
            return *known;
        }
        let found = self.folder.join(name).exists();
        self.known.insert(name.to_owned(), found);
        found
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use serde_json::json;

    use super::*;
    use crate::journal::{Line, subject};

    fn digest(n: usize) -> Digest {
        Digest::of(&n.to_le_bytes())
    }

    fn record(n: usize) -> serde_json::Value {
        let read = json!({ "path": format!("texts/{n}.txt"), "listing": false, "digest": digest(n) });
        json!({
            "key": digest(n), "manifest": "pipeline.toml", "kind": "write", "reads": [read], "outputs": [], "failure": null
        })
    }

    /// A watcher's rebuild: the journal of the last one is taken up, lines are appended.
    fn rebuild(path: &Path, folder: &Path, kept: Option<Journal>, lines: &[Line]) -> Option<Journal> {
        let journal = Journal::write(path, kept, |journal| Retention::of(journal, folder)).unwrap();
        journal.append(lines).unwrap();
        journal.rest()
    }

    #[test]
    fn a_hundred_thousand_lines_leave_a_bounded_journal_and_what_is_in_effect() {
        const ITEMS: usize = 20;
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("journal");
        fs::write(folder.path().join("pipeline.toml"), "").unwrap();
        let stamp = |n: usize| disk::place(&folder.path().join(format!("texts/{n}.txt")));
        let item = |n: usize| subject(&["item", &n.to_string()]);
        // What one rebuild appends for one item: the digest of a file, a result, the record in effect.
        let run = |place: usize, n: usize| {
            [
                Line::new(Tag::Stamp, stamp(n), Some(&n)),
                Line::new(Tag::Result, short(digest(n)), Some(&record(n))),
                Line::new(Tag::Item, item(place), Some(&record(n))),
            ]
        };
        let first = (0..ITEMS).flat_map(|n| run(n, n)).collect::<Vec<_>>();
        let mut kept = rebuild(&path, folder.path(), None, &first);
        let (mut longest, mut largest) = (0, 0);
        let mut appended = first.len();
        let mut n = ITEMS;
        while appended < 100_000 {
            // All but the first item change with every rebuild.
            let lines = (1..ITEMS).flat_map(|place| run(place, n + place)).collect::<Vec<_>>();
            n += ITEMS;
            appended += lines.len();
            let journal = rebuild(&path, folder.path(), kept.take(), &lines);
            longest = longest.max(fs::metadata(&path).unwrap().len());
            largest = largest.max(journal.as_ref().unwrap().size().1);
            kept = journal;
        }
        // 20 items, 20 + 4 * 20 + 1000 results and 20 + 1000 stamps are kept; twice that and a thousand lines trigger.
        let bound = 2 * (20 + 1100 + 1020) + 1000 + 3 * ITEMS;
        assert!(longest < 400 * bound as u64, "{longest} bytes in the file");
        assert!(largest <= bound as u64, "{largest} lines in the file");
        let journal = Journal::read(&path).unwrap();
        assert_eq!(journal.subjects::<serde_json::Value>(Tag::Item).len(), ITEMS);
        assert!(journal.results::<serde_json::Value>(short(digest(0))).next().is_some(), "it is in effect");
        assert_eq!(journal.get::<usize>(Tag::Stamp, stamp(0)), Some(0));
        let newest = n - 1;
        assert!(journal.results::<serde_json::Value>(short(digest(newest))).next().is_some());
        assert!(journal.results::<serde_json::Value>(short(digest(ITEMS + 1))).next().is_none());
    }

    #[test]
    fn of_items_that_have_gone_and_of_manifests_that_have_gone_some_are_kept() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("journal");
        fs::write(folder.path().join("pipeline.toml"), "").unwrap();
        let line = |n: usize, manifest: &str, gone: bool| {
            let mut record = record(n);
            record["manifest"] = manifest.into();
            record["gone"] = gone.into();
            Line::new(Tag::Item, n as Subject, Some(&record))
        };
        let lines = (0..10_000).map(|n| match n {
            0..100 => line(n, "pipeline.toml", false),
            100..8000 => line(n, "pipeline.toml", true),
            _ => line(n, "lost.toml", false),
        });
        let kept = rebuild(&path, folder.path(), None, &lines.collect::<Vec<_>>());
        rebuild(&path, folder.path(), kept, &[]);
        let journal = Journal::read(&path).unwrap();
        let left = journal.subjects::<serde_json::Value>(Tag::Item);
        assert_eq!(left.len(), 100 + OTHERS);
        assert!((0..100).all(|n| left.iter().any(|(subject, _)| *subject == n)));
    }
}
