//! A smooth function over half and difference angles through scattered values, zero away from them.
//!
//! y(theta_h, theta_d, phi_d) = sum over k = 0 .. 2 of w^k y_k(u, v) cos(2 k phi_d), with y_k cubic splines
//! on uniform knots in u = asinh(theta_h / alpha), fine where the highlight is, and in v = theta_d, mirrored
//! at all four borders (zero slope there, so that no trend is extrapolated). w = q / (q + 0.05), q = (sin
//! theta_h sin theta_d)^2, removes the dependence on the azimuth where phi_d loses its meaning.
//!
//! The coefficients minimise the squared errors plus a penalty (Eilers and Marx, "Flexible smoothing with
//! B-splines and penalties", 1996): stiffness times the squared second differences of neighbours, and a
//! fortieth of it times the squares themselves. The latter makes y fade, over two or three knots, where there
//! are no values. Errors are weighted anew three times by 1 / (1 + (error / 3 s)^2)^2, with s their typical
//! size, because readings at grazing angles can be outliers (zeros beside a highlight). The matrix is banded;
//! Cholesky's factors of the band are exact and fast.

use std::f64::consts::FRAC_PI_2;

/// The factors of the penalty that are tried; samples that the trial left out decide.
pub(super) const STIFFNESSES: [f64; 4] = [0.01, 0.1, 1.0, 10.0];

/// The intervals between knots in u and v, and the terms in phi_d.
const U: usize = 18;
const V: usize = 12;
const K: usize = 3;

const UNKNOWNS: usize = (U + 1) * (V + 1) * K;

/// The greatest distance between two unknowns of one spline patch.
const BAND: usize = (3 * (V + 1) + 3) * K + K;

/// A value to approximate.
#[derive(Clone, Copy, Debug)]
pub(super) struct Site {
    /// The angles theta_h, theta_d, phi_d.
    pub(super) angles: [f64; 3],
    pub(super) value: [f64; 3],
}

pub(super) struct Residual {
    alpha: f64,
    coefficients: Vec<[f64; 3]>,
    limits: [[f64; 2]; 3],
}

/// The series in phi_d at one theta_h and theta_d.
pub(super) struct Series {
    terms: [[f64; 3]; K],
    limits: [[f64; 2]; 3],
}

impl Series {
    pub(super) fn at(&self, phi_d: f64) -> [f64; 3] {
        [0, 1, 2].map(|channel| {
            let terms = self.terms.iter().enumerate();
            let sum: f64 = terms.map(|(k, term)| term[channel] * math::cos(2.0 * k as f64 * phi_d)).sum();
            sum.clamp(self.limits[channel][0], self.limits[channel][1])
        })
    }
}

impl Residual {
    pub(super) fn fit(sites: &[Site], alpha: f64, stiffness: f64) -> Self {
        let limits = [0, 1, 2].map(|channel| {
            let values = sites.iter().map(|site| site.value[channel]);
            [values.clone().fold(0.0, f64::min), values.fold(0.0, f64::max)]
        });
        let patches: Vec<Patch> = sites.iter().map(|site| patch(site.angles, alpha)).collect();
        let mut fit = Self { alpha, coefficients: vec![[0.0; 3]; UNKNOWNS], limits };
        let mut trust = vec![1.0; sites.len()];
        for round in 0..4 {
            fit.coefficients = solve(sites, &patches, &trust, stiffness);
            if round == 3 {
                break;
            }
            let miss = |(site, patch): (&Site, &Patch)| {
                let found = fit.sum(patch, site.angles[2]);
                (0..3).map(|channel| (found[channel] - site.value[channel]).abs()).fold(0.0, f64::max)
            };
            let misses: Vec<f64> = sites.iter().zip(&patches).map(miss).collect();
            trust = weighted_anew(&misses);
        }
        fit
    }

    pub(super) fn value(&self, angles: [f64; 3]) -> [f64; 3] {
        self.series(angles).at(angles[2])
    }

