//! Babylon.js' `.env`, version 2: a prefiltered cube with all levels down to one texel, and the irradiance,
//! as a polynomial and, for Babylon.js 8 and later, as a cube.
//!
//! | bytes | what |
//! | --- | --- |
//! | 0 | eight bytes that tell the format |
//! | 8 | JSON with the size, the polynomial of the irradiance and the place of each image, ended by NUL |
//! | | the images: PNG in RGBD, upside down; the largest level first, in a level the faces +X -X +Y -Y +Z -Z; then those of the irradiance |
//!
//! Read in Misc/environmentTextureTools of @babylonjs/core.

use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use serde_json::value::RawValue;

use super::rgbd;
use super::texture::Texture;
use crate::error::{Error, ErrorKind};
use crate::format::refuse_non_files;
use crate::images::Encoded;
use crate::{limits, recipe};

const MAGIC: [u8; 8] = [0x86, 0x16, 0x87, 0x96, 0xf6, 0xd6, 0x96, 0x36];

/// The most that PNG gains: deflate has at least a bit for 258 bytes twice over.
const PNG_RATIO: usize = 1040;

/// A quadratic polynomial of a direction in the frame of a cube's faces.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Polynomial {
    /// The coefficients of x, one for each colour.
    pub x: [f64; 3],
    /// The coefficients of y, one for each colour.
    pub y: [f64; 3],
    /// The coefficients of z, one for each colour.
    pub z: [f64; 3],
    /// The coefficients of x^2, one for each colour; a constant is in all three squares.
    pub xx: [f64; 3],
    /// The coefficients of y^2, one for each colour; a constant is in all three squares.
    pub yy: [f64; 3],
    /// The coefficients of z^2, one for each colour; a constant is in all three squares.
    pub zz: [f64; 3],
    /// The coefficients of y z, one for each colour.
    pub yz: [f64; 3],
    /// The coefficients of z x, one for each colour.
    pub zx: [f64; 3],
    /// The coefficients of x y, one for each colour.
    pub xy: [f64; 3],
}

impl Polynomial {
    /// The rows of the polynomial, in the order of the fields.
    pub fn rows(&self) -> [[f64; 3]; 9] {
        [self.x, self.y, self.z, self.xx, self.yy, self.zz, self.yz, self.zx, self.xy]
    }
}

/// The content of an `.env` file.
#[derive(Clone, Debug, PartialEq)]
pub struct BabylonEnv {
    /// A cube with all levels of detail.
    pub cube: Texture,
    /// The irradiance over pi, convolved with the cosine once more: what Babylon.js expects.
    pub irradiance: Option<Polynomial>,
    /// The irradiance over pi as a cube of one level, which Babylon.js 8 and later take in place of the
    /// polynomial; only beside a polynomial.
    pub irradiance_cube: Option<Texture>,
    /// The scale by which the engine finds the level of a roughness.
    pub lod_generation_scale: f64,
}

#[derive(Serialize, Deserialize)]
struct Place {
    length: usize,
    position: usize,
}

#[derive(Serialize, Deserialize)]
struct Specular {
    mipmaps: Vec<Place>,
    #[serde(rename = "lodGenerationScale")]
    lod_generation_scale: f64,
}

#[derive(Serialize, Deserialize)]
struct IrradianceTexture {
    size: usize,
    faces: Vec<Place>,
}

#[derive(Serialize, Deserialize)]
struct Irradiance {
    #[serde(flatten)]
    polynomial: Polynomial,
    #[serde(rename = "irradianceTexture", default, skip_serializing_if = "Option::is_none")]
    texture: Option<IrradianceTexture>,
}

#[derive(Serialize, Deserialize)]
struct Manifest {
    version: u32,
    width: usize,
    #[serde(rename = "imageType", default, skip_serializing_if = "Option::is_none")]
    image_type: Option<String>,
    irradiance: Option<Irradiance>,
    specular: Specular,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    specula: Option<Box<RawValue>>,
}

