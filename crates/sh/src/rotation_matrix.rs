//! One rotation of many expansions of a low degree.
//!
//! [`crate::rotate`] computes Wigner's functions while it sums, which is most of its work at a low degree.
//! Here the entries of the rotation's matrix are kept: one block of 2 l + 1 rows and columns for each l.

use pulp::{Simd, WithSimd};
use sphere::Rotation;

use crate::f64x4::SimdLevel;
use crate::vector::{LANES, Real, Vector8};
use crate::{Degree, Expansion, rotate};

/// The matrix of a rotation, which is applied to many vectors of coefficients.
///
/// # Example: a yaw of 90 degrees takes +X to +Y
/// ```
/// use sh::{Degree, RotationMatrix};
/// let quarter = sphere::Rotation::from_yaw_pitch_roll(std::f64::consts::FRAC_PI_2, 0.0, 0.0);
/// let matrix = RotationMatrix::new(quarter, Degree::new(1)?);
/// let mut rotated = [0.0; 4];
/// matrix.apply(&[1.0, 0.0, 0.0, 0.5], &mut rotated); // 1 and, along x, 0.5
/// assert!((rotated[1] - 0.5).abs() < 1e-7 && rotated[0] == 1.0); // along y
/// # Ok::<(), sh::DegreeTooHigh>(())
/// ```
pub struct RotationMatrix {
    level: SimdLevel,
    degree: Degree,
    /// For each l and each eight rows of its block: these rows of every column.
    rows: Vec<Vector8<f32>>,
}

impl RotationMatrix {
    /// The matrix of `rotation` for coefficients up to `degree`; O(degree^4).
    pub fn new(rotation: Rotation, degree: Degree) -> Self {
        Self::at_level(SimdLevel::detect(), rotation, degree)
    }

    fn at_level(level: SimdLevel, rotation: Rotation, degree: Degree) -> Self {
        let top = degree.get();
        // Column c of every block at once, three columns in the three channels.
        let columns: Vec<Expansion> = (0..=2 * top)
            .step_by(3)
            .map(|first| {
                let mut units = Expansion::zero(degree);
                for l in 0..=top {
                    for channel in (0..3).filter(|channel| first + channel <= 2 * l) {
                        units.coefficients_mut()[l * l + first + channel][channel] = 1.0;
                    }
                }
                rotate(&units, rotation)
            })
            .collect();
        let entry = |l: usize, row: usize, column: usize| {
            let inside = row <= 2 * l;
            if inside { columns[column / 3].coefficients()[l * l + row][column % 3] as f32 } else { 0.0 }
        };
        let rows = (0..=top)
            .flat_map(|l| first_rows(l).map(move |first| (l, first)))
            .flat_map(|(l, first)| (0..=2 * l).map(move |column| (l, first, column)))
            .map(|(l, first, column)| Vector8::from_fn(|lane| entry(l, first + lane, column)));
        Self { level, degree, rows: rows.collect() }
    }

    /// The highest l.
    pub fn degree(&self) -> Degree {
        self.degree
    }

    /// Rotates vectors of (degree + 1)^2 coefficients, in order l * l + l + m, one vector after the other.
    ///
    /// Accuracy: 1e-6 of a vector's length at degrees up to 16.
    ///
    /// # Panics
    /// If the slices differ in length, or that is not a multiple of (degree + 1)^2.
    pub fn apply(&self, vectors: &[f32], rotated: &mut [f32]) {
        assert_eq!(vectors.len(), rotated.len(), "as many vectors come out as go in");
        assert!(vectors.len().is_multiple_of(self.degree.rows()), "only whole vectors can be rotated");
        self.level.run(Apply { matrix: self, vectors, rotated });
    }
}

/// Vectors that are rotated together: their sums hide the latency of additions.
const TOGETHER: usize = 4;

struct Apply<'a> {
    matrix: &'a RotationMatrix,
    vectors: &'a [f32],
    rotated: &'a mut [f32],
}

