//! The running build, for those who stop it or make a part of it stale.
//!
//! A build records here what each item has read. If a file changes meanwhile, contents decide: an item is
//! stale if a file that it read no longer has the same content, and so are all items that depend on it. A
//! stale item stops at its next [`Reporter::check_cancelled`](crate::kinds::Reporter::check_cancelled), other
//! running items finish, and no further item starts, so that the next build can start soon; if a stale item
//! is wanted (`wanted.rs`), the others stop, too. A file that no item has read yet makes nothing stale: the
//! item that reads it gets its new content.

use std::collections::{HashMap, HashSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use parking_lot::Mutex;

use crate::cancel::StaleFlag;
use crate::plan::{ItemIndex, Plan, Selection, Stage, Wanted};
use crate::storage::{Disk, Read, ReadKind, SearchPath, digest_now, normal};

/// The files that an item's result depends on.
pub(crate) enum Dependencies {
    None,
    /// The files that an earlier run read and that have not changed since.
    Recorded(Box<[Read]>),
    /// The files that the item's run in this build has read so far.
    Running(Arc<Mutex<Vec<Read>>>),
}

impl Dependencies {
    /// The files that an earlier run read.
    pub(crate) fn recorded(reads: Box<[Read]>) -> Self {
        if reads.is_empty() { Self::None } else { Self::Recorded(reads) }
    }
}

/// An item, or items, whose dependencies the running build knows, so that a change of these files from now on
/// makes the items stale. Whoever reads the files to check the items takes this, because the build would miss
/// a change between a read and the time from which it knows of the file.
pub(crate) struct Dependent<T>(T);

impl<T> Dependent<T> {
    /// Items that are checked while no build runs, which nobody tells of changes.
    pub(crate) fn without_build(items: T) -> Self {
        Self(items)
    }

    pub(crate) fn items(&self) -> &T {
        &self.0
    }

    pub(crate) fn into_items(self) -> T {
        self.0
    }
}

/// Changed files whose old digests the build has forgotten: items that are checked from now on see the new
/// contents, so that only those which were checked before can be stale.
struct Forgotten<'c>(&'c ChangedPaths);

/// The plan of a running build, and what its items have read.
pub(crate) struct RunningBuild {
    plan: Plan,
    selected: Selection,
    disk: Disk,
    wanted: Wanted,
    dependencies: Mutex<Vec<Dependencies>>,
    stale: Arc<[AtomicBool]>,
    outdated: AtomicBool,
}

impl RunningBuild {
    /// A new build. It takes the disk before that is asked for digests, and learns of every change from then
    /// on.
    pub(crate) fn new(plan: &Plan, selected: &Selection, disk: Disk, wanted: &Wanted) -> Self {
        let items = plan.items.len();
        Self {
            plan: plan.clone(),
            selected: selected.clone(),
            disk,
            wanted: wanted.clone(),
            dependencies: Mutex::new(std::iter::repeat_with(|| Dependencies::None).take(items).collect()),
            stale: std::iter::repeat_with(AtomicBool::default).take(items).collect(),
            outdated: AtomicBool::new(false),
        }
    }

    pub(crate) fn disk(&self) -> &Disk {
        &self.disk
    }

    /// Sets the files that an item's result depends on, before they are read to check the item.
    pub(crate) fn depend(&self, item: ItemIndex, dependencies: Dependencies) -> Dependent<ItemIndex> {
        self.set_dependencies(item, dependencies);
        Dependent(item)
    }

    /// Sets the files that the results of many items depend on.
    pub(crate) fn depend_all(
        &self,
        items: Vec<ItemIndex>,
        dependencies: impl Fn(ItemIndex) -> Dependencies,
    ) -> Dependent<Vec<ItemIndex>> {
        items.iter().for_each(|item| self.set_dependencies(*item, dependencies(*item)));
        Dependent(items)
    }

    pub(crate) fn set_dependencies(&self, item: ItemIndex, dependencies: Dependencies) {
        self.dependencies.lock()[item] = dependencies;
    }

    /// The files and folders that these items have read in this build.
    pub(crate) fn read_by(&self, items: &[ItemIndex]) -> HashSet<PathBuf> {
        let dependencies = self.dependencies.lock();
        let mut paths = HashSet::new();
        for item in items {
            if let Dependencies::Running(reads) = &dependencies[*item] {
                paths.extend(reads.lock().iter().map(|read| read.path.clone()));
            }
        }
        paths
    }

    /// The flag that tells an item that a change has made it stale.
    pub(crate) fn stale_flag(&self, item: ItemIndex) -> StaleFlag {
        StaleFlag::new(&self.stale, item)
    }

    /// Whether no further item may start.
    pub(crate) fn is_outdated(&self) -> bool {
        self.outdated.load(Ordering::Relaxed)
    }

