//! A turntable camera.
//!
//! It orbits a point; up is always +Z. It frames a ball: the ball's outline touches the shorter side of the
//! picture, at a distance of r / sin(half the field of view), so that the ball's size does not change when
//! the camera turns or when the window changes its shape. Pixels are square.

use glam::{DMat4, DVec3};
use sphere::Direction;

/// The ball that a camera frames, or the part of one between two heights.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Framing {
    /// The centre of the ball, in the world.
    pub centre: DVec3,
    /// The radius of the ball, above 0.
    pub radius: f64,
    /// Half the height of what is framed, above 0: the radius, unless it is something low and wide.
    pub height: f64,
}

impl Framing {
    /// The framing of a whole ball.
    pub fn ball(centre: DVec3, radius: f64) -> Self {
        Self { centre, radius, height: radius }
    }

    /// The smaller ball that a camera frames in a picture of this size: in a wide picture, something low and
    /// wide may reach past the ball's sides.
    pub(crate) fn within(self, size: [u32; 2]) -> Self {
        /// The least share of the radius: it keeps the camera outside.
        const LEAST_SHARE: f64 = 0.45;
        let [width, height] = size.map(|side| f64::from(side.max(1)));
        let shorter = width.min(height);
        let wide = self.radius * (shorter / width).max(LEAST_SHARE);
        Self::ball(self.centre, wide.max(self.height * (shorter / height)))
    }
}

/// A camera that orbits a ball. Angles in radians.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// The ball that the camera frames.
    pub framing: Framing,
    /// The camera's angle around the ball: 0 on the +X side (the front of glTF models), growing toward +Y.
    pub yaw: f64,
    /// The camera's elevation, -pi/2 to pi/2; with a positive one it looks down.
    pub pitch: f64,
    /// The magnification: 1 frames the ball; 2 shows it twice as large.
    pub zoom: f64,
    /// The field of view over the shorter side of the picture, above 0 and below pi.
    pub field: f64,
}

impl Camera {
    /// A camera of 30 degrees in front of a ball, a little above.
    pub fn new(framing: Framing) -> Self {
        Self { framing, yaw: 0.0, pitch: 0.2, zoom: 1.0, field: 30.0_f64.to_radians() }
    }

    /// The camera's axes right, up and forward, in the world, orthonormal.
    pub fn axes(&self) -> [DVec3; 3] {
        let (sine, cosine) = math::sin_cos(self.yaw);
        let (up, level) = math::sin_cos(self.pitch);
        let forward = -DVec3::new(level * cosine, level * sine, up);
        let right = DVec3::new(-sine, cosine, 0.0);
        [right, right.cross(forward), forward]
    }

    /// The distance of the eye from the centre of the ball.
    pub fn distance(&self) -> f64 {
        self.framing.radius / math::sin(self.field / 2.0)
    }

    /// The place of the eye, in the world.
    pub fn eye(&self) -> DVec3 {
        self.framing.centre - self.axes()[2] * self.distance()
    }

    /// The direction from the centre of the ball to the eye: the view of a distant viewer.
    pub fn view(&self) -> Direction {
        Direction::normalised(-self.axes()[2])
    }

    /// Half the width and half the height of the picture at distance 1, divided by the zoom.
    pub fn half_extent(&self, size: [u32; 2]) -> [f64; 2] {
        let [width, height] = size.map(|side| f64::from(side.max(1)));
        let shorter = math::tan(self.field / 2.0) / self.zoom / width.min(height);
        [width * shorter, height * shorter]
    }

    /// The ray through a point of the picture, of any length. `size` is the lower right corner.
    pub fn ray(&self, size: [u32; 2], at: [f64; 2]) -> DVec3 {
        let [right, up, forward] = self.axes();
        let half = self.half_extent(size);
        let x = 2.0 * at[0] / f64::from(size[0].max(1)) - 1.0;
        let y = 1.0 - 2.0 * at[1] / f64::from(size[1].max(1));
        forward + right * (x * half[0]) + up * (y * half[1])
    }

