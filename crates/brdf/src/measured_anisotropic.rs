//! `measured-anisotropic`: a table of a BRDF that depends on the tangent.
//!
//! With h the direction half way between light and view, theta_h and phi_h are its angle from the normal and
//! its azimuth from the tangent, and theta_d is the angle between h and the light. The fourth coordinate is
//! the azimuth psi of the difference of light and view after the turn that takes h to the normal along its
//! meridian: psi = phi_h + phi_d of Rusinkiewicz' angles (see `measured`). Unlike phi_d it has a limit where
//! h is the normal. Exchanging light and view adds pi to psi, so that a table over half a turn is reciprocal.
//!
//! Entry (i, j, k, m) of n_h x n_phi x n_d x n_psi is at theta_h = (i / n_h)^2 pi/2, phi_h = j / n_phi 2 pi,
//! theta_d = k / n_d pi/2 and psi = m / n_psi pi. Between nodes the value is linear in (sqrt(theta_h), phi_h,
//! theta_d, psi); past the last node of theta_h and theta_d it stays constant. At theta_h = 0 there is no
//! phi_h, and at theta_d = 0 no psi: the table holds the mean there, so that the lookup is continuous
//! everywhere.

use std::f64::consts::{FRAC_PI_2, PI, TAU};
use std::fmt;
use std::sync::Arc;

use glam::{DVec2, DVec3, UVec4, Vec3};
use sphere::Direction;

use crate::Centre;
use crate::measured::{
    MOST_ENTRIES, MeasuredError, MeasuredTableConstants, facet_width, place, refuse_values,
};
use crate::models::{Lobe, ParameterError, Value, Values, colour};
use crate::packed::{self, packed};

/// A measured BRDF that depends on the tangent (see the text of the module).
///
/// Copies share one table.
#[derive(Clone, PartialEq)]
pub struct MeasuredAnisotropic {
    shape: [usize; 4],
    values: Arc<[[f32; 3]]>,
    scale: [f64; 3],
}

packed! {
    /// The constants of the formula of a measured table that depends on the tangent.
    pub struct MeasuredAnisotropicConstants as measured_anisotropic {
        /// n_h, n_phi, n_d and n_psi.
        shape: UVec4,
        /// The colour that multiplies the table.
        scale: Vec3,
        /// The table.
        table: MeasuredTableConstants,
    }
}

impl MeasuredAnisotropic {
    /// A BRDF from its table: `values` of shape [n_h, n_phi, n_d, n_psi], theta_h slowest, RGB, in 1/sr and
    /// without the cosine.
    ///
    /// # Errors
    /// If the length does not fit the shape, a value is negative or not finite, or the table is empty or has
    /// more than 2^24 entries.
    ///
    /// # Example: a constant table is a matte surface
    /// ```
    /// use brdf::{Material, MeasuredAnisotropic};
    /// use sphere::Direction;
    /// let chalk = MeasuredAnisotropic::new([2, 3, 2, 2], vec![[0.25; 3]; 24])?;
    /// let chalk = Material::MeasuredAnisotropic(chalk);
    /// assert_eq!(chalk.rho_hat(Direction::Z, Direction::from_angles(1.0, 0.3)), [0.25; 3]);
    /// # Ok::<(), brdf::MeasuredError>(())
    /// ```
    pub fn new(shape: [usize; 4], mut values: Vec<[f32; 3]>) -> Result<Self, MeasuredError> {
        let expected = Self::entries(shape)?;
        if values.len() != expected {
            return Err(MeasuredError::Length { expected, found: values.len() });
        }
        refuse_values(&values)?;
        let [_, n_phi, n_d, n_psi] = shape;
        for row in 0..n_d * n_psi {
            average(&mut values, (0..n_phi).map(|j| j * n_d * n_psi + row));
        }
        for first in (0..expected).step_by(n_d * n_psi) {
            average(&mut values, first..first + n_psi);
        }
        Ok(Self { shape, values: values.into(), scale: [1.0; 3] })
    }

    /// The number of entries of a table of this shape.
    pub(crate) fn entries(shape: [usize; 4]) -> Result<usize, MeasuredError> {
        let entries = shape.iter().try_fold(1usize, |product, &n| product.checked_mul(n));
        let [n_h, n_phi, n_d, n_psi] = shape;
        entries
            .filter(|n| (1..=MOST_ENTRIES).contains(n))
            .ok_or(MeasuredError::Shape { shape: [n_h.saturating_mul(n_phi), n_d, n_psi] })
    }

