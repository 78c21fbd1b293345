//! The parts of the outside world that belong to an item's key: the program, tool files, environment
//! variables.

use std::env;
use std::ffi::OsString;
use std::path::{Component, Path, PathBuf};

use engine::{
    Context, Diagnostic, Digest, Entry, Failure, ItemFiles, Parameter, Reporter, Value, ValueKind,
    canonicalize, path_text, unexpected,
};

use super::command::{Command, Piece};
use super::paths::Mention;
use super::{interpreter, paths};

/// The home folder in the scratch folder.
pub(super) const HOME: &str = "home";
/// The folder for temporary files in the scratch folder.
pub(super) const TEMPORARY: &str = "tmp";

/// Environment variables, with their values when the manifest was read.
///
/// The canonical form holds a digest, `NAME=0a1b...`: a value may be a secret, and recipes are published.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Variables(Vec<(String, Option<OsString>)>);

impl Parameter for Variables {
    fn expected() -> String {
        "an array of names of environment variables".into()
    }

    fn parse(value: &Value) -> Result<Self, Diagnostic> {
        let names = Vec::<String>::parse(value)?;
        match names.iter().find(|name| name.is_empty() || name.contains(['=', '\0'])) {
            Some(bad) => {
                Err(Diagnostic::at(value.span.clone(), format!("{bad:?} is not the name of a variable"))
                    .expected("expected only names, without values"))
            }
            None => Ok(Self(names.into_iter().map(|name| (name.clone(), env::var_os(name))).collect())),
        }
    }

    fn canonical(&self) -> serde_json::Value {
        let shown = |(name, value): &(String, Option<OsString>)| match value {
            Some(value) => format!("{name}={}", Digest::of(value.as_encoded_bytes())),
            None => name.clone(),
        };
        self.0.iter().map(shown).collect()
    }

    fn schema() -> serde_json::Value {
        serde_json::json!({ "type": "array", "items": { "type": "string", "minLength": 1 } })
    }
}

impl Variables {
    pub(super) fn is_empty(&self) -> bool {
        self.0.is_empty()
    }
}

/// The names and values of what another machine must have, sorted by name.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Platform(pub(super) Vec<(String, String)>);

impl Parameter for Platform {
    fn expected() -> String {
        "a table of texts".into()
    }

    fn parse(value: &Value) -> Result<Self, Diagnostic> {
        let ValueKind::Table(table) = &value.kind else { return Err(unexpected(value, &Self::expected())) };
        let property = |entry: &Entry| Ok((entry.key.clone(), String::parse(&entry.value)?));
        let mut properties = table.entries.iter().map(property).collect::<Result<Vec<_>, _>>()?;
        properties.sort_unstable();
        Ok(Self(properties))
    }

    fn canonical(&self) -> serde_json::Value {
        self.0.iter().map(|(name, value)| (name.clone(), serde_json::Value::from(value.as_str()))).collect()
    }

    fn schema() -> serde_json::Value {
        serde_json::json!({ "type": "object", "additionalProperties": { "type": "string" } })
    }
}

/// A variable of a program's environment.
pub(super) struct Variable {
    pub(super) name: OsString,
    pub(super) value: OsString,
    /// Whether messages may show the value: not if it is the user's.
    pub(super) is_shown: bool,
}

/// The environment of a program.
pub(super) fn environment(variables: &Variables, scratch: &Path, reporter: &Reporter) -> Vec<Variable> {
    let kept = ["PATH", "SystemRoot", "SystemDrive", "ComSpec", "PATHEXT"];
    let kept = if cfg!(windows) { &kept[..] } else { &kept[..1] };
    let variable =
        |name: &str, value: OsString, is_shown: bool| Variable { name: name.into(), value, is_shown };
    let mut environment: Vec<Variable> =
        kept.iter().filter_map(|name| Some(variable(name, env::var_os(name)?, false))).collect();
    for (name, folder) in [("HOME", HOME), ("TMPDIR", TEMPORARY), ("TEMP", TEMPORARY), ("TMP", TEMPORARY)] {
        environment.push(variable(name, scratch.join(folder).into(), true));
    }
    for (name, value) in [
        ("LANG", "C.UTF-8"),
        ("TZ", "UTC"),
        ("SOURCE_DATE_EPOCH", "0"),
        ("PYTHONHASHSEED", "0"),
        // Otherwise running a script would change the folders of its modules.
        ("PYTHONDONTWRITEBYTECODE", "1"),
    ] {
        environment.push(variable(name, value.into(), true));
    }
    for (name, value) in &variables.0 {
        match value {
            Some(value) => environment.push(variable(name, value.clone(), false)),
            None => reporter.warn(format!("the environment variable {name} is not set")),
        }
    }
    environment
}

/// The files that a command line uses, as far as they can be told.
pub(super) struct Tools<'t> {
    command: &'t Command,
    /// The parameter `tools`.
    listed: &'t [String],
    files: &'t ItemFiles<'t>,
    reporter: &'t Reporter,
    /// The warnings about the files that cannot be told.
    warnings: Vec<String>,
}

