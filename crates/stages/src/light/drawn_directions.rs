//! The light, the series or the product of both that directions follow, and the directions that are drawn
//! from it.

use engine::{Failure, Reporter};
use envmap::Environment;
use rayon::prelude::*;
use sampling::{
    ChannelWeights, Density, Error, Integrand, Options, ProductMasses, ProductOptions, ProductSampler,
    ProductTables, Sampler, Tables, TexelLight, weigh,
};
use sh::{Degree, Expansion};
use sphere::LatLong;

/// Directions between two checks for cancellation.
const BATCH: usize = 1 << 14;

/// Rows of a picture between two checks for cancellation.
const BAND: usize = 64;

/// How directions are drawn.
pub(crate) struct Drawing {
    /// From a series. Of a product, the density and the uniform share are those of its series.
    pub(crate) of_series: Options,
    /// What has the masses of a product.
    pub(crate) masses: ProductMasses,
}

/// What directions follow: light, a series, or the product of both.
pub(crate) struct Followed {
    light: Option<TexelLight>,
    series: Option<(Degree, Vec<f64>)>,
}

impl Followed {
    /// A weighted sum of the channels of light, of a series, or of both.
    pub(crate) fn new(
        light: Option<&Environment>,
        series: Option<&Expansion>,
        weights: ChannelWeights,
    ) -> Result<Self, Failure> {
        let light = light.map(|light| TexelLight::new(light, weights)).transpose().map_err(failure)?;
        Ok(Self { light, series: series.map(|series| (series.degree(), weigh(series, weights))) })
    }

    /// The rows of the light.
    pub(crate) fn rows(&self) -> Option<usize> {
        self.light.as_ref().map(|light| light.grid().height)
    }

    /// The sampler.
    pub(crate) fn source(&self, drawing: Drawing) -> Result<Source, Failure> {
        let Drawing { of_series: options, masses } = drawing;
        let (degree, coefficients) = self.series();
        let tables = Tables::new(degree);
        let Some(light) = &self.light else {
            let sampler = Sampler::new(&tables, coefficients, options).map_err(failure)?;
            return Ok(Source::Series(Box::new(sampler)));
        };
        let Options { density, uniform_share, .. } = options;
        // Texels alone are constant.
        let masses = if self.series.is_some() { masses } else { ProductMasses::Leaves };
        let options = ProductOptions { density, uniform_share, masses };
        let tables = ProductTables::new(light, &tables);
        let sampler = ProductSampler::new(&tables, coefficients, options).map_err(failure)?;
        Ok(Source::Light(Box::new(sampler)))
    }

    /// What the weights of directions integrate.
    pub(crate) fn integrand(&self, density: Density) -> Integrand<'_> {
        match (&self.light, &self.series) {
            (Some(light), None) => Integrand::of_light(light),
            (light, _) => {
                let (degree, coefficients) = self.series();
                let series = Integrand::of_function(degree, coefficients, density);
                light.iter().fold(series, Integrand::times)
            }
        }
    }

    /// The series, or 1.
    fn series(&self) -> (Degree, &[f64]) {
        self.series.as_ref().map_or((Degree::ZERO, &[1.0]), |(degree, coefficients)| (*degree, coefficients))
    }
}

/// What directions are drawn from.
pub(crate) enum Source {
    Series(Box<Sampler>),
    Light(Box<ProductSampler>),
}

impl Source {
    /// The density at the centre of each texel, as grey.
    pub(crate) fn density(&self, grid: LatLong, reporter: &Reporter) -> Result<Vec<[f32; 3]>, Failure> {
        let mut pixels = vec![[0.0; 3]; grid.len()];
        for (band, pixels) in pixels.chunks_mut(BAND * grid.width).enumerate() {
            reporter.check_cancelled()?;
            pixels.par_chunks_mut(grid.width).enumerate().for_each(|(row, pixels)| {
                for (column, pixel) in pixels.iter_mut().enumerate() {
                    let direction = grid.direction(band * BAND + row, column).vector().as_vec3().to_array();
                    *pixel = [match self {
                        Self::Series(sampler) => sampler.density(direction),
                        Self::Light(sampler) => sampler.density(direction),
                    }; 3];
                }
            });
        }
        Ok(pixels)
    }
}

/// Directions that were drawn.
pub(crate) struct Drawn {
    pub(crate) directions: Vec<[f32; 3]>,
    pub(crate) densities: Vec<f32>,
    pub(crate) weights: Vec<f64>,
}

impl Drawn {
    pub(crate) fn new(
        points: &[[f32; 2]],
        source: &Source,
        integrand: &Integrand<'_>,
        reporter: &Reporter,
    ) -> Result<Self, Failure> {
        let count = points.len();
        let mut drawn = Self {
            directions: vec![[0.0; 3]; count],
            densities: vec![0.0; count],
            weights: vec![0.0; count],
        };
        let outputs = drawn.directions.chunks_mut(BATCH).zip(drawn.densities.chunks_mut(BATCH));
        let outputs = outputs.zip(drawn.weights.chunks_mut(BATCH));
        for (points, ((directions, densities), weights)) in points.chunks(BATCH).zip(outputs) {
            reporter.check_cancelled()?;
            match source {
                Source::Series(sampler) => sampler.sample_into(points, directions, densities),
                Source::Light(sampler) => sampler.sample_into(points, directions, densities),
            }
            integrand.weigh_into(directions, densities, weights);
        }
        Ok(drawn)
    }
}

fn failure(error: Error) -> Failure {
    let failure = Failure::from(error);
    match error {
        Error::NoMass => failure.help(
            "connect a function that is not black; if it is negative everywhere, set density = \"absolute\"",
        ),
        Error::NotFinite { .. } | Error::LightNotFinite { .. } | Error::TexelNotFinite { .. } => failure,
    }
}
