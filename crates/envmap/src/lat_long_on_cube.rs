//! The points of a lat-long image under the texels of a cube, without an arc tangent for each.
//!
//! The coordinates of the image are almost linear across a texel of the cube, so they are computed at the
//! corners of the texels and interpolated between them. On a face about the horizon that is off by no more
//! than an eighth of the squared texel, 1e-5 rad for faces of 256; toward a pole, at a distance of n texels,
//! by 1 / (8 n) of a texel, so that points near the pole are computed one by one.
//!
//! The four faces about the horizon differ by quarter turns, and the lower polar face is the upper one upside
//! down: two tables serve all six.

use std::f64::consts::{PI, TAU};

use rayon::prelude::*;
use sphere::{Cube, Face, LatLong};

use crate::bright_texels::BrightTexels;
use crate::canvas::{Canvas, CubeCanvas, MOST_POINTS};
use crate::resample::{Points, by_taps, points_of_texel};
use crate::texels::{Taps, Texels};

/// Raised when the results of this kernel change: every kind of stage that calls it adds this to its own
/// revision.
pub const REVISION: u32 = 1;

/// Texels around a pole whose points are computed one by one.
const NEAR_POLE: usize = 8;

/// The number of points along the side of a square texel of the image.
const PER_TEXEL: f64 = 2.0;

/// A lat-long image under a cube.
pub(crate) struct LatLongOnCube {
    picture: LatLong,
    canvas: CubeCanvas,
    edge: usize,
    /// The column of the corners of the face about +X, left to right: 0 in the middle.
    columns: Vec<f64>,
    /// The rows of the corners of a face about the horizon.
    rows: Vec<f64>,
    /// The column and row of the corners of the upper polar face.
    polar: Vec<[f64; 2]>,
    /// The solid angle per area of a face, at the corners.
    density: Vec<f64>,
}

/// The numbers that are interpolated over a texel: column, row, density.
type Corner = [f64; 3];

impl LatLongOnCube {
    pub(crate) fn new(picture: LatLong, cube: Cube) -> Self {
        let edge = cube.edge;
        let side = edge + 1;
        let at = |corner: usize| 2.0 * corner as f64 / edge as f64 - 1.0;
        let (width, height) = (picture.width as f64, picture.height as f64);
        let table = |value: &(dyn Fn(f64, f64) -> f64 + Sync)| -> Vec<f64> {
            (0..side * side).into_par_iter().map(|index| value(at(index % side), at(index / side))).collect()
        };
        let polar = |index: usize| {
            let (s, t) = (at(index % side), at(index / side));
            [-math::atan2(-s, t) / TAU * width, math::atan(math::hypot(s, t)) / PI * height]
        };
        Self {
            picture,
            canvas: CubeCanvas(cube),
            edge,
            columns: (0..side).map(|corner| math::atan(at(corner)) / TAU * width).collect(),
            rows: table(&|s, t| math::atan2((1.0 + s * s).sqrt(), -t) / PI * height),
            polar: (0..side * side).into_par_iter().map(polar).collect(),
            density: table(&|s, t| math::pow(1.0 + s * s + t * t, -1.5)),
        }
    }