/// Reads everything that a command line and the parameter `tools` name, so that an edit of it reruns the
/// item. Returns the absolute path of the program's file, and warnings of arguments that may name more.
///
/// # Errors
/// If there is no such program, if something in `tools` cannot be read, or if one of the files is in the
/// folder for exports.
pub(super) fn read(
    command: &Command,
    tools: &[String],
    context: &Context<'_>,
) -> Result<(PathBuf, Vec<String>), Failure> {
    let Context { files, reporter, .. } = context;
    let mut read = Tools { command, listed: tools, files, reporter, warnings: Vec::new() };
    let program = read.program()?;
    read.arguments()?;
    read.listed()?;
    Ok((program, read.warnings))
}

impl Tools<'_> {
    /// The program's file and its interpreters.
    fn program(&mut self) -> Result<PathBuf, Failure> {
        let files = self.files;
        let written = super::filled(self.command.program(), &[], "", &files.resolve(Path::new("")));
        let name = Path::new(&written);
        let file = if name.components().count() > 1 || name.is_absolute() {
            files.resolve(name)
        } else {
            files.find_program(&written).map_err(|failure| {
                failure.help(
                    "install it, or write its path in command; a program beside the manifest is \"./NAME\"",
                )
            })?
        };
        let content = files.read(&file);
        let content =
            content.map_err(|failure| failure.context(format!("cannot run {}", path_text(name))))?;
        let mut is_known = interpreter::read_interpreters(content, files)?;
        if interpreter::is_env(&file) {
            let words = self.command.arguments().map(|pieces| match pieces.first() {
                Some(Piece::Text(text)) => text.as_str(),
                _ => "",
            });
            is_known &= interpreter::read_started_by_env(words, files)?;
        }
        if !is_known && self.listed.is_empty() {
            self.warnings.push(format!(
                "{}: cannot find out which program env starts, so the item does not rerun if it changes: \
                 list its file in tools = [...]",
                self.command.name()
            ));
        }
        Ok(file)
    }

    /// Adds the files and folders that the arguments name.
    fn arguments(&mut self) -> Result<(), Failure> {
        for (text, pieces) in self.command.shown_arguments() {
            let mentions = paths::mentions(pieces, self.files);
            if mentions.is_empty()
                && let Some(word) = paths::whole(pieces)
            {
                // It becomes a path as soon as something of this name exists.
                let _ = self.files.read(&word);
                self.files.is_folder(&word);
            }
            for mention in mentions {
                match mention {
                    Mention::Path(path) => self.named(&path, &text)?,
                    Mention::Program(path) => {
                        self.named(&path, &text)?;
                        if let Ok(content) = self.files.read(&path) {
                            interpreter::read_interpreters(content, self.files)?;
                        }
                    }
                    Mention::Below(path) => self.warn_of_folder(&path, &text),
                    Mention::Word(path) => self.warn_of_word(&path, &text),
                }
            }
        }
        Ok(())
    }

    /// A file or folder that an argument names. One that does not exist is recorded as missing, so that the
    /// item reruns when it appears.
    fn named(&mut self, path: &Path, argument: &str) -> Result<(), Failure> {
        if path.components().count() == 1 && self.files.is_out(path) {
            // A word that is the name of the folder for exports by chance.
            return Ok(());
        }
        self.files.check_not_exported(path)?;
        let file = self.files.resolve(path);
        if file.is_dir() {
            let is_inside = !path.starts_with("..") && file.starts_with(self.files.resolve(Path::new("")));
            let is_read = is_inside
                && !self.files.contains_exports(path)
                && self.folder_reader(Some(MAX_FILES)).read(path)?;
            if !is_read {
                self.warn_of_folder(path, argument);
            }
            return Ok(());
        }
        match self.files.read(path) {
            Err(failure) if file.is_file() || failure.cancelled => return Err(failure),
            // A folder may appear there.
            Err(_) => drop(self.files.is_folder(path)),
            Ok(_) => {}
        }
        Ok(())
    }

    /// Warns of a word that may be a path, unless `tools` lists it.
    fn warn_of_word(&mut self, path: &Path, argument: &str) {
        let project = self.files.resolve(Path::new(""));
        let path = path.strip_prefix(project).unwrap_or(path);
        if is_listed(path, self.listed) {
            return;
        }
        let shown = path_text(path);
        self.warnings.push(match self.files.check_not_exported(path) {
            Ok(()) => format!(
                "the argument {argument:?} contains {shown}, a file of the project that is not tracked: \
                 write {{folder}}/{shown}, or list it in tools = [...]"
            ),
            Err(_) => format!(
                "the argument {argument:?} contains {shown}, a file in \"out\": if the program reads it, \
                 connect the stage that makes it as an input; tools = [...] cannot list it"
            ),
        });
    }

    /// Warns of an argument that names an unknown part of a folder, unless `tools` lists the folder.
    fn warn_of_folder(&mut self, folder: &Path, argument: &str) {
        let is_project = folder.as_os_str().is_empty() || self.files.contains_exports(folder);
        if if is_project { !self.listed.is_empty() } else { is_listed(folder, self.listed) } {
            return;
        }
        let name = if is_project { "the manifest's folder".into() } else { path_text(folder) };
        self.warnings.push(format!(
            "the argument {argument:?} names {name}, but not the files that the program reads there, so an \
             edit of them does not rerun the item: list the files and folders in tools = [...]"
        ));
    }

    /// A reader of folders with at most this many files; without a limit, a file that cannot be read is an
    /// error.
    fn folder_reader(&self, limit: Option<usize>) -> FolderReader<'_> {
        let left = limit.unwrap_or(usize::MAX);
        let is_strict = limit.is_none();
        FolderReader { files: self.files, reporter: self.reporter, open: Vec::new(), left, is_strict }
    }

    /// The files and folders of the parameter `tools`.
    fn listed(&self) -> Result<(), Failure> {
        for tool in self.listed.iter().map(Path::new) {
            let read = if self.files.is_folder(tool) {
                self.folder_reader(None).read(tool).map(drop)
            } else {
                self.files.read(tool).map(drop)
            };
            read.map_err(|failure| match failure.help {
                Some(_) => failure,
                None => failure.help("tools: paths are relative to the manifest"),
            })?;
        }
        Ok(())
    }
}

