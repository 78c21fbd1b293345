//! Meshes: their values, the shapes that Specula has by itself, and what a file may leave out (normals, tangents).

mod mesh;
mod normals;
mod parts;
mod shapes;
mod tangents;

pub use mesh::{Mesh, MeshError};
pub use parts::Parts;
pub use shapes::{SHAPES, shape};

/// The revisions of the kernels, for the kinds of stage that call them.
pub mod revisions {
    pub use crate::tangents::REVISION as TANGENTS;
}
