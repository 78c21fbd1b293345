//! What a stage's `source` names: a file, a folder, the files that a glob matches, or several of them.
//!
//! A glob is split at the last `/` before its first special character: the part before it is the folder to
//! search, and the part after it is matched against the paths below that folder. `*` and `?` do not match
//! `/`, `**` does, `{a,b}` are alternatives, and `[ab]` is a set. Matching is case-sensitive on every system,
//! so that a manifest means the same everywhere.
//!
//! `source = ["env/*.hdr", "!env/old_*"]` names several of them, and after a `!` what is left out.
//!
//! Hidden files and folders and what editors and downloads leave never match, and neither does anything in
//! `out`, wherever links lead, so that a build does not read its own exports. What cannot be looked at is an
//! error and not an absence, because the outputs of a source that is absent are removed.

use std::ops::Range;
use std::path::{Component, Path, PathBuf};
use std::sync::Arc;

use super::glob::{Glob, is_ignored_file, is_ignored_folder};
use super::manifest::{Declaration, Key, Written};
use crate::kinds::{Configured, ErasedKind, HOW_TO_READ_EXPORTS};
use crate::manifest::Diagnostic;
use crate::platform::path_text;

/// The `source` of a stage.
#[derive(Clone, Debug)]
pub struct Source {
    text: String,
    pub(super) span: Range<usize>,
    /// The manifest's folder.
    pub(super) base: PathBuf,
    /// The folder for exports, which is not searched. Without `..`.
    pub(super) out: Option<PathBuf>,
    pub(super) included: Vec<SourcePath>,
    pub(super) excluded: Vec<SourcePath>,
}

#[derive(Clone, Debug)]
pub(super) struct SourcePath {
    /// The path or glob, without the `!` of what is left out.
    pub(super) text: String,
    pub(super) span: Range<usize>,
    /// The folder that a glob searches, or the file or folder itself.
    pub(super) root: PathBuf,
    pub(super) glob: Option<Glob>,
}

/// A file or folder that makes one item, or something built in that does.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Asset {
    /// The file's name without its extension, the folder's name, or the name of what is built in.
    pub(crate) stem: Arc<str>,
    /// The absolute path; `None` for what is built in.
    pub(crate) path: Option<PathBuf>,
}

/// The source of a stage, or without one the name of the item that is built in. `base` and `out` are those of
/// [`Source::parse`].
pub(super) fn source_of(
    stage: &Declaration,
    kind: Option<&dyn ErasedKind>,
    configured: Option<&dyn Configured>,
    (base, out): (&Path, Option<&Path>),
    errors: &mut Vec<Diagnostic>,
) -> (Option<Source>, Option<String>) {
    let source = match (&stage.source, kind) {
        (Key::Given(written), Some(kind)) if !kind.has_source() => {
            let error = Diagnostic::at(written.span.clone(), format!("{} does not read files", kind.name()));
            let error = error.expected("expected no \"source\"");
            errors.push(match kind.ports().first() {
                Some(port) => {
                    let types = port.takes_text();
                    error.help(format!("connect a stage that makes {types}: input = \"STAGE\""))
                }
                None => error,
            });
            None
        }
        (Key::Given(written), _) => Source::parse(written, base, out, errors),
        (Key::Absent, Some(kind)) if kind.has_source() => {
            let parameter = kind.built_in_parameter();
            if let Some(entry) = parameter.and_then(|name| stage.parameters.get(name)) {
                // What is wrong with the parameters has been reported.
                let named = configured.map(Configured::built_in).unwrap_or(Ok(Some(String::new())));
                match named {
                    Ok(Some(name)) => return (None, Some(name)),
                    Ok(None) => {}
                    Err(message) => {
                        errors.push(Diagnostic::at(entry.value.span.clone(), message));
                        return (None, None);
                    }
                }
            }
            let message = format!("stage {:?} has no source", stage.name.value);
            let error = Diagnostic::at(stage.header.clone(), message);
            let error = error.expected("expected source = \"...\", a file, a folder or a glob");
            errors.push(match parameter {
                Some(name) => error.help(format!("or {name} = \"...\", the name of a built-in one")),
                None => error,
            });
            None
        }
        _ => None,
    };
    (source, None)
}

