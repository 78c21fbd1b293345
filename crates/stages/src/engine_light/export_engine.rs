//! Writes an environment as the files that an engine loads as light: prefiltered, turned, and in its format.
//!
//! ```toml
//! [stage.light]
//! kind = "export-engine"
//! input = "environment"
//! preset = "babylon"
//! path = "{environment}/babylon"
//! ```
//!
//! Connect an environment, or a cube of `prefilter` that was made with the same `preset`. An environment is
//! prefiltered with the defaults of `prefilter`. Use `export-environment` to write a cube with other
//! roughnesses or lobes.
//!
//! | `preset` | files | level l of 0 to n holds | formats |
//! | --- | --- | --- | --- |
//! {rows: files of engines}
//!
//! The first format is the default. r is the roughness of GGX; level 0 is a mirror, and the last level is
//! irradiance over pi. KTX2 files are compressed with Zstandard.
//!
//! ## The sky
//!
//! An engine that loads a cube gets a second one, `-skybox` with the same extension, to show behind the
//! scene: the light at full sharpness, with smaller and smaller levels, each the mean of 2 x 2 texels, down
//! to one texel. By default a face has as many texels along its edge as a quarter of the image's width,
//! rounded to a power of two, at most 2048; `skybox-resolution` sets another number, and `skybox = false`
//! leaves it out. It has the same orientation as the light. An engine that loads a lat-long image shows
//! that image. The code is in `README.txt`.
//!
//! ## The sun as a light
//!
//! An engine shades a sun better as a separate light: it casts shadows, its highlight is sharp, and no
//! format clamps it. With `sun = "light"` the `lights` strongest suns and lamps leave the image, as in
//! `subtract-lights`, before the light, the sky and the irradiance are made from it. They are in
//! `-lights.json`, in the engine's world, and `README.txt` has the code that creates lights from it. They
//! are also written as a scene that the engine imports: `-lights.gltf` (KHR_lights_punctual), for Godot
//! `-lights.tscn`, and for Blender and Unreal `-lights.usda`. The last two include the image, so importing
//! them is all you need to do. The rest of the image and the lights together are the whole light. Parts of
//! one bright disk, of up to 12 degrees, are one light.
//!
//! ## Where the light comes from
//!
//! In each engine, a cube has the orientation of the same lat-long image. If d is the direction in the
//! frame of files (+Y up, the centre of a lat-long image looks along +Z) and c are the coordinates of a
//! cube's faces (KTX2), the texel at c holds the light from
//!
//! | `preset` | d at c |
//! | --- | --- |
//! {rows: directions of engines}
//!
//! So the centre of a lat-long image is +X in three.js and Bevy, and +Z in Filament and Babylon.js.
//! `test-pattern` makes files with which you can check this in your engine.
//!
//! ## What does not fit
//!
//! `hdr` and `rgba32f` hold every value, and so does `exr`: its numbers are halves, or, with a note, 32-bit
//! floats if a value exceeds 65504. `rgba16f` and `bc6h` end at 65504, `rgb9e5` at 65408, `r11g11b10f` at
//! 64512, `rgbd` at 255. Brighter values are clamped, and a warning reports the lost share of the red,
//! green and blue light; with `overflow = "error"` the item fails instead. Another format of the engine may
//! be able to hold the values, and a separate light (`sun`) always can.
//!
//! `rgb9e5`, `r11g11b10f`, `rgbd` and `bc6h` round by percents, so rounding each texel to the nearest
//! number would change the total light. Instead, tiles of 8 x 8 texels keep their light: a texel between
//! two numbers takes the farther one if necessary. A block of `bc6h` holds one or two lines of colours, and
//! the next block compensates for its loss. If the light of a channel still changes by more than 0.1 %, as
//! it does if a few texels hold all the light, a warning says by how much.
//!
//! The sky does not light anything, so there is no warning about its losses; `bounds.json` lists them as
//! `skybox`.
//!
//! `bounds.json` has the largest value, the number of clamped values and the lost shares (`lost_light`:
//! red, green, blue). For each level it has the estimated error of the prefilter (`error`) and the rounding
//! error of the format, as read back (`stored_error`), both as RMS relative to the level's largest value,
//! and the share of red, green and blue light that rounding adds (`rounded_light`).
//!
//! Irradiance from nine coefficients rings under a sun, as described in `export-sh`; here, too, the weakest
//! window under which it is never negative is applied. Babylon.js 8 and later instead uses the irradiance
//! cube in `.env`, which has all degrees and does not ring.
//!
//! ## Files
//!
//! The folder `path` contains `environment` with the extensions above, `README.txt` with the code that
//! loads them, and `bounds.json`.

