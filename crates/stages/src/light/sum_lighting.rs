//! Adds the light of two lightings: lamps to a sky, a sun to a studio.
//!
//! ```toml
//! [stage.light]
//! kind = "sum-lighting"
//! inputs = { lighting = "sky", added = "lamps" }
//! ```
//!
//! The sum has the series of both, up to the higher of the two degrees, and the separate lights of both.
//! Adding a series of a high degree does not make one of a low degree sharper. To add more than two, chain
//! several stages.

use engine::{Artifact, Context, Failure, Kind, Output, Port, Product, parameters};

use crate::values::artifacts;

parameters! {
    /// `sum-lighting` has no parameters.
    pub(crate) struct Parameters {}
}

/// The kind `sum-lighting`.
pub(crate) struct SumLighting;

impl Kind for SumLighting {
    type Parameters = Parameters;

    const NAME: &'static str = "sum-lighting";
    const REVISION: u32 = 1;
    const TEXT: &'static str = include_str!("sum_lighting.rs");

    fn ports() -> Vec<Port> {
        vec![Port::one::<artifacts::Lighting>("lighting"), Port::one::<artifacts::Lighting>("added")]
    }

    fn product(_: &Parameters, _: &[(&str, &'static str)]) -> Product {
        Product::Artifact(artifacts::Lighting::TYPE)
    }

    fn run(_: &Parameters, context: &Context<'_>) -> Result<Output, Failure> {
        let lighting = &context.inputs.get::<artifacts::Lighting>("lighting")?.0;
        let added = &context.inputs.get::<artifacts::Lighting>("added")?.0;
        let sum = lighting + added;
        let degrees = [lighting, added].map(|light| light.series.degree().get());
        if degrees[0] != degrees[1] {
            let [a, b] = degrees;
            context.reporter.note(format!("degrees {a} and {b}: the sum has degree {}", a.max(b)));
        }
        Output::artifact(artifacts::Lighting(sum))
    }
}
