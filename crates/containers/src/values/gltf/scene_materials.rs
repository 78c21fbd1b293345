//! The materials of a scene for light probes: matte, with the textures that they need.

use std::collections::{BTreeMap, BTreeSet};

use probes::{Alpha, Emission, MOST_ALBEDO, Material, Texture, TextureUse};
use serde_json::{Map, Value};

use super::buffers::ReadBeside;
use super::element::Element;
use super::materials::Reader;
use super::sampler::Sampler;
use super::texture_transform::TextureTransform;
use crate::error::Error;
use crate::images::{Raster, raster_of_texture, srgb_to_linear};

const FACTOR: brdf::Range = brdf::Range { least: 0.0, most: 1.0, words: "a number from 0 to 1" };
const AMOUNT: brdf::Range = brdf::Range { least: 0.0, most: f32::MAX as f64, words: "a number of 0 or more" };

/// Names that are listed in a note.
const LISTED: usize = 8;

/// What metals reflect.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Metals {
    /// Metals are matte, with their base colour as albedo.
    #[default]
    Diffuse,
    /// Metals are black.
    Black,
}

/// What surfaces with `KHR_materials_transmission` let through.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Transmission {
    /// They let nothing through.
    Opaque,
    /// They let the share that the extension states pass straight, with their base colour.
    #[default]
    Clear,
}

/// The set of coordinates of a texture, and how it is transformed.
type Placement = (u32, TextureTransform);

/// The coordinates that a material reads textures at.
#[derive(Clone, Debug, Default)]
pub(super) struct Coordinates {
    pub(super) base: Option<Placement>,
    pub(super) emission: Option<Placement>,
    pub(super) metallic: Option<Placement>,
}

/// The materials that a scene uses.
pub(super) struct Materials {
    pub(super) materials: Vec<Material>,
    pub(super) coordinates: Vec<Coordinates>,
    pub(super) textures: Vec<Texture>,
    pub(super) notes: Vec<String>,
    /// The place of each material of the file here; `None` is that of triangles without one.
    places: BTreeMap<Option<usize>, u32>,
}

/// What a texture's numbers mean.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Meaning {
    /// sRGB and alpha.
    Colour,
    /// The metallic share in blue.
    Metallic,
}

impl Materials {
    /// Reads the materials of a file that are used.
    pub(super) fn read<E: From<Error>>(
        json: &Map<String, Value>,
        used: &BTreeSet<Option<usize>>,
        chunk: Option<&[u8]>,
        metals: Metals,
        transmission: Transmission,
        read: &mut ReadBeside<'_, E>,
    ) -> Result<Self, E> {
        let mut pictures = Pictures {
            json,
            reader: Reader::new(json, chunk, read),
            textures: Vec::new(),
            places: BTreeMap::new(),
        };
        let (mut materials, mut coordinates, mut places) = (Vec::new(), Vec::new(), BTreeMap::new());
        for &index in used {
            places.insert(index, materials.len() as u32);
            let (material, own) = match index {
                None => (Material { name: "default".into(), ..Material::default() }, Coordinates::default()),
                Some(index) => {
                    let element = Element::of(json, "materials").at(index)?;
                    let name = element.get("name").text()?;
                    let name = name.map_or_else(|| element.path().to_owned(), str::to_owned);
                    pictures.material(&element, name, metals, transmission)?
                }
            };
            materials.push(material);
            coordinates.push(own);
        }
        let textures = pictures.textures;
        let notes = notes(&materials, &textures);
        Ok(Self { materials, coordinates, textures, notes, places })
    }

    /// The place of a material of the file.
    pub(super) fn place_of(&self, material: Option<usize>) -> u32 {
        self.places.get(&material).copied().unwrap_or(0)
    }
}

/// The textures that were read.
struct Pictures<'a, 'r, E> {
    json: &'a Map<String, Value>,
    reader: Reader<'a, 'r, E>,
    textures: Vec<Texture>,
    /// The place of each image among the textures, by its path in the document.
    places: BTreeMap<(String, Meaning), u32>,
}

