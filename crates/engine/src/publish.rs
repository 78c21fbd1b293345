//! `out` as a published view of the store.
//!
//! A file is written beside its place under a temporary name and renamed, so that it is whole or not at all; the
//! files of an item are all written before the first is renamed, and the last of them, the index, is renamed last.
//! The *ledger* says what was published: the digest and the stamp of each file. It is told before a rename what is
//! about to appear, so that a process killed at any moment leaves no file that the next build takes for a
//! stranger's. Only files of the ledger are ever removed or replaced. A file that a person has changed is put back,
//! with a warning, while its item exists, and left alone when its item has gone.

use std::collections::{BTreeMap, BTreeSet, HashMap, HashSet};
use std::fs::{self, Metadata};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::disk::hash;
use crate::journal::{Line, Tag, subject};
use crate::judge::{item_name, manifest_name};
use crate::platform::{self, Stamp};
use crate::record::path_name;
use crate::state::State;
use crate::store::Blob;
use crate::{Digest, Error, ErrorKind, ItemName, Plan};

/// A line of the ledger.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Published {
    pub(crate) manifest: String,
    /// The folder that files were published into, as records hold paths: a manifest whose `out` is changed begins a
    /// new view and leaves the old one alone.
    out: String,
    pub(crate) file: String,
    item: ItemName,
    pub(crate) digest: Digest,
    /// `None` while it is being renamed into place.
    stamp: Option<Stamp>,
    /// What the manifest had published there before, while it is being replaced.
    replaces: Option<Digest>,
}

impl Published {
    /// What the manifest has put there, whatever a person made of it; `None` where it never came to that.
    pub(crate) fn owned(&self) -> Option<Digest> {
        if self.stamp.is_some() { Some(self.digest) } else { self.replaces }
    }
}

/// Something that publishing did.
#[derive(Debug, PartialEq)]
pub(crate) enum Told {
    Published { file: String, bytes: u64, restored: bool },
    Removed { file: String },
    Warning(String),
}

/// Why files could not be published.
#[derive(Debug)]
pub(crate) enum Obstacle {
    /// A result is no longer in the store.
    Lost,
    /// Something stands in the way.
    Error(Error),
}

impl From<Error> for Obstacle {
    fn from(error: Error) -> Self {
        Self::Error(error)
    }
}

/// Publishes the files of one plan.
pub(crate) struct Publisher<'a> {
    state: &'a State,
    root: &'a Path,
    manifest: String,
    out: String,
    ledger: HashMap<String, Arc<Published>>,
    /// The files that were there as they were published when the build began.
    intact: HashSet<&'a str>,
    /// The files that the plan's items export.
    wanted: HashSet<&'a str>,
    /// The same by their names in lower case: no two are one file where case does not count.
    folded: OnceLock<HashMap<String, &'a str>>,
    /// Files of the ledger that nobody wants any more, by item.
    stale: BTreeMap<ItemName, Vec<String>>,
    /// What this build has removed.
    removed: Mutex<BTreeSet<String>>,
    /// The folders that it was removed from.
    thinned: Mutex<BTreeSet<PathBuf>>,
    announced: AtomicBool,
    next: AtomicU64,
}

/// What is to be done for a file.
struct Action {
    file: String,
    blob: Blob,
    replaces: Option<Digest>,
    /// `None`: the content is there already and only has to be entered in the ledger.
    write: Option<Write>,
}

struct Write {
    bytes: Vec<u8>,
    restored: bool,
    /// What is to be said when it is done.
    warning: Option<String>,
    temporary: Option<PathBuf>,
}

impl<'a> Publisher<'a> {
    pub(crate) fn new(plan: &'a Plan, state: &'a State) -> Self {
        let folder = plan.manifest.parent().unwrap_or(Path::new("."));
        let (manifest, out) = (manifest_name(plan), path_name(folder, &plan.out));
        let mut ledger = HashMap::new();
        for line in state.journal.all::<Published>(Tag::Published) {
            if line.manifest == manifest && line.out == out {
                ledger.insert(line.file.clone(), line);
            }
        }
        let wanted =
            plan.items.iter().flat_map(|item| item.files.iter().map(String::as_str)).collect::<HashSet<_>>();
        // All at once, as items are judged one after the other.
        let is_intact = |file: &&str| ledger.get(*file).is_some_and(|line| is_as_told(&plan.out, line));
        let intact = wanted.par_iter().copied().filter(is_intact).collect();
        let mut stale = BTreeMap::<_, Vec<_>>::new();
        for (file, line) in ledger.iter().filter(|(file, _)| !wanted.contains(file.as_str())) {
            stale.entry(line.item.clone()).or_default().push(file.clone());
        }
        stale.values_mut().for_each(|files| files.sort_unstable());
        Self {
            state,
            root: &plan.out,
            manifest,
            out,
            ledger,
            intact,
            wanted,
            folded: OnceLock::new(),
            stale,
            removed: Mutex::default(),
            thinned: Mutex::default(),
            announced: AtomicBool::new(false),
            next: AtomicU64::new(0),
        }
    }

