//! The files that an engine loads as light, made of a prefiltered cube or of a lat-long image.

use containers::lighting_json::{self, Preset};
use containers::{
    BabylonEnv, Encoded, ImageBasedLight, Polynomial, Precision, ReadOptions, TexelFormat, Texture,
    read_babylon_env, read_gltf_image_based_light, read_image, read_texture, write_babylon_env, write_dds,
    write_exr, write_gltf_image_based_light, write_ktx1, write_ktx2_zstd, write_rgbe,
};
use engine::{Context, Failure};
use envmap::{CubeMap, Environment, Image};
use sh::Expansion;
use shrm::{Distribution, MapGrid, PrefilterKernel, prefilter_series};
use sphere::Cube;

use crate::values::{
    Content, EngineFormat, EnginePreset, Excess, LARGEST_HALF, Overflow, note_floats, rounded, rounded_text,
};

/// The scale by which Babylon.js finds the level of a roughness; the default of its own files.
const LOD_GENERATION_SCALE: f64 = 0.8;

/// The number of texels along the edge of Bevy's cube of irradiance, which is smooth.
const DIFFUSE_EDGE: usize = 32;

/// The contents of an engine's files, in the order of [`names`].
pub(crate) struct EngineFiles {
    pub(crate) files: Vec<Vec<u8>>,
    /// The precision, if the format leaves it open: half unless a value exceeds the largest half.
    pub(crate) precision: Option<Precision>,
    /// The largest number that the file holds.
    pub(crate) limit: f32,
    /// The part of what was given that lies past the limit or, if the precision was open, past the largest
    /// half.
    pub(crate) excess: Excess,
    /// The kind of values, by which the excess was weighed.
    pub(crate) content: Content,
    /// The number of values below 0 in a format without a sign.
    pub(crate) negative: usize,
    /// The RMS difference of each level between what is read back and what was given, as a share of the
    /// level's largest value.
    pub(crate) errors: Vec<f64>,
    /// The change that rounding makes to the light of red, green and blue in each level, as a share of it.
    pub(crate) rounded: Vec<[f64; 3]>,
}

/// The file names of a preset; the first is the light.
pub(crate) fn names(preset: EnginePreset, format: EngineFormat, stem: &str) -> Vec<String> {
    let main = |ending: &str| format!("/{stem}.{ending}");
    let irradiance = || format!("/{stem}-irradiance.json");
    match (preset, format) {
        (EnginePreset::Three, EngineFormat::Bc6h) => vec![main("dds"), irradiance()],
        (EnginePreset::Three, _) => vec![main("ktx2"), irradiance()],
        (EnginePreset::Filament, _) => vec![main("ktx"), format!("/{stem}-sh.txt")],
        (EnginePreset::Babylon, EngineFormat::Rgbd) => vec![main("env")],
        (EnginePreset::Babylon, _) => vec![main("dds"), irradiance()],
        (EnginePreset::Bevy, _) => vec![format!("/{stem}-specular.ktx2"), format!("/{stem}-diffuse.ktx2")],
        (EnginePreset::Gltf, _) => vec![main("gltf")],
        (EnginePreset::Unity | EnginePreset::Unreal, EngineFormat::Exr) => vec![main("exr"), irradiance()],
        (EnginePreset::Unity | EnginePreset::Unreal, _) => vec![main("hdr"), irradiance()],
        (_, EngineFormat::Exr) => vec![main("exr")],
        _ => vec![main("hdr")],
    }
}

/// The largest number of a format.
pub(crate) fn largest(format: EngineFormat) -> f32 {
    match texels(format) {
        Some(format) => format.largest(),
        None if format == EngineFormat::Rgbd => 255.0,
        // The last exponent of RGBE is 2^127, and OpenEXR has 32-bit floats.
        None => f32::MAX,
    }
}