impl<E: From<Error>> Pictures<'_, '_, E> {
    fn material(
        &mut self,
        element: &Element<'_>,
        name: String,
        metals: Metals,
        transmission: Transmission,
    ) -> Result<(Material, Coordinates), E> {
        let base = element.get("pbrMetallicRoughness");
        let extensions = element.get("extensions");
        let factor = base.get("baseColorFactor");
        let [red, green, blue] = factor.colour([1.0; 3], FACTOR)?;
        let alpha = if factor.count() == 4 { factor.row([1.0; 4])?[3] } else { 1.0 };
        let (base_texture, of_base) = self.texture(&base.get("baseColorTexture"), Meaning::Colour)?.unzip();
        let (mut metallic, mut metallic_texture, mut of_metallic) = (0.0, None, None);
        if metals == Metals::Black {
            metallic = base.get("metallicFactor").number(1.0, FACTOR)?;
            if metallic > 0.0 {
                let texture = base.get("metallicRoughnessTexture");
                (metallic_texture, of_metallic) = self.texture(&texture, Meaning::Metallic)?.unzip();
            }
        }
        let is_unlit = extensions.get("KHR_materials_unlit").is_present();
        let (mut emission, mut of_emission) = (None, None);
        if is_unlit {
            let radiance = [red, green, blue].map(|channel| channel as f32);
            emission = Some(Emission { radiance, texture: base_texture });
        } else {
            let strength = extensions.get("KHR_materials_emissive_strength").get("emissiveStrength");
            let strength = strength.number(1.0, AMOUNT)?;
            let radiance = element.get("emissiveFactor").colour([0.0; 3], AMOUNT)?;
            let radiance = radiance.map(|channel| (channel * strength) as f32);
            if radiance != [0.0; 3] {
                let (texture, place) =
                    self.texture(&element.get("emissiveTexture"), Meaning::Colour)?.unzip();
                emission = Some(Emission { radiance, texture });
                of_emission = place;
            }
        }
        let alpha_mode = element.get("alphaMode");
        let mode = match alpha_mode.text()? {
            None | Some("OPAQUE") => Alpha::Opaque,
            Some("MASK") => Alpha::Mask(element.get("alphaCutoff").number(0.5, AMOUNT)? as f32),
            Some("BLEND") => Alpha::Blend,
            Some(other) => {
                let message = format!("{}: {other:?} is not OPAQUE, MASK or BLEND", alpha_mode.path());
                return Err(Error::damaged(message).into());
            }
        };
        let share =
            extensions.get("KHR_materials_transmission").get("transmissionFactor").number(0.0, FACTOR)?;
        let material = Material {
            name,
            base: [red, green, blue, alpha].map(|channel| channel as f32),
            base_texture,
            metallic: metallic as f32,
            metallic_texture,
            emission,
            alpha: mode,
            transmission: if transmission == Transmission::Clear { share as f32 } else { 0.0 },
            is_double_sided: element.get("doubleSided").flag()?,
            is_unlit,
        };
        Ok((material, Coordinates { base: of_base, emission: of_emission, metallic: of_metallic }))
    }

    /// A texture that a material refers to, if it does.
    fn texture(
        &mut self,
        texture: &Element<'_>,
        meaning: Meaning,
    ) -> Result<Option<(TextureUse, Placement)>, E> {
        if !texture.is_present() {
            return Ok(None);
        }
        let Sampler { wrap, is_nearest } = Sampler::of(self.json, texture)?;
        let placement = (TextureTransform::set(texture)? as u32, TextureTransform::of(texture)?);
        let key = (self.reader.image(texture)?.path().to_owned(), meaning);
        let place = match self.places.get(&key) {
            Some(place) => *place,
            None => {
                let (bytes, name) = self.reader.picture(texture)?;
                let picture = raster_of_texture(&bytes).and_then(|raster| texels(&raster, meaning));
                let picture = picture.map_err(|error| error.within(name).within(texture.path()))?;
                self.textures.push(picture);
                let place = self.textures.len() as u32 - 1;
                self.places.insert(key, place);
                place
            }
        };
        Ok(Some((TextureUse { texture: place, wrap, is_nearest }, placement)))
    }
}

