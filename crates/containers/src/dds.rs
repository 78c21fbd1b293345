//! DDS with the DX10 header (Microsoft's DDS programming guide): textures of four 16 or 32-bit floats, one
//! level of detail.
//!
//! | bytes | what |
//! | --- | --- |
//! | 0 | `DDS ` |
//! | 4 | the header, 124 bytes: size, flags, height, width, pitch, depth, levels, 11 reserved u32, pixel format, caps |
//! | 128 | the DX10 header, five u32: DXGI format, dimension, cube flag, elements of the array, alpha mode |
//! | 148 | pixels in the order layer, face, slice, row |
//!
//! A file holds no texts: the recipe goes into a JSON file beside it ([`crate::texture_sidecar`]). An array
//! of one element looks like no array, and is read as none.

use std::collections::BTreeMap;

use crate::decoded::Encoded;
use crate::error::{Error, ErrorKind};
use crate::format::refuse_non_files;
use crate::precision::Precision;
use crate::texture::{Texture, TextureFile, pack, pixel_bytes, size, unpack, word};

/// The first bytes of every DDS file.
const MAGIC: [u8; 4] = *b"DDS ";

const LENGTH: usize = 148;

/// DXGI_FORMAT and its precision.
const FORMATS: [(u32, Precision); 2] = [(10, Precision::Half), (2, Precision::Float)];

const FOURCC: u32 = 0x4;
const DX10: u32 = u32::from_le_bytes(*b"DX10");
const TEXTURE_2D: u32 = 3;
const TEXTURE_3D: u32 = 4;
const CUBE: u32 = 0x4;
const ALPHA_OPAQUE: u32 = 3;

/// Writes DDS: R16G16B16A16_FLOAT or R32G32B32A32_FLOAT with an alpha of 1.
///
/// With [`Precision::Half`] values past +-65504 become it and are counted.
///
/// # Errors
/// If the texture's sizes are impossible or not those of its pixels.
///
/// # Example: a volume comes back
/// ```
/// use containers::{Precision, Texture, read_dds, write_dds};
/// let volume = Texture { width: 3, height: 2, depth: 4, layers: 0, faces: 1, pixels: vec![[0.5; 3]; 24] };
/// assert_eq!(read_dds(&write_dds(&volume, Precision::Half)?.bytes)?, volume);
/// # Ok::<(), containers::Error>(())
/// ```
pub fn write_dds(texture: &Texture, precision: Precision) -> Result<Encoded, Error> {
    let (pixels, clamped) = pack(texture, precision).map_err(|error| error.within("DDS"))?;
    let (volume, cube) = (texture.depth > 1, texture.faces == 6);
    let mut words = [0_u32; (LENGTH - 4) / 4];
    // Caps, height, width, pitch, pixel format, level count; depth.
    let flags = 0x1 | 0x2 | 0x4 | 0x8 | 0x1000 | 0x2_0000 | if volume { 0x80_0000 } else { 0 };
    // At most MAX_PIXELS each, which pack() has checked.
    let narrow = |value: usize| value as u32;
    words[..7].copy_from_slice(&[
        124,
        flags,
        narrow(texture.height),
        narrow(texture.width),
        narrow(texture.width * pixel_bytes(precision)),
        if volume { narrow(texture.depth) } else { 0 },
        1,
    ]);
    words[18..21].copy_from_slice(&[32, FOURCC, DX10]);
    // Texture; complex if there is more than one image. All six faces, or volume.
    let complex = volume || cube || texture.layers > 1;
    words[26] = 0x1000 | if complex { 0x8 } else { 0 };
    words[27] = if cube { 0xfe00 } else { 0 } | if volume { 0x20_0000 } else { 0 };
    words[31..].copy_from_slice(&[
        FORMATS.iter().find(|(_, of)| *of == precision).map_or(0, |(format, _)| *format),
        if volume { TEXTURE_3D } else { TEXTURE_2D },
        if cube { CUBE } else { 0 },
        narrow(texture.layers.max(1)),
        ALPHA_OPAQUE,
    ]);
    let mut bytes = Vec::with_capacity(LENGTH + pixels.len());
    bytes.extend_from_slice(&MAGIC);
    bytes.extend(words.iter().flat_map(|word| word.to_le_bytes()));
    bytes.extend_from_slice(&pixels);
    Ok(Encoded { bytes, clamped })
}

