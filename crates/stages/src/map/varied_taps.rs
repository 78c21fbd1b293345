//! Tables of taps over a parameter as files, for `dfg` and `export-taps`.

use containers::{Precision, Texture, write_dds_rgba, write_ktx2_rgba};
use engine::Failure;
use taps::{ROWS, VariedTable, varied_texels};

/// The rows of a table over roughness: between them, look-ups are nearly as good as at them.
pub(crate) const STEPS: usize = 33;

/// A texture of a table over a parameter: an array of pictures in halves, which says its numbers in KTX2's
/// metadata.
pub(crate) fn texture(varied: &VariedTable, is_dds: bool, recipe: &str) -> Result<Vec<u8>, Failure> {
    let (layers, texels) = varied_texels(varied);
    let sizes = Texture { width: ROWS, height: varied.tables().len(), layers, ..Texture::default() };
    if is_dds {
        return Ok(write_dds_rgba(&sizes, &texels, Precision::Half)?.bytes);
    }
    let [first, last] = varied.range();
    let entries = [
        ("specula.taps", varied.taps().to_string()),
        ("specula.normals", varied.normals().to_string()),
        ("specula.range", format!("[{first}, {last}]")),
    ];
    let entries = entries.each_ref().map(|(key, text)| (*key, text.as_str()));
    Ok(write_ktx2_rgba(&sizes, &texels, Precision::Half, Some(recipe), &entries)?.bytes)
}
