//! Pictures as PNG files.

use std::path::Path;
use std::{fs, io};

/// Writes 8-bit sRGB, rows from the top, to a PNG file: whole or not at all, with the folders that lead to
/// it.
pub(crate) fn write(file: &Path, [width, height]: [usize; 2], codes: &[[u8; 3]]) -> io::Result<()> {
    let bytes = containers::write_png(width, height, codes, None).map_err(io::Error::other)?;
    if let Some(folder) = file.parent().filter(|folder| !folder.as_os_str().is_empty()) {
        fs::create_dir_all(folder)?;
    }
    engine::replace_file(file, &bytes)
}
