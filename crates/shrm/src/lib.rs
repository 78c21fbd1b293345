//! Reflected light: convolution in spherical harmonics and its evaluation.

mod evaluation;
mod global;
mod lookup;
mod map;
pub mod reference;
mod reflection;

pub use lookup::Lookup;
pub use map::{MapGrid, Shrm, Terms, View, frame, into_frame};
pub use reflection::{Plain, Reflection, ViewDependent};
