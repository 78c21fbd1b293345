//! Reading OpenEXR: scanlines and tiles (their largest level), half, float and uint, every compression.
//!
//! `layer.rs` finds the layers and chooses one; `subsampled.rs` reads chroma of half the resolution.
//!
//! All layers of a file are read in one pass over its chunks by [`read_layers`].
//!
//! The picture is the display window: pixels that the data window does not reach are black, those beyond the
//! display window are cut off, and a warning reports either. Windows that do not overlap are an error.

use std::borrow::Cow;
use std::collections::{BTreeMap, HashSet};
use std::io::{Cursor, Read, Seek};
use std::sync::Mutex;

use envmap::Image;
use exr::block::chunk::{Chunk, CompressedBlock};
use exr::block::{BlockIndex, UncompressedBlock};
use exr::compression::Compression;
use exr::math::Vec2;
use exr::meta::MetaData;
use exr::meta::attribute::{AttributeValue, EnvironmentMap};
use exr::meta::header::Header;
use rayon::prelude::*;
use sh::Stop;

use super::guard::{guarded, recipe_key};
use super::layer::{Colour, Layer, without_colour};
use super::subsampled;
use super::window::Window;
use crate::error::Error;
use crate::file_part::{beginning, rewind};
use crate::format::Format;
use crate::images::block_writer::{BlockWriter, Patch};
use crate::images::chromaticity::Chromaticities;
use crate::images::codec::HeaderFacts;
use crate::images::colour_space::ColourSpace;
use crate::images::decoded::{Decoded, OpenExrEnvmap, ReadOptions};
use crate::images::outside_gamut::OutsideGamut;
use crate::images::panorama::Panorama;
use crate::images::{chromaticity, gpano};
use crate::limits;

/// Chunks that are decompressed side by side, at most, and about how many pixels they hold.
const BATCH: usize = 64;
const BATCH_PIXELS: usize = 1 << 20;

pub(crate) fn header(
    file: impl Read + Seek,
    length: usize,
    wanted: Option<&str>,
) -> Result<HeaderFacts, Error> {
    let meta = open(file)?;
    let layer = Layer::choose(&meta.headers, wanted, &mut Vec::new())?;
    let header = &meta.headers[layer.part];
    subsampled::check(header, &layer)?;
    check_size(&meta.headers, header, length)?;
    let Vec2(width, height) = header.shared_attributes.display_window.size;
    let size = [width, height];
    Ok(HeaderFacts {
        size,
        blocks: blocks(header),
        openexr_envmap: envmap_of(header),
        panorama: panorama_of(header, size),
        ..HeaderFacts::default()
    })
}

pub(crate) fn read(bytes: &[u8], options: &ReadOptions, stop: Stop<'_>) -> Result<Decoded, Error> {
    let meta = open(Cursor::new(bytes))?;
    let mut warnings = Vec::new();
    let layer = Layer::choose(&meta.headers, options.layer.as_deref(), &mut warnings)?;
    let header = &meta.headers[layer.part];
    subsampled::check(header, &layer)?;
    check_size(&meta.headers, header, bytes.len())?;

    let (mut notes, mut about_colours) = (Vec::new(), Vec::new());
    let matrix = match layer.colour {
        Colour::Grey => None,
        _ => {
            let declared = declared(header, &mut about_colours);
            let declared = declared.as_ref().map(|(source, declared)| (source.as_str(), *declared));
            ColourSpace::chosen(options.colour_space, declared, &mut about_colours)
                .map(Chromaticities::to_rec_709)
        }
    };
    let convert = |pixels: &mut [[f32; 3]]| match matrix {
        Some(Some(matrix)) => chromaticity::apply(matrix, pixels),
        _ => OutsideGamut::default(),
    };
    let has_chroma = layer.colour == Colour::LuminanceChroma;
    let finish = |pixels: &mut [[f32; 3]]| match has_chroma {
        true => OutsideGamut::default(),
        false => convert(pixels),
    };
    let read = read_pixels(bytes, header, &[&layer], &mut warnings, finish, stop)?.pop();
    let (mut image, mut outside) =
        read.ok_or_else(|| Error::damaged("the pixels do not fill the display window"))?;
    if has_chroma {
        // Chroma is interpolated over the whole picture.
        to_rgb(header, &layer, image.pixels_mut());
        outside = convert(image.pixels_mut());
    }
    match matrix {
        Some(Some(_)) => outside.report(&mut about_colours, &mut notes),
        Some(None) => about_colours.push(NO_SPACE.into()),
        None => {}
    }
    warnings.append(&mut about_colours);
    Ok(Decoded {
        openexr_envmap: envmap_of(header),
        panorama: panorama_of(header, [image.width(), image.height()]),
        warnings,
        notes,
        recipe: recipe_of(header),
        ..Decoded::new(Format::OpenExr, image)
    })
}

