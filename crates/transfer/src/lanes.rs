//! From one vertex after another to eight vertices side by side.

use pulp::Simd;

use crate::frames::LANES;
use crate::rotation::Lanes;

/// Takes eight looked-up texels, [lane][row, channel], to [channel][row][lane], cut to the rows that there is
/// room for.
#[inline(always)]
pub(crate) fn by_lane<S: Simd>(simd: S, texels: &[f32], channels: usize, c: &mut Lanes) {
    // With a known number of channels nothing is divided.
    match channels {
        1 => transpose_all(simd, texels, 1, c),
        _ => transpose_all(simd, texels, channels, c),
    }
}

/// Takes eight vectors, one after another, to [element][lane], cut to the elements that there is room for.
#[inline(always)]
fn transpose_all<S: Simd>(simd: S, texels: &[f32], channels: usize, c: &mut Lanes) {
    let (texel, length, rows) = (texels.len() / LANES, c.len(), c.len() / channels);
    let place = |element: usize| element % channels * rows + element / channels;
    let whole = length - length % LANES;
    for start in (0..whole).step_by(LANES) {
        let mut vectors = [[0.0; LANES]; LANES];
        for lane in 0..LANES {
            vectors[lane].copy_from_slice(&texels[lane * texel + start..][..LANES]);
        }
        let vectors = transpose(simd, vectors);
        if channels == 1 {
            c[start..][..LANES].copy_from_slice(&vectors);
            continue;
        }
        for k in 0..LANES {
            c[place(start + k)] = vectors[k];
        }
    }
    for element in whole..length {
        for lane in 0..LANES {
            c[place(element)][lane] = texels[lane * texel + element];
        }
    }
}

/// Takes eight vectors as rows to the same as columns.
#[inline(always)]
fn transpose<S: Simd>(simd: S, rows: [[f32; LANES]; LANES]) -> [[f32; LANES]; LANES] {
    #[cfg(target_arch = "x86_64")]
    if let Some(v3) = (&simd as &dyn std::any::Any).downcast_ref::<pulp::x86::V3>() {
        return transpose_v3(*v3, rows);
    }
    let _ = simd;
    std::array::from_fn(|column| std::array::from_fn(|row| rows[row][column]))
}

/// [`transpose`] by 24 shuffles, where compilers move single numbers.
#[cfg(target_arch = "x86_64")]
#[inline(always)]
fn transpose_v3(simd: pulp::x86::V3, rows: [[f32; LANES]; LANES]) -> [[f32; LANES]; LANES] {
    use std::arch::x86_64::__m256;
    let avx = simd.avx;
    // Two rows with their elements taken in turn.
    let pair = |a: [f32; LANES], b: [f32; LANES]| -> (__m256, __m256) {
        let (a, b) = (pulp::cast(a), pulp::cast(b));
        (avx._mm256_unpacklo_ps(a, b), avx._mm256_unpackhi_ps(a, b))
    };
    // Columns k and k + 4 of four rows are the halves of the k-th vector.
    let four = |(low, high): (__m256, __m256), (next_low, next_high): (__m256, __m256)| {
        [
            avx._mm256_shuffle_ps::<0x44>(low, next_low),
            avx._mm256_shuffle_ps::<0xee>(low, next_low),
            avx._mm256_shuffle_ps::<0x44>(high, next_high),
            avx._mm256_shuffle_ps::<0xee>(high, next_high),
        ]
    };
    let upper = four(pair(rows[0], rows[1]), pair(rows[2], rows[3]));
    let lower = four(pair(rows[4], rows[5]), pair(rows[6], rows[7]));
    let mut columns = [[0.0; LANES]; LANES];
    for k in 0..4 {
        columns[k] = pulp::cast(avx._mm256_permute2f128_ps::<0x20>(upper[k], lower[k]));
        columns[k + 4] = pulp::cast(avx._mm256_permute2f128_ps::<0x31>(upper[k], lower[k]));
    }
    columns
}

#[cfg(test)]
mod tests {
    use super::*;
    use pulp::WithSimd;
    use sh::f64x4::SimdLevel;

    struct Transposed<'a>(&'a [f32], usize, &'a mut Lanes);

    impl WithSimd for Transposed<'_> {
        type Output = ();

        #[inline(always)]
        fn with_simd<S: Simd>(self, simd: S) {
            by_lane(simd, self.0, self.1, self.2);
        }
    }

    #[test]
    fn texels_lie_side_by_side() {
        for level in [SimdLevel::detect(), SimdLevel::Portable] {
            for (rows, kept, channels) in
                [(25, 25, 1), (25, 16, 3), (9, 9, 1), (4, 1, 3), (4, 4, 1), (1, 1, 3)]
            {
                let texel = rows * channels;
                let texels: Vec<f32> = (0..LANES * texel).map(|k| k as f32).collect();
                let mut c = vec![[-1.0; LANES]; kept * channels];
                level.run(Transposed(&texels, channels, &mut c));
                for (index, lanes) in c.iter().enumerate() {
                    let (channel, row) = (index / kept, index % kept);
                    let expected = |lane: usize| (lane * texel + row * channels + channel) as f32;
                    assert_eq!(*lanes, std::array::from_fn(expected), "{channel} {row}");
                }
            }
        }
    }
}
