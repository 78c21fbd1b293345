//! Makes a light rig: a few lights that replace an environment, a lighting or a reflection.
//!
//! ```toml
//! [stage.rig]
//! kind = "sample-light"
//! input = "environment"
//! count = 16
//! ```
//!
//! The light is divided into regions, and each region becomes a disk with the light of the region, in the
//! direction of its centroid, and as wide as the light is spread. All disks together have the whole light,
//! in each colour. So a renderer that supports shadows for some lights, but no environments, can show it.
//!
//! | `method` | regions |
//! | --- | --- |
//! | `median-cut` | rectangles: the one with the most light is cut into two halves of equal light, across its longer side, until there are enough (Debevec 2005) |
//! | `warped` | the directions that are nearest to each point of a set, whose density follows the light |
//!
//! Median cuts are even: all lights are about equally strong, and there are as many as you ask for. Warped
//! points follow soft light a little better; several points in one small sun become one light. The report's
//! section `rigs` shows how many lights your materials need; docs/sampling.md is about sampling in general.
//!
//! ## What is sampled
//!
//! An environment is sampled by its texels. A lighting is sampled by the exact integrals of its series; its
//! separate lights become part of the rig. A reflection is sampled like the map that
//! `export-reflection-map` would write, with all lamps in the series: the radiance for each central
//! direction, as the mean over all views or, with `view = "head-on"`, as seen straight on. Directions where
//! a series is negative get no light; the positive part is scaled down so that the total stays the same.
//!
//! ## The number of lights
//!
//! `count = "auto"` tries 1, 2, 4 ... 1024 lights, and takes the first number whose irradiance error is
//! within `tolerance`: the root mean square error over 128 normals all around, as a share of the mean
//! irradiance. This treats the lights as points. A note reports the errors. If fewer than `count` texels
//! are lit, there are fewer lights, with a warning.
//!
//! ## The result
//!
//! The result is a lighting with an empty series and the disks as lights, as `circular-lights` makes them.
//! Every kind that takes a lighting takes it, `export-light-rig` writes it for other programs, and
//! `subtract-lights` takes the lights out of their environment.
//!
//! A disk whose irradiance is E and whose angular radius is a has the light (flux) 2 E / (1 + cos(a)).
//! Every surface that sees a whole region gets exactly the irradiance of the region.

use std::num::NonZeroU32;

use engine::{Artifact, Context, Failure, Inputs, Kind, OrAuto, Output, Port, Product, choice, parameters};
use sampling::{Error, Irradiance, LightMasses, Method, Rig, rig, rig_within};
use sh::{Degree, Expansion, Lighting};
use shrm::Plain;

use crate::values::{PlainName, SHARE, artifacts, percent, quantity, report_loss};

choice! {
    /// How light is divided into regions.
    pub(crate) enum RigMethodName: Method {
        /// Rectangles of equal light.
        MedianCut = "median-cut",
        /// What is nearest to each of a set of points.
        Warped = "warped",
    }
}

/// The most lights of a rig.
const MAX_LIGHTS: usize = 4096;

/// The most lights that `count = "auto"` tries.
const MOST_TRIED: u32 = 1024;

/// The tolerance of `count = "auto"`.
const TOLERANCE: f64 = 0.01;

parameters! {
    /// Parameters of `sample-light`.
    pub(crate) struct Parameters {
        /// How light is divided into regions; see the table.
        method: RigMethodName = RigMethodName(Method::MedianCut),
        /// The number of lights, or "auto": as few as meet `tolerance`.
        #[range(1..=MAX_LIGHTS)]
        count: OrAuto<usize> = OrAuto::Fixed(64),
        /// With count "auto": the error of the irradiance, as a share of its mean. Default: 0.01.
        #[range(SHARE)]
        tolerance: Option<f64> = None,
        /// For a reflection that changes with the view: the mean over all views, or the surface viewed
        /// straight on.
        view: PlainName = PlainName(Plain::Mean),
    }
}

/// The kind `sample-light`.
pub(crate) struct SampleLight;

impl Kind for SampleLight {
    type Parameters = Parameters;

