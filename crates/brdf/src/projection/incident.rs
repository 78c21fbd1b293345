//! The incident directions for one outgoing direction, in pieces without a kink inside.
//!
//! About R the normal lies half way from +Z to w_o (theta_o from +Z, phi = 0), and N.L = 0 where
//!
//! > cos(phi) = -cos(theta_i) cos(theta_o/2) / (sin(theta_i) sin(theta_o/2)) = cos(phi_h).
//!
//! Circles with theta_i < pi/2 - theta_o/2 lie above the horizon, those with theta_i > pi/2 + theta_o/2 below
//! it; of those between, the part with |phi| < phi_h is above. At both ends of that range phi_h behaves as a
//! square root, which theta_i = pi/2 - (theta_o/2) cos(t) makes smooth in t. About N the horizon is theta_i =
//! pi/2. About T every circle is taken whole.

use std::f64::consts::{FRAC_PI_2, PI};

use crate::Centre;
use crate::quadrature::Panel;

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum CirclePart {
    /// Whole circles.
    Whole,
    /// The part of the circles above the horizon: phi from 0 to phi_h.
    Above,
    /// The part of the circles below the horizon: phi from phi_h to pi.
    Below,
}

/// A range of circles theta_i = const, over a variable t in which integrals are smooth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Piece {
    pub(super) from: f64,
    pub(super) to: f64,
    pub(super) part: CirclePart,
    /// Half of theta_o, if the horizon cuts the circles.
    half: f64,
}

/// The pieces for an outgoing direction; those below the horizon only if `below`.
pub(super) fn pieces(centre: Centre, theta_o: f64, below: bool) -> Vec<Piece> {
    let half = theta_o / 2.0;
    let circles = |from: f64, to: f64| Piece { from, to, part: CirclePart::Whole, half };
    let cut = |part: CirclePart| Piece { from: 0.0, to: PI, part, half };
    let mut all = match centre {
        Centre::Reflection => vec![circles(0.0, FRAC_PI_2 - half), cut(CirclePart::Above)],
        Centre::Normal => vec![circles(0.0, FRAC_PI_2)],
        Centre::Tangent => return vec![circles(0.0, FRAC_PI_2), circles(FRAC_PI_2, PI)],
    };
    if below {
        match centre {
            Centre::Reflection => all.extend([cut(CirclePart::Below), circles(FRAC_PI_2 + half, PI)]),
            _ => all.push(circles(FRAC_PI_2, PI)),
        }
    }
    all
}

impl Piece {
    /// The panels of the piece, none wider than `widest` in theta_i.
    pub(super) fn panels(self, widest: f64) -> impl Iterator<Item = Panel> {
        // If the horizon cuts the circles, the number of panels is even, so that a kink at theta_i = pi/2
        // lies between two.
        let middle = if self.part == CirclePart::Whole { self.to } else { 0.5 * (self.from + self.to) };
        let part = move |from, to| Panel::split(from, to, widest / self.stretch()).filter(|p| p.from < p.to);
        part(self.from, middle).chain(part(middle, self.to))
    }

    /// The greatest derivative of theta_i by t.
    pub(super) fn stretch(&self) -> f64 {
        if self.part == CirclePart::Whole { 1.0 } else { self.half }
    }

    /// theta_i and its derivative by t.
    pub(super) fn theta(&self, t: f64) -> (f64, f64) {
        match self.part {
            CirclePart::Whole => (t, 1.0),
            _ => (FRAC_PI_2 - self.half * math::cos(t), self.half * math::sin(t)),
        }
    }

    /// The range of azimuths at a t, within 0 to pi; those from -pi to 0 mirror it.
    pub(super) fn azimuths(&self, t: f64) -> (f64, f64) {
        if self.part == CirclePart::Whole {
            return (0.0, PI);
        }
        // theta_i - pi/2 = -half cos(t): cos(theta_i) = sin(half cos(t)), sin(theta_i) = cos(half cos(t)).
        let horizon =
            math::acos((-math::tan(self.half * math::cos(t)) / math::tan(self.half)).clamp(-1.0, 1.0));
        if self.part == CirclePart::Above { (0.0, horizon) } else { (horizon, PI) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sphere::Direction;

    #[test]
    fn the_horizon_is_where_the_normal_meets_the_light_at_a_right_angle() {
        for theta_o in [0.01, 0.7, 2.0, 3.1] {
            let piece = pieces(Centre::Reflection, theta_o, false)[1];
            for t in [0.2, 1.0, 2.5] {
                let ((theta, _), (_, phi)) = (piece.theta(t), piece.azimuths(t));
                let incident = Direction::from_angles(theta, phi);
                let [incident, _] =
                    Centre::Reflection.surface(incident, Direction::from_angles(theta_o, 0.0));
                assert!(incident.vector().z.abs() < 1e-14);
            }
        }
    }

    /// The solid angles above and below the horizon are half the sphere each, for every view.
    #[test]
    fn the_pieces_fill_the_sphere() {
        use crate::quadrature::RULE;
        for centre in [Centre::Reflection, Centre::Normal, Centre::Tangent] {
            for theta_o in [0.05, 1.0, 2.2, 3.0] {
                let area = |below: bool| -> f64 {
                    let mut sum = 0.0;
                    for piece in pieces(centre, theta_o, below) {
                        for panel in piece.panels(0.2) {
                            for node in RULE {
                                let t = panel.at(node);
                                let ((theta, slope), (from, to)) = (piece.theta(t), piece.azimuths(t));
                                sum +=
                                    panel.radius() * node.kronrod * slope * theta.sin() * 2.0 * (to - from);
                            }
                        }
                    }
                    sum
                };
                // Panels of 0.2 leave 1e-12 of these analytic integrands.
                let above = if centre == Centre::Tangent { 4.0 } else { 2.0 } * PI;
                assert!((area(false) - above).abs() < 1e-11, "{centre:?} {theta_o}: {}", area(false));
                assert!((area(true) - 4.0 * PI).abs() < 1e-11);
            }
        }
    }
}
