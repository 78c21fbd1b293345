//! The levels of a prefiltered cube: for each roughness the method that suits its lobe and the light.

use envmap::{CubeMap, Environment};
use sh::{Degree, Expansion, Lighting, Stop, Stopped, Transform, TransformError, energy_per_degree};
use sphere::{Cube, LatLong, spiral};

use super::series::by_factors;
use super::{Distribution, HORIZON_DEGREE, LightBlocks, PrefilterKernel, RoughnessOutOfRange};

/// The caller's choice of how levels are made.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum MethodChoice {
    /// Levels are made in spherical harmonics if the light holds the degree that the lobe needs, otherwise by
    /// quadrature.
    #[default]
    Auto,
    /// Levels are made in spherical harmonics; an error if the light does not hold the degree.
    Series,
    /// Levels are made by quadrature over blocks of texels.
    Quadrature,
}

/// How a level was made.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum LevelMethod {
    /// The level is a mirror: the environment, averaged over each texel.
    Resampled,
    /// The level was made by [`crate::prefilter_series`] with this many degrees.
    Series {
        /// The highest l, inclusive.
        degree: usize,
    },
    /// The level was made by [`LightBlocks`].
    Quadrature,
}

/// One level of a prefiltered cube.
#[derive(Clone, Debug, PartialEq)]
pub struct PrefilteredLevel {
    /// The roughness of the level; 0 is a mirror.
    pub roughness: f64,
    /// The radiance; nothing is negative.
    pub map: CubeMap,
    /// The method by which the level was made.
    pub method: LevelMethod,
    /// The number of values that were negative and became 0.
    pub negative: usize,
    /// The estimated RMS error as a share of the level's largest value: of a series, what its cut leaves
    /// out, as the light's energy per degree tells; of quadrature, the difference from blocks of a third of
    /// the size in 64 directions. `None` for a mirror.
    pub error: Option<f64>,
}

/// An environment, prefiltered for several roughnesses: a cube map with levels.
#[derive(Clone, Debug, PartialEq)]
pub struct Prefiltered {
    /// The lobe that the environment was prefiltered with.
    pub distribution: Distribution,
    /// The levels, each with half the edge of the one before.
    pub levels: Vec<PrefilteredLevel>,
    /// The coefficients of the light, lamps included: not prefiltered.
    pub series: Expansion,
}

