//! Files that are still being written, as far as that can be told: what changed there is not acted on yet.
//!
//! Linux reports when a file is closed that was open for writing. So one that was written to is waited for until then,
//! or until it has been quiet for a while, since a program may keep a file open. Where pieces come with a close after
//! each, or no close is reported, only what comes of the file can tell: one that an item failed on, and that changes
//! again soon, has to be quiet for longer, and longer still with each failure; unless a close shows that it did not
//! grow, for then it was written anew rather than continued.

use std::collections::{BTreeSet, HashMap, HashSet};
use std::fs;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use super::backoff::Backoff;

/// However busy a file is, what was heard is told after so many times the quiet time.
pub(super) const PATIENCE: u32 = 10;

/// How long files are waited for.
#[derive(Clone, Copy, Debug)]
pub(crate) struct WritePauses {
    /// The quiet time of a file that is open for writing.
    pub(crate) open: Duration,
    /// After so long it is acted on, however busy it is.
    pub(crate) longest: Duration,
    /// The quiet time of a file that an item failed on once, and the longest.
    pub(crate) failed: [Duration; 2],
    /// After so long without a change or a failure it is a file like any other.
    pub(crate) calm: Duration,
}

impl Default for WritePauses {
    fn default() -> Self {
        Self {
            open: Duration::from_millis(500),
            longest: Duration::from_secs(30),
            failed: [Duration::from_millis(500), Duration::from_secs(4)],
            calm: Duration::from_secs(5),
        }
    }
}

/// A file that is waited for.
#[derive(Debug, PartialEq)]
pub(super) struct Awaited {
    /// Whether its path led somewhere before.
    pub(super) knew: bool,
    /// When the first change of it was heard of.
    pub(super) first: Instant,
    /// When the last was.
    last: Instant,
    /// Whether it was written to and not closed since.
    is_open: bool,
    /// When it was last known to be whole without that having been acted on.
    pub(super) whole: Option<Instant>,
}

/// A file that an item failed on.
#[derive(Debug)]
struct Restless {
    backoff: Backoff,
    /// How long it has to be quiet.
    quiet: Duration,
    /// When it last changed, or an item failed on it.
    last: Instant,
    /// Its size when it was last closed, or an item failed on it.
    size: u64,
}

/// The files that are waited for, and those that have to be quiet for longer than others.
#[derive(Default)]
pub(super) struct Unfinished {
    pub(super) pauses: WritePauses,
    files: HashMap<PathBuf, Awaited>,
    restless: HashMap<PathBuf, Restless>,
}

impl Unfinished {
    /// Whether a file is waited for.
    pub(super) fn have(&self, path: &Path) -> bool {
        self.files.contains_key(path)
    }

    /// A file was written to; it will be closed. `pending` says what was to be acted on: whether its path led somewhere
    /// before, when that was heard of, and since when it was whole.
    pub(super) fn written(
        &mut self,
        path: PathBuf,
        knew: bool,
        pending: Option<(bool, Instant, Instant)>,
        now: Instant,
    ) {
        self.touch(&path, now);
        if let Some(file) = self.files.get_mut(&path) {
            (file.last, file.is_open) = (now, true);
            return;
        }
        let (knew, first, whole) = match pending {
            Some((knew, first, whole)) => (knew, first, Some(whole)),
            None => (knew, now, None),
        };
        self.files.insert(path, Awaited { knew, first, last: now, is_open: true, whole });
    }

    /// A file was closed. Returns it, if it has been written to and may be acted on.
    pub(super) fn closed(&mut self, path: &Path, now: Instant) -> Option<Awaited> {
        let file = self.files.get_mut(path).filter(|file| file.is_open)?;
        (file.is_open, file.last) = (false, now);
        if let Some(restless) = self.restless.get_mut(path) {
            let before = std::mem::replace(&mut restless.size, size(path));
            if restless.size > before {
                return None;
            }
        }
        self.take(path)
    }

    /// A file changed in a way that does not say whether it is whole. Returns whether it is waited for.
    pub(super) fn changed(&mut self, path: &Path, knew: bool, now: Instant) -> bool {
        let is_restless = self.touch(path, now);
        if let Some(file) = self.files.get_mut(path) {
            file.last = now;
        } else if is_restless {
            let file = Awaited { knew, first: now, last: now, is_open: false, whole: None };
            self.files.insert(path.into(), file);
        } else {
            return false;
        }
        true
    }

    /// No longer waits for a file.
    pub(super) fn take(&mut self, path: &Path) -> Option<Awaited> {
        self.files.remove(path)
    }

    /// No longer waits for files that have been quiet for long enough, or busy for too long.
    pub(super) fn take_ripe(&mut self, now: Instant) -> Vec<(PathBuf, Awaited)> {
        if self.files.is_empty() {
            return Vec::new();
        }
        let ripe = self.files.iter().filter(|(path, file)| self.ripe(path, file) <= now);
        let ripe = ripe.map(|(path, _)| path.clone()).collect::<Vec<_>>();
        ripe.into_iter().filter_map(|path| self.take(&path).map(|file| (path, file))).collect()
    }

    /// No longer waits for any file.
    pub(super) fn take_all(&mut self) -> Vec<(PathBuf, Awaited)> {
        self.files.drain().collect()
    }

    /// When the first of the files is to be acted on.
    pub(super) fn next(&self) -> Option<Instant> {
        self.files.iter().map(|(path, file)| self.ripe(path, file)).min()
    }

