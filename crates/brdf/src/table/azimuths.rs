//! Sums over the azimuth of a circle theta = const: the rule of equal steps, doubled until it agrees.
//!
//! A periodic function without kinks is integrated by n equal steps to an error that falls as a power with
//! the exponent n, and of 2 n steps half are already there. A highlight that is narrow, at azimuth 0, would
//! need many. So steps are equal in t, with
//!
//! > phi = t - a sin(t), dphi = (1 - a cos(t)) dt,
//!
//! which is periodic and smooth too, and has steps at phi = 0 that are smaller by 1 - a.

use std::f64::consts::TAU;

/// The number of steps of the first, coarsest rule.
const FIRST: usize = 8;
/// The number of rules: the last has 2048 steps.
const STAGES: usize = 9;
/// The number of rules past the one whose steps a highlight cannot hide between: 32 times as many steps.
const MORE: usize = 5;
/// The number of choices of 1 - a: 1, 1/2, ... 1/1024.
const CONCENTRATIONS: usize = 11;

/// The nodes of every rule, and the harmonics of the azimuth at them.
pub(super) struct Azimuths {
    /// The number of harmonics: 1, cos(phi), sin(phi), ... sin(F phi).
    columns: usize,
    /// The rules by concentration and stage.
    rules: Vec<Vec<Stage>>,
}

/// The nodes that a rule adds to those of the one before.
struct Stage {
    /// The cosine and sine of phi at each node.
    turns: Vec<[f64; 2]>,
    /// The harmonics times dphi / dt, [node, column].
    harmonics: Vec<f64>,
}

/// Which rules are tried on a circle.
#[derive(Clone, Copy, Debug)]
pub(super) struct Steps {
    /// The k of 1 - a = 2^-k.
    concentration: usize,
    /// The first and the last rule that may be the one that is used.
    stages: [usize; 2],
    /// The error that is aimed at, as a share of the greatest integral.
    accuracy: f64,
}

impl Steps {
    /// The rules for a highlight of a width in radians, at azimuth 0 or, if it `strays`, at any.
    pub(super) fn for_feature(width: f64, strays: bool, accuracy: f64) -> Self {
        let narrow = math::log2(1.0 / width.clamp(1e-9, 1.0));
        // Where 1 - a = width^(2/3), the highlight is about as wide in t as the bend of phi(t): width^(1/3).
        let concentration = (narrow * 2.0 / 3.0).round() as usize;
        // Steps that it cannot hide between.
        let stage = math::log2(TAU / (2.0 * width) / FIRST as f64).ceil().max(0.0) as usize;
        Self {
            concentration: concentration.min(CONCENTRATIONS - 1),
            stages: [if strays { stage.min(STAGES - 2) } else { 0 }, (stage + MORE).min(STAGES - 1)],
            accuracy,
        }
    }
}

/// The memory of [`Azimuths::integrate`], with its results in `moments`.
pub(super) struct CircleMoments {
    /// The integrals over phi of the function times each harmonic, [channel, column].
    pub(super) moments: [Vec<f64>; 3],
    /// The error that the moments may have.
    pub(super) error: f64,
    /// The number of values taken so far, over all calls.
    pub(super) evaluations: usize,
    sums: [Vec<f64>; 3],
    values: Vec<[f64; 3]>,
}

impl CircleMoments {
    pub(super) fn new(degree: usize) -> Self {
        let zeros = || [(); 3].map(|()| vec![0.0; 2 * degree + 1]);
        Self { moments: zeros(), error: 0.0, evaluations: 0, sums: zeros(), values: Vec::new() }
    }
}

impl Azimuths {
    /// Prepares the rules for harmonics up to cos(`degree` phi).
    pub(super) fn new(degree: usize) -> Self {
        let stage = |a: f64, stage: usize| {
            let (count, offset) = match stage {
                0 => (FIRST, 0.0),
                _ => (FIRST << (stage - 1), 0.5),
            };
            let (mut turns, mut harmonics) = (Vec::new(), Vec::new());
            for i in 0..count {
                let t = TAU * (i as f64 + offset) / count as f64;
                let (phi, slope) = (t - a * math::sin(t), 1.0 - a * math::cos(t));
                turns.push([math::cos(phi), math::sin(phi)]);
                harmonics.push(slope);
                for m in 1..=degree {
                    let (sine, cosine) = math::sin_cos(m as f64 * phi);
                    harmonics.extend([slope * cosine, slope * sine]);
                }
            }
            Stage { turns, harmonics }
        };
        let rule = |k: usize| {
            let a = 1.0 - math::powi(0.5f64, k as i32);
            (0..STAGES).map(|s| stage(a, s)).collect()
        };
        Self { columns: 2 * degree + 1, rules: (0..CONCENTRATIONS).map(rule).collect() }
    }

