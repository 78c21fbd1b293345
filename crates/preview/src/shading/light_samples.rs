//! Samples of an environment in proportion to its radiance, and their density in a direction.
//!
//! Each texel of the lat-long grid is a patch of constant radiance over its exact solid angle, as in
//! `shrm::reference::Reference`.
//!
//! The probability of a texel is proportional to the sum of its channels times its solid angle. The inverse
//! of the rows' distribution chooses the row, that of the row's distribution chooses the column, and the
//! direction inside the texel is uniform. The density is computed from the same f32 steps of the
//! distributions that choose, so that rounding causes no bias. A texel whose step rounds to 0 gets only
//! samples of the lobes.
//!
//! The buffer is an array of vec4:
//!
//! | elements | contents |
//! | --- | --- |
//! | 1 | columns W, rows H, the lengths G and G' of the guides of rows and columns |
//! | H + 1 | per row: cos(theta) at its top, the fall to its bottom, 1 / sr, distribution; 0, 0, 0, 1 |
//! | ceil((G + 1) / 4) | the guide of the rows, four entries in each |
//! | H (W + 1) | per row: per texel radiance RGB and the row's distribution at its left edge; 0, 0, 0, 1 |
//! | H ceil((G' + 1) / 4) | per row: the guide of its texels |
//!
//! Entry k of a guide of length G is the last place whose distribution is at most k / G, so that a search
//! tests only a few neighbours (Chen and Asau, "On Generating Random Variates from an Empirical
//! Distribution", 1974). G is a power of two, so that u G is exact. Without light, the distributions are 0 up
//! to their last place.

use std::f32::consts::{PI, TAU};
use std::ops::Range;

use envmap::Environment;
use glam::Vec3;

use super::angles::{angle, circle};

/// An environment that can be sampled.
#[derive(Debug)]
pub struct LightSamples {
    size: [usize; 2],
    /// The lengths of the guides of columns and rows.
    guides: [usize; 2],
    elements: Vec<[f32; 4]>,
    is_lit: bool,
}

/// A direction, the radiance from there, and the density of [`LightSamples::sample`] there, in 1/sr.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightSample {
    /// The direction, a unit vector in the light's frame.
    pub direction: Vec3,
    /// The radiance from the direction, RGB.
    pub radiance: Vec3,
    /// The density of samples.
    pub density: f32,
    /// The row and the column of the texel.
    pub texel: [u32; 2],
}

impl LightSamples {
    /// Prepares the distributions of an environment.
    pub fn new(environment: &Environment) -> Self {
        let grid = environment.grid();
        let (width, height) = (grid.width, grid.height);
        let guides = [width, height].map(guide_length);
        let pixels = || environment.pixels().chunks_exact(width);
        let weight = |pixel: &[f32; 3]| pixel.iter().map(|value| f64::from(value.abs())).sum::<f64>();
        let of_row = |(row, pixels): (usize, &[[f32; 3]])| {
            pixels.iter().map(weight).sum::<f64>() * grid.solid_angle(row)
        };
        let rows: Vec<f64> = pixels().enumerate().map(of_row).collect();
        let geometry = (0..height).map(|row| {
            let top = math::cos(std::f64::consts::PI * row as f64 / height as f64);
            let solid_angle = grid.solid_angle(row);
            let fall = solid_angle * width as f64 / std::f64::consts::TAU;
            [top, fall, 1.0 / solid_angle].map(|number| number as f32)
        });
        let mut elements = vec![[width, height, guides[1], guides[0]].map(|number| number as f32)];
        let mut of_rows = Vec::new();
        distribute(geometry, &rows, &mut elements);
        guide(&elements[1..], guides[1], &mut of_rows);
        elements.append(&mut of_rows);
        let first = elements.len();
        for pixels in pixels() {
            let weights: Vec<f64> = pixels.iter().map(weight).collect();
            distribute(pixels.iter().copied(), &weights, &mut elements);
        }
        for row in 0..height {
            let texels = &elements[first + row * (width + 1)..][..width + 1];
            guide(texels, guides[0], &mut of_rows);
        }
        elements.append(&mut of_rows);
        let is_lit = rows.iter().any(|weight| *weight > 0.0);
        Self { size: [width, height], guides, elements, is_lit }
    }

    /// The elements, for the buffer `light_samples` of the shader.
    pub fn elements(&self) -> &[[f32; 4]] {
        &self.elements
    }

    /// Whether the environment has any light.
    pub fn is_lit(&self) -> bool {
        self.is_lit
    }

    /// The sample for a point of the unit square, if [`LightSamples::is_lit`].
    pub fn sample(&self, point: [f32; 2]) -> LightSample {
        let [width, height] = self.size;
        let row = self.place(1, 2 + height, self.guides[1], point[1]);
        let guide = self.texels(height) + row * (self.guides[0] / 4 + 1);
        let column = self.place(self.texels(row), guide, self.guides[0], point[0]);
        let [top, fall, _, above] = self.elements[1 + row];
        let left = self.elements[self.texels(row) + column][3];
        let (rows, columns) = self.steps(row, column);
        let z = top - (point[1] - above) / rows * fall;
        let across = (point[0] - left) / columns;
        self.lit(direction(z, (column as f32 + across) / width as f32), row, column)
    }

