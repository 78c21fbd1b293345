//! The lat-long map of OpenEXR's `envmap` attribute.
//!
//! It has the orientation of [`crate::LatLong`] (image centre +Z_file = +X, left quarter +X_file = +Y), but
//! its texels are nodes, not cells: the first and last rows lie on the poles, and the last column repeats the
//! first. Definition: `LatLongMap::direction` and `pixelPosition` in `ImfEnvmap.cpp` of OpenEXR: latitude =
//! pi (0.5 - row / (height - 1)), longitude = 2 pi (0.5 - column / (width - 1)).

use std::f64::consts::{PI, TAU};

use crate::Direction;

/// A lat-long image whose outer texels lie on the poles and on the seam.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct OpenExrLatLong {
    /// The number of columns, at least 2; the last repeats the first.
    pub width: usize,
    /// The number of rows, at least 2; the first and the last are the poles.
    pub height: usize,
}

impl OpenExrLatLong {
    /// The direction of a texel.
    pub fn direction(self, row: usize, column: usize) -> Direction {
        self.direction_at(column as f64, row as f64)
    }

    /// The direction at continuous pixel coordinates (column, row); texels are at whole numbers.
    pub fn direction_at(self, column: f64, row: f64) -> Direction {
        Direction::from_angles(
            PI * row / (self.height - 1) as f64,
            TAU * (0.5 - column / (self.width - 1) as f64),
        )
    }

    /// Continuous pixel coordinates (column, row) of a direction; texels are at whole numbers.
    ///
    /// The column lies in [0, width - 1], the row in [0, height - 1].
    pub fn position(self, direction: Direction) -> (f64, f64) {
        let u = 0.5 - direction.phi() / TAU;
        let v = direction.theta() / PI;
        (u * (self.width - 1) as f64, v * (self.height - 1) as f64)
    }

    /// The solid angle of the cell around a texel, cut at the poles and the seam, in steradians. The sum over
    /// all cells is 4 pi.
    pub fn solid_angle(self, row: usize, column: usize) -> f64 {
        let step = PI / (self.height - 1) as f64;
        let top = step * (row as f64 - 0.5).max(0.0);
        let bottom = step * (row as f64 + 0.5).min((self.height - 1) as f64);
        let columns = if column == 0 || column == self.width - 1 { 0.5 } else { 1.0 };
        columns * TAU / (self.width - 1) as f64
            * 2.0
            * math::sin((top + bottom) / 2.0)
            * math::sin((bottom - top) / 2.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn solid_angles_make_4_pi() {
        for (width, height) in [(2, 2), (3, 2), (9, 5), (64, 32)] {
            let map = OpenExrLatLong { width, height };
            let sum: f64 =
                (0..width * height).map(|texel| map.solid_angle(texel / width, texel % width)).sum();
            assert!((sum - 4.0 * PI).abs() < 1e-12, "{width} x {height}: {sum}");
        }
    }

    proptest! {
        #[test]
        fn direction_undoes_position(theta in 0.0..PI, phi in -PI..PI) {
            let map = OpenExrLatLong { width: 129, height: 65 };
            let direction = Direction::from_angles(theta, phi);
            let (x, y) = map.position(direction);
            let back = map.direction_at(x, y);
            prop_assert!((back.vector() - direction.vector()).length() < 1e-13);
        }
    }
}
