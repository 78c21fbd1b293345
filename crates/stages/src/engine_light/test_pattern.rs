//! Writes probes that show where an engine looks: which axis it sees, which level, and how bright.
//!
//! ```toml
//! [stage.pattern]
//! kind = "test-pattern"
//! preset = "filament"
//! path = "filament-pattern"
//! ```
//!
//! There are three patterns, each in the files of `export-engine` with the same `preset`:
//!
//! | name | its light |
//! | --- | --- |
//! | `pattern-orient` | L = 2 + 1.5 d: red is the x of the direction, green y, blue z, in the frame of files (+Y up, the centre of a lat-long image looks along +Z). The colour in a mirror shows the direction in which it looked |
//! | `pattern-axes` | the six axes as discs with their names, for viewing: +X red, -X cyan, +Y green, -Y magenta, +Z blue, -Z yellow; letters stand upright toward +Y, those of +Y and -Y toward +Z |
//! | `pattern-lod` | level of detail l has the value 1 + l everywhere, so the brightness of a surface is the level that the engine reads for its roughness, plus one; only for engines that load levels |
//!
//! `pattern-orient` is prefiltered exactly: a level has the value 2 + 1.5 k d, where k is the factor of
//! degree 1 of its lobe, and irradiance over pi is 2 + d. `specula test-pattern --preset NAME OUT` writes
//! the files without a manifest.
//!
//! ## Files
//!
//! The folder `path` contains the files of `export-engine` with these names instead of `environment`, and
//! `README.txt`.

use engine::{Context, Failure, Kind, Output, Port, Product, parameters};
use envmap::{CubeMap, Environment};
use preview::drawing::{Align, Canvas, Rect, Style, Weight};
use rayon::prelude::*;
use sh::{Degree, Expansion, Stop, Transform};
use shrm::{Distribution, MethodChoice, PrefilterKernel, prefilter};
use sphere::{Cube, DVec3, Direction, Face, LatLong, from_file, to_file};

use super::engine_files;
use super::engine_files::{EngineFiles, EngineTarget, report};
use crate::engines::{EngineFormat, EnginePreset};
use crate::values::{MAX_RESOLUTION, Overflow, UntilStopped};

const ORIENT: &str = "pattern-orient";
const AXES: &str = "pattern-axes";
const LOD: &str = "pattern-lod";

/// The number of texels along the edge of a face, or of rows of a lat-long image, if nothing says how many.
const DEFAULT_SIZE: usize = 64;

/// The number of rows of the painted axes.
const AXES_ROWS: usize = 512;

/// The radius of an axis' disc, and the half width of its text, as tangents.
const DISC: f64 = 0.45;
const TEXT: f64 = 0.3;

/// The mean of the pattern `orient`, which is 2 + 1.5 d.
const MEAN: f64 = 2.0;
const SLOPE: f64 = 1.5;

parameters! {
    /// Parameters of `test-pattern`.
    pub(crate) struct Parameters {
        /// The engine.
        preset: EnginePreset = EnginePreset::DEFAULT,
        /// How texels are stored. Default: the first of the preset's formats.
        format: Option<EngineFormat> = None,
        /// Texels along the edge of a face, or rows of a lat-long image.
        #[range(1..=MAX_RESOLUTION)]
        resolution: usize = DEFAULT_SIZE,
    }
}

impl Parameters {
    fn target(&self) -> EngineTarget {
        let format = self.format.unwrap_or_else(|| self.preset.formats()[0]);
        EngineTarget { preset: self.preset, format }
    }

    fn patterns(&self) -> &'static [&'static str] {
        if self.preset.loads_cube() { &[ORIENT, AXES, LOD] } else { &[ORIENT, AXES] }
    }
}

/// The kind `test-pattern`.
pub(crate) struct TestPattern;

impl Kind for TestPattern {
    type Parameters = Parameters;

    const NAME: &'static str = "test-pattern";
    const REVISION: u32 = 5;
    const KERNELS: &'static [u32] =
        &[shrm::revisions::PREFILTER, sh::revisions::TRANSFORM, envmap::revisions::CUBE_MAP];
    const TEXT: &'static str = include_str!("test_pattern.rs");

    fn ports() -> Vec<Port> {
        Vec::new()
    }

