//! `build --timings`: a timeline of the workers, as a page for people and as a trace for Perfetto.

mod bars;
mod page;
#[cfg(test)]
mod tests;
mod timeline;
mod trace;

use std::path::{Path, PathBuf};
use std::{fs, io};

pub(crate) use self::timeline::Timeline;

/// Writes `timings.html` and `timings.json` into a folder, each whole or not at all, and returns their paths.
pub(crate) fn write(mut timeline: Timeline, folder: &Path) -> Result<[PathBuf; 2], (PathBuf, io::Error)> {
    timeline.settle();
    fs::create_dir_all(folder).map_err(|error| (folder.to_path_buf(), error))?;
    let [page, trace] = ["timings.html", "timings.json"].map(|name| folder.join(name));
    for (path, text) in [(&page, page::page(&timeline)), (&trace, trace::trace(&timeline))] {
        engine::replace_file(path, text.as_bytes()).map_err(|error| (path.clone(), error))?;
    }
    Ok([page, trace])
}
