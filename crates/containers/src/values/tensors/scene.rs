//! A scene as light sees it.

use brdf::Wrap;
use probes::{
    Alpha, Corner, Emission, Lamp, LampKind, Material, NamedBox, Part, Scene, ScenePart, SceneParts, Texture,
    TextureUse,
};
use safetensors::tensor::Dtype;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use super::file::{TensorFile, Writer, wrong_shape};
use crate::error::Error;

/// The metadata entry that says what of the scene is there.
const PART: &str = "part";
/// The metadata entry with the digest of the surfaces.
const SURFACES: &str = "surfaces";
/// The numbers of a corner: RGBA and three pairs of texture coordinates.
const CORNER: usize = 10;

const PARTS: [(&str, ScenePart); 4] = [
    ("all", ScenePart::All),
    ("shape", ScenePart::Shape),
    ("surfaces", ScenePart::Surfaces),
    ("lamps", ScenePart::Lamps),
];
const WRAPS: [(&str, Wrap); 3] = [("repeat", Wrap::Repeat), ("mirror", Wrap::Mirror), ("clamp", Wrap::Clamp)];

/// A scene or a part of it, and what its surfaces are known by.
#[derive(Clone, Debug, PartialEq)]
pub struct StoredScene {
    /// The scene.
    pub scene: Scene,
    /// What of it is there.
    pub part: ScenePart,
    /// The digest of [`ScenePart::Surfaces`] of the whole scene, which says whether a transport belongs to
    /// it; empty for a shape, which does not depend on it.
    pub surfaces: String,
}

/// How a material reads a texture, in JSON.
#[derive(Serialize, Deserialize)]
struct TextureEntry {
    texture: u32,
    wrap: [String; 2],
    nearest: bool,
}

#[derive(Serialize, Deserialize)]
struct EmissionEntry {
    radiance: [f32; 3],
    #[serde(skip_serializing_if = "Option::is_none")]
    texture: Option<TextureEntry>,
}

#[derive(Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum AlphaEntry {
    Opaque,
    Mask(f32),
    Blend,
}

/// A material in JSON.
#[derive(Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
struct MaterialEntry {
    name: String,
    base: [f32; 4],
    #[serde(skip_serializing_if = "Option::is_none")]
    base_texture: Option<TextureEntry>,
    metallic: f32,
    #[serde(skip_serializing_if = "Option::is_none")]
    metallic_texture: Option<TextureEntry>,
    #[serde(skip_serializing_if = "Option::is_none")]
    emission: Option<EmissionEntry>,
    alpha: AlphaEntry,
    transmission: f32,
    double_sided: bool,
    unlit: bool,
}

/// A lamp in JSON; angles in radians.
#[derive(Serialize, Deserialize)]
struct LampEntry {
    name: String,
    /// `point`, `directional` or a cone's inner and outer angle.
    kind: LampKindEntry,
    position: [f32; 3],
    direction: [f32; 3],
    color: [f32; 3],
    intensity: f32,
    #[serde(skip_serializing_if = "Option::is_none")]
    range: Option<f32>,
}

#[derive(Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum LampKindEntry {
    Point,
    Spot([f32; 2]),
    Directional,
}

/// A scene of T triangles in Specula's frame, in metres: `triangles` [T, 3, 3] f32, `material_of` \[T\]
/// u32, `attributes` [A, 3, 10] f32 (RGBA, and the coordinates of the base colour, the emission and the
/// metallic share), `attributes_of` \[T\] u32 (4294967295 for none), and `texture0` [height, width, 4] u16,
/// ... , linear. The metadata have the lists `materials`, `lamps`, `nodes`, `boxes` and, if there are any,
/// `points` in JSON, `part` and `surfaces`.
pub fn encode_scene(stored: &StoredScene, recipe: Option<&str>) -> Vec<u8> {
    let SceneParts {
        triangles,
        attributes,
        attributes_of,
        material_of,
        materials,
        textures,
        lamps,
        parts,
        boxes,
        points,
    } = stored.scene.parts();
    let mut file = Writer::new("scene", recipe);
    let part = PARTS.iter().find(|(_, part)| *part == stored.part).map_or("all", |(word, _)| word);
    file.entry(PART, part);
    file.entry(SURFACES, stored.surfaces.clone());
    file.entry("materials", list(materials.iter().map(MaterialEntry::of)));
    file.entry("lamps", list(lamps.iter().map(LampEntry::of)));
    file.entry("nodes", list(parts.iter().map(|part| (part.name.as_str(), part.triangles))));
    file.entry("boxes", list(boxes.iter().map(|named| (named.name.as_str(), named.bounds))));
    if !points.is_empty() {
        file.entry("points", list(points.iter()));
    }
    let count = triangles.len();
    file.numbers("triangles", &[count, 3, 3], triangles.as_flattened().as_flattened());
    file.words("material_of", &[count], material_of);
    let corner = |Corner { color, base, emission, metallic }: &Corner| {
        let mut numbers = [0.0; CORNER];
        numbers[..4].copy_from_slice(color);
        numbers[4..6].copy_from_slice(base);
        numbers[6..8].copy_from_slice(emission);
        numbers[8..].copy_from_slice(metallic);
        numbers
    };
    let corners: Vec<f32> = attributes.as_flattened().iter().flat_map(corner).collect();
    file.numbers("attributes", &[attributes.len(), 3, CORNER], &corners);
    file.words("attributes_of", &[count], attributes_of);
    for (index, texture) in textures.iter().enumerate() {
        let [width, height] = texture.size();
        file.data.extend(texture.texels().as_flattened().iter().flat_map(|code| code.to_le_bytes()));
        file.tensor(format!("texture{index}"), "U16", &[height, width, 4]);
    }
    file.finish()
}

