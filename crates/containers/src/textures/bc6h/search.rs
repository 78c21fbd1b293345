//! The lines of a block that are nearest to what was given, in logarithms, or nearest among those that keep
//! the block's light.
//!
//! Beside one line with 16 places, two lines with 8 places each are tried for the partitions that promise
//! most, which follow colours that change in two directions, as at the edge of a blurred lamp in a blue sky.
//! All two-line modes have the same places, so the one that stores the ends with most bits is the best, and
//! so it is among the modes with one line. Last the ends move by codes as long as that helps.

use super::block::{
    BYTES, BlockMode, Colours, ONE_LINE, PARTITIONS, TEXELS, TWO_LINES, TexelSet, between, contains,
    unquantise,
};
use super::line::{Block, ColourLine, Lane, ends, least_squares, mask, of_half, quantised, through};
use super::partitions::promises;

/// The number of partitions that are fitted.
const FITTED: usize = 4;

/// The error of a number, in the integers of halves, of which 1024 are a factor of 2, below which one line is
/// good enough.
const ONE_LINE_ERROR: f32 = 3.0;

/// The most sweeps over the ends of a block's lines.
const SWEEPS: usize = 4;

/// The light that a block is to have.
#[derive(Clone, Copy)]
pub(crate) struct WantedLight(pub(crate) [f32; 3]);

impl WantedLight {
    /// How much the block's light counts beside its texels: as an error that all sixteen have alike. More of
    /// it makes texels worse; with less, blocks owe the next ones more.
    const WEIGHT: f32 = 16.0;

    /// What a channel adds to the error of a block that has this light.
    #[inline(always)]
    fn off(&self, channel: usize, found: f32) -> f32 {
        // In the integers of halves.
        const STEP: f32 = 1024.0 / std::f32::consts::LN_2;
        if self.0[channel] > 0.0 {
            let off = STEP * (found / self.0[channel] - 1.0);
            Self::WEIGHT * off * off
        } else {
            0.0
        }
    }

    #[inline(always)]
    fn all(&self, found: [f32; 3]) -> f32 {
        self.off(0, found[0]) + self.off(1, found[1]) + self.off(2, found[2])
    }
}

/// The lines of a block, as they are stored.
#[derive(Clone, Copy)]
struct Fitted {
    mode: &'static BlockMode,
    /// The number of the partition; it counts if there are two lines.
    partition: usize,
    /// The texels of each line that count. If there is one line, the second has no texels.
    masks: [Lane; 2],
    lines: [ColourLine; 2],
}

/// A block as it is stored.
pub(crate) struct Encoded {
    pub(crate) bytes: [u8; BYTES],
    /// The weighted sum of squares over the texels that count and channels, in the integers of halves, before
    /// texels moved to keep the light.
    #[cfg_attr(not(test), expect(dead_code, reason = "tests compare it with a decoder's"))]
    pub(crate) error: f32,
    /// The sum of the texels' colours, if light was wanted.
    pub(crate) light: [f32; 3],
}

/// A block of colours, of which those of some texels count, each with a weight.
#[inline(always)]
pub(crate) fn encode(
    colours: &Colours,
    texels: TexelSet,
    weights: &Lane,
    wanted: Option<WantedLight>,
) -> Encoded {
    let block = Block::new(colours, texels, weights);
    let all = mask(texels);
    let mut best = one_line(&block, &all);
    let enough = ONE_LINE_ERROR * ONE_LINE_ERROR * (3 * texels.count_ones()) as f32;
    if best.error() > enough {
        let mut promises = promises(&block, &all);
        for _ in 0..FITTED {
            let mut number = 0;
            for other in 1..promises.len() {
                if promises[other] < promises[number] {
                    number = other;
                }
            }
            promises[number] = f32::INFINITY;
            if let Some(two) = two_lines(&block, &all, number)
                && two.error() < best.error()
            {
                best = two;
            }
        }
    }
    match (best.mode.lines, wanted) {
        (2, None) => best.polished::<8, false>(&block, WantedLight([0.0; 3])),
        (2, Some(wanted)) => best.polished::<8, true>(&block, wanted),
        (_, None) => best.polished::<16, false>(&block, WantedLight([0.0; 3])),
        (_, Some(wanted)) => best.polished::<16, true>(&block, wanted),
    }
    if let Some(wanted) = wanted {
        best.settle(&block, wanted);
    }
    Encoded { bytes: best.stored(), error: best.error(), light: best.light() }
}

