//! The files and folders that a source names on the disk.

use std::collections::{BTreeMap, BTreeSet};
use std::ffi::OsStr;
use std::io;
use std::path::{Path, PathBuf};

use super::folders::{Folders, Found, Name};
use super::glob::{Glob, is_ignored_file, is_ignored_folder};
use super::source::{Asset, Source, SourcePath, listed, resolved, unexpanded};
use crate::kinds::HOW_TO_READ_EXPORTS;
use crate::manifest::{Diagnostic, Spelling};
use crate::storage::{BrokenLink, lies_in, path_name};

const MAX_FOLDERS: usize = 1 << 16;

/// A search for the files of sources, and what was found to be wrong.
pub(crate) struct Search<'a> {
    pub(crate) folders: &'a dyn Folders,
    pub(crate) spelling: Spelling,
    pub(crate) errors: Vec<Diagnostic>,
    pub(crate) warnings: Vec<Diagnostic>,
    /// Which of the exclusions of the present source have left out something.
    left_out: BTreeSet<usize>,
    /// For each glob of the present source, the files that it would match if case were ignored.
    in_other_case: Vec<Vec<PathBuf>>,
}

impl<'a> Search<'a> {
    pub(crate) fn new(folders: &'a dyn Folders) -> Self {
        let (errors, warnings) = (Vec::new(), Vec::new());
        let (left_out, in_other_case) = (BTreeSet::new(), Vec::new());
        Self { folders, spelling: Spelling::default(), errors, warnings, left_out, in_other_case }
    }
}

impl Source {
    /// The assets that exist now, sorted by stem.
    pub(crate) fn assets(&self, search: &mut Search<'_>) -> Option<Vec<Asset>> {
        let before = search.errors.len();
        let mut found = BTreeMap::new();
        search.left_out.clear();
        search.in_other_case.clear();
        for included in &self.included {
            let here = match &included.glob {
                None => self.find(included, search),
                Some(glob) => self.search(included, glob, search),
            };
            for (path, kind) in here {
                if !self.leaves_out(&path, search) {
                    // Two globs may find one file.
                    found.entry(resolved(&path)).or_insert((path, kind));
                }
            }
        }
        if search.errors.len() > before {
            return None;
        }
        for (index, excluded) in self.excluded.iter().enumerate() {
            if !search.left_out.contains(&index) {
                let message =
                    format!("\"!{}\" excludes nothing: no file of this source matches it", excluded.text);
                search.warnings.push(Diagnostic::at(excluded.span.clone(), message));
            }
        }
        let globs = self.included.iter().filter(|included| included.glob.is_some());
        for (path, mut files) in globs.zip(std::mem::take(&mut search.in_other_case)) {
            files.retain(|file| !found.contains_key(&resolved(file)));
            if !files.is_empty() {
                search.warnings.push(self.in_other_case(path, &files));
            }
        }
        if found.is_empty() {
            let error = Diagnostic::at(self.span.clone(), "the source excludes every file that it matches");
            search
                .errors
                .push(error.expected("expected at least one file").help("narrow the pattern after the !"));
            return None;
        }
        self.by_stem(found.into_values(), search)
    }

    /// Whether a path is left out; if so, records which exclusions do that.
    fn leaves_out(&self, path: &Path, search: &mut Search<'_>) -> bool {
        let by =
            (0..self.excluded.len()).filter(|index| self.excluded[*index].covers(path)).collect::<Vec<_>>();
        search.left_out.extend(&by);
        !by.is_empty()
    }

    /// The assets of these files and folders, sorted by stem.
    fn by_stem(
        &self,
        found: impl Iterator<Item = (PathBuf, Found)>,
        search: &mut Search<'_>,
    ) -> Option<Vec<Asset>> {
        let before = search.errors.len();
        let mut stems: BTreeMap<String, Vec<PathBuf>> = BTreeMap::new();
        for (path, found) in found {
            let name = if found == Found::Folder { path.file_name() } else { path.file_stem() };
            match name.and_then(OsStr::to_str) {
                Some(stem) => stems.entry(stem.into()).or_default().push(path),
                None => {
                    let message = format!("the name of {} is not Unicode", self.shown(&path));
                    search.errors.push(Diagnostic::at(self.span.clone(), message).help("rename the file"));
                }
            }
        }
        for (stem, paths) in stems.iter().filter(|(_, paths)| paths.len() > 1) {
            let names = paths.iter().map(|path| self.shown(path));
            let message = format!("{} files have the stem {stem:?}: {}", paths.len(), listed(names));
            let error =
                Diagnostic::at(self.span.clone(), message).expected("expected one file for each stem");
            search.errors.push(error.help(
                "the stem is the item's name: rename a file, leave one out, or use a stage for each glob",
            ));
        }
        let assets = stems.into_iter().flat_map(|(stem, paths)| {
            paths.into_iter().map(move |path| Asset { stem: stem.as_str().into(), path: Some(path) })
        });
        (search.errors.len() == before).then(|| assets.collect())
    }

