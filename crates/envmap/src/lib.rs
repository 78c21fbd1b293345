//! The environment value, and its resampling between layouts.
//!
//! A decoded [`Image`] and its [`Layout`] make an [`Environment`]: linear radiance on a lat-long grid of
//! Specula's frame. [`repair`] comes before, so that no NaN, infinity or negative value is spread by resampling.
//! All results are bit-identical for any number of threads.

mod area;
mod audit;
mod canvas;
mod cube_map;
mod environment;
mod error;
mod faces;
mod image;
mod lamps;
mod layout;
mod resample;
mod texels;
mod tone;

pub use audit::{BadPixels, Finding, PixelAudit, Place, audit, repair};
pub use cube_map::CubeMap;
pub use environment::Environment;
pub use error::Error;
pub use faces::stack_faces;
pub use image::Image;
pub use layout::Layout;
pub use texels::{Taps, Texels};
pub use tone::{ToneMap, middle_grey_exposure, srgb_decode, srgb_encode, to_srgb8};

/// The revisions of the kernels, for the kinds of stage that call them.
pub mod revisions {
    pub use crate::resample::REVISION as RESAMPLING;
}
