//! `ggx`: a rough surface of small mirrors with GGX's long-tailed highlight, masking and Fresnel.
//!
//! rho_hat = specular * D(h) F(L.h) G(L, V) / (4 N.V) with alpha = roughness^2 and
//!
//! - D = alpha^2 / (pi ((N.h)^2 (alpha^2 - 1) + 1)^2) (Trowbridge and Reitz 1975; Walter, Marschner, Li and
//!   Torrance, "Microfacet Models for Refraction through Rough Surfaces", 2007, equation 33),
//! - G = 2 N.L N.V / (N.L sqrt(alpha^2 + (1 - alpha^2) (N.V)^2) + N.V sqrt(alpha^2 + (1 - alpha^2) (N.L)^2)):
//!   Smith's masking and shadowing, correlated by height (Heitz, "Understanding the Masking-Shadowing
//!   Function", 2014, equation 99),
//! - F is Fresnel's exact reflectance, of a dielectric (`ior`) or a conductor (`n`, `k`).
//!
//! The model is reciprocal. D is normalised, so that with `specular` 1 no view sees more light than falls on
//! the surface; light that is reflected twice is lost, which darkens rough metals.

use std::f64::consts::PI;

use sphere::Direction;

use super::facets::Half;
use super::fresnel::{Fresnel, IOR, K, N};
use super::lobe::Lobe;
use super::model::Model;
use super::parameter::{Parameter, ParameterError, ROUGHNESS, SPECULAR, Value, Values};

const ROUGH: Parameter =
    Parameter::number("roughness", "the width of the highlight: alpha is its square", ROUGHNESS);

/// A rough surface of GGX facets.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ggx {
    roughness: f64,
    fresnel: Fresnel,
    specular: [f64; 3],
}

impl Ggx {
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
}

impl Model for Ggx {
    const NAME: &'static str = "ggx";
    const SUMMARY: &'static str = "a rough surface with a long-tailed highlight, masking and Fresnel";
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
        let Some(half) = Half::new(incident, outgoing) else { return [0.0; 3] };
        let value = half.ggx(self.roughness.powi(4));
        let fresnel = self.fresnel.at(half.facet());
        [0, 1, 2].map(|channel| self.specular[channel] * fresnel[channel] * value)
    }

    /// alpha^2, specular alpha^2 / (2 pi) (3), Fresnel (7).
    fn constants(&self) -> Vec<f64> {
        let alpha2 = self.roughness.powi(4);
        let peak = self.specular.map(|specular| specular * 0.5 * alpha2 / PI);
        [&[alpha2][..], &peak, &self.fresnel.constants()].concat()
    }

    fn lobes(&self) -> Vec<Lobe> {
        vec![Lobe::facets([self.roughness.powi(2); 2])]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Head on, D = 1 / (pi alpha^2), F = 0.04 and G = 1.
    #[test]
    fn ggx_alpha_is_the_square_of_roughness() {
        for roughness in [0.1_f64, 0.4, 1.0] {
            let model = Ggx::new(roughness, Fresnel::Dielectric(1.5), [1.0; 3]).unwrap();
            let expected = 0.04 / (4.0 * PI * roughness.powi(4));
            let found = model.rho_hat(Direction::Z, Direction::Z)[0];
            assert!((found / expected - 1.0).abs() < 1e-12, "{found} {expected}");
        }
    }
}
