//! The lights that a fit is tried under: round spots of three sizes, each alone in the dark.
//!
//! A spot is the heat kernel of the sphere, a Gaussian of std tau whose factor of degree l is
//! e^(-l (l + 1) tau^2 / 2), so that what a level of a scale space holds of it is a sum of Legendre polynomials.

use std::f64::consts::PI;

use crate::gaussian::factors;
use crate::widths::{Widths, share};

/// The steps of a table over the angle.
const STEPS: usize = 1024;

/// Functions of an angle in [0, pi], linear between [`STEPS`] + 1 places.
#[derive(Clone, Debug)]
pub(crate) struct Tabulated {
    values: Vec<f64>,
}

impl Tabulated {
    fn place(angle: f64) -> (usize, f64) {
        let x = (angle / PI).clamp(0.0, 1.0) * STEPS as f64;
        let step = (x as usize).min(STEPS - 1);
        (step, x - step as f64)
    }

    pub(crate) fn at(&self, angle: f64) -> f64 {
        let (step, part) = Self::place(angle);
        self.values[step] + part * (self.values[step + 1] - self.values[step])
    }
}

/// Spots of one size.
#[derive(Clone, Debug)]
pub(crate) struct Spots {
    /// The radiance of a spot by the angle from its centre; the integral is 1.
    pub(crate) radiance: Tabulated,
    /// What each level of a scale space holds of it, by the angle from its centre.
    blurred: Vec<Tabulated>,
    /// The centres of the spots: the angle from R and the azimuth from the normal, 0 to pi.
    pub(crate) centres: Vec<(f64, f64)>,
}

/// All lights.
#[derive(Clone, Debug)]
pub(crate) struct TestLights {
    pub(crate) sizes: Vec<Spots>,
}

const ANGLES: usize = 13;
const AZIMUTHS: usize = 6;

impl TestLights {
    /// Spots for a material with a lobe of this width.
    pub(crate) fn new(width: f64, widths: Widths) -> Self {
        let wide = 0.577;
        let sizes = [(0.5 * width).min(0.2), width.min(0.4), wide];
        let spots = |tau: f64| {
            let degree = ((5.3 / tau).ceil() as usize).max(4);
            let spectrum: Vec<f64> =
                (0..=degree).map(|l| math::exp(-0.5 * (l * (l + 1)) as f64 * tau * tau)).collect();
            let mut series = vec![spectrum.clone()];
            for k in 0..widths.len() {
                let blur = factors(widths.std(k), degree);
                series.push(spectrum.iter().zip(blur).map(|(a, b)| a * b).collect());
            }
            let mut tables = tabulate(&series).into_iter();
            let radiance = tables.next().unwrap_or_else(|| unreachable!("the spectrum is one of them"));
            let scale = 1.5 * tau.max(width);
            let most = 1.75;
            let end = math::asinh(most / scale);
            let mut centres = vec![(0.0, 0.0)];
            for i in 1..ANGLES {
                let angle = scale * math::sinh(end * i as f64 / (ANGLES - 1) as f64);
                for j in 0..AZIMUTHS {
                    centres.push((angle, PI * (j as f64 + 0.5) / AZIMUTHS as f64));
                }
            }
            Spots { radiance, blurred: tables.collect(), centres }
        };
        Self { sizes: sizes.map(spots).to_vec() }
    }
}

impl TestLights {
    /// The number of levels of the scale space.
    pub(crate) fn levels(&self) -> usize {
        self.sizes[0].blurred.len()
    }
}

/// The functions sum of (2 l + 1) / (4 pi) f_l P_l(cos angle).
fn tabulate(series: &[Vec<f64>]) -> Vec<Tabulated> {
    let mut tables = vec![Tabulated { values: vec![0.0; STEPS + 1] }; series.len()];
    let degree = series[0].len() - 1;
    for step in 0..=STEPS {
        let x = math::cos(PI * step as f64 / STEPS as f64);
        let (mut before, mut p) = (0.0, 1.0);
        for l in 0..=degree {
            let scale = (2 * l + 1) as f64 / (4.0 * PI) * p;
            for (table, series) in tables.iter_mut().zip(series) {
                table.values[step] += scale * series[l];
            }
            let l = l as f64;
            (before, p) = (p, ((2.0 * l + 1.0) * x * p - l * before) / (l + 1.0));
        }
    }
    tables
}

impl Spots {
    /// What a look-up at place x between the levels sees of a spot at an angle, and its derivatives by the angle
    /// and by x.
    pub(crate) fn seen(&self, angle: f64, x: f64) -> [f64; 3] {
        let last = self.blurred.len() - 1;
        let clamped = x.clamp(0.0, last as f64 - 1e-3);
        let (k, part) = (clamped as usize, clamped.fract());
        let s = share(part);
        let (step, within) = Tabulated::place(angle);
        let [a, b] = [k, k + 1].map(|k| {
            let values = &self.blurred[k].values;
            (values[step], values[step + 1])
        });
        let rise = (STEPS as f64) / PI;
        let at = |(low, high): (f64, f64)| low + within * (high - low);
        let slope = |(low, high): (f64, f64)| (high - low) * rise;
        let (a_at, b_at) = (at(a), at(b));
        let (a_slope, b_slope) = (slope(a), slope(b));
        let by_x = if x == clamped {
            let rate = 0.5 * std::f64::consts::LN_2 * (s + 1.0 + std::f64::consts::SQRT_2);
            (b_at - a_at) * rate
        } else {
            0.0
        };
        [a_at + s * (b_at - a_at), a_slope + s * (b_slope - a_slope), by_x]
    }
}
