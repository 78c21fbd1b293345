//! Coefficients of a light, and products of vectors, in f32.

use sh::{Degree, Expansion};

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
