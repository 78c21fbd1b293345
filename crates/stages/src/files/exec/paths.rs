//! The files and folders of the project that a command line names.
//!
//! A whole argument may be a path, an option may end in one (`--lut=tools/film.cube`), and `{folder}/...` is
//! one wherever it stands, such as in a line of shell. What follows `{folder}/` ends at the last place where
//! a word may end so that the path exists, because names may hold spaces; if none exists, at the first one.

use std::path::{Path, PathBuf};

use engine::{ItemFiles, NamedPath};

use super::command::{Command, Piece};

/// A mention of a path in an argument.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum Mention {
    /// The argument names this path. A relative one is taken from the manifest's folder.
    Path(PathBuf),
    /// The argument is a line of shell that runs this program.
    Program(PathBuf),
    /// The argument names something below this path, but what cannot be told; empty for the manifest's
    /// folder.
    Below(PathBuf),
    /// The argument holds a word that would be this file if it were read from the manifest's folder.
    Word(PathBuf),
}

/// A look at which paths exist, for finding the ends of paths.
pub(super) trait Exists {
    fn is_file(&self, path: &Path) -> bool;
    fn is_folder(&self, path: &Path) -> bool;

    /// Whether an absolute path lies in the manifest's folder.
    fn is_in_project(&self, path: &Path) -> bool;

    fn exists(&self, path: &Path) -> bool {
        self.is_file(path) || self.is_folder(path)
    }
}

impl Exists for ItemFiles<'_> {
    fn is_file(&self, path: &Path) -> bool {
        self.resolve(path).is_file()
    }

    fn is_folder(&self, path: &Path) -> bool {
        self.resolve(path).is_dir()
    }

    fn is_in_project(&self, path: &Path) -> bool {
        path.starts_with(self.resolve(Path::new("")))
    }
}

/// Nothing exists: paths end at the first place where they may.
pub(super) struct Nothing;

impl Exists for Nothing {
    fn is_file(&self, _: &Path) -> bool {
        false
    }

    fn is_folder(&self, _: &Path) -> bool {
        false
    }

    fn is_in_project(&self, _: &Path) -> bool {
        false
    }
}

/// The paths that an argument mentions; the program is one too.
pub(super) fn mentions(pieces: &[Piece], disk: &dyn Exists) -> Vec<Mention> {
    if let Some(path) = whole(pieces).filter(|path| disk.exists(path) || is_like_a_path(pieces)) {
        return vec![Mention::Path(path)];
    }
    if let Some(path) = value(pieces, disk) {
        return vec![Mention::Path(path)];
    }
    let mut found = Vec::new();
    // What belongs to a path after {folder} is not a word of its own.
    let mut rest = "";
    for (index, piece) in pieces.iter().enumerate() {
        match (piece, pieces.get(index + 1)) {
            (Piece::Folder, next) => {
                let after = if let Some(Piece::Text(text)) = next { text } else { "" };
                let (mention, left) = below_folder(pieces, index, after, disk);
                found.extend(mention);
                rest = left;
                continue;
            }
            (Piece::Text(text), _) if index == 0 || pieces[index - 1] != Piece::Folder => rest = text,
            (Piece::Text(_), _) => {}
            _ => continue,
        }
        for word in rest.split(ends_a_word) {
            let path = Path::new(word);
            let is_here = path.is_relative() || disk.is_in_project(path);
            if word.contains(['/', '.']) && is_here && disk.is_file(path) {
                found.push(Mention::Word(path.into()));
            }
        }
    }
    found
}

/// The paths that a command line names, as far as can be told without a look at the disk.
pub(super) fn spelled(command: &Command) -> impl Iterator<Item = NamedPath> {
    let arguments = std::iter::once(command.program()).chain(command.arguments()).enumerate();
    arguments.flat_map(|(index, pieces)| {
        let named = |path: PathBuf, is_word: bool| NamedPath {
            parameter: "command",
            index,
            path,
            is_word,
            is_read_whole: false,
        };
        let found = mentions(pieces, &Nothing).into_iter().filter_map(|mention| match mention {
            Mention::Path(path) | Mention::Program(path) => Some(path),
            Mention::Below(path) => Some(path).filter(|path| !path.as_os_str().is_empty()),
            Mention::Word(_) => None,
        });
        let mut found = found.map(|path| named(path, false)).collect::<Vec<_>>();
        // A program without a `/` is looked up in PATH.
        let word = whole(pieces).filter(|path| path.components().count() == 1 && index > 0);
        if let (Some(word), true) = (word, found.is_empty()) {
            found.push(named(word, true));
        }
        found
    })
}

