//! The parts of the outside world that belong to an item's key: the program, tool files, environment
//! variables.

use std::env;
use std::ffi::{OsStr, OsString};
use std::path::{Path, PathBuf};

use engine::{Context, Diagnostic, Digest, Entry, Failure, Parameter, Value, ValueKind, unexpected};

use super::command::{Command, Piece};

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
                    .expected("expected names alone, without values"))
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

/// What another machine must have: names and values, sorted by name.
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

/// The environment of a program.
pub(super) fn environment(
    variables: &Variables,
    scratch: &Path,
    context: &Context<'_>,
) -> Vec<(OsString, OsString)> {
    let kept = ["PATH", "SystemRoot", "SystemDrive", "ComSpec", "PATHEXT"];
    let kept = if cfg!(windows) { &kept[..] } else { &kept[..1] };
    let mut environment: Vec<(OsString, OsString)> =
        kept.iter().filter_map(|name| Some((name.into(), env::var_os(name)?))).collect();
    for (name, folder) in [("HOME", HOME), ("TMPDIR", TEMPORARY), ("TEMP", TEMPORARY), ("TMP", TEMPORARY)] {
        environment.push((name.into(), scratch.join(folder).into()));
    }
    for (name, value) in [
        ("LANG", "C.UTF-8"),
        ("TZ", "UTC"),
        ("SOURCE_DATE_EPOCH", "0"),
        ("PYTHONHASHSEED", "0"),
        // Otherwise running a script would change the folders of its modules.
        ("PYTHONDONTWRITEBYTECODE", "1"),
    ] {
        environment.push((name.into(), value.into()));
    }
    for (name, value) in &variables.0 {
        match value {
            Some(value) => environment.push((name.into(), value.clone())),
            None => context.warn(format!("the environment variable {name} is not set")),
        }
    }
    environment
}

/// The absolute path of the program's file. The file is read, so that another program reruns the item.
///
/// # Errors
/// If there is none.
pub(super) fn program(command: &Command, context: &Context<'_>) -> Result<PathBuf, Failure> {
    let written = plain(command.program(), context).unwrap_or_default();
    let name = Path::new(&written);
    let file = if name.components().count() > 1 || name.is_absolute() {
        context.resolve(name)
    } else {
        context.find_program(&written).map_err(|failure| {
            failure
                .help("install it, or write its path in command; a program beside the manifest is \"./NAME\"")
        })?
    };
    context.read(&file).map_err(|failure| failure.context(format!("cannot run {}", name.display())))?;
    Ok(file)
}

/// Reads the files that arguments and `tools` name, so that editing one reruns the item.
///
/// # Errors
/// If a file or folder in `tools` cannot be read.
pub(super) fn read(command: &Command, tools: &[String], context: &Context<'_>) -> Result<(), Failure> {
    for pieces in command.arguments() {
        if let Some(file) = named_file(pieces, context) {
            context.read(&file)?;
        } else if let Some(file) = absent(pieces, context) {
            // The engine records that the file is missing, and reruns the item when it appears.
            let _ = context.read(&file);
        }
    }
    for tool in tools {
        let tool = Path::new(tool);
        let read =
            if context.is_folder(tool) { read_folder(tool, context) } else { context.read(tool).map(drop) };
        read.map_err(|failure| failure.help("tools: paths are relative to the manifest"))?;
    }
    Ok(())
}

/// The file that an argument without input and output names, if it names one.
pub(super) fn named_file(pieces: &[Piece], context: &Context<'_>) -> Option<PathBuf> {
    let argument =
        plain(pieces, context).filter(|argument| !argument.as_encoded_bytes().starts_with(b"-"))?;
    let path = context.resolve(Path::new(&argument));
    (!argument.is_empty() && path.is_file()).then_some(path)
}

/// The missing file that an argument looks like.
pub(super) fn absent(pieces: &[Piece], context: &Context<'_>) -> Option<PathBuf> {
    let argument = plain(pieces, context).filter(|argument| is_like_a_path(argument))?;
    let path = context.resolve(Path::new(&argument));
    (!path.exists()).then_some(path)
}

fn read_folder(folder: &Path, context: &Context<'_>) -> Result<(), Failure> {
    for (name, is_folder) in context.list(folder)? {
        if name.starts_with('.') || name == "__pycache__" || name.ends_with(".pyc") {
            continue;
        }
        let path = folder.join(name);
        if is_folder { read_folder(&path, context)? } else { drop(context.read(&path)?) }
    }
    Ok(())
}

/// An argument that is the same in every run; `None` if it holds an input or the output.
fn plain(pieces: &[Piece], context: &Context<'_>) -> Option<OsString> {
    let mut argument = OsString::new();
    for piece in pieces {
        match piece {
            Piece::Text(text) => argument.push(text),
            Piece::Folder => argument.push(context.resolve(Path::new(""))),
            Piece::Input(_) | Piece::Output => return None,
        }
    }
    Some(argument)
}

/// Whether an argument looks like a path: `tools/grade.py`, but not `--stops`, `0.5` or a script.
fn is_like_a_path(argument: &OsStr) -> bool {
    let Some(text) = argument.to_str() else { return false };
    !text.starts_with('-')
        && text.contains(['/', '.'])
        && !text.contains(char::is_whitespace)
        && text.parse::<f64>().is_err()
}

#[cfg(test)]
mod tests {
    use engine::ValueKind;

    use super::*;

    #[test]
    fn a_missing_file_is_distinguished_from_other_words() {
        for path in ["tools/grade.py", "grade.py", "./grade"] {
            assert!(is_like_a_path(path.as_ref()), "{path}");
        }
        for word in ["grade", "0.5", "-1e-3", "--lut=a/b", "cp $0 ./b", ""] {
            assert!(!is_like_a_path(word.as_ref()), "{word}");
        }
    }

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