    /// The series at theta_h and theta_d; the third angle is ignored.
    pub(super) fn series(&self, angles: [f64; 3]) -> Series {
        let patch = patch(angles, self.alpha);
        let mut terms = [[0.0; 3]; K];
        for (index, weight) in patch.places() {
            for (k, term) in terms.iter_mut().enumerate() {
                let coefficient = self.coefficients[index * K + k];
                for channel in 0..3 {
                    term[channel] += weight * math::powi(patch.fade, k as i32) * coefficient[channel];
                }
            }
        }
        Series { terms, limits: self.limits }
    }

    fn sum(&self, patch: &Patch, phi_d: f64) -> [f64; 3] {
        let mut sum = [0.0; 3];
        for (index, weight) in patch.unknowns(phi_d) {
            for channel in 0..3 {
                sum[channel] += weight * self.coefficients[index][channel];
            }
        }
        sum
    }
}

/// The weights of sites for the next round, by how far the last one missed them.
pub(super) fn weighted_anew(misses: &[f64]) -> Vec<f64> {
    let mut sorted = misses.to_vec();
    sorted.sort_by(f64::total_cmp);
    // 1.48 times the median is the standard deviation of Gaussian errors.
    let typical = (1.48 * sorted[sorted.len() / 2]).max(1e-6);
    misses.iter().map(|miss| math::powi(1.0 + math::powi(miss / (3.0 * typical), 2), -2)).collect()
}

/// The cost of a trial that found these values in place of others, and its median error as a share of the
/// value.
pub(super) fn miss(pairs: impl Iterator<Item = ([f64; 3], [f64; 3])>) -> (f64, f64) {
    let mut misses: Vec<f64> = pairs
        .flat_map(|(found, value)| [0, 1, 2].map(|channel| (found[channel] - value[channel]).abs()))
        .collect();
    misses.sort_by(f64::total_cmp);
    // An error counts 1 at most, so that a few outliers do not decide.
    let cost = misses.iter().map(|miss| miss.min(1.0)).sum::<f64>() / misses.len() as f64;
    (cost, math::exp_m1(misses[misses.len() / 2]))
}

/// The sixteen splines that reach a point.
struct Patch {
    u: [(usize, f64); 4],
    v: [(usize, f64); 4],
    fade: f64,
}

impl Patch {
    fn places(&self) -> impl Iterator<Item = (usize, f64)> {
        self.u.iter().flat_map(|&(i, a)| self.v.iter().map(move |&(j, b)| (i * (V + 1) + j, a * b)))
    }

    fn unknowns(&self, phi_d: f64) -> impl Iterator<Item = (usize, f64)> {
        let waves: [f64; K] =
            std::array::from_fn(|k| math::powi(self.fade, k as i32) * math::cos(2.0 * k as f64 * phi_d));
        self.places().flat_map(move |(index, weight)| (0..K).map(move |k| (index * K + k, weight * waves[k])))
    }
}

fn patch([theta_h, theta_d, _]: [f64; 3], alpha: f64) -> Patch {
    let u = math::asinh(theta_h / alpha) / math::asinh(FRAC_PI_2 / alpha);
    let q = math::powi(math::sin(theta_h) * math::sin(theta_d), 2);
    Patch { u: splines(u, U), v: splines(theta_d / FRAC_PI_2, V), fade: q / (q + 0.05) }
}

/// The four cubic B-splines at `share` of an axis of n intervals, those past a border are folded back over
/// it.
fn splines(share: f64, n: usize) -> [(usize, f64); 4] {
    let x = share.clamp(0.0, 1.0) * n as f64;
    let cell = (x as usize).min(n - 1);
    let t = x - cell as f64;
    let s = 1.0 - t;
    let weights = [
        s * s * s / 6.0,
        (4.0 - 6.0 * t * t + 3.0 * t * t * t) / 6.0,
        (4.0 - 6.0 * s * s + 3.0 * s * s * s) / 6.0,
        t * t * t / 6.0,
    ];
    std::array::from_fn(|i| (fold(cell as isize + i as isize - 1, n), weights[i]))
}