/// Writes an `.env` file. Values past 255 are clamped to it, negative ones become 0 and are counted.
///
/// # Errors
/// If the texture is not a cube of one layer with all levels down to one texel, a number of the polynomial is
/// not finite, or the cube of irradiance has several levels or no polynomial.
///
/// # Example: a grey cube comes back
/// ```
/// use containers::{BabylonEnv, Texture, read_babylon_env, write_babylon_env};
/// let pixels = vec![[1.0; 3]; 24];
/// let cube = Texture { width: 2, height: 2, faces: 6, pixels, ..Texture::default() };
/// let cube = Texture { smaller_levels: vec![vec![[1.0; 3]; 6]], ..cube };
/// let env = BabylonEnv { cube, irradiance: None, irradiance_cube: None, lod_generation_scale: 0.8 };
/// assert_eq!(read_babylon_env(&write_babylon_env(&env, None)?.bytes)?, env);
/// # Ok::<(), containers::Error>(())
/// ```
pub fn write_babylon_env(env: &BabylonEnv, recipe: Option<&str>) -> Result<Encoded, Error> {
    write(env, recipe).map_err(|error| error.within("Babylon.js environment"))
}

fn write(env: &BabylonEnv, recipe: Option<&str>) -> Result<Encoded, Error> {
    let unwritable = |message: String| Error::new(ErrorKind::Unwritable, message);
    recipe::check(recipe)?;
    let BabylonEnv { cube, irradiance, irradiance_cube, lod_generation_scale } = env;
    check_levels(cube, true)?;
    if let Some(cube) = irradiance_cube {
        check_levels(cube, false)?;
        if cube.levels().len() != 1 || irradiance.is_none() {
            return Err(unwritable("a cube of irradiance has one level, and a polynomial beside it".into()));
        }
    }
    let finite =
        |polynomial: &Polynomial| polynomial.rows().as_flattened().iter().all(|value| value.is_finite());
    if !irradiance.as_ref().is_none_or(finite) || !lod_generation_scale.is_finite() {
        return Err(unwritable("a number of the irradiance, or the scale, is not finite".into()));
    }
    let (mut images, mut places) = (Vec::new(), Vec::new());
    let mut negative = 0;
    for packed in rgbd::write_faces(std::iter::once(cube).chain(irradiance_cube))? {
        places.push(Place { length: packed.bytes.len(), position: images.len() });
        images.extend(packed.bytes);
        negative += packed.negative;
    }
    let faces = places.split_off(6 * cube.levels().len());
    let texture = irradiance_cube.as_ref().map(|cube| IrradianceTexture { size: cube.width, faces });
    let specula = match recipe {
        None => None,
        Some(recipe) => Some(
            RawValue::from_string(recipe.to_owned())
                .map_err(|error| unwritable(format!("the recipe is not JSON: {error}")))?,
        ),
    };
    let manifest = Manifest {
        version: 2,
        width: cube.width,
        image_type: Some("image/png".into()),
        irradiance: irradiance.map(|polynomial| Irradiance { polynomial, texture }),
        specular: Specular { mipmaps: places, lod_generation_scale: *lod_generation_scale },
        specula,
    };
    let text = serde_json::to_string(&manifest).map_err(|error| unwritable(error.to_string()))?;
    let bytes = [&MAGIC[..], text.as_bytes(), &[0], &images].concat();
    Ok(Encoded { bytes, negative })
}

/// Whether a texture is a cube of one layer, and whether its levels are as many as they can be.
pub(crate) fn check_levels(cube: &Texture, all: bool) -> Result<(), Error> {
    let unwritable = |message: String| Error::new(ErrorKind::Unwritable, message);
    if cube.faces != 6 || cube.layers > 0 || cube.depth != 1 {
        return Err(unwritable("expected a cube of one layer".into()));
    }
    // Checks every size.
    let most = cube.most_levels();
    let levels = cube.levels().len();
    if all && levels != most {
        return Err(unwritable(format!("expected all {most} levels down to one texel, found {levels}")));
    }
    cube.check_sizes()
}

/// Whether the bytes begin as an `.env` file.
pub fn is_babylon_env(bytes: &[u8]) -> bool {
    bytes.starts_with(&MAGIC)
}

/// The recipe, whatever the images are.
pub(crate) fn read_recipe(bytes: &[u8]) -> Option<String> {
    let (manifest, _) = manifest(bytes).ok()?;
    manifest.specula.map(|recipe| recipe.get().to_owned())
}

