//! KTX 1.1 (KTX File Format Specification, version 1.1): cubes with levels of detail, as Filament loads them.
//!
//! | bytes | what |
//! | --- | --- |
//! | 0 | identifier, then thirteen u32: byte order, type, size of a number, format, internal format, base format, width, height, depth, layers, faces, levels, bytes of key/value data |
//! | 64 | key/value data, each entry a length, a key, NUL, a value, and padding to 4 bytes |
//! | | for each level, the largest first: the bytes of one face, then six faces +X -X +Y -Y +Z -Z |

use std::collections::BTreeMap;

use super::container::Container;
use super::texel::{ByteFormat, TexelFormat};
use super::texture::{Texture, TextureFile};
use crate::error::{Error, ErrorKind};
use crate::header_word::{size, word};
use crate::images::Encoded;
use crate::recipe;
use crate::recipe::KEY;

/// The first bytes of every KTX 1 file.
const IDENTIFIER: [u8; 12] = *b"\xabKTX 11\xbb\r\n\x1a\n";

pub(crate) const CONTAINER: Container = Container {
    name: "KTX",
    ending: "ktx",
    signature: &IDENTIFIER,
    declares_cube: |first| word(first, 52) == Some(6),
    parse,
    recipe: read_recipe,
};

const HEADER: usize = 64;

/// The number at byte 12 in a file of this machine's order.
const ORDER: u32 = 0x0403_0201;

/// GL_R11F_G11F_B10F, and the type that OpenGL has for it, GL_UNSIGNED_INT_10F_11F_11F_REV.
const PACKED_FLOATS: u32 = 0x8c3a;
const PACKED_FLOATS_TYPE: u32 = 0x8c3b;

/// OpenGL's names of a format: type, size of a number, format, internal format.
fn names(format: TexelFormat) -> Option<[u32; 4]> {
    const RGB: u32 = 0x1907;
    const RGBA: u32 = 0x1908;
    match format {
        // GL_HALF_FLOAT, GL_RGBA16F; GL_FLOAT, GL_RGBA32F. Of packed floats Filament, as cmgen, knows
        // GL_R11F_G11F_B10F as the type, too.
        TexelFormat::Rgba16F => Some([0x140b, 2, RGBA, 0x881a]),
        TexelFormat::Rgba32F => Some([0x1406, 4, RGBA, 0x8814]),
        TexelFormat::R11G11B10F => Some([PACKED_FLOATS, 4, RGB, PACKED_FLOATS]),
        // Those that are only read: GL_RGB16F, GL_RGB32F; GL_COMPRESSED_RGB_BPTC_UNSIGNED_FLOAT and
        // _SIGNED_FLOAT; GL_UNSIGNED_BYTE with GL_RGB8, GL_SRGB8, GL_RGBA8 and GL_SRGB8_ALPHA8.
        TexelFormat::Rgb16F => Some([0x140b, 2, RGB, 0x881b]),
        TexelFormat::Rgb32F => Some([0x1406, 4, RGB, 0x8815]),
        TexelFormat::Bc6h => Some([0, 1, RGB, 0x8e8f]),
        TexelFormat::Bc6hSigned => Some([0, 1, RGB, 0x8e8e]),
        TexelFormat::Bytes(ByteFormat { channels: 3, is_bgr: false, is_srgb }) => {
            Some([0x1401, 1, RGB, if is_srgb { 0x8c41 } else { 0x8051 }])
        }
        TexelFormat::Bytes(ByteFormat { channels: 4, is_bgr: false, is_srgb }) => {
            Some([0x1401, 1, RGBA, if is_srgb { 0x8c43 } else { 0x8058 }])
        }
        _ => None,
    }
}

