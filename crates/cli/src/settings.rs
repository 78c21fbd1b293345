//! `specula.toml`: what a project, or a user for all projects, sets beside the manifest. Nobody needs the
//! file.
//!
//! A file that has errors ends a command, which would otherwise do something else than was asked for. One
//! that cannot be read is only a warning: it may belong to somebody else, such as the home of another user
//! in a container.

use std::io::ErrorKind;
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};

use engine::{Diagnostic, Document, Table, Value, ValueKind, path_text, unexpected, unknown_keys};

use crate::command_error::CommandError;
use crate::print::say;

pub(crate) const FILE: &str = "specula.toml";

/// The table `[remote]` of each file that there is; the first that has a key counts.
#[derive(Default)]
pub(crate) struct RemoteSettings(Vec<RemoteTable>);

struct RemoteTable {
    /// The folder that the table's paths are relative to.
    folder: PathBuf,
    document: Document,
    table: Table,
}

impl RemoteSettings {
    /// The tables of the file beside a manifest and of the user's file, whose keys are among `known`.
    pub(crate) fn read(manifest: &Path, known: &[&str]) -> Result<Self, CommandError> {
        let beside = manifest.parent().unwrap_or(Path::new("")).join(FILE);
        let of_user = dirs::config_dir().map(|folder| folder.join("specula").join(FILE));
        let files = [Some(beside), of_user].into_iter().flatten();
        let tables = files.filter_map(|file| {
            let bytes = read(&file)?;
            RemoteTable::parse(&file, &bytes, known).transpose()
        });
        Ok(Self(tables.collect::<Result<_, _>>()?))
    }

    /// The value of a key as text.
    pub(crate) fn text(&self, key: &str) -> Result<Option<String>, CommandError> {
        self.value(key, "a text", |_, value| as_text(value))
    }

    /// The value of a key as a path, relative to its file.
    pub(crate) fn path(&self, key: &str) -> Result<Option<PathBuf>, CommandError> {
        self.value(key, "a path", |folder, value| Some(folder.join(as_text(value)?)))
    }

    /// The value of a key as a switch.
    pub(crate) fn switch(&self, key: &str) -> Result<Option<bool>, CommandError> {
        self.value(key, "true or false", |_, value| match value.kind {
            ValueKind::Boolean(value) => Some(value),
            _ => None,
        })
    }

    /// The value of a key as a number of `what`, within a range.
    pub(crate) fn number(
        &self,
        key: &str,
        what: &str,
        range: RangeInclusive<u32>,
    ) -> Result<Option<u64>, CommandError> {
        let expected = format!("a whole number of {what} from {} to {}", range.start(), range.end());
        self.value(key, &expected, |_, value| match value.kind {
            ValueKind::Integer(number) => {
                u32::try_from(number).ok().filter(|number| range.contains(number)).map(u64::from)
            }
            _ => None,
        })
    }

    /// The value of a key as one of these words, each with its meaning.
    pub(crate) fn choice<T: Copy>(&self, key: &str, words: &[(&str, T)]) -> Result<Option<T>, CommandError> {
        let expected = words.iter().map(|(word, _)| format!("{word:?}")).collect::<Vec<_>>().join(" or ");
        self.value(key, &expected, |_, value| {
            let text = as_text(value)?;
            words.iter().find(|(word, _)| *word == text).map(|(_, meaning)| *meaning)
        })
    }

    /// The value of a key as a table of texts.
    pub(crate) fn texts(&self, key: &str) -> Result<Option<Vec<(String, String)>>, CommandError> {
        self.value(key, "a table of texts", |_, value| match &value.kind {
            ValueKind::Table(table) => {
                let entries = table.entries.iter();
                entries.map(|entry| Some((entry.key.clone(), as_text(&entry.value)?))).collect()
            }
            _ => None,
        })
    }

    fn value<T>(
        &self,
        key: &str,
        expected: &str,
        parse: impl Fn(&Path, &Value) -> Option<T>,
    ) -> Result<Option<T>, CommandError> {
        let mut tables = self.0.iter();
        let found = tables.find_map(|table| Some((table, table.table.get(key)?)));
        let Some((table, entry)) = found else { return Ok(None) };
        let value = parse(&table.folder, &entry.value);
        value.map(Some).ok_or_else(|| wrong(&table.document, vec![unexpected(&entry.value, expected)]))
    }
}

