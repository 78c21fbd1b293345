//! Real spherical harmonics of any degree as polynomials of a direction (x, y, z).
//!
//! Y_pq = Q_pq(z) c_q(x, y) and Y_p,-q = Q_pq(z) s_q(x, y), where c_q + i s_q = (x + i y)^q holds the sine of the polar angle,
//! so that there is no division at the poles. Q_pq climbs in p as P_lm does in `sh::Basis`:
//!
//! > Q_qq = k_q,  Q_pq = a_pq z Q_p-1,q - b_pq Q_p-2,q,  a_pq = sqrt((4 p^2 - 1) / (p^2 - q^2)),  b_pq = a_pq / a_p-1,q
//!
//! with b_q+1,q = 0, k_0 = sqrt(1 / 4 pi), k_1 = sqrt(3 / 4 pi) and k_q = k_q-1 sqrt((2q + 1) / (2q)), the factor sqrt(2) of
//! the real harmonics in it. Orthonormal, no Condon-Shortley phase, row p*p + p + q.

use std::ops::{Add, Mul, Sub};

/// The constants of the recurrences up to a degree P.
#[derive(Clone, Debug, PartialEq)]
pub struct Harmonics {
    degree: usize,
    /// For each q: k_q, then [a_pq, b_pq] for p = q + 1 ..= P.
    columns: Vec<Column>,
}

#[derive(Clone, Debug, PartialEq)]
struct Column {
    start: f32,
    climb: Vec<[f32; 2]>,
}

/// a_pq.
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

    /// P.
    pub fn degree(&self) -> usize {
        self.degree
    }

    /// Calls `f(p, q, Y_pq, Y_p,-q)` for every p and q >= 0, column after column of q; the last is 0 for q = 0.
    ///
    /// `T` is f32, or a vector of as many directions as it has lanes; `one` is 1 in each lane.
    #[inline]
    pub fn visit<T>(&self, [x, y, z]: [T; 3], one: T, mut f: impl FnMut(usize, usize, T, T))
    where
        T: Copy + Add<Output = T> + Sub<Output = T> + Mul<Output = T> + Mul<f32, Output = T>,
    {
        let (mut cosine, mut sine) = (one, one * 0.0);
        for (q, column) in self.columns.iter().enumerate() {
            let mut below = one * 0.0;
            let mut value = one * column.start;
            f(q, q, value * cosine, value * sine);
            for (k, &[a, b]) in column.climb.iter().enumerate() {
                (below, value) = (value, z * value * a - below * b);
                f(q + 1 + k, q, value * cosine, value * sine);
            }
            (cosine, sine) = (cosine * x - sine * y, cosine * y + sine * x);
        }
    }

    /// Y_pq of every row p*p + p + q into `rows`.
    ///
    /// # Panics
    /// Where `rows` has fewer than (P + 1)^2 elements.
    pub fn evaluate_into(&self, direction: glam::Vec3, rows: &mut [f32]) {
        self.visit(direction.to_array(), 1.0, |p, q, cosine, sine| {
            rows[p * p + p + q] = cosine;
            if q > 0 {
                rows[p * p + p - q] = sine;
            }
        });
    }
}

/// Y_p0 at the angle whose cosine is given, p = 0 to `rows.len() - 1`: the column q = 0 of [`Harmonics::visit`].
pub fn zonal_into(harmonics: &Harmonics, cosine: f32, rows: &mut [f32]) {
    let column = &harmonics.columns[0];
    let (mut below, mut value) = (0.0, column.start);
    rows[0] = value;
    for (row, &[a, b]) in rows[1..].iter_mut().zip(&column.climb) {
        (below, value) = (value, cosine * value * a - below * b);
        *row = value;
    }
}