    /// What was published under a name.
    pub(crate) fn entry(&self, file: &str) -> Option<&Published> {
        self.ledger.get(file).map(Arc::as_ref)
    }

    /// Whether a file is there as it was published.
    pub(crate) fn is_intact(&self, file: &str, digest: Digest) -> bool {
        self.entry(file).is_some_and(|line| line.digest == digest && is_as_told(self.root, line))
    }

    /// Whether it was when the build began.
    pub(crate) fn was_intact(&self, file: &str, digest: Digest) -> bool {
        self.intact.contains(file) && self.is_restored(file, digest)
    }

    /// Whether a file is there with this content, whatever its stamp says.
    pub(crate) fn is_in_place(&self, file: &str, digest: Digest) -> bool {
        let place = self.root.join(file);
        self.is_intact(file, digest)
            || fs::symlink_metadata(&place).is_ok_and(|found| found.is_file())
                && hash(&place).is_ok_and(|found| found == digest)
    }

    /// Whether publishing a file would only bring back what was published there.
    pub(crate) fn is_restored(&self, file: &str, digest: Digest) -> bool {
        self.ledger.get(file).is_some_and(|line| line.digest == digest)
    }

    /// Puts an item's files in place. `bytes` are their contents where they are at hand.
    ///
    /// # Errors
    /// Where a result is lost or something is in the way: that is found before the first rename, and the files are
    /// as they were. Where a rename itself fails, those renamed before it are new, each whole; the index is not.
    pub(crate) fn publish(
        &self,
        item: &ItemName,
        files: &[(String, Blob)],
        bytes: Option<Vec<Vec<u8>>>,
        told: &mut Vec<Told>,
    ) -> Result<(), Obstacle> {
        let mut bytes = bytes.map(Vec::into_iter);
        let mut actions = Vec::new();
        for (file, blob) in files {
            let fresh = bytes.as_mut().and_then(Iterator::next);
            actions.extend(self.plan_file(file, *blob, fresh, told)?);
        }
        if actions.is_empty() {
            return Ok(());
        }
        let result = self.carry_out(item, &mut actions, told);
        for write in actions.iter().filter_map(|action| action.write.as_ref()) {
            if let Some(left) = &write.temporary {
                let _ = fs::remove_file(left);
            }
        }
        result
    }

    /// Removes the files of items that have gone from selected stages (`all`: also from stages that have gone).
    ///
    /// # Errors
    /// Where a file cannot be removed.
    pub(crate) fn remove_gone(
        &self,
        plan: &Plan,
        selected: &[bool],
        all: bool,
        told: &mut Vec<(ItemName, Told)>,
    ) -> Result<(), Error> {
        let items = (0..plan.items.len()).map(|item| item_name(plan, item)).collect::<HashSet<_>>();
        for (item, files) in self.stale.iter().filter(|(item, _)| !items.contains(*item)) {
            let stage = plan.stages.iter().position(|stage| stage.name == item.stage);
            if stage.map_or(all, |stage| selected[stage]) {
                self.remove(files, &mut |what| told.push((item.clone(), what)))?;
            }
        }
        Ok(())
    }

    /// Removes the files that an item does not export any more, now that its others are in place.
    ///
    /// # Errors
    /// Where a file cannot be removed.
    pub(crate) fn remove_stale(&self, item: &ItemName, told: &mut Vec<Told>) -> Result<(), Error> {
        match self.stale.get(item) {
            Some(files) => self.remove(files, &mut |what| told.push(what)),
            None => Ok(()),
        }
    }

    /// Whether an item does not export any more what it exported.
    pub(crate) fn has_stale(&self, item: &ItemName) -> bool {
        self.stale.contains_key(item)
    }

