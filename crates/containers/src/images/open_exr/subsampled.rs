//! Luminance and chroma as OpenEXR's `RgbaOutputFile` writes them with `WRITE_YC`: a value of RY and BY for
//! each 2 x 2 of Y.
//!
//! The decoder refuses headers with subsampled channels, though most of its compressions know them. So it is
//! shown a header without them, and gets their sampling back before it unpacks a chunk.
//!
//! The chroma between two samples is that of OpenEXR's filter of 27 places, and colours that it makes too
//! saturated are drawn toward their neighbours' saturation (`ImfRgbaYca.cpp`: `reconstructChromaHoriz`,
//! `reconstructChromaVert`, `fixSaturation`). OpenEXR rounds to halves in between, which is not repeated
//! here.

use std::borrow::Cow;

use exr::compression::Compression;
use exr::math::Vec2;
use exr::meta::MetaData;
use exr::meta::header::Header;

use super::layer::{Colour, Layer};
use crate::error::Error;

/// The sampling of each channel of each part, in the file's order.
pub(super) type Samplings = Vec<Vec<[usize; 2]>>;

/// The beginning of the attribute `channels`.
const CHANNELS: &[u8] = b"channels\0chlist\0";

/// The most that the headers of a file have.
pub(super) const MOST_HEADER: u64 = 1 << 16;

/// The file with every channel sampled at each pixel by its header, and the samplings that it has.
pub(super) fn shown(bytes: &[u8]) -> (Cow<'_, [u8]>, Samplings) {
    let mut shown = Cow::Borrowed(bytes);
    let mut samplings = Vec::new();
    let header = &bytes[..bytes.len().min(MOST_HEADER as usize)];
    let mut from = 0;
    while let Some(at) = header[from..].windows(CHANNELS.len()).position(|window| window == CHANNELS) {
        // A size follows.
        from += at + CHANNELS.len() + 4;
        let Some((part, after)) = places(header, from) else { break };
        let is_sampled = |place: &usize| header[*place..*place + 8] != [1, 0, 0, 0, 1, 0, 0, 0];
        let word =
            |at: usize| u32::from_le_bytes([header[at], header[at + 1], header[at + 2], header[at + 3]]);
        samplings.push(part.iter().map(|&at| [word(at), word(at + 4)].map(|value| value as usize)).collect());
        for place in part.into_iter().filter(is_sampled) {
            shown.to_mut()[place..place + 8].copy_from_slice(&[1, 0, 0, 0, 1, 0, 0, 0]);
        }
        from = after;
    }
    (shown, samplings)
}

/// Where the samplings of a list of channels are, and its end.
fn places(header: &[u8], mut at: usize) -> Option<(Vec<usize>, usize)> {
    let mut places = Vec::new();
    loop {
        let name = header.get(at..)?.iter().position(|byte| *byte == 0)?;
        at += name + 1;
        if name == 0 {
            return Some((places, at));
        }
        // The type and whether it is linear come before the two numbers.
        places.push(at + 8);
        at += 16;
        header.get(..at)?;
    }
}

