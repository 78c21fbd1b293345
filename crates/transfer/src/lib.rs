//! Light on the vertices of a mesh, for any material: precomputed radiance transfer and shading.
//!
//! Kautz, Sloan and Snyder, "Fast, Arbitrary BRDF Shading for Low-Frequency Lighting Using Spherical
//! Harmonics" (2002; KSS02). A vertex p has the frame R_p, whose rows are x (the tangent), y and N: R_p d are
//! the coordinates of a direction d in it. With the light's coefficients L_i turned into that frame and the
//! table's c_i at the view in that frame, its radiance is the sum of L_i c_i [KSS02, eq. 1].

#![cfg_attr(not(test), warn(clippy::disallowed_methods))] // tests may compute with std

mod arriving;
mod directions;
mod frames;
mod half_transfer;
mod interreflection;
mod lanes;
mod light_field;
mod lights;
mod matte;
mod occluder_nodes;
mod occluders;
mod packet;
mod ray_caster;
mod rotation;
mod shading;
mod stored;
mod transfer;
mod triple_products;
mod vectors;
mod visibility;

pub use arriving::{arriving, turn_into_frames};
pub use directions::Directions;
pub use frames::{Frames, FramesError, Viewer};
pub use half_transfer::HalfTransfer;
pub use interreflection::{ReflectingMesh, interreflect, interreflect_matte, reflection_bytes};
pub use light_field::{LightField, LightFieldError};
pub use lights::shade_lights;
pub use matte::{MatteTransfer, NotMatte};
pub use occluder_nodes::OccluderNode;
pub use occluders::Occluders;
pub use ray_caster::{RayCaster, RayHit};
pub use rotation::quarter_turns;
pub use shading::{FixedLight, FixedView, shade, shade_with_transfer};
pub use stored::{Form, StoredTransfer};
pub use transfer::{MOST_BYTES, Transfer, TransferDegrees, TransferError, precompute};
pub use visibility::Visibility;

/// The revisions of the kernels, for the kinds of stage that call them.
pub mod revisions {
    pub use crate::interreflection::REVISION as INTERREFLECTION;
    pub use crate::lights::REVISION as LIGHTS;
    pub use crate::shading::REVISION as SHADING;
    pub use crate::transfer::REVISION as TRANSFER;
}
