//! Points in the unit square: random, Halton, Hammersley, scrambled Sobol, and a caller's own.
//!
//! Every point is a function of its index alone, so that any part of a set can be made on any thread.
//!
//! - Random: Philox2x32-10 (Salmon et al. 2011, "Parallel random numbers: as easy as 1, 2, 3"). The counter
//!   is the index, the key the seed.
//! - Halton: the radical inverses of the index in bases 2 and 3, its digits mirrored at the point.
//! - Hammersley: i / N, and the radical inverse of i in base 2.
//! - Sobol: the (0, 2)-sequence whose first coordinate is the radical inverse and whose second takes the bits
//!   of the index through Pascal's triangle modulo 2. Of 2^k points from a multiple of 2^k on, each of the
//!   2^k rectangles 2^-a x 2^-b, a + b = k, holds one. The triangle is five masked shifts (Ahmed 2024, "An
//!   implementation algorithm of 2D Sobol sequence fast, elegant, and compact"). Owen's scrambling swaps
//!   halves, quarters, ... at random. Here a hash does it in which no bit depends on a lower one of the
//!   coordinate (Laine and Karras 2011; Burley 2020, "Practical hash-based Owen scrambling"), with the
//!   constants that Vegdahl found ("Building a better LK hash", 2021).
//!
//! A coordinate is computed as 32 bits and rounded down to the 24 of an `f32`. Rounded to nearest, the
//! largest would become 1.

use std::num::NonZeroU32;

use pulp::{Simd, WithSimd};
use sh::f64x4::SimdLevel;

/// A set of points in [0, 1) x [0, 1).
///
/// The points are the same on every machine and for every number of threads.
///
/// # Example: the first Halton points halve and third the square
/// ```
/// let mut points = [[0.0; 2]; 3];
/// sampling::Points::Halton.fill(0, &mut points);
/// assert_eq!(points.map(|[x, _]| x), [0.0, 0.5, 0.25]);
/// assert!((points[1][1] - 1.0 / 3.0).abs() < 1e-7 && (points[2][1] - 2.0 / 3.0).abs() < 1e-7);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Points<'a> {
    /// Independent uniform points: 2^64 for each seed.
    Random {
        /// The seed; another one gives other points.
        seed: u32,
    },
    /// The Halton sequence in bases 2 and 3: 2^32 points, then the same again.
    Halton,
    /// The Hammersley set of `count` points, then the same again.
    Hammersley {
        /// The number of points.
        count: NonZeroU32,
    },
    /// The Sobol (0, 2)-sequence: 2^32 points, then the same again.
    Sobol {
        /// The seed of Owen's scrambling; `None` leaves the points as they are.
        seed: Option<u32>,
    },
    /// Points that the caller has made, then the same again.
    Given(GivenPoints<'a>),
}

/// A caller's points, all in [0, 1) x [0, 1), at least one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GivenPoints<'a>(&'a [[f32; 2]]);

/// Points that are not a set in the unit square.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum GivenPointsError {
    /// There is no point.
    #[error("there are no points")]
    Empty,
    /// A coordinate is negative, 1 or more, or not a number.
    #[error("point {index}, {point:?}, is not in [0, 1) x [0, 1)")]
    Outside {
        /// The index of the first such point.
        index: usize,
        /// The coordinates of that point.
        point: [f32; 2],
    },
}

impl<'a> GivenPoints<'a> {
    /// Checked points.
    ///
    /// # Errors
    /// If there is no point, or one is not in [0, 1) x [0, 1).
    pub fn new(points: &'a [[f32; 2]]) -> Result<Self, GivenPointsError> {
        let outside = |point: &[f32; 2]| !point.iter().all(|u| (0.0..1.0).contains(u));
        match points.iter().position(outside) {
            Some(index) => Err(GivenPointsError::Outside { index, point: points[index] }),
            None if points.is_empty() => Err(GivenPointsError::Empty),
            None => Ok(Self(points)),
        }
    }
}

