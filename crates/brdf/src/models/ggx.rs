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
//! Facets may be stretched along the tangent (the surface's +X, `roughness_x`) or across it (`roughness_y`),
//! with alpha_x and alpha_y the squares (Burley, "Physically-Based Shading at Disney", 2012, equation 13;
//! Heitz 2014, equations 85 and 86):
//!
//! - D = 1 / (pi alpha_x alpha_y (h_x^2 / alpha_x^2 + h_y^2 / alpha_y^2 + h_z^2)^2),
//! - in G, sqrt(alpha_x^2 V_x^2 + alpha_y^2 V_y^2 + V_z^2) stands for sqrt(alpha^2 + (1 - alpha^2) (N.V)^2).
//!
//! The model is reciprocal. D is normalised, so that with `specular` 1 no view sees more light than falls on
//! the surface; light that is reflected twice is lost, which darkens rough metals.

use std::f64::consts::PI;

use glam::{Vec2, Vec3};
use sphere::Direction;

use super::facets::HalfVector;
use super::fresnel::{Fresnel, FresnelConstants, IOR, K, N};
use super::lobe::Lobe;
use super::model::Model;
use super::parameter::{
    Parameter, ParameterError, ROUGHNESS, ROUGHNESS_X, ROUGHNESS_Y, ROUGHNESSES, SPECULAR, Value, Values,
};
use crate::packed::{self, packed};

const ROUGH: Parameter =
    Parameter::number("roughness", "the width of the highlight: alpha is its square", ROUGHNESS)
        .unless(ROUGHNESSES);

/// A rough surface of GGX facets.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ggx {
    /// The roughness along and across the tangent.
    roughness: [f64; 2],
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
        Self::stretched([ROUGH.checked(roughness)?; 2], fresnel, specular)
    }

    /// A surface of these roughnesses along and across the tangent.
    ///
    /// # Errors
    /// The errors of [`Ggx::new`].
    pub fn stretched(
        roughness: [f64; 2],
        fresnel: Fresnel,
        specular: [f64; 3],
    ) -> Result<Self, ParameterError> {
        Ok(Self {
            roughness: [ROUGHNESS_X.checked(roughness[0])?, ROUGHNESS_Y.checked(roughness[1])?],
            fresnel: fresnel.checked()?,
            specular: SPECULAR.checked_colour(specular)?,
        })
    }
}

packed! {
    /// The constants of the formula of `ggx`.
    pub struct GgxConstants as ggx {
        /// alpha_x alpha_y.
        product: f32,
        /// specular alpha_x alpha_y / (2 pi).
        peak: Vec3,
        /// What the facets are made of.
        fresnel: FresnelConstants,
        /// alpha_x^2 and alpha_y^2.
        squares: Vec2,
        /// alpha_y / alpha_x.
        ratio: f32,
    }
}

impl Model for Ggx {
    type Constants = GgxConstants;

    const NAME: &'static str = "ggx";
    const SUMMARY: &'static str =
        "a rough surface with a long-tailed highlight, stretched or not, masking and Fresnel";
    const PARAMETERS: &'static [Parameter] = &[ROUGH, ROUGHNESS_X, ROUGHNESS_Y, IOR, N, K, SPECULAR];

    fn from_values(values: &Values) -> Result<Self, ParameterError> {
        let roughness = values.stretched(&ROUGH, ROUGHNESSES)?;
        Self::stretched(roughness, Fresnel::from_values(values)?, values.colour("specular")?)
    }

    fn values(&self) -> Values {
        let [x, y] = self.roughness;
        let values = self.fresnel.values();
        let values =
            values.with("roughness", Value::Number(x)).with("specular", Value::Colour(self.specular));
        if self.is_isotropic() { values } else { values.with("roughness_y", Value::Number(y)) }
    }

    fn rho_hat(&self, incident: Direction, outgoing: Direction) -> [f64; 3] {
        let Some(half) = HalfVector::new(incident, outgoing) else { return [0.0; 3] };
        let [x, y] = self.roughness;
        let value = match self.is_isotropic() {
            true => half.ggx(math::powi(x, 4)),
            false => half.ggx_stretched([x * x, y * y], [incident.vector(), outgoing.vector()]),
        };
        let fresnel = self.fresnel.at(half.facet());
        [0, 1, 2].map(|channel| self.specular[channel] * fresnel[channel] * value)
    }

