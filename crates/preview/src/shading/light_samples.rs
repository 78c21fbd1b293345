//! Samples of an environment by its radiance, and how dense they lie in a direction.
//!
//! The environment is taken as it is measured: each texel of the lat-long grid is a patch of constant radiance over its
//! exact solid angle. `shrm::reference::Reference` sums the same patches with rho_hat at their centres, the midpoint
//! rule: both agree to the square of a texel's size times the curvature of rho_hat, h^2 s / 24 for a lobe of exponent s.
//!
//! A texel is chosen with a probability in proportion to the sum of its channels times its solid angle: the row by the
//! inverse of the rows' distribution, the column by that of the row's; the direction within it is uniform. The density
//! that is told is made of the same f32 steps of the distributions that choose, so that rounding makes no bias; a
//! texel whose step rounds to nothing is left to the samples of the lobes.
//!
//! The buffer is an array of vec4, RGB in x to z:
//!
//! | elements | what |
//! | --- | --- |
//! | 1 | columns W, rows H, whether there is light (1) or none (0), 0 |
//! | H | per row: cos(theta) at its upper edge, how far that falls to its lower edge, 1 / solid angle of a texel, the distribution at its upper edge |
//! | W H | per texel, rows from the top: radiance RGB, the row's distribution at its left edge |

use std::f32::consts::{PI, TAU};

use envmap::Environment;
use glam::Vec3;

use super::angles::{angle, circle};

/// An environment that can be sampled.
#[derive(Debug)]
pub struct LightSamples {
    size: [usize; 2],
    elements: Vec<[f32; 4]>,
}

/// A direction, what comes from there, and the density of [`LightSamples::sample`] there, in 1/sr.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lit {
    /// A unit vector in the light's frame.
    pub direction: Vec3,
    /// RGB.
    pub radiance: Vec3,
    /// The density of samples.
    pub density: f32,
}

impl LightSamples {
    /// Prepares the distributions of an environment.
    pub fn new(environment: &Environment) -> Self {
        let grid = environment.grid();
        let weight = |pixel: &[f32; 3]| pixel.iter().map(|value| f64::from(value.abs())).sum::<f64>();
        let rows: Vec<f64> = environment
            .pixels()
            .chunks_exact(grid.width)
            .enumerate()
            .map(|(row, pixels)| pixels.iter().map(weight).sum::<f64>() * grid.solid_angle(row))
            .collect();
        let total: f64 = rows.iter().sum();
        let lit = if total > 0.0 { 1.0 } else { 0.0 };
        let mut elements = Vec::with_capacity(1 + grid.height + grid.len());
        elements.push([grid.width as f32, grid.height as f32, lit, 0.0]);
        let mut above = 0.0;
        for (row, weight) in rows.iter().enumerate() {
            let edge = |row: usize| (std::f64::consts::PI * row as f64 / grid.height as f64).cos();
            let share = if total > 0.0 { above / total } else { 0.0 };
            let solid_angle = grid.solid_angle(row);
            let fall = solid_angle * grid.width as f64 / std::f64::consts::TAU;
            elements.push([edge(row) as f32, fall as f32, (1.0 / solid_angle) as f32, share as f32]);
            above += weight;
        }
        for pixels in environment.pixels().chunks_exact(grid.width) {
            let total: f64 = pixels.iter().map(weight).sum();
            let mut left = 0.0;
            for pixel in pixels {
                let share = if total > 0.0 { left / total } else { 0.0 };
                elements.push([pixel[0], pixel[1], pixel[2], share as f32]);
                left += weight(pixel);
            }
        }
        Self { size: [grid.width, grid.height], elements }
    }

    /// The elements, for the buffer `light_samples` of the shader.
    pub fn elements(&self) -> &[[f32; 4]] {
        &self.elements
    }

    /// Whether any light comes from anywhere.
    pub fn is_lit(&self) -> bool {
        self.elements[0][2] > 0.0
    }

    /// The direction for a point of the unit square, where [`LightSamples::is_lit`].
    pub fn sample(&self, point: [f32; 2]) -> Lit {
        let [width, height] = self.size;
        let row = self.last(1, height, point[1]);
        let first = 1 + height + row * width;
        let column = self.last(first, width, point[0]);
        let (above, below) = self.step(1, height, row);
        let (left, right) = self.step(first, width, column);
        let [top, fall, per_solid_angle, _] = self.elements[1 + row];
        let z = top - (point[1] - above) / (below - above) * fall;
        let across = (point[0] - left) / (right - left);
        let [cosine, sine] = circle(0.5 - (column as f32 + across) / width as f32).to_array();
        let level = (1.0 - z * z).max(0.0).sqrt();
        let [r, g, b, _] = self.elements[first + column];
        Lit {
            direction: Vec3::new(level * cosine, level * sine, z),
            radiance: Vec3::new(r, g, b),
            density: (below - above) * (right - left) * per_solid_angle,
        }
    }

    /// What comes from a direction, a unit vector.
    pub fn at(&self, direction: Vec3) -> Lit {
        let [width, height] = self.size;
        let level = direction.truncate().length();
        let phi = angle(direction.y, direction.x);
        let row = (angle(level, direction.z) / PI * height as f32) as usize;
        let row = row.min(height - 1);
        let column = ((0.5 - phi / TAU) * width as f32) as usize;
        let column = column.min(width - 1);
        let first = 1 + height + row * width;
        let (above, below) = self.step(1, height, row);
        let (left, right) = self.step(first, width, column);
        let [r, g, b, _] = self.elements[first + column];
        let density = (below - above) * (right - left) * self.elements[1 + row][2];
        Lit { direction, radiance: Vec3::new(r, g, b), density }
    }

    /// The last of `count` elements from `first` on whose distribution is at most `share`, which is below 1.
    fn last(&self, first: usize, count: usize, share: f32) -> usize {
        let (mut low, mut high) = (0, count);
        while high - low > 1 {
            let middle = (low + high) / 2;
            if self.elements[first + middle][3] <= share { low = middle } else { high = middle }
        }
        low
    }

    /// The distribution at both edges of one of `count` elements from `first` on.
    fn step(&self, first: usize, count: usize, at: usize) -> (f32, f32) {
        let after = if at + 1 < count { self.elements[first + at + 1][3] } else { 1.0 };
        (self.elements[first + at][3], after)
    }
}
