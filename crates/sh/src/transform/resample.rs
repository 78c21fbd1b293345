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
//! one circle: their sum is split again by parity. Eight such circles go together, one in each lane.

use std::f64::consts::PI;

use pulp::Simd;

use super::precision::Precision;
use super::sums::{Group, ODD, PARTS};
use crate::f64x4::{Lanes, SimdLevel, WithLanes};
use crate::fft::{Complex, Fft, Multiply, cis};
use crate::quadrature;
use crate::vector::{LANES, Vector8};

/// The orders of one task: an even one and the next in each lane.
pub(super) const ORDERS: usize = 2 * LANES;

/// The channels of a pixel, which are interleaved on a circle.
const CHANNELS: usize = 3;

/// The operator M for one number of rows.
pub(super) struct Resample<T: Precision> {
    level: SimdLevel,
    height: usize,
    fft: Fft<Vector8<T>>,
    /// Clenshaw-Curtis weights of our northern rows (the equator included).
    rows: Vec<T>,
    /// The Clenshaw-Curtis weights of the nodes between our rows, around the circle; the scale of the four
    /// Fourier transforms and of the circle's two halves included.
    between: Vec<[T; 2]>,
    /// The shift by half a sample toward theta = 0, by frequency; zero at the highest.
    shift: Vec<[T; 2]>,
}

/// The memory of one task.
#[derive(Default)]
pub(super) struct ResampleScratch<T: Precision> {
    /// The circles of each channel, interleaved.
    circle: Vec<Complex<Vector8<T>>>,
    fft: Vec<Complex<Vector8<T>>>,
}

impl<T: Precision> Resample<T> {
    /// Prepares M for `height` rows; `scale` multiplies the result.
    pub(super) fn new(level: SimdLevel, height: usize, scale: f64) -> Self {
        let samples = 2 * height;
        let weights = quadrature::clenshaw_curtis(samples);
        let fft_scale = 1.0 / (samples * samples) as f64;
        let between = (0..samples)
            .map(|i| {
                // An inner node stands on both halves of the circle, so it counts half on each; a sum over
                // our rows is half of that over the circle. The poles stand there once.
                let node = i.min(samples - i);
                let share = if node == 0 || node == height { 2.0 } else { 1.0 };
                // A quarter, since E and O come and go as sums of two values.
                [T::from_f64(0.25 * scale * share * fft_scale * weights[2 * node]), T::ZERO]
            })
            .collect();
        let shift = (0..samples)
            .map(|k| {
                let frequency = if k < height { k as f64 } else { k as f64 - samples as f64 };
                let shift = if k == height { [0.0; 2] } else { cis(-PI * frequency / samples as f64) };
                shift.map(T::from_f64)
            })
            .collect();
        let rows = (0..height.div_ceil(2)).map(|j| T::from_f64(scale * weights[2 * j + 1])).collect();
        Self { level, height, fft: Fft::new(level, samples), rows, between, shift }
    }

    /// Applies M to the columns of `orders` orders from an even one on: E and O of the first row at
    /// `input[order]`, of the next ones `stride` groups on. They come out one order after the other.
    pub(super) fn apply(
        &self,
        input: &[Group<T>],
        orders: usize,
        stride: usize,
        columns: &mut Vec<Group<T>>,
        scratch: &mut ResampleScratch<T>,
    ) {
        let groups = self.rows.len().div_ceil(LANES);
        columns.resize(ORDERS * groups, [Vector8::ZERO; PARTS]);
        for (m, column) in columns.chunks_exact_mut(groups).enumerate() {
            if m < orders {
                let input = input[m..].iter().step_by(stride);
                column.iter_mut().zip(input).for_each(|(to, from)| *to = *from);
            } else {
                column.fill([Vector8::ZERO; PARTS]);
            }
        }
        let ResampleScratch { circle, fft } = scratch;
        circle.resize(CHANNELS * 2 * self.height, [Vector8::ZERO; 2]);
        self.level.run_lanes(Close { height: self.height, columns, circle });
        // An inverse transform is a transform in reverse. Two of them cancel, because the weights are the
        // same in reverse and the shift is its conjugate.
        for factors in [&self.shift, &self.between, &self.shift] {
            self.fft.run(circle, fft);
            self.level.run(Multiply { data: circle, factors, count: CHANNELS });
        }
        self.fft.run(circle, fft);
        self.level.run_lanes(Open { resample: self, circle, columns });
    }
}

/// Eight values of each of eight orders or rows.
type Tile<T> = [[T; LANES]; LANES];

/// Rows of eight pairs: on the circle, the northern row, its mirror on the other half, and the same of the
/// southern one.
struct Places {
    height: usize,
    group: usize,
}

impl Places {
    #[inline(always)]
    fn at(&self, lane: usize) -> [Option<usize>; 4] {
        let north = self.group * LANES + lane;
        let (has_north, has_south) = (2 * north < self.height, 2 * north + 1 < self.height);
        [
            has_north.then_some(north),
            has_north.then(|| 2 * self.height - 1 - north),
            has_south.then(|| self.height - 1 - north),
            has_south.then(|| self.height + north),
        ]
    }
}