    fn find(&self, path: &SourcePath, search: &mut Search<'_>) -> Vec<(PathBuf, Found)> {
        let error = |message: String| Diagnostic::at(path.span.clone(), message);
        if self.leads_into_out(&path.root, search.folders) {
            search.errors.push(self.in_out(path, &path.root, search.folders));
            return Vec::new();
        }
        let link = search.folders.broken_link(&path.root);
        match search.folders.find(&path.root) {
            Some(found @ (Found::File | Found::Folder)) => return vec![(path.root.clone(), found)],
            Some(Found::Other | Found::Unreachable) => {
                search.errors.push(error(format!("{:?} is neither a file nor a folder", path.text)));
            }
            // Its item says so.
            None if link.as_ref().is_some_and(|link| link.path == path.root) => {
                return vec![(path.root.clone(), Found::Unreachable)];
            }
            None => {
                let error = error(format!("there is no file or folder {:?}", path.text))
                    .expected("expected a file, a folder or a glob");
                search.errors.push(match link {
                    Some(link) => error.help(self.broken(&link)),
                    None => self.with_surroundings(path, error, search),
                });
            }
        }
        Vec::new()
    }

    fn search(&self, path: &SourcePath, glob: &Glob, search: &mut Search<'_>) -> Vec<(PathBuf, Found)> {
        let folders = search.folders;
        let before = search.errors.len();
        if self.leads_into_out(&path.root, folders) {
            search.errors.push(self.in_out(path, &path.root, folders));
            return Vec::new();
        }
        let (mut found, mut in_other_case) = (Vec::new(), Vec::new());
        let mut searched = 0;
        let mut open = vec![(PathBuf::new(), 0)];
        while let Some((below, level)) = open.pop() {
            let folder = if level == 0 { path.root.clone() } else { path.root.join(&below) };
            searched += 1;
            if searched > MAX_FOLDERS {
                let message = format!("{:?} searches more than {MAX_FOLDERS} folders", path.text);
                let error = Diagnostic::at(path.span.clone(), message).expected("expected a narrower glob");
                search.errors.push(error.help(format!("the search begins in {}", self.shown(&path.root))));
                return Vec::new();
            }
            let names = match folders.list(&folder) {
                Ok(names) => names,
                Err(error) => {
                    search.errors.extend(self.unlisted(path, &folder, &error, folders));
                    continue;
                }
            };
            for Name { name, found: kind, link } in names {
                let below = below.join(&name);
                let here = path.root.join(&below);
                let is_match = glob.matches(&below) && !is_ignored_file(&name);
                match kind {
                    Found::Folder
                        if glob.enters(&name, level, link)
                            && !is_ignored_folder(&name)
                            && !self.is_out(&folder, &name)
                            && !self.leaves_out(&here, search) =>
                    {
                        if self.leads_into_out(&here, folders) {
                            search.errors.push(self.in_out(path, &here, folders));
                        } else {
                            open.push((below, level + 1));
                        }
                    }
                    Found::File | Found::Unreachable if is_match => {
                        if link && self.leads_into_out(&here, folders) && !self.leaves_out(&here, search) {
                            search.errors.push(self.in_out(path, &here, folders));
                        } else {
                            found.push((here, kind));
                        }
                    }
                    // It may be a folder of files that cannot be seen now.
                    Found::Unreachable
                        if glob.enters(&name, level, link)
                            && !is_ignored_folder(&name)
                            && !self.leaves_out(&here, search) =>
                    {
                        search.errors.extend(folders.broken_link(&here).map(|link| {
                            let error = Diagnostic::at(path.span.clone(), self.broken(&link));
                            error.help(format!(
                                "if it is not needed, leave it out: {:?}",
                                self.exclusion(&here)
                            ))
                        }));
                    }
                    Found::File if glob.matches_in_any_case(&below) && !is_ignored_file(&name) => {
                        in_other_case.push(here);
                    }
                    _ => {}
                }
            }
        }
        in_other_case.retain(|path| !self.leaves_out(path, search));
        in_other_case.sort_unstable();
        if found.is_empty() && search.errors.len() == before {
            let error = self.no_match(path, &in_other_case, search);
            search.errors.push(error);
        }
        search.in_other_case.push(in_other_case);
        found.sort_unstable();
        found
    }

    /// The error of a folder that cannot be listed; `None` if there is no such folder.
    fn unlisted(
        &self,
        path: &SourcePath,
        folder: &Path,
        error: &io::Error,
        folders: &dyn Folders,
    ) -> Option<Diagnostic> {
        if let Some(link) = folders.broken_link(folder) {
            return Some(Diagnostic::at(path.span.clone(), self.broken(&link)));
        }
        if matches!(error.kind(), io::ErrorKind::NotFound | io::ErrorKind::NotADirectory) {
            return None;
        }
        let message = format!("cannot read the folder {}: {error}", self.shown(folder));
        let help = "nothing is built or removed while the files of a source cannot be read";
        Some(Diagnostic::at(path.span.clone(), message).help(help))
    }

