//! The errors that stand: each is kept in view until its item succeeds or is gone, or the manifest is valid again.

use std::collections::{BTreeMap, BTreeSet};

use engine::{Diagnostics, Event, ItemName, line_and_column};

/// At most so many are named in one place; the others are counted.
const NAMED: usize = 5;

/// What is broken, over all the builds of a watcher.
#[derive(Default)]
pub(crate) struct OutstandingErrors {
    failures: BTreeMap<ItemName, Failed>,
    /// The manifest's errors in one line, while the last valid manifest is still in use.
    manifest: Option<String>,
    /// What keeps builds from going to their end.
    hindrance: Option<String>,
    /// The items that the build at work has spoken of.
    seen: BTreeSet<ItemName>,
}

/// An item's failure.
struct Failed {
    error: Vec<String>,
    help: Option<String>,
    /// How many items were not run because of it.
    waiting: usize,
    /// Whether the build at work printed it in full.
    fresh: bool,
}

/// What an event did to the errors that stand.
#[derive(Debug, PartialEq, Eq)]
pub(crate) enum Turn {
    /// Nothing that has to be said.
    Same,
    /// It is new, or is another one than before.
    Broke,
    /// What stood no longer does.
    Mended,
}

impl OutstandingErrors {
    /// Takes an event in.
    pub(crate) fn take(&mut self, event: &Event) -> Turn {
        match event {
            Event::Planned { .. } => {
                self.seen.clear();
                self.failures.values_mut().for_each(|failed| (failed.waiting, failed.fresh) = (0, false));
                self.hindrance = None;
            }
            Event::UpToDate { item } | Event::Finished { item, .. } => {
                self.seen.insert(item.clone());
                if self.failures.remove(item).is_some() {
                    return Turn::Mended;
                }
            }
            Event::Failed { item, error, help } => {
                self.seen.insert(item.clone());
                let known = self.failures.get(item);
                let fresh = known.is_none_or(|known| known.error != *error || known.help != *help);
                let failed = Failed { error: error.clone(), help: help.clone(), waiting: 0, fresh };
                self.failures.insert(item.clone(), failed);
                if fresh {
                    return Turn::Broke;
                }
            }
            Event::Skipped { item, because } => {
                self.seen.insert(item.clone());
                if let Some(failed) = because.as_ref().and_then(|because| self.failures.get_mut(because)) {
                    failed.waiting += 1;
                }
            }
            // A build that went to its end spoke of every item that there is.
            Event::Ended(summary) if !summary.cancelled => {
                self.failures.retain(|item, _| self.seen.contains(item));
            }
            Event::Rejected { diagnostics } => {
                self.manifest = Some(in_one_line(diagnostics));
                return Turn::Broke;
            }
            Event::Accepted => {
                self.manifest = None;
                return Turn::Mended;
            }
            Event::BuildError { error, .. } => {
                self.hindrance = Some(error.join(": "));
                return Turn::Broke;
            }
            _ => {}
        }
        Turn::Same
    }

    /// What to repeat after a rebuild: the errors that it did not print in full, in one paragraph.
    pub(crate) fn reminder(&self) -> Option<String> {
        let failures = self.failures.iter().filter(|(_, failed)| !failed.fresh);
        let failures = failures.map(|(item, failed)| format!("{item} ({})", failed.cause()));
        let named = self.manifest.iter().cloned().chain(failures).collect::<Vec<_>>();
        (!named.is_empty()).then(|| format!("still failing: {}", few(&named, "; ")))
    }

    /// Whether an error stands that keeps one of these items from being made anew.
    pub(crate) fn is_of(&self, items: &[ItemName]) -> bool {
        let failed = self.failures.keys().any(|item| items.contains(item));
        failed || self.manifest.is_some() || self.hindrance.is_some()
    }

    /// The errors for the bottom of a terminal, a few lines each.
    pub(crate) fn pinned(&self) -> Vec<String> {
        let mut lines = Vec::new();
        lines.extend(self.manifest.clone());
        lines.extend(self.hindrance.clone());
        for (item, failed) in self.failures.iter().take(NAMED) {
            let waiting = match failed.waiting {
                0 => String::new(),
                1 => "  (1 item waits for it)".into(),
                count => format!("  ({count} items wait for it)"),
            };
            lines.push(format!("FAILED  {item}{waiting}"));
            lines.push(format!("        {}", failed.cause()));
            lines.extend(failed.help.as_ref().map(|help| format!("        hint: {}", first_line(help))));
        }
        if self.failures.len() > NAMED {
            lines.push(format!("FAILED  {} more items", self.failures.len() - NAMED));
        }
        lines
    }
}

impl Failed {
    /// The chain in one line: where, and what happened at the end of it.
    fn cause(&self) -> String {
        self.error.iter().map(|cause| first_line(cause)).collect::<Vec<_>>().join(": ")
    }
}

/// The first error with its place, and the number of the others.
fn in_one_line(diagnostics: &Diagnostics) -> String {
    let Diagnostics { file, text, errors } = diagnostics;
    let Some(first) = errors.first() else { return file.clone() };
    let place = first.span.as_ref().map(|span| line_and_column(text, span.start));
    let place = place.map_or_else(String::new, |(line, column)| format!(":{line}:{column}"));
    let more = match errors.len() - 1 {
        0 => String::new(),
        1 => " (and 1 more error)".into(),
        more => format!(" (and {more} more errors)"),
    };
    format!("{file}{place}: {}{more}", first_line(&first.message))
}

fn first_line(text: &str) -> &str {
    text.lines().next().unwrap_or("")
}

/// Some of a list, and how many more there are.
pub(crate) fn few(names: &[String], between: &str) -> String {
    match names.len().checked_sub(NAMED) {
        None | Some(0) => names.join(between),
        Some(more) => format!("{} and {more} more", names[..NAMED].join(between)),
    }
}
