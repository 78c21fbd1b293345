//! Light in a texture: level 0 of a cube, or a lat-long picture, in any container.

use envmap::Image;

use crate::error::Error;
use crate::images::{ReadOptions, chromaticity};
use crate::read_recipe::read_recipe;
use crate::textures::{
    TexelFormat, Texture, TextureFile, is_babylon_env, is_texture, read_babylon_env, read_texture,
};
use crate::values::{is_gltf_image_based_light, read_gltf_image_based_light};

/// Light that a texture holds, and what its file says about it.
#[derive(Clone, Debug, PartialEq)]
pub struct LightTexture {
    /// Level 0 in linear Rec. 709. The faces of a cube lie below each other, +X -X +Y -Y +Z -Z, each upright
    /// and unmirrored from inside, as KTX2's table has them.
    pub image: Image,
    /// Whether the file holds a cube; otherwise it holds one picture.
    pub is_cube: bool,
    /// Whether the container is for lights in Babylon.js' frame, an `.env` or glTF; others say no frame.
    pub is_for_babylon: bool,
    /// The container and the format of its texels, for messages.
    pub format: String,
    /// The number of levels of detail.
    pub levels: usize,
    /// Notes of what was ignored or assumed, in whole sentences.
    pub warnings: Vec<String>,
    /// Notes of what was done that hardly changed the picture, in whole sentences.
    pub notes: Vec<String>,
    /// The recipe, if Specula wrote the file.
    pub recipe: Option<String>,
}

/// Whether the bytes begin as a file that [`read_light_texture`] reads: KTX2, KTX, DDS, Babylon.js' `.env`,
/// or a glTF document with EXT_lights_image_based.
pub fn is_light_texture(bytes: &[u8]) -> bool {
    is_texture(bytes) || is_babylon_env(bytes) || is_gltf_image_based_light(bytes)
}

/// Reads level 0 of a cube, or of one picture, that holds light. Of a prefiltered cube that is the mirror.
///
/// Rows and columns are put in order by the file's `KTXorientation`. Of `options`, the colour space counts:
/// the values are taken for linear Rec. 709 without it.
///
/// # Errors
/// The errors of [`read_texture`], [`crate::textures::read_babylon_env`] and
/// [`crate::values::read_gltf_image_based_light`], and an error if the texture is an array or a volume.
pub fn read_light_texture(bytes: &[u8], options: &ReadOptions) -> Result<LightTexture, Error> {
    let (mut warnings, mut notes) = (Vec::new(), Vec::new());
    let (texture, format, orientation) = if is_babylon_env(bytes) {
        (read_babylon_env(bytes)?.cube, "Babylon.js environment, RGBD".to_owned(), None)
    } else if is_gltf_image_based_light(bytes) {
        (read_gltf_image_based_light(bytes)?.cube, "glTF light, RGBD".to_owned(), None)
    } else {
        let TextureFile { texture, format, container, mut metadata } = read_texture(bytes)?;
        if let TexelFormat::Bytes(stored) = format {
            let code = if stored.is_srgb { "from sRGB" } else { "as linear numbers" };
            warnings.push(format!(
                "{container} of 8 bits holds no high dynamic range: no light in it is brighter than its white; it was \
                 decoded {code}"
            ));
        }
        (texture, format!("{container}, {}", format.name()), metadata.remove("KTXorientation"))
    };
    let is_for_babylon = is_babylon_env(bytes) || is_gltf_image_based_light(bytes);
    let levels = texture.levels().len();
    let Texture { width, height, depth, layers, faces, mut pixels, .. } = texture;
    if depth > 1 || layers > 1 {
        return Err(Error::unsupported(format!(
            "{format}: expected a cube or one picture, found {depth} slices and {layers} layers"
        )));
    }
    reorder(width, &mut pixels, height, orientation.as_deref());
    let mut image = Image::new(width, faces * height, pixels)
        .ok_or_else(|| Error::damaged("the pixels do not fill the declared size"))?;
    if let Some(matrix) = options.colour_space.and_then(|space| space.chromaticities().to_rec_709()) {
        chromaticity::apply(matrix, image.pixels_mut()).report(&mut warnings, &mut notes);
    }
    if let Some(layer) = &options.layer {
        warnings.push(format!("a texture has no layers; `{layer}` was ignored"));
    }
    Ok(LightTexture {
        image,
        is_cube: faces == 6,
        is_for_babylon,
        format,
        levels,
        warnings,
        notes,
        recipe: read_recipe(bytes),
    })
}

/// Puts the columns from left to right and the rows from top to bottom. `KTXorientation` is `rd`, `ru` and so
/// on in KTX2, and `S=r,T=d` and so on in KTX.
fn reorder(width: usize, pixels: &mut [[f32; 3]], height: usize, orientation: Option<&str>) {
    let Some(orientation) = orientation else { return };
    let (leftward, upward) = match orientation.contains('=') {
        true => (orientation.contains("S=l"), orientation.contains("T=u")),
        false => (orientation.starts_with('l'), orientation.chars().nth(1) == Some('u')),
    };
    for image in pixels.chunks_exact_mut((width * height).max(1)) {
        // All pixels backward is both at once.
        if upward {
            image.reverse();
        }
        if leftward != upward {
            image.chunks_exact_mut(width.max(1)).for_each(<[_]>::reverse);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::images::ColourSpace;
    use crate::precision::Precision;
    use crate::textures::write_ktx2;

    #[test]
    fn rows_and_columns_follow_the_orientation() {
        for (orientation, expected) in [
            (None, [0, 1, 2, 3]),
            (Some("rd"), [0, 1, 2, 3]),
            (Some("ru"), [2, 3, 0, 1]),
            (Some("S=r,T=u"), [2, 3, 0, 1]),
            (Some("ld"), [1, 0, 3, 2]),
            (Some("S=l,T=u"), [3, 2, 1, 0]),
        ] {
            let mut pixels = [0.0, 1.0, 2.0, 3.0].map(|value| [value; 3]);
            reorder(2, &mut pixels, 2, orientation);
            assert_eq!(pixels.map(|pixel| pixel[0] as usize), expected, "{orientation:?}");
        }
    }

    #[test]
    fn a_cube_has_its_largest_level_and_its_colours() {
        let cube =
            Texture { width: 2, height: 2, faces: 6, pixels: vec![[0.5; 3]; 24], ..Texture::default() };
        let cube = Texture { smaller_levels: vec![vec![[9.0; 3]; 6]], ..cube };
        let bytes = write_ktx2(&cube, Precision::Float, None, &[]).unwrap().bytes;
        let options = ReadOptions { colour_space: Some(ColourSpace::AcesCg), ..ReadOptions::default() };
        let found = read_light_texture(&bytes, &options).unwrap();
        assert_eq!((found.image.width(), found.image.height(), found.levels), (2, 12, 2));
        assert!(found.is_cube && found.image.pixels()[0].iter().all(|value| (value - 0.5).abs() < 1e-6));
        assert_eq!(found.format, "KTX2, RGBA32F");
        let array = Texture { layers: 2, pixels: vec![[0.5; 3]; 48], smaller_levels: Vec::new(), ..cube };
        let bytes = write_ktx2(&array, Precision::Float, None, &[]).unwrap().bytes;
        let error = read_light_texture(&bytes, &options).unwrap_err().to_string();
        assert!(error.contains("found 1 slices and 2 layers"), "{error}");
    }
}
