//! Meshes: their values, the shapes that Specula has by itself, and what a file may leave out (normals, tangents).

mod mesh;
mod shapes;

pub use mesh::{Mesh, MeshError};
pub use shapes::{SHAPES, shape};
