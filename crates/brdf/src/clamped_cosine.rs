//! The lobe u(x) = peak * max(0, x)^s, x the cosine of the angle to the centre, and its zonal coefficients.
//!
//! Lambert is s = 1 about the normal, Phong any s about the reflection vector. The kink at the horizon makes
//! the coefficients fall off slowly, and makes quadrature across it inaccurate, but the coefficients have a
//! closed form. With
//!
//! I_l = integral over [0, 1] of x^s P_l(x) dx: I_0 = 1 / (s+1), I_1 = 1 / (s+2),
//! I_l = I_l-2 (s - l + 2) / (s + l + 1)
//!
//! (Gradshteyn and Ryzhik 7.126.1, as a ratio). Products of a few factors each carry one rounding error, so
//! every I_l is accurate to l units of rounding, and for a whole s those with l > s and l - s even are
//! exactly 0.

use std::f64::consts::PI;

/// peak * max(0, cos)^exponent, RGB, in 1/sr.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClampedCosine {
    /// The value at the centre.
    pub peak: [f64; 3],
    /// The exponent s, 0 or more.
    pub exponent: f64,
}

impl ClampedCosine {
    /// rho_l00 for l = 0 ..= `degree`, RGB, of rho_hat(w_i, w_o) = u = sum of rho_l00 Y_l0(w_i) Y_00:
    ///
    /// rho_l00 = sqrt(4 pi) * 2 pi * integral of u(x) Y_l0(x) dx = 2 pi peak sqrt(2l+1) I_l.
    pub fn coefficients(&self, degree: usize) -> Vec<[f64; 3]> {
        let s = self.exponent;
        let mut integrals = [1.0 / (s + 1.0), 1.0 / (s + 2.0)];
        (0..=degree)
            .map(|l| {
                let integral = &mut integrals[l % 2];
                if l > 1 {
                    *integral *= (s - (l as f64 - 2.0)) / (s + l as f64 + 1.0);
                }
                let scale = 2.0 * PI * ((2 * l + 1) as f64).sqrt() * *integral;
                self.peak.map(|peak| peak * scale)
            })
            .collect()
    }

    /// The integral of rho_hat^2 over both directions, summed over channels: 8 pi^2 peak^2 / (2 s + 1).
    pub fn energy(&self) -> f64 {
        let peaks: f64 = self.peak.iter().map(|peak| peak * peak).sum();
        8.0 * PI * PI * peaks / (2.0 * self.exponent + 1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The oracle: Gauss-Legendre over the upper hemisphere alone, where x^s P_l(x) is a polynomial for whole
    /// s, and after x = y^8 smooth enough for the others (x^s has its singularity at 0, y^(8 s + 7) a far
    /// weaker one).
    fn by_quadrature(lobe: &ClampedCosine, degree: usize) -> Vec<f64> {
        let (nodes, weights) = sh::quadrature::gauss_legendre(1200);
        let mut sums = vec![0.0; degree + 1];
        let mut y_l0 = sums.clone();
        for (theta, weight) in nodes.iter().zip(weights) {
            let y = (theta.cos() + 1.0) / 2.0;
            let (x, slope) = (y.powi(8), 8.0 * y.powi(7));
            sh::zonal_into(x, &mut y_l0);
            for l in 0..=degree {
                sums[l] += weight / 2.0 * slope * lobe.peak[0] * x.powf(lobe.exponent) * y_l0[l];
            }
        }
        sums.iter().map(|sum| (4.0 * PI).sqrt() * 2.0 * PI * sum).collect()
    }

    #[test]
    fn closed_form_coefficients_are_those_of_quadrature() {
        for exponent in [0.0, 0.3, 1.0, 1.5, 2.0, 7.7, 32.0, 512.0, 1e4] {
            let lobe = ClampedCosine { peak: [1.0, 2.0, 0.0], exponent };
            let found = lobe.coefficients(60);
            // Both sides sum terms as large as rho_000 times sqrt(2l+1), with rounding errors of 1e-16 each;
            // the oracle's x has a few, which the power s multiplies.
            let allowed = 1e-13 + 1e-15 * exponent;
            let size = found[0][0] * 11.0;
            for (l, (found, expected)) in found.iter().zip(by_quadrature(&lobe, 60)).enumerate() {
                let error = (found[0] - expected) / size;
                assert!(error.abs() < allowed, "s {exponent}, l {l}: {} {expected} {error:e}", found[0]);
                assert_eq!(found[1], 2.0 * found[0]);
            }
        }
    }

    #[test]
    fn energy_is_the_sum_of_all_squares() {
        for exponent in [1.0, 2.5, 32.0, 300.0] {
            let lobe = ClampedCosine { peak: [1.0, 0.5, 0.25], exponent };
            let sum: f64 = lobe.coefficients(2048).iter().flatten().map(|rho| rho * rho).sum();
            // What lies past degree 2048 falls off as l^-(2 s + 2), at s = 1 as the sum of l^-4.
            assert!((sum / lobe.energy() - 1.0).abs() < 1e-9, "{exponent}: {sum} {}", lobe.energy());
        }
    }

    #[test]
    fn the_highest_exponents_and_degrees_stay_finite() {
        for exponent in [0.0, 1e-9, 0.5, 1e9] {
            let lobe = ClampedCosine { peak: [1e6; 3], exponent };
            assert!(lobe.coefficients(2048).iter().flatten().all(|rho| rho.is_finite()));
            assert!(lobe.energy().is_finite());
        }
    }
}
