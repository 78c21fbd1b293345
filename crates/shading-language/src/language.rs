//! The languages.

/// A language of shaders.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Language {
    /// GLSL of OpenGL 4 and Vulkan, and that of OpenGL ES 3 and WebGL 2, which have no arrays of cubes.
    Glsl,
    /// HLSL of shader model 4.1 and later: Direct3D.
    Hlsl,
    /// The Metal Shading Language, version 2 and later.
    Metal,
    /// WGSL: WebGPU.
    Wgsl,
}

impl Language {
    /// All languages.
    pub const ALL: [Self; 4] = [Self::Glsl, Self::Hlsl, Self::Metal, Self::Wgsl];
}
