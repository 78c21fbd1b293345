//! Polls the places of a graph, if events cannot be relied on.

use std::collections::{BTreeSet, HashMap};
use std::ffi::OsString;
use std::fs;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use super::places::WatchedPlaces;
use crate::platform::{Identity, Stamp, folder_identity};

/// Two changes within a file system's time resolution, at most so long, have the same stamp. So the contents
/// are checked once more when this time is over.
const SETTLES: Duration = Duration::from_millis(2500);

/// The state of a path as far as it can be seen without reading it.
#[derive(Debug, PartialEq)]
enum PathState {
    File(Stamp),
    Folder(Option<Identity>),
    Missing,
}

/// The states of the last poll, and when to poll again.
pub(super) struct Poller {
    every: Duration,
    next: Instant,
    paths: HashMap<PathBuf, PathState>,
    names: HashMap<PathBuf, BTreeSet<OsString>>,
    settles: Option<Instant>,
}

#[derive(Debug, Default, PartialEq)]
pub(super) struct Polled {
    pub(super) changed: BTreeSet<PathBuf>,
    /// Whether contents may have changed without a change of the stamp.
    pub(super) is_uncertain: bool,
}

impl Poller {
    pub(super) fn new(every: Duration) -> Self {
        let next = Instant::now() + every;
        Self { every, next, paths: HashMap::new(), names: HashMap::new(), settles: None }
    }

    pub(super) fn every(&self) -> Duration {
        self.every
    }

    pub(super) fn next(&self) -> Instant {
        self.next
    }

    /// Reads the state of new places, and forgets those that are not needed any more. The others keep their
    /// last state, so that the next poll finds what changed meanwhile. Returns whether any place is new.
    pub(super) fn watch(&mut self, places: &WatchedPlaces) -> bool {
        let mut is_new = false;
        let mut before = std::mem::take(&mut self.paths);
        for path in &places.files {
            let known = before.remove_entry(path);
            is_new |= known.is_none();
            let (path, state) = known.unwrap_or_else(|| (path.clone(), state(path)));
            self.paths.insert(path, state);
        }
        let mut before = std::mem::take(&mut self.names);
        for folder in places.named_folders() {
            let known = before.remove(folder);
            is_new |= known.is_none();
            self.names.insert(folder.into(), known.unwrap_or_else(|| places.names_in(folder)));
        }
        if is_new {
            self.settles = Some(Instant::now() + SETTLES);
        }
        is_new
    }

    pub(super) fn poll(&mut self, places: &WatchedPlaces) -> Polled {
        let mut polled = Polled::default();
        for (path, before) in &mut self.paths {
            let now = state(path);
            if now != *before {
                *before = now;
                polled.changed.insert(path.clone());
            }
        }
        for (folder, before) in &mut self.names {
            let now = places.names_in(folder);
            polled.changed.extend(now.symmetric_difference(before).map(|name| folder.join(name)));
            *before = now;
        }
        let now = Instant::now();
        if !polled.changed.is_empty() {
            self.settles = Some(now + SETTLES);
        } else if self.settles.is_some_and(|settles| settles <= now) {
            self.settles = None;
            polled.is_uncertain = true;
        }
        // The pause counts from the end, so that polling a slow disk does not take all the time.
        self.next = now + self.every;
        polled
    }
}

fn state(path: &Path) -> PathState {
    match fs::metadata(path) {
        Ok(metadata) if metadata.is_dir() => PathState::Folder(folder_identity(path)),
        Ok(metadata) => PathState::File(Stamp::of(&metadata)),
        Err(_) => PathState::Missing,
    }
}