/// The path that a whole argument may be: relative to the manifest's folder, or absolute. An option is none.
pub(super) fn whole(pieces: &[Piece]) -> Option<PathBuf> {
    match pieces {
        // The program's working folder is not in the project.
        [Piece::Text(text)] if text == "." || text == ".." => None,
        [Piece::Text(text)] => (!text.is_empty() && !text.starts_with('-')).then(|| text.into()),
        [Piece::Folder, Piece::Text(rest)] => {
            let rest = rest.strip_prefix('/')?.trim_start_matches('/');
            (!rest.is_empty()).then(|| rest.into())
        }
        _ => None,
    }
}

/// Whether the path that [`whole`] finds looks like one: `tools/grade.py`, but not `0.5` or a line of shell.
fn is_like_a_path(pieces: &[Piece]) -> bool {
    match pieces {
        [Piece::Text(text)] => text.contains(['/', '.']) && is_one_path(text) && text.parse::<f64>().is_err(),
        [Piece::Folder, Piece::Text(rest)] => is_one_path(rest),
        _ => false,
    }
}

fn is_one_path(text: &str) -> bool {
    !text.contains(|c| ends_a_word(c) || is_special(c)) && !text.contains("://")
}

/// The path after the `=` of an argument such as `--lut=tools/film.cube`.
fn value(pieces: &[Piece], disk: &dyn Exists) -> Option<PathBuf> {
    let [Piece::Text(text)] = pieces else { return None };
    let (name, value) = text.split_once('=')?;
    let is_name = name.chars().all(|c| c.is_ascii_alphanumeric() || c == '-' || c == '_');
    let path = Path::new(value);
    // A mode may have the name of a folder, but no `/`.
    let is_there = disk.is_file(path) || (value.contains('/') && disk.is_folder(path));
    (is_name && !value.is_empty() && (is_there || value.contains('/') && is_one_path(value)))
        .then(|| path.into())
}

/// The path that the text after the placeholder `{folder}` at an index names, and the rest of the text.
fn below_folder<'t>(
    pieces: &[Piece],
    index: usize,
    after: &'t str,
    disk: &dyn Exists,
) -> (Option<Mention>, &'t str) {
    let before = index.checked_sub(1).and_then(|before| match &pieces[before] {
        Piece::Text(text) => Some(text.as_str()),
        _ => None,
    });
    let before = before.map(|text| text.trim_end_matches(['"', '\'', ' ', '\t']));
    // What a shell writes is not read.
    if before.is_some_and(|text| text.ends_with('>')) {
        return (None, after.trim_start_matches(|c| !ends_a_word(c)));
    }
    // In a shell, "{folder}"/tools is a path too.
    let after = after.strip_prefix(['"', '\'']).filter(|rest| rest.starts_with('/')).unwrap_or(after);
    let rest = after.trim_start_matches('/');
    let is_end = |c: char| ends_a_word(c) || is_special(c);
    if rest.len() == after.len() || rest.is_empty() || rest.starts_with(is_end) {
        return (Some(Mention::Below(PathBuf::new())), rest);
    }
    let goes_on = pieces.len() > index + 2;
    let ends = rest.char_indices().filter(|(_, c)| is_end(*c)).map(|(end, c)| (end, is_special(c)));
    let ends = ends.chain([(rest.len(), goes_on)]).collect::<Vec<_>>();
    let existing = ends.iter().rev().find(|(end, _)| disk.exists(Path::new(&rest[..*end])));
    // The value of an option has no end, unless it is a list.
    let is_value = before.is_some_and(|text| text.ends_with('=') && !text.contains(char::is_whitespace))
        && !goes_on
        && !rest.contains(|c: char| is_end(c) && !c.is_whitespace());
    let first = if is_value { ends.last() } else { ends.first() };
    let (end, is_open) = existing.or(first).copied().unwrap_or((rest.len(), goes_on));
    let (path, rest) = rest.split_at(end);
    let mention = match is_open {
        // The last name is not complete: `{folder}/luts/film_$n.cube`.
        true => Mention::Below(path.rfind('/').map_or("", |slash| &path[..slash]).into()),
        false if is_run(before, rest, index) => Mention::Program(path.into()),
        false => Mention::Path(path.into()),
    };
    (Some(mention), rest)
}

/// Whether a shell runs the path that stands between two texts: it is the first word of a command.
fn is_run(before: Option<&str>, after: &str, index: usize) -> bool {
    match before {
        Some("") => after.starts_with(ends_a_word),
        Some(text) => text.ends_with([';', '|', '&', '(', '`', '\n']),
        None => index == 0 && after.starts_with(|c: char| ends_a_word(c) && !",:=".contains(c)),
    }
}

/// Whether a word ends at a character, for a shell or in a list.
fn ends_a_word(c: char) -> bool {
    c.is_whitespace() || "\"';()|&<>,:=`".contains(c)
}