impl Source {
    /// Parses the paths and globs of a `source`, without looking at the disk.
    pub(crate) fn parse(
        written: &Written<Vec<Written<String>>>,
        base: &Path,
        out: Option<&Path>,
        errors: &mut Vec<Diagnostic>,
    ) -> Option<Self> {
        let before = errors.len();
        let (mut included, mut excluded) = (Vec::new(), Vec::new());
        for part in &written.value {
            match part.value.strip_prefix('!') {
                Some(text) => excluded.extend(SourcePath::parse(text, part, base, errors)),
                None => {
                    let path = SourcePath::parse(&part.value, part, base, errors);
                    included.extend(path.filter(|path| path.is_source(out, errors)));
                }
            }
        }
        if included.is_empty() && errors.len() == before {
            let error = Diagnostic::at(written.span.clone(), "the source lists nothing to read");
            errors.push(
                error
                    .expected("expected a file, a folder or a glob")
                    .help("to leave files out: source = [\"sky/*.hdr\", \"!sky/old_*\"]"),
            );
        }
        let text = written.value.iter().map(|part| part.value.as_str()).collect::<Vec<_>>().join(", ");
        let (span, out) = (written.span.clone(), out.map(resolved));
        (errors.len() == before).then(|| Self { text, span, base: base.into(), out, included, excluded })
    }

    /// The source as it is written in the manifest; several paths are separated by commas.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// The folders that are searched, or that contain the file or folder itself. Absolute.
    pub fn folders(&self) -> impl Iterator<Item = &Path> {
        self.included.iter().filter_map(|path| match path.glob {
            Some(_) => Some(path.root.as_path()),
            None => path.root.parent(),
        })
    }

    /// Whether a file that appears, changes or disappears at this absolute path concerns the source.
    pub fn concerns(&self, path: &Path) -> bool {
        self.included.iter().any(|included| match &included.glob {
            None => path.starts_with(&included.root),
            Some(glob) => path.strip_prefix(&included.root).is_ok_and(|below| {
                glob.matches(below)
                    && !below.file_name().is_some_and(is_ignored_file)
                    && !below.iter().rev().skip(1).any(is_ignored_folder)
                    && !self.is_in_out(path)
            }),
        }) && !self.excludes(path)
    }

    /// Whether a folder that appears at this absolute path is searched.
    pub(crate) fn searches(&self, path: &Path) -> bool {
        self.included.iter().any(|included| {
            let (Some(glob), Ok(below)) = (&included.glob, path.strip_prefix(&included.root)) else {
                return false;
            };
            below
                .iter()
                .enumerate()
                .all(|(level, name)| !is_ignored_folder(name) && glob.enters(name, level, false))
        }) && !self.is_in_out(path)
            && !self.excludes(path)
    }

    pub(super) fn excludes(&self, path: &Path) -> bool {
        self.excluded.iter().any(|excluded| excluded.covers(path))
    }

    fn is_in_out(&self, path: &Path) -> bool {
        self.out.as_ref().is_some_and(|out| resolved(path).starts_with(out))
    }

    /// A path for messages: relative to the manifest's folder if it lies inside it.
    pub(super) fn shown(&self, path: &Path) -> String {
        let (plain, base) = (resolved(path), resolved(&self.base));
        let text = match plain.strip_prefix(&base) {
            Ok(below) if below.as_os_str().is_empty() => path_text(plain),
            Ok(below) => path_text(below),
            Err(_) => path_text(plain),
        };
        shortened(text)
    }
}

