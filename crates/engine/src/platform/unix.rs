//! What Unix knows of files.

use std::ffi::OsString;
use std::fs::{self, FileType, Metadata, OpenOptions};
use std::os::unix::fs::{FileTypeExt, MetadataExt, OpenOptionsExt, PermissionsExt};
use std::path::Path;

/// The last change of a file's metadata in nanoseconds since 1970, and its number on its drive.
pub(crate) fn changed(metadata: &Metadata) -> (i64, u64) {
    (metadata.ctime().saturating_mul(1_000_000_000).saturating_add(metadata.ctime_nsec()), metadata.ino())
}

/// The drive of what is at a path, and its number there.
pub(crate) fn identity(_: &Path, metadata: &Metadata) -> Option<(u64, u64)> {
    Some((metadata.dev(), metadata.ino()))
}

/// Whether a file has several names (hard links).
pub(crate) fn has_other_names(_: &Path, metadata: &Metadata) -> bool {
    metadata.is_file() && metadata.nlink() > 1
}

/// Options with which opening a pipe does not wait for its other end.
pub(crate) fn without_waiting(options: &mut OpenOptions) -> &mut OpenOptions {
    options.custom_flags(libc::O_NONBLOCK | libc::O_NOCTTY)
}

/// What there is at a path, for messages.
pub(crate) fn type_of(found: FileType) -> &'static str {
    match found {
        found if found.is_dir() => "a folder",
        found if found.is_file() => "a file",
        found if found.is_fifo() => "a pipe",
        found if found.is_socket() => "a socket",
        _ => "a device",
    }
}

/// The endings with which a program's name is looked up.
pub(crate) fn program_endings() -> Vec<OsString> {
    vec![OsString::new()]
}

/// Whether a file can be run as a program.
pub(crate) fn can_run(file: &Path) -> bool {
    fs::metadata(file).is_ok_and(|file| file.is_file() && file.permissions().mode() & 0o111 != 0)
}

/// The programs that keep others from a file: none do.
pub(crate) fn programs_that_hold(_: &Path) -> Vec<String> {
    Vec::new()
}
