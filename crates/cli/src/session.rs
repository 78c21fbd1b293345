//! Watching as a person sees it: which file changed, what ran because of it and why, how long it took until each output
//! was fresh, and what still fails.
//!
//! An edit takes a few lines: the items of a stage share one, with the files that they published. A build of seconds
//! speaks every now and then, one of milliseconds at its end.

use std::collections::BTreeMap;

use engine::{Change, Changed, Event, ItemName, Reason, Summary};
use parking_lot::{Mutex, MutexGuard};

use crate::outstanding::{OutstandingErrors, Turn, few};
use crate::quantity::{SHOWN, count, duration, more};
use crate::screen::Screen;
use crate::{manifest, reasons, terminal};

/// A build that takes longer tells what it has, in milliseconds.
const SILENCE: f64 = 2000.0;

/// So many changes are named; more are counted by folder.
const CHANGES: usize = 4;

/// Where the text of a line begins, below the times.
const INDENT: usize = 10;

/// The time, twice: to measure and to show.
pub(crate) struct Moment {
    /// Since some moment before all others, in milliseconds.
    pub(crate) milliseconds: f64,
    /// The time of day.
    pub(crate) time: String,
}

/// Turns a watcher's events into lines on standard error.
pub(crate) struct Session {
    verbose: bool,
    screen: Screen,
    clock: Box<dyn Fn() -> Moment + Send + Sync>,
    state: Mutex<State>,
}

#[derive(Default)]
struct State {
    standing: OutstandingErrors,
    /// How it learns of changes.
    way: String,
    /// When the first of the changes that are worked off was heard of.
    noticed: f64,
    /// The files that changed.
    changed: Vec<String>,
    /// Whether a graph was ever built.
    built: bool,
    /// The time of a build that no change is known for, until it has something to say: it only makes sure.
    unannounced: Option<String>,
    /// When something was last said.
    spoken: f64,
    /// What was done since, by stage.
    groups: Vec<Group>,
    /// What runs, and why.
    running: Vec<(ItemName, Vec<Reason>)>,
    /// The files that were removed since something was last said.
    removed: Vec<String>,
    /// The files that this build published.
    published: usize,
    /// How many items this build broke, and how many it mended.
    turned: [usize; 2],
}

/// What the items of one stage did.
struct Group {
    stage: String,
    items: Vec<ItemName>,
    why: Vec<String>,
    /// How many made what they had made before.
    same: usize,
    files: Vec<String>,
    /// When the last of it happened.
    at: f64,
}

impl Session {
    pub(crate) fn new(
        verbose: bool,
        screen: Screen,
        clock: impl Fn() -> Moment + Send + Sync + 'static,
    ) -> Self {
        Self { verbose, screen, clock: Box::new(clock), state: Mutex::default() }
    }

