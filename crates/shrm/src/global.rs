//! From local to global coefficients [RH02, eq. 8].
//!
//! A function given in the frame of a central direction becomes one of the world when its coefficients are
//! rotated by R = R_z(beta) R_y(alpha). With X a quarter turn about +X, which takes +Y to +Z, R_y(alpha) =
//! X^-1 R_z(alpha) X. Turns about +Z mix the two rows of each |q| only, and X is one orthogonal matrix for
//! each p, the same for every texel: work is O(P^3) per texel and no matrix depends on the angle.

use std::f64::consts::FRAC_PI_2;

use rayon::prelude::*;
use sh::{Degree, Expansion, rotate};
use sphere::{Direction, Rotation};

use crate::{Shrm, Terms, View};

/// Turns of expansions of one low degree from the frames of central directions into the world's.
pub(crate) struct LocalToWorld {
    degree: usize,
    /// The matrix X of degree p = 0 ..= degree, each with shape [2p+1, 2p+1].
    quarter: Vec<f64>,
}

impl LocalToWorld {
    pub(crate) fn new(degree: Degree) -> Self {
        let x = Rotation::from_yaw_pitch_roll(0.0, 0.0, FRAC_PI_2);
        let mut quarter = Vec::new();
        for p in 0..=degree.get() {
            let side = 2 * p + 1;
            let start = quarter.len();
            quarter.resize(start + side * side, 0.0);
            for column in 0..side {
                let mut unit = Expansion::zero(Degree::new(p).unwrap_or(degree));
                unit.coefficients_mut()[p * p + column] = [1.0; 3];
                for (row, value) in rotate(&unit, x).coefficients()[p * p..].iter().enumerate() {
                    // A quarter turn maps an axis to an axis: what is below rounding is zero.
                    quarter[start + row * side + column] =
                        if value[0].abs() < 1e-15 { 0.0 } else { value[0] };
                }
            }
        }
        Self { degree: degree.get(), quarter }
    }

    /// Turns `rows`, (degree + 1)^2 of them, from the frame of the central direction into the world's.
    pub(crate) fn apply(&self, central: Direction, rows: &mut [[f64; 3]], scratch: &mut Vec<[f64; 3]>) {
        let (alpha, beta) = (central.theta(), central.phi());
        scratch.resize(2 * self.degree + 1, [0.0; 3]);
        let mut start = 0;
        for p in 0..=self.degree {
            let side = 2 * p + 1;
            let quarter = &self.quarter[start..][..side * side];
            let (band, turned) = (&mut rows[p * p..][..side], &mut scratch[..side]);
            for (matrix, out) in quarter.chunks_exact(side).zip(turned.iter_mut()) {
                *out = [0.0; 3];
                for (x, value) in matrix.iter().zip(band.iter()) {
                    for channel in 0..3 {
                        out[channel] += x * value[channel];
                    }
                }
            }
            turn(turned, alpha);
            band.fill([0.0; 3]);
            for (matrix, value) in quarter.chunks_exact(side).zip(turned.iter()) {
                for (x, out) in matrix.iter().zip(band.iter_mut()) {
                    for channel in 0..3 {
                        out[channel] += x * value[channel];
                    }
                }
            }
            turn(band, beta);
            start += side * side;
        }
    }
}

/// Turns coefficients of one degree p by R_z(angle): c' = c cos(q angle) - s sin(q angle), s' = c sin(q
/// angle) + s cos(q angle).
fn turn(band: &mut [[f64; 3]], angle: f64) {
    let p = band.len() / 2;
    let (sine, cosine) = math::sin_cos(angle);
    let (mut x, mut y) = (cosine, sine);
    for q in 1..=p {
        let (c, s) = (band[p + q], band[p - q]);
        for channel in 0..3 {
            band[p + q][channel] = c[channel] * x - s[channel] * y;
            band[p - q][channel] = c[channel] * y + s[channel] * x;
        }
        (x, y) = (x * cosine - y * sine, y * cosine + x * sine);
    }
}

impl Shrm {
    /// Returns the same map with coefficients over the view in the world's frame, all (P+1)^2 of them; a copy
    /// if it is global already.
    ///
    /// The rotation is in f64 and rounded once; work is O(P^3) per texel. Global coefficients may be blended
    /// between texels, local ones may not.
    pub fn to_global(&self) -> Self {
        if self.view() == View::Global {
            return self.clone();
        }
        let (grid, rows) = (self.grid(), self.p().rows());
        let local_to_world = LocalToWorld::new(self.p());
        let mut values = vec![[0.0_f32; 3]; grid.len() * rows];
        values.par_chunks_mut(64 * rows).enumerate().for_each(|(block, values)| {
            let (mut wide, mut scratch) = (vec![[0.0; 3]; rows], Vec::new());
            for (texel, out) in (block * 64..).zip(values.chunks_exact_mut(rows)) {
                self.widen(texel, &mut wide);
                local_to_world.apply(grid.direction(texel), &mut wide, &mut scratch);
                for (out, value) in out.iter_mut().zip(&wide) {
                    *out = value.map(|v| v as f32);
                }
            }
        });
        Self { view: View::Global, terms: Terms::All, values, ..*self }
    }

    /// All (P+1)^2 coefficients of a texel, zeros included.
    fn widen(&self, texel: usize, rows: &mut [[f64; 3]]) {
        rows.fill([0.0; 3]);
        for (k, value) in self.texel(texel).iter().enumerate() {
            rows[if self.terms() == Terms::All { k } else { k * k + k }] = value.map(f64::from);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::into_frame;
    use sh::Basis;

    /// [RH02, eq. 8] in f64: rotated coefficients at V are the local ones at R^-1 V. Matrices are orthogonal,
    /// so that errors stay at some P^2 units of rounding.
    #[test]
    fn global_coefficients_at_v_are_local_ones_at_w_o() {
        for degree in [0, 1, 2, 5, 12] {
            let degree = Degree::new(degree).unwrap();
            let wave = |row: usize| ((row * 37 % 101) as f64 / 50.0 - 1.0).sin();
            let local: Vec<[f64; 3]> =
                (0..degree.rows()).map(|row| [wave(row), wave(row + 9), 1.0]).collect();
            let (local_to_world, basis) = (LocalToWorld::new(degree), Basis::new(degree));
            let mut scratch = Vec::new();
            for k in 0..20 {
                let central = Direction::from_angles(0.165 * f64::from(k), 2.4 * f64::from(k) - 3.0);
                let view = Direction::from_angles(0.15 * f64::from(k) + 0.1, 1.7 * f64::from(k));
                let mut global = local.clone();
                local_to_world.apply(central, &mut global, &mut scratch);
                let value = |rows: &[[f64; 3]], view| {
                    basis.evaluate(&Expansion::from_coefficients(degree, rows.to_vec()).unwrap(), view)
                };
                let (found, expected) = (value(&global, view), value(&local, into_frame(central, view)));
                for channel in 0..3 {
                    assert!((found[channel] - expected[channel]).abs() < 1e-12, "degree {degree:?}, {k}");
                }
            }
        }
    }
}
