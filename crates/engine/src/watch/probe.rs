//! Proof that events arrive: a hidden file that is written into a watched folder, to hear of it.
//!
//! A network mount takes watches and then stays silent. What a folder does not answer for is looked at instead.

use std::ffi::OsStr;
use std::fs;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// How the names of probes begin. They are hidden, so that no glob matches them.
const PREFIX: &str = ".specula-probe-";
/// How long an event may take.
const PATIENCE: Duration = Duration::from_secs(2);

/// Whether a name is a probe's, of this watcher or of another.
pub(crate) fn is_probe(name: &OsStr) -> bool {
    name.to_str().is_some_and(|name| name.starts_with(PREFIX))
}

/// The folders that are being proved.
#[derive(Default)]
pub(super) struct Probes {
    waiting: Vec<Probe>,
    /// Why events cannot be relied on, of the first folder where that is so.
    failed: Option<String>,
}

struct Probe {
    folder: PathBuf,
    file: PathBuf,
    since: Instant,
}

impl Probes {
    /// Writes a probe into a folder that is listened to, and removes what killed watchers left there.
    pub(super) fn write(&mut self, folder: &Path) {
        sweep(folder);
        let file = folder.join(format!("{PREFIX}{}", std::process::id()));
        // It waits before it is written: the event may come first.
        self.waiting.push(Probe { folder: folder.into(), file: file.clone(), since: Instant::now() });
        if let Err(error) = fs::write(&file, "") {
            self.waiting.pop();
            self.failed.get_or_insert_with(|| {
                format!(
                    "no probe can be written to {} to see whether events arrive: {error}",
                    folder.display()
                )
            });
        }
    }

    /// An event of this path arrived.
    pub(super) fn heard(&mut self, path: &Path) {
        self.waiting.retain(|probe| {
            let proved = probe.file == path;
            if proved {
                let _ = fs::remove_file(&probe.file);
            }
            !proved
        });
    }

    /// Whether a folder has not answered yet.
    pub(super) fn are_waiting(&self) -> bool {
        !self.waiting.is_empty()
    }

    /// Whether every folder has answered, or its time is over.
    pub(super) fn are_settled(&mut self) -> bool {
        let (over, waiting): (Vec<_>, Vec<_>) = std::mem::take(&mut self.waiting)
            .into_iter()
            .partition(|probe| probe.since.elapsed() >= PATIENCE);
        self.waiting = waiting;
        for probe in over {
            let _ = fs::remove_file(&probe.file);
            self.failed.get_or_insert_with(|| {
                let (folder, seconds) = (probe.folder.display(), PATIENCE.as_secs());
                format!("no event of a file that was written to {folder} arrived within {seconds} s")
            });
        }
        self.waiting.is_empty()
    }

    /// Why events cannot be relied on.
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
