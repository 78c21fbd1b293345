//! Coefficients of a light, and products of vectors, in f32.

use half::f16;
use pulp::Simd;
use sh::{Degree, Expansion};

use crate::frames::LANES;

/// The eights of columns that [`product`] sums at once: as many as registers hold.
pub(crate) const EIGHTS: usize = 4;

/// Loads eight numbers from memory into a register.
#[inline(always)]
pub(crate) fn load<S: Simd>(_: S, values: &[f32; LANES]) -> S::f32s {
    pulp::cast(*values)
}

/// Stores a register's eight numbers in memory.
#[inline(always)]
pub(crate) fn store<S: Simd>(_: S, vector: S::f32s, values: &mut [f32; LANES]) {
    *values = pulp::cast(vector);
}

/// An entry of a matrix.
pub(crate) trait Entry: Copy + Sync {
    /// Returns the same number in 32 bits.
    fn single(self) -> f32;

    /// The first eight of a slice.
    ///
    /// # Panics
    /// If there are fewer.
    fn load<S: Simd>(simd: S, entries: &[Self]) -> S::f32s;
}

impl Entry for f32 {
    #[inline(always)]
    fn single(self) -> f32 {
        self
    }

    #[inline(always)]
    fn load<S: Simd>(simd: S, entries: &[Self]) -> S::f32s {
        let mut values = [0.0; LANES];
        values.copy_from_slice(&entries[..LANES]);
        load(simd, &values)
    }
}

impl Entry for f16 {
    /// Converts a finite number; eight at once are a few instructions on any machine. Subnormal ones are
    /// slow.
    #[inline(always)]
    fn single(self) -> f32 {
        // The exponents differ by 112: those of 16 bits are counted from -15, those of 32 bits from -127.
        const UP: f32 = f32::from_bits((112 + 127) << 23);
        // The sign stays in the highest bit, which copies of it follow.
        let bits = i32::from(self.to_bits() as i16) << 13;
        f32::from_bits(bits as u32 & 0x8fff_e000) * UP
    }

    #[inline(always)]
    fn load<S: Simd>(simd: S, entries: &[Self]) -> S::f32s {
        let entries = &entries[..LANES];
        let mut values = [0.0; LANES];
        for lane in 0..LANES {
            values[lane] = entries[lane].single();
        }
        load(simd, &values)
    }
}

/// The coefficients of a light up to a degree, RGB in each row.
pub(crate) fn by_row(light: &Expansion, degree: Degree) -> Vec<[f32; 3]> {
    light.coefficients()[..degree.rows()].iter().map(|rgb| rgb.map(|value| value as f32)).collect()
}

/// The rows of each channel of a light up to a degree.
pub(crate) fn by_channel(light: &Expansion, degree: Degree) -> [Vec<f32>; 3] {
    [0, 1, 2].map(|c| light.coefficients()[..degree.rows()].iter().map(|rgb| rgb[c] as f32).collect())
}

/// The sum of products, in eight sums that fill a vector register.
#[inline(always)]
pub(crate) fn dot(a: &[f32], b: &[f32]) -> f32 {
    let mut sums = [0.0f32; 8];
    let (blocks_a, rest_a) = a.as_chunks::<8>();
    let (blocks_b, rest_b) = b.as_chunks::<8>();
    for (a, b) in blocks_a.iter().zip(blocks_b) {
        for lane in 0..8 {
            sums[lane] += a[lane] * b[lane];
        }
    }
    let rest: f32 = rest_a.iter().zip(rest_b).map(|(a, b)| a * b).sum();
    sums.iter().sum::<f32>() + rest
}

/// Some columns of a row c times a matrix, eight from each of the starts on; those past the last are zero.
#[inline(always)]
pub(crate) fn product<S: Simd, E: Entry>(
    simd: S,
    c: &[f32],
    stride: usize,
    matrix: &[E],
    columns: usize,
    starts: [usize; EIGHTS],
) -> [S::f32s; EIGHTS] {
    let rows = matrix.chunks_exact(columns).zip(c.iter().step_by(stride));
    let mut sums = [simd.splat_f32s(0.0); EIGHTS];
    if columns < LANES {
        let mut padded = [0.0; LANES];
        for (entries, c) in rows {
            padded.iter_mut().zip(entries).for_each(|(padded, entry)| *padded = entry.single());
            sums[0] = simd.mul_add_f32s(simd.splat_f32s(*c), load(simd, &padded), sums[0]);
        }
        return sums;
    }
    // One check before the loop rather than one for each in it.
    assert!(starts.iter().all(|start| start + LANES <= columns), "columns of the matrix");
    for (entries, c) in rows {
        let c = simd.splat_f32s(*c);
        for k in 0..EIGHTS {
            sums[k] = simd.mul_add_f32s(c, E::load(simd, &entries[starts[k]..]), sums[k]);
        }
    }
    sums
}

/// The sum of a vector's eight numbers.
#[inline(always)]
pub(crate) fn total<S: Simd>(_: S, sum: S::f32s) -> f32 {
    let [a, b, c, d, e, f, g, h]: [f32; LANES] = pulp::cast(sum);
    ((a + e) + (b + f)) + ((c + g) + (d + h))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn halves_are_the_same_numbers_in_32_bits() {
        for bits in 0..=u16::MAX {
            let half = f16::from_bits(bits);
            if half.is_finite() {
                assert_eq!(half.single().to_bits(), half.to_f32().to_bits(), "{half}");
            }
        }
    }
}
