//! Reflects a lighting off a material: the reflected light field in spherical harmonics.
//!
//! For a radially symmetric material (P = 0) this is the convolution of Ramamoorthi and Hanrahan (2002):
//!
//! > B_lm = Lambda_l rho_l L_lm, with Lambda_l = sqrt(4 pi / (2 l + 1))
//!
//! and in general B_lmpq = L_lm rho_lpq (equation 7). Both are cut to the smaller of their degrees: light that the
//! material blurs away, or detail that the lighting does not hold, costs nothing.
//!
//! ## Example
//!
//! ```toml
//! [stage.reflection]
//! kind = "convolve"
//! inputs = { lighting = "lighting", brdf = "coefficients" }
//! ```

use engine::{Artifact, Context, Failure, Kind, Output, Port, Product, parameters};
use shrm::Reflection;

use crate::artifacts;

parameters! {
    /// `convolve` has no parameters.
    pub(crate) struct Parameters {}
}

/// The kind `convolve`.
pub(crate) struct Convolve;

impl Kind for Convolve {
    type Parameters = Parameters;

    const NAME: &'static str = "convolve";
    const REVISION: u32 = 1;
    const TEXT: &'static str = include_str!("convolve.rs");

    fn ports() -> Vec<Port> {
        vec![Port::one::<artifacts::Lighting>("lighting"), Port::one::<artifacts::Brdf>("brdf")]
    }

    fn product(_: &Parameters, _: &[(&'static str, &'static str)]) -> Product {
        Product::Artifact(artifacts::Reflection::TYPE)
    }

    fn run(_: &Parameters, context: &Context<'_>) -> Result<Output, Failure> {
        let lighting = context.get::<artifacts::Lighting>("lighting")?;
        let brdf = context.get::<artifacts::Brdf>("brdf")?;
        let reflection = Reflection::convolve(&lighting.0, &brdf.0);
        Output::artifact(artifacts::Reflection(reflection))
    }
}
