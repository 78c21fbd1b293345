//! EXT_lights_image_based: a prefiltered cube in a glTF document, as Babylon.js reads it.
//!
//! The images are PNG in RGBD, upside down, within the document; `irradianceCoefficients` are those of the
//! irradiance itself, with the Condon-Shortley phase, in the frame of the cube's faces. The extension's text
//! leaves all of that open; Babylon.js is the engine that reads all of it.
//!
//! `intensity` multiplies the light. `rotation` turns it in the frame of the faces, which is left-handed: by
//! a positive angle about +Y, +Z moves to +X, clockwise as seen from above. That is what the matrix does that
//! the loader of Babylon.js makes of it, in its left-handed and in its right-handed scenes.

use std::borrow::Cow;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use rayon::prelude::*;
use serde_json::{Map, Value, json};
use sh::Expansion;
use sphere::{Cube, DVec3, Direction, Face, Rotation, from_cube};

use super::document::Chunks;
use super::element::Element;
use super::materials::open;
use crate::error::{Error, ErrorKind};
use crate::images::Encoded;
use crate::recipe::KEY;
use crate::textures::{Texture, check_levels, rgbd};
use crate::values::lighting_json::Preset;
use crate::{limits, recipe};

const EXTENSION: &str = "EXT_lights_image_based";

const PNG_DATA: &str = "data:image/png;base64,";

/// The range of an intensity.
const BRIGHTNESS: brdf::Range = brdf::Range { least: 0.0, most: f64::MAX, words: "a number from 0 on" };

/// The most that PNG gains, in base64.
const PNG_RATIO: usize = 780;

/// An image-based light.
#[derive(Clone, Debug, PartialEq)]
pub struct ImageBasedLight {
    /// A cube with levels of detail, level l of n having the roughness whose square is size^(l / n - 1).
    pub cube: Texture,
    /// The irradiance, rows l*l + l + m.
    pub irradiance: [[f64; 3]; 9],
}

/// Writes a document with one light, which its scene uses. Values past 255 are clamped to it, negative ones
/// become 0 and are counted.
///
/// # Errors
/// If the texture is not a cube of one layer, or a number is not finite.
///
/// # Example: a grey light comes back
/// ```
/// use containers::{ImageBasedLight, Texture, read_gltf_image_based_light, write_gltf_image_based_light};
/// let cube = Texture { width: 2, height: 2, faces: 6, pixels: vec![[1.0; 3]; 24], ..Texture::default() };
/// let light = ImageBasedLight { cube, irradiance: [[0.5; 3]; 9] };
/// let file = write_gltf_image_based_light(&light, None)?;
/// assert_eq!(read_gltf_image_based_light(&file.bytes)?, light);
/// # Ok::<(), containers::Error>(())
/// ```
pub fn write_gltf_image_based_light(light: &ImageBasedLight, recipe: Option<&str>) -> Result<Encoded, Error> {
    write(light, recipe).map_err(|error| error.within("glTF"))
}

