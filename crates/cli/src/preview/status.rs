//! What the window shows of builds: a status line, a message after each rebuild, the outstanding errors.

use std::collections::BTreeMap;

use engine::{Event, ItemName, path_text};

use crate::lists::{fitting, more};
use crate::outstanding::OutstandingErrors;
use crate::quantity::{count, duration, percent_done};
use crate::removals::Removals;
use crate::watch_reporter::watching;

/// A message names up to this many stages.
const STAGES: usize = 8;

/// The columns of a message.
const COLUMNS: usize = 60;

/// A message that disappears after a while.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Toast {
    pub(crate) title: String,
    pub(crate) lines: Vec<String>,
}

/// Follows the events of a watcher.
#[derive(Default)]
pub(crate) struct BuildStatus {
    errors: OutstandingErrors,
    /// How the watcher gets changes.
    watching: String,
    /// The item whose builds cause each other, if the watcher has stopped because of it.
    stopped: Option<ItemName>,
    /// The current build: how many items are done, and how many there are.
    progress: Option<(usize, usize)>,
    /// The items that take long, and the shares of their work that are done.
    long: BTreeMap<ItemName, f64>,
    /// The process that holds the lock that the current build waits for.
    holder: Option<String>,
    /// The changes since the current or the last build began.
    pending: Changes,
    /// The changes that the current build, and builds before it that were stopped, are for.
    building: Changes,
    /// The items that ran since the current or the last build began, by stage.
    ran: Vec<(String, Vec<ItemName>)>,
    /// The files that were removed since the current or the last build began.
    removals: Removals,
}

#[derive(Default)]
struct Changes {
    /// When the first of the changes was noticed, in milliseconds.
    since: Option<f64>,
    paths: Vec<String>,
}

impl Changes {
    fn add(&mut self, since: Option<f64>, paths: impl IntoIterator<Item = String>) {
        self.since = self.since.or(since);
        for path in paths {
            if !self.paths.contains(&path) {
                self.paths.push(path);
            }
        }
    }
}

impl BuildStatus {
    /// Follows an event, with `now` in milliseconds of any clock; returns a message if a change caused a
    /// build that ends now.
    pub(crate) fn update(&mut self, event: &Event, now: f64) -> Option<Toast> {
        self.errors.update(event);
        self.holder = None;
        match event {
            Event::Finished { item, .. } | Event::Failed { item, .. } | Event::Skipped { item, .. } => {
                self.long.remove(item);
            }
            Event::Planned { .. } | Event::Ended(_) | Event::BuildError { .. } => self.long.clear(),
            _ => {}
        }
        match event {
            Event::Waiting { holder, .. } => self.holder = Some(holder.clone()),
            Event::Watching { folders, poll_milliseconds, because } => {
                self.watching = watching(*folders, *poll_milliseconds, because.as_deref());
            }
            Event::Noticed { changes, milliseconds } => {
                let paths = changes.iter().map(|change| path_text(&change.path));
                self.pending.add(Some(now - milliseconds), paths);
            }
            Event::RebuildLoop { item, .. } => self.stopped = Some(item.clone()),
            Event::Planned { items, .. } => {
                self.stopped = None;
                self.progress = Some((0, *items));
                let Changes { since, paths } = std::mem::take(&mut self.pending);
                self.building.add(since, paths);
            }
            Event::Progress { item, share } => _ = self.long.insert(item.clone(), *share),
            Event::Finished { item, .. } => {
                self.count_done();
                match self.ran.iter_mut().find(|(stage, _)| *stage == item.stage) {
                    Some((_, items)) => items.push(item.clone()),
                    None => self.ran.push((item.stage.clone(), vec![item.clone()])),
                }
            }
            Event::UpToDate { .. } | Event::Failed { .. } | Event::Skipped { .. } => self.count_done(),
            Event::Removed { file, because, .. } => self.removals.add(because, file),
            Event::Ended(summary) => {
                self.progress = None;
                // If another change stopped it, the build after it reports for both.
                if !summary.cancelled {
                    return self.toast(now, summary.failed);
                }
            }
            // The build of the last valid manifest goes on.
            Event::Rejected { .. } => self.pending = Changes::default(),
            Event::BuildError { .. } => {
                self.progress = None;
                (self.pending, self.building) = (Changes::default(), Changes::default());
            }
            _ => {}
        }
        None
    }

    /// Whether a build runs, or the first one has not started.
    pub(crate) fn is_building(&self) -> bool {
        self.progress.is_some() || self.watching.is_empty()
    }

