//! Fourier series of many values at once, at four angles that mirror each other.
//!
//! A real series sum over m of a_m cos(m x) + b_m sin(m x) falls into four parts: cosines and sines of even
//! and of odd order. At -x the sines change sign, at pi - x the odd cosines and the even sines, and at x + pi
//! all odd ones. So four partial sums at one angle give the values at four. Each is a product of matrices,
//! [angles, orders] times [orders, values].

use pulp::Simd;

use super::product::Product;

/// Where the orders of a series of one degree lie: even cosines, odd cosines, even sines, odd sines.
#[derive(Clone, Copy, Debug)]
pub(super) struct ParitySplitFourier {
    /// Where each part starts, and the end.
    starts: [usize; 5],
}

/// The terms of several series, one term of all of them after the other.
#[derive(Clone, Copy)]
pub(super) struct StridedTerms<'a> {
    /// The values of the first term, then, `step` values on, those of the second.
    pub(super) values: &'a [f32],
    /// The number of values from one term to the next, which is at least the number of series.
    pub(super) step: usize,
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
    pub(super) fn angle(&self, (sine, cosine): (f64, f64), terms: &mut [f32]) {
        let (mut x, mut y) = (1.0, 0.0);
        terms[0] = 1.0;
        for m in 1..=self.len() / 2 {
            (x, y) = (x * cosine - y * sine, y * cosine + x * sine);
            terms[self.cosine(m)] = x as f32;
            terms[self.sine(m)] = y as f32;
        }
    }

    /// The four partial sums: `angles` [n, len], `series` [len, values] to `sums` [n, 4, values].
    #[inline(always)]
    pub(super) fn sum<S: Simd>(
        &self,
        simd: S,
        angles: &[f32],
        series: StridedTerms<'_>,
        values: usize,
        sums: &mut [f32],
    ) {
        let (terms, _) = S::as_simd_f32s(series.values);
        let (sums, _) = S::as_mut_simd_f32s(sums);
        let (vectors, right_step) = (values / S::F32_LANES, series.step / S::F32_LANES);
        for (part, ends) in self.starts.windows(2).enumerate() {
            let inner = ends[0]..ends[1];
            // A part may be empty.
            let right = terms.get(inner.start * right_step..).unwrap_or_default();
            let product = Product { left: angles, stride: self.len(), inner, right, right_step, vectors };
            product.write(simd, &mut sums[part * vectors..], 4 * vectors);
        }
    }
}

/// The values at x, pi - x, -x and x + pi from the four partial sums, each with as many values.
#[inline(always)]
pub(super) fn mirror(sums: &[f32], values: &mut [f32]) {
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
