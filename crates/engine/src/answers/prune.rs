//! Removes published files that no manifest exports any more.

use std::fs;
use std::path::{Path, PathBuf};

use serde::Serialize;

use super::cache;
use crate::build::{Fate, Others};
use crate::cancel::Cancel;
use crate::error::Error;
use crate::platform;
use crate::storage::{Journal, LockPurpose, LockRequest, LockTimeout, State};

/// The files that [`prune`] removed or would remove, and those that stay, relative to the folder of the
/// manifests.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Pruned {
    /// The files that were as they had been published.
    pub removed: Vec<String>,
    /// The files that stay, because somebody has changed them.
    pub changed: Vec<String>,
}

/// Removes the files that builds in a folder published and that no manifest there exports any more: their
/// manifest no longer exists, or names another folder as `out`. Files that somebody has changed since stay,
/// and so do files of which there is no record.
///
/// With `dry_run` nothing is written. `waiting` is called with a description of another process that holds
/// the lock, if the wait becomes noticeable.
///
/// # Errors
/// If there is no state folder, another process holds the lock, or a file cannot be removed.
pub fn prune(
    folder: &Path,
    dry_run: bool,
    timeout: LockTimeout,
    waiting: &dyn Fn(String),
) -> Result<Pruned, Error> {
    let mut state = cache::read(folder)?;
    if !dry_run {
        drop(state);
        let cancel = &Cancel::default();
        let request = LockRequest { purpose: LockPurpose::Prune, timeout, cancel, waiting };
        state = State::open(State::lock(folder, &request)?, None)?;
    }
    let pruned = remove(&state.journal, folder, dry_run);
    state.close();
    pruned
}

fn remove(journal: &Journal, folder: &Path, dry_run: bool) -> Result<Pruned, Error> {
    let others = Others::of_all(journal, folder);
    let mut pruned = Pruned::default();
    let mut emptied = Vec::<PathBuf>::new();
    for leftover in others.leftovers(&|_| true) {
        let (place, name) = (&leftover.place, leftover.path.to_owned());
        match leftover.fate {
            Fate::Unchanged if dry_run => pruned.removed.push(name),
            Fate::Unchanged => {
                platform::remove(place).map_err(|error| Error::io(&error, "remove", place))?;
                journal.append(&leftover.removals().collect::<Vec<_>>())?;
                // How many folders it is below the parent of `out`.
                let depth = leftover.line().map_or(0, |line| line.file.split('/').count());
                emptied.extend(place.ancestors().skip(1).take(depth).map(Path::to_path_buf));
                pruned.removed.push(name);
            }
            Fate::Changed => pruned.changed.push(name),
            Fate::Missing => journal.append(&leftover.removals().collect::<Vec<_>>())?,
            Fate::Unknown => {}
        }
    }
    // The inner folders first. Those that are not empty cannot be removed, and stay.
    emptied.sort_unstable_by(|one, other| other.cmp(one));
    emptied.dedup();
    emptied.iter().for_each(|folder| _ = fs::remove_dir(folder));
    Ok(pruned)
}
