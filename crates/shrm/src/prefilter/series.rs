//! Prefiltering of coefficients, onto a cube.
//!
//! Each texel is a value of the filtered series, by [`sh::interpolate_cube`].

use sh::{Degree, Expansion, TransformError, interpolate_cube};
use sphere::Cube;

use super::{PrefilterKernel, multiply};

/// The prefilter of a series at the centres of a cube's texels: six faces in file order, rows from the top.
///
/// What is past [`PrefilterKernel::degree`] is left out, and what the series does not have is 0. Values may
/// be negative where the light is: a series rings. Accuracy: rounding to f32 up to degree 40, 1e-4 of the
/// largest above (interpolation, under a point light; tests compare with sums).
///
/// # Errors
/// [`TransformError::Empty`] if the cube has no texel.
///
/// # Example: a constant sky stays constant
/// ```
/// use shrm::{Distribution, PrefilterKernel, prefilter_series};
/// let sky = sh::Expansion::from_coefficients(sh::Degree::ZERO, vec![[3.5449077018110318; 3]]).unwrap();
/// let kernel = PrefilterKernel::new(Distribution::Ggx, 0.5)?;
/// let texels = prefilter_series(&sky, &kernel, sphere::Cube { edge: 4 })?;
/// assert!(texels.iter().flatten().all(|value| (value - 1.0).abs() < 1e-6));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn prefilter_series(
    series: &Expansion,
    kernel: &PrefilterKernel,
    cube: Cube,
) -> Result<Vec<[f32; 3]>, TransformError> {
    let degree = kernel.degree();
    by_factors(series, &kernel.factors(degree), degree, cube)
}

/// [`prefilter_series`] with the factors of a kernel up to a degree.
pub(super) fn by_factors(
    series: &Expansion,
    factors: &[f64],
    degree: usize,
    cube: Cube,
) -> Result<Vec<[f32; 3]>, TransformError> {
    let degree = Degree::new(degree).unwrap_or(Degree::MAX).min(series.degree());
    let mut filtered = series.to_degree(degree);
    multiply(&mut filtered, factors);
    interpolate_cube(&filtered, cube)
}

#[cfg(test)]
mod tests {
    use sh::synthesise_cube;

    use super::*;
    use crate::Distribution;

    /// A point light, the hardest case: all degrees at full strength. On both sides of the change of method.
    #[test]
    fn interpolated_texels_are_those_of_the_sum() {
        for roughness in [0.2, 0.3, 0.5] {
            let kernel = PrefilterKernel::new(Distribution::Ggx, roughness).unwrap();
            let degree = Degree::new(kernel.degree()).unwrap();
            let sun = sphere::Direction::from_angles(0.7, 2.1);
            let series = sh::Light::from_flux(sun, 0.0, [1.0, 2.0, 0.5]).series(degree);
            let cube = Cube { edge: 16 };
            let expected: Vec<[f64; 3]> = synthesise_cube(&kernel.convolve(&series), cube).unwrap();
            let found = prefilter_series(&series, &kernel, cube).unwrap();
            let largest = expected.as_flattened().iter().fold(0.0_f64, |a, b| a.max(b.abs()));
            let errors = found.as_flattened().iter().zip(expected.as_flattened());
            let worst = errors.map(|(a, b)| (f64::from(*a) - b).abs()).fold(0.0, f64::max) / largest;
            assert!(worst < 1e-4, "roughness {roughness}: {worst:e}");
        }
    }
}
