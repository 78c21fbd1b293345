//! The places that a graph depends on: names in folders.
//!
//! A path is followed from folder to folder as the system follows it, through every link. Each step depends
//! on one name in one folder; the places are these pairs. So a link that is replaced anywhere on the way, a
//! folder that is moved away, and the first missing folder of a path are all places. Folders are canonical,
//! because the events of a folder that is watched under two names arrive under only one of them.

use std::collections::{BTreeSet, HashMap, HashSet};
use std::ffi::{OsStr, OsString};
use std::fs;
use std::path::{Component, Path, PathBuf};

use crate::plan::{FolderQueries, Plan, Source};
use crate::platform::{canonicalize, name_key};
use crate::storage::{MAX_LINKS, ReadKind, SearchPath, is_probe};

/// The names of a folder that matter.
#[derive(Debug, Default)]
pub(super) struct WatchedFolder {
    /// Single names by their keys, each with the paths, as the graph spells them, that lead through it.
    names: HashMap<OsString, Vec<PathBuf>>,
    /// The folder as it is spelled by the globs that search it.
    searched: Vec<PathBuf>,
    /// The folder as it is spelled by the stages that read all its names.
    listed: Vec<PathBuf>,
    /// Whether the graph reads a file or the names here; otherwise paths only lead through the folder.
    pub(super) is_needed: bool,
    /// Whether it is watched only for exported files that somebody removes.
    pub(super) is_output: bool,
}

/// At most this many folders of exported files are watched. Files that are removed from others are restored
/// by the next build.
const MAX_OUTPUT_FOLDERS: usize = 1024;

#[derive(Debug, Default)]
pub(super) struct WatchedPlaces {
    /// The watched folders by their canonical paths.
    pub(super) folders: HashMap<PathBuf, WatchedFolder>,
    /// Paths, as the graph spells them, that exist.
    existing: HashSet<PathBuf>,
    /// Files and folders that are read or looked for.
    pub(super) files: HashSet<PathBuf>,
    /// Folders that globs search.
    searches: BTreeSet<PathBuf>,
    /// Folders of which a stage reads all names.
    listings: BTreeSet<PathBuf>,
    lookups: HashSet<PathBuf>,
    sources: Vec<Source>,
    /// The paths that the engine itself writes to.
    own: Vec<PathBuf>,
    /// The folder for exports, as given and canonical.
    out: Option<(PathBuf, PathBuf)>,
    /// The manifest's folder, as given and canonical.
    base: (PathBuf, PathBuf),
    /// The canonical paths of folders; `None` if a folder does not exist.
    resolved: HashMap<PathBuf, Option<PathBuf>>,
}

impl WatchedPlaces {
    /// The places of a manifest, and no others yet. `own` are the folders that the engine writes to.
    pub(super) fn of(manifest: &Path, own: Vec<PathBuf>) -> Self {
        let base = manifest.parent().unwrap_or(manifest);
        let mut places = Self { own, ..Self::default() };
        // Each folder and link on the way to it is a place: another folder may be put there.
        let real = places.resolve_uncached(base).unwrap_or_else(|| base.into());
        places.base = (base.into(), real);
        places.add_file(manifest);
        places
    }

    /// Adds what an expansion of sources asked of the disk.
    pub(super) fn add_search(&mut self, queries: &FolderQueries, sources: impl Iterator<Item = Source>) {
        self.sources.extend(sources);
        queries.looked_for.iter().for_each(|path| self.add_file(path));
        for (folder, links) in &queries.listed {
            if let Some(real) = self.resolve(folder) {
                let watched = self.folders.entry(real).or_default();
                watched.is_needed = true;
                if !watched.searched.contains(folder) {
                    watched.searched.push(folder.clone());
                }
            }
            self.searches.insert(folder.clone());
            links.iter().for_each(|link| self.add_file(&folder.join(link)));
        }
    }

