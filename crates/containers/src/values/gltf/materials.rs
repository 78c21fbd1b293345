//! glTF 2.0: the materials of a file, each as one that is the same everywhere.
//!
//! `pbrMetallicRoughness` and the extensions `KHR_materials_ior`, `_specular`, `_clearcoat` and `_sheen`
//! become a [`Standard`] material. A texture becomes its mean, times its factor: a reflection map holds
//! one material. Previews show the texture of the base colour beside it. What makes no difference to these
//! (sets of coordinates and samplers of other textures) is ignored; what would, or might, is named in a
//! warning.

use std::collections::BTreeMap;
use std::io::{Read, Seek};
use std::sync::Arc;

use brdf::{BaseColorTexture, Range, Standard, StandardParameters, TexturePlacement, WEIGHT};
use serde_json::{Map, Value};

use super::base_color;
use super::buffers::{ReadBeside, embedded, find_beside};
use super::document;
use super::document::Chunks;
use super::element::Element;
use super::extensions::check_for_material;
use super::sampler::Sampler;
use super::texels::Mean;
use super::texture_transform::TextureTransform;
use crate::error::{Error, ErrorKind};
use crate::images::{Raster, raster_of_texture};

/// The factors of glTF.
const FACTOR: Range = Range { least: 0.0, most: 1.0, words: "a number from 0 to 1" };
/// An index of refraction; 0 stands for an infinite one.
const IOR: Range = Range { least: 0.0, most: 10.0, words: "0 or a number from 1 to 10" };
/// The least roughness of the highlights, and of sheen.
const MIN_ROUGHNESS: [f64; 2] = [0.01, 0.1];
/// Names that are listed in a message.
const LISTED: usize = 20;
/// Extensions of materials that are read.
const READ: [&str; 4] =
    ["KHR_materials_ior", "KHR_materials_specular", "KHR_materials_clearcoat", "KHR_materials_sheen"];

/// Which material of a file is meant.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum MaterialChoice {
    /// The material of this name.
    Name(String),
    /// The material at this place, from 0 on.
    Index(usize),
}

/// A material of a file, and what its user should know of it.
#[derive(Clone, Debug, PartialEq)]
pub struct GltfMaterial {
    /// The material.
    pub material: Standard,
    /// The picture of its base colour, if the meshes of the file have the coordinates for it.
    pub base_color: Option<BaseColorTexture>,
    /// Notes of what was averaged, and over how many texels.
    pub notes: Vec<String>,
    /// Warnings of what the file says of the material and is not read.
    pub warnings: Vec<String>,
}

/// The names of a file's materials in order; empty for one that has none.
///
/// # Errors
/// If the file is not glTF 2.0 or is damaged.
pub fn gltf_materials(bytes: &[u8]) -> Result<Vec<String>, Error> {
    names(&open(bytes)?.json)
}

/// Reads a material. Without a choice, the file must have one material only.
///
/// Textures are read through `read` if they are in files: see [`read_gltf`](super::read_gltf). Only those of
/// the chosen material are read.
///
/// # Errors
/// If `read` fails; if the file is not glTF 2.0 or is damaged, there is no such material, or a texture is not
/// PNG, JPEG or WebP. The message names the place in the file.
pub fn read_gltf_material<E: From<Error>>(
    bytes: &[u8],
    choice: Option<&MaterialChoice>,
    read: &mut ReadBeside<'_, E>,
) -> Result<GltfMaterial, E> {
    let Chunks { json, binary } = open(bytes)?;
    let index = find(&names(&json)?, choice)?;
    let material = Element::of(&json, "materials").at(index)?;
    check_for_material(&json, &material, &READ)?;
    let mut reader = Reader::new(&json, binary, read);
    let parameters = reader.parameters(&material)?;
    let (notes, of_textures, base_color) = (reader.notes, reader.warnings, reader.base_color);
    let material_of = |error: brdf::ParameterError| Error::damaged(error.to_string()).within(material.path());
    Ok(GltfMaterial {
        material: Standard::new(parameters).map_err(material_of)?,
        base_color,
        notes,
        warnings: [of_textures, warnings(&json, index, &material)?].concat(),
    })
}