use std::any::Any;

use containers::Precision;
use engine::{Artifact, Context, Failure, Kind, Output, Port, Product, Reporter, choice, parameters};
use envmap::{Environment, joined_lights};
use serde_json::{Value, json};
use sh::{Degree, Expansion, Light, Stop, Transform};
use shrm::{Distribution, LevelMethod, MethodChoice, Prefiltered, prefilter};
use sphere::{Cube, LatLong};

use super::engine_files;
use super::engine_files::{EngineFiles, EngineTarget, SkyFile, report};
use super::irradiance::windowed;
use crate::engines::{self, EngineFormat, EnginePreset, ExportedLight, Skybox};
use crate::values::{LIGHTS, LightCount, MAX_RESOLUTION, Overflow, UntilStopped, artifacts, share};

/// The stem of the names of `export-engine`'s files, before their endings.
pub const ENGINE_FILE_STEM: &str = "environment";

/// The port of the light.
const LIGHT: &str = "light";

/// The number of texels along the edge of a face, if nothing says how many.
const DEFAULT_EDGE: usize = 256;

choice! {
    /// What becomes of suns and lamps.
    pub(crate) enum Sun {
        /// They stay in the image.
        Image = "image",
        /// They are lights beside it.
        Light = "light",
    }
}

/// A sky of more bytes takes long to load.
const LARGE_SKY: usize = 32_000_000;

parameters! {
    /// Parameters of `export-engine`.
    pub(crate) struct Parameters {
        /// The engine.
        preset: EnginePreset = EnginePreset::DEFAULT,
        /// How texels are stored. Default: the first of the preset's formats.
        format: Option<EngineFormat> = None,
        /// If the input is an environment: texels along the edge of a face, by default 256; or rows of a
        /// lat-long image, by default those of the environment.
        #[range(1..=MAX_RESOLUTION)]
        resolution: Option<usize> = None,
        /// Whether an engine that loads a cube also gets a sharp one to show behind the scene.
        skybox: bool = true,
        /// Texels along the edge of a face of that cube. Default: as fine as the environment, at most 2048.
        #[range(1..=MAX_RESOLUTION)]
        skybox_resolution: Option<usize> = None,
        /// Whether suns and lamps stay in the image, or become separate lights.
        sun: Sun = Sun::Image,
        /// With sun = "light": how many of the strongest suns and lamps become lights, or "all". Default: 8.
        lights: Option<LightCount> = None,
        /// What happens to values that are too large for the format: they become the largest that it can
        /// hold, with a warning that reports the lost light, or the item fails.
        overflow: Overflow = Overflow::Clamp,
    }
}

impl Parameters {
    fn format(&self) -> EngineFormat {
        self.format.unwrap_or_else(|| self.preset.formats()[0])
    }

    /// The names of the image's files and of that of the sky, which come before all others.
    fn images(&self) -> Vec<String> {
        let mut files = self.preset.names(self.format(), ENGINE_FILE_STEM);
        files.extend(self.skybox().map(|skybox| format!("/{ENGINE_FILE_STEM}{}", skybox.ending)));
        files
    }

    /// The file of the sky, if there is one.
    fn skybox(&self) -> Option<&'static Skybox> {
        self.preset.skybox(self.format()).filter(|_| self.skybox)
    }
}

/// The kind `export-engine`.
pub(crate) struct ExportEngine;

impl Kind for ExportEngine {
    type Parameters = Parameters;

