//! A block whose texels are as near to what was given as the format allows, in logarithms.
//!
//! Beside one line with 16 places, two lines with 8 places each are tried for the partitions that promise
//! most, which follow colours that change in two directions, as at the edge of a blurred lamp in a blue sky.
//! All two-line modes have the same places, so the one that stores the ends with most bits is the best. Last
//! the ends move by codes as long as that brings the texels nearer.

use super::block::{BYTES, BlockMode, Colours, ONE_LINE, PARTITIONS, TEXELS, TWO_LINES, TexelSet, contains};
use super::line::{ColourLine, ends, fit, least_squares, principal, quantised, through};

/// The number of partitions that are fitted.
const FITTED: usize = 4;

/// The error of a number, in the integers of halves, of which 1024 are a factor of 2, below which one line is
/// good enough.
const ONE_LINE_ERROR: f64 = 3.0;

/// The most sweeps over the ends of a block's lines.
const SWEEPS: usize = 4;

/// The lines of a block, as they are stored.
#[derive(Clone, Copy)]
struct Fitted {
    mode: &'static BlockMode,
    /// The number of the partition; it counts if there are two lines.
    partition: usize,
    /// The texels of each line that count.
    texels: [TexelSet; 2],
    /// If there is one line, the second has no texels.
    lines: [ColourLine; 2],
}

/// A block of colours, of which those of some texels count.
pub(crate) fn encode(colours: &Colours, texels: TexelSet) -> [u8; BYTES] {
    let start = ends(colours, texels);
    let one = ONE_LINE.iter().filter_map(|mode| {
        let line = fit(mode, colours, texels, start)?;
        Some(Fitted {
            mode,
            partition: 0,
            texels: [texels, 0],
            lines: [line, ColourLine { error: 0.0, ..line }],
        })
    });
    // Mode 11 stores any two colours.
    let Some(one) = one.min_by(|a, b| a.error().total_cmp(&b.error())) else { return [0; BYTES] };
    let enough = ONE_LINE_ERROR * ONE_LINE_ERROR * f64::from(3 * texels.count_ones());
    if one.error() <= enough {
        return one.polished(colours).stored();
    }
    let mut promises = promises(colours, texels);
    promises.sort_by(|a, b| a.0.total_cmp(&b.0));
    let two = promises.iter().take(FITTED).filter_map(|&(_, number)| two_lines(colours, texels, number));
    let two = two.min_by(|a, b| a.error().total_cmp(&b.error()));
    two.filter(|two| two.error() < one.error()).unwrap_or(one).polished(colours).stored()
}

/// What each partition promises: the squares off the principal axes of its parts, and those of the steps
/// along them, if a part fills its axis evenly.
fn promises(colours: &Colours, texels: TexelSet) -> Vec<(f64, usize)> {
    let colours = colours.map(|colour| colour.map(f64::from));
    let left = |texels: TexelSet| -> f64 {
        let chosen = || (0..TEXELS).filter(|&texel| contains(texels, texel)).map(|texel| &colours[texel]);
        let count = f64::from(texels.count_ones().max(1));
        let mean = [0, 1, 2].map(|channel| chosen().map(|colour| colour[channel]).sum::<f64>() / count);
        let around: [[f64; 3]; TEXELS] = std::array::from_fn(|texel| {
            let share = if contains(texels, texel) { 1.0 } else { 0.0 };
            std::array::from_fn(|channel| share * (colours[texel][channel] - mean[channel]))
        });
        let covariance: [[f64; 3]; 3] =
            std::array::from_fn(|i| std::array::from_fn(|j| around.iter().map(|a| a[i] * a[j]).sum()));
        let trace = covariance[0][0] + covariance[1][1] + covariance[2][2];
        // The variance of an even spread is a twelfth of its width squared, of a step a 49th of that.
        trace - principal(&covariance).map_or(0.0, |(_, along)| along * (1.0 - 1.0 / 49.0))
    };
    let promise =
        |(number, second): (usize, TexelSet)| (left(texels & !second) + left(texels & second), number);
    PARTITIONS.iter().map(|partition| partition.second).enumerate().map(promise).collect()
}

/// The lines of a partition in the mode with most bits that stores them.
fn two_lines(colours: &Colours, texels: TexelSet, number: usize) -> Option<Fitted> {
    let partition = &PARTITIONS[number];
    let parts = [texels & !partition.second, texels & partition.second];
    let start = parts.map(|texels| ends(colours, texels));
    TWO_LINES.iter().find_map(|mode| {
        let (mut ends, mut best) = (start, None::<Fitted>);
        for _ in 0..3 {
            let codes = ends.map(|ends| quantised(mode, ends));
            let [[a, b], [c, d]] = codes;
            if !mode.stores(&[a, b, c, d]) && !mode.stores(&[b, a, c, d]) {
                break;
            }
            let lines = [0, 1].map(|part| through(mode, colours, parts[part], codes[part]));
            ends = std::array::from_fn(|part| {
                let refined = least_squares(mode, colours, parts[part], &lines[part].indices);
                refined.unwrap_or(ends[part])
            });
            let found = Fitted { mode, partition: number, texels: parts, lines }.storable();
            best = match (best, found) {
                (Some(best), Some(found)) if found.error() < best.error() => Some(found),
                (best, found) => best.or(found),
            };
        }
        best
    })
}

impl Fitted {
    fn error(&self) -> f64 {
        self.lines[0].error + self.lines[1].error
    }

    /// The ends of all lines, in the order of the file.
    fn colours(&self) -> [[i32; 3]; 4] {
        let [[a, b], [c, d]] = self.lines.map(|line| line.ends);
        [a, b, c, d]
    }

    /// The lines in the directions that can be stored; `None` if a difference does not fit.
    fn storable(mut self) -> Option<Self> {
        self.lines[0] = self.lines[0].turned(self.mode, 0);
        if self.mode.lines == 2 {
            self.lines[1] = self.lines[1].turned(self.mode, PARTITIONS[self.partition].short);
        }
        self.mode.stores(&self.colours()[..2 * self.mode.lines]).then_some(self)
    }

    /// Moves the ends by a code or two as long as that brings the texels nearer.
    fn polished(mut self, colours: &Colours) -> Self {
        for _ in 0..SWEEPS {
            let before = self.error();
            for number in 0..12 * self.mode.lines / 2 {
                let (part, end, channel) = (number / 6, number / 3 % 2, number % 3);
                for step in [-1, 1, -2, 2] {
                    let mut ends = self.lines[part].ends;
                    ends[end][channel] += step;
                    if !(0..1 << self.mode.bits).contains(&ends[end][channel]) {
                        continue;
                    }
                    let line = through(self.mode, colours, self.texels[part], ends);
                    if line.error < self.lines[part].error {
                        let mut moved = self;
                        moved.lines[part] = line;
                        self = moved.storable().unwrap_or(self);
                        break;
                    }
                }
            }
            if self.error() >= before {
                break;
            }
        }
        self
    }

    fn stored(&self) -> [u8; BYTES] {
        let second = if self.mode.lines == 2 { PARTITIONS[self.partition].second } else { 0 };
        let indices =
            std::array::from_fn(|texel| self.lines[usize::from(contains(second, texel))].indices[texel]);
        self.mode.store(&self.colours()[..2 * self.mode.lines], self.partition, &indices)
    }
}