/// Whether a path is among `tools`, or in a folder that is.
fn is_listed(path: &Path, tools: &[String]) -> bool {
    let plain =
        |path: &Path| path.components().filter(|part| *part != Component::CurDir).collect::<PathBuf>();
    tools.iter().any(|tool| plain(path).starts_with(plain(Path::new(tool))))
}

/// The file that a whole argument names, if it names one.
pub(super) fn named_file(pieces: &[Piece], files: &ItemFiles<'_>) -> Option<PathBuf> {
    paths::whole(pieces).map(|path| files.resolve(&path)).filter(|path| path.is_file())
}

/// The missing file that an argument names.
pub(super) fn absent(pieces: &[Piece], files: &ItemFiles<'_>) -> Option<PathBuf> {
    paths::mentions(pieces, files).into_iter().find_map(|mention| match mention {
        Mention::Path(path) => Some(files.resolve(&path)).filter(|path| !path.exists()),
        _ => None,
    })
}

/// An argument that names a folder with more files than this has to say in `tools` which ones matter.
const MAX_FILES: usize = 4096;

/// Reads the files in folders.
struct FolderReader<'c> {
    files: &'c ItemFiles<'c>,
    reporter: &'c Reporter,
    /// The folders above the present one, so that a link to one of them is not followed for ever.
    open: Vec<PathBuf>,
    /// The number of files that may still be read.
    left: usize,
    /// Whether a file that cannot be read is an error; otherwise that is recorded, and the program will tell.
    is_strict: bool,
}

impl FolderReader<'_> {
    /// Reads all files in a folder; returns whether those were not too many.
    fn read(&mut self, folder: &Path) -> Result<bool, Failure> {
        let path = self.files.resolve(folder);
        let real = canonicalize(&path).unwrap_or(path);
        if self.open.contains(&real) {
            return Ok(true);
        }
        self.open.push(real);
        let names = match self.files.list(folder) {
            Err(failure) if self.is_strict => return Err(failure),
            names => names.unwrap_or_default(),
        };
        for (name, is_folder) in names {
            if name.starts_with('.') || name == "__pycache__" || name.ends_with(".pyc") {
                continue;
            }
            self.reporter.check_cancelled()?;
            let path = folder.join(name);
            self.files.check_not_exported(&path)?;
            if is_folder {
                if !self.read(&path)? {
                    return Ok(false);
                }
            } else if self.left == 0 {
                return Ok(false);
            } else {
                self.left -= 1;
                match self.files.read(&path) {
                    Err(failure) if self.is_strict || failure.cancelled => return Err(failure),
                    _ => {}
                }
            }
        }
        self.open.pop();
        Ok(true)
    }
}

#[cfg(test)]
mod tests {
    use engine::ValueKind;

    use super::*;

    #[test]
    fn a_variables_value_is_part_of_the_key_by_its_digest() {
        let value = |kind| Value { span: 0..1, kind };
        let names = |names: &[&str]| {
            let names = names.iter().map(|name| value(ValueKind::String((*name).into()))).collect();
            Variables::parse(&value(ValueKind::Array(names)))
        };
        let canonical = names(&["CARGO_MANIFEST_DIR", "SPECULA_NOT_SET"]).unwrap().canonical();
        let digest = Digest::of(env!("CARGO_MANIFEST_DIR").as_bytes()).to_string();
        let expected = [format!("CARGO_MANIFEST_DIR={digest}"), "SPECULA_NOT_SET".into()];
        assert_eq!(canonical, serde_json::json!(expected));
        assert!(names(&["A=b"]).is_err() && names(&[""]).is_err());
    }
}
