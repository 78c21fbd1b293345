//! A texture for engines: a picture, an array of them, a cube or a volume, before it is put into a container.
//!
//! KTX2 and DDS hold the same pixels in the same order, four channels each, so that packing and unpacking
//! stand here.

use std::collections::BTreeMap;

use half::f16;
use rayon::prelude::*;

use crate::error::{Error, ErrorKind};
use crate::limits::MAX_PIXELS;
use crate::precision::{Precision, to_half};

/// A texture of linear Rec. 709 colours, one level of detail.
///
/// # Example: a cube array of two layers has twelve faces
/// ```
/// use containers::Texture;
/// let shape = Texture { width: 4, height: 4, depth: 1, layers: 2, faces: 6, pixels: Vec::new() };
/// assert_eq!(shape.len(), Some(2 * 6 * 4 * 4));
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Texture {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Slices of a volume; 1 for everything else.
    pub depth: usize,
    /// Layers of an array, 0 if it is not an array. One layer still makes an array.
    pub layers: usize,
    /// 6 for a cube (+X -X +Y -Y +Z -Z), 1 for everything else.
    pub faces: usize,
    /// RGB, shape [layers (at least 1), faces, depth, height, width]: the row index 0 is the image's top.
    pub pixels: Vec<[f32; 3]>,
}

impl Texture {
    /// The number of pixels that the sizes declare; `None` if it overflows.
    pub fn len(&self) -> Option<usize> {
        [self.height, self.depth, self.faces, self.layers.max(1)]
            .into_iter()
            .try_fold(self.width, |product, size| product.checked_mul(size))
    }

    /// Whether the sizes declare no pixel.
    pub fn is_empty(&self) -> bool {
        self.len() == Some(0)
    }

    /// Why no texture has these sizes, if none has.
    fn size_error(&self) -> Option<Error> {
        let Self { width, height, depth, layers, faces, .. } = *self;
        let shape = format!("{width} x {height} x {depth} pixels, {layers} layers, {faces} faces");
        let why = match self.len() {
            _ if ![1, 6].contains(&faces) => "a texture has 1 or 6 faces",
            _ if faces == 6 && width != height => "the faces of a cube are square",
            _ if depth > 1 && (layers > 0 || faces > 1) => "a volume has neither layers nor faces",
            Some(0) => "no size may be 0",
            Some(len) if len <= MAX_PIXELS => return None,
            _ => {
                let message = format!("{shape}: at most {MAX_PIXELS} pixels in all");
                return Some(Error::new(ErrorKind::TooLarge, message));
            }
        };
        Some(Error::damaged(format!("{shape}: {why}")))
    }

    /// The bytes of the pixels that a file's header declares.
    ///
    /// # Errors
    /// If no texture has these sizes, or they are over the limit.
    pub(crate) fn expected_bytes(&self, precision: Precision) -> Result<usize, Error> {
        match self.size_error() {
            Some(error) => Err(error.within("the header")),
            None => Ok(self.len().unwrap_or_default() * pixel_bytes(precision)),
        }
    }
}

/// A texture and what its file says about it.
#[derive(Clone, Debug, PartialEq)]
pub struct TextureFile {
    /// The texture.
    pub texture: Texture,
    /// The numbers in the file.
    pub precision: Precision,
    /// `KTX2` or `DDS`.
    pub container: &'static str,
    /// The texts in the file, the recipe among them; a DDS file has none.
    pub metadata: BTreeMap<String, String>,
}

/// Red, green, blue and an alpha of 1, little endian; and how many values a half could not hold.
///
/// # Errors
/// [`ErrorKind::Unwritable`] if the sizes are impossible or are not those of the pixels.
pub(crate) fn pack(texture: &Texture, precision: Precision) -> Result<(Vec<u8>, usize), Error> {
    pack_rgba(texture, texture.pixels.par_iter().map(|[r, g, b]| [*r, *g, *b, 1.0]), precision)
}

/// Four channels of a texture of these sizes, little endian; and how many values a half could not hold.
///
/// # Errors
/// As [`pack`].
pub(crate) fn pack_rgba(
    sizes: &Texture,
    pixels: impl IndexedParallelIterator<Item = [f32; 4]>,
    precision: Precision,
) -> Result<(Vec<u8>, usize), Error> {
    let unwritable = |message| Error::new(ErrorKind::Unwritable, message);
    if let Some(error) = sizes.size_error() {
        return Err(unwritable(error.to_string()));
    }
    if sizes.len() != Some(pixels.len()) {
        let (found, expected) = (pixels.len(), sizes.len().unwrap_or_default());
        return Err(unwritable(format!("expected {expected} pixels as the sizes say, found {found}")));
    }
    let mut bytes = vec![0; pixels.len() * pixel_bytes(precision)];
    match precision {
        Precision::Float => {
            bytes.par_chunks_exact_mut(16).zip(pixels).for_each(|(bytes, rgba)| {
                for (bytes, value) in bytes.chunks_exact_mut(4).zip(rgba) {
                    bytes.copy_from_slice(&value.to_le_bytes());
                }
            });
            Ok((bytes, 0))
        }
        Precision::Half => {
            let pixels = bytes.par_chunks_exact_mut(8).zip(pixels);
            let clamped = pixels.map(|(bytes, rgba)| {
                let mut clamped = 0;
                for (bytes, value) in bytes.chunks_exact_mut(2).zip(rgba) {
                    let (kept, past) = to_half(value);
                    clamped += usize::from(past);
                    bytes.copy_from_slice(&kept.to_le_bytes());
                }
                clamped
            });
            let clamped = clamped.sum();
            Ok((bytes, clamped))
        }
    }
}

/// The colours of packed pixels; their alpha is ignored.
pub(crate) fn unpack(bytes: &[u8], precision: Precision) -> Vec<[f32; 3]> {
    match precision {
        Precision::Float => {
            let value = |bytes: &[u8]| f32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]);
            let pixel = |bytes: &[u8]| [value(&bytes[0..]), value(&bytes[4..]), value(&bytes[8..])];
            bytes.par_chunks_exact(16).map(pixel).collect()
        }
        Precision::Half => {
            let value = |bytes: &[u8]| f16::from_le_bytes([bytes[0], bytes[1]]).to_f32();
            let pixel = |bytes: &[u8]| [value(&bytes[0..]), value(&bytes[2..]), value(&bytes[4..])];
            bytes.par_chunks_exact(8).map(pixel).collect()
        }
    }
}

/// The bytes of a pixel of four channels.
pub(crate) const fn pixel_bytes(precision: Precision) -> usize {
    match precision {
        Precision::Float => 16,
        Precision::Half => 8,
    }
}

/// The little-endian u32 at a place; `None` if the bytes end before.
pub(crate) fn word(bytes: &[u8], at: usize) -> Option<u32> {
    let word = bytes.get(at..)?.first_chunk::<4>()?;
    Some(u32::from_le_bytes(*word))
}

/// A size of a header; on a machine of 16 bits it would be too large anyway.
pub(crate) fn size(value: u32) -> usize {
    usize::try_from(value).unwrap_or(usize::MAX)
}
