//! A texture for engines: a picture, an array of them, a cube or a volume, with its levels of detail, before
//! it is put into a container.
//!
//! KTX2 and DDS hold the same texels, in orders of their own; what they share stands here.

use std::collections::BTreeMap;

use half::f16;
use rayon::prelude::*;

use super::texel::{Packed, TexelEncoding, TexelFormat};
use crate::error::{Error, ErrorKind};
use crate::limits::MAX_PIXELS;
use crate::precision::{Precision, to_half};

/// A texture of linear Rec. 709 colours.
///
/// # Example: a cube array of two layers has twelve faces, and a second level of a quarter of the pixels
/// ```
/// use containers::Texture;
/// let shape = Texture { width: 4, height: 4, layers: 2, faces: 6, ..Texture::default() };
/// assert_eq!(shape.level_len(0), Some(2 * 6 * 4 * 4));
/// assert_eq!(shape.level_len(1), Some(2 * 6 * 2 * 2));
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
    /// The further levels of detail, each with half the columns, rows and slices of the one before, rounded
    /// down, and at least 1.
    pub smaller_levels: Vec<Vec<[f32; 3]>>,
}

/// A texture that declares one pixel and has none.
impl Default for Texture {
    fn default() -> Self {
        Self {
            width: 1,
            height: 1,
            depth: 1,
            layers: 0,
            faces: 1,
            pixels: Vec::new(),
            smaller_levels: Vec::new(),
        }
    }
}

impl Texture {
    /// The pixels of each level of detail, the largest first.
    pub fn levels(&self) -> impl ExactSizeIterator<Item = &[[f32; 3]]> {
        let level = |index: usize| match index.checked_sub(1) {
            None => self.pixels.as_slice(),
            Some(smaller) => self.smaller_levels[smaller].as_slice(),
        };
        (0..self.smaller_levels.len() + 1).map(level)
    }

    /// Columns, rows and slices of a level of detail.
    pub fn level_size(&self, level: usize) -> [usize; 3] {
        let shift = u32::try_from(level).unwrap_or(u32::MAX);
        [self.width, self.height, self.depth].map(|size| size.checked_shr(shift).unwrap_or(0).max(1))
    }

    /// The number of pixels that the sizes declare for a level; `None` if it overflows.
    pub fn level_len(&self, level: usize) -> Option<usize> {
        let [width, height, depth] =
            if level == 0 { [self.width, self.height, self.depth] } else { self.level_size(level) };
        [height, depth, self.faces, self.layers.max(1)]
            .into_iter()
            .try_fold(width, |product, size| product.checked_mul(size))
    }

    /// The place of the first number that is NaN or infinite: "level 1, face -X, row 2, column 3". Rows and
    /// columns are counted from 0 at the top left.
    pub fn first_not_finite(&self) -> Option<String> {
        const FACES: [&str; 6] = ["+X", "-X", "+Y", "-Y", "+Z", "-Z"];
        self.levels().enumerate().find_map(|(level, pixels)| {
            let index = pixels.iter().position(|pixel| pixel.iter().any(|value| !value.is_finite()))?;
            let [width, height, depth] = self.level_size(level);
            let (row, column) = (index / width % height, index % width);
            let (slice, image) = (index / (width * height) % depth, index / (width * height * depth));
            let mut place = format!("level {level}");
            if self.layers > 0 {
                place += &format!(", layer {}", image / self.faces);
            }
            if self.faces == 6 {
                place += &format!(", face {}", FACES[image % 6]);
            }
            if self.depth > 1 {
                place += &format!(", slice {slice}");
            }
            Some(format!("{place}, row {row}, column {column}"))
        })
    }

    /// The largest number of levels: down to a single pixel.
    pub(crate) fn most_levels(&self) -> usize {
        self.width.max(self.height).max(self.depth).max(1).ilog2() as usize + 1
    }

    /// Why no texture has these sizes and so many levels, if none has.
    fn size_error(&self, levels: usize) -> Option<Error> {
        let Self { width, height, depth, layers, faces, .. } = *self;
        let shape = format!("{width} x {height} x {depth} pixels, {layers} layers, {faces} faces");
        let why = match self.level_len(0) {
            _ if ![1, 6].contains(&faces) => "a texture has 1 or 6 faces".to_owned(),
            _ if faces == 6 && width != height => "the faces of a cube are square".to_owned(),
            _ if depth > 1 && (layers > 0 || faces > 1) => "a volume has neither layers nor faces".to_owned(),
            Some(0) => "no size may be 0".to_owned(),
            Some(_) if levels > self.most_levels() => {
                format!("{levels} levels of detail, but the sizes halve to 1 in {}", self.most_levels())
            }
            Some(len) if len <= MAX_PIXELS => return None,
            _ => {
                let message = format!("{shape}: at most {MAX_PIXELS} pixels in all");
                return Some(Error::new(ErrorKind::TooLarge, message));
            }
        };
        Some(Error::damaged(format!("{shape}: {why}")))
    }