/// A picture as a texture of a scene, its sides halved until none is longer than [`Texture::LONGEST_SIDE`].
/// Means are those of linear colours.
fn texels(raster: &Raster, meaning: Meaning) -> Result<Texture, Error> {
    let &Raster { width, height, channels, depth, ref samples, .. } = raster;
    if depth > 2 {
        return Err(Error::unsupported("the texels are floats; expected integers of 8 or 16 bits"));
    }
    let codes = 1_usize << (8 * depth);
    let number = |code: usize| code as f64 / (codes - 1) as f64;
    let decoded: Vec<f32> = match meaning {
        Meaning::Colour => (0..codes).map(|code| srgb_to_linear(number(code)) as f32).collect(),
        Meaning::Metallic => (0..codes).map(|code| number(code) as f32).collect(),
    };
    let rgb = match (meaning, channels) {
        (_, 0..3) => [0; 3],
        (Meaning::Colour, _) => [0, 1, 2],
        (Meaning::Metallic, _) => [2; 3],
    };
    let code = |pixel: usize, channel: usize| {
        let first = (pixel * channels + channel) * depth;
        match samples.get(first..first + depth) {
            Some(&[code]) => usize::from(code),
            Some(&[a, b]) => usize::from(u16::from_ne_bytes([a, b])),
            _ => 0,
        }
    };
    let has_alpha = channels.is_multiple_of(2);
    let texel = |pixel: usize| {
        let [red, green, blue] = rgb.map(|channel| decoded[code(pixel, channel)]);
        [red, green, blue, if has_alpha { number(code(pixel, channels - 1)) as f32 } else { 1.0 }]
    };
    let longest = width.max(height);
    let halvings = (0..usize::BITS).find(|k| longest >> k <= Texture::LONGEST_SIDE).unwrap_or(0);
    let size = [width, height].map(|side| (side >> halvings).max(1));
    let edges = |side: usize, count: usize, k: usize| k * side / count..((k + 1) * side / count);
    let mut texels = Vec::with_capacity(size[0] * size[1]);
    for row in 0..size[1] {
        for column in 0..size[0] {
            let (mut sum, mut count) = ([0.0_f32; 4], 0.0);
            for y in edges(height, size[1], row) {
                for x in edges(width, size[0], column) {
                    sum.iter_mut().zip(texel(y * width + x)).for_each(|(sum, value)| *sum += value);
                    count += 1.0;
                }
            }
            texels.push(sum.map(|sum| (sum / count * 65535.0).round() as u16));
        }
    }
    Texture::new(size, texels).ok_or_else(|| Error::damaged("the picture has no texels"))
}

/// Notes of the materials: which are clamped, which let light pass.
fn notes(materials: &[Material], textures: &[Texture]) -> Vec<String> {
    let listed = |names: &[&str]| {
        let more = names.len().saturating_sub(LISTED);
        names[..names.len().min(LISTED)].join(", ")
            + &if more > 0 { format!(" and {more} more") } else { String::new() }
    };
    let (mut bright, mut texels) = (Vec::new(), 0);
    for material in materials.iter().filter(|material| !material.is_unlit) {
        let base = material.base.map(|factor| factor * (1.0 - material.metallic));
        let is_above = |texel: &[u16; 4]| {
            (0..3).any(|channel| base[channel] * f32::from(texel[channel]) / 65535.0 > MOST_ALBEDO)
        };
        let texture = material.base_texture.and_then(|how| textures.get(how.texture as usize));
        let above = match texture {
            Some(texture) => texture.texels().iter().filter(|texel| is_above(texel)).count(),
            None => usize::from(is_above(&[65535; 4])),
        };
        if above > 0 {
            bright.push(material.name.as_str());
            texels += if texture.is_some() { above } else { 0 };
        }
    }
    let mut notes = Vec::new();
    if !bright.is_empty() {
        let of_textures = if texels > 0 { format!(" ({texels} texels)") } else { String::new() };
        notes.push(format!(
            "the albedo of {} of {} materials is above {MOST_ALBEDO} and taken as that{of_textures}: {}",
            bright.len(),
            materials.len(),
            listed(&bright)
        ));
    }
    let blended: Vec<&str> =
        materials.iter().filter(|m| m.alpha == Alpha::Blend).map(|m| m.name.as_str()).collect();
    if !blended.is_empty() {
        notes.push(format!(
            "a share of 1 - alpha of light passes materials that are blended: {}",
            listed(&blended)
        ));
    }
    let clear: Vec<&str> =
        materials.iter().filter(|m| m.transmission > 0.0).map(|m| m.name.as_str()).collect();
    if !clear.is_empty() {
        notes.push(format!("light passes materials with transmission straight: {}", listed(&clear)));
    }
    notes
}
