//! What a stage's `source` names: a file, a folder, or the files that a glob matches.
//!
//! A glob is split at the last `/` before its first special character: the part before it is the folder to
//! search, and the part after it is matched against the paths below that folder. `*` and `?` do not match
//! `/`, `**` does, `{a,b}` are alternatives, and `[ab]` is a set. Matching is case-sensitive on every system,
//! so that a manifest means the same everywhere.
//!
//! Hidden files and folders and the backups of editors never match, and neither does anything in `out`, so
//! that a build does not read its own exports.

use std::collections::BTreeMap;
use std::ffi::OsStr;
use std::ops::Range;
use std::path::{Component, Path, PathBuf};
use std::sync::Arc;

use globset::{GlobBuilder, GlobMatcher};

use super::folders::{Folders, Found, Name};
use super::manifest::Written;
use crate::Diagnostic;
use crate::spelling::Spelling;

/// The most folders that one glob searches.
const MOST_FOLDERS: usize = 1 << 16;

/// Braces around a `/` are taken apart into at most this many globs.
const MOST_ALTERNATIVES: usize = 1024;

/// The `source` of a stage.
#[derive(Clone, Debug)]
pub struct Source {
    text: String,
    pub(crate) span: Range<usize>,
    /// The manifest's folder.
    base: PathBuf,
    /// The folder that a glob searches, or the file or folder itself.
    root: PathBuf,
    /// The folder for exports, which is not searched.
    out: Option<PathBuf>,
    glob: Option<Pattern>,
}

#[derive(Clone, Debug)]
struct Pattern {
    whole: GlobMatcher,
    /// What the names of folders must match, level by level, as far as the glob restricts them: one of these.
    levels: Vec<Vec<GlobMatcher>>,
    /// The deepest level at which a file can match; `None` if the glob contains `**`.
    depth: Option<usize>,
}

/// A file or folder that makes one item.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Asset {
    /// The file's name without its extension, or the folder's name.
    pub(crate) stem: Arc<str>,
    /// Absolute.
    pub(crate) path: PathBuf,
}

impl Source {
    /// Parses a `source`, without looking at the disk.
    pub(crate) fn parse(
        written: &Written<String>,
        base: &Path,
        out: Option<&Path>,
        errors: &mut Vec<Diagnostic>,
    ) -> Option<Self> {
        let (text, span) = (written.value.as_str(), written.span.clone());
        if text.is_empty() {
            errors.push(
                Diagnostic::at(span, "the source is empty").expected("expected a file, a folder or a glob"),
            );
            return None;
        }
        if text.contains('\\') {
            let error =
                Diagnostic::at(span, "a source cannot contain \\").expected("expected / between folders");
            errors.push(error.help(format!("write {:?}", text.replace('\\', "/"))));
            return None;
        }
        let special = text.find(['*', '?', '[', '{']);
        let (folder, glob) = match special {
            None => (text, None),
            Some(special) => {
                let split = text[..special].rfind('/').map_or(0, |slash| slash + 1);
                match Pattern::parse(&text[split..]) {
                    Ok(pattern) => (&text[..split], Some(pattern)),
                    Err(error) => {
                        let error = Diagnostic::at(span, format!("{text:?} is not a valid glob: {error}"));
                        errors.push(
                            error.help("to match a special character itself, put it in brackets: [[] or [*]"),
                        );
                        return None;
                    }
                }
            }
        };
        let mut named = Path::new(folder).components().filter(|part| *part != Component::CurDir);
        let root = base.join(named.clone().collect::<PathBuf>());
        let plain = resolved(&root);
        if out.is_some_and(|out| plain.starts_with(resolved(out))) {
            let error = Diagnostic::at(span, format!("{text:?} is inside \"out\", the folder for exports"));
            errors.push(error.help("connect the stage that makes the file instead, or move the file"));
            return None;
        }
        if glob.is_none() && !matches!(named.next_back(), Some(Component::Normal(_))) {
            let error =
                Diagnostic::at(span, format!("{text:?} does not end in a name, which its item needs"));
            errors.push(
                error.expected("expected a file, a folder or a glob").help("name the folder: \"../faces\""),
            );
            return None;
        }
        Some(Self { text: text.into(), span, base: base.into(), root, out: out.map(resolved), glob })
    }

    /// The source as it is written in the manifest.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// The folder that a glob searches, or the file or folder itself. Absolute.
    pub fn root(&self) -> &Path {
        &self.root
    }

    /// Whether it is a glob rather than a single file or folder.
    pub fn is_glob(&self) -> bool {
        self.glob.is_some()
    }

    /// Whether a glob searches folders below [`Source::root`].
    pub fn is_deep(&self) -> bool {
        self.glob.as_ref().is_some_and(|glob| glob.depth != Some(0))
    }

