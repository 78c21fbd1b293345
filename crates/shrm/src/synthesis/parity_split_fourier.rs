//! Fourier series of many values at once, at four angles that mirror each other.
//!
//! A real series sum over m of a_m cos(m x) + b_m sin(m x) falls into four parts: cosines and sines of even
//! and of odd order. At -x the sines change sign, at pi - x the odd cosines and the even sines, and at x + pi
//! all odd ones. So four partial sums at one angle give the values at four. Each is a product of matrices,
//! [angles, orders] times [orders, values], and is computed in tiles that stay in registers.

use pulp::Simd;

/// Where the orders of a series of one degree lie: even cosines, odd cosines, even sines, odd sines.
#[derive(Clone, Copy, Debug)]
pub(super) struct ParitySplitFourier {
    /// Where each part starts, and the end.
    starts: [usize; 5],
}

impl ParitySplitFourier {
    pub(super) fn new(degree: usize) -> Self {
        let lengths = [degree / 2 + 1, degree.div_ceil(2), degree / 2, degree.div_ceil(2)];
        let mut starts = [0; 5];
        for part in 0..4 {
            starts[part + 1] = starts[part] + lengths[part];
        }
        Self { starts }
    }

    /// The number of terms: 2 degree + 1.
    pub(super) fn len(&self) -> usize {
        self.starts[4]
    }

    /// The place of cos(m x).
    pub(super) fn cosine(&self, m: usize) -> usize {
        self.starts[m % 2] + m / 2
    }

    /// The place of sin(m x), m > 0.
    pub(super) fn sine(&self, m: usize) -> usize {
        self.starts[2 + m % 2] + (m - 1) / 2
    }

    /// All cosines and sines at an angle.
    pub(super) fn angle(&self, (sine, cosine): (f64, f64), terms: &mut [f64]) {
        let (mut x, mut y) = (1.0, 0.0);
        terms[0] = 1.0;
        for m in 1..=self.len() / 2 {
            (x, y) = (x * cosine - y * sine, y * cosine + x * sine);
            terms[self.cosine(m)] = x;
            terms[self.sine(m)] = y;
        }
    }

    /// The four partial sums: `angles` [n, len], `series` [len, values] to `sums` [n, 4, values].
    #[inline(always)]
    pub(super) fn sum<S: Simd>(
        &self,
        simd: S,
        angles: &[f64],
        series: &[f64],
        values: usize,
        sums: &mut [f64],
    ) {
        let (series, _) = S::as_simd_f64s(series);
        let (sums, _) = S::as_mut_simd_f64s(sums);
        let vectors = values / S::F64_LANES;
        let product = Product { fourier: *self, angles, series, vectors };
        let mut first = 0;
        while first < vectors {
            first += match vectors - first {
                1 => product.strip::<S, 4, 1>(simd, first, sums),
                2 => product.strip::<S, 4, 2>(simd, first, sums),
                3 => product.strip::<S, 4, 3>(simd, first, sums),
                _ => product.strip::<S, 2, 4>(simd, first, sums),
            };
        }
    }
}

/// A product of matrices, in vectors.
struct Product<'a, V> {
    fourier: ParitySplitFourier,
    angles: &'a [f64],
    series: &'a [V],
    /// Vectors in a row of `series`.
    vectors: usize,
}

impl<V: Copy> Product<'_, V> {
    /// The sums of `WIDE` vectors from `first` on, `TALL` angles at a time; gives `WIDE`.
    #[inline(always)]
    fn strip<S: Simd<f64s = V>, const TALL: usize, const WIDE: usize>(
        &self,
        simd: S,
        first: usize,
        sums: &mut [V],
    ) -> usize {
        let count = self.angles.len() / self.fourier.len();
        let whole = count / TALL * TALL;
        for part in 0..4 {
            for angle in (0..whole).step_by(TALL) {
                self.tile::<S, TALL, WIDE>(simd, first, part, angle, sums);
            }
            for angle in whole..count {
                self.tile::<S, 1, WIDE>(simd, first, part, angle, sums);
            }
        }
        WIDE
    }

    #[inline(always)]
    fn tile<S: Simd<f64s = V>, const TALL: usize, const WIDE: usize>(
        &self,
        simd: S,
        first: usize,
        part: usize,
        angle: usize,
        sums: &mut [V],
    ) {
        let (start, end) = (self.fourier.starts[part], self.fourier.starts[part + 1]);
        let len = self.fourier.len();
        let angles: [&[f64]; TALL] = std::array::from_fn(|i| &self.angles[(angle + i) * len..][start..end]);
        let mut total = [[simd.splat_f64s(0.0); WIDE]; TALL];
        for order in 0..end - start {
            let row = &self.series[(start + order) * self.vectors + first..][..WIDE];
            for i in 0..TALL {
                let factor = simd.splat_f64s(angles[i][order]);
                for j in 0..WIDE {
                    total[i][j] = simd.mul_add_f64s(factor, row[j], total[i][j]);
                }
            }
        }
        for i in 0..TALL {
            let place = ((angle + i) * 4 + part) * self.vectors + first;
            sums[place..place + WIDE].copy_from_slice(&total[i]);
        }
    }
}

/// The values at x, pi - x, -x and x + pi from the four partial sums, each with as many values.
#[inline(always)]
pub(super) fn mirror(sums: &[f64], values: &mut [f64]) {
    let len = sums.len() / 4;
    let (ce, rest) = sums.split_at(len);
    let (co, rest) = rest.split_at(len);
    let (se, so) = rest.split_at(len);
    let (x, rest) = values.split_at_mut(len);
    let (across, rest) = rest.split_at_mut(len);
    let (below, opposite) = rest.split_at_mut(len);
    let so = &so[..len];
    let opposite = &mut opposite[..len];
    for i in 0..len {
        let (even, odd) = (ce[i] + so[i], co[i] + se[i]);
        x[i] = even + odd;
        across[i] = even - odd;
        let (even, odd) = (ce[i] - so[i], co[i] - se[i]);
        below[i] = even + odd;
        opposite[i] = even - odd;
    }
}