    /// The corners of a texel, in the order (left, top), (right, top), (left, bottom), (right, bottom), with
    /// continuous coordinates of the picture; the column may be up to a turn past either side. `None` near a
    /// pole.
    fn corners(&self, face: Face, row: usize, column: usize) -> Option<[Corner; 4]> {
        let (edge, side) = (self.edge, self.edge + 1);
        let width = self.picture.width as f64;
        let corner = |k: usize| (row + k / 2, column + k % 2);
        let density = |k: usize| {
            let (row, column) = corner(k);
            self.density[row * side + column]
        };
        // The azimuth of the middle is 0, -90, 90 or 180 degrees; columns count against it from the middle.
        let middle = match face {
            Face::PositiveX => 0.75,
            Face::NegativeX => 0.25,
            Face::PositiveZ => 0.5,
            Face::NegativeZ => 0.0,
            Face::PositiveY | Face::NegativeY => {
                let from_middle = |k: usize| (2 * k + 1).abs_diff(edge);
                if from_middle(row).max(from_middle(column)) < 2 * NEAR_POLE {
                    return None;
                }
                let is_lower = face == Face::NegativeY;
                let mut corners = std::array::from_fn(|k| {
                    let (row, column) = corner(k);
                    let row = if is_lower { edge - row } else { row };
                    let [x, y] = self.polar[row * side + column];
                    let y = if is_lower { self.picture.height as f64 - y } else { y };
                    [x + 0.5 * width - 0.5, y - 0.5, density(k)]
                });
                // Corners on both sides of the seam: all on the side of the first.
                let first = corners[0][0];
                for corner in &mut corners {
                    corner[0] -= ((corner[0] - first) / width).round() * width;
                }
                return Some(corners);
            }
        };
        Some(std::array::from_fn(|k| {
            let (row, column) = corner(k);
            let x = middle * width + self.columns[column] - 0.5;
            [x, self.rows[row * side + column] - 0.5, density(k)]
        }))
    }
}

/// A texel whose taps lie next to each other in the picture: no seam and no pole is between them.
struct Inside {
    corners: [Corner; 4],
    /// The first and last column and row among the taps.
    columns: [usize; 2],
    rows: [usize; 2],
}

impl LatLongOnCube {
    fn inside(&self, row: usize, column: usize) -> Option<Inside> {
        let mut corners = self.corners(Face::ALL[row / self.edge], row % self.edge, column)?;
        let turn = (corners[0][0] / self.picture.width as f64).floor() * self.picture.width as f64;
        corners.iter_mut().for_each(|corner| corner[0] -= turn);
        let span = |axis: usize, length: usize| {
            let of = corners.map(|corner| corner[axis]);
            let (least, most) = (of.into_iter().fold(f64::MAX, f64::min), of.into_iter().fold(0.0, f64::max));
            (least >= 0.0 && most < (length - 1) as f64).then(|| [least as usize, most as usize + 1])
        };
        let (columns, rows) = (span(0, self.picture.width)?, span(1, self.picture.height)?);
        Some(Inside { corners, columns, rows })
    }
}

impl Points for LatLongOnCube {
    type Canvas = CubeCanvas;

    fn canvas(&self) -> &CubeCanvas {
        &self.canvas
    }

    fn visit(&self, row: usize, column: usize, mut visit: impl FnMut(Taps, f64)) {
        let (face, row_of_face) = (Face::ALL[row / self.edge], row % self.edge);
        let Some(corners) = self.corners(face, row_of_face, column) else {
            let (across, down) = points_of_texel(self.picture, &self.canvas, row, column);
            self.canvas.points(row, column, across, down, |direction, solid_angle| {
                visit(self.picture.taps(direction), solid_angle);
            });
            return;
        };
        let points = points_between(&corners);
        let area = 4.0 / ((self.edge * self.edge * points * points) as f64);
        between(&corners, points, |[column, row, density]| {
            visit(Taps::of_lat_long(self.picture, column, row), area * density);
        });
    }

    fn mean(&self, pixels: &[[f32; 3]], row: usize, column: usize) -> [f32; 3] {
        let Some(Inside { corners, .. }) = self.inside(row, column) else {
            return by_taps(self, pixels, row, column);
        };
        let width = self.picture.width;
        let (mut sum, mut total) = ([0.0; 3], 0.0);
        between(&corners, points_between(&corners), |[x, y, density]| {
            let (left, top) = (x as usize, y as usize);
            let (right, lower) = ((x - left as f64) as f32, (y - top as f64) as f32);
            let first = top * width + left;
            let (upper_row, lower_row) = (&pixels[first..][..2], &pixels[first + width..][..2]);
            // Steps from pixel to pixel, not weights: a constant picture stays constant to the last bit.
            let step = |a: f32, b: f32, share: f32| a + share * (b - a);
            for channel in 0..3 {
                let above = step(upper_row[0][channel], upper_row[1][channel], right);
                let below = step(lower_row[0][channel], lower_row[1][channel], right);
                sum[channel] += density * f64::from(step(above, below, lower));
            }
            total += density;
        });
        sum.map(|sum| (sum / total) as f32)
    }

