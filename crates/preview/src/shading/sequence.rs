//! The points of the unit square for light samples, with the same integers in both twins.
//!
//! Even points ([`PointSet::Even`]): point i of a pixel's sample is its shift plus i times Roberts' R2 ("The
//! Unreasonable Effectiveness of Quasirandom Sequences", 2018: the multiples of 1/g and 1/g^2, g^3 = g + 1),
//! modulo 1, in integers of 2^-32. Any number of points of one shift fills the square evenly. The shift is a
//! hash of the sample's index (Cranley and Patterson 1976): each single point is then uniform, so that
//! estimates are unbiased, and pixels have different noise.
//!
//! Random points ([`PointSet::Random`]): each point is a hash of its number and of the sample's index (pcg2d
//! of Jarzynski and Olano, "Hash Functions for GPU Rendering", 2020).

use super::shader_constants::shader_constants;
use crate::PointSet;

shader_constants!("SEQUENCE_":
    EVEN: u32 = 0;
    RANDOM: u32 = 1;
);

/// 2^32 / g and 2^32 / g^2, odd, so that no point repeats.
const STEP: [u32; 2] = [0xc13f_a9a9, 0x91e1_0da5];

/// The text of the shader: its constants and sequence.wgsl.
pub fn shader() -> String {
    [WGSL_CONSTANTS, include_str!("sequence.wgsl")].concat()
}

/// The number of a set of points in the shader.
pub fn number(points: PointSet) -> u32 {
    match points {
        PointSet::Even => EVEN,
        PointSet::Random => RANDOM,
    }
}

/// The points of one sample of a pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sequence {
    points: PointSet,
    /// The shift of even points; the index of the sample, for random ones.
    of_sample: [u32; 2],
}

impl Sequence {
    /// The points of the sample with this index.
    pub fn new(points: PointSet, sample_index: u32) -> Self {
        let of_sample = match points {
            PointSet::Even => shift(sample_index),
            PointSet::Random => [sample_index, 0],
        };
        Self { points, of_sample }
    }

    /// Point `i`, with coordinates of at least 0 and below 1, multiples of 2^-24.
    pub fn point(self, i: u32) -> [f32; 2] {
        let bits = match self.points {
            PointSet::Even => {
                [0, 1].map(|axis| self.of_sample[axis].wrapping_add(i.wrapping_mul(STEP[axis])))
            }
            PointSet::Random => hash_pair([i, self.of_sample[0]]),
        };
        bits.map(unit)
    }
}

/// The shift of a sample of a pixel.
fn shift(sample_index: u32) -> [u32; 2] {
    let first = hash(sample_index);
    [first, hash(first ^ 0x9e37_79b9)]
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

/// pcg2d, a permutation of all pairs of numbers.
fn hash_pair(pair: [u32; 2]) -> [u32; 2] {
    const FACTOR: u32 = 1_664_525;
    let [mut x, mut y] = pair.map(|value| value.wrapping_mul(FACTOR).wrapping_add(1_013_904_223));
    for _ in 0..2 {
        x = x.wrapping_add(y.wrapping_mul(FACTOR));
        y = y.wrapping_add(x.wrapping_mul(FACTOR));
        [x, y] = [x ^ (x >> 16), y ^ (y >> 16)];
    }
    [x, y]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of N points of a shift, a box with a corner at 0 holds N times its area, up to a few points: R2's
    /// discrepancy grows like ln N, while that of random points is sqrt(N) / 2 (16 at 1024).
    #[test]
    fn points_of_a_shift_fill_the_square_evenly() {
        let (sequence, n) = (Sequence::new(PointSet::Even, 7), 1024);
        for [width, height] in [[0.5, 0.5], [0.9, 0.1], [0.25, 0.7], [1.0, 0.3], [0.6, 1.0]] {
            for first in [0, 1000, u32::MAX - 300] {
                let inside = (0..n).filter(|i| {
                    let [x, y] = sequence.point(first.wrapping_add(*i));
                    x < width && y < height
                });
                let excess = inside.count() as f32 - n as f32 * width * height;
                assert!(excess.abs() < 6.0, "{width} {height} from {first}: {excess}");
            }
        }
    }

    /// Chi-square of 65,536 points in 64 boxes. With 1024 expected in each it has 63 degrees of freedom, mean
    /// 63 and deviation sqrt(126) = 11; 120 is over 5 deviations away.
    fn chi_square(points: impl Iterator<Item = [f32; 2]>) -> f64 {
        let mut counts = [0u32; 64];
        for [x, y] in points {
            counts[(x * 8.0) as usize * 8 + (y * 8.0) as usize] += 1;
        }
        assert_eq!(counts.iter().sum::<u32>(), 65_536);
        counts.iter().map(|count| (f64::from(*count) - 1024.0).powi(2) / 1024.0).sum()
    }

    #[test]
    fn the_first_points_of_samples_are_uniform() {
        for points in PointSet::ALL {
            let chi = chi_square((0..65_536).map(|sample| Sequence::new(points, sample).point(0)));
            assert!(chi < 120.0, "{points:?}: {chi}");
        }
    }

    /// Random points pass a chi-square test, and so do pairs of coordinates of successive points and samples,
    /// which a lattice, or points that neighbours share, would fail.
    #[test]
    fn random_points_are_independent() {
        let of = |sample, i| Sequence::new(PointSet::Random, sample).point(i);
        for (what, chi) in [
            ("of a sample", chi_square((0..65_536).map(|i| of(7, i)))),
            ("successive points", chi_square((0..65_536).map(|i| [of(7, i)[0], of(7, i + 1)[0]]))),
            ("neighbours", chi_square((0..65_536).map(|sample| [of(sample, 3)[1], of(sample + 1, 3)[1]]))),
            ("across", chi_square((0..65_536).map(|i| [of(i, 3)[0], of(3, i)[1]]))),
        ] {
            assert!((20.0..120.0).contains(&chi), "{what}: {chi}");
        }
    }

    #[test]
    fn coordinates_stay_below_1() {
        assert_eq!((unit(0), unit(u32::MAX)), (0.0, 1.0 - 2.0f32.powi(-24)));
    }
}
