//! A glob: which paths it matches, and which folders have to be searched for them.

use std::ffi::OsStr;
use std::ops::Range;
use std::path::Path;

use globset::{GlobBuilder, GlobMatcher};

/// Braces around a `/` are taken apart into at most this many globs.
const MAX_ALTERNATIVES: usize = 1024;

/// A glob that is matched against paths below the folder that it searches.
#[derive(Clone, Debug)]
pub(crate) struct Glob {
    whole: GlobMatcher,
    /// `whole` with the case ignored, to find the files that were meant and do not match.
    in_any_case: GlobMatcher,
    /// Patterns for the names of folders, level by level, as far as the glob restricts them: a name has to
    /// match one of its level.
    levels: Vec<Vec<GlobMatcher>>,
    /// The deepest level at which a file can match; `None` if the glob contains `**`.
    depth: Option<usize>,
}

impl Glob {
    /// # Errors
    /// If it is not valid: why.
    pub(crate) fn parse(glob: &str) -> Result<Self, String> {
        let build = |glob: &str, in_any_case: bool| {
            let mut builder = GlobBuilder::new(glob);
            let builder = builder.literal_separator(true).backslash_escape(false);
            let built = builder.case_insensitive(in_any_case).build();
            built.map(|glob| glob.compile_matcher()).map_err(|error| error.kind().to_string())
        };
        let matcher = |glob: &str| build(glob, false);
        let (whole, in_any_case) = (matcher(glob)?, build(glob, true)?);
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
        Ok(Self { whole, in_any_case, levels, depth: (!deep).then_some(deepest) })
    }

    /// Whether it matches a path below its folder.
    pub(crate) fn matches(&self, below: &Path) -> bool {
        self.whole.is_match(below)
    }

    /// Whether it would match a path below its folder if case were ignored.
    pub(crate) fn matches_in_any_case(&self, below: &Path) -> bool {
        self.in_any_case.is_match(below)
    }

    /// Whether files in a folder of this name, at this level, can match.
    pub(crate) fn enters(&self, name: &OsStr, level: usize, link: bool) -> bool {
        match self.depth {
            Some(depth) if level >= depth => return false,
            None if link => return false,
            _ => {}
        }
        self.levels.get(level).is_none_or(|folders| folders.iter().any(|matcher| matcher.is_match(name)))
    }
}

/// A glob without braces around a `/`: `{a/*,b/c}.exr` is `a/*.exr` or `b/c.exr`. If it is more than
/// [`MAX_ALTERNATIVES`], or not a valid glob, it is returned as it is.
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
        if found.len() + open.len() > MAX_ALTERNATIVES {
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

/// Whether no source has a file of this name: it is hidden, or editors, downloads and systems left it there.
pub(crate) fn is_ignored_file(name: &OsStr) -> bool {
    /// The file with which Vim tests whether a folder can be written, and what Windows keeps in a folder.
    const NAMES: [&str; 4] = ["4913", "thumbs.db", "ehthumbs.db", "desktop.ini"];
    let lower = name.to_string_lossy().to_ascii_lowercase();
    // Office locks a document by a file `~$name`.
    is_leftover(&lower) || lower.starts_with("~$") || NAMES.contains(&lower.as_str())
}

/// Whether no source is in a folder of this name: it is hidden, or a system keeps its own files there.
pub(crate) fn is_ignored_folder(name: &OsStr) -> bool {
    /// The folders of Synology's and QNAP's servers, of Windows and of Linux' file systems.
    const NAMES: [&str; 6] =
        ["__macosx", "@eadir", "#recycle", "$recycle.bin", "system volume information", "lost+found"];
    let lower = name.to_string_lossy().to_ascii_lowercase();
    is_leftover(&lower) || NAMES.contains(&lower.as_str())
}

/// Whether a name in lower case is hidden, or that of a backup, or of a download or copy that is not
/// finished.
fn is_leftover(name: &str) -> bool {
    const ENDINGS: [&str; 18] = [
        "~",
        ".swp",
        ".swo",
        ".swx",
        ".bak",
        ".tmp",
        ".orig",
        ".part",
        ".partial",
        ".filepart",
        ".crdownload",
        ".opdownload",
        ".download",
        ".aria2",
        ".!qb",
        ".!ut",
        "___jb_tmp___",
        "___jb_old___",
    ];
    name.starts_with('.')
        || ENDINGS.iter().any(|ending| name.ends_with(ending))
        || (name.starts_with('#') && name.ends_with('#'))
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
        let pattern = Glob::parse("{sky/noon.hdr,lab/light/lamp.hdr}").unwrap();
        let enters = |level: usize, name: &str| pattern.enters(OsStr::new(name), level, false);
        assert!(enters(0, "sky") && enters(0, "lab") && enters(1, "light"));
        assert!(!enters(0, "light") && !enters(0, "other") && !enters(1, "sky") && !enters(2, "light"));
        let matches = |path: &str| pattern.matches(Path::new(path));
        assert!(matches("lab/light/lamp.hdr") && !matches("sky/lamp.hdr"));
        let deep = Glob::parse("{sky/**/*.hdr,lab/*.hdr}").unwrap();
        let enters = |level: usize, name: &str| deep.enters(OsStr::new(name), level, false);
        assert!(enters(0, "sky") && !enters(0, "other") && enters(5, "anything"));
    }
    #[test]
    fn what_editors_downloads_and_systems_leave_is_ignored() {
        let leftovers = [
            ".sky.hdr",
            "sky.hdr~",
            "#sky.hdr#",
            "~$sky.hdr",
            "sky.hdr.crdownload",
            "Sky.HDR.Partial",
            "sky.hdr.filepart",
            "sky.hdr___jb_tmp___",
            "4913",
            "Thumbs.db",
            "desktop.ini",
        ];
        for name in leftovers {
            assert!(is_ignored_file(OsStr::new(name)), "{name}");
        }
        for name in ["sky.hdr", "partial.hdr", "4913.hdr", "thumbs.db.hdr", "~sky.hdr", "download"] {
            assert!(!is_ignored_file(OsStr::new(name)), "{name}");
        }
        for name in [".git", "@eaDir", "$RECYCLE.BIN", "lost+found", "old~"] {
            assert!(is_ignored_folder(OsStr::new(name)), "{name}");
        }
        for name in ["4913", "sky", "download"] {
            assert!(!is_ignored_folder(OsStr::new(name)), "{name}");
        }
    }
}
