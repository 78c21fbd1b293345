//! Light as texels to be sampled: one number for each, none below zero.

use envmap::Environment;
use sphere::{Direction, LatLong};

use crate::{ChannelWeights, Error};

/// Distant light whose texels are sampled as they are: constant in each, not interpolated.
///
/// The number of a texel is a weighted sum of its channels, in the unit of radiance. What is negative is
/// taken as 0.
#[derive(Clone, Debug, PartialEq)]
pub struct TexelLight {
    grid: LatLong,
    /// The numbers of the texels, relative to the largest.
    values: Vec<f32>,
    largest: f64,
}

impl TexelLight {
    /// The texels of an environment.
    ///
    /// # Errors
    /// [`Error::TexelNotFinite`] with the first number that is NaN or infinite, which weights can make;
    /// [`Error::NoMass`] if none is positive.
    pub fn new(environment: &Environment, weights: ChannelWeights) -> Result<Self, Error> {
        let grid = environment.grid();
        let weigh = |rgb: &[f32; 3]| rgb.iter().zip(weights).map(|(value, w)| f64::from(*value) * w).sum();
        let values: Vec<f64> = environment.pixels().iter().map(weigh).collect();
        if let Some(index) = values.iter().position(|value| !value.is_finite()) {
            let (row, column) = (index / grid.width, index % grid.width);
            return Err(Error::TexelNotFinite { row, column, value: values[index] });
        }
        let largest = values.iter().fold(0.0, |largest: f64, value| largest.max(*value));
        if !largest.recip().is_finite() {
            return Err(Error::NoMass);
        }
        let values = values.iter().map(|value| (value / largest).max(0.0) as f32).collect();
        Ok(Self { grid, values, largest })
    }

    /// The grid of the texels.
    pub fn grid(&self) -> LatLong {
        self.grid
    }

    /// The number of a texel, 0 or more, to single precision.
    pub fn value(&self, row: usize, column: usize) -> f64 {
        f64::from(self.relative(row, column)) * self.largest
    }

    /// The number of the texel that a direction looks at.
    pub fn toward(&self, direction: Direction) -> f64 {
        let (column, row) = self.grid.position(direction);
        let nearest = |place: f64, count: usize| ((place + 0.5).max(0.0) as usize).min(count - 1);
        self.value(nearest(row, self.grid.height), nearest(column, self.grid.width))
    }

    /// The number of a texel over the largest.
    pub(crate) fn relative(&self, row: usize, column: usize) -> f32 {
        self.values[row * self.grid.width + column]
    }

    pub(crate) fn largest(&self) -> f64 {
        self.largest
    }
}
