//! The integrals of three real harmonics, Y_i Y_j Y_k: few of them are not zero.

use sh::quadrature::gauss_legendre;
use sh::{Basis, Degree};
use sphere::Direction;

/// The integrals for i up to degree O, j up to F and k up to O + F that are not zero: 2,229 of 50,625 for O =
/// F = 4.
pub(crate) struct TripleProducts {
    /// The terms: i * (F+1)^2 + j, k and the integral, in this order.
    pub(crate) terms: Vec<(u32, u32, f64)>,
}

impl TripleProducts {
    /// Computes the integrals by a rule that is exact to degree 2 (O + F): Gauss-Legendre in cos(theta),
    /// equal steps in phi.
    pub(crate) fn new(output: Degree, input: Degree) -> Self {
        let sum = Degree::new(output.get() + input.get()).unwrap_or(Degree::MAX);
        let (nodes, weights) = gauss_legendre(sum.get() + 1);
        let columns = 2 * sum.get() + 1;
        let basis = Basis::new(sum);
        let (rows, outputs, inputs) = (sum.rows(), output.rows(), input.rows());
        let mut integrals = vec![0.0; outputs * inputs * rows];
        let mut y = vec![0.0; rows];
        for (theta, weight) in nodes.iter().zip(&weights) {
            for column in 0..columns {
                let phi = std::f64::consts::TAU * column as f64 / columns as f64;
                basis.evaluate_into(Direction::from_angles(*theta, phi), &mut y);
                let weight = weight * std::f64::consts::TAU / columns as f64;
                for (entry, integrals) in integrals.chunks_exact_mut(rows).enumerate() {
                    let factor = weight * y[entry / inputs] * y[entry % inputs];
                    integrals.iter_mut().zip(&y).for_each(|(integral, y)| *integral += factor * y);
                }
            }
        }
        let terms = integrals.into_iter().enumerate().filter(|(_, integral)| integral.abs() > 1e-12);
        let terms = terms.map(|(index, integral)| ((index / rows) as u32, (index % rows) as u32, integral));
        Self { terms: terms.collect() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn few_are_not_zero_and_those_with_a_constant_are_the_identity() {
        let degree = Degree::new(4).unwrap();
        let products = TripleProducts::new(degree, degree);
        assert_eq!(products.terms.len(), 2229, "of 50,625");
        let constant: Vec<_> = products.terms.iter().filter(|(_, k, _)| *k == 0).collect();
        assert_eq!(constant.len(), 25);
        for (entry, _, integral) in constant {
            assert_eq!(entry / 25, entry % 25);
            assert!((integral - 0.5 / std::f64::consts::PI.sqrt()).abs() < 1e-13);
        }
        let wide = TripleProducts::new(Degree::new(2).unwrap(), Degree::ZERO);
        assert_eq!(wide.terms.len(), 9);
    }
}
