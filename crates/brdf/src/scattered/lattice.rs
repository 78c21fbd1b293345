//! A smooth function of a pair of directions through scattered values, zero away from them.
//!
//! The coordinates are those of [`crate::half_and_difference`], laid out flat so that none of them has a pole
//! or a seam: p = u (cos phi_h, sin phi_h), u growing as asinh(theta_h / alpha), fine where the highlight is;
//! q = v (cos psi, sin psi), v = theta_d / (pi / 2). Exchanging light and view negates q. The function is a
//! sum of products of quadratic B-splines on a lattice of p and q, and every value counts at q and at -q, so
//! that it is reciprocal.
//!
//! The coefficients minimise what `residual` minimises: the squared errors, plus the stiffness times the
//! squared second differences of neighbours, plus a fortieth of it times the squares themselves, which makes
//! the function fade where there are no values. Errors are weighted anew, so that outliers count less.
//! Conjugate gradients solve the equations, whose matrix is never formed.

use std::f64::consts::FRAC_PI_2;

use super::residual::weighted_anew;

/// The intervals of an axis, and its splines.
const INTERVALS: usize = 8;
const N: usize = INTERVALS + 2;
const UNKNOWNS: usize = N * N * N * N;
/// The steps from an unknown to the next along each axis.
const STRIDES: [usize; 4] = [N * N * N, N * N, N, 1];

/// The most steps of conjugate gradients, and the residual at which they end.
const STEPS: usize = 200;
const ACCURACY: f64 = 1e-4;

/// A value to approximate.
#[derive(Clone, Copy, Debug)]
pub(super) struct LatticeSite {
    /// The angles theta_h, phi_h, theta_d, psi.
    pub(super) angles: [f64; 4],
    pub(super) value: [f64; 3],
}

pub(super) struct Lattice {
    alpha: f64,
    coefficients: Vec<[f64; 3]>,
    limits: [[f64; 2]; 3],
}

/// The splines that reach a place: the first of each axis and three weights.
struct LatticePatch([(usize, [f64; 3]); 4]);

impl LatticePatch {
    fn new([theta_h, phi_h, theta_d, psi]: [f64; 4], alpha: f64) -> Self {
        let u = math::asinh(theta_h / alpha) / math::asinh(FRAC_PI_2 / alpha);
        let v = theta_d / FRAC_PI_2;
        let place = [u * math::cos(phi_h), u * math::sin(phi_h), v * math::cos(psi), v * math::sin(psi)];
        Self(place.map(|x| {
            let at = (0.5 * (x + 1.0)).clamp(0.0, 1.0) * INTERVALS as f64;
            let cell = (at as usize).min(INTERVALS - 1);
            let t = at - cell as f64;
            (cell, [0.5 * (1.0 - t) * (1.0 - t), 0.5 + t * (1.0 - t), 0.5 * t * t])
        }))
    }

    /// Calls `f` with each unknown and its weight.
    fn each(&self, mut f: impl FnMut(usize, f64)) {
        let [a, b, c, d] = &self.0;
        for i in 0..3 {
            for j in 0..3 {
                let (row, weight) = ((a.0 + i) * N + b.0 + j, a.1[i] * b.1[j]);
                for k in 0..3 {
                    let (row, weight) = ((row * N + c.0 + k) * N + d.0, weight * c.1[k]);
                    (0..3).for_each(|m| f(row + m, weight * d.1[m]));
                }
            }
        }
    }

    fn sum(&self, coefficients: &[[f64; 3]]) -> [f64; 3] {
        let mut sum = [0.0; 3];
        self.each(|index, weight| {
            (0..3).for_each(|channel| sum[channel] += weight * coefficients[index][channel]);
        });
        sum
    }
}

impl Lattice {
    pub(super) fn fit(sites: &[LatticeSite], alpha: f64, stiffness: f64) -> Self {
        let limits = [0, 1, 2].map(|channel| {
            let values = sites.iter().map(|site| site.value[channel]);
            [values.clone().fold(0.0, f64::min), values.fold(0.0, f64::max)]
        });
        let patches: Vec<[LatticePatch; 2]> = sites
            .iter()
            .map(|&LatticeSite { angles: [theta_h, phi_h, theta_d, psi], .. }| {
                [0.0, std::f64::consts::PI]
                    .map(|turn| LatticePatch::new([theta_h, phi_h, theta_d, psi + turn], alpha))
            })
            .collect();
        let mut coefficients = vec![[0.0; 3]; UNKNOWNS];
        let mut trust = vec![1.0; sites.len()];
        for round in 0..3 {
            solve(sites, &patches, &trust, stiffness, &mut coefficients);
            if round == 2 {
                break;
            }
            let misses: Vec<f64> = sites
                .iter()
                .zip(&patches)
                .map(|(site, patches)| {
                    let found = patches[0].sum(&coefficients);
                    (0..3).map(|channel| (found[channel] - site.value[channel]).abs()).fold(0.0, f64::max)
                })
                .collect();
            trust = weighted_anew(&misses);
        }
        Self { alpha, coefficients, limits }
    }

