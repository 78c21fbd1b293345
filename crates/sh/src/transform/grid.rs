//! The grids that a transform works on: rows of constant colatitude, equally spaced columns.

use std::f64::consts::TAU;

use sphere::{Direction, LatLong};

use crate::quadrature;

/// Rows at the Gauss-Legendre colatitudes, columns as in a lat-long image.
///
/// Half as many rows as a pixel-centred grid needs integrate the same degree exactly: degree + 1 rows.
#[derive(Clone, Debug, PartialEq)]
pub struct GaussGrid {
    width: usize,
    theta: Vec<f64>,
    weights: Vec<f64>,
}

impl GaussGrid {
    /// A grid of `width` columns and `height` rows; O(height^2).
    pub fn new(width: usize, height: usize) -> Self {
        let (theta, weights) = quadrature::gauss_legendre(height);
        Self { width, theta, weights }
    }

    /// The number of columns, along phi.
    pub fn width(&self) -> usize {
        self.width
    }

    /// The number of rows, along theta.
    pub fn height(&self) -> usize {
        self.theta.len()
    }

    /// The colatitude of a row, in radians, rising with the row.
    pub fn theta(&self, row: usize) -> f64 {
        self.theta[row]
    }

    /// The azimuth of a column's centres, in (-pi, pi], as in a lat-long image.
    pub fn phi(&self, column: usize) -> f64 {
        LatLong { width: self.width, height: self.height() }.phi(column)
    }

    /// The direction of a sample.
    pub fn direction(&self, row: usize, column: usize) -> Direction {
        Direction::from_angles(self.theta(row), self.phi(column))
    }

    /// The quadrature weight of one sample of a row, in steradians; all samples together make 4 pi.
    pub fn solid_angle(&self, row: usize) -> f64 {
        TAU / self.width as f64 * self.weights[row]
    }

    /// The Gauss-Legendre weights of the rows; they sum to 2.
    pub(crate) fn weights(&self) -> &[f64] {
        &self.weights
    }
}

/// A grid of a [`crate::Transform`]; pixels go row by row from the top, columns from the left.
#[derive(Clone, Debug, PartialEq)]
pub enum Grid {
    /// Pixel-centred rows: a lat-long image.
    LatLong(LatLong),
    /// Rows at the Gauss-Legendre colatitudes.
    Gauss(GaussGrid),
}

impl Grid {
    /// The number of columns, along phi.
    pub fn width(&self) -> usize {
        match self {
            Self::LatLong(grid) => grid.width,
            Self::Gauss(grid) => grid.width(),
        }
    }

    /// The number of rows, along theta.
    pub fn height(&self) -> usize {
        match self {
            Self::LatLong(grid) => grid.height,
            Self::Gauss(grid) => grid.height(),
        }
    }

    /// The number of pixels.
    pub fn len(&self) -> usize {
        self.width() * self.height()
    }

    /// Whether the grid has no pixel.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The direction of a pixel's centre.
    pub fn direction(&self, row: usize, column: usize) -> Direction {
        match self {
            Self::LatLong(grid) => grid.direction(row, column),
            Self::Gauss(grid) => grid.direction(row, column),
        }
    }

    /// (cosine, sine) of the colatitude of a northern row, 2 * row < height.
    pub(crate) fn cosine_sine(&self, row: usize) -> (f64, f64) {
        let height = self.height();
        match self {
            Self::LatLong(grid) => {
                // The cosine as a sine of the latitude: relative accuracy near the equator, zero on it.
                let latitude = std::f64::consts::PI * (height - 1 - 2 * row) as f64 / (2 * height) as f64;
                (math::sin(latitude), math::sin(grid.theta(row)))
            }
            Self::Gauss(_) if 2 * row + 1 == height => (0.0, 1.0),
            Self::Gauss(grid) => (math::cos(grid.theta(row)), math::sin(grid.theta(row))),
        }
    }
}

impl From<LatLong> for Grid {
    fn from(grid: LatLong) -> Self {
        Self::LatLong(grid)
    }
}

impl From<GaussGrid> for Grid {
    fn from(grid: GaussGrid) -> Self {
        Self::Gauss(grid)
    }
}
