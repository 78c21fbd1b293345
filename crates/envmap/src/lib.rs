//! The environment, and its resampling between layouts.
//!
//! A decoded [`Image`] and its [`Layout`] make an [`Environment`]: linear radiance on a lat-long grid in
//! Specula's frame. [`repair`] comes first, so that resampling does not spread NaN, infinity or negative
//! values. All results are bit-identical for any number of threads.

#![cfg_attr(not(test), warn(clippy::disallowed_methods))] // tests may compute with std

mod area;
mod atlas;
mod audit;
mod bright_texels;
mod canvas;
mod coverage;
mod cube_map;
mod environment;
mod error;
mod exposure;
mod faces;
mod fill;
mod image;
mod joined_lights;
mod lamps;
mod lat_long_on_cube;
mod layout;
mod part;
mod pixel_audit;
mod pixels;
mod resample;
mod row_codec;
mod row_sums;
mod texels;
mod tone;
mod white_balance;
mod without_lights;

pub use area::box_filtered;
pub use atlas::Atlas;
pub use audit::{BadPixels, audit, repair};
pub use coverage::Coverage;
pub use cube_map::CubeMap;
pub use environment::Environment;
pub use error::Error;
pub use exposure::{Exposure, ExposureBasis, LUMINANCE, luminance};
pub use faces::{check_faces, stack_faces};
pub use fill::Fill;
pub use image::Image;
pub use joined_lights::joined_lights;
pub use lamps::Separated;
pub use layout::Layout;
pub use part::{Lens, Part};
pub use pixel_audit::{Finding, PixelAudit, Place};
pub use pixels::CodedRows;
pub use texels::{Taps, Texels};
pub use tone::{ToneMap, srgb_decode, srgb_encode, to_srgb8};
pub use white_balance::{temperature_colour, white_balance};
pub use without_lights::WithoutLights;

/// The revisions of the kernels, for the kinds of stage that call them.
pub mod revisions {
    pub use crate::lamps::REVISION as LAMPS;
    pub use crate::lat_long_on_cube::REVISION as CUBE_MAP;
    pub use crate::resample::REVISION as RESAMPLING;
    pub use crate::without_lights::REVISION as WITHOUT_LIGHTS;
}
