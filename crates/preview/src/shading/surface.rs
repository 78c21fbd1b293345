//! What a mode is asked about: a point of a surface, from one side, in the light's frame.
//!
//! A surface has two sides: the normal of a back face is turned over. An interpolated normal, or one from a file, may still
//! look away from the viewer. It is bent toward the view V until it grazes,
//!
//! > N' = N + (e - N.V) V, normalised, where N.V < e,
//!
//! which is continuous, keeps N'.V at e or above, and takes even N = -V to V.

use brdf::Centre;
use glam::Vec3;

/// e: the smallest cosine between the normal and the view before the bent normal is normalised.
pub const GRAZING: f32 = 1e-3;

/// A point of a surface. Unit vectors in the light's frame; normal and tangent are at a right angle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Surface {
    /// The normal, on the viewer's side.
    pub normal: Vec3,
    /// The tangent.
    pub tangent: Vec3,
    /// Toward the viewer.
    pub view: Vec3,
}

impl Surface {
    /// The surface of an interpolated normal and tangent, of any length, seen along a ray of any length.
    ///
    /// `front` says whether the face's outside is seen. A normal of length 0 becomes the view, a tangent without a part at a
    /// right angle to the normal becomes any that has.
    pub fn new(normal: Vec3, tangent: Vec3, ray: Vec3, front: bool) -> Self {
        let view = -ray.normalize();
        let side = if front { normal } else { -normal };
        let mut normal = unit_or(side, view);
        let cosine = normal.dot(view);
        if cosine < GRAZING {
            normal = (normal + view * (GRAZING - cosine)).normalize();
        }
        let tangent = unit_or(tangent - normal * normal.dot(tangent), across(normal));
        Self { normal, tangent, view }
    }

    /// The direction that a map is about: the reflection of the view about the normal, 2 (N.V) N - V; the normal; or
    /// the tangent.
    pub fn central(&self, centre: Centre) -> Vec3 {
        match centre {
            Centre::Reflection => self.normal * (2.0 * self.normal.dot(self.view)) - self.view,
            Centre::Normal => self.normal,
            Centre::Tangent => self.tangent,
        }
    }
}

/// The direction of `v`, or another where `v` is next to nothing.
fn unit_or(v: Vec3, other: Vec3) -> Vec3 {
    let square = v.dot(v);
    if square > 1e-24 { v / square.sqrt() } else { other }
}

/// A direction at a right angle to a normal.
fn across(normal: Vec3) -> Vec3 {
    let other = if normal.z.abs() < 0.9 { Vec3::Z } else { Vec3::X };
    other.cross(normal).normalize()
}