    /// The files that [`Publisher::remove_gone`] and [`Publisher::remove_stale`] would remove.
    ///
    /// # Errors
    /// Where a file cannot be read.
    pub(crate) fn would_remove(
        &self,
        plan: &Plan,
        selected: &[bool],
        all: bool,
    ) -> Result<Vec<String>, Error> {
        let stages =
            plan.stages.iter().zip(selected).map(|(stage, selected)| (stage.name.as_str(), *selected));
        let stages = stages.collect::<HashMap<_, _>>();
        let stale = self.stale.iter().filter(|(item, _)| *stages.get(item.stage.as_str()).unwrap_or(&all));
        let left = stale.flat_map(|(_, files)| files).filter_map(|file| self.left_over(file).transpose());
        let removed = left.filter_map(|left| match left {
            Ok(Told::Removed { file }) => Some(Ok(file)),
            Ok(_) => None,
            Err(error) => Some(Err(error)),
        });
        removed.collect()
    }

    /// Removes the folders that are empty now, and says that nothing is being published any more.
    ///
    /// Not before the end of a build: another item may be about to write into such a folder.
    ///
    /// # Errors
    /// Where the journal cannot be written.
    pub(crate) fn finish(&self) -> Result<(), Error> {
        for folder in lock(&self.thinned).iter() {
            for folder in folder.ancestors().take_while(|folder| *folder != self.root) {
                // Fails where the folder is not empty.
                if fs::remove_dir(folder).is_err() {
                    break;
                }
            }
        }
        if self.announced.load(Ordering::Acquire) {
            self.state.journal.append(&[publishing_line::<()>(&self.out, None)])?;
        }
        Ok(())
    }

    /// What has to be done for one file; `None` where it is in place.
    fn plan_file(
        &self,
        file: &str,
        blob: Blob,
        fresh: Option<Vec<u8>>,
        told: &mut Vec<Told>,
    ) -> Result<Option<Action>, Obstacle> {
        if self.is_intact(file, blob.digest) {
            return Ok(None);
        }
        let place = self.clear_way(file, told)?;
        let line = self.entry(file).or_else(|| self.other_spelling(file, &place));
        let found = match fs::symlink_metadata(&place) {
            Ok(found) => Some(found),
            Err(error) if error.kind() == io::ErrorKind::NotFound => None,
            Err(error) => return Err(Error::io(&error, "look at", &place).into()),
        };
        let (mut replaces, mut warning) = (None, None);
        if let Some(found) = &found {
            if found.is_dir() {
                return Err(in_the_way(&place).into());
            }
            let content = self.content(found, line, &place)?;
            if content == Some(blob.digest) {
                return Ok(Some(Action { file: file.into(), blob, replaces: None, write: None }));
            }
            match (content, line) {
                (Some(content), Some(line)) if content == line.digest || Some(content) == line.replaces => {
                    replaces = Some(content);
                }
                // Where the ledger's own file was never put in place, this one is not it.
                (_, Some(line)) if line.owned().is_some() => {
                    replaces = line.owned();
                    warning = Some(format!(
                        "{} had been changed since it was published; the published file was put back",
                        place.display()
                    ));
                }
                _ => return Err(in_the_way(&place).into()),
            }
        }
        let restored = line.is_some_and(|line| line.digest == blob.digest && line.stamp.is_some());
        let bytes = match fresh {
            Some(bytes) => bytes,
            None => self.state.store.get(blob.digest)?.ok_or(Obstacle::Lost)?,
        };
        let write = Some(Write { bytes, restored, warning, temporary: None });
        Ok(Some(Action { file: file.into(), blob, replaces, write }))
    }

    /// The digest of a file that is in place; a link or folder has none.
    fn content(
        &self,
        found: &Metadata,
        line: Option<&Published>,
        place: &Path,
    ) -> Result<Option<Digest>, Error> {
        if !found.is_file() {
            return Ok(None);
        }
        let stamp = Stamp::of(found);
        match line.filter(|line| line.stamp == Some(stamp)) {
            Some(line) => Ok(Some(line.digest)),
            None => hash(place).map(Some).map_err(|error| Error::io(&error, "read", place)),
        }
    }

    fn carry_out(
        &self,
        item: &ItemName,
        actions: &mut [Action],
        told: &mut Vec<Told>,
    ) -> Result<(), Obstacle> {
        if actions.iter().any(|action| action.write.is_some()) {
            self.announce()?;
        }
        for action in actions.iter_mut() {
            if let Some(write) = &mut action.write {
                let number = self.next.fetch_add(1, Ordering::Relaxed);
                let name = format!("{TEMPORARY}{}-{number}.tmp", std::process::id());
                let place = self.root.join(&action.file);
                let temporary = write.temporary.insert(place.with_file_name(name));
                fs::write(temporary, &write.bytes).map_err(|error| Error::io(&error, "write", &place))?;
            }
        }
        let intents = actions.iter().filter(|action| action.write.is_some());
        let intents = intents.map(|action| self.line(item, action, None)).collect::<Vec<_>>();
        self.state.journal.append(&intents)?;
        let mut lines = Vec::new();
        let mut result = Ok(());
        for action in actions.iter_mut() {
            let place = self.root.join(&action.file);
            if let Some(write) = &mut action.write {
                if let Some(temporary) = &write.temporary
                    && let Err(error) = platform::replace(temporary, &place)
                {
                    result = Err(Error::io(&error, "write", &place).into());
                    break;
                }
                write.temporary = None;
                told.extend(write.warning.take().map(Told::Warning));
                let (file, restored) = (action.file.clone(), write.restored);
                told.push(Told::Published { file, bytes: action.blob.bytes, restored });
            }
            let stamp = fs::symlink_metadata(&place).ok().map(|found| Stamp::of(&found));
            lines.push(self.line(item, action, stamp));
        }
        self.state.journal.append(&lines)?;
        result
    }

