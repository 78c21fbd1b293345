//! Active, right-handed rotations: yaw about +Z, pitch about +Y, roll about +X.

use glam::{DMat3, DQuat, DVec3};

use crate::Direction;

/// An active, right-handed rotation: it maps a direction w to R w, and a function f(w) to f(R^-1 w).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rotation(DQuat);

/// ZYZ angles of a rotation, in radians: R = R_z(alpha) R_y(beta) R_z(gamma), beta in [0, pi].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Zyz {
    /// The last rotation about +Z.
    pub alpha: f64,
    /// The rotation about +Y, in [0, pi].
    pub beta: f64,
    /// The first rotation about +Z.
    pub gamma: f64,
}

impl Rotation {
    /// The rotation that changes nothing.
    pub const IDENTITY: Self = Self(DQuat::IDENTITY);

    /// Makes the rotation R_z(yaw) R_y(pitch) R_x(roll), in radians. A positive pitch lowers +X.
    pub fn from_yaw_pitch_roll(yaw: f64, pitch: f64, roll: f64) -> Self {
        Self(about(DVec3::Z, yaw) * about(DVec3::Y, pitch) * about(DVec3::X, roll))
    }

    /// The yaw, pitch and roll of this rotation, in radians; if the pitch is 90 degrees up or down, the roll
    /// is 0.
    pub fn yaw_pitch_roll(self) -> [f64; 3] {
        let [x, y, z] = [self.matrix().x_axis, self.matrix().y_axis, self.matrix().z_axis];
        let level = math::hypot(x.x, x.y);
        let pitch = math::atan2(-x.z, level);
        // Straight up or down, yaw and roll turn about one axis.
        match level < 1e-9 {
            true => [math::atan2(-y.x, y.y), pitch, 0.0],
            false => [math::atan2(x.y, x.x), pitch, math::atan2(y.z, z.z)],
        }
    }

    /// The unit quaternion [x, y, z, w] of this rotation.
    pub fn quaternion(self) -> [f64; 4] {
        self.0.to_array()
    }

    /// The rotation of a quaternion (x, y, z, w), normalised; `None` if it is zero or not finite.
    pub fn from_quaternion(x: f64, y: f64, z: f64, w: f64) -> Option<Self> {
        let length = DQuat::from_xyzw(x, y, z, w).length();
        (length.is_finite() && length > 0.0)
            .then(|| Self(DQuat::from_xyzw(x / length, y / length, z / length, w / length)))
    }

    /// Makes the rotation R_z(alpha) R_y(beta) R_z(gamma).
    pub fn from_zyz(zyz: Zyz) -> Self {
        Self(about(DVec3::Z, zyz.alpha) * about(DVec3::Y, zyz.beta) * about(DVec3::Z, zyz.gamma))
    }

    /// The ZYZ angles of this rotation; gamma is 0 if beta is 0 or pi.
    pub fn zyz(self) -> Zyz {
        // q = (sin(b/2) sin((g-a)/2), sin(b/2) cos((g-a)/2), cos(b/2) sin((a+g)/2), cos(b/2) cos((a+g)/2))
        let q = self.0;
        let (sine, cosine) = (math::hypot(q.x, q.y), math::hypot(q.z, q.w));
        let beta = 2.0 * math::atan2(sine, cosine);
        let sum = math::atan2(q.z, q.w);
        let difference = math::atan2(q.x, q.y);
        if sine == 0.0 {
            Zyz { alpha: 2.0 * sum, beta, gamma: 0.0 }
        } else if cosine == 0.0 {
            Zyz { alpha: -2.0 * difference, beta, gamma: 0.0 }
        } else {
            Zyz { alpha: sum - difference, beta, gamma: sum + difference }
        }
    }

    /// Applies the rotation to a direction: R w.
    pub fn apply(self, direction: Direction) -> Direction {
        Direction::normalised(self.0 * direction.vector())
    }

    /// The inverse rotation.
    pub fn inverse(self) -> Self {
        Self(self.0.conjugate())
    }

    /// The rotation that applies `first`, then `self`.
    pub fn after(self, first: Self) -> Self {
        Self((self.0 * first.0).normalize())
    }

    /// The 3 x 3 matrix of this rotation.
    pub fn matrix(self) -> DMat3 {
        DMat3::from_quat(self.0)
    }
}

/// The rotation about a unit axis; glam's own would take the system's sine.
fn about(axis: DVec3, angle: f64) -> DQuat {
    let (sine, cosine) = math::sin_cos(0.5 * angle);
    DQuat::from_vec4((sine * axis).extend(cosine))
}
