//! Products of matrices in tiles that stay in registers.

use std::ops::Range;

use pulp::Simd;

/// Some columns of a matrix times the rows of another, in vectors.
pub(super) struct Product<'a, V> {
    /// Rows of `stride` numbers, of which the columns `inner` are used.
    pub(super) left: &'a [f32],
    pub(super) stride: usize,
    pub(super) inner: Range<usize>,
    /// A row of `vectors` vectors for each of `inner`, `right_step` vectors after the one before it.
    pub(super) right: &'a [V],
    pub(super) right_step: usize,
    pub(super) vectors: usize,
}

impl<V: Copy> Product<'_, V> {
    /// Writes each row of the product to `out`, `step` vectors after the one before it.
    #[inline(always)]
    pub(super) fn write<S: Simd<f32s = V>>(&self, simd: S, out: &mut [V], step: usize) {
        let mut first = 0;
        while first < self.vectors {
            first += match self.vectors - first {
                1 => self.strip::<S, 4, 1>(simd, first, out, step),
                2 => self.strip::<S, 4, 2>(simd, first, out, step),
                3 => self.strip::<S, 4, 3>(simd, first, out, step),
                _ => self.strip::<S, 2, 4>(simd, first, out, step),
            };
        }
    }

    /// `WIDE` vectors of all rows from `first` on, `TALL` rows at a time; gives `WIDE`.
    #[inline(always)]
    fn strip<S: Simd<f32s = V>, const TALL: usize, const WIDE: usize>(
        &self,
        simd: S,
        first: usize,
        out: &mut [V],
        step: usize,
    ) -> usize {
        let count = self.left.len() / self.stride;
        let whole = count / TALL * TALL;
        for row in (0..whole).step_by(TALL) {
            self.tile::<S, TALL, WIDE>(simd, [row, first], out, step);
        }
        for row in whole..count {
            self.tile::<S, 1, WIDE>(simd, [row, first], out, step);
        }
        WIDE
    }

    #[inline(always)]
    fn tile<S: Simd<f32s = V>, const TALL: usize, const WIDE: usize>(
        &self,
        simd: S,
        [row, first]: [usize; 2],
        out: &mut [V],
        step: usize,
    ) {
        let count = self.inner.len();
        let left: [&[f32]; TALL] =
            std::array::from_fn(|i| &self.left[(row + i) * self.stride + self.inner.start..][..count]);
        let mut total = [[simd.splat_f32s(0.0); WIDE]; TALL];
        for index in 0..count {
            let right = &self.right[index * self.right_step + first..][..WIDE];
            for i in 0..TALL {
                let factor = simd.splat_f32s(left[i][index]);
                for j in 0..WIDE {
                    total[i][j] = simd.mul_add_f32s(factor, right[j], total[i][j]);
                }
            }
        }
        for i in 0..TALL {
            // Not a copy of the array, which would keep it out of registers.
            let out = &mut out[(row + i) * step + first..][..WIDE];
            (0..WIDE).for_each(|j| out[j] = total[i][j]);
        }
    }
}
