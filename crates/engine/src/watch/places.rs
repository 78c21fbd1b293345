//! The places that a graph depends on: names in folders.
//!
//! A path is walked from folder to folder as the system walks it, through every link. Each step depends on one name
//! in one folder; the places are these pairs. So a link that is replaced anywhere on the way, a folder that is moved
//! away, and the first missing folder of a path that is not there are all places like any other. Folders are
//! canonical, because one that is watched under two names tells its events under one.

use std::collections::{BTreeSet, HashMap, HashSet};
use std::ffi::{OsStr, OsString};
use std::fs;
use std::path::{Component, Path, PathBuf};

use super::probe::is_probe;
use crate::Source;
use crate::plan::Asked;

/// As many links follow each other at most, as on Linux.
const MOST_LINKS: usize = 40;

/// What is wanted of a folder.
#[derive(Debug, Default)]
pub(super) struct Interest {
    /// Names that matter, each with the paths, as the graph spells them, whose walk steps on it.
    names: HashMap<OsString, Vec<PathBuf>>,
    /// The folder as the globs spell it that list it.
    searched: Vec<PathBuf>,
    /// The folder as stages spell it that read all its names.
    listed: Vec<PathBuf>,
    /// Whether a file or a listing of the graph lies here, rather than only the way to one.
    pub(super) is_needed: bool,
}

/// All places of a graph.
#[derive(Debug, Default)]
pub(super) struct Places {
    /// By canonical folder.
    pub(super) folders: HashMap<PathBuf, Interest>,
    /// Paths, as the graph spells them, that lead somewhere.
    known: HashSet<PathBuf>,
    /// Files and folders that are read or looked for.
    pub(super) files: HashSet<PathBuf>,
    /// Folders that globs search.
    searches: BTreeSet<PathBuf>,
    /// Folders all of whose names a stage reads.
    listings: BTreeSet<PathBuf>,
    sources: Vec<Source>,
    /// Where the engine itself writes.
    own: Vec<PathBuf>,
    /// The manifest's folder and what it is really.
    base: (PathBuf, PathBuf),
    /// Where folders lead that were walked to; `None`: nowhere.
    walked: HashMap<PathBuf, Option<PathBuf>>,
}

impl Places {
    /// The places of a manifest, and no others yet. `own` are the folders that the engine writes to.
    pub(super) fn of(manifest: &Path, own: Vec<PathBuf>) -> Self {
        let base = manifest.parent().unwrap_or(manifest);
        let real = fs::canonicalize(base).unwrap_or_else(|_| base.into());
        let mut places = Self { own, base: (base.into(), real.clone()), ..Self::default() };
        if let (Some(above), Some(name)) = (real.parent(), real.file_name()) {
            places.want(above, name, base);
        }
        places.file(manifest);
        places
    }

    /// Adds what an expansion of sources asked for.
    pub(super) fn add_search(&mut self, asked: &Asked, sources: impl Iterator<Item = Source>) {
        self.sources.extend(sources);
        asked.looked_for.iter().for_each(|path| self.file(path));
        for (folder, links) in &asked.listed {
            if let Some(real) = self.walk(folder) {
                let interest = self.folders.entry(real).or_default();
                interest.is_needed = true;
                if !interest.searched.contains(folder) {
                    interest.searched.push(folder.clone());
                }
            }
            self.searches.insert(folder.clone());
            links.iter().for_each(|link| self.file(&folder.join(link)));
        }
    }

