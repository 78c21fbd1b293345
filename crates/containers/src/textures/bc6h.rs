//! BC6H, unsigned: a block of 4 x 4 texels in 16 bytes (Direct3D 11 functional specification, section
//! 19.5.14).
//!
//! A block is two colours and, for each texel, one of 16 places on the line between them; or four colours,
//! and each texel is on one of two lines with 8 places, as one of 32 partitions says. All numbers are the
//! bits of halves, taken as integers: 1024 of them are a factor of 2, so the line is about straight in
//! logarithms. The search makes the sum of squared differences of these integers over texels and channels
//! small, which is an error in logarithms therefore. Below 2^-14 halves have steps of one size, which is the
//! floor of these logarithms.
//!
//! All fourteen modes are written. Blocks that are read may have any mode.

mod block;
mod line;
mod partitions;
mod search;

use half::f16;
use pulp::{Simd, WithSimd};
use rayon::prelude::*;
use sh::f64x4::SimdLevel;

pub(crate) use self::block::EDGE;
use self::block::{BYTES, Colours, TEXELS, TexelSet, WHOLE};
use self::line::{EVEN, Lane};
use self::search::WantedLight;
use crate::precision::to_half;

/// Rows of blocks that are written one after the other.
const STRIP: usize = 16;

/// How much the square of a texel at the border of an image counts. The faces of a cube meet there, and the
/// ends of a panorama, and blocks do not know of those beyond.
const BORDER_WEIGHT: f32 = 2.0;

/// Images of some size, which lie one after the other.
struct Images<'a> {
    width: usize,
    height: usize,
    texels: &'a [[f32; 3]],
}

impl Images<'_> {
    fn count(&self) -> usize {
        self.texels.len() / (self.width * self.height).max(1)
    }

    /// The columns and rows of an image's blocks.
    fn blocks(&self) -> (usize, usize) {
        (self.width.div_ceil(EDGE), self.height.div_ceil(EDGE))
    }

    /// The colours of a block, which past the edge are those of its texels.
    fn block(&self, image: usize, row: usize, column: usize) -> Colours {
        std::array::from_fn(|texel| {
            let y = (EDGE * row + texel / EDGE).min(self.height - 1);
            let x = (EDGE * column + texel % EDGE).min(self.width - 1);
            let colour = self.texels[(image * self.height + y) * self.width + x];
            // NaN is 0 by `max`.
            colour.map(|value| i32::from(to_half(value.max(0.0)).to_bits()))
        })
    }

    /// The texels of a block that are not past the edge.
    fn inside(&self, row: usize, column: usize) -> TexelSet {
        let is_inside = |texel: &usize| {
            EDGE * row + texel / EDGE < self.height && EDGE * column + texel % EDGE < self.width
        };
        (0..TEXELS).filter(is_inside).fold(0, |set, texel| set | 1 << texel)
    }

    /// How much each texel of a block counts. In images of one block a side nearly all are at the border.
    fn weights(&self, row: usize, column: usize) -> Lane {
        if self.width.min(self.height) < 2 * EDGE {
            return EVEN;
        }
        std::array::from_fn(|texel| {
            let (y, x) = (EDGE * row + texel / EDGE, EDGE * column + texel % EDGE);
            let is_border = y == 0 || x == 0 || y + 1 >= self.height || x + 1 >= self.width;
            if is_border { BORDER_WEIGHT } else { 1.0 }
        })
    }
}

/// Images of `width` x `height` texels, whose texels are as near as blocks allow, in logarithms.
pub(crate) fn encode_nearest(width: usize, height: usize, texels: &[[f32; 3]]) -> Vec<u8> {
    encode_images(&Images { width, height, texels }, false)
}

/// Images of `width` x `height` texels, which keep their light, with less error at their borders. Blocks past
/// the edge repeat its texels.
pub(crate) fn encode(width: usize, height: usize, texels: &[[f32; 3]]) -> Vec<u8> {
    encode_images(&Images { width, height, texels }, true)
}

