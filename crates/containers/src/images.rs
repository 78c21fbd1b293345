//! Pictures of light: what is read of each format, how its colours and directions are meant, and what is
//! written.

pub(crate) mod chromaticity;
mod cicp;
mod colour_space;
mod data_texture;
mod decoded;
mod decoder_level;
mod gain_map;
mod gain_map_metadata;
mod gpano;
mod icc;
mod image_header;
pub(crate) mod jpeg;
mod jpeg_segments;
pub(crate) mod open_exr;
mod orientation;
mod outside_gamut;
mod panorama;
mod pfm;
pub(crate) mod png;
pub(crate) mod radiance;
mod radiance_view;
pub(crate) mod raster;
mod read_image;
mod tiff;
mod xmp;

pub(crate) use chromaticity::Chromaticities;
pub use colour_space::ColourSpace;
pub use data_texture::{DataTexture, Wrap};
pub use decoded::{Decoded, Encoded, OpenExrEnvmap, ReadOptions};
pub use decoder_level::decoder_level;
pub(crate) use icc::srgb_to_linear;
pub use image_header::{ImageHeader, declares_high_dynamic_range, read_image_header};
pub use open_exr::{ExrLayers, read_exr_layers, write_exr, write_exr_layers};
pub use panorama::{Panorama, Shows};
pub use png::{write_apng, write_png};
pub use radiance::write_rgbe;
pub(crate) use raster::Raster;
pub use read_image::read_image;
