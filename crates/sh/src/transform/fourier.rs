//! Along the rows: pixels to Fourier coefficients of phi and back, eight pairs of rows at a time and in the
//! precision of the pixels.
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
//!
//! A row with many more columns than twice the degree is split: with c = a + d b, an FFT of W / d columns
//! runs over b for each a < d, and the factor exp(-2 pi i m a / W) joins u_m. So frequencies past the degree
//! are not computed.

use std::f64::consts::PI;
use std::ops::Range;

use pulp::{Simd, WithSimd};

use super::precision::Precision;
use super::sums::{Group, ODD};
use crate::f64x4::{Lanes, SimdLevel, WithLanes};
use crate::fft::{Complex, Fft, cis};
use crate::vector::{LANES, Vector8};

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

    /// The sums of the squares of some rows, each channel from left to right. An image that keeps them need
    /// not read the rows again.
    fn squares_of_rows(&self, width: usize, rows: Range<usize>, scratch: &mut Vec<[T; 3]>) -> Vec<[f64; 3]>
    where
        T: Precision,
    {
        let squares = |row: &[[T; 3]]| {
            let mut sum = [0.0; 3];
            for pixel in row {
                for channel in 0..3 {
                    let value = pixel[channel].to_f64();
                    sum[channel] += value * value;
                }
            }
            sum
        };
        self.read_rows(width, rows, scratch).chunks_exact(width).map(squares).collect()
    }
}

impl<T: Precision> ImageRows<T> for &[[T; 3]] {
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
pub(crate) struct Fourier<T: Precision> {
    level: SimdLevel,
    width: usize,
    height: usize,
    /// The transform of each of the d parts of a row.
    fft: Fft<Vector8<T>>,
    /// u_m exp(-2 pi i m a / W) / 2 for each part a: m = 0 ..= degree.
    turns: Vec<Vec<[T; 2]>>,
}

/// Memory of one task: three channels of each column or frequency.
#[derive(Default)]
pub(crate) struct FourierScratch<T: Precision> {
    /// Eight pairs of rows.
    rows: Vec<Complex<Vector8<T>>>,
    /// One part of them.
    part: Vec<Complex<Vector8<T>>>,
    fft: Vec<Complex<Vector8<T>>>,
    groups: Vec<Group<T>>,
    /// Stands for rows that do not exist.
    black: Vec<[T; 3]>,
}

/// Rows are split into this number of parts at least: into fewer, what is saved is less than it costs.
const FEWEST_PARTS: usize = 4;

/// The channels of a pixel.
const CHANNELS: usize = 3;

/// The number of parts into which rows are split.
fn parts(width: usize, degree: usize) -> usize {
    let enough = |parts: &usize| width.is_multiple_of(*parts) && width / parts > 2 * degree.max(2);
    (FEWEST_PARTS..=width).rev().find(enough).unwrap_or(1)
}

impl<T: Precision> Fourier<T> {
    pub(crate) fn new(level: SimdLevel, width: usize, height: usize, degree: usize) -> Self {
        let parts = parts(width, degree);
        let turn = |part: usize, m: usize| {
            let sign = if m.is_multiple_of(2) { 0.5 } else { -0.5 };
            cis(-PI * (m * (2 * part + 1) % (2 * width)) as f64 / width as f64)
                .map(|value| T::from_f64(sign * value))
        };
        let turns = (0..parts).map(|part| (0..=degree).map(|m| turn(part, m)).collect()).collect();
        Self { level, width, height, fft: Fft::new(level, width / parts), turns }
    }

    /// The number of groups of eight pairs of rows.
    pub(crate) fn groups(&self) -> usize {
        self.height.div_ceil(2).div_ceil(LANES)
    }

    /// The northern rows of some groups and their mirrors, which [`Fourier::analyse`] needs.
    pub(crate) fn rows(&self, groups: Range<usize>) -> [Range<usize>; 2] {
        let north = groups.start * LANES..(groups.end * LANES).min(self.height.div_ceil(2));
        let south = self.height - north.end..self.height - north.start;
        [north, south]
    }

