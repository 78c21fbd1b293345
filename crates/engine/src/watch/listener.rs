//! Listens to folders through the operating system.
//!
//! Folders are watched one by one, never recursively, because the graph knows which ones matter. A watch
//! belongs to a folder, not to its name, so each entry remembers the identity of its folder. If a folder is
//! moved or removed, its watch is forgotten when that event arrives, before another folder can get the name:
//! by then the system, or `notify`, has dropped the watch.

use std::collections::{HashMap, HashSet};
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::mpsc::Sender;

use notify::event::{AccessKind, AccessMode, CreateKind, EventKind, ModifyKind};
use notify::{Config, ErrorKind, Event, RecommendedWatcher, RecursiveMode, Watcher};

use super::places::WatchedPlaces;
use crate::platform::{self, Identity, path_text};

#[derive(Debug)]
pub(crate) enum WatchMessage {
    Event(Event),
    EventsLost,
    #[cfg_attr(not(target_os = "linux"), expect(dead_code, reason = "only Linux reports mounts"))]
    MountsChanged,
    /// A program has this file open for writing, and no event has said so.
    BeingWritten(PathBuf),
    /// Nothing has happened: the message only ends the waiting.
    Wake,
}

/// The meaning of an event for the file at a path.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum FileEvent {
    /// The file was written to; a close follows.
    Written,
    /// The file was closed after it was open for writing.
    Closed,
    /// Another file, which is complete, or no file is in its place.
    Replaced,
    Changed,
}

/// Whether the system reports when a file is closed.
const CLOSES: bool = cfg!(any(target_os = "linux", target_os = "android"));

impl FileEvent {
    /// The meaning of an event of a kind for a path.
    pub(super) fn of(kind: &EventKind, path: &Path) -> Self {
        match kind {
            EventKind::Access(_) => Self::Closed,
            EventKind::Remove(_) | EventKind::Modify(ModifyKind::Name(_)) => Self::Replaced,
            EventKind::Modify(ModifyKind::Data(_)) if CLOSES => Self::Written,
            // A file with content was linked, or another event follows when it is written.
            EventKind::Create(CreateKind::File) if CLOSES && is_empty_file(path) => Self::Written,
            EventKind::Create(_) if CLOSES => Self::Replaced,
            _ => Self::Changed,
        }
    }
}

fn is_empty_file(path: &Path) -> bool {
    fs::symlink_metadata(path).is_ok_and(|found| found.is_file() && found.len() == 0)
}

pub(super) struct Listener {
    watcher: RecommendedWatcher,
    watched: HashMap<PathBuf, Identity>,
}

#[derive(Debug, Default)]
pub(super) struct Listened {
    /// Whether a new watch was set.
    pub(super) is_more: bool,
    /// Why a needed folder cannot be watched; the others are watched.
    pub(super) failed: Option<String>,
}

impl Listener {
    /// # Errors
    /// If the system does not allow it; the message says what to do.
    pub(super) fn new(sender: Sender<WatchMessage>) -> Result<Self, String> {
        let send = move |event: notify::Result<Event>| {
            let message = match event {
                // Builds open many files; of these events only a close after writing matters.
                Ok(event) if event.kind.is_access() && !is_close(&event.kind) => return,
                Ok(event) if event.need_rescan() => WatchMessage::EventsLost,
                Ok(event) => WatchMessage::Event(event),
                Err(_) => WatchMessage::EventsLost,
            };
            // When the watcher ends, there is no receiver any more.
            let _ = sender.send(message);
        };
        match RecommendedWatcher::new(send, Config::default()) {
            Ok(watcher) => Ok(Self { watcher, watched: HashMap::new() }),
            Err(error) => Err(unable(&error)),
        }
    }

    pub(super) fn folders(&self) -> usize {
        self.watched.len()
    }

