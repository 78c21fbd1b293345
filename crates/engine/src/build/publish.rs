//! Publishes files from the store to `out`.
//!
//! A file is written beside its place under a temporary name and renamed, so that it appears complete or not
//! at all. All files of an item are written before the first is renamed, and the last of them, the index, is
//! renamed last. The *ledger* ([`crate::build::ledger`]) records the digest and the stamp of each published
//! file. The line of a file is written before the rename, so that after a kill at any moment the next build
//! recognizes the file as its own. Only files of the ledger are ever removed or replaced. A file that someone
//! has changed is put back, with a warning, while its item exists, and left alone when its item does not
//! exist any more. If the ledger is lost, a file is also replaced if its recipe names the kind of its stage.
//!
//! A file that another manifest published is not touched while that manifest exports into its folder. If the
//! other manifest no longer exists, or its `out` has changed, the file is replaced if it is as it was
//! published. Files that nothing exports any more are reported, and [`crate::answers::prune`] removes them.
//!
//! The stamp of a file shows whether it is as it was published. It is taken from the written file before the
//! rename: any later change of the file changes its stamp. If the file system keeps time too coarsely for
//! that, the content is read again until the stamp is old enough.

use std::collections::{BTreeMap, HashMap, HashSet};
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use parking_lot::Mutex;
use serde::Deserialize;

use super::ledger::{Ledger, Published};
use crate::error::{Error, ErrorKind};
use crate::event::ItemName;
use crate::key::Digest;
use crate::kinds::is_left_out;
use crate::plan::Plan;
use crate::platform;
use crate::platform::{Stamp, canonicalize, folded, path_text};
use crate::storage::{Blob, Line, State, create_folders, hash, read_file, write_new};

mod removal;

pub(crate) use removal::sweep;

/// A step of publishing, to be reported as an event.
#[derive(Debug, PartialEq)]
pub(crate) enum PublishEvent {
    Published { file: String, bytes: u64, restored: bool },
    Removed { file: String },
    Warning(String),
    Note(String),
}

#[derive(Debug)]
pub(crate) enum PublishError {
    ResultLost,
    /// A file or folder is in the way, or cannot be written.
    Error(Error),
}

impl From<Error> for PublishError {
    fn from(error: Error) -> Self {
        Self::Error(error)
    }
}

pub(crate) struct Publisher<'a> {
    state: &'a State,
    plan: &'a Plan,
    root: &'a Path,
    ledger: Ledger<'a>,
    /// The files that the plan's items export, by their folded names: no two of them have the same one.
    folded: OnceLock<HashMap<String, &'a str>>,
    /// Files of the ledger that no item exports any more, by their former item.
    stale: BTreeMap<ItemName, Vec<String>>,
    removed: Mutex<HashSet<String>>,
    /// The folders of those files.
    emptied_folders: Mutex<HashSet<PathBuf>>,
    announced: AtomicBool,
    /// Whether temporary files may be left for the next build to remove: the folder that they are in may have
    /// been moved away, and come back.
    is_unfinished: AtomicBool,
    next: AtomicU64,
}

struct Action {
    file: String,
    blob: Blob,
    replaces: Option<Digest>,
    /// The stamp that the file had before it turned out to have the right content.
    found: Option<Stamp>,
    /// `None` if the content is in place and only has to be entered in the ledger.
    write: Option<Write>,
    /// The removals of lines of manifests that no longer export the file.
    abandoned: Vec<Line>,
}

struct Write {
    bytes: Vec<u8>,
    restored: bool,
    /// The event to report when the file is written.
    remark: Option<PublishEvent>,
    temporary: Option<Temporary>,
}

/// A file that is to be renamed.
struct Temporary {
    path: PathBuf,
    stamp: Stamp,
    /// Whether every later change of the file shows in its stamp, as in [`Published::settled`].
    settled: bool,
}

