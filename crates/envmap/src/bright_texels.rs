//! Texels that are far brighter than their surroundings, and how resampling preserves their energy.
//!
//! Resampling blends texels at points of the new grid. Over a smooth picture the small errors of that
//! quadrature cancel, but those of a sun of one texel do not. So resampling sums, for each such texel, the
//! solid angles of its weights to c, and scales its radiance by w / c, with w its own solid angle: its energy
//! is then preserved exactly, and values stay non-negative.

use std::ops::Range;
use std::sync::atomic::{AtomicU64, Ordering};

use rayon::prelude::*;

use crate::pixels::Pixels;
use crate::texels::{Taps, Texels};

/// A bright texel is this many times brighter than the mean of the 5 x 5 pixels around it that the layout
/// uses.
const BRIGHTER: f32 = 2.0;

/// Solid angles are summed as whole numbers of 2^-58 sr, so that the order of threads does not matter; 4 pi
/// fits into 64 bits.
const UNIT: f64 = (1u64 << 58) as f64;

/// The rows that a thread searches at once: whole words of `is_bright` for every width.
const ROWS: usize = 64;

/// The bright texels of a picture.
pub(crate) struct BrightTexels {
    width: usize,
    /// A bit for each texel: whether it is bright; empty if none is.
    is_bright: Vec<u64>,
    /// The bright texels and their radiance, ascending.
    texels: Vec<(u32, [f32; 3])>,
    /// The solid angle that each bright texel received.
    given: Vec<AtomicU64>,
}

/// What keeps the energy of bright texels.
pub(crate) struct EnergyBalance {
    /// Radiance in place of that of bright texels.
    pub(crate) scaled: Vec<(u32, [f32; 3])>,
    /// The bright texels that no point of the new grid has sampled, and their radiance.
    pub(crate) unseen: Vec<(usize, [f32; 3])>,
}

/// Some rows of a picture, with two more above and below if it has them.
struct Near<'a, T> {
    picture: T,
    width: usize,
    /// The number of rows of the whole picture.
    height: usize,
    /// The first of the rows that are there.
    first: usize,
    pixels: &'a [[f32; 3]],
}

impl<T: Texels> Near<'_, T> {
    fn pixel(&self, texel: usize) -> [f32; 3] {
        self.pixels[texel - self.first * self.width]
    }

    /// The brightness of a texel, and 1 for one that the layout uses.
    fn weighed(&self, texel: usize) -> [f32; 2] {
        match self.picture.uses(texel) {
            true => [self.pixel(texel).iter().fold(0.0, |sum, value| sum + value.abs()), 1.0],
            false => [0.0, 0.0],
        }
    }

    /// The bright texels of some rows and their radiance; their bits are set in `words`, which begin with the
    /// first of these rows. `columns` is for sums.
    fn bright(
        &self,
        rows: Range<usize>,
        columns: &mut Vec<[f32; 2]>,
        words: &mut [u64],
    ) -> Vec<(u32, [f32; 3])> {
        let width = self.width;
        let mut texels = Vec::new();
        for row in rows.clone() {
            columns.clear();
            columns.resize(width, [0.0; 2]);
            for near in row.saturating_sub(2)..(row + 3).min(self.height) {
                for (column, sum) in columns.iter_mut().enumerate() {
                    let value = self.weighed(near * width + column);
                    *sum = [sum[0] + value[0], sum[1] + value[1]];
                }
            }
            for column in 0..width {
                let near = &columns[column.saturating_sub(2)..(column + 3).min(width)];
                let [light, count] =
                    near.iter().fold([0.0; 2], |sum, near| [sum[0] + near[0], sum[1] + near[1]]);
                let texel = row * width + column;
                // light / count is the mean; unused pixels are 0, so that they are never brighter.
                if self.weighed(texel)[0] * count > BRIGHTER * light {
                    let bit = texel - rows.start * width;
                    words[bit / 64] |= 1 << (bit % 64);
                    texels.push((texel as u32, self.pixel(texel)));
                }
            }
        }
        texels
    }
}

