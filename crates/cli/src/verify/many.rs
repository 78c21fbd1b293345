//! Many files at once: folders, globs, or the whole of `out`.

use std::collections::HashSet;
use std::fs;
use std::path::{Path, PathBuf};

use engine::{
    ContentState, FilesToVerify, MissingFile, OutVerification, Plan, RecipeState, Verification, path_text,
};
use globset::GlobMatcher;
use serde_json::json;

use super::{changed, in_place, unreadable, verdict};
use crate::command_error::CommandError;
use crate::exit::Exit;
use crate::globs::{self, files_below, matcher, slashed};
use crate::lists::{NAMED, SHOWN, list, more};
use crate::print;
use crate::quantity::count;

/// Prints how these files are, or all of `out`; returns whether all are current.
pub(super) fn verify(plan: &Plan, files: &[PathBuf], json: bool) -> Result<(Exit, bool), CommandError> {
    let wanted = Wanted::of(plan, files)?;
    let is_wanted =
        |name: &str| wanted.files.contains(name) || wanted.parts.iter().any(|part| part.has(name));
    let files = FilesToVerify { in_out: &is_wanted, elsewhere: wanted.elsewhere };
    let found = engine::verify_out(plan, &files, &containers::read_recipe)?;
    let is_current = found.is_current();
    let printed = match json {
        true => print::json(json!({ "current": is_current, "verifications": found })),
        false => print::data(&describe(&found)),
    };
    Ok((printed, is_current))
}

/// The files that the arguments ask for.
#[derive(Default)]
struct Wanted {
    /// Files of `out`, by their names there.
    files: HashSet<String>,
    /// Folders and globs of `out`, and the whole of it.
    parts: Vec<InOut>,
    elsewhere: Vec<PathBuf>,
}

/// A part of `out`, by its names there.
enum InOut {
    All,
    File(String),
    Folder(String),
    Glob(GlobMatcher),
}

impl InOut {
    /// The file or folder with this name, which is that of `out` itself if it is empty.
    fn of(name: String, is_folder: bool) -> Self {
        match is_folder {
            true if name.is_empty() => Self::All,
            true => Self::Folder(name + "/"),
            false => Self::File(name),
        }
    }

    fn has(&self, name: &str) -> bool {
        match self {
            Self::All => true,
            Self::File(file) => name == file,
            Self::Folder(folder) => name.starts_with(folder.as_str()),
            Self::Glob(glob) => glob.is_match(name),
        }
    }
}

impl Wanted {
    fn of(plan: &Plan, arguments: &[PathBuf]) -> Result<Self, CommandError> {
        let mut wanted = Self::default();
        if arguments.is_empty() {
            wanted.insert(InOut::All);
        }
        for argument in arguments {
            if is_glob(plan, argument) {
                wanted.add_glob(plan, argument)?;
            } else {
                wanted.add(plan, argument)?;
            }
        }
        Ok(wanted)
    }

    fn insert(&mut self, part: InOut) {
        match part {
            InOut::File(name) => _ = self.files.insert(name),
            part => self.parts.push(part),
        }
    }

    /// Adds a file or a folder.
    fn add(&mut self, plan: &Plan, argument: &Path) -> Result<(), CommandError> {
        let place = in_place(plan, argument);
        let names = engine::names_in_out(plan, &place);
        if !names.is_empty() && place.exists() {
            names.into_iter().for_each(|name| self.insert(InOut::of(name, place.is_dir())));
            return Ok(());
        }
        if let Some(gone) = exported(plan, argument) {
            self.insert(gone);
        } else if place.is_dir() {
            self.elsewhere.extend(files_below(&place));
        } else {
            fs::metadata(&place).map_err(|error| unreadable(&place, &error))?;
            self.elsewhere.push(place);
        }
        Ok(())
    }

    /// Adds the files of a glob: those of `out`, also by their names relative to it, or else others.
    fn add_glob(&mut self, plan: &Plan, argument: &Path) -> Result<(), CommandError> {
        let (folder, rest) = globs::parts(argument);
        let in_out = engine::names_in_out(plan, &folder);
        let names = if in_out.is_empty() { vec![slashed(&folder)] } else { in_out };
        let files = files_below(&plan.out);
        let files = files.iter().filter_map(|file| file.strip_prefix(&plan.out).ok()).map(slashed);
        let exported = plan.items.iter().flat_map(|item| item.files.iter().cloned());
        let files = files.chain(exported).collect::<Vec<_>>();
        for name in names {
            let glob = matcher(&if name.is_empty() { rest.clone() } else { format!("{name}/{rest}") })?;
            if files.iter().any(|file| glob.is_match(file)) {
                self.insert(InOut::Glob(glob));
                return Ok(());
            }
        }
        let others = globs::matching(argument)?;
        if others.is_empty() {
            return Err(CommandError::usage([format!("no file matches {}", path_text(argument))]));
        }
        self.elsewhere.extend(others);
        Ok(())
    }
}

