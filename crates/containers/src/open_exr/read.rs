//! Reading OpenEXR: scanlines and tiles (their largest level), half, float and uint, every compression.
//!
//! A *layer* is a part of a multi-part file, a channel prefix (`diffuse.R`), or both (`part.prefix`). Without
//! a name the first layer with colour is read, an unnamed one before all others. A layer has colour with R, G
//! and B, or with Y alone (grey). Luminance with chroma (Y RY BY) is refused, and so are subsampled channels:
//! the decoder misplaces them.
//!
//! All layers of a file are read in one pass over its chunks by [`read_exr_layers`].
//!
//! The picture is the display window: pixels that the data window does not reach are black, those beyond the
//! display window are cut off, and a warning reports either.

use std::collections::{BTreeMap, HashSet};
use std::io::{Cursor, Read};

use envmap::Image;
use exr::block::chunk::{Chunk, CompressedBlock};
use exr::block::{BlockIndex, UncompressedBlock};
use exr::compression::Compression;
use exr::math::Vec2;
use exr::meta::MetaData;
use exr::meta::attribute::{AttributeValue, EnvironmentMap, SampleType};
use exr::meta::header::Header;
use half::f16;
use rayon::prelude::*;

use super::guard::{guarded, recipe_key};
use crate::chromaticity::{self, Chromaticities};
use crate::decoded::{Decoded, OpenExrEnvmap};
use crate::error::{Error, ErrorKind};
use crate::format::identify;
use crate::{Format, limits};

/// Chunks that are decompressed side by side, at most, and about how many pixels they hold.
const BATCH: usize = 64;
const BATCH_PIXELS: usize = 1 << 23;

/// The size of the picture, and its `envmap` attribute.
pub(crate) fn header(
    file: impl Read,
    length: usize,
    wanted: Option<&str>,
) -> Result<([usize; 2], Option<OpenExrEnvmap>), Error> {
    let meta = open(file)?;
    let layer = Layer::choose(&meta.headers, wanted, &mut Vec::new())?;
    let header = &meta.headers[layer.part];
    check_size(&meta.headers, header, length)?;
    let Vec2(width, height) = header.shared_attributes.display_window.size;
    Ok(([width, height], envmap_of(header)))
}

pub(crate) fn read(bytes: &[u8], wanted: Option<&str>) -> Result<Decoded, Error> {
    let meta = open(bytes)?;
    let mut warnings = Vec::new();
    let layer = Layer::choose(&meta.headers, wanted, &mut warnings)?;
    let header = &meta.headers[layer.part];
    check_size(&meta.headers, header, bytes.len())?;

    let mut pixels = read_pixels(bytes, header, &[&layer], &mut warnings)?.pop().unwrap_or_default();
    to_rec_709(header, &layer, &mut pixels, &mut warnings);
    let Vec2(width, height) = header.shared_attributes.display_window.size;
    let image = Image::new(width, height, pixels)
        .ok_or_else(|| Error::damaged("the pixels do not fill the display window"))?;
    Ok(Decoded {
        openexr_envmap: envmap_of(header),
        warnings,
        recipe: recipe_of(header),
        ..Decoded::new(Format::OpenExr, image)
    })
}

fn envmap_of(header: &Header) -> Option<OpenExrEnvmap> {
    header.own_attributes.environment_map.map(|map| match map {
        EnvironmentMap::LatitudeLongitude => OpenExrEnvmap::LatLong,
        EnvironmentMap::Cube => OpenExrEnvmap::Cube,
    })
}

/// Every layer of an OpenEXR file, and its texts.
#[derive(Clone, Debug, PartialEq)]
pub struct ExrLayers {
    /// Columns of each layer.
    pub width: usize,
    /// Rows of each layer.
    pub height: usize,
    /// Each layer's name and linear Rec. 709 pixels, row by row, in the order of parts and names; `""` names
    /// the plain R, G, B.
    pub layers: Vec<(String, Vec<[f32; 3]>)>,
    /// The `string` attributes of the first part, the recipe among them.
    pub metadata: BTreeMap<String, String>,
    /// What was ignored or assumed, in whole sentences.
    pub warnings: Vec<String>,
}