    fn constants(&self) -> GgxConstants {
        let [x, y] = self.roughness.map(|roughness| roughness * roughness);
        GgxConstants {
            product: (x * y) as f32,
            peak: packed::rgb(self.specular.map(|specular| specular * 0.5 * x * y / PI)),
            fresnel: self.fresnel.constants(),
            squares: packed::two([x * x, y * y]),
            ratio: (y / x) as f32,
        }
    }

    fn examples() -> Result<Vec<Self>, ParameterError> {
        Ok(vec![
            Self::new(0.5, Fresnel::GOLD, [1.0, 0.5, 0.0])?,
            Self::stretched([0.4, 0.7], Fresnel::GOLD, [1.0, 0.5, 0.0])?,
        ])
    }

    fn lobes(&self) -> Vec<Lobe> {
        vec![Lobe::facets(self.roughness.map(|roughness| math::powi(roughness, 2)))]
    }

    fn is_isotropic(&self) -> bool {
        self.roughness[0] == self.roughness[1]
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
    use crate::models::tests::assert_fingerprint;

    #[test]
    fn fingerprint() {
        let ggx = |fresnel| Ggx::new(0.5, fresnel, [1.0; 3]).unwrap();
        assert_fingerprint(
            &ggx(Fresnel::Dielectric(1.5)),
            [3.628550225203e-02, 7.737193141409e-02, 1.113349189224e-01, 1.500806428147e-03],
        );
        assert_fingerprint(
            &ggx(Fresnel::GOLD),
            [8.697344536980e-01, 9.765961274575e-01, 2.914524239095e-01, 3.635558472026e-02],
        );
        assert_fingerprint(
            &Ggx::stretched([0.4, 0.7], Fresnel::GOLD, [1.0; 3]).unwrap(),
            [5.932279054669e-01, 1.033547257712e+00, 2.503500865116e-01, 6.364501820652e-03],
        );
    }

    /// The area of the facets' projections onto the surface is that of the surface: the integral of D (N.h)
    /// is 1. With tan(theta) = t, (N.h) dh = t dt dphi / (1 + t^2)^2; where N.L = N.V = N.h and L = V,
    /// rho_hat is D F G / (4 N.h), with G = N.h / |(alpha_x h_x, alpha_y h_y, h_z)| of two equal maskings.
    #[test]
    fn stretched_facets_cover_the_surface() {
        for roughness in [[0.3, 0.7], [0.9, 0.4], [0.6, 0.6001]] {
            let model = Ggx::stretched(roughness, Fresnel::Dielectric(1.5), [1.0; 3]).unwrap();
            let [x, y] = roughness.map(|r| r * r);
            let (steps, turns) = (4000, 360);
            let mut area = 0.0;
            for i in 0..steps {
                // t = s / (1 - s) reaches every slope.
                let s = (f64::from(i) + 0.5) / f64::from(steps);
                let t = s / (1.0 - s);
                for j in 0..turns {
                    let phi = 2.0 * PI * f64::from(j) / f64::from(turns);
                    let h = Direction::from_angles(t.atan(), phi);
                    let v = h.vector();
                    let mean = (x * x * v.x * v.x + y * y * v.y * v.y + v.z * v.z).sqrt();
                    let d = model.rho_hat(h, h)[0] * 4.0 * mean / 0.04;
                    let weight = t / (1.0 - s).powi(2) / (1.0 + t * t).powi(2) / f64::from(steps);
                    area += d * weight * 2.0 * PI / f64::from(turns);
                }
            }
            assert!((area - 1.0).abs() < 1e-4, "{roughness:?}: {area}");
        }
    }

    /// Between the two, a hair apart, the values of both formulas are a hair apart.
    #[test]
    fn a_surface_that_is_hardly_stretched_is_the_isotropic_one() {
        let [one, other] =
            [0.5, 0.5 + 1e-9].map(|y| Ggx::stretched([0.5, y], Fresnel::Dielectric(1.5), [1.0; 3]).unwrap());
        assert!(one.is_isotropic() && !other.is_isotropic());
        for k in 0..200 {
            let k = f64::from(k);
            let light = Direction::from_angles((k * 0.618).fract() * 1.57, k);
            let view = Direction::from_angles((k * 0.414).fract() * 1.57, 2.3 * k);
            let (a, b) = (one.rho_hat(light, view)[0], other.rho_hat(light, view)[0]);
            assert!((a - b).abs() <= 1e-7 * a, "{a} {b}");
        }
    }
}
