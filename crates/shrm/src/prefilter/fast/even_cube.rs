//! Cubes whose texels are even in angle, each face with a border of its neighbours' texels.
//!
//! A face has coordinates p and q in [-1, 1], with u = tan(pi p / 4) and v = tan(pi q / 4) where an ordinary
//! cube has u and v. The Laplacian of the sphere is then, with A = 1 + u^2 and B = 1 + v^2,
//!
//! > (4 / pi)^2 (1 + u^2 + v^2) / (A B) [d_pp + d_qq + (v d_p + u d_q)^2],
//!
//! the last square without the derivatives of v and u. It has no first derivative, so that a kernel that is
//! even in p and q does not move light; and what a kernel of equal variance along p and q lacks to be round
//! on the sphere is a spread along (v, u) alone.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI};

use envmap::CubeMap;
use rayon::prelude::*;
use sphere::{Cube, Face};

/// A texel's red, green and blue, and a weight.
pub(super) type Texel = [f32; 4];

/// Adds a multiple of a texel.
pub(super) fn add(sum: &mut Texel, weight: f32, texel: &Texel) {
    (0..4).for_each(|lane| sum[lane] += weight * texel[lane]);
}

/// Converts p to s (or q to t), both as shares of the edge.
pub(super) fn from_even(p: f64) -> f64 {
    0.5 + 0.5 * math::tan(FRAC_PI_4 * (2.0 * p - 1.0))
}

/// Converts s to p (or t to q), both as shares of the edge.
pub(super) fn to_even(s: f64) -> f64 {
    0.5 + 0.5 * math::atan(2.0 * s - 1.0) / FRAC_PI_4
}

/// A cube map on even texels: six faces in file order, rows from the top.
#[derive(Debug)]
pub(super) struct EvenCube {
    edge: usize,
    /// The texels of all faces with their borders, (edge + 2)^2 of each face.
    texels: Vec<Texel>,
}

impl EvenCube {
    /// How often [`EvenCube::rounded`] spreads a level, and the variance along p and along q of each spread,
    /// in texels. Each adds 1/2 along (v, u), and all bring the 1/2 of two quadratic B-splines to
    /// [`EvenCube::VARIANCE`].
    const PASSES: usize = 4;
    const OF_PASS: f32 = (Self::VARIANCE as f32 - 0.5) / Self::PASSES as f32;

    /// The variance in texels, along p in the middle of a face, of what [`EvenCube::rounded`] and then
    /// interpolation by quadratic B-splines make of a point.
    pub(super) const VARIANCE: f64 = Self::PASSES as f64 / 2.0;

    /// Makes a black cube.
    pub(super) fn black(edge: usize) -> Self {
        Self { edge, texels: vec![[0.0; 4]; 6 * (edge + 2).pow(2)] }
    }

    /// The number of texels along the edge of a face, without its border.
    pub(super) fn edge(&self) -> usize {
        self.edge
    }

    /// A row of a face with its border: row 0 is the border itself.
    pub(super) fn row(&self, face: usize, row: usize) -> &[Texel] {
        &self.texels[self.index(face, row, 0)..][..self.edge + 2]
    }

    fn index(&self, face: usize, row: usize, column: usize) -> usize {
        let stride = self.edge + 2;
        (face * stride + row) * stride + column
    }

    /// A cube whose rows are made from a face, a row (without the border) and its black texels.
    fn made(edge: usize, make: impl Fn(usize, usize, &mut [Texel]) + Sync) -> Self {
        let mut cube = Self::black(edge);
        let stride = edge + 2;
        cube.texels.par_chunks_mut(stride).enumerate().with_min_len(8).for_each(|(index, texels)| {
            let (face, row) = (index / stride, index % stride);
            if (1..=edge).contains(&row) {
                make(face, row - 1, &mut texels[1..=edge]);
            }
        });
        cube.fill_border();
        cube
    }

