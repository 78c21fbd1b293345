//! Reading a picture of any format.

use sh::Stop;

use super::decoded::{Decoded, ReadOptions};
use super::recognition::identify;
use crate::error::Error;

/// Reads a picture of any [`crate::format::Format`], known by its content.
///
/// Values come out linear and in Rec. 709 primaries; alpha is ignored. PNG, JPEG, TIFF, TGA and WebP are
/// converted by their ICC profile, or PNG by its cICP; without one, integers are taken for sRGB and floats
/// for linear Rec. 709. A JPEG with a gain map becomes its full rendition in HDR. A warning says if a picture
/// holds no high dynamic range. Colours outside of Rec. 709 are brought in, counted in a warning or, if
/// hardly any light moves, in a note. NaN, infinite and negative values of floats are given as they are
/// stored: judging them is up to the caller. Of several frames, the first is read, and of a TIFF's pages the
/// largest. Pictures are turned upright as Exif and TIFF say.
///
/// Memory: pictures of OpenEXR and Radiance consist of blocks of rows, which are compressed without loss as
/// soon as they are decoded, to less than a file with ZIP, PIZ or RGBE ([`envmap::Image::rows`]). Other
/// formats, and luminance and chroma, take 12 bytes for each pixel of the result, and about as much more
/// while they are decoded (twice with 64 bits in a sample). The result has at most
/// [`crate::limits::MAX_PIXELS`], and a header that declares more than its file can hold is refused before
/// that is allocated. A lossless WebP of any length can hold any picture.
///
/// # Errors
/// If the file is empty, a Git LFS pointer, of another format, truncated, damaged or too large, uses
/// something that is not read (deep data, subsampled RGB, signed integers), or has no layer of the
/// wanted name.
///
/// # Example: content decides, not a name
/// ```
/// use containers::{ErrorKind, Format, ReadOptions, read_image, write_rgbe};
/// let grey = envmap::Image::new(1, 1, vec![[0.5; 3]]).unwrap();
/// let bytes = write_rgbe(&grey, None)?.bytes;
/// assert_eq!(read_image(&bytes, &ReadOptions::default())?.format, Format::Radiance);
/// assert_eq!(read_image(b"PK..", &ReadOptions::default()).unwrap_err().kind(), ErrorKind::UnknownFormat);
/// # Ok::<(), containers::Error>(())
/// ```
pub fn read_image(bytes: &[u8], options: &ReadOptions) -> Result<Decoded, Error> {
    read_image_until(bytes, options, Stop::NEVER)
}

/// [`read_image`], which asks `stop` before each of the blocks of an OpenEXR or Radiance picture.
///
/// # Errors
/// The errors of [`read_image`], and [`crate::ErrorKind::Stopped`].
pub fn read_image_until(bytes: &[u8], options: &ReadOptions, stop: Stop<'_>) -> Result<Decoded, Error> {
    let codec = identify(bytes)?.codec();
    let mut decoded = (codec.read)(bytes, options, stop).map_err(|error| error.within(codec.name))?;
    decoded.high_dynamic_range |= codec.high_dynamic_range;
    if !decoded.high_dynamic_range {
        let encoding = match &decoded.profile {
            Some(name) if options.colour_space.is_some() => {
                let source = if name.starts_with("cICP ") { "" } else { "ICC profile, " };
                format!("with the curve of its {source}{name}")
            }
            Some(name) if name.starts_with("cICP ") => format!("as its {name} says"),
            Some(name) => format!("by its ICC profile, {name}"),
            None => "from sRGB".into(),
        };
        decoded.warnings.push(format!(
            "{} holds no high dynamic range: no light in it is brighter than its white; it was decoded {encoding}",
            codec.name
        ));
    }
    if let Some(layer) = options.layer.as_deref().filter(|_| !codec.has_layers) {
        decoded.warnings.push(format!("{} has no layers; `{layer}` was ignored", codec.name));
    }
    Ok(decoded)
}
