//! The course of a build: `--timings` draws the timeline of its workers, as a page for people and as a trace
//! for Perfetto, and `--junit` lists its items for CI servers.

mod bars;
mod junit;
mod page;
#[cfg(test)]
mod tests;
mod timeline;
mod trace;

use std::path::{Path, PathBuf};
use std::{fs, io};

use crate::command_error::CommandError;

pub(crate) use self::timeline::Timeline;

/// Writes `timings.html` and `timings.json` into a folder, each whole or not at all, and returns their paths.
pub(crate) fn write(timeline: &Timeline, folder: &Path) -> Result<[PathBuf; 2], (PathBuf, io::Error)> {
    fs::create_dir_all(folder).map_err(|error| (folder.to_path_buf(), error))?;
    let [page, trace] = ["timings.html", "timings.json"].map(|name| folder.join(name));
    for (path, text) in [(&page, page::page(timeline)), (&trace, trace::trace(timeline))] {
        engine::replace_file(path, text.as_bytes()).map_err(|error| (path.clone(), error))?;
    }
    Ok([page, trace])
}

/// Writes the report for CI servers, whole or not at all. `error` is why the build could not begin or
/// continue.
pub(crate) fn write_junit(
    file: &Path,
    manifest: &Path,
    timeline: Option<&Timeline>,
    error: Option<&CommandError>,
) -> io::Result<()> {
    if let Some(folder) = file.parent() {
        fs::create_dir_all(folder)?;
    }
    let report = junit::report(&manifest.display().to_string(), timeline, error);
    engine::replace_file(file, report.as_bytes())
}
