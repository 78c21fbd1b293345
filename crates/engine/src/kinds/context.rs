//! What a running item has access to: its inputs, the files that it names, its key; and what it reports.

use std::collections::BTreeMap;
use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use parking_lot::Mutex;

use super::artifact::{Artifact, Handle};
use super::failure::Failure;
use super::gate::Gate;
use super::progress::ShareDone;
use crate::cancel::{Cancel, StaleFlag};
use crate::key::{Digest, ItemKey};
use crate::storage::{
    BrokenLink, Files, OpenFile, Read, ReadKind, leads_to, lies_in, listing_digest, normal,
};

/// What to do about a file that another program is writing.
pub(crate) const WHEN_WRITTEN: &str = "build again when it is written";

/// What to do to read a file that the same manifest exports.
pub(crate) const HOW_TO_READ_EXPORTS: &str =
    "connect the stage that makes the file instead, or move the file";

/// The inputs, files and folders that a running item has access to.
pub struct Context<'a> {
    pub(crate) inputs: BTreeMap<String, Vec<(ItemKey, Arc<Handle>)>>,
    pub(crate) source: Option<PathBuf>,
    pub(crate) folder: Option<PathBuf>,
    /// The folder for exports.
    pub(crate) out: Option<PathBuf>,
    pub(crate) key: Option<ItemKey>,
    pub(crate) recipe: String,
    pub(crate) scratch: PathBuf,
    /// Where the scratch folder goes if the item fails and somebody wants to see it.
    pub(crate) kept: Option<PathBuf>,
    pub(crate) files: &'a dyn Files,
    pub(crate) cancel: Cancel,
    /// Whether a change has made the item stale.
    pub(crate) stale: Option<StaleFlag>,
    /// Where the item pauses while wanted items run.
    pub(crate) gate: Option<Arc<Gate>>,
    pub(crate) share: Arc<ShareDone>,
    pub(crate) reads: Arc<Mutex<Vec<Read>>>,
    pub(crate) warnings: Mutex<Vec<String>>,
    pub(crate) notes: Mutex<Vec<String>>,
    /// Whether the item was stopped.
    pub(crate) stopped: AtomicBool,
}

impl<'a> Context<'a> {
    /// A context without inputs; the scheduler and tests of kinds add those of the item.
    pub fn new(files: &'a dyn Files) -> Self {
        Self {
            inputs: BTreeMap::new(),
            source: None,
            folder: None,
            out: None,
            kept: None,
            key: None,
            recipe: String::new(),
            scratch: std::env::temp_dir(),
            files,
            cancel: Cancel::default(),
            stale: None,
            gate: None,
            share: Arc::default(),
            reads: Arc::default(),
            warnings: Mutex::default(),
            notes: Mutex::default(),
            stopped: AtomicBool::new(false),
        }
    }

    /// Adds the items at a port, sorted by key.
    #[must_use]
    pub fn with_input(mut self, port: &str, items: Vec<(ItemKey, Arc<Handle>)>) -> Self {
        self.inputs.insert(port.into(), items);
        self
    }

    /// Sets the source file or folder of the item.
    #[must_use]
    pub fn with_source(mut self, source: PathBuf) -> Self {
        self.source = Some(source);
        self
    }

    /// Sets the folder for relative paths if the item has no source: the manifest's folder.
    #[must_use]
    pub fn with_folder(mut self, folder: PathBuf) -> Self {
        self.folder = Some(folder);
        self
    }

    /// Sets the folder for exports, which no item reads.
    #[must_use]
    pub fn with_out(mut self, out: PathBuf) -> Self {
        self.out = Some(out);
        self
    }

    /// Lets the item see its key, for a kind that shows names.
    #[must_use]
    pub fn with_key(mut self, key: ItemKey) -> Self {
        self.key = Some(key);
        self
    }

    /// Sets the recipe that exported files hold.
    #[must_use]
    pub fn with_recipe(mut self, recipe: String) -> Self {
        self.recipe = recipe;
        self
    }

    /// Sets the folder for the scratch folders of items. The default is the system's.
    #[must_use]
    pub fn with_scratch(mut self, scratch: PathBuf) -> Self {
        self.scratch = scratch;
        self
    }

    /// Lets the item be cancelled.
    #[must_use]
    pub fn with_cancel(mut self, cancel: Cancel) -> Self {
        self.cancel = cancel;
        self
    }

    /// The artifact at a single port.
    ///
    /// # Errors
    /// If it cannot be read, or the port is not connected.
    pub fn get<T: Artifact>(&self, port: &str) -> Result<Arc<T>, Failure> {
        self.optional(port)?.ok_or_else(|| Failure::new(format!("port {port} is not connected")))
    }

    /// The artifact at an optional port.
    ///
    /// # Errors
    /// If it cannot be read.
    pub fn optional<T: Artifact>(&self, port: &str) -> Result<Option<Arc<T>>, Failure> {
        match self.inputs.get(port).and_then(|items| items.first()) {
            Some((_, handle)) => handle.get::<T>().map(Some),
            None => Ok(None),
        }
    }

