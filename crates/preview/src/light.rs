//! Distant light as renderers read it.

use std::sync::OnceLock;

use envmap::Environment;
use sh::{Degree, Expansion, Transform};

/// An environment, and its coefficients where they are wanted.
#[derive(Debug)]
pub struct Light {
    environment: Environment,
    lighting: OnceLock<Expansion>,
}

impl Light {
    /// The light of an environment. `lighting` is what a graph projected of it; without, it is projected here when it is
    /// first wanted.
    pub fn new(environment: Environment, lighting: Option<Expansion>) -> Self {
        let known = OnceLock::new();
        if let Some(lighting) = lighting {
            let _ = known.set(lighting);
        }
        Self { environment, lighting: known }
    }

    /// The environment.
    pub fn environment(&self) -> &Environment {
        &self.environment
    }

    /// Its coefficients: what [`crate::Background::Harmonics`] and [`crate::Mode::Irradiance`] show.
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
}