impl BrightTexels {
    /// Finds the bright texels of a picture; all layouts are searched as flat pictures.
    pub(crate) fn find<T: Texels>(picture: T, pixels: &Pixels) -> Self {
        let (width, height) = (pixels.width(), pixels.height());
        let mut is_bright = vec![0_u64; (width * height).div_ceil(64)];
        let mut texels = Vec::new();
        let parts = (pixels.rows_of_band() / ROWS).max(1);
        let mut scratch = Vec::new();
        for (band, words) in is_bright.chunks_mut(parts * ROWS * width / 64).enumerate() {
            let rows = band * parts * ROWS..((band + 1) * parts * ROWS).min(height);
            let around = rows.start.saturating_sub(2)..(rows.end + 2).min(height);
            let near = Near {
                picture,
                width,
                height,
                first: around.start,
                pixels: pixels.band(around, &mut scratch),
            };
            let parts = words.par_chunks_mut(ROWS * width / 64).enumerate();
            let found = parts.map_init(Vec::new, |columns, (part, words)| {
                let first = rows.start + part * ROWS;
                near.bright(first..(first + ROWS).min(rows.end), columns, words)
            });
            texels.extend(found.collect::<Vec<_>>().into_iter().flatten());
        }
        if texels.is_empty() {
            is_bright = Vec::new();
        }
        let given = texels.iter().map(|_| AtomicU64::new(0)).collect();
        Self { width, is_bright, texels, given }
    }

    /// Whether the picture has no bright texel.
    pub(crate) fn is_empty(&self) -> bool {
        self.texels.is_empty()
    }

    /// Whether one of the texels in these columns and rows is bright, first and last included.
    pub(crate) fn is_within(&self, columns: [usize; 2], rows: [usize; 2]) -> bool {
        (rows[0]..=rows[1]).any(|row| {
            let [first, last] = columns.map(|column| row * self.width + column);
            (first / 64..=last / 64).any(|word| {
                let from = if word == first / 64 { first % 64 } else { 0 };
                let until = if word == last / 64 { last % 64 } else { 63 };
                self.is_bright[word] & (u64::MAX << from) & (u64::MAX >> (63 - until)) != 0
            })
        })
    }

    /// Adds to the solid angle that a texel received, if it is bright.
    pub(crate) fn give(&self, texel: usize, solid_angle: f64) {
        if self.is_bright[texel / 64] & (1 << (texel % 64)) == 0 {
            return;
        }
        if let Ok(index) = self.texels.binary_search_by_key(&texel, |(texel, _)| *texel as usize) {
            self.given[index].fetch_add((solid_angle * UNIT) as u64, Ordering::Relaxed);
        }
    }

    /// Gives the texels that make up the radiance of a point their shares of its solid angle.
    pub(crate) fn give_taps(&self, taps: Taps, solid_angle: f64) {
        for (texel, weight) in taps.index.into_iter().zip(taps.weight) {
            self.give(texel, weight * solid_angle);
        }
    }

    /// Scales the bright texels so that they keep their energy.
    pub(crate) fn balance<T: Texels>(&self, picture: T) -> EnergyBalance {
        let mut balanced = EnergyBalance { scaled: Vec::new(), unseen: Vec::new() };
        for (&(texel, radiance), given) in self.texels.iter().zip(&self.given) {
            let own = picture.solid_angle(texel as usize);
            let given = given.load(Ordering::Relaxed) as f64 / UNIT;
            if given < 1e-3 * own {
                balanced.unseen.push((texel as usize, radiance));
                continue;
            }
            let scale = |value: f32| (f64::from(value) * own / given) as f32;
            balanced.scaled.push((texel, radiance.map(|value| scale(value).clamp(f32::MIN, f32::MAX))));
        }
        balanced
    }
}