/// Reads every layer with colour of an OpenEXR file; names are as [`crate::ReadOptions`] takes them.
///
/// # Errors
/// As [`crate::read_image`]; and if all layers together have more than [`crate::MAX_PIXELS`].
pub fn read_exr_layers(bytes: &[u8]) -> Result<ExrLayers, Error> {
    identify(bytes)
        .and_then(|format| match format {
            Format::OpenExr => read_layers(bytes),
            other => {
                Err(Error::unsupported(format!("{} has no layers; expected an OpenEXR file", other.name())))
            }
        })
        .map_err(|error| error.within(Format::OpenExr.name()))
}

fn read_layers(bytes: &[u8]) -> Result<ExrLayers, Error> {
    let meta = open(bytes)?;
    let (found, colourless) = Layer::all(&meta.headers);
    let Some((_, first)) = found.first() else { return Err(without_colour(colourless)) };
    let Vec2(width, height) = meta.headers[first.part].shared_attributes.display_window.size;
    limits::pixels(width.saturating_mul(found.len()), height).map_err(|error| error.within("all layers"))?;
    let mut warnings = Vec::new();
    let mut layers = Vec::with_capacity(found.len());
    for (part, header) in meta.headers.iter().enumerate() {
        let wanted: Vec<&Layer> =
            found.iter().map(|(_, layer)| layer).filter(|layer| layer.part == part).collect();
        if wanted.is_empty() {
            continue;
        }
        check_size(&meta.headers, header, bytes.len())?;
        let pictures = read_pixels(bytes, header, &wanted, &mut warnings)?;
        for (layer, mut pixels) in wanted.into_iter().zip(pictures) {
            if pixels.len() != width * height {
                return Err(Error::damaged("the pixels do not fill the display window"));
            }
            to_rec_709(header, layer, &mut pixels, &mut warnings);
            layers.push((layer.name.clone(), pixels));
        }
    }
    warnings.dedup();
    let texts = meta.headers[0].own_attributes.other.iter();
    let metadata = texts.filter_map(|(key, value)| match value {
        AttributeValue::Text(text) => Some((key.to_string(), String::from_utf8(text.bytes().to_vec()).ok()?)),
        _ => None,
    });
    Ok(ExrLayers { width, height, layers, metadata: metadata.collect(), warnings })
}

/// The headers of a file that has nothing deep.
fn open(file: impl Read) -> Result<MetaData, Error> {
    let meta = guarded(|| MetaData::read_from_buffered(file, false))?;
    if meta.requirements.has_deep_data || meta.headers.iter().any(|header| header.deep) {
        return Err(Error::unsupported("deep data is not read; flatten the image first"));
    }
    Ok(meta)
}

/// Converts from the file's `chromaticities`, if it has them.
fn to_rec_709(header: &Header, layer: &Layer, pixels: &mut [[f32; 3]], warnings: &mut Vec<String>) {
    let Some(given) = header.shared_attributes.chromaticities else { return };
    let point = |Vec2(x, y): Vec2<f32>| [f64::from(x), f64::from(y)];
    match Chromaticities([given.red, given.green, given.blue, given.white].map(point)).to_rec_709() {
        Some(matrix) if !layer.grey() => chromaticity::apply(matrix, pixels),
        Some(_) => {}
        None => warnings.push("the chromaticities span no colour space and were ignored".into()),
    }
}

/// The recipe in a file's first part.
pub(crate) fn read_recipe(bytes: &[u8]) -> Option<String> {
    let meta = guarded(|| MetaData::read_from_buffered(bytes, false)).ok()?;
    recipe_of(meta.headers.first()?)
}

fn recipe_of(header: &Header) -> Option<String> {
    match header.own_attributes.other.get(&recipe_key())? {
        AttributeValue::Text(text) => String::from_utf8(text.bytes().to_vec()).ok(),
        _ => None,
    }
}

/// A layer with colour: the part that it is in, and which of the part's channels are red, green and blue.
struct Layer {
    part: usize,
    name: String,
    channels: [usize; 3],
}

impl Layer {
    /// Whether one channel, Y, serves all three.
    fn grey(&self) -> bool {
        self.channels[0] == self.channels[1]
    }

