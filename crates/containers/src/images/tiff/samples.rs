//! From the samples of a TIFF's page to a raster's: pixel by pixel, in 8 or 16 bits or as f32.

use ::tiff::decoder::DecodingResult;

use super::page::{Page, Photometric};
use crate::error::Error;

/// Channels, bytes of a sample, and the samples.
type Samples = (usize, usize, Vec<u8>);

impl Page {
    /// Bytes of a sample, and the samples, of what was decoded of the page or of one of its planes.
    pub(super) fn native(&self, mut stored: DecodingResult) -> Result<(usize, Vec<u8>), Error> {
        if self.bits < 8 {
            stored = DecodingResult::U8(self.expand(stored.as_buffer(0).as_bytes()));
        }
        Ok(match stored {
            DecodingResult::U8(samples) => (1, samples),
            DecodingResult::U16(samples) => (2, bytes(&samples, |value| value.to_ne_bytes())),
            DecodingResult::U32(samples) => (4, normalised(&samples, |value| value.into(), u32::MAX.into())),
            DecodingResult::U64(samples) => (4, normalised(&samples, |value| value as f64, u64::MAX as f64)),
            DecodingResult::F16(samples) => (4, bytes(&samples, |value| value.to_f32().to_ne_bytes())),
            DecodingResult::F32(samples) => (4, bytes(&samples, |value| value.to_ne_bytes())),
            DecodingResult::F64(samples) => (4, bytes(&samples, |value| (value as f32).to_ne_bytes())),
            _ => return Err(Error::unsupported("signed integers are not read")),
        })
    }

    /// How many of the first samples of a pixel are its colour and its alpha; others are left out.
    pub(super) fn channels(&self) -> usize {
        let colours = match self.photometric {
            // Files of three or more samples that call themselves grey are RGB without the word.
            Photometric::BlackIsZero if self.samples >= 3 => 3,
            _ => self.colours(),
        };
        colours + usize::from(self.alpha && self.samples > colours)
    }

    /// The samples of a raster out of those that are stored: of all samples, or of the planes of
    /// [`Page::channels`], one after the other.
    pub(super) fn arrange(
        &self,
        depth: usize,
        samples: Vec<u8>,
        palette: Option<Vec<u16>>,
    ) -> Result<Samples, Error> {
        let channels = self.channels();
        let samples = self.interleave(samples, depth, channels);
        Ok(match self.photometric {
            Photometric::BlackIsZero | Photometric::Rgb => (channels, depth, samples),
            Photometric::WhiteIsZero => (channels, depth, inverted(samples, channels, depth)),
            Photometric::Palette => (3, 1, coloured(&samples, channels, &palette.unwrap_or_default())?),
            Photometric::Cmyk => (3, depth, each_pixel(&samples, channels, depth, without_black)),
            Photometric::YCbCr => (3, depth, each_pixel(&samples, channels, depth, from_luma)),
        })
    }

    /// Codes of less than 8 bits as bytes: a palette's as they are, others stretched to 255.
    fn expand(&self, stored: &[u8]) -> Vec<u8> {
        let in_row = if self.planar { self.width } else { self.width * self.samples };
        let most = (1_u8 << self.bits) - 1;
        let scale = if self.photometric == Photometric::Palette { 1 } else { u8::MAX / most };
        let rows = stored.chunks_exact(self.row_bytes(self.width).max(1));
        let code = |row: &[u8], index: usize| {
            let bit = index * self.bits;
            row[bit / 8] >> (8 - self.bits - bit % 8) & most
        };
        rows.flat_map(|row| (0..in_row).map(move |index| code(row, index) * scale)).collect()
    }

