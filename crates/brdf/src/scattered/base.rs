//! The layered model that scattered samples are compared with.
//!
//! f_0 = a / pi + b * 28 / (23 pi) (1 - (1 - c_i / 2)^5) (1 - (1 - c_o / 2)^5) + (c (1 - s) + d s) D G / (4
//! c_i c_o)
//!
//! with c_i, c_o the cosines, s = (1 - cos theta_d)^5 (Schlick), a, b, c, d colours of 0 or more: a plain
//! matte part, a matte part under a coat that takes away the light it reflects (Ashikhmin and Shirley 2000),
//! and a coat's highlight with its rise toward grazing. D is Beckmann's or GGX's distribution of width alpha,
//! and G is Smith's masking for GGX in its separable form, for which G / (4 c_i c_o) stays finite down to the
//! horizon.
//!
//! For each D and alpha of a list the colours are the non-negative least squares of the relative error; the D
//! and alpha with the least sum of ln((f + e) / (f_0 + e))^2, each capped, win.

use std::f64::consts::PI;

use sphere::Direction;

use super::sample::Sample;

/// The most samples that the model is fitted to; if there are more, evenly spaced ones are chosen.
const MOST: usize = 1 << 12;

/// The number of steps in the search for alpha, from 0.02 to 1.
const STEPS: usize = 32;

const TERMS: usize = 4;

/// The fitted model.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Base {
    distribution: Distribution,
    alpha: f64,
    weights: [[f64; TERMS]; 3],
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Distribution {
    Beckmann,
    Ggx,
}

impl Base {
    pub(super) fn fit(samples: &[Sample], floor: f64) -> Self {
        let chosen: Vec<Sample> = samples.iter().step_by(samples.len().div_ceil(MOST)).copied().collect();
        let mut best =
            (f64::INFINITY, Self { distribution: Distribution::Ggx, alpha: 1.0, weights: [[0.0; TERMS]; 3] });
        for distribution in [Distribution::Beckmann, Distribution::Ggx] {
            for step in 0..=STEPS {
                let alpha = 0.02 * 50f64.powf(step as f64 / STEPS as f64);
                let rows: Vec<[f64; TERMS]> = chosen
                    .iter()
                    .map(|sample| terms(distribution, alpha, sample.incident, sample.outgoing))
                    .collect();
                let weights = [0, 1, 2].map(|channel| colours(&chosen, &rows, channel, floor));
                let cost = [0, 1, 2].map(|channel| cost(&chosen, &rows, channel, &weights[channel], floor));
                let cost = cost.iter().sum();
                if cost < best.0 {
                    best = (cost, Self { distribution, alpha, weights });
                }
            }
        }
        best.1
    }

    /// f_0 in 1/sr; below the horizon it is the value at the horizon.
    pub(super) fn value(&self, incident: Direction, outgoing: Direction) -> [f64; 3] {
        let terms = terms(self.distribution, self.alpha, incident, outgoing);
        self.weights.map(|weights| dot(&weights, &terms))
    }

    /// alpha, about the highlight's width in theta_h, in radians.
    pub(super) fn width(&self) -> f64 {
        self.alpha
    }
}

/// The functions that the colours multiply.
fn terms(distribution: Distribution, alpha: f64, incident: Direction, outgoing: Direction) -> [f64; TERMS] {
    let [c_i, c_o] = [incident, outgoing].map(|direction| direction.vector().z.clamp(0.0, 1.0));
    let sum = incident.vector() + outgoing.vector();
    // theta_h may be past 90 degrees if both directions are below the horizon; it is then that at the
    // horizon.
    let c_h = (sum.z / sum.length().max(1e-300)).clamp(1e-3, 1.0);
    let cos_d = (sum.length() / 2.0).min(1.0);
    let matte = |c: f64| 1.0 - (1.0 - c / 2.0).powi(5);
    let (square, a2) = (c_h * c_h, alpha * alpha);
    let d = match distribution {
        Distribution::Beckmann => ((square - 1.0) / (square * a2)).exp() / (PI * a2 * square * square),
        Distribution::Ggx => a2 / (PI * (square * (a2 - 1.0) + 1.0).powi(2)),
    };
    let smith = |c: f64| 1.0 / (c + (a2 + (1.0 - a2) * c * c).sqrt());
    let lobe = d * smith(c_i) * smith(c_o);
    let schlick = (1.0 - cos_d).powi(5);
    [1.0 / PI, 28.0 / (23.0 * PI) * matte(c_i) * matte(c_o), lobe * (1.0 - schlick), lobe * schlick]
}

