//! Along the rows: pixels to Fourier coefficients of phi and back, four pairs of rows at a time.
//!
//! A northern row N and its mirror S are the real and imaginary part of one complex row, so that one complex
//! FFT serves both: with X its transform, N_m = (X_m + conj X_(W-m)) / 2 and S_m = (X_m - conj X_(W-m)) / 2i.
//! Columns run from phi = pi - pi / W downward, phi_c = pi - 2 pi (c + 1/2) / W, hence
//!
//! ```text
//! sum over c of f_c (cos(m phi_c) + i sin(m phi_c)) = u_m N_m,   u_m = (-1)^m exp(-i pi m / W),
//! sum over m of (A_m cos(m phi_c) + B_m sin(m phi_c))
//!     = Re sum over m of (A_m - i B_m) u_m exp(-2 pi i m c / W).
//! ```

use std::f64::consts::PI;
use std::ops::Range;

use pulp::{Simd, WithSimd};

use super::sums::{Group, ODD, PARTS};
use crate::f64x4::{F64x4, LANES, SimdLevel, load, store};
use crate::fft::{self, Complex4, Fft, cis};

/// A channel of a pixel: `f32` or `f64`.
pub trait Sample: Copy + Send + Sync + private::Sealed {
    /// The value of a black channel.
    const ZERO: Self;

    /// Converts to the precision of the sums.
    fn to_f64(self) -> f64;

    /// Converts from the precision of the sums, rounding to nearest.
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

/// An image whose rows are read a few at a time, such as one that is compressed.
pub trait ImageRows<T>: Sync {
    /// The number of pixels.
    fn pixel_count(&self) -> usize;

    /// The number of rows, from each of its multiples on, that cost no more to read than one of them.
    fn rows_at_once(&self) -> usize;

    /// Some rows of an image of `width` columns, which may be written into `scratch`.
    fn read_rows<'a>(
        &'a self,
        width: usize,
        rows: Range<usize>,
        scratch: &'a mut Vec<[T; 3]>,
    ) -> &'a [[T; 3]];
}

impl<T: Sample> ImageRows<T> for [[T; 3]] {
    fn pixel_count(&self) -> usize {
        self.len()
    }

    fn rows_at_once(&self) -> usize {
        1
    }

    fn read_rows<'a>(&'a self, width: usize, rows: Range<usize>, _: &'a mut Vec<[T; 3]>) -> &'a [[T; 3]] {
        &self[rows.start * width..rows.end * width]
    }
}

/// The Fourier transform of one grid's rows for m = 0 ..= degree.
pub(crate) struct Fourier {
    level: SimdLevel,
    width: usize,
    height: usize,
    fft: Fft,
    /// u_m of the module text, m = 0 ..= degree.
    turns: Vec<[f64; 2]>,
}

/// Memory of one task.
#[derive(Default)]
pub(crate) struct FourierScratch {
    /// Four pairs of rows as complex rows, by channel.
    rows: [Vec<Complex4>; 3],
    fft: Vec<Complex4>,
}

impl Fourier {
    pub(crate) fn new(level: SimdLevel, width: usize, height: usize, degree: usize) -> Self {
        let turns = (0..=degree)
            .map(|m| {
                let sign = if m % 2 == 0 { 1.0 } else { -1.0 };
                cis(-PI * (m % (2 * width)) as f64 / width as f64).map(|part| sign * part)
            })
            .collect();
        Self { level, width, height, fft: Fft::new(level, width), turns }
    }

    /// The number of groups of four pairs of rows.
    pub(crate) fn groups(&self) -> usize {
        self.height.div_ceil(2).div_ceil(LANES)
    }

    /// The northern rows of some groups and their mirrors, which [`Fourier::analyse`] needs.
    pub(crate) fn rows(&self, groups: Range<usize>) -> [Range<usize>; 2] {
        let north = groups.start * LANES..(groups.end * LANES).min(self.height.div_ceil(2));
        let south = self.height - north.end..self.height - north.start;
        [north, south]
    }

