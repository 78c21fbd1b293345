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
//! D and G may be stretched along any direction of the surface, with alpha_x and alpha_y as in `ggx`.
//!
//! For each D and alpha of a list the colours are the non-negative least squares of the relative error; the D
//! and alpha with the least sum of ln((f + e) / (f_0 + e))^2, each capped, win.

use std::f64::consts::PI;

use sphere::{DVec3, Direction};

use super::sample::Sample;

/// The most samples that the model is fitted to; if there are more, evenly spaced ones are chosen.
const MAX_SAMPLES: usize = 1 << 12;

/// The number of steps in the search for alpha, from 0.02 to 1.
const STEPS: usize = 32;

const TERMS: usize = 4;

/// The fitted model.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Base {
    coat: Coat,
    weights: [[f64; TERMS]; 3],
}

/// The facets of the coat.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Coat {
    distribution: Distribution,
    /// alpha along a direction of the surface, and across it.
    alpha: [f64; 2],
    /// The azimuth of the direction along which `alpha` has its first value.
    turn: f64,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Distribution {
    Beckmann,
    Ggx,
}

impl Base {
    pub(super) fn fit(samples: &[Sample], floor: f64) -> Self {
        let mut search = CoatSearch::new(samples, floor);
        for distribution in [Distribution::Beckmann, Distribution::Ggx] {
            for step in 0..=STEPS {
                let alpha = 0.02 * math::pow(50f64, step as f64 / STEPS as f64);
                search.offer(Coat { distribution, alpha: [alpha; 2], turn: 0.0 });
            }
        }
        search.best
    }

    /// Fits the model with a coat that may be stretched: first in steps of 22.5 degrees and factors of
    /// sqrt(2), then by ever smaller steps from the best.
    pub(super) fn fit_stretched(samples: &[Sample], floor: f64) -> Self {
        let alpha = Self::fit(samples, floor).width();
        let mut search = CoatSearch::new(samples, floor);
        for distribution in [Distribution::Beckmann, Distribution::Ggx] {
            search.offer(Coat { distribution, alpha: [alpha; 2], turn: 0.0 });
            for (stretch, turn) in
                (1..=6).flat_map(|k| (0..8).map(move |turn| (f64::from(k), f64::from(turn))))
            {
                let ratio = math::pow(2f64, 0.25 * stretch);
                search.offer(Coat {
                    distribution,
                    alpha: [alpha * ratio, alpha / ratio],
                    turn: turn * PI / 8.0,
                });
            }
        }
        for size in 1..=7 {
            let factor = math::pow(2f64, math::powi(0.5f64, size));
            let turn = PI / 8.0 * math::powi(0.5f64, size);
            for [x, y, by] in [
                [factor, 1.0, 0.0],
                [1.0 / factor, 1.0, 0.0],
                [1.0, factor, 0.0],
                [1.0, 1.0 / factor, 0.0],
                [1.0, 1.0, turn],
                [1.0, 1.0, -turn],
            ] {
                let coat = search.best.coat;
                let alpha = [coat.alpha[0] * x, coat.alpha[1] * y].map(|alpha| alpha.clamp(0.01, 1.0));
                search.offer(Coat { alpha, turn: coat.turn + by, ..coat });
            }
        }
        search.best
    }

    /// The fitted BRDF f_0 in 1/sr; below the horizon it is the value at the horizon.
    pub(super) fn value(&self, incident: Direction, outgoing: Direction) -> [f64; 3] {
        let terms = terms(self.coat, incident, outgoing);
        self.weights.map(|weights| dot(&weights, &terms))
    }

    /// alpha, about the highlight's width in theta_h, in radians; the geometric mean of both if stretched.
    pub(super) fn width(&self) -> f64 {
        let [x, y] = self.coat.alpha;
        if x == y { x } else { (x * y).sqrt() }
    }
}

/// The best of the coats that were offered.
struct CoatSearch {
    samples: Vec<Sample>,
    floor: f64,
    cost: f64,
    best: Base,
}

