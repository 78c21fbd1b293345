//! Pictures inside a page: PNG files as `data:` URIs.

use base64::prelude::{BASE64_STANDARD, Engine};
use containers::write_png;
use engine::Failure;

/// The `src` of an image of 8-bit sRGB pixels, rows from the top.
pub(crate) fn data_uri(width: usize, height: usize, pixels: &[[u8; 3]]) -> Result<String, Failure> {
    let png = write_png(width, height, pixels, None)?;
    Ok(format!("data:image/png;base64,{}", BASE64_STANDARD.encode(&png)))
}
