//! The leaves: cells of equal area in (z, phi), and the way between a place in a leaf and a direction.
//!
//! Row 0 touches the north pole, column 0 begins at phi = 0, and places are fractions of the leaf: t from its
//! northern edge, s from its western edge. z = 1 - 2 (row + t) / rows. All of it is single precision:
//! sin(theta) = sqrt(d (2 - d)) comes from d, the distance of z to the nearer pole, and cos(phi), sin(phi)
//! from the angle to the nearest axis.

use std::f64::consts::{PI, TAU};

use sh::Degree;

/// The grid of leaves: rows equal in z, columns equal in phi.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LeafGrid {
    rows: usize,
}

/// A place: a leaf, and the fractions of it that lie north and west.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct LeafPlace {
    pub(crate) row: usize,
    pub(crate) column: usize,
    pub(crate) t: f32,
    pub(crate) s: f32,
}

/// Fewer rows would not fill the vectors of the kernels.
const LEAST_ROWS: usize = 16;

impl LeafGrid {
    /// The leaves that suffice for a degree: the least power of two of rows that is 3 (degree + 1) or more
    /// (and 16), and twice as many columns. Smaller leaves add little.
    pub fn for_degree(degree: Degree) -> Self {
        Self { rows: (3 * (degree.get() + 1)).next_power_of_two().max(LEAST_ROWS) }
    }

    /// The number of rows, a power of two.
    pub fn rows(self) -> usize {
        self.rows
    }

    /// The number of columns, twice that of the rows.
    pub fn columns(self) -> usize {
        2 * self.rows
    }

    pub(crate) fn leaves(self) -> usize {
        2 * self.rows * self.rows
    }

    /// The solid angle of a leaf, in steradians.
    pub fn area(self) -> f64 {
        4.0 * PI / self.leaves() as f64
    }

    /// How close to its leaf's edges a point may come, in fractions of the leaf along z and phi: what the
    /// rounding of a direction to single precision moves, so that a direction lies in the leaf that it was
    /// drawn in.
    pub(crate) fn margins(self) -> [f32; 2] {
        [2e-7 * self.rows as f32, 3e-7 * self.rows as f32]
    }

    pub(crate) fn locate(self, direction: [f32; 3]) -> LeafPlace {
        let [x, y, z] = direction.map(f64::from);
        let square = x * x + y * y;
        let length = (square + z * z).sqrt();
        let half = self.rows / 2;
        // d = s^2 / (1 + |z|), in rows.
        let down = square / (length * (length + z.abs())) * half as f64;
        let from_pole = (down as usize).min(half - 1);
        let t = down - from_pole as f64;
        let (row, t) = if z < 0.0 { (self.rows - 1 - from_pole, 1.0 - t) } else { (from_pole, t) };
        let turn = math::atan2(y, x) / TAU;
        let along = (turn - turn.floor()) * self.columns() as f64;
        let column = (along as usize).min(self.columns() - 1);
        LeafPlace { row, column, t: t as f32, s: (along - column as f64) as f32 }
    }

    #[inline(always)]
    pub(crate) fn direction(self, row: u32, column: u32, t: f32, s: f32) -> [f32; 3] {
        let (rows, columns) = (self.rows as u32, 2 * self.rows as u32);
        let is_south = 2 * row >= rows;
        let edge = if is_south { rows - row } else { row } as i32 as f32;
        let d = (if is_south { edge - t } else { edge + t }) * (2.0 / rows as f32);
        let z = if is_south { d - 1.0 } else { 1.0 - d };
        let sine = (d * (2.0 - d)).max(0.0).sqrt();
        // Quadrants are centred on the axes.
        let turned = column + columns / 8;
        let quadrant = (turned >> (columns / 4).trailing_zeros()) & 3;
        let offset = (turned & (columns / 4 - 1)) as i32 - (columns / 8) as i32;
        let angle = (offset as f32 + s) * (std::f32::consts::TAU / columns as f32);
        let (a, b) = sin_cos(angle);
        let (x, y) = if quadrant & 1 == 1 { (-a, b) } else { (b, a) };
        let sine = if quadrant & 2 == 2 { -sine } else { sine };
        [sine * x, sine * y, z]
    }
}

/// The sine and cosine of an angle in [-pi/4, pi/4]: the polynomials of Cephes (Moshier), 6e-8.
#[inline(always)]
pub(crate) fn sin_cos(x: f32) -> (f32, f32) {
    let y = x * x;
    let sine = x + x * y * (-0.166_666_55 + y * (8.332_161e-3 - y * 1.951_529_6e-4));
    let cosine = 1.0 - 0.5 * y + y * y * (4.166_664_6e-2 + y * (-1.388_731_6e-3 + y * 2.443_315_7e-5));
    (sine, cosine)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn directions_return_to_their_place() {
        for degree in [0, 7, 19, 200] {
            let grid = LeafGrid::for_degree(Degree::new(degree).unwrap());
            let [edge_t, edge_s] = grid.margins();
            for index in 0..40_000u32 {
                // Golden ratios: every part of the grid, and the edges of leaves.
                let of = |ratio: f64| (f64::from(index) * ratio).fract();
                let row = (of(0.618_034) * grid.rows() as f64) as u32;
                let column = (of(0.754_878) * grid.columns() as f64) as u32;
                let near = |fraction: f64, edge: f32| match index % 4 {
                    0 => edge,
                    1 => 1.0 - edge,
                    _ => (fraction as f32).clamp(edge, 1.0 - edge),
                };
                let (t, s) = (near(of(0.569_84), edge_t), near(of(0.324_718), edge_s));
                let direction = grid.direction(row, column, t, s);
                let length: f32 = direction.iter().map(|x| x * x).sum();
                assert!((length - 1.0).abs() < 4e-7, "{length}");
                let place = grid.locate(direction);
                assert_eq!((place.row as u32, place.column as u32), (row, column), "{t} {s} {direction:?}");
                assert!((place.t - t).abs() < edge_t && (place.s - s).abs() < edge_s, "{place:?} {t} {s}");
            }
        }
    }

    #[test]
    fn leaves_have_equal_areas_and_suffice_for_the_degree() {
        for (degree, rows) in [(0, 16), (4, 16), (5, 32), (19, 64), (20, 64), (21, 128)] {
            let grid = LeafGrid::for_degree(Degree::new(degree).unwrap());
            assert_eq!((grid.rows(), grid.columns()), (rows, 2 * rows));
            assert!((grid.area() * grid.leaves() as f64 - 4.0 * PI).abs() < 1e-14);
        }
    }
}