    /// Returns the same BRDF times a colour, which replaces an earlier one.
    ///
    /// # Errors
    /// If a channel is not a number from 0 to 1e6.
    pub fn scaled(self, scale: [f64; 3]) -> Result<Self, ParameterError> {
        Ok(Self { scale: colour("scale", scale)?, ..self })
    }

    /// The shape of the table: n_h, n_phi, n_d, n_psi.
    pub fn shape(&self) -> [usize; 4] {
        self.shape
    }

    /// The table, before the scale: [n_h, n_phi, n_d, n_psi], RGB, in 1/sr.
    pub fn values(&self) -> &[[f32; 3]] {
        &self.values
    }

    /// The colour that multiplies the table.
    pub fn scale(&self) -> [f64; 3] {
        self.scale
    }

    /// theta_h, phi_h, theta_d and psi of an entry of a table of this shape.
    pub fn node(shape: [usize; 4], entry: [usize; 4]) -> [f64; 4] {
        let [h, phi, d, psi] = [0, 1, 2, 3].map(|axis| entry[axis] as f64 / shape[axis] as f64);
        [h * h * FRAC_PI_2, phi * TAU, d * FRAC_PI_2, psi * PI]
    }

    /// The BRDF in 1/sr, without the cosine. Both directions point away from the surface, whose normal is +Z
    /// and whose tangent is +X.
    ///
    /// Reciprocal, bit for bit.
    pub fn brdf(&self, incident: Direction, outgoing: Direction) -> [f64; 3] {
        let [theta_h, phi_h, theta_d, psi] = half_and_difference(incident, outgoing);
        let [n_h, n_phi, n_d, n_psi] = self.shape;
        let (h, to_h) = place((theta_h / FRAC_PI_2).max(0.0).sqrt(), n_h);
        let (d, to_d) = place(theta_d / FRAC_PI_2, n_d);
        let around = |turn: f64, n: usize| {
            let at = (turn * n as f64).max(0.0);
            (at as usize % n, (at as usize + 1) % n, at.fract())
        };
        let (phi, next_phi, to_phi) = around(phi_h / TAU, n_phi);
        let (psi, next_psi, to_psi) = around(psi / PI, n_psi);
        let mut sum = [0.0; 3];
        for (i, weight_h) in [(h, 1.0 - to_h), ((h + 1).min(n_h - 1), to_h)] {
            for (j, weight_phi) in [(phi, 1.0 - to_phi), (next_phi, to_phi)] {
                for (k, weight_d) in [(d, 1.0 - to_d), ((d + 1).min(n_d - 1), to_d)] {
                    let row = ((i * n_phi + j) * n_d + k) * n_psi;
                    let (low, high) = (self.values[row + psi], self.values[row + next_psi]);
                    let weight = weight_h * weight_phi * weight_d;
                    for channel in 0..3 {
                        let [low, high] = [low, high].map(|rgb| f64::from(rgb[channel]));
                        sum[channel] += weight * (low + (high - low) * to_psi);
                    }
                }
            }
        }
        [0, 1, 2].map(|channel| sum[channel] * self.scale[channel])
    }

    pub(crate) const NAME: &str = "measured-anisotropic";

    pub(crate) fn parameters(&self) -> Values {
        Values::default().with("scale", Value::Colour(self.scale))
    }

    pub(crate) fn centre(&self) -> Centre {
        Centre::Reflection
    }

    /// See [`crate::Model::rho_hat`]; 0 for light below the horizon.
    pub(crate) fn rho_hat(&self, incident: Direction, outgoing: Direction) -> [f64; 3] {
        let cosine = incident.vector().z;
        if cosine <= 0.0 {
            return [0.0; 3];
        }
        self.brdf(incident, outgoing).map(|value| value * cosine)
    }

    pub(crate) fn constants(&self) -> MeasuredAnisotropicConstants {
        MeasuredAnisotropicConstants {
            shape: UVec4::from_array(self.shape.map(|n| n as u32)),
            scale: packed::rgb(self.scale),
            table: MeasuredTableConstants { values: Arc::clone(&self.values) },
        }
    }

    /// The lobes to sample: a cosine, and facets as wide along the tangent, and across it, as the table: see
    /// [`facet_width`].
    pub(crate) fn lobes(&self) -> Vec<Lobe> {
        let [n_h, n_phi, n_d, n_psi] = self.shape;
        let theta = |h: usize| Self::node(self.shape, [h, 0, 0, 0])[0];
        let width = |phi: usize| {
            let grey = |h: usize| {
                let entry = (h * n_phi + phi) * n_d * n_psi;
                self.values[entry].iter().map(|value| f64::from(*value)).sum::<f64>()
            };
            facet_width(n_h, theta, grey)
        };
        vec![Lobe::facets([width(0), width(n_phi / 4)]), Lobe::Cosine]
    }
}