impl<'a> Publisher<'a> {
    pub(crate) fn new(plan: &'a Plan, state: &'a State) -> Self {
        let mut publisher = Self::without_stale(plan, state);
        publisher.ledger.prepare();
        let taken_over = publisher.ledger.take_over();
        // If this cannot be recorded, nothing can: the build ends with that error at its next line.
        let _ = state.journal.append(&taken_over);
        publisher.stale = publisher.ledger.unwanted();
        publisher
    }

    /// A publisher for a ledger of which it is known that items export every file.
    pub(crate) fn without_stale(plan: &'a Plan, state: &'a State) -> Self {
        Self {
            state,
            plan,
            root: &plan.out,
            ledger: Ledger::new(plan, &state.journal),
            folded: OnceLock::new(),
            stale: BTreeMap::new(),
            removed: Mutex::default(),
            emptied_folders: Mutex::default(),
            announced: AtomicBool::new(false),
            is_unfinished: AtomicBool::new(false),
            next: AtomicU64::new(0),
        }
    }

    pub(crate) fn entry(&self, file: &str) -> Option<Published> {
        self.ledger.entry(file)
    }

    /// Whether a file is as it was published; if its item leaves it out, whether none was published.
    pub(crate) fn is_intact(&self, file: &str, digest: Digest) -> bool {
        let line = self.ledger.stamp(file);
        if is_left_out(digest) {
            return line.is_none();
        }
        let line = line.filter(|line| line.digest == digest);
        let stamp = line.and_then(|line| line.stamp);
        let found = || fs::symlink_metadata(self.root.join(file)).ok().map(|found| Stamp::of(&found));
        stamp.is_some() && found() == stamp
    }

    /// Whether a file has this content, whatever its stamp is.
    pub(crate) fn is_in_place(&self, file: &str, digest: Digest) -> bool {
        let place = self.root.join(file);
        self.is_intact(file, digest)
            || !is_left_out(digest)
                && fs::symlink_metadata(&place).is_ok_and(|found| found.is_file())
                && hash(&place).is_ok_and(|found| found == digest)
    }

    /// Whether publishing a file would only restore what was published there.
    pub(crate) fn is_restored(&self, file: &str, digest: Digest) -> bool {
        self.ledger.stamp(file).is_some_and(|line| line.digest == digest)
    }

    /// Puts an item's files in place, and then removes those that it leaves out. `contents` are those of the
    /// files, if they are in memory.
    ///
    /// # Errors
    /// If a result is lost or something is in the way: both are found before the first rename, and the files
    /// are unchanged. If a rename fails, the files renamed before it are new and complete; the index is not
    /// replaced.
    pub(crate) fn publish(
        &self,
        item: &ItemName,
        files: &[(String, Blob)],
        contents: Option<Vec<Option<Vec<u8>>>>,
        events: &mut Vec<PublishEvent>,
    ) -> Result<(), PublishError> {
        let mut contents = contents.map(Vec::into_iter);
        let mut actions = Vec::new();
        let mut left_out = Vec::new();
        for (file, blob) in files {
            let fresh = contents.as_mut().and_then(Iterator::next).flatten();
            if is_left_out(blob.digest) {
                left_out.push(file.clone());
            } else {
                actions.extend(self.plan_file(item, files, file, *blob, fresh, events)?);
            }
        }
        if !actions.is_empty() {
            let result = self.carry_out(item, &mut actions, events);
            self.is_unfinished.fetch_or(result.is_err(), Ordering::AcqRel);
            for write in actions.iter().filter_map(|action| action.write.as_ref()) {
                if let Some(left) = &write.temporary {
                    let _ = fs::remove_file(&left.path);
                }
            }
            result?;
        }
        Ok(self.remove(&left_out, &mut |what| events.push(what))?)
    }