fn texels(format: EngineFormat) -> Option<TexelFormat> {
    match format {
        EngineFormat::Rgba16F => Some(TexelFormat::Rgba16F),
        EngineFormat::Rgba32F => Some(TexelFormat::Rgba32F),
        EngineFormat::Rgb9E5 => Some(TexelFormat::Rgb9E5),
        EngineFormat::R11G11B10F => Some(TexelFormat::R11G11B10F),
        EngineFormat::Bc6h => Some(TexelFormat::Bc6h),
        EngineFormat::Rgbd | EngineFormat::Exr | EngineFormat::Hdr => None,
    }
}

/// The texels of a cube in the order of the engine's file.
fn turned(map: &CubeMap, preset: EnginePreset) -> Vec<[f32; 3]> {
    preset.texels(map.cube()).map(|texel| map.pixels()[texel]).collect()
}

/// Makes a texture of the engine's from levels.
pub(crate) fn texture<'a>(levels: impl IntoIterator<Item = &'a CubeMap>, preset: EnginePreset) -> Texture {
    let mut texture = Texture { faces: 6, ..Texture::default() };
    for (level, map) in levels.into_iter().enumerate() {
        let pixels = turned(map, preset);
        if level == 0 {
            (texture.width, texture.height) = (map.cube().edge, map.cube().edge);
            texture.pixels = pixels;
        } else {
            texture.smaller_levels.push(pixels);
        }
    }
    texture
}

/// The rows of a preset's one table of coefficients.
fn rows(preset: Preset, light: &Expansion) -> Vec<[f64; 3]> {
    let tables = preset.convert(light);
    let rows = tables.iter().flat_map(|table| &table.rows);
    rows.filter_map(|row| row.first_chunk::<3>().copied()).collect()
}

/// The files of an engine that loads cubes with levels.
///
/// `levels` are radiance in our frame; `light` is its series, and `irradiance` the part of the series that
/// few coefficients hold without ringing.
pub(crate) fn of_levels(
    (preset, format): (EnginePreset, EngineFormat),
    levels: &[&CubeMap],
    (light, irradiance): (&Expansion, &Expansion),
    recipe: Option<&str>,
) -> Result<EngineFiles, Failure> {
    let texture = texture(levels.iter().copied(), preset);
    if let Some(place) = texture.first_not_finite() {
        return Err(Failure::new(format!("{place}: the value is not finite"))
            .help("repair the environment with bad-pixels of import-environment"));
    }
    let texel_format = texels(format).unwrap_or(TexelFormat::Rgba16F);
    let json = |preset: Preset| lighting_json::encode(&irradiance.clone().into(), preset, recipe);
    let (encoded, beside): (Encoded, Option<Vec<u8>>) = match (preset, format) {
        (EnginePreset::Three, EngineFormat::Bc6h) => {
            (write_dds(&texture, texel_format)?, Some(json(Preset::Three)?))
        }
        (EnginePreset::Three, _) => {
            (write_ktx2_zstd(&texture, texel_format, recipe, &[])?, Some(json(Preset::Three)?))
        }
        (EnginePreset::Filament, _) => {
            let line = |[r, g, b]: [f64; 3]| format!("{r} {g} {b}\n");
            let lines: String = rows(Preset::Filament, irradiance).into_iter().map(line).collect();
            (write_ktx1(&texture, texel_format, recipe, &[("sh", &lines)])?, Some(lines.into_bytes()))
        }
        (EnginePreset::Babylon, EngineFormat::Rgbd) => {
            let rows = rows(Preset::BabylonEnv, irradiance);
            let [x, y, z, xx, yy, zz, yz, zx, xy] = <[[f64; 3]; 9]>::try_from(rows)
                .map_err(|rows| Failure::new(format!("{} rows of a polynomial", rows.len())))?;
            let env = BabylonEnv {
                cube: texture.clone(),
                irradiance: Some(Polynomial { x, y, z, xx, yy, zz, yz, zx, xy }),
                lod_generation_scale: LOD_GENERATION_SCALE,
            };
            (write_babylon_env(&env, recipe)?, None)
        }
        (EnginePreset::Babylon, _) => (write_dds(&texture, texel_format)?, Some(json(Preset::Babylon)?)),
        (EnginePreset::Gltf, _) => {
            let irradiance = <[[f64; 3]; 9]>::try_from(rows(Preset::Gltf, irradiance))
                .map_err(|rows| Failure::new(format!("{} rows of irradiance", rows.len())))?;
            let light = ImageBasedLight { cube: texture.clone(), irradiance };
            (write_gltf_image_based_light(&light, recipe)?, None)
        }
        _ => {
            let diffuse = write_ktx2_zstd(&diffuse(light, preset)?, texel_format, recipe, &[])?;
            (write_ktx2_zstd(&texture, texel_format, recipe, &[])?, Some(diffuse.bytes))
        }
    };
    let found = match (preset, format) {
        (EnginePreset::Babylon, EngineFormat::Rgbd) => read_babylon_env(&encoded.bytes)?.cube,
        (EnginePreset::Gltf, _) => read_gltf_image_based_light(&encoded.bytes)?.cube,
        _ => read_texture(&encoded.bytes)?.texture,
    };
    let errors =
        texture.levels().zip(found.levels()).map(|(given, found)| difference(given, found)).collect();
    let limit = largest(format);
    // The texels are turned by whole faces, which have the same solid angles.
    let contents: Vec<_> = levels.iter().map(|level| Content::Light(MapGrid::Cube(level.cube()))).collect();
    let excesses =
        texture.levels().zip(&contents).map(|(texels, content)| Excess::of(texels, *content, limit));
    let is_signed = texels(format).is_some_and(TexelFormat::is_signed);
    let pairs = texture.levels().zip(found.levels()).zip(&contents);
    let rounded = pairs.map(|((given, found), content)| rounded(given, found, *content, (limit, is_signed)));
    Ok(EngineFiles {
        precision: None,
        limit,
        excess: excesses.fold(Excess::default(), Excess::and),
        content: Content::Light(MapGrid::Cube(Cube { edge: texture.width })),
        negative: encoded.negative,
        errors,
        rounded: rounded.collect(),
        files: std::iter::once(encoded.bytes).chain(beside).collect(),
    })
}

