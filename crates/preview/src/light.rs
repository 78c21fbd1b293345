//! Distant light as renderers read it.

use std::sync::{Arc, OnceLock};

use envmap::{Environment, Exposure};
use sh::{Degree, Expansion, Lighting, Stop, Transform, synthesise_cube};
use shrm::stops::BLACK_SHARE;
use sphere::{Cube, Direction, LatLong};

use crate::RenderError;
use crate::light_image::image;
use crate::shading::light_samples::LightSamples;

/// An environment, and the maps that are computed from it when first needed.
#[derive(Debug)]
pub struct Light {
    environment: Environment,
    /// The lighting that the environment is a picture of, if no environment was there before.
    source: Option<Lighting>,
    /// The suns and lamps that the light's coefficients were made beside.
    lamps: Vec<sh::Light>,
    exposure: OnceLock<Exposure>,
    lighting: OnceLock<Expansion>,
    separated: OnceLock<Lighting>,
    reconstruction: OnceLock<(Cube, Vec<[f32; 3]>)>,
    samples: OnceLock<Arc<LightSamples>>,
}

impl Light {
    /// The light of an environment. `lighting` holds its coefficients if they are known; otherwise they are
    /// computed when first needed.
    pub fn new(environment: Environment, lighting: Option<Expansion>) -> Self {
        let known = OnceLock::new();
        if let Some(lighting) = lighting {
            let _ = known.set(lighting);
        }
        Self {
            environment,
            source: None,
            lamps: Vec::new(),
            exposure: OnceLock::new(),
            lighting: known,
            separated: OnceLock::new(),
            reconstruction: OnceLock::new(),
            samples: OnceLock::new(),
        }
    }

    /// The light of disks and a series without an environment, which is made as a picture of them. `None` if
    /// a radiance is not finite.
    pub fn of_lighting(lighting: Lighting) -> Option<Self> {
        let light = Self::new(image(&lighting)?, Some(lighting.whole()));
        Some(Self { lamps: lighting.lights.clone(), source: Some(lighting), ..light })
    }

    /// Returns the same light with the suns and lamps that its coefficients were made beside. They are in its
    /// environment and in [`Light::lighting`].
    #[must_use]
    pub fn with_lamps(self, lamps: Vec<sh::Light>) -> Self {
        Self { lamps, ..self }
    }

    /// The suns and lamps that the light's coefficients were made beside.
    pub fn lamps(&self) -> &[sh::Light] {
        &self.lamps
    }

    /// The disks that the light was made of: those that can be moved.
    pub fn disks(&self) -> &[sh::Light] {
        self.source.as_ref().map_or(&[], |lighting| &lighting.lights)
    }

    /// Returns the same light with its disks in other directions, in order; `None` if it has not as many.
    pub fn with_disks_at(&self, directions: &[Direction]) -> Option<Self> {
        let mut lighting =
            self.source.clone().filter(|lighting| lighting.lights.len() == directions.len())?;
        for (light, direction) in lighting.lights.iter_mut().zip(directions) {
            light.direction = *direction;
        }
        Self::of_lighting(lighting)
    }

    /// The environment.
    pub fn environment(&self) -> &Environment {
        &self.environment
    }

    /// The radiance below which a value counts as black, for errors in stops.
    pub fn dark(&self) -> f64 {
        BLACK_SHARE * self.environment.integral().iter().sum::<f64>().max(0.0) / (12.0 * std::f64::consts::PI)
    }

    /// The exposure that shows the environment; see [`Environment::exposure`].
    pub fn exposure(&self) -> Exposure {
        *self.exposure.get_or_init(|| self.environment.exposure())
    }

    /// The light in at most so many rows.
    ///
    /// # Errors
    /// If the environment cannot be made smaller.
    pub fn in_rows(self: &Arc<Self>, rows: usize) -> Result<Arc<Self>, RenderError> {
        if self.environment.grid().height <= rows {
            return Ok(Arc::clone(self));
        }
        let small = self.environment.downsampled(LatLong::with_rows(rows));
        Ok(Arc::new(Self::new(small.map_err(|error| RenderError::maps(error.to_string()))?, None)))
    }

    /// The light's suns and lamps, and the coefficients of everything else up to degree 32.
    pub(crate) fn separated(&self) -> &Lighting {
        self.separated.get_or_init(|| match self.environment.separate_lamps(Stop::NEVER) {
            Ok(found) => Lighting { series: coefficients(&found.soft, 32), lights: found.lights },
            Err(_) => Lighting { series: coefficients(&self.environment, 32), lights: Vec::new() },
        })
    }

    /// The light's coefficients, for [`crate::Background::Harmonics`] and [`crate::Mode::Irradiance`].
    pub fn lighting(&self) -> &Expansion {
        self.lighting.get_or_init(|| coefficients(&self.environment, 30))
    }

    /// The environment as its coefficients describe it, RGB on a cube, with texels in the order of [`Cube`].
    /// Each wave of the highest degree has at least sixteen texels, but an edge has at most 512.
    pub fn reconstruction(&self) -> (Cube, &[[f32; 3]]) {
        let (cube, texels) = self.reconstruction.get_or_init(|| {
            let lighting = self.lighting();
            let cube = Cube { edge: (4 * (lighting.degree().get() + 1)).next_power_of_two().clamp(16, 512) };
            // The synthesis only fails for a cube without texels.
            let texels = synthesise_cube(lighting, cube).unwrap_or_else(|_| vec![[0.0; 3]; cube.len()]);
            (cube, texels)
        });
        (*cube, texels)
    }

    /// The light samples of brute force.
    pub fn samples(&self) -> &Arc<LightSamples> {
        self.samples.get_or_init(|| Arc::new(LightSamples::new(&self.environment)))
    }
}

/// The coefficients of an environment up to a degree, or to the highest that its pixels determine.
fn coefficients(environment: &Environment, degree: usize) -> Expansion {
    let grid = environment.grid();
    let most = degree.min((grid.height.max(1) - 1) / 2).min((grid.width.max(1) - 1) / 2);
    match Transform::new(grid, Degree::new(most).unwrap_or(Degree::ZERO)) {
        Ok(transform) => transform.analyse(environment.pixels()),
        Err(_) => Expansion::zero(Degree::ZERO),
    }
}
