//! f_lq of Y_lq = f_lq(theta) e^(i q phi): normalised associated Legendre functions without Condon-Shortley
//! phase.
//!
//! f_qq = c_q sin^q(theta), f_lq = a_lq cos(theta) f_(l-1)q - b_lq f_(l-2)q with a_lq = sqrt((4 l^2 - 1) /
//! (l^2 - q^2)) and b_lq = a_lq / a_(l-1)q. The projection needs orders up to P only, which is far below F.

use std::f64::consts::PI;

/// Values are computed at this many angles at once: the 15 nodes of a panel, and one of weight 0.
pub(super) const LANES: usize = 16;

/// One value for each angle.
pub(super) type F64x16 = [f64; LANES];

/// The functions of degree l <= `f` and order q <= `orders`.
#[derive(Clone, Debug)]
pub(super) struct Legendre {
    f: usize,
    /// The highest q, at most f.
    orders: usize,
    /// The factor c_q of each order.
    start: Vec<f64>,
    /// The constants a_lq and b_lq, l = q+1 ..= f, order after order.
    climb: Vec<[f64; 2]>,
}

impl Legendre {
    pub(super) fn new(f: usize, orders: usize) -> Self {
        let orders = orders.min(f);
        let mut start = vec![0.5 / PI.sqrt()];
        let mut climb = Vec::new();
        for q in 0..=orders {
            if q > 0 {
                start.push(start[q - 1] * ((2 * q + 1) as f64 / (2 * q) as f64).sqrt());
            }
            let mut below = f64::INFINITY;
            for l in q + 1..=f {
                let a = (((2 * l - 1) * (2 * l + 1)) as f64 / ((l - q) * (l + q)) as f64).sqrt();
                climb.push([a, a / below]);
                below = a;
            }
        }
        Self { f, orders, start, climb }
    }

    /// The highest order.
    pub(super) fn orders(&self) -> usize {
        self.orders
    }

    /// Calls `visit(l, q, f_lq)` for every q and l >= q.
    #[inline]
    pub(super) fn visit(&self, cosine: &F64x16, sine: &F64x16, mut visit: impl FnMut(usize, usize, &F64x16)) {
        let mut climb = self.climb.iter();
        let mut power = [1.0; LANES];
        for q in 0..=self.orders {
            let mut below = [0.0; LANES];
            let mut value = power.map(|power| self.start[q] * power);
            visit(q, q, &value);
            for (l, [a, b]) in (q + 1..=self.f).zip(&mut climb) {
                let mut next = [0.0; LANES];
                for i in 0..LANES {
                    next[i] = a * cosine[i] * value[i] - b * below[i];
                }
                (below, value) = (value, next);
                visit(l, q, &value);
            }
            for i in 0..LANES {
                power[i] *= sine[i];
            }
        }
    }

    /// Calls `visit(l, f_lq)` for one q, at most the highest order, and every l >= q, at some angles.
    #[inline]
    pub(super) fn order<const COUNT: usize>(
        &self,
        q: usize,
        cosine: &[f64; COUNT],
        sine: &[f64; COUNT],
        mut visit: impl FnMut(usize, &[f64; COUNT]),
    ) {
        let mut below = [0.0; COUNT];
        let mut value = sine.map(|sine| self.start[q] * math::powi(sine, q as i32));
        visit(q, &value);
        // Order k has f - k steps.
        let first = (0..q).map(|k| self.f - k).sum();
        for (l, [a, b]) in (q + 1..=self.f).zip(&self.climb[first..]) {
            let mut next = [0.0; COUNT];
            for i in 0..COUNT {
                next[i] = a * cosine[i] * value[i] - b * below[i];
            }
            (below, value) = (value, next);
            visit(l, &value);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sh::{Basis, Degree};
    use sphere::Direction;

    /// The real harmonics at phi = 0 are f_lq, times sqrt(2) for q > 0.
    #[test]
    fn the_functions_are_those_of_the_real_harmonics() {
        let degree = Degree::new(40).unwrap();
        let basis = Basis::new(degree);
        let mut rows = vec![0.0; degree.rows()];
        for theta in [0.0, 1e-3, 0.4, 1.5, 2.9, PI] {
            basis.evaluate_into(Direction::from_angles(theta, 0.0), &mut rows);
            let mut count = 0;
            Legendre::new(40, 7).visit(&[theta.cos(); LANES], &[theta.sin(); LANES], |l, q, value| {
                let expected = rows[l * l + l + q] / if q > 0 { 2f64.sqrt() } else { 1.0 };
                // 40 steps of the recurrence, next to the poles with cos(theta) rounded: a few 1e-13.
                assert!((value[3] - expected).abs() < 1e-12, "{l} {q} {theta}: {} {expected}", value[3]);
                count += 1;
            });
            assert_eq!(count, (0..=7).map(|q| 41 - q).sum::<usize>());
            for q in [0, 3, 7] {
                Legendre::new(40, 7).order(q, &[theta.cos(); 3], &[theta.sin(); 3], |l, value| {
                    let expected = rows[l * l + l + q] / if q > 0 { 2f64.sqrt() } else { 1.0 };
                    let error = value.map(|value| (value - expected).abs());
                    assert!(
                        error.iter().all(|error| *error < 1e-12),
                        "{l} {q} {theta}: {value:?} {expected}"
                    );
                });
            }
        }
    }
}
