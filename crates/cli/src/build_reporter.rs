//! The build as a person sees it: a progress bar, a line for each event, a summary at the end. Warnings are
//! shown together before it. If thousands of items fail, the first are shown and the others counted, unless
//! `--verbose` asks for all of them.

use std::collections::HashMap;
use std::fmt::Display;
use std::path::Path;

use engine::{Event, ItemName, Summary, Traffic, path_text};
use parking_lot::{Mutex, MutexGuard};

use crate::arguments::BuildArguments;
use crate::lists::{NAMED, SHOWN, list, more};
use crate::print::{message, say};
use crate::prune::leftovers;
use crate::quantity::{count, duration, size};
use crate::reasons;
use crate::removals::Removals;
use crate::screen::Screen;
use crate::warning_groups::WarningGroups;

/// Turns events into lines on standard error.
pub(crate) struct BuildReporter {
    verbose: bool,
    quiet: bool,
    dry_run: bool,
    screen: Screen,
    state: Mutex<BuildReporterState>,
}

#[derive(Default)]
struct BuildReporterState {
    /// The items that run on other machines, and the server that has them run.
    elsewhere: HashMap<ItemName, String>,
    failures: Vec<(ItemName, Vec<String>, Option<String>)>,
    skipped: Vec<(ItemName, Option<ItemName>)>,
    removals: Removals,
    warnings: WarningGroups,
}

impl BuildReporter {
    pub(crate) fn new(arguments: &BuildArguments) -> Self {
        let &BuildArguments { verbose, quiet, dry_run, json, .. } = arguments;
        Self { verbose, quiet, dry_run, ..Self::on(Screen::new(!json && !dry_run && !quiet)) }
    }

    /// Shows warnings and failures alone.
    pub(crate) fn quiet() -> Self {
        Self { quiet: true, ..Self::on(Screen::new(false)) }
    }

    /// Shows what a build does by default, or all.
    pub(crate) fn with_bar(verbose: bool) -> Self {
        Self { verbose, ..Self::on(Screen::new(true)) }
    }

    fn on(screen: Screen) -> Self {
        Self { verbose: false, quiet: false, dry_run: false, screen, state: Mutex::default() }
    }

    pub(crate) fn show(&self, event: &Event) {
        match event {
            Event::Planned { items, .. } => self.screen.begin(*items),
            Event::ManifestWarnings { diagnostics } => {
                diagnostics.to_string().lines().for_each(|line| self.important("warning", line));
            }
            Event::Waiting { holder, limit_milliseconds } => {
                let limit = limit_milliseconds.map(|limit| format!(", at most {}", duration(limit)));
                self.important("waiting", format_args!("for {holder}{}", limit.unwrap_or_default()));
            }
            Event::UpToDate { item, host } => {
                match host {
                    Some(_) if self.verbose => self.line("shared cache", item),
                    None if self.verbose => self.line("up to date", item),
                    _ => {}
                }
                self.screen.settled();
            }
            Event::SharedCache { host, message } => {
                self.important("warning", format_args!("{host}: {message}"));
            }
            Event::Started { item, reasons, host } => {
                let at = host.as_ref().map_or_else(String::new, |host| format!(" at {host}"));
                match host {
                    Some(host) => _ = self.state().elsewhere.insert(item.clone(), host.clone()),
                    None => _ = self.state().elsewhere.remove(item),
                }
                let why = || reasons::lines(reasons).join("; ");
                if self.dry_run {
                    return self.line("would run", format_args!("{item}: {}", why()));
                }
                if self.verbose {
                    self.line("run", format_args!("{item}{at}: {}", why()));
                }
                self.screen.started(item);
            }
            Event::Progress { item, share } => self.screen.progress(item, *share),
            Event::Finished { item, milliseconds, changed } => {
                let same = if *changed { "" } else { "  (same result as before)" };
                let host = self.state().elsewhere.remove(item);
                let at = host.map_or_else(String::new, |host| format!("  (at {host})"));
                self.line(&duration(*milliseconds), format_args!("{item}{at}{same}"));
                self.screen.ended(item);
            }
            Event::Warning { item, message } if self.verbose => {
                self.important("warning", format_args!("{item}: {message}"));
            }
            Event::Warning { item, message } => self.state().warnings.add(item, message),
            Event::Note { item, message } => {
                if self.verbose {
                    self.line("note", format_args!("{item}: {message}"));
                }
            }
            Event::Failed { item, error, help } => {
                let mut state = self.state();
                if state.failures.len() < self.shown() {
                    self.important("FAILED", item);
                }
                self.screen.ended(item);
                state.failures.push((item.clone(), error.clone(), help.clone()));
            }
            Event::Skipped { item, because } => {
                self.screen.settled();
                self.state().skipped.push((item.clone(), because.clone()));
            }
            Event::Published { file, restored: true, .. } => {
                self.line(if self.dry_run { "would restore" } else { "restored" }, path_text(file));
            }
            Event::Published { file, .. } if self.dry_run => self.line("would publish", path_text(file)),
            Event::Published { file, .. } => {
                if self.verbose {
                    self.line("published", path_text(file));
                }
            }
            Event::Removed { file, because, .. } => {
                if self.verbose {
                    self.line(if self.dry_run { "would remove" } else { "removed" }, path_text(file));
                }
                self.state().removals.add(because, file);
            }
            Event::Leftovers { folder, files, published_by, manifest } => {
                self.important("warning", leftovers(folder, *files, published_by, manifest));
            }
            Event::Ended(_) => self.screen.clear(),
            // Only a watcher sends these.
            Event::Watching { .. }
            | Event::Noticed { .. }
            | Event::RebuildLoop { .. }
            | Event::Rejected { .. }
            | Event::Accepted
            | Event::BuildError { .. } => {}
            // Only a timeline needs it.
            Event::TaskTimed { .. } => {}
        }
    }

