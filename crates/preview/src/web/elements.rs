//! The elements of what is a storage buffer on a graphics device: in a uniform block if they fit into the
//! smallest that WebGL 2 has, which is read as fast as a constant, and otherwise in a texture.

use super::texture::{ELEMENTS, WebTexels, WebTexture};

/// The arrays that are in a block if they fit, and otherwise in a texture.
#[cfg(all(test, feature = "gpu"))]
pub(crate) const ARRAYS: [&str; 6] =
    ["harmonics_constants", "lamps", "material", "quarter_turns", "table_light", "transfer_light"];

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
    /// Places them: in a block, or in a texture of this name.
    pub(super) fn placed(self, name: &'static str) -> Place {
        let (vectors, mut words): (usize, Vec<u32>) = match self {
            Self::Vectors(of) => (of.len(), of.as_flattened().iter().map(|value| value.to_bits()).collect()),
            Self::Words(of) => (of.len().div_ceil(4), of.to_vec()),
        };
        let vectors = vectors.max(1);
        if vectors <= MAX_VECTORS {
            words.resize(4 * vectors, 0);
            return Place::Block(words);
        }
        let (count, texels) = match self {
            Self::Vectors(of) => (of.len(), WebTexels::Rgba(padded(of, [0.0; 4]))),
            Self::Words(of) => (of.len(), WebTexels::Words(padded(of, 0))),
        };
        let size = [ELEMENTS, count.div_ceil(ELEMENTS), 1];
        Place::Texture(WebTexture { name, size, is_array: false, is_linear: false, texels })
    }
}

/// Elements in whole rows of a texture.
pub(super) fn padded<T: Copy>(elements: &[T], nothing: T) -> Vec<T> {
    let mut texels = elements.to_vec();
    texels.resize(elements.len().next_multiple_of(ELEMENTS), nothing);
    texels
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn few_elements_are_in_a_block() {
        let place = Elements::Words(&[7, 8, 9, 10, 11]).placed("material");
        assert!(matches!(place, Place::Block(words) if words == [7, 8, 9, 10, 11, 0, 0, 0]));
    }

    #[test]
    fn many_elements_are_in_a_texture() {
        let many = vec![1; 4 * MAX_VECTORS + 1];
        let Place::Texture(texture) = Elements::Words(&many).placed("material") else {
            panic!("a block of {} words", many.len())
        };
        assert_eq!((texture.name, texture.size), ("material", [1024, 5, 1]));
    }
}