    /// Sums over the columns of the pairs 8 `group` .. 8 `group` + 8: `output[m]` gets E and O of every
    /// channel. `bands` are the first row and the pixels of a band in the north and one in the south that
    /// have these rows.
    pub(crate) fn analyse(
        &self,
        group: usize,
        bands: [(usize, &[[T; 3]]); 2],
        scratch: &mut FourierScratch<T>,
        output: &mut [Group<T>],
    ) {
        let (width, height, parts) = (self.width, self.height, self.turns.len());
        let FourierScratch { rows, part: part_of_rows, fft, black, .. } = scratch;
        black.resize(width, [T::ZERO; 3]);
        rows.resize(CHANNELS * width, [Vector8::ZERO; 2]);
        // Past the last pair, and as the mirror of an odd height's equator, rows are black.
        let pairs = [0, 1].map(|part| {
            std::array::from_fn(|lane| {
                let north = group * LANES + lane;
                let row = if part == 0 { north } else { (height - 1).wrapping_sub(north) };
                let counts = 2 * north + part < height;
                let (first, pixels) = bands[part];
                if !counts {
                    return black.as_flattened();
                }
                pixels[(row - first) * width..][..width].as_flattened()
            })
        });
        self.level.run_lanes(Interleave { pairs, rows });
        for (part, turns) in self.turns.iter().enumerate() {
            let rows = if parts == 1 {
                &mut *rows
            } else {
                let columns = rows.chunks_exact(CHANNELS).skip(part).step_by(parts);
                part_of_rows.clear();
                columns.for_each(|column| part_of_rows.extend_from_slice(column));
                &mut *part_of_rows
            };
            self.fft.run(rows, fft);
            self.level.run(Separate { turns, rows, output, first: part == 0, last: part + 1 == parts });
        }
    }

    /// The pixels of eight pairs of rows from E and O of every m, as `input` gives them.
    ///
    /// `north` takes the northern rows from the first pair down, `south` their mirrors from the last pair
    /// down (without the equator, whose row is northern).
    pub(crate) fn synthesise<'a>(
        &self,
        input: impl Fn(usize) -> &'a Group<T>,
        scratch: &mut FourierScratch<T>,
        north: &mut [[T; 3]],
        south: &mut [[T; 3]],
    ) {
        let (width, parts) = (self.width, self.turns.len());
        let FourierScratch { rows, part: part_of_rows, fft, groups, .. } = scratch;
        groups.clear();
        groups.extend((0..self.turns[0].len()).map(|m| *input(m)));
        rows.resize(CHANNELS * width, [Vector8::ZERO; 2]);
        for (part, turns) in self.turns.iter().enumerate() {
            if parts == 1 {
                self.level.run(Join { turns, groups, rows });
                self.fft.run(rows, fft);
            } else {
                part_of_rows.resize(CHANNELS * width / parts, [Vector8::ZERO; 2]);
                self.level.run(Join { turns, groups, rows: part_of_rows });
                self.fft.run(part_of_rows, fft);
                let columns = rows.chunks_exact_mut(CHANNELS).skip(part).step_by(parts);
                for (to, from) in columns.zip(part_of_rows.chunks_exact(CHANNELS)) {
                    to.copy_from_slice(from);
                }
            }
        }
        let mut lines = [(); 2].map(|()| std::array::from_fn(|_| Default::default()));
        for (line, pixels) in lines[0].iter_mut().zip(north.chunks_exact_mut(width)) {
            *line = pixels.as_flattened_mut();
        }
        for (line, pixels) in lines[1].iter_mut().zip(south.chunks_exact_mut(width).rev()) {
            *line = pixels.as_flattened_mut();
        }
        self.level.run_lanes(Spread { rows, pairs: lines });
    }
}