/// Checks the JSON of a file for a material, but not the pictures of its textures: `find` is called with each
/// file beside it that is needed.
///
/// # Errors
/// If `find` fails, or for what [`read_gltf_material`] refuses, if the JSON shows it.
pub fn check_gltf_material<E: From<Error>>(
    file: &mut (impl Read + Seek),
    choice: Option<&MaterialChoice>,
    find: &mut dyn FnMut(&str) -> Result<(), E>,
) -> Result<(), E> {
    let (json, _) = document::read_json(file)?;
    check_asset(&json)?;
    let index = self::find(&names(&json)?, choice)?;
    let material = Element::of(&json, "materials").at(index)?;
    check_for_material(&json, &material, &READ)?;
    let mut beside = |path: &str| find(path).map(|()| Arc::default());
    let mut reader = Reader { is_check: true, ..Reader::new(&json, None, &mut beside) };
    let parameters = reader.parameters(&material)?;
    let material_of = |error: brdf::ParameterError| Error::damaged(error.to_string()).within(material.path());
    Standard::new(parameters).map_err(material_of)?;
    warnings(&json, index, &material)?;
    Ok(())
}

/// The chunks of a file of this version.
pub(super) fn open(bytes: &[u8]) -> Result<Chunks<'_>, Error> {
    let chunks = document::read(bytes)?;
    check_asset(&chunks.json)?;
    Ok(chunks)
}

fn check_asset(json: &Map<String, Value>) -> Result<(), Error> {
    let asset = Element::of(json, "asset");
    let version = asset.get("version").text()?;
    let version = version.ok_or_else(|| Error::damaged("asset.version is missing; expected \"2.0\""))?;
    document::check_version(version, asset.get("minVersion").text()?)
}

/// The name of each material; its place if it has none.
pub(super) fn names(json: &Map<String, Value>) -> Result<Vec<String>, Error> {
    let materials = Element::of(json, "materials");
    let name = |index: usize| {
        Ok(materials.at(index)?.get("name").text()?.map_or_else(|| index.to_string(), str::to_owned))
    };
    (0..materials.count()).map(name).collect()
}

/// The place of the material that is meant.
pub(in crate::values) fn find(names: &[String], choice: Option<&MaterialChoice>) -> Result<usize, Error> {
    let wrong = |message: String| Err(Error::new(ErrorKind::NoSuchMaterial, message));
    if names.is_empty() {
        return wrong("the file has no materials".into());
    }
    let listed = || {
        let more = names.len().saturating_sub(LISTED);
        let number = |(index, name): (usize, &String)| match index.to_string() {
            number if number == *name => format!("{index} (without a name)"),
            number => format!("{number}: {name}"),
        };
        let first: Vec<_> = names.iter().enumerate().take(LISTED).map(number).collect();
        first.join(", ") + &if more > 0 { format!(" and {more} more") } else { String::new() }
    };
    match choice {
        None if names.len() == 1 => Ok(0),
        None => wrong(format!(
            "the file has {} materials; expected `material` to be one of: {}",
            names.len(),
            listed()
        )),
        Some(MaterialChoice::Index(index)) if *index < names.len() => Ok(*index),
        Some(MaterialChoice::Index(index)) => {
            wrong(format!("there is no material {index}; expected 0 to {} of: {}", names.len() - 1, listed()))
        }
        Some(MaterialChoice::Name(name)) => {
            let mut named = (0..names.len()).filter(|index| names[*index] == *name);
            match (named.next(), named.next()) {
                (Some(index), None) => Ok(index),
                (Some(one), Some(other)) => wrong(format!(
                    "the materials {one} and {other} are both named {name:?}; name one by its number: material = {one}"
                )),
                _ => wrong(format!("there is no material {name:?}; expected one of: {}", listed())),
            }
        }
    }
}

/// A material that is being read, and the files beside that were.
pub(super) struct Reader<'a, 'r, E> {
    document: &'a Map<String, Value>,
    chunk: Option<&'a [u8]>,
    read: &'a mut ReadBeside<'r, E>,
    /// The contents and paths of the files that URIs name, by the URI.
    beside: BTreeMap<String, (Arc<Vec<u8>>, String)>,
    notes: Vec<String>,
    warnings: Vec<String>,
    /// The texture of the base colour.
    base_color: Option<BaseColorTexture>,
    /// Whether textures are only looked for, not averaged.
    is_check: bool,
}

