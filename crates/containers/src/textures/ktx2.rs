//! KTX2 (KTX File Format Specification 2.0): textures in one of the [`TexelFormat`]s, with their levels of
//! detail, plain or each level compressed with Zstandard (scheme 2) or, of others, zlib (scheme 3).
//!
//! | bytes | what |
//! | --- | --- |
//! | 0 | identifier, then nine u32: VkFormat, bytes of a number, width, height, depth, layers, faces, levels, scheme |
//! | 48 | the places of what follows: u32 descriptor, u32 key/value data, u64 global data, each an offset and a length |
//! | 80 | the level index, the largest level first: u64 offset, length, uncompressed length |
//! | | the data format descriptor: linear BT.709 |
//! | | key/value data, sorted by key, each entry padded to 4 bytes |
//! | | the levels, the smallest first, each padded to the size of a block unless it is compressed; within a level the order is layer, face, slice, row |
//!
//! Depth is 0 but for volumes and the number of layers 0 but for arrays, as the specification's table of
//! texture types wants. `KTXorientation` is `rd` (row 0 at the top; for cubes the only one allowed) and `rdi`
//! for volumes.

use std::collections::BTreeMap;

use ruzstd::encoding::{CompressionLevel, compress_to_vec};

use super::container::Container;
use super::texel::{ByteFormat, Packed, TexelEncoding, TexelFormat, foreign_vulkan};
use super::texture::{Texture, TextureFile, pack_r8, pack_rgba};
use crate::error::{Error, ErrorKind};
use crate::header_word::{size, word};
use crate::images::Encoded;
use crate::precision::Precision;
use crate::recipe::KEY;
use crate::{limits, recipe, zstandard};

/// The first bytes of every KTX2 file.
const IDENTIFIER: [u8; 12] = *b"\xabKTX 20\xbb\r\n\x1a\n";

pub(crate) const CONTAINER: Container = Container {
    name: "KTX2",
    ending: "ktx2",
    signature: &IDENTIFIER,
    declares_cube: |first| word(first, 36) == Some(6),
    parse,
    recipe: read_recipe,
};

const HEADER: usize = 80;
const LEVEL_INDEX: usize = 24;

/// The most that deflate gains.
const ZLIB_RATIO: usize = 1032;

/// The most that Zstandard gains: a block of 128 KiB is at least 4 bytes.
const ZSTD_RATIO: usize = 1 << 15;

/// How levels are compressed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Scheme {
    Plain = 0,
    Zstd = 2,
    /// Zlib, which others write.
    Zlib = 3,
}

/// Writes KTX2, without compression; formats of four channels have an alpha of 1.
///
/// The recipe becomes the entry `specula`, and `metadata` further entries; `KTXorientation` and `KTXwriter`
/// are added. Values past the largest of the format are clamped to it, negative ones become 0 if it has no
/// sign, and are counted too; NaN becomes 0 there. [`TexelEncoding`] says what the others become.
///
/// # Errors
/// If the texture's sizes are impossible or not those of its pixels; if a key is empty, given twice, or
/// begins with `KTX` or `ktx`; if a key or value has control characters.
///
/// # Example: a grey cube comes back
/// ```
/// use containers::{Precision, Texture, read_ktx2, write_ktx2};
/// let cube = Texture { width: 2, height: 2, faces: 6, pixels: vec![[0.5; 3]; 24], ..Texture::default() };
/// let file = write_ktx2(&cube, Precision::Half, None, &[("maker", "me")])?;
/// assert_eq!(read_ktx2(&file.bytes)?, cube);
/// # Ok::<(), containers::Error>(())
/// ```
pub fn write_ktx2(
    texture: &Texture,
    encoding: impl Into<TexelEncoding>,
    recipe: Option<&str>,
    metadata: &[(&str, &str)],
) -> Result<Encoded, Error> {
    write_levels(texture, encoding.into(), Scheme::Plain, recipe, metadata)
}

/// Writes KTX2 as [`write_ktx2`] does, with each level compressed by Zstandard.
///
/// # Errors
/// The errors of [`write_ktx2`].
pub fn write_ktx2_zstd(
    texture: &Texture,
    encoding: impl Into<TexelEncoding>,
    recipe: Option<&str>,
    metadata: &[(&str, &str)],
) -> Result<Encoded, Error> {
    write_levels(texture, encoding.into(), Scheme::Zstd, recipe, metadata)
}