    /// The sample in some texels of a row that have light, for a share of their light and one of the row's
    /// height.
    pub(crate) fn sample_between(&self, row: usize, columns: Range<usize>, point: [f32; 2]) -> LightSample {
        let [width, _] = self.size;
        let texels = self.texels(row);
        let at = |column: usize| self.elements[texels + column][3];
        let share = at(columns.start) + point[0] * (at(columns.end) - at(columns.start));
        let (mut column, mut left) = (columns.start, columns.len());
        while left > 1 {
            let middle = column + left / 2;
            if at(middle) <= share {
                column = middle;
            }
            left -= left / 2;
        }
        let [top, fall, ..] = self.elements[1 + row];
        let across = ((share - at(column)) / (at(column + 1) - at(column)).max(1e-30)).clamp(0.0, 1.0);
        self.lit(direction(top - point[1] * fall, (column as f32 + across) / width as f32), row, column)
    }

    /// The density of [`LightSamples::sample_between`] in a texel, in 1/sr.
    pub(crate) fn density_between(&self, row: usize, columns: Range<usize>, column: usize) -> f32 {
        let [_, _, per_solid_angle, _] = self.elements[1 + row];
        let texels = self.texels(row);
        let between = |columns: Range<usize>| {
            self.elements[texels + columns.end][3] - self.elements[texels + columns.start][3]
        };
        between(column..column + 1) / between(columns).max(1e-30) * per_solid_angle
    }

    /// The share of all samples that are in some texels of a row.
    pub(crate) fn share_between(&self, row: usize, columns: Range<usize>) -> f64 {
        let texels = self.texels(row);
        let of_row = self.elements[2 + row][3] - self.elements[1 + row][3];
        let between = self.elements[texels + columns.end][3] - self.elements[texels + columns.start][3];
        f64::from(of_row) * f64::from(between)
    }

    /// The columns and rows of texels.
    pub(crate) fn size(&self) -> [usize; 2] {
        self.size
    }

    /// The light from a direction, a unit vector.
    pub fn at(&self, direction: Vec3) -> LightSample {
        let [width, height] = self.size;
        let level = direction.truncate().length();
        let row = (angle(level, direction.z) / PI * height as f32) as usize;
        let column = ((0.5 - angle(direction.y, direction.x) / TAU) * width as f32) as usize;
        self.lit(direction, row.min(height - 1), column.min(width - 1))
    }

    /// The light from a direction inside a texel.
    fn lit(&self, direction: Vec3, row: usize, column: usize) -> LightSample {
        let (rows, columns) = self.steps(row, column);
        let [_, _, per_solid_angle, _] = self.elements[1 + row];
        let [r, g, b, _] = self.elements[self.texels(row) + column];
        LightSample {
            direction,
            radiance: Vec3::new(r, g, b),
            density: rows * columns * per_solid_angle,
            texel: [row as u32, column as u32],
        }
    }

    /// The steps of the distributions of rows and columns over a texel.
    fn steps(&self, row: usize, column: usize) -> (f32, f32) {
        let step = |at: usize| self.elements[at + 1][3] - self.elements[at][3];
        (step(1 + row), step(self.texels(row) + column))
    }

    /// The index of a row's first texel; after the last row, that of the first guide.
    fn texels(&self, row: usize) -> usize {
        let [width, height] = self.size;
        2 + height + self.guides[1] / 4 + 1 + row * (width + 1)
    }

    /// The last place whose distribution is at most `share`, which is below 1. The distribution starts at
    /// `first`, and its guide, of length `length`, at `guide`.
    fn place(&self, first: usize, guide: usize, length: usize, share: f32) -> usize {
        let hint = 4 * guide + (share * length as f32) as usize;
        let hints = self.elements.as_flattened();
        let mut place = hints[hint] as usize;
        let mut left = hints[hint + 1] as usize - place + 1;
        while left > 1 {
            let middle = place + left / 2;
            place = if self.elements[first + middle][3] <= share { middle } else { place };
            left -= left / 2;
        }
        place
    }
}

/// The direction at a height, so far around from the left edge of the grid, in turns.
fn direction(z: f32, around: f32) -> Vec3 {
    let level = (1.0 - z * z).max(0.0).sqrt();
    (circle(0.5 - around) * level).extend(z)
}

/// The length of a guide: one entry for four places, so that the places between two entries mostly share a
/// cache line.
fn guide_length(places: usize) -> usize {
    places.div_ceil(4).next_power_of_two()
}

/// Appends values, each with the distribution of the weights before it, and the end of the distribution.
fn distribute(values: impl Iterator<Item = [f32; 3]>, weights: &[f64], elements: &mut Vec<[f32; 4]>) {
    let total: f64 = weights.iter().sum();
    let mut before = 0.0;
    for ([x, y, z], weight) in values.zip(weights) {
        elements.push([x, y, z, if total > 0.0 { (before / total) as f32 } else { 0.0 }]);
        before += weight;
    }
    elements.push([0.0, 0.0, 0.0, 1.0]);
}

/// Appends the guide of a distribution and its end.
fn guide(distribution: &[[f32; 4]], length: usize, elements: &mut Vec<[f32; 4]>) {
    let mut place = 0;
    let mut entry = |k: usize| {
        // The last entry is for shares just below 1.
        let share = (k as f32 / length as f32).min(1.0 - f32::EPSILON / 2.0);
        while distribution[place + 1][3] <= share {
            place += 1;
        }
        place as f32
    };
    elements.extend((0..=length / 4).map(|k| [0, 1, 2, 3].map(|part| entry((4 * k + part).min(length)))));
}