impl<'a, 'r, E: From<Error>> Reader<'a, 'r, E> {
    pub(super) fn new(
        document: &'a Map<String, Value>,
        chunk: Option<&'a [u8]>,
        read: &'a mut ReadBeside<'r, E>,
    ) -> Self {
        let (beside, notes, warnings) = (BTreeMap::new(), Vec::new(), Vec::new());
        Self { document, chunk, read, beside, notes, warnings, base_color: None, is_check: false }
    }

    fn parameters(&mut self, material: &Element<'_>) -> Result<StandardParameters, E> {
        let base = material.get("pbrMetallicRoughness");
        let [ior, specular, clearcoat, sheen] = READ.map(|name| material.get("extensions").get(name));
        let one = [1.0; 3];

        let base_color = self.base_color(&base, material)?;
        let mut metallic = base.get("metallicFactor").number(1.0, FACTOR)?;
        let mut roughness = base.get("roughnessFactor").number(1.0, FACTOR)?;
        if let Some(mean) = self.mean(&base.get("metallicRoughnessTexture"), "metallic and roughness")? {
            roughness *= mean.stored[1];
            metallic *= mean.stored[2];
        }

        let mut specular_factor = specular.get("specularFactor").number(1.0, FACTOR)?;
        if let Some(mean) = self.mean(&specular.get("specularTexture"), "specular")? {
            specular_factor *= mean.stored[3];
        }
        let mut specular_color = specular.get("specularColorFactor").colour(one, WEIGHT)?;
        if let Some(mean) = self.mean(&specular.get("specularColorTexture"), "specular_color")? {
            specular_color = times(specular_color, mean.colour);
        }
        let (ior, scale) = refraction(ior.get("ior").number(1.5, IOR)?);
        specular_color = specular_color.map(|channel| channel * scale);

        let mut coat = clearcoat.get("clearcoatFactor").number(0.0, FACTOR)?;
        if let Some(mean) = self.mean(&clearcoat.get("clearcoatTexture"), "clearcoat")? {
            coat *= mean.stored[0];
        }
        let mut coat_roughness = clearcoat.get("clearcoatRoughnessFactor").number(0.0, FACTOR)?;
        if let Some(mean) = self.mean(&clearcoat.get("clearcoatRoughnessTexture"), "clearcoat_roughness")? {
            coat_roughness *= mean.stored[1];
        }

        let mut sheen_color = sheen.get("sheenColorFactor").colour([0.0; 3], FACTOR)?;
        if let Some(mean) = self.mean(&sheen.get("sheenColorTexture"), "sheen")? {
            sheen_color = times(sheen_color, mean.colour);
        }
        let mut sheen_roughness = sheen.get("sheenRoughnessFactor").number(0.0, FACTOR)?;
        if let Some(mean) = self.mean(&sheen.get("sheenRoughnessTexture"), "sheen_roughness")? {
            sheen_roughness *= mean.stored[3];
        }

        let has_sheen = sheen_color.iter().any(|channel| *channel > 0.0);
        let [least, least_of_sheen] = MIN_ROUGHNESS;
        Ok(StandardParameters {
            base_color,
            metallic,
            roughness: self.at_least("roughness", roughness, least, true),
            ior,
            specular: specular_factor,
            specular_color,
            clearcoat: coat,
            clearcoat_roughness: self.at_least("clearcoat_roughness", coat_roughness, least, coat > 0.0),
            sheen: sheen_color,
            sheen_roughness: self.at_least("sheen_roughness", sheen_roughness, least_of_sheen, has_sheen),
        })
    }

    /// The base colour: its factor, times the mean of its texture, which is kept if previews can show it.
    fn base_color(&mut self, base: &Element<'_>, material: &Element<'_>) -> Result<[f64; 3], E> {
        let factor = base.get("baseColorFactor").colour([1.0; 3], FACTOR)?;
        let texture = base.get("baseColorTexture");
        if !texture.is_present() {
            return Ok(factor);
        }
        self.image(&texture)?;
        let Sampler { wrap, is_nearest } = Sampler::of(self.document, &texture)?;
        let transform = TextureTransform::of(&texture)?.rows();
        // The coordinates of an imported mesh are those of its normal texture.
        let [set, kept] = [&texture, &material.get("normalTexture")].map(TextureTransform::set);
        let (set, kept) = (set?, kept?);
        let Some((mean, raster)) = self.averaged(&texture, "base_color")? else { return Ok(factor) };
        if set == kept {
            let placement = TexturePlacement { factor, transform, wrap, is_nearest };
            self.base_color = base_color::texture(&raster, placement);
        } else {
            self.notes.push(format!(
                "base_color: previews show its mean, because its texture has the coordinates {set}, and a mesh those of its normal texture, {kept}"
            ));
        }
        Ok(times(factor, mean.colour))
    }

