//! `measured`: a table of an isotropic BRDF over half and difference angles, independent of the format of its
//! file.
//!
//! With h the direction half way between light and view, theta_h is its angle from the normal, and (theta_d,
//! phi_d) are the angles of the incident direction in the frame whose +Z is h and whose +X leads away from
//! the normal (Rusinkiewicz, "A New Change of Variables for Efficient BRDF Representation", 1998). An
//! isotropic BRDF does not depend on phi_h. Exchanging light and view adds pi to phi_d, so that a table over
//! half a turn is reciprocal; a mirror image negates phi_d.
//!
//! The nodes are those of the MERL database: entry (i, j, k) of n_h x n_d x n_phi at theta_h = (i / n_h)^2
//! pi/2, dense where highlights are, theta_d = j / n_d pi/2 and phi_d = k / n_phi pi. Between nodes the value
//! is linear in (sqrt(theta_h), theta_d, phi_d); past the last node it stays constant. At theta_h = 0 an
//! isotropic BRDF cannot depend on phi_d, and at theta_d = 0 there is no phi_d: the table holds the mean over
//! phi_d there, so that the lookup is continuous everywhere.

use std::f64::consts::{FRAC_PI_2, PI};
use std::fmt;
use std::sync::Arc;

use glam::{DVec3, UVec3, Vec3};
use sphere::Direction;

use crate::Centre;
use crate::models::{Lobe, ParameterError, Value, Values, colour};
use crate::packed::{self, packed};

/// The most entries of a table: 16 million, 192 MB. A table of MERL has 1.5 million.
pub(crate) const MOST_ENTRIES: usize = 1 << 24;

/// A measured isotropic BRDF: a table over half and difference angles (see the text of the module).
///
/// Copies share one table.
#[derive(Clone, PartialEq)]
pub struct Measured {
    shape: [usize; 3],
    values: Arc<[[f32; 3]]>,
    scale: [f64; 3],
}

/// Why a table cannot be that of a BRDF.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum MeasuredError {
    /// The shape has no entries, or too many.
    #[error(
        "a table of {} x {} x {} entries is not possible; expected 1 to {MOST_ENTRIES} in all",
        shape[0], shape[1], shape[2]
    )]
    Shape {
        /// The shape: n_h, n_d, n_phi.
        shape: [usize; 3],
    },
    /// The number of values is not that of the shape.
    #[error("{found} values for a table of {expected} entries")]
    Length {
        /// The product of the shape.
        expected: usize,
        /// The number of values.
        found: usize,
    },
    /// A value that a BRDF cannot have.
    #[error("entry {entry} has a value of {value}; expected a finite number, 0 or more")]
    Value {
        /// The value's place in the table.
        entry: usize,
        /// The value that was found.
        value: f32,
    },
}

packed! {
    /// The constants of the formula of a measured table.
    pub struct MeasuredConstants as measured {
        /// n_h, n_d and n_phi.
        shape: UVec3,
        /// The colour that multiplies the table.
        scale: Vec3,
        /// The table.
        table: MeasuredTableConstants,
    }
}

packed! {
    /// The values of a measured table.
    pub struct MeasuredTableConstants as measured_table {
        /// The BRDF at the nodes, as in [`Measured::values`] or [`crate::MeasuredAnisotropic::values`].
        values: Arc<[[f32; 3]]>,
    }
}

