//! Writing OpenEXR: one part of R, G and B, scanlines in blocks of 16, ZIP (lossless), Rec. 709 by absence of
//! `chromaticities`.

use std::io::Cursor;

use envmap::Image;
use exr::block::chunk::Chunk;
use exr::block::writer::ChunksWriter;
use exr::block::{BlockIndex, UncompressedBlock, enumerate_ordered_header_block_indices};
use exr::compression::Compression;
use exr::meta::attribute::{AttributeValue, ChannelDescription, LineOrder, SampleType};
use exr::meta::header::Header;
use exr::meta::{BlockDescription, Headers};
use half::f16;
use rayon::prelude::*;

use super::{guarded, recipe_key, text};
use crate::error::Error;
use crate::image::Encoded;
use crate::{Format, recipe};

/// The samples of a written OpenEXR file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Precision {
    /// 32 bits: every value is kept.
    #[default]
    Float,
    /// 16 bits: 11 significant bits, at most 65504.
    Half,
}

/// The largest half.
const HALF_MAX: f32 = 65504.0;

/// Writes OpenEXR; `recipe` goes into a `string` attribute.
///
/// With [`Precision::Half`] each value becomes the nearest half, ties to even; values past +-65504, infinite ones
/// among them, become +-65504 and are counted. NaN stays NaN.
///
/// # Errors
/// Where the recipe holds control characters.
pub fn write_exr(image: &Image, precision: Precision, recipe: Option<&str>) -> Result<Encoded, Error> {
    write(image, precision, recipe).map_err(|error| error.within(Format::OpenExr.name()))
}

fn write(image: &Image, precision: Precision, recipe: Option<&str>) -> Result<Encoded, Error> {
    recipe::check(recipe)?;
    let sample_type = match precision {
        Precision::Float => SampleType::F32,
        Precision::Half => SampleType::F16,
    };
    // Channels stand in the order of their names.
    let channels = ["B", "G", "R"].map(|name| ChannelDescription::named(name, sample_type));
    let mut header = Header::new(text(""), (image.width(), image.height()), channels.into_iter().collect())
        .with_encoding(Compression::ZIP16, BlockDescription::ScanLines, LineOrder::Increasing);
    header.own_attributes.layer_name = None;
    if let Some(recipe) = recipe {
        header.own_attributes.other.insert(recipe_key(), AttributeValue::Text(text(recipe)));
    }
    let headers: Headers = [header].into_iter().collect();

    let blocks: Vec<(usize, BlockIndex)> = enumerate_ordered_header_block_indices(&headers).collect();
    let compress = |(position, index)| -> Result<(usize, Chunk, usize), Error> {
        let (data, clamped) = samples(image, index, precision);
        let chunk = guarded(|| UncompressedBlock { index, data }.compress_to_chunk(&headers))?;
        Ok((position, chunk, clamped))
    };
    let chunks: Vec<(usize, Chunk, usize)> =
        blocks.into_par_iter().map(compress).collect::<Result<_, _>>()?;
    let clamped = chunks.iter().map(|(_, _, clamped)| clamped).sum();
    let mut bytes = Vec::new();
    guarded(|| {
        exr::block::write(Cursor::new(&mut bytes), headers, false, |_, writer| {
            chunks.into_iter().try_for_each(|(position, chunk, _)| writer.write_chunk(position, chunk))
        })
    })?;
    Ok(Encoded { bytes, clamped })
}

/// A block's samples in the order of this machine's bytes, each row channel after channel, and how many were clamped.
fn samples(image: &Image, index: BlockIndex, precision: Precision) -> (Vec<u8>, usize) {
    let mut data = Vec::new();
    let mut clamped = 0;
    let (x, y) = (index.pixel_position.0, index.pixel_position.1);
    for row in y..y + index.pixel_size.1 {
        let line = &image.pixels()[row * image.width()..][x..x + index.pixel_size.0];
        for channel in [2, 1, 0] {
            for pixel in line {
                let value = pixel[channel];
                match precision {
                    Precision::Float => data.extend_from_slice(&value.to_ne_bytes()),
                    Precision::Half => {
                        clamped += usize::from(value.abs() > HALF_MAX);
                        let kept = f16::from_f32(value.clamp(-HALF_MAX, HALF_MAX));
                        data.extend_from_slice(&kept.to_ne_bytes());
                    }
                }
            }
        }
    }
    (data, clamped)
}