    /// Listens to the folders of these places and to no others.
    pub(super) fn listen(&mut self, places: &WatchedPlaces) -> Listened {
        // Outdated watches are dropped first, because a folder has only one watch, whatever its name.
        let unwanted = self.watched.keys().filter(|folder| !places.folders.contains_key(*folder));
        let outdated = unwanted.cloned().chain(self.replaced()).collect::<HashSet<_>>();
        outdated.iter().for_each(|folder| self.drop_watch(folder));
        let mut listened = Listened::default();
        for (folder, wanted) in &places.folders {
            if self.watched.contains_key(folder) {
                continue;
            }
            // If it has gone, an event of its parent says so.
            let Some(identity) = platform::folder_identity(folder) else { continue };
            match self.watcher.watch(folder, RecursiveMode::NonRecursive) {
                Ok(()) => {
                    self.watched.insert(folder.clone(), identity);
                    listened.is_more = true;
                }
                Err(error) if is_gone(&error) || wanted.is_output => {}
                Err(error) => {
                    if wanted.is_needed || is_limit(&error) {
                        let why = || format!("cannot listen to {}: {}", path_text(folder), unable(&error));
                        listened.failed.get_or_insert_with(why);
                    }
                }
            }
        }
        listened
    }

    /// The watched folders in whose place there is another folder now, or none.
    pub(super) fn replaced(&self) -> Vec<PathBuf> {
        let replaced = self
            .watched
            .iter()
            .filter(|(folder, identity)| platform::folder_identity(folder).as_ref() != Some(identity));
        replaced.map(|(folder, _)| folder.clone()).collect()
    }

    /// Forgets the watches of folders that were moved or removed.
    pub(super) fn forget_moved(&mut self, event: &Event) {
        if !is_removal(&event.kind) {
            return;
        }
        for path in &event.paths {
            // Most events are of files.
            if self.watched.contains_key(path) {
                self.forget_below(path);
            }
        }
    }

    /// Forgets all watches, because events were lost that may have moved or removed folders.
    pub(super) fn forget_all(&mut self) {
        self.forget_below(Path::new(""));
    }

    fn forget_below(&mut self, path: &Path) {
        let below =
            self.watched.keys().filter(|folder| folder.starts_with(path)).cloned().collect::<Vec<_>>();
        below.iter().for_each(|folder| self.drop_watch(folder));
    }

    fn drop_watch(&mut self, folder: &Path) {
        self.watched.remove(folder);
        // The watch may have gone with its folder.
        let _ = self.watcher.unwatch(folder);
    }
}

/// Whether an event removes or renames something.
pub(super) fn is_removal(kind: &EventKind) -> bool {
    matches!(kind, EventKind::Remove(_) | EventKind::Modify(ModifyKind::Name(_)))
}

fn is_close(kind: &EventKind) -> bool {
    matches!(kind, EventKind::Access(AccessKind::Close(AccessMode::Write)))
}

fn is_gone(error: &notify::Error) -> bool {
    match &error.kind {
        ErrorKind::PathNotFound => true,
        ErrorKind::Io(error) => {
            matches!(error.kind(), io::ErrorKind::NotFound | io::ErrorKind::NotADirectory)
        }
        _ => false,
    }
}

fn is_limit(error: &notify::Error) -> bool {
    const TOO_MANY_FILES: i32 = 24;
    match &error.kind {
        ErrorKind::MaxFilesWatch => true,
        ErrorKind::Io(error) => cfg!(unix) && error.raw_os_error() == Some(TOO_MANY_FILES),
        _ => false,
    }
}

/// Why there is no watch, and what to do.
fn unable(error: &notify::Error) -> String {
    match &error.kind {
        ErrorKind::MaxFilesWatch => {
            "the system's limit of watches is reached; to raise it: sysctl fs.inotify.max_user_watches=524288"
                .into()
        }
        ErrorKind::Io(cause) if is_limit(error) => format!(
            "too many files or watchers are open ({cause}); to raise the limit: sysctl fs.inotify.max_user_instances=1024"
        ),
        ErrorKind::Io(cause) => cause.to_string(),
        _ => error.to_string(),
    }
}
