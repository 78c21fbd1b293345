//! `ashikhmin-shirley`: a highlight with Fresnel over a matte base, which reflects the light that the
//! highlight does not.
//!
//! BRDF = rho_s + rho_d (Ashikhmin and Shirley, "An Anisotropic Phong BRDF Model", 2000, equations 2 to 5)
//! with
//!
//! - rho_s = sqrt((e_x + 1) (e_y + 1)) / (8 pi) * (N.h)^((e_x h_x^2 + e_y h_y^2) / (1 - (N.h)^2)) / (L.h
//!   max(N.L, N.V)) * F,
//! - F = specular + (1 - specular) (1 - L.h)^5, Schlick's approximation,
//! - rho_d = 28 diffuse / (23 pi) * (1 - specular) (1 - (1 - N.L / 2)^5) (1 - (1 - N.V / 2)^5),
//!
//! and rho_hat = BRDF * max(0, cos(theta_i)). `specular` is the reflectance at normal incidence; e_x is the
//! exponent along the tangent (the surface's +X), e_y across it.
//!
//! If light and view are opposite, both at the horizon, the value has no bound. L.h is limited to 1e-3 or
//! more, which matters within 0.06 degrees of grazing.
//!
//! The model is reciprocal. With weights of 1 and less no view sees more light than falls on the surface.

use std::f64::consts::PI;

use glam::{Vec2, Vec3};
use sphere::Direction;

use super::facets::HalfVector;
use super::lobe::Lobe;
use super::model::Model;
use super::parameter::{POWER, Parameter, ParameterError, Range, Value, Values, WEIGHT};
use crate::packed::{self, packed};

const EXPONENT: Parameter = Parameter::number(
    "exponent",
    "the sharpness of the highlight: the power of the half vector's cosine",
    POWER,
)
.unless(EXPONENTS);
const EXPONENTS: [&str; 2] = [EXPONENT_X.name, EXPONENT_Y.name];
const EXPONENT_X: Parameter =
    Parameter::number("exponent_x", "the sharpness along the tangent; default `exponent`", POWER).optional();
const EXPONENT_Y: Parameter =
    Parameter::number("exponent_y", "the sharpness across the tangent; default `exponent`", POWER).optional();
const DIFFUSE: Parameter =
    Parameter::colour("diffuse", "the share of the remaining light that the base reflects", WEIGHT).or(0.0);
/// Above 1 the highlight would darken toward grazing, and the base would be negative.
const SHARE: Parameter = Parameter::colour(
    "specular",
    "the share of light that the highlight reflects at normal incidence",
    Range { least: 0.0, most: 1.0, words: "a number from 0 to 1" },
);

/// The least L.h.
const MIN_COSINE: f64 = 1e-3;

/// A highlight with Fresnel over a matte base.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AshikhminShirley {
    exponent: [f64; 2],
    diffuse: [f64; 3],
    specular: [f64; 3],
}

impl AshikhminShirley {
    /// A highlight of these exponents along and across the tangent, over a matte base; colours are RGB.
    ///
    /// # Errors
    /// If an exponent is not a number from 0 to 1e9, a channel of `diffuse` not one from 0 to 1e6, or one of
    /// `specular` not one from 0 to 1.
    pub fn new(exponent: [f64; 2], diffuse: [f64; 3], specular: [f64; 3]) -> Result<Self, ParameterError> {
        if exponent[0] == exponent[1] {
            EXPONENT.checked(exponent[0])?;
        }
        Ok(Self {
            exponent: [EXPONENT_X.checked(exponent[0])?, EXPONENT_Y.checked(exponent[1])?],
            diffuse: DIFFUSE.checked_colour(diffuse)?,
            specular: SHARE.checked_colour(specular)?,
        })
    }
}

packed! {
    /// The constants of the formula of `ashikhmin-shirley`.
    pub struct AshikhminShirleyConstants as ashikhmin_shirley {
        /// e_x / 2 and e_y / 2.
        half_exponent: Vec2,
        /// The factor of rho_s.
        lobe: f32,
        /// The reflectance at normal incidence.
        specular: Vec3,
        /// The factor of rho_d.
        base: Vec3,
    }
}

