//! The directions of rays, and weights that integrate every harmonic up to a degree exactly.
//!
//! Points on a spiral, z_i = 1 - (2 i + 1) / n and phi_i = i times the golden angle, cover the sphere evenly
//! and put no row on a horizon. With equal weights they integrate harmonics to about 1 / n; a small change of
//! each weight, the least one, makes that exact: w <- w + (4 pi / n) Y (integral of Y - sum of w Y),
//! repeated, where Y holds every harmonic at every point. For n well above (degree + 1)^2 each round leaves a
//! small share of the error.

use std::f64::consts::{PI, TAU};

use sh::{Basis, Degree};
use sphere::{DVec3, Direction};

/// Directions and weights, exact to a degree.
#[derive(Clone, Debug, PartialEq)]
pub struct Directions {
    degree: Degree,
    directions: Vec<Direction>,
    weights: Vec<f64>,
    /// Every harmonic at every direction, times the weight: [direction, (degree + 1)^2].
    weighted: Vec<f64>,
}

/// The most rounds of the correction.
const ROUNDS: usize = 200;
/// The error of an integral at which the correction ends.
const EXACT: f64 = 1e-13;

impl Directions {
    /// `count` directions whose weights are exact to `degree`; `None` if they are too few for that: about
    /// twice (degree + 1)^2 are enough.
    ///
    /// # Example: the weights sum to the sphere's solid angle
    /// ```
    /// let directions = transfer::Directions::new(1024, sh::Degree::new(8)?).unwrap();
    /// let sum: f64 = directions.weights().iter().sum();
    /// assert!((sum - 4.0 * std::f64::consts::PI).abs() < 1e-12);
    /// # Ok::<(), sh::DegreeTooHigh>(())
    /// ```
    pub fn new(count: usize, degree: Degree) -> Option<Self> {
        let golden = PI * (3.0 - 5f64.sqrt());
        let directions: Vec<Direction> = (0..count)
            .map(|i| {
                let z = 1.0 - (2 * i + 1) as f64 / count as f64;
                let (sine, cosine) = math::sin_cos(i as f64 * golden % TAU);
                let across = (1.0 - z * z).sqrt();
                Direction::normalised(DVec3::new(across * cosine, across * sine, z))
            })
            .collect();
        let (basis, rows) = (Basis::new(degree), degree.rows());
        let mut harmonics = vec![0.0; count * rows];
        for (direction, row) in directions.iter().zip(harmonics.chunks_exact_mut(rows)) {
            basis.evaluate_into(*direction, row);
        }
        let equal = 4.0 * PI / count as f64;
        let mut weights = vec![equal; count];
        for _ in 0..ROUNDS {
            let mut missing = vec![0.0; rows];
            missing[0] = (4.0 * PI).sqrt();
            for (weight, row) in weights.iter().zip(harmonics.chunks_exact(rows)) {
                missing.iter_mut().zip(row).for_each(|(missing, y)| *missing -= weight * y);
            }
            if missing.iter().all(|missing| missing.abs() < EXACT) {
                let weighted = harmonics.chunks_exact(rows).zip(&weights);
                let weighted =
                    weighted.flat_map(|(row, weight)| row.iter().map(move |y| weight * y)).collect();
                return Some(Self { degree, directions, weights, weighted });
            }
            for (weight, row) in weights.iter_mut().zip(harmonics.chunks_exact(rows)) {
                *weight += equal * row.iter().zip(&missing).map(|(y, missing)| y * missing).sum::<f64>();
            }
        }
        None
    }

    /// The degree to which integrals are exact.
    pub fn degree(&self) -> Degree {
        self.degree
    }

    /// The directions.
    pub fn directions(&self) -> &[Direction] {
        &self.directions
    }

    /// The weight of each direction; they sum to 4 pi.
    pub fn weights(&self) -> &[f64] {
        &self.weights
    }

    /// Every harmonic at a direction, times its weight.
    pub(crate) fn weighted(&self, index: usize) -> &[f64] {
        let rows = self.degree.rows();
        &self.weighted[index * rows..][..rows]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn products_of_harmonics_integrate_to_the_identity() {
        for (count, degree) in [(256, 8), (1024, 12), (4096, 8), (2, 0)] {
            let directions = Directions::new(count, Degree::new(degree).unwrap()).unwrap();
            let half = Degree::new(degree / 2).unwrap();
            let basis = Basis::new(half);
            let mut sums = vec![0.0; half.rows() * half.rows()];
            let mut row = vec![0.0; half.rows()];
            for (direction, weight) in directions.directions().iter().zip(directions.weights()) {
                basis.evaluate_into(*direction, &mut row);
                for i in 0..half.rows() {
                    for j in 0..half.rows() {
                        sums[i * half.rows() + j] += weight * row[i] * row[j];
                    }
                }
            }
            for i in 0..half.rows() {
                for j in 0..half.rows() {
                    let expected = f64::from(u8::from(i == j));
                    assert!((sums[i * half.rows() + j] - expected).abs() < 1e-12, "{count} {i} {j}");
                }
            }
            assert!(directions.weights().iter().all(|weight| *weight > 0.0));
        }
    }

    #[test]
    fn too_few_directions_are_none() {
        assert_eq!(Directions::new(0, Degree::ZERO), None);
        assert_eq!(Directions::new(60, Degree::new(8).unwrap()), None);
    }
}