    /// The action that has to be done for one file; `None` if the file is in place.
    fn plan_file(
        &self,
        item: &ItemName,
        files: &[(String, Blob)],
        file: &str,
        blob: Blob,
        fresh: Option<Vec<u8>>,
        events: &mut Vec<PublishEvent>,
    ) -> Result<Option<Action>, PublishError> {
        if self.is_intact(file, blob.digest) {
            return Ok(None);
        }
        let place = self.prepare_place(file, events)?;
        let line = self.entry(file).or_else(|| self.other_spelling(file, &place));
        let line = line.as_ref();
        let abandoned = if line.is_none() { self.ledger.abandoned(file) } else { &[] };
        let removals = || abandoned.iter().map(Published::removal).collect::<Vec<_>>();
        let found = match fs::symlink_metadata(&place) {
            Ok(found) => Some(found),
            Err(error) if error.kind() == io::ErrorKind::NotFound => None,
            Err(error) => return Err(Error::io(&error, "look at", &place).into()),
        };
        let (mut replaces, mut remark) = (None, None);
        if let Some(found) = &found {
            if found.is_dir() {
                return Err(self.in_the_way(file, &place).into());
            }
            let content = match line.or(abandoned.last()) {
                Some(line) => line.content(found, &place),
                None => found.is_file().then(|| hash(&place)).transpose(),
            };
            let content = content.map_err(|error| Error::io(&error, "read", &place))?;
            if content == Some(blob.digest) {
                let (file, found, abandoned) = (file.into(), Some(Stamp::of(found)), removals());
                return Ok(Some(Action { file, blob, replaces: None, found, write: None, abandoned }));
            }
            match (content, line) {
                (Some(content), Some(line)) if line.published(content) => replaces = Some(content),
                // If the ledger's own file was never put in place, this is another one.
                (_, Some(line)) if line.owned().is_some() => {
                    replaces = line.owned();
                    remark = Some(PublishEvent::Warning(format!(
                        "{} had changed since it was published; the published file was restored",
                        path_text(place)
                    )));
                }
                (Some(content), None) if abandoned.iter().any(|line| line.published(content)) => {
                    replaces = Some(content);
                }
                (Some(content), None) if abandoned.is_empty() && self.is_export(item, files, file) => {
                    replaces = Some(content);
                    remark = Some(PublishEvent::Note(format!(
                        "{} was replaced: there is no record of it, but its recipe says that an earlier \
                         build published it",
                        path_text(place)
                    )));
                }
                _ => return Err(self.in_the_way(file, &place).into()),
            }
        }
        let restored = line.is_some_and(|line| line.digest == blob.digest && line.stamp.is_some());
        let bytes = match fresh {
            Some(bytes) => bytes,
            None => self.state.store.get(blob.digest)?.ok_or(PublishError::ResultLost)?,
        };
        let write = Some(Write { bytes, restored, remark, temporary: None });
        Ok(Some(Action { file: file.into(), blob, replaces, found: None, write, abandoned: removals() }))
    }

    /// Whether a file that is not in the ledger was exported by a stage of this kind, according to its recipe
    /// or that of another file of its item: if so, the ledger has been lost.
    fn is_export(&self, item: &ItemName, files: &[(String, Blob)], file: &str) -> bool {
        let stage = self.plan.stages.iter().find(|stage| stage.name == item.stage);
        let Some(stage) = stage.filter(|_| self.ledger.exported_by_another(file).is_none()) else {
            return false;
        };
        let others = files.iter().map(|(other, _)| other.as_str()).filter(|other| *other != file);
        std::iter::once(file).chain(others).any(|file| {
            let place = self.root.join(file);
            let is_file = fs::symlink_metadata(&place).is_ok_and(|found| found.is_file());
            let bytes = is_file.then(|| read_file(&place).ok()).flatten();
            let recipe = bytes.and_then(|bytes| (self.plan.recipe_reader)(&bytes));
            recipe.and_then(|recipe| kind_of_recipe(&recipe)).as_deref() == Some(stage.kind.name())
        })
    }