/// The manifest, and where the images begin.
fn manifest(bytes: &[u8]) -> Result<(Manifest, usize), Error> {
    refuse_non_files(bytes)?;
    let Some(rest) = bytes.strip_prefix(&MAGIC) else {
        return Err(Error::new(ErrorKind::UnknownFormat, "expected an .env file, found other first bytes"));
    };
    let end = rest.iter().position(|byte| *byte == 0);
    let end = end.ok_or_else(|| Error::truncated("the file ends within its JSON, which begins at byte 8"))?;
    let manifest = serde_json::from_slice(&rest[..end])
        .map_err(|error| Error::damaged(format!("the JSON at byte 8: {error}")))?;
    Ok((manifest, MAGIC.len() + end + 1))
}

/// Only the polynomial of an `.env` file, whatever its images are.
///
/// # Errors
/// The errors of [`read_babylon_env`], but for those of the images.
pub fn read_babylon_polynomial(bytes: &[u8]) -> Result<Option<Polynomial>, Error> {
    let (manifest, _) = manifest(bytes).map_err(|error| error.within("Babylon.js environment"))?;
    Ok(manifest.irradiance.map(|irradiance| irradiance.polynomial))
}

/// Reads an `.env` file of version 1 or 2 whose images are PNG or WebP.
///
/// # Errors
/// If the file is truncated, damaged, too large, or has images of another format.
pub fn read_babylon_env(bytes: &[u8]) -> Result<BabylonEnv, Error> {
    parse(bytes).map_err(|error| error.within("Babylon.js environment"))
}

fn parse(bytes: &[u8]) -> Result<BabylonEnv, Error> {
    let (manifest, begin) = manifest(bytes)?;
    if ![1, 2].contains(&manifest.version) {
        return Err(Error::unsupported(format!("version {} is not read; expected 1 or 2", manifest.version)));
    }
    let Specular { mipmaps, lod_generation_scale } = manifest.specular;
    if mipmaps.is_empty() || !mipmaps.len().is_multiple_of(6) {
        return Err(Error::damaged(format!("expected six images for each level, found {}", mipmaps.len())));
    }
    let edge = manifest.width;
    let mut cube = Texture { width: edge, height: edge, faces: 6, ..Texture::default() };
    cube.check_declared(mipmaps.len() / 6)?;
    limits::plausible(6 * edge * edge * 4, bytes.len(), PNG_RATIO)?;
    for (level, places) in mipmaps.chunks_exact(6).enumerate() {
        let [edge, ..] = cube.level_size(level);
        let texels = read_faces(bytes, begin, places, edge, &format!("level {level}"))?;
        if level == 0 { cube.pixels = texels } else { cube.smaller_levels.push(texels) }
    }
    let (irradiance, texture) =
        manifest.irradiance.map(|irradiance| (irradiance.polynomial, irradiance.texture)).unzip();
    let irradiance_cube = match texture.flatten() {
        None => None,
        Some(IrradianceTexture { size, faces }) => {
            if faces.len() != 6 {
                return Err(Error::damaged(format!(
                    "expected six images of irradiance, found {}",
                    faces.len()
                )));
            }
            let mut cube = Texture { width: size, height: size, faces: 6, ..Texture::default() };
            cube.check_declared(1)?;
            limits::plausible(6 * size * size * 4, bytes.len(), PNG_RATIO)?;
            cube.pixels = read_faces(bytes, begin, &faces, size, "irradiance")?;
            Some(cube)
        }
    };
    Ok(BabylonEnv { cube, irradiance, irradiance_cube, lod_generation_scale })
}

/// The texels of the faces of a level, whose images lie at these places after the beginning of all.
fn read_faces(
    bytes: &[u8],
    begin: usize,
    places: &[Place],
    edge: usize,
    what: &str,
) -> Result<Vec<[f32; 3]>, Error> {
    let read = |(face, place): (usize, &Place)| {
        let at = begin.saturating_add(place.position);
        let image = bytes.get(at..).and_then(|rest| rest.get(..place.length));
        let image = image.ok_or_else(|| {
            let end = bytes.len();
            Error::truncated(format!("{} bytes at {at} are past the file's {end}", place.length))
        });
        image
            .and_then(|image| rgbd::read_face(edge, image))
            .map_err(|error| error.within(format!("{what}, face {face}, byte {at}")))
    };
    let faces: Vec<_> = places.par_iter().enumerate().with_max_len(1).map(read).collect();
    // Of several errors the first is reported.
    Ok(faces.into_iter().collect::<Result<Vec<_>, Error>>()?.concat())
}
