//! The kinds of stage: the only crate where the engine and the kernels meet.
//!
//! One file per kind: its module text is its manual page, its `run` converts parameters and calls kernels.
//! Each folder lists its kinds first, then what they share; `values` is for all of them, and `engines` has
//! the engines that load light, one file each. A studio adds its own kinds to the list:
//! `stages::kinds().with(ItsKind)`. Kinds exchange the values in [`artifacts`].

#![cfg_attr(not(test), warn(clippy::disallowed_methods))] // tests may compute with std

mod engine_light;
mod engines;
mod files;
mod light;
mod map;
mod material;
mod mesh;
mod picture;
#[cfg(test)]
mod testkit;
mod values;

pub use engines::{ENGINES, Engine};
pub use files::{CatalogEntry, LightEdit, PreviewCatalog, SceneCache, Unknown};
pub use light::{face_sets, is_face, six_faces};
pub use material::{
    MaterialFile, ReadFile, is_gltf_file, is_measured_file, material_form, material_schema,
    material_with_form, read_material, why_not_editable,
};
pub use picture::{Picture, material_picture, table_picture};
pub use values::{ExportedMaps, Rgb, artifacts, quantity};

/// Every kind, in the order in which a pipeline uses them.
pub fn kinds() -> engine::Kinds {
    engine::Kinds::new()
        .with_recipe_reader(containers::read_recipe)
        .with(light::ImportEnvironment)
        .with(material::ImportMaterial)
        .with(mesh::ImportMesh)
        .with(mesh::BrushMesh)
        .with(mesh::VertexBlendKind)
        .with(mesh::PrecomputeTransfer)
        .with(light::ProjectSh)
        .with(light::CircularLights)
        .with(light::SampleLight)
        .with(light::SubtractLights)
        .with(light::Rotate)
        .with(light::SumLighting)
        .with(light::LightFieldKind)
        .with(material::ProjectBrdf)
        .with(material::TabulateBrdf)
        .with(mesh::ShadeVertices)
        .with(map::Convolve)
        .with(map::Prefilter)
        .with(map::Dfg)
        .with(engine_light::TestPattern)
        .with(engine_light::ExportEngine)
        .with(engine_light::ExportEnvironment)
        .with(map::ExportReflectionMap)
        .with(engine_light::ExportSh)
        .with(map::ExportShrm)
        .with(map::ExportCabral)
        .with(map::ExportKautzMcCool)
        .with(map::ExportViewMaps)
        .with(material::ExportBrdfTable)
        .with(mesh::ExportGltf)
        .with(engine_light::ExportLightRig)
        .with(map::ImportReflectionMaps)
        .with(map::ReferenceMap)
        .with(picture::ContactSheet)
        .with(picture::ReportKind)
        .with(picture::Preview)
        .with(files::Exec)
}
