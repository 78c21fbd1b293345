//! BC6H, unsigned: a block of 4 x 4 texels in 16 bytes (Direct3D 11 functional specification, section
//! 19.5.14).
//!
//! A block is two colours and, for each texel, one of 16 places on the line between them; all numbers are the
//! bits of halves, taken as integers, so the line is about straight in logarithms. Of the format's fourteen
//! modes those with one line are written: 11 to 14, which hold the first colour in 10, 11, 12 or 16 bits and
//! the second in 10 or as a difference of 9, 8 or 4. Blocks that are read may have any mode.

use half::f16;
use rayon::prelude::*;

use crate::precision::to_half;

/// Texels along the edge of a block.
pub(crate) const EDGE: usize = 4;

const TEXELS: usize = EDGE * EDGE;

/// Rows of blocks that are written one after the other.
const STRIP: usize = 16;

/// The bytes of a block.
const BYTES: usize = 16;

/// The place of each index between the two colours, in 64ths.
const WEIGHTS: [i32; 16] = [0, 4, 9, 13, 17, 21, 26, 30, 34, 38, 43, 47, 51, 55, 60, 64];

/// A mode with one line.
struct BlockMode {
    /// The first five bits of a block in the mode.
    code: u128,
    /// The number of bits of each of the first colour's numbers.
    bits: u32,
    /// The number of bits of each of the second colour's numbers: all of them, or those of a difference.
    second: u32,
}

const MODES: [BlockMode; 4] = [
    BlockMode { code: 0b00011, bits: 10, second: 10 },
    BlockMode { code: 0b00111, bits: 11, second: 9 },
    BlockMode { code: 0b01011, bits: 12, second: 8 },
    BlockMode { code: 0b01111, bits: 16, second: 4 },
];

