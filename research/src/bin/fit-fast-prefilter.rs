//! Prints the weights of `crates/shrm/src/prefilter/fast/table.rs`: how a GGX lobe is best summed from the
//! levels of a chain of cubes.
//!
//! `cargo run --release --manifest-path research/Cargo.toml --bin fit-fast-prefilter`
//!
//! In the tangent plane, with distances in units of the lobe's 2 a, the lobe (1 + x^2)^-2 / pi multiplies a
//! wave of wave number q by the mean of exp(-q^2 / (4 s)) over s that is distributed exponentially. A level
//! multiplies it by the spot that a point of light becomes in it: along each axis two quadratic B-splines
//! and four spreads of second differences, averaged here over the orientation of the wave. Levels are an
//! octave apart; which t = log2(spot) the finest has, its phase, differs between lobes and places. One table
//! of weights by t, linear between its entries, is fitted to 16 phases at once by least squares over q, each
//! wave weighted as a point light has it (q dq), with sums of weights near 1 and a little smoothness.
//! Weights are not negative, so that dark places beside a sun are not either.

use std::f64::consts::FRAC_PI_4;

const PER_OCTAVE: usize = 4;
const FIRST: f64 = -2.25;
const ENTRIES: usize = 34;
const PHASES: usize = 16;

/// `EvenCube::VARIANCE` of a level, in texels, and `EvenCube::PASSES`.
const VARIANCE: f64 = 2.0;
const PASSES: i32 = 4;

/// What a squared error of a sum of weights counts, and what a squared second difference does.
const OF_SUM: f64 = 1e4;
const OF_BEND: f64 = 3e-3;

fn main() {
    let waves: Vec<(f64, f64)> = (0..100)
        .map(|index| 0.02 * 600.0_f64.powf(f64::from(index) / 99.0))
        .map(|wave| (wave, lobe(wave)))
        .collect();
    let mut normal = vec![vec![0.0; ENTRIES]; ENTRIES];
    let mut right = vec![0.0; ENTRIES];
    let equations: Vec<Vec<(Vec<f64>, f64)>> = (0..PHASES)
        .map(|phase| {
            let finest = FIRST - 1.0 + phase as f64 / PHASES as f64;
            let sum = (row(finest, OF_SUM.sqrt(), |_| 1.0), OF_SUM.sqrt());
            let waves =
                waves.iter().map(|&(wave, lobe)| (row(finest, wave, |t| level(wave, t)), wave * lobe));
            waves.chain([sum]).collect()
        })
        .collect();
    for (row, value) in equations.iter().flatten() {
        for i in 0..ENTRIES {
            right[i] += row[i] * value;
            (0..ENTRIES).for_each(|j| normal[i][j] += row[i] * row[j]);
        }
    }
    for middle in 1..ENTRIES - 1 {
        let bend = [(middle - 1, 1.0), (middle, -2.0), (middle + 1, 1.0)];
        for (i, a) in bend {
            bend.iter().for_each(|(j, b)| normal[i][*j] += OF_BEND * a * b);
        }
    }
    (0..ENTRIES).for_each(|i| normal[i][i] += 1e-6);
    let weights: Vec<f64> =
        solved(&normal, &right).iter().map(|weight| (weight * 1e4).round() / 1e4).collect();

    println!("pub(super) const PER_OCTAVE: f64 = {PER_OCTAVE}.0;");
    println!("pub(super) const FIRST: f64 = {FIRST:?};");
    println!("pub(super) const WEIGHTS: [f64; {ENTRIES}] = {weights:?};");
    let power: f64 = waves.iter().map(|(wave, lobe)| (wave * lobe).powi(2)).sum();
    let lost = |equations: &Vec<(Vec<f64>, f64)>| -> f64 {
        let of = |row: &[f64]| row.iter().zip(&weights).map(|(a, weight)| a * weight).sum::<f64>();
        let waves = equations.iter().take(waves.len());
        (waves.map(|(row, value)| (of(row) - value).powi(2)).sum::<f64>() / power).sqrt()
    };
    let lost: Vec<f64> = equations.iter().map(lost).collect();
    let (mean, most) = (lost.iter().sum::<f64>() / PHASES as f64, lost.iter().copied().fold(0.0, f64::max));
    println!(
        "// under a point light the RMS error is {:.2} % (mean over phases), {:.2} % at most",
        100.0 * mean,
        100.0 * most
    );
}

/// The coefficients of the table's entries in the sum over levels, from the finest, of weights times `value`.
fn row(finest: f64, scale: f64, value: impl Fn(f64) -> f64) -> Vec<f64> {
    let mut row = vec![0.0; ENTRIES];
    for octave in 0.. {
        let t = finest + f64::from(octave);
        let x = (t - FIRST) * PER_OCTAVE as f64;
        if x >= (ENTRIES - 1) as f64 {
            return row;
        }
        if x >= 0.0 {
            row[x as usize] += (1.0 - x.fract()) * scale * value(t);
            row[x as usize + 1] += x.fract() * scale * value(t);
        }
    }
    row
}

/// What the lobe multiplies a wave by.
fn lobe(wave: f64) -> f64 {
    const PARTS: usize = 20_000;
    let part = |index: usize| {
        let s = -((index as f64 + 0.5) / PARTS as f64).ln();
        (-wave * wave / (4.0 * s)).exp()
    };
    (0..PARTS).map(part).sum::<f64>() / PARTS as f64
}

/// What a level with spots of 2^t multiplies a wave by.
fn level(wave: f64, t: f64) -> f64 {
    const ORIENTATIONS: usize = 9;
    let texel = t.exp2() / VARIANCE.sqrt();
    // The variance of a spread along one axis, beside those along (v, u), which are 0 in the middle of a
    // face.
    let spread = (VARIANCE - 0.5) / f64::from(PASSES);
    let along = |wave: f64| {
        let half = wave / 2.0;
        let spline = if half.abs() < 1e-6 { 1.0 } else { half.sin() / half };
        spline.powi(6) * (1.0 - spread + spread * wave.cos()).powi(PASSES)
    };
    let orientation = |index: usize| {
        let (sine, cosine) = (FRAC_PI_4 * (index as f64 + 0.5) / ORIENTATIONS as f64).sin_cos();
        along(wave * texel * cosine) * along(wave * texel * sine)
    };
    (0..ORIENTATIONS).map(orientation).sum::<f64>() / ORIENTATIONS as f64
}

/// The non-negative solution of symmetric positive equations, by descent along one unknown at a time.
fn solved(normal: &[Vec<f64>], right: &[f64]) -> Vec<f64> {
    const SWEEPS: usize = 200_000;
    let mut weights = vec![0.0; ENTRIES];
    for _ in 0..SWEEPS {
        for i in 0..ENTRIES {
            let others: f64 = (0..ENTRIES).filter(|j| *j != i).map(|j| normal[i][j] * weights[j]).sum();
            weights[i] = f64::max((right[i] - others) / normal[i][i], 0.0);
        }
    }
    weights
}