/// Writes KTX2 as [`write_ktx2`] does, of four channels, none of which is an opacity: `rgba` are the pixels
/// of a texture with the sizes of `sizes`, whose own pixels are ignored.
///
/// # Errors
/// The errors of [`write_ktx2`].
pub fn write_ktx2_rgba(
    sizes: &Texture,
    rgba: &[[f32; 4]],
    precision: Precision,
    recipe: Option<&str>,
    metadata: &[(&str, &str)],
) -> Result<Encoded, Error> {
    pack_rgba(sizes, rgba, precision)
        .and_then(|level| write(sizes, vec![level], precision.into(), Scheme::Plain, recipe, metadata))
        .map_err(|error| error.within("KTX2"))
}

/// Writes KTX2 as [`write_ktx2`] does, of one channel in bytes: `red` are the bytes, of which 255 stands for
/// 1, of a texture with the sizes of `sizes`, whose own pixels are ignored.
///
/// # Errors
/// The errors of [`write_ktx2`].
///
/// # Example: a volume of bytes comes back as red
/// ```
/// use containers::{Texture, read_ktx2, write_ktx2_r8};
/// let sizes = Texture { width: 1, height: 1, depth: 3, ..Texture::default() };
/// let read = read_ktx2(&write_ktx2_r8(&sizes, &[0, 255, 51], None, &[])?.bytes)?;
/// assert_eq!(read.pixels, [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.2, 0.0, 0.0]]);
/// # Ok::<(), containers::Error>(())
/// ```
pub fn write_ktx2_r8(
    sizes: &Texture,
    red: &[u8],
    recipe: Option<&str>,
    metadata: &[(&str, &str)],
) -> Result<Encoded, Error> {
    pack_r8(sizes, red)
        .and_then(|level| write(sizes, vec![level], TexelFormat::R8, Scheme::Plain, recipe, metadata))
        .map_err(|error| error.within("KTX2"))
}

/// Reads the subset of KTX2 that [`write_ktx2`] and [`write_ktx2_zstd`] write, whichever program wrote it.
/// Alpha is ignored, and channels that the file lacks are 0. [`crate::textures::read_texture::read_texture`]
/// gives the metadata too.
///
/// # Errors
/// If the file is truncated, damaged, too large, or of another pixel format or compression.
pub fn read_ktx2(bytes: &[u8]) -> Result<Texture, Error> {
    CONTAINER.read(bytes).map(|file| file.texture)
}

fn write_levels(
    texture: &Texture,
    encoding: TexelEncoding,
    scheme: Scheme,
    recipe: Option<&str>,
    metadata: &[(&str, &str)],
) -> Result<Encoded, Error> {
    let levels = texture.pack(encoding);
    levels
        .and_then(|levels| write(texture, levels, encoding.format, scheme, recipe, metadata))
        .map_err(|error| error.within("KTX2"))
}

fn write(
    texture: &Texture,
    levels: Vec<Packed>,
    format: TexelFormat,
    scheme: Scheme,
    recipe: Option<&str>,
    metadata: &[(&str, &str)],
) -> Result<Encoded, Error> {
    let volume = texture.depth > 1;
    let key_values = key_values(if volume { "rdi" } else { "rd" }, recipe, metadata)?;
    let descriptor = descriptor(format);
    let descriptor_at = HEADER + LEVEL_INDEX * levels.len();
    let key_values_at = descriptor_at + descriptor.len();

    let mut bytes = Vec::new();
    bytes.extend_from_slice(&IDENTIFIER);
    bytes.extend_from_slice(&format.vulkan().to_le_bytes());
    let depth = if volume { texture.depth } else { 0 };
    let (Texture { width, height, layers, faces, .. }, count) = (texture, levels.len());
    for value in [number_bytes(format), *width, *height, depth, *layers, *faces, count, scheme as usize] {
        bytes.extend_from_slice(&word32(value)?);
    }
    for value in [descriptor_at, descriptor.len(), key_values_at, key_values.len()] {
        bytes.extend_from_slice(&word32(value)?);
    }
    // No global data.
    bytes.extend_from_slice(&[0; 16]);
    let index_at = bytes.len();
    bytes.resize(descriptor_at, 0);
    bytes.extend(descriptor);
    bytes.extend_from_slice(&key_values);

    let mut negative = 0;
    for (level, packed) in levels.into_iter().enumerate().rev() {
        negative += packed.negative;
        let uncompressed = packed.bytes.len();
        let stored = match scheme {
            Scheme::Plain => {
                // A multiple of lcm(block, 4): every block of more than a byte is a multiple of 4 already.
                bytes.resize(bytes.len().next_multiple_of(format.block().0.max(4)), 0);
                packed.bytes
            }
            Scheme::Zstd | Scheme::Zlib => {
                compress_to_vec(packed.bytes.as_slice(), CompressionLevel::Fastest)
            }
        };
        let entry = index_at + LEVEL_INDEX * level;
        for (position, value) in [bytes.len(), stored.len(), uncompressed].into_iter().enumerate() {
            bytes[entry + 8 * position..][..8].copy_from_slice(&(value as u64).to_le_bytes());
        }
        bytes.extend_from_slice(&stored);
    }
    Ok(Encoded { bytes, negative })
}