    /// A border lies in the first row of texels of the next face, but between their centres: it is
    /// interpolated there along the row, by a cubic.
    fn fill_border(&mut self) {
        let edge = self.edge;
        let past = math::tan(FRAC_PI_4 * (1.0 + 1.0 / edge as f64));
        let between: Vec<_> = (0..edge)
            .map(|along| {
                let u = 2.0 * from_even((along as f64 + 0.5) / edge as f64) - 1.0;
                cubic(to_even(0.5 + 0.5 * u / past) * edge as f64 - 0.5, edge)
            })
            .collect();
        for face in 0..6 {
            let near = SIDES.map(|side| self.next_row(face, side));
            for (side, line) in SIDES.into_iter().zip(&near) {
                for (along, (first, weights)) in between.iter().enumerate() {
                    let mut sum = [0.0; 4];
                    for (texel, weight) in line[*first..].iter().zip(weights) {
                        add(&mut sum, *weight, texel);
                    }
                    let index = self.border_index(face, side, along + 1);
                    self.texels[index] = sum;
                }
            }
            // A corner lies on the edge between the two next faces. The middle of their first texels is half
            // a texel too near, which makes light in a corner of the cube rounder than the right place
            // would.
            for (row, of_row) in [(0, &near[2]), (edge + 1, &near[3])] {
                for (column, of_column) in [(0, &near[0]), (edge + 1, &near[1])] {
                    let (a, b) = (of_column[row.min(edge - 1)], of_row[column.min(edge - 1)]);
                    let index = self.index(face, row, column);
                    self.texels[index] = std::array::from_fn(|lane| 0.5 * (a[lane] + b[lane]));
                }
            }
        }
    }

    fn border_index(&self, face: usize, side: Side, along: usize) -> usize {
        let outside = if side.is_far { self.edge + 1 } else { 0 };
        if side.is_column { self.index(face, along, outside) } else { self.index(face, outside, along) }
    }

    /// The texels of the next face that touch a side, in the order of the side.
    fn next_row(&self, face: usize, side: Side) -> Vec<Texel> {
        let edge = self.edge;
        let probe = |along: f64| {
            let past = if side.is_far { 1.01 } else { -0.01 };
            let (s, t) = if side.is_column { (past, along) } else { (along, past) };
            let cube = Cube { edge };
            cube.position(cube.direction_at(Face::ALL[face], s, t))
        };
        let ((next, s0, t0), (_, s1, t1)) = (probe(0.25), probe(0.75));
        let is_column = (s1 - s0).abs() < (t1 - t0).abs();
        let (across, is_reversed) = if is_column { (s0, t1 < t0) } else { (t0, s1 < s0) };
        let line = if across < 0.5 { 1 } else { edge };
        let texel = |along: usize| {
            let along = if is_reversed { edge - along } else { along + 1 };
            let (row, column) = if is_column { (along, line) } else { (line, along) };
            self.texels[self.index(next as usize, row, column)]
        };
        (0..edge).map(texel).collect()
    }

    /// Takes an ordinary cube to even texels of the same number: the mean over each, with weight 1.
    pub(super) fn of(map: &CubeMap) -> Self {
        let edge = map.cube().edge;
        let spans: Vec<CoveredTexels> = (0..edge).map(|index| CoveredTexels::new(index, edge)).collect();
        Self::made(edge, |face, row, texels| {
            let mut means = vec![[0.0; 4]; edge];
            for (pixels, weight) in spans[row].parts() {
                let pixels = &map.pixels()[(face * edge + pixels) * edge..][..edge];
                for (mean, [r, g, b]) in means.iter_mut().zip(pixels) {
                    add(mean, weight, &[*r, *g, *b, 1.0]);
                }
            }
            for (texel, span) in texels.iter_mut().zip(&spans) {
                span.parts().for_each(|(column, weight)| add(texel, weight, &means[column]));
            }
        })
    }

    /// Halves the edge, by a quadratic B-spline over 4 x 4 texels.
    pub(super) fn halved(&self) -> Self {
        const OUTER: f32 = 0.125;
        const INNER: f32 = 0.375;
        Self::made(self.edge / 2, |face, row, texels| {
            let rows: [&[Texel]; 4] = std::array::from_fn(|k| self.row(face, 2 * row + k));
            let column = |x: usize| -> Texel {
                let [a, b, c, d] = rows.map(|row| row[x]);
                std::array::from_fn(|lane| OUTER * (a[lane] + d[lane]) + INNER * (b[lane] + c[lane]))
            };
            let (mut a, mut b) = (column(0), column(1));
            for (x, texel) in texels.iter_mut().enumerate() {
                let (c, d) = (column(2 * x + 2), column(2 * x + 3));
                *texel =
                    std::array::from_fn(|lane| OUTER * (a[lane] + d[lane]) + INNER * (b[lane] + c[lane]));
                (a, b) = (c, d);
            }
        })
    }

