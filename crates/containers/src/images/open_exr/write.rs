//! Writing OpenEXR: one part of R, G and B, once or for each layer, scanlines in blocks of 16, ZIP
//! (lossless), Rec. 709 by absence of `chromaticities`.
//!
//! Layers are channels with a prefix (`diffuse.R`) in one part: every viewer and compositor reads that, while
//! some read only the first part of a file with several. A layer without a name is the plain R, G, B, which
//! is what a program without layers shows.

use std::collections::HashSet;
use std::io::Cursor;
use std::ops::Range;

use envmap::{CodedRows, Image};
use exr::block::chunk::{Chunk, CompressedBlock};
use exr::block::writer::ChunksWriter;
use exr::block::{BlockIndex, UncompressedBlock, enumerate_ordered_header_block_indices};
use exr::compression::Compression;
use exr::meta::attribute::{AttributeValue, ChannelDescription, LineOrder, SampleType};
use exr::meta::header::Header;
use exr::meta::{BlockDescription, Headers};
use rayon::prelude::*;
use sh::{Stop, Stopped};

use super::CODEC;
use super::guard::{guarded, recipe_key, text};
use crate::error::{Error, ErrorKind};
use crate::header_word::{size, word};
use crate::images::decoded::Encoded;
use crate::precision::{Precision, to_half};
use crate::{limits, recipe};

/// Writes OpenEXR; `recipe` goes into a `string` attribute.
///
/// With [`Precision::Half`] each value becomes the nearest half, ties to even; values past +-65504, infinite
/// ones among them, become +-65504. NaN stays NaN.
///
/// # Errors
/// If the recipe holds control characters.
pub fn write_exr(image: &Image, precision: Precision, recipe: Option<&str>) -> Result<Encoded, Error> {
    let (width, height) = (image.width(), image.height());
    write(
        width,
        height,
        &[Layer { name: "", letters: "RGB", values: Values::Image(image) }],
        precision,
        recipe,
        &[],
        Stop::NEVER,
    )
    .map_err(|error| error.within(CODEC.name))
}

/// Writes OpenEXR of four channels, R, G, B and A, row by row, for numbers that are no colours: the alpha is
/// whatever the last number is. Numbers and `metadata` as [`write_exr_layers`] has them.
///
/// # Errors
/// If there are not `width` x `height` pixels; if an attribute has control characters, the name of another or
/// one that the format uses itself.
pub fn write_exr_rgba(
    width: usize,
    height: usize,
    rgba: &[[f32; 4]],
    precision: Precision,
    recipe: Option<&str>,
    metadata: &[(&str, &str)],
) -> Result<Encoded, Error> {
    let layer = Layer { name: "", letters: "RGBA", values: Values::All(rgba.as_flattened()) };
    check_count(width, height, rgba.len())
        .and_then(|()| write(width, height, &[layer], precision, recipe, metadata, Stop::NEVER))
        .map_err(|error| error.within(CODEC.name))
}

/// Writes OpenEXR with a layer for each of `layers`: a name and RGB, row by row. `metadata` and the recipe
/// become `string` attributes.
///
/// The layer named `""` is the plain R, G and B; it is optional. Numbers as [`write_exr`] has them. `stop` is
/// asked before each block of rows is compressed.
///
/// # Errors
/// If there is no layer, or one does not have `width` x `height` pixels; if two have the same name, or a name
/// or an attribute has control characters; if two attributes have the same name, or one has a name that the
/// format uses itself; if it was stopped.
///
/// # Example: a program without layers sees the layer without a name
/// ```
/// use containers::{Precision, ReadOptions, read_image, write_exr_layers};
/// let layers = [(String::new(), vec![[1.0; 3]]), ("p1q0".to_owned(), vec![[0.5; 3]])];
/// let bytes = write_exr_layers(1, 1, &layers, Precision::Half, None, &[], sh::Stop::NEVER)?.bytes;
/// assert_eq!(read_image(&bytes, &ReadOptions::default())?.image.pixels(), [[1.0; 3]]);
/// let option = ReadOptions { layer: Some("p1q0".into()), ..ReadOptions::default() };
/// assert_eq!(read_image(&bytes, &option)?.image.pixels(), [[0.5; 3]]);
/// # Ok::<(), containers::Error>(())
/// ```
pub fn write_exr_layers(
    width: usize,
    height: usize,
    layers: &[(String, Vec<[f32; 3]>)],
    precision: Precision,
    recipe: Option<&str>,
    metadata: &[(&str, &str)],
    stop: Stop<'_>,
) -> Result<Encoded, Error> {
    let values = layers.iter().map(|(name, pixels)| (name, Values::All(pixels.as_flattened())));
    let named: Vec<_> = values.map(|(name, values)| Layer { name, letters: "RGB", values }).collect();
    check_layers(width, height, layers)
        .and_then(|()| write(width, height, &named, precision, recipe, metadata, stop))
        .map_err(|error| error.within(CODEC.name))
}