/// A list in JSON; numbers of 32 bits have the digits that they need.
fn list<T: Serialize>(entries: impl Iterator<Item = T>) -> String {
    serde_json::to_string(&entries.collect::<Vec<T>>()).unwrap_or_default()
}

/// A scene, from a file of kind `scene`.
///
/// # Errors
/// The errors of [`super::decode_lighting`] and of [`Scene::new`].
pub fn decode_scene(bytes: &[u8]) -> Result<StoredScene, Error> {
    let file = TensorFile::open_as(bytes, "scene")?;
    let numbers = |name: &str, shape: &str, columns: &[usize]| {
        file.array(name, Dtype::F32, shape, columns, f32::from_le_bytes)
    };
    let words = |name: &str| file.array(name, Dtype::U32, "[T]", &[], u32::from_le_bytes);
    let corners = numbers("attributes", "[A, 3, 10]", &[3, CORNER])?;
    let corner = |n: &[f32; CORNER]| Corner {
        color: [n[0], n[1], n[2], n[3]],
        base: [n[4], n[5]],
        emission: [n[6], n[7]],
        metallic: [n[8], n[9]],
    };
    let corners: Vec<Corner> = corners.as_chunks::<CORNER>().0.iter().map(corner).collect();
    let materials: Vec<MaterialEntry> = file.list("materials")?;
    let lamps: Vec<LampEntry> = file.list("lamps")?;
    let nodes: Vec<(String, usize)> = file.list("nodes")?;
    let nodes = nodes.into_iter().map(|(name, triangles)| Part { name, triangles });
    let boxes: Vec<(String, [[f32; 3]; 2])> = file.list("boxes")?;
    // Scenes without points do not have the list.
    let points = if file.metadata.contains_key("points") { file.list("points")? } else { Vec::new() };
    let triangles = numbers("triangles", "[T, 3, 3]", &[3, 3])?;
    let mut textures = Vec::new();
    while file.has(&format!("texture{}", textures.len())) {
        textures.push(texture(&file, &format!("texture{}", textures.len()))?);
    }
    let parts = SceneParts {
        triangles: triangles.as_chunks::<3>().0.as_chunks::<3>().0.to_vec(),
        attributes: corners.as_chunks::<3>().0.to_vec(),
        attributes_of: words("attributes_of")?,
        material_of: words("material_of")?,
        materials: materials.into_iter().map(MaterialEntry::material).collect::<Result<_, _>>()?,
        textures,
        lamps: lamps.into_iter().map(LampEntry::lamp).collect(),
        parts: nodes.collect(),
        boxes: boxes.into_iter().map(|(name, bounds)| NamedBox { name, bounds }).collect(),
        points,
    };
    let scene = Scene::new(parts).map_err(|error| Error::damaged(error.to_string()))?;
    let surfaces = file.metadata.get(SURFACES).cloned().unwrap_or_default();
    Ok(StoredScene { scene, part: file.choice(PART, PARTS)?, surfaces })
}

fn texture(file: &TensorFile<'_>, name: &str) -> Result<Texture, Error> {
    const SHAPE: &str = "[height, width, 4]";
    let tensor = file.tensor(name, Dtype::U16, SHAPE)?;
    let wrong = || wrong_shape(name, SHAPE, tensor.shape());
    let &[height, width, 4] = tensor.shape() else { return Err(wrong()) };
    let codes = tensor.data().as_chunks::<2>().0.iter().map(|code| u16::from_le_bytes(*code));
    let codes: Vec<u16> = codes.collect();
    Texture::new([width, height], codes.as_chunks::<4>().0.to_vec()).ok_or_else(wrong)
}

