//! Which lines of the journal survive a compaction.
//!
//! With a watcher, every edit appends a result under a key that never recurs, and every new file a stamp. A
//! compaction keeps the latest records, the ledger, the results and stamps that those records refer to, and
//! of the others the newest: four results for each item and a thousand more. That allows undoing some hours
//! of edits, and the journal opens hardly more slowly than a new one, as a line has about a kilobyte and only
//! its index stays in memory. A dropped line costs no more than a rerun.

use std::collections::HashSet;

use super::line::{Subject, Tag};

/// Further results for each item, and further stamps, results and items that no longer exist.
const EARLIER: usize = 4;
pub(crate) const OTHERS: usize = 1000;

/// Decides about each line, the newest first.
pub(crate) struct Retention {
    results: HashSet<Subject>,
    stamps: HashSet<Subject>,
    /// Items that no longer exist, or whose manifest does not.
    gone: HashSet<Subject>,
    other_results: usize,
    other_stamps: usize,
    other_items: usize,
}

impl Retention {
    /// Keeps the results and stamps that the latest records refer to; `gone` are the items that no longer
    /// exist.
    pub(crate) fn new(results: HashSet<Subject>, stamps: HashSet<Subject>, gone: HashSet<Subject>) -> Self {
        let other_results = EARLIER * results.len() + OTHERS;
        Self { results, stamps, gone, other_results, other_stamps: OTHERS, other_items: OTHERS }
    }

    /// The number of lines that remain at most of so many latest records, items that no longer exist, results
    /// and stamps.
    pub(crate) fn most(items: usize, gone: usize, results: usize, stamps: usize) -> usize {
        items + gone.min(OTHERS) + results.min((EARLIER + 1) * items + OTHERS) + stamps.min(items + OTHERS)
    }

    /// Whether to keep a line; to be called from the newest line to the oldest.
    pub(crate) fn keeps(&mut self, tag: Tag, subject: Subject) -> bool {
        let others = match tag {
            Tag::Published | Tag::Publishing => return true,
            // The newest result of such a key is the one that the latest record has.
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
