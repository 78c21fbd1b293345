//! A texture for engines: a picture, an array of them, a cube or a volume, before it is put into a container.
//!
//! KTX2 and DDS hold the same pixels in the same order, four channels each, so that packing and unpacking stand here.

use half::f16;
use rayon::prelude::*;

use crate::error::{Error, ErrorKind};
use crate::{MAX_PIXELS, Precision};

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
    /// Layers of an array; 0 where it is none. An array of one layer is an array still.
    pub layers: usize,
    /// 6 for a cube (+X -X +Y -Y +Z -Z), 1 for everything else.
    pub faces: usize,
    /// RGB, shape [layers (at least 1), faces, depth, height, width]: the row index 0 is the image's top.
    pub pixels: Vec<[f32; 3]>,
}

impl Texture {
    /// The number of pixels that the sizes declare; `None` where it overflows.
    pub fn len(&self) -> Option<usize> {
        [self.height, self.depth, self.faces, self.layers.max(1)]
            .into_iter()
            .try_fold(self.width, |product, size| product.checked_mul(size))
    }

    /// Whether the sizes declare no pixel.
    pub fn is_empty(&self) -> bool {
        self.len() == Some(0)
    }

    /// Why this is no texture, if it is none.
    pub(crate) fn fault(&self) -> Option<String> {
        let Self { width, height, depth, layers, faces, .. } = *self;
        match self.len() {
            _ if ![1, 6].contains(&faces) => Some(format!("{faces} faces; a texture has 1 or 6")),
            _ if faces == 6 && width != height => {
                Some(format!("faces of {width} x {height}; those of a cube are square"))
            }
            _ if depth > 1 && (layers > 0 || faces > 1) => {
                Some("a volume with layers or faces; it has neither".into())
            }
            Some(0) => Some(format!("{width} x {height} x {depth} pixels; no size may be 0")),
            Some(len) if len <= MAX_PIXELS => None,
            _ => Some(format!(
                "{width} x {height} x {depth} pixels, {layers} layers, {faces} faces; at most {MAX_PIXELS} pixels in all"
            )),
        }
    }
}

/// Red, green, blue and an alpha of 1, little endian; and how many values a half could not hold.
///
/// # Errors
/// [`ErrorKind::Unwritable`] where the sizes are impossible or are not those of the pixels.
pub(crate) fn pack(texture: &Texture, precision: Precision) -> Result<(Vec<u8>, usize), Error> {
    let unwritable = |message| Error::new(ErrorKind::Unwritable, message);
    if let Some(fault) = texture.fault() {
        return Err(unwritable(format!("expected a texture, found {fault}")));
    }
    if texture.len() != Some(texture.pixels.len()) {
        let (found, expected) = (texture.pixels.len(), texture.len().unwrap_or_default());
        return Err(unwritable(format!("expected {expected} pixels as the sizes say, found {found}")));
    }
    let mut bytes = vec![0; texture.pixels.len() * pixel_bytes(precision)];
    match precision {
        Precision::Float => {
            bytes.par_chunks_exact_mut(16).zip(&texture.pixels).for_each(|(bytes, [r, g, b])| {
                for (bytes, value) in bytes.chunks_exact_mut(4).zip([*r, *g, *b, 1.0]) {
                    bytes.copy_from_slice(&value.to_le_bytes());
                }
            });
            Ok((bytes, 0))
        }
        Precision::Half => {
            let pixels = bytes.par_chunks_exact_mut(8).zip(&texture.pixels);
            let clamped = pixels.map(|(bytes, [r, g, b])| {
                let mut clamped = 0;
                for (bytes, value) in bytes.chunks_exact_mut(2).zip([*r, *g, *b, 1.0]) {
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

/// The nearest half, ties to even, and whether the value was past the largest, +-65504, which it then became.
pub(crate) fn to_half(value: f32) -> (f16, bool) {
    const MAX: f32 = 65504.0;
    (f16::from_f32(value.clamp(-MAX, MAX)), value.abs() > MAX)
}