    fn carry_out(
        &self,
        item: &ItemName,
        actions: &mut [Action],
        events: &mut Vec<PublishEvent>,
    ) -> Result<(), PublishError> {
        if actions.iter().any(|action| action.write.is_some()) {
            self.announce()?;
        }
        for action in actions.iter_mut() {
            if let Some(write) = &mut action.write {
                let number = self.next.fetch_add(1, Ordering::Relaxed);
                let name = format!("{TEMPORARY}{}-{number}.tmp", std::process::id());
                let place = self.root.join(&action.file);
                let path = place.with_file_name(name);
                let written = write_new(&path, &write.bytes).and_then(|file| platform::mark_written(&file));
                let (stamp, settled) = written.map_err(|error| {
                    let _ = fs::remove_file(&path);
                    Error::io(&error, "write", &place)
                })?;
                write.temporary = Some(Temporary { path, stamp, settled });
            }
        }
        let intents = actions.iter().filter(|action| action.write.is_some());
        let intents =
            intents.map(|action| self.ledger.intent(item, &action.file, action.blob.digest, action.replaces));
        let intents = intents.collect::<Vec<_>>();
        self.state.journal.append(&intents)?;
        let mut lines = Vec::new();
        let mut result = Ok(());
        for action in actions.iter_mut() {
            let place = self.root.join(&action.file);
            let now = || fs::symlink_metadata(&place).ok().map(|found| Stamp::of(&found));
            let (stamp, settled) = match &mut action.write {
                Some(write) => {
                    let Some(temporary) = &write.temporary else { continue };
                    if let Err(error) = platform::replace(&temporary.path, &place) {
                        result = Err(Error::io(&error, "write", &place).into());
                        break;
                    }
                    // If someone has changed or replaced the file since the rename, the stamp is that of the
                    // written file: the next build sees the difference.
                    let renamed = now().filter(|now| now.is_renamed(&temporary.stamp));
                    let stamp = (renamed.unwrap_or(temporary.stamp), temporary.settled);
                    write.temporary = None;
                    events.extend(write.remark.take());
                    let (file, restored) = (action.file.clone(), write.restored);
                    events.push(PublishEvent::Published { file, bytes: action.blob.bytes, restored });
                    stamp
                }
                None => {
                    let Some(found) = action.found else { continue };
                    (found, found.is_settled(self.state.now) && now() == Some(found))
                }
            };
            lines.push(self.ledger.line(item, &action.file, action.blob.digest, stamp, settled));
            lines.append(&mut action.abandoned);
        }
        self.state.journal.append(&lines)?;
        result
    }

    /// Records once that temporary files may be left in `out` from now on.
    fn announce(&self) -> Result<(), Error> {
        if !self.announced.swap(true, Ordering::AcqRel) {
            self.state.journal.append(&[self.ledger.publishing(true)])?;
        }
        Ok(())
    }

    /// Creates the folders of a file, and removes files of the ledger that are in the way and no longer
    /// exported.
    fn prepare_place(&self, file: &str, events: &mut Vec<PublishEvent>) -> Result<PathBuf, Error> {
        create_folders(&self.plan.state, self.root)
            .map_err(|error| Error::io(&error, "create", self.root))?;
        let mut folder = self.root.to_path_buf();
        let mut parts = file.split('/').peekable();
        let mut so_far = String::new();
        while let Some(part) = parts.next() {
            folder.push(part);
            so_far += part;
            if parts.peek().is_none() {
                break;
            }
            self.make_folder(&folder, &so_far, events)?;
            so_far.push('/');
        }
        if fs::symlink_metadata(&folder).is_ok_and(|found| found.is_dir()) {
            let inside = format!("{file}/");
            let stale = self.stale.values().flatten().filter(|stale| stale.starts_with(&inside)).cloned();
            self.remove(&stale.collect::<Vec<_>>(), &mut |what| events.push(what))?;
            self.remove_leftovers(file, &mut |what| events.push(what))?;
            remove_empty_folders(&folder);
        }
        Ok(folder)
    }

