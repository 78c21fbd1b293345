//! The lat-long (equirectangular) grid: row 0 at the top, pixel centres at half texels.

use std::f64::consts::{PI, TAU};

use crate::Direction;

/// A lat-long grid of `height` rows (theta) and `width` columns (phi).
///
/// Row 0 is at the top, toward +Z; the image centre looks along +X, u = 0.25 along +Y:
/// theta = pi v, phi = 2 pi (0.5 - u), with u = (column + 0.5) / width and v = (row + 0.5) / height.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct LatLong {
    /// The number of columns, along phi.
    pub width: usize,
    /// The number of rows, along theta.
    pub height: usize,
}

impl LatLong {
    /// A grid of `height` rows and twice as many columns.
    pub const fn with_rows(height: usize) -> Self {
        Self { width: 2 * height, height }
    }

    /// The number of texels.
    pub const fn len(self) -> usize {
        self.width * self.height
    }

    /// Whether the grid has no texels.
    pub const fn is_empty(self) -> bool {
        self.len() == 0
    }

    /// The colatitude of a row's centres, in radians.
    pub fn theta(self, row: usize) -> f64 {
        PI * (row as f64 + 0.5) / self.height as f64
    }

    /// The azimuth of a column's centres, in (-pi, pi].
    pub fn phi(self, column: usize) -> f64 {
        TAU * (0.5 - (column as f64 + 0.5) / self.width as f64)
    }

    /// The direction of a texel's centre.
    pub fn direction(self, row: usize, column: usize) -> Direction {
        Direction::from_angles(self.theta(row), self.phi(column))
    }

    /// The direction at continuous pixel coordinates (column, row); a texel's centre is at whole numbers.
    pub fn direction_at(self, column: f64, row: f64) -> Direction {
        let theta = PI * (row + 0.5) / self.height as f64;
        Direction::from_angles(theta, TAU * (0.5 - (column + 0.5) / self.width as f64))
    }

    /// Continuous pixel coordinates (column, row) of a direction; a texel's centre is at whole numbers.
    ///
    /// The column lies in [-0.5, width - 0.5], the row in [-0.5, height - 0.5].
    pub fn position(self, direction: Direction) -> (f64, f64) {
        let u = 0.5 - direction.phi() / TAU;
        let v = direction.theta() / PI;
        (u * self.width as f64 - 0.5, v * self.height as f64 - 0.5)
    }

    /// The solid angle of one texel of a row, in steradians. The sum over all texels is 4 pi.
    pub fn solid_angle(self, row: usize) -> f64 {
        let top = PI * row as f64 / self.height as f64;
        let bottom = PI * (row + 1) as f64 / self.height as f64;
        TAU / self.width as f64 * 2.0 * math::sin((top + bottom) / 2.0) * math::sin((bottom - top) / 2.0)
    }
}
