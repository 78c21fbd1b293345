//! The nearest spelling of an unknown word.

use std::cell::Cell;

/// Longer words are not compared, because the time is the product of both lengths.
const MAX_WORD: usize = 256;

/// The candidate that `name` is most likely a misspelling of.
pub fn nearest<'a>(name: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    Spelling::default().nearest(name, candidates)
}

/// Finds the nearest spellings of many words among many candidates. The work is bounded; after that it finds
/// nothing.
///
/// Of thousands of errors people read a few, and thousands of words times thousands of candidates take
/// minutes.
pub(crate) struct Spelling {
    budget: Cell<usize>,
}

impl Default for Spelling {
    /// A budget that is enough for fifty short words among twenty thousand.
    fn default() -> Self {
        Self { budget: Cell::new(50_000_000) }
    }
}

impl Spelling {
    /// The cost of a candidate that is excluded by its length.
    const CANDIDATE: usize = 8;

    /// The cost of listing a name in a folder.
    const NAME: usize = 1000;

    /// Finds what [`nearest`] finds, within the budget.
    pub(crate) fn nearest<'a>(
        &self,
        name: &str,
        candidates: impl IntoIterator<Item = &'a str>,
    ) -> Option<&'a str> {
        let length = name.chars().count();
        if length > MAX_WORD || self.is_used_up() {
            return None;
        }
        let most = 1 + length / 3;
        let similar = candidates.into_iter().filter(|candidate| {
            let other = candidate.chars().count();
            let is_similar = length.abs_diff(other) <= most;
            self.spend(Self::CANDIDATE + if is_similar { length * other } else { 0 });
            is_similar
        });
        let scored = similar.map(|candidate| (strsim::osa_distance(name, candidate), candidate));
        let best = scored.min_by_key(|(distance, _)| *distance)?;
        // A word that shares no letter is not a misspelling.
        (best.0 <= most && best.0 < length).then_some(best.1)
    }

    /// Counts the names of a folder that was listed for a message.
    pub(crate) fn has_listed(&self, names: usize) {
        self.spend(Self::NAME * names);
    }

    pub(crate) fn is_used_up(&self) -> bool {
        self.budget.get() == 0
    }

    fn spend(&self, work: usize) {
        self.budget.set(self.budget.get().saturating_sub(work));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_a_near_spelling_is_found() {
        let kinds = ["project-sh", "project-brdf", "convolve", "rotate", "export-shrm"];
        assert_eq!(nearest("projectsh", kinds), Some("project-sh"));
        assert_eq!(nearest("Convolve", kinds), Some("convolve"));
        assert_eq!(nearest("roatte", kinds), Some("rotate"));
        assert_eq!(nearest("export", kinds), None);
        assert_eq!(nearest("x", ["a"]), None);
        assert_eq!(nearest("x", []), None);
    }

    #[test]
    fn a_word_as_long_as_a_file_is_not_compared() {
        let (one, other) = ("a".repeat(1 << 20), "b".repeat(1 << 20));
        assert_eq!(nearest(&one, [one.as_str(), other.as_str()]), None);
        assert_eq!(nearest("rotat", [one.as_str(), "rotate"]), Some("rotate"));
    }

    #[test]
    fn the_work_for_many_words_among_many_is_bounded() {
        let names = (0..2000).map(|n| format!("stage-{n}")).collect::<Vec<_>>();
        let spelling = Spelling { budget: Cell::new(5_000_000) };
        let looked_at = Cell::new(0_usize);
        let found = (0..2000).filter(|n| {
            let candidates = names.iter().inspect(|_| looked_at.set(looked_at.get() + 1));
            spelling.nearest(&format!("stgae-{n}"), candidates.map(String::as_str)).is_some()
        });
        assert_eq!(found.count(), looked_at.get() / names.len(), "each search compares all candidates");
        assert!((20_000..100_000).contains(&looked_at.get()), "{} of 4 million", looked_at.get());
        assert!(spelling.is_used_up());
        assert_eq!(nearest("stgae-1999", names.iter().map(String::as_str)), Some("stage-1999"));
    }
}
