//! Points in the unit cube of four dimensions: Owen-scrambled Sobol points in a shuffled order.
//!
//! The first two coordinates are those of the (0, 2)-sequence of [`crate::Points::Sobol`]; the other two have
//! the primitive polynomials x^2 + x + 1 and x^3 + x + 1 and the initial numbers (1, 3) and (1, 3, 1) of Joe
//! and Kuo, "Constructing Sobol sequences with better two-dimensional projections" (2008). The index is
//! scrambled as a coordinate is (Burley, "Practical hash-based Owen scrambling", 2020): of 2^k points from a
//! multiple of 2^k on, all orders are equally likely, so that two sets with different seeds may be paired to
//! make points of eight dimensions.

use crate::points::{laine_karras, pascal, random_words, unit};

/// A set of 2^32 points in [0, 1)^4 for each seed; each point is a function of its index alone, and is the
/// same on every machine.
///
/// # Example: of 16 points, one is in each sixteenth of each coordinate
/// ```
/// let points = sampling::PointsOfFour::new(7);
/// for axis in 0..4 {
///     let mut cells: Vec<u32> = (0..16).map(|k| (points.get(k)[axis] * 16.0) as u32).collect();
///     cells.sort();
///     assert_eq!(cells, (0..16).collect::<Vec<u32>>());
/// }
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PointsOfFour {
    order: u32,
    seeds: [u32; 4],
}

impl PointsOfFour {
    /// The points of a seed.
    pub fn new(seed: u64) -> Self {
        let [[order, one], [two, three], [four, _]] =
            [0, 1, 2].map(|pair| random_words((seed >> 32) as u32 ^ (pair << 29), seed as u32));
        Self { order, seeds: [one, two, three, four] }
    }

    /// The point of an index.
    #[inline]
    pub fn get(&self, index: u32) -> [f32; 4] {
        let index = laine_karras(index.reverse_bits(), self.order).reverse_bits();
        // Mirrored, the bit that halves lowest, as scrambling takes them.
        let [third, fourth] = [0, 1].map(|axis| {
            let tables = &TABLES[axis];
            let bytes = index.to_le_bytes();
            (0..4).fold(0, |bits, byte| bits ^ tables[byte][usize::from(bytes[byte])])
        });
        let mirrored = [index, pascal(index), third, fourth];
        let scrambled = |axis: usize| unit(laine_karras(mirrored[axis], self.seeds[axis]).reverse_bits());
        [scrambled(0), scrambled(1), scrambled(2), scrambled(3)]
    }
}

/// For the third and the fourth coordinate, the sum of the direction numbers, mirrored, of each byte's bits.
static TABLES: [[[u32; 256]; 4]; 2] =
    [tables(&direction_numbers([1, 3, 0], 2, 1)), tables(&direction_numbers([1, 3, 1], 3, 1))];

/// The mirrored direction numbers of a primitive polynomial of a degree, whose inner coefficients are the
/// bits of `inner`, with the initial numbers m (Joe and Kuo, eq. 2).
const fn direction_numbers(m: [u32; 3], degree: usize, inner: u32) -> [u32; 32] {
    let mut numbers = [0; 32];
    let mut k = 0;
    while k < 32 {
        numbers[k] = if k < degree {
            m[k] << (31 - k)
        } else {
            let before = numbers[k - degree];
            let mut next = before ^ (before >> degree);
            let mut i = 1;
            while i < degree {
                if (inner >> (degree - 1 - i)) & 1 == 1 {
                    next ^= numbers[k - i];
                }
                i += 1;
            }
            next
        };
        k += 1;
    }
    k = 0;
    while k < 32 {
        numbers[k] = numbers[k].reverse_bits();
        k += 1;
    }
    numbers
}

const fn tables(numbers: &[u32; 32]) -> [[u32; 256]; 4] {
    let mut tables = [[0; 256]; 4];
    let mut byte = 0;
    while byte < 4 {
        let mut value = 0;
        while value < 256 {
            let mut bit = 0;
            while bit < 8 {
                if (value >> bit) & 1 == 1 {
                    tables[byte][value] ^= numbers[8 * byte + bit];
                }
                bit += 1;
            }
            value += 1;
        }
        byte += 1;
    }
    tables
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Pairs of the coordinates are (0, m, 2)- or (1, m, 2)-nets: a box of area 2^-k or twice that holds its
    /// share of points.
    #[test]
    fn pairs_of_coordinates_fill_the_square_evenly() {
        for seed in [0, 1, 1 << 40] {
            let points = PointsOfFour::new(seed);
            for (a, b) in [(0, 1), (0, 2), (1, 2), (0, 3), (1, 3), (2, 3)] {
                for shift in 0..=8 {
                    let mut cells = vec![0; 256];
                    for index in 0..1024 {
                        let point = points.get(index + 4096);
                        let column = (point[a] * (1 << shift) as f32) as usize;
                        let row = (point[b] * (256 >> shift) as f32) as usize;
                        cells[column * (256 >> shift) + row] += 1;
                    }
                    assert!(cells.iter().all(|count| *count == 4), "{seed} {a} {b} {shift}: {cells:?}");
                }
            }
        }
    }

    #[test]
    fn two_sets_are_independent() {
        let (one, other) = (PointsOfFour::new(1), PointsOfFour::new(2));
        for (a, b) in [(0, 0), (0, 1), (3, 3)] {
            let product = |k: u32| (one.get(k)[a] - 0.5) * (other.get(k)[b] - 0.5);
            let covariance = (0..4096).map(product).sum::<f32>() / 4096.0;
            // Independent numbers have a covariance of 1 / 12 / 64 = 0.0013.
            assert!(covariance.abs() < 0.004, "{a} {b}: {covariance}");
        }
    }
}
