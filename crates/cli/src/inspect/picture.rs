//! The picture of a material that `specula inspect --picture` writes.

use std::path::Path;

use brdf::Material;

use super::facts::Facts;
use crate::exit::Exit;
use crate::{png_file, print};

/// Draws a material to the PNG file `place` and returns the file's path and size. The title is the name of
/// the inspected file.
///
/// # Errors
/// If the file cannot be written: that is printed.
pub(super) fn draw(file: &Path, material: &Material, place: &Path) -> Result<Facts, Exit> {
    let name = file.file_stem().unwrap_or(file.as_os_str()).to_string_lossy();
    let picture = stages::material_picture(&name, material);
    let size @ [width, height] = [picture.width, picture.height];
    png_file::write(place, size, &picture.pixels).map_err(|error| {
        print::error(&[format!("cannot write {}", place.display()), error.to_string()], None);
        Exit::System
    })?;
    Ok(vec![
        ("picture", place.to_string_lossy().into()),
        ("picture size", format!("{width} x {height}").into()),
    ])
}
