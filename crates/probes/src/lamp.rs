//! Lamps without a size: points, spots and directions, as KHR_lights_punctual has them.

use glam::Vec3;

/// The shape of a lamp's light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LampKind {
    /// Light from a point toward all sides.
    Point,
    /// Light from a point into a cone.
    Spot {
        /// The angle from the axis up to which the light is full, in radians.
        inner: f32,
        /// The angle from which on there is no light, in radians.
        outer: f32,
    },
    /// Parallel light from infinitely far away.
    Directional,
}

/// A lamp.
#[derive(Clone, Debug, PartialEq)]
pub struct Lamp {
    /// The name of its node, or of the light.
    pub name: String,
    /// The shape of its light.
    pub kind: LampKind,
    /// Where it is, in metres; without meaning for a directional one.
    pub position: [f32; 3],
    /// The way of its light, of length 1; without meaning for a point.
    pub direction: [f32; 3],
    /// Linear RGB.
    pub color: [f32; 3],
    /// Candela for points and spots, lux for directions.
    pub intensity: f32,
    /// The distance at which the light ends, in metres; `None` for none.
    pub range: Option<f32>,
}

/// The reason why something is not a lamp.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum LampError {
    /// The intensity or the colour is negative or not finite.
    #[error("its intensity or its colour is not a number of 0 or more")]
    Light,
    /// The position or the direction is not finite.
    #[error("its place is not finite")]
    Place,
    /// The angles are not 0 <= inner < outer <= 90 degrees.
    #[error("its cone is not one; expected 0 <= innerConeAngle < outerConeAngle <= pi / 2")]
    Cone,
    /// The range is not more than 0.
    #[error("its range is not a number above 0")]
    Range,
}

/// The light of a lamp at a place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Arriving {
    /// Toward the lamp.
    pub(crate) direction: Vec3,
    /// How far the lamp is; infinite for a directional one.
    pub(crate) distance: f32,
    /// The irradiance of a surface that faces the lamp, for colour times intensity = 1.
    pub(crate) irradiance: f32,
}

impl Lamp {
    pub(crate) fn check(&self) -> Result<(), LampError> {
        let light = self.color.map(|channel| channel * self.intensity);
        if !(light.iter().chain(&self.color).chain([&self.intensity])).all(|x| *x >= 0.0 && x.is_finite()) {
            return Err(LampError::Light);
        }
        let length = Vec3::from(self.direction).length();
        if !(Vec3::from(self.position).is_finite() && (length - 1.0).abs() < 1e-3) {
            return Err(LampError::Place);
        }
        if let LampKind::Spot { inner, outer } = self.kind
            && !(0.0 <= inner && inner < outer && outer <= std::f32::consts::FRAC_PI_2 + 1e-5)
        {
            return Err(LampError::Cone);
        }
        if self.range.is_some_and(|range| range.is_nan() || range <= 0.0) {
            return Err(LampError::Range);
        }
        Ok(())
    }

    /// The light at a place, before anything is in its way; `None` if there is none.
    ///
    /// The factors of `range` and of a spot's cone are those that the extension recommends.
    pub(crate) fn at(&self, place: Vec3) -> Option<Arriving> {
        let axis = Vec3::from(self.direction);
        if self.kind == LampKind::Directional {
            return Some(Arriving { direction: -axis, distance: f32::INFINITY, irradiance: 1.0 });
        }
        let way = Vec3::from(self.position) - place;
        let squared = way.length_squared();
        let distance = squared.sqrt();
        let direction = way / distance;
        if !direction.is_finite() || distance == 0.0 {
            return None;
        }
        let mut irradiance = 1.0 / squared;
        if let Some(range) = self.range {
            let share = squared / (range * range);
            irradiance *= (1.0 - share * share).clamp(0.0, 1.0);
        }
        if let LampKind::Spot { inner, outer } = self.kind {
            let (inner, outer) = (math::cos(inner), math::cos(outer));
            let scale = 1.0 / (inner - outer).max(0.001);
            let factor = ((-direction.dot(axis) - outer) * scale).clamp(0.0, 1.0);
            irradiance *= factor * factor;
        }
        (irradiance > 0.0).then_some(Arriving { direction, distance, irradiance })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lamp(kind: LampKind, range: Option<f32>) -> Lamp {
        let (position, direction) = ([0.0, 0.0, 2.0], [0.0, 0.0, -1.0]);
        Lamp { name: "lamp".into(), kind, position, direction, color: [1.0; 3], intensity: 3.0, range }
    }

    #[test]
    fn light_falls_off_as_the_extension_says() {
        let at = |lamp: &Lamp, place: [f32; 3]| lamp.at(place.into()).map_or(0.0, |found| found.irradiance);
        let point = lamp(LampKind::Point, None);
        assert_eq!((at(&point, [0.0; 3]), at(&point, [0.0, 0.0, 4.0])), (0.25, 0.25));
        let ranged = lamp(LampKind::Point, Some(4.0));
        assert_eq!((at(&ranged, [0.0; 3]), at(&ranged, [0.0, 0.0, -2.0])), (0.25 * (1.0 - 1.0 / 16.0), 0.0));
        let spot = lamp(LampKind::Spot { inner: 0.0, outer: 0.5 }, None);
        assert_eq!(at(&spot, [0.0; 3]), 0.25);
        assert_eq!(at(&spot, [2.0, 0.0, 0.0]), 0.0);
        let between = at(&spot, [0.5, 0.0, 0.0]) * 4.25;
        let expected = (((2.0 / 4.25_f32.sqrt()) - 0.5_f32.cos()) / (1.0 - 0.5_f32.cos())).powi(2);
        assert!((between - expected).abs() < 1e-4, "{between} {expected}");
        assert_eq!(at(&lamp(LampKind::Directional, None), [9.0; 3]), 1.0);
        assert_eq!(point.at(Vec3::new(0.0, 0.0, 2.0)), None);
    }

    #[test]
    fn lamps_that_are_none_say_why() {
        let wrong = |change: fn(&mut Lamp)| {
            let mut lamp = lamp(LampKind::Point, None);
            change(&mut lamp);
            lamp.check().unwrap_err()
        };
        assert_eq!(wrong(|lamp| lamp.color[1] = f32::NAN), LampError::Light);
        assert_eq!(wrong(|lamp| lamp.position[0] = f32::INFINITY), LampError::Place);
        assert_eq!(wrong(|lamp| lamp.kind = LampKind::Spot { inner: 0.5, outer: 0.4 }), LampError::Cone);
        assert_eq!(wrong(|lamp| lamp.range = Some(0.0)), LampError::Range);
    }
}
