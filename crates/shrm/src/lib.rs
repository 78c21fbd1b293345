//! Reflected light: convolution in spherical harmonics and its evaluation.

mod reflection;

pub use reflection::{Reflection, ViewDependent};
