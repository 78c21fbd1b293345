//! The reflected light field at single directions, straight from its coefficients [RH02, eqs. 6 and 14].
//!
//! With Y_lm(R w) = sum over n of D^l_mn(R) Y_ln(w), the lighting in the frame of the central direction, L(R
//! w), has coefficients a_lq, and B(R, w_o), the integral of L(R w_i) rho_hat(w_i, w_o) over w_i, is
//!
//! > b_pq = sum over l of a_lq rho_lp|q|,  B = sum over p, q of b_pq Y_pq(w_o),
//!
//! the same for real harmonics as for complex ones: the cosines and sines of one |q| make rho_lpq (Y*_lq(w_i)
//! Y_pq(w_o) + its conjugate) = rho_lpq (Y_lq(w_i) Y_pq(w_o) + Y_l,-q(w_i) Y_p,-q(w_o)) in both.

use sh::Basis;
use sphere::Direction;

use crate::{Reflection, frame, into_frame};

impl Reflection {
    /// The light reflected about a central direction: real coefficients b_pq over w_o in the frame
    /// R_z(beta) R_y(alpha) of the central direction, (P+1)^2 rows p*p + p + q, RGB.
    ///
    /// Work is O(F^3), for a turn of the lighting; for a whole map take [`Reflection::synthesise`].
    pub fn coefficients(&self, central: Direction) -> Vec<[f64; 3]> {
        let lighting = sh::rotate(self.lighting(), frame(central).inverse());
        let (f, p) = (self.brdf().f().get(), self.brdf().p());
        let mut rows = vec![[0.0; 3]; p.rows()];
        for p in 0..=p.get() {
            for l in 0..=f {
                for q in 0..=p.min(l) {
                    let rho = self.brdf().get(l, p, q);
                    for (row, a) in [(p * p + p + q, l * l + l + q), (p * p + p - q, l * l + l - q)]
                        .into_iter()
                        .take(if q == 0 { 1 } else { 2 })
                    {
                        for channel in 0..3 {
                            rows[row][channel] += rho[channel] * lighting.coefficients()[a][channel];
                        }
                    }
                }
            }
        }
        rows
    }

    /// Radiance toward `view`, in the world's frame, from a surface whose central direction is `central`.
    ///
    /// The central direction of a surface is [`brdf::Centre::central`]; whether the surface faces the viewer
    /// is not checked here.
    pub fn evaluate(&self, central: Direction, view: Direction) -> [f64; 3] {
        let mut basis = vec![0.0; self.brdf().p().rows()];
        Basis::new(self.brdf().p()).evaluate_into(into_frame(central, view), &mut basis);
        let mut sum = [0.0; 3];
        for (row, y) in self.coefficients(central).iter().zip(&basis) {
            for channel in 0..3 {
                sum[channel] += row[channel] * y;
            }
        }
        sum
    }
}