/// The irradiance over pi, in all degrees that the light holds.
fn diffuse(light: &Expansion, preset: EnginePreset) -> Result<Texture, Failure> {
    let kernel =
        PrefilterKernel::new(Distribution::Lambert, 1.0).map_err(|error| Failure::new(error.to_string()))?;
    let cube = Cube { edge: DIFFUSE_EDGE };
    let mut texels =
        prefilter_series(light, &kernel, cube).map_err(|error| Failure::new(error.to_string()))?;
    texels.as_flattened_mut().iter_mut().for_each(|value| *value = value.max(0.0));
    let map = CubeMap::new(cube, texels).ok_or_else(|| Failure::new("a cube without texels"))?;
    Ok(texture([&map], preset))
}

/// The files of an engine that loads a lat-long image and filters it itself.
pub(crate) fn of_lat_long(
    (preset, format): (EnginePreset, EngineFormat),
    environment: &Environment,
    irradiance: &Expansion,
    recipe: Option<&str>,
) -> Result<EngineFiles, Failure> {
    let grid = environment.grid();
    let image = Image::new(grid.width, grid.height, environment.pixels().to_vec())
        .ok_or_else(|| Failure::new("an environment without pixels"))?;
    let content = Content::Light(MapGrid::LatLong(grid));
    let past = |limit: f32| Excess::of(environment.pixels(), content, limit);
    let (encoded, precision, limit, excess) = match format {
        EngineFormat::Exr => {
            let excess = past(LARGEST_HALF);
            let (precision, limit) = match excess.count {
                0 => (Precision::Half, LARGEST_HALF),
                _ => (Precision::Float, f32::MAX),
            };
            (write_exr(&image, precision, recipe)?, Some(precision), limit, excess)
        }
        _ => (write_rgbe(&image, recipe)?, None, largest(format), past(largest(format))),
    };
    let beside = match preset {
        EnginePreset::Unity => Some(Preset::Unity),
        EnginePreset::Unreal => Some(Preset::Unreal),
        _ => None,
    };
    let beside = beside.map(|preset| lighting_json::encode(&irradiance.clone().into(), preset, recipe));
    let found = read_image(&encoded.bytes, &ReadOptions::default())?.image;
    Ok(EngineFiles {
        precision,
        limit,
        excess,
        content,
        negative: encoded.negative,
        errors: vec![difference(environment.pixels(), found.pixels())],
        rounded: vec![rounded(
            environment.pixels(),
            found.pixels(),
            content,
            (limit, format == EngineFormat::Exr),
        )],
        files: std::iter::once(encoded.bytes).chain(beside.transpose()?).collect(),
    })
}

