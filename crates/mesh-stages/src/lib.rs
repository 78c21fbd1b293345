//! The kinds of stage for meshes: BRDF tables, the transfer of light, and shading vertex by vertex.
//!
//! One file per kind, as in `stages`, whose list they join as a studio's own kinds do. Of `stages` they use
//! nothing but what every studio is promised in docs/plugins.md: [`stages::artifacts`] and
//! [`stages::plugin`].

#![cfg_attr(not(test), warn(clippy::disallowed_methods))] // tests may compute with std

mod brush_mesh;
mod export_brdf_table;
mod export_gltf;
mod import_mesh;
mod precompute_transfer;
mod shade_vertices;
mod tabulate_brdf;
mod transfer_texture;
mod vertex_blend;
mod vertex_coefficients;
mod vertex_probes;
mod viewer;

use engine::Kinds;

/// Adds the kinds of this crate to a list, in the order in which a pipeline uses them.
///
/// # Panics
/// If the list has a kind of the same name.
#[must_use]
pub fn add_to(kinds: Kinds) -> Kinds {
    kinds
        .with(import_mesh::ImportMesh)
        .with(brush_mesh::BrushMesh)
        .with(vertex_blend::VertexBlendKind)
        .with(precompute_transfer::PrecomputeTransfer)
        .with(tabulate_brdf::TabulateBrdf)
        .with(shade_vertices::ShadeVertices)
        .with(export_brdf_table::ExportBrdfTable)
        .with(export_gltf::ExportGltf)
}