    /// Sums over the columns of the pairs 4 `group` .. 4 `group` + 4: `output[m]` gets E and O of every
    /// channel. `bands` are the first row and the pixels of a band in the north and one in the south that
    /// have these rows.
    pub(crate) fn analyse<T: Sample>(
        &self,
        group: usize,
        bands: [(usize, &[[T; 3]]); 2],
        scratch: &mut FourierScratch,
        output: &mut [Group],
    ) {
        let (width, height) = (self.width, self.height);
        // Past the last pair, and for the mirror of an odd height's equator, the factor of a row is 0.
        let pairs = [0, 1].map(|part| {
            let row = |lane: usize| {
                let north = group * LANES + lane;
                let counts = 2 * north + part < height;
                let north = north.min(height.div_ceil(2) - 1);
                let (first, pixels) = bands[part];
                let row = if part == 0 { north } else { height - 1 - north } - first;
                (&pixels[row * width..][..width], counts)
            };
            let rows: [_; LANES] = std::array::from_fn(row);
            (rows.map(|(row, _)| row), F64x4(rows.map(|(_, counts)| f64::from(u8::from(counts)))))
        });
        let FourierScratch { rows, fft } = scratch;
        rows.iter_mut().for_each(|rows| rows.resize(width, fft::ZERO));
        self.level.run(Interleave { pairs, rows });
        rows.iter_mut().for_each(|rows| self.fft.run(rows, fft));
        self.level.run(Separate { turns: &self.turns, rows, output });
    }

    /// The pixels of four pairs of rows from E and O of every m, as `input` gives them.
    ///
    /// `north` takes the northern rows from the first pair down, `south` their mirrors from the last pair
    /// down (without the equator, whose row is northern).
    pub(crate) fn synthesise<'a, T: Sample>(
        &self,
        input: impl Fn(usize) -> &'a Group,
        scratch: &mut FourierScratch,
        north: &mut [[T; 3]],
        south: &mut [[T; 3]],
    ) {
        let width = self.width;
        let FourierScratch { rows, fft } = scratch;
        for rows in rows.iter_mut() {
            rows.clear();
            rows.resize(width, fft::ZERO);
        }
        // Copied a few at a time: the groups lie far apart, and a short loop has more of them under way.
        for (block, turns) in self.turns.chunks(GROUPS).enumerate() {
            let first = block * GROUPS;
            let mut groups = [[F64x4::ZERO; PARTS]; GROUPS];
            (0..turns.len()).for_each(|i| groups[i] = *input(first + i));
            self.level.run(Join { first, turns, groups: &groups, rows });
        }
        rows.iter_mut().for_each(|rows| self.fft.run(rows, fft));
        let [red, green, blue] = rows;
        let store = |part: usize, lane: usize, columns: Range<usize>, pixels: &mut [[T; 3]]| {
            let rows = red[columns.clone()].iter().zip(&green[columns.clone()]).zip(&blue[columns.clone()]);
            for (rgb, ((red, green), blue)) in pixels[columns].iter_mut().zip(rows) {
                *rgb = [red, green, blue].map(|row| T::from_f64(row[part].0[lane]));
            }
        };
        for start in (0..width).step_by(COLUMNS) {
            let columns = start..(start + COLUMNS).min(width);
            for (lane, pixels) in north.chunks_exact_mut(width).enumerate() {
                store(0, lane, columns.clone(), pixels);
            }
            for (lane, pixels) in south.chunks_exact_mut(width).rev().enumerate() {
                store(1, lane, columns.clone(), pixels);
            }
        }
    }
}

/// Columns of four pairs of rows that stay in the first-level cache while they are gathered or spread.
const COLUMNS: usize = 64;

/// Groups that a synthesis reads at once.
const GROUPS: usize = 32;

/// Takes the pixels of four pairs of rows, each row times a factor, to complex rows.
struct Interleave<'a, T> {
    pairs: [([&'a [[T; 3]]; LANES], F64x4); 2],
    rows: &'a mut [Vec<Complex4>; 3],
}

impl<T: Sample> WithSimd for Interleave<'_, T> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { pairs, rows: [red, green, blue] } = self;
        for start in (0..red.len()).step_by(COLUMNS) {
            let columns = start..(start + COLUMNS).min(red.len());
            for (part, (pixels, factors)) in pairs.iter().enumerate() {
                let factors = load(simd, factors);
                let [p0, p1, p2, p3] = pixels.map(|row| &row[columns.clone()]);
                let rows = red[columns.clone()].iter_mut().zip(&mut green[columns.clone()]);
                let rows = rows.zip(&mut blue[columns.clone()]);
                let pixels = p0.iter().zip(p1).zip(p2.iter().zip(p3));
                for (((red, green), blue), ((a, b), (c, d))) in rows.zip(pixels) {
                    for (channel, value) in [red, green, blue].into_iter().enumerate() {
                        let lanes = F64x4([a, b, c, d].map(|pixel| pixel[channel].to_f64()));
                        store(simd, simd.mul_f64s(load(simd, &lanes), factors), &mut value[part]);
                    }
                }
            }
        }
    }
}