    const NAME: &'static str = "export-engine";
    const REVISION: u32 = 7;
    const KERNELS: &'static [u32] = &[
        shrm::revisions::PREFILTER,
        sh::revisions::TRANSFORM,
        sh::revisions::WINDOW,
        envmap::revisions::CUBE_MAP,
        envmap::revisions::LAMPS,
        envmap::revisions::WITHOUT_LIGHTS,
    ];
    const TEXT: &'static str = include_str!("export_engine.rs");

    fn manual(text: String) -> String {
        engines::fill_in(&text)
    }

    fn ports() -> Vec<Port> {
        vec![Port::one::<artifacts::Environment>(LIGHT).or::<artifacts::Prefiltered>()]
    }

    fn product(parameters: &Parameters, _: &[(&str, &'static str)]) -> Product {
        let mut files = parameters.images();
        if parameters.sun == Sun::Light {
            let endings = parameters.preset.lights.endings();
            files.extend(endings.map(|ending| format!("/{ENGINE_FILE_STEM}{ending}")));
        }
        files.extend(["/README.txt".into(), "/bounds.json".into()]);
        Product::Files(files)
    }

    fn details(parameters: &Parameters) -> Option<Box<dyn Any>> {
        Some(Box::new(ExportedLight::Engine {
            engine: parameters.preset.engine(),
            format: parameters.format(),
            lights_file: (parameters.sun == Sun::Light).then(|| parameters.images().len()),
        }))
    }

    fn check(parameters: &Parameters) -> Vec<(&'static str, String)> {
        let preset = parameters.preset;
        let size = parameters.resolution.filter(|_| preset.loads_cube());
        let size = size.and_then(|size| preset.roughness(size).err()).map(|error| ("resolution", error));
        let unused = parameters.skybox_resolution.is_some() && !(parameters.skybox && preset.loads_cube());
        let unused = unused.then(|| {
            let why = if parameters.skybox {
                "the engine shows the lat-long image itself"
            } else {
                "skybox = false leaves it out"
            };
            ("skybox-resolution", format!("there is no cube of the sky: {why}"))
        });
        let no_sun = parameters.lights.is_some() && parameters.sun == Sun::Image;
        let no_sun = no_sun.then(|| ("lights", "only sun = \"light\" uses it".into()));
        preset.check_format(parameters.format).into_iter().chain(size).chain(unused).chain(no_sun).collect()
    }

    fn check_inputs(parameters: &Parameters, types: &[(&str, &'static str)]) -> Vec<(&'static str, String)> {
        let is_cube = types.contains(&(LIGHT, artifacts::Prefiltered::TYPE));
        let mut errors = Vec::new();
        if is_cube && parameters.sun == Sun::Light {
            errors.push(("sun", "a prefiltered cube is already blurred; connect an environment".into()));
        }
        if is_cube && !parameters.preset.loads_cube() {
            let name = parameters.preset.name;
            errors
                .push(("preset", format!("{name} filters a lat-long image itself; connect an environment")));
        }
        let sizes =
            [("resolution", parameters.resolution), ("skybox-resolution", parameters.skybox_resolution)];
        for (name, size) in sizes {
            if is_cube && size.is_some() {
                errors.push((name, "a prefiltered cube already has a size".into()));
            }
        }
        errors
    }

    fn run(parameters: &Parameters, context: &Context<'_>) -> Result<Output, Failure> {
        let reporter = &context.reporter;
        let (preset, format) = (parameters.preset, parameters.format());
        let target = EngineTarget { preset, format };
        let recipe = Some(context.recipe());
        let (mut sky, mut suns) = (None, Vec::new());
        let (made, levels) = if context.inputs.type_at(LIGHT) == Some(artifacts::Prefiltered::TYPE) {
            let cube = context.inputs.get::<artifacts::Prefiltered>(LIGHT)?;
            check_levels(preset, &cube.0)?;
            // The mirror, which is as sharp as the cube is.
            sky = cube.0.levels.first().map(|level| level.map.clone());
            cube_files(target, &cube.0, context)?
        } else {
            let environment = &context.inputs.get::<artifacts::Environment>(LIGHT)?.0;
            let rest;
            let environment = match parameters.sun {
                Sun::Image => environment,
                Sun::Light => {
                    let count = parameters.lights.unwrap_or(LIGHTS);
                    (rest, suns) = without_suns(environment, count, reporter)?;
                    &rest
                }
            };
            if preset.loads_cube() {
                let edge = parameters.resolution.unwrap_or(DEFAULT_EDGE);
                let cube = prefiltered(preset, environment, edge, reporter)?;
                if parameters.skybox().is_some() {
                    let edge = parameters.skybox_resolution.unwrap_or_else(|| skybox_edge(environment));
                    // The mirror may be that cube already.
                    let mirror = cube.levels.first().filter(|level| {
                        let is_mirror = level.method == LevelMethod::Resampled && level.negative == 0;
                        is_mirror && level.map.cube().edge == edge
                    });
                    sky = Some(match mirror {
                        Some(level) => level.map.clone(),
                        None => environment.cube_map(Cube { edge })?,
                    });
                }
                cube_files(target, &cube, context)?
            } else {
                // The irradiance is that of the whole picture, whatever the size of the written one is.
                let light = reporter.until_stopped(|stop| light_of(environment, stop))?;
                let irradiance = nine(&light, reporter);
                let resized = match parameters.resolution {
                    Some(rows) if rows != environment.grid().height => {
                        Some(environment.resized(LatLong::with_rows(rows))?)
                    }
                    _ => None,
                };
                let environment = resized.as_ref().unwrap_or(environment);
                let made = reporter.until_stopped(|stop| {
                    engine_files::of_lat_long(target, environment, &irradiance, recipe, stop)
                })?;
                (made, vec![json!({ "rows": environment.grid().height })])
            }
        };
        context.reporter.check_cancelled()?;
        report(&made, target, parameters.overflow, reporter)?;
        let mut text = preset.readme(format, ENGINE_FILE_STEM);
        let sky = match parameters.skybox().zip(sky) {
            Some((skybox, map)) => {
                text =
                    format!("{text}\n{}", (skybox.readme)(&format!("{ENGINE_FILE_STEM}{}", skybox.ending)));
                Some(engine_files::of_sky(target, skybox, map, recipe)?)
            }
            None => None,
        };
        let lights = match parameters.sun {
            Sun::Image => Vec::new(),
            Sun::Light => {
                text = format!("{text}\n{}", preset.lights.text(ENGINE_FILE_STEM));
                let names = preset.names(format, ENGINE_FILE_STEM);
                let image = names.first().map_or("", |name| name.trim_start_matches('/'));
                preset.lights.files(preset.name, |d| preset.world(d), &suns, image, context.recipe())?
            }
        };
        let bounds = bounds(target, &made, levels, sky.as_ref(), context.recipe())?;
        if let Some(sky) = sky.as_ref().filter(|sky| sky.file.len() > LARGE_SKY) {
            let (megabytes, half) = (sky.file.len() / 1_000_000, (sky.size / 2).max(1));
            reporter.warn(format!(
                "the sky takes {megabytes} MB; skybox-resolution = {half} takes a quarter of that"
            ));
        }
        let sky = sky.map(|sky| sky.file);
        Ok(Output::files(
            made.files.into_iter().chain(sky).chain(lights).chain([text.into_bytes(), bounds]).collect(),
        ))
    }
}

/// The edge of a sky that is as fine as an environment in the middle of a face: a power of two.
fn skybox_edge(environment: &Environment) -> usize {
    const LARGEST: usize = 2048;
    engines::nearest_power_of_two(environment.grid().width / 4).clamp(1, LARGEST)
}

/// An environment without its strongest suns and lamps, and these.
fn without_suns(
    environment: &Environment,
    count: LightCount,
    reporter: &Reporter,
) -> Result<(Environment, Vec<Light>), Failure> {
    let found = joined_lights(reporter.until_stopped(|stop| environment.separate_lamps(stop))?.lights);
    let suns = count.of(&found).to_vec();
    let subtracted = environment.without_lights(&suns);
    match (suns.len(), found.len()) {
        (_, 0) => reporter.note("there is no sun or lamp that can become a light"),
        (kept, all) => {
            let taken: f64 = subtracted.taken.iter().sum();
            let taken = share(taken / environment.integral().iter().sum::<f64>());
            let lights = if kept == 1 { "1 light holds".into() } else { format!("{kept} lights hold") };
            let rest =
                if all > kept { format!("; {} more stay in the image", all - kept) } else { String::new() };
            reporter.note(format!("{lights} {taken} of the light{rest}"));
        }
    }
    Ok((subtracted.rest, suns))
}

/// An environment prefiltered with an engine's levels.
fn prefiltered(
    preset: EnginePreset,
    environment: &Environment,
    edge: usize,
    reporter: &Reporter,
) -> Result<Prefiltered, Failure> {
    let roughness = preset.roughness(edge).map_err(Failure::new)?;
    reporter.until_stopped(|stop| {
        prefilter(environment, None, Distribution::Ggx, &roughness, edge, MethodChoice::Auto, stop)
            .map_err(|error| Failure::new(error.to_string()))
    })
}

/// Whether a cube has the levels that an engine looks for.
fn check_levels(preset: EnginePreset, cube: &Prefiltered) -> Result<(), Failure> {
    let edge = cube.levels.first().map_or(0, |level| level.map.cube().edge);
    let help = format!("give preset = {:?} to the stage of kind prefilter", preset.name);
    let expected = preset.roughness(edge).map_err(|error| Failure::new(error).help(help.as_str()))?;
    if cube.levels.len() != expected.len() {
        let fits = preset.size_with(cube.levels.len()).unwrap_or(edge);
        let (found, name, wanted) = (cube.levels.len(), preset.name, expected.len());
        return Err(Failure::new(format!(
            "the cube has {found} levels; {name} expects {wanted} in a cube of {edge}; the nearest size that \
             fits {found} is {fits}"
        ))
        .help(help.as_str()));
    }
    for (l, (level, expected)) in cube.levels.iter().zip(&expected).enumerate() {
        if (level.roughness - expected).abs() > 1e-6 {
            let (found, name) = (level.roughness, preset.name);
            let text = format!("level {l} has roughness {found:.4}, but {name} expects {expected:.4} there");
            return Err(Failure::new(text).help(help.as_str()));
        }
    }
    if cube.distribution != Distribution::Ggx {
        return Err(Failure::new(
            "the cube is not prefiltered with GGX, the lobe of the engines' reflections",
        )
        .help(
            "give distribution = \"ggx\" to the stage of kind prefilter, or write the cube for your own \
             renderer: kind = \"export-environment\", layout = \"cube\", format = \"ktx2\"",
        ));
    }
    Ok(())
}

/// An environment's series of degree 2.
fn light_of(environment: &Environment, stop: Stop<'_>) -> Result<Expansion, Failure> {
    Ok(Transform::new(environment.grid(), Degree::new(2)?)?.analyse_rows(environment, stop)?)
}

/// Cuts a light to nine coefficients, without ringing.
fn nine(light: &Expansion, reporter: &Reporter) -> Expansion {
    windowed(light.to_degree(Degree::new(2).unwrap_or(light.degree())), reporter)
}

/// Makes the files of a cube, and the entries of `bounds.json` about its levels.
fn cube_files(
    target: EngineTarget,
    cube: &Prefiltered,
    context: &Context<'_>,
) -> Result<(EngineFiles, Vec<Value>), Failure> {
    let maps: Vec<_> = cube.levels.iter().map(|level| &level.map).collect();
    let irradiance = nine(&cube.series, &context.reporter);
    let made = engine_files::of_levels(target, &maps, &cube.series, &irradiance, Some(context.recipe()))?;
    let level = |level: &shrm::PrefilteredLevel| {
        let (method, degree) = match level.method {
            LevelMethod::Resampled => ("resampled", None),
            LevelMethod::Series { degree } => ("sh", Some(degree)),
            LevelMethod::Quadrature => ("quadrature", None),
        };
        json!({
            "size": level.map.cube().edge, "roughness": level.roughness, "method": method, "degree": degree,
            "negative": level.negative, "error": level.error,
        })
    };
    Ok((made, cube.levels.iter().map(level).collect()))
}

/// Makes the JSON with the largest value, what was clamped, and the error of each level.
fn bounds(
    EngineTarget { preset, format }: EngineTarget,
    made: &EngineFiles,
    mut levels: Vec<Value>,
    sky: Option<&SkyFile>,
    recipe: &str,
) -> Result<Vec<u8>, Failure> {
    for (level, (stored, rounded)) in levels.iter_mut().zip(made.errors.iter().zip(&made.rounded)) {
        level["stored_error"] = json!(stored);
        level["rounded_light"] = json!(rounded);
    }
    let recipe: Value = serde_json::from_str(recipe)?;
    let bounds = json!({
        "preset": preset.name,
        "format": format.name(),
        "precision": made.precision.map(|precision| match precision {
            Precision::Half => "half",
            Precision::Float => "float",
        }),
        "largest": made.excess.largest,
        "format_largest": made.limit,
        "clamped": if made.precision.is_some() { 0 } else { made.excess.count },
        "lost_light": if made.precision.is_some() { [0.0; 3] } else { made.excess.lost },
        "negative": made.negative,
        "levels": levels,
        "skybox": sky.map(|sky| json!({
            "size": sky.size, "largest": sky.excess.largest, "clamped": sky.excess.count,
            "lost_light": sky.excess.lost,
        })),
        "specula": recipe,
    });
    Ok((serde_json::to_string_pretty(&bounds)? + "\n").into_bytes())
}
