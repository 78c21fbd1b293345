//! Ranges of triangles, each of one material.

/// Consecutive triangles of one material.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MaterialRange {
    /// The place of the material in [`crate::Mesh::materials`]; `None` for triangles without a material.
    pub material: Option<u32>,
    /// The number of the triangles.
    pub triangles: usize,
}

/// The materials of a mesh; empty if no triangle has one.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Materials {
    pub(crate) names: Vec<String>,
    /// Neighbours differ, none is empty, and all together have as many triangles as the mesh.
    pub(crate) ranges: Vec<MaterialRange>,
}