    /// A roughness, or the least that the model has; that is noted if it matters.
    fn at_least(&mut self, name: &str, value: f64, least: f64, matters: bool) -> f64 {
        if value < least && matters {
            self.notes.push(format!("{name}: {value:.3} is taken as {least}, the least here"));
        }
        value.max(least)
    }

    /// The mean of a texture, if there is one; it is noted for a parameter.
    fn mean(&mut self, texture: &Element<'_>, parameter: &str) -> Result<Option<Mean>, E> {
        Ok(self.averaged(texture, parameter)?.map(|(mean, _)| mean))
    }

    /// The mean of a texture and its picture, if there is one; it is noted for a parameter.
    fn averaged(&mut self, texture: &Element<'_>, parameter: &str) -> Result<Option<(Mean, Raster)>, E> {
        if !texture.is_present() {
            return Ok(None);
        }
        let transform = TextureTransform::of(texture)?;
        if self.is_check {
            let image = self.image(texture)?;
            return match image.get("uri").text()? {
                Some(uri) if !uri.starts_with("data:") => self.content(uri, &image).map(|_| None),
                _ => Ok(None),
            };
        }
        let (bytes, name) = self.picture(texture)?;
        let raster = raster_of_texture(&bytes);
        let read = raster.and_then(|raster| Ok((Mean::of(&raster)?, raster)));
        let (mean, raster) = read.map_err(|error| error.within(name.clone()).within(texture.path()))?;
        let Mean { width, height, .. } = mean;
        self.notes.push(format!("{parameter}: averaged over {width} x {height} texels of {name}"));
        // Quantised coordinates are brought back to their range by the same extension.
        let used = Element::of(self.document, "extensionsUsed");
        let is_quantised = (0..used.count())
            .any(|index| matches!(used.element(index).text(), Ok(Some("KHR_mesh_quantization"))));
        if transform.shows_part() && !is_quantised {
            let [u, v] = transform.scale;
            self.warnings.push(format!(
                "{parameter}: KHR_texture_transform scales the coordinates by {u} and {v}, so that a mesh may show a part of {name} only; the mean is that of all its texels: cut the texture to that part if it differs"
            ));
        }
        Ok(Some((mean, raster)))
    }

    /// The picture of a texture, and a name for messages.
    pub(super) fn picture(&mut self, texture: &Element<'_>) -> Result<(Arc<Vec<u8>>, String), E> {
        let image = self.image(texture)?;
        let name = image.get("name").text()?.unwrap_or(image.path()).to_owned();
        match (image.get("uri").text()?, image.get("bufferView").index()?) {
            (Some(uri), _) => {
                let (bytes, path) = self.content(uri, &image)?;
                Ok((bytes, if path.is_empty() { name } else { path }))
            }
            (None, Some(view)) => Ok((self.view(view)?, name)),
            (None, None) => Err(Error::damaged("expected a uri or a bufferView").within(image.path()).into()),
        }
    }

