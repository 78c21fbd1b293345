//! A unit vector in Specula's frame: right-handed, +Z up and the polar axis.

use glam::DVec3;

/// A unit vector in Specula's frame (right-handed, +Z up).
///
/// Spherical angles: theta is measured from +Z, phi from +X toward +Y.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Direction(DVec3);

impl Direction {
    /// +X: the centre of a lat-long image.
    pub const X: Self = Self(DVec3::X);
    /// +Y: a quarter of the way from the left of a lat-long image.
    pub const Y: Self = Self(DVec3::Y);
    /// +Z: up, the polar axis.
    pub const Z: Self = Self(DVec3::Z);

    /// The direction of `v`, or `None` if `v` is zero or not finite.
    pub fn new(v: DVec3) -> Option<Self> {
        v.try_normalize().map(Self)
    }

    /// The direction of a vector that is known to be neither zero nor infinite.
    ///
    /// # Panics
    /// In debug builds, if `v` cannot be normalised.
    #[inline]
    pub fn normalised(v: DVec3) -> Self {
        Self(v.normalize())
    }

    /// The direction of a vector whose length is 1 up to rounding, without normalising it.
    ///
    /// # Panics
    /// In debug builds, if the length is not 1 within 1e-6.
    #[inline]
    pub fn from_unit(v: DVec3) -> Self {
        debug_assert!((v.length_squared() - 1.0).abs() < 2e-6, "not a unit vector: {v}");
        Self(v)
    }

    /// The direction at colatitude `theta` and azimuth `phi`, in radians.
    pub fn from_angles(theta: f64, phi: f64) -> Self {
        let (sin_theta, cos_theta) = math::sin_cos(theta);
        let (sin_phi, cos_phi) = math::sin_cos(phi);
        Self(DVec3::new(sin_theta * cos_phi, sin_theta * sin_phi, cos_theta))
    }

    /// The colatitude in [0, pi], accurate at the poles.
    pub fn theta(self) -> f64 {
        math::atan2((self.0.x * self.0.x + self.0.y * self.0.y).sqrt(), self.0.z)
    }

    /// The azimuth in (-pi, pi]; 0 at the poles.
    pub fn phi(self) -> f64 {
        if self.0.x == 0.0 && self.0.y == 0.0 { 0.0 } else { math::atan2(self.0.y, self.0.x) }
    }

    /// The direction as a unit vector.
    #[inline]
    pub fn vector(self) -> DVec3 {
        self.0
    }

    /// The cosine of the angle between two directions.
    pub fn dot(self, other: Self) -> f64 {
        self.0.dot(other.0)
    }
}