impl Points<'_> {
    /// The point of an index.
    pub fn get(&self, index: u64) -> [f32; 2] {
        let one = |[[x], [y]]: [[u32; 1]; 2]| [unit(x), unit(y)];
        match *self {
            Self::Random { seed } => one(RandomBlock { seed }.make(index)),
            Self::Halton => {
                let index = index as u32;
                let high = radical_inverse_3(index / TABLE as u32, TRITS);
                [unit(index.reverse_bits()), unit(high + MIRRORED[index as usize % TABLE])]
            }
            Self::Hammersley { count } => {
                one(HammersleyBlock { count: count.get() }.make(index % u64::from(count.get())))
            }
            Self::Sobol { seed: None } => one(SobolBlock.make(index)),
            Self::Sobol { seed: Some(seed) } => one(OwenBlock { seeds: coordinate_seeds(seed) }.make(index)),
            Self::Given(GivenPoints(given)) => given[(index % given.len() as u64) as usize],
        }
    }

    /// Writes the points `first`, `first` + 1, ... into a slice: faster than one by one.
    pub fn fill(&self, first: u64, points: &mut [[f32; 2]]) {
        let simd = SimdLevel::detect();
        match *self {
            Self::Random { seed } => simd.run(Blocks { first, points, block: RandomBlock { seed } }),
            Self::Halton => fill_halton(simd, first as u32, points),
            Self::Hammersley { count } => {
                let mut first = first % u64::from(count.get());
                for points in pieces(points, (u64::from(count.get()) - first) as usize, count.get() as usize)
                {
                    simd.run(Blocks { first, points, block: HammersleyBlock { count: count.get() } });
                    first = 0;
                }
            }
            Self::Sobol { seed } => match seed.map(coordinate_seeds) {
                Some(seeds) => simd.run(Blocks { first, points, block: OwenBlock { seeds } }),
                None => simd.run(Blocks { first, points, block: SobolBlock }),
            },
            Self::Given(GivenPoints(given)) => {
                let mut start = (first % given.len() as u64) as usize;
                for points in pieces(points, given.len() - start, given.len()) {
                    points.copy_from_slice(&given[start..start + points.len()]);
                    start = 0;
                }
            }
        }
    }
}

/// Cuts a slice into pieces: the first of at most `head` elements, the others of at most `size`.
fn pieces<T>(slice: &mut [T], head: usize, size: usize) -> impl Iterator<Item = &mut [T]> {
    let (head, rest) = slice.split_at_mut(head.min(slice.len()));
    std::iter::once(head).chain(rest.chunks_mut(size))
}

/// Points made side by side, which the compiler vectorises.
const BLOCK: usize = 16;

/// Makes the coordinates of N points in sequence, as 32 bits each.
trait Block {
    fn make<const N: usize>(&self, first: u64) -> [[u32; N]; 2];
}

struct Blocks<'a, B> {
    first: u64,
    points: &'a mut [[f32; 2]],
    block: B,
}

impl<B: Block> WithSimd for Blocks<'_, B> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let mut first = self.first;
        let (blocks, rest) = self.points.as_chunks_mut::<BLOCK>();
        for points in blocks {
            let [x, y] = self.block.make::<BLOCK>(first);
            for i in 0..BLOCK {
                points[i] = [unit(x[i]), unit(y[i])];
            }
            first = first.wrapping_add(BLOCK as u64);
        }
        if !rest.is_empty() {
            let [x, y] = self.block.make::<BLOCK>(first);
            for (i, point) in rest.iter_mut().enumerate() {
                *point = [unit(x[i]), unit(y[i])];
            }
        }
    }
}

/// The upper 24 bits as a number in [0, 1).
#[inline(always)]
pub(crate) fn unit(bits: u32) -> f32 {
    // By way of i32, which has an instruction.
    (bits >> 8) as i32 as f32 * (1.0 / (1 << 24) as f32)
}

#[inline(always)]
fn from_fn<const N: usize>(f: impl Fn(usize) -> u32) -> [u32; N] {
    let mut values = [0; N];
    for (i, value) in values.iter_mut().enumerate() {
        *value = f(i);
    }
    values
}

struct RandomBlock {
    seed: u32,
}

impl Block for RandomBlock {
    #[inline(always)]
    fn make<const N: usize>(&self, first: u64) -> [[u32; N]; 2] {
        // Of each u64 the lower half counts: no instruction multiplies u32 to u64 without spreading them.
        let (mut left, mut right) = ([0; N], [0; N]);
        for i in 0..N {
            left[i] = first.wrapping_add(i as u64);
            right[i] = left[i] >> 32;
        }
        let mut key = self.seed;
        for _ in 0..10 {
            for i in 0..N {
                let product = (left[i] & 0xffff_ffff) * 0xd256_d193;
                left[i] = (product >> 32) ^ u64::from(key) ^ right[i];
                right[i] = product;
            }
            key = key.wrapping_add(0x9e37_79b9);
        }
        [from_fn(|i| left[i] as u32), from_fn(|i| right[i] as u32)]
    }
}

struct HammersleyBlock {
    count: u32,
}

impl Block for HammersleyBlock {
    #[inline(always)]
    fn make<const N: usize>(&self, first: u64) -> [[u32; N]; 2] {
        let first = first as u32;
        let mut x = [0; N];
        for (i, x) in x.iter_mut().enumerate() {
            // 24 bits of the quotient, past the set's end too.
            let quotient = f64::from(first.wrapping_add(i as u32)) / f64::from(self.count);
            *x = ((quotient * f64::from(1 << 24)) as i64 as u32) << 8;
        }
        [x, from_fn(|i| first.wrapping_add(i as u32).reverse_bits())]
    }
}