    /// The artifacts at a `many` port, sorted by key.
    ///
    /// Only a kind that shows names (`SHOWS_KEYS`) gets the keys; for other kinds they are empty.
    ///
    /// # Errors
    /// If one cannot be read.
    pub fn many<T: Artifact>(&self, port: &str) -> Result<Vec<(ItemKey, Arc<T>)>, Failure> {
        let items = self.inputs.get(port).map_or(&[][..], Vec::as_slice);
        items.iter().map(|(key, handle)| Ok((key.clone(), handle.get::<T>()?))).collect()
    }

    /// The encoded bytes of the artifact at a single port, for a kind that passes them to another program.
    ///
    /// # Errors
    /// If they cannot be read, or the port is not connected.
    pub fn bytes(&self, port: &str) -> Result<Vec<u8>, Failure> {
        match self.inputs.get(port).and_then(|items| items.first()) {
            Some((_, handle)) => handle.bytes(),
            None => Err(Failure::new(format!("port {port} is not connected"))),
        }
    }

    /// The type of the artifact at a port, for a port that takes several types.
    pub fn type_at(&self, port: &str) -> Option<&'static str> {
        self.inputs.get(port).and_then(|items| items.first()).map(|(_, handle)| handle.type_name())
    }

    /// The source file or folder of this item.
    ///
    /// # Errors
    /// If the stage has no source.
    pub fn source(&self) -> Result<&Path, Failure> {
        self.source.as_deref().ok_or_else(|| Failure::new("this stage has no source"))
    }

    /// The content of a file. A relative path is taken from the folder of the item's source, or, if it has
    /// none, from the manifest's.
    ///
    /// The engine records the file: the item reruns when its content changes. A file that another program
    /// writes meanwhile is read again until it no longer changes.
    ///
    /// # Errors
    /// If the file cannot be read, or is in the folder for exports; the message names it.
    pub fn read(&self, path: &Path) -> Result<Arc<Vec<u8>>, Failure> {
        let path = self.resolve(path);
        if let Err(failure) = self.check_not_exported(&path) {
            self.record(Read::of(path, ReadKind::Content, None));
            return Err(failure);
        }
        let bytes = self.files.read(&path);
        let digest = bytes.as_ref().ok().map(|bytes| Digest::of(bytes));
        self.record(Read::of(path.clone(), ReadKind::Content, digest));
        if bytes.as_ref().is_err_and(|error| error.kind() == std::io::ErrorKind::Interrupted) {
            self.stopped.store(true, Ordering::Relaxed);
            return Err(Failure::cancelled());
        }
        bytes.map_err(|error| unreadable(&path, error))
    }

    /// A file, for [`Kind::check_source`](crate::kinds::kind::Kind::check_source), which reads a part of it;
    /// relative paths as for [`Context::read`].
    ///
    /// The engine does not know what is read, so it takes an item for outdated whose run opened a file.
    ///
    /// # Errors
    /// If the file cannot be opened; the message names it.
    pub fn open(&self, path: &Path) -> Result<Box<dyn OpenFile>, Failure> {
        let path = self.resolve(path);
        let file = self.files.open(&path);
        self.record(Read::of(path.clone(), ReadKind::Content, None));
        file.map_err(|error| unreadable(&path, error))
    }

    /// The names in a folder, sorted, each with whether it is a folder; recorded as by [`Context::read`].
    ///
    /// # Errors
    /// If the folder cannot be read, or is in the folder for exports; the message names it.
    pub fn list(&self, path: &Path) -> Result<Vec<(String, bool)>, Failure> {
        let path = self.resolve(path);
        if let Err(failure) = self.check_not_exported(&path) {
            self.record(Read::of(path, ReadKind::Names, None));
            return Err(failure);
        }
        let names = self.files.list(&path);
        let digest = names.as_ref().ok().map(|names| listing_digest(names));
        self.record(Read::of(path.clone(), ReadKind::Names, digest));
        names.map_err(|error| Failure::from(error).context(format!("cannot read folder {}", path.display())))
    }

    /// Whether the path is a folder; relative paths as for [`Context::read`].
    ///
    /// The answer is recorded as a reading of the folder's names, or of a folder that does not exist.
    pub fn is_folder(&self, path: &Path) -> bool {
        let path = self.resolve(path);
        let is_folder = self.files.is_folder(&path);
        let names = if is_folder { self.files.list(&path).ok() } else { None };
        let digest = names.map(|names| listing_digest(&names));
        self.record(Read::of(path, ReadKind::Names, digest));
        is_folder
    }

    /// The file that PATH finds for a program's name.
    ///
    /// The look-up is recorded: the item reruns when PATH finds another file, or none. The content of the
    /// file is not: see [`Context::read`].
    ///
    /// # Errors
    /// If PATH finds no file of this name that can be run.
    pub fn find_program(&self, name: &OsStr) -> Result<PathBuf, Failure> {
        let found = self.files.find_program(name);
        let folder = self.folder.as_deref().unwrap_or(Path::new(""));
        self.record(Read::lookup(folder, name, found.clone()));
        found.ok_or_else(|| Failure::new(format!("there is no program {:?} in PATH", name.display())))
    }

    /// Checks that a path is not in the folder for exports, links followed: an item that reads a file there
    /// is not ordered after the stage that makes the file.
    ///
    /// # Errors
    /// If it is; the message names it.
    pub fn check_not_exported(&self, path: &Path) -> Result<(), Failure> {
        let path = self.resolve(path);
        if self.out.as_ref().is_none_or(|out| !lies_in(&path, out, leads_to)) {
            return Ok(());
        }
        let message = format!("{} is inside \"out\", the folder for exports", path.display());
        Err(Failure::new(message).help(HOW_TO_READ_EXPORTS))
    }

    /// Whether a path is the folder for exports, as it is spelled.
    pub fn is_out(&self, path: &Path) -> bool {
        self.out.as_ref().is_some_and(|out| normal(&self.resolve(path)) == normal(out))
    }

    /// Whether a folder contains the folder for exports or the manifest, links followed.
    pub fn contains_exports(&self, folder: &Path) -> bool {
        let folder = self.resolve(folder);
        [&self.out, &self.folder].into_iter().flatten().any(|inside| lies_in(inside, &folder, leads_to))
    }

    /// The item's key; only a kind that shows names (`SHOWS_KEYS`) sees it.
    pub fn key(&self) -> Option<&ItemKey> {
        self.key.as_ref()
    }

    /// The recipe for an exported file: canonical JSON of kind, revision, parameters and input digests.
    pub fn recipe(&self) -> &str {
        &self.recipe
    }

    /// An existing folder, in which a kind that runs another program creates a folder of its own and removes
    /// it again.
    ///
    /// Whatever a killed build leaves there is removed by the next build.
    pub fn scratch(&self) -> &Path {
        &self.scratch
    }

    /// Where the item's scratch folder goes if the item fails, for people who want to see it. An earlier one
    /// may be there. `None`: the folder is removed.
    pub fn kept_scratch(&self) -> Option<&Path> {
        self.kept.as_deref()
    }

    /// Warns the user about something that they should check.
    pub fn warn(&self, message: impl Into<String>) {
        self.warnings.lock().push(message.into());
    }

    /// Reports a fact about the result to the user: the degree that was chosen, and why.
    pub fn note(&self, message: impl Into<String>) {
        self.notes.lock().push(message.into());
    }

    /// Reports that this share of the item's work is done, 0 to 1; a lower one than before is ignored. A
    /// person sees it if the item takes long. It may be called from any thread, and often; see
    /// [`Steps`](crate::kinds::steps::Steps) for work that is done in steps.
    pub fn progress(&self, share: f64) {
        self.share.raise(share);
    }

    /// The share of the work that was reported as done.
    pub fn share_done(&self) -> f64 {
        self.share.get()
    }

    /// The warnings so far.
    pub fn warnings(&self) -> Vec<String> {
        self.warnings.lock().clone()
    }

    /// The notes so far.
    pub fn notes(&self) -> Vec<String> {
        self.notes.lock().clone()
    }

    /// The reads so far, in order.
    pub fn reads(&self) -> Vec<Read> {
        self.reads.lock().clone()
    }

    /// Returns early from work that is no longer needed, and pauses while an item runs that somebody looks
    /// at. To be called at least ten times a second.
    ///
    /// # Errors
    /// [`Failure::cancelled`] if the build is cancelled, or the item's files, parameters or inputs have
    /// changed.
    pub fn check_cancelled(&self) -> Result<(), Failure> {
        let is_stopped = || self.cancel.is_cancelled() || self.is_stale();
        if let Some(gate) = &self.gate {
            gate.pass(is_stopped);
        }
        if !is_stopped() {
            return Ok(());
        }
        self.stopped.store(true, Ordering::Relaxed);
        Err(Failure::cancelled())
    }

    /// Whether the item's files, parameters or inputs have changed.
    pub(crate) fn is_stale(&self) -> bool {
        self.stale.as_ref().is_some_and(StaleFlag::is_set)
    }

    /// The file that a path names: relative paths as for [`Context::read`].
    pub fn resolve(&self, path: &Path) -> PathBuf {
        match self.source.as_deref().and_then(Path::parent).or(self.folder.as_deref()) {
            Some(folder) if path.is_relative() => folder.join(path),
            _ => path.to_path_buf(),
        }
    }

    fn record(&self, read: Read) {
        let mut reads = self.reads.lock();
        if !reads.contains(&read) {
            reads.push(read);
        }
    }
}

/// The failure of a file that cannot be read.
fn unreadable(path: &Path, error: std::io::Error) -> Failure {
    let is_busy = error.kind() == std::io::ErrorKind::ResourceBusy;
    let failure = match BrokenLink::on_the_way_to(path) {
        Some(link) => Failure::new(link.to_string()),
        None => Failure::from(error),
    };
    let failure = failure.context(format!("cannot read {}", path.display()));
    if is_busy { failure.help(WHEN_WRITTEN) } else { failure }
}