/// Writes a cube as KTX 1 in `Rgba16F`, `Rgba32F` or `R11G11B10F`.
///
/// The recipe becomes the entry `specula`, and `metadata` further entries; Filament reads the irradiance from
/// one named `sh`. What the format cannot hold is counted, as by [`crate::textures::ktx2::write_ktx2`].
///
/// # Errors
/// If the texture is not a cube of one layer or has impossible sizes, if the format is another, or if a key
/// is empty or given twice or has control characters.
///
/// # Example: a grey cube comes back
/// ```
/// use containers::{TexelFormat, Texture, read_texture, write_ktx1};
/// let cube = Texture { width: 2, height: 2, faces: 6, pixels: vec![[0.5; 3]; 24], ..Texture::default() };
/// let file = write_ktx1(&cube, TexelFormat::R11G11B10F, None, &[("sh", "0.5 0.5 0.5\n")])?;
/// let found = read_texture(&file.bytes)?;
/// assert_eq!(found.texture, cube);
/// assert_eq!(found.metadata["sh"], "0.5 0.5 0.5\n");
/// # Ok::<(), containers::Error>(())
/// ```
pub fn write_ktx1(
    texture: &Texture,
    format: TexelFormat,
    recipe: Option<&str>,
    metadata: &[(&str, &str)],
) -> Result<Encoded, Error> {
    write(texture, format, recipe, metadata).map_err(|error| error.within("KTX"))
}

fn write(
    texture: &Texture,
    format: TexelFormat,
    recipe: Option<&str>,
    metadata: &[(&str, &str)],
) -> Result<Encoded, Error> {
    let unwritable = |message: String| Error::new(ErrorKind::Unwritable, message);
    let written = [TexelFormat::Rgba16F, TexelFormat::Rgba32F, TexelFormat::R11G11B10F];
    let Some([kind, number, base, internal]) = names(format).filter(|_| written.contains(&format)) else {
        return Err(unwritable(format!(
            "{} is not written; expected RGBA16F, RGBA32F or R11G11B10F",
            format.name()
        )));
    };
    if texture.faces != 6 || texture.layers > 0 {
        return Err(unwritable("expected a cube of one layer".into()));
    }
    let levels = texture.pack(format.into())?;
    recipe::check(recipe)?;
    let mut entries: BTreeMap<&str, &str> = recipe.map(|recipe| (KEY, recipe)).into_iter().collect();
    for (key, value) in metadata {
        let control = key.chars().any(char::is_control) || value.contains('\0');
        if key.is_empty() || control || entries.insert(key, value).is_some() {
            return Err(unwritable(format!("metadata {key:?}: expected a key of its own, and text")));
        }
    }
    let mut key_values = Vec::new();
    for (key, value) in entries {
        key_values.extend_from_slice(&((key.len() + value.len() + 2) as u32).to_le_bytes());
        for text in [key, value] {
            key_values.extend_from_slice(text.as_bytes());
            key_values.push(0);
        }
        key_values.resize(key_values.len().next_multiple_of(4), 0);
    }
    // The sizes are at most MAX_PIXELS, which pack() has checked.
    let edge = texture.width as u32;
    let mut bytes = IDENTIFIER.to_vec();
    let (count, text) = (levels.len() as u32, key_values.len() as u32);
    for value in [ORDER, kind, number, base, internal, base, edge, edge, 0, 0, 6, count, text] {
        bytes.extend_from_slice(&value.to_le_bytes());
    }
    bytes.extend_from_slice(&key_values);
    for level in &levels {
        // A multiple of 4, so that no face is padded.
        bytes.extend_from_slice(&((level.bytes.len() / 6) as u32).to_le_bytes());
        bytes.extend_from_slice(&level.bytes);
    }
    let negative = levels.iter().map(|level| level.negative).sum();
    Ok(Encoded { bytes, negative })
}

/// The recipe, whatever the pixels are.
fn read_recipe(bytes: &[u8]) -> Option<String> {
    read_key_values(bytes).ok()?.0.remove(KEY)
}