    pub(super) fn value(&self, angles: [f64; 4]) -> [f64; 3] {
        let sum = LatticePatch::new(angles, self.alpha).sum(&self.coefficients);
        [0, 1, 2].map(|channel| sum[channel].clamp(self.limits[channel][0], self.limits[channel][1]))
    }
}

/// The product of the matrix of the normal equations and a vector.
fn product(patches: &[[LatticePatch; 2]], trust: &[f64], stiffness: f64, x: &[[f64; 3]], y: &mut [[f64; 3]]) {
    let ridge = stiffness / 40.0 + 1e-6;
    y.iter_mut().zip(x).for_each(|(y, x)| *y = x.map(|x| ridge * x));
    for (patch, trust) in
        patches.iter().zip(trust).flat_map(|(pair, trust)| pair.iter().map(move |p| (p, trust)))
    {
        let sum = patch.sum(x).map(|sum| trust * sum);
        patch.each(|index, weight| {
            (0..3).for_each(|channel| y[index][channel] += weight * sum[channel]);
        });
    }
    for stride in STRIDES {
        for index in (0..UNKNOWNS).filter(|index| (1..N - 1).contains(&(index / stride % N))) {
            for channel in 0..3 {
                let at = |index: usize| x[index][channel];
                let bend = stiffness * (at(index - stride) - 2.0 * at(index) + at(index + stride));
                y[index - stride][channel] += bend;
                y[index][channel] -= 2.0 * bend;
                y[index + stride][channel] += bend;
            }
        }
    }
}

/// Conjugate gradients, from the given coefficients on.
fn solve(
    sites: &[LatticeSite],
    patches: &[[LatticePatch; 2]],
    trust: &[f64],
    stiffness: f64,
    coefficients: &mut [[f64; 3]],
) {
    let dot = |a: &[[f64; 3]], b: &[[f64; 3]]| {
        let mut sum = [0.0; 3];
        for (a, b) in a.iter().zip(b) {
            (0..3).for_each(|channel| sum[channel] += a[channel] * b[channel]);
        }
        sum
    };
    let mut right = vec![[0.0; 3]; UNKNOWNS];
    for ((site, patches), trust) in sites.iter().zip(patches).zip(trust) {
        for patch in patches {
            patch.each(|index, weight| {
                (0..3).for_each(|channel| right[index][channel] += trust * weight * site.value[channel]);
            });
        }
    }
    let goal = dot(&right, &right).map(|square| (square * ACCURACY * ACCURACY).max(1e-300));
    let mut image = vec![[0.0; 3]; UNKNOWNS];
    product(patches, trust, stiffness, coefficients, &mut image);
    let mut left = right;
    for (left, image) in left.iter_mut().zip(&image) {
        (0..3).for_each(|channel| left[channel] -= image[channel]);
    }
    let mut direction = left.clone();
    let mut square = dot(&left, &left);
    for _ in 0..STEPS {
        if (0..3).all(|channel| square[channel] <= goal[channel]) {
            break;
        }
        product(patches, trust, stiffness, &direction, &mut image);
        let curvature = dot(&direction, &image);
        let step = [0, 1, 2].map(|channel| match curvature[channel] > 0.0 {
            true => square[channel] / curvature[channel],
            false => 0.0,
        });
        for index in 0..UNKNOWNS {
            for channel in 0..3 {
                coefficients[index][channel] += step[channel] * direction[index][channel];
                left[index][channel] -= step[channel] * image[index][channel];
            }
        }
        let next = dot(&left, &left);
        let keep = [0, 1, 2].map(|channel| match square[channel] > 0.0 {
            true => next[channel] / square[channel],
            false => 0.0,
        });
        for (direction, left) in direction.iter_mut().zip(&left) {
            (0..3)
                .for_each(|channel| direction[channel] = left[channel] + keep[channel] * direction[channel]);
        }
        square = next;
    }
}
