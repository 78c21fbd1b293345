//! What the window is told of builds: a line of what goes on, a message after each rebuild, the errors that stand.

use engine::{Event, ItemName};

use crate::outstanding::OutstandingErrors;
use crate::quantity::{count, duration};
use crate::session::{fitting, way};

/// So many stages are named.
const STAGES: usize = 8;

/// The columns of a message.
const COLUMNS: usize = 60;

/// A message that goes by itself.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Message {
    pub(crate) title: String,
    pub(crate) lines: Vec<String>,
}

/// Follows the events of a watcher.
#[derive(Default)]
pub(crate) struct BuildStatus {
    standing: OutstandingErrors,
    way: String,
    /// The items of the build at work, and how many of them are settled.
    progress: Option<(usize, usize)>,
    /// Who works in the folder, so that the build at work waits.
    holder: Option<String>,
    /// When the first change was heard of that no build has answered yet, in milliseconds.
    noticed: Option<f64>,
    changed: Vec<String>,
    /// What ran since, by stage.
    ran: Vec<(String, Vec<ItemName>)>,
}

impl BuildStatus {
    /// Takes an event in, `now` in milliseconds of any clock; a message where a build has ended that a change began.
    pub(crate) fn hear(&mut self, event: &Event, now: f64) -> Option<Message> {
        self.standing.take(event);
        self.holder = None;
        match event {
            Event::Waiting { holder, .. } => self.holder = Some(holder.clone()),
            Event::Watching { folders, poll_milliseconds, because } => {
                self.way = way(*folders, *poll_milliseconds, because.as_deref());
            }
            Event::Noticed { changes, milliseconds } => {
                self.noticed.get_or_insert(now - milliseconds);
                for change in changes {
                    if !self.changed.contains(&change.path) {
                        self.changed.push(change.path.clone());
                    }
                }
            }
            Event::Planned { items, .. } => self.progress = Some((0, *items)),
            Event::Finished { item, .. } => {
                self.settle();
                match self.ran.iter_mut().find(|(stage, _)| *stage == item.stage) {
                    Some((_, items)) => items.push(item.clone()),
                    None => self.ran.push((item.stage.clone(), vec![item.clone()])),
                }
            }
            Event::UpToDate { .. } | Event::Failed { .. } | Event::Skipped { .. } => self.settle(),
            Event::Ended(summary) => {
                self.progress = None;
                // What was stopped by another change goes on with it.
                if !summary.cancelled {
                    return self.message(now, summary.failed);
                }
            }
            Event::Rejected { .. } | Event::BuildError { .. } => {
                self.progress = None;
                self.noticed = None;
                self.changed.clear();
            }
            _ => {}
        }
        None
    }

    /// Whether a build is at work, or was not even begun.
    pub(crate) fn is_building(&self) -> bool {
        self.progress.is_some() || self.way.is_empty()
    }

    /// What goes on.
    pub(crate) fn status(&self) -> String {
        if let Some(holder) = &self.holder {
            return format!("waiting for {holder}");
        }
        match self.progress {
            Some((settled, items)) => format!("building: {settled} of {}", count(items, "item")),
            None => self.way.clone(),
        }
    }

    /// The errors that stand, a few lines each; none where all is well.
    pub(crate) fn failures(&self) -> Vec<String> {
        self.standing.pinned()
    }

    /// Whether one of them keeps some of these items from being made anew.
    pub(crate) fn is_of(&self, items: &[ItemName]) -> bool {
        self.standing.is_of(items)
    }

    fn settle(&mut self) {
        if let Some((settled, items)) = &mut self.progress {
            *settled = (*settled + 1).min(*items);
        }
    }

    /// What a rebuild came to.
    fn message(&mut self, now: f64, failed: usize) -> Option<Message> {
        let (changed, ran) = (std::mem::take(&mut self.changed), std::mem::take(&mut self.ran));
        let time = duration(now - self.noticed.take()?);
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
        if ran.len() > STAGES {
            lines.push(format!("and {}", count(ran.len() - STAGES, "more stage")));
        }
        let title = match (failed, ran.is_empty()) {
            (0, false) => format!("rebuilt in {time}"),
            (0, true) => format!("up to date in {time}: nothing had to run"),
            (failed, _) => format!("{} failed, after {time}", count(failed, "item")),
        };
        Some(Message { title, lines })
    }
}

