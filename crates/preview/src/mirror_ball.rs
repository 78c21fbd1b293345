//! The sphere of directions on a disk: what a mirror ball shows to a viewer who is far away.
//!
//! The point (x, y) of the unit disk is the place of the ball whose normal is n = (x, y, sqrt(1 - x^2 -
//! y^2)) in the camera's axes: right, up, and toward the camera e. It shows the direction 2 (n . e) n - e.
//! The middle shows e, the rim -e. The radius of a direction at an angle theta from e is sin(theta / 2), so
//! that the map preserves areas, up to a constant factor: points are as dense on the disk as on the sphere.

use glam::{DMat3, Vec2, Vec3};

use crate::Shot;

/// A mirror ball, in the light's frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct MirrorBall {
    right: Vec3,
    up: Vec3,
    toward: Vec3,
}

impl MirrorBall {
    /// The ball that the camera of a shot sees.
    pub(crate) fn new(shot: &Shot) -> Self {
        let [right, up, toward] = camera_axes(shot).to_cols_array_2d();
        let [right, up, toward] = [right, up, toward].map(|axis| Vec3::from(axis.map(|value| value as f32)));
        Self { right, up, toward }
    }

    /// The direction that a point of the disk shows; `None` outside the disk.
    pub(crate) fn direction(&self, at: Vec2) -> Option<Vec3> {
        let rest = 1.0 - at.length_squared();
        if rest < 0.0 {
            return None;
        }
        let cosine = rest.sqrt();
        let [x, y, z] = [2.0 * cosine * at.x, 2.0 * cosine * at.y, 2.0 * rest - 1.0];
        Some(self.right * x + self.up * y + self.toward * z)
    }

    /// The point of the disk that shows a direction, a unit vector. Of the direction away from the camera,
    /// which the whole rim shows, the lowest point.
    pub(crate) fn place(&self, direction: Vec3) -> Vec2 {
        let half = (direction + self.toward).normalize_or_zero();
        if half == Vec3::ZERO { -Vec2::Y } else { Vec2::new(half.dot(self.right), half.dot(self.up)) }
    }
}

/// The camera's axes in the light's frame, as columns: right, up, and toward the camera.
pub(crate) fn camera_axes(shot: &Shot) -> DMat3 {
    let [right, up, forward] = shot.camera.axes();
    shot.turn.inverse().matrix() * DMat3::from_cols(right, up, -forward)
}

#[cfg(test)]
mod tests {
    use std::f32::consts::PI;

    use super::*;

    const BALL: MirrorBall = MirrorBall { right: Vec3::Y, up: Vec3::Z, toward: Vec3::X };

    #[test]
    fn a_direction_is_at_the_place_that_shows_it() {
        for k in 0..400 {
            let (radius, angle) = ((k as f32 + 0.5).sqrt() / 20.0, 2.399_963 * k as f32);
            let at = Vec2::from_angle(angle) * radius;
            let direction = BALL.direction(at).unwrap();
            assert!((direction.length() - 1.0).abs() < 1e-6);
            // Next to the rim, half of the direction and the view is short.
            assert!(BALL.place(direction).distance(at) < 1e-4, "{at}");
        }
        assert_eq!(BALL.direction(Vec2::ZERO), Some(Vec3::X));
        assert_eq!(BALL.direction(Vec2::new(0.8, 0.7)), None);
        assert_eq!(BALL.place(-Vec3::X), -Vec2::Y);
    }

    #[test]
    fn equal_areas_of_the_disk_are_equal_areas_of_the_sphere() {
        for theta in [0.1, 1.0, 2.0, 3.0_f32] {
            let direction = Vec3::new(theta.cos(), theta.sin(), 0.0);
            let cap = 2.0 * PI * (1.0 - theta.cos());
            let disk = PI * BALL.place(direction).length_squared();
            assert!((cap - 4.0 * disk).abs() < 1e-5, "{theta}");
        }
    }
}
