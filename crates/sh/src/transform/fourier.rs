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

use super::lanes::{Kernel, LANES, Lane, Simd};
use super::sums::{Group, ODD};

type C64 = Complex<f64>;

/// A channel of a pixel: `f32` or `f64`.
pub trait Sample: Copy + Send + Sync + private::Sealed {
    /// Black.
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
pub(crate) struct FourierScratch {
    /// Four pairs of rows as complex rows, by channel, then pair.
    rows: Vec<C64>,
    fft: Vec<C64>,
    /// The groups of every m.
    groups: Vec<Group>,
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
            rows: vec![C64::ZERO; 3 * LANES * self.width],
            fft: vec![C64::ZERO; self.fft.get_inplace_scratch_len()],
            groups: Vec::new(),
        }
    }

    /// Pairs of rows of the grid; with an odd height the last pair is the equator alone.
    fn pairs(&self) -> usize {
        self.height.div_ceil(2)
    }
}

/// Sums over the columns of the pairs 4 `group` .. 4 `group` + 4: `output[m]` gets E and O of every channel.
pub(crate) struct AnalyseRows<'a, T> {
    pub(crate) fourier: &'a Fourier,
    pub(crate) group: usize,
    pub(crate) pixels: &'a [[T; 3]],
    pub(crate) scratch: &'a mut FourierScratch,
    pub(crate) output: &'a mut [Group],
}

impl<T: Sample> Kernel for AnalyseRows<'_, T> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let Self { fourier, group, pixels, scratch, output } = self;
        let (width, height) = (fourier.width, fourier.height);
        for lane in 0..LANES {
            let [red, green, blue] = channels(&mut scratch.rows, lane, width);
            let north = group * LANES + lane;
            if north >= fourier.pairs() {
                [red, green, blue].into_iter().for_each(|row| row.fill(C64::ZERO));
                continue;
            }
            let south = height - 1 - north;
            let north_pixels = &pixels[north * width..][..width];
            let south_pixels = &pixels[south * width..][..width];
            // The equator of an odd height is a northern row without a mirror.
            let mirrored = if north == south { 0.0 } else { 1.0 };
            for column in 0..width {
                let n = north_pixels[column].map(T::to_f64);
                let s = south_pixels[column].map(T::to_f64);
                red[column] = C64::new(n[0], s[0] * mirrored);
                green[column] = C64::new(n[1], s[1] * mirrored);
                blue[column] = C64::new(n[2], s[2] * mirrored);
            }
        }
        fourier.fft.process_with_scratch(&mut scratch.rows, &mut scratch.fft);
        for (channel, rows) in scratch.rows.chunks_exact(LANES * width).enumerate() {
            for (m, (parts, turn)) in output.iter_mut().zip(&fourier.turns).enumerate() {
                let mirror = if m == 0 { 0 } else { width - m };
                let gather = |column: usize, part: fn(&C64) -> f64| {
                    simd.load(&Lane(std::array::from_fn(|lane| part(&rows[lane * width + column]))))
                };
                let (p_re, p_im) = (gather(m, |z| z.re), gather(m, |z| z.im));
                let (q_re, q_im) = (gather(mirror, |z| z.re), gather(mirror, |z| z.im));
                // With X_m = p and X_(W-m) = q: 2 N = p + conj q and 2 S = -i (p - conj q).
                let (n_re, n_im) = (simd.add(p_re, q_re), simd.sub(p_im, q_im));
                let (s_re, minus_s_im) = (simd.add(p_im, q_im), simd.sub(p_re, q_re));
                let even = (simd.add(n_re, s_re), simd.sub(n_im, minus_s_im));
                let odd = (simd.sub(n_re, s_re), simd.add(n_im, minus_s_im));
                let (u_re, u_im) = (simd.splat(0.5 * turn.re), simd.splat(0.5 * turn.im));
                let minus_u_im = simd.splat(-0.5 * turn.im);
                for (part, (re, im)) in [(2 * channel, even), (ODD + 2 * channel, odd)] {
                    let product = simd.mul_add(re, u_re, simd.mul(im, minus_u_im));
                    simd.store(product, &mut parts[part]);
                    let product = simd.mul_add(re, u_im, simd.mul(im, u_re));
                    simd.store(product, &mut parts[part + 1]);
                }
            }
        }
    }
}

