//! The lights that a fit is tried under: round spots of three sizes, each in an ambient light.
//!
//! A spot is the heat kernel of the sphere, a Gaussian of standard deviation tau whose factor of degree l is
//! e^(-l (l + 1) tau^2 / 2), so that what a level of a scale space holds of it is a sum of Legendre
//! polynomials. Functions of the angle between a look-up and a spot are tabulated over the chord, the
//! distance of both.

use std::f64::consts::PI;

use sphere::DVec3;

use crate::kernels::{NORMAL_KERNELS, gaussian_factors, normal_factors};
use crate::widths::{Widths, share};

/// The steps of a table over the chord, from 0 to 2.
const STEPS: usize = 1000;

/// The spots of one size.
#[derive(Debug)]
pub(super) struct Spots {
    /// The radiance of a spot, whose integral is 1, over the chord.
    radiance: Vec<f64>,
    /// What each level of a scale space holds of a spot, over the chord.
    levels: Vec<Vec<f64>>,
    /// What each kernel about the normal holds of a spot, over the chord.
    normals: Vec<Vec<f64>>,
    /// The cosine of the angle from a spot past which nothing is seen of it.
    reach: f64,
    /// The centres in the frame of the reflection vector: +Z is R, +X lies toward the normal, y >= 0.
    pub(super) centres: Vec<DVec3>,
}

/// Between two tables: their index, the share of the second, and its derivative.
#[derive(Clone, Copy, Debug)]
pub(super) struct Between {
    index: usize,
    share: f64,
    rate: f64,
}

impl Between {
    /// A place between the levels of a scale space.
    pub(super) fn levels(x: f64) -> Self {
        let share = share(x.fract());
        // share + 1 + sqrt(2) is (1 + sqrt(2)) 2^(part / 2).
        let rate = 0.5 * std::f64::consts::LN_2 * (share + 1.0 + std::f64::consts::SQRT_2);
        Self { index: x as usize, share, rate }
    }

    /// A place between the kernels about the normal.
    pub(super) fn normals(x: f64) -> Self {
        Self { index: x as usize, share: x.fract(), rate: 1.0 }
    }
}

/// What a look-up sees, and its derivatives by the cosine of the angle to the spot and by the place between
/// tables.
#[derive(Clone, Copy, Debug)]
pub(super) struct Seen {
    pub(super) value: f64,
    pub(super) by_cosine: f64,
    pub(super) by_place: f64,
}

/// The angles of centres from R, and the azimuths at each.
const ANGLES: usize = 13;
const AZIMUTHS: usize = 6;

/// The farthest centre, in radians.
const FARTHEST: f64 = 1.75;

/// The widest spot, in radians; about as wide as the sky of a sunset.
pub(super) const WIDEST: f64 = 0.577;

/// The spots for a material whose lobe has a width, in radians: half as wide, as wide, and [`WIDEST`].
pub(super) fn spots(width: f64, widths: Widths) -> Vec<Spots> {
    [(0.5 * width).min(0.2), width.min(0.4), WIDEST].map(|tau| Spots::new(tau, width, widths)).into()
}

impl Spots {
    pub(super) fn new(tau: f64, width: f64, widths: Widths) -> Self {
        let degree = ((5.3 / tau).ceil() as usize).max(8);
        let spectrum: Vec<f64> =
            (0..=degree).map(|l| math::exp(-0.5 * (l * (l + 1)) as f64 * tau * tau)).collect();
        let blurred = |factors: Vec<f64>| spectrum.iter().zip(factors).map(|(a, b)| a * b).collect();
        let mut series: Vec<Vec<f64>> = vec![spectrum.clone()];
        series.extend((0..widths.len()).map(|k| blurred(gaussian_factors(widths.std(k), degree))));
        let kernels = (0..NORMAL_KERNELS).map(|i| i as f64 / (NORMAL_KERNELS - 1) as f64);
        series.extend(kernels.map(|y| blurred(normal_factors(y, degree))));
        let mut tables = tabulate(&series);
        let normals = tables.split_off(widths.len() + 1);
        let radiance = tables.remove(0);
        let scale = 1.5 * tau.max(width);
        let end = math::asinh(FARTHEST / scale);
        let mut centres = vec![DVec3::Z];
        for i in 1..ANGLES {
            let (s, c) = math::sin_cos(scale * math::sinh(end * i as f64 / (ANGLES - 1) as f64));
            for j in 0..AZIMUTHS {
                let (y, x) = math::sin_cos(PI * (j as f64 + 0.5) / AZIMUTHS as f64);
                centres.push(DVec3::new(s * x, s * y, c));
            }
        }
        Self { radiance, levels: tables, normals, reach: math::cos((5.0 * tau).min(PI)), centres }
    }