    /// The first `channels` samples of each pixel.
    fn interleave(&self, stored: Vec<u8>, depth: usize, channels: usize) -> Vec<u8> {
        if !self.planar && channels == self.samples {
            return stored;
        }
        let count = self.width * self.height;
        let mut samples = Vec::with_capacity(count * channels * depth);
        for pixel in 0..count {
            for channel in 0..channels {
                let at = if self.planar { channel * count + pixel } else { pixel * self.samples + channel };
                samples.extend_from_slice(&stored[at * depth..][..depth]);
            }
        }
        samples
    }
}

fn bytes<T: Copy, const N: usize>(values: &[T], each: impl Fn(T) -> [u8; N]) -> Vec<u8> {
    values.iter().flat_map(|value| each(*value)).collect()
}

/// Integers as f32 from 0 to 1.
fn normalised<T: Copy>(values: &[T], each: impl Fn(T) -> f64, most: f64) -> Vec<u8> {
    bytes(values, |value| ((each(value) / most) as f32).to_ne_bytes())
}

fn number(sample: &[u8]) -> f32 {
    match *sample {
        [code] => f32::from(code) / 255.0,
        [a, b] => f32::from(u16::from_ne_bytes([a, b])) / 65535.0,
        [a, b, c, d] => f32::from_ne_bytes([a, b, c, d]),
        _ => 0.0,
    }
}

fn put(samples: &mut Vec<u8>, depth: usize, value: f32) {
    match depth {
        1 => samples.push((value * 255.0).round() as u8),
        2 => samples.extend(((value * 65535.0).round() as u16).to_ne_bytes()),
        _ => samples.extend(value.to_ne_bytes()),
    }
}

/// Grey whose 0 is white; alpha stays.
fn inverted(samples: Vec<u8>, channels: usize, depth: usize) -> Vec<u8> {
    let mut inverted = Vec::with_capacity(samples.len());
    for (index, sample) in samples.chunks_exact(depth).enumerate() {
        let value = number(sample);
        put(&mut inverted, depth, if index % channels == 0 { 1.0 - value } else { value });
    }
    inverted
}

/// The colours of a palette's codes, by the high bytes: writers differ in the low ones. Old palettes are of
/// bytes.
fn coloured(codes: &[u8], channels: usize, palette: &[u16]) -> Result<Vec<u8>, Error> {
    let count = palette.len() / 3;
    let shift = if palette.iter().any(|value| *value > 0xff) { 8 } else { 0 };
    let mut samples = Vec::with_capacity(codes.len() / channels * 3);
    for pixel in codes.chunks_exact(channels) {
        let code = usize::from(pixel[0]);
        if code >= count {
            return Err(Error::damaged(format!("code {code} is not in the palette of {count} colours")));
        }
        samples.extend([0, 1, 2].iter().map(|channel| (palette[channel * count + code] >> shift) as u8));
    }
    Ok(samples)
}

/// RGB of pixels in other colours.
fn each_pixel(samples: &[u8], channels: usize, depth: usize, colour: fn([f32; 4]) -> [f32; 3]) -> Vec<u8> {
    let mut rgb = Vec::with_capacity(samples.len() / channels * 3);
    for pixel in samples.chunks_exact(channels * depth) {
        let mut values = [0.0; 4];
        values.iter_mut().zip(pixel.chunks_exact(depth)).for_each(|(value, sample)| *value = number(sample));
        colour(values).into_iter().for_each(|value| put(&mut rgb, depth, value.clamp(0.0, 1.0)));
    }
    rgb
}

/// Inks without a profile: each takes its colour away, and black takes all.
fn without_black([cyan, magenta, yellow, black]: [f32; 4]) -> [f32; 3] {
    [cyan, magenta, yellow].map(|ink| (1.0 - ink) * (1.0 - black))
}

/// ITU-R BT.601 as JFIF uses it: full range, chroma around a half.
fn from_luma([luma, blue, red, _]: [f32; 4]) -> [f32; 3] {
    let (blue, red) = (blue - 128.0 / 255.0, red - 128.0 / 255.0);
    [luma + 1.402 * red, luma - 0.344_136 * blue - 0.714_136 * red, luma + 1.772 * blue]
}
