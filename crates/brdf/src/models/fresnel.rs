//! Fresnel's equations for unpolarised light: the reflectance of a smooth facet.

use glam::Vec3;

use super::parameter::{Parameter, ParameterError, Range, Value, Values};
use crate::packed::{self, packed};

pub(crate) const IOR: Parameter = Parameter::number(
    "ior",
    "the index of refraction of a dielectric (glass 1.5, water 1.33); or give `n` and `k`",
    Range { least: 1.0, most: 10.0, words: "a number from 1 to 10" },
)
.optional();
pub(crate) const N: Parameter = Parameter::colour(
    "n",
    "the index of refraction of a conductor, with `k`",
    Range { least: 0.01, most: 50.0, words: "a number from 0.01 to 50" },
)
.optional();
pub(crate) const K: Parameter = Parameter::colour(
    "k",
    "the extinction of a conductor, with `n`",
    Range { least: 0.0, most: 50.0, words: "a number from 0 to 50" },
)
.optional();

/// The material of a facet.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Fresnel {
    /// A dielectric of this index of refraction, 1 to 10; 1 reflects nothing.
    Dielectric(f64),
    /// A conductor.
    Conductor {
        /// The index of refraction, RGB, each 0.01 to 50.
        n: [f64; 3],
        /// The extinction, RGB, each 0 to 50.
        k: [f64; 3],
    },
}

packed! {
    /// The constants of Fresnel's equations.
    pub struct FresnelConstants as fresnel {
        /// Whether the facet is of a conductor.
        is_conductor: bool,
        /// The index of refraction; that of a dielectric in all channels.
        n: Vec3,
        /// The extinction of a conductor.
        k: Vec3,
    }
}

impl Fresnel {
    /// Gold at about 630, 530 and 460 nm, for examples.
    pub(crate) const GOLD: Self = Self::Conductor { n: [0.14, 0.43, 1.4], k: [4.1, 2.4, 1.9] };

    pub(crate) fn checked(self) -> Result<Self, ParameterError> {
        match self {
            Self::Dielectric(ior) => IOR.checked(ior).map(|_| self),
            Self::Conductor { n, k } => {
                N.checked_colour(n)?;
                K.checked_colour(k).map(|_| self)
            }
        }
    }

    pub(crate) fn from_values(values: &Values) -> Result<Self, ParameterError> {
        let (n, k) = (values.optional_colour("n"), values.optional_colour("k"));
        match (values.optional_number("ior"), n, k) {
            (Some(ior), None, None) => Ok(Self::Dielectric(ior)),
            (None, Some(n), Some(k)) => Ok(Self::Conductor { n, k }),
            (None, None, None) => Err(ParameterError::whole("ior", "is missing; give ior, or n and k")),
            (None, Some(_), None) => Err(ParameterError::whole("n", "has no effect without k; give both")),
            (None, None, Some(_)) => Err(ParameterError::whole("k", "has no effect without n; give both")),
            (Some(_), _, _) => {
                Err(ParameterError::whole("ior", "conflicts with n or k; give ior, or n and k"))
            }
        }
    }

    pub(crate) fn values(&self) -> Values {
        match *self {
            Self::Dielectric(ior) => Values::default().with("ior", Value::Number(ior)),
            Self::Conductor { n, k } => {
                Values::default().with("n", Value::Colour(n)).with("k", Value::Colour(k))
            }
        }
    }

    /// The constants of the formula.
    pub(crate) fn constants(&self) -> FresnelConstants {
        let (is_conductor, n, k) = match *self {
            Self::Dielectric(ior) => (false, [ior; 3], [0.0; 3]),
            Self::Conductor { n, k } => (true, n, k),
        };
        FresnelConstants { is_conductor, n: packed::rgb(n), k: packed::rgb(k) }
    }

