//! The fit at one view.

use std::f64::consts::PI;

use sphere::DVec3;

use super::least_squares::Normal;
use super::lights::TestLights;
use super::lobe::Lobe;
use crate::widths::Widths;

/// The taps at one view: the angle delta, the place x between levels, and the logarithm of the weight.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Parameters(pub(crate) Vec<[f64; 3]>);

impl Parameters {
    /// Taps of widths from `least` to `most`, all at R.
    pub(crate) fn start(taps: usize, least: f64, most: f64, widths: Widths) -> Self {
        let tap = |j: usize| {
            let part = if taps == 1 { 0.3 } else { j as f64 / (taps - 1) as f64 };
            let std = least * math::pow(most / least, part);
            [0.0, widths.place(std), -math::ln(taps as f64) ]
        };
        Self((0..taps).map(tap).collect())
    }
}

/// One residual's light: its size, its centre, and what the material reflects of it.
struct Target {
    size: usize,
    centre: DVec3,
    truth: f64,
    weight: f64,
}

/// The residuals of one view.
pub(crate) struct ViewFit<'a> {
    pub(crate) theta: f64,
    lights: &'a TestLights,
    targets: Vec<Target>,
    last: f64,
}

/// The ambient light of every test, in shares of the spot's flux.
const AMBIENT: f64 = 0.03 / (4.0 * PI);

/// How much more the uniform light weighs than one spot.
const UNIFORM: f64 = 4.0;

impl<'a> ViewFit<'a> {
    pub(crate) fn new(theta: f64, lobe: &Lobe, lights: &'a TestLights) -> Self {
        let mut targets = Vec::new();
        for (size, spots) in lights.sizes.iter().enumerate() {
            for (angle, azimuth) in &spots.centres {
                let (s, c) = math::sin_cos(*angle);
                let (y, x) = math::sin_cos(*azimuth);
                let centre = DVec3::new(s * x, s * y, c);
                let mirrored = DVec3::new(centre.x, -centre.y, centre.z);
                let mut truth = 0.0;
                for (direction, share) in &lobe.shares {
                    let seen = [centre, mirrored]
                        .map(|centre| spots.radiance.at(math::acos(centre.dot(*direction).clamp(-1.0, 1.0))));
                    truth += 0.5 * share * (seen[0] + seen[1]);
                }
                targets.push(Target { size, centre, truth, weight: 1.0 });
            }
        }
        Self { theta, lights, targets, last: 0.0 }
    }

    /// The number of residuals.
    pub(crate) fn len(&self) -> usize {
        self.targets.len() + 1
    }

    /// The sum of squared residuals, and the normal equations if they are wanted. Taps beyond one side of the
    /// plane have a mirror image, of which each sees a half.
    pub(crate) fn evaluate(&self, taps: &[[f64; 3]], mut normal: Option<&mut Normal>) -> f64 {
        let mut row = vec![0.0; 3 * taps.len()];
        let placed: Vec<(DVec3, DVec3, f64, f64)> = taps
            .iter()
            .map(|[delta, x, log]| {
                let (s, c) = math::sin_cos(*delta);
                (DVec3::new(s, 0.0, c), DVec3::new(c, 0.0, -s), *x, math::exp(*log))
            })
            .collect();
        let mut cost = 0.0;
        for target in &self.targets {
            let spots = &self.lights.sizes[target.size];
            let mut sum = AMBIENT;
            for (tap, (d, along, x, weight)) in placed.iter().enumerate() {
                let cosine = d.dot(target.centre).clamp(-1.0, 1.0);
                let angle = math::acos(cosine);
                let [seen, by_angle, by_x] = spots.seen(angle, *x);
                sum += weight * seen;
                // d angle / d delta = -(d cosine / d delta) / sin(angle).
                let sine = (1.0 - cosine * cosine).sqrt().max(1e-9);
                row[3 * tap] = -weight * by_angle * along.dot(target.centre) / sine;
                row[3 * tap + 1] = weight * by_x;
                row[3 * tap + 2] = weight * seen;
            }
            let residual = target.weight * math::log2(sum / (target.truth + AMBIENT));
            cost += residual * residual;
            if let Some(normal) = normal.as_deref_mut() {
                let scale = target.weight / (std::f64::consts::LN_2 * sum);
                row.iter_mut().for_each(|value| *value *= scale);
                normal.add(&row, residual);
            }
        }
        // The uniform light: the sum of the weights is 1.
        let whole: f64 = placed.iter().map(|(.., weight)| weight).sum();
        let residual = UNIFORM * math::log2(whole);
        cost += residual * residual;
        if let Some(normal) = normal {
            row.fill(0.0);
            for (tap, (.., weight)) in placed.iter().enumerate() {
                row[3 * tap + 2] = UNIFORM * weight / (std::f64::consts::LN_2 * whole);
            }
            normal.add(&row, residual);
        }
        cost + self.last
    }

    /// The taps that fit best, from a start, with a weak pull to it.
    pub(crate) fn solve(&self, start: &Parameters) -> Parameters {
        const PULL: f64 = 0.05;
        let pulled = |taps: &[[f64; 3]], normal: Option<&mut Normal>| {
            let (taps_flat, start_flat) = (taps.as_flattened(), start.0.as_flattened());
            let mut cost = 0.0;
            for (a, b) in taps_flat.iter().zip(start_flat) {
                cost += PULL * PULL * (a - b) * (a - b);
            }
            if let Some(normal) = normal {
                for (i, (a, b)) in taps_flat.iter().zip(start_flat).enumerate() {
                    normal.matrix[i * normal.size + i] += PULL * PULL;
                    normal.vector[i] += PULL * PULL * (a - b);
                }
            }
            cost
        };
        let mut taps = start.0.clone();
        let mut damping = 1e-2;
        let mut cost = f64::INFINITY;
        for _ in 0..ITERATIONS {
            let mut normal = Normal::new(3 * taps.len());
            cost = self.evaluate(&taps, Some(&mut normal)) + pulled(&taps, Some(&mut normal));
            let mut better = None;
            while damping < 1e6 {
                if let Some(step) = normal.step(damping) {
                    let mut trial = taps.clone();
                    trial.as_flattened_mut().iter_mut().zip(&step).for_each(|(value, step)| *value += step);
                    self.bound(&mut trial);
                    let trial_cost = self.evaluate(&trial, None) + pulled(&trial, None);
                    if trial_cost < cost {
                        better = Some((trial, trial_cost));
                        break;
                    }
                }
                damping *= 4.0;
            }
            let Some((trial, trial_cost)) = better else { break };
            taps = trial;
            damping = (damping * 0.25).max(1e-7);
            let gain = cost - trial_cost;
            cost = trial_cost;
            if gain < 1e-4 * cost {
                break;
            }
        }
        let _ = cost;
        Parameters(taps)
    }

    /// Keeps taps where a scale space has levels.
    pub(crate) fn bound(&self, taps: &mut [[f64; 3]]) {
        let last = (self.lights.levels() - 1) as f64 - 1e-3;
        for [delta, x, log] in taps {
            *delta = delta.clamp(-1.5, 1.5);
            *x = x.clamp(0.0, last);
            *log = log.clamp(-12.0, 3.0);
        }
    }
}

const ITERATIONS: usize = 40;
