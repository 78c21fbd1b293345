//! `microfacet`: RH02's simplified rough surface, a Gaussian of the half vector's angle.
//!
//! rho_hat = specular / (4 pi sigma^2) * e^(-(theta_h / sigma)^2), theta_h the angle between the normal and
//! the vector half way between light and view; 0 if the light is below the horizon ([RH02, eq. 11]: Torrance
//! and Sparrow's model without masking, Fresnel and cosines).
//!
//! The equation is taken as rho_hat, without another cosine. So the BRDF itself, rho_hat / cos(theta_i), is
//! not reciprocal. Toward a view along the normal the integral over all light is specular * (1 - O(sigma^2)),
//! because the half vector's solid angle is a quarter of the light's; toward grazing it falls, as the horizon
//! cuts the lobe.

use std::f64::consts::PI;

use glam::Vec3;
use sphere::Direction;

use super::lobe::Lobe;
use super::model::Model;
use super::parameter::{Parameter, ParameterError, Range, SPECULAR, Value, Values};
use crate::packed::{self, packed};

const SIGMA: Parameter = Parameter::number(
    "sigma",
    "the width of the highlight: the angle of the half vector from the normal, in radians, at which it has fallen to 1/e",
    Range { least: 1e-4, most: 100.0, words: "a number from 1e-4 to 100" },
);

/// A rough surface by [RH02, eq. 11].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Microfacet {
    sigma: f64,
    specular: [f64; 3],
}

impl Microfacet {
    /// A highlight of width `sigma`, in radians, and weight `specular`, RGB.
    ///
    /// # Errors
    /// If `sigma` is not a number from 1e-4 to 100, or a channel of `specular` not one from 0 to 1e6.
    pub fn new(sigma: f64, specular: [f64; 3]) -> Result<Self, ParameterError> {
        Ok(Self { sigma: SIGMA.checked(sigma)?, specular: SPECULAR.checked_colour(specular)? })
    }

    /// The width of the highlight, in radians.
    pub fn sigma(&self) -> f64 {
        self.sigma
    }

    /// The weight of the highlight, RGB.
    pub fn specular(&self) -> [f64; 3] {
        self.specular
    }
}

packed! {
    /// The constants of the formula of `microfacet`.
    pub struct MicrofacetConstants as microfacet {
        /// The width of the highlight, in radians.
        sigma: f32,
        /// specular / (4 pi sigma^2).
        peak: Vec3,
    }
}

impl Model for Microfacet {
    type Constants = MicrofacetConstants;

    const NAME: &'static str = "microfacet";
    const SUMMARY: &'static str =
        "the paper's simplified rough surface (equation 11): a Gaussian of the half vector's angle";
    const PARAMETERS: &'static [Parameter] = &[SIGMA, SPECULAR];

    fn from_values(values: &Values) -> Result<Self, ParameterError> {
        Self::new(values.number("sigma")?, values.colour("specular")?)
    }

    fn values(&self) -> Values {
        Values::default()
            .with("sigma", Value::Number(self.sigma))
            .with("specular", Value::Colour(self.specular))
    }

    fn rho_hat(&self, incident: Direction, outgoing: Direction) -> [f64; 3] {
        let light = incident.vector();
        let sum = light + outgoing.vector();
        let length = sum.length();
        if light.z <= 0.0 || length <= 0.0 {
            return [0.0; 3];
        }
        let theta_h = math::acos((sum.z / length).clamp(-1.0, 1.0));
        let share = theta_h / self.sigma;
        let value = math::exp(-share * share) / (4.0 * PI * self.sigma * self.sigma);
        self.specular.map(|specular| specular * value)
    }

    fn constants(&self) -> MicrofacetConstants {
        let scale = 0.25 / (PI * self.sigma * self.sigma);
        let peak = packed::rgb(self.specular.map(|specular| specular * scale));
        MicrofacetConstants { sigma: self.sigma as f32, peak }
    }

    fn examples() -> Result<Vec<Self>, ParameterError> {
        Ok(vec![Self::new(0.3, [1.0, 0.5, 0.0])?])
    }

    fn lobes(&self) -> Vec<Lobe> {
        vec![Lobe::facets([self.sigma; 2])]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::models::tests::assert_fingerprint;

    #[test]
    fn fingerprint() {
        assert_fingerprint(
            &Microfacet::new(0.3, [1.0; 3]).unwrap(),
            [7.243904530039e-01, 6.714368812270e-01, 1.606295151875e-01, 9.284242429114e-03],
        );
    }
}
