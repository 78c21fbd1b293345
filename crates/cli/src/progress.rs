//! The build as a person sees it: a bar while it works, a line for what happened, a summary at the end.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::{Mutex, PoisonError};

use engine::{Event, ItemName, Summary};
use indicatif::{ProgressBar, ProgressStyle};

use crate::{reasons, terminal};

/// Turns events into lines on standard error.
pub(crate) struct Progress {
    verbose: bool,
    dry_run: bool,
    bar: ProgressBar,
    state: Mutex<State>,
}

#[derive(Default)]
struct State {
    running: BTreeMap<ItemName, ()>,
    failures: Vec<(ItemName, Vec<String>, Option<String>)>,
    skipped: Vec<(ItemName, Option<ItemName>)>,
}

impl Progress {
    pub(crate) fn new(verbose: bool, dry_run: bool) -> Self {
        let bar =
            if terminal::is_watched() && !dry_run { ProgressBar::new(0) } else { ProgressBar::hidden() };
        if let Ok(style) = ProgressStyle::with_template("{bar:30} {pos}/{len}  {wide_msg}") {
            bar.set_style(style);
        }
        Self { verbose, dry_run, bar, state: Mutex::default() }
    }

    /// Shows one event.
    pub(crate) fn tell(&self, event: &Event) {
        match event {
            Event::Planned { items, .. } => self.bar.set_length(*items as u64),
            Event::UpToDate { item } => {
                if self.verbose {
                    self.line(&format!("      current  {item}"));
                }
                self.bar.inc(1);
            }
            Event::Started { item, reasons } if self.dry_run => {
                self.line(&format!("would run  {item}: {}", reasons::planned(reasons)));
            }
            Event::Started { item, reasons } => {
                if self.verbose {
                    self.line(&format!("          run  {item}: {}", reasons::past(reasons)));
                }
                self.running(|running| _ = running.insert(item.clone(), ()));
            }
            Event::Finished { item, milliseconds, changed } => {
                let same = if *changed { "" } else { "  (same result as before)" };
                self.line(&format!("{:>13}  {item}{same}", terminal::duration(*milliseconds)));
                self.ended(item);
            }
            Event::Warning { item, message } => self.line(&format!("      warning  {item}: {message}")),
            Event::Note { item, message } => {
                if self.verbose {
                    self.line(&format!("         note  {item}: {message}"));
                }
            }
            Event::Failed { item, error, help } => {
                self.line(&format!("       FAILED  {item}"));
                self.ended(item);
                self.state().failures.push((item.clone(), error.clone(), help.clone()));
            }
            Event::Skipped { item, because } => {
                self.bar.inc(1);
                self.state().skipped.push((item.clone(), because.clone()));
            }
            Event::Published { file, restored: true, .. } => self.line(&format!("     restored  {file}")),
            Event::Published { file, .. } => {
                if self.verbose {
                    self.line(&format!("    published  {file}"));
                }
            }
            Event::Removed { file } => self.line(&format!("      removed  {file}")),
            Event::Ended(_) => self.bar.finish_and_clear(),
        }
    }

    /// What is worth saying at the end: failures in full, then one paragraph of counts.
    pub(crate) fn summarise(&self, summary: &Summary, out: &Path) {
        self.bar.finish_and_clear();
        let state = self.state();
        for (item, chain, help) in &state.failures {
            eprintln!("\nerror: {item} failed");
            for cause in chain {
                eprintln!("  {}", cause.replace('\n', "\n  "));
            }
            if let Some(help) = help {
                eprintln!("  hint: {help}");
            }
            let lost = state.skipped.iter().filter(|(_, because)| because.as_ref() == Some(item));
            let lost = lost.map(|(skipped, _)| skipped.to_string()).collect::<Vec<_>>();
            if !lost.is_empty() {
                eprintln!("  not run because of it: {}", lost.join("; "));
            }
        }
        for line in conclusion(summary, out, self.dry_run) {
            eprintln!("{line}");
        }
    }

    fn line(&self, line: &str) {
        if self.bar.is_hidden() { eprintln!("{line}") } else { self.bar.println(line) }
    }

    fn ended(&self, item: &ItemName) {
        self.running(|running| _ = running.remove(item));
        self.bar.inc(1);
    }

    fn running(&self, change: impl FnOnce(&mut BTreeMap<ItemName, ()>)) {
        let mut state = self.state();
        change(&mut state.running);
        let names = state.running.keys().map(ItemName::to_string).collect::<Vec<_>>();
        self.bar.set_message(names.join(", "));
    }

    fn state(&self) -> std::sync::MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

fn conclusion(summary: &Summary, out: &Path, dry_run: bool) -> Vec<String> {
    let Summary { ran, up_to_date, failed, skipped, published, removed, cancelled, milliseconds } = *summary;
    let time = terminal::duration(milliseconds);
    let out = out.display();
    if dry_run {
        return vec![match ran {
            0 => format!("Nothing would run: {} up to date. Nothing was written.", items(up_to_date)),
            _ => format!("{} would run, {up_to_date} up to date. Nothing was written.", items(ran)),
        }];
    }
    if ran + failed + skipped == 0 && !cancelled {
        let mut lines = vec![format!(
            "Nothing to run: for all {} the parameters, the kinds' revisions and the contents of inputs and files \
             are those of a build before ({time}).",
            items(up_to_date)
        )];
        lines.push(match (published, removed) {
            (0, 0) => format!("The files in {out} are as they were published."),
            _ => format!("{published} files put back and {removed} removed in {out}."),
        });
        return lines;
    }
    let mut counts = vec![format!("{} ran", items(ran)), format!("{up_to_date} up to date")];
    if failed > 0 {
        counts.push(format!("{failed} FAILED"));
    }
    if skipped > 0 {
        counts.push(format!("{skipped} not run"));
    }
    let mut lines = vec![format!("{} in {time}.", counts.join(", "))];
    lines.push(format!("{published} files published and {removed} removed in {out}."));
    if failed + skipped > 0 || cancelled {
        lines.push("The last good outputs of what did not run are still there.".into());
    }
    if cancelled {
        lines.push("Stopped before the end; the next build goes on from here.".into());
    }
    lines
}

fn items(count: usize) -> String {
    if count == 1 { "1 item".into() } else { format!("{count} items") }
}
