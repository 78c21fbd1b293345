//! `oren-nayar`: a rough matte surface, flatter than lambert and brighter toward the light.
//!
//! BRDF = albedo / pi * (A + B max(0, cos(phi_i - phi_o)) sin(alpha) tan(beta)), alpha the greater and beta
//! the lesser of theta_i and theta_o, A = 1 - 0.5 s^2 / (s^2 + 0.33), B = 0.45 s^2 / (s^2 + 0.09), s =
//! `sigma` in radians (Oren and Nayar, "Generalization of Lambert's Reflectance Model", 1994, equation 30);
//! rho_hat = BRDF * max(0, cos(theta_i)).
//!
//! The model is reciprocal. It is a fit to a simulation of such facets, and not exactly normalised: a grazing
//! view sees albedo * (A + B / 2), at most 1.6 percent more than `albedo`. sigma = 0 is lambert. rho_hat is
//! taken about the normal, so that the horizon is fixed; views below the horizon never occur, and mirror
//! those above.

use std::f64::consts::PI;

use glam::Vec3;
use sphere::Direction;

use super::model::Model;
use super::parameter::{Parameter, ParameterError, Range, Value, Values, WEIGHT};
use crate::coefficients::Centre;
use crate::packed::{self, packed};

const ALBEDO: Parameter =
    Parameter::colour("albedo", "the share of light that a facet reflects, 0 to 1", WEIGHT);
const SIGMA: Parameter = Parameter::number(
    "sigma",
    "the standard deviation of the facets' angle from the surface, in degrees; 0 is lambert",
    Range { least: 0.0, most: 90.0, words: "a number of degrees from 0 to 90" },
);

/// A rough matte surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OrenNayar {
    albedo: [f64; 3],
    degrees: f64,
    /// The factors A / pi and B / pi.
    factors: [f64; 2],
}

impl OrenNayar {
    /// A surface of facets of this albedo, RGB, whose angles deviate by `sigma` degrees.
    ///
    /// # Errors
    /// If a channel of `albedo` is not a number from 0 to 1e6, or `sigma` not one from 0 to 90.
    pub fn new(albedo: [f64; 3], sigma: f64) -> Result<Self, ParameterError> {
        let degrees = SIGMA.checked(sigma)?;
        let s2 = math::powi(degrees.to_radians(), 2);
        let factors = [1.0 - 0.5 * s2 / (s2 + 0.33), 0.45 * s2 / (s2 + 0.09)].map(|factor| factor / PI);
        Ok(Self { albedo: ALBEDO.checked_colour(albedo)?, degrees, factors })
    }
}

packed! {
    /// The constants of the formula of `oren-nayar`.
    pub struct OrenNayarConstants as oren_nayar {
        /// albedo A / pi.
        matte: Vec3,
        /// albedo B / pi.
        rough: Vec3,
    }
}

impl Model for OrenNayar {
    type Constants = OrenNayarConstants;

    const NAME: &'static str = "oren-nayar";
    const SUMMARY: &'static str = "a rough matte surface";
    const PARAMETERS: &'static [Parameter] = &[ALBEDO, SIGMA];

    fn from_values(values: &Values) -> Result<Self, ParameterError> {
        Self::new(values.colour("albedo")?, values.number("sigma")?)
    }

    fn values(&self) -> Values {
        Values::default()
            .with("albedo", Value::Colour(self.albedo))
            .with("sigma", Value::Number(self.degrees))
    }

    fn centre(&self) -> Centre {
        Centre::Normal
    }

    fn rho_hat(&self, incident: Direction, outgoing: Direction) -> [f64; 3] {
        let (light, view) = (incident.vector(), outgoing.vector());
        if light.z <= 0.0 {
            return [0.0; 3];
        }
        // sin(alpha) tan(beta) is both sines over the greater cosine, and cos(phi_i - phi_o) times both sines
        // a product.
        let across = (light.x * view.x + light.y * view.y).max(0.0);
        let value = light.z * (self.factors[0] + self.factors[1] * across / light.z.max(view.z.abs()));
        self.albedo.map(|albedo| albedo * value)
    }

    fn constants(&self) -> OrenNayarConstants {
        let [matte, rough] =
            self.factors.map(|factor| packed::rgb(self.albedo.map(|albedo| albedo * factor)));
        OrenNayarConstants { matte, rough }
    }

    fn examples() -> Result<Vec<Self>, ParameterError> {
        Ok(vec![Self::new([1.0, 0.5, 0.0], 25.0)?])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::models::tests::assert_fingerprint;

    #[test]
    fn fingerprint() {
        assert_fingerprint(
            &OrenNayar::new([0.8; 3], 25.0).unwrap(),
            [1.987728289306e-01, 9.437782946012e-02, 2.507250234213e-02, 1.832958222227e-01],
        );
    }
}
