//! Each test gives a manifest and the files beside it, and checks the items or the errors.

mod damage;
mod errors;
mod items;
mod loading;
mod many_errors;
mod paths;
mod sources;

use std::collections::{BTreeMap, BTreeSet};
use std::ffi::OsString;
use std::io;

use expect_test::{Expect, expect};
use proptest::prelude::*;

use super::*;
use crate::key::ItemKey;
use crate::testkit::{kinds, shown};

/// Folders in memory, by their absolute paths.
struct Tree(BTreeMap<PathBuf, BTreeSet<Name>>);

const PROJECT: &str = if cfg!(windows) { "C:/project" } else { "/project" };

fn manifest_file() -> ManifestFile {
    ManifestFile::of(&Path::new(PROJECT).join("pipeline.toml"))
}

impl Tree {
    /// Files by their paths relative to `/project`, separated by spaces; `name/` is an empty folder.
    fn new(files: &str) -> Self {
        let mut tree = Self(BTreeMap::from([(PathBuf::from(PROJECT), BTreeSet::new())]));
        files
            .split_whitespace()
            .for_each(|file| tree.add(Path::new(PROJECT).join(file), file.ends_with('/')));
        tree
    }

    fn add(&mut self, path: PathBuf, is_folder: bool) {
        let path = source::resolved(&path);
        let mut found = if is_folder { Found::Folder } else { Found::File };
        if is_folder {
            self.0.entry(path.clone()).or_default();
        }
        for (path, folder) in path.ancestors().zip(path.ancestors().skip(1)) {
            let name = path.file_name().map_or_else(OsString::new, |name| name.to_owned());
            self.0.entry(folder.into()).or_default().insert(Name { name, found, link: false });
            found = Found::Folder;
        }
    }
}

impl Folders for Tree {
    fn list(&self, folder: &Path) -> io::Result<Vec<Name>> {
        match self.0.get(&source::resolved(folder)) {
            Some(names) => Ok(names.iter().cloned().collect()),
            None => Err(io::ErrorKind::NotFound.into()),
        }
    }

    fn find(&self, path: &Path) -> Option<Found> {
        let path = source::resolved(path);
        if self.0.contains_key(&path) {
            return Some(Found::Folder);
        }
        let names = self.0.get(path.parent()?)?;
        names.iter().find(|name| Some(name.name.as_os_str()) == path.file_name()).map(|name| name.found)
    }
}

fn load(files: &str, manifest: &str) -> Result<Plan, Diagnostics> {
    let text = format!("schema = 1\n{manifest}");
    Plan::of_bytes(&manifest_file(), text.as_bytes(), &kinds(), &Tree::new(files))
}

/// The errors of a manifest; `schema = 1` is inserted as its first line.
fn check_errors(files: &str, manifest: &str, expected: Expect) {
    let errors = load(files, manifest).map_or_else(|errors| shown(&errors), |_| "no error\n".into());
    expected.assert_eq(&errors);
}

/// The items of a manifest: stage, key, what arrives at each port, source, files.
fn check_items(files: &str, manifest: &str, expected: Expect) {
    let plan = load(files, manifest).unwrap_or_else(|errors| panic!("{}", shown(&errors)));
    expected.assert_eq(&drawn(&plan));
}

fn drawn(plan: &Plan) -> String {
    let name = |item: &Item| format!("{}[{}]", plan.stages[item.stage].name, item.key);
    let mut text = String::new();
    for item in plan.items.iter() {
        text += &name(item);
        for ((port, _), arriving) in plan.stages[item.stage].inputs.iter().zip(&item.inputs) {
            let names: Vec<_> = arriving.iter().map(|&index| name(&plan.items[index])).collect();
            text += &format!(" {port}={}", names.join("+"));
        }
        if let Some(source) = &item.source {
            text += &format!(" < {}", test_data::unix_paths(source.display().to_string()));
        }
        if !item.files.is_empty() {
            text += &format!(" > {}", item.files.join(" "));
        }
        text.push('\n');
    }
    text
}

/// Lines, each after what they are about.
fn marked(subject: &str, lines: &str) -> String {
    lines.lines().map(|line| format!("{subject}: {line}\n")).collect()
}

const SOURCES: &str = r#"
[stage.sky]
kind = "text-source"
source = "skies/*.txt"
[stage.paint]
kind = "text-source"
source = "paints/*.txt"
"#;
const FILES: &str = "skies/dawn.txt skies/noon.txt paints/gold.txt paints/red.txt";
