//! The points of the unit square for light samples, with the same integers in both twins.
//!
//! Point i of a pixel's sample is its shift plus i times Roberts' R2 ("The Unreasonable Effectiveness of
//! Quasirandom Sequences", 2018: the multiples of 1/g and 1/g^2, g^3 = g + 1), modulo 1, in integers of
//! 2^-32. Any number of points of one shift fills the square evenly. The shift is a hash of the sample's
//! index (Cranley and Patterson 1976): each single point is then uniform, so that estimates are unbiased, and
//! pixels have different noise.

/// 2^32 / g and 2^32 / g^2, odd, so that no point repeats.
const STEP: [u32; 2] = [0xc13f_a9a9, 0x91e1_0da5];

/// The shift of a sample of a pixel.
pub fn shift(sample_index: u32) -> [u32; 2] {
    let first = hash(sample_index);
    [first, hash(first ^ 0x9e37_79b9)]
}

/// Point `i` of a shift, with coordinates of at least 0 and below 1, multiples of 2^-24.
pub fn point(shift: [u32; 2], i: u32) -> [f32; 2] {
    [0, 1].map(|axis| unit(shift[axis].wrapping_add(i.wrapping_mul(STEP[axis]))))
}

/// The upper 24 bits as a number below 1.
fn unit(bits: u32) -> f32 {
    (bits >> 8) as f32 * (1.0 / 16_777_216.0)
}

/// One step of O'Neill's PCG in its RXS-M-XS form ("PCG: A Family of Simple Fast Space-Efficient
/// Statistically Good Algorithms for Random Number Generation", 2014): a permutation of all numbers.
fn hash(value: u32) -> u32 {
    let state = value.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
    let word = ((state >> ((state >> 28) + 4)) ^ state).wrapping_mul(277_803_737);
    (word >> 22) ^ word
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of N points of a shift, a box with a corner at 0 holds N times its area, up to a few points: R2's
    /// discrepancy grows like ln N, while that of random points is sqrt(N) / 2 (16 at 1024).
    #[test]
    fn points_of_a_shift_fill_the_square_evenly() {
        let (shift, n) = (shift(7), 1024);
        for [width, height] in [[0.5, 0.5], [0.9, 0.1], [0.25, 0.7], [1.0, 0.3], [0.6, 1.0]] {
            for first in [0, 1000, u32::MAX - 300] {
                let inside = (0..n).filter(|i| {
                    let [x, y] = point(shift, first.wrapping_add(*i));
                    x < width && y < height
                });
                let excess = inside.count() as f32 - n as f32 * width * height;
                assert!(excess.abs() < 6.0, "{width} {height} from {first}: {excess}");
            }
        }
    }

    /// The first points of many samples are uniform: with 1024 expected in each of 64 boxes, chi-square has
    /// 63 degrees of freedom, mean 63 and deviation sqrt(126) = 11; 120 is over 5 deviations away.
    #[test]
    fn shifts_are_uniform_over_samples() {
        let mut counts = [0u32; 64];
        for sample in 0..65_536 {
            let [x, y] = point(shift(sample), 0);
            counts[(x * 8.0) as usize * 8 + (y * 8.0) as usize] += 1;
        }
        let chi: f64 = counts.iter().map(|count| (f64::from(*count) - 1024.0).powi(2) / 1024.0).sum();
        assert!(chi < 120.0, "{chi}");
    }

    #[test]
    fn coordinates_stay_below_1() {
        assert_eq!((unit(0), unit(u32::MAX)), (0.0, 1.0 - 2.0f32.powi(-24)));
    }
}