/// Takes twice the columns of even and odd orders to circles.
struct Close<'a, T> {
    height: usize,
    columns: &'a [Group<T>],
    circle: &'a mut [Complex<Vector8<T>>],
}

impl<T: Precision> WithLanes for Close<'_, T> {
    type Output = ();

    #[inline(always)]
    fn with_lanes<S: Lanes>(self, simd: S) {
        let Self { height, columns, circle } = self;
        let groups = columns.len() / ORDERS;
        for group in 0..groups {
            let places = Places { height, group };
            for part in 0..ODD {
                let mut tiles = [[[T::ZERO; LANES]; LANES]; 4];
                for pair in 0..LANES {
                    let [even_m, odd_m] = [0, 1].map(|odd| &columns[(2 * pair + odd) * groups + group]);
                    for r in 0..LANES / T::PER_REGISTER {
                        let (even_e, even_o) = load_parts(simd, even_m, part, r);
                        let (odd_e, odd_o) = load_parts(simd, odd_m, part, r);
                        let (even_n, even_s) = (T::add(simd, even_e, even_o), T::sub(simd, even_e, even_o));
                        let (odd_n, odd_s) = (T::add(simd, odd_e, odd_o), T::sub(simd, odd_e, odd_o));
                        let values = [
                            T::add(simd, even_n, odd_n),
                            T::sub(simd, even_n, odd_n),
                            T::add(simd, even_s, odd_s),
                            T::sub(simd, even_s, odd_s),
                        ];
                        for (tile, value) in tiles.iter_mut().zip(values) {
                            T::store(simd, value, &mut tile[pair], r);
                        }
                    }
                }
                let tiles = transposed(simd, tiles);
                for lane in 0..LANES {
                    for (tile, place) in tiles.iter().zip(places.at(lane)) {
                        if let Some(place) = place {
                            circle[CHANNELS * place + part / 2][part % 2] = Vector8(tile[lane]);
                        }
                    }
                }
            }
        }
    }
}

/// Four tables with rows and columns exchanged.
#[inline(always)]
fn transposed<T: Precision, S: Lanes>(simd: S, [a, b, c, d]: [Tile<T>; 4]) -> [Tile<T>; 4] {
    [T::transpose(simd, a), T::transpose(simd, b), T::transpose(simd, c), T::transpose(simd, d)]
}

#[inline(always)]
fn load_parts<T: Precision, S: Simd>(
    simd: S,
    group: &Group<T>,
    part: usize,
    r: usize,
) -> (T::Register<S>, T::Register<S>) {
    (group[part].load(simd, r), group[ODD + part].load(simd, r))
}

/// Takes circles back to columns: weights times these, and what the nodes between the rows add.
struct Open<'a, T: Precision> {
    resample: &'a Resample<T>,
    circle: &'a [Complex<Vector8<T>>],
    columns: &'a mut [Group<T>],
}

impl<T: Precision> WithLanes for Open<'_, T> {
    type Output = ();

    #[inline(always)]
    fn with_lanes<S: Lanes>(self, simd: S) {
        let Self { resample: Resample { height, rows, .. }, circle, columns } = self;
        let groups = columns.len() / ORDERS;
        for group in 0..groups {
            let places = Places { height: *height, group };
            let weights = Vector8::from_fn(|lane| rows.get(group * LANES + lane).copied().unwrap_or(T::ZERO));
            for part in 0..ODD {
                let mut tiles = [[[T::ZERO; LANES]; LANES]; 4];
                for lane in 0..LANES {
                    for (tile, place) in tiles.iter_mut().zip(places.at(lane)) {
                        if let Some(place) = place {
                            tile[lane] = circle[CHANNELS * place + part / 2][part % 2].0;
                        }
                    }
                }
                let tiles = transposed(simd, tiles);
                for pair in 0..LANES {
                    for r in 0..LANES / T::PER_REGISTER {
                        let (n, other_n) =
                            (T::load(simd, &tiles[0][pair], r), T::load(simd, &tiles[1][pair], r));
                        let (s, other_s) =
                            (T::load(simd, &tiles[2][pair], r), T::load(simd, &tiles[3][pair], r));
                        let even = [T::add(simd, n, other_n), T::add(simd, s, other_s)];
                        let odd = [T::sub(simd, n, other_n), T::sub(simd, s, other_s)];
                        for (m, [n, s]) in [even, odd].into_iter().enumerate() {
                            let column = &mut columns[(2 * pair + m) * groups + group];
                            let between = [T::add(simd, n, s), T::sub(simd, n, s)];
                            for (part, between) in [part, ODD + part].into_iter().zip(between) {
                                let value = column[part].load(simd, r);
                                let weight = weights.load(simd, r);
                                let sum = T::mul_add(simd, value, weight, between);
                                column[part].store(simd, sum, r);
                            }
                        }
                    }
                }
            }
        }
    }
}