impl Model for AshikhminShirley {
    type Constants = AshikhminShirleyConstants;

    const NAME: &'static str = "ashikhmin-shirley";
    const SUMMARY: &'static str = "a highlight with Fresnel, stretched or not, over a matte base";
    const PARAMETERS: &'static [Parameter] = &[EXPONENT, EXPONENT_X, EXPONENT_Y, DIFFUSE, SHARE];

    fn from_values(values: &Values) -> Result<Self, ParameterError> {
        let exponent = values.stretched(&EXPONENT, EXPONENTS)?;
        Self::new(exponent, values.colour("diffuse")?, values.colour("specular")?)
    }

    fn values(&self) -> Values {
        let [x, y] = self.exponent;
        let values = Values::default()
            .with("exponent", Value::Number(x))
            .with("diffuse", Value::Colour(self.diffuse))
            .with("specular", Value::Colour(self.specular));
        if self.is_isotropic() { values } else { values.with("exponent_y", Value::Number(y)) }
    }

    fn rho_hat(&self, incident: Direction, outgoing: Direction) -> [f64; 3] {
        let Some(half) = HalfVector::new(incident, outgoing) else { return [0.0; 3] };
        let [e_x, e_y] = self.exponent;
        let (light, view, facet) = (half.light, half.view, half.facet());
        let sum = half.sum;
        let across = sum.x * sum.x + sum.y * sum.y;
        // h_x^2 / (1 - (N.h)^2) is the square of the azimuth's cosine; at the pole every power of the cosine
        // is 1.
        let power = if across > 0.0 { (e_x * sum.x * sum.x + e_y * sum.y * sum.y) / across } else { 0.0 };
        let lobe =
            ((e_x + 1.0) * (e_y + 1.0)).sqrt() / (8.0 * PI) * math::pow(half.cos2().min(1.0), 0.5 * power);
        let lobe = lobe / facet.max(MIN_COSINE) * (light / light.max(view));
        let grazing = math::powi((1.0 - facet).max(0.0), 5);
        let fade = |cosine: f64| 1.0 - math::powi(1.0 - 0.5 * cosine, 5);
        let base = 28.0 / (23.0 * PI) * fade(light) * fade(view) * light;
        [0, 1, 2].map(|channel| {
            let (diffuse, specular) = (self.diffuse[channel], self.specular[channel]);
            lobe * (specular + (1.0 - specular) * grazing) + base * diffuse * (1.0 - specular)
        })
    }

    fn constants(&self) -> AshikhminShirleyConstants {
        let [x, y] = self.exponent;
        let base = |channel: usize| self.diffuse[channel] * (1.0 - self.specular[channel]);
        AshikhminShirleyConstants {
            half_exponent: packed::two([0.5 * x, 0.5 * y]),
            lobe: (((x + 1.0) * (y + 1.0)).sqrt() / (8.0 * PI)) as f32,
            specular: packed::rgb(self.specular),
            base: packed::rgb([0, 1, 2].map(|channel| base(channel) * 28.0 / (23.0 * PI))),
        }
    }

    fn examples() -> Result<Vec<Self>, ParameterError> {
        Ok(vec![
            Self::new([50.0, 50.0], [0.5; 3], [0.04; 3])?,
            Self::new([50.0, 8.0], [0.5; 3], [0.04, 1.0, 0.3])?,
        ])
    }

    fn lobes(&self) -> Vec<Lobe> {
        vec![Lobe::facets_of_powers(self.exponent), Lobe::Cosine]
    }

    fn is_isotropic(&self) -> bool {
        self.exponent[0] == self.exponent[1]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::models::tests::assert_fingerprint;

    #[test]
    fn fingerprint() {
        let shirley = |x: f64, y: f64| AshikhminShirley::new([x, y], [0.5; 3], [0.04; 3]).unwrap();
        assert_fingerprint(
            &shirley(50.0, 50.0),
            [2.172572473323e-01, 1.375299289885e-01, 4.850920452489e-02, 1.204343244448e-01],
        );
        assert_fingerprint(
            &shirley(50.0, 8.0),
            [1.896100291036e-01, 1.106955331141e-01, 1.909066268143e-01, 1.204341804447e-01],
        );
    }
}
