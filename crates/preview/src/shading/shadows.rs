//! Traced shadows: whether the mesh of an object hides a direction from a point on it.
//!
//! Rays start a little above the point, along its normal, in the mesh's own coordinates, and triangles block
//! from both sides. Light from below the point's own horizon is not shadowed, as in transfer matrices.

use std::sync::Arc;

use glam::{DMat3, Vec3};
use sphere::Direction;
use transfer::Occluders;

use super::surface::Surface;
use crate::{Object, Shot};

/// The function `light_arrives` of brute_force.wgsl and lamps.wgsl without shadows.
#[cfg(feature = "gpu")]
pub(crate) const NO_SHADOWS: &str = "fn light_arrives(direction: vec3f) -> bool { return true; }\n";

/// The triangles that hide light from the points of an object.
#[derive(Clone, Debug)]
pub struct Shadows {
    occluders: Arc<Occluders>,
    to_mesh: DMat3,
}

/// A point on an object that light may not reach.
#[derive(Clone, Copy, Debug)]
pub struct ShadowedPoint<'a> {
    shadows: &'a Shadows,
    /// The place where rays start.
    origin: Vec3,
    up: Vec3,
}

/// The matrix from the light's frame in a shot to the coordinates of an object's mesh.
pub(crate) fn to_mesh(object: &Object, shot: &Shot) -> DMat3 {
    object.place.matrix3.inverse() * shot.turn.matrix()
}

impl Shadows {
    /// The shadows of an object on itself in a shot.
    pub fn new(occluders: Arc<Occluders>, object: &Object, shot: &Shot) -> Self {
        Self { occluders, to_mesh: to_mesh(object, shot) }
    }

    /// The point of a surface, which is in the light's frame, at a position in the mesh's coordinates.
    pub fn at(&self, surface: &Surface, position: Vec3) -> ShadowedPoint<'_> {
        let normal = (self.to_mesh * surface.normal.as_dvec3()).normalize_or_zero();
        ShadowedPoint {
            shadows: self,
            origin: self.occluders.above(position.to_array(), normal.as_vec3().to_array()),
            up: surface.normal,
        }
    }
}

impl ShadowedPoint<'_> {
    /// Whether light from a direction of the light's frame arrives.
    pub fn sees(&self, direction: Vec3) -> bool {
        let Shadows { occluders, to_mesh } = self.shadows;
        if direction.dot(self.up) <= 0.0 {
            return true;
        }
        Direction::new(*to_mesh * direction.as_dvec3())
            .is_none_or(|direction| !occluders.block_from(self.origin, direction))
    }
}
