//! Along the rows: pixels to Fourier coefficients of phi and back, four pairs of rows at a time.
//!
//! A northern row N and its mirror S are the real and imaginary part of one complex row, so that one complex
//! FFT serves both: with X its transform, N_m = (X_m + conj X_(W-m)) / 2 and S_m = (X_m - conj X_(W-m)) / 2i.
//! Columns run from phi = pi - pi / W downward, phi_c = pi - 2 pi (c + 1/2) / W, hence
//!
//! ```text
//! sum over c of f_c (cos(m phi_c) + i sin(m phi_c)) = u_m N_m,   u_m = (-1)^m exp(-i pi m / W),
//! sum over m of (A_m cos(m phi_c) + B_m sin(m phi_c)) = Re sum over m of (A_m - i B_m) u_m exp(-2 pi i m c / W).
//! ```

use std::f64::consts::PI;
use std::sync::Arc;

use rustfft::num_complex::Complex;
use rustfft::{Fft, FftPlanner};

use super::lanes::{LANES, Lane};
use super::sums::{Group, ODD, PARTS};

type C64 = Complex<f64>;

/// A channel of a pixel: `f32` or `f64`.
pub trait Sample: Copy + Send + Sync + private::Sealed {
    /// Nothing.
    const ZERO: Self;

    /// To the precision of the sums.
    fn to_f64(self) -> f64;

    /// From the precision of the sums, rounded to nearest.
    fn from_f64(value: f64) -> Self;
}

mod private {
    pub trait Sealed {}
    impl Sealed for f32 {}
    impl Sealed for f64 {}
}

impl Sample for f32 {
    const ZERO: Self = 0.0;

    #[inline(always)]
    fn to_f64(self) -> f64 {
        f64::from(self)
    }

    #[inline(always)]
    fn from_f64(value: f64) -> Self {
        value as f32
    }
}

impl Sample for f64 {
    const ZERO: Self = 0.0;

    #[inline(always)]
    fn to_f64(self) -> f64 {
        self
    }

    #[inline(always)]
    fn from_f64(value: f64) -> Self {
        value
    }
}

/// The FFT of one grid's rows for m = 0 ..= degree.
pub(crate) struct Fourier {
    width: usize,
    height: usize,
    fft: Arc<dyn Fft<f64>>,
    /// u_m of the module text, m = 0 ..= degree.
    turns: Vec<C64>,
}

/// Memory of one task.
#[derive(Default)]
pub(crate) struct FourierScratch {
    /// One channel of four pairs of rows.
    rows: Vec<C64>,
    fft: Vec<C64>,
}

impl Fourier {
    pub(crate) fn new(width: usize, height: usize, degree: usize) -> Self {
        let turns = (0..=degree)
            .map(|m| {
                let sign = if m % 2 == 0 { 1.0 } else { -1.0 };
                C64::cis(-PI * (m % (2 * width)) as f64 / width as f64) * sign
            })
            .collect();
        Self { width, height, fft: FftPlanner::new().plan_fft_forward(width), turns }
    }

    pub(crate) fn scratch(&self) -> FourierScratch {
        FourierScratch {
            rows: vec![C64::ZERO; LANES * self.width],
            fft: vec![C64::ZERO; self.fft.get_inplace_scratch_len()],
        }
    }

    /// Pairs of rows of the grid; with an odd height the last pair is the equator alone.
    fn pairs(&self) -> usize {
        self.height.div_ceil(2)
    }

