//! Files that are still being written, as far as that can be known: they are not built yet.
//!
//! Linux reports when a file that was open for writing is closed. So after a write the watcher waits until
//! then. If the file has been quiet for a while, it looks whether a program still has it open for writing
//! ([`crate::storage::writers`]), and waits on if so, up to a limit, since a program may keep a file open. If
//! a program closes the file after each piece, or if the system does not report a close, only a failure shows
//! that the file was not complete: if an item failed on a file that soon changes again, the file has to be
//! quiet for longer, and longer still after each further failure. An exception is a file that did not grow
//! when it was closed: it was written anew rather than continued.

use std::collections::{BTreeSet, HashMap, HashSet};
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

use super::backoff::Backoff;
use crate::build::PathSet;
use crate::storage::being_written;

/// However busy files are, they are built after so many times the quiet time.
pub(super) const MOST_QUIET_TIMES: u32 = 10;

/// How long to wait for files.
#[derive(Clone, Copy, Debug)]
pub(crate) struct WritePauses {
    /// The quiet time of a file that no program is known to have open for writing, and the time between two
    /// looks whether one has.
    pub(crate) open: Duration,
    /// The longest wait for a file that no program is known to have open for writing, however busy it is.
    pub(crate) longest: Duration,
    /// The quiet time of a file after the first failure of an item on it, and the longest.
    pub(crate) failed: [Duration; 2],
    /// The time without a change or a failure after which a file counts as stable again.
    pub(crate) stable: Duration,
}

impl Default for WritePauses {
    fn default() -> Self {
        Self {
            open: Duration::from_millis(500),
            longest: Duration::from_secs(30),
            failed: [Duration::from_millis(500), Duration::from_secs(4)],
            stable: Duration::from_secs(5),
        }
    }
}

/// A file that the watcher waits for.
#[derive(Debug, PartialEq)]
pub(super) struct UnfinishedFile {
    /// Whether its path led to a file or folder before.
    pub(super) existed: bool,
    pub(super) first: Instant,
    last: Instant,
    /// Whether it was written to and not closed since.
    is_open: bool,
    /// The time at which the file was complete, if there was one and it has not been built since.
    pub(super) complete_since: Option<Instant>,
}

/// A file that an item failed on.
#[derive(Debug)]
struct UnstableFile {
    backoff: Backoff,
    /// How long it has to be quiet.
    quiet: Duration,
    /// The time of its last change or failure.
    last: Instant,
    /// The file's size at the last close or failure.
    size: u64,
}

/// The files that the watcher waits for, and those that have to be quiet for longer than others.
#[derive(Default)]
pub(super) struct UnfinishedFiles {
    pub(super) pauses: WritePauses,
    /// The paths of `files`, for items that read one of them.
    shared: Arc<PathSet>,
    files: HashMap<PathBuf, UnfinishedFile>,
    unstable: HashMap<PathBuf, UnstableFile>,
}

impl UnfinishedFiles {
    pub(super) fn shared(&self) -> Arc<PathSet> {
        Arc::clone(&self.shared)
    }

    pub(super) fn have(&self, path: &Path) -> bool {
        self.files.contains_key(path)
    }

    /// A file was written to; it will be closed. `pending` describes an earlier change that has not been
    /// built: whether the path existed before, when it changed, and since when it was complete.
    pub(super) fn written(
        &mut self,
        path: PathBuf,
        existed: bool,
        pending: Option<(bool, Instant, Instant)>,
        now: Instant,
    ) {
        self.touch(&path, now);
        if let Some(file) = self.files.get_mut(&path) {
            (file.last, file.is_open) = (now, true);
            return;
        }
        let (existed, first, complete_since) = match pending {
            Some((existed, first, complete)) => (existed, first, Some(complete)),
            None => (existed, now, None),
        };
        self.insert(path, UnfinishedFile { existed, first, last: now, is_open: true, complete_since });
    }

    /// A file was closed. Returns it if it had been written to and can be built.
    pub(super) fn closed(&mut self, path: &Path, now: Instant) -> Option<UnfinishedFile> {
        let file = self.files.get_mut(path).filter(|file| file.is_open)?;
        (file.is_open, file.last) = (false, now);
        if let Some(unstable) = self.unstable.get_mut(path) {
            let before = std::mem::replace(&mut unstable.size, size(path));
            if unstable.size > before {
                return None;
            }
        }
        self.take(path)
    }

    /// A file changed, and it is not known whether it is complete. Returns whether the watcher waits for it.
    pub(super) fn changed(&mut self, path: &Path, existed: bool, now: Instant) -> bool {
        let is_unstable = self.touch(path, now);
        if let Some(file) = self.files.get_mut(path) {
            file.last = now;
        } else if is_unstable {
            let file =
                UnfinishedFile { existed, first: now, last: now, is_open: false, complete_since: None };
            self.insert(path.into(), file);
        } else {
            return false;
        }
        true
    }

    /// Stops waiting for a file.
    pub(super) fn take(&mut self, path: &Path) -> Option<UnfinishedFile> {
        self.shared.lock().remove(path);
        self.files.remove(path)
    }

    fn insert(&mut self, path: PathBuf, file: UnfinishedFile) {
        self.shared.lock().insert(path.clone());
        self.files.insert(path, file);
    }

