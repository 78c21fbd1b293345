//! Prefilters an environment for a list of roughnesses: the cube with levels that an engine reflects.
//!
//! ```toml
//! [stage.prefiltered]
//! kind = "prefilter"
//! input = "environment"
//! preset = "filament"
//! resolution = 256
//! ```
//!
//! For the direction of reflection, an engine looks up the mean of the light over a lobe that is wider for
//! rougher surfaces. Each level of the cube holds that mean for one roughness r, with a = r^2, if view,
//! normal and reflection vector are the same (N):
//!
//! > F(N) = integral of L(w) K(N.w) dw / integral of K(N.w) dw
//!
//! | `distribution` | K(mu), mu = N.w > 0 |
//! | --- | --- |
//! | `ggx` | mu / (1 + a^2 - (1 - a^2) mu)^2: the GGX lobe that all engines of `preset` prefilter with |
//! | `charlie` | mu ((1 - mu) / 2)^(1 / (2 a)): sheen |
//! | `lambert` | mu: irradiance over pi, in every level |
//!
//! At roughness 1 GGX is irradiance over pi. Roughness 0 is a mirror: the environment, averaged over each
//! texel. Level l has `resolution` / 2^l texels along the edge of a face.
//!
//! ## Levels
//!
//! `preset` sets the roughness that an engine expects in each level, and the size of the last:
//!
//! | `preset` | level l of 0 to n | last level |
//! | --- | --- | --- |
//! {rows: levels of engines}
//!
//! The other presets of `export-engine` are engines that filter a lat-long image themselves. For your own
//! engine, set `roughness = [0.0, 0.25, 0.5, 1.0]`, and write the cube with `export-environment` as a KTX2
//! or DDS texture with these levels. Do the same for cubes of `charlie` and `lambert`, which no preset
//! loads.
//!
//! ## Methods
//!
//! A prefilter multiplies each degree l of the light's spherical harmonics by a number (Ramamoorthi and
//! Hanrahan 2002), so a level is exact up to the degree that its lobe needs: 5 / a for GGX, and 74 from
//! roughness 0.7 on. With `method = "auto"` a level is made in this way if the light has that degree (the
//! environment's width minus one, or the degree of `lighting`, which is optional), and otherwise by
//! quadrature over the environment's texels: those near the lobe one by one, those far from it in blocks.
//! Neither has sampling noise: a sun of three texels keeps its energy. The build notes the method, the
//! degree and the estimated error of each level, and how many negative values became 0.

use engine::{Artifact, Context, Failure, Kind, Output, Port, Product, choice, parameters};
use shrm::{Distribution, LevelMethod, MethodChoice, PrefilterError, PrefilteredLevel, prefilter};

use crate::engines::{self, EnginePreset, nearest_power_of_two};
use crate::values::{DistributionName, MAX_RESOLUTION, UntilStopped, artifacts, percent};

choice! {
    /// How levels are made.
    pub(crate) enum PrefilterMethodName: MethodChoice {
        /// In spherical harmonics if the light holds the degree, otherwise by quadrature.
        Auto = "auto",
        /// In spherical harmonics, or the item fails.
        Series = "sh",
        /// By quadrature over the environment's texels.
        Quadrature = "quadrature",
    }
}

parameters! {
    /// Parameters of `prefilter`.
    pub(crate) struct Parameters {
        /// The lobe; see the table.
        distribution: DistributionName = DistributionName(Distribution::Ggx),
        /// The engine whose levels are made; see Levels. Default: "three", unless there is a `roughness`.
        preset: Option<EnginePreset> = None,
        /// The roughness of each level, from 0 to 1, instead of a preset.
        roughness: Option<Vec<f64>> = None,
        /// Texels along the edge of a face of level 0: a power of two.
        #[range(1..=MAX_RESOLUTION)]
        resolution: usize = 256,
        /// How levels are made; see Methods.
        method: PrefilterMethodName = PrefilterMethodName(MethodChoice::Auto),
    }
}

impl Parameters {
    /// The roughness of each level, or the name of a parameter and what is wrong with it.
    fn levels(&self) -> Result<Vec<f64>, (&'static str, String)> {
        let Self { preset, roughness, resolution, .. } = self;
        match (preset, roughness) {
            (Some(preset), Some(roughness)) => Err(("roughness", both(*preset, roughness, *resolution))),
            (preset, None) => {
                let preset = preset.unwrap_or(EnginePreset::DEFAULT);
                preset
                    .roughness(*resolution)
                    .map_err(|error| (if preset.loads_cube() { "resolution" } else { "preset" }, error))
            }
            (None, Some(roughness)) => {
                if let Some(wrong) = roughness.iter().find(|value| !(0.0..=1.0).contains(*value)) {
                    return Err(("roughness", format!("{wrong} is not from 0 to 1")));
                }
                if roughness.is_empty() {
                    return Err(("roughness", "expected a number for each level, at least one".into()));
                }
                if !resolution.is_power_of_two() {
                    let nearest = nearest_power_of_two(*resolution);
                    let text =
                        format!("levels halve a power of two; the nearest size that fits is {nearest}");
                    return Err(("resolution", text));
                }
                let most = resolution.ilog2() as usize + 1;
                if roughness.len() > most {
                    let text =
                        format!("{} levels, but {resolution} texels halve to 1 in {most}", roughness.len());
                    let needed = roughness.len() - 1;
                    return Err((
                        "roughness",
                        match 1_usize.checked_shl(needed as u32) {
                            Some(size) if size <= MAX_RESOLUTION => {
                                format!("{text}; the nearest resolution that fits is {size}")
                            }
                            _ => text,
                        },
                    ));
                }
                Ok(roughness.clone())
            }
        }
    }
}