impl WithSimd for Apply<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { matrix, vectors, rotated } = self;
        let length = matrix.degree.rows();
        let whole = vectors.len() - vectors.len() % (TOGETHER * length);
        let ((vectors, last), (rotated, last_rotated)) =
            (vectors.split_at(whole), rotated.split_at_mut(whole));
        let together = vectors.chunks_exact(TOGETHER * length);
        for (vectors, rotated) in together.zip(rotated.chunks_exact_mut(TOGETHER * length)) {
            matrix.rotate::<S, TOGETHER>(simd, vectors, rotated);
        }
        for (vector, rotated) in last.chunks_exact(length).zip(last_rotated.chunks_exact_mut(length)) {
            matrix.rotate::<S, 1>(simd, vector, rotated);
        }
    }
}

impl RotationMatrix {
    /// Rotates N vectors.
    #[inline(always)]
    fn rotate<S: Simd, const N: usize>(&self, simd: S, vectors: &[f32], rotated: &mut [f32]) {
        let length = self.degree.rows();
        let mut rows = &self.rows[..];
        for l in 0..=self.degree.get() {
            let size = 2 * l + 1;
            let blocks: [&[f32]; N] = std::array::from_fn(|i| &vectors[i * length + l * l..][..size]);
            for first in first_rows(l) {
                let (columns, rest) = rows.split_at(size);
                rows = rest;
                let mut sums = [simd.splat_f32s(0.0); N];
                for (c, column) in columns.iter().enumerate() {
                    let column = f32::load(simd, &column.0, 0);
                    for i in 0..N {
                        sums[i] = simd.mul_add_f32s(column, simd.splat_f32s(blocks[i][c]), sums[i]);
                    }
                }
                // Lanes past the block are overwritten with the next one.
                let at = l * l + first;
                for (sum, rotated) in sums.into_iter().zip(rotated.chunks_exact_mut(length)) {
                    if let Some(to) = rotated.get_mut(at..at + LANES) {
                        f32::store(simd, sum, to, 0);
                    } else {
                        let mut last = Vector8::ZERO;
                        f32::store(simd, sum, &mut last.0, 0);
                        rotated[at..].copy_from_slice(&last.0[..length - at]);
                    }
                }
            }
        }
    }
}

/// The first of each eight rows of a block; the last eight end with it.
fn first_rows(l: usize) -> impl Iterator<Item = usize> {
    let last = (2 * l + 1).saturating_sub(LANES);
    (0..=2 * l).step_by(LANES).map(move |first| first.min(last))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testkit::Noise;

    fn rotation() -> Rotation {
        Rotation::from_yaw_pitch_roll(1.0, -0.4, 2.5)
    }

    /// Sums of up to 33 products, each rounded to 6e-8 of a vector's length at most.
    #[test]
    fn vectors_are_rotated_as_expansions_are() {
        for degree in [0, 1, 2, 3, 4, 5, 7, 8, 11, 16] {
            let mut noise = Noise::new(degree + 1);
            let degree = Degree::new(degree as usize).unwrap();
            let matrix = RotationMatrix::new(rotation(), degree);
            let expansions = [0; 3].map(|_| noise.expansion(degree.get()));
            let vector =
                |f: &Expansion| -> Vec<f32> { f.coefficients().iter().map(|c| c[0] as f32).collect() };
            let vectors: Vec<f32> = expansions.iter().flat_map(vector).collect();
            let mut rotated = vec![f32::NAN; vectors.len()];
            matrix.apply(&vectors, &mut rotated);
            for (f, rotated) in expansions.iter().zip(rotated.chunks(degree.rows())) {
                let length = f.coefficients().iter().map(|c| c[0] * c[0]).sum::<f64>().sqrt();
                for (found, expected) in rotated.iter().zip(rotate(f, rotation()).coefficients()) {
                    let error = (f64::from(*found) - expected[0]) / length;
                    assert!(error.abs() < 1e-6, "{degree:?}: {error:e}");
                }
            }
        }
    }

    #[test]
    fn every_level_gives_the_same_vectors_to_the_last_bit() {
        let degree = Degree::new(4).unwrap();
        let mut noise = Noise::new(3);
        let vectors: Vec<f32> = (0..7 * degree.rows()).map(|_| noise.next() as f32).collect();
        let [best, portable] = [SimdLevel::detect(), SimdLevel::Portable].map(|level| {
            let mut rotated = vec![0.0; vectors.len()];
            RotationMatrix::at_level(level, rotation(), degree).apply(&vectors, &mut rotated);
            rotated
        });
        assert_eq!(best, portable);
    }
}
