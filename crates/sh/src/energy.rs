//! How much of a function each degree holds, and the degree that holds enough (thesis, equations 5.15 and 5.16).
//!
//! Harmonics are orthonormal, so that the integral of L^2 over the sphere is the sum of all |L_lm|^2 (Parseval).

use crate::Expansion;

/// The share of energy that may be lost: above 0, below 1.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
pub struct Tolerance(f64);

/// A tolerance that is not above 0 and below 1.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("tolerance {0} is not above 0 and below 1")]
pub struct ToleranceOutOfRange(pub f64);

impl Tolerance {
    /// A checked tolerance.
    ///
    /// # Errors
    /// Where `share` is not above 0 and below 1.
    pub fn new(share: f64) -> Result<Self, ToleranceOutOfRange> {
        if share > 0.0 && share < 1.0 { Ok(Self(share)) } else { Err(ToleranceOutOfRange(share)) }
    }

    /// The share as a number.
    pub fn get(self) -> f64 {
        self.0
    }
}

/// Sum over m of |L_lm|^2, RGB, for l = 0 ..= degree: the integral of that degree's part squared (equation 5.15).
pub fn energy_per_degree(expansion: &Expansion) -> Vec<[f64; 3]> {
    let rows = expansion.rows();
    (0..=expansion.degree().get())
        .map(|l| {
            let mut sum = [0.0; 3];
            for row in &rows[l * l..(l + 1) * (l + 1)] {
                for channel in 0..3 {
                    sum[channel] += row[channel] * row[channel];
                }
            }
            sum
        })
        .collect()
}

/// The least F whose degrees hold (1 - tolerance) of `total` (equation 5.16); `None` where all of them together
/// hold less.
///
/// `energy` is that of l = 0, 1, ..., summed over channels; `total` is the integral of L^2, summed over
/// channels: of the image, which counts what lies past the last degree, or the sum of `energy`, which does not.
///
/// # Example: two degrees hold 90 percent, three hold 99
/// ```
/// use sh::{Tolerance, degree_holding};
/// let energy = [8.0, 1.2, 0.7, 0.1];
/// assert_eq!(degree_holding(&energy, 10.0, Tolerance::new(0.1)?), Some(1));
/// assert_eq!(degree_holding(&energy, 10.0, Tolerance::new(0.02)?), Some(2));
/// # Ok::<(), sh::ToleranceOutOfRange>(())
/// ```
pub fn degree_holding(energy: &[f64], total: f64, tolerance: Tolerance) -> Option<usize> {
    let enough = (1.0 - tolerance.get()) * total;
    let mut held = 0.0;
    energy.iter().position(|part| {
        held += part;
        held >= enough
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Degree;

    #[test]
    fn energy_counts_each_degree_once() {
        let rows = (0..9).map(|row| [1.0, f64::from(row), 0.0]).collect();
        let f = Expansion::from_rows(Degree::new(2).unwrap(), rows).unwrap();
        assert_eq!(
            energy_per_degree(&f),
            [[1.0, 0.0, 0.0], [3.0, 1.0 + 4.0 + 9.0, 0.0], [5.0, 16.0 + 25.0 + 36.0 + 49.0 + 64.0, 0.0]]
        );
    }

    #[test]
    fn what_no_degree_holds_has_no_degree() {
        let tolerance = Tolerance::new(0.01).unwrap();
        assert_eq!(degree_holding(&[1.0, 1.0], 4.0, tolerance), None);
        assert_eq!(degree_holding(&[], 1.0, tolerance), None);
        assert_eq!(degree_holding(&[0.0, 0.0], 0.0, tolerance), Some(0), "a black function needs degree 0");
        assert_eq!(degree_holding(&[f64::NAN], f64::NAN, tolerance), None);
    }

    #[test]
    fn tolerances_lie_between_0_and_1() {
        for share in [0.0, 1.0, -0.1, f64::NAN, f64::INFINITY] {
            assert!(Tolerance::new(share).is_err(), "{share}");
        }
    }
}
