//! Listens to folders through the operating system.
//!
//! Folders are watched one by one, never with what is below: the graph says which matter. A watch belongs to a folder,
//! not to its name, so that each remembers which folder it was set on. One whose folder was moved or removed is
//! forgotten at the event of that, before its name can come back: the system, or `notify`, has dropped it by then.

use std::collections::{HashMap, HashSet};
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::mpsc::Sender;

use notify::event::{AccessKind, AccessMode, CreateKind, EventKind, ModifyKind};
use notify::{Config, ErrorKind, Event, RecommendedWatcher, RecursiveMode, Watcher};

use super::places::Places;
use crate::platform::{self, FolderIdentity};

/// What is heard.
#[derive(Debug)]
pub(crate) enum Heard {
    /// Something happened at these paths.
    Event(Event),
    /// Events were lost.
    Lost,
    /// Nothing; somebody wants to be heard.
    Nudge,
}

/// What an event says of the file at a path.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Step {
    /// It was written to; a close follows.
    Written,
    /// It was closed by who could write to it.
    Closed,
    /// Another file, or none, stands in its place: whole, if it is one.
    Replaced,
    /// Something changed.
    Changed,
}

/// Whether the system reports when a file is closed.
const CLOSES: bool = cfg!(any(target_os = "linux", target_os = "android"));

impl Step {
    /// What an event of some kind says of a path.
    pub(super) fn of(kind: &EventKind, path: &Path) -> Self {
        match kind {
            EventKind::Access(_) => Self::Closed,
            EventKind::Remove(_) | EventKind::Modify(ModifyKind::Name(_)) => Self::Replaced,
            EventKind::Modify(ModifyKind::Data(_)) if CLOSES => Self::Written,
            // One that has content was linked, or is told of once more when it was written.
            EventKind::Create(CreateKind::File) if CLOSES && is_empty_file(path) => Self::Written,
            EventKind::Create(_) if CLOSES => Self::Replaced,
            _ => Self::Changed,
        }
    }
}

fn is_empty_file(path: &Path) -> bool {
    fs::symlink_metadata(path).is_ok_and(|found| found.is_file() && found.len() == 0)
}

/// The watches.
pub(super) struct Listener {
    watcher: RecommendedWatcher,
    watched: HashMap<PathBuf, FolderIdentity>,
}

/// What came of listening to folders.
#[derive(Debug, Default)]
pub(super) struct Listened {
    /// Whether a watch was set that was not there.
    pub(super) is_more: bool,
    /// Why a folder that is needed cannot be listened to; the others are.
    pub(super) failed: Option<String>,
}

impl Listener {
    /// # Errors
    /// Where the system does not allow it; what is told says what to do.
    pub(super) fn new(heard: Sender<Heard>) -> Result<Self, String> {
        let tell = move |event: notify::Result<Event>| {
            let heard_of = match event {
                // Builds open many files; of what is done with open ones only the end of writing matters.
                Ok(event) if event.kind.is_access() && !is_close(&event.kind) => return,
                Ok(event) if event.need_rescan() => Heard::Lost,
                Ok(event) => Heard::Event(event),
                Err(_) => Heard::Lost,
            };
            // Nobody listens any more when the watcher ends.
            let _ = heard.send(heard_of);
        };
        match RecommendedWatcher::new(tell, Config::default()) {
            Ok(watcher) => Ok(Self { watcher, watched: HashMap::new() }),
            Err(error) => Err(unable(&error)),
        }
    }

    /// The number of folders that are listened to.
    pub(super) fn folders(&self) -> usize {
        self.watched.len()
    }

    /// Listens to the folders of these places and to no others.
    pub(super) fn listen(&mut self, places: &Places) -> Listened {
        // First what is no longer right: a folder has one watch, whatever its name.
        let wrong = self.watched.iter().filter(|(folder, identity)| {
            !places.folders.contains_key(*folder)
                || platform::folder_identity(folder).as_ref() != Some(identity)
        });
        let wrong = wrong.map(|(folder, _)| folder.clone()).collect::<HashSet<_>>();
        wrong.iter().for_each(|folder| self.drop_watch(folder));
        let mut listened = Listened::default();
        for (folder, interest) in &places.folders {
            if self.watched.contains_key(folder) {
                continue;
            }
            // One that has gone is told by the folder above.
            let Some(identity) = platform::folder_identity(folder) else { continue };
            match self.watcher.watch(folder, RecursiveMode::NonRecursive) {
                Ok(()) => {
                    self.watched.insert(folder.clone(), identity);
                    listened.is_more = true;
                }
                Err(error) if is_gone(&error) => {}
                Err(error) => {
                    if interest.is_needed || is_limit(&error) {
                        let why = || format!("cannot listen to {}: {}", folder.display(), unable(&error));
                        listened.failed.get_or_insert_with(why);
                    }
                }
            }
        }
        listened
    }

    /// Forgets the watches of folders that an event moved or removed.
    pub(super) fn forget_moved(&mut self, event: &Event) {
        if !matches!(event.kind, EventKind::Remove(_) | EventKind::Modify(ModifyKind::Name(_))) {
            return;
        }
        for path in &event.paths {
            // Most events are of files.
            if self.watched.contains_key(path) {
                self.forget_below(path);
            }
        }
    }

    /// Forgets all watches: events were lost, and with them what became of the folders.
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
        // It may have gone with its folder.
        let _ = self.watcher.unwatch(folder);
    }
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
            "the system's limit of watches is reached; raise it: sysctl fs.inotify.max_user_watches=524288"
                .into()
        }
        ErrorKind::Io(cause) if is_limit(error) => format!(
            "too many files or watchers are open ({cause}); raise the limit: sysctl fs.inotify.max_user_instances=1024"
        ),
        ErrorKind::Io(cause) => cause.to_string(),
        _ => error.to_string(),
    }
}
