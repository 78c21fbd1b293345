//! The files that an engine loads as light, made of a prefiltered cube or of a lat-long image.

use std::iter;

use containers::{Precision, ReadOptions, TexelFormat, lighting_json, read_image, write_exr, write_rgbe};
use engine::{Failure, Reporter};
use envmap::{CubeMap, Environment};
use sh::{Expansion, Stop};
use shrm::MapGrid;
use sphere::Cube;

use crate::engines::{CubeLight, EngineFormat, EnginePreset, Skybox, texture};
use crate::values::{
    Content, Excess, LARGEST_HALF, Overflow, RowsLost, note_floats, rounded, rounded_text, squares,
};

/// An engine, and the format in which it gets its light.
#[derive(Clone, Copy)]
pub(crate) struct EngineTarget {
    pub(crate) preset: EnginePreset,
    pub(crate) format: EngineFormat,
}

/// The contents of an engine's files, in the order of [`crate::engines::Engine::names`].
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

/// The files of an engine that loads cubes with levels.
///
/// `levels` are radiance in our frame; `series` is that of the light, and `irradiance` the part of the series
/// that few coefficients hold without ringing.
pub(crate) fn of_levels(
    EngineTarget { preset, format }: EngineTarget,
    levels: &[&CubeMap],
    series: &Expansion,
    irradiance: &Expansion,
    recipe: Option<&str>,
) -> Result<EngineFiles, Failure> {
    let loaded = preset.cube().and_then(|cube| Some((cube, cube.files(format)?)));
    let Some((cube, files)) = loaded else {
        return Err(Failure::new(format!("{} loads no cube as {}", preset.name, format.name())));
    };
    let texture = texture(levels.iter().copied(), cube.direction_at);
    if let Some(place) = texture.first_not_finite() {
        return Err(Failure::new(format!("{place}: the value is not finite"))
            .help("repair the environment with bad-pixels of import-environment"));
    }
    let texels = format.texels().unwrap_or(TexelFormat::Rgba16F);
    let direction_at = cube.direction_at;
    let light = CubeLight { texture, texels, direction_at, series, irradiance, recipe };
    let (encoded, beside) = (files.write)(&light)?;
    let found = (files.read)(&encoded.bytes)?;
    let texture = light.texture;
    let errors =
        texture.levels().zip(found.levels()).map(|(given, found)| difference(given, found)).collect();
    let limit = format.largest();
    // The texels are turned by whole faces, which have the same solid angles.
    let contents: Vec<_> = levels.iter().map(|level| Content::Light(MapGrid::Cube(level.cube()))).collect();
    let excesses =
        texture.levels().zip(&contents).map(|(texels, content)| Excess::of(texels, *content, limit));
    let is_signed = format.texels().is_some_and(TexelFormat::is_signed);
    let pairs = texture.levels().zip(found.levels()).zip(&contents);
    let rounded = pairs.map(|((given, found), content)| rounded(given, found, *content, limit, is_signed));
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

/// The sharp cube that an engine shows behind a scene.
pub(crate) struct SkyFile {
    pub(crate) file: Vec<u8>,
    /// The number of texels along the edge of a face.
    pub(crate) size: usize,
    /// The part of the light that lies past the format's largest number.
    pub(crate) excess: Excess,
}

/// The file of a sky in our frame, with all its smaller levels.
pub(crate) fn of_sky(
    EngineTarget { preset, format }: EngineTarget,
    skybox: &Skybox,
    sky: CubeMap,
    recipe: Option<&str>,
) -> Result<SkyFile, Failure> {
    let cube = preset.cube().ok_or_else(|| Failure::new(format!("{} loads no cube", preset.name)))?;
    let content = Content::Light(MapGrid::Cube(sky.cube()));
    let (size, excess) = (sky.cube().edge, Excess::of(sky.pixels(), content, format.largest()));
    let texture = texture(iter::successors(Some(sky), CubeMap::halved), cube.direction_at);
    let texels = format.texels().unwrap_or(TexelFormat::Rgba16F);
    let file = (skybox.write)(&texture, texels, recipe)?.bytes;
    Ok(SkyFile { file, size, excess })
}

/// The files of an engine that loads a lat-long image and filters it itself.
pub(crate) fn of_lat_long(
    EngineTarget { preset, format }: EngineTarget,
    environment: &Environment,
    irradiance: &Expansion,
    recipe: Option<&str>,
    stop: Stop<'_>,
) -> Result<EngineFiles, Failure> {
    let image = environment.to_image();
    let past = |limit: f32| Excess::of_rows(environment, limit, stop);
    let (encoded, precision, limit, excess) = match format {
        EngineFormat::Exr => {
            let excess = past(LARGEST_HALF)?;
            let (precision, limit) = match excess.count {
                0 => (Precision::Half, LARGEST_HALF),
                _ => (Precision::Float, f32::MAX),
            };
            (write_exr(&image, precision, recipe)?, Some(precision), limit, excess)
        }
        EngineFormat::Hdr => (write_rgbe(&image, recipe)?, None, format.largest(), past(format.largest())?),
        EngineFormat::Rgba16F
        | EngineFormat::Rgba32F
        | EngineFormat::Rgb9E5
        | EngineFormat::R11G11B10F
        | EngineFormat::Bc6h
        | EngineFormat::Rgbd => {
            return Err(Failure::new(format!("{} loads no image as {}", preset.name, format.name())));
        }
    };
    let beside = preset.irradiance_beside_image();
    let beside = beside.map(|preset| lighting_json::encode(&irradiance.clone().into(), preset, recipe));
    let found = read_image(&encoded.bytes, &ReadOptions::default())?.image;
    let lost = RowsLost::of(environment, &found, limit, format == EngineFormat::Exr);
    let largest = f64::from(excess.largest);
    Ok(EngineFiles {
        precision,
        limit,
        excess,
        content: Content::Light(MapGrid::LatLong(environment.grid())),
        negative: encoded.negative,
        errors: vec![if largest > 0.0 { lost.rms / largest } else { 0.0 }],
        rounded: vec![lost.rounded],
        files: std::iter::once(encoded.bytes).chain(beside.transpose()?).collect(),
    })
}

/// The RMS difference over texels and channels, as a share of the largest value.
fn difference(given: &[[f32; 3]], found: &[[f32; 3]]) -> f64 {
    let largest = f64::from(given.as_flattened().iter().fold(0.0_f32, |largest, value| largest.max(*value)));
    if largest == 0.0 { 0.0 } else { (squares(given, found) / (3 * given.len()) as f64).sqrt() / largest }
}

/// Warns of the values that the format could not hold, or fails.
pub(crate) fn report(
    made: &EngineFiles,
    EngineTarget { preset, format }: EngineTarget,
    overflow: Overflow,
    reporter: &Reporter,
) -> Result<(), Failure> {
    let (excess, most, name) = (&made.excess, made.limit, format.name());
    if excess.count > 0 && made.precision == Some(Precision::Float) {
        note_floats(excess, reporter);
    } else if excess.count > 0 {
        let remedy = remedy(preset, excess.largest);
        match overflow {
            Overflow::Clamp => {
                reporter.warn(format!("{}; {name} ends at {most}; {remedy}", excess.text(made.content)));
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
        reporter.warn(format!("{text}; {}", finer(preset, format)));
    }
    if made.negative > 0 {
        reporter.warn(format!("{} negative values became 0, for {name} has no sign", made.negative));
    }
    Ok(())
}

/// Advises a format that rounds less than this one.
fn finer(preset: EnginePreset, format: EngineFormat) -> String {
    let finer = [EngineFormat::Rgba16F, EngineFormat::Rgba32F, EngineFormat::Exr];
    match preset.formats().into_iter().find(|other| *other != format && finer.contains(other)) {
        Some(other) => format!("format = {:?} keeps it", other.name()),
        None => "more texels keep more of it: give a higher `resolution`".into(),
    }
}

/// Advises how to keep a light of this radiance in an engine.
fn remedy(preset: EnginePreset, largest: f32) -> String {
    let beside = "sun = \"light\" makes it a separate light";
    match preset.formats().into_iter().find(|format| format.largest() >= largest) {
        Some(format) => format!("format = {:?} keeps it, or {beside}", format.name()),
        None => beside.into(),
    }
}
