//! Reading a picture of any format.

use envmap::Image;

use crate::error::Error;
use crate::format::{Format, identify};
use crate::{jpeg, open_exr, png, radiance};

/// What to read where a file holds several pictures.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ReadOptions {
    /// The OpenEXR layer: a part's name, a channel prefix, or `part.prefix`. The other formats have no layers.
    pub layer: Option<String>,
}

/// The layout that OpenEXR's `envmap` attribute names.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum OpenExrEnvmap {
    /// OpenEXR's lat-long: pixel centres on the poles, the last column repeats the first.
    LatLong,
    /// OpenEXR's cube: six faces below each other.
    Cube,
}

/// A picture and what its file says of it.
#[derive(Clone, Debug, PartialEq)]
pub struct Decoded {
    /// Linear Rec. 709 values in the file's own units, row 0 at the top of the picture.
    pub image: Image,
    /// The format that the content is in.
    pub format: Format,
    /// OpenEXR's `envmap` attribute.
    pub openexr_envmap: Option<OpenExrEnvmap>,
    /// Whether the format can hold values above its white.
    pub high_dynamic_range: bool,
    /// What was ignored or assumed, in whole sentences.
    pub warnings: Vec<String>,
    /// The recipe, where this project wrote the file.
    pub recipe: Option<String>,
}

impl Decoded {
    pub(crate) fn new(format: Format, image: Image) -> Self {
        Self {
            image,
            format,
            openexr_envmap: None,
            high_dynamic_range: format.high_dynamic_range(),
            warnings: Vec::new(),
            recipe: None,
        }
    }
}

/// A file's bytes, and how many values had to be clamped to fit the format.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Encoded {
    /// The whole file.
    pub bytes: Vec<u8>,
    /// Values that the format cannot hold and that were replaced by the nearest that it can.
    pub clamped: usize,
}

/// Reads a picture: OpenEXR, Radiance, PNG or JPEG, known by its content.
///
/// Values come out linear and in Rec. 709 primaries; alpha is ignored. PNG and JPEG are taken for sRGB, and
/// a warning says that they hold no high dynamic range. NaN, infinite and negative values are given as they
/// are stored: judging them is the caller's.
///
/// Memory: 12 bytes for each pixel of the result, at most 12 more while it is decoded, and the compressed blocks
/// in work. The result has at most [`crate::MAX_PIXELS`], and a header that declares more than its file can hold is
/// refused before that is allocated.
///
/// # Errors
/// Where the file is empty, a Git LFS pointer, of another format, truncated, damaged or too large, uses
/// something that is not read (deep data, subsampled channels), or has no layer of the wanted name.
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
    let format = identify(bytes)?;
    let decoded = match format {
        Format::OpenExr => open_exr::read(bytes, options.layer.as_deref()),
        Format::Radiance => radiance::read(bytes),
        Format::Png => png::read(bytes),
        Format::Jpeg => jpeg::read(bytes),
    };
    let mut decoded = decoded.map_err(|error| error.within(format.name()))?;
    if !format.high_dynamic_range() {
        decoded.warnings.push(format!(
            "{} holds no high dynamic range: no light in it is brighter than its white; it was decoded from sRGB",
            format.name()
        ));
    }
    if let Some(layer) = options.layer.as_deref().filter(|_| format != Format::OpenExr) {
        decoded.warnings.push(format!("{} has no layers; `{layer}` was ignored", format.name()));
    }
    Ok(decoded)
}