    /// The radiance of a spot at the cosine of the angle from its centre.
    pub(super) fn radiance(&self, cosine: f64) -> f64 {
        if cosine < self.reach {
            return 0.0;
        }
        let (step, part, _) = place(cosine);
        self.radiance[step] + part * (self.radiance[step + 1] - self.radiance[step])
    }

    /// What a look-up between levels sees at the cosine of the angle from a spot.
    pub(super) fn in_levels(&self, cosine: f64, between: Between) -> Seen {
        seen(&self.levels[between.index..], cosine, between)
    }

    /// What a look-up about the normal sees at the cosine of the angle from a spot.
    pub(super) fn about_normal(&self, cosine: f64, between: Between) -> Seen {
        seen(&self.normals[between.index..], cosine, between)
    }
}

/// A step of a table, the part of it, and the chord at the cosine of an angle.
fn place(cosine: f64) -> (usize, f64, f64) {
    let chord = (2.0 - 2.0 * cosine).max(0.0).sqrt();
    let x = (0.5 * STEPS as f64 * chord).min(STEPS as f64);
    let step = (x as usize).min(STEPS - 1);
    (step, x - step as f64, chord)
}

fn seen(tables: &[Vec<f64>], cosine: f64, between: Between) -> Seen {
    let (step, part, chord) = place(cosine);
    let [a, b] = [&tables[0], &tables[1]].map(|table| [table[step], table[step + 1]]);
    let low = a[0] + between.share * (b[0] - a[0]);
    let high = a[1] + between.share * (b[1] - a[1]);
    let (at_a, at_b) = (a[0] + part * (a[1] - a[0]), b[0] + part * (b[1] - b[0]));
    // The chord falls by 1 / chord with the cosine.
    let by_cosine = -(high - low) * 0.5 * STEPS as f64 / chord.max(1e-6);
    Seen { value: low + part * (high - low), by_cosine, by_place: between.rate * (at_b - at_a) }
}

/// The functions sum of (2 l + 1) / (4 pi) f_l P_l(cos angle), over the chord.
fn tabulate(series: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let degree = series[0].len() - 1;
    // Factors of one degree lie side by side, so that each P_l is computed once.
    let mut by_degree = Vec::with_capacity((degree + 1) * series.len());
    for l in 0..=degree {
        by_degree.extend(series.iter().map(|factors| (2 * l + 1) as f64 / (4.0 * PI) * factors[l]));
    }
    let mut tables = vec![vec![0.0; STEPS + 1]; series.len()];
    let mut sums = vec![0.0; series.len()];
    for step in 0..=STEPS {
        let chord = 2.0 * step as f64 / STEPS as f64;
        let x = 1.0 - 0.5 * chord * chord;
        sums.fill(0.0);
        let (mut before, mut p) = (0.0, 1.0);
        for (l, factors) in by_degree.chunks_exact(series.len()).enumerate() {
            sums.iter_mut().zip(factors).for_each(|(sum, factor)| *sum += p * factor);
            let l = l as f64;
            (before, p) = (p, ((2.0 * l + 1.0) * x * p - l * before) / (l + 1.0));
        }
        tables.iter_mut().zip(&sums).for_each(|(table, sum)| table[step] = *sum);
    }
    tables
}
