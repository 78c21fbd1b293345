//! KTX2 (KTX File Format Specification 2.0): textures of four 16 or 32-bit floats, one level of detail, no
//! supercompression.
//!
//! | bytes | what |
//! | --- | --- |
//! | 0 | identifier, then nine u32: VkFormat, bytes of a component, width, height, depth, layers, faces, levels, scheme |
//! | 48 | the places of what follows: u32 descriptor, u32 key/value data, u64 global data, each an offset and a length |
//! | 80 | the level index: u64 offset, length, uncompressed length of the one level |
//! | 104 | the data format descriptor, 92 bytes: linear BT.709 RGBA, signed floats, alpha straight |
//! | 196 | key/value data, sorted by key, each entry padded to 4 bytes |
//! | | padding to the size of a pixel, then pixels in the order layer, face, slice, row |
//!
//! Depth is 0 but for volumes and the number of layers 0 but for arrays, as the specification's table of
//! texture types wants. `KTXorientation` is `rd` (row 0 at the top; for cubes the only one allowed) and `rdi`
//! for volumes.

use std::collections::BTreeMap;

use rayon::prelude::*;

use crate::decoded::Encoded;
use crate::error::{Error, ErrorKind};
use crate::format::refuse_non_files;
use crate::precision::Precision;
use crate::recipe::{self, KEY};
use crate::texture::{Texture, TextureFile, pack, pack_rgba, pixel_bytes, size, unpack, word};

/// The first bytes of every KTX2 file.
const IDENTIFIER: [u8; 12] = *b"\xabKTX 20\xbb\r\n\x1a\n";

const HEADER: usize = 80;
const LEVEL_INDEX: usize = 24;
const DESCRIPTOR: usize = 92;

/// VkFormat and its precision.
const FORMATS: [(u32, Precision); 2] = [(97, Precision::Half), (109, Precision::Float)];

/// Writes KTX2: RGBA16F or RGBA32F with an alpha of 1.
///
/// The recipe becomes the entry `specula`, and `metadata` further entries; `KTXorientation` and `KTXwriter`
/// are added. With [`Precision::Half`] values past +-65504 become it and are counted.
///
/// # Errors
/// If the texture's sizes are impossible or not those of its pixels; if a key is empty, given twice, or
/// begins with `KTX` or `ktx`; if a key or value has control characters.
///
/// # Example: a grey cube comes back
/// ```
/// use containers::{Precision, Texture, read_ktx2, write_ktx2};
/// let cube = Texture { width: 2, height: 2, depth: 1, layers: 0, faces: 6, pixels: vec![[0.5; 3]; 24] };
/// let file = write_ktx2(&cube, Precision::Half, None, &[("maker", "me")])?;
/// assert_eq!(read_ktx2(&file.bytes)?, cube);
/// # Ok::<(), containers::Error>(())
/// ```
pub fn write_ktx2(
    texture: &Texture,
    precision: Precision,
    recipe: Option<&str>,
    metadata: &[(&str, &str)],
) -> Result<Encoded, Error> {
    let pixels = pack(texture, precision);
    pixels
        .and_then(|pixels| write(texture, pixels, precision, recipe, metadata))
        .map_err(|error| error.within("KTX2"))
}

/// [`write_ktx2`] of four channels, none of which is an opacity: `rgba` are the pixels of a texture with the
/// sizes of `sizes`, whose own pixels are ignored.
///
/// # Errors
/// As [`write_ktx2`].
pub fn write_ktx2_rgba(
    sizes: &Texture,
    rgba: &[[f32; 4]],
    precision: Precision,
    recipe: Option<&str>,
    metadata: &[(&str, &str)],
) -> Result<Encoded, Error> {
    let pixels = pack_rgba(sizes, rgba.par_iter().copied(), precision);
    pixels
        .and_then(|pixels| write(sizes, pixels, precision, recipe, metadata))
        .map_err(|error| error.within("KTX2"))
}

/// Reads the subset of KTX2 that [`write_ktx2`] writes, whichever program wrote it: RGBA16F or RGBA32F
/// without supercompression; of several levels of detail the largest. Alpha is ignored.
/// [`crate::read_texture`] gives the metadata too.
///
/// # Errors
/// If the file is truncated, damaged, too large, or of another pixel format.
pub fn read_ktx2(bytes: &[u8]) -> Result<Texture, Error> {
    read(bytes).map(|file| file.texture)
}

/// Whether the bytes begin as a KTX2 file.
pub(crate) fn is_ktx2(bytes: &[u8]) -> bool {
    bytes.starts_with(&IDENTIFIER)
}

