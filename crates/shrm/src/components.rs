//! Reflected light as a sum of principal components: the form that Ramamoorthi and Hanrahan name as future
//! work [RH02, sec. 8].
//!
//! > B(C, V) ~ sum over k < K of U_k(C) w_k(x, y)
//!
//! C is the material's central direction, the reflection vector R or the normal N. (x, y) is the place on a
//! disc of the other direction that the surface has, N if C is R and the view V if C is N, in a frame about
//! C: its radius is sqrt(1 - cos(theta_v)), theta_v being the angle between N and V, so that the rim is the
//! horizon. The functions w_k belong to the material ([`ComponentBasis`]). U_k belongs to the light, too: it
//! is an image on a cube.
//!
//! *Frames.* A spherical harmonic reflection map has frames that spin around the poles, so that hardware must
//! not filter it. Here each cube face has the frames that the minimal rotations from its centre make of its
//! axes ([`face_frame`]). They are smooth on the face and a texel beyond it, and each face has a border of
//! one texel, which is computed in the face's own frames: bilinear look-ups within a face are right, without
//! poles and seams.
//!
//! *Fit.* For each texel and channel, U_k minimises the sum over views v of
//!
//! > s_v ((sum over k of U_k w_k(v) - B_v) / (B_v + e))^2,
//!
//! a relative error; s_v is the share of a ball's image that the view has, e is black ([`crate::stops`]). B_v
//! comes from the lighting's series and the harmonics of the material toward each view, which are integrated
//! from its formula: no degree P cuts them. The views are 16 radii in 36 azimuths.
//!
//! *Accuracy.* A low rank does not follow a narrow highlight under contrasty light: 24 components of rough
//! copper (GGX 0.3) in a photographer's studio, lamps apart, are off by a tenth of a stop in one view of 20.
//! `tests/components` compares with brute force.

mod basis;
mod chart;
mod eigen;
mod field;
mod lobes;
mod map;
mod measure;
mod options;
mod packed;
mod solve;

use brdf::Centre;
use sh::Stop;

use crate::Reflection;
pub use basis::{Component, ComponentBasis, MAX_COMPONENTS, RADII};
pub use chart::{face_axes, face_frame};
pub use map::ComponentMap;
pub use options::{ComponentCount, ComponentError, ComponentOptions, FULL_SIZE_COMPONENTS};
pub use packed::PackedComponents;

/// Raised when the results of this kernel change: every kind of stage that calls it adds this to its own
/// revision.
pub const REVISION: u32 = 1;

/// A fitted map and its error.
#[derive(Clone, Debug, PartialEq)]
pub struct FittedComponents {
    /// The map.
    pub map: ComponentMap,
    /// The stops that bilinear look-ups of 95 and of 99 of 100 views stay within, lights included.
    pub error: [f64; 2],
    /// These errors, about, for each number of components that was tried.
    pub by_count: Vec<(usize, [f64; 2])>,
}

/// Fits components to a reflection. `basis` is [`ComponentBasis::of`] its material: one serves all lights.
///
/// The lighting's series is used up to the reflection's degree F; its degree P is not used. `stop` is asked
/// before each row of texels and each sample of the error. The result does not depend on the number of
/// threads.
///
/// # Errors
/// If the material is not known or is about the tangent, has a value that is not finite, or the fit was
/// stopped.
///
/// # Example: a matte surface has one component
/// ```
/// use brdf::{Choice, Lambert, Material, project};
/// use sh::{Degree, Expansion, Stop};
/// use shrm::components::{ComponentBasis, ComponentCount, ComponentOptions, fit};
/// use sphere::Direction;
/// let sky = Expansion::from_coefficients(Degree::ZERO, vec![[1.0; 3]]).unwrap();
/// let chalk = Material::Lambert(Lambert::new([0.5; 3])?);
/// let degrees = Choice::Degree { f: Degree::ZERO, p: Degree::ZERO };
/// let brdf = project(&chalk, degrees, Stop::NEVER)?.coefficients;
/// let lamps = shrm::Lamps { lights: Vec::new(), material: chalk.clone() };
/// let field = shrm::Reflection::convolve(&sky, &brdf).with_lamps(lamps);
/// let count = ComponentCount::Accept([0.15, 0.4]);
/// let options = ComponentOptions { edge: 4, count, half: false, bake: false };
/// let fitted = fit(&field, &ComponentBasis::of(&chalk)?, options, Stop::NEVER)?;
/// assert_eq!(fitted.map.basis().components().len(), 1);
/// let radiance = fitted.map.radiance(Direction::X, Direction::X);
/// assert!((radiance[0] - 0.5 / (4.0 * std::f64::consts::PI).sqrt()).abs() < 1e-4);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn fit(
    reflection: &Reflection,
    basis: &ComponentBasis,
    options: ComponentOptions,
    stop: Stop<'_>,
) -> Result<FittedComponents, ComponentError> {
    let material = reflection.material().ok_or(ComponentError::NoMaterial)?;
    if material.centre() == Centre::Tangent {
        return Err(ComponentError::Tangent);
    }
    let fit = map::Fit::new(reflection, material, basis, options)?;
    let samples = measure::Samples::new(reflection, material, options.bake, stop)?;
    let (count, by_count) = match options.count {
        ComponentCount::Fixed(count) => (count.clamp(1, basis.components.len().max(1)), Vec::new()),
        ComponentCount::Accept(limits) => {
            let by_count = samples.by_count(&fit, stop)?;
            let is_enough = |error: &[f64; 2]| error[0] <= limits[0] && error[1] <= limits[1];
            let least = by_count.iter().find(|(_, error)| is_enough(error)).or(by_count.last());
            (least.map_or(1, |(count, _)| *count), by_count)
        }
    };
    let map = fit.map(count, stop)?;
    let error = samples.error(&map);
    Ok(FittedComponents { map, error, by_count })
}

/// The maps of [`fit`] with each of these numbers of components, or with all that the material has if these
/// are fewer: lights beside the lighting's series are not in them, and all have the full resolution of `edge`
/// texels. One fit serves all numbers. `stop` is asked before each row of texels.
///
/// # Errors
/// If the material is not known or is about the tangent, has a value that is not finite, or the fit was
/// stopped.
pub fn fit_counts(
    reflection: &Reflection,
    basis: &ComponentBasis,
    edge: usize,
    counts: &[usize],
    stop: Stop<'_>,
) -> Result<Vec<ComponentMap>, ComponentError> {
    let material = reflection.material().ok_or(ComponentError::NoMaterial)?;
    if material.centre() == Centre::Tangent {
        return Err(ComponentError::Tangent);
    }
    let most = counts.iter().copied().max().unwrap_or(1).clamp(1, basis.components.len().max(1));
    let basis = basis.first(most);
    let options = ComponentOptions { edge, count: ComponentCount::Fixed(most), half: false, bake: false };
    map::Fit::new(reflection, material, &basis, options)?.maps(counts, stop)
}