    /// Whether a build runs.
    pub(crate) fn has_build(&self) -> bool {
        self.progress.is_some()
    }

    pub(crate) fn line(&self) -> String {
        if let Some(holder) = &self.holder {
            return format!("waiting for {holder}");
        }
        match self.progress {
            Some((done, items)) => {
                let long = self.long.iter().map(|(item, share)| format!(", {item} {}", percent_done(*share)));
                format!("building: {done} of {}{}", count(items, "item"), long.collect::<String>())
            }
            None => match &self.stopped {
                Some(item) => format!("stopped: the build of {item} changes files that it reads"),
                None => self.watching.clone(),
            },
        }
    }

    pub(crate) fn errors(&self) -> &OutstandingErrors {
        &self.errors
    }

    fn count_done(&mut self) {
        if let Some((done, items)) = &mut self.progress {
            *done = (*done + 1).min(*items);
        }
    }

    /// The outcome of a rebuild.
    fn toast(&mut self, now: f64, failed: usize) -> Option<Toast> {
        let Changes { since, paths: changed } = std::mem::take(&mut self.building);
        let ran = std::mem::take(&mut self.ran);
        let removed = self.removals.take_lines("removed");
        let time = duration(now - since?);
        let mut lines = Vec::new();
        if !changed.is_empty() {
            lines.push(format!("because of {}", fitting(&changed, COLUMNS)));
        }
        for (stage, items) in ran.iter().take(STAGES) {
            lines.push(match &items[..] {
                [item] => item.to_string(),
                items => format!("{stage}, {}", count(items.len(), "item")),
            });
        }
        lines.extend(more(ran.len().saturating_sub(STAGES), "more stage"));
        lines.extend(removed);
        let title = match (failed, ran.is_empty()) {
            (0, false) => format!("rebuilt in {time}"),
            (0, true) => format!("up to date after {time}; nothing had to run"),
            (failed, _) => format!("{} failed, after {time}", count(failed, "item")),
        };
        Some(Toast { title, lines })
    }
}

#[cfg(test)]
mod tests {
    use engine::{Change, Changed, ItemKey, RemovalCause, Summary};

    use super::*;

    fn item(stage: &str, stem: &str) -> ItemName {
        ItemName { stage: stage.into(), key: ItemKey::from_iter([("material", stem)]) }
    }

    fn finished(stage: &str, stem: &str) -> Event {
        Event::Finished { item: item(stage, stem), milliseconds: 1.0, changed: true }
    }

    fn noticed(path: &str) -> Event {
        let changes = vec![Change { path: path.into(), what: Changed::Changed }];
        Event::Noticed { changes, milliseconds: 20.0 }
    }

    fn rejected() -> Event {
        Event::Rejected { diagnostics: engine::Diagnostics::new("pipeline.toml", "", Vec::new()) }
    }

    fn planned(items: usize) -> Event {
        Event::Planned { dry_run: false, stages: 2, items }
    }

    fn ended(cancelled: bool) -> Event {
        Event::Ended(Summary { cancelled, ..Summary::default() })
    }

    /// The outcome of the last of these events, which come a tenth of a second apart.
    fn update(status: &mut BuildStatus, events: &[Event]) -> Option<Toast> {
        let times = (0..).map(|number| 1000.0 + 100.0 * f64::from(number));
        events.iter().zip(times).fold(None, |_, (event, now)| status.update(event, now))
    }

    #[test]
    fn a_rebuild_is_reported_with_what_ran_and_how_long_it_took() {
        let mut status = BuildStatus::default();
        assert_eq!(
            update(&mut status, &[planned(3), finished("material", "gold"), ended(false)]),
            None,
            "no change caused it"
        );
        let events = [
            noticed("gold.toml"),
            planned(3),
            finished("material", "gold"),
            finished("map", "a"),
            finished("map", "b"),
        ];
        assert_eq!(update(&mut status, &events), None);
        assert_eq!(status.line(), "building: 3 of 3 items");
        let toast = update(&mut status, &[ended(false)]).unwrap();
        assert!(toast.title.starts_with("rebuilt in 20 ms"), "{}", toast.title);
        assert_eq!(toast.lines, ["because of gold.toml", "material [gold]", "map, 2 items"]);
        assert_eq!(update(&mut status, &[planned(3), ended(false)]), None, "it was reported before");
    }

