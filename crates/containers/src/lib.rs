//! Bytes to values and back. Nothing here opens a file: every function takes or gives bytes.
//!
//! | bytes | value | module |
//! | --- | --- | --- |
//! | OpenEXR, Radiance RGBE, PNG, JPEG, TIFF, TGA, WebP, PFM | [`envmap::Image`] | [`read_image`], [`write_exr`], [`write_rgbe`], [`write_png`], [`write_apng`] |
//! | OpenEXR of several layers | [`ExrLayers`] | [`read_exr_layers`], [`write_exr_layers`], [`write_exr_layers_unless`] |
//! | KTX2, DDS, KTX, `.env`, glTF | light: [`LightTexture`] | [`read_light_texture`] |
//! | KTX2, DDS, KTX | [`Texture`] | [`read_texture`], [`write_ktx2`], [`write_dds`], [`write_ktx1`] |
//! | Babylon.js' `.env` | [`BabylonEnv`] | [`read_babylon_env`], [`write_babylon_env`] |
//! | glTF, binary or not | [`mesh::Mesh`], [`brdf::Standard`] | [`read_gltf`], [`read_gltf_material`], [`write_glb`] |
//! | glTF with EXT_lights_image_based | [`ImageBasedLight`] | [`read_gltf_image_based_light`], [`write_gltf_image_based_light`] |
//! | measured BRDFs: MERL, Cornell, CURET, CSV | [`brdf::Measured`] | [`measured`] |
//! | safetensors | coefficients, environments, reflection maps | [`tensors`] |
//! | JSON | lighting for people and engines | [`lighting_json`] |
//! | glTF, USD text, CSV | lights | [`write_gltf_lights`], [`write_usda_lights`], [`write_csv_lights`] |
//!
//! A format is known by its content, never by a file's name. Every written file may hold a *recipe*, the
//! canonical JSON that says how it was made; [`read_recipe`] finds it again in any of them. Written bytes
//! depend on the arguments alone: no clock, no version, no order of a hash map.
//!
//! Bytes are never trusted. A header's claim of size is compared with [`MAX_PIXELS`] and with what a file of
//! that length can hold before anything of that size is allocated, and damage is an [`Error`], not a panic.

#![cfg_attr(test, allow(clippy::disallowed_methods))] // tests may compute with std

mod babylon_env;
mod bc6h;
mod brdf_table_metadata;
mod chromaticity;
mod cicp;
mod colour_space;
mod data_texture;
mod dds;
mod decoded;
mod decoder_level;
mod error;
mod file_part;
mod format;
mod gain_map;
mod gain_map_metadata;
mod gltf;
mod gpano;
mod header_word;
mod icc;
mod image_header;
mod jpeg;
mod jpeg_segments;
mod ktx1;
mod ktx2;
mod light_rig;
mod light_texture;
pub mod lighting_json;
mod limits;
pub mod measured;
mod metadata;
mod open_exr;
mod orientation;
mod outside_gamut;
mod panorama;
mod pfm;
mod png;
mod png_text;
mod precision;
mod radiance;
mod radiance_view;
mod raster;
mod read_image;
mod read_recipe;
mod read_texture;
mod recipe;
mod rgbd;
mod rounding;
mod shrm_metadata;
pub mod tensors;
mod texel;
mod texture;
mod tiff;
mod web_page;
mod xmp;
mod zstandard;

pub use babylon_env::{
    BabylonEnv, Polynomial, is_babylon_env, read_babylon_env, read_babylon_polynomial, write_babylon_env,
};
pub use brdf_table_metadata::{brdf_table_metadata, coefficient_names};
pub use colour_space::ColourSpace;
pub use data_texture::{DataTexture, Wrap};
pub use dds::{read_dds, write_dds};
pub use decoded::{Decoded, Encoded, OpenExrEnvmap, ReadOptions};
pub use decoder_level::decoder_level;
pub use error::{Error, ErrorKind};
pub use format::Format;
pub use gltf::{
    Anisotropy, GlbText, GltfLighting, GltfMaterial, ImageBasedLight, MAX_TRIANGLES, MaterialChoice, Model,
    ReadBeside, VertexAttribute, check_gltf, check_gltf_material, gltf_document, gltf_has_triangles,
    gltf_materials, read_gltf, read_gltf_anisotropy, read_gltf_attribute, read_gltf_image_based_light,
    read_gltf_lighting, read_gltf_material, write_glb, write_gltf_image_based_light,
};
pub use image_header::{ImageHeader, declares_high_dynamic_range, read_image_header};
pub use ktx1::write_ktx1;
pub use ktx2::{read_ktx2, write_ktx2, write_ktx2_rgba, write_ktx2_zstd};
pub use light_rig::{write_csv_lights, write_gltf_lights, write_usda_lights};
pub use light_texture::{LightTexture, is_light_texture, read_light_texture};
pub use limits::MAX_PIXELS;
pub use open_exr::{ExrLayers, read_exr_layers, write_exr, write_exr_layers, write_exr_layers_unless};
pub use panorama::{Panorama, Shows};
pub use png::{write_apng, write_png};
pub use precision::Precision;
pub use radiance::write_rgbe;
pub use read_image::read_image;
pub use read_recipe::read_recipe;
pub use read_texture::{declares_cube, is_texture, read_texture};
pub use recipe::texture_sidecar;
pub use shrm_metadata::{row_names, shrm_metadata};
pub use texel::{ByteFormat, TexelFormat};
pub use texture::{Texture, TextureFile};
pub use web_page::{escape_html, is_web_page, recipe_element};