impl fmt::Debug for MeasuredAnisotropic {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("MeasuredAnisotropic")
            .field("shape", &self.shape)
            .field("scale", &self.scale)
            .finish_non_exhaustive()
    }
}

/// Replaces these entries by their mean.
fn average(values: &mut [[f32; 3]], entries: impl ExactSizeIterator<Item = usize> + Clone) {
    let count = entries.len() as f64;
    let mean = [0, 1, 2].map(|channel| {
        (entries.clone().map(|entry| f64::from(values[entry][channel])).sum::<f64>() / count) as f32
    });
    entries.for_each(|entry| values[entry] = mean);
}

/// theta_h, phi_h in [0, 2 pi), theta_d and psi in [0, pi) of two directions over a surface with normal +Z
/// and tangent +X.
pub fn half_and_difference(incident: Direction, outgoing: Direction) -> [f64; 4] {
    let sum = incident.vector() + outgoing.vector();
    let difference = incident.vector() - outgoing.vector();
    let theta_d = math::atan2(difference.length(), sum.length());
    let away = DVec2::new(sum.x, sum.y);
    let across = away.length();
    let theta_h = math::atan2(across, sum.z);
    let away = if across > 0.0 { away / across } else { DVec2::X };
    let (sine, cosine) = math::sin_cos(theta_h);
    // The part along the meridian is turned with h to the normal; the other stays.
    let along = (difference.x * away.x + difference.y * away.y) * cosine - difference.z * sine;
    let beside = difference.y * away.x - difference.x * away.y;
    let turned = away * along + away.perp() * beside;
    // Exchanging light and view changes the sign of the difference.
    let turned = if turned.y < 0.0 || (turned.y == 0.0 && turned.x < 0.0) { -turned } else { turned };
    let angle = |v: DVec2, period: f64| {
        let angle = math::atan2(v.y, v.x);
        let angle = if angle < 0.0 { angle + period } else { angle };
        if angle < period { angle } else { 0.0 }
    };
    [theta_h, if across > 0.0 { angle(away, TAU) } else { 0.0 }, theta_d, angle(turned, PI)]
}

