//! Bytes to values and back. Nothing here opens a file: every function takes or gives bytes.
//!
//! | bytes | value | module |
//! | --- | --- | --- |
//! | a picture of any [`Format`] | [`envmap::Image`] | [`read_image`], [`write_exr`], [`write_rgbe`], [`write_png`], [`write_apng`] |
//! | OpenEXR of several layers | [`ExrLayers`] | [`read_exr_layers`], [`write_exr_layers`] |
//! | KTX2, DDS, KTX, `.env`, glTF | light: [`LightTexture`] | [`read_light_texture`] |
//! | KTX2, DDS, KTX | [`Texture`] | [`read_texture`], [`write_ktx2`], [`write_dds`], [`write_ktx1`] |
//! | KTX2, DDS, OpenEXR of four channels | tables of numbers | [`write_ktx2_rgba`], [`write_dds_rgba`], [`write_exr_rgba`] |
//! | Babylon.js' `.env` | [`BabylonEnv`] | [`read_babylon_env`], [`write_babylon_env`] |
//! | glTF, binary or not | [`mesh::Mesh`], [`brdf::Standard`] | [`read_gltf`], [`read_gltf_material`], [`write_glb`], [`write_into_gltf`] |
//! | glTF: surfaces, emission, lamps | [`probes::Scene`] | [`read_gltf_scene`] |
//! | glTF with EXT_lights_image_based | [`ImageBasedLight`] | [`read_gltf_image_based_light`], [`write_gltf_image_based_light`] |
//! | MaterialX: `standard_surface`, OpenPBR | [`brdf::Standard`] | [`read_materialx_material`] |
//! | measured BRDFs: MERL, Cornell, CURET, CSV | [`brdf::Measured`] | [`measured`] |
//! | safetensors | coefficients, environments, reflection maps | [`tensors`] |
//! | JSON | lighting for people and engines | [`lighting_json`] |
//! | glTF, USD text, Godot's `.tscn`, CSV | lights | [`write_gltf_lights`], [`write_usda_lights`], [`write_tscn_lights`], [`write_csv_lights`] |
//!
//! A format is known by its content, never by a file's name. Every written file may hold a *recipe*, the
//! canonical JSON that says how it was made; [`read_recipe`] finds it again in any of them. Written bytes
//! depend on the arguments alone: no clock, no version, no order of a hash map.
//!
//! Bytes are never trusted. A header's claim of size is compared with [`MAX_PIXELS`] and with what a file of
//! that length can hold before anything of that size is allocated, and damage is an [`Error`], not a panic.
//!
//! # Example: `examples/convert_picture.rs`
#![doc = concat!("```\n", include_str!("../examples/convert_picture.rs"), "```")]
#![cfg_attr(not(test), warn(clippy::disallowed_methods))] // tests may compute with std

mod error;
mod file_part;
mod format;
mod header_word;
mod images;
mod light_texture;
mod limits;
mod metadata;
mod png_text;
mod precision;
mod read_recipe;
mod recipe;
mod rounding;
mod textures;
mod values;
mod zstandard;

pub use brdf::Wrap;
pub use error::{Error, ErrorKind};
pub use format::Format;
pub use images::{
    ColourSpace, DataTexture, Decoded, Encoded, ExrLayers, ImageHeader, OpenExrEnvmap, Panorama, ReadOptions,
    Shows, declares_high_dynamic_range, decoder_level, read_exr_layers, read_image, read_image_header,
    read_image_until, write_apng, write_exr, write_exr_layers, write_exr_rgba, write_png, write_rgbe,
};
pub use light_texture::{LightTexture, is_light_texture, read_light_texture};
pub use limits::MAX_PIXELS;
pub use precision::Precision;
pub use read_recipe::read_recipe;
pub use recipe::texture_sidecar;
pub use textures::{
    BabylonEnv, ByteFormat, Polynomial, Rounding, TexelEncoding, TexelFormat, Texture, TextureFile,
    declares_cube, is_babylon_env, is_texture, is_texture_ending, read_babylon_env, read_babylon_polynomial,
    read_dds, read_ktx2, read_texture, texture_containers, write_babylon_env, write_dds, write_dds_rgba,
    write_ktx1, write_ktx2, write_ktx2_r8, write_ktx2_rgba, write_ktx2_zstd,
};
pub use values::{
    Anisotropy, AssetFile, DIRECTION_COLUMNS, DirectionSamples, GlbText, GltfLighting, GltfMaterial,
    GltfScene, ImageBasedLight, LIGHT_COLUMNS, MAX_TRIANGLES, MaterialChoice, MaterialxMaterial, Metals,
    Model, ReadBeside, SceneAxes, SceneOptions, Transmission, VertexAttribute, brdf_table_metadata,
    check_gltf, check_gltf_material, coefficient_names, escape_html, gltf_document, gltf_has_triangles,
    gltf_materials, is_web_page, lighting_json, measured, read_csv_points, read_gltf, read_gltf_anisotropy,
    read_gltf_attribute, read_gltf_image_based_light, read_gltf_lighting, read_gltf_material,
    read_gltf_scene, read_materialx_material, recipe_element, row_names, shrm_metadata, tensors,
    write_csv_directions, write_csv_lights, write_glb, write_gltf_image_based_light, write_gltf_lights,
    write_into_gltf, write_tscn_lights, write_usda_lights,
};
