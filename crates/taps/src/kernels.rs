//! The kernels that light is blurred with. Each is zonal and has an integral of 1, so that a convolution with
//! it scales the terms of degree l of a series by a factor k_l = 2 pi times the integral of k(angle) P_l(cos
//! angle) sin(angle), and k_0 is 1 [RH02, eq. 5].
//!
//! - About any direction: g_s(angle) = c exp(-angle^2 / (2 s^2)) up to 90 degrees, beyond 0.
//! - About the normal: h_y(m) = c m / (m (1 - y) + y) of the cosine m > 0, beyond 0. At y = 1 it is the
//!   cosine, at y = 0 the hemisphere, and toward a view at the cosine v a surface of GGX with alpha = 1
//!   reflects by m / (m + v), which is y = v / (1 + v).

use std::f64::consts::{FRAC_PI_2, PI};

use sh::quadrature::gauss_legendre;

/// The number of kernels about the normal; the i-th has y = i / 3.
pub const NORMAL_KERNELS: usize = 4;

/// Nodes of a panel.
const NODES: usize = 16;

/// The phase of P_l over a panel, in radians, that so many nodes integrate to rounding.
const PHASE: f64 = 6.0;

/// The standard deviations past which a Gaussian is left out: e^-40.
const REACH: f64 = 9.0;

/// The factors k_l, l = 0 ..= `degree`, of g_s with s = `std`, in radians.
pub(crate) fn gaussian_factors(std: f64, degree: usize) -> Vec<f64> {
    let end = FRAC_PI_2.min(REACH * std);
    let panels = (degree as f64 * end / PHASE).ceil() + (end / std).ceil();
    zonal_factors(degree, panels as usize, |part| {
        let angle = end * part;
        (angle, math::exp(-0.5 * math::powi(angle / std, 2)))
    })
}

/// The kernel g_s at an angle.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Gaussian {
    std: f64,
    peak: f64,
    /// The angle past which it is left out.
    reach: f64,
}

impl Gaussian {
    pub(crate) fn new(std: f64) -> Self {
        let end = FRAC_PI_2.min(REACH * std);
        let panels = (end / std).ceil() as usize;
        let (theta, weights) = gauss_legendre(NODES);
        let mut integral = 0.0;
        for panel in 0..panels {
            for node in 0..NODES {
                let part = (panel as f64 + 0.5 - 0.5 * math::cos(theta[node])) / panels as f64;
                let angle = end * part;
                let value = math::exp(-0.5 * math::powi(angle / std, 2));
                integral += PI * end / panels as f64 * weights[node] * value * math::sin(angle);
            }
        }
        Self { std, peak: 1.0 / integral, reach: end }
    }

    pub(crate) fn at(self, cosine: f64) -> f64 {
        let angle = math::acos(cosine.clamp(-1.0, 1.0));
        if angle < self.reach { self.peak * math::exp(-0.5 * math::powi(angle / self.std, 2)) } else { 0.0 }
    }

    pub(crate) fn std(self) -> f64 {
        self.std
    }

    pub(crate) fn reach(self) -> f64 {
        self.reach
    }
}

/// The kernel h_y at the cosine m of an angle.
pub(crate) fn about_normal(y: f64, m: f64) -> f64 {
    let rest = 1.0 - y;
    // The integral of m / (m (1 - y) + y) from 0 to 1.
    let whole = if y <= 0.0 {
        1.0
    } else if rest <= 0.0 {
        0.5
    } else {
        1.0 / rest + y * math::ln(y) / (rest * rest)
    };
    if m > 0.0 { m / ((m * rest + y) * 2.0 * PI * whole) } else { 0.0 }
}

/// The factors k_l, l = 0 ..= `degree`, of h_y.
pub(crate) fn normal_factors(y: f64, degree: usize) -> Vec<f64> {
    let panels = (degree as f64 * FRAC_PI_2 / PHASE).ceil() + 8.0;
    zonal_factors(degree, panels as usize, |part| {
        // Dense toward the horizon, where a small y makes a step.
        let above = FRAC_PI_2 * part * part;
        let cosine = math::sin(above);
        (FRAC_PI_2 - above, part * cosine / (cosine * (1.0 - y) + y))
    })
}

/// The factors of a kernel that `at` gives at places from 0 to 1: the angle, and the kernel times the
/// derivative of the angle by the place, up to a constant.
fn zonal_factors(degree: usize, panels: usize, at: impl Fn(f64) -> (f64, f64)) -> Vec<f64> {
    let (theta, weights) = gauss_legendre(NODES);
    let mut sums = vec![0.0; degree + 1];
    for panel in 0..panels {
        let (mut x, mut before, mut p) = ([0.0; NODES], [0.0; NODES], [0.0; NODES]);
        for node in 0..NODES {
            let (angle, value) = at((panel as f64 + 0.5 - 0.5 * math::cos(theta[node])) / panels as f64);
            let sine;
            (sine, x[node]) = math::sin_cos(angle);
            p[node] = weights[node] * value * sine;
        }
        // (l + 1) P_(l+1) = (2 l + 1) x P_l - l P_(l-1).
        for (l, sum) in sums.iter_mut().enumerate() {
            *sum += p.iter().sum::<f64>();
            let l = l as f64;
            let (grow, fall) = ((2.0 * l + 1.0) / (l + 1.0), l / (l + 1.0));
            for node in 0..NODES {
                let next = grow * x[node] * p[node] - fall * before[node];
                before[node] = p[node];
                p[node] = next;
            }
        }
    }
    let whole = sums[0];
    sums.iter_mut().for_each(|sum| *sum /= whole);
    sums
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The ratio of the integrals of k P_l sin and k sin, by the midpoint rule with very many nodes.
    fn slow(kernel: impl Fn(f64) -> f64, l: usize) -> f64 {
        let steps = 400_000;
        let (mut sum, mut whole) = (0.0, 0.0);
        for step in 0..steps {
            let angle = FRAC_PI_2 * (f64::from(step) + 0.5) / f64::from(steps);
            let (mut before, mut p) = (0.0, 1.0);
            for k in 0..l {
                let k = k as f64;
                (before, p) = (p, ((2.0 * k + 1.0) * angle.cos() * p - k * before) / (k + 1.0));
            }
            sum += angle.sin() * kernel(angle) * p;
            whole += angle.sin() * kernel(angle);
        }
        sum / whole
    }

    #[test]
    fn factors_are_the_integrals() {
        for l in [0, 1, 7, 40] {
            for std in [0.02, 0.15, 0.8, 2.0] {
                let expected = slow(|angle| (-0.5 * (angle / std).powi(2)).exp(), l);
                let found = gaussian_factors(std, 40)[l];
                assert!((found - expected).abs() < 1e-8, "{std} {l}: {found} {expected}");
            }
            for y in [0.0, 1.0 / 3.0, 0.5, 1.0] {
                let expected = slow(|angle| angle.cos() / (angle.cos() * (1.0 - y) + y), l);
                let found = normal_factors(y, 40)[l];
                assert!((found - expected).abs() < 1e-8, "{y} {l}: {found} {expected}");
            }
        }
    }
}
