//! Which lines of the journal outlive a compaction.
//!
//! Under a watcher every edit appends a result under a key that never comes again, and every new file a stamp. Kept are
//! the records in effect, the ledger, the results and stamps that those records lead to, and of the others the newest:
//! four results for each item and a thousand more. That is some hours of edits to take back, and a journal that opens
//! in little more time than one without a past, as a line has about a kilobyte. In memory only its index stays. What is forgotten only costs a rerun.

use std::collections::HashSet;

use super::line::{Subject, Tag};

/// Earlier results for each item in effect, stamps that no record in effect needs, items that have gone.
const EARLIER: usize = 4;
pub(crate) const OTHERS: usize = 1000;

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
    /// Keeps the results and stamps that the records in effect lead to; `gone` are the items that have gone.
    pub(crate) fn new(results: HashSet<Subject>, stamps: HashSet<Subject>, gone: HashSet<Subject>) -> Self {
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