impl TensorFile<'_> {
    /// A list in the metadata.
    pub(super) fn list<T: DeserializeOwned>(&self, key: &str) -> Result<Vec<T>, Error> {
        let text = self.metadata.get(key).map_or("", String::as_str);
        serde_json::from_str(text)
            .map_err(|error| Error::damaged(format!("metadata `{key}`: expected a list in JSON: {error}")))
    }
}

impl TextureEntry {
    fn of(how: &TextureUse) -> Self {
        let word = |wrap: Wrap| {
            WRAPS.iter().find(|(_, other)| *other == wrap).map_or("repeat", |(word, _)| word).to_owned()
        };
        Self { texture: how.texture, wrap: how.wrap.map(word), nearest: how.is_nearest }
    }

    fn texture_use(self) -> Result<TextureUse, Error> {
        let wrap = |word: &String| {
            let found = WRAPS.iter().find(|(other, _)| other == word).map(|(_, wrap)| *wrap);
            found.ok_or_else(|| Error::damaged(format!("metadata `materials`: no wrap is called {word:?}")))
        };
        let [u, v] = &self.wrap;
        Ok(TextureUse { texture: self.texture, wrap: [wrap(u)?, wrap(v)?], is_nearest: self.nearest })
    }
}

impl MaterialEntry {
    fn of(material: &Material) -> Self {
        let texture = |how: &Option<TextureUse>| how.as_ref().map(TextureEntry::of);
        let emission = |Emission { radiance, texture: how }: &Emission| EmissionEntry {
            radiance: *radiance,
            texture: texture(how),
        };
        Self {
            name: material.name.clone(),
            base: material.base,
            base_texture: texture(&material.base_texture),
            metallic: material.metallic,
            metallic_texture: texture(&material.metallic_texture),
            emission: material.emission.as_ref().map(emission),
            alpha: match material.alpha {
                Alpha::Opaque => AlphaEntry::Opaque,
                Alpha::Mask(cutoff) => AlphaEntry::Mask(cutoff),
                Alpha::Blend => AlphaEntry::Blend,
            },
            transmission: material.transmission,
            double_sided: material.is_double_sided,
            unlit: material.is_unlit,
        }
    }

    fn material(self) -> Result<Material, Error> {
        let texture = |how: Option<TextureEntry>| how.map(TextureEntry::texture_use).transpose();
        let emission = match self.emission {
            Some(EmissionEntry { radiance, texture: how }) => {
                Some(Emission { radiance, texture: texture(how)? })
            }
            None => None,
        };
        Ok(Material {
            name: self.name,
            base: self.base,
            base_texture: texture(self.base_texture)?,
            metallic: self.metallic,
            metallic_texture: texture(self.metallic_texture)?,
            emission,
            alpha: match self.alpha {
                AlphaEntry::Opaque => Alpha::Opaque,
                AlphaEntry::Mask(cutoff) => Alpha::Mask(cutoff),
                AlphaEntry::Blend => Alpha::Blend,
            },
            transmission: self.transmission,
            is_double_sided: self.double_sided,
            is_unlit: self.unlit,
        })
    }
}

impl LampEntry {
    fn of(lamp: &Lamp) -> Self {
        Self {
            name: lamp.name.clone(),
            kind: match lamp.kind {
                LampKind::Point => LampKindEntry::Point,
                LampKind::Spot { inner, outer } => LampKindEntry::Spot([inner, outer]),
                LampKind::Directional => LampKindEntry::Directional,
            },
            position: lamp.position,
            direction: lamp.direction,
            color: lamp.color,
            intensity: lamp.intensity,
            range: lamp.range,
        }
    }

