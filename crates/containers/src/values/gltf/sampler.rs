//! How a texture is read between its texels and beyond its edges.

use brdf::Wrap;
use serde_json::{Map, Value};

use super::element::Element;
use crate::error::Error;

/// OpenGL's numbers.
const NEAREST: usize = 9728;
const CLAMP_TO_EDGE: usize = 33071;
const MIRRORED_REPEAT: usize = 33648;

/// The sampler of a texture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Sampler {
    /// How the texture goes on along u and v.
    pub(super) wrap: [Wrap; 2],
    /// Whether enlarged texels are squares.
    pub(super) is_nearest: bool,
}

impl Sampler {
    /// The sampler of a reference to a texture. A texture without one repeats and is smooth.
    pub(super) fn of(json: &Map<String, Value>, info: &Element<'_>) -> Result<Self, Error> {
        let texture = Element::of(json, "textures").at(info.get("index").index()?.unwrap_or(0))?;
        let Some(sampler) = texture.get("sampler").index()? else {
            return Ok(Self { wrap: [Wrap::Repeat; 2], is_nearest: false });
        };
        let sampler = Element::of(json, "samplers").at(sampler)?;
        let along = |name: &str| {
            Ok(match sampler.get(name).index()? {
                Some(CLAMP_TO_EDGE) => Wrap::Clamp,
                Some(MIRRORED_REPEAT) => Wrap::Mirror,
                _ => Wrap::Repeat,
            })
        };
        Ok(Self {
            wrap: [along("wrapS")?, along("wrapT")?],
            is_nearest: sampler.get("magFilter").index()? == Some(NEAREST),
        })
    }
}