    fn make_folder(&self, folder: &Path, name: &str, events: &mut Vec<PublishEvent>) -> Result<(), Error> {
        match fs::symlink_metadata(folder) {
            Ok(found) if found.is_dir() => return Ok(()),
            Ok(found) if found.is_symlink() && folder.is_dir() => {
                let inside = match (canonicalize(folder), canonicalize(self.root)) {
                    (Ok(target), Ok(root)) => target.starts_with(root),
                    _ => false,
                };
                if inside {
                    return Ok(());
                }
                let message =
                    format!("{} is a link that leads out of {}", path_text(folder), path_text(self.root));
                return Err(Error::new(ErrorKind::FileInTheWay, message)
                    .with_help("files are published inside out only: remove the link, or change path"));
            }
            Ok(_) if self.entry(name).is_some() && !self.ledger.is_wanted(name) => {
                self.remove(&[name.to_owned()], &mut |what| events.push(what))?;
            }
            Ok(_) => {
                self.remove_leftovers(name, &mut |what| events.push(what))?;
                if fs::symlink_metadata(folder).is_ok() {
                    return Err(self.in_the_way(name, folder));
                }
            }
            Err(_) => {}
        }
        match fs::create_dir(folder) {
            // Another item was faster.
            Err(error) if error.kind() == io::ErrorKind::AlreadyExists && folder.is_dir() => Ok(()),
            other => other.map_err(|error| Error::io(&error, "create", folder)),
        }
    }

    fn in_the_way(&self, file: &str, place: &Path) -> Error {
        let (why, help) = match (self.ledger.exported_by_another(file), self.ledger.abandoned(file).last()) {
            (Some(Published { manifest, .. }), _) => (
                format!("{manifest} published it"),
                format!(
                    "change the path of the stage, or the out of one of the two manifests; if {manifest} no \
                     longer exports the file, build {manifest} first, which removes it"
                ),
            ),
            (None, Some(Published { manifest, .. })) => (
                format!("it has changed since {manifest} published it"),
                "move it away or delete it; nothing was overwritten".into(),
            ),
            (None, None) => (
                "it was not published by this manifest".into(),
                "move it away or delete it, or change the path of the stage; nothing was overwritten".into(),
            ),
        };
        let message = format!("{} is in the way: {why}", path_text(place));
        Error::new(ErrorKind::FileInTheWay, message).with_help(help)
    }

    /// A file of the ledger whose name differs only in case or encoding, on a file system that ignores that:
    /// it is renamed to the new spelling.
    fn other_spelling(&self, file: &str, place: &Path) -> Option<Published> {
        if fs::symlink_metadata(place).is_err() {
            return None;
        }
        let name = folded(file);
        let mut stale = self.stale.values().flatten().filter(|stale| folded(stale) == name);
        let stale = stale.find(|stale| platform::is_one_file(&self.root.join(stale), place))?;
        let _ = platform::replace(&self.root.join(stale), place);
        self.entry(stale)
    }
}

/// The prefix of the names of temporary files.
const TEMPORARY: &str = ".specula-";

/// Whether a path is that of a temporary file, which is renamed into its place.
pub(crate) fn is_temporary(path: &Path) -> bool {
    path.file_name().is_some_and(|name| name.to_string_lossy().starts_with(TEMPORARY))
}

fn kind_of_recipe(recipe: &str) -> Option<String> {
    #[derive(Deserialize)]
    struct RecipeFields {
        kind: String,
        #[serde(rename = "revision")]
        _revision: u32,
        #[serde(rename = "parameters")]
        _parameters: serde_json::Map<String, serde_json::Value>,
        #[serde(rename = "inputs")]
        _inputs: serde_json::Map<String, serde_json::Value>,
    }
    serde_json::from_str::<RecipeFields>(recipe).ok().map(|recipe| recipe.kind)
}

fn remove_empty_folders(folder: &Path) {
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        if entry.file_type().is_ok_and(|kind| kind.is_dir()) {
            remove_empty_folders(&entry.path());
        }
    }
    let _ = fs::remove_dir(folder);
}
