//! What passes over a picture need to know of some of its rows, so that they need not decode them.

use pulp::{Simd, WithSimd};
use sh::f64x4::SimdLevel;

/// Sums over a few rows of pixels.
///
/// Values are added from left to right in double precision, whatever keeps the pixels: a sum that is kept is
/// the same to the last bit as one that is computed anew.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct RowSums {
    /// The sum of each row's pixels.
    pub(crate) values: Vec<[f64; 3]>,
    /// The sum of their squares.
    pub(crate) squares: Vec<[f64; 3]>,
    /// The largest [`radiance`] of a pixel; NaN does not count.
    pub(crate) brightest: f64,
}

/// The mean of the channels of a pixel, by which lamps are brighter than the rest.
#[inline(always)]
pub(crate) fn radiance(rgb: [f32; 3]) -> f64 {
    let [red, green, blue] = rgb.map(f64::from);
    (red + green + blue) / 3.0
}

impl RowSums {
    /// The sums of rows of `width` pixels.
    pub(crate) fn of(width: usize, rows: &[[f32; 3]]) -> Self {
        SimdLevel::detect().run(Sums { width, rows })
    }
}

struct Sums<'a> {
    width: usize,
    rows: &'a [[f32; 3]],
}

impl WithSimd for Sums<'_> {
    type Output = RowSums;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> RowSums {
        let Self { width, rows } = self;
        let (mut values, mut squares) = (Vec::new(), Vec::new());
        // The largest sum of the channels has the largest third.
        let mut brightest = f64::NEG_INFINITY;
        for pair in rows.chunks(2 * width) {
            // Two rows at a time, each in its own order; the fourth lane is not used.
            let (first, second) = pair.split_at(width);
            let (mut sums, mut of_squares, mut most) = ([[0.0; 4]; 2], [[0.0; 4]; 2], [f64::NEG_INFINITY; 2]);
            let second_or_first = if second.is_empty() { first } else { second };
            for (a, b) in first.iter().zip(second_or_first) {
                for (row, pixel) in [a, b].into_iter().enumerate() {
                    let rgb = [f64::from(pixel[0]), f64::from(pixel[1]), f64::from(pixel[2]), 0.0];
                    for lane in 0..4 {
                        sums[row][lane] += rgb[lane];
                        of_squares[row][lane] += rgb[lane] * rgb[lane];
                    }
                    let sum = rgb[0] + rgb[1] + rgb[2];
                    most[row] = if sum > most[row] { sum } else { most[row] };
                }
            }
            for row in 0..pair.len() / width {
                values.push([sums[row][0], sums[row][1], sums[row][2]]);
                squares.push([of_squares[row][0], of_squares[row][1], of_squares[row][2]]);
                brightest = brightest.max(most[row]);
            }
        }
        RowSums { values, squares, brightest: brightest / 3.0 }
    }
}
