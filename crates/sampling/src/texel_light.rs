//! Light as texels to be sampled: one number for each, none below zero.

use envmap::Environment;
use sh::Haar;
use sphere::LatLong;

use crate::{ChannelWeights, Error};

/// Distant light whose texels are sampled as they are: constant in each, not interpolated.
///
/// The number of a texel is a weighted sum of its channels, in the unit of radiance. What is negative is
/// taken as 0 and reported by [`TexelLight::negative_share`].
#[derive(Clone, Debug, PartialEq)]
pub struct TexelLight {
    grid: LatLong,
    /// The numbers of the texels, relative to the largest.
    values: Vec<f32>,
    largest: f64,
    negative_share: f64,
}

impl TexelLight {
    /// The texels of an environment.
    ///
    /// # Errors
    /// [`Error::NoMass`] if none is positive.
    pub fn new(environment: &Environment, weights: ChannelWeights) -> Result<Self, Error> {
        let weigh = |rgb: &[f32; 3]| rgb.iter().zip(weights).map(|(value, w)| f64::from(*value) * w).sum();
        let values: Vec<f64> = environment.pixels().iter().map(weigh).collect();
        Self::from_values(environment.grid(), &values)
    }

    /// The texels that Haar wavelets of an image add up to, row by row from the top: light that is held as
    /// its few largest coefficients ([`Haar::keep_largest`]), as in wavelet importance sampling.
    ///
    /// The wavelets are those of the lat-long image's radiance, orthonormal over the image: a coefficient
    /// near a pole counts as much as one at the horizon. What is left of them after others were dropped may
    /// be negative in places. No direction is drawn there, so that an estimate of the *original* light
    /// misses what it has there; [`TexelLight::negative_share`] reports how much the wavelets have.
    ///
    /// # Errors
    /// [`Error::TexelNotFinite`] with the first value that is NaN or infinite; [`Error::NoMass`] if none is
    /// positive.
    ///
    /// # Panics
    /// If the number of coefficients is not that of the texels.
    ///
    /// # Example: the constant alone is the mean of the texels
    /// ```
    /// use sampling::TexelLight;
    /// use sphere::LatLong;
    ///
    /// let mut texels = [[1.0]; 8];
    /// texels[3] = [9.0];
    /// let mut haar = sh::Haar::of(2, 4, &texels)?;
    /// haar.keep_largest(1);
    /// let light = TexelLight::from_haar(LatLong { width: 4, height: 2 }, &haar)?;
    /// assert!((light.value(1, 3) - 2.0).abs() < 1e-12);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn from_haar(grid: LatLong, haar: &Haar<1>) -> Result<Self, Error> {
        Self::from_values(grid, haar.values().as_flattened())
    }

    fn from_values(grid: LatLong, values: &[f64]) -> Result<Self, Error> {
        assert_eq!(values.len(), grid.len(), "one value for each texel");
        if let Some(index) = values.iter().position(|value| !value.is_finite()) {
            let (row, column) = (index / grid.width, index % grid.width);
            return Err(Error::TexelNotFinite { row, column, value: values[index] });
        }
        let largest = values.iter().fold(0.0, |largest: f64, value| largest.max(*value));
        if !largest.recip().is_finite() {
            return Err(Error::NoMass);
        }
        let (mut negative, mut all) = (0.0, 0.0);
        for (row, texels) in values.chunks_exact(grid.width).enumerate() {
            let sum = |f: fn(f64) -> f64| texels.iter().map(|value| f(value / largest)).sum::<f64>();
            negative += sum(|value| (-value).max(0.0)) * grid.solid_angle(row);
            all += sum(f64::abs) * grid.solid_angle(row);
        }
        let values = values.iter().map(|value| (value / largest).max(0.0) as f32).collect();
        Ok(Self { grid, values, largest, negative_share: negative / all })
    }

    /// The grid of the texels.
    pub fn grid(&self) -> LatLong {
        self.grid
    }

    /// The number of a texel, 0 or more, to single precision.
    pub fn value(&self, row: usize, column: usize) -> f64 {
        f64::from(self.relative(row, column)) * self.largest
    }

    /// The share of the integral of the absolute value, over the sphere, that was negative and is 0 now.
    pub fn negative_share(&self) -> f64 {
        self.negative_share
    }

    /// The number of a texel over the largest.
    pub(crate) fn relative(&self, row: usize, column: usize) -> f32 {
        self.values[row * self.grid.width + column]
    }

    pub(crate) fn largest(&self) -> f64 {
        self.largest
    }
}