    #[test]
    fn files_that_were_removed_are_counted_with_their_cause() {
        let mut status = BuildStatus::default();
        let removed = |file: &str| Event::Removed {
            item: item("map", "studio"),
            file: file.into(),
            because: RemovalCause::SourceDeleted { path: "hdri/studio.hdr".into() },
        };
        let events =
            [noticed("hdri/studio.hdr"), planned(3), removed("a.exr"), removed("b.exr"), ended(false)];
        let toast = update(&mut status, &events).unwrap();
        assert_eq!(
            toast.lines.into_iter().map(test_data::unix_paths).collect::<Vec<_>>(),
            ["because of hdri/studio.hdr", "hdri/studio.hdr was deleted: 2 files removed"]
        );
    }

    #[test]
    fn a_build_that_another_change_stopped_is_reported_with_the_next() {
        let mut status = BuildStatus::default();
        let first = [noticed("a.toml"), planned(2), finished("material", "a"), ended(true)];
        assert_eq!(update(&mut status, &first), None);
        let second = [noticed("b.toml"), planned(2), finished("material", "b"), ended(false)];
        let toast = update(&mut status, &second).unwrap();
        assert_eq!(toast.lines, ["because of a.toml, b.toml", "material, 2 items"]);
    }

    #[test]
    fn failures_are_kept_until_they_are_fixed() {
        let mut status = BuildStatus::default();
        let failed = Event::Failed { item: item("material", "gold"), error: vec!["bad".into()], help: None };
        update(&mut status, &[planned(1), failed, ended(false)]);
        assert_eq!(status.errors().lines()[0], "FAILED  material [gold]");
        assert!(status.errors().affects(&[item("material", "gold"), item("map", "gold")]));
        assert!(!status.errors().affects(&[item("material", "tin")]));
        update(&mut status, &[planned(1), finished("material", "gold"), ended(false)]);
        assert!(status.errors().lines().is_empty());
    }

    #[test]
    fn failures_and_builds_without_a_run_are_reported_as_such() {
        let mut status = BuildStatus::default();
        let end = |failed| Event::Ended(Summary { failed, ..Summary::default() });
        let title = |status: &mut BuildStatus, failed| {
            update(status, &[noticed("a.toml"), planned(1), end(failed)]).unwrap().title
        };
        assert!(title(&mut status, 1).starts_with("1 item failed, after "));
        assert!(title(&mut status, 0).ends_with("; nothing had to run"));
    }

    #[test]
    fn a_broken_manifest_stops_no_build_and_is_not_among_its_causes() {
        let mut status = BuildStatus::default();
        update(&mut status, &[noticed("gold.toml"), planned(2), noticed("pipeline.toml"), rejected()]);
        assert!(status.has_build());
        assert_eq!(status.line(), "building: 0 of 2 items");
        let toast = update(&mut status, &[finished("material", "gold"), ended(false)]).unwrap();
        assert_eq!(toast.lines, ["because of gold.toml", "material [gold]"]);
        assert_eq!(update(&mut status, &[noticed("pipeline.toml"), rejected()]), None);
        assert_eq!(update(&mut status, &[planned(2), ended(false)]), None, "nothing was noticed for it");
    }

    #[test]
    fn a_build_that_waits_names_the_process_it_waits_for() {
        let mut status = BuildStatus::default();
        let waiting = Event::Waiting { holder: "specula build, process 7".into(), limit_milliseconds: None };
        update(&mut status, &[planned(2), waiting]);
        assert_eq!(status.line(), "waiting for specula build, process 7");
        update(&mut status, &[finished("map", "a")]);
        assert_eq!(status.line(), "building: 1 of 2 items");
    }

    #[test]
    fn the_line_shows_how_far_long_items_are() {
        let mut status = BuildStatus::default();
        let progress = |stem: &str, share| Event::Progress { item: item("report", stem), share };
        update(&mut status, &[planned(3), progress("b", 0.25), progress("a", 0.5), progress("b", 0.75)]);
        assert_eq!(status.line(), "building: 0 of 3 items, report [a] 50 %, report [b] 75 %");
        update(&mut status, &[finished("report", "a")]);
        assert_eq!(status.line(), "building: 1 of 3 items, report [b] 75 %");
        update(&mut status, &[ended(true), planned(3)]);
        assert_eq!(status.line(), "building: 0 of 3 items");
    }

    #[test]
    fn the_line_says_how_the_watcher_gets_changes_once_that_is_known() {
        let mut status = BuildStatus::default();
        assert!(status.is_building());
        let watching = Event::Watching { folders: 2, poll_milliseconds: None, because: None };
        update(&mut status, &[planned(1), ended(false), watching]);
        assert!(!status.is_building());
        assert_eq!(status.line(), "listening to 2 folders");
    }
}