/// Gives the channels of headers the samplings that the file declares.
///
/// # Errors
/// If a chunk with these samplings is not read.
pub(super) fn restore(headers: &mut [Header], samplings: &Samplings) -> Result<(), Error> {
    for (header, samplings) in headers.iter_mut().zip(samplings) {
        if samplings.iter().all(|sampling| *sampling == [1, 1]) {
            continue;
        }
        if samplings.len() != header.channels.list.len() {
            return Err(Error::damaged("the header declares its channels twice"));
        }
        let at = header.own_attributes.layer_position;
        let Vec2(width, height) = header.layer_size;
        let mut quarters = 0;
        for (channel, &[x, y]) in header.channels.list.iter_mut().zip(samplings) {
            let divides = |factor: usize, at: i32, size: usize| {
                [1, 2].contains(&factor) && at % factor as i32 == 0 && size.is_multiple_of(factor)
            };
            if !divides(x, at.0, width) || !divides(y, at.1, height) {
                return Err(Error::unsupported(format!(
                    "channel {} is sampled {x} x {y} in a data window of {width} x {height} pixels at ({}, {}); \
                     expected 1 or 2 that divide them, or convert the image to RGB",
                    channel.name, at.0, at.1
                )));
            }
            channel.sampling = Vec2(x, y);
            quarters += 4 / (x * y) * channel.sample_type.bytes_per_sample();
        }
        let reads = !matches!(header.compression, Compression::B44 | Compression::B44A | Compression::PXR24);
        if !reads || !quarters.is_multiple_of(4) || header.deep {
            return Err(Error::unsupported(format!(
                "subsampled channels with {} are not read; save the image with ZIP or PIZ, or as RGB",
                header.compression
            )));
        }
        // By this number the decoder finds how many bytes a chunk has.
        header.channels.bytes_per_pixel = quarters / 4;
    }
    Ok(())
}

/// The headers by which the decoder reads chunks that are an odd row alone, which has no chroma; `None` if
/// there are none. The headers in `meta` are those that [`restore`] made, and become those of even rows.
pub(super) fn without_chroma(meta: &mut MetaData) -> Option<MetaData> {
    let is_row = |header: &Header| {
        header.compression.scan_lines_per_block() == 1
            && header.channels.list.iter().any(|channel| channel.sampling.1 != 1)
    };
    if !meta.headers.iter().any(is_row) {
        return None;
    }
    let mut odd = meta.clone();
    for (headers, rows) in [(&mut meta.headers, [1, 2]), (&mut odd.headers, [1, 1])] {
        for header in headers.iter_mut().filter(|header| is_row(header)) {
            let channels = header.channels.list.iter().filter(|channel| rows.contains(&channel.sampling.1));
            header.channels.bytes_per_pixel =
                channels.map(|channel| channel.sample_type.bytes_per_sample() / channel.sampling.0).sum();
        }
    }
    Some(odd)
}

/// Whether the channels of a layer are sampled as its colour can be.
///
/// # Errors
/// If others than RY and BY are subsampled, or these differently.
pub(super) fn check(header: &Header, layer: &Layer) -> Result<(), Error> {
    let sampling = |channel: usize| header.channels.list[layer.channels[channel]].sampling;
    let is_chroma = layer.colour == Colour::LuminanceChroma;
    let subsampled = (0..3).find(|&channel| sampling(channel) != Vec2(1, 1) && (channel == 0 || !is_chroma));
    match subsampled {
        Some(channel) => Err(Error::unsupported(format!(
            "channel {} is subsampled, which is read of the chroma RY and BY only; convert the image to RGB",
            header.channels.list[layer.channels[channel]].name
        ))),
        None if is_chroma && sampling(1) != sampling(2) => {
            Err(Error::unsupported("RY and BY are sampled differently, which is not read"))
        }
        None => Ok(()),
    }
}

/// A row or column, and the chroma samples nearest to it before and after: a line of them with a period of 2.
struct Line {
    /// The first place that has a sample, and the last.
    ends: [i64; 2],
}

impl Line {
    /// The line of the places from `from` to before `to` that `origin` makes even; `None` if there are none.
    fn new(from: i64, to: i64, origin: i64) -> Option<Self> {
        let first = from + (from + origin).rem_euclid(2);
        let last = to - 1 - (to - 1 + origin).rem_euclid(2);
        (first <= last).then_some(Self { ends: [first, last] })
    }

    /// The value between two samples, by OpenEXR's filter; past an end the sample there is repeated.
    fn between(&self, at: i64, sample: impl Fn(i64) -> f32) -> f32 {
        const FILTER: [f32; 7] =
            [0.627_123, -0.186_077, 0.087_929, -0.043_159, 0.019_597, -0.007_54, 0.002_128];
        let [first, last] = self.ends;
        let sample = |at: i64| sample(at.clamp(first, last));
        (1_i64..)
            .step_by(2)
            .zip(FILTER)
            .map(|(off, weight)| weight * (sample(at - off) + sample(at + off)))
            .sum()
    }
}