    pub(super) fn add_reads<'a>(&mut self, reads: impl IntoIterator<Item = &'a (PathBuf, ReadKind)>) {
        let search_path = SearchPath::current();
        for (path, kind) in reads {
            if *kind == ReadKind::Lookup {
                if self.lookups.insert(path.clone()) {
                    let tried = path.file_name().map(|name| search_path.tried(name));
                    tried.iter().flatten().for_each(|file| self.add_file(file));
                }
                continue;
            }
            self.add_file(path);
            if *kind == ReadKind::Names {
                if let Some(real) = self.resolve(path) {
                    let watched = self.folders.entry(real).or_default();
                    watched.is_needed = true;
                    if !watched.listed.contains(path) {
                        watched.listed.push(path.clone());
                    }
                }
                self.listings.insert(path.clone());
            }
        }
    }

    /// Adds the folders of exported files that exist, and that around `out`. Returns whether one is new.
    pub(super) fn add_outputs(&mut self, plan: &Plan) -> bool {
        let Ok(real) = canonicalize(&plan.out) else { return false };
        let below = plan.output_folders().iter().flat_map(|folder| Path::new(folder).ancestors());
        let folders = below.map(|folder| real.join(folder)).collect::<BTreeSet<_>>();
        let around = real.parent().map(Path::to_path_buf);
        let mut is_new = false;
        let folders = around.into_iter().chain([real.clone()]).chain(folders);
        for folder in folders.filter(|folder| folder.is_dir()).take(MAX_OUTPUT_FOLDERS) {
            is_new |= !self.folders.contains_key(&folder);
            self.folders
                .entry(folder)
                .or_insert_with(|| WatchedFolder { is_output: true, ..WatchedFolder::default() });
        }
        self.out = Some((plan.out.clone(), real));
        is_new
    }

    /// The exported file, or the folder of some, at the path of an event, as the graph spells it.
    pub(super) fn output_at(&self, path: &Path) -> Option<PathBuf> {
        let (out, real) = self.out.as_ref()?;
        let below = path.strip_prefix(real).ok()?;
        Some(if below.as_os_str().is_empty() { out.clone() } else { out.join(below) })
    }

    /// The folders of exported files that are watched.
    pub(super) fn output_folders(&self) -> impl Iterator<Item = PathBuf> {
        self.folders.keys().filter_map(|folder| self.output_at(folder))
    }

    /// Whether what was read is among the places.
    pub(super) fn have(&self, (path, kind): &(PathBuf, ReadKind)) -> bool {
        match kind {
            ReadKind::Content => self.files.contains(path),
            ReadKind::Names => self.listings.contains(path),
            ReadKind::Lookup => self.lookups.contains(path),
        }
    }

    /// Whether there is a place that others do not have.
    pub(super) fn exceed(&self, others: &Self) -> bool {
        self.folders.iter().any(|(folder, watched)| {
            others.folders.get(folder).is_none_or(|before| {
                watched.names.keys().any(|name| !before.names.contains_key(name))
                    || watched.searched.iter().any(|folder| !before.searched.contains(folder))
                    || watched.listed.iter().any(|folder| !before.listed.contains(folder))
            })
        })
    }

    /// The paths of the graph that an event at a path concerns, as the graph spells them.
    pub(super) fn concerned(&self, path: &Path) -> Vec<PathBuf> {
        let mut concerned = Vec::new();
        if let (Some(folder), Some(name)) = (path.parent(), path.file_name())
            && let Some(watched) = self.folders.get(folder)
        {
            concerned.extend(watched.names.get(&*name_key(name)).into_iter().flatten().cloned());
            for folder in &watched.searched {
                let path = folder.join(name);
                if self.is_searched_for(&path) {
                    concerned.push(path);
                }
            }
            if !self.own.iter().any(|own| own == path) && !is_probe(name) {
                concerned.extend(watched.listed.iter().cloned());
            }
        }
        if let Some(watched) = self.folders.get(path) {
            concerned.extend(watched.searched.iter().chain(&watched.listed).cloned());
        }
        concerned
    }

    /// The folders whose names are searched or listed, as the graph spells them.
    pub(super) fn named_folders(&self) -> impl Iterator<Item = &Path> {
        self.searches.union(&self.listings).map(PathBuf::as_path)
    }

    /// The names in such a folder that matter now.
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

    /// Whether a path existed when the places were recorded.
    pub(super) fn existed(&self, path: &Path) -> bool {
        self.existing.contains(path)
    }

    /// The folders of the sources and of the manifest: those that are probed.
    pub(super) fn roots(&self) -> BTreeSet<PathBuf> {
        let roots = self.sources.iter().flat_map(Source::folders);
        let roots = roots.filter_map(|root| canonicalize(root).ok());
        roots.chain([self.base.1.clone()]).filter(|root| self.folders.contains_key(root)).collect()
    }

    fn add_file(&mut self, path: &Path) {
        if !self.files.insert(path.into()) {
            return;
        }
        let real = self.resolve_uncached(path);
        let folder = path.parent().and_then(|folder| self.resolved.get(folder).cloned().flatten());
        for folder in folder.iter().map(PathBuf::as_path).chain(real.as_deref().and_then(Path::parent)) {
            if let Some(watched) = self.folders.get_mut(folder) {
                watched.is_needed = true;
            }
        }
    }

    /// The canonical path of a folder. Adds the names on the way to it.
    fn resolve(&mut self, folder: &Path) -> Option<PathBuf> {
        if folder == self.base.0 {
            return Some(self.base.1.clone());
        }
        if let Some(known) = self.resolved.get(folder) {
            return known.clone();
        }
        let real = self.resolve_uncached(folder);
        self.resolved.insert(folder.into(), real.clone());
        real
    }

    fn resolve_uncached(&mut self, path: &Path) -> Option<PathBuf> {
        match path.components().next_back()? {
            Component::Normal(name) => {
                let folder = self.resolve(path.parent()?)?;
                self.follow(&folder, name, path, 0)
            }
            Component::ParentDir => Some(self.resolve(path.parent()?)?.parent()?.into()),
            Component::CurDir => self.resolve(path.parent()?),
            Component::RootDir | Component::Prefix(_) => Some(path.into()),
        }
    }

    /// Where a name in a folder leads, links followed. `path` is the path that leads through it.
    fn follow(&mut self, folder: &Path, name: &OsStr, path: &Path, links: usize) -> Option<PathBuf> {
        self.add_name(folder, name, path);
        let at = folder.join(name);
        let found = fs::symlink_metadata(&at).ok()?;
        if !found.is_symlink() {
            self.existing.insert(path.into());
            return Some(at);
        }
        if links == MAX_LINKS {
            return None;
        }
        let target = fs::read_link(&at).ok()?;
        let mut here = folder.to_path_buf();
        for part in target.components() {
            match part {
                Component::Normal(name) => here = self.follow(&here, name, path, links + 1)?,
                Component::ParentDir => _ = here.pop(),
                Component::CurDir => {}
                Component::RootDir | Component::Prefix(_) => here.push(part),
            }
        }
        Some(here)
    }

    fn add_name(&mut self, folder: &Path, name: &OsStr, path: &Path) {
        let watched = self.folders.entry(folder.into()).or_default();
        let paths = watched.names.entry(name_key(name).into()).or_default();
        if !paths.iter().any(|known| known == path) {
            paths.push(path.into());
        }
    }
}