    /// What came of acting on changes: the files that items failed on, and whether the build went to its end.
    pub(super) fn judge(
        &mut self,
        changed: &BTreeSet<PathBuf>,
        failed: &HashSet<PathBuf>,
        has_ended: bool,
        now: Instant,
    ) {
        let [first, longest] = self.pauses.failed;
        let calm = self.pauses.calm;
        self.restless.retain(|_, restless| now.saturating_duration_since(restless.last) <= calm);
        for path in changed {
            if failed.contains(path) {
                let backoff = Backoff::new(first, longest);
                let restless = Restless { backoff, quiet: first, last: now, size: 0 };
                let restless = self.restless.entry(path.clone()).or_insert(restless);
                (restless.quiet, restless.last) = (restless.backoff.pause(), now);
                restless.size = size(path);
            } else if has_ended {
                self.restless.remove(path);
            }
        }
    }

    /// Notes that a file changes. Returns whether it is restless.
    fn touch(&mut self, path: &Path, now: Instant) -> bool {
        let Some(restless) = self.restless.get_mut(path) else { return false };
        let is_calm = now.saturating_duration_since(restless.last) > self.pauses.calm;
        restless.last = now;
        if is_calm {
            self.restless.remove(path);
        }
        !is_calm
    }

    /// When a file is to be acted on, should nothing more come.
    fn ripe(&self, path: &Path, file: &Awaited) -> Instant {
        let restless = self.restless.get(path).map_or(Duration::ZERO, |restless| restless.quiet);
        let (quiet, longest) = if file.is_open {
            (self.pauses.open.max(restless), self.pauses.longest.max(restless * PATIENCE))
        } else {
            (restless, restless * PATIENCE)
        };
        (file.last + quiet).min(file.first + longest)
    }
}

fn size(path: &Path) -> u64 {
    fs::metadata(path).map_or(0, |found| found.len())
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: Duration = Duration::from_millis(1);

    /// A file, the times of whose changes and failures a test chooses.
    struct Clocked {
        folder: tempfile::TempDir,
        unfinished: Unfinished,
        start: Instant,
    }

    impl Clocked {
        fn new() -> Self {
            let folder = tempfile::tempdir().unwrap();
            Self { folder, unfinished: Unfinished::default(), start: Instant::now() }
        }

        fn path(&self) -> PathBuf {
            self.folder.path().join("sky")
        }

        fn resize(&self, bytes: usize) {
            fs::write(self.path(), vec![b'.'; bytes]).unwrap();
        }

        fn at(&self, time: u32) -> Instant {
            self.start + time * MS
        }

        fn written(&mut self, time: u32) {
            self.unfinished.written(self.path(), true, None, self.at(time));
        }

        fn closed(&mut self, time: u32) -> bool {
            self.unfinished.closed(&self.path(), self.at(time)).is_some()
        }

        /// A change that does not say whether the file is whole; whether it is waited for.
        fn changed(&mut self, time: u32) -> bool {
            self.unfinished.changed(&self.path(), true, self.at(time))
        }

        /// When the file is acted on, in milliseconds.
        fn next(&self) -> Option<u128> {
            self.unfinished.next().map(|next| next.saturating_duration_since(self.start).as_millis())
        }

        fn judge(&mut self, failed: bool, time: u32) {
            self.unfinished.take_all();
            let failed = failed.then(|| self.path()).into_iter().collect();
            self.unfinished.judge(&[self.path()].into(), &failed, true, self.at(time));
        }
    }

    #[test]
    fn a_file_that_is_open_is_waited_for_until_it_is_closed_or_quiet_and_not_for_ever() {
        let mut file = Clocked::new();
        assert!(!file.closed(0), "nothing was written");
        for time in (0..29_800).step_by(400) {
            file.written(time);
            assert_eq!(file.next(), Some(u128::from(time + 500).min(30_000)));
        }
        assert!(file.closed(29_800));
        assert!(!file.closed(29_800));
        assert_eq!(file.next(), None);
    }

    #[test]
    fn the_quiet_time_grows_with_each_failure() {
        let mut file = Clocked::new();
        assert!(!file.changed(0));
        let mut time = 20;
        for quiet in [500, 1000, 2000, 4000, 4000] {
            file.judge(true, time);
            time += 900;
            assert!(file.changed(time));
            assert_eq!(file.next(), Some(u128::from(time + quiet)));
            time += quiet;
        }
    }

    #[test]
    fn a_restless_file_is_acted_on_at_last_however_busy_it_is() {
        let mut file = Clocked::new();
        file.judge(true, 0);
        (100..=4900).step_by(100).for_each(|time| assert!(file.changed(time)));
        assert_eq!(file.next(), Some(5100));
    }

    #[test]
    fn a_close_ends_the_wait_for_a_restless_file_only_if_it_did_not_grow() {
        let mut file = Clocked::new();
        file.resize(10);
        file.judge(true, 0);
        file.resize(20);
        file.written(100);
        assert!(!file.closed(200));
        assert_eq!(file.next(), Some(700));
        file.written(300);
        assert!(file.closed(400), "written anew");
        file.resize(21);
        file.written(500);
        assert!(!file.closed(600));
    }

    #[test]
    fn a_success_or_some_seconds_of_calm_make_it_a_file_like_any_other() {
        let mut file = Clocked::new();
        file.judge(true, 0);
        file.judge(false, 10);
        assert!(!file.changed(20));
        file.judge(true, 30);
        assert!(!file.changed(5100));
        file.judge(true, 5200);
        assert!(file.changed(5300));
        assert_eq!(file.next(), Some(5800), "the pauses begin anew");
    }
}
