//! Watching as a person sees it: which files changed, what ran because of that and why, how long it took
//! until each output was updated, and what still fails.
//!
//! An edit takes a few lines: the items of a stage share one line, with the files that they published. A
//! build of milliseconds is reported at its end, a build of seconds every now and then.

use std::collections::BTreeMap;

use engine::{Change, Changed, Event, ItemName, Reason, Summary, path_text};
use parking_lot::{Mutex, MutexGuard};

use crate::lists::{NAMED, SHOWN, fitting, list, more};
use crate::outstanding::{OutstandingErrors, Transition};
use crate::prune::leftovers;
use crate::quantity::{count, duration};
use crate::removals::Removals;
use crate::screen::Screen;
use crate::warning_groups::WarningGroups;
use crate::{drawn_errors, reasons};

/// A build that takes longer reports what it has done so far, in milliseconds.
const REPORT_INTERVAL: f64 = 2000.0;

/// Up to this many changes are named; more are counted by folder.
const CHANGES: usize = 4;

/// The column where the text of a line begins, after the times.
const INDENT: usize = 10;

/// A moment, to measure with and to show.
pub(crate) struct Moment {
    /// The time since the program started, in milliseconds.
    pub(crate) milliseconds: f64,
    /// The time of day.
    pub(crate) time: String,
}

/// Turns a watcher's events into lines on standard error.
pub(crate) struct WatchReporter {
    verbose: bool,
    screen: Screen,
    clock: Box<dyn Fn() -> Moment + Send + Sync>,
    state: Mutex<WatchReporterState>,
}

#[derive(Default)]
struct WatchReporterState {
    errors: OutstandingErrors,
    /// How the watcher gets changes.
    watching: String,
    /// When the first of the current changes was noticed.
    noticed: f64,
    changed: Vec<String>,
    /// Whether there was a build before.
    built: bool,
    /// The time of day of a build without a known change, until it has something to report.
    unannounced: Option<String>,
    /// The time of the last report.
    reported: f64,
    /// The reports of what was done since the last report, by stage.
    groups: Vec<StageReport>,
    /// The items that run, and why.
    running: Vec<(ItemName, Vec<Reason>)>,
    /// The files that were removed since the last report.
    removals: Removals,
    /// The warnings since the last report.
    warnings: WarningGroups,
    /// How many files this build published.
    published: usize,
    /// How many items failed in this build, and how many failures it fixed.
    transitions: [usize; 2],
}

/// A report of what the items of one stage did since the last report.
struct StageReport {
    stage: String,
    items: Vec<ItemName>,
    why: Vec<String>,
    /// The number of items that have the same result as before.
    same: usize,
    files: Vec<String>,
    /// The time of the last of these events.
    at: f64,
}

impl WatchReporter {
    pub(crate) fn new(
        verbose: bool,
        screen: Screen,
        clock: impl Fn() -> Moment + Send + Sync + 'static,
    ) -> Self {
        Self { verbose, screen, clock: Box::new(clock), state: Mutex::default() }
    }

