//! What Windows knows of files.

use std::ffi::OsString;
use std::fs::{self, FileType, Metadata, OpenOptions};
use std::path::Path;

use winapi_util::{Handle, file};

use crate::timestamp::nanoseconds;

/// The creation of a file in nanoseconds since 1970. Its number on its drive is known only while it is open.
pub(crate) fn changed(metadata: &Metadata) -> (i64, u64) {
    (metadata.created().map_or(0, nanoseconds), 0)
}

/// The drive of what is at a path, and its number there.
pub(crate) fn identity(path: &Path, _: &Metadata) -> Option<(u64, u64)> {
    let information = Handle::from_path_any(path).and_then(file::information).ok()?;
    Some((information.volume_serial_number(), information.file_index()))
}

/// Whether a file has several names (hard links).
pub(crate) fn has_other_names(path: &Path, metadata: &Metadata) -> bool {
    let links = || Handle::from_path_any(path).and_then(file::information);
    metadata.is_file() && links().is_ok_and(|file| file.number_of_links() > 1)
}

/// Options with which opening a pipe does not wait for its other end: those of any file.
pub(crate) fn without_waiting(options: &mut OpenOptions) -> &mut OpenOptions {
    options
}

/// What there is at a path, for messages.
pub(crate) fn type_of(found: FileType) -> &'static str {
    match found {
        found if found.is_dir() => "a folder",
        found if found.is_file() => "a file",
        _ => "a device",
    }
}

/// The endings with which a program's name is looked up: none, and those of PATHEXT.
pub(crate) fn program_endings() -> Vec<OsString> {
    let endings = std::env::var("PATHEXT").unwrap_or_else(|_| ".COM;.EXE;.BAT;.CMD".into());
    let endings = endings.split(';').filter(|ending| ending.starts_with('.')).map(str::to_ascii_lowercase);
    std::iter::once(String::new()).chain(endings).map(OsString::from).collect()
}

/// Whether a file can be run as a program: by its ending.
pub(crate) fn can_run(file: &Path) -> bool {
    fs::metadata(file).is_ok_and(|found| found.is_file()) && file.extension().is_some()
}

/// The programs that have a file open, as far as the Restart Manager knows them: `Photoshop (process 1234)`.
pub(crate) fn programs_that_hold(path: &Path) -> Vec<String> {
    let found = || {
        let mut session = restart_manager::RestartSession::new()?;
        session.register_files([path])?;
        let applications = session.affected_applications()?;
        let names = applications.iter().map(|application| {
            let name = application.display_name().to_string_lossy();
            match application.process() {
                Some(process) => format!("{name} (process {})", process.pid()),
                None => name.into_owned(),
            }
        });
        let names = names.collect();
        session.end().map(|()| names)
    };
    found().unwrap_or_default()
}
