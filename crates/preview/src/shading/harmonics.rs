//! Real spherical harmonics of any degree as polynomials of a direction (x, y, z).
//!
//! Y_pq = Q_pq(z) c_q(x, y) and Y_p,-q = Q_pq(z) s_q(x, y), where c_q + i s_q = (x + i y)^q contains the sine
//! of the polar angle, so that nothing is divided at the poles. The recurrence of Q_pq over p is that of P_lm
//! in `sh::Basis`:
//!
//! > Q_qq = k_q,  Q_pq = a_pq z Q_p-1,q - b_pq Q_p-2,q,
//! > a_pq = sqrt((4 p^2 - 1) / (p^2 - q^2)),  b_pq = a_pq / a_p-1,q
//!
//! with b_q+1,q = 0, k_0 = sqrt(1 / 4 pi), k_1 = sqrt(3 / 4 pi) and k_q = k_q-1 sqrt((2q + 1) / (2q)), which
//! include the factor sqrt(2) of the real harmonics. Orthonormal, no Condon-Shortley phase, row p*p + p + q.

use std::ops::{Add, Mul, Sub};

/// The constants of the recurrences up to a degree P.
#[derive(Clone, Debug, PartialEq)]
pub struct Harmonics {
    degree: usize,
    /// The columns of each q: k_q, then [a_pq, b_pq] for p = q + 1 ..= P.
    columns: Vec<Column>,
}

#[derive(Clone, Debug, PartialEq)]
struct Column {
    start: f32,
    climb: Vec<[f32; 2]>,
}

/// The constant a_pq of the recurrence.
fn climb(p: usize, q: usize) -> f32 {
    (((2 * p - 1) * (2 * p + 1)) as f32 / ((p - q) * (p + q)) as f32).sqrt()
}

impl Harmonics {
    /// The harmonics of degree 0 to `degree`.
    pub fn new(degree: usize) -> Self {
        let mut start = 0.282_094_8;
        let columns = (0..=degree)
            .map(|q| {
                match q {
                    0 => {}
                    1 => start = 0.488_602_52,
                    _ => start *= ((2 * q + 1) as f32 / (2 * q) as f32).sqrt(),
                }
                let pair = |p: usize| {
                    let a = climb(p, q);
                    [a, if p == q + 1 { 0.0 } else { a / climb(p - 1, q) }]
                };
                Column { start, climb: (q + 1..=degree).map(pair).collect() }
            })
            .collect();
        Self { degree, columns }
    }

    /// The degree P.
    pub fn degree(&self) -> usize {
        self.degree
    }

    /// The constants for shaders: [a_pq, b_pq] at p (p + 1) / 2 + q for q < p, and [k_p, 0] at q = p.
    pub fn constants(&self) -> Vec<[f32; 2]> {
        let pair = |p: usize, q: usize| match p.checked_sub(q + 1) {
            None => [self.columns[q].start, 0.0],
            Some(k) => self.columns[q].climb[k],
        };
        (0..=self.degree).flat_map(|p| (0..=p).map(move |q| pair(p, q))).collect()
    }

    /// Calls `f(p, q, Y_pq, Y_p,-q)` for every q >= 0 and p, with both values times `scale`. Y_p,-q is 0 for
    /// q = 0.
    ///
    /// `T` is f32, or a vector with one direction in each lane.
    #[inline]
    pub fn visit<T>(&self, [x, y, z]: [T; 3], scale: T, mut f: impl FnMut(usize, usize, T, T))
    where
        T: Copy + Add<Output = T> + Sub<Output = T> + Mul<Output = T> + Mul<f32, Output = T>,
    {
        self.zonal(z, scale, |p, value| f(p, 0, value, scale * 0.0));
        let (mut cosine, mut sine) = (x, y);
        for (q, column) in self.columns.iter().enumerate().skip(1) {
            let (mut below, mut value) = (scale * 0.0, scale * column.start);
            f(q, q, value * cosine, value * sine);
            for (k, &[a, b]) in column.climb.iter().enumerate() {
                (below, value) = (value, z * value * a - below * b);
                f(q + 1 + k, q, value * cosine, value * sine);
            }
            (cosine, sine) = (cosine * x - sine * y, cosine * y + sine * x);
        }
    }