/// Whether a shell replaces a character, so that what it stands for cannot be told.
fn is_special(c: char) -> bool {
    "$*?[{\\".contains(c)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::files::exec::command::pieces;

    struct Files(&'static [&'static str]);

    impl Exists for Files {
        fn is_in_project(&self, path: &Path) -> bool {
            path.starts_with("/project")
        }

        fn is_file(&self, path: &Path) -> bool {
            self.0.iter().any(|file| Path::new(file) == path)
        }

        fn is_folder(&self, path: &Path) -> bool {
            self.0.iter().any(|file| Path::new(file) != path && Path::new(file).starts_with(path))
        }
    }

    const FILES: Files = Files(&[
        "tools/run.sh",
        "tools/film.cube",
        "tools/my lut.cube",
        "tools/my run.sh",
        "luts/a.cube",
        "grade",
        "run.sh",
    ]);

    fn found(argument: &str) -> String {
        let shown = mentions(&pieces(argument).unwrap(), &FILES).into_iter().map(|mention| match mention {
            Mention::Path(path) => path.display().to_string(),
            Mention::Program(path) => format!("run {}", path.display()),
            Mention::Below(path) => format!("below {}/", path.display()),
            Mention::Word(path) => format!("word {}", path.display()),
        });
        shown.collect::<Vec<_>>().join(" + ")
    }

    #[test]
    fn paths_are_found_in_arguments() {
        for (argument, expected) in [
            // Whole arguments.
            ("tools/run.sh", "tools/run.sh"),
            ("./tools/run.sh", "./tools/run.sh"),
            ("grade", "grade"),
            ("luts", "luts"),
            ("tools/my lut.cube", "tools/my lut.cube"),
            ("tools/missing.cube", "tools/missing.cube"),
            ("/opt/missing.cube", "/opt/missing.cube"),
            ("{folder}/tools/run.sh", "tools/run.sh"),
            ("{folder}//tools/run.sh", "tools/run.sh"),
            ("{folder}/luts", "luts"),
            ("{folder}/luts/", "luts/"),
            ("{folder}/missing", "missing"),
            // Options.
            ("--lut={folder}/tools/film.cube", "tools/film.cube"),
            ("--lut={folder}/tools/my lut.cube", "tools/my lut.cube"),
            ("--lut={folder}/missing.cube", "missing.cube"),
            ("--lut={folder}/a missing.cube", "a missing.cube"),
            ("--lut=tools/film.cube", "tools/film.cube"),
            ("--lut=tools/missing.cube", "tools/missing.cube"),
            ("lut=grade", "grade"),
            ("--dir=luts/", "luts/"),
            ("--mode=luts", ""),
            ("-I{folder}/luts", "luts"),
            ("{folder}/luts/a.cube:{folder}/tools/film.cube", "luts/a.cube + tools/film.cube"),
            ("{folder}/missing,{folder}/tools/film.cube", "missing + tools/film.cube"),
            // Lines of shell.
            ("{folder}/tools/run.sh {input} {output}", "run tools/run.sh"),
            ("sh '{folder}/tools/run.sh' > {output}", "tools/run.sh"),
            ("sh \"{folder}/tools/my lut.cube\" > {output}", "tools/my lut.cube"),
            ("sh \"{folder}\"/tools/run.sh", "tools/run.sh"),
            ("(cd {folder}/luts; ls) | {folder}/tools/run.sh", "luts + run tools/run.sh"),
            ("\"{folder}/tools/my run.sh\" $1", "run tools/my run.sh"),
            ("\"{folder}\"/tools/run.sh; true", "run tools/run.sh"),
            ("cd / && {folder}/tools/run.sh", "run tools/run.sh"),
            ("{folder}/tools/run.sh; {folder}/missing $1", "run tools/run.sh + run missing"),
            ("cat `{folder}/tools/run.sh`&&true", "run tools/run.sh"),
            ("echo > {folder}/log; true", ""),
            ("echo >>\"{folder}/log\"", ""),
            // What cannot be told.
            ("{folder}", "below /"),
            ("--root={folder}", "below /"),
            ("cd {folder} && make", "below /"),
            ("cat {folder}/luts/$n.cube", "below luts/"),
            ("cat {folder}/luts/*.cube", "below luts/"),
            ("cat {folder}/luts/film_${{n}}.cube", "below luts/"),
            ("cat {folder}/$n", "below /"),
            ("{folder}/luts/{input}", "below luts/"),
            ("tools/run.sh {input} {output}", "word tools/run.sh"),
            ("sh tools/run.sh; run.sh grade", "word tools/run.sh + word run.sh"),
            ("tools/run.sh,{folder}/tools/run.sh", "word tools/run.sh + tools/run.sh"),
            // No paths.
            ("{input}", ""),
            ("{output}", ""),
            ("--stops", ""),
            ("0.5", ""),
            ("", ""),
            ("--url=http://example.com/a", ""),
            ("cp $0 $1", ""),
            (".", ""),
        ] {
            assert_eq!(found(argument), expected, "{argument}");
        }
    }
}
