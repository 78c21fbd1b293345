//! `lafortune`: a matte part and generalised cosine lobes, usually fitted to measurements.
//!
//! BRDF = diffuse / pi + sum over lobes of weight * max(0, cx (L_x V_x + L_y V_y) + cz L_z V_z)^n, in the
//! frame of the surface (Lafortune, Foo, Torrance and Greenberg, "Non-Linear Approximation of Reflectance
//! Functions", 1997, equation 9 with C_x = C_y); rho_hat = BRDF * max(0, cos(theta_i)). cx = -1, cz = 1 is
//! Phong's lobe, cz above -cx tilts it away from the mirror direction, and cx with the sign of cz reflects
//! light back to where it comes from.
//!
//! The model is reciprocal, but not normalised: the n, cx and cz of a fit may make light.

use std::f64::consts::PI;

use glam::Vec3;
use sphere::Direction;

use super::lobe::Lobe;
use super::model::Model;
use super::parameter::{Absent, Parameter, ParameterError, Range, Value, ValueType, Values, WEIGHT};
use crate::packed::{self, packed};

const DIFFUSE: Parameter =
    Parameter::colour("diffuse", "the share of light that the matte part reflects", WEIGHT).or(0.0);
const LOBES: Parameter = Parameter {
    name: "lobes",
    meaning: "the lobes",
    value_type: ValueType::Records(&[CX, CZ, N, LOBE_WEIGHT]),
    absent: Absent::Required,
};
const AXIS: Range = Range { least: -10.0, most: 10.0, words: "a number from -10 to 10" };
const CX: Parameter = Parameter::number("cx", "the factor of L_x V_x + L_y V_y; -1 for Phong's lobe", AXIS);
const CZ: Parameter = Parameter::number("cz", "the factor of L_z V_z; 1 for Phong's lobe", AXIS);
const N: Parameter =
    Parameter::number("n", "the power", Range { least: 0.0, most: 1e6, words: "a number from 0 to 1e6" });
const LOBE_WEIGHT: Parameter = Parameter::colour("weight", "the weight of the lobe", WEIGHT).or(1.0);

/// The highest value of a lobe before its weight.
const HIGHEST: f64 = 1e9;

/// A lobe of [`Lafortune`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LafortuneLobe {
    /// The factor of L_x V_x + L_y V_y.
    pub cx: f64,
    /// The factor of L_z V_z.
    pub cz: f64,
    /// The power of the lobe's cosine.
    pub n: f64,
    /// The weight of the lobe, RGB.
    pub weight: [f64; 3],
}

/// A matte part and generalised cosine lobes.
#[derive(Clone, Debug, PartialEq)]
pub struct Lafortune {
    diffuse: [f64; 3],
    lobes: Vec<LafortuneLobe>,
}

impl Lafortune {
    /// A surface of these lobes whose matte part reflects the share `diffuse`, RGB.
    ///
    /// # Errors
    /// If a channel of `diffuse` or a weight is not a number from 0 to 1e6, cx or cz not one from -10 to 10,
    /// n not one from 0 to 1e6, or max(|cx|, |cz|)^n is more than 1e9.
    pub fn new(diffuse: [f64; 3], lobes: Vec<LafortuneLobe>) -> Result<Self, ParameterError> {
        for (index, lobe) in lobes.iter().enumerate() {
            let checked = || {
                let factor = CX.checked(lobe.cx)?.abs().max(CZ.checked(lobe.cz)?.abs());
                N.checked(lobe.n)?;
                LOBE_WEIGHT.checked_colour(lobe.weight)?;
                if math::pow(factor, lobe.n) > HIGHEST {
                    let expected = "a power that keeps the lobe, max(|cx|, |cz|)^n, at 1e9 or below";
                    return Err(ParameterError::value("n", lobe.n, expected));
                }
                Ok(())
            };
            checked().map_err(|error| error.within("lobes", index))?;
        }
        Ok(Self { diffuse: DIFFUSE.checked_colour(diffuse)?, lobes })
    }
}

packed! {
    /// The constants of the formula of `lafortune`.
    pub struct LafortuneConstants as lafortune {
        /// diffuse / pi.
        diffuse: Vec3,
        /// The lobes.
        lobes: Vec<LafortuneLobeConstants>,
    }
}

