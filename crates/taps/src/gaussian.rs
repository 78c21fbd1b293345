//! The kernel of a scale space: a Gaussian of the angle, cut at the horizon of its own direction.
//!
//! > g_s(angle) = c_s exp(-angle^2 / (2 s^2)) up to 90 degrees, beyond 0; its integral over the sphere is 1.

use std::f64::consts::{FRAC_PI_2, TAU};

use sh::quadrature::gauss_legendre;

/// Nodes of a panel.
const NODES: usize = 16;

/// The phase of P_l over a panel, in radians, that so many nodes integrate to rounding.
const PHASE: f64 = 6.0;

/// The standard deviations past which a Gaussian is left out: e^-40.
const REACH: f64 = 9.0;

/// The factors g_l, l = 0 ..= `degree`, by which a convolution with the kernel scales the degrees of a series:
/// g_l = 2 pi times the integral of g_s(angle) P_l(cos angle) sin(angle); g_0 = 1.
pub(crate) fn factors(std: f64, degree: usize) -> Vec<f64> {
    let (theta, weights) = gauss_legendre(NODES);
    let end = FRAC_PI_2.min(REACH * std);
    let panels = ((degree as f64 * end / PHASE).ceil() + (end / std).ceil()) as usize;
    let step = end / panels as f64;
    let mut sums = vec![0.0; degree + 1];
    for panel in 0..panels {
        for (theta, weight) in theta.iter().zip(&weights) {
            let angle = step * (panel as f64 + 0.5 - 0.5 * math::cos(*theta));
            let (sine, x) = math::sin_cos(angle);
            let weight = weight * sine * math::exp(-0.5 * math::powi(angle / std, 2));
            let (mut before, mut p) = (0.0, weight);
            for (l, sum) in sums.iter_mut().enumerate() {
                *sum += p;
                let l = l as f64;
                (before, p) = (p, ((2.0 * l + 1.0) * x * p - l * before) / (l + 1.0));
            }
        }
    }
    let whole = sums[0];
    sums.iter_mut().for_each(|sum| *sum /= whole);
    sums
}

/// The kernel g_s of a width.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Gaussian {
    std: f64,
    /// c_s.
    scale: f64,
}

impl Gaussian {
    pub(crate) fn new(std: f64) -> Self {
        let (theta, weights) = gauss_legendre(NODES);
        let end = FRAC_PI_2.min(REACH * std);
        let panels = (end / std).ceil().max(1.0);
        let mut whole = 0.0;
        for panel in 0..panels as usize {
            for (theta, weight) in theta.iter().zip(&weights) {
                let angle = end * (panel as f64 + 0.5 - 0.5 * math::cos(*theta)) / panels;
                let weight = 0.5 * weight * end / panels * math::sin(angle);
                whole += TAU * weight * math::exp(-0.5 * math::powi(angle / std, 2));
            }
        }
        Self { std, scale: 1.0 / whole }
    }

    /// g_s at an angle, in radians.
    pub(crate) fn at(self, angle: f64) -> f64 {
        if angle >= FRAC_PI_2 {
            return 0.0;
        }
        self.scale * math::exp(-0.5 * math::powi(angle / self.std, 2))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The trapezoid rule with very many nodes.
    #[test]
    fn factors_are_the_integrals() {
        for std in [0.02, 0.15, 0.8, 2.0] {
            let (kernel, found) = (Gaussian::new(std), factors(std, 40));
            let steps = 200_000;
            for l in [0, 1, 7, 40] {
                let mut sum = 0.0;
                for step in 0..steps {
                    let angle = FRAC_PI_2 * (f64::from(step) + 0.5) / f64::from(steps);
                    let (mut before, mut p) = (0.0, 1.0);
                    for k in 0..l {
                        let k = f64::from(k);
                        (before, p) = (p, ((2.0 * k + 1.0) * angle.cos() * p - k * before) / (k + 1.0));
                    }
                    sum += TAU * FRAC_PI_2 / f64::from(steps) * angle.sin() * kernel.at(angle) * p;
                }
                assert!((found[l as usize] - sum).abs() < 1e-8, "{std} {l}: {} {sum}", found[l as usize]);
            }
        }
    }
}