    /// Integrates `value(cos(phi), sin(phi))` times every harmonic to within `allowed` or the share of the
    /// greatest of these integrals that `Steps` says, or as well as the last rule does; `None` as soon as a
    /// value is `None`.
    pub(super) fn integrate(
        &self,
        Steps { concentration, stages: [first, last], accuracy }: Steps,
        allowed: f64,
        circle: &mut CircleMoments,
        mut value: impl FnMut(f64, f64) -> Option<[f64; 3]>,
    ) -> Option<()> {
        circle.sums.iter_mut().for_each(|sums| sums.fill(0.0));
        let (mut grey, mut before) = (true, 0.0);
        let mut nodes = 0;
        for (number, stage) in self.rules[concentration][..=last].iter().enumerate() {
            circle.values.clear();
            for &[cosine, sine] in &stage.turns {
                let rgb = value(cosine, sine)?;
                if grey && (rgb[0] != rgb[1] || rgb[0] != rgb[2]) {
                    // Until here the other channels are those of the first.
                    grey = false;
                    let [first, others @ ..] = &mut circle.sums;
                    others.iter_mut().for_each(|sums| sums.copy_from_slice(first));
                }
                circle.values.push(rgb);
            }
            nodes += stage.turns.len();
            let channels = if grey { 1 } else { 3 };
            for channel in 0..channels {
                let sums = &mut circle.sums[channel];
                for (rgb, harmonics) in circle.values.iter().zip(stage.harmonics.chunks_exact(self.columns)) {
                    let value = rgb[channel];
                    sums.iter_mut().zip(harmonics).for_each(|(sum, harmonic)| *sum += value * harmonic);
                }
            }
            let step = TAU / nodes as f64;
            let mut difference: f64 = 0.0;
            for channel in 0..channels {
                for (moment, sum) in circle.moments[channel].iter_mut().zip(&circle.sums[channel]) {
                    difference = difference.max((step * sum - *moment).abs());
                    *moment = step * sum;
                }
            }
            if number == 0 {
                continue;
            }
            // Differences that shrink by a factor go on to shrink, by more.
            circle.error = difference * (difference / before).min(1.0);
            before = difference;
            let size = circle.moments[..channels].iter().flatten().fold(0.0, |m: f64, v| m.max(v.abs()));
            if number > first && circle.error <= allowed.max(accuracy * size) {
                break;
            }
        }
        if grey {
            let [first, others @ ..] = &mut circle.moments;
            others.iter_mut().for_each(|moments| moments.copy_from_slice(first));
        }
        circle.evaluations += nodes;
        Some(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The integrals of e^(k cos(phi)) cos(m phi) are 2 pi I_m(k), Bessel's functions (DLMF 10.32.3), which a
    /// sum of 2^16 equal steps has to the last digit for these k.
    #[test]
    fn circles_of_narrow_and_wide_features_are_integrated_to_what_is_asked() {
        let degree = 4;
        let azimuths = Azimuths::new(degree);
        let mut circle = CircleMoments::new(degree);
        for (sharpness, width) in [(0.5_f64, 1.0), (30.0, 0.2), (1e4, 0.01), (1e6, 1e-3)] {
            let f = |cosine: f64| (sharpness * (cosine - 1.0)).exp();
            let steps = 1 << 16;
            let step = TAU / f64::from(steps);
            circle.evaluations = 0;
            azimuths
                .integrate(Steps::for_feature(width, false, 1e-7), 1e-12, &mut circle, |cosine, sine| {
                    Some([f(cosine), 2.0 * f(cosine), sine * f(cosine)])
                })
                .unwrap();
            for m in 0..=degree {
                let sum: f64 = (0..steps)
                    .map(|i| f((step * f64::from(i)).cos()) * (m as f64 * step * f64::from(i)).cos())
                    .sum();
                let (sum, column) = (step * sum, if m == 0 { 0 } else { 2 * m - 1 });
                let size = circle.moments[0][0];
                assert!((circle.moments[0][column] - sum).abs() < 1e-7 * size, "{sharpness} {m}");
                assert!((circle.moments[1][column] - 2.0 * sum).abs() < 1e-7 * size);
                assert!(circle.moments[2][column].abs() < 1e-7 * size, "odd in phi");
            }
            assert!(circle.evaluations <= 256, "{sharpness}: {}", circle.evaluations);
        }
    }
}