    fn lamp(self) -> Lamp {
        Lamp {
            name: self.name,
            kind: match self.kind {
                LampKindEntry::Point => LampKind::Point,
                LampKindEntry::Spot([inner, outer]) => LampKind::Spot { inner, outer },
                LampKindEntry::Directional => LampKind::Directional,
            },
            position: self.position,
            direction: self.direction,
            color: self.color,
            intensity: self.intensity,
            range: self.range,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::values::tensors::{describe, read_recipe};

    fn scene() -> StoredScene {
        let how = |texture| TextureUse { texture, wrap: [Wrap::Mirror, Wrap::Clamp], is_nearest: true };
        let texel = |k: u16| [k, 2 * k, 65535, 1];
        let lamp = |name: &str, kind| Lamp {
            name: name.into(),
            kind,
            position: [0.1, 0.2, 0.3],
            direction: [0.0, 0.6, -0.8],
            color: [1.0, 0.3, 0.1],
            intensity: 12.7,
            range: (name == "spot").then_some(7.25),
        };
        let wall = Material {
            name: "wall \"1\"".into(),
            base: [0.1, 0.7, 1.0 / 3.0, 0.9],
            base_texture: Some(how(0)),
            metallic: 0.25,
            metallic_texture: Some(how(1)),
            emission: Some(Emission { radiance: [1e3, 0.1, 0.0], texture: Some(how(1)) }),
            alpha: Alpha::Mask(0.4),
            transmission: 0.5,
            is_double_sided: true,
            is_unlit: false,
        };
        let unlit = Material { is_unlit: true, alpha: Alpha::Blend, ..Material::default() };
        let corner = Corner { color: [0.1; 4], base: [0.2; 2], emission: [0.3; 2], metallic: [-0.4; 2] };
        let parts = SceneParts {
            triangles: vec![[[0.0; 3], [1.1, 0.0, 0.0], [0.0, 1.0, 0.3]]; 3],
            attributes: vec![[corner; 3], [Corner::default(); 3]],
            attributes_of: vec![1, SceneParts::NONE, 0],
            material_of: vec![0, 1, 0],
            materials: vec![wall, unlit],
            textures: vec![
                Texture::new([3, 2], (0..6).map(texel).collect()).unwrap(),
                Texture::new([1, 1], vec![[7; 4]]).unwrap(),
            ],
            lamps: vec![
                lamp("point", LampKind::Point),
                lamp("spot", LampKind::Spot { inner: 0.1, outer: 0.7 }),
                lamp("sun", LampKind::Directional),
            ],
            parts: ["floor", "wall"].map(|name| Part { name: name.into(), triangles: 1 }).into(),
            boxes: vec![NamedBox { name: "hall".into(), bounds: [[-1.0; 3], [0.7; 3]] }],
            points: vec![[0.1, -2.5, 1e-7]],
        };
        let parts = SceneParts {
            parts: vec![parts.parts[0].clone(), Part { name: "wall".into(), triangles: 2 }],
            ..parts
        };
        StoredScene { scene: Scene::new(parts).unwrap(), part: ScenePart::All, surfaces: "ab12".into() }
    }

    #[test]
    fn scenes_and_their_parts_come_back() {
        let whole = scene();
        for (_, part) in PARTS {
            let stored = StoredScene { scene: whole.scene.part(part), part, ..whole.clone() };
            let bytes = encode_scene(&stored, Some("{}"));
            assert_eq!(decode_scene(&bytes).unwrap(), stored);
            assert_eq!(encode_scene(&decode_scene(&bytes).unwrap(), Some("{}")), bytes);
            assert_eq!(read_recipe(&bytes).as_deref(), Some("{}"));
        }
        let tensors = describe(&encode_scene(&whole, None)).unwrap().tensors;
        assert_eq!(tensors[4], ("texture0".to_owned(), "U16".to_owned(), vec![2, 3, 4]));
    }

    /// Every length, and every byte changed: an error or a scene that was checked, and never a panic.
    #[test]
    fn damaged_files_are_errors() {
        let whole = encode_scene(&scene(), None);
        for length in 0..whole.len() {
            assert!(decode_scene(&whole[..length]).is_err(), "cut at {length}");
        }
        let mut refused = 0;
        for at in 0..whole.len() {
            for change in [0x01, 0x80, 0xff] {
                let mut bytes = whole.clone();
                bytes[at] ^= change;
                match decode_scene(&bytes) {
                    Ok(stored) => assert!(Scene::new(stored.scene.parts().clone()).is_ok()),
                    Err(_) => refused += 1,
                }
            }
        }
        assert!(refused > 1000, "{refused}");
    }

    #[test]
    fn errors_name_what_is_wrong() {
        let whole = String::from_utf8_lossy(&encode_scene(&scene(), None)).into_owned();
        assert!(whole.contains(r#"\"wrap\":[\"mirror\",\"clamp\"]"#), "{whole}");
        let error = |from: &str, to: &str| {
            let bytes = encode_scene(&scene(), None);
            assert_eq!(from.len(), to.len());
            let at = bytes.windows(from.len()).position(|part| part == from.as_bytes()).unwrap();
            let bytes = [&bytes[..at], to.as_bytes(), &bytes[at + from.len()..]].concat();
            decode_scene(&bytes).unwrap_err().to_string()
        };
        assert_eq!(error("mirror", "mirrow"), "metadata `materials`: no wrap is called \"mirrow\"");
        let message = error(r#""part":"all""#, r#""part":"any""#);
        assert_eq!(message, "metadata `part`: expected all, shape, surfaces or lamps, found `any`");
        let message = error(r#"[\"wall\",2]"#, r#"[\"wall\",9]"#);
        assert_eq!(message, "the nodes of the scene do not belong together");
        let message = error("12.7", "-2.7");
        assert_eq!(message, "the lamp point: its intensity or its colour is not a number of 0 or more");
        assert!(error(r#"[\"wall\",2]"#, r#"[\"wall\";2]"#).starts_with("metadata `nodes`: expected a list"));
    }
}
