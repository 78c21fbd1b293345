//! RGBD: four bytes for a colour up to 255, as Babylon.js has it, in PNG files that lie upside down.
//!
//! With D = floor(255 / max(1, the largest channel)), at most 255, a channel is the byte (value * D /
//! 255)^(1/2.2) and the alpha is D (Babylon.js helperFunctions.fx, toRGBD and fromRGBD).

use std::sync::LazyLock;

use rayon::prelude::*;

use super::texel::Packed;
use super::texture::Texture;
use crate::error::Error;
use crate::format::Format;
use crate::images::{png, webp};
use crate::rounding;

const GAMMA: f32 = 2.2;

/// What is known of the 256 codes of a channel.
struct Codes {
    /// The value that each stands for, of 1.
    values: [f32; 256],
    /// The least number that becomes each, or one above it.
    least: [f32; 256],
    /// The code of the least number with these upper 16 bits, counted from those of `least[1]`.
    by_upper_bits: Vec<u8>,
}

/// Powers are slow: each is taken once.
static CODES: LazyLock<Codes> = LazyLock::new(|| {
    let values = std::array::from_fn(|code| math::pow(code as f32 / 255.0, GAMMA));
    let least = std::array::from_fn(|code| {
        // What is about a code may have become it by the last bits of the root.
        let is_code = |value: f32| 255.0 * math::pow(value, 1.0 / GAMMA) >= code as f32;
        let mut least: f32 = values[code];
        while least > 0.0 && is_code(least.next_down()) {
            least = least.next_down();
        }
        least
    });
    let upper_bits = least[1].to_bits() >> 16..=1.0_f32.to_bits() >> 16;
    let code = |bits: u32| {
        let above = least.iter().position(|least| *least > f32::from_bits(bits << 16));
        (above.unwrap_or(256) - 1) as u8
    };
    Codes { values, least, by_upper_bits: upper_bits.map(code).collect() }
});

impl Codes {
    /// The highest code that stands for at most this number, from 0 to 1.
    fn below(&self, value: f32) -> u8 {
        if value < self.least[1] {
            return 0;
        }
        let at = (value.to_bits() >> 16) - (self.least[1].to_bits() >> 16);
        let mut code = self.by_upper_bits[at as usize];
        while code < u8::MAX && self.least[usize::from(code) + 1] <= value {
            code += 1;
        }
        code
    }
}

/// The codes that enclose a colour, and its divisor.
fn enclosing(texel: [f32; 3]) -> ([[u8; 2]; 3], u8) {
    // NaN is 0 by `max`.
    let texel = texel.map(|value| value.max(0.0));
    let largest = texel.iter().fold(1.0_f32, |a, b| a.max(*b));
    let divisor = (255.0 / largest).floor().max(1.0);
    let codes = |value: f32| {
        let code = CODES.below((value * divisor / 255.0).min(1.0));
        [code, code.saturating_add(1)]
    };
    (texel.map(codes), divisor as u8)
}

/// The value that a code stands for, of 1.
fn of_code(code: u8) -> f32 {
    CODES.values[usize::from(code)]
}

fn unpack([r, g, b, divisor]: [u8; 4]) -> [f32; 3] {
    [r, g, b].map(|code| of_code(code) * 255.0 / f32::from(divisor.max(1)))
}

/// The faces of all levels of cubes, one after the other.
pub(crate) fn write_faces<'a>(cubes: impl IntoIterator<Item = &'a Texture>) -> Result<Vec<Packed>, Error> {
    let mut faces = Vec::new();
    for cube in cubes {
        for (level, texels) in cube.levels().enumerate() {
            let [edge, ..] = cube.level_size(level);
            faces.extend(texels.chunks_exact(edge * edge).map(|face| (edge, face)));
        }
    }
    // One by one: the first six have most of the texels, and would be one thread's share.
    faces.into_par_iter().with_max_len(1).map(|(edge, texels)| write_face(edge, texels)).collect()
}

/// A face as a PNG, the last row first.
fn write_face(edge: usize, texels: &[[f32; 3]]) -> Result<Packed, Error> {
    let values = |texel: &[f32; 3]| {
        let (codes, divisor) = enclosing(*texel);
        let value = |code: u8| f64::from(of_code(code)) * 255.0 / f64::from(divisor);
        codes.map(|codes| codes.map(value))
    };
    let upper = rounding::upper(edge, edge, texels, values);
    let code = |(texel, upper): (&[f32; 3], &[bool; 3])| {
        let (codes, divisor) = enclosing(*texel);
        let [r, g, b] = [0, 1, 2].map(|channel| codes[channel][usize::from(upper[channel])]);
        [r, g, b, divisor]
    };
    let rows = texels.par_chunks_exact(edge).zip(upper.par_chunks_exact(edge)).rev();
    let codes: Vec<[u8; 4]> =
        rows.flat_map_iter(|(texels, upper)| texels.iter().zip(upper).map(code)).collect();
    let values = texels.as_flattened();
    Ok(Packed {
        bytes: png::write_rgba(edge, edge, &codes)?,
        negative: values.iter().filter(|value| **value < 0.0).count(),
    })
}