/// Reads the subset of DDS that [`write_dds`] writes, whichever program wrote it: with a DX10 header, RGBA of
/// 16 or 32-bit floats, one level of detail. Alpha is ignored.
///
/// # Errors
/// If the file is truncated, damaged, too large, or of another pixel format.
pub fn read_dds(bytes: &[u8]) -> Result<Texture, Error> {
    read(bytes).map(|file| file.texture)
}

/// Whether the bytes begin as a DDS file.
pub(crate) fn is_dds(bytes: &[u8]) -> bool {
    bytes.starts_with(&MAGIC)
}

pub(crate) fn read(bytes: &[u8]) -> Result<TextureFile, Error> {
    parse(bytes).map_err(|error| error.within("DDS"))
}

fn parse(bytes: &[u8]) -> Result<TextureFile, Error> {
    refuse_non_files(bytes)?;
    if !bytes.starts_with(&MAGIC) {
        return Err(if MAGIC.starts_with(bytes) {
            Error::truncated("the file ends before its data does")
        } else {
            Error::new(ErrorKind::UnknownFormat, "expected a DDS file, found other first bytes")
        });
    }
    let words: Vec<u32> = (1..LENGTH / 4).map_while(|position| word(bytes, 4 * position)).collect();
    let at = |position: usize| {
        words.get(position).copied().ok_or_else(|| Error::truncated("the file ends within its header"))
    };
    if (at(0)?, at(18)?) != (124, 32) {
        return Err(Error::damaged("the header's sizes: expected 124 and 32"));
    }
    if at(19)? & FOURCC == 0 || at(20)? != DX10 {
        return Err(Error::unsupported(
            "only files with a DX10 header are read; convert the texture with texconv",
        ));
    }
    let (format, dimension, misc, elements) = (at(31)?, at(32)?, at(33)?, at(34)?);
    at(35)?;
    let Some((_, precision)) = FORMATS.iter().find(|(known, _)| *known == format) else {
        return Err(Error::unsupported(format!(
            "DXGI format {format} is not read; expected 10 (RGBA, 16-bit floats) or 2 (RGBA, 32-bit floats)"
        )));
    };
    if ![TEXTURE_2D, TEXTURE_3D].contains(&dimension) {
        return Err(Error::unsupported(format!(
            "dimension {dimension} is not read; expected 3 (2D) or 4 (3D)"
        )));
    }
    if at(6)? > 1 {
        return Err(Error::unsupported(format!("{} levels of detail are not read; expected one", at(6)?)));
    }
    let volume = dimension == TEXTURE_3D;
    let mut texture = Texture {
        width: size(at(3)?),
        height: size(at(2)?),
        depth: if volume { size(at(5)?) } else { 1 },
        layers: if elements > 1 { size(elements) } else { 0 },
        faces: if misc & CUBE != 0 { 6 } else { 1 },
        pixels: Vec::new(),
    };
    let expected = texture.expected_bytes(*precision)?;
    let pixels = &bytes[LENGTH..];
    if pixels.len() < expected {
        return Err(Error::truncated(format!("expected {expected} bytes of pixels, found {}", pixels.len())));
    }
    if pixels.len() > expected {
        return Err(Error::damaged(format!("expected {expected} bytes of pixels, found {}", pixels.len())));
    }
    texture.pixels = unpack(pixels, *precision);
    Ok(TextureFile { texture, precision: *precision, container: "DDS", metadata: BTreeMap::new() })
}