/// The incident and the outgoing direction at theta_h, phi_h, theta_d and psi. Either may lie below the
/// horizon.
pub fn from_half_and_difference([theta_h, phi_h, theta_d, psi]: [f64; 4]) -> [Direction; 2] {
    let ((sin_h, cos_h), (sin_phi, cos_phi)) = (math::sin_cos(theta_h), math::sin_cos(phi_h));
    let half = DVec3::new(sin_h * cos_phi, sin_h * sin_phi, cos_h);
    let (beside, along) = math::sin_cos(psi - phi_h);
    let meridian = DVec3::new(cos_h * cos_phi, cos_h * sin_phi, -sin_h);
    let away = meridian * along + DVec3::new(-sin_phi, cos_phi, 0.0) * beside;
    let (sin_d, cos_d) = math::sin_cos(theta_d);
    [1.0, -1.0].map(|side| Direction::from_unit(half * cos_d + away * (side * sin_d)))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A table of f(theta_h, phi_h, theta_d, psi).
    fn table(shape: [usize; 4], f: impl Fn([f64; 4]) -> f64) -> MeasuredAnisotropic {
        let mut values = Vec::new();
        for entry in 0..shape.iter().product() {
            let m = entry % shape[3];
            let (rest, k) = (entry / shape[3] / shape[2], entry / shape[3] % shape[2]);
            let (i, j) = (rest / shape[1], rest % shape[1]);
            let value = f(MeasuredAnisotropic::node(shape, [i, j, k, m])) as f32;
            values.push([value, 2.0 * value, 0.5]);
        }
        MeasuredAnisotropic::new(shape, values).unwrap()
    }

    fn pairs() -> impl Iterator<Item = [Direction; 2]> {
        let direction = |i: f64| Direction::from_angles((i * 0.618_034).fract() * 1.57, i * 2.399_963);
        (0..60).map(move |i| [direction(f64::from(i) + 0.1), direction(f64::from(i) + 7.3)])
    }

    #[test]
    fn coordinates_round_trip() {
        for [incident, outgoing] in pairs() {
            let found = half_and_difference(incident, outgoing);
            let [light, view] = from_half_and_difference(found);
            let near = |a: Direction, b: Direction| (a.vector() - b.vector()).length() < 1e-12;
            let same = near(light, incident) && near(view, outgoing);
            assert!(same || (near(light, outgoing) && near(view, incident)), "{found:?}");
        }
    }

    /// A turn about the normal adds to phi_h and to psi; a function of neither is isotropic.
    #[test]
    fn an_isotropic_table_is_one_of_the_other_angles() {
        let turned = |d: Direction, angle: f64| Direction::from_angles(d.theta(), d.phi() + angle);
        for [incident, outgoing] in pairs() {
            let [theta_h, phi_h, theta_d, psi] = half_and_difference(incident, outgoing);
            let [h, d, phi_d] = crate::half_difference(incident, outgoing);
            assert!((theta_h - h).abs() < 1e-12 && (theta_d - d).abs() < 1e-12);
            let off = (psi - phi_h - phi_d).rem_euclid(PI);
            assert!(off.min(PI - off) < 1e-9, "{psi} {phi_h} {phi_d}");
            let [_, other_phi, _, other_psi] =
                half_and_difference(turned(incident, 0.5), turned(outgoing, 0.5));
            let off = (other_phi - phi_h - 0.5).rem_euclid(TAU);
            assert!(off.min(TAU - off) < 1e-9);
            let off = (other_psi - psi - 0.5).rem_euclid(PI);
            assert!(off.min(PI - off) < 1e-9);
        }
    }

    /// Second derivatives of up to 2 in the coordinates, 1/8 of them times the squared steps: 2e-3.
    #[test]
    fn the_lookup_follows_a_smooth_function() {
        let f = |[h, phi, d, psi]: [f64; 4]| {
            0.6 + 0.2 * h.sin().powi(2) * (2.0 * phi).cos() + 0.1 * d.sin().powi(2) * (2.0 * psi - 0.7).cos()
        };
        let measured = table([40, 60, 40, 40], f);
        for [incident, outgoing] in pairs() {
            let angles = half_and_difference(incident, outgoing);
            let found = measured.brdf(incident, outgoing);
            if angles[2] < 39.0 / 40.0 * FRAC_PI_2 && angles[0] < (39.0f64 / 40.0).powi(2) * FRAC_PI_2 {
                assert!((found[0] - f(angles)).abs() < 2e-3, "{angles:?}: {found:?} {}", f(angles));
                assert!((found[1] - 2.0 * found[0]).abs() < 1e-6 && (found[2] - 0.5).abs() < 1e-6);
            }
            assert_eq!(found, measured.brdf(outgoing, incident), "reciprocal");
        }
    }

    #[test]
    fn the_lookup_is_continuous_at_the_poles_and_over_the_seams() {
        let measured = table([6, 7, 6, 8], |[h, phi, d, psi]| {
            0.5 + 0.2 * (5.0 * h + phi).sin() + 0.2 * (3.0 * d + psi).sin()
        });
        let at = |angles: [f64; 4]| {
            let [light, view] = from_half_and_difference(angles);
            measured.brdf(light, view)[0]
        };
        for k in 0..8 {
            let angle = 0.8 * f64::from(k);
            // One psi, any phi_h: the same pair of directions if theta_h is 0.
            assert!((at([1e-9, angle, 0.7, 0.4]) - at([1e-9, 0.0, 0.7, 0.4])).abs() < 2e-3);
            assert!((at([0.5, 1.0, 1e-6, angle]) - at([0.5, 1.0, 1e-6, 0.0])).abs() < 2e-3);
        }
        assert!((at([0.5, 1e-6, 0.7, 0.4]) - at([0.5, TAU - 1e-6, 0.7, 0.4])).abs() < 1e-4);
        assert!((at([0.5, 1.0, 0.7, 1e-6]) - at([0.5, 1.0, 0.7, PI - 1e-6])).abs() < 1e-4);
    }

    #[test]
    fn impossible_tables_are_errors() {
        let wrong = |shape, values| MeasuredAnisotropic::new(shape, values).unwrap_err().to_string();
        assert!(wrong([0, 1, 1, 1], vec![]).contains("a table of 0 x 1 x 1 entries"));
        assert!(wrong([usize::MAX, 2, 2, 2], vec![]).contains("is not possible"));
        assert_eq!(wrong([2, 1, 1, 1], vec![[0.0; 3]]), "1 values for a table of 2 entries");
        assert!(wrong([1; 4], vec![[0.0, f32::NAN, 0.0]]).starts_with("entry 0 has a value of NaN"));
    }
}