/// How many blocks the largest level of a part consists of.
fn blocks(header: &Header) -> usize {
    let (size, block) = (header.layer_size, header.max_block_pixel_size());
    size.width().div_ceil(block.width().max(1)) * size.height().div_ceil(block.height().max(1))
}

fn envmap_of(header: &Header) -> Option<OpenExrEnvmap> {
    header.own_attributes.environment_map.map(|map| match map {
        EnvironmentMap::LatitudeLongitude => OpenExrEnvmap::LatLong,
        EnvironmentMap::Cube => OpenExrEnvmap::Cube,
    })
}

/// GPano in attributes, as OpenImageIO writes the XMP of a picture that it converts.
fn panorama_of(header: &Header, size: [usize; 2]) -> Option<Panorama> {
    let value = |name: &str| {
        let key = format!("GPano:{name}");
        let mut attributes = header.own_attributes.other.iter().chain(&header.shared_attributes.other);
        let (_, value) = attributes.find(|(name, _)| (*name).eq(key.as_str()))?;
        match value {
            AttributeValue::Text(text) => Some(String::from_utf8_lossy(text.bytes()).into_owned()),
            AttributeValue::I32(number) => Some(number.to_string()),
            AttributeValue::F32(number) => Some(number.to_string()),
            AttributeValue::F64(number) => Some(number.to_string()),
            _ => None,
        }
    };
    gpano::of_properties(value, size)
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
    /// Notes of what was ignored or assumed, in whole sentences.
    pub warnings: Vec<String>,
}