fn parse(bytes: &[u8]) -> Result<TextureFile, Error> {
    let header: Vec<u32> = (0..13).map_while(|position| word(bytes, 12 + 4 * position)).collect();
    let &[order, kind, _, _, internal, _, width, height, depth, layers, faces, levels, _] = header.as_slice()
    else {
        return Err(Error::truncated("the file ends within its header"));
    };
    if order != ORDER {
        return Err(Error::unsupported("files of the other byte order are not read"));
    }
    let kind = if kind == PACKED_FLOATS_TYPE { PACKED_FLOATS } else { kind };
    let known =
        |format: &TexelFormat| names(*format).is_some_and(|names| (names[0], names[3]) == (kind, internal));
    let Some(format) = TexelFormat::read().find(known) else {
        return Err(Error::unsupported(format!(
            "type {kind:#x} with internal format {internal:#x} is not read; expected RGB or RGBA in halves, floats or \
             bytes, R11F_G11F_B10F or BC6H"
        )));
    };
    // As pictures are, whose writers did not say so.
    let stored_format = match format {
        TexelFormat::Bytes(stored) => TexelFormat::Bytes(ByteFormat { is_srgb: true, ..stored }),
        other => other,
    };
    if layers > 0 || depth > 1 {
        return Err(Error::unsupported(format!(
            "expected a cube or one picture, found {depth} slices, {layers} layers"
        )));
    }
    let faces = size(faces);
    let mut texture = Texture { width: size(width), height: size(height), faces, ..Texture::default() };
    // Rows of three small numbers are padded to 4 bytes.
    let rows = |level: usize| -> (usize, usize, usize) {
        let [width, height, _] = texture.level_size(level);
        let (block, edge) = format.block();
        let row = width.div_ceil(edge) * block;
        (row, row.next_multiple_of(4), height.div_ceil(edge) * faces)
    };
    texture.expected_bytes(size(levels).max(1), format)?;
    let expected: Vec<usize> = (0..size(levels).max(1)).map(|level| rows(level).1 * rows(level).2).collect();
    let (metadata, mut at) = read_key_values(bytes)?;
    let mut places = Vec::new();
    for (level, &expected) in expected.iter().enumerate() {
        let truncated = || {
            Error::truncated(format!("level {level} at byte {at} is past the file's {} bytes", bytes.len()))
        };
        let declared = size(word(bytes, at).ok_or_else(truncated)?);
        if declared.checked_mul(faces) != Some(expected) {
            return Err(Error::damaged(format!(
                "level {level} at byte {at} declares {declared} bytes for a face; the sizes make {}",
                expected / faces
            )));
        }
        places.push(bytes.get(at + 4..).and_then(|rest| rest.get(..expected)).ok_or_else(truncated)?);
        at += 4 + expected;
    }
    let sizes: Vec<_> = (0..places.len()).map(rows).collect();
    for ((level, bytes), (row, padded, _)) in places.into_iter().enumerate().zip(sizes) {
        let bytes: Vec<u8> =
            bytes.chunks_exact(padded.max(1)).flat_map(|bytes| &bytes[..row]).copied().collect();
        texture.unpack(level, stored_format, &bytes);
    }
    Ok(TextureFile { texture, format: stored_format, container: CONTAINER.name, metadata })
}

/// The texts of the key/value data, and where the levels begin; entries that are not text are left out.
fn read_key_values(bytes: &[u8]) -> Result<(BTreeMap<String, String>, usize), Error> {
    let damaged = || Error::damaged("the key/value data at byte 64 do not add up to their length");
    let length = size(word(bytes, 60).ok_or_else(damaged)?);
    let mut rest = bytes.get(HEADER..).and_then(|rest| rest.get(..length)).ok_or_else(damaged)?;
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
        // The last entry's padding may be missing.
        rest = rest.get(4 + length.next_multiple_of(4)..).unwrap_or_default();
    }
    Ok((entries, HEADER + length))
}
