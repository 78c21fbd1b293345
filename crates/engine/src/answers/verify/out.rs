//! Verifies many files at once: those that the items of a plan export, and copies of them.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use serde::Serialize;

use super::{FileContent, RecipeOf, Verification, Verifier};
use crate::build::{Published, is_temporary};
use crate::error::Error;
use crate::event::ItemName;
use crate::kinds::is_left_out;
use crate::parallel;
use crate::plan::{ItemIndex, Plan};
use crate::storage::read_file;

/// Which files to verify.
pub struct FilesToVerify<'a> {
    /// Whether the file of `out` with this name, relative to `out` with `/` between folders, is among them.
    pub in_out: &'a dyn Fn(&str) -> bool,
    /// Files in other places, which are recognised by their digests and recipes.
    pub elsewhere: Vec<PathBuf>,
}

/// The verification of many files. Names of files in `out` are relative to it.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct OutVerification {
    /// The files that a record knows, in order of their names.
    pub files: Vec<Verification>,
    /// The files that items export and that do not exist.
    pub missing: Vec<MissingFile>,
    /// The files that items export and that cannot be read, each with the error.
    pub unreadable: Vec<(String, String)>,
    /// The files that were published and that nothing exports any more. A build removes them, unless someone
    /// has changed them.
    pub left_over: Vec<String>,
    /// The files that this manifest has not published.
    pub unknown: Vec<String>,
}

/// A file that an item exports and that does not exist, or not as a build would make it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MissingFile {
    /// The file, relative to `out`.
    pub file: String,
    /// The item that exports it.
    pub item: ItemName,
    /// Whether it was published; if not, no build has made it yet.
    pub was_published: bool,
}

impl OutVerification {
    /// Whether a build would change nothing. Files that nothing has published do not count.
    pub fn is_current(&self) -> bool {
        let Self { files, missing, unreadable, left_over, unknown: _ } = self;
        let is_complete = missing.is_empty() && unreadable.is_empty() && left_over.is_empty();
        is_complete && files.iter().all(Verification::is_current)
    }
}

/// Reports for each of many files whether it is as it was published, and whether that is up to date.
///
/// `recipe_of` reads the recipe from a file of any format. Nothing is written, and a build may be running.
///
/// # Errors
/// If the records cannot be read.
pub fn verify_out(
    plan: &Plan,
    files: &FilesToVerify<'_>,
    recipe_of: &RecipeOf<'_>,
) -> Result<OutVerification, Error> {
    Verifier::open(plan, recipe_of, |verifier| Ok(verifier.verify_out(files)))
}

impl Verifier<'_> {
    fn verify_out(&self, files: &FilesToVerify<'_>) -> OutVerification {
        let plan = self.check.plan;
        let mut found = OutVerification::default();
        // What the items export is asked for by name: a link to a folder may be on the way.
        let exported = plan.items.iter().flat_map(|item| &item.files).filter(|file| (files.in_out)(file));
        let is_present = |file: &&String| fs::symlink_metadata(plan.out.join(file)).is_ok();
        let present = exported.filter(is_present).cloned().collect::<Vec<_>>();
        for name in files_below(&plan.out).into_iter().filter(|name| (files.in_out)(name)) {
            match self.records.place(&name) {
                Some(_) => {}
                None if self.was_published(&name) => found.left_over.push(name),
                None => found.unknown.push(name),
            }
        }
        // Files are read in parallel, and only what is needed of them is kept.
        let reads = self.read_all(&present.iter().map(|name| plan.out.join(name)).collect::<Vec<_>>());
        for (name, read) in present.iter().zip(reads) {
            match read {
                // Its name in the result is relative to `out`.
                Ok(read) => match self.verify(&plan.out.join(name), std::slice::from_ref(name), &read) {
                    Some(verification) => {
                        found.files.push(Verification { file: name.clone(), ..verification });
                    }
                    // No build has made the file that belongs there.
                    None => {
                        let (item, _) = self.records.place(name).unwrap_or_default();
                        found.missing.push(self.missing(item, name));
                        found.unknown.push(name.clone());
                    }
                },
                Err(error) => found.unreadable.push((name.clone(), error.to_string())),
            }
        }
        for item in 0..plan.items.len() {
            self.add_missing(item, files, &mut found);
        }
        for (file, read) in files.elsewhere.iter().zip(self.read_all(&files.elsewhere)) {
            let name = file.display().to_string();
            match read.map(|read| self.verify(file, &[], &read)) {
                Ok(Some(verification)) => found.files.push(verification),
                Ok(None) => found.unknown.push(name),
                Err(error) => found.unreadable.push((name, error.to_string())),
            }
        }
        found.files.sort_by(|one, other| one.file.cmp(&other.file));
        found.missing.sort_by(|one, other| one.file.cmp(&other.file));
        found
    }

    fn read_all(&self, files: &[PathBuf]) -> Vec<io::Result<FileContent>> {
        parallel::map(files.len(), &|index| {
            read_file(&files[index]).map(|bytes| FileContent::of(&bytes, self.recipe_of))
        })
    }

    /// Adds the files of an item that do not exist, or that cannot be looked at.
    fn add_missing(&self, item: ItemIndex, files: &FilesToVerify<'_>, found: &mut OutVerification) {
        let plan = self.check.plan;
        let outputs = self.check.latest(item).map_or(&[][..], |latest| latest.outputs());
        for (output, file) in plan.items[item].files.iter().enumerate() {
            let is_left_out = outputs.get(output).is_some_and(|blob| is_left_out(blob.digest));
            if is_left_out || !(files.in_out)(file) {
                continue;
            }
            match fs::symlink_metadata(plan.out.join(file)) {
                Ok(_) => {}
                Err(error) if error.kind() == io::ErrorKind::NotFound => {
                    found.missing.push(self.missing(item, file));
                }
                Err(error) => found.unreadable.push((file.clone(), error.to_string())),
            }
        }
    }

    fn missing(&self, item: ItemIndex, file: &str) -> MissingFile {
        let was_published = self.was_published(file);
        MissingFile { file: file.into(), item: self.check.name(item), was_published }
    }

    fn was_published(&self, file: &str) -> bool {
        self.publisher.entry(file).as_ref().and_then(Published::owned).is_some()
    }
}

/// The files below a folder, by their names there, sorted. Links to folders are not followed, and a build's
/// temporary files are left out.
fn files_below(folder: &Path) -> Vec<String> {
    let (mut found, mut open) = (Vec::new(), vec![String::new()]);
    while let Some(below) = open.pop() {
        for entry in fs::read_dir(folder.join(&below)).into_iter().flatten().flatten() {
            let name = entry.file_name().to_string_lossy().into_owned();
            let path = if below.is_empty() { name.clone() } else { format!("{below}/{name}") };
            if entry.file_type().is_ok_and(|kind| kind.is_dir()) {
                open.push(path);
            } else if !is_temporary(Path::new(&name)) {
                found.push(path);
            }
        }
    }
    found.sort_unstable();
    found
}
