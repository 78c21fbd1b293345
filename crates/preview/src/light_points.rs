//! Points that follow a light: the more of them a texel has, the brighter it is.

use envmap::Environment;
use sampling::{Error, ProductSampler, ProductTables, SUM, Tables, TexelLight};
use sh::Degree;

/// The texels of a light, and the directions of points that follow them.
pub(crate) struct LightPoints {
    pub(crate) texels: TexelLight,
    pub(crate) directions: Vec<[f32; 3]>,
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
        let sampler = ProductSampler::new(&tables, &[1.0], Default::default())?;
        let mut directions = vec![[0.0; 3]; points.len()];
        sampler.sample_into(points, &mut directions, &mut vec![0.0; points.len()]);
        Ok(Self { texels, directions })
    }
}