    pub(crate) fn show(&self, event: &Event) {
        let now = (self.clock)();
        let mut state = self.state();
        let transition = state.errors.update(event);
        if is_news(event, &transition)
            && let Some(time) = state.unannounced.take()
        {
            self.head(&time, "building again");
        }
        let since = duration(now.milliseconds - state.noticed);
        match event {
            Event::Watching { folders, poll_milliseconds, because } => {
                state.watching = watching(*folders, *poll_milliseconds, because.as_deref());
                self.head(&now.time, &state.watching);
            }
            Event::Noticed { changes, milliseconds } => {
                state.noticed = now.milliseconds - milliseconds;
                state.changed = changes.iter().map(|change| change.path.clone()).collect();
                self.show_changes(&now.time, changes);
            }
            Event::Planned { items, .. } => {
                if state.changed.is_empty() {
                    state.noticed = now.milliseconds;
                    if state.built {
                        state.unannounced = Some(now.time.clone());
                    } else {
                        self.head(&now.time, &format!("building, {}", count(*items, "item")));
                    }
                }
                (state.published, state.reported, state.built) = (0, now.milliseconds, true);
                state.transitions = [0; 2];
                self.screen.begin(*items);
            }
            Event::ManifestWarnings { diagnostics } => {
                diagnostics.to_string().lines().for_each(|line| self.line("warning", line));
            }
            Event::Waiting { holder, .. } => self.line("waiting", &format!("for {holder}")),
            Event::UpToDate { item, .. } => {
                self.screen.settled();
                if self.verbose {
                    self.line("", &format!("{item} is up to date"));
                }
                self.show_fixed(&mut state, &transition, item);
            }
            Event::SharedCache { host, message } => {
                self.line("warning", &format!("shared cache {host}: {message}"));
            }
            Event::Started { item, reasons, .. } => {
                state.running.push((item.clone(), reasons.clone()));
                self.screen.started(item);
            }
            Event::Progress { item, share } => self.screen.progress(item, *share),
            Event::Finished { item, changed, .. } => {
                self.screen.ended(item);
                self.show_fixed(&mut state, &transition, item);
                let why = state.ended(item);
                if self.verbose {
                    let same = if *changed { "" } else { "; the same result as before" };
                    self.line(&since, &format!("{item} ran: {}{same}", reasons::lines(&why).join("; ")));
                } else {
                    state.ran(item, &why, *changed, now.milliseconds);
                }
            }
            Event::Published { item, file, restored, .. } => {
                state.published += 1;
                if self.verbose {
                    let how = if *restored { "restored" } else { "updated" };
                    self.line(&since, &format!("{} {how}", path_text(file)));
                } else {
                    state.group(&item.stage, now.milliseconds).files.push(path_text(file));
                }
            }
            Event::Removed { file, because, .. } => {
                if self.verbose {
                    self.line(&since, &format!("{} was removed", path_text(file)));
                }
                state.removals.add(because, file);
            }
            Event::Warning { item, message } if self.verbose => {
                self.line("warning", &format!("{item}: {message}"));
            }
            Event::Warning { item, message } => state.warnings.add(item, message),
            Event::Leftovers { folder, files, published_by, manifest } => {
                self.line("warning", &leftovers(folder, *files, published_by, manifest));
            }
            Event::Note { item, message } if self.verbose => self.line("note", &format!("{item}: {message}")),
            Event::Note { .. } | Event::TaskTimed { .. } => {}
            Event::Failed { item, error, help } => {
                state.ended(item);
                self.screen.ended(item);
                if transition == Transition::Failed {
                    state.transitions[0] += 1;
                    if state.transitions[0] <= self.shown() {
                        self.show_error(&item.to_string(), error, help.as_deref());
                    }
                }
            }
            Event::Skipped { .. } => self.screen.settled(),
            Event::Ended(summary) => {
                self.screen.clear();
                self.report(&mut state, now.milliseconds);
                let counts = state.transitions.into_iter().zip(["more failed item", "more fixed item"]);
                for (number, what) in counts {
                    let more = more(number.saturating_sub(self.shown()), what);
                    more.iter().for_each(|more| self.line("", &format!("{more}; --verbose shows all")));
                }
                if state.unannounced.take().is_none() {
                    self.summarise(&mut state, summary, &since);
                }
            }
            Event::RebuildLoop { item, files } => {
                let files = list(files, ", ", NAMED);
                self.line(
                    "stopped",
                    &format!(
                        "{item} was restarted again and again, because each of its builds changed {files}: \
                         something in the build writes files that it reads. It will be tried again in ten \
                         seconds, or when another file changes."
                    ),
                );
            }
            Event::Rejected { diagnostics } => {
                self.screen.painted(&drawn_errors::drawn(diagnostics, self.screen.width()));
                let next = if state.built { "still using the last valid manifest" } else { "nothing runs" };
                self.line("", &format!("{}; {next}", drawn_errors::counted(diagnostics)));
                state.changed.clear();
            }
            Event::Accepted => self.line("fixed", "the manifest is valid again"),
            Event::BuildError { error, help } => {
                self.screen.clear();
                self.report(&mut state, now.milliseconds);
                self.show_error("the build", error, help.as_deref());
                state.running.clear();
                state.changed.clear();
            }
        }
        if now.milliseconds - state.reported > REPORT_INTERVAL {
            self.report(&mut state, now.milliseconds);
        }
        self.pin(&state, &now.time);
    }

    /// Removes everything but the lines that stay.
    pub(crate) fn close(&self) {
        self.screen.close();
    }

