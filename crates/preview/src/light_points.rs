//! Points that follow a light: the more of them a texel has, the brighter it is.

use std::f64::consts::FRAC_2_SQRT_PI;

use envmap::Environment;
use sampling::{Error, ProductSampler, ProductTables, SUM, Tables, TexelLight};
use sh::Degree;

/// 1 / sqrt(4 pi), the first harmonic.
const Y00: f64 = FRAC_2_SQRT_PI / 4.0;

/// The texels of a light, and the directions of points that follow them.
pub(crate) struct LightPoints {
    pub(crate) texels: TexelLight,
    pub(crate) directions: Vec<[f32; 3]>,
    /// The integral of the sum of the light's channels, in the unit of radiance times sr.
    pub(crate) integral: f64,
}

impl LightPoints {
    /// The directions of points of the unit square.
    ///
    /// # Errors
    /// [`Error::NoMass`] if no texel is positive.
    pub(crate) fn new(environment: &Environment, points: &[[f32; 2]]) -> Result<Self, Error> {
        let texels = TexelLight::new(environment, SUM)?;
        // The product of the light and a constant is the light.
        let tables = ProductTables::new(&texels, &Tables::new(Degree::ZERO));
        let sampler = ProductSampler::new(&tables, &[Y00.recip()], Default::default())?;
        let mut directions = vec![[0.0; 3]; points.len()];
        sampler.sample_into(points, &mut directions, &mut vec![0.0; points.len()]);
        Ok(Self { texels, directions, integral: sampler.mass() })
    }
}