    /// Doubles the edge, by the subdivision of quadratic B-splines, and adds a further cube times a weight
    /// for each texel of a face.
    pub(super) fn doubled(&self, more: Option<(&Self, &[f32])>) -> Self {
        let edge = 2 * self.edge;
        Self::made(edge, |face, row, texels| {
            let (near, far) = (row / 2 + 1, if row % 2 == 0 { row / 2 } else { row / 2 + 2 });
            let (near, far) = (self.row(face, near), self.row(face, far));
            let column = |x: usize| -> Texel {
                std::array::from_fn(|lane| 0.75 * near[x][lane] + 0.25 * far[x][lane])
            };
            let (mut a, mut b) = (column(0), column(1));
            for (x, pair) in texels.chunks_exact_mut(2).enumerate() {
                let c = column(x + 2);
                pair[0] = std::array::from_fn(|lane| 0.25 * a[lane] + 0.75 * b[lane]);
                pair[1] = std::array::from_fn(|lane| 0.75 * b[lane] + 0.25 * c[lane]);
                (a, b) = (b, c);
            }
            if let Some((cube, weights)) = more {
                let weights = &weights[row * edge..][..edge];
                for ((texel, weight), other) in
                    texels.iter_mut().zip(weights).zip(&cube.row(face, row + 1)[1..])
                {
                    add(texel, *weight, other);
                }
            }
        })
    }

    /// The cube with spots that are round on the sphere and as large everywhere but for a seventh: after
    /// interpolation by quadratic B-splines, a point of light has become a spot of [`EvenCube::VARIANCE`]
    /// times (texel pi / 4)^2 A B / (1 + u^2 + v^2).
    ///
    /// `halvings` is how often the cube was halved since [`EvenCube::of`], and `pixel` the size, in radians,
    /// of the pixels between which the light was interpolated linearly before that.
    pub(super) fn rounded(&self, halvings: usize, pixel: f64) -> Self {
        let scale = math::powi(0.25_f64, halvings.min(30) as i32);
        // Where a quadratic B-spline has 1/4, the first cube has the means over a pixel and a texel, and the
        // linear interpolation, which is round on the sphere.
        let interpolated = math::powi(pixel / (FRAC_PI_2 / self.edge as f64), 2) / 6.0;
        let axis: Vec<FaceLine> = (0..self.edge)
            .map(|index| {
                let u = 2.0 * from_even((index as f64 + 0.5) / self.edge as f64) - 1.0;
                let lacking =
                    scale * (1.0 / 6.0 - math::powi(4.0 / PI / (1.0 + u * u), 2) / 12.0) - interpolated;
                FaceLine {
                    u: u as f32,
                    lacking: lacking as f32,
                    slope: (-interpolated / (1.0 + u * u)) as f32,
                }
            })
            .collect();
        let mut spread = self.spread(&axis, 1.0);
        for _ in 1..Self::PASSES {
            spread = spread.spread(&axis, 0.0);
        }
        spread
    }

    /// The cube plus half a variance times its second differences. The variance in texels is
    /// [`EvenCube::OF_PASS`] along p and q, `share` of what they lack at each [`FaceLine`], and 1/2 times
    /// (v, u) along that.
    fn spread(&self, axis: &[FaceLine], share: f32) -> Self {
        Self::made(self.edge, |face, row, texels| {
            let rows: [&[Texel]; 3] = std::array::from_fn(|k| self.row(face, row + k));
            let down = axis[row];
            for (x, (texel, across)) in texels.iter_mut().zip(axis).enumerate() {
                let [u2, v2] = [across.u * across.u, down.u * down.u];
                let slanted = 0.25 * (across.u * down.u).abs();
                let even = 0.5 * Self::OF_PASS - slanted;
                let (left, right) = if across.u * down.u > 0.0 { (0, 2) } else { (2, 0) };
                let (across, down) = (
                    even + 0.25 * v2 + 0.5 * share * (across.lacking + across.slope * v2),
                    even + 0.25 * u2 + 0.5 * share * (down.lacking + down.slope * u2),
                );
                let centre = 1.0 - 2.0 * (across + down + slanted);
                *texel = std::array::from_fn(|lane| {
                    centre * rows[1][x + 1][lane]
                        + across * (rows[1][x][lane] + rows[1][x + 2][lane])
                        + down * (rows[0][x + 1][lane] + rows[2][x + 1][lane])
                        + slanted * (rows[left][x][lane] + rows[right][x + 2][lane])
                });
            }
        })
    }
}

/// A row or a column of a face.
#[derive(Clone, Copy)]
struct FaceLine {
    /// The coordinate u of a column, or v of a row.
    u: f32,
    /// The variance across, in texels, that a spot lacks there: this and `slope` times the square of the
    /// other coordinate.
    lacking: f32,
    slope: f32,
}