fn write(
    texture: &Texture,
    (pixels, clamped): (Vec<u8>, usize),
    precision: Precision,
    recipe: Option<&str>,
    metadata: &[(&str, &str)],
) -> Result<Encoded, Error> {
    let volume = texture.depth > 1;
    let key_values = key_values(if volume { "rdi" } else { "rd" }, recipe, metadata)?;
    let (descriptor_at, key_values_at) = (HEADER + LEVEL_INDEX, HEADER + LEVEL_INDEX + DESCRIPTOR);
    let block = pixel_bytes(precision);
    // A multiple of 4 already, so that lcm(block, 4) is the block.
    let level_at = (key_values_at + key_values.len()).next_multiple_of(block);

    let component = block / 4;
    let format = FORMATS.iter().find(|(_, of)| *of == precision).map_or(0, |(format, _)| *format);
    let mut bytes = Vec::with_capacity(level_at + pixels.len());
    bytes.extend_from_slice(&IDENTIFIER);
    let depth = if volume { texture.depth } else { 0 };
    for value in [component, texture.width, texture.height, depth, texture.layers, texture.faces, 1, 0] {
        if bytes.len() == IDENTIFIER.len() {
            bytes.extend_from_slice(&format.to_le_bytes());
        }
        bytes.extend_from_slice(&word32(value)?);
    }
    for value in [descriptor_at, DESCRIPTOR, key_values_at, key_values.len()] {
        bytes.extend_from_slice(&word32(value)?);
    }
    // No global data.
    bytes.extend_from_slice(&[0; 16]);
    for value in [level_at, pixels.len(), pixels.len()] {
        bytes.extend_from_slice(&(value as u64).to_le_bytes());
    }
    bytes.extend(descriptor(component));
    bytes.extend_from_slice(&key_values);
    bytes.resize(level_at, 0);
    bytes.extend_from_slice(&pixels);
    Ok(Encoded { bytes, clamped })
}

/// A number of the header; all of them fit, because a texture has at most [`crate::MAX_PIXELS`].
fn word32(value: usize) -> Result<[u8; 4], Error> {
    let value = u32::try_from(value).map_err(|_| {
        Error::new(ErrorKind::Unwritable, format!("{value} is past 32 bits, the format's numbers"))
    })?;
    Ok(value.to_le_bytes())
}

/// The Khronos basic data format descriptor of four signed floats of `component` bytes.
fn descriptor(component: usize) -> Vec<u8> {
    const RGBSDA: u8 = 1;
    const BT709: u8 = 1;
    const LINEAR: u8 = 1;
    const RED_GREEN_BLUE_ALPHA: [u8; 4] = [0, 1, 2, 15];
    const FLOAT_SIGNED: u8 = 0x80 | 0x40;
    let mut bytes = (DESCRIPTOR as u32).to_le_bytes().to_vec();
    // Vendor and type 0: Khronos, basic. Version 2; the block's size.
    bytes.extend_from_slice(&[0, 0, 0, 0, 2, 0, DESCRIPTOR as u8 - 4, 0]);
    bytes.extend_from_slice(&[RGBSDA, BT709, LINEAR, 0]);
    // A block of 1 x 1 x 1 x 1 texels, each size less one; the bytes of the first of eight planes.
    bytes.extend_from_slice(&[0, 0, 0, 0, 4 * component as u8, 0, 0, 0, 0, 0, 0, 0]);
    let bits = 8 * component as u8;
    for (position, channel) in RED_GREEN_BLUE_ALPHA.into_iter().enumerate() {
        bytes.extend_from_slice(&[position as u8 * bits, 0, bits - 1, channel | FLOAT_SIGNED]);
        bytes.extend_from_slice(&[0; 4]);
        bytes.extend_from_slice(&(-1.0_f32).to_le_bytes());
        bytes.extend_from_slice(&1.0_f32.to_le_bytes());
    }
    bytes
}

/// The key/value data: texts that end with NUL.
fn key_values(orientation: &str, recipe: Option<&str>, metadata: &[(&str, &str)]) -> Result<Vec<u8>, Error> {
    recipe::check(recipe)?;
    let mut entries = BTreeMap::from([("KTXorientation", orientation), ("KTXwriter", "specula")]);
    entries.extend(recipe.map(|recipe| (KEY, recipe)));
    for (key, value) in metadata {
        let reserved = key.is_empty() || key.starts_with("KTX") || key.starts_with("ktx");
        let control = key.chars().chain(value.chars()).any(char::is_control);
        if reserved || control || entries.insert(key, value).is_some() {
            return Err(Error::new(
                ErrorKind::Unwritable,
                format!(
                    "metadata {key:?}: expected a key of its own, not KTX..., and texts without control characters"
                ),
            ));
        }
    }
    let mut bytes = Vec::new();
    // The order of UTF-8 bytes is that of Unicode code points.
    for (key, value) in entries {
        bytes.extend_from_slice(&word32(key.len() + value.len() + 2)?);
        for text in [key, value] {
            bytes.extend_from_slice(text.as_bytes());
            bytes.push(0);
        }
        bytes.resize(bytes.len().next_multiple_of(4), 0);
    }
    Ok(bytes)
}