/// Takes the channels of eight pairs of rows to complex rows.
struct Interleave<'a, T> {
    pairs: [[&'a [T]; LANES]; 2],
    rows: &'a mut [Complex<Vector8<T>>],
}

impl<T: Precision> WithLanes for Interleave<'_, T> {
    type Output = ();

    #[inline(always)]
    fn with_lanes<S: Lanes>(self, simd: S) {
        let Self { pairs, rows } = self;
        let (tiles, rest) = rows.as_chunks_mut::<LANES>();
        let whole = LANES * tiles.len();
        for (part, lines) in pairs.iter().enumerate() {
            for (i, rows) in (whole..).zip(&mut *rest) {
                rows[part] = Vector8(lines.map(|line| line[i]));
            }
        }
        let lines = pairs.map(|lines| lines.map(|line| line.as_chunks::<LANES>().0));
        for (i, rows) in tiles.iter_mut().enumerate() {
            for (part, lines) in lines.iter().enumerate() {
                let [a, b, c, d, e, f, g, h] = lines;
                let tile = [a[i], b[i], c[i], d[i], e[i], f[i], g[i], h[i]];
                let tile = T::transpose(simd, tile);
                for j in 0..LANES {
                    rows[j][part].0 = tile[j];
                }
            }
        }
    }
}

/// Takes complex rows to the channels of eight pairs of rows; those that do not exist are empty.
struct Spread<'a, T> {
    rows: &'a [Complex<Vector8<T>>],
    pairs: [[&'a mut [T]; LANES]; 2],
}

impl<T: Precision> WithLanes for Spread<'_, T> {
    type Output = ();

    #[inline(always)]
    fn with_lanes<S: Lanes>(self, simd: S) {
        let Self { rows, mut pairs } = self;
        let (tiles, rest) = rows.as_chunks::<LANES>();
        let whole = LANES * tiles.len();
        for (part, lines) in pairs.iter_mut().enumerate() {
            for (lane, line) in lines.iter_mut().enumerate().filter(|(_, line)| !line.is_empty()) {
                for (to, rows) in line[whole..].iter_mut().zip(rest) {
                    *to = rows[part].0[lane];
                }
            }
        }
        let mut lines = pairs.map(|lines| lines.map(|line| line.as_chunks_mut::<LANES>().0));
        for (i, rows) in tiles.iter().enumerate() {
            for (part, lines) in lines.iter_mut().enumerate() {
                let mut tile = [[T::ZERO; LANES]; LANES];
                for j in 0..LANES {
                    tile[j] = rows[j][part].0;
                }
                let tile = T::transpose(simd, tile);
                for lane in 0..LANES {
                    if let Some(to) = lines[lane].get_mut(i) {
                        *to = tile[lane];
                    }
                }
            }
        }
    }
}

/// Adds the transforms of one part of pairs of rows to E and O of every m.
struct Separate<'a, T> {
    turns: &'a [[T; 2]],
    rows: &'a [Complex<Vector8<T>>],
    output: &'a mut [Group<T>],
    first: bool,
    last: bool,
}

impl<T: Precision> WithSimd for Separate<'_, T> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { turns, rows, output, first, last } = self;
        for (m, (parts, [x, y])) in output.iter_mut().zip(turns).enumerate() {
            let near = &rows[CHANNELS * m..][..CHANNELS];
            let far = if m == 0 { near } else { &rows[rows.len() - CHANNELS * m..][..CHANNELS] };
            for r in 0..LANES / T::PER_REGISTER {
                let (u_re, u_im) = (T::splat(simd, *x), T::splat(simd, *y));
                for channel in 0..CHANNELS {
                    let at = [0, 1, ODD, ODD + 1].map(|part| part + 2 * channel);
                    let mut sums = [T::splat(simd, T::ZERO); 4];
                    if !first {
                        for (sum, part) in sums.iter_mut().zip(at) {
                            *sum = parts[part].load(simd, r);
                        }
                    }
                    // The turned sums of p = X_m and of conj q, q = X_(W-m).
                    let [p, q] = [near, far].map(|rows| &rows[channel]);
                    let p = [p[0].load(simd, r), p[1].load(simd, r)];
                    let q = [q[0].load(simd, r), q[1].load(simd, r)];
                    let p_re = T::negate_mul_add(simd, p[1], u_im, T::mul_add(simd, p[0], u_re, sums[0]));
                    let p_im = T::mul_add(simd, p[1], u_re, T::mul_add(simd, p[0], u_im, sums[1]));
                    let q_re = T::mul_add(simd, q[1], u_im, T::mul_add(simd, q[0], u_re, sums[2]));
                    let q_im = T::negate_mul_add(simd, q[1], u_re, T::mul_add(simd, q[0], u_im, sums[3]));
                    let mut values = [p_re, p_im, q_re, q_im];
                    if last {
                        // N = p + conj q, S = -i (p - conj q)
                        let (n_re, n_im) = (T::add(simd, p_re, q_re), T::add(simd, p_im, q_im));
                        let (s_re, minus_s_im) = (T::sub(simd, p_im, q_im), T::sub(simd, p_re, q_re));
                        values = [
                            T::add(simd, n_re, s_re),
                            T::sub(simd, n_im, minus_s_im),
                            T::sub(simd, n_re, s_re),
                            T::add(simd, n_im, minus_s_im),
                        ];
                    }
                    for (part, value) in at.into_iter().zip(values) {
                        parts[part].store(simd, value, r);
                    }
                }
            }
        }
    }
}