impl SourcePath {
    /// Parses a path or glob; `written` is the whole entry, which may begin with a `!`.
    fn parse(
        text: &str,
        written: &Written<String>,
        base: &Path,
        errors: &mut Vec<Diagnostic>,
    ) -> Option<Self> {
        let span = written.span.clone();
        if text.is_empty() {
            errors.push(
                Diagnostic::at(span, "the source is empty").expected("expected a file, a folder or a glob"),
            );
            return None;
        }
        if text.contains('\\') {
            let error =
                Diagnostic::at(span, "a source cannot contain \\").expected("expected / between folders");
            errors.push(error.help(format!("write {:?}", written.value.replace('\\', "/"))));
            return None;
        }
        let special = text.find(['*', '?', '[', '{']);
        let (folder, glob) = match special {
            None => (text, None),
            Some(special) => {
                let split = text[..special].rfind('/').map_or(0, |slash| slash + 1);
                match Glob::parse(&text[split..]) {
                    Ok(glob) => (&text[..split], Some(glob)),
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
        let named = Path::new(folder).components().filter(|part| *part != Component::CurDir);
        Some(Self { text: text.into(), span, root: base.join(named.collect::<PathBuf>()), glob })
    }

    /// Whether a path can be read; otherwise reports why not.
    fn is_source(&self, out: Option<&Path>, errors: &mut Vec<Diagnostic>) -> bool {
        if out.is_some_and(|out| resolved(&self.root).starts_with(resolved(out))) {
            let message = format!("{:?} is inside \"out\", the folder for exports", self.text);
            errors.push(Diagnostic::at(self.span.clone(), message).help(HOW_TO_READ_EXPORTS));
            return false;
        }
        if self.glob.is_none() && is_folder_itself(&self.text) {
            let message = format!("{:?} does not end in a name, but its item needs one", self.text);
            errors.push(
                Diagnostic::at(self.span.clone(), message)
                    .expected("expected a file, a folder or a glob")
                    .help("name the folder: \"../faces\""),
            );
            return false;
        }
        true
    }

    /// Whether a path, or a folder that contains it, is one that this names.
    pub(super) fn covers(&self, path: &Path) -> bool {
        let (path, root) = (resolved(path), resolved(&self.root));
        let Ok(below) = path.strip_prefix(&root) else { return false };
        match &self.glob {
            None => true,
            Some(glob) => {
                let folders = below.ancestors().take_while(|above| !above.as_os_str().is_empty());
                folders.into_iter().any(|path| glob.matches(path))
            }
        }
    }
}

/// Whether a path without special characters names no file but a folder by its place: `.` or `../..`.
fn is_folder_itself(text: &str) -> bool {
    let last = Path::new(text).components().rfind(|part| *part != Component::CurDir);
    !matches!(last, Some(Component::Normal(_)))
}

/// The part of a path that a shell would expand: `~` or a variable.
pub(crate) fn unexpanded(text: &str) -> Option<&str> {
    let is_name = |c: char| c.is_ascii_alphanumeric() || c == '_';
    if text.starts_with('~') {
        return text.split('/').next();
    }
    let (start, sign) = text.char_indices().find(|(_, c)| matches!(c, '$' | '%'))?;
    let rest = &text[start + 1..];
    let name = rest.find(|c| !is_name(c)).unwrap_or(rest.len());
    let length = match sign {
        '%' if name > 0 && rest[name..].starts_with('%') => name + 1,
        '$' if rest.starts_with('{') => rest.find('}')? + 1,
        '$' => name,
        _ => 0,
    };
    (length > 0).then(|| &text[start..=start + length])
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

/// A long text without its middle.
fn shortened(text: String) -> String {
    const MAX_CHARACTERS: usize = 240;
    let count = text.chars().count();
    if count <= MAX_CHARACTERS {
        return text;
    }
    let half = MAX_CHARACTERS / 2;
    let start = text.chars().take(half);
    start.chain("...".chars()).chain(text.chars().skip(count - half)).collect()
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
    fn what_a_shell_would_expand_is_recognised() {
        for (text, expected) in [
            ("~/hdri/*.hdr", Some("~")),
            ("$HOME/hdri/*.hdr", Some("$HOME")),
            ("a/${STUDIO}/x", Some("${STUDIO}")),
            ("a/~/x", None),
            ("a/x~", None),
            ("price_$", None),
            ("a$/x", None),
            ("%USERPROFILE%/hdri", Some("%USERPROFILE%")),
            ("50%/x", None),
            ("~artist/x", Some("~artist")),
        ] {
            assert_eq!(unexpanded(text), expected, "{text}");
        }
    }
}
