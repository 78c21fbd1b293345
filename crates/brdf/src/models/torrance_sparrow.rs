//! `torrance-sparrow`: a rough surface of small mirrors with Gaussian slopes, masking and Fresnel.
//!
//! rho_hat = specular * D(h) F(L.h) G(L, V) / (4 N.V) (Torrance and Sparrow, "Theory for Off-Specular
//! Reflection From Roughened Surfaces", 1967) with m = `roughness`, the root mean square of the facets' slope
//! (sqrt(2) times that along a line), and
//!
//! - D = e^(-tan^2(theta_h) / m^2) / (pi m^2 (N.h)^4), Beckmann's distribution (Cook and Torrance 1982,
//!   equation 14),
//! - G = 1 / (1 + Lambda(L) + Lambda(V)), Smith's masking correlated by height, in place of Torrance and
//!   Sparrow's V-shaped grooves, whose highlight has no bound toward grazing: Lambda(a) = (1 - 1.259 a +
//!   0.396 a^2) / (3.535 a + 2.181 a^2), 0 for a > 1.6, a = 1 / (m tan(theta)) (Walter et al. 2007, after
//!   equation 27: within 0.35 percent),
//! - F is Fresnel's exact reflectance, of a dielectric (`ior`) or a conductor (`n`, `k`).
//!
//! The model is reciprocal. D is normalised, so that with `specular` 1 no view sees more light than falls on
//! the surface (but for the error of Lambda's fit); light that is reflected twice is lost.

use std::f64::consts::PI;

use glam::Vec3;
use sphere::Direction;

use super::facets::HalfVector;
use super::fresnel::{Fresnel, FresnelConstants, IOR, K, N};
use super::lobe::Lobe;
use super::model::Model;
use super::parameter::{Parameter, ParameterError, ROUGHNESS, SPECULAR, Value, Values};
use crate::packed::{self, packed};

const ROUGH: Parameter = Parameter::number(
    "roughness",
    "the width of the highlight: the tangent of the half vector's angle at which the facets have thinned out to 1/e",
    ROUGHNESS,
);

/// A rough surface of facets with Gaussian slopes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TorranceSparrow {
    roughness: f64,
    fresnel: Fresnel,
    specular: [f64; 3],
}

impl TorranceSparrow {
    /// A surface of this roughness and material, its highlight times `specular`, RGB.
    ///
    /// # Errors
    /// If `roughness` is not a number from 0.01 to 1, a constant of the material is out of the range that
    /// [`Fresnel`] states, or a channel of `specular` not a number from 0 to 1e6.
    pub fn new(roughness: f64, fresnel: Fresnel, specular: [f64; 3]) -> Result<Self, ParameterError> {
        Ok(Self {
            roughness: ROUGH.checked(roughness)?,
            fresnel: fresnel.checked()?,
            specular: SPECULAR.checked_colour(specular)?,
        })
    }

    /// Lambda times the cosine, finite at grazing.
    fn lambda_cosine(&self, cosine: f64) -> f64 {
        let sine = (1.0 - cosine * cosine).max(0.0).sqrt();
        let slope = self.roughness * sine;
        if cosine >= 1.6 * slope {
            return 0.0;
        }
        let a = cosine / slope;
        // The fit ends slightly below 0.
        slope * (1.0 - 1.259 * a + 0.396 * a * a).max(0.0) / (3.535 + 2.181 * a)
    }
}

packed! {
    /// The constants of the formula of `torrance-sparrow`.
    pub struct TorranceSparrowConstants as torrance_sparrow {
        /// m.
        roughness: f32,
        /// specular / (4 pi m^2).
        peak: Vec3,
        /// What the facets are made of.
        fresnel: FresnelConstants,
    }
}

impl Model for TorranceSparrow {
    type Constants = TorranceSparrowConstants;

    const NAME: &'static str = "torrance-sparrow";
    const SUMMARY: &'static str = "a rough surface with Gaussian slopes, masking and Fresnel";
    const PARAMETERS: &'static [Parameter] = &[ROUGH, IOR, N, K, SPECULAR];

    fn from_values(values: &Values) -> Result<Self, ParameterError> {
        Self::new(values.number("roughness")?, Fresnel::from_values(values)?, values.colour("specular")?)
    }

    fn values(&self) -> Values {
        self.fresnel
            .values()
            .with("roughness", Value::Number(self.roughness))
            .with("specular", Value::Colour(self.specular))
    }

    fn rho_hat(&self, incident: Direction, outgoing: Direction) -> [f64; 3] {
        let Some(half) = HalfVector::new(incident, outgoing) else { return [0.0; 3] };
        let slopes = half.tan2(self.roughness, self.roughness);
        // Past this e^-x is 0, and cos^4 may be.
        if slopes >= 700.0 {
            return [0.0; 3];
        }
        let (cos2, m2) = (half.cos2(), self.roughness * self.roughness);
        let d = math::exp(-slopes) / (PI * m2 * cos2 * cos2);
        let (light, view) = (half.light, half.view);
        let masked = light * view + view * self.lambda_cosine(light) + light * self.lambda_cosine(view);
        let value = d * light / (4.0 * masked);
        let fresnel = self.fresnel.at(half.facet());
        [0, 1, 2].map(|channel| self.specular[channel] * fresnel[channel] * value)
    }

    fn constants(&self) -> TorranceSparrowConstants {
        let m = self.roughness;
        TorranceSparrowConstants {
            roughness: m as f32,
            peak: packed::rgb(self.specular.map(|specular| specular * 0.25 / (PI * m * m))),
            fresnel: self.fresnel.constants(),
        }
    }

    fn examples() -> Result<Vec<Self>, ParameterError> {
        Ok(vec![Self::new(0.4, Fresnel::Dielectric(1.5), [1.0, 0.5, 0.0])?])
    }

    fn lobes(&self) -> Vec<Lobe> {
        vec![Lobe::facets([self.roughness; 2])]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::models::tests::assert_fingerprint;

    #[test]
    fn fingerprint() {
        assert_fingerprint(
            &TorranceSparrow::new(0.4, Fresnel::Dielectric(1.5), [1.0; 3]).unwrap(),
            [2.120296728275e-02, 5.469186046161e-02, 2.361044652237e-01, 1.814355226116e-03],
        );
    }
}