impl Measured {
    /// A BRDF from its table: `values` of shape [n_h, n_d, n_phi], theta_h slowest, RGB, in 1/sr and without
    /// the cosine.
    ///
    /// # Errors
    /// If the length does not fit the shape, a value is negative or not finite, or the table is empty or has
    /// more than 2^24 entries.
    ///
    /// # Example: a constant table is a matte surface
    /// ```
    /// use brdf::{Material, Measured};
    /// use sphere::Direction;
    /// let chalk = Material::Measured(Measured::new([2, 2, 2], vec![[0.25; 3]; 8])?);
    /// assert_eq!(chalk.rho_hat(Direction::Z, Direction::from_angles(1.0, 0.3)), [0.25; 3]);
    /// # Ok::<(), brdf::MeasuredError>(())
    /// ```
    pub fn new(shape: [usize; 3], mut values: Vec<[f32; 3]>) -> Result<Self, MeasuredError> {
        let expected = Self::entries(shape)?;
        if values.len() != expected {
            return Err(MeasuredError::Length { expected, found: values.len() });
        }
        refuse_values(&values)?;
        let [_, n_d, n_phi] = shape;
        for (row, values) in values.chunks_exact_mut(n_phi).enumerate() {
            if row < n_d || row % n_d == 0 {
                let sum = |channel: usize| values.iter().map(|rgb| f64::from(rgb[channel])).sum::<f64>();
                let mean = [0, 1, 2].map(|channel| (sum(channel) / n_phi as f64) as f32);
                values.fill(mean);
            }
        }
        Ok(Self { shape, values: values.into(), scale: [1.0; 3] })
    }

    /// The number of entries of a table of this shape.
    pub(crate) fn entries(shape: [usize; 3]) -> Result<usize, MeasuredError> {
        let entries = shape.iter().try_fold(1usize, |product, &n| product.checked_mul(n));
        entries.filter(|n| (1..=MOST_ENTRIES).contains(n)).ok_or(MeasuredError::Shape { shape })
    }

    /// Returns the same BRDF times a colour, which replaces an earlier one.
    ///
    /// # Errors
    /// If a channel is not a number from 0 to 1e6.
    pub fn scaled(self, scale: [f64; 3]) -> Result<Self, ParameterError> {
        Ok(Self { scale: colour("scale", scale)?, ..self })
    }

    /// The shape of the table: n_h, n_d, n_phi.
    pub fn shape(&self) -> [usize; 3] {
        self.shape
    }

    /// The table, before the scale: [n_h, n_d, n_phi], RGB, in 1/sr.
    pub fn values(&self) -> &[[f32; 3]] {
        &self.values
    }

    /// The colour that multiplies the table.
    pub fn scale(&self) -> [f64; 3] {
        self.scale
    }

    /// theta_h, theta_d and phi_d of an entry of a table of this shape.
    pub fn node(shape: [usize; 3], entry: [usize; 3]) -> [f64; 3] {
        let [h, d, phi] = [0, 1, 2].map(|axis| entry[axis] as f64 / shape[axis] as f64);
        [h * h * FRAC_PI_2, d * FRAC_PI_2, phi * PI]
    }

    /// The BRDF in 1/sr, without the cosine. Both directions point away from the surface, whose normal is +Z.
    ///
    /// Reciprocal, bit for bit.
    pub fn brdf(&self, incident: Direction, outgoing: Direction) -> [f64; 3] {
        let [theta_h, theta_d, phi_d] = half_difference(incident, outgoing);
        let [n_h, n_d, n_phi] = self.shape;
        let (h, to_h) = place((theta_h / FRAC_PI_2).max(0.0).sqrt(), n_h);
        let (d, to_d) = place(theta_d / FRAC_PI_2, n_d);
        let turn = (phi_d / PI * n_phi as f64).max(0.0);
        let (phi, to_phi) = (turn as usize % n_phi, turn.fract());
        let next = (phi + 1) % n_phi;
        let mut sum = [0.0; 3];
        for (i, weight_h) in [(h, 1.0 - to_h), ((h + 1).min(n_h - 1), to_h)] {
            for (j, weight_d) in [(d, 1.0 - to_d), ((d + 1).min(n_d - 1), to_d)] {
                let row = (i * n_d + j) * n_phi;
                let (low, high) = (self.values[row + phi], self.values[row + next]);
                for channel in 0..3 {
                    let [low, high] = [low, high].map(|rgb| f64::from(rgb[channel]));
                    sum[channel] += weight_h * weight_d * (low + (high - low) * to_phi);
                }
            }
        }
        [0, 1, 2].map(|channel| sum[channel] * self.scale[channel])
    }

