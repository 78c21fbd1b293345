//! Functions for shaders, written once, in GLSL, HLSL, Metal and WGSL.
//!
//! The source is WGSL in which every declaration has its type and a line of its own. For the other languages
//! its declarations are turned round, and types and functions get their names there. What a texture is and
//! how it is read differs from language to language; four words stand for that, whose arguments are names or
//! numbers:
//!
//! - `load_layer(texture, at, layer)` of an array of pictures, with whole numbers,
//! - `sample_2d(texture, place)`, with `place` from 0 to 1,
//! - `sample_layer(texture, place, layer)` of an array of pictures, and
//! - `sample_cube(texture, c, layer, mip)` of an array of cubes.
//!
//! Metal has no global textures: there, a function that reads one takes it, and so does what calls it.

mod language;
mod metal;
mod resource;
mod source;
mod translation;
mod words;

pub use language::Language;
pub use resource::{Resource, ResourceKind};
pub use source::Source;

#[cfg(test)]
mod tests;
