//! Tests whether events arrive: writes a hidden file into a watched folder and waits for its event.
//!
//! Some network mounts accept watches but never send events. Such folders are polled instead.

use std::fs;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use crate::platform::path_text;
use crate::storage::{PROBE_PREFIX, is_probe};

/// The time within which a probe's event must arrive.
const TIMEOUT: Duration = Duration::from_secs(2);

#[derive(Default)]
pub(super) struct Probes {
    waiting: Vec<Probe>,
    /// Why events cannot be relied on: the reason of the first folder that failed.
    failed: Option<String>,
}

struct Probe {
    folder: PathBuf,
    file: PathBuf,
    since: Instant,
}

impl Probes {
    /// Writes a probe file into a watched folder, and removes those that killed watchers left there.
    pub(super) fn write(&mut self, folder: &Path) {
        sweep(folder);
        let file = folder.join(format!("{PROBE_PREFIX}{}", std::process::id()));
        // The probe is registered before the file is written, because the event may come first.
        self.waiting.push(Probe { folder: folder.into(), file: file.clone(), since: Instant::now() });
        if let Err(error) = fs::write(&file, "") {
            self.waiting.pop();
            self.failed.get_or_insert_with(|| {
                let folder = path_text(folder);
                format!("cannot write a file to {folder} to test whether events arrive: {error}")
            });
        }
    }

    /// Notes that an event of this path arrived.
    pub(super) fn arrived(&mut self, path: &Path) {
        self.waiting.retain(|probe| {
            let is_this = probe.file == path;
            if is_this {
                let _ = fs::remove_file(&probe.file);
            }
            !is_this
        });
    }

    /// Whether an event is still missing.
    pub(super) fn are_waiting(&self) -> bool {
        !self.waiting.is_empty()
    }

    /// Whether the event of every probe arrived or timed out.
    pub(super) fn are_settled(&mut self) -> bool {
        let (late, waiting): (Vec<_>, Vec<_>) =
            std::mem::take(&mut self.waiting).into_iter().partition(|probe| probe.since.elapsed() >= TIMEOUT);
        self.waiting = waiting;
        for probe in late {
            let _ = fs::remove_file(&probe.file);
            self.failed.get_or_insert_with(|| {
                let (folder, seconds) = (path_text(probe.folder), TIMEOUT.as_secs());
                format!("no event arrived within {seconds} s for a file written to {folder}")
            });
        }
        self.waiting.is_empty()
    }

    pub(super) fn failed(&self) -> Option<&String> {
        self.failed.as_ref()
    }
}

impl Drop for Probes {
    fn drop(&mut self) {
        for probe in &self.waiting {
            let _ = fs::remove_file(&probe.file);
        }
    }
}

fn sweep(folder: &Path) {
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        if is_probe(&entry.file_name()) {
            let _ = fs::remove_file(entry.path());
        }
    }
}
