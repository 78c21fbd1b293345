//! The kinds of stage: the only crate where the engine and the kernels meet.
//!
//! One file per kind: its module text is its manual page, its `run` converts parameters and calls kernels. A
//! studio adds its own kinds to the list: `stages::kinds().with(ItsKind)`. Kinds exchange the values in
//! [`artifacts`].

#![cfg_attr(test, allow(clippy::disallowed_methods))] // tests may compute with std

pub mod artifacts;
mod bad_pixels;
mod blended_frames;
mod brush_mesh;
mod choices;
mod circular_lights;
mod colour;
mod colour_space_name;
mod contact_sheet;
mod convolve;
mod degree_pair;
mod dfg;
mod engine_files;
mod engine_preset;
mod engine_readme;
mod exec;
mod export_brdf_table;
mod export_cabral;
mod export_engine;
mod export_environment;
mod export_gltf;
mod export_kautz_mccool;
mod export_light_rig;
mod export_reflection_map;
mod export_sh;
mod export_shrm;
mod export_view_maps;
mod full_lighting;
mod import_environment;
mod import_material;
mod import_mesh;
mod import_reflection_maps;
mod irradiance;
mod light_edit;
mod light_field;
mod light_input;
mod light_mismatch;
mod manifest_edit;
mod map_index;
mod map_input;
mod map_pictures;
mod map_source;
mod material_edit;
mod material_file;
mod material_picture;
mod material_schema;
mod overflow;
mod panorama;
mod parts;
mod precompute_transfer;
mod prefilter;
mod preview;
mod preview_catalog;
mod project_brdf;
mod project_sh;
pub mod quantity;
mod reference;
mod report;
mod rotate;
mod sample_light;
mod shade_vertices;
mod share;
mod sheet;
mod six_faces;
mod subtract_lights;
mod sum_lighting;
mod table_picture;
mod tabulate_brdf;
mod test_pattern;
#[cfg(test)]
mod testkit;
mod toml_text;
mod vector;
mod vertex_blend;

pub use colour::Rgb;
pub use light_edit::LightEdit;
pub use material_edit::{material_form, material_with_form, why_not_editable};
pub use material_file::{MaterialFile, ReadFile, is_gltf_file, is_measured_file, read_material};
pub use material_picture::material_picture;
pub use material_schema::material_schema;
pub use preview_catalog::{CatalogEntry, PreviewCatalog, SceneCache, Unknown};
pub use sheet::Picture;
pub use six_faces::{face_sets, is_face, six_faces};
pub use table_picture::table_picture;

/// Every kind, in the order in which a pipeline uses them.
pub fn kinds() -> engine::Kinds {
    engine::Kinds::new()
        .with_recipe_reader(containers::read_recipe)
        .with(import_environment::ImportEnvironment)
        .with(import_material::ImportMaterial)
        .with(import_mesh::ImportMesh)
        .with(brush_mesh::BrushMesh)
        .with(vertex_blend::VertexBlend)
        .with(precompute_transfer::PrecomputeTransfer)
        .with(project_sh::ProjectSh)
        .with(circular_lights::CircularLights)
        .with(sample_light::SampleLight)
        .with(subtract_lights::SubtractLights)
        .with(rotate::Rotate)
        .with(sum_lighting::SumLighting)
        .with(light_field::LightField)
        .with(project_brdf::ProjectBrdf)
        .with(tabulate_brdf::TabulateBrdf)
        .with(shade_vertices::ShadeVertices)
        .with(convolve::Convolve)
        .with(prefilter::Prefilter)
        .with(dfg::Dfg)
        .with(test_pattern::TestPattern)
        .with(export_engine::ExportEngine)
        .with(export_environment::ExportEnvironment)
        .with(export_reflection_map::ExportReflectionMap)
        .with(export_sh::ExportSh)
        .with(export_shrm::ExportShrm)
        .with(export_cabral::ExportCabral)
        .with(export_kautz_mccool::ExportKautzMcCool)
        .with(export_view_maps::ExportViewMaps)
        .with(export_brdf_table::ExportBrdfTable)
        .with(export_gltf::ExportGltf)
        .with(export_light_rig::ExportLightRig)
        .with(import_reflection_maps::ImportReflectionMaps)
        .with(reference::ReferenceMap)
        .with(contact_sheet::ContactSheet)
        .with(report::ReportKind)
        .with(preview::Preview)
        .with(exec::Exec)
}