    /// Adds what items read, and whether each is a listing.
    pub(super) fn add_reads<'a>(&mut self, reads: impl IntoIterator<Item = &'a (PathBuf, bool)>) {
        for (path, listing) in reads {
            self.file(path);
            if *listing {
                if let Some(real) = self.walk(path) {
                    let interest = self.folders.entry(real).or_default();
                    interest.is_needed = true;
                    if !interest.listed.contains(path) {
                        interest.listed.push(path.clone());
                    }
                }
                self.listings.insert(path.clone());
            }
        }
    }

    /// Whether a file, or listing, is among these.
    pub(super) fn have(&self, (path, listing): &(PathBuf, bool)) -> bool {
        if *listing { self.listings.contains(path) } else { self.files.contains(path) }
    }

    /// Whether there is a place here that is not in another.
    pub(super) fn exceed(&self, other: &Self) -> bool {
        self.folders.iter().any(|(folder, interest)| {
            other.folders.get(folder).is_none_or(|before| {
                interest.names.keys().any(|name| !before.names.contains_key(name))
                    || interest.searched.iter().any(|folder| !before.searched.contains(folder))
                    || interest.listed.iter().any(|folder| !before.listed.contains(folder))
            })
        })
    }

    /// The paths of the graph that an event at a path concerns, as the graph spells them.
    pub(super) fn concerned(&self, path: &Path) -> Vec<PathBuf> {
        let mut concerned = Vec::new();
        if let (Some(folder), Some(name)) = (path.parent(), path.file_name())
            && let Some(interest) = self.folders.get(folder)
        {
            concerned.extend(interest.names.get(name).into_iter().flatten().cloned());
            for folder in &interest.searched {
                let path = folder.join(name);
                if self.is_searched_for(&path) {
                    concerned.push(path);
                }
            }
            if !self.own.iter().any(|own| own == path) && !is_probe(name) {
                concerned.extend(interest.listed.iter().cloned());
            }
        }
        if let Some(interest) = self.folders.get(path) {
            concerned.extend(interest.searched.iter().chain(&interest.listed).cloned());
        }
        concerned
    }

    /// The folders whose names matter, as the graph spells them.
    pub(super) fn named_folders(&self) -> impl Iterator<Item = &Path> {
        self.searches.union(&self.listings).map(PathBuf::as_path)
    }

    /// The names in a folder that matter now.
    pub(super) fn names_in(&self, folder: &Path) -> BTreeSet<OsString> {
        let names = fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.file_name());
        let is_listed = self.listings.contains(folder);
        let names = names.filter(|name| {
            let path = folder.join(name);
            let is_foreign = !is_probe(name) && !self.own.contains(&path);
            (is_listed && is_foreign) || self.is_searched_for(&path)
        });
        names.collect()
    }

    /// Whether a glob matches a path, or searches the folder there.
    fn is_searched_for(&self, path: &Path) -> bool {
        let is_folder = || fs::metadata(path).is_ok_and(|found| found.is_dir());
        self.sources.iter().any(|source| source.concerns(path) || (source.searches(path) && is_folder()))
    }

    /// Whether a path led somewhere when the places were gathered.
    pub(super) fn knew(&self, path: &Path) -> bool {
        self.known.contains(path)
    }

    /// The folders that sources and the manifest lie in: those where events are proved to arrive.
    pub(super) fn roots(&self) -> BTreeSet<PathBuf> {
        let roots = self.sources.iter().filter_map(|source| {
            let root = if source.is_glob() { Some(source.root()) } else { source.root().parent() };
            fs::canonicalize(root?).ok()
        });
        roots.chain([self.base.1.clone()]).filter(|root| self.folders.contains_key(root)).collect()
    }

    fn file(&mut self, path: &Path) {
        if !self.files.insert(path.into()) {
            return;
        }
        let real = self.step_to(path);
        let folder = path.parent().and_then(|folder| self.walked.get(folder).cloned().flatten());
        for folder in folder.iter().map(PathBuf::as_path).chain(real.as_deref().and_then(Path::parent)) {
            if let Some(interest) = self.folders.get_mut(folder) {
                interest.is_needed = true;
            }
        }
    }

    /// Walks to a folder, once.
    fn walk(&mut self, folder: &Path) -> Option<PathBuf> {
        if folder == self.base.0 {
            return Some(self.base.1.clone());
        }
        if let Some(known) = self.walked.get(folder) {
            return known.clone();
        }
        let real = self.step_to(folder);
        self.walked.insert(folder.into(), real.clone());
        real
    }

    /// The last step to a path, after those to its folder.
    fn step_to(&mut self, path: &Path) -> Option<PathBuf> {
        match path.components().next_back()? {
            Component::Normal(name) => {
                let folder = self.walk(path.parent()?)?;
                self.step(&folder, name, path, 0)
            }
            Component::ParentDir => Some(self.walk(path.parent()?)?.parent()?.into()),
            Component::CurDir => self.walk(path.parent()?),
            Component::RootDir | Component::Prefix(_) => Some(path.into()),
        }
    }

    fn step(&mut self, folder: &Path, name: &OsStr, spelled: &Path, links: usize) -> Option<PathBuf> {
        self.want(folder, name, spelled);
        let at = folder.join(name);
        let found = fs::symlink_metadata(&at).ok()?;
        if !found.is_symlink() {
            self.known.insert(spelled.into());
            return Some(at);
        }
        if links == MOST_LINKS {
            return None;
        }
        let target = fs::read_link(&at).ok()?;
        let mut here = folder.to_path_buf();
        for part in target.components() {
            match part {
                Component::Normal(name) => here = self.step(&here, name, spelled, links + 1)?,
                Component::ParentDir => _ = here.pop(),
                Component::CurDir => {}
                Component::RootDir | Component::Prefix(_) => here.push(part),
            }
        }
        Some(here)
    }

    fn want(&mut self, folder: &Path, name: &OsStr, spelled: &Path) {
        let interest = self.folders.entry(folder.into()).or_default();
        let paths = interest.names.entry(name.into()).or_default();
        if !paths.iter().any(|path| path == spelled) {
            paths.push(spelled.into());
        }
    }
}
