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
    fn load<S: Simd, H: Halves>(simd: S, halves: H, entries: &[Self]) -> S::f32s;
}

/// A way to convert halves.
pub(crate) trait Halves: Copy {
    /// Converts finite halves to the same numbers in 32 bits.
    fn singles(self, halves: [f16; LANES]) -> [f32; LANES];
}

/// Converts halves with shifts, on any CPU.
#[derive(Clone, Copy)]
pub(crate) struct Shifts;

impl Halves for Shifts {
    #[inline(always)]
    fn singles(self, halves: [f16; LANES]) -> [f32; LANES] {
        let mut values = [0.0; LANES];
        for lane in 0..LANES {
            values[lane] = halves[lane].single();
        }
        values
    }
}

#[cfg(target_arch = "x86_64")]
impl Halves for pulp::x86::V4 {
    #[inline(always)]
    fn singles(self, halves: [f16; LANES]) -> [f32; LANES] {
        let halves = pulp::cast(halves.map(f16::to_bits));
        pulp::cast(self.avx512vl._mm256_maskz_cvtph_ps(u8::MAX, halves))
    }
}

impl Entry for f32 {
    #[inline(always)]
    fn single(self) -> f32 {
        self
    }

    #[inline(always)]
    fn load<S: Simd, H: Halves>(simd: S, _: H, entries: &[Self]) -> S::f32s {
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
    fn load<S: Simd, H: Halves>(simd: S, halves: H, entries: &[Self]) -> S::f32s {
        let mut eight = [Self::ZERO; LANES];
        eight.copy_from_slice(&entries[..LANES]);
        load(simd, &halves.singles(eight))
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

/// Where an eight of columns begins: the last one of a matrix goes back over what those before it have.
#[inline(always)]
pub(crate) fn first_column(eight: usize, columns: usize) -> usize {
    (eight * LANES).min(columns.saturating_sub(LANES))
}

/// A row c times a matrix: the columns of the group-th [`EIGHTS`] eights; those past the last are zero.
/// `COLUMNS` is the number of columns where it is known when the program is compiled, otherwise 0.
#[inline(always)]
pub(crate) fn product<S: Simd, H: Halves, E: Entry, const COLUMNS: usize>(
    simd: S,
    halves: H,
    c: &[f32],
    stride: usize,
    matrix: &[E],
    columns: usize,
    group: usize,
) -> [S::f32s; EIGHTS] {
    let columns = if COLUMNS > 0 { COLUMNS } else { columns };
    let rows = matrix.chunks_exact(columns).zip(c.chunks(stride));
    let mut sums = [simd.splat_f32s(0.0); EIGHTS];
    if columns < LANES {
        let mut padded = [0.0; LANES];
        for (entries, c) in rows {
            padded.iter_mut().zip(entries).for_each(|(padded, entry)| *padded = entry.single());
            sums[0] = simd.mul_add_f32s(simd.splat_f32s(c[0]), load(simd, &padded), sums[0]);
        }
        return sums;
    }
    for (entries, c) in rows {
        let c = simd.splat_f32s(c[0]);
        for k in 0..EIGHTS {
            let entries = E::load(simd, halves, &entries[first_column(group * EIGHTS + k, columns)..]);
            sums[k] = simd.mul_add_f32s(c, entries, sums[k]);
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

    /// `half` converts in its own way.
    #[test]
    fn halves_are_the_same_numbers_in_32_bits() {
        let check = |halves: [f16; LANES], found: [f32; LANES]| {
            for (half, found) in halves.into_iter().zip(found).filter(|(half, _)| half.is_finite()) {
                assert_eq!(found.to_bits(), half.to_f32().to_bits(), "{half}");
            }
        };
        for first in (0..=u16::MAX).step_by(LANES) {
            let halves = std::array::from_fn(|lane| f16::from_bits(first + lane as u16));
            check(halves, Shifts.singles(halves));
            #[cfg(target_arch = "x86_64")]
            if let sh::f64x4::SimdLevel::V4(v4) = sh::f64x4::SimdLevel::detect() {
                check(halves, v4.singles(halves));
            }
        }
    }
}
