//! Removes files from `out`: those that no item exports any more, folders that become empty, and temporary
//! files of killed builds. Only files of the ledger are removed, and only if they are as they were published.

use std::collections::{BTreeMap, BTreeSet, HashMap, HashSet};
use std::fs::{self, Metadata};
use std::io;
use std::path::Path;
use std::sync::atomic::Ordering;

use super::{PublishEvent, Publisher, TEMPORARY};
use crate::build::ledger::{Fate, Published, is_inside, out_name};
use crate::error::Error;
use crate::event::{Event, ItemName};
use crate::plan::{Plan, Selection};
use crate::platform;
use crate::platform::{canonicalize, folded, path_text};
use crate::storage::{Line, State, Tag, path_name};

impl Publisher<'_> {
    /// Removes the files of items that no longer exist in selected stages (with `all`, also in stages that no
    /// longer exist).
    pub(crate) fn remove_gone(
        &self,
        plan: &Plan,
        selected: &Selection,
        all: bool,
        events: &mut Vec<(ItemName, PublishEvent)>,
    ) -> Result<(), Error> {
        if self.stale.is_empty() {
            return Ok(());
        }
        let items = (0..plan.items.len()).map(|item| plan.item_name(item)).collect::<HashSet<_>>();
        for (item, files) in self.stale.iter().filter(|(item, _)| !items.contains(*item)) {
            let stage = plan.stages.iter().position(|stage| stage.name == item.stage);
            if stage.map_or(all, |stage| selected.has_stage(stage)) {
                self.remove(files, &mut |what| events.push((item.clone(), what)))?;
            }
        }
        Ok(())
    }

    /// Removes the files that an item no longer exports, now that its others are in place.
    pub(crate) fn remove_stale(&self, item: &ItemName, events: &mut Vec<PublishEvent>) -> Result<(), Error> {
        match self.stale.get(item) {
            Some(files) => self.remove(files, &mut |what| events.push(what)),
            None => Ok(()),
        }
    }

    /// Whether an item no longer exports some file.
    pub(crate) fn has_stale(&self, item: &dyn Fn() -> ItemName) -> bool {
        !self.stale.is_empty() && self.stale.contains_key(&item())
    }

    /// The files that [`Publisher::remove_gone`] and [`Publisher::remove_stale`] would remove.
    pub(crate) fn would_remove(
        &self,
        plan: &Plan,
        selected: &Selection,
        all: bool,
    ) -> Result<Vec<(ItemName, String)>, Error> {
        let stages = plan
            .stages
            .iter()
            .enumerate()
            .map(|(index, stage)| (stage.name.as_str(), selected.has_stage(index)));
        let stages = stages.collect::<HashMap<_, _>>();
        let stale = self.stale.iter().filter(|(item, _)| *stages.get(item.stage.as_str()).unwrap_or(&all));
        let files = stale.flat_map(|(item, files)| files.iter().map(move |file| (item, file)));
        let lines = files.filter_map(|(item, file)| Some((item, self.entry(file)?)));
        let left = lines.filter_map(|(item, line)| Some((item, self.left_over(&line).transpose()?)));
        let removed = left.filter_map(|(item, left)| match left {
            Ok(PublishEvent::Removed { file }) => Some(Ok((item.clone(), file))),
            Ok(_) => None,
            Err(error) => Some(Err(error)),
        });
        removed.collect()
    }

    /// Removes folders that are empty now, and records that publishing has ended. Returns the files that were
    /// removed.
    ///
    /// Only at the end of a build: until then another item may be about to write into such a folder.
    ///
    /// # Errors
    /// If the journal cannot be written.
    pub(crate) fn finish(&self) -> Result<HashSet<String>, Error> {
        for folder in self.emptied_folders.lock().iter() {
            for folder in folder.ancestors().take_while(|folder| *folder != self.root) {
                // Fails if the folder is not empty.
                if fs::remove_dir(folder).is_err() {
                    break;
                }
            }
        }
        if self.announced.load(Ordering::Acquire) && !self.is_unfinished.load(Ordering::Acquire) {
            self.state.journal.append(&[self.ledger.publishing(false)])?;
        }
        Ok(std::mem::take(&mut *self.removed.lock()))
    }

    /// Removes files of the ledger, and the folders that they leave empty.
    pub(super) fn remove(&self, files: &[String], report: &mut dyn FnMut(PublishEvent)) -> Result<(), Error> {
        // The lock is held until the files are removed: whoever finds a file in `removed` may put something
        // in its place.
        let mut removed = self.removed.lock();
        for file in files {
            let Some(line) = self.entry(file).filter(|_| removed.insert(file.clone())) else { continue };
            if let Some(left) = self.left_over(&line)? {
                if let PublishEvent::Removed { .. } = left {
                    let place = self.root.join(file);
                    platform::remove(&place).map_err(|error| Error::io(&error, "remove", &place))?;
                    self.emptied_folders.lock().extend(place.parent().map(Path::to_path_buf));
                }
                report(left);
            }
            self.state.journal.append(&[self.ledger.removal(file)])?;
        }
        Ok(())
    }

    /// Removes abandoned files that are in the way: at the place of a file, or in a folder there.
    pub(super) fn remove_leftovers(
        &self,
        place: &str,
        report: &mut dyn FnMut(PublishEvent),
    ) -> Result<(), Error> {
        for leftover in self.ledger.leftovers(Some(place)) {
            if leftover.fate == Fate::Unchanged {
                let place = &leftover.place;
                platform::remove(place).map_err(|error| Error::io(&error, "remove", place))?;
                self.state.journal.append(&leftover.removals().collect::<Vec<_>>())?;
                report(PublishEvent::Removed { file: self.name_in_out(place) });
            }
        }
        Ok(())
    }

    /// The files that no manifest exports any more, as counts for each folder. Those that do not exist any
    /// more are forgotten.
    ///
    /// # Errors
    /// If the journal cannot be written.
    pub(crate) fn leftovers(&self) -> Result<Vec<Event>, Error> {
        let mut folders = BTreeMap::<String, (BTreeSet<String>, usize)>::new();
        let mut missing = Vec::new();
        for leftover in self.ledger.leftovers(None) {
            match leftover.fate {
                Fate::Unchanged => {
                    let Some(Published { out, manifest, .. }) = leftover.line() else { continue };
                    let (manifests, files) = folders.entry(out.clone()).or_default();
                    manifests.insert(manifest.clone());
                    *files += 1;
                }
                Fate::Missing => missing.extend(leftover.removals()),
                Fate::Changed | Fate::Unknown => {}
            }
        }
        self.state.journal.append(&missing)?;
        let events = folders.into_iter().map(|(folder, (manifests, files))| Event::Leftovers {
            folder,
            published_by: manifests.into_iter().collect(),
            files,
            manifest: self.plan.manifest_name(),
        });
        Ok(events.collect())
    }

    /// The name of a file in `out`, given its real path.
    fn name_in_out(&self, place: &Path) -> String {
        let root = canonicalize(self.root).unwrap_or_else(|_| self.root.to_path_buf());
        path_name(&root, place)
    }

    /// What happens to a file that no item exports, or that its item leaves out: it is removed, or left alone
    /// if someone changed it. `None` if it does not exist any more, or another manifest exports it.
    fn left_over(&self, line: &Published) -> Result<Option<PublishEvent>, Error> {
        let file = &line.file;
        let place = self.root.join(file);
        let found = self.found(&place)?.filter(|_| is_inside(self.root, &place));
        let Some(found) = found else { return Ok(None) };
        if self.is_wanted_in_other_spelling(file, &place) || self.ledger.exported_by_another(file).is_some() {
            return Ok(None);
        }
        if line.describes(&found, &place).map_err(|error| Error::io(&error, "read", &place))? {
            return Ok(Some(PublishEvent::Removed { file: file.clone() }));
        }
        Ok(Some(PublishEvent::Warning(format!(
            "{} has changed since it was published; nothing exports it now, so it stays",
            path_text(place)
        ))))
    }

    /// The metadata of a place; `None` if nothing is there.
    ///
    /// # Errors
    /// If that cannot be seen: the project's folder may have been moved away for a moment.
    fn found(&self, place: &Path) -> Result<Option<Metadata>, Error> {
        let look = || fs::symlink_metadata(place);
        let is_absent = |error: &io::Error| {
            matches!(error.kind(), io::ErrorKind::NotFound | io::ErrorKind::NotADirectory)
        };
        match look() {
            Ok(found) => Ok(Some(found)),
            Err(error) if is_absent(&error) && self.plan.state.is_dir() && look().is_err() => Ok(None),
            Err(error) => Err(Error::io(&error, "look at", place)),
        }
    }

    fn is_wanted_in_other_spelling(&self, file: &str, place: &Path) -> bool {
        let wanted = self.plan.items.iter().flat_map(|item| &item.files);
        let by_name = || wanted.map(|wanted| (folded(wanted).into_owned(), wanted.as_str())).collect();
        let wanted = self.folded.get_or_init(by_name).get(&*folded(file));
        wanted.is_some_and(|wanted| *wanted != file && platform::is_one_file(&self.root.join(wanted), place))
    }
}

/// Removes temporary files that a killed build left in the folder that it was publishing into, if that is the
/// plan's `out`. Other folders are left to the builds of the manifests that name them.
///
/// # Errors
/// If the journal cannot be written.
pub(crate) fn sweep(state: &State, plan: &Plan) -> Result<(), Error> {
    let out = out_name(plan);
    for (place, announced) in state.journal.contents::<String>(Tag::Publishing) {
        if announced == out {
            sweep_folder(&plan.out);
            state.journal.append(&[Line::new::<()>(Tag::Publishing, place, None)])?;
        }
    }
    Ok(())
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
