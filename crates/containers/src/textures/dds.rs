//! DDS with the DX10 header (Microsoft's DDS programming guide): textures in one of the [`TexelFormat`]s,
//! with their levels of detail.
//!
//! | bytes | what |
//! | --- | --- |
//! | 0 | `DDS ` |
//! | 4 | the header, 124 bytes: size, flags, height, width, pitch, depth, levels, 11 reserved u32, pixel format, caps |
//! | 128 | the DX10 header, five u32: DXGI format, dimension, cube flag, elements of the array, alpha mode |
//! | 148 | pixels in the order layer, face, level (the largest first), slice, row |
//!
//! A file holds no texts: the recipe goes into a JSON file beside it ([`crate::recipe::texture_sidecar`]). An
//! array of one element looks like no array, and is read as none.

use std::collections::BTreeMap;

use super::container::Container;
use super::texel::{ByteFormat, Packed, TexelEncoding, TexelFormat, foreign_dxgi};
use super::texture::{Texture, TextureFile, pack_rgba};
use crate::error::Error;
use crate::header_word::{size, word};
use crate::images::Encoded;
use crate::precision::Precision;

/// The first bytes of every DDS file.
const MAGIC: [u8; 4] = *b"DDS ";

pub(crate) const CONTAINER: Container = Container {
    name: "DDS",
    ending: "dds",
    signature: &MAGIC,
    declares_cube: |first| word(first, 112).is_some_and(|caps| caps & OLD_CUBE != 0),
    parse,
    recipe: |_| None,
};

const LENGTH: usize = 148;

const FOURCC: u32 = 0x4;
const DX10: u32 = u32::from_le_bytes(*b"DX10");
const TEXTURE_2D: u32 = 3;
const TEXTURE_3D: u32 = 4;
const CUBE: u32 = 0x4;
const ALPHA_OPAQUE: u32 = 3;
/// The fourth number is no opacity.
const ALPHA_CUSTOM: u32 = 4;

/// Where the pixels of a file without DX10 header begin, and its formats: D3DFMT_A16B16G16R16F and
/// D3DFMT_A32B32G32R32F, in which AMD's CubeMapGen, Lys and others write light.
const OLD_LENGTH: usize = 128;
const OLD_FORMATS: [(u32, TexelFormat); 2] = [(113, TexelFormat::Rgba16F), (116, TexelFormat::Rgba32F)];

/// The flag of colours without a code, and masks of red with four bytes for a texel: D3DFMT_A8B8G8R8 and
/// D3DFMT_A8R8G8B8.
const RGB: u32 = 0x40;
const OLD_MASKS: [(u32, bool); 2] = [(0xff, false), (0xff_0000, true)];

/// The flags of a cube, of its six faces and of a volume there.
const OLD_CUBE: u32 = 0x200;
const OLD_FACES: u32 = 0xfc00;
const OLD_VOLUME: u32 = 0x20_0000;

/// Writes DDS; formats of four channels have an alpha of 1.
///
/// Numbers that the format cannot hold are counted, as by [`crate::textures::ktx2::write_ktx2`].
///
/// # Errors
/// If the texture's sizes are impossible or not those of its pixels.
///
/// # Example: a volume comes back
/// ```
/// use containers::{Precision, Texture, read_dds, write_dds};
/// let pixels = vec![[0.5; 3]; 24];
/// let volume = Texture { width: 3, height: 2, depth: 4, pixels, ..Texture::default() };
/// assert_eq!(read_dds(&write_dds(&volume, Precision::Half)?.bytes)?, volume);
/// # Ok::<(), containers::Error>(())
/// ```
pub fn write_dds(texture: &Texture, encoding: impl Into<TexelEncoding>) -> Result<Encoded, Error> {
    let encoding = encoding.into();
    let levels = texture.pack(encoding).map_err(|error| error.within("DDS"))?;
    Ok(write(texture, &levels, encoding.format, ALPHA_OPAQUE))
}

