//! rho_hat at one view, as a function of the incident direction in the world.
//!
//! In the frame R of the central direction, w_o = R^-1 V, and with real harmonics
//!
//! > rho_hat(w_i, w_o) = sum over l, q of c_lq Y_lq(w_i),  c_lq = sum over p of rho_lp|q| Y_pq(w_o),
//!
//! because the cosines and sines of one |q| make Y*_lq(w_i) Y_pq(w_o) + its conjugate = Y_lq(w_i) Y_pq(w_o) +
//! Y_l,-q(w_i) Y_p,-q(w_o). The function in the world is that one turned by R.

use sh::{Basis, Expansion, rotate};
use sphere::{Direction, Rotation, Zyz};

use crate::BrdfCoefficients;

impl BrdfCoefficients {
    /// rho_hat over all incident directions in the world's frame, in 1/sr, of a surface seen from `view`:
    /// degree F, RGB.
    ///
    /// Exact to rounding: the rotation's 1e-11 of the largest coefficient. Its integral with the
    /// coefficients of a light is the radiance toward the view. Rings, below the horizon too, as far as F
    /// and P cut the material.
    ///
    /// # Example: a matte surface does not look different from elsewhere
    /// ```
    /// use brdf::{Choice, Lambert, Material, project};
    /// use sh::Degree;
    /// use sphere::Direction;
    ///
    /// let chalk = Material::Lambert(Lambert::new([0.5; 3])?);
    /// let degrees = Choice::Degree { f: Degree::new(4)?, p: Degree::ZERO };
    /// let rho = project(&chalk, degrees, sh::Stop::NEVER)?.coefficients;
    /// let above = rho.at_view(Direction::X, Direction::Z, Direction::X);
    /// let aside = rho.at_view(Direction::X, Direction::Z, Direction::from_angles(1.0, 0.4));
    /// assert_eq!(above, aside);
    /// // albedo / pi times the integral of the cosine
    /// assert!((above.get(0, 0)[0] * (4.0 * std::f64::consts::PI).sqrt() - 0.5).abs() < 1e-12);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn at_view(&self, normal: Direction, tangent: Direction, view: Direction) -> Expansion {
        let central = self.centre().central(normal, tangent, view);
        let frame = Rotation::from_zyz(Zyz { alpha: central.phi(), beta: central.theta(), gamma: 0.0 });
        let mut outgoing = vec![0.0; self.p().rows()];
        Basis::new(self.p()).evaluate_into(frame.inverse().apply(view), &mut outgoing);
        let mut local = Expansion::zero(self.f());
        let rows = local.coefficients_mut();
        for l in 0..=self.f().get() {
            for p in 0..=self.p().get() {
                for q in 0..=p.min(l) {
                    let rho = self.get(l, p, q);
                    let signs: &[isize] = if q == 0 { &[1] } else { &[1, -1] };
                    for sign in signs {
                        let order = sign * q as isize;
                        let y = outgoing[(p * p + p).wrapping_add_signed(order)];
                        let row = &mut rows[(l * l + l).wrapping_add_signed(order)];
                        (0..3).for_each(|channel| row[channel] += rho[channel] * y);
                    }
                }
            }
        }
        rotate(&local, frame)
    }
}

#[cfg(test)]
mod tests {
    use sh::{Degree, Stop};
    use sphere::{DMat3, DVec3};

    use super::*;
    use crate::{BlinnPhong, Choice, KajiyaKay, Lambert, Material, Microfacet, project};

    /// The series at a view is the material, as near as the share of its energy that the series lacks.
    #[test]
    fn a_view_of_the_series_is_the_material() {
        let materials = [
            (Material::Lambert(Lambert::new([0.3, 0.5, 0.8]).unwrap()), 0.02),
            (Material::Microfacet(Microfacet::new(0.4, [1.0, 0.5, 0.2]).unwrap()), 0.05),
            (Material::BlinnPhong(BlinnPhong::new(20.0, [0.7, 0.2, 0.4]).unwrap()), 0.05),
            (Material::KajiyaKay(KajiyaKay::new(8.0, [0.6; 3]).unwrap()), 0.02),
        ];
        let degrees = Choice::Degree { f: Degree::new(16).unwrap(), p: Degree::new(12).unwrap() };
        for (material, tolerance) in materials {
            let rho = project(&material, degrees, Stop::NEVER).unwrap().coefficients;
            // A surface that leans, and views of it up to 40 degrees from its normal.
            let normal = Direction::from_angles(0.9, 2.0);
            let tangent = Direction::normalised(normal.vector().cross(DVec3::new(0.3, -0.2, 1.0)));
            let bitangent = normal.vector().cross(tangent.vector());
            let local = DMat3::from_cols(tangent.vector(), bitangent, normal.vector()).transpose();
            let into = |w: Direction| Direction::normalised(local * w.vector());
            for (theta, phi) in [(0.0, 0.0), (0.3, 1.0), (0.7, -2.0)] {
                let v = Direction::from_angles(theta, phi);
                let view = Direction::normalised(local.transpose() * v.vector());
                let f = rho.at_view(normal, tangent, view);
                let (mut error, mut size) = (0.0, 0.0);
                for index in 0..4000 {
                    // A golden spiral.
                    let z = 1.0 - (f64::from(index) + 0.5) / 2000.0;
                    let incident = Direction::from_angles(z.acos(), 2.399_963 * f64::from(index));
                    let expected = material.rho_hat(into(incident), into(view));
                    let found = f.evaluate(incident);
                    for channel in 0..3 {
                        error += (found[channel] - expected[channel]).powi(2);
                        size += expected[channel].powi(2);
                    }
                }
                let relative = (error / size).sqrt();
                assert!(relative < tolerance, "{material:?} {theta} {phi}: {relative}");
            }
        }
    }
}