    fn line(&self, item: &ItemName, action: &Action, stamp: Option<Stamp>) -> Line {
        let content = Published {
            manifest: self.manifest.clone(),
            out: self.out.clone(),
            file: action.file.clone(),
            item: item.clone(),
            digest: action.blob.digest,
            stamp,
            replaces: if stamp.is_some() { None } else { action.replaces },
        };
        Line::new(Tag::Published, self.subject(&action.file), Some(&content))
    }

    fn subject(&self, file: &str) -> u128 {
        subject(&[&self.manifest, &self.out, file])
    }

    /// Tells the journal once that temporary files may be left in `out` from now on.
    fn announce(&self) -> Result<(), Error> {
        if !self.announced.swap(true, Ordering::AcqRel) {
            self.state.journal.append(&[publishing_line(&self.out, Some(&self.out))])?;
        }
        Ok(())
    }

    /// Makes the folders of a file, and removes files of the ledger that nobody wants from its way.
    fn clear_way(&self, file: &str, told: &mut Vec<Told>) -> Result<PathBuf, Error> {
        fs::create_dir_all(self.root).map_err(|error| Error::io(&error, "create", self.root))?;
        let mut folder = self.root.to_path_buf();
        let mut parts = file.split('/').peekable();
        let mut so_far = String::new();
        while let Some(part) = parts.next() {
            folder.push(part);
            so_far += part;
            if parts.peek().is_none() {
                break;
            }
            self.make_folder(&folder, &so_far, told)?;
            so_far.push('/');
        }
        if fs::symlink_metadata(&folder).is_ok_and(|found| found.is_dir()) {
            let inside = format!("{file}/");
            let stale = self.stale.values().flatten().filter(|stale| stale.starts_with(&inside)).cloned();
            self.remove(&stale.collect::<Vec<_>>(), &mut |what| told.push(what))?;
            remove_empty_folders(&folder);
        }
        Ok(folder)
    }

    fn make_folder(&self, folder: &Path, name: &str, told: &mut Vec<Told>) -> Result<(), Error> {
        match fs::symlink_metadata(folder) {
            Ok(found) if found.is_dir() => return Ok(()),
            Ok(found) if found.is_symlink() && folder.is_dir() => {
                let inside = match (fs::canonicalize(folder), fs::canonicalize(self.root)) {
                    (Ok(target), Ok(root)) => target.starts_with(root),
                    _ => false,
                };
                if inside {
                    return Ok(());
                }
                let message =
                    format!("{} is a link that leads out of {}", folder.display(), self.root.display());
                return Err(Error::new(ErrorKind::FileInTheWay, message)
                    .with_help("files are published inside out only: remove the link, or change path"));
            }
            Ok(_) if self.ledger.contains_key(name) && !self.wanted.contains(name) => {
                self.remove(&[name.to_owned()], &mut |what| told.push(what))?;
            }
            Ok(_) => return Err(in_the_way(folder)),
            Err(_) => {}
        }
        match fs::create_dir(folder) {
            // Another item was faster.
            Err(error) if error.kind() == io::ErrorKind::AlreadyExists && folder.is_dir() => Ok(()),
            other => other.map_err(|error| Error::io(&error, "create", folder)),
        }
    }

    /// A file of the ledger whose name differs in case only, on a file system that takes the two for one: it gets its
    /// new spelling.
    fn other_spelling(&self, file: &str, place: &Path) -> Option<&Published> {
        if fs::symlink_metadata(place).is_err() {
            return None;
        }
        let folded = file.to_lowercase();
        let mut stale = self.stale.values().flatten().filter(|stale| stale.to_lowercase() == folded);
        let stale = stale.find(|stale| platform::is_one_file(&self.root.join(stale), place))?;
        let _ = platform::replace(&self.root.join(stale), place);
        self.entry(stale)
    }

