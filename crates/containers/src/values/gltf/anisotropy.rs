//! glTF 2.0: the direction in which a material is stretched, by `KHR_materials_anisotropy`.
//!
//! `anisotropyRotation` is an angle from the tangent toward the bitangent; red and green of
//! `anisotropyTexture`, from -1 to 1, are a direction in that frame, which is turned by that angle. Blue, the
//! strength, belongs to the material. `KHR_texture_transform` and the sampler's wrapping apply.

use brdf::Wrap;

use super::buffers::ReadBeside;
use super::element::Element;
use super::materials::{MaterialChoice, Reader, find, names, open};
use super::sampler::Sampler;
use super::texture_transform::TextureTransform;
use crate::error::Error;
use crate::images::DataTexture;

const NAME: &str = "KHR_materials_anisotropy";
const ANY: brdf::Range = brdf::Range { least: -1e9, most: 1e9, words: "a number" };

/// The direction in which a material is stretched, at any coordinates of a texture.
#[derive(Clone, Debug, PartialEq)]
pub struct Anisotropy {
    rotation: f64,
    texture: Option<AnisotropyTexture>,
    /// Warnings of what is not read of the anisotropy.
    pub warnings: Vec<String>,
}

#[derive(Clone, Debug, PartialEq)]
struct AnisotropyTexture {
    texels: DataTexture,
    wrap: [Wrap; 2],
    transform: TextureTransform,
}

impl Anisotropy {
    /// Whether the direction differs between coordinates.
    pub fn has_texture(&self) -> bool {
        self.texture.is_some()
    }

    /// The angle from the tangent toward the bitangent, in radians, at coordinates (u, v), v downward.
    pub fn angle(&self, [u, v]: [f32; 2]) -> f64 {
        let Some(AnisotropyTexture { texels, wrap, transform }) = &self.texture else {
            return self.rotation;
        };
        let place = transform.apply([f64::from(u), f64::from(v)]);
        let direction = |[x, y, ..]: [f32; 4]| [2.0 * x - 1.0, 2.0 * y - 1.0];
        let [x, y] = texels.at(place.map(|x| x as f32), *wrap, direction);
        self.rotation + math::atan2(f64::from(y), f64::from(x))
    }
}

/// The anisotropy of a material. Without a choice, the file must have one material only.
///
/// # Errors
/// The errors of [`super::read_gltf_material`], and an error if the material does not have the extension.
pub fn read_gltf_anisotropy<E: From<Error>>(
    bytes: &[u8],
    choice: Option<&MaterialChoice>,
    read: &mut ReadBeside<'_, E>,
) -> Result<Anisotropy, E> {
    let chunks = open(bytes)?;
    let json = &chunks.json;
    let material = Element::of(json, "materials").at(find(&names(json)?, choice)?)?;
    let extension = material.get("extensions").get(NAME);
    if !extension.is_present() {
        return Err(Error::unsupported(format!("{}: there is no {NAME}", material.path())).into());
    }
    let rotation = extension.get("anisotropyRotation").number(0.0, ANY)?;
    let info = extension.get("anisotropyTexture");
    let mut warnings = Vec::new();
    let texture = if info.is_present() {
        let (bytes, name) = Reader::new(json, chunks.binary, read).picture(&info)?;
        let texels = DataTexture::read(&bytes).map_err(|error| error.within(name).within(info.path()))?;
        let wanted = TextureTransform::set(&info)?;
        // The coordinates of an imported mesh are those of its normal texture.
        if wanted != TextureTransform::set(&material.get("normalTexture"))? {
            warnings.push(format!(
                "{}: the texture is read with the mesh's coordinates, not set {wanted}",
                info.path()
            ));
        }
        Some(AnisotropyTexture {
            texels,
            wrap: Sampler::of(json, &info)?.wrap,
            transform: TextureTransform::of(&info)?,
        })
    } else {
        None
    };
    Ok(Anisotropy { rotation, texture, warnings })
}
