//! The cube map of OpenEXR's `envmap` attribute: six faces stacked in one column of the image.
//!
//! Faces are cut along the file's axes (+X -X +Y -Y +Z -Z of [`crate::to_file`], from the top), and texels
//! are nodes: the outer ones lie on the edges of the cube, so that neighbouring faces repeat them.
//! Definition: `CubeMap::direction`, `pixelPosition` and `faceAndPixelPosition` in `ImfEnvmap.cpp` of
//! OpenEXR. Written out for (a, b) in [-1, 1], a to the right and b down in the image, they are:
//!
//! | face | file direction | seen from inside |
//! | --- | --- | --- |
//! | +X | (1, -b, a) | up is +Y, right is +Z |
//! | -X | (-1, -b, -a) | up is +Y, right is -Z |
//! | +Y | (a, 1, -b) | up is +Z, right is +X |
//! | -Y | (a, -1, b) | up is -Z, right is +X |
//! | +Z | (-a, -b, 1) | up is +Y, right is -X |
//! | -Z | (a, -b, -1) | up is +Y, right is +X |
//!
//! Each face is unmirrored from inside. The axes differ from those of [`crate::Cube`] (its cube X is
//! -X_file), so that its +X face is the -X face here, and both polar faces are turned by half a turn.

use glam::DVec3;

use crate::{Direction, from_file, to_file};

/// An image of `edge` columns and 6 x `edge` rows, `edge` at least 2.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct OpenExrCube {
    /// The number of texels along the edge of a face.
    pub edge: usize,
}

impl OpenExrCube {
    /// The direction of a texel of the image, `row` counted over all faces.
    pub fn direction(self, row: usize, column: usize) -> Direction {
        self.direction_at(row / self.edge, column as f64, (row % self.edge) as f64)
    }

    /// The direction at continuous coordinates of a face (0 to 5 from the top): (column, row), each in
    /// [0, edge - 1], texels at whole numbers.
    pub fn direction_at(self, face: usize, column: f64, row: f64) -> Direction {
        let last = (self.edge - 1) as f64;
        let (a, b) = (2.0 * column / last - 1.0, 2.0 * row / last - 1.0);
        let d = match face {
            0 => DVec3::new(1.0, -b, a),
            1 => DVec3::new(-1.0, -b, -a),
            2 => DVec3::new(a, 1.0, -b),
            3 => DVec3::new(a, -1.0, b),
            4 => DVec3::new(-a, -b, 1.0),
            _ => DVec3::new(a, -b, -1.0),
        };
        Direction::normalised(from_file(d))
    }

    /// The face that a direction falls on (0 to 5 from the top) and continuous (column, row) there, each in
    /// [0, edge - 1].
    pub fn position(self, direction: Direction) -> (usize, f64, f64) {
        let d = to_file(direction.vector());
        let m = d.abs();
        let (face, a, b) = if m.x >= m.y && m.x >= m.z {
            if d.x > 0.0 { (0, d.z / m.x, -d.y / m.x) } else { (1, -d.z / m.x, -d.y / m.x) }
        } else if m.y >= m.z {
            if d.y > 0.0 { (2, d.x / m.y, -d.z / m.y) } else { (3, d.x / m.y, d.z / m.y) }
        } else if d.z > 0.0 {
            (4, -d.x / m.z, -d.y / m.z)
        } else {
            (5, d.x / m.z, -d.y / m.z)
        };
        let last = (self.edge - 1) as f64;
        (face, (a + 1.0) / 2.0 * last, (b + 1.0) / 2.0 * last)
    }

    /// The solid angle of the part of its face that is nearest to a texel, in steradians. The sum over all
    /// texels is 4 pi.
    pub fn solid_angle(self, row: usize, column: usize) -> f64 {
        let last = (self.edge - 1) as f64;
        let cut = |k: f64| (2.0 * k / last - 1.0).clamp(-1.0, 1.0);
        let corner = |x: f64, y: f64| math::atan2(x * y, (x * x + y * y + 1.0).sqrt());
        let row = (row % self.edge) as f64;
        let (x0, x1) = (cut(column as f64 - 0.5), cut(column as f64 + 0.5));
        let (y0, y1) = (cut(row - 0.5), cut(row + 0.5));
        corner(x0, y0) - corner(x0, y1) - corner(x1, y0) + corner(x1, y1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::f64::consts::PI;

    #[test]
    fn solid_angles_make_4_pi() {
        for edge in [2, 3, 8, 33] {
            let cube = OpenExrCube { edge };
            let sum: f64 =
                (0..6 * edge * edge).map(|texel| cube.solid_angle(texel / edge, texel % edge)).sum();
            assert!((sum - 4.0 * PI).abs() < 1e-12, "{edge}: {sum}");
        }
    }

    proptest! {
        #[test]
        fn direction_undoes_position(theta in 0.0..PI, phi in -PI..PI) {
            let cube = OpenExrCube { edge: 17 };
            let direction = Direction::from_angles(theta, phi);
            let (face, x, y) = cube.position(direction);
            prop_assert!((0.0..=16.0).contains(&x) && (0.0..=16.0).contains(&y));
            let back = cube.direction_at(face, x, y);
            prop_assert!((back.vector() - direction.vector()).length() < 1e-14);
        }
    }
}