    /// Whether a file that appears, changes or disappears at this absolute path concerns the source.
    pub fn concerns(&self, path: &Path) -> bool {
        let Ok(below) = path.strip_prefix(&self.root) else { return false };
        match &self.glob {
            None => true,
            Some(glob) => {
                glob.whole.is_match(below)
                    && !below.components().any(|part| is_ignored(part.as_os_str()))
                    && !self.out.as_ref().is_some_and(|out| resolved(path).starts_with(out))
            }
        }
    }

    /// Whether a folder that appears at this absolute path is searched.
    pub(crate) fn searches(&self, path: &Path) -> bool {
        let (Some(glob), Ok(below)) = (&self.glob, path.strip_prefix(&self.root)) else { return false };
        let mut names = below.components().enumerate();
        names
            .all(|(level, part)| !is_ignored(part.as_os_str()) && glob.enters(part.as_os_str(), level, false))
            && !self.out.as_ref().is_some_and(|out| resolved(path).starts_with(out))
    }

    /// The assets that exist now, sorted by stem.
    pub(crate) fn assets(
        &self,
        folders: &dyn Folders,
        spelling: &Spelling,
        errors: &mut Vec<Diagnostic>,
    ) -> Option<Vec<Asset>> {
        let before = errors.len();
        let found = match &self.glob {
            None => self.find(folders, spelling, errors),
            Some(glob) => self.search(glob, folders, spelling, errors),
        };
        if errors.len() > before {
            return None;
        }
        let mut stems: BTreeMap<String, Vec<PathBuf>> = BTreeMap::new();
        for (path, found) in found {
            let name = if found == Found::Folder { path.file_name() } else { path.file_stem() };
            match name.and_then(OsStr::to_str) {
                Some(stem) => stems.entry(stem.into()).or_default().push(path),
                None => {
                    let message = format!("the name of {} is not Unicode", self.shown(&path));
                    errors.push(Diagnostic::at(self.span.clone(), message).help("rename the file"));
                }
            }
        }
        for (stem, paths) in stems.iter().filter(|(_, paths)| paths.len() > 1) {
            let names = paths.iter().map(|path| self.shown(path));
            let message = format!("{} files have the stem {stem:?}: {}", paths.len(), listed(names));
            let error =
                Diagnostic::at(self.span.clone(), message).expected("expected one file for each stem");
            errors
                .push(error.help("the stem is the item's name: rename a file, or use a stage for each glob"));
        }
        let assets = stems.into_iter().flat_map(|(stem, paths)| {
            paths.into_iter().map(move |path| Asset { stem: stem.as_str().into(), path })
        });
        (errors.len() == before).then(|| assets.collect())
    }

    /// The file or folder that the source names.
    fn find(
        &self,
        folders: &dyn Folders,
        spelling: &Spelling,
        errors: &mut Vec<Diagnostic>,
    ) -> Vec<(PathBuf, Found)> {
        match folders.find(&self.root) {
            Some(found @ (Found::File | Found::Folder)) => return vec![(self.root.clone(), found)],
            Some(Found::Other) => {
                let message = format!("{:?} is neither a file nor a folder", self.text);
                errors.push(Diagnostic::at(self.span.clone(), message));
            }
            None => {
                let message = format!("there is no file or folder {:?}", self.text);
                let error = Diagnostic::at(self.span.clone(), message)
                    .expected("expected a file, a folder or a glob");
                errors.push(self.with_surroundings(error, folders, spelling));
            }
        }
        Vec::new()
    }

    /// The files that the glob matches.
    fn search(
        &self,
        glob: &Pattern,
        folders: &dyn Folders,
        spelling: &Spelling,
        errors: &mut Vec<Diagnostic>,
    ) -> Vec<(PathBuf, Found)> {
        let before = errors.len();
        let mut found = Vec::new();
        let mut searched = 0;
        let mut open = vec![(PathBuf::new(), 0)];
        while let Some((below, level)) = open.pop() {
            let folder = if level == 0 { self.root.clone() } else { self.root.join(&below) };
            searched += 1;
            if searched > MOST_FOLDERS {
                let message = format!("{:?} searches more than {MOST_FOLDERS} folders", self.text);
                let error = Diagnostic::at(self.span.clone(), message).expected("expected a narrower glob");
                errors.push(error.help(format!("the search begins in {}", self.shown(&self.root))));
                return Vec::new();
            }
            let names = match folders.list(&folder) {
                Ok(names) => names,
                Err(_) if folders.find(&folder) != Some(Found::Folder) => continue,
                Err(error) => {
                    let message = format!("cannot read the folder {}: {error}", self.shown(&folder));
                    errors.push(Diagnostic::at(self.span.clone(), message));
                    continue;
                }
            };
            for Name { name, found: kind, link } in names {
                if is_ignored(&name) {
                    continue;
                }
                let path = below.join(&name);
                match kind {
                    Found::File if glob.whole.is_match(&path) => found.push((self.root.join(path), kind)),
                    Found::Folder if glob.enters(&name, level, link) && !self.is_out(&folder, &name) => {
                        open.push((path, level + 1));
                    }
                    _ => {}
                }
            }
        }
        if found.is_empty() && errors.len() == before {
            errors.push(self.no_match(folders, spelling));
        }
        found.sort_unstable();
        found
    }