fn dot(a: &[f64; TERMS], b: &[f64; TERMS]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// The weights of one channel, none of them negative: the least squares of (f - f_0) / (scale + e), where the
/// scale is first f, then twice the f_0 of the round before, so that errors count about as their logarithms
/// would.
fn colours(samples: &[Sample], rows: &[[f64; TERMS]], channel: usize, floor: f64) -> [f64; TERMS] {
    let mut weights = [0.0; TERMS];
    for round in 0..3 {
        let mut matrix = [[0.0; TERMS]; TERMS];
        let mut right = [0.0; TERMS];
        for (sample, row) in samples.iter().zip(rows) {
            let value = sample.value[channel];
            let guess = dot(&weights, row);
            let scale = if round == 0 { value } else { guess.max(value / 20.0) } + floor;
            let miss = if round == 0 { 0.0 } else { ((value + floor) / (guess + floor)).ln() };
            // Outliers count less: see `cost`.
            let trust = if scale > 0.0 { 1.0 / (scale * (1.0 + miss * miss)).powi(2) } else { 0.0 };
            for a in 0..TERMS {
                right[a] += trust * row[a] * value;
                for b in 0..TERMS {
                    matrix[a][b] += trust * row[a] * row[b];
                }
            }
        }
        weights = non_negative(&matrix, &right);
    }
    weights
}

/// The sum of y^2 / (1 + y^2), y = ln((f + e) / (f_0 + e)): past a factor of e, a larger error hardly counts
/// more.
fn cost(
    samples: &[Sample],
    rows: &[[f64; TERMS]],
    channel: usize,
    weights: &[f64; TERMS],
    floor: f64,
) -> f64 {
    let each = samples.iter().zip(rows).map(|(sample, row)| {
        let ratio = (sample.value[channel] + floor) / (dot(weights, row) + floor);
        let square = if ratio > 0.0 { ratio.ln().powi(2) } else { 0.0 };
        square / (1.0 + square)
    });
    each.sum()
}

/// The least squares without negative unknowns: of the 16 subsets of unknowns (the others are 0), the
/// solution with the least error among those without negative ones.
fn non_negative(matrix: &[[f64; TERMS]; TERMS], right: &[f64; TERMS]) -> [f64; TERMS] {
    let mut best = (0.0, [0.0; TERMS]);
    for subset in 1u32..1 << TERMS {
        let held: Vec<usize> = (0..TERMS).filter(|term| subset >> term & 1 == 1).collect();
        let Some(solution) = solve(matrix, right, &held) else { continue };
        // The squared error, less its constant.
        let error = -dot(&solution, right);
        if solution.iter().all(|weight| *weight >= 0.0) && error < best.0 {
            best = (error, solution);
        }
    }
    best.1
}

/// Cholesky on the held unknowns; `None` if they are nearly dependent.
fn solve(matrix: &[[f64; TERMS]; TERMS], right: &[f64; TERMS], held: &[usize]) -> Option<[f64; TERMS]> {
    let n = held.len();
    let mut lower = [[0.0; TERMS]; TERMS];
    let mut x = [0.0; TERMS];
    for i in 0..n {
        for j in 0..=i {
            let sum = matrix[held[i]][held[j]] - (0..j).map(|k| lower[i][k] * lower[j][k]).sum::<f64>();
            if i == j {
                if sum <= 1e-10 * matrix[held[i]][held[i]] || !sum.is_finite() {
                    return None;
                }
                lower[i][i] = sum.sqrt();
            } else {
                lower[i][j] = sum / lower[j][j];
            }
        }
        x[i] = (right[held[i]] - (0..i).map(|k| lower[i][k] * x[k]).sum::<f64>()) / lower[i][i];
    }
    let mut solution = [0.0; TERMS];
    for i in (0..n).rev() {
        x[i] = (x[i] - (i + 1..n).map(|k| lower[k][i] * x[k]).sum::<f64>()) / lower[i][i];
        solution[held[i]] = x[i];
    }
    Some(solution)
}