/// The bytes of a number or of a packed pixel; 1 if it has blocks.
fn number_bytes(format: TexelFormat) -> usize {
    match format {
        TexelFormat::Rgba16F | TexelFormat::Rg16F => 2,
        TexelFormat::Rgba32F | TexelFormat::Rgb9E5 | TexelFormat::R11G11B10F => 4,
        // The rest is not written.
        _ => 1,
    }
}

/// A number of the header; all of them fit, because a texture has at most [`crate::limits::MAX_PIXELS`].
fn word32(value: usize) -> Result<[u8; 4], Error> {
    let value = u32::try_from(value).map_err(|_| {
        Error::new(ErrorKind::Unwritable, format!("{value} is past 32 bits, the format's numbers"))
    })?;
    Ok(value.to_le_bytes())
}

/// The Khronos basic data format descriptor (Khronos Data Format Specification 1.3, section 5).
fn descriptor(format: TexelFormat) -> Vec<u8> {
    const RGBSDA: u8 = 1;
    const BC6H: u8 = 133;
    const BT709: u8 = 1;
    const LINEAR: u8 = 1;
    const FLOAT: u8 = 0x80;
    const SIGNED: u8 = 0x40;
    const EXPONENT: u8 = 0x20;
    let signed = [(-1.0_f32).to_bits(), 1.0_f32.to_bits()];
    let unsigned = [0, 1.0_f32.to_bits()];
    // Of each sample: its first bit, the bits, the channel with what it is, its lowest and highest value.
    let samples: Vec<(u16, u8, u8, [u32; 2])> = match format {
        TexelFormat::Rgba16F | TexelFormat::Rgba32F | TexelFormat::Rg16F => {
            let bits = 8 * number_bytes(format) as u8;
            let channels: &[u8] = if format == TexelFormat::Rg16F { &[0, 1] } else { &[0, 1, 2, 15] };
            let place = |position: usize| position as u16 * u16::from(bits);
            let sample =
                |(position, channel): (usize, &u8)| (place(position), bits, channel | FLOAT | SIGNED, signed);
            channels.iter().enumerate().map(sample).collect()
        }
        TexelFormat::R11G11B10F => {
            vec![(0, 11, FLOAT, unsigned), (11, 11, 1 | FLOAT, unsigned), (22, 10, 2 | FLOAT, unsigned)]
        }
        // Each channel is a mantissa and, in the same bits for all, an exponent; the specification's example.
        TexelFormat::Rgb9E5 => (0..3_u8)
            .flat_map(|channel| {
                [(9 * u16::from(channel), 9, channel, [0, 8448]), (27, 5, channel | EXPONENT, [15, 31])]
            })
            .collect(),
        TexelFormat::R8 => vec![(0, 8, 0, [0, 255])],
        // BC6H; the rest is not written.
        _ => vec![(0, 128, FLOAT, unsigned)],
    };
    let (block, edge) = format.block();
    let length = 28 + 16 * samples.len();
    let mut bytes = (length as u32).to_le_bytes().to_vec();
    // Vendor and type 0: Khronos, basic. Version 2; the block's size.
    bytes.extend_from_slice(&[0, 0, 0, 0, 2, 0, length as u8 - 4, 0]);
    bytes.extend_from_slice(&[if format == TexelFormat::Bc6h { BC6H } else { RGBSDA }, BT709, LINEAR, 0]);
    // The texels of a block along each of four axes, less one; the bytes of the first of eight planes.
    let along = edge as u8 - 1;
    bytes.extend_from_slice(&[along, along, 0, 0, block as u8, 0, 0, 0, 0, 0, 0, 0]);
    for (first, bits, channel, [lower, upper]) in samples {
        bytes.extend_from_slice(&first.to_le_bytes());
        bytes.extend_from_slice(&[bits - 1, channel, 0, 0, 0, 0]);
        bytes.extend_from_slice(&lower.to_le_bytes());
        bytes.extend_from_slice(&upper.to_le_bytes());
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
fn read_recipe(bytes: &[u8]) -> Option<String> {
    read_key_values(bytes).ok()?.remove(KEY)
}

fn parse(bytes: &[u8]) -> Result<TextureFile, Error> {
    let [format, _, width, height, depth, layers, faces, levels, scheme] = [0, 1, 2, 3, 4, 5, 6, 7, 8]
        .map(|position| word(bytes, 12 + 4 * position))
        .into_iter()
        .collect::<Option<Vec<u32>>>()
        .and_then(|words| words.try_into().ok())
        .ok_or_else(|| Error::truncated("the file ends within its header"))?;
    let Some(format) = TexelFormat::read().find(|known| known.vulkan() == format) else {
        let name = foreign_vulkan(format).map_or(String::new(), |name| format!(" ({name})"));
        return Err(Error::unsupported(format!(
            "VkFormat {format}{name} is not read; expected {}",
            TexelFormat::listed(TexelFormat::vulkan)
        )));
    };
    let schemes = [Scheme::Plain, Scheme::Zstd, Scheme::Zlib];
    let Some(scheme) = schemes.into_iter().find(|known| *known as u32 == scheme) else {
        let name = if scheme == 1 { " (BasisLZ)" } else { "" };
        return Err(Error::unsupported(format!(
            "supercompression scheme {scheme}{name} is not read; expected 0 (none), 2 (Zstandard) or 3 (zlib)"
        )));
    };
    let format = match format {
        TexelFormat::Bytes(stored) => {
            TexelFormat::Bytes(ByteFormat { is_srgb: stored.is_srgb || declares_srgb(bytes), ..stored })
        }
        other => other,
    };
    if height == 0 {
        return Err(Error::unsupported("textures of one dimension are not read"));
    }
    let mut texture = Texture {
        width: size(width),
        height: size(height),
        depth: size(depth).max(1),
        layers: size(layers),
        faces: size(faces),
        ..Texture::default()
    };
    // 0 asks the reader to make the smaller levels itself.
    let expected = texture.expected_bytes(size(levels).max(1), format)?;
    let stored = expected.iter().enumerate().map(|(level, &expected)| stored(bytes, level, expected, scheme));
    let stored = stored.collect::<Result<Vec<_>, _>>()?;
    let metadata = read_key_values(bytes)?;
    for (level, (offset, stored)) in stored.into_iter().enumerate() {
        match scheme {
            Scheme::Plain => texture.unpack(level, format, stored),
            Scheme::Zstd | Scheme::Zlib => {
                let place = |error: Error| error.within(format!("level {level} at byte {offset}"));
                let bytes = match scheme {
                    Scheme::Zlib => inflate(stored, expected[level]),
                    _ => zstandard::decompress(stored, expected[level]),
                };
                let bytes = bytes.map_err(place)?;
                texture.unpack(level, format, &bytes);
            }
        }
    }
    Ok(TextureFile { texture, format, container: CONTAINER.name, metadata })
}

/// The place of the stored bytes of a level, and those bytes; decompressed they must be `expected` bytes.
fn stored(bytes: &[u8], level: usize, expected: usize, scheme: Scheme) -> Result<(usize, &[u8]), Error> {
    let number = |position: usize| -> Option<usize> {
        let at = HEADER + LEVEL_INDEX * level + 8 * position;
        let (low, high) = (word(bytes, at)?, word(bytes, at + 4)?);
        Some(usize::try_from(u64::from(high) << 32 | u64::from(low)).unwrap_or(usize::MAX))
    };
    let entry = || Some((number(0)?, number(1)?, number(2)?));
    let (offset, length, uncompressed) =
        entry().ok_or_else(|| Error::truncated("the file ends within its level index"))?;
    let declared = if scheme == Scheme::Plain { length } else { uncompressed };
    if declared != expected {
        return Err(Error::damaged(format!(
            "the level index declares {declared} bytes for level {level}; the sizes make {expected}"
        )));
    }
    let stored = bytes.get(offset..).and_then(|rest| rest.get(..length)).ok_or_else(|| {
        Error::truncated(format!(
            "level {level}: {length} bytes of pixels at {offset} are past the file's {} bytes",
            bytes.len()
        ))
    })?;
    if scheme == Scheme::Zlib {
        limits::plausible(expected, length, ZLIB_RATIO)?;
    }
    if scheme == Scheme::Zstd {
        limits::plausible(expected, length, ZSTD_RATIO)?;
    }
    Ok((offset, stored))
}

/// Whether the data format descriptor says that the numbers are sRGB's codes, which a format may leave open.
fn declares_srgb(bytes: &[u8]) -> bool {
    const SRGB: u8 = 2;
    // The size and the first two words come before the model, the primaries and the transfer function.
    let transfer = word(bytes, 48).and_then(|at| bytes.get(size(at).checked_add(14)?));
    transfer == Some(&SRGB)
}

/// Exactly `expected` bytes of zlib.
fn inflate(stored: &[u8], expected: usize) -> Result<Vec<u8>, Error> {
    match miniz_oxide::inflate::decompress_to_vec_zlib_with_limit(stored, expected) {
        Ok(bytes) if bytes.len() == expected => Ok(bytes),
        Ok(bytes) => Err(Error::damaged(format!("expected {expected} bytes, zlib gives {}", bytes.len()))),
        Err(error) => Err(Error::damaged(format!("zlib: {error}"))),
    }
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