/// The exported file, or the folder of exported files, that a path names even if it does not exist.
fn exported(plan: &Plan, path: &Path) -> Option<InOut> {
    let names =
        [path.to_path_buf(), plan.out.join(path)].map(|path| engine::names_in_out(plan, &path)).concat();
    let files = || plan.items.iter().flat_map(|item| &item.files);
    names.into_iter().find_map(|name| {
        let folder = format!("{name}/");
        match files().find(|file| **file == name || file.starts_with(&folder))? {
            file if *file == name => Some(InOut::of(name, false)),
            _ => Some(InOut::of(name, true)),
        }
    })
}

/// Whether a path stands for the files below it, or for those that match it.
pub(super) fn is_many(plan: &Plan, path: &Path) -> bool {
    let is_folder = || matches!(exported(plan, path), Some(InOut::Folder(_)));
    in_place(plan, path).is_dir() || is_glob(plan, path) || is_folder()
}

/// Whether a path is a glob: it has one of its characters, and nothing has it as name.
fn is_glob(plan: &Plan, path: &Path) -> bool {
    globs::is_glob(path) && !in_place(plan, path).exists()
}

/// A line for each file that is not current, and a summary.
fn describe(found: &OutVerification) -> String {
    let OutVerification { files, missing, unreadable, left_over, unknown } = found;
    let is_altered = |file: &&Verification| {
        matches!(file.content, ContentState::Altered { .. })
            || matches!(file.recipe, RecipeState::Differs { .. })
    };
    let differing = files.iter().filter(|file| !file.is_current()).collect::<Vec<_>>();
    let (altered, stale): (Vec<_>, Vec<_>) = differing.into_iter().partition(is_altered);
    let (gone, unmade): (Vec<_>, Vec<_>) = missing.iter().partition(|file| file.was_published);
    let line = |file: &&Verification| format!("{}: {}", path_text(&file.file), brief(file));
    let absent = |state: &str| {
        let state = state.to_owned();
        move |missing: &&MissingFile| format!("{}: {state} ({})", path_text(&missing.file), missing.item)
    };
    let states = [
        ("altered", altered.iter().map(line).collect::<Vec<_>>()),
        ("stale", stale.iter().map(line).collect()),
        ("gone", gone.iter().map(absent("gone since it was published; a build restores it")).collect()),
        ("not published yet", unmade.iter().map(absent("not published yet")).collect()),
        (
            "unreadable",
            unreadable.iter().map(|(file, error)| format!("{file}: cannot be read: {error}")).collect(),
        ),
        (
            "left over",
            left_over.iter().map(|file| format!("{file}: left over: nothing exports it any more")).collect(),
        ),
        (
            "not published by this manifest",
            unknown.iter().map(|file| format!("{file}: not published by this manifest")).collect(),
        ),
    ];
    let mut text = String::new();
    let current = files.len() - altered.len() - stale.len();
    let mut counts = vec![format!("{current} current")];
    for (state, lines) in &states {
        lines.iter().take(SHOWN).for_each(|line| text += &format!("{line}\n"));
        let more = more(lines.len().saturating_sub(SHOWN), "more file");
        more.iter().for_each(|more| text += &format!("{more} {state}; --json lists all\n"));
        if !lines.is_empty() {
            counts.push(format!("{} {state}", lines.len()));
        }
    }
    let all = states.iter().map(|(_, lines)| lines.len()).sum::<usize>() + current;
    text + &format!("{}: {}\n", count(all, "file"), counts.join(", "))
}

/// The verdict on a file, with the sources that changed.
fn brief(file: &Verification) -> String {
    let sources = changed(file).map(|source| path_text(&source.path)).collect::<Vec<_>>();
    match verdict(file) {
        verdict if sources.is_empty() => verdict.into(),
        verdict => format!("{verdict} ({})", list(&sources, ", ", NAMED)),
    }
}