    /// The layers with colour, each with its channels' prefix, and the channels of those without.
    fn all(headers: &[Header]) -> (Vec<(String, Self)>, Vec<String>) {
        let mut layers = Vec::new();
        let mut colourless = Vec::new();
        for (part, header) in headers.iter().enumerate() {
            let part_name = header.own_attributes.layer_name.as_ref().map(ToString::to_string);
            let names: Vec<String> = header.channels.list.iter().map(|c| c.name.to_string()).collect();
            let mut prefixes: Vec<&str> =
                names.iter().map(|name| name.rsplit_once('.').map_or("", |(prefix, _)| prefix)).collect();
            prefixes.sort_unstable();
            prefixes.dedup();
            for prefix in prefixes {
                let find = |channel: &str| {
                    let full =
                        if prefix.is_empty() { channel.to_owned() } else { format!("{prefix}.{channel}") };
                    names.iter().position(|name| *name == full)
                };
                let channels = match [find("R"), find("G"), find("B"), find("Y")] {
                    [Some(r), Some(g), Some(b), _] => Some([r, g, b]),
                    [None, None, None, Some(y)] if find("RY").is_none() && find("BY").is_none() => {
                        Some([y; 3])
                    }
                    _ => None,
                };
                let name = match part_name.as_deref().unwrap_or_default() {
                    "" => prefix.to_owned(),
                    part if prefix.is_empty() => part.to_owned(),
                    part => format!("{part}.{prefix}"),
                };
                match channels {
                    Some(channels) => layers.push((prefix.to_owned(), Self { part, name, channels })),
                    None => colourless.extend(names.iter().cloned()),
                }
            }
        }
        (layers, colourless)
    }

    fn choose(headers: &[Header], wanted: Option<&str>, warnings: &mut Vec<String>) -> Result<Self, Error> {
        let (mut layers, colourless) = Self::all(headers);
        let list = |layers: &[(String, Self)]| {
            let name = |(_, layer): &(String, Self)| match layer.name.as_str() {
                "" => "the unnamed one".to_owned(),
                name => format!("`{name}`"),
            };
            layers.iter().map(name).collect::<Vec<_>>().join(", ")
        };
        let position = match wanted {
            Some(wanted) => layers
                .iter()
                .position(|(_, layer)| layer.name == wanted)
                .or_else(|| layers.iter().position(|(prefix, _)| prefix == wanted && !prefix.is_empty())),
            None => layers.iter().position(|(_, layer)| layer.name.is_empty()).or(Some(0)),
        };
        if let Some(position) = position.filter(|&position| position < layers.len()) {
            if wanted.is_none() && layers.len() > 1 {
                let chosen = list(&layers[position..=position]);
                warnings.push(format!("the file has the layers {}; {chosen} was read", list(&layers)));
            }
            return Ok(layers.swap_remove(position).1);
        }
        if layers.is_empty() {
            return Err(without_colour(colourless));
        }
        Err(Error::new(
            ErrorKind::NoSuchLayer,
            format!("there is no layer `{}`; the layers are {}", wanted.unwrap_or_default(), list(&layers)),
        ))
    }
}

/// Why a file with these channels holds no picture.
fn without_colour(channels: Vec<String>) -> Error {
    match channels.iter().any(|name| name.ends_with("RY") || name.ends_with("BY")) {
        true => Error::unsupported("luminance and chroma (Y RY BY) are not read; convert the image to RGB"),
        false => Error::unsupported(format!(
            "no layer has R, G and B, or Y; the channels are {}",
            channels.join(", ")
        )),
    }
}

/// Checks all that the decoder would otherwise believe: sizes of the windows, of a tile, of the offset
/// tables.
fn check_size(headers: &[Header], header: &Header, len: usize) -> Result<(), Error> {
    let display = header.shared_attributes.display_window.size;
    limits::pixels(display.0, display.1).map_err(|error| error.within("display window"))?;
    for header in headers {
        // Each chunk has 8 bytes in the offset table and at least 8 of its own.
        limits::plausible(header.chunk_count.saturating_mul(16), len, 1)?;
    }
    if let Some(channel) = header.channels.list.iter().find(|channel| channel.sampling != Vec2(1, 1)) {
        return Err(Error::unsupported(format!(
            "channel {} is subsampled, which is not read; convert the image to full resolution",
            channel.name
        )));
    }
    let Vec2(width, height) = header.layer_size;
    let pixels = limits::pixels(width, height).map_err(|error| error.within("data window"))?;
    let block = header.max_block_pixel_size();
    limits::pixels(block.0, block.1).map_err(|error| error.within("tile size"))?;
    // A window that is nearly empty is more likely damage than a crop, and its size is not paid for by any
    // data.
    limits::plausible(display.0 * display.1, pixels, MAX_EMPTY).map_err(|_| {
        Error::damaged(format!("the data window holds {pixels} of {} x {} pixels", display.0, display.1))
    })?;
    limits::plausible(pixels.saturating_mul(pixel_bytes(header)), len, ratio(header.compression))
}