#[cfg(test)]
mod tests {

    use engine::{Change, Changed, ItemKey, Summary};

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

    fn planned(items: usize) -> Event {
        Event::Planned { dry_run: false, stages: 2, items }
    }

    fn ended(cancelled: bool) -> Event {
        Event::Ended(Summary { cancelled, ..Summary::default() })
    }

    /// The last of what is told of events that come a tenth of a second apart.
    fn told(gazette: &mut BuildStatus, events: &[Event]) -> Option<Message> {
        let times = (0..).map(|number| 1000.0 + 100.0 * f64::from(number));
        events.iter().zip(times).fold(None, |_, (event, now)| gazette.hear(event, now))
    }

    #[test]
    fn a_rebuild_is_told_with_what_ran_and_since_when() {
        let mut gazette = BuildStatus::default();
        assert_eq!(
            told(&mut gazette, &[planned(3), finished("material", "gold"), ended(false)]),
            None,
            "nobody asked"
        );
        let events = [
            noticed("gold.toml"),
            planned(3),
            finished("material", "gold"),
            finished("map", "a"),
            finished("map", "b"),
        ];
        assert_eq!(told(&mut gazette, &events), None);
        assert_eq!(gazette.status(), "building: 3 of 3 items");
        let message = told(&mut gazette, &[ended(false)]).unwrap();
        assert!(message.title.starts_with("rebuilt in 20 ms"), "{}", message.title);
        assert_eq!(message.lines, ["because of gold.toml", "material [gold]", "map, 2 items"]);
        assert_eq!(told(&mut gazette, &[planned(3), ended(false)]), None, "it was told");
    }

    #[test]
    fn what_another_change_stopped_is_told_with_it() {
        let mut gazette = BuildStatus::default();
        let first = [noticed("a.toml"), planned(2), finished("material", "a"), ended(true)];
        assert_eq!(told(&mut gazette, &first), None);
        let second = [noticed("b.toml"), planned(2), finished("material", "b"), ended(false)];
        let message = told(&mut gazette, &second).unwrap();
        assert_eq!(message.lines, ["because of a.toml, b.toml", "material, 2 items"]);
    }

    #[test]
    fn failures_stand_until_they_are_mended() {
        let mut gazette = BuildStatus::default();
        let failed = Event::Failed { item: item("material", "gold"), error: vec!["bad".into()], help: None };
        told(&mut gazette, &[planned(1), failed, ended(false)]);
        assert_eq!(gazette.failures()[0], "FAILED  material [gold]");
        assert!(gazette.is_of(&[item("material", "gold"), item("map", "gold")]));
        assert!(!gazette.is_of(&[item("material", "tin")]));
        told(&mut gazette, &[planned(1), finished("material", "gold"), ended(false)]);
        assert!(gazette.failures().is_empty());
    }

    #[test]
    fn what_failed_and_what_had_not_to_run_is_told_as_such() {
        let mut gazette = BuildStatus::default();
        let end = |failed| Event::Ended(Summary { failed, ..Summary::default() });
        let title = |gazette: &mut BuildStatus, failed| {
            told(gazette, &[noticed("a.toml"), planned(1), end(failed)]).unwrap().title
        };
        assert!(title(&mut gazette, 1).starts_with("1 item failed, after "));
        assert!(title(&mut gazette, 0).ends_with(": nothing had to run"));
    }

    #[test]
    fn while_a_build_waits_it_tells_for_whom() {
        let mut gazette = BuildStatus::default();
        let waiting = Event::Waiting { holder: "specula build, process 7".into(), limit_milliseconds: None };
        told(&mut gazette, &[planned(2), waiting]);
        assert_eq!(gazette.status(), "waiting for specula build, process 7");
        told(&mut gazette, &[finished("map", "a")]);
        assert_eq!(gazette.status(), "building: 1 of 2 items");
    }

    #[test]
    fn it_tells_how_changes_are_learnt_of_once_that_is_known() {
        let mut gazette = BuildStatus::default();
        assert!(gazette.is_building());
        let watching = Event::Watching { folders: 2, poll_milliseconds: None, because: None };
        told(&mut gazette, &[planned(1), ended(false), watching]);
        assert!(!gazette.is_building());
        assert_eq!(gazette.status(), "listening to 2 folders");
    }
}