fn write(light: &ImageBasedLight, recipe: Option<&str>) -> Result<Encoded, Error> {
    let ImageBasedLight { cube, irradiance } = light;
    recipe::check(recipe)?;
    check_levels(cube, false)?;
    if !irradiance.as_flattened().iter().all(|value| value.is_finite()) {
        return Err(Error::new(ErrorKind::Unwritable, "a coefficient of the irradiance is not finite"));
    }
    let (mut images, mut negative) = (Vec::new(), 0);
    for face in rgbd::write_faces([cube])? {
        images.push(json!({
            "uri": format!("{PNG_DATA}{}", STANDARD.encode(&face.bytes)), "mimeType": "image/png"
        }));
        negative += face.negative;
    }
    let levels: Vec<[usize; 6]> =
        (0..cube.levels().len()).map(|level| std::array::from_fn(|face| 6 * level + face)).collect();
    let mut asset = "\"generator\": \"Specula\", \"version\": \"2.0\"".to_owned();
    if let Some(recipe) = recipe {
        // As it is given, byte for byte.
        asset.push_str(&format!(", \"extras\": {{\"{KEY}\": {recipe}}}"));
    }
    let light = json!({
        "intensity": 1.0,
        "rotation": [0.0, 0.0, 0.0, 1.0],
        "irradianceCoefficients": irradiance,
        "specularImageSize": cube.width,
        "specularImages": levels,
    });
    let images: Vec<String> = images.iter().map(|image| format!("    {image}")).collect();
    let text = format!(
        "{{\n  \"asset\": {{{asset}}},\n  \"extensionsUsed\": [\"{EXTENSION}\"],\n  \"extensions\": \
         {{\"{EXTENSION}\": {{\"lights\": [\n    {light}\n  ]}}}},\n  \"scene\": 0,\n  \"scenes\": \
         [{{\"extensions\": {{\"{EXTENSION}\": {{\"light\": 0}}}}}}],\n  \"images\": [\n{}\n  ]\n}}\n",
        images.join(",\n")
    );
    Ok(Encoded { bytes: text.into_bytes(), negative })
}

/// Lighting of a document, and what its user should know of it.
#[derive(Clone, Debug, PartialEq)]
pub struct GltfLighting {
    /// Radiance in Specula's frame, of degree 2, with the light's intensity and rotation.
    pub series: Expansion,
    /// A description of which light of the document it is, and of its intensity and rotation.
    pub light: String,
}

/// The lighting that the irradiance coefficients of a document's light hold, whatever its images are. It is
/// the light of the default scene; if that has none, it is the first.
///
/// # Errors
/// If the document is not glTF 2.0 or is damaged, or has no such light. The message names the place in it.
pub fn read_gltf_lighting(bytes: &[u8]) -> Result<GltfLighting, Error> {
    let Chunks { json, .. } = open(bytes)?;
    let light = Light::of(&json)?;
    let rows: Vec<Vec<f64>> = light.irradiance.iter().map(|row| row.to_vec()).collect();
    let mut series = Preset::Gltf.revert(&[rows]).map_err(|error| error.within(light.element.path()))?;
    if light.intensity != 1.0 {
        let numbers = series.coefficients_mut().as_flattened_mut();
        numbers.iter_mut().for_each(|number| *number *= light.intensity);
    }
    if light.rotation != Rotation::IDENTITY {
        series = sh::rotate(&series, light.rotation);
    }
    Ok(GltfLighting { series, light: light.description()? })
}

/// Whether the bytes are a glTF document that holds such a light.
pub(crate) fn is_gltf_image_based_light(bytes: &[u8]) -> bool {
    let name = EXTENSION.as_bytes();
    let is_document = bytes.starts_with(b"glTF") || bytes.trim_ascii_start().starts_with(b"{");
    is_document && bytes.windows(name.len()).any(|window| window == name)
}

/// Reads the light of a document whose images are within it, as [`write_gltf_image_based_light`] writes them
/// or in the binary chunk of a `.glb`. Its intensity multiplies what is given, and its rotation turns it; a
/// cube that is turned is resampled.
///
/// # Errors
/// If the document is damaged, has no such light, or has its images elsewhere.
pub fn read_gltf_image_based_light(bytes: &[u8]) -> Result<ImageBasedLight, Error> {
    parse(bytes).map_err(|error| error.within("glTF"))
}

struct Light<'a> {
    element: Element<'a>,
    irradiance: [[f64; 3]; 9],
    intensity: f64,
    /// The rotation in Specula's frame, and the quaternion that the document has.
    rotation: Rotation,
    quaternion: [f64; 4],
}

