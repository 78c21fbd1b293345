//! Texels that are far brighter than their surroundings, and how resampling preserves their energy.
//!
//! Resampling blends texels at points of the new grid. Over a smooth picture the small errors of that
//! quadrature cancel, but those of a sun of one texel do not. So resampling sums, for each such texel, the
//! solid angles of its weights to c, and scales its radiance by w / c, with w its own solid angle: its energy
//! is then preserved exactly, and values stay non-negative.

use std::sync::atomic::{AtomicU64, Ordering};

use rayon::prelude::*;

use crate::texels::{Taps, Texels};

/// A bright texel is this many times brighter than the mean of the 5 x 5 pixels around it that the layout
/// uses.
const BRIGHTER: f32 = 2.0;

/// Solid angles are summed as whole numbers of 2^-58 sr, so that the order of threads does not matter; 4 pi
/// fits into 64 bits.
const UNIT: f64 = (1u64 << 58) as f64;

/// The bright texels of a picture.
pub(crate) struct BrightTexels {
    width: usize,
    /// Whether each texel is bright; empty if none is.
    is_bright: Vec<bool>,
    /// For each texel, the number of bright ones above and to the left of it and itself; empty if none is.
    counts: Vec<u32>,
    /// The bright texels, ascending.
    texels: Vec<usize>,
    /// The solid angle that each bright texel received.
    given: Vec<AtomicU64>,
}

impl BrightTexels {
    /// Finds the bright texels of a picture of `width` columns; all layouts are searched as flat pictures.
    pub(crate) fn find<T: Texels>(picture: T, width: usize, pixels: &[[f32; 3]]) -> Self {
        let height = pixels.len() / width;
        // The brightness, and 1 for a pixel that the layout uses.
        let weighed = |texel: usize| match picture.uses(texel) {
            true => [pixels[texel].iter().fold(0.0, |sum, value| sum + value.abs()), 1.0],
            false => [0.0, 0.0],
        };
        let mut is_bright = vec![false; pixels.len()];
        let bright_of_row = |columns: &mut Vec<[f32; 2]>, (row, is_bright): (usize, &mut [bool])| {
            columns.clear();
            columns.resize(width, [0.0; 2]);
            for near in row.saturating_sub(2)..(row + 3).min(height) {
                for (column, sum) in columns.iter_mut().enumerate() {
                    let value = weighed(near * width + column);
                    *sum = [sum[0] + value[0], sum[1] + value[1]];
                }
            }
            for (column, is_bright) in is_bright.iter_mut().enumerate() {
                let near = &columns[column.saturating_sub(2)..(column + 3).min(width)];
                let [light, count] =
                    near.iter().fold([0.0; 2], |sum, near| [sum[0] + near[0], sum[1] + near[1]]);
                // light / count is the mean; unused pixels are 0, so that they are never brighter.
                *is_bright = weighed(row * width + column)[0] * count > BRIGHTER * light;
            }
        };
        is_bright.par_chunks_mut(width).enumerate().for_each_init(Vec::new, bright_of_row);
        let texels: Vec<usize> = is_bright
            .iter()
            .enumerate()
            .filter(|(_, is_bright)| **is_bright)
            .map(|(texel, _)| texel)
            .collect();
        if texels.is_empty() {
            is_bright = Vec::new();
        }
        let mut counts = vec![0; is_bright.len()];
        for (row, is_bright) in is_bright.chunks(width).enumerate() {
            let mut in_row = 0;
            for (column, is_bright) in is_bright.iter().enumerate() {
                in_row += u32::from(*is_bright);
                let above = if row == 0 { 0 } else { counts[(row - 1) * width + column] };
                counts[row * width + column] = above + in_row;
            }
        }
        let given = texels.iter().map(|_| AtomicU64::new(0)).collect();
        Self { width, is_bright, counts, texels, given }
    }

    /// Whether the picture has no bright texel.
    pub(crate) fn is_empty(&self) -> bool {
        self.texels.is_empty()
    }

    /// Whether one of the texels in these columns and rows is bright, first and last included.
    pub(crate) fn is_within(&self, columns: [usize; 2], rows: [usize; 2]) -> bool {
        let count = |column: usize, row: usize| match (column, row) {
            (0, _) | (_, 0) => 0,
            _ => self.counts[(row - 1) * self.width + column - 1],
        };
        let [(left, right), (top, bottom)] = [columns, rows].map(|[first, last]| (first, last + 1));
        count(right, bottom) + count(left, top) > count(left, bottom) + count(right, top)
    }

    /// Adds to the solid angle that a texel received, if it is bright.
    pub(crate) fn give(&self, texel: usize, solid_angle: f64) {
        if !self.is_bright[texel] {
            return;
        }
        if let Ok(index) = self.texels.binary_search(&texel) {
            self.given[index].fetch_add((solid_angle * UNIT) as u64, Ordering::Relaxed);
        }
    }

    /// Gives the texels that make up the radiance of a point their shares of its solid angle.
    pub(crate) fn give_taps(&self, taps: Taps, solid_angle: f64) {
        for (texel, weight) in taps.index.into_iter().zip(taps.weight) {
            self.give(texel, weight * solid_angle);
        }
    }

    /// Scales the bright texels among `pixels` so that they keep their energy, and returns those that no
    /// point of the new grid has sampled, with their solid angles.
    pub(crate) fn balance<T: Texels>(&self, picture: T, pixels: &mut [[f32; 3]]) -> Vec<(usize, f64)> {
        let mut unseen = Vec::new();
        for (&texel, given) in self.texels.iter().zip(&self.given) {
            let own = picture.solid_angle(texel);
            let given = given.load(Ordering::Relaxed) as f64 / UNIT;
            if given < 1e-3 * own {
                unseen.push((texel, own));
                continue;
            }
            for value in &mut pixels[texel] {
                *value = ((f64::from(*value) * own / given) as f32).clamp(f32::MIN, f32::MAX);
            }
        }
        unseen
    }
}