fn encode_images(images: &Images, keeps_light: bool) -> Vec<u8> {
    let rows = images.blocks().1;
    let level = SimdLevel::detect();
    let strips: Vec<(usize, usize)> =
        (0..images.count()).flat_map(|image| (0..rows).step_by(STRIP).map(move |row| (image, row))).collect();
    let strip = |(image, first)| level.run(Strip { images, image, first, keeps_light });
    strips.into_par_iter().flat_map_iter(strip).collect()
}

/// Rows of blocks of an image, from a first one on.
struct Strip<'a> {
    images: &'a Images<'a>,
    image: usize,
    first: usize,
    keeps_light: bool,
}

impl WithSimd for Strip<'_> {
    type Output = Vec<u8>;

    /// What a block loses of the light the next one makes up for, to the right in one row and to the left in
    /// the next, by strips of a height that does not depend on the machine.
    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Vec<u8> {
        let Strip { images, image, first, keeps_light } = self;
        let (columns, rows) = images.blocks();
        let mut owed = [0.0; 3];
        let mut bytes = Vec::new();
        for row in first..rows.min(first + STRIP) {
            let mut blocks = vec![[0; BYTES]; columns];
            for step in 0..columns {
                let column = if row % 2 == 0 { step } else { columns - 1 - step };
                let colours = images.block(image, row, column);
                let (texels, weights, wanted) = if keeps_light {
                    (WHOLE, images.weights(row, column), Some(wanted(&colours, owed)))
                } else {
                    (images.inside(row, column), EVEN, None)
                };
                let found = search::encode(&colours, texels, &weights, wanted.map(|(_, wanted)| wanted));
                blocks[column] = found.bytes;
                if let Some((light, _)) = wanted {
                    owed = [0, 1, 2].map(|c: usize| owed[c] + light[c] - found.light[c]);
                }
            }
            bytes.extend(blocks.into_flattened());
        }
        bytes
    }
}

/// The most of its own light that a block makes up for those before it.
const MOST_OWED: f32 = 0.02;

/// The light of a block, and that with what those before it owe.
#[inline(always)]
fn wanted(colours: &Colours, owed: [f32; 3]) -> ([f32; 3], WantedLight) {
    let mut light = [0.0; 3];
    for colour in colours {
        for channel in 0..3 {
            light[channel] += line::of_half(colour[channel]);
        }
    }
    let wanted = [0, 1, 2].map(|channel: usize| {
        let most = MOST_OWED * light[channel];
        light[channel] + owed[channel].max(-most).min(most)
    });
    (light, WantedLight(wanted))
}

/// The colours of images of `width` x `height` texels, unsigned or signed.
pub(crate) fn decode(width: usize, height: usize, bytes: &[u8], is_signed: bool) -> Vec<[f32; 3]> {
    let (columns, rows) = (width.div_ceil(EDGE), height.div_ceil(EDGE));
    let images = bytes.len() / (columns * rows * BYTES).max(1);
    let mut texels = vec![[0.0; 3]; images * width * height];
    let strips =
        texels.par_chunks_mut((width * height).max(1)).zip(bytes.par_chunks_exact(columns * rows * BYTES));
    strips.for_each(|(texels, blocks)| {
        for (index, block) in blocks.chunks_exact(BYTES).enumerate() {
            let mut colours = [0_u16; 3 * TEXELS];
            bcdec_rs::bc6h_half(block, &mut colours, 3 * EDGE, is_signed);
            let (top, left) = (index / columns * EDGE, index % columns * EDGE);
            for y in 0..EDGE.min(height - top) {
                for x in 0..EDGE.min(width - left) {
                    let colour = &colours[3 * (EDGE * y + x)..];
                    let value = |channel: usize| f16::from_bits(colour[channel]).to_f32();
                    texels[(top + y) * width + left + x] = [value(0), value(1), value(2)];
                }
            }
        }
    });
    texels
}

#[cfg(test)]
mod tests {
    use super::block::{between, unquantise};
    use super::*;