fn fold(index: isize, n: usize) -> usize {
    let index = index.unsigned_abs();
    if index > n { 2 * n - index } else { index }
}

/// A symmetric matrix whose entries more than `BAND` from the diagonal are zero; row i holds the entries (i,
/// i - BAND ..= i).
struct Banded(Vec<[f64; BAND + 1]>);

impl Banded {
    fn add(&mut self, i: usize, j: usize, value: f64) {
        let (row, column) = (i.max(j), i.min(j));
        self.0[row][column + BAND - row] += value;
    }

    /// L of L L^T in place, then both substitutions. The matrix is positive definite by its ridge.
    fn solve(mut self, right: &mut [[f64; 3]]) {
        let n = self.0.len();
        for i in 0..n {
            let first = i.saturating_sub(BAND);
            let (before, rest) = self.0.split_at_mut(i);
            let row = &mut rest[0];
            for j in first..i {
                // Entry (i, k) is row[k + BAND - i], entry (j, k) is other[k + BAND - j], for k from first to
                // j.
                let other = &before[j];
                let (a, b) = (&row[first + BAND - i..j + BAND - i], &other[first + BAND - j..BAND]);
                let sum: f64 = a.iter().zip(b).map(|(a, b)| a * b).sum();
                row[j + BAND - i] = (row[j + BAND - i] - sum) / other[BAND];
            }
            let squares: f64 = row[first + BAND - i..BAND].iter().map(|value| value * value).sum();
            row[BAND] = (row[BAND] - squares).max(1e-12).sqrt();
            for channel in 0..3 {
                let sum: f64 = (first..i).map(|k| row[k + BAND - i] * right[k][channel]).sum();
                right[i][channel] = (right[i][channel] - sum) / row[BAND];
            }
        }
        for i in (0..n).rev() {
            for channel in 0..3 {
                right[i][channel] /= self.0[i][BAND];
                let known = right[i][channel];
                for k in i.saturating_sub(BAND)..i {
                    right[k][channel] -= self.0[i][k + BAND - i] * known;
                }
            }
        }
    }
}

fn solve(sites: &[Site], patches: &[Patch], trust: &[f64], stiffness: f64) -> Vec<[f64; 3]> {
    let mut matrix = Banded(vec![[0.0; BAND + 1]; UNKNOWNS]);
    let mut right = vec![[0.0; 3]; UNKNOWNS];
    for ((site, patch), &trust) in sites.iter().zip(patches).zip(trust) {
        let unknowns: Vec<(usize, f64)> = patch.unknowns(site.angles[2]).collect();
        for (a, &(i, weight)) in unknowns.iter().enumerate() {
            for channel in 0..3 {
                right[i][channel] += trust * weight * site.value[channel];
            }
            for &(j, other) in &unknowns[..a] {
                // Folding may list one unknown twice: its square then holds the product twice.
                matrix.add(i, j, trust * weight * other * if i == j { 2.0 } else { 1.0 });
            }
            matrix.add(i, i, trust * weight * weight);
        }
    }
    for i in 0..=U {
        for j in 0..=V {
            for k in 0..K {
                let at = |i: isize, j: isize| (fold(i, U) * (V + 1) + fold(j, V)) * K + k;
                let (u, v) = (i as isize, j as isize);
                for difference in
                    [[at(u - 1, v), at(u, v), at(u + 1, v)], [at(u, v - 1), at(u, v), at(u, v + 1)]]
                {
                    let factors = [1.0, -2.0, 1.0];
                    for a in 0..3 {
                        for b in 0..3 {
                            let value = stiffness * factors[a] * factors[b];
                            // Both orders of a pair occur; the matrix holds one.
                            if difference[a] >= difference[b] {
                                matrix.add(difference[a], difference[b], value);
                            }
                        }
                    }
                }
                // The penalty on waves in phi_d grows with their frequency.
                matrix.add(at(u, v), at(u, v), stiffness * (1 + 4 * k * k) as f64 / 40.0 + 1e-6);
            }
        }
    }
    matrix.solve(&mut right);
    right
}