/// The kind `prefilter`.
pub(crate) struct Prefilter;

impl Kind for Prefilter {
    type Parameters = Parameters;

    const NAME: &'static str = "prefilter";
    const REVISION: u32 = 1;
    const KERNELS: &'static [u32] =
        &[shrm::revisions::PREFILTER, sh::revisions::TRANSFORM, envmap::revisions::CUBE_MAP];
    const TEXT: &'static str = include_str!("prefilter.rs");
    const SLOW: bool = true;

    fn manual(text: String) -> String {
        engines::fill_in(&text)
    }

    fn ports() -> Vec<Port> {
        vec![
            Port::one::<artifacts::Environment>("environment"),
            Port::one::<artifacts::Lighting>("lighting").optional(),
        ]
    }

    fn product(_: &Parameters, _: &[(&str, &'static str)]) -> Product {
        Product::Artifact(artifacts::Prefiltered::TYPE)
    }

    fn check(parameters: &Parameters) -> Vec<(&'static str, String)> {
        parameters.levels().err().into_iter().collect()
    }

    fn run(parameters: &Parameters, context: &Context<'_>) -> Result<Output, Failure> {
        let reporter = &context.reporter;
        let roughness =
            parameters.levels().map_err(|(name, error)| Failure::new(format!("{name}: {error}")))?;
        let environment = context.inputs.get::<artifacts::Environment>("environment")?;
        let lighting = context.inputs.optional::<artifacts::Lighting>("lighting")?;
        let lighting = lighting.as_deref().map(|lighting| &lighting.0);
        let (distribution, method) = (parameters.distribution.0, parameters.method.0);
        let prefiltered = reporter.until_stopped(|stop| {
            let (environment, edge) = (&environment.0, parameters.resolution);
            prefilter(environment, lighting, distribution, &roughness, edge, method, stop).map_err(failure)
        })?;
        for (l, level) in prefiltered.levels.iter().enumerate() {
            reporter.note(level_note(l, level));
        }
        let sharp = |level: &&PrefilteredLevel| level.method == LevelMethod::Quadrature;
        let by_quadrature = prefiltered.levels.iter().filter(sharp).count();
        let is_auto = parameters.method.0 == MethodChoice::Auto;
        if let (Some(lighting), true, 1..) = (lighting, is_auto, by_quadrature) {
            reporter.note(format!(
                "the lighting holds degree {}: {by_quadrature} of {} levels need more and are made by quadrature",
                lighting.series.degree().get(),
                prefiltered.levels.len()
            ));
        }
        Output::artifact(artifacts::Prefiltered(prefiltered))
    }
}

/// Says what is wrong with a list of roughnesses beside a preset.
fn both(preset: EnginePreset, roughness: &[f64], resolution: usize) -> String {
    match (preset.roughness(resolution), preset.size_with(roughness.len())) {
        (Ok(levels), Some(size)) if levels.len() != roughness.len() => format!(
            "a list of length {}, but {} reads {} levels of a cube of {resolution}; the nearest resolution \
             that fits is {size}, or leave out `roughness`, because the preset sets the levels",
            roughness.len(),
            preset.name,
            levels.len()
        ),
        _ => "the preset already sets the levels".into(),
    }
}

/// The note of the build about a level.
fn level_note(l: usize, level: &PrefilteredLevel) -> String {
    let method = match level.method {
        LevelMethod::Resampled => "the environment, averaged over each texel".to_owned(),
        LevelMethod::Series { degree } => format!("spherical harmonics to degree {degree}"),
        LevelMethod::Quadrature => "quadrature".to_owned(),
    };
    let edge = level.map.cube().edge;
    let mut text = format!("level {l}, {edge} x {edge}, roughness {:.3}: {method}", level.roughness);
    if let Some(error) = level.error {
        text += &format!(", estimated error {} of its largest value", percent(error));
    }
    if level.negative > 0 {
        text += &format!("; {} negative values became 0", level.negative);
    }
    text
}

/// Says what can be done about an error.
fn failure(error: PrefilterError) -> Failure {
    let help = match error {
        PrefilterError::DegreeTooLow { .. } => {
            Some("use method = \"auto\", a larger environment, or a lighting of that degree")
        }
        _ => None,
    };
    let failure = Failure::new(error.to_string());
    match help {
        Some(help) => failure.help(help),
        None => failure,
    }
}