impl CoatSearch {
    fn new(samples: &[Sample], floor: f64) -> Self {
        let chosen = samples.iter().step_by(samples.len().div_ceil(MAX_SAMPLES)).copied().collect();
        let coat = Coat { distribution: Distribution::Ggx, alpha: [1.0; 2], turn: 0.0 };
        Self { samples: chosen, floor, cost: f64::INFINITY, best: Base { coat, weights: [[0.0; TERMS]; 3] } }
    }

    fn offer(&mut self, coat: Coat) {
        let Self { samples, floor, .. } = self;
        let rows: Vec<[f64; TERMS]> =
            samples.iter().map(|sample| terms(coat, sample.incident, sample.outgoing)).collect();
        let weights = [0, 1, 2].map(|channel| colours(samples, &rows, channel, *floor));
        let cost = [0, 1, 2].map(|channel| cost(samples, &rows, channel, &weights[channel], *floor));
        let cost = cost.iter().sum();
        if cost < self.cost {
            (self.cost, self.best) = (cost, Base { coat, weights });
        }
    }
}

/// The functions that the colours multiply.
fn terms(Coat { distribution, alpha, turn }: Coat, incident: Direction, outgoing: Direction) -> [f64; TERMS] {
    let [c_i, c_o] = [incident, outgoing].map(|direction| direction.vector().z.clamp(0.0, 1.0));
    let sum = incident.vector() + outgoing.vector();
    // theta_h may be past 90 degrees if both directions are below the horizon; it is then that at the
    // horizon.
    let c_h = (sum.z / sum.length().max(1e-300)).clamp(1e-3, 1.0);
    let cos_d = (sum.length() / 2.0).min(1.0);
    let matte = |c: f64| 1.0 - math::powi(1.0 - c / 2.0, 5);
    let square = c_h * c_h;
    let [a_x, a_y] = alpha;
    let (d, smith_i, smith_o) = if a_x == a_y {
        let a2 = a_x * a_x;
        let d = match distribution {
            Distribution::Beckmann => math::exp((square - 1.0) / (square * a2)) / (PI * a2 * square * square),
            Distribution::Ggx => a2 / (PI * math::powi(square * (a2 - 1.0) + 1.0, 2)),
        };
        let smith = |c: f64| 1.0 / (c + (a2 + (1.0 - a2) * c * c).sqrt());
        (d, smith(c_i), smith(c_o))
    } else {
        let (sine, cosine) = math::sin_cos(turn);
        let [x, y] = in_frame(sum, sine, cosine);
        let slopes =
            (math::powi(x / a_x, 2) + math::powi(y / a_y, 2)) / sum.length_squared().max(1e-300) / square;
        let d = match distribution {
            Distribution::Beckmann => math::exp(-slopes),
            Distribution::Ggx => math::powi(1.0 + slopes, -2),
        };
        let smith = |direction: Direction, c: f64| {
            let [x, y] = in_frame(direction.vector(), sine, cosine);
            1.0 / (c + (math::powi(a_x * x, 2) + math::powi(a_y * y, 2) + c * c).sqrt())
        };
        (d / (PI * a_x * a_y * square * square), smith(incident, c_i), smith(outgoing, c_o))
    };
    let lobe = d * smith_i * smith_o;
    let schlick = math::powi(1.0 - cos_d, 5);
    [1.0 / PI, 28.0 / (23.0 * PI) * matte(c_i) * matte(c_o), lobe * (1.0 - schlick), lobe * schlick]
}

/// The parts of a vector along a direction of the surface, and across it.
fn in_frame(v: DVec3, sine: f64, cosine: f64) -> [f64; 2] {
    [v.x * cosine + v.y * sine, v.y * cosine - v.x * sine]
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
            let miss = if round == 0 { 0.0 } else { math::ln((value + floor) / (guess + floor)) };
            // Outliers count less: see `cost`.
            let trust = if scale > 0.0 { 1.0 / math::powi(scale * (1.0 + miss * miss), 2) } else { 0.0 };
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
        let square = if ratio > 0.0 { math::powi(math::ln(ratio), 2) } else { 0.0 };
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
