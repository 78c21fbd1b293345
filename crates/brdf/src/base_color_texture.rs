//! The picture of a material's base colour, as renderers show it on a mesh.

/// How coordinates outside of 0 to 1 are read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wrap {
    /// The picture is repeated.
    Repeat,
    /// The picture is repeated, every other time in a mirror.
    Mirror,
    /// The edge of the picture goes on.
    Clamp,
}

/// The picture of a base colour, and how a mesh shows it.
///
/// The material itself is the same everywhere: its base colour is the mean of the picture, times the factor.
#[derive(Clone, Debug, PartialEq)]
pub struct BaseColorTexture {
    size: [usize; 2],
    texels: Vec<[u8; 3]>,
    placement: TexturePlacement,
}

/// How a mesh shows a texture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TexturePlacement {
    /// The factor of the linear texels, RGB, each 0 to 1.
    pub factor: [f64; 3],
    /// The texture's coordinates of a mesh's (u, v), v downward: a row for each, `[a, b, c]` for a u + b v +
    /// c.
    pub transform: [[f64; 3]; 2],
    /// How coordinates outside of 0 to 1 are read along u and v.
    pub wrap: [Wrap; 2],
    /// Whether enlarged texels are squares of one colour. Otherwise colours are linear between their middles.
    pub is_nearest: bool,
}

impl Default for TexturePlacement {
    /// The coordinates of the mesh, repeated, without a factor.
    fn default() -> Self {
        Self {
            factor: [1.0; 3],
            transform: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
            wrap: [Wrap::Repeat; 2],
            is_nearest: false,
        }
    }
}

impl TexturePlacement {
    /// The texture's coordinates at a mesh's (u, v). What is not finite becomes 0, and what is far away at
    /// most 1e6.
    ///
    /// # Example: the transform is affine
    /// ```
    /// let transform = [[2.0, 0.0, 0.5], [0.0, 1.0, 0.0]];
    /// let placement = brdf::TexturePlacement { transform, ..Default::default() };
    /// assert_eq!(placement.coordinates([0.25, 0.5]), [1.0, 0.5]);
    /// ```
    pub fn coordinates(&self, [u, v]: [f32; 2]) -> [f32; 2] {
        self.transform.map(|[a, b, c]| {
            let at = a * f64::from(u) + b * f64::from(v) + c;
            if at.is_finite() { at.clamp(-1e6, 1e6) as f32 } else { 0.0 }
        })
    }
}

impl BaseColorTexture {
    /// The most texels along a side.
    pub const LONGEST_SIDE: usize = 1024;

    /// The texture of a width and height in texels, each RGB in sRGB, row by row from the top; `None` if
    /// these are not as many as the size says, a side is 0 or above [`BaseColorTexture::LONGEST_SIDE`], a
    /// factor is not from 0 to 1, or a number of the transform is not finite.
    pub fn new(size: [usize; 2], texels: Vec<[u8; 3]>, placement: TexturePlacement) -> Option<Self> {
        let is_sound = size.iter().all(|side| (1..=Self::LONGEST_SIDE).contains(side))
            && size[0] * size[1] == texels.len()
            && placement.factor.iter().all(|factor| (0.0..=1.0).contains(factor))
            && placement.transform.as_flattened().iter().all(|number| number.is_finite());
        is_sound.then_some(Self { size, texels, placement })
    }

    /// The width and the height in texels.
    pub fn size(&self) -> [usize; 2] {
        self.size
    }

    /// The texels, RGB in sRGB, row by row from the top.
    pub fn texels(&self) -> &[[u8; 3]] {
        &self.texels
    }

    /// How a mesh shows it.
    pub fn placement(&self) -> &TexturePlacement {
        &self.placement
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_sound_textures_are_made() {
        let sound = TexturePlacement::default();
        let made = |size, count, placement| BaseColorTexture::new(size, vec![[0; 3]; count], placement);
        assert_eq!(made([3, 2], 6, sound).unwrap().size(), [3, 2]);
        for (size, count) in [([0, 2], 0), ([3, 2], 5), ([1025, 1], 1025)] {
            assert_eq!(made(size, count, sound), None);
        }
        assert_eq!(made([1, 1], 1, TexturePlacement { factor: [1.0, 1.5, 1.0], ..sound }), None);
        assert_eq!(made([1, 1], 1, TexturePlacement { factor: [f64::NAN; 3], ..sound }), None);
        let infinite = [[1.0, 0.0, 0.0], [0.0, f64::INFINITY, 0.0]];
        assert_eq!(made([1, 1], 1, TexturePlacement { transform: infinite, ..sound }), None);
    }

    #[test]
    fn every_coordinate_is_usable() {
        let placement = TexturePlacement {
            transform: [[0.0, 1.0, 0.25], [-2.0, 0.0, 0.0]],
            ..TexturePlacement::default()
        };
        assert_eq!(placement.coordinates([0.5, 3.0]), [3.25, -1.0]);
        assert_eq!(placement.coordinates([1.0, f32::MAX]), [1e6, -2.0]);
        assert_eq!(placement.coordinates([f32::INFINITY, f32::NAN]), [0.0; 2]);
    }
}