/// The recipe, whatever the pixels are.
pub(crate) fn read_recipe(bytes: &[u8]) -> Option<String> {
    read_key_values(bytes).ok()?.remove(KEY)
}

pub(crate) fn read(bytes: &[u8]) -> Result<TextureFile, Error> {
    parse(bytes).map_err(|error| error.within("KTX2"))
}

fn parse(bytes: &[u8]) -> Result<TextureFile, Error> {
    refuse_non_files(bytes)?;
    if !bytes.starts_with(&IDENTIFIER) {
        return Err(if IDENTIFIER.starts_with(bytes) {
            Error::truncated("the file ends before its data does")
        } else {
            Error::new(ErrorKind::UnknownFormat, "expected a KTX2 file, found other first bytes")
        });
    }
    let [format, _, width, height, depth, layers, faces, _levels, scheme] = [0, 1, 2, 3, 4, 5, 6, 7, 8]
        .map(|position| word(bytes, 12 + 4 * position))
        .into_iter()
        .collect::<Option<Vec<u32>>>()
        .and_then(|words| words.try_into().ok())
        .ok_or_else(|| Error::truncated("the file ends within its header"))?;
    let Some((_, precision)) = FORMATS.iter().find(|(known, _)| *known == format) else {
        return Err(Error::unsupported(format!(
            "VkFormat {format} is not read; expected 97 (RGBA, 16-bit floats) or 109 (RGBA, 32-bit floats)"
        )));
    };
    if scheme != 0 {
        return Err(Error::unsupported(format!(
            "supercompression scheme {scheme} is not read; decompress first"
        )));
    }
    if height == 0 {
        return Err(Error::unsupported("textures of one dimension are not read"));
    }
    let mut texture = Texture {
        width: size(width),
        height: size(height),
        depth: size(depth).max(1),
        layers: size(layers),
        faces: size(faces),
        pixels: Vec::new(),
    };
    let expected = texture.expected_bytes(*precision)?;
    let place = |at: usize| -> Option<usize> {
        let (low, high) = (word(bytes, at)?, word(bytes, at + 4)?);
        usize::try_from(u64::from(high) << 32 | u64::from(low)).ok()
    };
    let level = place(HEADER).zip(place(HEADER + 8));
    let (offset, length) = level.ok_or_else(|| Error::truncated("the file ends within its level index"))?;
    if length != expected {
        return Err(Error::damaged(format!(
            "the level index declares {length} bytes; the sizes make {expected}"
        )));
    }
    let pixels = bytes.get(offset..).and_then(|rest| rest.get(..length)).ok_or_else(|| {
        Error::truncated(format!(
            "{length} bytes of pixels at {offset} are past the file's {} bytes",
            bytes.len()
        ))
    })?;
    let metadata = read_key_values(bytes)?;
    texture.pixels = unpack(pixels, *precision);
    Ok(TextureFile { texture, precision: *precision, container: "KTX2", metadata })
}

/// The texts of the key/value data; entries that are not text are left out.
fn read_key_values(bytes: &[u8]) -> Result<BTreeMap<String, String>, Error> {
    let damaged = || Error::damaged("the key/value data do not add up to their length");
    let (offset, length) = word(bytes, 56).zip(word(bytes, 60)).ok_or_else(damaged)?;
    let mut rest = bytes.get(size(offset)..).and_then(|rest| rest.get(..size(length))).ok_or_else(damaged)?;
    let mut entries = BTreeMap::new();
    while !rest.is_empty() {
        let length = size(word(rest, 0).ok_or_else(damaged)?);
        let entry = rest[4..].get(..length).ok_or_else(damaged)?;
        let end = entry.iter().position(|byte| *byte == 0).ok_or_else(damaged)?;
        let (key, value) = (&entry[..end], &entry[end + 1..]);
        let value = value.strip_suffix(&[0]).unwrap_or(value);
        if let (Ok(key), Ok(value)) = (str::from_utf8(key), str::from_utf8(value)) {
            entries.insert(key.to_owned(), value.to_owned());
        }
        rest = rest.get(4 + length.next_multiple_of(4)..).ok_or_else(damaged)?;
    }
    Ok(entries)
}