    /// Shows the changes, after the time of day.
    fn show_changes(&self, time: &str, changes: &[Change]) {
        let of_project = changes.iter().find(|change| change.path == "." && change.what != Changed::Unknown);
        let lines = if let Some(change) = of_project {
            // Everything in it has changed with it.
            vec![in_words(change)]
        } else if changes.len() <= CHANGES || self.verbose {
            changes.iter().map(in_words).collect()
        } else {
            by_folder(changes)
        };
        for (index, line) in lines.iter().enumerate() {
            self.head(if index == 0 { time } else { "" }, line);
        }
    }

    /// Reports what was done since the last report, a line for each stage.
    fn report(&self, state: &mut WatchReporterState, now: f64) {
        state.groups.sort_by(|one, other| one.at.total_cmp(&other.at));
        for group in std::mem::take(&mut state.groups) {
            self.line(&duration(group.at - state.noticed), &group.line(self.screen.width()));
        }
        for removed in state.removals.take_lines("removed") {
            self.line("", &removed);
        }
        for warning in state.warnings.take_lines() {
            self.line("warning", &warning);
        }
        state.reported = now;
    }

    /// Shows the end of a build: its counts, and what still fails.
    fn summarise(&self, state: &mut WatchReporterState, summary: &Summary, since: &str) {
        let Summary { ran, up_to_date, failed, skipped, cancelled, .. } = *summary;
        let mut parts = Vec::new();
        if state.published > 0 {
            parts.push(format!("{} updated", count(state.published, "file")));
        }
        if ran > 0 {
            parts.push(format!("{} ran", count(ran, "item")));
        }
        if failed > 0 {
            parts.push(format!("{failed} FAILED"));
        }
        if skipped > 0 && !cancelled {
            parts.push(format!("{skipped} not run"));
        }
        parts.push(format!("{up_to_date} up to date"));
        if cancelled {
            parts.push("stopped before the end".into());
        }
        self.line(since, &parts.join(", "));
        if !self.screen.can_pin()
            && let Some(reminder) = state.errors.reminder()
        {
            self.line("", &reminder);
        }
        state.running.clear();
        if !cancelled {
            state.changed.clear();
        }
    }

    /// Shows a line for an item that does not fail any more.
    fn show_fixed(&self, state: &mut WatchReporterState, transition: &Transition, item: &ItemName) {
        if *transition == Transition::Fixed {
            state.transitions[1] += 1;
            if state.transitions[1] <= self.shown() {
                self.line("fixed", &item.to_string());
            }
        }
    }

    /// How many failed items, and how many fixed ones, a build names.
    fn shown(&self) -> usize {
        if self.verbose { usize::MAX } else { SHOWN }
    }

    fn show_error(&self, what: &str, error: &[String], help: Option<&str>) {
        self.line("FAILED", what);
        for cause in error {
            cause.lines().for_each(|line| self.line("", &format!("  {line}")));
        }
        if let Some(help) = help {
            self.line("", &format!("  hint: {}", help.replace('\n', "\n          ")));
        }
    }

    /// The outstanding errors and how the watcher gets changes, at the bottom of a terminal.
    fn pin(&self, state: &WatchReporterState, time: &str) {
        if !self.screen.can_pin() {
            return;
        }
        let mut lines = state.errors.lines();
        lines.push(format!(
            "{time}  {}",
            if state.watching.is_empty() { "building" } else { &state.watching }
        ));
        self.screen.pin(lines.join("\n"));
    }

    /// Shows the first line of a paragraph.
    fn head(&self, time: &str, text: &str) {
        self.screen.line(format!("{time:<INDENT$}{text}").trim_end());
    }

    /// Shows a line: when something happened, and what.
    fn line(&self, when: &str, text: &str) {
        self.screen.line(format!("{when:>width$}  {text}", width = INDENT - 2).trim_end());
    }

    fn state(&self) -> MutexGuard<'_, WatchReporterState> {
        self.state.lock()
    }
}

/// Whether an event of a build is worth a line. It is not if an item is up to date, or fails as before.
fn is_news(event: &Event, transition: &Transition) -> bool {
    match event {
        Event::Finished { .. } | Event::Published { .. } | Event::Removed { .. } | Event::Warning { .. } => {
            true
        }
        _ => *transition != Transition::None,
    }
}

