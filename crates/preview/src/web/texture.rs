//! The textures that the shaders of a page read.

/// The texels in a row of a texture that holds the elements of a buffer.
pub(crate) const ELEMENTS: usize = 1024;

/// The texels of a texture.
#[derive(Clone, Debug, PartialEq)]
pub enum WebTexels {
    /// Radiance or coefficients of it.
    Rgb(Vec<[f32; 3]>),
    /// Numbers, which are read as they are.
    Rgba(Vec<[f32; 4]>),
    /// Numbers, between which a look-up may be linear.
    Halves(Vec<[f32; 4]>),
    /// Words, of which each is a texel.
    Words(Vec<u32>),
    /// Words of four codes, the lowest byte first, of which each is a texel.
    Codes(Vec<[u8; 4]>),
}

/// A texture that a shader reads.
#[derive(Clone, Debug, PartialEq)]
pub struct WebTexture {
    /// The sampler's name in the shader.
    pub name: &'static str,
    /// The width, the height, and the number of layers.
    pub size: [usize; 3],
    /// Whether it is an array of layers.
    pub is_array: bool,
    /// Whether look-ups are linear between texels.
    pub is_linear: bool,
    /// The texels: row by row, layer by layer.
    pub texels: WebTexels,
}