    fn no_match(&self, folders: &dyn Folders, spelling: &Spelling) -> Diagnostic {
        let error = Diagnostic::at(self.span.clone(), format!("no file matches {:?}", self.text))
            .expected(format!("expected files in {}", self.shown(&self.root)));
        if folders.find(&self.base.join(&self.text)).is_some() {
            return error.help(
                "a file has exactly this name: put its special characters in brackets, such as [[] for [",
            );
        }
        self.with_surroundings(error, folders, spelling)
    }

    /// Adds help for somebody who looks for a path that does not exist.
    fn with_surroundings(&self, error: Diagnostic, folders: &dyn Folders, spelling: &Spelling) -> Diagnostic {
        if spelling.is_used_up() { error } else { error.help(self.surroundings(folders, spelling)) }
    }

    /// What exists near the path.
    fn surroundings(&self, folders: &dyn Folders, spelling: &Spelling) -> String {
        let plain = resolved(&self.root);
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
        let shown = names.iter().filter(|name| !is_ignored(&name.name)).map(|name| {
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
        if missing == &above[0] && self.glob.is_none() {
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

    /// A path for messages: relative to the manifest's folder if it lies inside it.
    fn shown(&self, path: &Path) -> String {
        let (plain, base) = (resolved(path), resolved(&self.base));
        match plain.strip_prefix(&base) {
            Ok(below) if below.as_os_str().is_empty() => plain.display().to_string(),
            Ok(below) => below.display().to_string(),
            Err(_) => plain.display().to_string(),
        }
    }
}

impl Pattern {
    fn parse(glob: &str) -> Result<Self, String> {
        let matcher = |glob: &str| {
            let mut builder = GlobBuilder::new(glob);
            let builder = builder.literal_separator(true).backslash_escape(false);
            builder.build().map(|glob| glob.compile_matcher()).map_err(|error| error.kind().to_string())
        };
        let whole = matcher(glob)?;
        let globs = alternatives(glob);
        let alternatives: Vec<Vec<&str>> = globs.iter().map(|glob| parts(glob)).collect();
        let deep = glob.contains("**");
        let mut levels = Vec::new();
        for level in 0.. {
            // The last part matches files.
            let folders = alternatives.iter().filter_map(|parts| parts[..parts.len() - 1].get(level));
            let folders: Vec<&str> = folders.copied().collect();
            // From the first part that may match several folders on, a level is not known.
            if folders.is_empty() || folders.iter().any(|part| part.contains('/') || part.contains("**")) {
                break;
            }
            levels.push(folders.into_iter().map(matcher).collect::<Result<_, _>>()?);
        }
        let deepest = globs.iter().map(|glob| glob.matches('/').count()).max().unwrap_or_default();
        Ok(Self { whole, levels, depth: (!deep).then_some(deepest) })
    }

    /// Whether files in a folder of this name, at this level, can match.
    fn enters(&self, name: &OsStr, level: usize, link: bool) -> bool {
        match self.depth {
            Some(depth) if level >= depth => return false,
            None if link => return false,
            _ => {}
        }
        self.levels.get(level).is_none_or(|folders| folders.iter().any(|matcher| matcher.is_match(name)))
    }
}

/// A glob without braces around a `/`: `{a/*,b/c}.exr` is `a/*.exr` or `b/c.exr`. If it is more than
/// [`MOST_ALTERNATIVES`], or not a valid glob, it is returned as it is.
fn alternatives(glob: &str) -> Vec<String> {
    let mut open = vec![glob.to_owned()];
    let mut found = Vec::new();
    while let Some(next) = open.pop() {
        match braces_around_a_slash(&next) {
            None => found.push(next),
            Some((place, choices)) => {
                let whole = |choice: String| [&next[..place.start], &choice, &next[place.end..]].concat();
                open.extend(choices.into_iter().map(whole));
            }
        }
        if found.len() + open.len() > MOST_ALTERNATIVES {
            return vec![glob.to_owned()];
        }
    }
    found
}

/// The first outer braces around a `/`: their place, and what they choose from.
fn braces_around_a_slash(glob: &str) -> Option<(Range<usize>, Vec<String>)> {
    let (mut start, mut depth, mut in_brackets) = (0, 0_usize, false);
    let mut commas = Vec::new();
    for (index, byte) in glob.bytes().enumerate() {
        match byte {
            b']' => in_brackets = false,
            _ if in_brackets => {}
            b'[' => in_brackets = true,
            b'{' => {
                if depth == 0 {
                    (start, commas) = (index, vec![index]);
                }
                depth += 1;
            }
            b',' if depth == 1 => commas.push(index),
            b'}' if depth > 0 => {
                depth -= 1;
                if depth == 0 && glob[start..index].contains('/') {
                    commas.push(index);
                    let choices = commas.windows(2).map(|pair| glob[pair[0] + 1..pair[1]].to_owned());
                    return Some((start..index + 1, choices.collect()));
                }
            }
            _ => {}
        }
    }
    None
}

/// The parts of a glob between the `/` that are not inside braces or brackets.
fn parts(glob: &str) -> Vec<&str> {
    let (mut depth, mut start, mut parts) = (0_usize, 0, Vec::new());
    for (index, byte) in glob.bytes().enumerate() {
        match byte {
            b'{' | b'[' => depth += 1,
            b'}' | b']' => depth = depth.saturating_sub(1),
            b'/' if depth == 0 => {
                parts.push(&glob[start..index]);
                start = index + 1;
            }
            _ => {}
        }
    }
    parts.push(&glob[start..]);
    parts
}

/// Whether a name is hidden, or that of a file that editors and downloads put beside another.
fn is_ignored(name: &OsStr) -> bool {
    const ENDINGS: [&str; 8] = ["~", ".swp", ".swo", ".swx", ".bak", ".tmp", ".orig", ".part"];
    let name = name.to_string_lossy();
    let lower = name.to_ascii_lowercase();
    name.starts_with('.')
        || ENDINGS.iter().any(|ending| lower.ends_with(ending))
        || (name.starts_with('#') && name.ends_with('#'))
}

/// A path without `.` and, as far as possible without the disk, without `..`: to compare and show, not to
/// open.
pub(crate) fn resolved(path: &Path) -> PathBuf {
    let mut plain = PathBuf::new();
    for part in path.components() {
        match part {
            Component::CurDir => {}
            Component::ParentDir if matches!(plain.components().next_back(), Some(Component::Normal(_))) => {
                plain.pop();
            }
            _ => plain.push(part),
        }
    }
    plain
}

/// The first names of a list, and the number of the others.
pub(crate) fn listed<S: ToString>(names: impl IntoIterator<Item = S, IntoIter: ExactSizeIterator>) -> String {
    const SHOWN: usize = 8;
    let names = names.into_iter();
    let more = names.len().saturating_sub(SHOWN);
    let mut text = names.take(SHOWN).map(|name| name.to_string()).collect::<Vec<_>>().join(", ");
    if more > 0 {
        text += &format!(" and {more} more");
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn braces_around_a_slash_are_taken_apart() {
        for (glob, expected) in [
            ("*.{exr,hdr}", &["*.{exr,hdr}"][..]),
            ("{a/x,b/c/y}.exr", &["a/x.exr", "b/c/y.exr"]),
            ("d/{a/{x,y},b/z}", &["d/a/{x,y}", "d/b/z"]),
            ("{a/[{,]/x,b}", &["a/[{,]/x", "b"]),
            ("{a/b", &["{a/b"]),
        ] {
            let mut found = alternatives(glob);
            found.sort();
            assert_eq!(found, expected, "{glob}");
        }
        let many = "{a/,b/,c/,d/}".repeat(6);
        assert_eq!(alternatives(&many), std::slice::from_ref(&many));
    }

    #[test]
    fn only_the_folders_of_files_that_are_named_are_entered() {
        let pattern = Pattern::parse("{sky/noon.hdr,lab/light/lamp.hdr}").unwrap();
        let enters = |level: usize, name: &str| pattern.enters(OsStr::new(name), level, false);
        assert!(enters(0, "sky") && enters(0, "lab") && enters(1, "light"));
        assert!(!enters(0, "light") && !enters(0, "other") && !enters(1, "sky") && !enters(2, "light"));
        assert!(pattern.whole.is_match("lab/light/lamp.hdr") && !pattern.whole.is_match("sky/lamp.hdr"));
        let deep = Pattern::parse("{sky/**/*.hdr,lab/*.hdr}").unwrap();
        let enters = |level: usize, name: &str| deep.enters(OsStr::new(name), level, false);
        assert!(enters(0, "sky") && !enters(0, "other") && enters(5, "anything"));
    }
}