impl WatchReporterState {
    /// The group of a stage in the next report, which is added if there is none.
    fn group(&mut self, stage: &str, now: f64) -> &mut StageReport {
        let index = self.groups.iter().position(|group| group.stage == stage).unwrap_or_else(|| {
            let (items, why, files) = (Vec::new(), Vec::new(), Vec::new());
            self.groups.push(StageReport { stage: stage.into(), items, why, same: 0, files, at: now });
            self.groups.len() - 1
        });
        let group = &mut self.groups[index];
        group.at = now;
        group
    }

    /// Notes that an item no longer runs; returns why it ran.
    fn ended(&mut self, item: &ItemName) -> Vec<Reason> {
        let found = self.running.iter().position(|(running, _)| running == item);
        found.map(|index| self.running.swap_remove(index).1).unwrap_or_default()
    }

    fn ran(&mut self, item: &ItemName, reasons: &[Reason], changed: bool, now: f64) {
        let why = reasons.iter().map(|reason| reasons::brief(reason, &self.changed)).collect::<Vec<_>>();
        let group = self.group(&item.stage, now);
        group.items.push(item.clone());
        group.same += usize::from(!changed);
        for why in why {
            if !group.why.contains(&why) {
                group.why.push(why);
            }
        }
    }
}

impl StageReport {
    /// `map, 2 items (reflection changed): maps/gold.exr, maps/red.exr`
    fn line(&self, width: usize) -> String {
        let mut line = match self.items.as_slice() {
            [] => self.stage.clone(),
            [item] => item.to_string(),
            items => format!("{}, {} items", self.stage, items.len()),
        };
        if !self.why.is_empty() {
            line += &format!(" ({})", list(&self.why, "; ", NAMED));
        }
        if self.same > 0 {
            line += match self.items.len() {
                1 => ", the same result as before",
                all if all == self.same => ", the same results as before",
                _ => ", some the same as before",
            };
        }
        if !self.files.is_empty() {
            line += ": ";
            line += &fitting(&self.files, width.saturating_sub(INDENT + line.chars().count()));
        }
        line
    }
}

/// The changes of many files, a line for each folder: `assets/materials: 498 changed, 2 new`
fn by_folder(changes: &[Change]) -> Vec<String> {
    let mut folders = BTreeMap::<&str, BTreeMap<Changed, usize>>::new();
    for change in changes {
        let folder = change.path.rsplit_once('/').map_or(".", |(folder, _)| folder);
        *folders.entry(folder).or_default().entry(change.what).or_default() += 1;
    }
    let lines = folders.iter().take(CHANGES).map(|(folder, counts)| {
        let counts = counts.iter().map(|(what, count)| match what {
            Changed::Appeared => format!("{count} new"),
            Changed::Changed => format!("{count} changed"),
            Changed::Gone => format!("{count} gone"),
            Changed::Unknown => LOST.into(),
        });
        format!("{}: {}", path_text(folder), counts.collect::<Vec<_>>().join(", "))
    });
    let mut lines = lines.collect::<Vec<_>>();
    lines.extend(more(folders.len().saturating_sub(CHANGES), "more folder"));
    lines
}

fn in_words(change: &Change) -> String {
    let path = match change.path.as_str() {
        "." => "the project folder".into(),
        path => path_text(path),
    };
    match change.what {
        Changed::Appeared if change.path == "." => format!("{path} is back"),
        Changed::Changed if change.path == "." => format!("{path} was replaced by another folder"),
        Changed::Appeared => format!("{path} is new"),
        Changed::Changed => format!("{path} changed"),
        Changed::Gone => format!("{path} is gone"),
        Changed::Unknown => format!("{path}: {LOST}"),
    }
}

/// If the system dropped events, every file of the folder is examined.
const LOST: &str = "events were lost, so everything in it will be checked";

/// How the watcher gets changes.
pub(crate) fn watching(folders: usize, poll_milliseconds: Option<f64>, because: Option<&str>) -> String {
    let because = because.map(|because| format!(": {because}")).unwrap_or_default();
    match poll_milliseconds {
        None => format!("listening to {}{because}", count(folders, "folder")),
        Some(pause) => format!("polling every {}{because}", duration(pause)),
    }
}

#[cfg(test)]
mod tests;
