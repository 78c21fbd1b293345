//! The programs that start a script: those of its first line, `#!/usr/bin/env python3`.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use engine::{Failure, ItemFiles};

/// The most interpreters that follow each other, as on Linux.
const MAX_INTERPRETERS: usize = 5;

/// The most bytes of a first line that the system reads.
const MAX_LINE: usize = 256;

/// Reads the interpreters of a script, so that another one reruns the item. Returns whether all of them could
/// be told.
///
/// # Errors
/// If one is in the folder for exports.
pub(super) fn read_interpreters(script: Arc<Vec<u8>>, files: &ItemFiles<'_>) -> Result<bool, Failure> {
    let mut content = script;
    for _ in 0..MAX_INTERPRETERS {
        let Some((file, argument)) = first_line(&content) else { return Ok(true) };
        content = read(&file, files)?;
        if is_env(&file) {
            let Some(program) = started_by_env(argument.split_whitespace()) else { return Ok(false) };
            content = read_program(&program, files)?;
        }
    }
    Ok(true)
}

/// Reads what `env` starts with these arguments, and its interpreters, as [`read_interpreters`] does.
///
/// # Errors
/// If one of the files is in the folder for exports.
pub(super) fn read_started_by_env<'w>(
    arguments: impl Iterator<Item = &'w str>,
    files: &ItemFiles<'_>,
) -> Result<bool, Failure> {
    match started_by_env(arguments) {
        Some(program) => read_interpreters(read_program(&program, files)?, files),
        None => Ok(false),
    }
}

/// Whether a program is `env`, which looks up another one.
pub(super) fn is_env(program: &Path) -> bool {
    program.file_name().is_some_and(|name| name == "env")
}

fn read_program(name: &str, files: &ItemFiles<'_>) -> Result<Arc<Vec<u8>>, Failure> {
    if name.contains('/') {
        return read(Path::new(name), files);
    }
    match files.find_program(name.as_ref()) {
        Ok(file) => read(&file, files),
        // The look-up is recorded; the system says what is wrong.
        Err(_) => Ok(Arc::default()),
    }
}

/// The content of a file; empty if it cannot be read, because a program need not be readable.
fn read(file: &Path, files: &ItemFiles<'_>) -> Result<Arc<Vec<u8>>, Failure> {
    files.check_not_exported(file)?;
    Ok(files.read(file).unwrap_or_default())
}

/// The interpreter that a file's first line names, and the rest of the line. A relative path is one from the
/// program's working folder, where nothing is.
fn first_line(content: &[u8]) -> Option<(PathBuf, String)> {
    let line = content.strip_prefix(b"#!")?;
    let line = &line[..line.len().min(MAX_LINE)];
    let line = line.split(|byte| *byte == b'\n').next()?;
    let line = String::from_utf8_lossy(line);
    let line = line.trim();
    let (file, argument) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
    Path::new(file).is_absolute().then(|| (file.into(), argument.trim().to_owned()))
}

/// The program that `env` starts; `None` if that cannot be told.
fn started_by_env<'w>(arguments: impl Iterator<Item = &'w str>) -> Option<String> {
    for word in arguments {
        let word =
            ["--split-string=", "-S"].iter().find_map(|option| word.strip_prefix(option)).unwrap_or(word);
        match word {
            "" | "--" | "--split-string" => {}
            // Other options may change PATH, and so may a variable of that name.
            _ if word.starts_with('-') || word.starts_with("PATH=") => return None,
            _ if word.contains(['"', '\'', '$', '\\']) || word.contains(char::is_whitespace) => return None,
            _ if word.contains('=') => {}
            _ => return Some(word.to_owned()),
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[cfg(unix)] // Windows has no such paths, and starts no script by its first line
    #[test]
    fn a_first_line_names_an_interpreter() {
        let line =
            |text: &str| first_line(text.as_bytes()).map(|(file, rest)| (file.display().to_string(), rest));
        let found = |file: &str, rest: &str| Some((file.to_owned(), rest.to_owned()));
        assert_eq!(line("#!/bin/sh\necho"), found("/bin/sh", ""));
        assert_eq!(line("#! /bin/sh -e \r\necho"), found("/bin/sh", "-e"));
        assert_eq!(line("#!/usr/bin/env python3"), found("/usr/bin/env", "python3"));
        for other in ["", "#!", "#!\n/bin/sh", "# !/bin/sh", "#!sh", "\x7fELF"] {
            assert_eq!(line(other), None, "{other:?}");
        }
    }

    #[test]
    fn env_starts_the_first_word_that_is_no_variable() {
        let started = |text: &str| started_by_env(text.split(' '));
        for (text, expected) in [
            ("python3", Some("python3")),
            ("-S python3 -u", Some("python3")),
            ("-Spython3 -u", Some("python3")),
            ("--split-string=python3 -u", Some("python3")),
            ("-S A=1 B=2 ./tools/python3", Some("./tools/python3")),
            ("-i python3", None),
            ("PATH=/x python3", None),
            ("-S \"a b\"", None),
            ("A=1", None),
            ("", None),
        ] {
            assert_eq!(started(text).as_deref(), expected, "{text}");
        }
    }
}
