//! The mirror ball: a distant photograph of a reflecting sphere.
//!
//! The image centre shows +Z_file (the camera's side), up is +Y_file, image right is +X_file: a reflection is
//! mirrored. In coordinates (a, b) of the unit disk, a to the right and b up, a direction at the angle t from
//! +Z_file has radius r = sin(t / 2). From dr = cos(t / 2) / 2 dt and sin(t) = 2 r cos(t / 2), dw = sin(t) dt
//! dpsi = 4 r dr dpsi: the map preserves areas. The whole rim is one direction, -Z_file.

use glam::DVec3;

use crate::{Direction, from_file, to_file};

/// A mirror ball that fills an image of `edge` x `edge` texels; only texels whose centre is in the inscribed
/// disk have a direction.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct MirrorBall {
    /// The number of texels along an edge of the square image.
    pub edge: usize,
}

impl MirrorBall {
    /// The direction of a texel's centre; `None` outside the disk.
    pub fn direction(self, row: usize, column: usize) -> Option<Direction> {
        self.direction_at(column as f64, row as f64)
    }

    /// The direction at continuous pixel coordinates (column, row); a texel's centre is at whole numbers.
    /// `None` outside the disk.
    pub fn direction_at(self, column: f64, row: f64) -> Option<Direction> {
        let half = self.edge as f64 / 2.0;
        let (a, b) = ((column + 0.5) / half - 1.0, 1.0 - (row + 0.5) / half);
        let squared = a * a + b * b;
        if squared > 1.0 {
            return None;
        }
        // cos(t) = 1 - 2 r^2, sin(t) / r = 2 cos(t / 2) = 2 sqrt(1 - r^2)
        let scale = 2.0 * (1.0 - squared).sqrt();
        Some(Direction::normalised(from_file(DVec3::new(a * scale, b * scale, 1.0 - 2.0 * squared))))
    }

    /// Continuous pixel coordinates (column, row) of a direction; a texel's centre is at whole numbers.
    ///
    /// -Z_file, which is the whole rim, is placed at its right end.
    pub fn position(self, direction: Direction) -> (f64, f64) {
        let d = to_file(direction.vector());
        let squared = d.x * d.x + d.y * d.y;
        // r / sin(t), without cancellation on either side
        let (a, b) = if d.z >= 0.0 {
            let scale = 1.0 / (2.0 * (1.0 + d.z)).sqrt();
            (d.x * scale, d.y * scale)
        } else if squared > 0.0 {
            let scale = ((1.0 - d.z) / (2.0 * squared)).sqrt();
            (d.x * scale, d.y * scale)
        } else {
            (1.0, 0.0)
        };
        let half = self.edge as f64 / 2.0;
        ((a + 1.0) * half - 0.5, (1.0 - b) * half - 0.5)
    }

    /// The solid angle of the part of a texel that lies in the disk, in steradians: four times its area in
    /// the unit disk, exactly. The sum over all texels is 4 pi.
    pub fn solid_angle(self, row: usize, column: usize) -> f64 {
        let at = |k: usize| 2.0 * k as f64 / self.edge as f64 - 1.0;
        let (x0, x1, y0, y1) = (at(column), at(column + 1), at(row), at(row + 1));
        let area = corner(x1, y1) - corner(x0, y1) - corner(x1, y0) + corner(x0, y0);
        4.0 * area.max(0.0)
    }
}

/// The area that the unit disk shares with the rectangle from the centre to (x, y), |x| and |y| <= 1; odd in
/// both.
fn corner(x: f64, y: f64) -> f64 {
    let (width, height) = (x.abs().min(1.0), y.abs().min(1.0));
    let area = if width * width + height * height <= 1.0 {
        width * height
    } else {
        let under = |t: f64| (t * (1.0 - t * t).max(0.0).sqrt() + math::asin(t)) / 2.0;
        let flat = (1.0 - height * height).sqrt();
        flat * height + under(width) - under(flat)
    };
    if (x < 0.0) == (y < 0.0) { area } else { -area }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::f64::consts::PI;

    #[test]
    fn solid_angles_make_4_pi() {
        for edge in [1, 2, 7, 64, 301] {
            let ball = MirrorBall { edge };
            let sum: f64 = (0..edge * edge).map(|texel| ball.solid_angle(texel / edge, texel % edge)).sum();
            // Each texel is a difference of areas near 1, so each may be off by a few 1e-16.
            assert!((sum - 4.0 * PI).abs() < 1e-15 * (10 + edge * edge) as f64, "{edge}: {sum}");
        }
    }

    proptest! {
        #[test]
        fn position_undoes_direction(column in -0.5..255.5f64, row in -0.5..255.5f64) {
            let ball = MirrorBall { edge: 256 };
            if let Some(direction) = ball.direction_at(column, row) {
                let (x, y) = ball.position(direction);
                // Toward the rim sin(t) falls to 0 and one rounding of the vector moves the azimuth by
                // 1e-16 / sin(t), that is by 128 x 1e-16 / sin(t) texels.
                let t = direction.vector().x.clamp(-1.0, 1.0).acos();
                let tolerance = 1e-11 + 1e-13 / t.sin().max(1e-13);
                prop_assert!((x - column).hypot(y - row) < tolerance, "{x} {y}");
            }
        }

        #[test]
        fn direction_undoes_position(theta in 0.0..PI, phi in -PI..PI) {
            let ball = MirrorBall { edge: 1000 };
            let direction = Direction::from_angles(theta, phi);
            let (x, y) = ball.position(direction);
            if let Some(back) = ball.direction_at(x, y) {
                // Near -Z_file r = 1 - s^2 / 8, so that s is accurate only to the square root of the rounding
                // there.
                let tolerance = if direction.vector().x < -0.999 { 1e-7 } else { 1e-12 };
                prop_assert!((back.vector() - direction.vector()).length() < tolerance);
            }
        }
    }
}
