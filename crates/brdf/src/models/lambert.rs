//! `lambert`: a matte surface, the same from every view.
//!
//! The BRDF is albedo / pi; taken about the normal and times the incident cosine,
//! rho_hat = albedo / pi * max(0, cos(theta_i)). A constant sky of radiance 1 is reflected as `albedo`.

use std::f64::consts::PI;

use glam::Vec3;
use sphere::Direction;

use super::model::Model;
use super::parameter::{Parameter, ParameterError, Value, Values, WEIGHT};
use crate::clamped_cosine::ClampedCosine;
use crate::coefficients::Centre;
use crate::packed::{self, packed};

const ALBEDO: Parameter = Parameter::colour("albedo", "the share of light that is reflected, 0 to 1", WEIGHT);

/// A matte surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lambert {
    albedo: [f64; 3],
}

impl Lambert {
    /// A matte surface that reflects the share `albedo` of the light, RGB.
    ///
    /// # Errors
    /// If a channel is not a number from 0 to 1e6. A share above 1 makes light, but is not an error.
    pub fn new(albedo: [f64; 3]) -> Result<Self, ParameterError> {
        Ok(Self { albedo: ALBEDO.checked_colour(albedo)? })
    }

    /// The share of light that is reflected, RGB.
    pub fn albedo(&self) -> [f64; 3] {
        self.albedo
    }
}

packed! {
    /// The constants of the formula of `lambert`.
    pub struct LambertConstants as lambert {
        /// albedo / pi.
        brdf: Vec3,
    }
}

impl Model for Lambert {
    type Constants = LambertConstants;

    const NAME: &'static str = "lambert";
    const SUMMARY: &'static str = "matte, the same from every view";
    const PARAMETERS: &'static [Parameter] = &[ALBEDO];

    fn from_values(values: &Values) -> Result<Self, ParameterError> {
        Self::new(values.colour("albedo")?)
    }

    fn values(&self) -> Values {
        Values::default().with("albedo", Value::Colour(self.albedo))
    }

    fn centre(&self) -> Centre {
        Centre::Normal
    }

    fn rho_hat(&self, incident: Direction, _: Direction) -> [f64; 3] {
        self.albedo.map(|albedo| albedo / PI * incident.vector().z.max(0.0))
    }

    fn constants(&self) -> LambertConstants {
        LambertConstants { brdf: packed::rgb(self.albedo.map(|albedo| albedo / PI)) }
    }

    fn examples() -> Result<Vec<Self>, ParameterError> {
        Ok(vec![Self::new([1.0, 0.5, 0.0])?])
    }

    fn radial(&self) -> Option<ClampedCosine> {
        Some(ClampedCosine { peak: self.albedo.map(|albedo| albedo / PI), exponent: 1.0 })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lambert_holds_the_cosine() {
        let chalk = Lambert::new([0.5, 1.0, 0.0]).unwrap();
        let at = |theta: f64| chalk.rho_hat(Direction::from_angles(theta, 1.0), Direction::Z);
        assert_eq!(at(0.0), [0.5 / PI, 1.0 / PI, 0.0]);
        assert!((at(PI / 3.0)[1] - 0.5 / PI).abs() < 1e-15, "half as much at 60 degrees");
        assert_eq!(at(2.0), [0.0; 3], "nothing below the horizon");
    }
}
