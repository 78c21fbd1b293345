//! Phong's lobe as the talk has it: its integral over the sphere is 1.

use std::f64::consts::TAU;

use sh::{Degree, Expansion, quadrature, zonal_into};
use sphere::{DVec3, Direction};

/// f(w) = (s + 1) / (2 pi) max(axis . w, 0)^s.
#[derive(Clone, Copy, Debug)]
pub struct Phong {
    /// s.
    pub exponent: u32,
    /// Where the lobe is largest.
    pub axis: Direction,
}

impl Phong {
    /// f in the direction of a unit vector.
    pub fn value(&self, w: DVec3) -> f64 {
        self.at_cosine(self.axis.vector().dot(w))
    }

    fn at_cosine(&self, cosine: f64) -> f64 {
        f64::from(self.exponent + 1) / TAU * cosine.max(0.0).powi(self.exponent.cast_signed())
    }

    /// u_l, the coefficients of f about +Z in Y_l0: Gauss' rule on the hemisphere, exact for these
    /// polynomials.
    fn zonal(&self, degree: Degree) -> Vec<f64> {
        let top = degree.get();
        let (nodes, weights) = quadrature::gauss_legendre(self.exponent as usize / 2 + top / 2 + 1);
        let (mut u, mut harmonics) = (vec![0.0; top + 1], vec![0.0; top + 1]);
        for (theta, weight) in nodes.iter().zip(&weights) {
            let cosine = 0.5 + 0.5 * theta.cos();
            zonal_into(cosine, &mut harmonics);
            let mass = TAU * 0.5 * weight * self.at_cosine(cosine);
            u.iter_mut().zip(&harmonics).for_each(|(u, y)| *u += mass * y);
        }
        u
    }

    /// The coefficients of f, in order l*l + l + m.
    pub fn coefficients(&self, degree: Degree) -> Vec<f64> {
        let u = self.zonal(degree);
        let expansion = Expansion::zonal(self.axis, degree, |l| [u[l]; 3]);
        expansion.coefficients().iter().map(|rgb| rgb[0]).collect()
    }

    /// The share of f's integral where its series to this degree is zero or negative.
    pub fn lost(&self, degree: Degree) -> f64 {
        const STEPS: usize = 20_000;
        let u = self.zonal(degree);
        let mut harmonics = vec![0.0; u.len()];
        let lost = (0..STEPS).map(|k| {
            let cosine = (k as f64 + 0.5) / STEPS as f64;
            zonal_into(cosine, &mut harmonics);
            let series: f64 = u.iter().zip(&harmonics).map(|(u, y)| u * y).sum();
            if series > 0.0 { 0.0 } else { self.at_cosine(cosine) }
        });
        lost.sum::<f64>() * TAU / STEPS as f64
    }

    /// f along the axis.
    pub fn largest(&self) -> f64 {
        self.at_cosine(1.0)
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test may panic")]

    use super::*;

    #[test]
    fn the_series_is_the_lobe_once_its_degree_holds_it() {
        let phong = Phong { exponent: 4, axis: Direction::from_angles(0.7, 2.0) };
        let degree = Degree::new(60).unwrap();
        let coefficients = phong.coefficients(degree);
        assert!((coefficients[0] * (2.0 * TAU).sqrt() - 1.0).abs() < 1e-12, "the integral is 1");
        let rgb = coefficients.iter().map(|value| [*value; 3]).collect();
        let series = Expansion::from_coefficients(degree, rgb).unwrap();
        for w in (0..50).map(|index| sphere::spiral(index, 50)) {
            let error = series.evaluate(w)[0] - phong.value(w.vector());
            assert!(error.abs() < 1e-4 * phong.largest(), "{error}");
        }
    }

    /// Measured by another program: 0, 2e-4 and 3e-4.
    #[test]
    fn short_series_lose_little_of_the_lobes_of_the_talk() {
        let lost =
            |exponent, degree| Phong { exponent, axis: Direction::Z }.lost(Degree::new(degree).unwrap());
        assert!(lost(10, 7) < 5e-5, "{}", lost(10, 7));
        assert!((1e-4..3e-4).contains(&lost(20, 12)), "{}", lost(20, 12));
        assert!((2e-4..4e-4).contains(&lost(3, 4)), "{}", lost(3, 4));
    }
}