impl RemoteTable {
    /// The table of a file; `None` if the file has none.
    ///
    /// # Errors
    /// If the file has errors.
    fn parse(file: &Path, bytes: &[u8], known: &[&str]) -> Result<Option<Self>, CommandError> {
        let name = path_text(file);
        let document = Document::parse(name, bytes).map_err(CommandError::settings)?;
        let Some(entry) = document.table.get("remote") else { return Ok(None) };
        let ValueKind::Table(table) = &entry.value.kind else {
            let error = unexpected(&entry.value, "a table");
            return Err(wrong(&document, vec![error.help("write its keys below a line [remote]")]));
        };
        let known = known.iter().map(|key| (*key).to_owned()).collect::<Vec<_>>();
        let mut errors = Vec::new();
        unknown_keys(table, &known, &mut errors);
        if !errors.is_empty() {
            return Err(wrong(&document, errors));
        }
        let (folder, table) = (file.parent().unwrap_or(Path::new("")).to_path_buf(), table.clone());
        Ok(Some(Self { folder, document, table }))
    }
}

/// The bytes of the file; `None` if it does not exist, or, with a warning, if it cannot be read.
fn read(file: &Path) -> Option<Vec<u8>> {
    match engine::read_file(file) {
        Ok(bytes) => Some(bytes),
        Err(error) if nothing_can_be_there(error.kind()) => None,
        Err(error) => {
            say!("warning: {} is ignored, because it cannot be read: {error}", path_text(file));
            None
        }
    }
}

/// Whether an error means that no file can have this path, such as one in `/dev/null`.
fn nothing_can_be_there(error: ErrorKind) -> bool {
    matches!(error, ErrorKind::NotFound | ErrorKind::NotADirectory | ErrorKind::InvalidFilename)
}

fn as_text(value: &Value) -> Option<String> {
    match &value.kind {
        ValueKind::String(text) => Some(text.clone()),
        _ => None,
    }
}

fn wrong(document: &Document, errors: Vec<Diagnostic>) -> CommandError {
    CommandError::settings(document.diagnostics(errors))
}

#[cfg(test)]
impl RemoteSettings {
    /// The settings of these texts below `[remote]`, each a file in `/studio`.
    pub(crate) fn of_texts(texts: &[&str]) -> Self {
        let table = |text: &&str| {
            let document = Document::parse(FILE, text.as_bytes()).unwrap();
            let table = document.table.clone();
            RemoteTable { folder: "/studio".into(), document, table }
        };
        Self(texts.iter().map(table).collect())
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    /// The settings of a project whose `specula.toml` has this text.
    fn parsed(text: &str) -> Result<Option<RemoteTable>, CommandError> {
        RemoteTable::parse(Path::new("/studio/specula.toml"), text.as_bytes(), &["cache", "header-file"])
    }

    #[test]
    fn errors_have_a_place_and_show_no_value_that_may_be_secret() {
        for (text, expected) in [
            ("[remote]\nheader = \"authorization=1234\"\n", ":2:1: unknown key \"header\""),
            ("[remote]\nheader-file = \"1234\n", ":2:20: "),
            ("remote = 7\n", ":1:10: 7 is not a table"),
        ] {
            let error = test_data::unix_paths(parsed(text).err().unwrap().to_string());
            assert!(error.starts_with(&format!("/studio/specula.toml{expected}")), "{error}");
            assert!(!error.contains("1234"), "{error}");
        }
        assert!(parsed("").unwrap().is_none(), "the file may be empty");
    }

    #[test]
    fn what_cannot_exist_or_be_read_is_no_setting() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path();
        fs::write(path.join("file"), "").unwrap();
        for file in [path.join(FILE), path.join("file").join(FILE), path.join("x".repeat(5000)), path.into()]
        {
            assert_eq!(read(&file), None, "{}", file.display());
        }
    }
}