/// The texels of a face with this edge.
///
/// # Errors
/// If the bytes are no PNG or WebP with 8 bits for each of four channels, or three, whose D is 1 because an
/// encoder left an opaque alpha out; or if they have another size.
pub(crate) fn read_face(edge: usize, bytes: &[u8]) -> Result<Vec<[f32; 3]>, Error> {
    let raster = match Format::sniff(bytes) {
        Some(Format::Png) => png::raster(bytes)?,
        Some(Format::WebP) => webp::raster(bytes)?,
        _ => return Err(Error::unsupported("expected a PNG or a WebP, found other first bytes")),
    };
    if !matches!((raster.channels, raster.depth), (3 | 4, 1)) {
        return Err(Error::unsupported("expected an image of four channels of 8 bits, which RGBD is"));
    }
    if (raster.width, raster.height) != (edge, edge) {
        let (width, height) = (raster.width, raster.height);
        return Err(Error::damaged(format!("expected {edge} x {edge} pixels, found {width} x {height}")));
    }
    let rows = raster.samples.chunks_exact(raster.channels * edge).rev();
    let texel = |rgbd: &[u8]| unpack([rgbd[0], rgbd[1], rgbd[2], rgbd.get(3).copied().unwrap_or(u8::MAX)]);
    Ok(rows.flat_map(|row| row.chunks_exact(raster.channels).map(texel)).collect())
}

#[cfg(test)]
mod tests {
    use ::image::codecs::png::PngEncoder;
    use ::image::{ExtendedColorType, ImageEncoder};

    use super::*;

    #[test]
    fn a_colour_is_within_two_percent_and_ends_at_255() {
        let through = |texel| read_face(1, &write_face(1, &[texel]).unwrap().bytes).unwrap()[0];
        for step in 0..2000 {
            let value = 0.05 * 1.004_f32.powi(step);
            let [found, ..] = through([value, 0.5 * value, 0.0]);
            let expected = value.min(255.0);
            assert!((found / expected - 1.0).abs() < 0.02, "{value}: {found}");
        }
        assert_eq!(through([1e6, -1.0, f32::NAN]), [255.0, 0.0, 0.0]);
    }

    /// The table of codes against the power, at numbers about each code and between.
    #[test]
    fn a_code_is_the_root_rounded_down() {
        for code in 0..=u8::MAX {
            let value = of_code(code);
            for step in -40..=40 {
                let number = match step {
                    -30..=30 => f32::from_bits(value.to_bits().saturating_add_signed(step)),
                    _ => value * (1.0 + step as f32 / 8000.0),
                };
                if (0.0..=1.0).contains(&number) {
                    let root = (255.0 * math::pow(number, 1.0 / GAMMA)) as u8;
                    let above = root < u8::MAX && of_code(root + 1) <= number;
                    assert_eq!(CODES.below(number), root + u8::from(above), "{number}");
                }
            }
        }
        assert_eq!([-0.0, 0.0, 1e-30, 1.0].map(|number| CODES.below(number)), [0, 0, 0, 255]);
    }

    #[test]
    fn a_face_lies_upside_down() {
        let texels = [[0.0; 3], [0.0; 3], [1.0; 3], [1.0; 3]];
        let bytes = write_face(2, &texels).unwrap().bytes;
        let raster = png::raster(&bytes).unwrap();
        assert_eq!(raster.samples[..4], [255, 255, 255, 255]);
        assert_eq!(read_face(2, &bytes).unwrap(), texels);
        assert!(read_face(4, &bytes).unwrap_err().to_string().contains("expected 4 x 4 pixels"));
        // Where D is 1 everywhere, an encoder may leave the alpha out.
        let mut opaque = Vec::new();
        let rgb = [255_u8, 255, 255, 255, 255, 255, 0, 0, 0, 0, 0, 0];
        PngEncoder::new(&mut opaque).write_image(&rgb, 2, 2, ExtendedColorType::Rgb8).unwrap();
        assert_eq!(read_face(2, &opaque).unwrap(), texels);
    }
}
