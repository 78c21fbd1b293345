//! The figures of the section on degrees, which the page shows and the JSON file holds.

use serde::Serialize;

use crate::picture::report::errors::Errors;

/// The section's figures; empty without `sections = ["degrees"]`.
#[derive(Clone, Debug, Default, Serialize)]
pub(crate) struct DegreeFigures {
    /// The share of each material's energy that low degrees hold.
    pub(crate) materials: Vec<CapturedEnergy>,
    pub(crate) pairs: Vec<DegreePair>,
}

/// The degree F at which [`CapturedEnergy`] is, and the degrees P: those of [RH02, fig. 8].
pub(crate) const CAPTURED_F: usize = 30;
pub(crate) const CAPTURED_P: usize = 5;

/// The share of a material's energy that its degrees up to F = 30 and each P from 0 to 5 hold.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct CapturedEnergy {
    pub(crate) material: String,
    pub(crate) by_p: Vec<f64>,
}

/// What truncations of a material under an environment lose.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct DegreePair {
    pub(crate) environment: String,
    pub(crate) material: String,
    /// The number of lamps that the light is without, because they are beside the series.
    pub(crate) lamps: usize,
    /// The share of the material's energy that the paper's rule may lose.
    pub(crate) tolerance: f64,
    /// The highest degrees [F, P], with which a truncation in the other degree is made.
    pub(crate) highest: [usize; 2],
    /// Whether the reflection's degrees were chosen for this light; otherwise they were given.
    pub(crate) for_light: bool,
    /// The truncation at the reflection's own degrees.
    pub(crate) chosen: Truncation,
    /// The truncation at the degrees of the paper's rule; none if the highest degrees lose too much.
    pub(crate) rule: Option<Truncation>,
    /// Truncations at each F and the highest P.
    pub(crate) by_f: Vec<Truncation>,
    /// Truncations at each P and the highest F.
    pub(crate) by_p: Vec<Truncation>,
    /// Spheres of the reflection at some P up to its own.
    pub(crate) spheres: Vec<DegreeSphere>,
    /// Spheres under light that is blurred more and more.
    pub(crate) blurred: Vec<BlurredSphere>,
}

/// Shares of energy that a truncation to degrees (F, P) loses.
#[derive(Clone, Copy, Debug, Serialize)]
pub(crate) struct Truncation {
    pub(crate) f: usize,
    pub(crate) p: usize,
    /// The number of coefficients of a texel, (P + 1)^2.
    pub(crate) coefficients: usize,
    /// What the light alone loses.
    pub(crate) light: f64,
    /// What the material alone loses.
    pub(crate) material: f64,
    /// The lesser of both past F, and what the material loses past P.
    pub(crate) min: f64,
    /// The bound of appendix B as it is printed.
    pub(crate) printed: f64,
    /// The bound that holds.
    pub(crate) bound: f64,
    /// What the product of the coefficients loses.
    pub(crate) product: f64,
    /// What the reflection loses of brute force.
    pub(crate) truth: f64,
}

/// A sphere of a reflection that is cut at a degree P.
#[derive(Clone, Copy, Debug, Serialize)]
pub(crate) struct DegreeSphere {
    pub(crate) p: usize,
    /// The share of the material's energy that the degrees up to the highest F and this P hold.
    pub(crate) held: f64,
    #[serde(flatten)]
    pub(crate) errors: Errors,
}

/// The degrees of light that is blurred more and more by the window of Hanning.
pub(crate) const BLURS: [usize; 6] = [64, 32, 16, 8, 4, 2];

/// A sphere under blurred light.
#[derive(Clone, Copy, Debug, Serialize)]
pub(crate) struct BlurredSphere {
    /// The degree of the window.
    pub(crate) degree: usize,
    /// Whether the sphere looks like the one under the light itself: within the report's limits.
    pub(crate) alike: bool,
    #[serde(flatten)]
    pub(crate) errors: Errors,
}
