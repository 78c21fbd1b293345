//! The languages that a look-up is written in.

/// A language of shaders.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Language {
    /// GLSL of OpenGL 4 and Vulkan, and that of OpenGL ES 3 and WebGL 2, which have no arrays of cubes.
    Glsl,
    /// HLSL of shader model 4.1 and later.
    Hlsl,
    /// WGSL.
    Wgsl,
}
