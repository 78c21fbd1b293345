//! The grids that pictures are resampled to: the places of their texels, and the sample points of each.

use std::f64::consts::{PI, TAU};

use sphere::{Cube, Direction, Face, LatLong};

/// The most texels of an environment: 2^28, which take 3 GiB.
pub(crate) const MOST_TEXELS: usize = 1 << 28;

/// The most points along one side of a texel.
pub(crate) const MOST_POINTS: usize = 16;

/// A grid of texels on the sphere, row by row.
pub(crate) trait Canvas: Sync {
    /// The number of texels of a row.
    fn width(&self) -> usize;

    fn rows(&self) -> usize;

    /// The centre of a texel, and its extents across and down, in radians.
    fn extent(&self, row: usize, column: usize) -> (Direction, f64, f64);

    /// Calls `visit` with `across` x `down` points spread evenly over a texel, and the solid angle of each.
    ///
    /// Both numbers are from 1 to [`MOST_POINTS`].
    fn points(
        &self,
        row: usize,
        column: usize,
        across: usize,
        down: usize,
        visit: impl FnMut(Direction, f64),
    );

    /// The solid angle of a texel, in steradians.
    fn solid_angle(&self, row: usize, column: usize) -> f64;

    /// The row and column of the texel that holds a direction.
    fn texel(&self, direction: Direction) -> (usize, usize);
}

/// A lat-long grid; sines and cosines come from tables and sums of angles.
pub(crate) struct LatLongCanvas {
    grid: LatLong,
    /// The sine and cosine of theta, by row.
    theta: Vec<(f64, f64)>,
    /// The sine and cosine of phi, by column.
    phi: Vec<(f64, f64)>,
    /// The sine and cosine of the offsets of the points from the centre of a texel, by the number of points
    /// minus 1.
    down: Vec<Vec<(f64, f64)>>,
    across: Vec<Vec<(f64, f64)>>,
}

impl LatLongCanvas {
    pub(crate) fn new(grid: LatLong) -> Self {
        let offsets = |step: f64| {
            (1..=MOST_POINTS)
                .map(|n| {
                    (0..n)
                        .map(|k| math::sin_cos(step * ((k as f64 + 0.5) / n as f64 - 0.5)))
                        .collect::<Vec<_>>()
                })
                .collect::<Vec<_>>()
        };
        Self {
            grid,
            theta: (0..grid.height).map(|row| math::sin_cos(grid.theta(row))).collect(),
            phi: (0..grid.width).map(|column| math::sin_cos(grid.phi(column))).collect(),
            down: offsets(PI / grid.height as f64),
            across: offsets(TAU / grid.width as f64),
        }
    }
}

/// The sine and cosine of a sum of angles.
fn sum((sin_a, cos_a): (f64, f64), (sin_b, cos_b): (f64, f64)) -> (f64, f64) {
    (sin_a * cos_b + cos_a * sin_b, cos_a * cos_b - sin_a * sin_b)
}

impl Canvas for LatLongCanvas {
    fn width(&self) -> usize {
        self.grid.width
    }

    fn rows(&self) -> usize {
        self.grid.height
    }

    fn extent(&self, row: usize, column: usize) -> (Direction, f64, f64) {
        let ((sine, cosine), (sin_phi, cos_phi)) = (self.theta[row], self.phi[column]);
        let centre = Direction::from_unit([sine * cos_phi, sine * sin_phi, cosine].into());
        let down = PI / self.grid.height as f64;
        // A texel is widest at its side toward the equator.
        let widest = (sine + cosine.abs() * down / 2.0).min(1.0);
        (centre, widest * TAU / self.grid.width as f64, down)
    }

    fn points(
        &self,
        row: usize,
        column: usize,
        across: usize,
        down: usize,
        mut visit: impl FnMut(Direction, f64),
    ) {
        let step = PI / (self.grid.height * down) as f64;
        let area = TAU / (self.grid.width * across) as f64 * 2.0 * math::sin(step / 2.0);
        for &offset in &self.down[down - 1] {
            let (sine, cosine) = sum(self.theta[row], offset);
            for &offset in &self.across[across - 1] {
                let (sin_phi, cos_phi) = sum(self.phi[column], offset);
                let point = Direction::from_unit([sine * cos_phi, sine * sin_phi, cosine].into());
                visit(point, area * sine);
            }
        }
    }

    fn solid_angle(&self, row: usize, _column: usize) -> f64 {
        self.grid.solid_angle(row)
    }

    fn texel(&self, direction: Direction) -> (usize, usize) {
        let (x, y) = self.grid.position(direction);
        let at = |x: f64, length: usize| ((x + 0.5).max(0.0) as usize).min(length - 1);
        (at(y, self.grid.height), at(x, self.grid.width))
    }
}

/// A cube; its rows are those of the six faces, one face after the other.
pub(crate) struct CubeCanvas(pub(crate) Cube);

impl CubeCanvas {
    fn face(&self, row: usize) -> (Face, usize) {
        (Face::ALL[row / self.0.edge], row % self.0.edge)
    }
}

impl Canvas for CubeCanvas {
    fn width(&self) -> usize {
        self.0.edge
    }

    fn rows(&self) -> usize {
        6 * self.0.edge
    }

    fn extent(&self, row: usize, column: usize) -> (Direction, f64, f64) {
        let (face, row) = self.face(row);
        let centre = self.0.direction(face, row, column);
        // A step in the plane of the face turns the direction by no more than step / rho.
        let extent = 2.0 / self.0.edge as f64 * centre.vector().abs().max_element();
        (centre, extent, extent)
    }

    fn points(
        &self,
        row: usize,
        column: usize,
        across: usize,
        down: usize,
        mut visit: impl FnMut(Direction, f64),
    ) {
        let (face, row) = self.face(row);
        let edge = self.0.edge as f64;
        let area = 4.0 / (edge * edge * (across * down) as f64);
        for y in 0..down {
            let t = (row as f64 + (y as f64 + 0.5) / down as f64) / edge;
            for x in 0..across {
                let s = (column as f64 + (x as f64 + 0.5) / across as f64) / edge;
                let point = self.0.direction_at(face, s, t);
                // dw = dA / rho^3
                visit(point, area * math::powi(point.vector().abs().max_element(), 3));
            }
        }
    }

    fn solid_angle(&self, row: usize, column: usize) -> f64 {
        self.0.solid_angle(row % self.0.edge, column)
    }

    fn texel(&self, direction: Direction) -> (usize, usize) {
        let (face, s, t) = self.0.position(direction);
        let at = |s: f64| ((s * self.0.edge as f64) as usize).min(self.0.edge - 1);
        (face as usize * self.0.edge + at(t), at(s))
    }
}
