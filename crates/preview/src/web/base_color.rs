//! What the shaders of a page read of the texture of a base colour.

use super::texture::{ELEMENTS, WebTexels, WebTexture};
use crate::Look;

/// The texture of a look's base colour, and how its material responds to it under its light: what a program
/// with `TEXTURED` reads beside the rest of its view, in every mode.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct WebBaseColor {
    /// The textures.
    pub textures: Vec<WebTexture>,
    /// The uniform blocks, by their names.
    pub blocks: Vec<(&'static str, Vec<u32>)>,
}

impl WebBaseColor {
    /// The texels that a pixel reads of the texture: four of each of two levels.
    pub const FETCHES: usize = 8;

    /// The base colour of a look, with at most so many texels along a side of its texture; `None` if the look
    /// has no texture, or a material that renderers show without it.
    pub fn of(look: &Look, longest_side: usize) -> Option<Self> {
        let map = look.base_color_map()?;
        let texture = map.texture.within(longest_side);
        let mut codes: Vec<[u8; 4]> = texture.words().iter().map(|word| word.to_le_bytes()).collect();
        codes.resize(codes.len().next_multiple_of(ELEMENTS), [0; 4]);
        let plain = |name, size, texels| WebTexture { name, size, is_array: false, is_linear: false, texels };
        let numbers = map.response.texels();
        let textures = vec![
            plain("texture_texels", [ELEMENTS, codes.len() / ELEMENTS, 1], WebTexels::Codes(codes)),
            plain("base_color_numbers", [numbers.len(), 1, 1], WebTexels::Rgba(numbers)),
        ];
        Some(Self { textures, blocks: vec![("texture_uniforms", texture.uniforms())] })
    }
}