/// Images of `width` x `height` texels. Blocks past the edge repeat its texels.
pub(crate) fn encode(width: usize, height: usize, texels: &[[f32; 3]]) -> Vec<u8> {
    let (columns, rows) = (width.div_ceil(EDGE), height.div_ceil(EDGE));
    let images = texels.len() / (width * height).max(1);
    let block = |image: usize, row: usize, column: usize| -> [[i32; 3]; TEXELS] {
        std::array::from_fn(|texel| {
            let y = (EDGE * row + texel / EDGE).min(height - 1);
            let x = (EDGE * column + texel % EDGE).min(width - 1);
            // NaN is 0 by `max`.
            texels[(image * height + y) * width + x].map(|value| i32::from(to_half(value.max(0.0)).to_bits()))
        })
    };
    // What a block loses of the light the next one makes up for, to the right in one row and to the left in
    // the next, by strips of a height that does not depend on the machine.
    let strips: Vec<(usize, usize)> =
        (0..images).flat_map(|image| (0..rows).step_by(STRIP).map(move |row| (image, row))).collect();
    let strip = |(image, first): (usize, usize)| -> Vec<u8> {
        let mut owed = [0.0; 3];
        let mut bytes = Vec::new();
        for row in first..rows.min(first + STRIP) {
            let mut blocks = vec![[0; BYTES]; columns];
            for step in 0..columns {
                let column = if row % 2 == 0 { step } else { columns - 1 - step };
                blocks[column] = encode_block(&block(image, row, column), &mut owed);
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

/// A line through colour space, as it is stored.
struct ColourLine {
    ends: [[i32; 3]; 2],
    indices: [usize; TEXELS],
    /// The sum of squares over texels and channels.
    error: f64,
}

/// A block, which makes up for the light that is `owed`.
fn encode_block(colours: &[[i32; 3]; TEXELS], owed: &mut [f64; 3]) -> [u8; BYTES] {
    let ends = ends(colours);
    let best = MODES
        .iter()
        .filter_map(|mode| Some((mode, fit(mode, colours, ends)?)))
        .min_by(|(_, a), (_, b)| a.error.total_cmp(&b.error));
    // Mode 11 stores any two colours.
    best.map_or([0; BYTES], |(mode, mut line)| {
        *owed = settle(mode, colours, &mut line, *owed);
        store(mode, &line)
    })
}

/// The ends of the colours' extent along their principal axis.
fn ends(colours: &[[i32; 3]; TEXELS]) -> [[f64; 3]; 2] {
    let colours = colours.map(|colour| colour.map(f64::from));
    let mean: [f64; 3] = std::array::from_fn(|channel| {
        colours.iter().map(|colour| colour[channel]).sum::<f64>() / TEXELS as f64
    });
    let around =
        colours.map(|colour| std::array::from_fn::<f64, 3, _>(|channel| colour[channel] - mean[channel]));
    // The power method, from the axis of the widest channel on.
    let covariance: [[f64; 3]; 3] = std::array::from_fn(|i| {
        std::array::from_fn(|j| around.iter().map(|colour| colour[i] * colour[j]).sum())
    });
    let widest = (0..3).max_by(|&a, &b| covariance[a][a].total_cmp(&covariance[b][b])).unwrap_or(0);
    let mut axis = covariance[widest];
    for _ in 0..8 {
        let length = axis.iter().map(|value| value * value).sum::<f64>().sqrt();
        if length == 0.0 {
            return [mean; 2];
        }
        axis = axis.map(|value| value / length);
        axis = std::array::from_fn(|i| (0..3).map(|j| covariance[i][j] * axis[j]).sum());
    }
    let length = axis.iter().map(|value| value * value).sum::<f64>().sqrt();
    if length == 0.0 {
        return [mean; 2];
    }
    let axis = axis.map(|value| value / length);
    let along = around.map(|colour| (0..3).map(|channel| colour[channel] * axis[channel]).sum::<f64>());
    let (low, high) = along.iter().fold((f64::MAX, f64::MIN), |(low, high), t| (low.min(*t), high.max(*t)));
    [low, high].map(|t| std::array::from_fn(|channel| mean[channel] + t * axis[channel]))
}

/// The best line of a mode from these ends on, refined by least squares; `None` if a difference between its
/// ends does not fit.
fn fit(mode: &BlockMode, colours: &[[i32; 3]; TEXELS], mut ends: [[f64; 3]; 2]) -> Option<ColourLine> {
    let mut best: Option<ColourLine> = None;
    for _ in 0..3 {
        let quantised = ends.map(|end| end.map(|value| quantise(value, mode.bits)));
        let line = place(mode, colours, quantised);
        let Some(line) = line else { break };
        ends = least_squares(colours, &line.indices).unwrap_or(ends);
        if best.as_ref().is_none_or(|best| line.error < best.error) {
            best = Some(line);
        }
    }
    best
}

/// How much the block's light counts beside that of its texels: as much as an error that all of these texels
/// have alike.
const LIGHT: f64 = 256.0;

/// The most of its own light that a block makes up for those before it.
const MOST_OWED: f64 = 0.02;

/// Moves the ends of a line by a few codes, and then texels by a place, so that the block keeps its light and
/// what those before it `owed`, which the nearest texels in logarithms do not. Gives what is owed after it.
fn settle(mode: &BlockMode, colours: &[[i32; 3]; TEXELS], line: &mut ColourLine, owed: [f64; 3]) -> [f64; 3] {
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
    let is_difference = mode.bits != mode.second;
    let far = 1 << (mode.second - 1);
    for channel in 0..3 {
        let cost = |ends: [i32; 2]| {
            let wide = ends.map(|end| unquantise(end, mode.bits));
            let (mut error, mut found) = (0.0, 0.0);
            for (colour, &index) in colours.iter().zip(&line.indices) {
                let bits = between(wide, WEIGHTS[index]);
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
                && (!is_difference || (-far..far).contains(&(ends[1] - ends[0])));
            let cost = if fits { cost(ends) } else { f64::MAX };
            if cost < best.0 {
                best = (cost, ends);
            }
        }
        [line.ends[0][channel], line.ends[1][channel]] = best.1;
    }
    let wide = line.ends.map(|end| end.map(|value| unquantise(value, mode.bits)));
    let bits = WEIGHTS.map(|weight| {
        std::array::from_fn::<i32, 3, _>(|channel| between([wide[0][channel], wide[1][channel]], weight))
    });
    let values = bits.map(|bits| bits.map(value));
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

/// The bits of the half at a place between two ends.
fn between(wide: [i32; 2], weight: i32) -> i32 {
    finish((wide[0] * (64 - weight) + wide[1] * weight + 32) >> 6)
}

/// The nearest index of each texel.
fn place(mode: &BlockMode, colours: &[[i32; 3]; TEXELS], mut ends: [[i32; 3]; 2]) -> Option<ColourLine> {
    let wide = ends.map(|end| end.map(|value| unquantise(value, mode.bits)));
    let palette = WEIGHTS.map(|weight| {
        std::array::from_fn::<i32, 3, _>(|channel| between([wide[0][channel], wide[1][channel]], weight))
    });
    let mut error = 0.0;
    let mut indices = colours.map(|colour| {
        let distance = |entry: &[i32; 3]| -> f64 {
            (0..3).map(|channel| math::powi(f64::from(entry[channel] - colour[channel]), 2)).sum()
        };
        let nearest =
            (0..16).min_by(|&a, &b| distance(&palette[a]).total_cmp(&distance(&palette[b]))).unwrap_or(0);
        error += distance(&palette[nearest]);
        nearest
    });
    // The highest bit of the first index is not stored, and is 0.
    if indices[0] >= 8 {
        ends.reverse();
        indices = indices.map(|index| 15 - index);
    }
    let reach = 1 << (mode.second - 1);
    let fits = |channel: usize| (-reach..reach).contains(&(ends[1][channel] - ends[0][channel]));
    (mode.bits == mode.second || (0..3).all(fits)).then_some(ColourLine { ends, indices, error })
}

/// The ends that suit indices best, in the integers of halves.
fn least_squares(colours: &[[i32; 3]; TEXELS], indices: &[usize; TEXELS]) -> Option<[[f64; 3]; 2]> {
    let share = indices.map(|index| f64::from(WEIGHTS[index]) / 64.0);
    let sum = |value: &dyn Fn(usize) -> f64| (0..TEXELS).map(value).sum::<f64>();
    let (aa, ab, bb) = (
        sum(&|i| math::powi(1.0 - share[i], 2)),
        sum(&|i| (1.0 - share[i]) * share[i]),
        sum(&|i| math::powi(share[i], 2)),
    );
    let determinant = aa * bb - ab * ab;
    if determinant < 1e-9 {
        return None;
    }
    let mut ends = [[0.0; 3]; 2];
    for channel in 0..3 {
        let value = |i: usize| f64::from(colours[i][channel]);
        let (a, b) = (sum(&|i| (1.0 - share[i]) * value(i)), sum(&|i| share[i] * value(i)));
        ends[0][channel] = (a * bb - b * ab) / determinant;
        ends[1][channel] = (b * aa - a * ab) / determinant;
    }
    Some(ends)
}

/// The number of `bits` bits that [`unquantise`] and [`finish`] take nearest to a half's integer.
fn quantise(value: f64, bits: u32) -> i32 {
    let most = (1 << bits) - 1;
    let wide = value.clamp(0.0, 31743.0) * 64.0 / 31.0;
    let guess = ((wide * f64::from(1 << bits) - 32768.0) / 65536.0).round() as i32;
    let distance = |code: i32| (f64::from(finish(unquantise(code, bits))) - value).abs();
    let candidates = (guess - 1..=guess + 1).map(|code| code.clamp(0, most));
    candidates.min_by(|&a, &b| distance(a).total_cmp(&distance(b))).unwrap_or(0)
}

fn unquantise(code: i32, bits: u32) -> i32 {
    match code {
        _ if bits >= 15 => code,
        0 => 0,
        _ if code == (1 << bits) - 1 => 0xffff,
        _ => ((code << 16) + 0x8000) >> bits,
    }
}

/// Converts 16 bits to the bits of a half, at most those of 65504.
fn finish(wide: i32) -> i32 {
    (wide * 31) >> 6
}

fn store(mode: &BlockMode, line: &ColourLine) -> [u8; BYTES] {
    let (mut block, mut at) = (mode.code, 5);
    let mut put = |value: i32, bits: u32| {
        let mask = (1_u128 << bits) - 1;
        block |= (value as u128 & mask) << at;
        at += bits;
    };
    let [first, second] = line.ends;
    for value in first {
        put(value, 10);
    }
    for (low, high) in first.into_iter().zip(second) {
        let is_difference = mode.bits != mode.second;
        put(if is_difference { high - low } else { high }, mode.second);
        // The first colour's bits past ten, the highest first.
        for bit in (10..mode.bits).rev() {
            put(low >> bit & 1, 1);
        }
    }
    for (texel, &index) in line.indices.iter().enumerate() {
        put(index as i32, if texel == 0 { 3 } else { 4 });
    }
    block.to_le_bytes()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What the decoder makes of a stored block is what the encoder thought, in every mode.
    #[test]
    fn a_decoder_reads_every_mode_that_is_written() {
        let mut seen = [0; 4];
        for seed in 0..4000_u32 {
            let random =
                |k: u32| (seed.wrapping_mul(2_654_435_761).wrapping_add(k.wrapping_mul(40_503)) >> 8) % 4096;
            let spread = [4096, 600, 60, 2][seed as usize % 4];
            let colours: [[i32; 3]; TEXELS] = std::array::from_fn(|texel| {
                std::array::from_fn(|channel| {
                    let base = 7 * random(channel as u32) % 27_000;
                    (base + random(texel as u32 * 17 + 3) % spread + random(99 + channel as u32) % spread)
                        as i32
                })
            });
            let ends = ends(&colours);
            for (number, mode) in MODES.iter().enumerate() {
                let Some(line) = fit(mode, &colours, ends) else { continue };
                seen[number] += 1;
                let mut found = [0_u16; 3 * TEXELS];
                bcdec_rs::bc6h_half(&store(mode, &line), &mut found, 3 * EDGE, false);
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

    #[test]
    fn images_of_any_size_have_whole_blocks() {
        for (width, height) in [(1, 1), (2, 2), (5, 3), (8, 8)] {
            let texels = vec![[1.0, 2.0, 4.0]; 2 * width * height];
            let bytes = encode(width, height, &texels);
            assert_eq!(bytes.len(), 2 * width.div_ceil(4) * height.div_ceil(4) * BYTES);
            assert_eq!(decode(width, height, &bytes, false), texels);
        }
        // Negative numbers, NaN and infinity have the nearest that the format has.
        let odd = vec![[-1.0, f32::NAN, f32::INFINITY]; 16];
        assert!(decode(4, 4, &encode(4, 4, &odd), false).iter().all(|found| *found == [0.0, 0.0, 65504.0]));
    }
}
