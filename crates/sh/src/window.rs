//! Windows: factors per degree that calm the ringing of a series cut at degree F.
//!
//! All three are in Sloan 2008, "Stupid spherical harmonics (SH) tricks", section "Windowing":
//!
//! - Hanning: (1 + cos(pi l / (F + 1))) / 2;
//! - Lanczos: sin(x) / x, x = pi l / (F + 1);
//! - Laplacian: 1 / (1 + lambda l^2 (l + 1)^2), the f that minimises integral of (f - f_0)^2 + lambda
//!   integral of (Laplacian f)^2, because the Laplacian of Y_lm is -l (l+1) Y_lm.
//!
//! The first two would reach 0 at degree F + 1, the first that is missing.

use std::f64::consts::PI;

use crate::{Degree, Expansion};

/// Raised when the results of this kernel change: every kind of stage that calls it adds this to its own
/// revision.
pub const REVISION: u32 = 1;

/// A factor for each degree; 1 at degree 0, so that the mean is kept.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Window {
    /// 1 for every degree.
    None,
    /// Half a period of a raised cosine.
    Hanning,
    /// The main lobe of a sinc.
    Lanczos,
    /// A penalty on the squared Laplacian.
    Laplacian(Penalty),
}

/// lambda, the weight of the squared Laplacian: finite, 0 or more.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
pub struct Penalty(f64);

/// A penalty that is not a finite number of 0 or more.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("penalty {0} is not a finite number of 0 or more")]
pub struct PenaltyOutOfRange(pub f64);

impl Penalty {
    /// No penalty: the window changes nothing.
    pub const ZERO: Self = Self(0.0);

    /// A checked penalty.
    ///
    /// # Errors
    /// If `lambda` is negative, infinite or not a number.
    pub fn new(lambda: f64) -> Result<Self, PenaltyOutOfRange> {
        if lambda >= 0.0 && lambda.is_finite() { Ok(Self(lambda)) } else { Err(PenaltyOutOfRange(lambda)) }
    }

    /// lambda as a number.
    pub fn get(self) -> f64 {
        self.0
    }
}

impl Window {
    /// The factor of degree `l` in an expansion cut at `degree`.
    ///
    /// # Example: Hanning halves the middle degree
    /// ```
    /// let factor = sh::Window::Hanning.factor(2, sh::Degree::new(3)?);
    /// assert!((factor - 0.5).abs() < 1e-15);
    /// # Ok::<(), sh::DegreeTooHigh>(())
    /// ```
    pub fn factor(self, l: usize, degree: Degree) -> f64 {
        let x = PI * l as f64 / (degree.get() + 1) as f64;
        match self {
            Self::None => 1.0,
            Self::Hanning => (1.0 + math::cos(x)) / 2.0,
            Self::Lanczos if l == 0 => 1.0,
            Self::Lanczos => math::sin(x) / x,
            Self::Laplacian(Penalty(lambda)) => {
                let eigenvalue = (l * (l + 1)) as f64;
                1.0 / (1.0 + lambda * eigenvalue * eigenvalue)
            }
        }
    }

    /// The expansion with every coefficient times the factor of its degree.
    pub fn apply(self, expansion: &Expansion) -> Expansion {
        let degree = expansion.degree();
        let mut windowed = expansion.clone();
        let rows = windowed.coefficients_mut();
        for l in 0..=degree.get() {
            let factor = self.factor(l, degree);
            for row in &mut rows[l * l..(l + 1) * (l + 1)] {
                *row = row.map(|value| value * factor);
            }
        }
        windowed
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ALL: [Window; 4] =
        [Window::None, Window::Hanning, Window::Lanczos, Window::Laplacian(Penalty(0.01))];

    #[test]
    fn factors_fall_from_1_and_stay_above_0() {
        for window in ALL {
            for degree in [0, 1, 6, 2048].map(|l| Degree::new(l).unwrap()) {
                let mut last = window.factor(0, degree);
                assert_eq!(last, 1.0, "{window:?}");
                for l in 1..=degree.get() {
                    let factor = window.factor(l, degree);
                    assert!(factor > 0.0 && factor <= last, "{window:?} {l}: {factor}");
                    last = factor;
                }
            }
        }
    }

    #[test]
    fn factors_are_those_of_the_paper() {
        let degree = Degree::new(5).unwrap();
        assert!((Window::Hanning.factor(2, degree) - 0.75).abs() < 1e-15);
        assert!((Window::Lanczos.factor(3, degree) - 2.0 / PI).abs() < 1e-15);
        assert!((Window::Laplacian(Penalty(0.5)).factor(2, degree) - 1.0 / 19.0).abs() < 1e-15);
    }

    #[test]
    fn a_window_scales_whole_degrees() {
        let degree = Degree::new(3).unwrap();
        let rows = (0..16).map(|row| [f64::from(row), 1.0, -1.0]).collect();
        let f = Expansion::from_coefficients(degree, rows).unwrap();
        let windowed = Window::Lanczos.apply(&f);
        for l in 0..=3 {
            for m in -(l as isize)..=l as isize {
                let factor = Window::Lanczos.factor(l, degree);
                assert_eq!(windowed.get(l, m), f.get(l, m).map(|value| value * factor));
            }
        }
    }

    #[test]
    fn penalties_are_finite_and_not_negative() {
        for lambda in [-1e-9, f64::NAN, f64::INFINITY] {
            assert!(Penalty::new(lambda).is_err());
        }
    }
}
