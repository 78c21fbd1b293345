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

use sphere::Direction;

use super::facets::HalfVector;
use super::lobe::Lobe;
use super::model::Model;
use super::parameter::{POWER, Parameter, ParameterError, SPECULAR, Value, Values};

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

impl Model for BlinnPhong {
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

    /// The constants of the formula: s / 2, specular c(s) (3).
    fn constants(&self) -> Vec<f64> {
        [&[0.5 * self.exponent][..], &self.specular.map(|specular| specular * self.factor)].concat()
    }

    fn lobes(&self) -> Vec<Lobe> {
        vec![Lobe::facets_of_powers([self.exponent; 2])]
    }
}
