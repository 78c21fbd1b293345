//! WebP (RFC 9649), read only, by the `image` crate; Exif is in its chunk EXIF, XMP in its chunk XMP.

use std::io::{BufRead, Cursor, Read, Seek, SeekFrom};

use ::image::codecs::webp::WebPDecoder;

use super::codec::{Codec, HeaderFacts, KnownBy};
use super::colour_space::ColourSpace;
use super::decoded::Decoded;
use super::raster;
use super::raster::{DEFLATE_RATIO, Opened, Raster};
use crate::error::Error;
use crate::file_part::{bytes_at, rewind};
use crate::format::Format;
use crate::metadata::{Metadata, array, block};

pub(crate) const CODEC: Codec = Codec {
    name: "WebP",
    endings: &["webp"],
    known_by: KnownBy::Signature(|bytes| {
        matches!(bytes, [b'R', b'I', b'F', b'F', _, _, _, _, b'W', b'E', b'B', b'P', ..])
    }),
    high_dynamic_range: false,
    declares_high_dynamic_range: |_| false,
    has_layers: false,
    read: |bytes, options, _| read(bytes, options.colour_space),
    header: |mut file, length, _| {
        let (_, size) = open(&mut file, length)?;
        Ok(HeaderFacts { size, metadata: metadata(&mut file), ..HeaderFacts::default() })
    },
    recipe: |_| None,
};

fn read(bytes: &[u8], wanted: Option<ColourSpace>) -> Result<Decoded, Error> {
    raster(bytes)?.decode(Format::WebP, wanted)
}

pub(crate) fn raster(bytes: &[u8]) -> Result<Raster, Error> {
    let raster = Raster::decoded_by(open(Cursor::new(bytes), bytes.len())?, bytes.len())?;
    Ok(Raster { metadata: metadata(&mut Cursor::new(bytes)), ..raster })
}

fn open<F: BufRead + Seek>(mut file: F, length: usize) -> Result<Opened<WebPDecoder<F>>, Error> {
    // A code that is the only one takes no bit: a few bytes hold any lossless picture of one colour. The
    // decoder writes into its memory only what the codes give.
    let ratio = match is_lossless(&mut file, length) {
        Some(true) => usize::MAX,
        Some(false) => DEFLATE_RATIO,
        None => return Err(Error::truncated("the file ends before its data does")),
    };
    rewind(&mut file)?;
    raster::opened(WebPDecoder::new(file), length, ratio)
}

/// Whether a file holds a lossless picture; `None` if its chunks are not all in it: the decoder makes room
/// for as much as they declare.
fn is_lossless(file: &mut (impl BufRead + Seek), length: usize) -> Option<bool> {
    let (mut at, mut lossless) = (12, false);
    while let Some([name @ .., a, b, c, d]) = bytes_at(file, at, 8) {
        let size = u32::from_le_bytes([a, b, c, d]) as usize;
        if size > length - at - 8 {
            return None;
        }
        lossless |= name == *b"VP8L";
        // The frames of an animation are chunks within a chunk, behind 16 bytes.
        at += if name == *b"ANMF" { 24 } else { 8 + size + size % 2 };
    }
    Some(lossless)
}

/// Reads the metadata; what is damaged says nothing.
fn metadata(file: &mut (impl Read + Seek)) -> Metadata {
    let mut found = Metadata::default();
    // The walk ends with the file: what it has found until then counts.
    let _ = chunks(file, |name, bytes| match name {
        b"EXIF" => found.take_exif(bytes),
        b"XMP " => found.take_xmp(Some(bytes)),
        _ => {}
    });
    found
}

/// Visits the chunks that hold metadata.
fn chunks(file: &mut (impl Read + Seek), mut visit: impl FnMut(&[u8; 4], &[u8])) -> Option<()> {
    file.seek(SeekFrom::Start(12)).ok()?;
    loop {
        let [name @ .., a, b, c, d]: [u8; 8] = array(file)?;
        let length = u32::from_le_bytes([a, b, c, d]) as usize;
        let wanted = [b"EXIF", b"XMP "].contains(&&name);
        block(file, length, length % 2, wanted, |bytes| visit(&name, bytes))?;
    }
}