    /// Random ends and indices in every mode that stores one line.
    #[test]
    fn a_decoder_reads_every_mode_with_one_line() {
        for (number, mode) in block::ONE_LINE.iter().enumerate() {
            for seed in 0..1000 {
                let random = |k: usize| {
                    let seed = (number * 1000 + seed) * 64 + k;
                    ((seed as u32).wrapping_mul(2_654_435_761) >> 8) as i32
                };
                let first: [i32; 3] = std::array::from_fn(|channel| random(channel) % (1 << mode.bits));
                let other: [i32; 3] = std::array::from_fn(|channel| {
                    let reach = 1 << (mode.others[channel] - 1);
                    let value = first[channel] + random(3 + channel) % (2 * reach) - reach;
                    value.clamp(0, (1 << mode.bits) - 1)
                });
                let index = |texel: usize| random(20 + texel) as usize % if texel == 0 { 8 } else { 16 };
                let indices: [usize; TEXELS] = std::array::from_fn(index);
                assert!(mode.stores(&[first, other]));
                let mut found = [0_u16; 3 * TEXELS];
                bcdec_rs::bc6h_half(&mode.store(&[first, other], 0, &indices), &mut found, 3 * EDGE, false);
                for texel in 0..TEXELS {
                    let place = mode.places()[indices[texel]];
                    for channel in 0..3 {
                        let ends = [first, other].map(|end| unquantise(end[channel], mode.bits));
                        let found = i32::from(found[3 * texel + channel]);
                        assert_eq!(found, between(ends, place), "mode {number}, seed {seed}, texel {texel}");
                    }
                }
            }
        }
    }

    /// Random blocks: colours on one line or two, from nearly equal ones to those of all halves.
    fn random_blocks(count: usize) -> Vec<Colours> {
        let block = |seed: usize| -> Colours {
            let random = |k: usize| {
                let mut mixed = (seed * 64 + k) as u32;
                for factor in [0x7feb_352d, 0x846c_a68b] {
                    mixed = (mixed ^ mixed >> 16).wrapping_mul(factor);
                }
                f64::from(mixed >> 8) / f64::from(1 << 24)
            };
            let widths = [3.0, 30.0, 100.0, 400.0, 2000.0, 12_000.0];
            let (near, far) = (widths[seed % 6], widths[seed / 6 % 6]);
            let second = block::PARTITIONS[seed / 36 % 32].second;
            let other = !seed.is_multiple_of(7);
            std::array::from_fn(|texel| {
                let part = usize::from(other && block::contains(second, texel));
                let along = random(40 + texel);
                std::array::from_fn(|channel| {
                    let base = 30_000.0 * random(channel) + part as f64 * far * (random(3 + channel) - 0.5);
                    let line = near * along * (random(6 + 3 * part + channel) - 0.5);
                    (base + line + 2.0 * random(50 + channel + 3 * (texel % 4))).clamp(0.0, 31_743.0) as i32
                })
            })
        };
        (0..count).map(block).collect()
    }

    /// An independent decoder finds the texels as near as the encoder thought, in every mode.
    #[test]
    fn every_mode_is_chosen_where_it_is_nearest() {
        let modes: Vec<&block::BlockMode> = block::ONE_LINE.iter().chain(&block::TWO_LINES).collect();
        let mut seen = vec![0; modes.len()];
        for colours in random_blocks(6000) {
            let search::Encoded { bytes, error, .. } = search::encode(&colours, WHOLE, &EVEN, None);
            let is = |mode: &&block::BlockMode| mode.is_of(&bytes);
            seen[modes.iter().position(is).unwrap()] += 1;
            let mut found = [0_u16; 3 * TEXELS];
            bcdec_rs::bc6h_half(&bytes, &mut found, 3 * EDGE, false);
            let off = |(found, given): (&u16, &i32)| f64::from(i32::from(*found) - given).powi(2);
            let squares: f64 = found.iter().zip(colours.as_flattened()).map(off).sum();
            assert!((squares - f64::from(error)).abs() <= 1e-5 * squares, "{squares} {error}");
        }
        assert!(seen.iter().all(|count| *count > 0), "{seen:?}");
    }

    /// The instructions of a processor do not change a byte.
    #[test]
    fn vectors_make_the_same_bytes() {
        let texels: Vec<[f32; 3]> = random_blocks(256)
            .iter()
            .flatten()
            .map(|colour| colour.map(|bits| f16::from_bits(bits as u16).to_f32()))
            .collect();
        let images = Images { width: 64, height: 64, texels: &texels };
        for keeps_light in [false, true] {
            let strip = || Strip { images: &images, image: 0, first: 0, keeps_light };
            assert!(SimdLevel::detect().run(strip()) == SimdLevel::Portable.run(strip()));
        }
    }

