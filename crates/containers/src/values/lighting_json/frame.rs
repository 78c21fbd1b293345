//! An expansion seen in another frame: a signed permutation of the axes, with or without a reflection.
//!
//! With w' = A w, the same function has the coefficients f'_lm = sum over n of T^l_mn f_ln, where T^l_mn =
//! integral of Y_lm(A w) Y_ln(w) dw. The integrand is a polynomial of degree 2 l, which a product of
//! Gauss-Legendre and equidistant nodes integrates, but for rounding. Rounding is then undone: A is made of
//! quarter turns, whose matrices have entries +-sqrt(n) / 2^(l+1) with whole n, so that each axis keeps its 0
//! and 1.

use std::f64::consts::TAU;

use sh::{Basis, Degree, Expansion};
use sphere::{DVec3, Direction};

/// The highest degree that is converted. The matrices are dense.
pub(crate) const MAX_DEGREE: usize = 8;

/// The coefficients of `expansion` for harmonics of `to(w)`; `to` permutes axes and flips their signs.
///
/// # Panics
/// If the degree is past [`MAX_DEGREE`].
pub(crate) fn seen_in(expansion: &Expansion, to: fn(DVec3) -> DVec3) -> Expansion {
    let degree = expansion.degree();
    assert!(degree.get() <= MAX_DEGREE, "the matrices stay small");
    let transfer = transfer(degree, to);
    let size = degree.rows();
    let mut seen = Expansion::zero(degree);
    for l in 0..=degree.get() {
        for row in l * l..(l + 1) * (l + 1) {
            for column in l * l..(l + 1) * (l + 1) {
                let weight = transfer[row * size + column];
                for channel in 0..3 {
                    seen.coefficients_mut()[row][channel] +=
                        weight * expansion.coefficients()[column][channel];
                }
            }
        }
    }
    seen
}

/// T of every degree, as one square matrix by rows.
fn transfer(degree: Degree, to: fn(DVec3) -> DVec3) -> Vec<f64> {
    let size = degree.rows();
    let basis = Basis::new(degree);
    let (mut here, mut there) = (vec![0.0; size], vec![0.0; size]);
    let mut matrix = vec![0.0; size * size];
    let columns = 2 * degree.get() + 1;
    let (thetas, weights) = sh::quadrature::gauss_legendre(degree.get() + 1);
    for (theta, weight) in thetas.iter().zip(&weights) {
        for column in 0..columns {
            let w = Direction::from_angles(*theta, TAU * column as f64 / columns as f64);
            basis.evaluate_into(w, &mut here);
            basis.evaluate_into(Direction::normalised(to(w.vector())), &mut there);
            for row in 0..size {
                for column in 0..size {
                    matrix[row * size + column] += weight * there[row] * here[column];
                }
            }
        }
    }
    for row in 0..size {
        let unit = math::powi(2.0_f64, row.isqrt() as i32 + 1);
        for entry in &mut matrix[row * size..][..size] {
            *entry = exact(*entry * TAU / columns as f64, unit);
        }
    }
    matrix
}

/// The nearest +-sqrt(n) / unit, if it is nearer than rounding explains.
fn exact(entry: f64, unit: f64) -> f64 {
    let square = (entry * unit) * (entry * unit);
    let whole = square.round();
    if (square - whole).abs() < 1e-9 { (whole.sqrt() / unit).copysign(entry) } else { entry }
}
