//! Meshes: their values, the shapes that Specula has by itself, and what a file may leave out (normals, tangents).

mod mesh;
mod normals;
mod parts;
mod shapes;
mod tangents;

pub use mesh::{Mesh, MeshError};
pub use parts::Parts;
pub use shapes::{SHAPES, shape};
