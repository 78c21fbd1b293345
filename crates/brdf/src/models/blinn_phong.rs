//! `blinn-phong`: a highlight about the half vector.
//!
//! BRDF = specular * c(s) * (N.h)^s with s the `exponent` (Blinn, "Models of Light Reflection for Computer
//! Synthesized Pictures", 1977); rho_hat = BRDF * max(0, cos(theta_i)). The factor
//!
//! c(s) = (s + 2) (s + 4) / (8 pi (2^(-s/2) + s))
//!
//! makes a view along the normal see the share `specular` of a constant sky. With V = N and u = cos(theta_i),
//! N.h = sqrt((1 + u) / 2) and 2 pi times the integral of ((1 + u) / 2)^(s/2) u over [0, 1] is 1 / c(s).
//!
//! Reciprocal. No other view sees more than `specular`.

use std::f64::consts::PI;

use glam::Vec3;
use sphere::Direction;

use super::facets::HalfVector;
use super::lobe::Lobe;
use super::model::Model;
use super::parameter::{POWER, Parameter, ParameterError, SPECULAR, Value, Values};
use crate::packed::{self, packed};

const EXPONENT: Parameter = Parameter::number(
    "exponent",
    "the sharpness of the highlight: the power of the half vector's cosine",
    POWER,
);

/// A highlight about the half vector.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BlinnPhong {
    exponent: f64,
    specular: [f64; 3],
    /// The factor c(s) of the highlight.
    factor: f64,
}

impl BlinnPhong {
    /// A highlight (N.h)^`exponent` that reflects the share `specular` toward the normal, RGB.
    ///
    /// # Errors
    /// If `exponent` is not a number from 0 to 1e9, or a channel of `specular` not one from 0 to 1e6.
    pub fn new(exponent: f64, specular: [f64; 3]) -> Result<Self, ParameterError> {
        let s = EXPONENT.checked(exponent)?;
        Ok(Self { exponent, specular: SPECULAR.checked_colour(specular)?, factor: factor(s) })
    }
}

/// The factor c(s) of the highlight.
pub(super) fn factor(s: f64) -> f64 {
    (s + 2.0) * (s + 4.0) / (8.0 * PI * (math::exp2(-0.5 * s) + s))
}

packed! {
    /// The constants of the formula of `blinn-phong`.
    pub struct BlinnPhongConstants as blinn_phong {
        /// s / 2.
        half_exponent: f32,
        /// specular c(s).
        peak: Vec3,
    }
}

impl Model for BlinnPhong {
    type Constants = BlinnPhongConstants;

    const NAME: &'static str = "blinn-phong";
    const SUMMARY: &'static str = "a highlight about the half vector";
    const PARAMETERS: &'static [Parameter] = &[EXPONENT, SPECULAR];

    fn from_values(values: &Values) -> Result<Self, ParameterError> {
        Self::new(values.number("exponent")?, values.colour("specular")?)
    }

    fn values(&self) -> Values {
        Values::default()
            .with("exponent", Value::Number(self.exponent))
            .with("specular", Value::Colour(self.specular))
    }

    fn rho_hat(&self, incident: Direction, outgoing: Direction) -> [f64; 3] {
        let Some(half) = HalfVector::new(incident, outgoing) else { return [0.0; 3] };
        let value = self.factor * half.light * math::pow(half.cos2().min(1.0), 0.5 * self.exponent);
        self.specular.map(|specular| specular * value)
    }

    fn constants(&self) -> BlinnPhongConstants {
        BlinnPhongConstants {
            half_exponent: (0.5 * self.exponent) as f32,
            peak: packed::rgb(self.specular.map(|specular| specular * self.factor)),
        }
    }

    fn examples() -> Result<Vec<Self>, ParameterError> {
        Ok(vec![Self::new(20.0, [1.0, 0.5, 0.0])?])
    }

    fn lobes(&self) -> Vec<Lobe> {
        vec![Lobe::facets_of_powers([self.exponent; 2])]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::models::tests::assert_fingerprint;

    #[test]
    fn fingerprint() {
        assert_fingerprint(
            &BlinnPhong::new(20.0, [1.0; 3]).unwrap(),
            [8.382000866093e-01, 3.715154093614e-01, 2.617593019360e-02, 9.706284333813e-03],
        );
    }
}