    fn is_lit_by(&self, bright: &BrightTexels, row: usize, column: usize) -> bool {
        self.inside(row, column).is_none_or(|inside| bright.is_within(inside.columns, inside.rows))
    }
}

/// The number of points that a texel needs along each side.
fn points_between(corners: &[Corner; 4]) -> usize {
    let diagonal = |from: usize, to: usize| [0, 1].map(|axis| corners[to][axis] - corners[from][axis]);
    let ([a, b], [c, d]) = (diagonal(0, 3), diagonal(1, 2));
    let pixels = 0.5 * (a * d - b * c).abs();
    (PER_TEXEL * pixels.sqrt()).round().clamp(1.0, MOST_POINTS as f64) as usize
}

/// Calls `visit` with the numbers at `points`^2 points spread evenly between four corners.
fn between(corners: &[Corner; 4], points: usize, mut visit: impl FnMut(Corner)) {
    let [top_left, top_right, bottom_left, bottom_right] = corners;
    let step = 1.0 / points as f64;
    let mix = |a: &Corner, b: &Corner, share: f64| -> Corner {
        std::array::from_fn(|k| a[k] + share * (b[k] - a[k]))
    };
    for y in 0..points {
        let t = (y as f64 + 0.5) * step;
        let (left, right) = (mix(top_left, bottom_left, t), mix(top_right, bottom_right, t));
        for x in 0..points {
            visit(mix(&left, &right, (x as f64 + 0.5) * step));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Compares every point with its arc tangents, on sizes at which the poles are and are not between
    /// texels.
    #[test]
    fn points_are_where_their_directions_are() {
        for (edge, rows) in [(64, 100), (33, 64), (5, 8)] {
            let (picture, cube) = (LatLong::with_rows(rows), Cube { edge });
            let points = LatLongOnCube::new(picture, cube);
            // A function that is linear in the taps' coordinates everywhere but at the seam.
            let place = |taps: Taps| {
                let mut sum = [0.0; 2];
                for (index, weight) in taps.index.into_iter().zip(taps.weight) {
                    let phi = TAU * (index % picture.width) as f64 / picture.width as f64;
                    sum[0] += weight * (phi.sin() + 0.3 * phi.cos());
                    sum[1] += weight * (index / picture.width) as f64 / picture.height as f64;
                }
                sum
            };
            let mut whole = 0.0;
            for row in 0..6 * edge {
                for column in 0..edge {
                    let mut found = Vec::new();
                    points.visit(row, column, |taps, solid_angle| found.push((place(taps), solid_angle)));
                    let along = (found.len() as f64).sqrt() as usize;
                    let mut expected = Vec::new();
                    points.canvas.points(row, column, along, along, |direction, solid_angle| {
                        expected.push((place(picture.taps(direction)), solid_angle));
                    });
                    assert_eq!(found.len(), expected.len());
                    for ((found, given), (expected, solid_angle)) in found.iter().zip(&expected) {
                        let limit = 2.0 / (edge * edge) as f64 + 0.02 / edge as f64;
                        for (found, expected) in found.iter().zip(expected) {
                            assert!((found - expected).abs() < limit, "{row} {column}: {found} {expected}");
                        }
                        assert!((given / solid_angle - 1.0).abs() < 2.0 * limit, "{given} {solid_angle}");
                        whole += given;
                    }
                }
            }
            assert!((whole / (4.0 * PI) - 1.0).abs() < 1.0 / (edge * edge) as f64, "{edge}: {whole}");
        }
    }
}