    /// The matrix from the world to wgpu's clip coordinates: x right, y up, z / w from 0 (near) to 1 (far).
    pub fn projection(&self, size: [u32; 2]) -> DMat4 {
        let [right, up, forward] = self.axes();
        let eye = self.eye();
        let half = self.half_extent(size);
        let near = (self.distance() - self.framing.radius).max(1e-3 * self.framing.radius) / 2.0;
        let far = self.distance() + 4.0 * self.framing.radius;
        let row = |axis: DVec3, scale: f64| (axis * scale).extend(-axis.dot(eye) * scale);
        let depth = row(forward, far / (far - near)) - DVec3::ZERO.extend(far * near / (far - near));
        DMat4::from_cols(row(right, 1.0 / half[0]), row(up, 1.0 / half[1]), depth, row(forward, 1.0))
            .transpose()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn camera() -> Camera {
        let framing = Framing::ball(DVec3::new(0.3, -0.2, 1.0), 0.7);
        Camera { yaw: 0.8, pitch: 0.3, ..Camera::new(framing) }
    }

    #[test]
    fn the_projection_and_the_rays_agree() {
        let (camera, size) = (camera(), [640, 360]);
        for at in [[0.0, 0.0], [640.0, 0.0], [123.5, 301.25], [320.0, 180.0]] {
            let point = camera.eye() + camera.ray(size, at) * 2.5;
            let clip = camera.projection(size) * point.extend(1.0);
            let x = (clip.x / clip.w + 1.0) / 2.0 * 640.0;
            let y = (1.0 - clip.y / clip.w) / 2.0 * 360.0;
            assert!((x - at[0]).abs() < 1e-9 && (y - at[1]).abs() < 1e-9, "{at:?}: {x} {y}");
            assert!((0.0..1.0).contains(&(clip.z / clip.w)));
        }
    }

    /// The rays from the eye that touch the ball have the angle asin(r / d), half the field of view at the
    /// middle of the shorter side.
    #[test]
    fn the_ball_touches_the_shorter_side_from_everywhere() {
        for (size, middle) in [([640, 360], [320.0, 0.0]), ([300, 500], [0.0, 250.0])] {
            for turn in 0..5 {
                let camera = Camera { yaw: f64::from(turn), pitch: 0.3 * f64::from(turn) - 0.6, ..camera() };
                let ray = camera.ray(size, middle).normalize();
                let toward = camera.framing.centre - camera.eye();
                let miss = (toward - ray * toward.dot(ray)).length();
                assert!((miss - camera.framing.radius).abs() < 1e-9, "{miss}");
            }
        }
    }

    /// A ball stays as it is in a picture of any shape. A row of five is as wide as a wide picture.
    #[test]
    fn a_row_fills_a_wide_picture() {
        let ball = Framing::ball(DVec3::ZERO, 0.7);
        for size in [[640, 360], [360, 640], [100, 100]] {
            assert_eq!(ball.within(size), ball, "{size:?}");
        }
        let row = Framing { centre: DVec3::ZERO, radius: 5.4, height: 1.0 };
        assert!((row.within([1600, 900]).radius - 5.4 * 9.0 / 16.0).abs() < 1e-12);
        assert_eq!(row.within([300, 300]).radius, 5.4);
        assert_eq!(row.within([300, 600]).radius, 5.4);
        assert_eq!(row.within([9000, 300]).radius, 0.45 * 5.4);
        let camera = Camera::new(row.within([9000, 300]));
        assert!(camera.distance() > 5.4, "the camera is outside, wherever it turns");
    }

    #[test]
    fn at_rest_it_looks_along_minus_x_with_z_up() {
        let camera = Camera { pitch: 0.0, ..Camera::new(Framing::ball(DVec3::ZERO, 1.0)) };
        let [right, up, forward] = camera.axes();
        assert!((forward + DVec3::X).length() < 1e-15 && (up - DVec3::Z).length() < 1e-15);
        assert!((right - DVec3::Y).length() < 1e-15);
    }
}