    /// Random ends and indices in every mode that stores two lines, for every partition.
    #[test]
    fn a_decoder_reads_every_mode_with_two_lines() {
        for (number, mode) in block::TWO_LINES.iter().enumerate() {
            for (partition, block::Partition { second, short }) in block::PARTITIONS.iter().enumerate() {
                let random = |k: usize| {
                    let seed = (number * 32 + partition) * 64 + k;
                    ((seed as u32).wrapping_mul(2_654_435_761) >> 8) as i32
                };
                let first: [i32; 3] = std::array::from_fn(|channel| random(channel) % (1 << mode.bits));
                let other = |k: usize| -> [i32; 3] {
                    std::array::from_fn(|channel| {
                        let reach = 1 << (mode.others[channel] - 1);
                        let value = first[channel] + random(3 * k + channel) % (2 * reach) - reach;
                        value.clamp(0, (1 << mode.bits) - 1)
                    })
                };
                let colours = [first, other(1), other(2), other(3)];
                let stores = mode.stores(&colours);
                assert!(stores || mode.others[0] == mode.bits);
                let index = |texel: usize| {
                    random(20 + texel) as usize % if texel == 0 || texel == *short { 4 } else { 8 }
                };
                let indices: [usize; TEXELS] = std::array::from_fn(index);
                let mut found = [0_u16; 3 * TEXELS];
                bcdec_rs::bc6h_half(&mode.store(&colours, partition, &indices), &mut found, 3 * EDGE, false);
                for texel in 0..TEXELS {
                    let line = 2 * usize::from(block::contains(*second, texel));
                    let place = mode.places()[indices[texel]];
                    let expected: [i32; 3] = std::array::from_fn(|channel| {
                        let ends = [colours[line], colours[line + 1]];
                        between(ends.map(|end| unquantise(end[channel], mode.bits)), place)
                    });
                    let found: [i32; 3] =
                        std::array::from_fn(|channel| i32::from(found[3 * texel + channel]));
                    assert_eq!(found, expected, "mode {number}, partition {partition}, texel {texel}");
                }
            }
        }
    }

    /// A gradient of one colour, of 0.1 % and of 10 % from texel to texel. The ends have 12 bits at most
    /// here, which are steps of half a percent, either of which keeps the block's light, and places on the
    /// line are sixteenths of two stops.
    #[test]
    fn a_smooth_block_is_nearly_kept() {
        for (factor, most) in [(1.0, 2e-3), (1.001, 6e-3), (1.1, 0.06)] {
            let texels: Vec<[f32; 3]> =
                (0..16).map(|i| [3.0, 1.0, 0.2].map(|value: f32| value * f32::powi(factor, i))).collect();
            for (found, given) in decode(4, 4, &encode(4, 4, &texels), false).iter().zip(&texels) {
                for channel in 0..3 {
                    let error = (found[channel] / given[channel] - 1.0).abs();
                    assert!(error < most, "{factor}: {found:?} instead of {given:?}");
                }
            }
        }
    }

    /// Blocks of three stops and tints of a tenth: each errs by percents, and their sum does not.
    #[test]
    fn rows_of_blocks_keep_their_light() {
        let (width, height) = (128, 32);
        let noise =
            |seed: usize| f64::from((seed as u32).wrapping_mul(2_654_435_761) >> 8) / f64::from(1 << 24);
        let texels: Vec<[f32; 3]> = (0..width * height)
            .map(|texel| {
                let level = math::exp2(3.0 * noise(texel));
                [3, 5, 7].map(|prime| (level * (1.0 + 0.1 * noise(prime * texel + prime))) as f32)
            })
            .collect();
        let found = decode(width, height, &encode(width, height, &texels), false);
        for channel in 0..3 {
            let sum = |texels: &[[f32; 3]]| texels.iter().map(|texel| f64::from(texel[channel])).sum::<f64>();
            let error = sum(&found) / sum(&texels) - 1.0;
            assert!(error.abs() < 1e-3, "channel {channel}: {error}");
        }
    }

