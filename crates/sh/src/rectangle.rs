//! Exact integrals of the harmonics over rectangles in (z, phi), where dOmega = dz dphi.
//!
//! The integral of Y_lm over a rectangle is that of P_lm over a zone (a z-interval) times that of cos(m phi)
//! or sin(m phi) (Jarosz et al. 2009; JCJ09). With s = sin(theta), P_mm = c_m s^m, e_l = sqrt((l^2 - m^2) /
//! (4 l^2 - 1)) and [g] = g(z1) - g(z0), integrating
//!
//! ```text
//! d(s^2 P_l)/dz = (l-1) e_l P_(l-1) - (l+2) e_(l+1) P_(l+1)
//! ```
//!
//! gives I_l = integral of P_l, upward from l = m (e_m = 0):
//!
//! ```text
//! (l+2) e_(l+1) I_(l+1) = (l-1) e_l I_(l-1) - [s^2 P_l]
//! I_mm = c_m J_m,   J_0 = [z],   2 J_1 = [z s + asin z],   (m+1) J_m = m J_(m-2) + [z s^m]
//! ```
//!
//! Both recurrences multiply earlier errors by factors below 1, so that errors stay some units of rounding of
//! the whole sphere. They are absolute: an integral over a small cell has the same error as one over a large
//! one.

use std::f64::consts::FRAC_PI_2;

use crate::{Basis, Degree};

/// A circle of constant theta, with what rounding z loses near a pole.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Parallel {
    z: f64,
    sine: f64,
    /// 1 - |z|.
    from_pole: f64,
}

impl Parallel {
    /// The parallel of this z, in [-1, 1].
    pub fn from_z(z: f64) -> Self {
        let z = z.clamp(-1.0, 1.0);
        Self::from_pole(z < 0.0, 1.0 - z.abs())
    }

    /// The parallel of 1 - |z|, in [0, 1], from the south or the north pole.
    pub fn from_pole(is_south: bool, distance: f64) -> Self {
        let z = if is_south { distance - 1.0 } else { 1.0 - distance };
        Self { z, sine: (distance * (2.0 - distance)).sqrt(), from_pole: distance }
    }

    /// The parallel of a colatitude, in [0, pi].
    pub fn from_theta(theta: f64) -> Self {
        let half = math::sin(if theta > FRAC_PI_2 { std::f64::consts::PI - theta } else { theta } / 2.0);
        let from_pole = 2.0 * half * half;
        let z = if theta > FRAC_PI_2 { from_pole - 1.0 } else { 1.0 - from_pole };
        Self { z, sine: 2.0 * half * (1.0 - half * half).sqrt(), from_pole }
    }

    /// cos(theta).
    pub fn z(self) -> f64 {
        self.z
    }

    /// sin(theta).
    pub fn sine(self) -> f64 {
        self.sine
    }

    /// asin(z), the latitude.
    fn latitude(self) -> f64 {
        math::atan2(self.z, self.sine)
    }

    /// How much higher this parallel's z is than that of `other`.
    pub(crate) fn above(self, other: Self) -> f64 {
        if self.z.signum() != other.z.signum() {
            self.z - other.z
        } else {
            (other.from_pole - self.from_pole) * self.z.signum()
        }
    }
}

/// Integrals of P_lm over z-intervals up to a degree, with the constants of their recurrence.
///
/// Absolute errors are below 6e-16 at degree 256 and some 1e-14 at [`Degree::MAX`]; the tests compare with
/// Gauss-Legendre quadrature and with reference values.
#[derive(Clone, Debug)]
pub struct ZoneIntegrals {
    basis: Basis,
    /// (l-1) e_l / ((l+2) e_(l+1)) and 1 / ((l+2) e_(l+1)) for l = m .. degree, column after column of m.
    climb: Vec<[f64; 2]>,
}

impl ZoneIntegrals {
    /// Prepares the integrals of all P_lm with l up to `degree`.
    pub fn new(degree: Degree) -> Self {
        let top = degree.get();
        let mut climb = Vec::with_capacity(top * (top + 1) / 2);
        for m in 0..=top {
            // l^2 - m^2 = (l - m) (l + m)
            let e = |l: usize| (((l - m) * (l + m)) as f64 / (4.0 * (l * l) as f64 - 1.0)).abs().sqrt();
            climb.extend((m..top).map(|l| {
                let divisor = (l + 2) as f64 * e(l + 1);
                [(l as f64 - 1.0) * e(l) / divisor, 1.0 / divisor]
            }));
        }
        Self { basis: Basis::new(degree), climb }
    }

    /// The highest l.
    pub fn degree(&self) -> Degree {
        self.basis.degree()
    }