    pub(crate) const NAME: &str = "measured";

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

    pub(crate) fn constants(&self) -> MeasuredConstants {
        MeasuredConstants {
            shape: UVec3::from_array(self.shape.map(|n| n as u32)),
            scale: packed::rgb(self.scale),
            table: MeasuredTableConstants { values: Arc::clone(&self.values) },
        }
    }

    /// The lobes to sample: a cosine, and facets as wide as the table: see [`facet_width`].
    pub(crate) fn lobes(&self) -> Vec<Lobe> {
        let [n_h, n_d, n_phi] = self.shape;
        let grey = |h: usize| self.values[h * n_d * n_phi].iter().map(|value| f64::from(*value)).sum::<f64>();
        let theta = |h: usize| Self::node(self.shape, [h, 0, 0])[0];
        vec![Lobe::facets([facet_width(n_h, theta, grey); 2]), Lobe::Cosine]
    }
}

impl fmt::Debug for Measured {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Measured")
            .field("shape", &self.shape)
            .field("scale", &self.scale)
            .finish_non_exhaustive()
    }
}

/// The width of GGX facets that fall to a half at the angle at which a table, seen along the normal, falls
/// half way from its peak to its value at 60 degrees: D is a half at tan^2(theta_h) = a^2 (sqrt(2) - 1). The
/// table has `grey` at `count` angles `theta`.
pub(crate) fn facet_width(count: usize, theta: impl Fn(usize) -> f64, grey: impl Fn(usize) -> f64) -> f64 {
    let base = (0..count).take_while(|h| theta(*h) < 60f64.to_radians()).last().map_or(0.0, &grey);
    let half = 0.5 * (grey(0) + base);
    let tangent = (0..count).find(|h| grey(*h) < half).map_or(1.0, |h| math::tan(theta(h)));
    tangent / (2f64.sqrt() - 1.0).sqrt()
}

/// theta_h, theta_d and phi_d of two directions over a surface with normal +Z; phi_d in [0, pi), by
/// reciprocity.
///
/// If the half vector is the normal, phi_d is the azimuth of a direction (an isotropic BRDF does not depend
/// on it); if both directions are the same, it is 0.
pub fn half_difference(incident: Direction, outgoing: Direction) -> [f64; 3] {
    let sum = incident.vector() + outgoing.vector();
    let difference = incident.vector() - outgoing.vector();
    let theta_d = math::atan2(difference.length(), sum.length());
    let across = math::hypot(sum.x, sum.y);
    let theta_h = math::atan2(across, sum.z);
    let (cos_phi, sin_phi) = if across > 0.0 { (sum.x / across, sum.y / across) } else { (1.0, 0.0) };
    let (sin_theta, cos_theta) = math::sin_cos(theta_h);
    let x = (difference.x * cos_phi + difference.y * sin_phi) * cos_theta - difference.z * sin_theta;
    let y = difference.y * cos_phi - difference.x * sin_phi;
    // Exchanging light and view changes the sign of the difference.
    let (x, y) = if y < 0.0 || (y == 0.0 && x < 0.0) { (-x, -y) } else { (x, y) };
    let phi_d = if x == 0.0 && y == 0.0 { 0.0 } else { math::atan2(y, x) };
    [theta_h, theta_d, if phi_d < PI { phi_d } else { 0.0 }]
}