impl<'a> Light<'a> {
    fn of(document: &'a Map<String, Value>) -> Result<Self, Error> {
        let root = Element::of(document, "extensions");
        let lights = root.get(EXTENSION).get("lights");
        if lights.count() == 0 {
            let others: Vec<_> = root.keys().collect();
            let others = match others.is_empty() {
                true => String::new(),
                false => format!("; its extensions {} are not read as lighting", others.join(", ")),
            };
            return Err(Error::unsupported(format!("the file has no light in {}{others}", lights.path())));
        }
        let scene = Element::of(document, "scene").index()?.unwrap_or(0);
        let scenes = Element::of(document, "scenes");
        let used = match scene < scenes.count() {
            true => scenes.at(scene)?.get("extensions").get(EXTENSION).get("light").index()?,
            false => None,
        };
        let element = lights.at(used.unwrap_or(0))?;
        let quaternion = element.get("rotation").row([0.0, 0.0, 0.0, 1.0])?;
        let [x, y, z, w] = quaternion;
        // A reflection of the axes keeps the angle and turns the sense.
        let axis = -from_cube(DVec3::new(x, y, z));
        let rotation = Rotation::from_quaternion(axis.x, axis.y, axis.z, w).ok_or_else(|| {
            let path = element.get("rotation").path().to_owned();
            Error::damaged(format!("{path}: {quaternion:?} is not a quaternion of length 1"))
        })?;
        Ok(Self {
            irradiance: element.get("irradianceCoefficients").rows()?,
            intensity: element.get("intensity").number(1.0, BRIGHTNESS)?,
            rotation,
            quaternion,
            element,
        })
    }

    fn description(&self) -> Result<String, Error> {
        let mut text = self.element.path().to_owned();
        if let Some(name) = self.element.get("name").text()? {
            text += &format!(" {name:?}");
        }
        text += &format!(", intensity {}", self.intensity);
        if self.rotation != Rotation::IDENTITY {
            text += &format!(", turned by the quaternion {:?}", self.quaternion);
        }
        Ok(text)
    }
}

fn parse(bytes: &[u8]) -> Result<ImageBasedLight, Error> {
    let Chunks { json, binary } = open(bytes)?;
    let light = Light::of(&json)?;
    let element = &light.element;
    let size = element.get("specularImageSize");
    let edge = size.index()?.ok_or_else(|| size.missing())?;
    let mut cube = Texture { width: edge, height: edge, faces: 6, ..Texture::default() };
    let levels = element.get("specularImages");
    if levels.count() == 0 {
        return Err(Error::damaged(format!("{}: expected the six images of each level", levels.path())));
    }
    cube.check_declared(levels.count())?;
    limits::plausible(6 * edge * edge * 4, bytes.len(), PNG_RATIO)?;
    let images = Element::of(&json, "images");
    for level in 0..levels.count() {
        let faces = levels.element(level);
        if faces.count() != 6 {
            return Err(Error::damaged(format!(
                "{}: expected 6 images, found {}",
                faces.path(),
                faces.count()
            )));
        }
        let [edge, ..] = cube.level_size(level);
        let mut texels = Vec::new();
        for face in 0..6 {
            let number = faces.element(face);
            let read = || {
                let index = number.index()?.ok_or_else(|| number.missing())?;
                rgbd::read_face(edge, &within(&json, binary, &images.at(index)?)?)
            };
            texels
                .extend(read().map_err(|error: Error| error.within(format!("level {level}, face {face}")))?);
        }
        if light.intensity != 1.0 {
            texels.as_flattened_mut().iter_mut().for_each(|value| *value *= light.intensity as f32);
        }
        if light.rotation != Rotation::IDENTITY {
            texels = turned(&texels, Cube { edge }, light.rotation);
        }
        if level == 0 { cube.pixels = texels } else { cube.smaller_levels.push(texels) }
    }
    let mut irradiance = light.irradiance.map(|row| row.map(|value| value * light.intensity));
    if light.rotation != Rotation::IDENTITY {
        let rows: Vec<Vec<f64>> = irradiance.iter().map(|row| row.to_vec()).collect();
        let series = Preset::Gltf.revert(&[rows]).map_err(|error| error.within(element.path()))?;
        let tables = Preset::Gltf.convert(&sh::rotate(&series, light.rotation));
        let rows = tables.iter().flat_map(|table| &table.rows);
        for (row, turned) in irradiance.iter_mut().zip(rows.filter_map(|row| row.first_chunk::<3>())) {
            *row = *turned;
        }
    }
    Ok(ImageBasedLight { cube, irradiance })
}