/// The most that the display window may be larger than the data window.
const MAX_EMPTY: usize = 64;

fn pixel_bytes(header: &Header) -> usize {
    header.channels.list.iter().map(|channel| channel.sample_type.bytes_per_sample()).sum()
}

/// The most that a compression can gain. Deflate's is 1032 to 1, and the other codes gain less, except that
/// DWA keeps 2 deflated bytes of a constant block of 64 pixels.
fn ratio(compression: Compression) -> usize {
    match compression {
        Compression::Uncompressed => 1,
        Compression::DWAA(_) | Compression::DWAB(_) => 1032 * 64,
        _ => 1032,
    }
}

/// Checks what a chunk says about its own size, which the decoder would allocate unchecked.
fn check_chunk(header: &Header, chunk: &Chunk) -> Result<(), Error> {
    let compressed = match &chunk.compressed_block {
        CompressedBlock::ScanLine(block) => &block.compressed_pixels_le,
        CompressedBlock::Tile(block) => &block.compressed_pixels_le,
        _ => return Err(Error::unsupported("deep data is not read; flatten the image first")),
    };
    let size = guarded(|| {
        let position = header.get_block_data_indices(&chunk.compressed_block)?;
        Ok(header.get_absolute_block_pixel_coordinates(position)?.size)
    })?;
    let (block_bytes, dwa) = match header.compression {
        Compression::DWAA(_) | Compression::DWAB(_) => {
            (size.0.next_multiple_of(8) * size.1.next_multiple_of(8) * pixel_bytes(header), true)
        }
        _ => (size.0 * size.1 * pixel_bytes(header), false),
    };
    limits::plausible(block_bytes, compressed.len(), ratio(header.compression))?;
    if dwa {
        // Eleven counters lead a DWA chunk; those of uncompressed bytes and values count what the block
        // holds.
        const UNCOMPRESSED: [usize; 5] = [1, 6, 7, 8, 9];
        for (position, counter) in compressed.chunks_exact(8).take(11).enumerate() {
            let counter = counter.iter().rev().fold(0_u64, |value, byte| value << 8 | u64::from(*byte));
            if UNCOMPRESSED.contains(&position) && counter > 2 * block_bytes as u64 {
                return Err(Error::damaged("a DWA chunk declares more values than its block has"));
            }
        }
    }
    Ok(())
}

/// RGB of the display window, row by row, of each of these layers of one part.
fn read_pixels(
    bytes: &[u8],
    header: &Header,
    layers: &[&Layer],
    warnings: &mut Vec<String>,
) -> Result<Vec<Vec<[f32; 3]>>, Error> {
    let part = layers[0].part;
    let (mut chunks, meta) = guarded(|| {
        let reader = exr::block::read(Cursor::new(bytes), false)?;
        let meta = reader.meta_data().clone();
        let largest = |_: &MetaData, _, block: BlockIndex| block.layer == part && block.level == Vec2(0, 0);
        Ok((reader.filter_chunks(false, largest)?, meta))
    })?;
    let mut windows: Vec<Window> = layers.iter().map(|layer| Window::new(header, layer)).collect();
    if windows[0].partial {
        warnings.push(
            "the data window differs from the display window, which was read; what lies outside the data is black"
                .into(),
        );
    }
    let Vec2(width, height) = header.max_block_pixel_size();
    let batch_size = (BATCH_PIXELS / (width * height).max(1)).clamp(2, BATCH);
    let mut seen = HashSet::new();
    loop {
        let batch: Vec<Chunk> = guarded(|| chunks.by_ref().take(batch_size).collect())?;
        if batch.is_empty() {
            break;
        }
        let blocks: Vec<Result<UncompressedBlock, Error>> = batch
            .into_par_iter()
            .map(|chunk| {
                check_chunk(header, &chunk)?;
                guarded(|| UncompressedBlock::decompress_chunk(chunk, &meta, false))
            })
            .collect();
        for block in blocks {
            let block = block?;
            let index = block.index;
            if index.layer != part || index.level != Vec2(0, 0) || !seen.insert(index.pixel_position) {
                return Err(Error::damaged("the offset table names a wrong chunk"));
            }
            for (window, layer) in windows.iter_mut().zip(layers) {
                window.fill(header, layer, &block)?;
            }
        }
    }
    if windows.iter().any(|window| window.transparent) {
        warnings.push("alpha was ignored; the colours are those over black".into());
    }
    Ok(windows.into_iter().map(|window| window.pixels).collect())
}

