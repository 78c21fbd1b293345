//! Coefficients of a light, and products of vectors, in f32.

use half::f16;
use sh::{Degree, Expansion};

use crate::frames::LANES;

/// The eights of columns that [`product`] sums at once: as many as registers hold.
pub(crate) const EIGHTS: usize = 4;

/// An entry of a matrix.
pub(crate) trait Entry: Copy + Sync {
    /// The same number in 32 bits.
    fn single(self) -> f32;
}

impl Entry for f32 {
    #[inline(always)]
    fn single(self) -> f32 {
        self
    }
}

impl Entry for f16 {
    /// Of finite numbers; eight at once are a few instructions on any machine. Subnormal ones are slow.
    #[inline(always)]
    fn single(self) -> f32 {
        // The exponents differ by 112: those of 16 bits are counted from -15, those of 32 bits from -127.
        const UP: f32 = f32::from_bits((112 + 127) << 23);
        let bits = u32::from(self.to_bits());
        let size = f32::from_bits((bits & 0x7fff) << 13) * UP;
        f32::from_bits(size.to_bits() | (bits & 0x8000) << 16)
    }
}

/// The coefficients of a light up to a degree, RGB in each row.
pub(crate) fn by_row(light: &Expansion, degree: Degree) -> Vec<[f32; 3]> {
    light.coefficients()[..degree.rows()].iter().map(|rgb| rgb.map(|value| value as f32)).collect()
}

/// Rows of each channel of a light up to a degree.
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
pub(crate) fn product<E: Entry>(
    c: &[f32],
    stride: usize,
    matrix: &[E],
    columns: usize,
    starts: [usize; EIGHTS],
) -> [[f32; LANES]; EIGHTS] {
    let rows = matrix.chunks_exact(columns).zip(c.iter().step_by(stride));
    if columns < LANES {
        let mut sums = [0.0; LANES];
        for (entries, c) in rows {
            for (sum, entry) in sums.iter_mut().zip(entries) {
                *sum += c * entry.single();
            }
        }
        return [sums, [0.0; LANES], [0.0; LANES], [0.0; LANES]];
    }
    // One check before the loop rather than four in it.
    assert!(starts.iter().all(|start| start + LANES <= columns), "columns of the matrix");
    // Four variables, which stay in registers; an array of them does not.
    let [mut first, mut second, mut third, mut fourth] = [[0.0; LANES]; EIGHTS];
    for (entries, c) in rows {
        add(&mut first, *c, &entries[starts[0]..][..LANES]);
        add(&mut second, *c, &entries[starts[1]..][..LANES]);
        add(&mut third, *c, &entries[starts[2]..][..LANES]);
        add(&mut fourth, *c, &entries[starts[3]..][..LANES]);
    }
    [first, second, third, fourth]
}

/// Adds c times eight entries.
#[inline(always)]
fn add<E: Entry>(sum: &mut [f32; LANES], c: f32, entries: &[E]) {
    for lane in 0..LANES {
        sum[lane] += c * entries[lane].single();
    }
}

/// The sum of eight.
#[inline(always)]
pub(crate) fn total([a, b, c, d, e, f, g, h]: [f32; LANES]) -> f32 {
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