/// One line through all of a block, in the mode with most bits that stores it.
#[inline(always)]
fn one_line(block: &Block, all: &Lane) -> Fitted {
    let start = ends(block, all);
    let mut found = Fitted {
        mode: &ONE_LINE[0],
        partition: 0,
        masks: [*all, [0.0; TEXELS]],
        lines: [ColourLine::NONE; 2],
    };
    // Mode 11, the first here, stores any two colours.
    for mode in ONE_LINE.iter().rev() {
        let (mut ends, mut best) = (start, None::<ColourLine>);
        for _ in 0..3 {
            let line = through::<16, false>(mode, block, all, quantised(mode, block, ends)).turned::<16>(0);
            if !mode.stores(&line.ends) {
                break;
            }
            ends = least_squares::<16>(block, all, &line.indices).unwrap_or(ends);
            if best.is_none_or(|best| line.error < best.error) {
                best = Some(line);
            }
        }
        if let Some(line) = best {
            found.mode = mode;
            found.lines[0] = line;
            break;
        }
    }
    found
}

/// The lines of a partition in the mode with most bits that stores them.
#[inline(always)]
fn two_lines(block: &Block, all: &Lane, number: usize) -> Option<Fitted> {
    let second = mask(PARTITIONS[number].second);
    let mut masks = [*all; 2];
    for i in 0..TEXELS {
        masks[0][i] *= 1.0 - second[i];
        masks[1][i] *= second[i];
    }
    // The lines do not depend on the mode before they are rounded.
    let mut start = [ends(block, &masks[0]), ends(block, &masks[1])];
    for mode in &TWO_LINES {
        let mut best = None::<Fitted>;
        for _ in 0..3 {
            let codes = [quantised(mode, block, start[0]), quantised(mode, block, start[1])];
            let [[a, b], [c, d]] = codes;
            if !mode.stores(&[a, b, c, d]) && !mode.stores(&[b, a, c, d]) {
                break;
            }
            let lines = [0, 1].map(|part: usize| through::<8, false>(mode, block, &masks[part], codes[part]));
            start = [0, 1].map(|part: usize| {
                least_squares::<8>(block, &masks[part], &lines[part].indices).unwrap_or(start[part])
            });
            let mut found = Fitted { mode, partition: number, masks, lines };
            if found.turn::<8>() && best.as_ref().is_none_or(|best| found.error() < best.error()) {
                best = Some(found);
            }
        }
        if best.is_some() {
            return best;
        }
    }
    None
}

impl Fitted {
    #[inline(always)]
    fn error(&self) -> f32 {
        self.lines[0].error + self.lines[1].error
    }

    #[inline(always)]
    fn light(&self) -> [f32; 3] {
        [0, 1, 2].map(|channel: usize| self.lines[0].light[channel] + self.lines[1].light[channel])
    }

    /// The ends of all lines, in the order of the file.
    #[inline(always)]
    fn colours(&self) -> [[i32; 3]; 4] {
        let [[a, b], [c, d]] = self.lines.map(|line| line.ends);
        [a, b, c, d]
    }

    /// Turns the lines to the directions that can be stored, and says whether all differences fit.
    #[inline(always)]
    fn turn<const PLACES: usize>(&mut self) -> bool {
        self.lines[0] = self.lines[0].turned::<PLACES>(0);
        if PLACES == 8 {
            self.lines[1] = self.lines[1].turned::<PLACES>(PARTITIONS[self.partition].short);
        }
        self.mode.stores(&self.colours()[..32 / PLACES])
    }

