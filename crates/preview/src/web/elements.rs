//! The elements of what is a storage buffer on a graphics device: in a uniform block if they fit into the
//! smallest that WebGL 2 has, which is read as fast as a constant, and otherwise in a texture.

use super::texture::{ELEMENTS, WebTexels, WebTexture};

/// The most vectors of four in a uniform block: 16 KiB.
const MAX_VECTORS: usize = 1024;

/// The elements of a buffer.
pub(super) enum Elements<'a> {
    /// Vectors of four numbers, an element each.
    Vectors(&'a [[f32; 4]]),
    /// Words, an element each.
    Words(&'a [u32]),
}

/// Where elements are.
pub(super) enum Place {
    /// In a uniform block of this content.
    Block(Vec<u32>),
    /// In a texture.
    Texture(WebTexture),
}

impl Elements<'_> {
    /// Places them, and returns the shader, which reads them from a texture of this name, so that it reads
    /// them from where they are.
    pub(super) fn placed(self, shader: &str, name: &'static str) -> (String, Place) {
        let (vectors, mut words): (usize, Vec<u32>) = match self {
            Self::Vectors(of) => (of.len(), of.as_flattened().iter().map(|value| value.to_bits()).collect()),
            Self::Words(of) => (of.len().div_ceil(4), of.to_vec()),
        };
        let vectors = vectors.max(1);
        if vectors <= MAX_VECTORS {
            words.resize(4 * vectors, 0);
            return (in_block(shader, name, vectors), Place::Block(words));
        }
        let (count, texels) = match self {
            Self::Vectors(of) => (of.len(), WebTexels::Rgba(padded(of, [0.0; 4]))),
            Self::Words(of) => (of.len(), WebTexels::Words(padded(of, 0))),
        };
        let size = [ELEMENTS, count.div_ceil(ELEMENTS), 1];
        let texture = WebTexture { name, size, is_array: false, is_linear: false, texels };
        (shader.to_owned(), Place::Texture(texture))
    }
}

/// Elements in whole rows of a texture.
pub(super) fn padded<T: Copy>(elements: &[T], nothing: T) -> Vec<T> {
    let mut texels = elements.to_vec();
    texels.resize(elements.len().next_multiple_of(ELEMENTS), nothing);
    texels
}

/// The shader with a block of so many vectors in place of a texture.
fn in_block(shader: &str, name: &str, vectors: usize) -> String {
    let fetch = format!("texelFetch({name}, ");
    let mut element = "";
    let mut text = String::new();
    for line in shader.lines() {
        if let Some((_, rest)) = line.split_once(&format!("{name}_element(uint ")) {
            element = rest.split(')').next().unwrap_or_default();
        }
        let sampler =
            line.strip_prefix("uniform highp ").and_then(|rest| rest.strip_suffix(&format!(" {name};")));
        let line = match (sampler, line.split_once(&fetch)) {
            (Some(sampler), _) => {
                let vector = if sampler == "usampler2D" { "uvec4" } else { "vec4" };
                format!("layout(std140) uniform {name}_block {{ {vector} {name}[{vectors}]; }};")
            }
            (None, Some((before, _))) if before.contains("uvec4") => {
                format!("{before}uvec4({name}[{element} >> 2u][{element} & 3u]);")
            }
            (None, Some((before, _))) => format!("{before}{name}[{element}];"),
            (None, None) => line.to_owned(),
        };
        text += &line;
        text += "\n";
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    const SHADER: &str = "uniform highp usampler2D material;\nuint material_element(uint i_1) {\n    uvec4 _e8 = \
        texelFetch(material, ivec2(uvec2((i_1 % 1024u), (i_1 / 1024u))), 0);\n    return _e8.x;\n}\n";

    #[test]
    fn few_elements_are_in_a_block() {
        let (text, place) = Elements::Words(&[7, 8, 9, 10, 11]).placed(SHADER, "material");
        assert!(matches!(place, Place::Block(words) if words == [7, 8, 9, 10, 11, 0, 0, 0]));
        assert!(text.contains("layout(std140) uniform material_block { uvec4 material[2]; };"), "{text}");
        assert!(text.contains("uvec4 _e8 = uvec4(material[i_1 >> 2u][i_1 & 3u]);"), "{text}");
        assert!(!text.contains("texelFetch"), "{text}");
    }

    #[test]
    fn many_elements_are_in_a_texture() {
        let many = vec![1; 4 * MAX_VECTORS + 1];
        let (text, place) = Elements::Words(&many).placed(SHADER, "material");
        assert_eq!(text, SHADER);
        let Place::Texture(texture) = place else { panic!("a block of {} words", many.len()) };
        assert_eq!((texture.name, texture.size), ("material", [1024, 5, 1]));
    }
}