/// The incident and the outgoing direction at theta_h, theta_d and phi_d, half vector in the plane of +X and
/// +Z.
///
/// Either may lie below the horizon.
pub fn from_half_difference([theta_h, theta_d, phi_d]: [f64; 3]) -> [Direction; 2] {
    let (sin_h, cos_h) = math::sin_cos(theta_h);
    let half = DVec3::new(sin_h, 0.0, cos_h);
    let away = DVec3::new(cos_h, 0.0, -sin_h) * math::cos(phi_d) + DVec3::Y * math::sin(phi_d);
    let (sin_d, cos_d) = math::sin_cos(theta_d);
    [1.0, -1.0].map(|side| Direction::from_unit(half * cos_d + away * (side * sin_d)))
}

/// # Errors
/// If a value is negative or not finite.
pub(crate) fn refuse_values(values: &[[f32; 3]]) -> Result<(), MeasuredError> {
    let good = |value: f32| value.is_finite() && value >= 0.0;
    for (entry, rgb) in values.iter().enumerate() {
        if let Some(&value) = rgb.iter().find(|&&value| !good(value)) {
            return Err(MeasuredError::Value { entry, value });
        }
    }
    Ok(())
}

/// The node before `share` of an axis of n nodes at 0, 1/n, 2/n ..., and how far the share is on the way to
/// the next, 0 to 1.
pub(crate) fn place(share: f64, n: usize) -> (usize, f64) {
    let at = (share * n as f64).min((n - 1) as f64);
    let node = at as usize;
    (node, at - node as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A table of f(theta_h, theta_d, phi_d).
    fn table(shape: [usize; 3], f: impl Fn([f64; 3]) -> f64) -> Measured {
        let mut values = Vec::new();
        for i in 0..shape[0] {
            for j in 0..shape[1] {
                for k in 0..shape[2] {
                    let value = f(Measured::node(shape, [i, j, k])) as f32;
                    values.push([value, 2.0 * value, 0.5]);
                }
            }
        }
        Measured::new(shape, values).unwrap()
    }

    fn pairs() -> impl Iterator<Item = [Direction; 2]> {
        let directions = |seed: f64| {
            (0..40).map(move |i| {
                let i = f64::from(i) + seed;
                Direction::from_angles((i * 0.618_034).fract() * 1.57, i * 2.399_963)
            })
        };
        directions(0.1).zip(directions(7.3)).map(|(incident, outgoing)| [incident, outgoing])
    }

    #[test]
    fn angles_round_trip() {
        for [incident, outgoing] in pairs() {
            let angles = half_difference(incident, outgoing);
            let [light, view] = from_half_difference(angles);
            let back = half_difference(light, view);
            for axis in 0..3 {
                assert!((angles[axis] - back[axis]).abs() < 1e-12, "{angles:?} {back:?}");
            }
            // The pair is the same, up to a turn and an exchange of both.
            assert!((light.dot(view) - incident.dot(outgoing)).abs() < 1e-12);
            let mut heights = [light.vector().z, view.vector().z, incident.vector().z, outgoing.vector().z];
            heights[..2].sort_by(f64::total_cmp);
            heights[2..].sort_by(f64::total_cmp);
            assert!((heights[0] - heights[2]).abs() < 1e-12 && (heights[1] - heights[3]).abs() < 1e-12);
        }
    }

    #[test]
    fn the_brdf_is_reciprocal_bit_for_bit() {
        let measured = table([7, 5, 9], |[h, d, phi]| 1.0 + (3.0 * h + d).sin() * (2.0 * phi + 0.4).cos());
        for [incident, outgoing] in pairs() {
            assert_eq!(measured.brdf(incident, outgoing), measured.brdf(outgoing, incident));
        }
    }

    /// The interpolation error of a function with second derivatives below 4 in (sqrt-theta_h, theta_d,
    /// phi_d) shares is 1/8 of that times the step squared in each axis: 3 * 4 / 8 / 60^2 * (pi/2)^2 < 2e-3,
    /// less near the poles.
    #[test]
    fn the_lookup_follows_a_smooth_function() {
        let f = |[h, d, phi]: [f64; 3]| {
            0.6 + 0.3 * d.cos() * h.cos() + 0.1 * (h * d).sin().powi(2) * (2.0 * phi).cos()
        };
        let measured = table([60, 60, 60], f);
        for [incident, outgoing] in pairs() {
            let angles = half_difference(incident, outgoing);
            if angles[1] < 59.0 / 60.0 * FRAC_PI_2 && angles[0] < (59.0f64 / 60.0).powi(2) * FRAC_PI_2 {
                let found = measured.brdf(incident, outgoing);
                assert!((found[0] - f(angles)).abs() < 2e-3, "{angles:?}: {found:?} {}", f(angles));
                assert!((found[1] - 2.0 * found[0]).abs() < 1e-6 && (found[2] - 0.5).abs() < 1e-6);
            }
        }
    }

    /// Across the poles, and over the seam phi_d = pi = 0, a small step changes little: slope times step.
    #[test]
    fn the_lookup_is_continuous_at_the_poles_and_over_the_seam() {
        let measured = table([6, 6, 8], |[h, d, phi]| 0.5 + 0.4 * (5.0 * h + 3.0 * d + phi).sin());
        let near = |a: [f64; 3], b: [f64; 3]| (a[0] - b[0]).abs() < 2e-3;
        for phi in [0.0, 0.8, 2.1, 3.0] {
            let [i, o] = from_half_difference([1e-8, 0.7, phi]);
            let [i_0, o_0] = from_half_difference([0.0, 0.7, 0.0]);
            assert!(near(measured.brdf(i, o), measured.brdf(i_0, o_0)));
            let [i, o] = from_half_difference([0.5, 1e-5, phi]);
            let [i_0, o_0] = from_half_difference([0.5, 0.0, 0.0]);
            assert!(near(measured.brdf(i, o), measured.brdf(i_0, o_0)));
        }
        let [before, after] = [-1e-5, 1e-5].map(|phi| from_half_difference([0.5, 0.7, phi]));
        assert!(near(measured.brdf(before[0], before[1]), measured.brdf(after[0], after[1])));
    }

    #[test]
    fn rho_hat_holds_the_cosine_the_scale_and_the_horizon() {
        let measured = table([2, 2, 2], |_| 0.25).scaled([2.0, 1.0, 0.0]).unwrap();
        let light = Direction::from_angles(PI / 3.0, 2.0);
        let value = measured.rho_hat(light, Direction::Z);
        assert!((value[0] - 0.25).abs() < 1e-15 && (value[1] - 0.25).abs() < 1e-15 && value[2] == 0.0);
        assert_eq!(measured.rho_hat(Direction::X, Direction::Z), [0.0; 3]);
        assert_eq!(measured.rho_hat(Direction::from_angles(2.0, 0.0), Direction::Z), [0.0; 3]);
        assert_eq!(measured.scaled([-1.0; 3]).unwrap_err().parameter, "scale");
    }

    #[test]
    fn impossible_tables_are_errors() {
        let huge = [usize::MAX, 2, 2];
        assert_eq!(Measured::new(huge, vec![]), Err(MeasuredError::Shape { shape: huge }));
        assert_eq!(Measured::new([0, 2, 2], vec![]), Err(MeasuredError::Shape { shape: [0, 2, 2] }));
        assert_eq!(
            Measured::new([2, 1, 1], vec![[0.0; 3]]),
            Err(MeasuredError::Length { expected: 2, found: 1 })
        );
        let error = Measured::new([2, 1, 1], vec![[0.0; 3], [0.0, -1.0, 0.0]]).unwrap_err();
        assert_eq!(error, MeasuredError::Value { entry: 1, value: -1.0 });
        assert_eq!(error.to_string(), "entry 1 has a value of -1; expected a finite number, 0 or more");
        assert!(Measured::new([1, 1, 1], vec![[f32::NAN; 3]]).is_err());
        assert!(Measured::new([1, 1, 1], vec![[f32::INFINITY; 3]]).is_err());
    }
}