    /// Shows one event.
    pub(crate) fn tell(&self, event: &Event) {
        let now = (self.clock)();
        let mut state = self.state();
        let turn = state.standing.take(event);
        if news(event, &turn)
            && let Some(time) = state.unannounced.take()
        {
            self.head(&time, "building again");
        }
        let since = duration(now.milliseconds - state.noticed);
        match event {
            Event::Watching { folders, poll_milliseconds, because } => {
                state.way = way(*folders, *poll_milliseconds, because.as_deref());
                self.head(&now.time, &state.way);
            }
            Event::Noticed { changes, milliseconds } => {
                state.noticed = now.milliseconds - milliseconds;
                state.changed = changes.iter().map(|change| change.path.clone()).collect();
                self.tell_changes(&now.time, changes);
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
                (state.published, state.spoken, state.built) = (0, now.milliseconds, true);
                state.turned = [0; 2];
                self.screen.begin(*items);
            }
            Event::Waiting { holder, .. } => self.line("waiting", &format!("for {holder}")),
            Event::UpToDate { item } => {
                self.screen.settled();
                if self.verbose {
                    self.line("", &format!("{item} is up to date"));
                }
                self.tell_turn(&mut state, &turn, item);
            }
            Event::Started { item, reasons } => {
                state.running.push((item.clone(), reasons.clone()));
                self.screen.started(item);
            }
            Event::Finished { item, changed, .. } => {
                self.screen.ended(item);
                self.tell_turn(&mut state, &turn, item);
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
                    let how = if *restored { "is back" } else { "is fresh" };
                    self.line(&since, &format!("{file} {how}"));
                } else {
                    state.group(&item.stage, now.milliseconds).files.push(file.clone());
                }
            }
            Event::Removed { file } if self.verbose => self.line(&since, &format!("{file} was removed")),
            Event::Removed { file } => state.removed.push(file.clone()),
            Event::Warning { item, message } => self.line("warning", &format!("{item}: {message}")),
            Event::Note { item, message } if self.verbose => self.line("note", &format!("{item}: {message}")),
            Event::Note { .. } | Event::TaskTimed { .. } => {}
            Event::Failed { item, error, help } => {
                state.ended(item);
                self.screen.ended(item);
                if turn == Turn::Broke {
                    state.turned[0] += 1;
                    if state.turned[0] <= self.shown() {
                        self.tell_error(&item.to_string(), error, help.as_deref());
                    }
                }
            }
            Event::Skipped { .. } => self.screen.settled(),
            Event::Ended(summary) => {
                self.screen.clear();
                self.speak(&mut state, now.milliseconds);
                for (turned, what) in state.turned.into_iter().zip(["more failed item", "more mended item"]) {
                    let more = more(turned.saturating_sub(self.shown()), what);
                    more.iter().for_each(|more| self.line("", &format!("{more}; --verbose shows all")));
                }
                if state.unannounced.take().is_none() {
                    self.conclude(&mut state, summary, &since);
                }
            }
            Event::Rejected { diagnostics } => {
                self.screen.painted(&manifest::drawn(diagnostics));
                let next = match state.built {
                    true => "still using the last valid manifest",
                    false => "nothing runs until it is valid",
                };
                self.line("", &format!("{}; {next}", manifest::counted(diagnostics)));
                state.changed.clear();
            }
            Event::Accepted => self.line("mended", "the manifest is valid again"),
            Event::BuildError { error, help } => {
                self.screen.clear();
                self.speak(&mut state, now.milliseconds);
                self.tell_error("the build", error, help.as_deref());
                state.running.clear();
                state.changed.clear();
            }
        }
        if now.milliseconds - state.spoken > SILENCE {
            self.speak(&mut state, now.milliseconds);
        }
        self.pin(&state, &now.time);
    }

    /// Takes what moves off the terminal.
    pub(crate) fn close(&self) {
        self.screen.close();
    }

    /// What changed, beside the time of day.
    fn tell_changes(&self, time: &str, changes: &[Change]) {
        let lines = if changes.len() <= CHANGES || self.verbose {
            changes.iter().map(in_words).collect()
        } else {
            by_folder(changes)
        };
        for (index, line) in lines.iter().enumerate() {
            self.head(if index == 0 { time } else { "" }, line);
        }
    }

    /// Tells what was done since the last time, a line for each stage.
    fn speak(&self, state: &mut State, now: f64) {
        state.groups.sort_by(|one, other| one.at.total_cmp(&other.at));
        for group in std::mem::take(&mut state.groups) {
            self.line(&duration(group.at - state.noticed), &group.line());
        }
        let removed = std::mem::take(&mut state.removed);
        if !removed.is_empty() {
            let names = fitting(&removed, terminal::width() - INDENT - "removed ".len());
            self.line("", &format!("removed {names}"));
        }
        state.spoken = now;
    }

    /// The end of a build: what there is now, and what still fails.
    fn conclude(&self, state: &mut State, summary: &Summary, since: &str) {
        let Summary { ran, up_to_date, failed, skipped, cancelled, .. } = *summary;
        let mut parts = Vec::new();
        if state.published > 0 {
            let fresh = if state.published == 1 { "file is fresh" } else { "files are fresh" };
            parts.push(format!("{} {fresh}", state.published));
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
        if !self.screen.moves()
            && let Some(reminder) = state.standing.reminder()
        {
            self.line("", &reminder);
        }
        state.running.clear();
        if !cancelled {
            state.changed.clear();
        }
    }

    fn tell_turn(&self, state: &mut State, turn: &Turn, item: &ItemName) {
        if *turn == Turn::Mended {
            state.turned[1] += 1;
            if state.turned[1] <= self.shown() {
                self.line("mended", &item.to_string());
            }
        }
    }

    /// How many items that broke, or were mended, a build names.
    fn shown(&self) -> usize {
        if self.verbose { usize::MAX } else { SHOWN }
    }

    fn tell_error(&self, what: &str, error: &[String], help: Option<&str>) {
        self.line("FAILED", what);
        for cause in error {
            cause.lines().for_each(|line| self.line("", &format!("  {line}")));
        }
        if let Some(help) = help {
            self.line("", &format!("  hint: {}", help.replace('\n', "\n          ")));
        }
    }

    /// The errors that stand and how it learns of changes, at the bottom of a terminal.
    fn pin(&self, state: &State, time: &str) {
        if !self.screen.moves() {
            return;
        }
        let mut lines = state.standing.pinned();
        lines.push(format!("{time}  {}", if state.way.is_empty() { "building" } else { &state.way }));
        self.screen.pin(lines.join("\n"));
    }

    /// A line that begins a paragraph.
    fn head(&self, time: &str, text: &str) {
        self.screen.line(format!("{time:<INDENT$}{text}").trim_end());
    }

    /// A line of what was done: when, and what.
    fn line(&self, when: &str, text: &str) {
        self.screen.line(format!("{when:>width$}  {text}", width = INDENT - 2).trim_end());
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock()
    }
}