    /// The end of a build: the warnings, the failures in full, then one paragraph of counts.
    pub(crate) fn summarise(&self, summary: &Summary, out: &Path) {
        self.show_failures();
        if self.quiet && summary.failed == 0 && !summary.cancelled {
            return;
        }
        for line in conclusion(summary, out, self.dry_run) {
            message(&line);
        }
    }

    /// Removes the bar, and shows why files were removed, the warnings, and the failures so far in full.
    pub(crate) fn show_failures(&self) {
        self.screen.close();
        let mut state = self.state();
        for line in state.removals.take_lines(if self.dry_run { "would be removed" } else { "removed" }) {
            self.line("", line);
        }
        for line in state.warnings.take_lines() {
            self.important("warning", line);
        }
        let mut skipped = HashMap::<_, Vec<_>>::new();
        for (item, because) in &state.skipped {
            skipped.entry(because.as_ref()).or_default().push(item.to_string());
        }
        for (item, chain, help) in state.failures.iter().take(self.shown()) {
            say!("\nerror: {item} failed");
            for cause in chain {
                say!("  {}", cause.replace('\n', "\n  "));
            }
            if let Some(help) = help {
                say!("  hint: {help}");
            }
            if let Some(dependants) = skipped.get(&Some(item)) {
                let most = if self.verbose { usize::MAX } else { NAMED };
                say!("  did not run because of it: {}", list(dependants, "; ", most));
            }
        }
        if let Some(more) = more(state.failures.len().saturating_sub(self.shown()), "more failed item") {
            say!("\n{more}; --verbose shows all");
        }
    }

    /// The number of failures that are shown.
    fn shown(&self) -> usize {
        if self.verbose { usize::MAX } else { SHOWN }
    }

    /// Shows a line above the bar: what happened, to what.
    fn line(&self, what: &str, subject: impl Display) {
        if !self.quiet {
            self.important(what, subject);
        }
    }

    /// Shows a line that a quiet build has, too.
    fn important(&self, what: &str, subject: impl Display) {
        self.screen.line(&format!("{what:>13}  {subject}"));
    }

    fn state(&self) -> MutexGuard<'_, BuildReporterState> {
        self.state.lock()
    }
}

fn conclusion(summary: &Summary, out: &Path, dry_run: bool) -> Vec<String> {
    let Summary {
        ran,
        ran_elsewhere,
        up_to_date,
        failed,
        skipped,
        kept,
        published,
        removed,
        cancelled,
        milliseconds,
        shared,
        ref shared_traffic,
        ..
    } = *summary;
    let time = duration(milliseconds);
    let out = path_text(out);
    if dry_run {
        let runs = match ran {
            0 => format!("Nothing would run: {} up to date.", count(up_to_date, "item")),
            _ => format!("{} would run, {up_to_date} up to date.", count(ran, "item")),
        };
        let changes = match (published, removed) {
            (0, 0) => String::new(),
            _ => {
                format!(" {} would be published from the cache, {removed} removed.", count(published, "file"))
            }
        };
        return vec![format!("{runs}{changes} Nothing was written.")];
    }
    if ran + failed + skipped + shared == 0 && !cancelled {
        let items = format!(
            "Up to date: {} an earlier build ({time}).",
            if up_to_date == 1 { "1 item matches".into() } else { format!("all {up_to_date} items match") }
        );
        let files = match (published, removed) {
            (0, 0) => format!("The files in {out} are unchanged."),
            _ => {
                format!("{} published from the cache, {removed} removed in {out}.", count(published, "file"))
            }
        };
        return vec![items, files];
    }
    let up_to_date = match shared {
        0 => format!("{up_to_date} up to date"),
        _ => format!("{} up to date, {shared} from the shared cache", up_to_date - shared),
    };
    let elsewhere = match ran_elsewhere {
        0 => String::new(),
        _ => format!(" ({ran_elsewhere} on other machines)"),
    };
    let mut counts = vec![format!("{} ran{elsewhere}", count(ran, "item")), up_to_date];
    if failed > 0 {
        counts.push(format!("{failed} FAILED"));
    }
    if skipped > 0 {
        counts.push(format!("{skipped} not run"));
    }
    let mut lines = vec![format!("{} in {time}.", counts.join(", "))];
    lines.push(format!("{} published, {removed} removed in {out}.", count(published, "file")));
    lines.extend(shared_traffic.filter(|traffic| traffic.calls > 0).map(|traffic| {
        let Traffic { calls, received, sent } = traffic;
        let amounts = format!("{} received, {} sent", size(received), size(sent));
        format!("Network: {amounts}, in {}.", count(calls as usize, "call"))
    }));
    if kept > 0 {
        lines.push("The last good outputs of the items that did not run are kept.".into());
    }
    if cancelled {
        lines.push("Stopped before the end; the next build continues from here.".into());
    }
    lines
}
