//! The errors that are not fixed yet: each stays in view until its item succeeds or is gone, or the manifest
//! is valid.

use std::collections::{BTreeMap, BTreeSet};

use engine::{Diagnostics, Event, ItemName, line_and_column};

use crate::lists::{NAMED, list, more};

/// The errors that all the builds of a watcher so far have left.
#[derive(Default)]
pub(crate) struct OutstandingErrors {
    failures: BTreeMap<ItemName, FailedItem>,
    /// The manifest's errors in one line, while the last valid manifest is in use.
    manifest: Option<String>,
    /// Why the last build as a whole could not finish.
    build: Option<String>,
    /// The items that the current build has reported.
    seen: BTreeSet<ItemName>,
}

struct FailedItem {
    error: Vec<String>,
    help: Option<String>,
    /// The number of items that were not run because of the failure.
    waiting: usize,
    /// Whether the current build printed the failure in full.
    is_new: bool,
}

/// What an event does to the outstanding errors.
#[derive(Debug, PartialEq, Eq)]
pub(crate) enum Transition {
    /// Nothing that has to be reported.
    None,
    /// An error is new, or differs from the one before.
    Failed,
    Fixed,
}

impl OutstandingErrors {
    /// Follows the events of a watcher.
    pub(crate) fn update(&mut self, event: &Event) -> Transition {
        match event {
            Event::Planned { .. } => {
                self.seen.clear();
                self.failures.values_mut().for_each(|failure| (failure.waiting, failure.is_new) = (0, false));
                self.build = None;
            }
            Event::UpToDate { item, .. } | Event::Finished { item, .. } => {
                self.seen.insert(item.clone());
                if self.failures.remove(item).is_some() {
                    return Transition::Fixed;
                }
            }
            Event::Failed { item, error, help } => {
                self.seen.insert(item.clone());
                let known = self.failures.get(item);
                let is_new = known.is_none_or(|known| known.error != *error || known.help != *help);
                let failure = FailedItem { error: error.clone(), help: help.clone(), waiting: 0, is_new };
                self.failures.insert(item.clone(), failure);
                if is_new {
                    return Transition::Failed;
                }
            }
            Event::Skipped { item, because } => {
                self.seen.insert(item.clone());
                if let Some(failure) = because.as_ref().and_then(|because| self.failures.get_mut(because)) {
                    failure.waiting += 1;
                }
            }
            // A build that was not cancelled has reported every item of the graph.
            Event::Ended(summary) if !summary.cancelled => {
                self.failures.retain(|item, _| self.seen.contains(item));
            }
            Event::Rejected { diagnostics } => {
                self.manifest = Some(in_one_line(diagnostics));
                return Transition::Failed;
            }
            Event::Accepted => {
                self.manifest = None;
                return Transition::Fixed;
            }
            Event::BuildError { error, .. } => {
                self.build = Some(error.join(": "));
                return Transition::Failed;
            }
            _ => {}
        }
        Transition::None
    }

    /// The reminder at the end of a rebuild: the errors that it did not print in full, in one paragraph.
    pub(crate) fn reminder(&self) -> Option<String> {
        let failures = self.failures.iter().filter(|(_, failure)| !failure.is_new);
        let failures = failures.map(|(item, failure)| format!("{item} ({})", failure.in_one_line()));
        let named = self.manifest.iter().cloned().chain(failures).collect::<Vec<_>>();
        (!named.is_empty()).then(|| format!("still failing: {}", list(&named, "; ", NAMED)))
    }

    /// Whether the manifest has errors, so that the last valid one is in use.
    pub(crate) fn rejects_manifest(&self) -> bool {
        self.manifest.is_some()
    }

    /// Whether one of the errors keeps some of these items from being rebuilt.
    pub(crate) fn affects(&self, items: &[ItemName]) -> bool {
        let failed = self.failures.keys().any(|item| items.contains(item));
        failed || self.manifest.is_some() || self.build.is_some()
    }

    /// The errors, a few lines each, for the bottom of a terminal or a panel.
    pub(crate) fn lines(&self) -> Vec<String> {
        let mut lines = Vec::new();
        lines.extend(self.manifest.clone());
        lines.extend(self.build.clone());
        for (item, failure) in self.failures.iter().take(NAMED) {
            let waiting = match failure.waiting {
                0 => String::new(),
                1 => "  (1 item waits for it)".into(),
                count => format!("  ({count} items wait for it)"),
            };
            lines.push(format!("FAILED  {item}{waiting}"));
            lines.push(format!("        {}", failure.in_one_line()));
            lines.extend(failure.help.as_ref().map(|help| format!("        hint: {}", first_line(help))));
        }
        lines.extend(more(self.failures.len().saturating_sub(NAMED), "more failed item"));
        lines
    }
}

impl FailedItem {
    /// The failure's chain of causes in one line.
    fn in_one_line(&self) -> String {
        self.error.iter().map(|cause| first_line(cause)).collect::<Vec<_>>().join(": ")
    }
}

/// The first of the manifest's errors with its place, and how many others there are.
fn in_one_line(diagnostics: &Diagnostics) -> String {
    let Some(first) = diagnostics.errors.first() else { return diagnostics.file.clone() };
    let place = first.span.as_ref().map(|span| line_and_column(&diagnostics.text, span.start));
    let place = place.map_or_else(String::new, |(line, column)| format!(":{line}:{column}"));
    let more = match diagnostics.errors.len() {
        1 => String::new(),
        2 => " (and 1 more error)".into(),
        count => format!(" (and {} more errors)", count - 1),
    };
    format!("{}{place}: {}{more}", diagnostics.file, first_line(&first.message))
}

fn first_line(text: &str) -> &str {
    text.lines().next().unwrap_or("")
}