    fn product(parameters: &Parameters, _: &[(&str, &'static str)]) -> Product {
        let EngineTarget { preset, format } = parameters.target();
        let files = parameters.patterns().iter().flat_map(|stem| preset.names(format, stem));
        Product::Files(files.chain(["/README.txt".into()]).collect())
    }

    fn check(parameters: &Parameters) -> Vec<(&'static str, String)> {
        let preset = parameters.preset;
        let size = Some(parameters.resolution).filter(|_| preset.loads_cube());
        let size = size.and_then(|size| preset.roughness(size).err()).map(|error| ("resolution", error));
        preset.check_format(parameters.format).into_iter().chain(size).collect()
    }

    fn run(parameters: &Parameters, context: &Context<'_>) -> Result<Output, Failure> {
        let target = parameters.target();
        let mut files = Vec::new();
        for &pattern in parameters.patterns() {
            context.reporter.check_cancelled()?;
            let made = if target.preset.loads_cube() {
                levels(target, pattern, parameters.resolution, context)?
            } else {
                lat_long(target, pattern, parameters.resolution, context.recipe())?
            };
            report(&made, target, Overflow::Clamp, &context.reporter)?;
            files.extend(made.files);
        }
        let text = format!(
            "Test patterns of Specula. A colour of {ORIENT} is the direction that it lies in: 2 + 1.5 d.\n\n{}",
            target.preset.readme(target.format, ORIENT)
        );
        files.push(text.into_bytes());
        Ok(Output::files(files))
    }
}

/// A pattern for an engine that loads levels.
fn levels(
    target: EngineTarget,
    pattern: &str,
    edge: usize,
    context: &Context<'_>,
) -> Result<EngineFiles, Failure> {
    let roughness = target.preset.roughness(edge).map_err(Failure::new)?;
    let (maps, light) = match pattern {
        ORIENT => {
            let maps = roughness.iter().enumerate().map(|(level, &r)| {
                let factor = match r {
                    0.0 => 1.0,
                    _ => {
                        PrefilterKernel::new(Distribution::Ggx, r).map_or(0.0, |kernel| kernel.factors(1)[1])
                    }
                };
                orient(Cube { edge: edge >> level }, factor)
            });
            (maps.collect::<Option<Vec<_>>>(), orient_light()?)
        }
        AXES => {
            let environment = axes()?;
            let auto = MethodChoice::Auto;
            let made = context.reporter.until_stopped(|stop| {
                let made = prefilter(&environment, None, Distribution::Ggx, &roughness, edge, auto, stop);
                made.map_err(|error| Failure::new(error.to_string()))
            })?;
            (Some(made.levels.into_iter().map(|level| level.map).collect()), made.series)
        }
        _ => {
            let level = |level: usize| {
                let cube = Cube { edge: edge >> level };
                CubeMap::new(cube, vec![[1.0 + level as f32; 3]; cube.len()])
            };
            (roughness.iter().enumerate().map(|(l, _)| level(l)).collect(), constant(roughness.len() as f64)?)
        }
    };
    let maps = maps.ok_or_else(|| Failure::new("a cube without texels"))?;
    let irradiance = light.to_degree(Degree::new(2)?);
    let maps: Vec<_> = maps.iter().collect();
    engine_files::of_levels(target, &maps, &light, &irradiance, Some(context.recipe()))
}

/// A pattern for an engine that loads a lat-long image.
fn lat_long(target: EngineTarget, pattern: &str, rows: usize, recipe: &str) -> Result<EngineFiles, Failure> {
    let (environment, light) = match pattern {
        ORIENT => (painted(rows, |d| direction_colour(d, 1.0))?, orient_light()?),
        _ => {
            let environment = axes()?;
            let light = Transform::new(environment.grid(), Degree::new(2)?)?.analyse(environment.pixels());
            (environment, light)
        }
    };
    engine_files::of_lat_long(target, &environment, &light, Some(recipe), Stop::NEVER)
}

/// 2 + 1.5 k d of a direction in the frame of files.
fn direction_colour(d: DVec3, factor: f64) -> [f32; 3] {
    d.to_array().map(|value| (MEAN + SLOPE * factor * value) as f32)
}

fn orient(cube: Cube, factor: f64) -> Option<CubeMap> {
    let edge = cube.edge;
    let texel = |index: usize| {
        let (face, row, column) = (index / (edge * edge), index / edge % edge, index % edge);
        direction_colour(to_file(cube.direction(Face::ALL[face], row, column).vector()), factor)
    };
    CubeMap::new(cube, (0..cube.len()).map(texel).collect())
}

/// The series of 2 + 1.5 d.
fn orient_light() -> Result<Expansion, Failure> {
    let mut light = constant(MEAN)?;
    // Y_1m is sqrt(3 / (4 pi)) times y, z, x of our frame.
    let coefficient = SLOPE * (4.0 * std::f64::consts::PI / 3.0).sqrt();
    for (row, axis) in [DVec3::Y, DVec3::Z, DVec3::X].into_iter().enumerate() {
        light.coefficients_mut()[row + 1] = to_file(axis).to_array().map(|value| coefficient * value);
    }
    Ok(light)
}

/// The series of degree 2 of a constant.
fn constant(value: f64) -> Result<Expansion, Failure> {
    let mut light = Expansion::zero(Degree::new(2)?);
    light.coefficients_mut()[0] = [value * (4.0 * std::f64::consts::PI).sqrt(); 3];
    Ok(light)
}

/// A lat-long image of a function of the direction in the frame of files.
fn painted(rows: usize, colour: impl Fn(DVec3) -> [f32; 3] + Sync) -> Result<Environment, Failure> {
    let grid = LatLong::with_rows(rows);
    let pixel = |index: usize| {
        let direction = grid.direction(index / grid.width, index % grid.width);
        colour(to_file(direction.vector()))
    };
    let pixels = (0..grid.width * grid.height).into_par_iter().map(pixel).collect();
    Environment::new(grid, pixels).ok_or_else(|| Failure::new("an environment without pixels"))
}

/// An axis with its name and its colour.
struct Axis {
    direction: DVec3,
    /// The direction in which the top of the axis' name points.
    up: DVec3,
    colour: [f32; 3],
    name: Canvas,
}

/// The six axes.
fn axes() -> Result<Environment, Failure> {
    let axis = |name: &str, direction: DVec3, up: DVec3, colour: [f32; 3]| {
        let mut canvas = Canvas::new(128, 128, [0; 3]);
        let style = Style { weight: Weight::SemiBold, size: 80.0, colour: [255; 3] };
        style.draw(&mut canvas, Rect { x: 0, y: 0, width: 128, height: 128 }, Align::Centre, name);
        Axis { direction, up, colour, name: canvas }
    };
    let (dim, full) = (0.02, 1.0);
    let axes = [
        axis("+X", DVec3::X, DVec3::Y, [full, dim, dim]),
        axis("-X", DVec3::NEG_X, DVec3::Y, [dim, full, full]),
        axis("+Y", DVec3::Y, DVec3::Z, [dim, full, dim]),
        axis("-Y", DVec3::NEG_Y, DVec3::Z, [full, dim, full]),
        axis("+Z", DVec3::Z, DVec3::Y, [dim, dim, full]),
        axis("-Z", DVec3::NEG_Z, DVec3::Y, [full, full, dim]),
    ];
    painted(AXES_ROWS, |d| axes.iter().find_map(|axis| axis.colour_at(d)).unwrap_or_else(|| background(d)))
}

impl Axis {
    /// The colour of the axis' disc and name; `None` outside of the disc.
    fn colour_at(&self, d: DVec3) -> Option<[f32; 3]> {
        let ahead = self.direction.dot(d);
        // Seen from within, right is forward times up.
        let right = self.direction.cross(self.up);
        let (x, y) = (right.dot(d) / ahead, self.up.dot(d) / ahead);
        if ahead <= 0.0 || math::hypot(x, y) > DISC {
            return None;
        }
        let size = self.name.width() as f64;
        let place = |share: f64| (0.0..1.0).contains(&share).then_some((share * size) as usize);
        let (column, row) = (place(0.5 + 0.5 * x / TEXT), place(0.5 - 0.5 * y / TEXT));
        let ink = column.zip(row).map_or(0.0, |(column, row)| {
            f32::from(self.name.pixels()[row * self.name.width() + column][0]) / 255.0
        });
        Some(self.colour.map(|value| value + ink * (2.0 - value)))
    }
}

/// Grey with a line each 15 degrees of longitude and latitude, lighter above the horizon.
fn background(d: DVec3) -> [f32; 3] {
    let direction = Direction::normalised(from_file(d));
    let near = |angle: f64| {
        let steps = angle.to_degrees() / 15.0;
        (steps - steps.round()).abs() * 15.0
    };
    let latitude = near(direction.theta());
    let longitude = near(direction.phi()) * math::sin(direction.theta());
    let base = if d.y > 0.0 { 0.25 } else { 0.1 };
    [if latitude.min(longitude) < 0.5 { 0.6 } else { base }; 3]
}