/// Whether an event of a build is worth a line: that an item is as it was, or fails as it did, is not.
fn news(event: &Event, turn: &Turn) -> bool {
    match event {
        Event::Finished { .. } | Event::Published { .. } | Event::Removed { .. } | Event::Warning { .. } => {
            true
        }
        _ => *turn != Turn::Same,
    }
}

impl State {
    /// What is said of a stage next.
    fn group(&mut self, stage: &str, now: f64) -> &mut Group {
        let index = self.groups.iter().position(|group| group.stage == stage).unwrap_or_else(|| {
            let (items, why, files) = (Vec::new(), Vec::new(), Vec::new());
            self.groups.push(Group { stage: stage.into(), items, why, same: 0, files, at: now });
            self.groups.len() - 1
        });
        let group = &mut self.groups[index];
        group.at = now;
        group
    }

    /// An item no longer runs: why it did.
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

impl Group {
    /// `map, 2 items (reflection changed): maps/gold.exr, maps/red.exr`
    fn line(&self) -> String {
        let mut line = match self.items.as_slice() {
            [] => self.stage.clone(),
            [item] => item.to_string(),
            items => format!("{}, {} items", self.stage, items.len()),
        };
        if !self.why.is_empty() {
            line += &format!(" ({})", few(&self.why, "; "));
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
            line += &fitting(&self.files, terminal::width().saturating_sub(INDENT + line.chars().count()));
        }
        line
    }
}

/// As many names as fit, and how many more there are.
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

/// Changes of many files, a line for each folder: `assets/materials: 498 changed, 2 new`
fn by_folder(changes: &[Change]) -> Vec<String> {
    let mut folders = BTreeMap::<&str, BTreeMap<Changed, usize>>::new();
    for change in changes {
        let folder = change.path.rsplit_once('/').map_or("here", |(folder, _)| folder);
        *folders.entry(folder).or_default().entry(change.what).or_default() += 1;
    }
    let lines = folders.iter().take(CHANGES).map(|(folder, counts)| {
        let counts = counts.iter().map(|(what, count)| match what {
            Changed::Appeared => format!("{count} new"),
            Changed::Changed => format!("{count} changed"),
            Changed::Gone => format!("{count} gone"),
            Changed::Unknown => "events were lost, so that all below is looked at".into(),
        });
        format!("{folder}: {}", counts.collect::<Vec<_>>().join(", "))
    });
    let mut lines = lines.collect::<Vec<_>>();
    if let Some(more) = folders.len().checked_sub(CHANGES).filter(|more| *more > 0) {
        lines.push(format!("and {}", count(more, "more folder")));
    }
    lines
}

fn in_words(change: &Change) -> String {
    let path = &change.path;
    match change.what {
        Changed::Appeared => format!("{path} is new"),
        Changed::Changed => format!("{path} changed"),
        Changed::Gone => format!("{path} is gone"),
        Changed::Unknown => format!("{path}: events were lost, so that all below is looked at"),
    }
}

/// How the watcher learns of changes.
pub(crate) fn way(folders: usize, poll_milliseconds: Option<f64>, because: Option<&str>) -> String {
    let because = because.map(|because| format!(": {because}")).unwrap_or_default();
    match poll_milliseconds {
        None => format!("listening to {}{because}", count(folders, "folder")),
        Some(pause) => format!("looking every {}{because}", duration(pause)),
    }
}

#[cfg(test)]
mod tests;
