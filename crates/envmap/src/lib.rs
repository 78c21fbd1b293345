//! The environment value, and its resampling between layouts.

mod environment;
mod image;

pub use environment::{CubeMap, Environment};
pub use image::Image;
