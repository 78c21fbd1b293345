//! The picture of a material or of a BRDF table that `specula inspect --picture` writes.

use std::path::Path;

use stages::Picture;

use engine::path_text;

use super::facts::Facts;
use crate::command_error::CommandError;
use crate::png_file;

/// Draws to the PNG file `place` and returns the file's path and size; `None` if there is nothing to draw.
/// The title is the name of the inspected file.
pub(super) fn draw(
    file: &Path,
    picture: impl Fn(&str) -> Option<Picture>,
    place: &Path,
) -> Option<Result<Facts, CommandError>> {
    let name = file.file_stem().unwrap_or(file.as_os_str()).to_string_lossy();
    let picture = picture(&name)?;
    let size @ [width, height] = [picture.width, picture.height];
    let written = png_file::write(place, size, &picture.pixels)
        .map_err(|error| CommandError::system(format!("cannot write {}", path_text(place)), &error));
    Some(written.map(|()| {
        vec![
            ("picture", place.to_string_lossy().into()),
            ("picture size", format!("{width} x {height}").into()),
        ]
    }))
}