/// Writes DDS of four channels, none of which is an opacity: `rgba` are the pixels of a texture with the
/// sizes of `sizes`, whose own pixels are ignored.
///
/// # Errors
/// The errors of [`write_dds`].
pub fn write_dds_rgba(sizes: &Texture, rgba: &[[f32; 4]], precision: Precision) -> Result<Encoded, Error> {
    let level = pack_rgba(sizes, rgba, precision).map_err(|error| error.within("DDS"))?;
    Ok(write(sizes, &[level], precision.into(), ALPHA_CUSTOM))
}

fn write(texture: &Texture, levels: &[Packed], format: TexelFormat, alpha: u32) -> Encoded {
    let (volume, cube, (block, edge)) = (texture.depth > 1, texture.faces == 6, format.block());
    let row = texture.width.div_ceil(edge) * block;
    // Of blocks the first image's bytes are declared instead of a row's.
    let (pitch_flag, pitch) =
        if edge > 1 { (0x8_0000, row * texture.height.div_ceil(edge)) } else { (0x8, row) };
    let mut words = [0_u32; (LENGTH - 4) / 4];
    // Caps, height, width, pixel format, level count; depth.
    let flags = 0x1 | 0x2 | 0x4 | pitch_flag | 0x1000 | 0x2_0000 | if volume { 0x80_0000 } else { 0 };
    // At most MAX_PIXELS each, which pack() has checked.
    let narrow = |value: usize| value as u32;
    words[..7].copy_from_slice(&[
        124,
        flags,
        narrow(texture.height),
        narrow(texture.width),
        narrow(pitch),
        if volume { narrow(texture.depth) } else { 0 },
        narrow(levels.len()),
    ]);
    words[18..21].copy_from_slice(&[32, FOURCC, DX10]);
    // Texture; complex if there is more than one image; levels. All six faces, or volume.
    let complex = volume || cube || texture.layers > 1 || levels.len() > 1;
    words[26] = 0x1000 | if complex { 0x8 } else { 0 } | if levels.len() > 1 { 0x40_0000 } else { 0 };
    words[27] = if cube { 0xfe00 } else { 0 } | if volume { 0x20_0000 } else { 0 };
    words[31..].copy_from_slice(&[
        format.dxgi(),
        if volume { TEXTURE_3D } else { TEXTURE_2D },
        if cube { CUBE } else { 0 },
        narrow(texture.layers.max(1)),
        alpha,
    ]);
    let mut bytes = Vec::with_capacity(LENGTH + levels.iter().map(|level| level.bytes.len()).sum::<usize>());
    bytes.extend_from_slice(&MAGIC);
    bytes.extend(words.iter().flat_map(|word| word.to_le_bytes()));
    let images = texture.faces * texture.layers.max(1);
    for image in 0..images {
        for level in levels {
            let length = level.bytes.len() / images;
            bytes.extend_from_slice(&level.bytes[image * length..(image + 1) * length]);
        }
    }
    let negative = levels.iter().map(|level| level.negative).sum();
    Encoded { bytes, negative }
}

/// Reads the subset of DDS that [`write_dds`] writes, whichever program wrote it, and the other formats that
/// [`TexelFormat`] has: with a DX10 header, or, of RGBA in halves, floats or bytes, without one. Bytes are
/// sRGB's codes, as pictures are, also if their format does not say so.
/// Alpha is ignored, and blue is 0 if there are two channels.
///
/// # Errors
/// If the file is truncated, damaged, too large, or of another pixel format.
pub fn read_dds(bytes: &[u8]) -> Result<Texture, Error> {
    CONTAINER.read(bytes).map(|file| file.texture)
}

/// The format of the codes of sRGB with the same bytes: of R8G8B8A8, B8G8R8A8 and B8G8R8X8.
fn encoded(format: u32) -> u32 {
    match format {
        28 => 29,
        87 | 88 | 93 => 91,
        other => other,
    }
}

