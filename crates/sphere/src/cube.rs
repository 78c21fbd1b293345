//! The cube map: six faces in the order and orientation of KTX2, Vulkan, GL and D3D.
//!
//! Cube coordinates c come from [`crate::to_cube`]. A face's image has row 0 at the top (t = 0) and is
//! unmirrored from inside the cube.

use glam::DVec3;

use crate::{Direction, from_cube, to_cube};

/// A face of a cube map, in file order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Face {
    /// +X of the cube coordinates.
    PositiveX,
    /// -X of the cube coordinates.
    NegativeX,
    /// +Y of the cube coordinates: up.
    PositiveY,
    /// -Y of the cube coordinates: down.
    NegativeY,
    /// +Z of the cube coordinates: Specula's +X.
    PositiveZ,
    /// -Z of the cube coordinates: Specula's -X.
    NegativeZ,
}

impl Face {
    /// The six faces in file order: +X -X +Y -Y +Z -Z.
    pub const ALL: [Self; 6] = [
        Self::PositiveX,
        Self::NegativeX,
        Self::PositiveY,
        Self::NegativeY,
        Self::PositiveZ,
        Self::NegativeZ,
    ];

    /// The short name used in file names: `px`, `nx`, `py`, `ny`, `pz`, `nz`.
    pub const fn name(self) -> &'static str {
        match self {
            Self::PositiveX => "px",
            Self::NegativeX => "nx",
            Self::PositiveY => "py",
            Self::NegativeY => "ny",
            Self::PositiveZ => "pz",
            Self::NegativeZ => "nz",
        }
    }
}

/// A cube map whose faces have `edge` x `edge` texels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Cube {
    /// The number of texels along the edge of a face.
    pub edge: usize,
}

impl Cube {
    /// The number of texels of the six faces.
    pub const fn len(self) -> usize {
        6 * self.edge * self.edge
    }

    /// Whether the cube has no texels.
    pub const fn is_empty(self) -> bool {
        self.edge == 0
    }

    /// The direction of a texel's centre.
    pub fn direction(self, face: Face, row: usize, column: usize) -> Direction {
        let edge = self.edge as f64;
        self.direction_at(face, (column as f64 + 0.5) / edge, (row as f64 + 0.5) / edge)
    }

    /// The direction at (s, t) of a face, each in [0, 1], t downward.
    pub fn direction_at(self, face: Face, s: f64, t: f64) -> Direction {
        let (sc, tc) = (2.0 * s - 1.0, 2.0 * t - 1.0);
        let c = match face {
            Face::PositiveX => DVec3::new(1.0, -tc, -sc),
            Face::NegativeX => DVec3::new(-1.0, -tc, sc),
            Face::PositiveY => DVec3::new(sc, 1.0, tc),
            Face::NegativeY => DVec3::new(sc, -1.0, -tc),
            Face::PositiveZ => DVec3::new(sc, -tc, 1.0),
            Face::NegativeZ => DVec3::new(-sc, -tc, -1.0),
        };
        Direction::normalised(from_cube(c))
    }

    /// The face that a direction falls on, and its place (s, t) there.
    pub fn position(self, direction: Direction) -> (Face, f64, f64) {
        let c = to_cube(direction.vector());
        let a = c.abs();
        let (face, sc, tc, ma) = if a.x >= a.y && a.x >= a.z {
            if c.x > 0.0 { (Face::PositiveX, -c.z, -c.y, a.x) } else { (Face::NegativeX, c.z, -c.y, a.x) }
        } else if a.y >= a.z {
            if c.y > 0.0 { (Face::PositiveY, c.x, c.z, a.y) } else { (Face::NegativeY, c.x, -c.z, a.y) }
        } else if c.z > 0.0 {
            (Face::PositiveZ, c.x, -c.y, a.z)
        } else {
            (Face::NegativeZ, -c.x, -c.y, a.z)
        };
        (face, (sc / ma + 1.0) / 2.0, (tc / ma + 1.0) / 2.0)
    }

    /// The solid angle of a texel of any face, in steradians. The sum over all texels is 4 pi.
    pub fn solid_angle(self, row: usize, column: usize) -> f64 {
        let edge = self.edge as f64;
        let corner = |x: f64, y: f64| math::atan2(x * y, (x * x + y * y + 1.0).sqrt());
        let (x0, x1) = (2.0 * column as f64 / edge - 1.0, 2.0 * (column + 1) as f64 / edge - 1.0);
        let (y0, y1) = (2.0 * row as f64 / edge - 1.0, 2.0 * (row + 1) as f64 / edge - 1.0);
        corner(x0, y0) - corner(x0, y1) - corner(x1, y0) + corner(x1, y1)
    }
}
