//! The zonal factors of a prefilter.
//!
//! Nodes are spread where the lobe is. For GGX, mu = (1 - u^2) / (1 + u^2) and u = a sinh(t) (u is the
//! tangent of half the angle) make
//!
//! > K dmu = mu tanh(t) / cosh(t)^2 dt up to a constant, t in (0, asinh(1 / a)),
//!
//! smooth and as wide as 1 for every a. For Charlie, 1 - mu = v^4 makes (1 - mu)^(1 / (2 a)) smooth at
//! mu = 1.

use std::f64::consts::FRAC_PI_2;

use sh::quadrature::gauss_legendre;

use super::{Distribution, PrefilterKernel};

/// Nodes of a panel.
const NODES: usize = 20;

/// The phase of P_l over a panel, in radians: 20 nodes integrate that many to rounding.
const PHASE: f64 = 16.0;

/// k_l for l = 0 ..= `degree`.
pub(super) fn factors(kernel: &PrefilterKernel, degree: usize) -> Vec<f64> {
    let (theta, weights) = gauss_legendre(NODES);
    let nodes: [f64; NODES] = std::array::from_fn(|node| math::cos(theta[node]));
    let recurrence: Vec<[f64; 2]> = (0..=degree)
        .map(|l| [(2.0 * l as f64 + 1.0) / (l as f64 + 1.0), l as f64 / (l as f64 + 1.0)])
        .collect();
    let mut sums = vec![0.0; degree + 1];
    for ends in panels(kernel, degree).windows(2) {
        let (mut down, mut weight) = ([0.0; NODES], [0.0; NODES]);
        let half = 0.5 * (ends[1] - ends[0]);
        for node in 0..NODES {
            let measure;
            (down[node], measure) = transformed(kernel, ends[0] + half * (1.0 + nodes[node]));
            weight[node] = half * weights[node] * measure;
        }
        accumulate(&down, &weight, &recurrence, &mut sums);
    }
    let total = sums[0];
    sums.iter_mut().for_each(|sum| *sum /= total);
    sums
}

/// The ends of the panels in t.
fn panels(kernel: &PrefilterKernel, degree: usize) -> Vec<f64> {
    let alpha = kernel.alpha();
    // The largest derivative of the angle is about pi / 2 for Charlie's v. GGX's is 1 far from the peak and
    // small near it, where most of t is.
    let (length, rate, features) = match kernel.distribution() {
        Distribution::Ggx => (math::asinh(1.0 / alpha), 0.0, 8.0),
        Distribution::Charlie => (1.0, 4.0, 8.0 + 4.0 / alpha),
        Distribution::Lambert => (1.0, FRAC_PI_2, 4.0),
    };
    let even = length / (degree as f64 * length * rate / PHASE + features).ceil();
    let mut ends = vec![0.0];
    let mut end = 0.0;
    while end < length {
        end += even;
        if kernel.distribution() == Distribution::Ggx {
            let angle = |t: f64| 2.0 * math::atan(alpha * math::sinh(t));
            let before = end - even;
            let next = angle(before) + PHASE / degree.max(1) as f64;
            if next < angle(end) {
                end = math::asinh(math::tan(0.5 * next) / alpha);
            }
        }
        // The last panel takes what rounding leaves.
        end = if end > length - 1e-9 { length } else { end };
        ends.push(end);
    }
    ends
}

/// 1 - mu and K dmu / dt at t, the latter up to a constant factor.
fn transformed(kernel: &PrefilterKernel, t: f64) -> (f64, f64) {
    let alpha = kernel.alpha();
    match kernel.distribution() {
        Distribution::Ggx => {
            let squared = math::powi(alpha * math::sinh(t), 2);
            let mu = (1.0 - squared) / (1.0 + squared);
            (2.0 * squared / (1.0 + squared), mu * math::tanh(t) / math::powi(math::cosh(t), 2))
        }
        Distribution::Charlie => {
            let down = math::powi(t, 4);
            (down, (1.0 - down) * math::pow(t, 2.0 / alpha) * math::powi(t, 3))
        }
        Distribution::Lambert => {
            let theta = FRAC_PI_2 * t;
            (2.0 * math::powi(math::sin(0.5 * theta), 2), math::cos(theta) * math::sin(theta))
        }
    }
}

/// Adds weight P_l(mu) of each node to the sums, l from 0.
///
/// By d_l = P_(l+1) - P_l = b_l d_(l-1) - a_l (1 - mu) P_l, with a_l = (2 l + 1) / (l + 1) and b_l = l / (l +
/// 1): near the peak, where P_l depends on the last bits of mu, 1 - mu is exact.
fn accumulate(down: &[f64; NODES], weight: &[f64; NODES], recurrence: &[[f64; 2]], sums: &mut [f64]) {
    const LANES: usize = 4;
    let (mut current, mut difference) = (*weight, [0.0; NODES]);
    for (sum, [grow, fall]) in sums.iter_mut().zip(recurrence) {
        let mut lanes = [0.0; LANES];
        for values in current.as_chunks::<LANES>().0 {
            (0..LANES).for_each(|lane| lanes[lane] += values[lane]);
        }
        *sum += (lanes[0] + lanes[1]) + (lanes[2] + lanes[3]);
        for node in 0..NODES {
            difference[node] = fall * difference[node] - grow * down[node] * current[node];
            current[node] += difference[node];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn kernel(distribution: Distribution, roughness: f64) -> PrefilterKernel {
        PrefilterKernel::new(distribution, roughness).unwrap()
    }

    /// The cosine's integrals are known: I_l = I_(l-2) (3 - l) / (l + 2) (Gradshteyn and Ryzhik 7.126.1).
    #[test]
    fn lambert_and_the_roughest_ggx_have_the_closed_form_of_the_cosine() {
        let mut expected = vec![1.0, 2.0 / 3.0];
        for l in 2..=200 {
            let before: f64 = expected[l - 2];
            expected.push(before * (3.0 - l as f64) / (l as f64 + 2.0));
        }
        for distribution in [Distribution::Lambert, Distribution::Ggx] {
            let found = kernel(distribution, 1.0).factors(200);
            let worst = found.iter().zip(&expected).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            assert!(worst < 1e-14, "{distribution:?}: {worst:e}");
        }
    }

    /// Compares factors with those from ten times as many panels. The recurrence of P_l rounds by about 1e-16
    /// l.
    #[test]
    fn sharp_lobes_are_resolved() {
        for (distribution, roughness, degree) in [
            (Distribution::Ggx, 0.05, 2000),
            (Distribution::Ggx, 0.5, 100),
            (Distribution::Charlie, 0.1, 600),
            (Distribution::Charlie, 0.77, 200),
        ] {
            let kernel = kernel(distribution, roughness);
            let coarse = kernel.factors(degree);
            let fine = kernel.factors(10 * degree);
            let worst = coarse.iter().zip(&fine).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            assert!(worst < 1e-12, "{distribution:?} {roughness}: {worst:e}");
        }
    }

    /// The degrees that the table of the kind `prefilter` names.
    #[test]
    fn what_is_past_4_over_alpha_is_below_a_thousandth() {
        for (distribution, roughness, expected) in [
            (Distribution::Ggx, 0.15, 182),
            (Distribution::Ggx, 0.25, 65),
            (Distribution::Ggx, 0.5, 16),
            (Distribution::Charlie, 0.5, 38),
        ] {
            let factors = kernel(distribution, roughness).factors(600);
            let past = factors.iter().rposition(|k| k.abs() >= 1e-3).unwrap();
            assert!(past.abs_diff(expected) <= 1, "{distribution:?} {roughness}: {past}");
        }
    }
}