    /// Calls `f(p, Y_p0)` for every p, with the values times `scale`, at a given cosine of the polar angle:
    /// the column q = 0 of [`Harmonics::visit`].
    #[inline]
    pub fn zonal<T>(&self, cosine: T, scale: T, mut f: impl FnMut(usize, T))
    where
        T: Copy + Sub<Output = T> + Mul<Output = T> + Mul<f32, Output = T>,
    {
        let column = &self.columns[0];
        let (mut below, mut value) = (scale * 0.0, scale * column.start);
        f(0, value);
        for (k, &[a, b]) in column.climb.iter().enumerate() {
            (below, value) = (value, cosine * value * a - below * b);
            f(k + 1, value);
        }
    }

    /// Writes Y_pq to row p*p + p + q for every p and q.
    ///
    /// # Panics
    /// If `rows` has fewer than (P + 1)^2 elements.
    pub fn evaluate_into(&self, direction: glam::Vec3, rows: &mut [f32]) {
        self.visit(direction.to_array(), 1.0, |p, q, cosine, sine| {
            rows[p * p + p + q] = cosine;
            if q > 0 {
                rows[p * p + p - q] = sine;
            }
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shading::testkit::{ROUNDING, directions, rounded};

    /// Each step of a recurrence rounds three times, and a direction that is one rounding too long enlarges a
    /// harmonic by p roundings: about 10 (p + 1) roundings of values up to sqrt((2p + 1) / 4 pi).
    #[test]
    fn they_match_sh_at_every_degree() {
        for degree in [0, 1, 2, 5, 8, 20, 40] {
            let basis = sh::Basis::new(sh::Degree::new(degree).unwrap());
            let harmonics = Harmonics::new(degree);
            let rows = (degree + 1) * (degree + 1);
            let (mut found, mut expected) = (vec![f32::NAN; rows], vec![0.0; rows]);
            for direction in directions() {
                let (short, exact) = rounded(direction);
                harmonics.evaluate_into(short, &mut found);
                basis.evaluate_into(exact, &mut expected);
                for (row, (&found, &expected)) in found.iter().zip(&expected).enumerate() {
                    let size = (0.16 * (2 * row.isqrt() + 1) as f64).sqrt();
                    let allowed = 10.0 * (row.isqrt() + 1) as f64 * ROUNDING * size;
                    assert!((f64::from(found) - expected).abs() < allowed, "row {row} at {short}");
                }
            }
        }
    }

    #[test]
    fn zonal_harmonics_are_the_column_q_0() {
        let harmonics = Harmonics::new(9);
        for direction in directions() {
            let v = direction.vector().as_vec3();
            let mut rows = [0.0; 100];
            harmonics.evaluate_into(v, &mut rows);
            let mut seen = 0;
            harmonics.zonal(v.z, 1.0, |p, value| {
                assert_eq!(value, rows[p * p + p]);
                seen += 1;
            });
            assert_eq!(seen, 10);
        }
    }

    #[test]
    fn lanes_have_the_values_of_single_directions() {
        let harmonics = Harmonics::new(6);
        for four in directions().chunks_exact(4) {
            let four: [glam::Vec3; 4] = std::array::from_fn(|k| four[k].vector().as_vec3());
            let lanes = [0, 1, 2].map(|axis| glam::Vec4::from_array(four.map(|v| v[axis])));
            let mut rows = [[0.0; 49]; 4];
            for (rows, v) in rows.iter_mut().zip(four) {
                harmonics.evaluate_into(v, rows);
            }
            harmonics.visit(lanes, glam::Vec4::ONE, |p, q, cosine, _| {
                assert_eq!(cosine.to_array(), rows.map(|rows| rows[p * p + p + q]));
            });
        }
    }
}