/// A prefiltered cube could not be made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PrefilterError {
    /// A roughness is past 1 or negative.
    #[error(transparent)]
    Roughness(#[from] RoughnessOutOfRange),
    /// The light does not hold the degree that a level needs, and quadrature was not wanted.
    #[error("roughness {roughness:.3} needs degree {needed}; the light holds {held}")]
    DegreeTooLow {
        /// The roughness of the level.
        roughness: f64,
        /// The degree that the level needs.
        needed: usize,
        /// The highest degree of the light.
        held: usize,
    },
    /// The cube has no texel, or too many.
    #[error(transparent)]
    Size(#[from] envmap::Error),
    /// A grid has no pixels.
    #[error(transparent)]
    Transform(#[from] TransformError),
    /// The levels were stopped, because the caller did not want them any more.
    #[error(transparent)]
    Stopped(#[from] Stopped),
}

/// A prefiltered cube for each roughness, and the light's series.
///
/// `levels[l]` has max(1, resolution >> l) texels along the edge of a face. A roughness of 0 is the
/// environment itself, resampled by area. The series is that of `lighting` if it is given, its lamps
/// included, otherwise of the environment. It has the degree that the levels need and at least 74, the
/// cosine's, if the light holds that. An image holds twice the degree that its pixels' centres do, as each of
/// its pixels is four of the same radiance for a level that needs it. `stop` is asked for each level, and
/// more often by quadrature.
///
/// # Errors
/// [`PrefilterError`]
pub fn prefilter(
    environment: &Environment,
    lighting: Option<&Lighting>,
    distribution: Distribution,
    roughness: &[f64],
    resolution: usize,
    choice: MethodChoice,
    stop: Stop<'_>,
) -> Result<Prefiltered, PrefilterError> {
    let kernels = roughness
        .iter()
        .map(|&roughness| match roughness {
            0.0 => Ok(None),
            _ => PrefilterKernel::new(distribution, roughness).map(Some),
        })
        .collect::<Result<Vec<_>, _>>()?;
    let own = lighting.map_or(highest_degree(environment.grid()), |light| light.series.degree().get());
    let held = lighting.map_or(highest_degree(doubled(environment.grid())), |_| own);
    let methods = kernels
        .iter()
        .zip(roughness)
        .map(|(kernel, &roughness)| match (kernel.map(|kernel| kernel.degree()), choice) {
            (None, _) => Ok(LevelMethod::Resampled),
            (Some(degree), MethodChoice::Auto | MethodChoice::Series) if degree <= held => {
                Ok(LevelMethod::Series { degree })
            }
            (Some(needed), MethodChoice::Series) => {
                Err(PrefilterError::DegreeTooLow { roughness, needed, held })
            }
            (Some(_), _) => Ok(LevelMethod::Quadrature),
        })
        .collect::<Result<Vec<_>, _>>()?;

    let needed = methods.iter().map(|method| match method {
        LevelMethod::Series { degree } => *degree,
        _ => 0,
    });
    let highest = needed.max().unwrap_or(0).max(HORIZON_DEGREE.min(own));
    let series = series(environment, lighting, Degree::new(highest).unwrap_or(Degree::MAX), stop)?;
    let mut light =
        LevelLight { environment, energy: energy_per_degree(&series), series, blocks: None, stop };
    let mut levels: Vec<PrefilteredLevel> = Vec::with_capacity(roughness.len());
    for (l, method) in methods.into_iter().enumerate() {
        stop.check()?;
        let cube = Cube { edge: (resolution >> l.min(31)).max(1) };
        levels.push(light.level(roughness[l], kernels[l].as_ref(), method, cube)?);
    }
    Ok(Prefiltered { distribution, levels, series: light.series })
}

/// The highest degree that an image holds.
fn highest_degree(grid: LatLong) -> usize {
    (grid.width.saturating_sub(1) / 2).min(grid.height.saturating_sub(1)).min(Degree::MAX.get())
}

/// A grid whose pixels are quarters of those of another.
fn doubled(grid: LatLong) -> LatLong {
    LatLong { width: 2 * grid.width, height: 2 * grid.height }
}

/// The light's coefficients, lamps included.
fn series(
    environment: &Environment,
    lighting: Option<&Lighting>,
    degree: Degree,
    stop: Stop<'_>,
) -> Result<Expansion, PrefilterError> {
    let Some(lighting) = lighting else {
        let grid = environment.grid();
        if degree.get() <= highest_degree(grid) {
            return Ok(Transform::new(grid, degree)?.analyse_rows(environment, stop)?);
        }
        let pixels = environment.pixels();
        let fine = doubled(grid);
        let quarter = |index: usize| {
            let (row, column) = (index / fine.width, index % fine.width);
            pixels[row / 2 * grid.width + column / 2]
        };
        let quarters: Vec<[f32; 3]> = (0..fine.len()).map(quarter).collect();
        return Ok(Transform::new(fine, degree)?.analyse(&quarters));
    };
    let mut series = lighting.series.to_degree(degree);
    for lamp in &lighting.lights {
        let lamp = lamp.series(degree);
        let values = series.coefficients_mut().as_flattened_mut();
        values.iter_mut().zip(lamp.coefficients().as_flattened()).for_each(|(sum, value)| *sum += value);
    }
    Ok(series)
}

/// The light that levels are made from.
struct LevelLight<'a> {
    environment: &'a Environment,
    series: Expansion,
    /// The energy of the series, per degree.
    energy: Vec<[f64; 3]>,
    /// The environment's blocks, built when the first level needs them.
    blocks: Option<LightBlocks<'a>>,
    stop: Stop<'a>,
}

impl LevelLight<'_> {
    fn level(
        &mut self,
        roughness: f64,
        kernel: Option<&PrefilterKernel>,
        method: LevelMethod,
        cube: Cube,
    ) -> Result<PrefilteredLevel, PrefilterError> {
        let Some(kernel) = kernel else {
            let map = self.environment.cube_map(cube)?;
            let (map, negative) = without_negatives(cube, map.pixels().to_vec());
            return Ok(PrefilteredLevel { roughness, map, method, negative, error: None });
        };
        let environment = self.environment;
        let blocks = || LightBlocks::new(environment);
        let (texels, error) = match method {
            LevelMethod::Series { degree } => {
                let factors = kernel.factors(2 * degree);
                (by_factors(&self.series, &factors, degree, cube)?, self.cut_off(&factors, degree))
            }
            _ => {
                let blocks = self.blocks.get_or_insert_with(blocks);
                let texels = blocks.prefilter(kernel, cube, self.stop)?;
                (texels, quadrature_error(blocks, kernel))
            }
        };
        let (map, negative) = without_negatives(cube, texels);
        let largest = map.pixels().as_flattened().iter().fold(f32::MIN_POSITIVE, |a, b| a.max(*b));
        let error = Some(error / f64::from(largest));
        Ok(PrefilteredLevel { roughness, map, method, negative, error })
    }

    /// The RMS over the sphere of what a series loses past a degree: the root of sum over l of k_l^2 E_l / 4
    /// pi. Past the degrees that were computed, energy is taken to grow as that of a point light, 2 l + 1.
    fn cut_off(&self, factors: &[f64], degree: usize) -> f64 {
        let last = self.energy.len() - 1;
        let lost = |channel: usize| -> f64 {
            let energy = |l: usize| match self.energy.get(l) {
                Some(energy) => energy[channel],
                None => self.energy[last][channel] * (2 * l + 1) as f64 / (2 * last + 1) as f64,
            };
            (degree + 1..=2 * degree).map(|l| math::powi(factors[l], 2) * energy(l)).sum()
        };
        let most = (0..3).map(lost).fold(0.0, f64::max);
        (most / (4.0 * std::f64::consts::PI)).sqrt()
    }
}

/// The number of directions in which errors are measured.
const DIRECTIONS: usize = 64;

/// The RMS difference from blocks of a third of the size.
fn quadrature_error(blocks: &LightBlocks<'_>, kernel: &PrefilterKernel) -> f64 {
    let square = |index: usize| -> f64 {
        let normal = spiral(index, DIRECTIONS);
        let coarse = blocks.prefilter_at(kernel, normal, LightBlocks::SHARE);
        let fine = blocks.prefilter_at(kernel, normal, LightBlocks::SHARE / 3.0);
        (0..3).map(|channel| math::powi(coarse[channel] - fine[channel], 2)).fold(0.0, f64::max)
    };
    ((0..DIRECTIONS).map(square).sum::<f64>() / DIRECTIONS as f64).sqrt()
}

/// The map with 0 for each negative value, and their number.
fn without_negatives(cube: Cube, mut texels: Vec<[f32; 3]>) -> (CubeMap, usize) {
    let mut negative = 0;
    for value in texels.as_flattened_mut() {
        if *value < 0.0 {
            *value = 0.0;
            negative += 1;
        }
    }
    (CubeMap::new(cube, texels).expect("as many texels as the cube has"), negative)
}