/// The pixels of four pairs of rows from E and O of every m, as `input` gives them.
///
/// `north` takes the northern rows from the first pair down, `south` their mirrors from the last pair down
/// (without the equator, whose row is northern).
pub(crate) struct SynthesiseRows<'a, T, I> {
    pub(crate) fourier: &'a Fourier,
    pub(crate) input: I,
    pub(crate) scratch: &'a mut FourierScratch,
    pub(crate) north: &'a mut [[T; 3]],
    pub(crate) south: &'a mut [[T; 3]],
}

impl<'a, T: Sample, I: Fn(usize) -> &'a Group> Kernel for SynthesiseRows<'_, T, I> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let Self { fourier, input, scratch, north, south } = self;
        let width = fourier.width;
        let degree = fourier.turns.len() - 1;
        // Coarser than the function, frequencies fold onto each other.
        let folds = degree >= width - degree.min(width);
        for row in scratch.rows.chunks_exact_mut(width) {
            if folds {
                row.fill(C64::ZERO);
            } else {
                row[degree + 1..width - degree].fill(C64::ZERO);
            }
        }
        // Copied first: the groups lie far apart, and a short loop has more of them under way.
        scratch.groups.clear();
        scratch.groups.extend((0..=degree).map(|m| *input(m)));
        for (m, (turn, parts)) in fourier.turns.iter().zip(&scratch.groups).enumerate() {
            // The two halves of a real cosine, except at m = 0.
            let half = if m == 0 { 1.0 } else { 0.5 };
            let (u_re, u_im) = (simd.splat(half * turn.re), simd.splat(half * turn.im));
            let minus_u_re = simd.splat(-half * turn.re);
            let (column, mirror) = (m % width, (width - m % width) % width);
            for (channel, rows) in scratch.rows.chunks_exact_mut(LANES * width).enumerate() {
                let part = |part: usize| simd.load(&parts[part + 2 * channel]);
                let (e_re, e_im, o_re, o_im) = (part(0), part(1), part(ODD), part(ODD + 1));
                // (A - i B) u for N = E + O and S = E - O
                let turned = |a, b| {
                    let re = simd.mul_add(a, u_re, simd.mul(b, u_im));
                    let im = simd.mul_add(a, u_im, simd.mul(b, minus_u_re));
                    (re, im)
                };
                let (n_re, n_im) = turned(simd.add(e_re, o_re), simd.add(e_im, o_im));
                let (s_re, s_im) = turned(simd.sub(e_re, o_re), simd.sub(e_im, o_im));
                let lanes = |vector| {
                    let mut lane = Lane::ZERO;
                    simd.store(vector, &mut lane);
                    lane.0
                };
                // N + i S and, for the mirrored frequency, conj N + i conj S.
                let near = (lanes(simd.sub(n_re, s_im)), lanes(simd.add(n_im, s_re)));
                let far = (lanes(simd.add(n_re, s_im)), lanes(simd.sub(s_re, n_im)));
                for lane in 0..LANES {
                    let row = &mut rows[lane * width..][..width];
                    let near = C64::new(near.0[lane], near.1[lane]);
                    let far = C64::new(far.0[lane], far.1[lane]);
                    if folds {
                        row[column] += near;
                        if m > 0 {
                            row[mirror] += far;
                        }
                    } else {
                        row[mirror] = far;
                        row[column] = near;
                    }
                }
            }
        }
        fourier.fft.process_with_scratch(&mut scratch.rows, &mut scratch.fft);
        let south_rows = south.len() / width;
        for (lane, pixels) in north.chunks_exact_mut(width).enumerate() {
            let [red, green, blue] = channels(&mut scratch.rows, lane, width);
            for column in 0..width {
                pixels[column] = [red[column].re, green[column].re, blue[column].re].map(T::from_f64);
            }
        }
        for (lane, pixels) in south.chunks_exact_mut(width).rev().enumerate().take(south_rows) {
            let [red, green, blue] = channels(&mut scratch.rows, lane, width);
            for column in 0..width {
                pixels[column] = [red[column].im, green[column].im, blue[column].im].map(T::from_f64);
            }
        }
    }
}

/// The rows of one pair, for each channel.
#[inline(always)]
fn channels(rows: &mut [C64], lane: usize, width: usize) -> [&mut [C64]; 3] {
    let (red, rest) = rows.split_at_mut(LANES * width);
    let (green, blue) = rest.split_at_mut(LANES * width);
    [red, green, blue].map(|rows| &mut rows[lane * width..][..width])
}