packed! {
    /// The constants of a lobe of `lafortune`.
    pub struct LafortuneLobeConstants as lafortune_lobe {
        /// The factor of L_x V_x + L_y V_y.
        cx: f32,
        /// The factor of L_z V_z.
        cz: f32,
        /// The power of the lobe's cosine.
        n: f32,
        /// The weight of the lobe.
        weight: Vec3,
    }
}

impl Model for Lafortune {
    type Constants = LafortuneConstants;

    const NAME: &'static str = "lafortune";
    const SUMMARY: &'static str =
        "a matte part and generalised cosine lobes, fitted to measurements; not normalised";
    const PARAMETERS: &'static [Parameter] = &[DIFFUSE, LOBES];

    fn from_values(values: &Values) -> Result<Self, ParameterError> {
        let lobes = values.records("lobes")?.iter().map(|lobe| {
            Ok(LafortuneLobe {
                cx: lobe.number("cx")?,
                cz: lobe.number("cz")?,
                n: lobe.number("n")?,
                weight: lobe.colour("weight")?,
            })
        });
        Self::new(values.colour("diffuse")?, lobes.collect::<Result<_, ParameterError>>()?)
    }

    fn values(&self) -> Values {
        let lobes = self.lobes.iter().map(|lobe| {
            Values::default()
                .with("cx", Value::Number(lobe.cx))
                .with("cz", Value::Number(lobe.cz))
                .with("n", Value::Number(lobe.n))
                .with("weight", Value::Colour(lobe.weight))
        });
        Values::default()
            .with("diffuse", Value::Colour(self.diffuse))
            .with("lobes", Value::Records(lobes.collect()))
    }

    fn rho_hat(&self, incident: Direction, outgoing: Direction) -> [f64; 3] {
        let (light, view) = (incident.vector(), outgoing.vector());
        if light.z <= 0.0 {
            return [0.0; 3];
        }
        let (across, along) = (light.x * view.x + light.y * view.y, light.z * view.z);
        let mut brdf = self.diffuse.map(|diffuse| diffuse / PI);
        for lobe in &self.lobes {
            let base = lobe.cx * across + lobe.cz * along;
            if base > 0.0 {
                let value = math::pow(base, lobe.n);
                (0..3).for_each(|channel| brdf[channel] += lobe.weight[channel] * value);
            }
        }
        brdf.map(|brdf| brdf * light.z)
    }

    fn constants(&self) -> LafortuneConstants {
        let lobes = self.lobes.iter().map(|lobe| LafortuneLobeConstants {
            cx: lobe.cx as f32,
            cz: lobe.cz as f32,
            n: lobe.n as f32,
            weight: packed::rgb(lobe.weight),
        });
        let diffuse = packed::rgb(self.diffuse.map(|diffuse| diffuse / PI));
        LafortuneConstants { diffuse, lobes: lobes.collect() }
    }

    fn examples() -> Result<Vec<Self>, ParameterError> {
        let lobe = |cx: f64, cz: f64, n: f64| LafortuneLobe { cx, cz, n, weight: [1.0; 3] };
        Ok(vec![Self::new([0.1; 3], vec![lobe(-0.95, 0.8, 12.0), lobe(0.5, 0.5, 3.0)])?])
    }

    /// A lobe of the model is a power about its axis; the matte part is a cosine.
    fn lobes(&self) -> Vec<Lobe> {
        let powers = self.lobes.iter().map(|lobe| Lobe::power(lobe.cx, lobe.cz, lobe.n));
        std::iter::once(Lobe::Cosine).chain(powers).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::models::tests::assert_fingerprint;

    #[test]
    fn fingerprint() {
        let lobe = LafortuneLobe { cx: -0.95, cz: 0.8, n: 12.0, weight: [1.0; 3] };
        assert_fingerprint(
            &Lafortune::new([0.1; 3], vec![lobe]).unwrap(),
            [8.894878737077e-02, 1.128892544862e-01, 5.565270780154e-02, 2.434568433145e-02],
        );
    }
}
