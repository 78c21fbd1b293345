//! How much of a function each degree holds, and the degree that holds enough [Ram02, eqs. 5.15 and 5.16].
//!
//! Harmonics are orthonormal, so that the integral of L^2 over the sphere is the sum of all |L_lm|^2
//! (Parseval).

use std::f64::consts::TAU;

use rayon::prelude::*;
use sphere::LatLong;

use crate::quadrature::fejer;
use crate::{Expansion, ImageRows, Sample, Stop, Stopped, unstopped};

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
    /// If `share` is not above 0 and below 1.
    pub fn new(share: f64) -> Result<Self, ToleranceOutOfRange> {
        if share > 0.0 && share < 1.0 { Ok(Self(share)) } else { Err(ToleranceOutOfRange(share)) }
    }

    /// The share as a number.
    pub fn get(self) -> f64 {
        self.0
    }
}

/// Sum over m of |L_lm|^2, RGB, for l = 0 ..= degree: the integral of that degree's part squared (equation
/// 5.15).
pub fn energy_per_degree(expansion: &Expansion) -> Vec<[f64; 3]> {
    let rows = expansion.coefficients();
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

/// The integral over the sphere of an image squared, RGB (the left side of [Ram02, eq. 5.15]), by the
/// quadrature of [`crate::Transform`]. If the image is an expansion, this is the sum of its energies.
///
/// `pixels` are RGB, row by row from the top. Exact if the degree of the square is below the number of rows
/// and the number of columns.
///
/// # Panics
/// If the number of pixels is not that of the grid, or the grid has no column.
///
/// # Example: a constant sky has an energy of 4 pi
/// ```
/// let grid = sphere::LatLong::with_rows(8);
/// let energy = sh::image_energy(grid, &vec![[1.0f32; 3]; grid.len()]);
/// assert!((energy[0] - 4.0 * std::f64::consts::PI).abs() < 1e-13);
/// ```
pub fn image_energy<T: Sample>(grid: LatLong, pixels: &[[T; 3]]) -> [f64; 3] {
    unstopped(|stop| image_energy_of_rows(grid, &pixels, stop))
}

/// [`image_energy`] of an image whose rows are read a few at a time. `stop` is asked before some of them are
/// read.
///
/// # Errors
/// If it was stopped.
///
/// # Panics
/// If the number of pixels is not that of the grid, or the grid has no column.
pub fn image_energy_of_rows<T: Sample>(
    grid: LatLong,
    image: &impl ImageRows<T>,
    stop: Stop<'_>,
) -> Result<[f64; 3], Stopped> {
    assert_eq!(image.pixel_count(), grid.len(), "pixels of the grid");
    let at_once = image.rows_at_once();
    let rows = |scratch: &mut Vec<_>, band: usize| {
        stop.check()?;
        let rows = band * at_once..((band + 1) * at_once).min(grid.height);
        Ok(image.squares_of_rows(grid.width, rows, scratch))
    };
    let bands = (0..grid.height.div_ceil(at_once)).into_par_iter().map_init(Vec::new, rows);
    let sums = bands.collect::<Result<Vec<_>, Stopped>>()?;
    let mut energy = [0.0; 3];
    for (sum, weight) in sums.into_iter().flatten().zip(fejer(grid.height)) {
        for channel in 0..3 {
            energy[channel] += weight * TAU / grid.width as f64 * sum[channel];
        }
    }
    Ok(energy)
}

/// The least F whose degrees hold (1 - tolerance) of `total` [Ram02, eq. 5.16]; `None` if all of them
/// together hold less.
///
/// `energy` is that of l = 0, 1, ..., summed over channels; `total` is the integral of L^2, summed over
/// channels: of the image, which includes what lies past the last degree, or the sum of `energy`, which does
/// not.
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
    use crate::{Degree, Transform};

    /// Parseval, on 16 rows: the square of degree 7 is of degree 14, which the quadrature integrates exactly.
    #[test]
    fn the_energy_of_an_image_is_that_of_its_expansion() {
        let (grid, degree) = (LatLong::with_rows(16), Degree::new(7).unwrap());
        let rows = (0..64).map(|row| [1.0, f64::from(row % 5), f64::from(row) - 30.0]).collect();
        let f = Expansion::from_coefficients(degree, rows).unwrap();
        let pixels: Vec<[f64; 3]> = Transform::new(grid, degree).unwrap().synthesise(&f);
        let energy = image_energy(grid, &pixels);
        for channel in 0..3 {
            let expected: f64 = energy_per_degree(&f).iter().map(|rgb| rgb[channel]).sum();
            assert!((energy[channel] / expected - 1.0).abs() < 1e-13, "{energy:?}");
        }
    }

    #[test]
    fn energy_counts_each_degree_once() {
        let rows = (0..9).map(|row| [1.0, f64::from(row), 0.0]).collect();
        let f = Expansion::from_coefficients(Degree::new(2).unwrap(), rows).unwrap();
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
