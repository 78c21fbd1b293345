//! KHR_texture_transform: which coordinates of a texture a mesh's coordinates become.

use super::element::Element;
use crate::error::Error;

const NAME: &str = "KHR_texture_transform";
const ANY: brdf::Range = brdf::Range { least: -1e9, most: 1e9, words: "a number" };

/// u' = T R S u, each optional.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct TextureTransform {
    offset: [f64; 2],
    /// The rotation in radians, clockwise in a frame whose v goes downward.
    rotation: f64,
    pub(super) scale: [f64; 2],
}

impl TextureTransform {
    /// The transform of a reference to a texture; the identity if it has none.
    pub(super) fn of(texture: &Element<'_>) -> Result<Self, Error> {
        let transform = texture.get("extensions").get(NAME);
        Ok(Self {
            offset: transform.get("offset").pair([0.0; 2], ANY)?,
            rotation: transform.get("rotation").number(0.0, ANY)?,
            scale: transform.get("scale").pair([1.0; 2], ANY)?,
        })
    }

    /// The set of coordinates of a reference to a texture. The transform may name another than the texture.
    pub(super) fn set(texture: &Element<'_>) -> Result<usize, Error> {
        match texture.get("extensions").get(NAME).get("texCoord").index()? {
            Some(set) => Ok(set),
            None => Ok(texture.get("texCoord").index()?.unwrap_or(0)),
        }
    }

    /// Whether coordinates from 0 to 1 show a part of the texture only.
    pub(super) fn shows_part(&self) -> bool {
        self.scale.iter().any(|scale| scale.abs() < 1.0)
    }

    /// The rows of the transform: [a, b, c] for a u + b v + c.
    pub(super) fn rows(&self) -> [[f64; 3]; 2] {
        let (sin, cos) = math::sin_cos(self.rotation);
        let ([x, y], [u, v]) = (self.scale, self.offset);
        [[cos * x, sin * y, u], [-sin * x, cos * y, v]]
    }

    pub(super) fn apply(&self, [u, v]: [f64; 2]) -> [f64; 2] {
        let (sin, cos) = math::sin_cos(self.rotation);
        let [u, v] = [u * self.scale[0], v * self.scale[1]];
        [cos * u + sin * v + self.offset[0], cos * v - sin * u + self.offset[1]]
    }
}