/// Fills in the chroma of pixels of Y, RY and BY, of which only each second row or column has a sample.
///
/// `window` is the rectangle of the data in the picture of `width` columns, its first column and row and
/// those past its last; `origin` is the pixel of the picture's corner.
pub(super) fn fill(
    pixels: &mut [[f32; 3]],
    width: usize,
    [left, top, right, bottom]: [i64; 4],
    origin: [i64; 2],
    sampling: Vec2<usize>,
) {
    let at = |x: i64, y: i64| y as usize * width + x as usize;
    let has_sample = |at: i64, origin: i64, factor: usize| factor == 1 || (at + origin).rem_euclid(2) == 0;
    if let (2, Some(line)) = (sampling.0, Line::new(left, right, origin[0])) {
        for y in (top..bottom).filter(|&y| has_sample(y, origin[1], sampling.1)) {
            for x in (left..right).filter(|&x| !has_sample(x, origin[0], 2)) {
                for channel in [1, 2] {
                    pixels[at(x, y)][channel] = line.between(x, |x| pixels[at(x, y)][channel]);
                }
            }
        }
    }
    if let (2, Some(line)) = (sampling.1, Line::new(top, bottom, origin[1])) {
        for y in (top..bottom).filter(|&y| !has_sample(y, origin[1], 2)) {
            for (x, channel) in (left..right).flat_map(|x| [(x, 1), (x, 2)]) {
                pixels[at(x, y)][channel] = line.between(y, |y| pixels[at(x, y)][channel]);
            }
        }
    }
}

fn saturation(pixel: [f32; 3]) -> f32 {
    let [least, most] = extent(pixel);
    if most > 0.0 { 1.0 - least / most } else { 0.0 }
}

fn extent([r, g, b]: [f32; 3]) -> [f32; 2] {
    [r.min(g).min(b), r.max(g).max(b)]
}

/// Draws colours that are far more saturated than the four pixels at their corners toward the grey of the
/// same luminance, of which `weights` are those of R, G and B.
pub(super) fn fix_saturation(
    pixels: &mut [[f32; 3]],
    width: usize,
    [left, top, right, bottom]: [i64; 4],
    weights: [f32; 3],
) {
    let rows: Vec<Vec<f32>> = (top..bottom)
        .map(|y| {
            let row = &pixels[y as usize * width..][left as usize..right as usize];
            row.iter().map(|pixel| saturation(*pixel)).collect()
        })
        .collect();
    let luminance =
        |pixel: [f32; 3]| -> f32 { pixel.iter().zip(weights).map(|(value, weight)| value * weight).sum() };
    for (y, row) in rows.iter().enumerate() {
        // OpenEXR repeats the last row that has chroma below the last.
        let below = if y + 1 < rows.len() { y + 1 } else { y.saturating_sub(1) };
        let around = [&rows[y.saturating_sub(1)], &rows[below]];
        for (x, &found) in row.iter().enumerate() {
            let columns = [x.saturating_sub(1), (x + 1).min(row.len() - 1)];
            let sum: f32 = around.iter().flat_map(|row| columns.map(|x| row[x])).sum();
            let mean = (0.25 * sum).min(1.0);
            let most = (1.0 - (1.0 - mean) * 0.25).min(1.0);
            // A saturation below the mean is below the most, too.
            if found <= most {
                continue;
            }
            let pixel = &mut pixels[(top as usize + y) * width + left as usize + x];
            let [_, largest] = extent(*pixel);
            let drawn = pixel.map(|value| (largest - (largest - value) * most / found).max(0.0));
            let (before, after) = (luminance(*pixel), luminance(drawn));
            *pixel = if after > 0.0 { drawn.map(|value| value * before / after) } else { drawn };
        }
    }
}
