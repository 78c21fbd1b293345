//! The environment value, and its resampling between layouts.

mod environment;
mod image;
mod tone;

pub use environment::{CubeMap, Environment};
pub use image::Image;
pub use tone::{ToneMap, middle_grey_exposure, srgb_decode, srgb_encode, to_srgb8};
