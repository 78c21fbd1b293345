//! BC6H, unsigned: a block of 4 x 4 texels in 16 bytes (Direct3D 11 functional specification, section
//! 19.5.14).
//!
//! A block is two colours and, for each texel, one of 16 places on the line between them; all numbers are the
//! bits of halves, taken as integers, so the line is about straight in logarithms. The modes with one line,
//! 11 to 14, hold the first colour in 10, 11, 12 or 16 bits and the second in 10 or as a difference of 9, 8
//! or 4; [`encode`] writes these. In the others each texel is on one of two lines with 8 places;
//! [`encode_nearest`] writes all fourteen. Blocks that are read may have any mode.

mod block;
mod line;
mod nearest;

use half::f16;
use rayon::prelude::*;

pub(crate) use self::block::EDGE;
use self::block::{BYTES, BlockMode, Colours, ONE_LINE, TEXELS, TexelSet, WHOLE, between, unquantise};
use self::line::{ColourLine, ends, fit};
use crate::precision::to_half;

/// Rows of blocks that are written one after the other.
const STRIP: usize = 16;

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
}

/// Images of `width` x `height` texels, whose texels are as near as blocks allow, in logarithms.
pub(crate) fn encode_nearest(width: usize, height: usize, texels: &[[f32; 3]]) -> Vec<u8> {
    let images = Images { width, height, texels };
    let (columns, rows) = images.blocks();
    let block = |index: usize| {
        let (image, row, column) = (index / (columns * rows), index / columns % rows, index % columns);
        nearest::encode(&images.block(image, row, column), images.inside(row, column))
    };
    (0..images.count() * rows * columns).into_par_iter().flat_map_iter(block).collect()
}