    /// The bytes of each level that a file's header declares.
    ///
    /// # Errors
    /// If no texture has these sizes, or they are over the limit.
    pub(crate) fn expected_bytes(&self, levels: usize, format: TexelFormat) -> Result<Vec<usize>, Error> {
        self.check_declared(levels)?;
        let bytes = |level: usize| {
            let [width, height, depth] = self.level_size(level);
            let images = depth * self.faces * self.layers.max(1);
            format.image_bytes(width, height).and_then(|bytes| bytes.checked_mul(images))
        };
        let bytes: Option<Vec<usize>> = (0..levels).map(bytes).collect();
        bytes.ok_or_else(|| Error::new(ErrorKind::TooLarge, "the header: the sizes are past this machine's"))
    }

    /// Whether the sizes and the number of levels that a file declares are possible.
    ///
    /// # Errors
    /// If no texture has these sizes, or they are over the limit.
    pub(crate) fn check_declared(&self, levels: usize) -> Result<(), Error> {
        self.size_error(levels).map_or(Ok(()), |error| Err(error.within("the header")))
    }

    /// Whether the pixels are those that the sizes say.
    ///
    /// # Errors
    /// [`ErrorKind::Unwritable`] if not, or if the sizes are impossible.
    pub(crate) fn check_sizes(&self) -> Result<(), Error> {
        if let Some(error) = self.size_error(self.levels().len()) {
            return Err(Error::new(ErrorKind::Unwritable, error.to_string()));
        }
        self.levels().enumerate().try_for_each(|(level, pixels)| self.check_len(level, pixels.len()))
    }

    /// Packs each level as it is stored.
    ///
    /// # Errors
    /// [`ErrorKind::Unwritable`] if the sizes are impossible or are not those of the pixels.
    pub(crate) fn pack(&self, encoding: TexelEncoding) -> Result<Vec<Packed>, Error> {
        self.check_sizes()?;
        let TexelEncoding { format, rounding } = encoding;
        if !TexelFormat::ALL.contains(&format) {
            return Err(Error::new(ErrorKind::Unwritable, format!("{} is not written", format.name())));
        }
        let pack = |(level, pixels)| {
            let [width, height, _] = self.level_size(level);
            format.pack(rounding, width, height, pixels)
        };
        Ok(self.levels().enumerate().map(pack).collect())
    }

    /// Whether a level has as many pixels as its sizes say.
    fn check_len(&self, level: usize, found: usize) -> Result<(), Error> {
        let expected = self.level_len(level).unwrap_or_default();
        if expected == found {
            return Ok(());
        }
        let place = if level == 0 { String::new() } else { format!("level {level}: ") };
        let message = format!("{place}expected {expected} pixels as the sizes say, found {found}");
        Err(Error::new(ErrorKind::Unwritable, message))
    }

    /// Takes the pixels of a level from its bytes.
    pub(crate) fn unpack(&mut self, level: usize, format: TexelFormat, bytes: &[u8]) {
        let [width, height, _] = self.level_size(level);
        let pixels = format.unpack(width, height, bytes);
        match level {
            0 => self.pixels = pixels,
            _ => self.smaller_levels.push(pixels),
        }
    }
}

/// A texture and what its file says about it.
#[derive(Clone, Debug, PartialEq)]
pub struct TextureFile {
    /// The texture.
    pub texture: Texture,
    /// How the file stores it.
    pub format: TexelFormat,
    /// `KTX2`, `DDS` or `KTX`.
    pub container: &'static str,
    /// The texts in the file, the recipe among them; a DDS file has none.
    pub metadata: BTreeMap<String, String>,
}

/// Four channels of a texture of these sizes, little endian.
pub(crate) fn pack_rgba(sizes: &Texture, rgba: &[[f32; 4]], precision: Precision) -> Result<Packed, Error> {
    if let Some(error) = sizes.size_error(1) {
        return Err(Error::new(ErrorKind::Unwritable, error.to_string()));
    }
    sizes.check_len(0, rgba.len())?;
    let values = rgba.as_flattened().par_iter();
    let bytes = match precision {
        Precision::Float => values.map(|value| value.to_le_bytes()).collect::<Vec<_>>().into_flattened(),
        Precision::Half => {
            values.map(|value| f16::to_le_bytes(to_half(*value))).collect::<Vec<_>>().into_flattened()
        }
    };
    Ok(Packed { bytes, negative: 0 })
}

/// The bytes of a texture of one channel, with the sizes of `sizes`.
///
/// # Errors
/// If the sizes are impossible or not those of the bytes.
pub(crate) fn pack_r8(sizes: &Texture, red: &[u8]) -> Result<Packed, Error> {
    if let Some(error) = sizes.size_error(1) {
        return Err(Error::new(ErrorKind::Unwritable, error.to_string()));
    }
    sizes.check_len(0, red.len())?;
    Ok(Packed { bytes: red.to_vec(), negative: 0 })
}