/// The numbers of all channels of a layer, pixel by pixel.
enum Values<'a> {
    /// The numbers themselves.
    All(&'a [f32]),
    /// The numbers of a picture, which may have to be decoded.
    Image(&'a Image),
}

/// A layer, of which each channel has a letter.
struct Layer<'a> {
    name: &'a str,
    letters: &'static str,
    values: Values<'a>,
}

impl Layer<'_> {
    /// The numbers of some rows, which are decoded into `scratch` if they have to be.
    fn rows<'s>(&'s self, width: usize, rows: Range<usize>, scratch: &'s mut Vec<[f32; 3]>) -> &'s [f32] {
        match self.values {
            Values::All(values) => {
                let per_row = width * self.letters.len();
                &values[rows.start * per_row..rows.end * per_row]
            }
            Values::Image(image) => image.rows(rows, scratch).as_flattened(),
        }
    }

    fn channel_name(&self, letter: char) -> String {
        if self.name.is_empty() { letter.into() } else { format!("{}.{letter}", self.name) }
    }
}

/// A channel: its name, its layer, and its place in a pixel of that.
struct Channel {
    name: String,
    layer: usize,
    place: usize,
}

/// The channels of all layers, in the order of their names' bytes.
fn channels(layers: &[Layer<'_>]) -> Vec<Channel> {
    let of_layer = |(layer, of): (usize, &Layer<'_>)| {
        let letters = of.letters.chars().enumerate();
        let channel = |(place, letter)| Channel { name: of.channel_name(letter), layer, place };
        letters.map(channel).collect::<Vec<_>>()
    };
    let mut channels: Vec<Channel> = layers.iter().enumerate().flat_map(of_layer).collect();
    channels.sort_by(|a, b| a.name.as_bytes().cmp(b.name.as_bytes()));
    channels
}

fn check_count(width: usize, height: usize, found: usize) -> Result<(), Error> {
    let unwritable = |message| Error::new(ErrorKind::Unwritable, message);
    let pixels = limits::pixels(width, height).map_err(|error| unwritable(error.to_string()))?;
    if found != pixels {
        return Err(unwritable(format!("expected {width} x {height} pixels, found {found} pixels")));
    }
    Ok(())
}

fn check_layers(width: usize, height: usize, layers: &[(String, Vec<[f32; 3]>)]) -> Result<(), Error> {
    let unwritable = |message| Err(Error::new(ErrorKind::Unwritable, message));
    let pixels = limits::pixels(width, height)
        .map_err(|error| Error::new(ErrorKind::Unwritable, error.to_string()))?;
    if layers.is_empty() {
        return unwritable("expected a layer, found none".to_owned());
    }
    let mut names = HashSet::new();
    for (name, values) in layers {
        if values.len() != pixels {
            return unwritable(format!(
                "layer `{name}`: expected {width} x {height} pixels, found {} pixels",
                values.len()
            ));
        }
        if !names.insert(name) {
            return unwritable(format!("two layers are named `{name}`"));
        }
        if name.chars().any(char::is_control) {
            return unwritable(format!("layer {name:?}: a name has no control characters"));
        }
    }
    Ok(())
}

fn write(
    width: usize,
    height: usize,
    layers: &[Layer<'_>],
    precision: Precision,
    recipe: Option<&str>,
    metadata: &[(&str, &str)],
    stop: Stop<'_>,
) -> Result<Encoded, Error> {
    recipe::check(recipe)?;
    let sample_type = match precision {
        Precision::Float => SampleType::F32,
        Precision::Half => SampleType::F16,
    };
    let channels = channels(layers);
    let list = channels.iter().map(|channel| ChannelDescription::named(text(&channel.name), sample_type));
    let mut header = Header::new(text(""), (width, height), list.collect()).with_encoding(
        Compression::ZIP16,
        BlockDescription::ScanLines,
        LineOrder::Increasing,
    );
    header.own_attributes.layer_name = None;
    let entries = metadata.iter().map(|(key, value)| (text(key), *value));
    for (key, value) in entries.chain(recipe.map(|recipe| (recipe_key(), recipe))) {
        let bad = value.chars().any(char::is_control);
        let previous = header.own_attributes.other.insert(key.clone(), AttributeValue::Text(text(value)));
        if previous.is_some() || bad {
            return Err(Error::new(
                ErrorKind::Unwritable,
                format!("attribute `{key}`: expected one, of one line without control characters"),
            ));
        }
    }
    let several_texts = header.own_attributes.other.len() > 1;
    let headers: Headers = [header].into_iter().collect();

    let blocks: Vec<(usize, BlockIndex)> = enumerate_ordered_header_block_indices(&headers).collect();
    let compress = |blocks: &[(usize, BlockIndex)]| -> Result<Vec<(usize, Chunk)>, Error> {
        let data = samples(width, layers, &channels, blocks, precision);
        let chunk = |((position, index), data): (&(usize, BlockIndex), Vec<u8>)| {
            stop.check().map_err(|Stopped| Error::new(ErrorKind::Unwritable, "the writing was stopped"))?;
            let block = UncompressedBlock { index: *index, data };
            Ok((*position, guarded(|| block.compress_to_chunk(&headers))?))
        };
        blocks.iter().zip(data).map(chunk).collect()
    };
    let chunks: Vec<Vec<(usize, Chunk)>> =
        blocks.par_chunks(BLOCKS_AT_ONCE).map(compress).collect::<Result<_, _>>()?;
    let of_chunks: usize = chunks.iter().flatten().map(|(_, chunk)| length(chunk)).sum();
    let mut bytes = Vec::with_capacity(HEADER + of_chunks);
    guarded(|| {
        exr::block::write(Cursor::new(&mut bytes), headers, false, |_, writer| {
            chunks.into_iter().flatten().try_for_each(|(position, chunk)| writer.write_chunk(position, chunk))
        })
    })?;
    if several_texts {
        sort_attributes(&mut bytes);
    }
    Ok(Encoded { bytes, negative: 0 })
}

/// Room for the header of most files.
const HEADER: usize = 1 << 14;

/// The bytes of a chunk of scanlines in the file, and of its place.
fn length(chunk: &Chunk) -> usize {
    const NUMBERS: usize = 16;
    match &chunk.compressed_block {
        CompressedBlock::ScanLine(block) => NUMBERS + block.compressed_pixels_le.len(),
        _ => 0,
    }
}

/// Puts the attributes of a file of one part in the order of their names: the `exr` crate keeps texts in a
/// hash map, so that their order would differ from run to run. No length changes, and so no offset does.
fn sort_attributes(bytes: &mut [u8]) {
    const START: usize = 8;
    let mut attributes: Vec<Vec<u8>> = Vec::new();
    let mut at = START;
    // Name, type, each ended by NUL, length of the value, value; an empty name ends the header.
    while bytes.get(at).is_some_and(|byte| *byte != 0) {
        let text =
            |from: usize| bytes[from..].iter().position(|byte| *byte == 0).map(|length| from + length + 1);
        let Some(length_at) = text(at).and_then(text) else { return };
        let Some(length) = word(bytes, length_at) else { return };
        let end = length_at + 4 + size(length);
        let Some(attribute) = bytes.get(at..end) else { return };
        attributes.push(attribute.to_vec());
        at = end;
    }
    // A name ends with NUL, which is below every other byte, so that bytes are in the order of names.
    attributes.sort_unstable();
    bytes[START..at].copy_from_slice(&attributes.concat());
}

/// Blocks of 16 rows that are compressed one after the other: their rows are decoded at once.
const BLOCKS_AT_ONCE: usize = CodedRows::HEIGHT / 16;

/// The samples of neighbouring blocks in the order of this machine's bytes, each row channel after channel.
fn samples(
    width: usize,
    layers: &[Layer<'_>],
    channels: &[Channel],
    blocks: &[(usize, BlockIndex)],
    precision: Precision,
) -> Vec<Vec<u8>> {
    let rows = |index: &BlockIndex| index.pixel_position.1..index.pixel_position.1 + index.pixel_size.1;
    let ends = blocks.first().zip(blocks.last());
    let all = ends.map_or(0..0, |((_, first), (_, last))| rows(first).start..rows(last).end);
    let mut scratch: Vec<Vec<[f32; 3]>> = layers.iter().map(|_| Vec::new()).collect();
    let values: Vec<&[f32]> = layers
        .iter()
        .zip(&mut scratch)
        .map(|(layer, scratch)| layer.rows(width, all.clone(), scratch))
        .collect();
    let of_block = |(_, index): &(usize, BlockIndex)| {
        let mut data = Vec::new();
        for row in rows(index) {
            for Channel { layer, place, .. } in channels {
                let count = layers[*layer].letters.len();
                let row = &values[*layer][(row - all.start) * width * count..][..width * count];
                for value in row.iter().skip(*place).step_by(count) {
                    match precision {
                        Precision::Float => data.extend_from_slice(&value.to_ne_bytes()),
                        Precision::Half => data.extend_from_slice(&to_half(*value).to_ne_bytes()),
                    }
                }
            }
        }
        data
    };
    blocks.iter().map(of_block).collect()
}