/// A side of a face.
#[derive(Clone, Copy)]
struct Side {
    is_column: bool,
    /// Whether the side is the right or the bottom one.
    is_far: bool,
}

/// The sides of a face: left, right, top, bottom.
const SIDES: [Side; 4] = [
    Side { is_column: true, is_far: false },
    Side { is_column: true, is_far: true },
    Side { is_column: false, is_far: false },
    Side { is_column: false, is_far: true },
];

/// The cubic (with fewer than four texels, the highest polynomial) through texels about `x`: the first of
/// them, and their weights.
fn cubic(x: f64, edge: usize) -> (usize, [f32; 4]) {
    let points = edge.min(4);
    let first = ((x - 1.0).max(0.0) as usize).min(edge - points);
    let x = x - first as f64;
    let weight = |k: usize| -> f64 {
        let others = (0..points).filter(|other| *other != k);
        others.map(|other| (x - other as f64) / (k as f64 - other as f64)).product()
    };
    (first, std::array::from_fn(|k| if k < points { weight(k) as f32 } else { 0.0 }))
}

/// The texels of an ordinary row that an even texel covers. In the corner of a face it is pi / 2 of them
/// long.
struct CoveredTexels {
    first: usize,
    shares: [f32; 4],
}

impl CoveredTexels {
    fn new(index: usize, edge: usize) -> Self {
        let [from, to] = [index, index + 1].map(|end| from_even(end as f64 / edge as f64) * edge as f64);
        let first = (from.max(0.0) as usize).min(edge - 1);
        let share = |k: usize| {
            let left = (first + k) as f64;
            if first + k < edge {
                ((to.min(left + 1.0) - from.max(left)) / (to - from)).max(0.0)
            } else {
                0.0
            }
        };
        Self { first, shares: std::array::from_fn(|k| share(k) as f32) }
    }

    /// Lists the texels and their shares.
    fn parts(&self) -> impl Iterator<Item = (usize, f32)> {
        let parts = self.shares.iter().enumerate().filter(|(_, share)| **share > 0.0);
        parts.map(|(k, share)| (self.first + k, *share))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cube_of(edge: usize, value: impl Fn(sphere::DVec3) -> f64) -> EvenCube {
        let at = |index: usize| from_even((index as f64 + 0.5) / edge as f64);
        let mut cube = EvenCube::black(edge);
        for face in 0..6 {
            for row in 0..edge {
                for column in 0..edge {
                    let direction = Cube { edge }.direction_at(Face::ALL[face], at(column), at(row));
                    let index = cube.index(face, row + 1, column + 1);
                    cube.texels[index] = [value(direction.vector()) as f32; 4];
                }
            }
        }
        cube.fill_border();
        cube
    }

    /// The border continues a face over its edge: there, too, it holds a smooth function's value. Corners are
    /// off by half a texel.
    #[test]
    fn a_border_holds_what_lies_past_the_edge() {
        let value = |w: sphere::DVec3| w.x + 2.0 * w.y - 0.5 * w.z + w.x * w.y;
        for (edge, bound) in [(4, 6e-2), (16, 3e-4), (64, 2e-6)] {
            let cube = cube_of(edge, value);
            let at = |index: usize| from_even((index as f64 - 0.5) / edge as f64);
            let mut worst = [0.0_f64; 2];
            for face in 0..6 {
                for (row, column) in
                    (0..edge + 2).flat_map(|row| (0..edge + 2).map(move |column| (row, column)))
                {
                    let there = Cube { edge }.direction_at(Face::ALL[face], at(column), at(row));
                    let error = (f64::from(cube.row(face, row)[column][0]) - value(there.vector())).abs();
                    let is_end = |index: usize| index == 0 || index == edge + 1;
                    let worst = &mut worst[usize::from(is_end(row) && is_end(column))];
                    *worst = worst.max(error);
                }
            }
            assert!(worst[0] < bound && worst[1] < 1.0 / edge as f64, "{edge}: {worst:?}");
        }
    }

    /// Halving and rounding are sums of the light with weights of sum 1.
    #[test]
    fn what_is_constant_stays_so() {
        let cube = cube_of(8, |_| 1.0);
        for cube in [cube.halved(), cube.rounded(0, 0.1), cube.doubled(None)] {
            assert!(cube.texels.as_flattened().iter().all(|value| (value - 1.0).abs() < 1e-6));
        }
    }
}
