//! Lists as people read them: the first entries, and how many others there are.

use std::borrow::Borrow;

use crate::quantity::count;

/// If thousands of items fail, this many failures are shown; the others are counted.
pub(crate) const SHOWN: usize = 50;

/// This many entries of a list are named in a sentence.
pub(crate) const NAMED: usize = 5;

/// The first `most` entries: `a, b and 3 more`.
pub(crate) fn list<S: Borrow<str>>(entries: &[S], separator: &str, most: usize) -> String {
    let named = entries[..most.min(entries.len())].join(separator);
    match entries.len().saturating_sub(most) {
        0 => named,
        more => format!("{named} and {more} more"),
    }
}

/// As many names as fit into a line: `a, b and 3 more`.
pub(crate) fn fitting(names: &[String], columns: usize) -> String {
    let mut text = names.first().cloned().unwrap_or_default();
    for (index, name) in names.iter().enumerate().skip(1) {
        if text.chars().count() + name.chars().count() + " and 100 more".len() > columns {
            return format!("{text} and {} more", names.len() - index);
        }
        text += &format!(", {name}");
    }
    text
}

/// `... and 4950 more errors`: the line that counts those that are not shown, if there are any.
pub(crate) fn more(number: usize, what: &str) -> Option<String> {
    (number > 0).then(|| format!("... and {}", count(number, what)))
}
