//! `phong`: a highlight about the reflection vector R, the same shape from every view.
//!
//! rho_hat = specular * (s + 1) / (2 pi) * max(0, cos(theta_i))^s, theta_i from R, with s the `exponent`:
//! Phong's lobe, scaled so that the surface reflects a constant sky of radiance 1 as `specular`
//! [RH02, sec. 6.3 and app. D]. rho_hat includes the incident cosine; light from below the surface's horizon
//! is reflected too, which keeps the model radially symmetric.

use std::f64::consts::TAU;

use glam::Vec3;
use sphere::Direction;

use super::lobe::Lobe;
use super::model::Model;
use super::parameter::{POWER, Parameter, ParameterError, SPECULAR, Value, Values};
use crate::clamped_cosine::ClampedCosine;
use crate::packed::{self, packed};

const EXPONENT: Parameter =
    Parameter::number("exponent", "the sharpness of the highlight: the power of the cosine", POWER);

/// A highlight about the reflection vector.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Phong {
    exponent: f64,
    specular: [f64; 3],
}

impl Phong {
    /// A highlight cos^`exponent` that reflects the share `specular` of the light, RGB.
    ///
    /// # Errors
    /// If `exponent` is not a number from 0 to 1e9, or a channel of `specular` not one from 0 to 1e6. A share
    /// above 1 makes light, but is not an error.
    pub fn new(exponent: f64, specular: [f64; 3]) -> Result<Self, ParameterError> {
        Ok(Self { exponent: EXPONENT.checked(exponent)?, specular: SPECULAR.checked_colour(specular)? })
    }

    /// The sharpness s of the highlight.
    pub fn exponent(&self) -> f64 {
        self.exponent
    }

    /// The share of light that is reflected, RGB.
    pub fn specular(&self) -> [f64; 3] {
        self.specular
    }
}

packed! {
    /// The constants of the formula of `phong`.
    pub struct PhongConstants as phong {
        /// s.
        exponent: f32,
        /// specular (s + 1) / (2 pi).
        peak: Vec3,
    }
}

impl Model for Phong {
    type Constants = PhongConstants;

    const NAME: &'static str = "phong";
    const SUMMARY: &'static str = "a highlight about the reflection vector, of one shape from every view";
    const PARAMETERS: &'static [Parameter] = &[EXPONENT, SPECULAR];

    fn from_values(values: &Values) -> Result<Self, ParameterError> {
        Self::new(values.number("exponent")?, values.colour("specular")?)
    }

    fn values(&self) -> Values {
        Values::default()
            .with("exponent", Value::Number(self.exponent))
            .with("specular", Value::Colour(self.specular))
    }

    fn has_horizon(&self) -> bool {
        false
    }

    fn rho_hat(&self, incident: Direction, outgoing: Direction) -> [f64; 3] {
        let (light, view) = (incident.vector(), outgoing.vector());
        let cosine = light.z * view.z - light.x * view.x - light.y * view.y;
        let value =
            if cosine > 0.0 { (self.exponent + 1.0) / TAU * math::pow(cosine, self.exponent) } else { 0.0 };
        self.specular.map(|specular| specular * value)
    }

    fn constants(&self) -> PhongConstants {
        let scale = (self.exponent + 1.0) / TAU;
        let peak = packed::rgb(self.specular.map(|specular| specular * scale));
        PhongConstants { exponent: self.exponent as f32, peak }
    }

    fn examples() -> Result<Vec<Self>, ParameterError> {
        Ok(vec![Self::new(20.0, [1.0, 0.5, 0.0])?])
    }

    fn lobes(&self) -> Vec<Lobe> {
        vec![Lobe::power(-1.0, 1.0, self.exponent)]
    }

    fn radial(&self) -> Option<ClampedCosine> {
        let scale = (self.exponent + 1.0) / TAU;
        Some(ClampedCosine { peak: self.specular.map(|specular| specular * scale), exponent: self.exponent })
    }
}
