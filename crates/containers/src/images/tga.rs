//! Truevision TGA (Truevision TGA File Format Specification, version 2.0), read only, by the `image` crate.
//! The decoder applies a file's orientation.

use std::io::{BufRead, Cursor, Seek};

use ::image::codecs::tga::TgaDecoder;

use super::codec::{Codec, HeaderFacts, KnownBy};
use super::colour_space::ColourSpace;
use super::decoded::Decoded;
use super::raster;
use super::raster::{Opened, Raster};
use crate::error::Error;
use crate::format::Format;

pub(crate) const CODEC: Codec = Codec {
    name: "TGA",
    endings: &["tga"],
    known_by: KnownBy::Header(is_header),
    high_dynamic_range: false,
    declares_high_dynamic_range: |_| false,
    has_layers: false,
    read: |bytes, options, _| read(bytes, options.colour_space),
    header: |mut file, length, _| {
        let (_, size) = open(&mut file, length)?;
        Ok(HeaderFacts { size, ..HeaderFacts::default() })
    },
    recipe: |_| None,
};

/// A run of 128 pixels of 4 bytes takes 2 bytes if a palette gives the colours.
const RATIO: usize = 256;

/// Whether the bytes begin with a header: its fields have only a few values that go together.
fn is_header(bytes: &[u8]) -> bool {
    let Some(
        &[
            _,
            palette,
            kind,
            _,
            _,
            length_low,
            length_high,
            entry,
            _,
            _,
            _,
            _,
            w0,
            w1,
            h0,
            h1,
            depth,
            descriptor,
        ],
    ) = bytes.first_chunk()
    else {
        return false;
    };
    let has_palette =
        palette == 1 && [length_low, length_high] != [0; 2] && [15, 16, 24, 32].contains(&entry);
    let known = match kind {
        1 | 9 => has_palette && [8, 16].contains(&depth),
        2 | 10 => (palette == 0 || has_palette) && [15, 16, 24, 32].contains(&depth),
        3 | 11 => palette == 0 && [8, 16].contains(&depth),
        _ => false,
    };
    let alpha_bits = descriptor & 15;
    known && descriptor < 64 && [0, 1, 8].contains(&alpha_bits) && [w0, w1] != [0; 2] && [h0, h1] != [0; 2]
}

fn read(bytes: &[u8], wanted: Option<ColourSpace>) -> Result<Decoded, Error> {
    Raster::decoded_by(open(Cursor::new(bytes), bytes.len())?, bytes.len())?.decode(Format::Tga, wanted)
}

fn open<F: BufRead + Seek>(file: F, length: usize) -> Result<Opened<TgaDecoder<F>>, Error> {
    raster::opened(TgaDecoder::new(file), length, RATIO)
}
