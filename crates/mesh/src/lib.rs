//! Meshes, the built-in shapes, the parts that a file may omit (normals, tangents), and the materials of
//! triangles.

#![cfg_attr(not(test), warn(clippy::disallowed_methods))] // tests may compute with std

mod brush;
mod material_range;
mod materials;
mod mesh;
mod normals;
mod parts;
mod shapes;
mod tangents;

pub use material_range::MaterialRange;
pub use mesh::{Mesh, MeshError};
pub use parts::Parts;
pub use shapes::{SHAPES, shape};

/// The revisions of the kernels, for the kinds of stage that call them.
pub mod revisions {
    pub use crate::tangents::REVISION as TANGENTS;
}