/// The bytes of an image that is in the file: a data URI, or a part of the binary chunk.
fn within<'a>(
    document: &Map<String, Value>,
    binary: Option<&'a [u8]>,
    image: &Element<'_>,
) -> Result<Cow<'a, [u8]>, Error> {
    if let Some(uri) = image.get("uri").text()? {
        let data = uri.strip_prefix("data:").and_then(|uri| uri.split_once(";base64,"));
        let (_, data) = data
            .ok_or_else(|| Error::unsupported("the image is beside the file; expected it as a data URI"))?;
        let decoded = STANDARD.decode(data).map_err(|error| Error::damaged(format!("base64: {error}")))?;
        return Ok(decoded.into());
    }
    let index = image.get("bufferView").index()?.ok_or_else(|| image.get("uri").missing())?;
    let view = Element::of(document, "bufferViews").at(index)?;
    let number = |key: &str| Ok::<_, Error>(view.get(key).index()?.unwrap_or(0));
    let (buffer, offset, length) = (number("buffer")?, number("byteOffset")?, number("byteLength")?);
    let chunk = binary.filter(|_| buffer == 0);
    let chunk =
        chunk.ok_or_else(|| Error::unsupported("the image is beside the file; expected it in its chunk"))?;
    let part = chunk.get(offset..).and_then(|rest| rest.get(..length));
    part.map(Cow::from)
        .ok_or_else(|| Error::truncated("the file ends before the image does").within(view.path()))
}

/// A cube whose light is turned: each texel is the mean of 3 x 3 places of the given one, interpolated within
/// a face.
fn turned(texels: &[[f32; 3]], cube: Cube, rotation: Rotation) -> Vec<[f32; 3]> {
    const PLACES: usize = 3;
    let (edge, back) = (cube.edge, rotation.inverse());
    let at = |place: usize| (place as f64 + 0.5) / PLACES as f64;
    let blend = |direction: Direction| -> [f64; 3] {
        let (face, s, t) = cube.position(direction);
        let axis = |place: f64| {
            let place = (place * edge as f64 - 0.5).clamp(0.0, (edge - 1) as f64);
            let first = (place as usize).min(edge.saturating_sub(2));
            (first, (first + 1).min(edge - 1), place - first as f64)
        };
        let ((left, right, x), (top, bottom, y)) = (axis(s), axis(t));
        let texel =
            |row: usize, column: usize| texels[(face as usize * edge + row) * edge + column].map(f64::from);
        let (a, b, c, d) = (texel(top, left), texel(top, right), texel(bottom, left), texel(bottom, right));
        [0, 1, 2].map(|k| (1.0 - y) * ((1.0 - x) * a[k] + x * b[k]) + y * ((1.0 - x) * c[k] + x * d[k]))
    };
    let texel = |index: usize| -> [f32; 3] {
        let (face, row, column) = (index / (edge * edge), index / edge % edge, index % edge);
        let mut sum = [0.0; 3];
        for place in 0..PLACES * PLACES {
            let s = (column as f64 + at(place % PLACES)) / edge as f64;
            let t = (row as f64 + at(place / PLACES)) / edge as f64;
            let found = blend(back.apply(cube.direction_at(Face::ALL[face], s, t)));
            (0..3).for_each(|channel| sum[channel] += found[channel]);
        }
        sum.map(|sum| (sum / (PLACES * PLACES) as f64) as f32)
    };
    (0..texels.len()).into_par_iter().map(texel).collect()
}