    /// A sun of 20,000 and two lamps, blurred with a standard deviation of 1.5 texels and more, in a sky of 1
    /// over a ground of 0.01.
    fn blurred(edge: usize) -> Vec<[f32; 3]> {
        const LAMPS: [([f64; 2], f64, [f64; 3]); 3] = [
            ([0.31, 0.22], 1.5, [20_000.0, 16_000.0, 11_000.0]),
            ([0.74, 0.55], 3.0, [3.0, 9.0, 30.0]),
            ([0.15, 0.81], 6.0, [2.0, 0.3, 0.1]),
        ];
        let texel = |index: usize| {
            let at = [index % edge, index / edge].map(|place| place as f64 + 0.5);
            let sky = 1.0 / (1.0 + math::exp((at[1] / edge as f64 - 0.5) * 40.0));
            std::array::from_fn(|channel| {
                let ambient = 0.01 + sky * [0.3, 0.55, 1.0][channel];
                let lamps = LAMPS.iter().map(|(place, width, colour)| {
                    let squared = (0..2).map(|axis| math::powi(at[axis] - edge as f64 * place[axis], 2));
                    colour[channel] * math::exp(-squared.sum::<f64>() / (2.0 * width * width))
                });
                (ambient + lamps.sum::<f64>()) as f32
            })
        };
        (0..edge * edge).map(texel).collect()
    }

    /// The 95th and 99th percentiles of the error in stops, as of a picture whose darkest hundredth does not
    /// matter.
    fn stops(found: &[[f32; 3]], given: &[[f32; 3]]) -> [f64; 2] {
        const BLACK_RADIANCE: f64 = 0.01;
        let pairs = found.as_flattened().iter().zip(given.as_flattened());
        let error = |(found, given): (&f32, &f32)| {
            math::log2((f64::from(*found) + BLACK_RADIANCE) / (f64::from(*given) + BLACK_RADIANCE)).abs()
        };
        let mut errors: Vec<f64> = pairs.map(error).collect();
        errors.sort_by(f64::total_cmp);
        [95, 99].map(|percent| errors[errors.len() * percent / 100])
    }

    #[test]
    fn blurred_light_is_kept_within_a_tenth_of_a_stop() {
        let given = blurred(64);
        let light = stops(&decode(64, 64, &encode(64, 64, &given), false), &given);
        let nearest = stops(&decode(64, 64, &encode_nearest(64, 64, &given), false), &given);
        assert!(nearest[0] < 0.09 && nearest[1] < 0.2, "{nearest:?}");
        assert!(nearest[0] < light[0] && nearest[1] < light[1], "{nearest:?} {light:?}");
    }

    /// Two of the four texels lie on each line, whose ends are at steps of an eighth of a stop here. What is
    /// past the edge does not count.
    #[test]
    fn the_last_levels_of_a_cube_are_nearly_exact() {
        let texels = [[0.4, 0.5, 0.9], [1.0, 0.8, 0.6], [0.3, 0.35, 0.3], [0.5, 0.5, 1.6]];
        for image in [&texels[..], &texels[..1]] {
            let edge = image.len().isqrt();
            let found = decode(edge, edge, &encode_nearest(edge, edge, image), false);
            for (found, given) in found.as_flattened().iter().zip(image.as_flattened()) {
                assert!((found / given).log2().abs() < 0.09, "{found} instead of {given}");
            }
        }
    }

    #[test]
    fn images_of_any_size_have_whole_blocks() {
        for encode in [encode, encode_nearest] {
            for (width, height) in [(1, 1), (2, 2), (5, 3), (8, 8)] {
                let texels = vec![[1.0, 2.0, 4.0]; 2 * width * height];
                let bytes = encode(width, height, &texels);
                assert_eq!(bytes.len(), 2 * width.div_ceil(4) * height.div_ceil(4) * BYTES);
                assert_eq!(decode(width, height, &bytes, false), texels);
            }
            // Negative numbers, NaN and infinity have the nearest that the format has.
            let odd = vec![[-1.0, f32::NAN, f32::INFINITY]; 16];
            let found = decode(4, 4, &encode(4, 4, &odd), false);
            assert!(found.iter().all(|found| *found == [0.0, 0.0, 65504.0]));
        }
    }
}
