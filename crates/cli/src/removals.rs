//! The files that were removed from `out`, a line for each cause.

use std::cmp::Reverse;
use std::collections::BTreeMap;

use engine::{RemovalCause, path_text};

use crate::lists::more;
use crate::quantity::count;

/// This many causes are shown; the files of the others are counted.
const MAX_CAUSES: usize = 10;

/// The removed files that have not been shown yet.
#[derive(Default)]
pub(crate) struct Removals(BTreeMap<RemovalCause, Vec<String>>);

impl Removals {
    pub(crate) fn add(&mut self, because: &RemovalCause, file: &str) {
        self.0.entry(because.clone()).or_default().push(file.to_owned());
    }

    /// `hdri/studio.hdr was deleted: 26 files removed`; the causes of most files first. Nothing is left to be
    /// shown.
    pub(crate) fn take_lines(&mut self, removed: &str) -> Vec<String> {
        let mut causes = std::mem::take(&mut self.0).into_iter().collect::<Vec<_>>();
        causes.sort_by_key(|(_, files)| Reverse(files.len()));
        let rest = causes.iter().skip(MAX_CAUSES).map(|(_, files)| files.len()).sum();
        let lines = causes.iter().take(MAX_CAUSES).map(|(because, files)| match &files[..] {
            [file] => format!("{because}: {} {removed}", path_text(file)),
            files => format!("{because}: {} {removed}", count(files.len(), "file")),
        });
        let more = more(rest, "more file").map(|more| format!("{more} {removed}"));
        lines.chain(more).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_cause_has_a_line_with_its_files() {
        let deleted = |number: usize| RemovalCause::SourceDeleted { path: format!("hdri/{number:02}.hdr") };
        let mut removals = Removals::default();
        for number in 0..12 {
            removals.add(&deleted(number), "maps/a.exr");
        }
        removals.add(&deleted(3), "maps/b.exr");
        let lines: Vec<_> = removals.take_lines("removed").into_iter().map(test_data::unix_paths).collect();
        assert_eq!(lines[0], "hdri/03.hdr was deleted: 2 files removed");
        assert_eq!(lines[1], "hdri/00.hdr was deleted: maps/a.exr removed");
        assert_eq!((lines.len(), lines[10].as_str()), (11, "... and 2 more files removed"));
        assert!(removals.take_lines("removed").is_empty());
    }
}
