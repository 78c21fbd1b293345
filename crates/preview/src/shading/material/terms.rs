//! What the formulas of materials share, in terms.wgsl, and the powers of cosines among it, for shaders of
//! other files and their twins.

use crate::shading::shader_constants::shader_constants;

shader_constants!("MATERIAL_":
    /// The square of a sine below which the logarithm of the cosine comes from a series.
    NEAR: f32 = 0.1;
    /// A number with a logarithm that is less than any cosine that matters.
    TINY: f32 = 1e-30;
);

/// The text of the shader: its constants and terms.wgsl.
pub(super) fn shader() -> String {
    [WGSL_CONSTANTS, include_str!("terms.wgsl")].concat()
}

/// cos^s, or 0 if the cosine is not above 0; `sin2` is the square of the sine.
pub(in crate::shading) fn power(cosine: f32, sin2: f32, s: f32) -> f32 {
    if cosine <= 0.0 {
        return 0.0;
    }
    let ln = if sin2 < NEAR { ln_cosine(sin2) } else { math::ln(cosine.max(TINY)) };
    bounded_exp(s * ln)
}

/// ln(sqrt(1 - x)) for |x| below [`NEAR`]: the series of ln(1 - x), whose next term is below 2e-8 of it.
fn ln_cosine(x: f32) -> f32 {
    let series = 1.0 / 6.0 + x * (1.0 / 7.0);
    let series = 0.25 + x * (0.2 + x * series);
    -0.5 * x * (1.0 + x * (0.5 + x * (1.0 / 3.0 + x * series)))
}

/// e^x, in the range of f32.
fn bounded_exp(x: f32) -> f32 {
    math::exp(x.clamp(-80.0, 80.0))
}
