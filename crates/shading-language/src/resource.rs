//! What functions read, and how it is declared.

/// What functions read beside their arguments.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Resource {
    /// Its name in the functions.
    pub name: &'static str,
    /// What it is.
    pub kind: ResourceKind,
}

/// A kind of [`Resource`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ResourceKind {
    /// A picture.
    Picture,
    /// An array of pictures.
    Layers,
    /// An array of cubes.
    Cubes,
    /// The sampler of all textures, where it is apart from them, with a comment.
    Sampler(&'static str),
    /// So many vectors of four numbers.
    Vectors(usize),
}

impl Resource {
    /// The declaration in GLSL, in which textures are their own samplers.
    pub(super) fn glsl(&self) -> Option<String> {
        let Self { name, kind } = self;
        let sampler = match kind {
            ResourceKind::Picture => "sampler2D",
            ResourceKind::Layers => "sampler2DArray",
            ResourceKind::Cubes => "samplerCubeArray",
            ResourceKind::Sampler(_) => return None,
            ResourceKind::Vectors(count) => return Some(format!("uniform vec4 {name}[{count}];\n")),
        };
        Some(format!("uniform highp {sampler} {name};\n"))
    }

    /// The declaration in HLSL.
    pub(super) fn hlsl(&self) -> String {
        let Self { name, kind } = self;
        match kind {
            ResourceKind::Picture => format!("Texture2D {name};\n"),
            ResourceKind::Layers => format!("Texture2DArray {name};\n"),
            ResourceKind::Cubes => format!("TextureCubeArray {name};\n"),
            ResourceKind::Sampler(comment) => format!("SamplerState {name};  // {comment}\n"),
            ResourceKind::Vectors(count) => format!("float4 {name}[{count}];\n"),
        }
    }

    /// The parameter in Metal.
    pub(super) fn metal(&self) -> String {
        let Self { name, kind } = self;
        match kind {
            ResourceKind::Picture => format!("texture2d<float> {name}"),
            ResourceKind::Layers => format!("texture2d_array<float> {name}"),
            ResourceKind::Cubes => format!("texturecube_array<float> {name}"),
            ResourceKind::Sampler(_) => format!("sampler {name}"),
            ResourceKind::Vectors(_) => format!("constant float4 *{name}"),
        }
    }

    /// The declaration in WGSL.
    pub(super) fn wgsl(&self, binding: u32) -> String {
        let Self { name, kind } = self;
        let declaration = match kind {
            ResourceKind::Picture => format!("var {name}: texture_2d<f32>"),
            ResourceKind::Layers => format!("var {name}: texture_2d_array<f32>"),
            ResourceKind::Cubes => format!("var {name}: texture_cube_array<f32>"),
            ResourceKind::Sampler(_) => format!("var {name}: sampler"),
            ResourceKind::Vectors(count) => format!("var<uniform> {name}: array<vec4f, {count}>"),
        };
        format!("@group(0) @binding({binding}) {declaration};\n")
    }
}
