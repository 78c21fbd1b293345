//! Exact integration in theta up to degree H - 1 on the H pixel-centred rows.
//!
//! Fejér's weights are exact while the product of the image and P_lm has degree H - 1 at most, so for l up to
//! (H - 1) / 2. Beyond, the product is integrated on twice as many rows. For order m a column of Fourier
//! coefficients G continues across the poles as G(-theta) = (-1)^m G(theta), to a trigonometric polynomial of
//! degree H - 1 on 2 H samples of the circle, known everywhere. The Clenshaw-Curtis rule of 2 H intervals, exact
//! to degree 2 H, has our rows as its odd nodes; with D its weights there, C those of the even nodes
//! theta = pi i / H and S the shift of a circle by half a sample,
//!
//! ```text
//! integral of G P_lm sin(theta) = sum over our rows of (M G) P_lm,   M = D + S^T C S,
//! ```
//!
//! since P_lm is such a polynomial too. So the Legendre sums stay on our H rows. Columns of m and m + 1 share
//! one circle: their sum is split again by parity.

use std::f64::consts::PI;
use std::sync::Arc;

use rustfft::num_complex::Complex;
use rustfft::{Fft, FftPlanner};

use super::lanes::LANES;
use super::sums::{Group, ODD};
use crate::quadrature;

type C64 = Complex<f64>;

/// The operator M for one number of rows.
pub(crate) struct Resample {
    height: usize,
    forward: Arc<dyn Fft<f64>>,
    inverse: Arc<dyn Fft<f64>>,
    /// Clenshaw-Curtis weights of our northern rows (the equator included).
    rows: Vec<f64>,
    /// Those of the nodes between, around the circle; the scale of the four FFTs and of the circle's two
    /// halves included.
    between: Vec<f64>,
    /// The shift by half a sample toward theta = 0, by frequency; zero at the highest.
    shift: Vec<C64>,
}

/// Memory of one task.
pub(crate) struct ResampleScratch {
    circle: Vec<C64>,
    fft: Vec<C64>,
}

impl Resample {
    /// For `height` rows; `scale` multiplies the result.
    pub(crate) fn new(height: usize, scale: f64) -> Self {
        let samples = 2 * height;
        let weights = quadrature::clenshaw_curtis(samples);
        let mut planner = FftPlanner::new();
        let fft_scale = 1.0 / (samples * samples) as f64;
        let between = (0..samples)
            .map(|i| {
                // An inner node stands on both halves of the circle, so it counts half on each; a sum over our
                // rows is half of that over the circle. The poles stand there once.
                let node = i.min(samples - i);
                let share = if node == 0 || node == height { 2.0 } else { 1.0 };
                scale * share * fft_scale * weights[2 * node]
            })
            .collect();
        let shift = (0..samples)
            .map(|k| {
                let frequency = if k < height { k as f64 } else { k as f64 - samples as f64 };
                if k == height { C64::ZERO } else { C64::cis(-PI * frequency / samples as f64) }
            })
            .collect();
        Self {
            height,
            forward: planner.plan_fft_forward(samples),
            inverse: planner.plan_fft_inverse(samples),
            rows: (0..height.div_ceil(2)).map(|j| scale * weights[2 * j + 1]).collect(),
            between,
            shift,
        }
    }

    pub(crate) fn scratch(&self) -> ResampleScratch {
        let fft = self.forward.get_inplace_scratch_len().max(self.inverse.get_inplace_scratch_len());
        ResampleScratch { circle: vec![C64::ZERO; 2 * self.height], fft: vec![C64::ZERO; fft] }
    }

    /// Applies M to the columns of an even m and of m + 1, given and returned as E and O.
    pub(crate) fn apply(&self, even_m: &mut [Group], odd_m: &mut [Group], scratch: &mut ResampleScratch) {
        let (height, samples) = (self.height, 2 * self.height);
        let ResampleScratch { circle, fft } = scratch;
        for channel in 0..3 {
            let (re, im) = (2 * channel, 2 * channel + 1);
            let read = |group: &Group, lane: usize| {
                let even = C64::new(group[re].0[lane], group[im].0[lane]);
                let odd = C64::new(group[ODD + re].0[lane], group[ODD + im].0[lane]);
                ((even + odd) * 0.5, (even - odd) * 0.5)
            };
            for north in 0..height.div_ceil(2) {
                let (group, lane) = (north / LANES, north % LANES);
                let (a_north, a_south) = read(&even_m[group], lane);
                let (b_north, b_south) = read(&odd_m[group], lane);
                let south = height - 1 - north;
                if north == south {
                    // The equator came as a northern row without a mirror: E = O = N.
                    let (a, b) = (a_north + a_south, b_north + b_south);
                    circle[north] = a + b;
                    circle[samples - 1 - north] = a - b;
                } else {
                    circle[north] = a_north + b_north;
                    circle[south] = a_south + b_south;
                    circle[samples - 1 - north] = a_north - b_north;
                    circle[samples - 1 - south] = a_south - b_south;
                }
            }
            self.forward.process_with_scratch(circle, fft);
            circle.iter_mut().zip(&self.shift).for_each(|(value, shift)| *value *= shift);
            self.inverse.process_with_scratch(circle, fft);
            circle.iter_mut().zip(&self.between).for_each(|(value, weight)| *value *= weight);
            self.forward.process_with_scratch(circle, fft);
            circle.iter_mut().zip(&self.shift).for_each(|(value, shift)| *value *= shift.conj());
            self.inverse.process_with_scratch(circle, fft);

            for north in 0..height.div_ceil(2) {
                let (group, lane) = (north / LANES, north % LANES);
                let south = height - 1 - north;
                let weight = self.rows[north];
                let at = |row: usize| {
                    let (near, far) = (circle[row], circle[samples - 1 - row]);
                    ((near + far) * 0.5, (near - far) * 0.5)
                };
                let (a_north, b_north) = at(north);
                let (a_south, b_south) = if north == south { (C64::ZERO, C64::ZERO) } else { at(south) };
                let write = |group: &mut Group, n: C64, s: C64| {
                    let (e, o) = (n + s, n - s);
                    for (part, between) in [(re, e.re), (im, e.im), (ODD + re, o.re), (ODD + im, o.im)] {
                        let value = &mut group[part].0[lane];
                        *value = *value * weight + between;
                    }
                };
                write(&mut even_m[group], a_north, a_south);
                write(&mut odd_m[group], b_north, b_south);
            }
        }
    }
}
