//! `kajiya-kay`: a highlight along a fibre, such as hair and brushed metal.
//!
//! rho_hat = specular * max(0, cos(theta_i - theta_o))^s, both angles from the tangent T, s the `exponent`
//! (Kajiya and Kay, "Rendering Fur with Three Dimensional Textures", 1989, in the form of [RH02, sec. 7.1]).
//! The tangent is the surface's +X; no direction about it is special, so that rho_hat depends on neither the
//! normal nor a horizon.
//!
//! The model is not normalised: `specular` is its greatest value, in 1/sr. rho_hat itself, rather than the
//! BRDF, is symmetric in light and view.

use glam::Vec3;
use sphere::Direction;

use super::lobe::Lobe;
use super::model::Model;
use super::parameter::{POWER, Parameter, ParameterError, SPECULAR, Value, Values};
use crate::coefficients::Centre;
use crate::packed::{self, packed};

const EXPONENT: Parameter =
    Parameter::number("exponent", "the sharpness of the highlight: the power of the cosine", POWER);

/// A highlight along a fibre.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KajiyaKay {
    exponent: f64,
    specular: [f64; 3],
}

impl KajiyaKay {
    /// A highlight cos^`exponent` of greatest value `specular`, RGB, in 1/sr.
    ///
    /// # Errors
    /// If `exponent` is not a number from 0 to 1e9, or a channel of `specular` not one from 0 to 1e6.
    pub fn new(exponent: f64, specular: [f64; 3]) -> Result<Self, ParameterError> {
        Ok(Self { exponent: EXPONENT.checked(exponent)?, specular: SPECULAR.checked_colour(specular)? })
    }
}

packed! {
    /// The constants of the formula of `kajiya-kay`.
    pub struct KajiyaKayConstants as kajiya_kay {
        /// s.
        exponent: f32,
        /// The greatest value.
        specular: Vec3,
    }
}

impl Model for KajiyaKay {
    type Constants = KajiyaKayConstants;

    const NAME: &'static str = "kajiya-kay";
    const SUMMARY: &'static str = "a highlight along a fibre, about the tangent; not normalised";
    const PARAMETERS: &'static [Parameter] = &[EXPONENT, SPECULAR];

    fn from_values(values: &Values) -> Result<Self, ParameterError> {
        Self::new(values.number("exponent")?, values.colour("specular")?)
    }

    fn values(&self) -> Values {
        Values::default()
            .with("exponent", Value::Number(self.exponent))
            .with("specular", Value::Colour(self.specular))
    }

    fn centre(&self) -> Centre {
        Centre::Tangent
    }

    fn has_horizon(&self) -> bool {
        false
    }

    fn rho_hat(&self, incident: Direction, outgoing: Direction) -> [f64; 3] {
        let (light, view) = (incident.vector(), outgoing.vector());
        // cos(theta_i - theta_o) = cos cos + sin sin.
        let sines = (light.y * light.y + light.z * light.z) * (view.y * view.y + view.z * view.z);
        let cosine = light.x * view.x + sines.sqrt();
        let value = if cosine > 0.0 { math::pow(cosine.min(1.0), self.exponent) } else { 0.0 };
        self.specular.map(|specular| specular * value)
    }

    fn constants(&self) -> KajiyaKayConstants {
        KajiyaKayConstants { exponent: self.exponent as f32, specular: packed::rgb(self.specular) }
    }

    fn examples() -> Result<Vec<Self>, ParameterError> {
        Ok(vec![Self::new(6.0, [0.1; 3])?])
    }

    fn lobes(&self) -> Vec<Lobe> {
        vec![Lobe::band(math::pow(self.exponent + 1.0, -0.5))]
    }

    fn is_isotropic(&self) -> bool {
        false
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::models::tests::assert_fingerprint;

    #[test]
    fn fingerprint() {
        assert_fingerprint(
            &KajiyaKay::new(6.0, [1.0; 3]).unwrap(),
            [1.305988031739e-01, 1.494146164915e-02, 0.0, 9.094868640419e-01],
        );
    }
}