struct SobolBlock;

impl Block for SobolBlock {
    #[inline(always)]
    fn make<const N: usize>(&self, first: u64) -> [[u32; N]; 2] {
        let index = |i: usize| (first as u32).wrapping_add(i as u32);
        [from_fn(|i| index(i).reverse_bits()), from_fn(|i| pascal(index(i)).reverse_bits())]
    }
}

struct OwenBlock {
    seeds: [u32; 2],
}

impl Block for OwenBlock {
    #[inline(always)]
    fn make<const N: usize>(&self, first: u64) -> [[u32; N]; 2] {
        let index = |i: usize| (first as u32).wrapping_add(i as u32);
        [
            from_fn(|i| laine_karras(index(i), self.seeds[0]).reverse_bits()),
            from_fn(|i| laine_karras(pascal(index(i)), self.seeds[1]).reverse_bits()),
        ]
    }
}

/// The second coordinate's bits, the one that halves lowest: bit j is the sum modulo 2 of the bits k of the
/// index with an odd binomial coefficient (k over j).
#[inline(always)]
pub(crate) fn pascal(index: u32) -> u32 {
    let mut bits = index;
    bits ^= bits >> 16;
    bits ^= (bits & 0xff00_ff00) >> 8;
    bits ^= (bits & 0xf0f0_f0f0) >> 4;
    bits ^= (bits & 0xcccc_cccc) >> 2;
    bits ^ (bits & 0xaaaa_aaaa) >> 1
}

/// A permutation in which no bit depends on a higher one: Owen's scrambling of a mirrored coordinate.
#[inline(always)]
pub(crate) fn laine_karras(bits: u32, seed: u32) -> u32 {
    let mut bits = bits;
    bits ^= bits.wrapping_mul(0x3d20_adea);
    bits = bits.wrapping_add(seed);
    bits = bits.wrapping_mul((seed >> 16) | 1);
    bits ^= bits.wrapping_mul(0x0552_6c56);
    bits ^ bits.wrapping_mul(0x53a2_2864)
}

/// Two words for an index: all bits of the index and of the seed change them.
pub(crate) fn random_words(seed: u32, index: u32) -> [u32; 2] {
    RandomBlock { seed }.make(u64::from(index)).map(|[bits]| bits)
}

/// A seed for each coordinate, since the hash needs all of its bits to be random.
fn coordinate_seeds(seed: u32) -> [u32; 2] {
    RandomBlock { seed }.make(0).map(|[bits]| bits)
}

/// Low digits of an index in base 3 that a table mirrors.
const TRITS: u32 = 7;
const TABLE: usize = 3_usize.pow(TRITS);

/// The radical inverses of 0 to 3^7 - 1 in base 3, times 2^32.
static MIRRORED: [u32; TABLE] = {
    let mut table = [0; TABLE];
    let mut i = 0;
    while i < TABLE {
        table[i] = radical_inverse_3(i as u32, 0);
        i += 1;
    }
    table
};

/// 2^32 times the radical inverse in base 3 of `index` 3^skipped, which has at most 21 digits.
const fn radical_inverse_3(index: u32, skipped: u32) -> u32 {
    let (mut rest, mut mirrored, mut digit) = (index, 0_u128, skipped);
    while digit < 21 {
        mirrored = 3 * mirrored + (rest % 3) as u128;
        rest /= 3;
        digit += 1;
    }
    ((mirrored << 32) / 3_u128.pow(21)) as u32
}

/// Points of which only the digits in the table differ.
struct HaltonRun<'a> {
    first: u32,
    points: &'a mut [[f32; 2]],
}

impl WithSimd for HaltonRun<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let high = radical_inverse_3(self.first / TABLE as u32, TRITS);
        let low = &MIRRORED[self.first as usize % TABLE..];
        for (i, (point, low)) in self.points.iter_mut().zip(low).enumerate() {
            // Both are rounded down, so that their sum stays below 2^32.
            *point = [unit((self.first.wrapping_add(i as u32)).reverse_bits()), unit(high + low)];
        }
    }
}

fn fill_halton(simd: SimdLevel, first: u32, mut points: &mut [[f32; 2]]) {
    let mut first = first;
    while !points.is_empty() {
        let to_wrap = (1 << 32) - u64::from(first);
        let length = (TABLE - first as usize % TABLE).min(points.len()).min(to_wrap as usize);
        let (run, rest) = points.split_at_mut(length);
        simd.run(HaltonRun { first, points: run });
        (first, points) = (first.wrapping_add(length as u32), rest);
    }
}

#[cfg(test)]
mod tests;