/// Takes E and O of every m to the terms of one part of pairs of rows.
struct Join<'a, T> {
    turns: &'a [[T; 2]],
    groups: &'a [Group<T>],
    rows: &'a mut [Complex<Vector8<T>>],
}

impl<T: Precision> WithSimd for Join<'_, T> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { turns, groups, rows } = self;
        let width = rows.len() / CHANNELS;
        // Coarser than the function, frequencies fold onto each other: terms are added.
        let fold = 2 * (turns.len() - 1) >= width;
        let unused = if fold { 0..width } else { turns.len()..width + 1 - turns.len() };
        rows[CHANNELS * unused.start..CHANNELS * unused.end].fill([Vector8::ZERO; 2]);
        for (m, ([x, y], parts)) in turns.iter().zip(groups).enumerate() {
            let column = m % width;
            let mirror = (width - column) % width;
            for r in 0..LANES / T::PER_REGISTER {
                let (u_re, u_im) = (T::splat(simd, *x), T::splat(simd, *y));
                for channel in 0..CHANNELS {
                    let even = [&parts[2 * channel], &parts[2 * channel + 1]];
                    let odd = [&parts[ODD + 2 * channel], &parts[ODD + 2 * channel + 1]];
                    let even = [even[0].load(simd, r), even[1].load(simd, r)];
                    let odd = [odd[0].load(simd, r), odd[1].load(simd, r)];
                    // (A - i B) u / 2 for N = E + O and S = E - O
                    let n = [T::add(simd, even[0], odd[0]), T::add(simd, even[1], odd[1])];
                    let s = [T::sub(simd, even[0], odd[0]), T::sub(simd, even[1], odd[1])];
                    let [n_re, n_im] = turned::<T, S>(simd, n, [u_re, u_im]);
                    let [s_re, s_im] = turned::<T, S>(simd, s, [u_re, u_im]);
                    // N + i S and, for the mirrored frequency, conj N + i conj S: the halves of a cosine.
                    let near = [T::sub(simd, n_re, s_im), T::add(simd, n_im, s_re)];
                    let far = [T::add(simd, n_re, s_im), T::sub(simd, s_re, n_im)];
                    for (column, vector, is_fresh) in [(column, near, true), (mirror, far, m > 0)] {
                        for (value, part) in rows[CHANNELS * column + channel].iter_mut().zip(vector) {
                            let add = fold || !is_fresh;
                            let sum = if add { T::add(simd, value.load(simd, r), part) } else { part };
                            value.store(simd, sum, r);
                        }
                    }
                }
            }
        }
    }
}

/// (A - i B) u
#[inline(always)]
fn turned<T: Precision, S: Simd>(
    simd: S,
    [a, b]: [T::Register<S>; 2],
    u: [T::Register<S>; 2],
) -> [T::Register<S>; 2] {
    [
        T::mul_add(simd, a, u[0], T::mul(simd, b, u[1])),
        T::negate_mul_add(simd, b, u[0], T::mul(simd, a, u[1])),
    ]
}
