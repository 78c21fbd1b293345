//! Exact integration in theta up to degree H - 1 on the H pixel-centred rows.
//!
//! Fejér's weights are exact while the product of the image and P_lm has degree H - 1 at most, so for l up to
//! (H - 1) / 2. Beyond, the product is integrated on twice as many rows. For order m a column of Fourier
//! coefficients G continues across the poles as G(-theta) = (-1)^m G(theta), to a trigonometric polynomial of
//! degree H - 1 on 2 H samples of the circle, known everywhere. The Clenshaw-Curtis rule of 2 H intervals,
//! exact to degree 2 H, has our rows as its odd nodes; with D its weights there, C those of the even nodes
//! theta = pi i / H and S the shift of a circle by half a sample,
//!
//! ```text
//! integral of G P_lm sin(theta) = sum over our rows of (M G) P_lm,   M = D + S^T C S,
//! ```
//!
//! since P_lm is such a polynomial too. So the Legendre sums stay on our H rows. Columns of m and m + 1 share
//! one circle: their sum is split again by parity.

use std::f64::consts::PI;

use super::sums::{Group, ODD};
use crate::f64x4::{F64x4, LANES, SimdLevel};
use crate::fft::{self, Complex4, Fft, cis, times};
use crate::quadrature;

/// The operator M for one number of rows.
pub(crate) struct Resample {
    height: usize,
    fft: Fft,
    /// Clenshaw-Curtis weights of our northern rows (the equator included).
    rows: Vec<f64>,
    /// The Clenshaw-Curtis weights of the nodes between our rows, around the circle; the scale of the four
    /// Fourier transforms and of the circle's two halves included.
    between: Vec<f64>,
    /// The shift by half a sample toward theta = 0, by frequency; zero at the highest.
    shift: Vec<[f64; 2]>,
}

/// The memory of one task.
#[derive(Default)]
pub(crate) struct ResampleScratch {
    /// The circle of each channel, one in each lane.
    circle: Vec<Complex4>,
    fft: Vec<Complex4>,
}

impl Resample {
    /// Prepares M for `height` rows; `scale` multiplies the result.
    pub(crate) fn new(level: SimdLevel, height: usize, scale: f64) -> Self {
        let samples = 2 * height;
        let weights = quadrature::clenshaw_curtis(samples);
        let fft_scale = 1.0 / (samples * samples) as f64;
        let between = (0..samples)
            .map(|i| {
                // An inner node stands on both halves of the circle, so it counts half on each; a sum over
                // our rows is half of that over the circle. The poles stand there once.
                let node = i.min(samples - i);
                let share = if node == 0 || node == height { 2.0 } else { 1.0 };
                scale * share * fft_scale * weights[2 * node]
            })
            .collect();
        let shift = (0..samples)
            .map(|k| {
                let frequency = if k < height { k as f64 } else { k as f64 - samples as f64 };
                if k == height { [0.0; 2] } else { cis(-PI * frequency / samples as f64) }
            })
            .collect();
        let rows = (0..height.div_ceil(2)).map(|j| scale * weights[2 * j + 1]).collect();
        Self { height, fft: Fft::new(level, samples), rows, between, shift }
    }

    /// Applies M to the columns of an even m and of m + 1, given and returned as E and O.
    pub(crate) fn apply(&self, even_m: &mut [Group], odd_m: &mut [Group], scratch: &mut ResampleScratch) {
        let (height, samples) = (self.height, 2 * self.height);
        let ResampleScratch { circle, fft } = scratch;
        circle.resize(samples, fft::ZERO);
        // Values of one row and its mirror, by part (real, imaginary) and channel.
        let read = |group: &Group, lane: usize, sign: f64| -> Complex4 {
            [0, 1].map(|part| {
                F64x4(std::array::from_fn(|channel| {
                    let Some(even) = group[..ODD].get(2 * channel + part) else { return 0.0 };
                    0.5 * (even.0[lane] + sign * group[ODD + 2 * channel + part].0[lane])
                }))
            })
        };
        for north in 0..height.div_ceil(2) {
            let (group, lane) = (north / LANES, north % LANES);
            let south = height - 1 - north;
            // The equator comes as a northern row without a mirror, E = O = N: its halves are added.
            for (row, sign) in [(north, 1.0), (south, -1.0)] {
                let value = |groups: &[Group]| {
                    if north == south {
                        combine(&read(&groups[group], lane, 1.0), &read(&groups[group], lane, -1.0), 1.0)
                    } else {
                        read(&groups[group], lane, sign)
                    }
                };
                let (a, b) = (value(even_m), value(odd_m));
                circle[row] = combine(&a, &b, 1.0);
                circle[samples - 1 - row] = combine(&a, &b, -1.0);
            }
        }
        // An inverse transform is a transform in reverse. Two of them cancel, because the weights are the
        // same in reverse and the shift is its conjugate.
        let shift = |circle: &mut [Complex4]| {
            circle.iter_mut().zip(&self.shift).for_each(|(value, shift)| *value = times(value, *shift));
        };
        self.fft.run(circle, fft);
        shift(circle);
        self.fft.run(circle, fft);
        circle
            .iter_mut()
            .zip(&self.between)
            .for_each(|(value, weight)| *value = times(value, [*weight, 0.0]));
        self.fft.run(circle, fft);
        shift(circle);
        self.fft.run(circle, fft);

        for north in 0..height.div_ceil(2) {
            let (group, lane) = (north / LANES, north % LANES);
            let south = height - 1 - north;
            let weight = self.rows[north];
            for (groups, sign) in [(&mut *even_m, 1.0), (&mut *odd_m, -1.0)] {
                let at = |row: usize| combine(&circle[row], &circle[samples - 1 - row], sign);
                let n = at(north);
                let s = if north == south { fft::ZERO } else { at(south) };
                let (e, o) = (combine(&n, &s, 1.0), combine(&n, &s, -1.0));
                for part in 0..ODD {
                    let (part_of, channel) = (part % 2, part / 2);
                    for (place, between) in [(part, &e), (ODD + part, &o)] {
                        let value = &mut groups[group][place].0[lane];
                        *value = *value * weight + 0.5 * between[part_of].0[channel];
                    }
                }
            }
        }
    }
}

fn combine(a: &Complex4, b: &Complex4, sign: f64) -> Complex4 {
    [0, 1].map(|part| F64x4::from_fn(|lane| a[part].0[lane] + sign * b[part].0[lane]))
}
