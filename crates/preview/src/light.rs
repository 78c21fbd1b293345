//! Distant light as renderers read it.

use std::sync::{Arc, OnceLock};

use envmap::{Environment, Exposure};
use sh::{Degree, Expansion, Lighting, Transform, synthesise_cube};
use shrm::stops::BLACK_SHARE;
use sphere::{Cube, Direction};

use crate::light_image::image;
use crate::shading::light_samples::LightSamples;

/// An environment, and the maps that are computed from it when first needed.
#[derive(Debug)]
pub struct Light {
    environment: Environment,
    /// The lighting that the environment is a picture of, if no environment was there before.
    source: Option<Lighting>,
    exposure: OnceLock<Exposure>,
    lighting: OnceLock<Expansion>,
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
            exposure: OnceLock::new(),
            lighting: known,
            reconstruction: OnceLock::new(),
            samples: OnceLock::new(),
        }
    }

    /// The light of disks and a series without an environment, which is made as a picture of them. `None` if
    /// a radiance is not finite.
    pub fn of_lighting(lighting: Lighting) -> Option<Self> {
        let light = Self::new(image(&lighting)?, Some(lighting.whole()));
        Some(Self { source: Some(lighting), ..light })
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

    /// The light's coefficients, for [`crate::Background::Harmonics`] and [`crate::Mode::Irradiance`].
    pub fn lighting(&self) -> &Expansion {
        self.lighting.get_or_init(|| {
            let grid = self.environment.grid();
            let most = 30.min((grid.height.max(1) - 1) / 2).min((grid.width.max(1) - 1) / 2);
            let degree = Degree::new(most).unwrap_or(Degree::ZERO);
            match Transform::new(grid, degree) {
                Ok(transform) => transform.analyse(self.environment.pixels()),
                Err(_) => Expansion::zero(Degree::ZERO),
            }
        })
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
