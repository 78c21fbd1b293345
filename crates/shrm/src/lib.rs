//! Reflected light: convolution in spherical harmonics and its evaluation.

mod map;
mod reflection;

pub use map::{MapGrid, Shrm, Terms, View, frame};
pub use reflection::{Reflection, ViewDependent};