fn largest_of(pixels: &[[f32; 3]]) -> f32 {
    pixels.as_flattened().iter().fold(0.0, |a, b| a.max(*b))
}

/// The RMS difference over texels and channels, as a share of the largest value.
fn difference(given: &[[f32; 3]], found: &[[f32; 3]]) -> f64 {
    let squares: f64 = given
        .as_flattened()
        .iter()
        .zip(found.as_flattened())
        .map(|(a, b)| math::powi(f64::from(*a) - f64::from(*b), 2))
        .sum();
    let largest = f64::from(largest_of(given));
    if largest == 0.0 { 0.0 } else { (squares / (3 * given.len()) as f64).sqrt() / largest }
}

/// Warns of the values that the format could not hold, or fails.
pub(crate) fn report(
    made: &EngineFiles,
    (preset, format): (EnginePreset, EngineFormat),
    overflow: Overflow,
    context: &Context<'_>,
) -> Result<(), Failure> {
    let (excess, most, name) = (&made.excess, made.limit, format.name());
    if excess.count > 0 && made.precision == Some(Precision::Float) {
        note_floats(excess, context);
    } else if excess.count > 0 {
        let remedy = remedy(preset, excess.largest);
        match overflow {
            Overflow::Clamp => {
                context.warn(format!("{}; {name} ends at {most}; {remedy}", excess.text(made.content)));
            }
            Overflow::Error => {
                let text = format!("{} values exceed {most}, the largest of {name}", excess.count);
                return Err(Failure::new(text).help(remedy));
            }
        }
    }
    // The change of each channel in the level where rounding changes it most.
    let worst = made.rounded.iter().fold([0.0_f64; 3], |worst, level| {
        [0, 1, 2].map(|c| if level[c].abs() > worst[c].abs() { level[c] } else { worst[c] })
    });
    if let Some(text) = rounded_text(worst) {
        context.warn(format!("{text}; {}", finer(preset, format)));
    }
    if made.negative > 0 {
        context.warn(format!("{} negative values became 0, for {name} has no sign", made.negative));
    }
    Ok(())
}

/// Advises a format that rounds less than this one.
fn finer(preset: EnginePreset, format: EngineFormat) -> String {
    let finer = [EngineFormat::Rgba16F, EngineFormat::Rgba32F, EngineFormat::Exr];
    match preset.formats().iter().find(|other| **other != format && finer.contains(other)) {
        Some(other) => format!("format = {:?} keeps it", other.name()),
        None => "more texels keep more of it: give a higher `resolution`".into(),
    }
}

/// Advises how to keep a light of this radiance in an engine.
fn remedy(preset: EnginePreset, largest: f32) -> String {
    let beside =
        "a light beside the map keeps it (`subtract-lights` takes it out, `export-light-rig` writes it)";
    match preset.formats().iter().find(|format| self::largest(**format) >= largest) {
        Some(format) => format!("format = {:?} keeps it, or {beside}", format.name()),
        None => beside.into(),
    }
}