    /// Marks what is stale now; see [`BuildSession::outdate`](crate::build::session::BuildSession::outdate).
    pub(crate) fn outdate(&self, changes: &ChangedPaths, plan: Option<&Plan>) {
        let mut stale = self.with_changed_reads(&self.forget(changes));
        let mut outdated = false;
        if let Some(plan) = plan {
            outdated = plan.out != self.plan.out || !self.compare(plan, &mut stale);
        }
        // Items come after those that they need.
        for (index, item) in self.plan.items.iter().enumerate() {
            stale[index] |= item.inputs.iter().flatten().any(|input| stale[*input]);
            if stale[index] && self.selected.has(index) {
                self.stale[index].store(true, Ordering::Relaxed);
                outdated = true;
            }
        }
        let wanted = self.wanted.among(&self.plan);
        if (0..stale.len()).any(|item| stale[item] && wanted[item]) {
            // Nothing else is worth waiting for.
            self.stale.iter().for_each(|flag| flag.store(true, Ordering::Relaxed));
        }
        if outdated {
            self.outdated.store(true, Ordering::Relaxed);
        }
    }

    /// Forgets the digests of changed files.
    fn forget<'c>(&self, changes: &'c ChangedPaths) -> Forgotten<'c> {
        self.disk.invalidate(|path, kind| changes.affect(path, kind));
        Forgotten(changes)
    }

    /// For each item, whether a changed file makes its result stale. Items whose dependencies are not known
    /// yet are checked later.
    fn with_changed_reads(&self, Forgotten(changes): &Forgotten<'_>) -> Vec<bool> {
        // Files are hashed after the lock is released: the build needs it too.
        let mut affected = Vec::new();
        for (index, dependencies) in self.dependencies.lock().iter().enumerate() {
            let add = |read: &Read| {
                if changes.affect(&read.path, read.kind) {
                    affected.push((index, read.clone()));
                }
            };
            match dependencies {
                Dependencies::None => {}
                Dependencies::Recorded(reads) => reads.iter().for_each(add),
                Dependencies::Running(reads) => reads.lock().iter().for_each(add),
            }
        }
        let mut stale = vec![false; self.plan.items.len()];
        let mut now = HashMap::new();
        for (index, read) in affected {
            let now = now.entry((read.path, read.kind));
            let now = now.or_insert_with_key(|(path, kind)| digest_now(path, *kind));
            stale[index] |= *now != read.digest;
        }
        stale
    }

    /// Marks the items that another plan does not have or makes differently. Returns whether the plans are
    /// otherwise the same: no item is new, and files go to the same places.
    fn compare(&self, plan: &Plan, stale: &mut [bool]) -> bool {
        if self.plan.is_same(plan) {
            return true;
        }
        let places = plan.items.iter().enumerate();
        let places = places.map(|(index, item)| ((plan.stages[item.stage].name.as_str(), &item.key), index));
        let places = places.collect::<HashMap<_, _>>();
        let stages = self.plan.stages.iter().map(|old| {
            let new = plan.stages.iter().find(|new| new.name == old.name);
            new.is_some_and(|new| does_the_same(old, new))
        });
        let stages = stages.collect::<Vec<_>>();
        // The index of each item in the other plan.
        let moved = self
            .plan
            .items
            .iter()
            .map(|item| places.get(&(self.plan.stages[item.stage].name.as_str(), &item.key)).copied());
        let moved = moved.collect::<Vec<_>>();
        let mut same = self.plan.items.len() == plan.items.len();
        for (index, old) in self.plan.items.iter().enumerate() {
            let Some(new) = moved[index].map(|place| &plan.items[place]) else {
                stale[index] = true;
                continue;
            };
            same &= old.files == new.files;
            let inputs_are_same = old.inputs.len() == new.inputs.len()
                && old.inputs.iter().zip(&new.inputs).all(|(old, new)| {
                    old.len() == new.len() && old.iter().zip(new).all(|(old, new)| moved[*old] == Some(*new))
                });
            stale[index] |= !stages[old.stage] || old.source != new.source || !inputs_are_same;
        }
        same
    }
}

/// Whether items of two stages make the same output from equal inputs and sources.
fn does_the_same(old: &Stage, new: &Stage) -> bool {
    let ports = |stage: &Stage| stage.inputs.iter().map(|(port, _)| port.clone()).collect::<Vec<_>>();
    old.kind.name() == new.kind.name()
        && old.kind.revision() == new.kind.revision()
        && old.configured.canonical() == new.configured.canonical()
        && ports(old) == ports(new)
}

/// The files and folders that may have changed.
pub(crate) struct ChangedPaths {
    paths: HashSet<PathBuf>,
    /// The folders that contain these files and folders.
    folders: HashSet<PathBuf>,
    search_path: SearchPath,
}

impl ChangedPaths {
    pub(crate) fn new(paths: &[PathBuf]) -> Self {
        let paths = paths.iter().map(|path| normal(path)).collect::<HashSet<_>>();
        let folders = paths.iter().filter_map(|path| path.parent()).map(Path::to_path_buf).collect();
        Self { paths, folders, search_path: SearchPath::current() }
    }

    /// Whether the answer to what was asked of a path may have changed.
    pub(crate) fn affect(&self, path: &Path, kind: ReadKind) -> bool {
        let is_changed = |path: &Path| path.ancestors().any(|ancestor| self.paths.contains(ancestor));
        let path = normal(path);
        match kind {
            ReadKind::Content => is_changed(&path),
            ReadKind::Names => self.folders.contains(&path) || is_changed(&path),
            ReadKind::Lookup => path
                .file_name()
                .is_some_and(|name| self.search_path.candidates(name).any(|file| is_changed(&normal(&file)))),
        }
    }
}
