//! Which lines the journal of the manifests in a folder has to keep.

use std::collections::{HashMap, HashSet};
use std::path::Path;

use crate::plan;
use crate::platform::is_one_file;
use crate::storage::{Journal, ReadKind, Retention, path_name, short, stamp_subject};

impl Retention {
    /// The lines that a compaction of the journal of the manifests in a folder keeps.
    pub(crate) fn of(journal: &Journal, folder: &Path) -> Self {
        let mut manifests = Manifests::new(folder, None);
        let (mut results, mut stamps, mut gone) = (HashSet::new(), HashSet::new(), HashSet::new());
        for (subject, latest) in journal.latest_records() {
            if latest.is_gone() || !manifests.has(latest.manifest()) {
                gone.insert(subject);
                continue;
            }
            results.insert(short(latest.key()));
            let files = latest.reads().filter(|(_, kind, _)| *kind == ReadKind::Content);
            stamps.extend(files.map(|(path, ..)| stamp_subject(&folder.join(path))));
        }
        Self::new(results, stamps, gone)
    }
}

/// Which manifests are still in a folder, and where they export to.
pub(crate) struct Manifests<'a> {
    folder: &'a Path,
    /// A manifest whose file may have other names, such as a link or another spelling, which do not count.
    own: Option<&'a str>,
    known: HashMap<String, bool>,
    /// The folders for exports; `None` if a manifest cannot be read.
    outs: HashMap<String, Option<String>>,
}

impl<'a> Manifests<'a> {
    pub(crate) fn new(folder: &'a Path, own: Option<&'a str>) -> Self {
        Self { folder, own, known: HashMap::new(), outs: HashMap::new() }
    }

    pub(crate) fn has(&mut self, name: &str) -> bool {
        if let Some(known) = self.known.get(name) {
            return *known;
        }
        let path = self.folder.join(name);
        let is_own = |own: &str| own != name && is_one_file(&self.folder.join(own), &path);
        let found = path.exists() && !self.own.is_some_and(is_own);
        self.known.insert(name.to_owned(), found);
        found
    }

    /// Whether a manifest exists and may export into a folder, as records contain it. A manifest that cannot
    /// be read may.
    pub(crate) fn exports_into(&mut self, name: &str, out: &str) -> bool {
        if !self.has(name) {
            return false;
        }
        let found = || plan::out_of(&self.folder.join(name)).map(|out| path_name(self.folder, &out));
        let known = self.outs.entry(name.to_owned()).or_insert_with(found);
        known.as_ref().is_none_or(|known| known == out)
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use serde_json::json;

    use super::*;
    use crate::key::Digest;
    use crate::storage::{Line, OTHERS, Subject, Tag, subject};

    fn digest(n: usize) -> Digest {
        Digest::of(&n.to_le_bytes())
    }

    fn record(n: usize) -> serde_json::Value {
        let read = json!({ "path": format!("texts/{n}.txt"), "listing": false, "digest": digest(n) });
        json!({
            "key": digest(n), "manifest": "pipeline.toml", "kind": "write", "reads": [read], "outputs": [], "failure": null
        })
    }

    /// A watcher's rebuild: the last one's journal is opened again, and lines are appended.
    fn rebuild(path: &Path, folder: &Path, saved: Option<Journal>, lines: &[Line]) -> Option<Journal> {
        let journal = Journal::write(path, saved, |journal| Retention::of(journal, folder)).unwrap();
        journal.append(lines).unwrap();
        journal.close()
    }

    #[test]
    fn a_hundred_thousand_lines_leave_a_bounded_journal_and_what_is_in_effect() {
        const ITEMS: usize = 20;
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("journal");
        fs::write(folder.path().join("pipeline.toml"), "").unwrap();
        let stamp = |n: usize| stamp_subject(&folder.path().join(format!("texts/{n}.txt")));
        let item = |n: usize| subject(&["item", &n.to_string()]);
        // One rebuild appends for one item: the digest of a file, a result, the latest record.
        let run = |place: usize, n: usize| {
            [
                Line::new(Tag::Stamp, stamp(n), Some(&n)),
                Line::new(Tag::Result, short(digest(n)), Some(&record(n))),
                Line::new(Tag::Item, item(place), Some(&record(n))),
            ]
        };
        let first = (0..ITEMS).flat_map(|n| run(n, n)).collect::<Vec<_>>();
        let mut saved = rebuild(&path, folder.path(), None, &first);
        let (mut longest, mut largest) = (0, 0);
        let mut appended = first.len();
        let mut n = ITEMS;
        while appended < 100_000 {
            // All but the first item change with every rebuild.
            let lines = (1..ITEMS).flat_map(|place| run(place, n + place)).collect::<Vec<_>>();
            n += ITEMS;
            appended += lines.len();
            let journal = rebuild(&path, folder.path(), saved.take(), &lines);
            longest = longest.max(fs::metadata(&path).unwrap().len());
            largest = largest.max(journal.as_ref().unwrap().size().1);
            saved = journal;
        }
        // 20 items, 20 + 4 * 20 + 1000 results and 20 + 1000 stamps are kept; a compaction comes at twice
        // that and 1000.
        let bound = 2 * (20 + 1100 + 1020) + 1000 + 3 * ITEMS;
        assert!(longest < 400 * bound as u64, "{longest} bytes in the file");
        assert!(largest <= bound as u64, "{largest} lines in the file");
        let journal = Journal::read(&path).unwrap();
        assert_eq!(journal.contents::<serde_json::Value>(Tag::Item).len(), ITEMS);
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
        let saved = rebuild(&path, folder.path(), None, &lines.collect::<Vec<_>>());
        rebuild(&path, folder.path(), saved, &[]);
        let journal = Journal::read(&path).unwrap();
        let left = journal.contents::<serde_json::Value>(Tag::Item);
        assert_eq!(left.len(), 100 + OTHERS);
        assert!((0..100).all(|n| left.iter().any(|(subject, _)| *subject == n)));
    }
}
