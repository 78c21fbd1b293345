//! Meshes, the transfer of light to them, and their shading vertex by vertex.

// The kinds.
mod brush_mesh;
mod export_gltf;
mod import_mesh;
mod precompute_transfer;
mod shade_vertices;
mod vertex_blend;

pub(crate) use brush_mesh::BrushMesh;
pub(crate) use export_gltf::ExportGltf;
pub(crate) use import_mesh::ImportMesh;
pub(crate) use precompute_transfer::PrecomputeTransfer;
pub(crate) use shade_vertices::ShadeVertices;
pub(crate) use vertex_blend::VertexBlendKind;