    /// Removes files of the ledger, and the folders that they leave empty.
    fn remove(&self, files: &[String], told: &mut dyn FnMut(Told)) -> Result<(), Error> {
        // Whoever finds a file removed may put something in its place, so that it must have gone by then.
        let mut removed = lock(&self.removed);
        for file in files {
            if !removed.insert(file.clone()) {
                continue;
            }
            if !self.ledger.contains_key(file) {
                continue;
            }
            if let Some(left) = self.left_over(file)? {
                if let Told::Removed { .. } = left {
                    let place = self.root.join(file);
                    platform::remove(&place).map_err(|error| Error::io(&error, "remove", &place))?;
                    lock(&self.thinned).extend(place.parent().map(Path::to_path_buf));
                }
                told(left);
            }
            self.state.journal.append(&[Line::new::<()>(Tag::Published, self.subject(file), None)])?;
        }
        Ok(())
    }

    /// What becomes of a file that nobody wants: it is removed, or left to the person who changed it. `None` where it is
    /// not there any more.
    fn left_over(&self, file: &str) -> Result<Option<Told>, Error> {
        let place = self.root.join(file);
        let found = fs::symlink_metadata(&place).ok().filter(|_| self.is_inside(&place));
        let (Some(line), Some(found)) = (self.ledger.get(file), found) else { return Ok(None) };
        if self.is_wanted_in_other_spelling(file, &place) {
            return Ok(None);
        }
        let content = self.content(&found, Some(line), &place)?;
        if content == Some(line.digest) || (content.is_some() && content == line.replaces) {
            return Ok(Some(Told::Removed { file: file.into() }));
        }
        Ok(Some(Told::Warning(format!(
            "{} has been changed since it was published; nothing exports it now, and it was left there",
            place.display()
        ))))
    }

    fn is_wanted_in_other_spelling(&self, file: &str, place: &Path) -> bool {
        let folded = || self.wanted.iter().map(|wanted| (wanted.to_lowercase(), *wanted)).collect();
        let wanted = self.folded.get_or_init(folded).get(&file.to_lowercase());
        wanted.is_some_and(|wanted| platform::is_one_file(&self.root.join(wanted), place))
    }

    /// Whether no link leads from `out` to the file's folder.
    fn is_inside(&self, place: &Path) -> bool {
        let folders = place.ancestors().skip(1).take_while(|folder| *folder != self.root);
        folders.into_iter().all(|folder| fs::symlink_metadata(folder).is_ok_and(|found| found.is_dir()))
    }
}

const TEMPORARY: &str = ".specula-";

/// Removes temporary files that a killed build left in the folders that it was publishing into. Their names are
/// relative to `folder`, the manifest's: a project may be moved or copied before it is built again.
///
/// # Errors
/// Where the journal cannot be written.
pub(crate) fn sweep(state: &State, folder: &Path) -> Result<(), Error> {
    for (place, out) in state.journal.subjects::<String>(Tag::Publishing) {
        sweep_folder(&folder.join(out));
        state.journal.append(&[Line::new::<()>(Tag::Publishing, place, None)])?;
    }
    Ok(())
}

/// Whether a file is there with the stamp that the ledger says.
fn is_as_told(root: &Path, line: &Published) -> bool {
    let found = || fs::symlink_metadata(root.join(&line.file)).ok();
    line.stamp.is_some() && found().is_some_and(|found| Some(Stamp::of(&found)) == line.stamp)
}

fn sweep_folder(folder: &Path) {
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let Ok(kind) = entry.file_type() else { continue };
        let name = entry.file_name();
        let name = name.to_string_lossy();
        if kind.is_dir() {
            sweep_folder(&entry.path());
        } else if kind.is_file() && name.starts_with(TEMPORARY) && name.ends_with(".tmp") {
            let _ = fs::remove_file(entry.path());
        }
    }
}

/// Removes a folder and those in it as far as they are empty.
fn remove_empty_folders(folder: &Path) {
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        if entry.file_type().is_ok_and(|kind| kind.is_dir()) {
            remove_empty_folders(&entry.path());
        }
    }
    let _ = fs::remove_dir(folder);
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

fn publishing_line<T: Serialize>(out: &str, content: Option<&T>) -> Line {
    Line::new(Tag::Publishing, subject(&[out]), content)
}

fn in_the_way(place: &Path) -> Error {
    let message = format!("{} is in the way: it was not published by this manifest", place.display());
    Error::new(ErrorKind::FileInTheWay, message)
        .with_help("move it away or delete it, or change the stage's path; nothing has been overwritten")
}
