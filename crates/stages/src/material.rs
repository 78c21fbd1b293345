//! Materials: files and measured tables in, their coefficients out.

// The kinds.
mod import_material;
mod project_brdf;

// What they share.
mod degree_pair;
mod found_material;
mod material_edit;
mod material_file;
mod material_manual;
mod material_messages;
mod material_schema;
mod materialx_file;
mod presets;

use engine::Kinds;

pub(crate) use degree_pair::DegreePair;
pub use found_material::MaterialFile;
pub(crate) use import_material::ImportMaterial;
pub use material_edit::{material_form, material_with_form, why_not_editable};
pub(crate) use material_file::GLTF;
pub use material_file::{ReadFile, is_gltf_file, is_measured_file, read_material};
pub use material_schema::material_schema;
pub use materialx_file::is_materialx_file;
pub use presets::{PRESETS, Preset};

/// Adds the kinds of this folder to a list, in the order in which a pipeline uses them.
pub(crate) fn add_to(kinds: Kinds) -> Kinds {
    kinds.with(import_material::ImportMaterial).with(project_brdf::ProjectBrdf)
}