    const NAME: &'static str = "sample-light";
    const REVISION: u32 = 1;
    const KERNELS: &'static [u32] = &[sampling::revisions::RIG];
    const TEXT: &'static str = include_str!("sample_light.rs");

    fn ports() -> Vec<Port> {
        vec![
            Port::one::<artifacts::Environment>("light")
                .or::<artifacts::Lighting>()
                .or::<artifacts::Reflection>(),
        ]
    }

    fn product(_: &Parameters, _: &[(&str, &'static str)]) -> Product {
        Product::Artifact(artifacts::Lighting::TYPE)
    }

    fn check(parameters: &Parameters) -> Vec<(&'static str, String)> {
        if parameters.tolerance.is_some() && parameters.count != OrAuto::Auto {
            return vec![("tolerance", "only count = \"auto\" uses it".into())];
        }
        Vec::new()
    }

    fn run(parameters: &Parameters, context: &Context<'_>) -> Result<Output, Failure> {
        let reporter = &context.reporter;
        let masses = masses(parameters, &context.inputs)?;
        if masses.negative_share() > 0.0 {
            let help = "set non-negative = \"nearest\" in project-sh, or connect the environment itself";
            report_loss(reporter, masses.negative_share(), "the series is negative, and left out", help);
        }
        reporter.check_cancelled()?;
        let RigMethodName(method) = parameters.method;
        let lights = match parameters.count {
            OrAuto::Fixed(count) => {
                let lights = rig(&masses, number(count), method);
                if lights.len() < count {
                    let (found, why) = (lights.len(), why(method));
                    reporter.warn(format!("{found} lights instead of {count}: {why}"));
                }
                let error = Irradiance::of(&masses).error(&lights);
                reporter.note(format!(
                    "{}: irradiance to {}",
                    quantity::count(lights.len(), "light"),
                    percent(error)
                ));
                lights
            }
            OrAuto::Auto => {
                let tolerance = parameters.tolerance.unwrap_or(TOLERANCE);
                let most = number(MOST_TRIED as usize);
                let Rig { lights, error, tried } = rig_within(&masses, tolerance, most, method);
                let tried = tried.iter().map(|(count, error)| format!("{count}: {}", percent(*error)));
                let tried = tried.collect::<Vec<_>>().join(", ");
                reporter.note(format!(
                    "{}: error of the irradiance {tried}",
                    quantity::count(lights.len(), "light")
                ));
                if error > tolerance {
                    let (most, error) = (MOST_TRIED, percent(error));
                    reporter.warn(format!(
                        "{most} lights are too few for tolerance {tolerance}: the error on surfaces is up to \
                         {error}; raise `tolerance` to that, or set a larger `count`"
                    ));
                }
                lights
            }
        };
        let series = Expansion::zero(Degree::ZERO);
        Output::artifact(artifacts::Lighting(Lighting { series, lights }))
    }
}

/// The light that is connected.
fn masses(parameters: &Parameters, inputs: &Inputs) -> Result<LightMasses, Failure> {
    let masses = match inputs.type_at("light") {
        Some(artifacts::Environment::TYPE) => {
            LightMasses::of_environment(&inputs.get::<artifacts::Environment>("light")?.0)
        }
        Some(artifacts::Reflection::TYPE) => {
            let reflection = inputs.get::<artifacts::Reflection>("light")?;
            LightMasses::of_lighting(&reflection.0.with_whole_light().plain(parameters.view.0).into())
        }
        _ => LightMasses::of_lighting(&inputs.get::<artifacts::Lighting>("light")?.0),
    };
    masses.map_err(|error| {
        let failure = Failure::from(error);
        match error {
            Error::NoMass => failure.help("connect light that is not black"),
            Error::NotFinite { .. } | Error::LightNotFinite { .. } | Error::TexelNotFinite { .. } => failure,
        }
    })
}

/// A number of lights, of the range of `count`.
fn number(count: usize) -> NonZeroU32 {
    u32::try_from(count).ok().and_then(NonZeroU32::new).unwrap_or(NonZeroU32::MIN)
}

fn why(method: Method) -> &'static str {
    match method {
        Method::MedianCut => "no other texels are lit",
        Method::Warped => "several points lie in one texel",
    }
}