fn parse(bytes: &[u8]) -> Result<TextureFile, Error> {
    let words: Vec<u32> = (1..LENGTH / 4).map_while(|position| word(bytes, 4 * position)).collect();
    let at = |position: usize| {
        words.get(position).copied().ok_or_else(|| Error::truncated("the file ends within its header"))
    };
    if (at(0)?, at(18)?) != (124, 32) {
        return Err(Error::damaged("the header's sizes: expected 124 and 32"));
    }
    let code = if at(19)? & FOURCC == 0 { 0 } else { at(20)? };
    let old = OLD_FORMATS.iter().find(|(old, _)| *old == code).map(|(_, format)| *format);
    let is_rgb = code == 0 && at(19)? & RGB != 0 && (at(21)?, at(23)?) == (32, 0xff00);
    let masks = OLD_MASKS.iter().find(|(red, _)| is_rgb && at(22).ok() == Some(*red));
    let old = old.or_else(|| {
        let (_, is_bgr) = *masks?;
        Some(TexelFormat::Bytes(ByteFormat { channels: 4, is_bgr, is_srgb: true }))
    });
    let (format, dimension, misc, elements, begin) = match old {
        Some(format) => {
            let caps = at(27)?;
            let cube = if caps & OLD_CUBE != 0 { CUBE } else { 0 };
            if cube != 0 && caps & OLD_FACES != OLD_FACES {
                return Err(Error::unsupported("a cube without all six faces is not read"));
            }
            let dimension = if caps & OLD_VOLUME != 0 { TEXTURE_3D } else { TEXTURE_2D };
            (format, dimension, cube, 1, OLD_LENGTH)
        }
        None if code == DX10 => {
            let (format, dimension, misc, elements) = (at(31)?, at(32)?, at(33)?, at(34)?);
            at(35)?;
            let Some(format) =
                TexelFormat::read().find(|known| known.dxgi() == encoded(format) && format != 0)
            else {
                let name = foreign_dxgi(format).map_or(String::new(), |name| format!(" ({name})"));
                return Err(Error::unsupported(format!(
                    "DXGI format {format}{name} is not read; expected {}",
                    TexelFormat::listed(TexelFormat::dxgi)
                )));
            };
            (format, dimension, misc, elements, LENGTH)
        }
        None => {
            return Err(Error::unsupported(
                "without a DX10 header only RGBA in halves, floats or bytes is read; convert the texture with texconv",
            ));
        }
    };
    if ![TEXTURE_2D, TEXTURE_3D].contains(&dimension) {
        return Err(Error::unsupported(format!(
            "dimension {dimension} is not read; expected 3 (2D) or 4 (3D)"
        )));
    }
    let volume = dimension == TEXTURE_3D;
    let mut texture = Texture {
        width: size(at(3)?),
        height: size(at(2)?),
        depth: if volume { size(at(5)?) } else { 1 },
        layers: if elements > 1 { size(elements) } else { 0 },
        faces: if misc & CUBE != 0 { 6 } else { 1 },
        ..Texture::default()
    };
    let levels = texture.expected_bytes(size(at(6)?).max(1), format)?;
    let (expected, pixels) = (levels.iter().sum::<usize>(), bytes.get(begin..).unwrap_or_default());
    if pixels.len() < expected {
        return Err(Error::truncated(format!("expected {expected} bytes of pixels, found {}", pixels.len())));
    }
    if pixels.len() > expected {
        return Err(Error::damaged(format!("expected {expected} bytes of pixels, found {}", pixels.len())));
    }
    let images = texture.faces * texture.layers.max(1);
    let mut offset = 0;
    for (level, length) in levels.iter().map(|bytes| bytes / images).enumerate() {
        let image = |image: usize| &pixels[image * (expected / images) + offset..][..length];
        let bytes: Vec<u8> = (0..images).flat_map(image).copied().collect();
        texture.unpack(level, format, &bytes);
        offset += length;
    }
    Ok(TextureFile { texture, format, container: CONTAINER.name, metadata: BTreeMap::new() })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cube_without_the_dx10_header_is_read() {
        let pixels = (0..24).map(|value| [value as f32, 0.5, 2.0]).collect();
        let cube = Texture { width: 2, height: 2, faces: 6, pixels, ..Texture::default() };
        for (precision, code) in [(Precision::Half, 113_u32), (Precision::Float, 116)] {
            let new = write_dds(&cube, precision).unwrap().bytes;
            let mut old = [&new[..OLD_LENGTH], &new[LENGTH..]].concat();
            old[84..88].copy_from_slice(&code.to_le_bytes());
            assert_eq!(read_dds(&old).unwrap(), cube);
            for cut in 5..old.len() {
                assert!(read_dds(&old[..cut]).is_err(), "{cut}");
            }
        }
    }
}
