//! The angular probe: the whole sphere in a disk, at a radius proportional to the angle from the centre.
//!
//! As seen from inside: the image centre looks along +Z_file, up is +Y_file, image right is -X_file (see
//! [`crate::to_file`]). In coordinates (a, b) of the unit disk, a to the right and b up, a direction at the
//! angle t from +Z_file has radius r = t / pi. From dw = sin(t) dt dpsi and dA = r dr dpsi, dw = pi sin(pi r)
//! / r dA. The whole rim is one direction, -Z_file.

use std::f64::consts::PI;

use glam::DVec3;

use crate::{Direction, from_file, to_file};

/// An angular map of `edge` x `edge` texels; only texels whose centre is in the inscribed disk have a
/// direction.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct AngularProbe {
    /// The number of texels along an edge of the square image.
    pub edge: usize,
}

impl AngularProbe {
    /// The direction of a texel's centre; `None` outside the disk.
    pub fn direction(self, row: usize, column: usize) -> Option<Direction> {
        self.direction_at(column as f64, row as f64)
    }

    /// The direction at continuous pixel coordinates (column, row); a texel's centre is at whole numbers.
    /// `None` outside the disk.
    pub fn direction_at(self, column: f64, row: f64) -> Option<Direction> {
        let half = self.edge as f64 / 2.0;
        let (a, b) = ((column + 0.5) / half - 1.0, 1.0 - (row + 0.5) / half);
        let r = math::hypot(a, b);
        if r > 1.0 {
            return None;
        }
        let (sine, cosine) = math::sin_cos(PI * r);
        let scale = if r > 0.0 { sine / r } else { PI };
        Some(Direction::normalised(from_file(DVec3::new(-a * scale, b * scale, cosine))))
    }

    /// Continuous pixel coordinates (column, row) of a direction; a texel's centre is at whole numbers.
    ///
    /// -Z_file, which is the whole rim, is placed at its right end.
    pub fn position(self, direction: Direction) -> (f64, f64) {
        let d = to_file(direction.vector());
        let sine = (d.x * d.x + d.y * d.y).sqrt();
        let (a, b) = if sine > 0.0 {
            let scale = math::atan2(sine, d.z) / (PI * sine);
            (-d.x * scale, d.y * scale)
        } else if d.z > 0.0 {
            (0.0, 0.0)
        } else {
            (1.0, 0.0)
        };
        let half = self.edge as f64 / 2.0;
        ((a + 1.0) * half - 0.5, (1.0 - b) * half - 0.5)
    }

    /// The solid angle of the part of a texel that lies in the disk, in steradians. The sum over all texels
    /// is 4 pi.
    ///
    /// Texels inside the disk are integrated with four Gauss points, whose error falls as edge^-4; texels on
    /// the rim, where the density of solid angle goes to 0, with the midpoints of a 16 x 16 grid.
    pub fn solid_angle(self, row: usize, column: usize) -> f64 {
        let half = self.edge as f64 / 2.0;
        let (a, b) = ((column as f64 + 0.5) / half - 1.0, (row as f64 + 0.5) / half - 1.0);
        let reach = 0.5 / half;
        let r = math::hypot(a, b);
        let mean = if r + 2.0 * reach < 1.0 {
            let offset = reach / 3.0_f64.sqrt();
            let pair = |y: f64| density(math::hypot(a - offset, y)) + density(math::hypot(a + offset, y));
            (pair(b - offset) + pair(b + offset)) / 4.0
        } else if r - 2.0 * reach > 1.0 {
            0.0
        } else {
            const POINTS: i32 = 16;
            let at = |k: i32| reach * (f64::from(2 * k + 1) / f64::from(POINTS) - 1.0);
            let sum: f64 = (0..POINTS * POINTS)
                .map(|k| density(math::hypot(a + at(k % POINTS), b + at(k / POINTS))))
                .sum();
            sum / f64::from(POINTS * POINTS)
        };
        mean / (half * half)
    }
}

/// Solid angle per area of the unit disk: pi sin(pi r) / r, and 0 outside.
fn density(r: f64) -> f64 {
    if r >= 1.0 {
        0.0
    } else if r < 1e-8 {
        PI * PI
    } else {
        PI * math::sin(PI * r) / r
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn solid_angles_make_4_pi() {
        for edge in [1, 2, 7, 64, 301] {
            let probe = AngularProbe { edge };
            let sum: f64 = (0..edge * edge).map(|texel| probe.solid_angle(texel / edge, texel % edge)).sum();
            // The midpoints resolve the rim to 1/16 of a texel, where the density has fallen to about pi^2 x
            // 2 / edge: the error is far below 2 pi pi^2 (2 / edge)^2 / 16.
            let bound = 2.0 * PI * PI * PI * (2.0 / edge as f64).powi(2) / 16.0;
            assert!((sum - 4.0 * PI).abs() < bound.min(0.2), "{edge}: {sum}");
        }
    }

    proptest! {
        #[test]
        fn position_undoes_direction(column in -0.5..255.5f64, row in -0.5..255.5f64) {
            let probe = AngularProbe { edge: 256 };
            if let Some(direction) = probe.direction_at(column, row) {
                let (x, y) = probe.position(direction);
                // Toward the rim sin(t) falls to 0 and one rounding of the vector moves the azimuth by
                // 1e-16 / sin(t), that is by 128 x 1e-16 / sin(t) texels.
                let t = direction.vector().x.clamp(-1.0, 1.0).acos();
                let tolerance = 1e-11 + 1e-13 / t.sin().max(1e-13);
                prop_assert!((x - column).hypot(y - row) < tolerance, "{x} {y}");
            }
        }

        #[test]
        fn direction_undoes_position(theta in 0.0..PI, phi in -PI..PI) {
            let probe = AngularProbe { edge: 1000 };
            let direction = Direction::from_angles(theta, phi);
            let (x, y) = probe.position(direction);
            if let Some(back) = probe.direction_at(x, y) {
                prop_assert!((back.vector() - direction.vector()).length() < 1e-12);
            }
        }
    }

    #[test]
    fn the_corners_have_no_direction() {
        let probe = AngularProbe { edge: 10 };
        assert!(probe.direction(0, 0).is_none());
        assert!(probe.direction(9, 0).is_none());
        assert!(probe.direction(5, 0).is_some());
    }
}