/// Images of `width` x `height` texels, which keep their light. Blocks past the edge repeat its texels.
pub(crate) fn encode(width: usize, height: usize, texels: &[[f32; 3]]) -> Vec<u8> {
    let images = Images { width, height, texels };
    let (columns, rows) = images.blocks();
    // What a block loses of the light the next one makes up for, to the right in one row and to the left in
    // the next, by strips of a height that does not depend on the machine.
    let strips: Vec<(usize, usize)> =
        (0..images.count()).flat_map(|image| (0..rows).step_by(STRIP).map(move |row| (image, row))).collect();
    let strip = |(image, first): (usize, usize)| -> Vec<u8> {
        let mut owed = [0.0; 3];
        let mut bytes = Vec::new();
        for row in first..rows.min(first + STRIP) {
            let mut blocks = vec![[0; BYTES]; columns];
            for step in 0..columns {
                let column = if row % 2 == 0 { step } else { columns - 1 - step };
                blocks[column] = encode_block(&images.block(image, row, column), &mut owed);
            }
            bytes.extend(blocks.into_flattened());
        }
        bytes
    };
    strips.into_par_iter().flat_map_iter(strip).collect()
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

/// A block, which makes up for the light that is `owed`.
fn encode_block(colours: &Colours, owed: &mut [f64; 3]) -> [u8; BYTES] {
    let ends = ends(colours, WHOLE);
    let best = ONE_LINE
        .iter()
        .filter_map(|mode| Some((mode, fit(mode, colours, WHOLE, ends)?)))
        .min_by(|(_, a), (_, b)| a.error.total_cmp(&b.error));
    // Mode 11 stores any two colours.
    best.map_or([0; BYTES], |(mode, mut line)| {
        *owed = settle(mode, colours, &mut line, *owed);
        mode.store(&line.ends, 0, &line.indices)
    })
}

/// How much the block's light counts beside that of its texels: as much as an error that all of these texels
/// have alike.
const LIGHT: f64 = 256.0;

/// The most of its own light that a block makes up for those before it.
const MOST_OWED: f64 = 0.02;

/// Moves the ends of a line by a few codes, and then texels by a place, so that the block keeps its light and
/// what those before it `owed`, which the nearest texels in logarithms do not. Gives what is owed after it.
fn settle(mode: &BlockMode, colours: &Colours, line: &mut ColourLine, owed: [f64; 3]) -> [f64; 3] {
    const REACH: i32 = 2;
    let value = |bits: i32| f64::from(f16::from_bits(bits as u16).to_f32());
    let lights = [0, 1, 2].map(|channel| colours.iter().map(|colour| value(colour[channel])).sum::<f64>());
    let wanted: [f64; 3] = std::array::from_fn(|channel| {
        let most = MOST_OWED * lights[channel];
        lights[channel] + owed[channel].clamp(-most, most)
    });
    // In the integers of halves, of which 1024 are a factor of 2.
    let off = |channel: usize, found: f64| {
        let step = 1024.0 / std::f64::consts::LN_2;
        if wanted[channel] > 0.0 {
            LIGHT * math::powi(step * (found / wanted[channel] - 1.0), 2)
        } else {
            0.0
        }
    };
    for channel in 0..3 {
        let cost = |ends: [i32; 2]| {
            let wide = ends.map(|end| unquantise(end, mode.bits));
            let (mut error, mut found) = (0.0, 0.0);
            for (colour, &index) in colours.iter().zip(&line.indices) {
                let bits = between(wide, mode.places()[index]);
                error += math::powi(f64::from(bits - colour[channel]), 2);
                found += value(bits);
            }
            error + off(channel, found)
        };
        let given = [line.ends[0][channel], line.ends[1][channel]];
        let mut best = (cost(given), given);
        for (first, second) in (-REACH..=REACH).flat_map(|a| (-REACH..=REACH).map(move |b| (a, b))) {
            let ends = [given[0] + first, given[1] + second];
            let fits = ends.iter().all(|end| (0..1 << mode.bits).contains(end))
                && mode.reaches(channel, ends[0], ends[1]);
            let cost = if fits { cost(ends) } else { f64::MAX };
            if cost < best.0 {
                best = (cost, ends);
            }
        }
        [line.ends[0][channel], line.ends[1][channel]] = best.1;
    }
    let wide = line.ends.map(|end| end.map(|value| unquantise(value, mode.bits)));
    let colour = |weight: &i32| -> [i32; 3] {
        std::array::from_fn(|channel| between([wide[0][channel], wide[1][channel]], *weight))
    };
    let bits: Vec<[i32; 3]> = mode.places().iter().map(colour).collect();
    let values: Vec<[f64; 3]> = bits.iter().map(|bits| bits.map(value)).collect();
    let mut found: [f64; 3] =
        std::array::from_fn(|channel| line.indices.iter().map(|&index| values[index][channel]).sum());
    for texel in 0..TEXELS {
        let old = line.indices[texel];
        let with = |new: usize| -> (f64, [f64; 3]) {
            let found = std::array::from_fn(|c| found[c] - values[old][c] + values[new][c]);
            let cost =
                |c: usize| math::powi(f64::from(bits[new][c] - colours[texel][c]), 2) + off(c, found[c]);
            ((0..3).map(cost).sum(), found)
        };
        // The first index has three bits.
        let most = if texel == 0 { 7 } else { 15 };
        let places = old.saturating_sub(1)..=(old + 1).min(most);
        let best = places.map(|new| (with(new), new)).min_by(|a, b| a.0.0.total_cmp(&b.0.0));
        if let Some(((_, light), new)) = best {
            (line.indices[texel], found) = (new, light);
        }
    }
    std::array::from_fn(|channel| lights[channel] + owed[channel] - found[channel])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What the decoder makes of a stored block is what the encoder thought.
    #[test]
    fn a_decoder_reads_every_mode_with_one_line() {
        let mut seen = [0; 4];
        for seed in 0..4000_u32 {
            let random =
                |k: u32| (seed.wrapping_mul(2_654_435_761).wrapping_add(k.wrapping_mul(40_503)) >> 8) % 4096;
            let spread = [4096, 600, 60, 2][seed as usize % 4];
            let colours: Colours = std::array::from_fn(|texel| {
                std::array::from_fn(|channel| {
                    let base = 7 * random(channel as u32) % 27_000;
                    (base + random(texel as u32 * 17 + 3) % spread + random(99 + channel as u32) % spread)
                        as i32
                })
            });
            let ends = ends(&colours, WHOLE);
            for (number, mode) in ONE_LINE.iter().enumerate() {
                let Some(line) = fit(mode, &colours, WHOLE, ends) else { continue };
                seen[number] += 1;
                let mut found = [0_u16; 3 * TEXELS];
                let block = mode.store(&line.ends, 0, &line.indices);
                bcdec_rs::bc6h_half(&block, &mut found, 3 * EDGE, false);
                let error: f64 = found
                    .iter()
                    .zip(colours.as_flattened())
                    .map(|(found, given)| f64::from(i32::from(*found) - given).powi(2))
                    .sum();
                assert!(
                    (error - line.error).abs() < 1e-6 * (1.0 + error),
                    "mode {number}: {error} {}",
                    line.error
                );
            }
        }
        assert!(seen.iter().all(|count| *count > 50), "{seen:?}");
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