    /// Moves the ends by a code or two as long as that brings the texels nearer, or nearer with their light.
    #[inline(always)]
    fn polished<const PLACES: usize, const LIGHT: bool>(&mut self, block: &Block, wanted: WantedLight) {
        let lines = self.mode.lines;
        let cost = |lines: &[ColourLine; 2]| {
            let error = lines[0].error + lines[1].error;
            let light = [0, 1, 2].map(|channel: usize| lines[0].light[channel] + lines[1].light[channel]);
            if LIGHT { error + wanted.all(light) } else { error }
        };
        if LIGHT {
            for part in 0..lines {
                let ends = self.lines[part].ends;
                self.lines[part] = through::<PLACES, LIGHT>(self.mode, block, &self.masks[part], ends);
            }
        }
        let mut least = cost(&self.lines);
        for _ in 0..SWEEPS {
            let before = least;
            for number in 0..6 * lines {
                let (part, end, channel) = (number / 6, number / 3 % 2, number % 3);
                for step in [-1, 1, -2, 2] {
                    let mut ends = self.lines[part].ends;
                    ends[end][channel] += step;
                    if !(0..1 << self.mode.bits).contains(&ends[end][channel]) {
                        continue;
                    }
                    let old = self.lines;
                    self.lines[part] = through::<PLACES, LIGHT>(self.mode, block, &self.masks[part], ends);
                    let new = cost(&self.lines);
                    if new < least && self.turn::<PLACES>() {
                        least = new;
                        break;
                    }
                    self.lines = old;
                }
            }
            if least >= before {
                break;
            }
        }
    }

    /// Moves texels by a place, so that the block keeps its light.
    #[inline(always)]
    fn settle(&mut self, block: &Block, wanted: WantedLight) {
        let places = self.mode.places();
        let count = self.mode.lines;
        let mut bits = [[[0.0; 3]; 16]; 2];
        let mut values = [[[0.0; 3]; 16]; 2];
        for part in 0..count {
            let wide = self.lines[part].ends.map(|end| end.map(|value| unquantise(value, self.mode.bits)));
            for (index, &weight) in places.iter().enumerate() {
                for channel in 0..3 {
                    let half = between([wide[0][channel], wide[1][channel]], weight);
                    bits[part][index][channel] = half as f32 - block.mean[channel];
                    values[part][index][channel] = of_half(half);
                }
            }
        }
        let mut found = self.light();
        let short = PARTITIONS[self.partition].short;
        for texel in 0..TEXELS {
            let Some(part) = (0..count).find(|&part| self.masks[part][texel] > 0.0) else { continue };
            let old = self.lines[part].indices[texel] as usize;
            // An index with a bit less is in the first half.
            let is_short = texel == 0 || count == 2 && texel == short;
            let most = if is_short { places.len() / 2 - 1 } else { places.len() - 1 };
            let with = |new: usize| -> (f32, [f32; 3]) {
                let (values, bits) = (&values[part], &bits[part][new]);
                let light = [0, 1, 2].map(|c: usize| found[c] - values[old][c] + values[new][c]);
                let off = [0, 1, 2].map(|c: usize| bits[c] - block.around[c][texel]);
                let squares = off[0] * off[0] + off[1] * off[1] + off[2] * off[2];
                (block.weights[texel] * squares + wanted.all(light), light)
            };
            let (mut least, mut chosen) = (with(old), old);
            for new in [old.wrapping_sub(1), old + 1] {
                if new <= most {
                    let other = with(new);
                    if other.0 < least.0 {
                        (least, chosen) = (other, new);
                    }
                }
            }
            self.lines[part].indices[texel] = chosen as u32;
            for channel in 0..3 {
                self.lines[part].light[channel] += values[part][chosen][channel] - values[part][old][channel];
            }
            found = least.1;
        }
    }

    #[inline(always)]
    fn stored(&self) -> [u8; BYTES] {
        let second = if self.mode.lines == 2 { PARTITIONS[self.partition].second } else { 0 };
        let mut indices = [0; TEXELS];
        for (texel, index) in indices.iter_mut().enumerate() {
            *index = self.lines[usize::from(contains(second, texel))].indices[texel] as usize;
        }
        self.mode.store(&self.colours()[..2 * self.mode.lines], self.partition, &indices)
    }
}
