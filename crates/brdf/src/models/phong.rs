//! `phong`: a highlight about the reflection vector R, the same shape from every view.
//!
//! rho_hat = specular * (s + 1) / (2 pi) * max(0, cos(theta_i))^s, theta_i from R, with s the `exponent`: Phong's
//! lobe, scaled so that a constant sky of radiance 1 is reflected as `specular` (paper 1, section 6, and its
//! Appendix D). The factor holds the incident cosine; the horizon of the normal is not applied, which keeps
//! the model radially symmetric.

use std::f64::consts::TAU;

use sphere::Direction;

use super::ParameterError;
use super::parameter::{colour, exponent};
use crate::Centre;
use crate::clamped_cosine::ClampedCosine;

/// A highlight about the reflection vector.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Phong {
    exponent: f64,
    specular: [f64; 3],
}

impl Phong {
    /// The name in material files.
    pub const NAME: &'static str = "phong";
    pub(super) const CENTRE: Centre = Centre::Reflection;

    /// A highlight cos^`exponent` that reflects the share `specular` of the light, RGB.
    ///
    /// # Errors
    /// Where `exponent` is not a number from 0 to 1e9, or a channel of `specular` not one from 0 to 1e6. A share
    /// above 1 makes light, but is no error.
    pub fn new(exponent: f64, specular: [f64; 3]) -> Result<Self, ParameterError> {
        Ok(Self { exponent: self::exponent("exponent", exponent)?, specular: colour("specular", specular)? })
    }

    /// s, the sharpness of the highlight.
    pub fn exponent(&self) -> f64 {
        self.exponent
    }

    /// The share of light that is reflected, RGB.
    pub fn specular(&self) -> [f64; 3] {
        self.specular
    }

    pub(super) fn rho_hat(&self, incident: Direction, _: Direction) -> [f64; 3] {
        let cosine = incident.vector().z;
        let value = if cosine > 0.0 { (self.exponent + 1.0) / TAU * cosine.powf(self.exponent) } else { 0.0 };
        self.specular.map(|specular| specular * value)
    }

    pub(super) fn lobe(&self) -> ClampedCosine {
        let scale = (self.exponent + 1.0) / TAU;
        ClampedCosine { peak: self.specular.map(|specular| specular * scale), exponent: self.exponent }
    }
}
