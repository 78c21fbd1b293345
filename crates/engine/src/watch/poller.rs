//! Looks at the places of a graph again and again, where events cannot be relied on.

use std::collections::{BTreeSet, HashMap};
use std::ffi::OsString;
use std::fs;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use super::places::Places;
use crate::platform::{FolderIdentity, Stamp, folder_identity};

/// A change within the coarsest time of change of a file system leaves a stamp as it was. So when that time is over,
/// the contents are asked once more.
const SETTLES: Duration = Duration::from_millis(2500);

/// What is to be seen of a path without reading it.
#[derive(Debug, PartialEq)]
enum Look {
    File(Stamp),
    Folder(Option<FolderIdentity>),
    Nothing,
}

/// What was seen last, and when to look again.
pub(super) struct Poller {
    every: Duration,
    next: Instant,
    paths: HashMap<PathBuf, Look>,
    names: HashMap<PathBuf, BTreeSet<OsString>>,
    settles: Option<Instant>,
}

/// What looking again showed.
#[derive(Debug, Default, PartialEq)]
pub(super) struct Seen {
    /// The paths that look otherwise.
    pub(super) changed: BTreeSet<PathBuf>,
    /// Whether contents may have changed that stamps do not show.
    pub(super) perhaps: bool,
}

impl Poller {
    pub(super) fn new(every: Duration) -> Self {
        let next = Instant::now() + every;
        Self { every, next, paths: HashMap::new(), names: HashMap::new(), settles: None }
    }

    /// The time between two looks.
    pub(super) fn every(&self) -> Duration {
        self.every
    }

    /// When to look next.
    pub(super) fn next(&self) -> Instant {
        self.next
    }

    /// Looks at places that are new, and forgets those that are no longer there. The others keep what was seen last,
    /// so that a change that came meanwhile is told. Returns whether any is new.
    pub(super) fn attend(&mut self, places: &Places) -> bool {
        let mut is_new = false;
        let mut before = std::mem::take(&mut self.paths);
        for path in &places.files {
            let seen = before.remove_entry(path);
            is_new |= seen.is_none();
            let (path, seen) = seen.unwrap_or_else(|| (path.clone(), look(path)));
            self.paths.insert(path, seen);
        }
        let mut before = std::mem::take(&mut self.names);
        for folder in places.named_folders() {
            let seen = before.remove(folder);
            is_new |= seen.is_none();
            self.names.insert(folder.into(), seen.unwrap_or_else(|| places.names_in(folder)));
        }
        if is_new {
            self.settles = Some(Instant::now() + SETTLES);
        }
        is_new
    }

    /// Looks at everything.
    pub(super) fn look(&mut self, places: &Places) -> Seen {
        let mut seen = Seen::default();
        for (path, before) in &mut self.paths {
            let now = look(path);
            if now != *before {
                *before = now;
                seen.changed.insert(path.clone());
            }
        }
        for (folder, before) in &mut self.names {
            let now = places.names_in(folder);
            seen.changed.extend(now.symmetric_difference(before).map(|name| folder.join(name)));
            *before = now;
        }
        let now = Instant::now();
        if !seen.changed.is_empty() {
            self.settles = Some(now + SETTLES);
        } else if self.settles.is_some_and(|settles| settles <= now) {
            self.settles = None;
            seen.perhaps = true;
        }
        // The pause counts from the end, so that looking at a slow disk is not all that is done.
        self.next = now + self.every;
        seen
    }
}

fn look(path: &Path) -> Look {
    match fs::metadata(path) {
        Ok(metadata) if metadata.is_dir() => Look::Folder(folder_identity(path)),
        Ok(metadata) => Look::File(Stamp::of(&metadata)),
        Err(_) => Look::Nothing,
    }
}