    fn no_match(&self, path: &SourcePath, in_other_case: &[PathBuf], search: &Search<'_>) -> Diagnostic {
        let error = Diagnostic::at(path.span.clone(), format!("no file matches {:?}", path.text))
            .expected(format!("expected files in {}", self.shown(&path.root)));
        if let Some(first) = in_other_case.first() {
            return error.help(format!("{} differs only in case, and case counts", self.shown(first)));
        }
        if search.folders.find(&self.base.join(&path.text)).is_some() {
            return error.help(
                "there is a file with exactly this name: put its special characters in brackets, such as [[] \
                 for [",
            );
        }
        self.with_surroundings(path, error, search)
    }

    /// The warning of files that a glob would match if case were ignored.
    fn in_other_case(&self, path: &SourcePath, files: &[PathBuf]) -> Diagnostic {
        let names = listed(files.iter().map(|file| self.shown(file)));
        let message = match files {
            [_] => format!("{names} is not read: it differs from {:?} only in case", path.text),
            _ => format!(
                "{} files are not read: they differ from {:?} only in case: {names}",
                files.len(),
                path.text
            ),
        };
        let help = "rename it, or add its spelling to the glob: *.{hdr,HDR}";
        Diagnostic::at(path.span.clone(), message).help(help)
    }

    /// The error of a path that leads into the folder for exports.
    fn in_out(&self, source: &SourcePath, path: &Path, folders: &dyn Folders) -> Diagnostic {
        let real = self.shown(&folders.leads_to(path));
        let message =
            format!("{} is inside \"out\", the folder for exports: it leads to {real}", self.shown(path));
        Diagnostic::at(source.span.clone(), message).help(HOW_TO_READ_EXPORTS)
    }

    /// Adds help for somebody who looks for a path that does not exist.
    fn with_surroundings(&self, path: &SourcePath, error: Diagnostic, search: &Search<'_>) -> Diagnostic {
        if let Some(expansion) = unexpanded(&path.text) {
            return error.help(format!("a source does not expand {expansion}: write the path itself"));
        }
        if search.spelling.is_used_up() { error } else { error.help(self.surroundings(path, search)) }
    }

    fn surroundings(&self, path: &SourcePath, search: &Search<'_>) -> String {
        let Search { folders, spelling, .. } = search;
        let plain = resolved(&path.root);
        let above: Vec<_> = plain.ancestors().collect();
        let exists = |folder: &&&Path| folders.find(folder) == Some(Found::Folder);
        let Some(folder) = above.iter().find(exists) else {
            return format!(
                "there is no folder {}",
                above.last().map_or_else(String::new, |top| self.shown(top))
            );
        };
        let Ok(mut names) = folders.list(folder) else {
            return format!("the folder {} cannot be read", self.shown(folder));
        };
        spelling.has_listed(names.len());
        names.sort_unstable();
        // A hidden name is shown only if it is near to the missing one.
        let shown = names.iter().filter(|name| !is_ignored_file(&name.name)).map(|name| {
            format!("{}{}", name.name.to_string_lossy(), if name.found == Found::Folder { "/" } else { "" })
        });
        let shown: Vec<_> = shown.collect();
        let holds = match shown.len() {
            0 => format!("{} is empty", self.shown(folder)),
            _ => format!("{} contains {}", self.shown(folder), listed(shown)),
        };
        let Some(missing) = above.iter().take_while(|above| above != &folder).last() else { return holds };
        let wanted = missing.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned());
        let names: Vec<_> = names.iter().map(|name| name.name.to_string_lossy()).collect();
        let near = spelling.nearest(&wanted, names.iter().map(AsRef::as_ref));
        let near = near.map_or_else(String::new, |near| format!("; did you mean {near:?}?"));
        if missing == &above[0] && path.glob.is_none() {
            format!("{holds}{near}")
        } else {
            format!("the folder {} does not exist; {holds}{near}", self.shown(missing))
        }
    }

    fn is_out(&self, folder: &Path, name: &OsStr) -> bool {
        self.out
            .as_ref()
            .is_some_and(|out| out.file_name() == Some(name) && resolved(folder).join(name) == *out)
    }

    /// Whether a path leads into the folder for exports when links are followed.
    fn leads_into_out(&self, path: &Path, folders: &dyn Folders) -> bool {
        let lies_in = |out: &Path| lies_in(path, out, |path| folders.leads_to(path));
        self.out.as_ref().is_some_and(|out| lies_in(out) || folders.are_one(path, out))
    }

    /// Describes a link that leads nowhere, for messages.
    fn broken(&self, link: &BrokenLink) -> String {
        BrokenLink { path: self.shown(&link.path).into(), ..link.clone() }.to_string()
    }

    /// The exclusion of a path, as it would be written.
    fn exclusion(&self, path: &Path) -> String {
        format!("!{}", path_name(&self.base, path))
    }
}