    pub(super) fn image(&self, texture: &Element<'_>) -> Result<Element<'a>, Error> {
        let missing = |element: &Element<'_>| Error::damaged(format!("{} is missing", element.path()));
        let number = texture.get("index");
        let index = number.index()?.ok_or_else(|| missing(&number))?;
        let texture = Element::of(self.document, "textures").at(index)?;
        let extensions = texture.get("extensions");
        let source = match texture.get("source").index()? {
            Some(source) => Some(source),
            None => extensions.get("EXT_texture_webp").get("source").index()?,
        };
        let source = source.ok_or_else(|| {
            let others: Vec<_> = extensions.keys().collect();
            let wrong = match others.is_empty() {
                true => "there is no source".to_owned(),
                false => format!("{} is not read", others.join(", ")),
            };
            Error::unsupported(format!("{}: {wrong}; expected PNG, JPEG or WebP", texture.path()))
        })?;
        Element::of(self.document, "images").at(source)
    }

    fn view(&mut self, index: usize) -> Result<Arc<Vec<u8>>, E> {
        let view = Element::of(self.document, "bufferViews").at(index)?;
        let buffer = view.get("buffer").index()?.unwrap_or(0);
        let [offset, length] = ["byteOffset", "byteLength"].map(|key| view.get(key).index());
        let (offset, length) = (offset?.unwrap_or(0), length?.unwrap_or(0));
        let declared = Element::of(self.document, "buffers").at(buffer)?;
        let content;
        let bytes = match (declared.get("uri").text()?, self.chunk) {
            (Some(uri), _) => {
                content = self.content(uri, &declared)?.0;
                content.as_slice()
            }
            (None, Some(chunk)) if buffer == 0 => chunk,
            (None, _) => {
                let missing = Error::damaged("there is neither a uri nor a binary chunk");
                return Err(missing.within(declared.path()).into());
            }
        };
        let part = bytes.get(offset..).and_then(|rest| rest.get(..length));
        let part = part.ok_or_else(|| {
            Error::truncated(format!(
                "{}: {length} bytes from byte {offset} on are more than the {} of buffer {buffer}",
                view.path(),
                bytes.len()
            ))
        })?;
        Ok(Arc::new(part.to_vec()))
    }

    /// The bytes that a URI holds or names, and the path of the file that it names.
    fn content(&mut self, uri: &str, at: &Element<'_>) -> Result<(Arc<Vec<u8>>, String), E> {
        if uri.starts_with("data:") {
            let bytes = embedded(uri).map_err(|error| error.within(at.path()))?;
            return Ok((Arc::new(bytes), String::new()));
        }
        if let Some(found) = self.beside.get(uri) {
            return Ok(found.clone());
        }
        let found = find_beside(uri, &|error| error.within(at.path()), &mut |path| (self.read)(path))?;
        self.beside.insert(uri.to_owned(), found.clone());
        Ok(found)
    }
}

fn times(one: [f64; 3], other: [f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|channel| one[channel] * other[channel])
}

/// The index of refraction, and the factor of the reflectance at normal incidence. An index of 0 stands for a
/// reflectance of 1 (KHR_materials_ior).
fn refraction(ior: f64) -> (f64, f64) {
    const MAX_IOR: f64 = 10.0;
    match ior {
        0.0 => (MAX_IOR, math::powi((MAX_IOR + 1.0) / (MAX_IOR - 1.0), 2)),
        _ => (ior, 1.0),
    }
}

/// Warnings of what a material has and is not read.
fn warnings(
    document: &Map<String, Value>,
    index: usize,
    material: &Element<'_>,
) -> Result<Vec<String>, Error> {
    let mut warnings = Vec::new();
    let others: Vec<_> = material.get("extensions").keys().filter(|name| !READ.contains(name)).collect();
    if !others.is_empty() {
        warnings.push(format!("{} of the material is not read", others.join(", ")));
    }
    if let Some(mode) = material.get("alphaMode").text()?.filter(|mode| *mode != "OPAQUE") {
        warnings.push(format!("the alphaMode {mode} of the material is not read: the material is opaque"));
    }
    let emissive = material.get("emissiveFactor").colour([0.0; 3], WEIGHT)?;
    if emissive.iter().any(|channel| *channel > 0.0) {
        warnings.push("the light that the material emits is not read".to_owned());
    }
    let coloured = coloured_primitives(document, index);
    if coloured > 0 {
        let primitives = if coloured == 1 { "1 primitive" } else { &format!("{coloured} primitives") };
        warnings.push(format!(
            "the vertex colours (COLOR_0) of {primitives}, which glTF multiplies the base colour by, are not read"
        ));
    }
    Ok(warnings)
}

/// How many primitives of a material have colours at their vertices. What is not as it should be is an error
/// of the mesh, not of the material.
fn coloured_primitives(document: &Map<String, Value>, material: usize) -> usize {
    let meshes = document.get("meshes").and_then(Value::as_array).into_iter().flatten();
    let primitives =
        meshes.flat_map(|mesh| mesh.get("primitives").and_then(Value::as_array).into_iter().flatten());
    primitives
        .filter(|primitive| {
            primitive.get("material").and_then(Value::as_u64) == Some(material as u64)
                && primitive.pointer("/attributes/COLOR_0").is_some()
        })
        .count()
}