    /// Sums over the columns of the pairs 4 `group` .. 4 `group` + 4: `output[m]` gets E and O of every channel.
    pub(crate) fn analyse<T: Sample>(
        &self,
        group: usize,
        pixels: &[[T; 3]],
        scratch: &mut FourierScratch,
        output: &mut [Group],
    ) {
        let width = self.width;
        for channel in 0..3 {
            for (lane, row) in scratch.rows.chunks_exact_mut(width).enumerate() {
                let north = group * LANES + lane;
                if north >= self.pairs() {
                    row.fill(C64::ZERO);
                    continue;
                }
                let south = self.height - 1 - north;
                let north_pixels = &pixels[north * width..][..width];
                let south_pixels = &pixels[south * width..][..width];
                if north == south {
                    for (value, n) in row.iter_mut().zip(north_pixels) {
                        *value = C64::new(n[channel].to_f64(), 0.0);
                    }
                } else {
                    for ((value, n), s) in row.iter_mut().zip(north_pixels).zip(south_pixels) {
                        *value = C64::new(n[channel].to_f64(), s[channel].to_f64());
                    }
                }
            }
            self.fft.process_with_scratch(&mut scratch.rows, &mut scratch.fft);
            for (m, (parts, &turn)) in output.iter_mut().zip(&self.turns).enumerate() {
                let mirror = if m == 0 { 0 } else { width - m };
                for lane in 0..LANES {
                    let p = scratch.rows[lane * width + m];
                    let q = scratch.rows[lane * width + mirror].conj();
                    // N = (p + q) / 2, S = -i (p - q) / 2
                    let half_turn = turn * 0.5;
                    let north = (p + q) * half_turn;
                    let south = p - q;
                    let south = C64::new(south.im, -south.re) * half_turn;
                    let (even, odd) = (north + south, north - south);
                    parts[2 * channel].0[lane] = even.re;
                    parts[2 * channel + 1].0[lane] = even.im;
                    parts[ODD + 2 * channel].0[lane] = odd.re;
                    parts[ODD + 2 * channel + 1].0[lane] = odd.im;
                }
            }
        }
    }

    /// The pixels of the pairs 4 `group` .. 4 `group` + 4 from E and O of every m.
    ///
    /// `north` takes the northern rows from the first pair down, `south` their mirrors from the last pair down
    /// (without the equator, whose row is northern).
    pub(crate) fn synthesise<'a, T: Sample>(
        &self,
        input: impl Fn(usize) -> &'a Group,
        scratch: &mut FourierScratch,
        north: &mut [[T; 3]],
        south: &mut [[T; 3]],
    ) {
        let width = self.width;
        let south_rows = south.len() / width;
        for channel in 0..3 {
            scratch.rows.fill(C64::ZERO);
            for (m, &turn) in self.turns.iter().enumerate() {
                let parts: &[Lane; PARTS] = input(m);
                let column = m % width;
                let mirror = (width - column) % width;
                // The two halves of a real cosine, except at m = 0.
                let half_turn = if m == 0 { turn } else { turn * 0.5 };
                for lane in 0..LANES {
                    let even = C64::new(parts[2 * channel].0[lane], -parts[2 * channel + 1].0[lane]);
                    let odd =
                        C64::new(parts[ODD + 2 * channel].0[lane], -parts[ODD + 2 * channel + 1].0[lane]);
                    let n = (even + odd) * half_turn;
                    let s = (even - odd) * half_turn;
                    let row = &mut scratch.rows[lane * width..][..width];
                    row[column] += C64::new(n.re - s.im, n.im + s.re);
                    if m > 0 {
                        row[mirror] += C64::new(n.re + s.im, s.re - n.im);
                    }
                }
            }
            self.fft.process_with_scratch(&mut scratch.rows, &mut scratch.fft);
            for (row, pixels) in scratch.rows.chunks_exact(width).zip(north.chunks_exact_mut(width)) {
                for (value, pixel) in row.iter().zip(pixels) {
                    pixel[channel] = T::from_f64(value.re);
                }
            }
            let mirrored = south.chunks_exact_mut(width).rev();
            for (row, pixels) in scratch.rows.chunks_exact(width).take(south_rows).zip(mirrored) {
                for (value, pixel) in row.iter().zip(pixels) {
                    pixel[channel] = T::from_f64(value.im);
                }
            }
        }
    }
}