/// Takes the transforms of pairs of rows to E and O of every m.
struct Separate<'a> {
    turns: &'a [[f64; 2]],
    rows: &'a [Vec<Complex4>; 3],
    output: &'a mut [Group],
}

impl WithSimd for Separate<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { turns, rows, output } = self;
        for (channel, rows) in rows.iter().enumerate() {
            for (m, (parts, [x, y])) in output.iter_mut().zip(turns).enumerate() {
                let read = |column: usize| [0, 1].map(|part| load(simd, &rows[column][part]));
                let ([p_re, p_im], [q_re, q_im]) = (read(m), read(if m == 0 { 0 } else { rows.len() - m }));
                // With X_m = p and X_(W-m) = q: 2 N = p + conj q and 2 S = -i (p - conj q).
                let (n_re, n_im) = (simd.add_f64s(p_re, q_re), simd.sub_f64s(p_im, q_im));
                let (s_re, minus_s_im) = (simd.add_f64s(p_im, q_im), simd.sub_f64s(p_re, q_re));
                let even = (simd.add_f64s(n_re, s_re), simd.sub_f64s(n_im, minus_s_im));
                let odd = (simd.sub_f64s(n_re, s_re), simd.add_f64s(n_im, minus_s_im));
                let (u_re, u_im) = (simd.splat_f64s(0.5 * x), simd.splat_f64s(0.5 * y));
                for (part, (re, im)) in [(2 * channel, even), (ODD + 2 * channel, odd)] {
                    let product = simd.negate_mul_add_f64s(im, u_im, simd.mul_f64s(re, u_re));
                    store(simd, product, &mut parts[part]);
                    let product = simd.mul_add_f64s(re, u_im, simd.mul_f64s(im, u_re));
                    store(simd, product, &mut parts[part + 1]);
                }
            }
        }
    }
}

/// Takes E and O of some m, `first` and up, to the terms of pairs of rows.
struct Join<'a> {
    first: usize,
    turns: &'a [[f64; 2]],
    groups: &'a [Group],
    rows: &'a mut [Vec<Complex4>; 3],
}

impl WithSimd for Join<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { first, turns, groups, rows } = self;
        for (channel, rows) in rows.iter_mut().enumerate() {
            let width = rows.len();
            for (m, ([x, y], parts)) in (first..).zip(turns.iter().zip(groups)) {
                // The two halves of a real cosine, except at m = 0.
                let half = if m == 0 { 1.0 } else { 0.5 };
                let (u_re, u_im) = (simd.splat_f64s(half * x), simd.splat_f64s(half * y));
                let part = |part: usize| load(simd, &parts[part + 2 * channel]);
                let (e_re, e_im, o_re, o_im) = (part(0), part(1), part(ODD), part(ODD + 1));
                // (A - i B) u for N = E + O and S = E - O
                let turned = |a, b| {
                    let re = simd.mul_add_f64s(a, u_re, simd.mul_f64s(b, u_im));
                    let im = simd.negate_mul_add_f64s(b, u_re, simd.mul_f64s(a, u_im));
                    (re, im)
                };
                let (n_re, n_im) = turned(simd.add_f64s(e_re, o_re), simd.add_f64s(e_im, o_im));
                let (s_re, s_im) = turned(simd.sub_f64s(e_re, o_re), simd.sub_f64s(e_im, o_im));
                // N + i S and, for the mirrored frequency, conj N + i conj S.
                let near = [simd.sub_f64s(n_re, s_im), simd.add_f64s(n_im, s_re)];
                let far = [simd.add_f64s(n_re, s_im), simd.sub_f64s(s_re, n_im)];
                // Coarser than the function, frequencies fold onto each other: terms are added.
                let column = m % width;
                let targets = [(column, near), ((width - column) % width, far)];
                for (column, vector) in targets.into_iter().take(if m == 0 { 1 } else { 2 }) {
                    for (value, part) in rows[column].iter_mut().zip(vector) {
                        store(simd, simd.add_f64s(load(simd, value), part), value);
                    }
                }
            }
        }
    }
}
