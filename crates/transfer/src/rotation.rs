//! The rotation of coefficients by the frames of eight vertices at a time.
//!
//! R_z(alpha) R_y(beta) R_z(gamma), with the turn about y as a turn about x by 90 degrees, one about z and
//! one about x by -90 degrees: R_y(beta) = R_x(-90) R_z(beta) R_x(90) (the appendix of the paper, its second
//! method). A turn about z mixes the pairs of each m, those about x are matrices of few entries. About 350
//! operations for degree 4.

use sh::{Degree, Expansion, rotate};
use sphere::Rotation;

use crate::frames::{Angles, LANES};

/// Coefficients of eight vertices, [(F+1)^2][8].
pub(crate) type Lanes = [[f32; LANES]];

/// The turn about x by 90 degrees, for coefficients up to a degree.
pub(crate) struct FrameRotation {
    degree: usize,
    quarter: Sparse,
    /// Its transpose.
    back: Sparse,
}

/// The entries of a matrix that are not zero, row by row.
struct Sparse {
    /// Column and value.
    entries: Vec<(u32, f32)>,
    /// Where each row ends.
    ends: Vec<u32>,
}

impl FrameRotation {
    pub(crate) fn new(degree: Degree) -> Self {
        let rows = degree.rows();
        let turn = Rotation::from_yaw_pitch_roll(0.0, 0.0, std::f64::consts::FRAC_PI_2);
        let (mut quarter, mut back) = (vec![Vec::new(); rows], vec![Vec::new(); rows]);
        for column in 0..rows {
            let mut unit = Expansion::zero(degree);
            unit.coefficients_mut()[column] = [1.0; 3];
            for (row, [value, ..]) in rotate(&unit, turn).coefficients().iter().enumerate() {
                if value.abs() > 1e-12 {
                    quarter[row].push((column as u32, *value as f32));
                    back[column].push((row as u32, *value as f32));
                }
            }
        }
        Self { degree: degree.get(), quarter: Sparse::new(&quarter), back: Sparse::new(&back) }
    }

    /// Turns functions in the frames of the vertices into the world.
    #[inline(always)]
    pub(crate) fn to_world(&self, angles: &Angles, c: &mut Lanes, work: &mut Lanes) {
        self.about_z(angles.gamma, 1.0, c);
        self.quarter.apply(c, work);
        self.about_z(angles.beta, 1.0, work);
        self.back.apply(work, c);
        self.about_z(angles.alpha, 1.0, c);
    }

    /// Turns functions in the world into the frames of the vertices.
    #[inline(always)]
    pub(crate) fn to_local(&self, angles: &Angles, c: &mut Lanes, work: &mut Lanes) {
        self.about_z(angles.alpha, -1.0, c);
        self.quarter.apply(c, work);
        self.about_z(angles.beta, -1.0, work);
        self.back.apply(work, c);
        self.about_z(angles.gamma, -1.0, c);
    }

    /// The turn about z by angles with these cosines and sines, or back.
    #[inline(always)]
    fn about_z(&self, [cosine, sine]: [[f32; LANES]; 2], sign: f32, c: &mut Lanes) {
        let (mut x, mut y) = (cosine, sine.map(|sine| sign * sine));
        for m in 1..=self.degree {
            for l in m..=self.degree {
                let middle = l * l + l;
                let (even, odd) = (c[middle + m], c[middle - m]);
                let (mut first, mut second) = ([0.0; LANES], [0.0; LANES]);
                for lane in 0..LANES {
                    first[lane] = even[lane] * x[lane] - odd[lane] * y[lane];
                    second[lane] = even[lane] * y[lane] + odd[lane] * x[lane];
                }
                (c[middle + m], c[middle - m]) = (first, second);
            }
            for lane in 0..LANES {
                let s = sign * sine[lane];
                (x[lane], y[lane]) =
                    (x[lane] * cosine[lane] - y[lane] * s, y[lane] * cosine[lane] + x[lane] * s);
            }
        }
    }
}

impl Sparse {
    fn new(rows: &[Vec<(u32, f32)>]) -> Self {
        let ends = rows.iter().scan(0, |end, row| {
            *end += row.len() as u32;
            Some(*end)
        });
        Self { ends: ends.collect(), entries: rows.concat() }
    }

    /// The product with a vector.
    #[inline(always)]
    fn apply(&self, from: &Lanes, to: &mut Lanes) {
        let mut first = 0;
        for (&end, to) in self.ends.iter().zip(to) {
            let mut sum = [0.0; LANES];
            for &(column, value) in &self.entries[first..end as usize] {
                let from = &from[column as usize];
                for lane in 0..LANES {
                    sum[lane] += value * from[lane];
                }
            }
            *to = sum;
            first = end as usize;
        }
    }
}
