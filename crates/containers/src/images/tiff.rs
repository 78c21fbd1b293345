//! TIFF (TIFF 6.0, and BigTIFF).
//!
//! The `tiff` crate decodes what a file's samples are: strips and tiles, planes, predictors, and the
//! compressions that it knows. What they mean is found here: the page that is the picture, its orientation,
//! white as 0, palettes, inks and the range of integers.
//!
//! Of several pages, the largest is the picture, and the first of those. Pages that call themselves reduced
//! (thumbnails) or masks are not (tags 254 and 255).

mod directory;
mod page;
mod samples;
mod single_page;

use std::io::{BufRead, Cursor, Seek};

use ::image::metadata::Orientation;
use ::tiff::TiffError;
use ::tiff::decoder::{Decoder, DecodingResult, Limits};

use super::codec::{Codec, HeaderFacts, KnownBy};
use super::colour_space::ColourSpace;
use super::decoded::Decoded;
use super::raster;
use super::raster::Raster;
use crate::error::{Error, ErrorKind};
use crate::format::Format;
use crate::limits;
use crate::metadata::Metadata;
use page::Page;
use single_page::SinglePage;

/// The most bytes of a page: RGBA in 32-bit floats of the largest picture.
const MOST_BYTES: usize = 16 * limits::MAX_PIXELS;

pub(crate) const CODEC: Codec = Codec {
    name: "TIFF",
    endings: &["tif", "tiff"],
    known_by: KnownBy::Signature(|bytes| {
        matches!(bytes, [b'I', b'I', 42 | 43, 0, ..] | [b'M', b'M', 0, 42 | 43, ..])
    }),
    high_dynamic_range: false,
    declares_high_dynamic_range: |_| false,
    has_layers: false,
    read: |bytes, options, _| read(bytes, options.colour_space),
    header: |mut file, length, _| {
        let page = Page::find(&mut file, length)?;
        let metadata = metadata(&mut file, &page);
        Ok(HeaderFacts { size: [page.width, page.height], metadata, ..HeaderFacts::default() })
    },
    recipe: |_| None,
};

fn read(bytes: &[u8], wanted: Option<ColourSpace>) -> Result<Decoded, Error> {
    let page = Page::find(&mut Cursor::new(bytes), bytes.len())?;
    let mut decoded = raster(bytes, &page)?.decode(Format::Tiff, wanted)?;
    decoded.warnings.extend(page.warnings);
    Ok(decoded)
}

/// Reads the orientation and XMP, which have tags of their own.
fn metadata(file: &mut (impl BufRead + Seek), page: &Page) -> Metadata {
    let orientation = page.directory.number(file, directory::ORIENTATION);
    let orientation = orientation.and_then(|tag| Orientation::from_exif(u8::try_from(tag).ok()?));
    let mut metadata = Metadata::default();
    metadata.orientation = orientation.unwrap_or(metadata.orientation);
    metadata.take_xmp(page.directory.bytes(file, directory::XMP).as_deref());
    metadata
}

fn raster(bytes: &[u8], page: &Page) -> Result<Raster, Error> {
    let planes = if page.planar { page.channels() } else { 1 };
    let size = page.decoded_size().saturating_mul(planes);
    if size > MOST_BYTES {
        return Err(Error::new(
            ErrorKind::TooLarge,
            format!("the page holds {size} bytes of samples; at most {MOST_BYTES} are read"),
        ));
    }
    let (mut depth, mut samples) = (0, Vec::new());
    for plane in 0..planes {
        let (bytes_of_sample, mut decoded) =
            page.native(decode(SinglePage::new(bytes, page, plane)?, page)?)?;
        depth = bytes_of_sample;
        if samples.is_empty() {
            samples = decoded;
        } else {
            samples.append(&mut decoded);
        }
    }
    let mut file = Cursor::new(bytes);
    let palette = page.palette(&mut file);
    let (channels, depth, samples) = page.arrange(depth, samples, palette)?;
    Ok(Raster {
        width: page.width,
        height: page.height,
        channels,
        depth,
        floats: page.is_float(),
        samples,
        profile: page.directory.bytes(&mut file, directory::ICC_PROFILE),
        code_points: None,
        gain_map: None,
        metadata: metadata(&mut file, page),
    })
}

/// Decodes a page or a plane by the `tiff` crate.
fn decode(mut file: SinglePage<'_>, page: &Page) -> Result<DecodingResult, Error> {
    let size = page.decoded_size();
    limits::plausible(size, file.len(), raster::DEFLATE_RATIO)?;
    let [columns, rows] = page.chunk;
    let chunk = page.row_bytes(columns).saturating_mul(rows);
    limits::plausible(chunk, file.len(), raster::DEFLATE_RATIO)?;
    let mut allowed = Limits::default();
    allowed.decoding_buffer_size = size;
    allowed.intermediate_buffer_size = size.saturating_add(file.len() + raster::WORKSPACE);
    allowed.ifd_value_size = file.len();
    let mut decoder = Decoder::new(&mut file).map_err(describe)?.with_limits(allowed);
    let mut samples = DecodingResult::U8(Vec::new());
    decoder.read_image_to_buffer(&mut samples).map_err(describe)?;
    match samples.as_buffer(0).byte_len() == size {
        true => Ok(samples),
        false => Err(Error::damaged("the pixels do not fill the declared size")),
    }
}

fn describe(error: TiffError) -> Error {
    match error {
        TiffError::LimitsExceeded => {
            Error::new(ErrorKind::TooLarge, "the decoder's limit of memory is exceeded")
        }
        TiffError::UnsupportedError(error) => Error::unsupported(format!("not read: {error}")),
        TiffError::IoError(error) if error.kind() == std::io::ErrorKind::UnexpectedEof => {
            Error::truncated("the file ends before its data does")
        }
        other => Error::damaged(other.to_string()),
    }
}