    /// The integral of P_lm dz from one parallel up to another, for every m >= 0 and l = m ..= degree, column
    /// after column of m as in [`Basis::legendre_into`].
    ///
    /// # Panics
    /// If `integrals` does not have (degree + 1) (degree + 2) / 2 elements.
    pub fn evaluate_into(&self, south: Parallel, north: Parallel, integrals: &mut [f64]) {
        let top = self.degree().get();
        let mut edges = [south, north].map(|edge| {
            let mut values = vec![0.0; integrals.len()];
            self.basis.legendre_into(edge.z, edge.sine, &mut values);
            values.into_iter()
        });
        let mut legendre = || edges.each_mut().map(|values| values.next().unwrap_or_default());
        let squares = [south, north].map(|edge| edge.sine * edge.sine);
        // s^m at both edges; J_m and the two before it.
        let mut powers = [1.0, 1.0];
        let (mut before, mut last) = (0.0, 0.0);
        let (mut climb, mut integrals) = (self.climb.iter(), integrals.iter_mut());
        let mut push = |value| {
            if let Some(integral) = integrals.next() {
                *integral = value;
            }
        };
        for m in 0..=top {
            let bracket = north.z * powers[1] - south.z * powers[0];
            let j = match m {
                0 => north.above(south),
                1 => 0.5 * (bracket + north.latitude() - south.latitude()),
                _ => (m as f64 * before + bracket) / (m + 1) as f64,
            };
            (before, last) = (last, j);
            powers = [powers[0] * south.sine, powers[1] * north.sine];
            let (mut below, mut value) = (0.0, self.basis.sectoral(m) * j);
            push(value);
            for _ in m..top {
                let [low, high] = legendre();
                let [a, b] = climb.next().copied().unwrap_or_default();
                let next = a * below - b * (squares[1] * high - squares[0] * low);
                (below, value) = (value, next);
                push(value);
            }
            legendre();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::quadrature::gauss_legendre;
    use crate::testkit::{integrate_rectangle, legendre};
    use test_data::tensors;

    #[test]
    fn zones_agree_with_quadrature() {
        for (top, nodes) in [(0, 40), (1, 40), (19, 80), (256, 460)] {
            let zones = ZoneIntegrals::new(Degree::new(top).unwrap());
            let (angles, weights) = gauss_legendre(nodes);
            let mut integrals = vec![0.0; (top + 1) * (top + 2) / 2];
            for (theta0, theta1) in [(0.0, 0.02), (0.3, 0.9), (1.5, 1.6), (0.7, 2.9), (3.0, 3.12), (0.0, 3.1)]
            {
                let [north, south] = [theta0, theta1].map(Parallel::from_theta);
                zones.evaluate_into(south, north, &mut integrals);
                // In theta every integrand is smooth: P_lm sin(theta).
                let half = 0.5 * (theta1 - theta0);
                let theta: Vec<f64> = angles.iter().map(|x| theta0 + half * (1.0 - x.cos())).collect();
                let mut expected = Vec::new();
                for m in 0..=top {
                    let mut column = vec![0.0; top + 1 - m];
                    for (theta, weight) in theta.iter().zip(&weights) {
                        for (sum, p) in column.iter_mut().zip(legendre(m, top, *theta)) {
                            *sum += p * theta.sin() * weight * half;
                        }
                    }
                    expected.extend(column);
                }
                let errors = integrals.iter().zip(&expected).map(|(a, b)| (a - b).abs());
                let worst = errors.fold(0.0, f64::max);
                // The quadrature itself errs by some 1e-15 l.
                assert!(worst < 2e-14, "degree {top}, {theta0} to {theta1}: {worst}");
            }
        }
    }

    #[test]
    fn the_whole_sphere_leaves_the_constant_at_the_highest_degree() {
        let zones = ZoneIntegrals::new(Degree::MAX);
        let top = Degree::MAX.get();
        let mut integrals = vec![0.0; (top + 1) * (top + 2) / 2];
        zones.evaluate_into(Parallel::from_z(-1.0), Parallel::from_z(1.0), &mut integrals);
        assert!((integrals[0] * std::f64::consts::PI.sqrt() - 1.0).abs() < 1e-15);
        assert!(integrals[1..=top].iter().all(|integral| integral.abs() < 1e-15));
        // Zones add up: errors of the parts are absolute.
        let mut sum = vec![0.0; integrals.len()];
        let mut part = sum.clone();
        let edges: Vec<_> =
            (0..=8).map(|j| Parallel::from_theta(f64::from(j) * 0.125 * std::f64::consts::PI)).collect();
        for pair in edges.windows(2) {
            zones.evaluate_into(pair[1], pair[0], &mut part);
            sum.iter_mut().zip(&part).for_each(|(sum, part)| *sum += part);
        }
        let worst = sum.iter().zip(&integrals).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(worst < 1e-14, "{worst}");
    }

    #[test]
    fn rectangles_agree_with_the_reference() {
        let Some(file) = tensors("rectangles_agree_with_the_reference", "sampling/rectangles.safetensors")
        else {
            return;
        };
        let zones = ZoneIntegrals::new(Degree::new(19).unwrap());
        let mut rows = [0.0; 400];
        let (rectangles, expected) = (&file["rectangles"], &file["integrals"]);
        assert_eq!(rectangles.len(), 4 * 40);
        for (edges, expected) in rectangles.chunks_exact(4).zip(expected.chunks_exact(400)) {
            let parallels = [edges[0], edges[1]].map(Parallel::from_z);
            integrate_rectangle(&zones, parallels, [edges[2], edges[3]], &mut rows);
            for (row, (a, b)) in rows.iter().zip(expected).enumerate() {
                assert!((a - b).abs() < 1e-13, "{edges:?}, row {row}: {a} {b}");
            }
        }
    }
}
