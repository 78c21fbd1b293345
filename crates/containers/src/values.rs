//! Files of other values than pictures: tables, meshes, materials, lamps, coefficients.

mod brdf_table_metadata;
pub(crate) mod direction_samples;
pub(crate) mod gltf;
pub(crate) mod light_rig;
pub mod lighting_json;
mod materialx;
pub mod measured;
mod shrm_metadata;
pub mod tensors;
pub(crate) mod web_page;

pub use brdf_table_metadata::{brdf_table_metadata, coefficient_names};
pub use direction_samples::{DIRECTION_COLUMNS, DirectionSamples, read_csv_points, write_csv_directions};
pub(crate) use gltf::is_gltf_image_based_light;
pub use gltf::{
    Anisotropy, AssetFile, GlbText, GltfLighting, GltfMaterial, GltfScene, ImageBasedLight, MAX_TRIANGLES,
    MaterialChoice, Metals, Model, ReadBeside, SceneOptions, Transmission, VertexAttribute, check_gltf,
    check_gltf_material, gltf_document, gltf_has_triangles, gltf_materials, read_gltf, read_gltf_anisotropy,
    read_gltf_attribute, read_gltf_image_based_light, read_gltf_lighting, read_gltf_material,
    read_gltf_scene, write_glb, write_gltf_image_based_light, write_into_gltf,
};
pub use light_rig::{
    LIGHT_COLUMNS, SceneAxes, write_csv_lights, write_gltf_lights, write_tscn_lights, write_usda_lights,
};
pub use materialx::{MaterialxMaterial, read_materialx_material};
pub use shrm_metadata::{row_names, shrm_metadata};
pub use web_page::{escape_html, is_web_page, recipe_element};
