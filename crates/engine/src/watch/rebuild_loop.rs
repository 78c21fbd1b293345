//! Finds builds that cause themselves.
//!
//! A build may write what it reads: a program that a stage runs changes a source, or a file of `out` is a
//! source by another name (a drive that is mounted twice). If builds follow each other because of nothing but
//! such changes, the watcher stops, until something else changes. It looks once more after a while: a person
//! may have saved a file just while a program ran, each time.

use std::collections::{HashSet, VecDeque};
use std::fs;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant, SystemTime};

use crate::event::{Event, ItemName};
use crate::plan::Plan;
use crate::platform::{Identity, file_identity};

/// Builds may cause so many others within [`PERIOD`].
const MAX_BUILDS: usize = 10;
const PERIOD: Duration = Duration::from_secs(10);

/// File systems may keep times so much more coarsely than the clock.
const RESOLUTION: Duration = Duration::from_millis(20);

/// The traces of a build in the outside world that can cause another build.
#[derive(Debug, Default)]
pub(super) struct BuildTrace {
    /// The first item that was started.
    first: Option<ItemName>,
    published: Vec<PathBuf>,
    /// Since when programs may have run.
    programs: Option<SystemTime>,
}

impl BuildTrace {
    pub(super) fn record(&mut self, event: &Event, plan: &Plan) {
        match event {
            Event::Started { item, .. } => {
                let stage = plan.stages.iter().find(|stage| stage.name == item.stage);
                if stage.is_some_and(|stage| stage.kind.runs_programs()) {
                    self.programs.get_or_insert_with(SystemTime::now);
                }
                self.first.get_or_insert_with(|| item.clone());
            }
            Event::Published { file, .. } => self.published.push(plan.out.join(file)),
            _ => {}
        }
    }
}

/// The builds that may have caused each other.
#[derive(Debug, Default)]
pub(super) struct RebuildLoop {
    /// When builds ended that started items, since the last change that no build can have made.
    ended: VecDeque<Instant>,
    /// The first item that the last of them started: it reads what changes.
    first: Option<ItemName>,
    /// The files that the last build has published.
    published: HashSet<Identity>,
    /// When programs of the last build may have run.
    programs: Option<(SystemTime, SystemTime)>,
    is_stopped: bool,
    look_again: Option<Instant>,
}

/// Whether changes are to be built.
#[derive(Debug, PartialEq)]
pub(super) enum LoopCheck {
    Build,
    /// The changes are not to be built any more: too many builds caused each other, the last of which began
    /// with this item.
    Stop(ItemName),
    /// The changes are not to be built, because the watcher has stopped.
    Stopped,
}

impl RebuildLoop {
    /// Checks changed files that are about to be built.
    pub(super) fn check<'a>(&mut self, changed: impl Iterator<Item = &'a Path>) -> LoopCheck {
        let changed = changed.collect::<HashSet<_>>();
        // A folder whose names are read is named with each change in it.
        let around = changed.iter().flat_map(|path| path.ancestors().skip(1)).collect::<HashSet<_>>();
        if !changed.iter().all(|path| around.contains(path) || self.may_have_made(path)) {
            (self.is_stopped, self.look_again) = (false, None);
            self.ended.clear();
            return LoopCheck::Build;
        }
        if self.is_stopped {
            return LoopCheck::Stopped;
        }
        let now = Instant::now();
        while self.ended.front().is_some_and(|ended| *ended + PERIOD < now) {
            self.ended.pop_front();
        }
        match &self.first {
            Some(first) if self.ended.len() > MAX_BUILDS => {
                (self.is_stopped, self.look_again) = (true, Some(now + PERIOD));
                LoopCheck::Stop(first.clone())
            }
            _ => LoopCheck::Build,
        }
    }

    /// When to look once more, if the watcher has stopped.
    pub(super) fn look_again(&self) -> Option<Instant> {
        self.look_again
    }

    /// Whether it is time to look once more. The next time does not come before somebody changes something.
    pub(super) fn take_look(&mut self) -> bool {
        self.look_again.take_if(|time| *time <= Instant::now()).is_some()
    }

    pub(super) fn build_ended(&mut self, trace: BuildTrace) {
        if trace.first.is_some() {
            self.ended.push_back(Instant::now());
            self.first = trace.first;
        }
        self.published = trace.published.iter().filter_map(|file| file_identity(file)).collect();
        self.programs = trace.programs.map(|since| (since, SystemTime::now()));
    }

    /// Whether the last build may have made a change of a file.
    fn may_have_made(&self, path: &Path) -> bool {
        if file_identity(path).is_some_and(|file| self.published.contains(&file)) {
            return true;
        }
        let Some((since, until)) = self.programs else { return false };
        // Of a file that was removed, its folder has the time.
        let found = fs::metadata(path).or_else(|_| fs::metadata(path.parent().unwrap_or(path)));
        let changed = found.and_then(|found| found.modified());
        changed.is_ok_and(|changed| since <= changed + RESOLUTION && changed <= until + RESOLUTION)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::key::ItemKey;

    fn item() -> ItemName {
        ItemName { stage: "text".into(), key: ItemKey::default() }
    }

    /// What a build of one item did that ran programs from now on, or that published a file.
    fn trace(programs: bool, published: Option<&Path>) -> BuildTrace {
        BuildTrace {
            first: Some(item()),
            published: published.into_iter().map(Path::to_path_buf).collect(),
            programs: programs.then(SystemTime::now),
        }
    }

    #[test]
    fn builds_whose_programs_change_a_source_are_found_after_ten() {
        let folder = tempfile::tempdir().unwrap();
        let source = folder.path().join("source");
        fs::write(&source, "").unwrap();
        std::thread::sleep(3 * RESOLUTION);
        let mut builds = RebuildLoop::default();
        let write_and_check = |builds: &mut RebuildLoop| {
            let trace = trace(true, None);
            fs::write(&source, "").unwrap();
            builds.build_ended(trace);
            // With the folder, whose names are read as well and have not changed.
            builds.check([folder.path(), source.as_path()].into_iter())
        };
        for _ in 0..MAX_BUILDS {
            assert_eq!(write_and_check(&mut builds), LoopCheck::Build);
        }
        assert_eq!(write_and_check(&mut builds), LoopCheck::Stop(item()));
        assert_eq!(write_and_check(&mut builds), LoopCheck::Stopped);
        assert!(builds.look_again().is_some() && !builds.take_look());
        // Somebody saves the file while no program runs.
        std::thread::sleep(3 * RESOLUTION);
        fs::write(&source, "").unwrap();
        assert_eq!(builds.check(std::iter::once(source.as_path())), LoopCheck::Build);
        assert_eq!(write_and_check(&mut builds), LoopCheck::Build, "the builds are counted from there");
    }

    #[test]
    fn only_programs_and_exports_can_cause_a_build() {
        let folder = tempfile::tempdir().unwrap();
        let [source, export] = ["source", "export"].map(|name| folder.path().join(name));
        fs::write(&export, "").unwrap();
        let found = |published: Option<&Path>, changed: &Path| {
            let mut builds = RebuildLoop::default();
            for _ in 0..2 * MAX_BUILDS {
                fs::write(&source, "").unwrap();
                builds.build_ended(trace(false, published));
                if builds.check(std::iter::once(changed)) != LoopCheck::Build {
                    return true;
                }
            }
            false
        };
        assert!(!found(None, &source), "a person who saves often");
        assert!(!found(Some(&export), &source));
        if cfg!(unix) {
            assert!(found(Some(&export), &export));
        }
    }
}