/// Reads every layer with colour.
pub(crate) fn read_layers(bytes: &[u8]) -> Result<ExrLayers, Error> {
    let meta = open(Cursor::new(bytes))?;
    let (found, colourless) = Layer::all(&meta.headers);
    let Some((_, first)) = found.first() else { return Err(without_colour(&colourless)) };
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
        wanted.iter().try_for_each(|layer| subsampled::check(header, layer))?;
        check_size(&meta.headers, header, bytes.len())?;
        let pictures =
            read_pixels(bytes, header, &wanted, &mut warnings, |_| OutsideGamut::default(), Stop::NEVER)?;
        for (layer, (picture, _)) in wanted.into_iter().zip(pictures) {
            let mut pixels = picture.into_pixels();
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
fn open(mut file: impl Read + Seek) -> Result<MetaData, Error> {
    let start = beginning(&mut file, subsampled::MOST_HEADER)?;
    rewind(&mut file)?;
    let (shown, samplings) = subsampled::shown(&start);
    let meta = match shown {
        Cow::Borrowed(_) => guarded(|| MetaData::read_from_buffered(&mut file, false)),
        Cow::Owned(shown) => guarded(|| MetaData::read_from_buffered(Cursor::new(shown), false)),
    };
    let mut meta = meta.map_err(|error| {
        // The decoder knows no compression beyond HTJ2K, and says of others that there is none.
        match compression_number(&mut file) {
            Some(12) => unread_compression("LJ2K (JPEG 2000)"),
            Some(13) => unread_compression("ZSTD"),
            Some(number @ 14..) => unread_compression(&format!("number {number}")),
            _ => error,
        }
    })?;
    let htj2k = |header: &Header| matches!(header.compression, Compression::HTJ2K32 | Compression::HTJ2K256);
    if meta.headers.iter().any(htj2k) {
        return Err(unread_compression("HTJ2K (High-Throughput JPEG 2000)"));
    }
    if meta.requirements.has_deep_data || meta.headers.iter().any(|header| header.deep) {
        return Err(Error::unsupported("deep data is not read; flatten the image first"));
    }
    subsampled::restore(&mut meta.headers, &samplings)?;
    Ok(meta)
}

fn unread_compression(name: &str) -> Error {
    Error::unsupported(format!("the compression {name} is not read; save the image with ZIP or PIZ"))
}

/// The number of the first part's compression.
fn compression_number(file: &mut (impl Read + Seek)) -> Option<u8> {
    const ATTRIBUTE: &[u8] = b"compression\0compression\0\x01\0\0\0";
    let start = beginning(file, 1 << 16).ok()?;
    let at = start.windows(ATTRIBUTE.len()).position(|window| window == ATTRIBUTE)?;
    start.get(at + ATTRIBUTE.len()).copied()
}

const NO_SPACE: &str = "the chromaticities span no colour space and were ignored";

/// The primaries that a file declares, and where: `colorInteropID`, `chromaticities`, or a name that
/// OpenImageIO or OCIO left, in this order.
fn declared(header: &Header, warnings: &mut Vec<String>) -> Option<(String, Chromaticities)> {
    const NAMES: [&str; 3] = ["colorInteropID", "oiio:ColorSpace", "colorspace"];
    let numbers = chromaticities_of(header);
    let named = NAMES.into_iter().find_map(|key| {
        let name = text_of(header, key)?;
        // These say on purpose that nothing is known, or that nothing is to be converted.
        let says_nothing =
            ["", "unknown", "raw", "data"].contains(&name.trim().to_ascii_lowercase().as_str());
        (!says_nothing).then_some((key, name))
    });
    let Some((key, name)) = named else {
        return numbers.map(|numbers| ("the file's chromaticities".to_owned(), numbers));
    };
    let space = ColourSpace::from_name(&name).map(ColourSpace::chromaticities);
    let source = format!("the file's attribute {key} = {name:?}");
    match (space, numbers) {
        (Some(space), Some(numbers)) if key == NAMES[0] && !space.is_near(numbers) => {
            warnings
                .push(format!("{source} and its chromaticities name different primaries; {key} was taken"));
            Some((source, space))
        }
        (_, Some(numbers)) => Some(("the file's chromaticities".to_owned(), numbers)),
        (Some(space), None) => Some((source, space)),
        (None, None) => {
            let known = ColourSpace::ALL.map(ColourSpace::name).join(", ");
            warnings.push(format!(
                "{source} is not a linear colour space that is known here; the values were taken for linear \
                 Rec. 709 (known are {known}, also by their names in OCIO)"
            ));
            None
        }
    }
}

/// A text among the attributes of a part.
fn text_of(header: &Header, key: &str) -> Option<String> {
    let attributes = header.own_attributes.other.iter().chain(&header.shared_attributes.other);
    attributes.filter(|(name, _)| (*name).eq(key)).find_map(|(_, value)| match value {
        AttributeValue::Text(text) => String::from_utf8(text.bytes().to_vec()).ok(),
        _ => None,
    })
}

fn chromaticities_of(header: &Header) -> Option<Chromaticities> {
    let point = |Vec2(x, y): Vec2<f32>| [f64::from(x), f64::from(y)];
    let given = header.shared_attributes.chromaticities?;
    Some(Chromaticities([given.red, given.green, given.blue, given.white].map(point)))
}

/// Makes R, G and B of luminance and chroma. The weights of the luminance are those of the attribute
/// `chromaticities`, or else of Rec. 709, whatever other primaries are named.
fn to_rgb(header: &Header, layer: &Layer, pixels: &mut [[f32; 3]]) {
    if layer.colour != Colour::LuminanceChroma {
        return;
    }
    let sampling = header.channels.list[layer.channels[1]].sampling;
    let display = header.shared_attributes.display_window;
    let at = header.own_attributes.layer_position;
    // The data in the display window, and the pixel of its corner.
    let origin = [display.position.0, display.position.1].map(i64::from);
    let from = [at.0, at.1].map(i64::from);
    let size = [display.size.0 as i64, display.size.1 as i64];
    let data = [header.layer_size.0 as i64, header.layer_size.1 as i64];
    let first = [0, 1].map(|axis| (from[axis] - origin[axis]).max(0));
    let past = [0, 1].map(|axis| (from[axis] - origin[axis] + data[axis]).min(size[axis]));
    let window = [first[0], first[1], past[0], past[1]];
    if sampling != Vec2(1, 1) {
        subsampled::fill(pixels, display.size.0, window, origin, sampling);
    }
    let weights = chromaticities_of(header).and_then(Chromaticities::to_xyz);
    let weights = weights.or_else(|| Chromaticities::REC_709.to_xyz());
    let [r, g, b] = weights.map_or([0.0, 1.0, 0.0], |matrix| matrix.row(1).to_array());
    // OpenEXR, "luminance/chroma images": RY = (R - Y) / Y, BY = (B - Y) / Y.
    for pixel in pixels.iter_mut() {
        let [luminance, red, blue] = pixel.map(f64::from);
        let (red, blue) = ((red + 1.0) * luminance, (blue + 1.0) * luminance);
        *pixel = [red, (luminance - r * red - b * blue) / g, blue].map(|value| value as f32);
    }
    if sampling != Vec2(1, 1) {
        subsampled::fix_saturation(pixels, display.size.0, window, [r, g, b].map(|value| value as f32));
    }
}

/// Converts the values of a layer to R, G and B, and from the primaries of the file. They may be
/// coefficients, so that colours outside of Rec. 709 stay where they are.
fn to_rec_709(header: &Header, layer: &Layer, pixels: &mut [[f32; 3]], warnings: &mut Vec<String>) {
    to_rgb(header, layer, pixels);
    if layer.colour == Colour::Grey {
        return;
    }
    let Some((_, declared)) = declared(header, warnings) else { return };
    match declared.to_rec_709() {
        Some(matrix) => chromaticity::apply_linear(matrix, pixels),
        None => warnings.push(NO_SPACE.into()),
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

/// Checks all that the decoder would otherwise believe: sizes of the windows, of a tile, of the offset
/// tables.
fn check_size(headers: &[Header], header: &Header, len: usize) -> Result<(), Error> {
    let display = header.shared_attributes.display_window.size;
    limits::pixels(display.0, display.1).map_err(|error| error.within("display window"))?;
    for header in headers {
        // Each chunk has 8 bytes in the offset table and at least 8 of its own.
        limits::plausible(header.chunk_count.saturating_mul(16), len, 1)?;
    }
    let Vec2(width, height) = header.layer_size;
    let pixels = limits::pixels(width, height).map_err(|error| error.within("data window"))?;
    let at = header.own_attributes.layer_position;
    let shown = header.shared_attributes.display_window;
    let apart = |at: i32, size: usize, from: i32, shown: usize| {
        let (at, from) = (i64::from(at), i64::from(from));
        at >= from + shown as i64 || from >= at + size as i64
    };
    if apart(at.0, width, shown.position.0, display.0) || apart(at.1, height, shown.position.1, display.1) {
        return Err(Error::unsupported(format!(
            "the data window, {width} x {height} pixels at ({}, {}), lies outside the display window, {} x {} at ({}, {}): \
             nothing would be seen; set the display window to the data window",
            at.0, at.1, display.0, display.1, shown.position.0, shown.position.1
        )));
    }
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
    header.channels.bytes_per_pixel
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
    // A chunk that packing would not have made smaller is stored as it is.
    if dwa && compressed.len() != size.0 * size.1 * pixel_bytes(header) {
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

/// RGB of the display window of each of these layers of one part. `finish` changes some rows at a time.
fn read_pixels(
    bytes: &[u8],
    header: &Header,
    layers: &[&Layer],
    warnings: &mut Vec<String>,
    finish: impl Fn(&mut [[f32; 3]]) -> OutsideGamut + Sync,
    stop: Stop<'_>,
) -> Result<Vec<(Image, OutsideGamut)>, Error> {
    let part = layers[0].part;
    let (shown, samplings) = subsampled::shown(bytes);
    let (mut chunks, mut meta) = guarded(|| {
        let reader = exr::block::read(Cursor::new(&shown), false)?;
        let meta = reader.meta_data().clone();
        let largest = |_: &MetaData, _, block: BlockIndex| block.layer == part && block.level == Vec2(0, 0);
        Ok((reader.filter_chunks(false, largest)?, meta))
    })?;
    subsampled::restore(&mut meta.headers, &samplings)?;
    let without_chroma = subsampled::without_chroma(&mut meta);
    let windows: Vec<Window> = layers.iter().map(|layer| Window::new(header, layer)).collect();
    let mut writers: Option<Vec<BlockWriter>> = None;
    let mut is_transparent = false;
    if windows[0].partial {
        warnings.push(
            "the data window differs from the display window, which was read; what lies outside the data is black"
                .into(),
        );
    }
    let Vec2(width, height) = header.max_block_pixel_size();
    let least = rayon::current_num_threads().min(BATCH);
    let batch_size = (BATCH_PIXELS / (width * height).max(1)).clamp(least, BATCH);
    let mut seen = HashSet::new();
    // Memory of patches that were written, for those of the next batch.
    let spare = Mutex::new(Vec::new());
    loop {
        let batch: Vec<Chunk> = guarded(|| chunks.by_ref().take(batch_size).collect())?;
        if batch.is_empty() {
            break;
        }
        let decoded = batch.into_par_iter().map(|chunk| {
            stop.check().map_err(Error::stopped)?;
            let meta = match (&without_chroma, &chunk.compressed_block) {
                (Some(odd), CompressedBlock::ScanLine(block)) if block.y_coordinate % 2 != 0 => odd,
                _ => &meta,
            };
            check_chunk(&meta.headers[part], &chunk)?;
            let block = guarded(|| UncompressedBlock::decompress_chunk(chunk, meta, false))?;
            let memory = || spare.lock().ok().and_then(|mut spare| spare.pop()).unwrap_or_default();
            let patches = windows
                .iter()
                .zip(layers)
                .map(|(window, layer)| window.patch(header, layer, &block, memory()));
            Ok((block.index, patches.collect::<Result<Vec<_>, Error>>()?))
        });
        let decoded: Vec<Result<_, Error>> = decoded.collect();
        let mut of_layers: Vec<Vec<Patch>> = layers.iter().map(|_| Vec::new()).collect();
        for decoded in decoded {
            let (index, patches) = decoded?;
            if index.layer != part || index.level != Vec2(0, 0) || !seen.insert(index.pixel_position) {
                return Err(Error::damaged("the offset table names a wrong chunk"));
            }
            for (of_layer, (patch, transparent)) in of_layers.iter_mut().zip(patches) {
                of_layer.push(patch);
                is_transparent |= transparent;
            }
        }
        // Only now, when blocks have come out sound, is the header's size believed.
        let writers = writers.get_or_insert_with(|| windows.iter().map(Window::writer).collect());
        for (writer, patches) in writers.iter_mut().zip(of_layers) {
            writer.write(&patches, &finish);
            if let Ok(mut spare) = spare.lock() {
                spare.extend(patches.into_iter().map(|patch| patch.pixels));
            }
        }
    }
    if is_transparent {
        warnings.push("alpha was ignored; the colours are those over black".into());
    }
    let images = writers.unwrap_or_default().into_iter().map(|writer| {
        let image = writer.into_image(&finish);
        image.ok_or_else(|| Error::damaged("the pixels do not fill the display window"))
    });
    images.collect()
}
