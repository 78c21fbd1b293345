//! The kinds of stage for light, materials, maps, engines and pictures, and what all kinds share.
//!
//! One file per kind: its module text is its manual page, its `run` converts parameters and calls kernels.
//! Each folder lists its kinds first, then what they share; `values` is for all of them, and `engines` has
//! the engines that load light, one file each. Kinds exchange the values in [`artifacts`].
//!
//! The kinds of other crates, a studio's and those of `mesh-stages` and `probe-stages`, join the list by
//! [`engine::Kinds::with`]. They use [`artifacts`] and [`plugin`] of this crate; everything else in it is for
//! the command line.

#![cfg_attr(not(test), warn(clippy::disallowed_methods))] // tests may compute with std

mod engine_light;
mod engines;
mod files;
mod light;
mod map;
mod material;
mod picture;
pub mod plugin;
#[cfg(test)]
mod testkit;
mod values;

pub use engine_light::ENGINE_FILE_STEM;
pub use engines::{ENGINES, Engine};
pub use files::{
    CatalogEntry, CompactMapItems, LightAlone, LightEdit, PreviewCatalog, ROUGHNESSES, SceneCache, Unknown,
};
pub use light::{face_sets, is_face, six_faces};
pub use material::{
    MaterialFile, PRESETS, Preset, ReadFile, is_gltf_file, is_materialx_file, is_measured_file,
    material_form, material_schema, material_with_form, read_material, why_not_editable,
};
pub use picture::{Picture, material_picture, table_picture};
pub use values::{artifacts, quantity};

/// The kinds of this crate, folder by folder, each in the order in which a pipeline uses them. Those of
/// `mesh-stages` and `probe-stages` are not among them: `cli::kinds()` has all.
pub fn kinds() -> engine::Kinds {
    let folders =
        [light::add_to, material::add_to, map::add_to, engine_light::add_to, picture::add_to, files::add_to];
    let empty = engine::Kinds::new().with_recipe_reader(containers::read_recipe);
    folders.into_iter().fold(empty, |kinds, add_to| add_to(kinds))
}