/// The display window's pixels, filled block by block.
struct Window {
    pixels: Vec<[f32; 3]>,
    size: [i64; 2],
    /// The data window's corner, in the display window.
    corner: [i64; 2],
    /// Whether the windows differ.
    partial: bool,
    /// The channel of alpha, and whether it was anywhere below 1.
    alpha: Option<usize>,
    transparent: bool,
}

impl Window {
    fn new(header: &Header, layer: &Layer) -> Self {
        let display = header.shared_attributes.display_window;
        let at = header.own_attributes.layer_position;
        // The layer's own alpha: that of another says nothing of these colours.
        let colour = header.channels.list[layer.channels[0]].name.to_string();
        let alpha = colour.rsplit_once('.').map_or("A".to_owned(), |(prefix, _)| format!("{prefix}.A"));
        let alpha = header.channels.list.iter().position(|channel| channel.name.eq(alpha.as_str()));
        Self {
            pixels: Vec::new(),
            size: [display.size.0 as i64, display.size.1 as i64],
            corner: [
                i64::from(at.0) - i64::from(display.position.0),
                i64::from(at.1) - i64::from(display.position.1),
            ],
            partial: at != display.position || header.layer_size != display.size,
            alpha,
            transparent: false,
        }
    }

    fn fill(&mut self, header: &Header, layer: &Layer, block: &UncompressedBlock) -> Result<(), Error> {
        if self.pixels.is_empty() {
            // Only now, when a block has come out sound, is the header's size believed.
            self.pixels = vec![[0.0; 3]; (self.size[0] * self.size[1]) as usize];
        }
        let mut rest = block.data.as_slice();
        let BlockIndex { pixel_position, pixel_size, .. } = block.index;
        for y in 0..pixel_size.1 {
            let row = self.corner[1] + (pixel_position.1 + y) as i64;
            for (channel, description) in header.channels.list.iter().enumerate() {
                let length = pixel_size.0 * description.sample_type.bytes_per_sample();
                let (samples, after) = rest
                    .split_at_checked(length)
                    .ok_or_else(|| Error::damaged("a block is shorter than its pixels"))?;
                rest = after;
                if self.alpha == Some(channel) {
                    visit(description.sample_type, samples, |_, value| self.transparent |= value < 1.0);
                }
                let targets: Vec<usize> = (0..3).filter(|&c| layer.channels[c] == channel).collect();
                if targets.is_empty() || !(0..self.size[1]).contains(&row) {
                    continue;
                }
                let start = self.corner[0] + pixel_position.0 as i64;
                let line = &mut self.pixels[(row * self.size[0]) as usize..][..self.size[0] as usize];
                visit(description.sample_type, samples, |x, value| {
                    let column = start + x as i64;
                    if let Some(pixel) = usize::try_from(column).ok().and_then(|column| line.get_mut(column))
                    {
                        targets.iter().for_each(|&c| pixel[c] = value);
                    }
                });
            }
        }
        Ok(())
    }
}

/// Gives every sample of a line, in the order of this machine's bytes, as f32.
fn visit(kind: SampleType, bytes: &[u8], mut each: impl FnMut(usize, f32)) {
    let word = |bytes: &[u8]| [bytes[0], bytes[1], bytes[2], bytes[3]];
    match kind {
        SampleType::F16 => bytes
            .chunks_exact(2)
            .enumerate()
            .for_each(|(x, bytes)| each(x, f16::from_ne_bytes([bytes[0], bytes[1]]).to_f32())),
        SampleType::F32 => {
            bytes.chunks_exact(4).enumerate().for_each(|(x, bytes)| each(x, f32::from_ne_bytes(word(bytes))));
        }
        SampleType::U32 => {
            bytes
                .chunks_exact(4)
                .enumerate()
                .for_each(|(x, bytes)| each(x, u32::from_ne_bytes(word(bytes)) as f32));
        }
    }
}