    /// The reflectance, RGB, for light at an angle of this cosine, above 0.
    pub(crate) fn at(&self, cosine: f64) -> [f64; 3] {
        match self {
            Self::Dielectric(ior) => [dielectric(*ior, cosine); 3],
            Self::Conductor { n, k } => [0, 1, 2].map(|channel| conductor(n[channel], k[channel], cosine)),
        }
    }
}

/// The reflectance in Cook and Torrance's form ("A Reflectance Model for Computer Graphics", 1982).
fn dielectric(ior: f64, c: f64) -> f64 {
    let g = (ior * ior - 1.0 + c * c).sqrt();
    let parallel = (c * (g + c) - 1.0) / (c * (g - c) + 1.0);
    let share = (g - c) / (g + c);
    0.5 * share * share * (1.0 + parallel * parallel)
}

/// The exact reflectance, with a^2 + b^2 = sqrt((n^2 - k^2 - sin^2)^2 + 4 n^2 k^2) (Born and Wolf, 14.2).
fn conductor(n: f64, k: f64, c: f64) -> f64 {
    let (cos2, sin2) = (c * c, 1.0 - c * c);
    let real = n * n - k * k - sin2;
    let size = (real * real + 4.0 * n * n * k * k).sqrt();
    let twice = 2.0 * c * (0.5 * (size + real)).max(0.0).sqrt();
    let s = (size + cos2 - twice) / (size + cos2 + twice);
    let (sum, part) = (cos2 * size + sin2 * sin2, twice * sin2);
    0.5 * s * (1.0 + (sum - part) / (sum + part))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// At normal incidence the reflectance is |(m - 1) / (m + 1)|^2 with m = n + i k.
    #[test]
    fn closed_forms_at_normal_incidence() {
        let glass = Fresnel::Dielectric(1.5).at(1.0)[0];
        assert!((glass - 0.04).abs() < 1e-15);
        for (n, k) in [(0.2, 3.9), (1.5, 0.0), (2.9, 3.1), (0.01, 0.0)] {
            let expected = ((n - 1.0f64).powi(2) + k * k) / ((n + 1.0f64).powi(2) + k * k);
            let found = Fresnel::Conductor { n: [n; 3], k: [k; 3] }.at(1.0)[0];
            assert!((found - expected).abs() < 1e-14, "n {n}, k {k}: {found} {expected}");
        }
    }

    /// Fresnel's amplitudes with Snell's law: the oracle for dielectrics, and for conductors without
    /// extinction.
    #[test]
    fn both_forms_are_fresnels() {
        for ior in [1.1, 1.5, 4.0] {
            for degrees in [1.0f64, 30.0, 56.0, 80.0, 89.9] {
                let (sine, cosine) = degrees.to_radians().sin_cos();
                let inside = (1.0 - (sine / ior) * (sine / ior)).sqrt();
                let s = (cosine - ior * inside) / (cosine + ior * inside);
                let p = (ior * cosine - inside) / (ior * cosine + inside);
                let expected = 0.5 * (s * s + p * p);
                assert!((dielectric(ior, cosine) - expected).abs() < 1e-13);
                assert!((conductor(ior, 0.0, cosine) - expected).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn shares_are_0_to_1_and_1_at_grazing() {
        for fresnel in [
            Fresnel::Dielectric(1.0),
            Fresnel::Dielectric(10.0),
            Fresnel::Conductor { n: [0.01, 1.0, 50.0], k: [0.0, 50.0, 3.0] },
        ] {
            for i in 1..=1000 {
                let shares = fresnel.at(f64::from(i) / 1000.0);
                assert!(
                    shares.iter().all(|share| (0.0..=1.0 + 1e-12).contains(share)),
                    "{fresnel:?} {shares:?}"
                );
            }
            assert!(fresnel.at(1e-300).iter().all(|share| share.is_finite()));
        }
        assert!((Fresnel::Dielectric(1.5).at(1e-9)[0] - 1.0).abs() < 1e-7);
    }
}
