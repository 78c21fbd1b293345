//! EXT_lights_image_based: a prefiltered cube in a glTF document, as Babylon.js reads it.
//!
//! The images are PNG in RGBD, upside down, within the document; `irradianceCoefficients` are those of the
//! irradiance itself, with the Condon-Shortley phase, in the frame of the cube's faces. The extension's text
//! leaves all of that open; Babylon.js is the one engine that reads it.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use serde::Deserialize;
use serde_json::json;

use crate::babylon_env::check_levels;
use crate::decoded::Encoded;
use crate::error::{Error, ErrorKind};
use crate::format::refuse_non_files;
use crate::limits;
use crate::recipe::{self, KEY};
use crate::rgbd;
use crate::texture::Texture;

const EXTENSION: &str = "EXT_lights_image_based";

const PNG_DATA: &str = "data:image/png;base64,";

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

/// Writes a document with one light, which its scene uses. Values past 255 are clamped to it and counted,
/// negative ones become 0.
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
    let (mut images, mut levels) = (Vec::new(), Vec::new());
    let (mut clamped, mut negative) = (0, 0);
    for (level, texels) in cube.levels().enumerate() {
        let [edge, ..] = cube.level_size(level);
        let mut faces = Vec::new();
        for face in texels.chunks_exact(edge * edge) {
            let packed = rgbd::write_face(edge, face)?;
            faces.push(images.len());
            images.push(json!({
                "uri": format!("{PNG_DATA}{}", STANDARD.encode(&packed.bytes)), "mimeType": "image/png"
            }));
            clamped += packed.clamped;
            negative += packed.negative;
        }
        levels.push(faces);
    }
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
    Ok(Encoded { bytes: text.into_bytes(), clamped, negative })
}

#[derive(Deserialize)]
struct Document {
    extensions: Extensions,
    #[serde(default)]
    images: Vec<Image>,
}

#[derive(Deserialize)]
struct Extensions {
    #[serde(rename = "EXT_lights_image_based")]
    image_based: Lights,
}

#[derive(Deserialize)]
struct Lights {
    lights: Vec<Light>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct Light {
    irradiance_coefficients: [[f64; 3]; 9],
    specular_image_size: usize,
    specular_images: Vec<[usize; 6]>,
}

#[derive(Deserialize)]
struct Image {
    #[serde(default)]
    uri: String,
}

/// The irradiance coefficients of a document's first light, whatever its images are.
///
/// # Errors
/// As [`read_gltf_image_based_light`], but for the images.
pub fn read_gltf_irradiance(bytes: &[u8]) -> Result<[[f64; 3]; 9], Error> {
    let light = document(bytes).and_then(first_light).map_err(|error| error.within("glTF"))?;
    Ok(light.0.irradiance_coefficients)
}

/// Reads the first light of a document that [`write_gltf_image_based_light`] wrote.
///
/// # Errors
/// If the document is damaged, has no such light, or has its images elsewhere.
pub fn read_gltf_image_based_light(bytes: &[u8]) -> Result<ImageBasedLight, Error> {
    parse(bytes).map_err(|error| error.within("glTF"))
}

fn document(bytes: &[u8]) -> Result<Document, Error> {
    refuse_non_files(bytes)?;
    serde_json::from_slice(bytes).map_err(|error| match error.is_eof() {
        true => Error::truncated(format!("the JSON ends too early: {error}")),
        false => Error::damaged(format!("not a document with {EXTENSION}: {error}")),
    })
}

fn first_light(document: Document) -> Result<(Light, Vec<Image>), Error> {
    let Document { extensions: Extensions { image_based: Lights { lights } }, images } = document;
    let light =
        lights.into_iter().next().ok_or_else(|| Error::damaged(format!("{EXTENSION} has no light")))?;
    Ok((light, images))
}

fn parse(bytes: &[u8]) -> Result<ImageBasedLight, Error> {
    let (light, images) = first_light(document(bytes)?)?;
    let edge = light.specular_image_size;
    let mut cube = Texture { width: edge, height: edge, faces: 6, ..Texture::default() };
    if light.specular_images.is_empty() {
        return Err(Error::damaged("`specularImages` is empty"));
    }
    cube.check_declared(light.specular_images.len())?;
    limits::plausible(6 * edge * edge * 4, bytes.len(), PNG_RATIO)?;
    for (level, faces) in light.specular_images.iter().enumerate() {
        let [edge, ..] = cube.level_size(level);
        let mut texels = Vec::new();
        for (face, &index) in faces.iter().enumerate() {
            let read = || {
                let image = images.get(index);
                let image = image.ok_or_else(|| Error::damaged(format!("there is no image {index}")))?;
                let data = image.uri.strip_prefix(PNG_DATA);
                let data = data.ok_or_else(|| Error::unsupported("expected a PNG as a data URI"))?;
                let png =
                    STANDARD.decode(data).map_err(|error| Error::damaged(format!("base64: {error}")))?;
                rgbd::read_face(edge, &png)
            };
            texels
                .extend(read().map_err(|error: Error| error.within(format!("level {level}, face {face}")))?);
        }
        if level == 0 { cube.pixels = texels } else { cube.smaller_levels.push(texels) }
    }
    Ok(ImageBasedLight { cube, irradiance: light.irradiance_coefficients })
}