    /// Stops waiting for the files that have been quiet for long enough, or busy for too long.
    pub(super) fn take_ready(&mut self, now: Instant) -> Vec<(PathBuf, UnfinishedFile)> {
        if self.files.is_empty() {
            return Vec::new();
        }
        let ready = self.files.iter().filter(|(path, file)| self.ready_at(path, file) <= now);
        let mut ready = ready.map(|(path, _)| path.clone()).collect::<Vec<_>>();
        // A program may pause for long while it has the file open.
        for path in being_written(ready.iter().map(PathBuf::as_path)) {
            if let Some(file) = self.files.get_mut(&path)
                && now < file.first + self.pauses.longest
            {
                (file.last, file.is_open) = (now, true);
                ready.retain(|ready| *ready != path);
            }
        }
        ready.into_iter().filter_map(|path| self.take(&path).map(|file| (path, file))).collect()
    }

    pub(super) fn take_all(&mut self) -> Vec<(PathBuf, UnfinishedFile)> {
        self.shared.lock().clear();
        self.files.drain().collect()
    }

    /// When the first of the files is to be built.
    pub(super) fn next(&self) -> Option<Instant> {
        self.files.iter().map(|(path, file)| self.ready_at(path, file)).min()
    }

    /// Records what a build made of changes: the files on which items failed, and whether the build was
    /// completed.
    pub(super) fn record_outcome(
        &mut self,
        changed: &BTreeSet<PathBuf>,
        failed: &HashSet<PathBuf>,
        has_ended: bool,
        now: Instant,
    ) {
        let [first, longest] = self.pauses.failed;
        let stable = self.pauses.stable;
        self.unstable.retain(|_, unstable| now.saturating_duration_since(unstable.last) <= stable);
        for path in changed {
            if failed.contains(path) {
                let backoff = Backoff::new(first, longest);
                let unstable = UnstableFile { backoff, quiet: first, last: now, size: 0 };
                let unstable = self.unstable.entry(path.clone()).or_insert(unstable);
                (unstable.quiet, unstable.last) = (unstable.backoff.pause(), now);
                unstable.size = size(path);
            } else if has_ended {
                self.unstable.remove(path);
            }
        }
    }

    /// Records that a file changed. Returns whether it is unstable.
    fn touch(&mut self, path: &Path, now: Instant) -> bool {
        let Some(unstable) = self.unstable.get_mut(path) else { return false };
        let is_stable = now.saturating_duration_since(unstable.last) > self.pauses.stable;
        unstable.last = now;
        if is_stable {
            self.unstable.remove(path);
        }
        !is_stable
    }

    /// When a file is to be built if it does not change any more.
    fn ready_at(&self, path: &Path, file: &UnfinishedFile) -> Instant {
        let unstable = self.unstable.get(path).map_or(Duration::ZERO, |unstable| unstable.quiet);
        let (quiet, longest) = if file.is_open {
            (self.pauses.open.max(unstable), self.pauses.longest.max(unstable * MOST_QUIET_TIMES))
        } else {
            (unstable, unstable * MOST_QUIET_TIMES)
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

    /// A file whose changes and failures have the times that a test chooses.
    struct TimedFile {
        folder: tempfile::TempDir,
        unfinished: UnfinishedFiles,
        start: Instant,
    }

    impl TimedFile {
        fn new() -> Self {
            let folder = tempfile::tempdir().unwrap();
            Self { folder, unfinished: UnfinishedFiles::default(), start: Instant::now() }
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

        /// A change that does not show whether the file is complete; returns whether the watcher waits for
        /// it.
        fn changed(&mut self, time: u32) -> bool {
            self.unfinished.changed(&self.path(), true, self.at(time))
        }

        /// When the file is built, in milliseconds.
        fn next(&self) -> Option<u128> {
            self.unfinished.next().map(|next| next.saturating_duration_since(self.start).as_millis())
        }

        fn record_outcome(&mut self, failed: bool, time: u32) {
            self.unfinished.take_all();
            let failed = failed.then(|| self.path()).into_iter().collect();
            self.unfinished.record_outcome(&[self.path()].into(), &failed, true, self.at(time));
        }
    }

    #[test]
    fn an_open_file_is_built_when_it_is_closed_or_quiet_or_has_been_busy_for_too_long() {
        let mut file = TimedFile::new();
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
        let mut file = TimedFile::new();
        assert!(!file.changed(0));
        let mut time = 20;
        for quiet in [500, 1000, 2000, 4000, 4000] {
            file.record_outcome(true, time);
            time += 900;
            assert!(file.changed(time));
            assert_eq!(file.next(), Some(u128::from(time + quiet)));
            time += quiet;
        }
    }

    #[test]
    fn an_unstable_file_is_built_in_the_end_however_busy_it_is() {
        let mut file = TimedFile::new();
        file.record_outcome(true, 0);
        (100..=4900).step_by(100).for_each(|time| assert!(file.changed(time)));
        assert_eq!(file.next(), Some(5100));
    }

    #[test]
    fn a_close_ends_the_wait_for_an_unstable_file_only_if_it_did_not_grow() {
        let mut file = TimedFile::new();
        file.resize(10);
        file.record_outcome(true, 0);
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
    fn a_success_or_some_quiet_seconds_make_a_file_stable() {
        let mut file = TimedFile::new();
        file.record_outcome(true, 0);
        file.record_outcome(false, 10);
        assert!(!file.changed(20));
        file.record_outcome(true, 30);
        assert!(!file.changed(5100));
        file.record_outcome(true, 5200);
        assert!(file.changed(5300));
        assert_eq!(file.next(), Some(5800), "the pauses begin with the first again");
    }
}
