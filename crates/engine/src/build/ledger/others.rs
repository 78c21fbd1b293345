//! The files in the ledger that are not files of the manifest that is being built: those that other manifests
//! of the folder export, and *abandoned* files, whose manifest no longer exists (it was renamed or deleted)
//! or now names another folder as `out`.
//!
//! Two folders may hold the same file (`out` and `out/game`, or a folder and a link to it). So files are
//! compared by their path from the manifest's folder, with the links that lead to `out` resolved.

use std::collections::{BTreeMap, HashMap};
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use super::Published;
use crate::build::retention::Manifests;
use crate::parallel;
use crate::plan::template;
use crate::platform::canonicalize;
use crate::storage::{FOLDER, Journal, Line, Subject, Tag};

/// The lines of other manifests and of other folders, by the paths of their files.
#[derive(Default)]
pub(crate) struct Others {
    /// The real path of the manifests' folder.
    folder: PathBuf,
    /// The lines of manifests that exist and export into the folder of the line.
    exported: HashMap<String, Published>,
    /// The lines of abandoned files: several manifests may have published a file, one after the other.
    abandoned: BTreeMap<String, Vec<Published>>,
}

/// The fate of an abandoned file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Fate {
    /// The file is as it was published.
    Unchanged,
    /// Somebody has changed the file, or a link leads to its folder.
    Changed,
    Missing,
    /// The file's folder cannot be read at present: a link to it leads nowhere.
    Unknown,
}

/// An abandoned file that no manifest exports.
pub(crate) struct Leftover<'a> {
    /// The file's path from the folder of the manifests.
    pub(crate) path: &'a str,
    pub(crate) place: PathBuf,
    /// The file's lines in the ledger: at least one.
    lines: &'a [Published],
    pub(crate) fate: Fate,
}

impl Leftover<'_> {
    /// The line of the last build that published the file.
    pub(crate) fn line(&self) -> Option<&Published> {
        self.lines.last()
    }

    /// The lines that remove the file from the ledger.
    pub(crate) fn removals(&self) -> impl Iterator<Item = Line> {
        self.lines.iter().map(Published::removal)
    }
}

impl Others {
    /// All lines of the journal in a folder; no manifest is being built.
    pub(crate) fn of_all(journal: &Journal, folder: &Path) -> Self {
        Self::of(journal.contents(Tag::Published), folder, None)
    }

    /// Sorts lines of the journal in a folder. `own` is the manifest that is being built: a second name of
    /// its file, such as a link, is not another manifest.
    pub(super) fn of(
        lines: impl IntoIterator<Item = (Subject, Published)>,
        folder: &Path,
        own: Option<&str>,
    ) -> Self {
        let real = canonicalize(folder).unwrap_or_else(|_| folder.to_path_buf());
        let mut others = Self { folder: real, ..Self::default() };
        let mut manifests = Manifests::new(folder, own);
        let mut roots = HashMap::<String, Option<String>>::new();
        for (subject, line) in lines {
            let is_valid = line.is_valid(subject)
                && is_name(&line.manifest)
                && template::check(&line.out, "the manifest's folder").is_ok();
            if !is_valid {
                continue;
            }
            let root = roots.entry(line.out.clone()).or_insert_with(|| others.root(&line.out));
            let Some(root) = root else { continue };
            let path = format!("{root}/{}", line.file);
            if own != Some(line.manifest.as_str()) && manifests.exports_into(&line.manifest, &line.out) {
                others.exported.insert(path, line);
            } else {
                others.abandoned.entry(path).or_default().push(line);
            }
        }
        others
    }

    /// The path of an `out` from the manifests' folder, links resolved; `None` if it leads out of that
    /// folder.
    pub(super) fn root(&self, out: &str) -> Option<String> {
        match canonicalize(self.folder.join(out)) {
            Ok(real) => {
                let inside = real.strip_prefix(&self.folder).ok()?;
                let names = inside.components().map(|name| name.as_os_str().to_str());
                let names = names.collect::<Option<Vec<_>>>()?;
                (!names.is_empty()).then(|| names.join("/"))
            }
            Err(_) => Some(out.to_owned()),
        }
    }

    /// The line of another manifest that exports a file.
    pub(super) fn exported(&self, path: &str) -> Option<&Published> {
        self.exported.get(path)
    }

    pub(super) fn abandoned(&self, path: &str) -> &[Published] {
        self.abandoned.get(path).map_or(&[], Vec::as_slice)
    }

    pub(super) fn all_abandoned(&self) -> impl Iterator<Item = &Published> {
        self.abandoned.values().flatten()
    }

    pub(super) fn retain_abandoned(&mut self, keeps: impl Fn(&Published) -> bool) {
        self.abandoned.retain(|_, lines| {
            lines.retain(&keeps);
            !lines.is_empty()
        });
    }

    /// The abandoned files that no manifest exports; `is_left` excludes those of the manifest that is being
    /// built. Files of a folder that has its own `.specula` are left to the manifests there.
    pub(crate) fn leftovers(&self, is_left: &dyn Fn(&str) -> bool) -> Vec<Leftover<'_>> {
        let mut foreign = HashMap::<&str, bool>::new();
        let mut left = Vec::new();
        for (path, lines) in &self.abandoned {
            let folder = path.rsplit_once('/').map_or("", |(folder, _)| folder);
            let is_foreign = *foreign.entry(folder).or_insert_with(|| self.has_state(folder));
            if !is_foreign && !self.exported.contains_key(path) && is_left(path) {
                left.push((path, lines));
            }
        }
        parallel::map(left.len(), &|index| {
            let (path, lines) = left[index];
            let place = self.folder.join(path);
            Leftover { fate: self.fate(&place, lines), path, place, lines }
        })
    }

    /// Whether a folder, or one between it and the manifests' folder, has its own `.specula`.
    fn has_state(&self, folder: &str) -> bool {
        let folder = self.folder.join(folder);
        let mut folders = folder.ancestors().take_while(|folder| *folder != self.folder);
        folders.any(|folder| folder.join(FOLDER).exists())
    }

    fn fate(&self, place: &Path, lines: &[Published]) -> Fate {
        match fs::symlink_metadata(place) {
            Ok(found) if is_inside(&self.folder, place) => {
                let is_unchanged = lines.iter().any(|line| line.describes(&found, place).unwrap_or(false));
                if is_unchanged { Fate::Unchanged } else { Fate::Changed }
            }
            Ok(_) => Fate::Changed,
            Err(error) if error.kind() == io::ErrorKind::NotFound => {
                // The folder of the manifests may have been moved away for a moment. If a link to the file
                // leads nowhere, the file may be there again when a disk is mounted.
                let is_dangling = |folder: &Path| fs::symlink_metadata(folder).is_ok() && !folder.exists();
                let folders = place.ancestors().skip(1).take_while(|folder| *folder != self.folder);
                let is_unseen = !self.folder.is_dir() || folders.into_iter().any(is_dangling);
                if is_unseen { Fate::Unknown } else { Fate::Missing }
            }
            Err(_) => Fate::Unknown,
        }
    }
}

/// Whether no link leads from a folder to the folder of a file in it.
pub(crate) fn is_inside(root: &Path, place: &Path) -> bool {
    let folders = place.ancestors().skip(1).take_while(|folder| *folder != root);
    folders.into_iter().all(|folder| fs::symlink_metadata(folder).is_ok_and(|found| found.is_dir()))
}

fn is_name(name: &str) -> bool {
    Path::new(name).file_name().is_some_and(|own| own == name)
}
