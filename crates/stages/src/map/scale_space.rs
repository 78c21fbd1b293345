//! Blurs an environment by Gaussians of many widths: one small map that every material reads with a few
//! look-ups.
//!
//! ```toml
//! [stage.light]
//! kind = "scale-space"
//! input = "environment"
//! ```
//!
//! > M(d, s) = integral of L(w) g_s(angle(w, d)) dw
//!
//! g_s is a Gaussian with the standard deviation s, cut at 90 degrees and scaled to an integral of 1. A
//! material is a table of look-ups, or taps (`fit-taps`): for the angle between view and normal it says
//! where a pixel looks, how wide, and with which weight. For most materials six of them come within a tenth
//! of a stop of the integral over the whole environment. The scale space does not depend on materials: an
//! edit of the light rebuilds it and no tables, and an edit of a material leaves it alone. docs/taps.md
//! derives all this, with the errors of many materials.
//!
//! The levels have s = s_0 2^(k / 4) with s_0 = 2.4 / `resolution` radians, and `resolution` / 2^(k / 4,
//! rounded down) texels along the edge of a face, down to 2. Each is a convolution in spherical harmonics,
//! with one factor for each degree (Ramamoorthi and Hanrahan 2002, equation 5), so it contains all light,
//! however small its source. Four more maps have the light about a normal N, with kernels h_y(m) = m / (m
//! (1 - y) + y) of the cosine m from N. Materials whose reflection is cut off by the horizon of N read
//! these, and the last, y = 1, is the radiance of a white diffuse surface.
//!
//! ## Resolution
//!
//! | sharpest highlight | `resolution` |
//! | --- | --- |
//! | roughness 0.4 and more, sigma 0.15 and more | 32 |
//! | roughness 0.3 | 64 |
//! | roughness 0.2 | 128 |
//! | roughness 0.15 | 256 |
//!
//! A highlight that is narrower than the finest level looks as wide as that level.
//!
//! ## Lights
//!
//! The `lights` strongest suns and lamps are taken out of the levels and kept as lights, each a disk with a
//! direction and an irradiance. A renderer adds each with the material's own formula, which costs less than
//! two look-ups and is exact in the cases for which blurred lamps have the largest errors. All other light
//! stays in the levels, with its real shape, so nothing is lost with `lights = 0`.

use containers::tensors::EnvironmentScales;
use engine::{Artifact, Context, Failure, Kind, Output, Port, Product, parameters};
use taps::{LightPoints, Widths};

use super::compact::{RESOLUTION, scale_space_of};
use crate::engines::nearest_power_of_two;
use crate::values::{LIGHTS, LightCount, artifacts, quantity};

/// The range of the edge of the finest level.
const EDGES: std::ops::RangeInclusive<usize> = Widths::EDGES[0]..=Widths::EDGES[1];

parameters! {
    /// Parameters of `scale-space`.
    pub(crate) struct Parameters {
        /// Texels along the edge of a face of the finest level: a power of two.
        #[range(EDGES)]
        resolution: usize = RESOLUTION,
        /// How many of the strongest suns and lamps are kept as lights, or "all"; see Lights.
        lights: LightCount = LIGHTS,
    }
}

/// The kind `scale-space`.
pub(crate) struct ScaleSpaceOfLight;

impl Kind for ScaleSpaceOfLight {
    type Parameters = Parameters;

    const NAME: &'static str = "scale-space";
    const REVISION: u32 = 1;
    const KERNELS: &'static [u32] = &[
        taps::revisions::SCALE_SPACE,
        sh::revisions::TRANSFORM,
        envmap::revisions::LAMPS,
        envmap::revisions::WITHOUT_LIGHTS,
    ];
    const TEXT: &'static str = include_str!("scale_space.rs");

    fn ports() -> Vec<Port> {
        vec![Port::one::<artifacts::Environment>("environment")]
    }

    fn product(_: &Parameters, _: &[(&str, &'static str)]) -> Product {
        Product::Artifact(artifacts::ScaleSpace::TYPE)
    }

    fn check(parameters: &Parameters) -> Vec<(&'static str, String)> {
        let edge = parameters.resolution;
        let wrong = || {
            let nearest = nearest_power_of_two(edge);
            ("resolution", format!("expected a power of two; the nearest is {nearest}"))
        };
        Widths::new(edge).is_none().then(wrong).into_iter().collect()
    }

    fn run(parameters: &Parameters, context: &Context<'_>) -> Result<Output, Failure> {
        let reporter = &context.reporter;
        let environment = &context.inputs.get::<artifacts::Environment>("environment")?.0;
        let widths = Widths::new(parameters.resolution).ok_or_else(|| {
            Failure::new(format!("resolution {} is not a power of two", parameters.resolution))
        })?;
        let (space, found) = scale_space_of(environment, widths, parameters.lights, reporter)?;
        let kept = space.lights().len();
        let of = |count| quantity::count(count, "light");
        let (edge, levels) = (widths.edge(), widths.len());
        reporter.note(match found - kept {
            0 => format!("{levels} levels from {edge} x {edge} on; {} separate", of(kept)),
            baked => format!(
                "{levels} levels from {edge} x {edge} on; {} separate, {} in the levels",
                of(kept),
                of(baked)
            ),
        });
        let points = LightPoints::new(environment)?;
        Output::artifact(artifacts::ScaleSpace(EnvironmentScales { space, points }))
    }
}
