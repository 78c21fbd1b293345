//! Darkens single pixels that are far too bright.
//!
//! ```toml
//! [stage.clean]
//! kind = "clamp-fireflies"
//! input = "environment"
//! limit = 100.0
//! ```
//!
//! A path tracer leaves *fireflies*: pixels that hold the light of a whole lamp. One of them outshines the
//! sky in every coefficient. A pixel whose luminance is above `limit` is scaled down to it; its hue stays. A
//! note says how many there were.

use std::ops::Bound;

use engine::{Artifact, Context, Failure, Kind, Output, Port, Product, parameters};
use stages::artifacts::Environment;

parameters! {
    /// Parameters of `clamp-fireflies`.
    pub(crate) struct Parameters {
        /// The largest luminance that a pixel may have, in the environment's own unit.
        #[range((Bound::Excluded(0.0), Bound::Unbounded))]
        limit: f64,
    }
}

/// The kind `clamp-fireflies`.
pub(crate) struct ClampFireflies;

impl Kind for ClampFireflies {
    type Parameters = Parameters;

    const NAME: &'static str = "clamp-fireflies";
    const REVISION: u32 = 1;
    const TEXT: &'static str = include_str!("clamp_fireflies.rs");

    fn ports() -> Vec<Port> {
        vec![Port::one::<Environment>("environment")]
    }

    fn product(_: &Parameters, _: &[(&str, &'static str)]) -> Product {
        Product::Artifact(Environment::TYPE)
    }

    fn run(parameters: &Parameters, context: &Context<'_>) -> Result<Output, Failure> {
        let environment = &context.inputs.get::<Environment>("environment")?.0;
        let mut clamped = 0;
        let pixels = environment.pixels().iter().map(|pixel| {
            let scale = parameters.limit / luminance(*pixel);
            if !(0.0..1.0).contains(&scale) {
                return *pixel;
            }
            clamped += 1;
            pixel.map(|value| (f64::from(value) * scale) as f32)
        });
        let clean = envmap::Environment::new(environment.grid(), pixels.collect());
        if clamped > 0 {
            context.reporter.note(format!("{clamped} pixels were brighter than {}", parameters.limit));
        }
        Output::artifact(Environment(clean.ok_or_else(|| Failure::new("a pixel is not finite"))?))
    }
}

/// The luminance of a linear Rec. 709 colour.
fn luminance([red, green, blue]: [f32; 3]) -> f64 {
    0.2126 * f64::from(red) + 0.7152 * f64::from(green) + 0.0722 * f64::from(blue)
}
