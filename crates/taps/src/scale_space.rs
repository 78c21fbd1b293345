//! The scale space of an environment: its light, blurred by Gaussians of many widths.
//!
//! > M(d, s) = integral of L(w) g_s(angle(w, d)) dw
//!
//! and the same with the kernels about the normal (`kernels.rs` has both). Each is a zonal convolution, one factor
//! for each degree and level: M_lm(s) = g_l(s) L_lm. It knows no material: one scale space serves all of them.

use envmap::{CubeMap, Environment, Texels};
use rayon::prelude::*;
use sh::{Degree, Expansion, Light, Stop, Transform, TransformError, interpolate_cube};
use sphere::{Cube, Direction, LatLong};

use crate::kernels::{NORMAL_KERNELS, gaussian_factors, normal_factors};
use crate::widths::{Widths, share};

/// The light of an environment at every width.
#[derive(Clone, Debug)]
pub struct ScaleSpace {
    widths: Widths,
    levels: Vec<CubeMap>,
    /// The light about each normal, by each kernel.
    normals: Vec<CubeMap>,
    /// The lights that are not in the levels.
    lights: Vec<Light>,
    /// The radiance of a white diffuse surface by its normal, degree 2; lights not included.
    diffuse: Expansion,
}

/// A scale space could not be made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ScaleSpaceError {
    /// A grid has no pixels.
    #[error(transparent)]
    Transform(#[from] TransformError),
    /// The environment cannot be resampled.
    #[error(transparent)]
    Size(#[from] envmap::Error),
    /// The work was stopped, because the caller did not want it any more.
    #[error(transparent)]
    Stopped(#[from] sh::Stopped),
}

/// The standard deviations of a Gaussian's spectrum that a series keeps: what is cut is e^-10 of a lamp's peak.
const SPECTRUM: f64 = 4.5;

/// The degree that the cut of a wide Gaussian at 90 degrees asks for.
const HORIZON: usize = 74;

/// The edge of the maps of light about normals.
const NORMAL_EDGE: usize = 16;

/// The width past which a Gaussian is cut by its horizon at more than 1e-4 of its peak.
const CUT: f64 = 0.366;

impl ScaleSpace {
    /// The scale space of an environment, less these lights, which are kept beside it: see
    /// [`Environment::without_lights`].
    ///
    /// # Errors
    /// If the work was stopped.
    pub fn new(
        environment: &Environment,
        lights: &[Light],
        widths: Widths,
        stop: Stop<'_>,
    ) -> Result<Self, ScaleSpaceError> {
        let soft = (!lights.is_empty()).then(|| environment.without_lights(lights).rest);
        let soft = soft.as_ref().unwrap_or(environment);
        stop.check()?;
        let highest = degree(widths.texel_std(0));
        let series = series(soft, highest)?;
        let blurred = |edge: usize, degree: usize, factors: &dyn Fn(usize) -> Vec<f64>| {
            stop.check()?;
            let degree = Degree::new(degree).unwrap_or(Degree::MAX).min(series.degree());
            let mut blurred = series.to_degree(degree);
            scale(&mut blurred, &factors(degree.get()));
            let cube = Cube { edge };
            let mut texels = interpolate_cube(&blurred, cube)?;
            // What a cut rings below zero.
            texels.as_flattened_mut().iter_mut().for_each(|value| *value = value.max(0.0));
            Ok(CubeMap::new(cube, texels).unwrap_or_else(|| unreachable!("the cube has a texel for each")))
        };
        let level = |k: usize| {
            let std = widths.texel_std(k);
            blurred(widths.edge_of(k), degree(std), &|degree| gaussian_factors(std, degree))
        };
        let normal = |kernel: usize| {
            let y = kernel as f64 / (NORMAL_KERNELS - 1) as f64;
            blurred(NORMAL_EDGE, HORIZON, &|degree| normal_factors(y, degree))
        };
        let (levels, normals) = rayon::join(
            || (0..widths.len()).into_par_iter().map(level).collect::<Result<_, ScaleSpaceError>>(),
            || (0..NORMAL_KERNELS).into_par_iter().map(normal).collect::<Result<_, ScaleSpaceError>>(),
        );
        let (levels, normals) = (levels?, normals?);
        let mut diffuse = series.to_degree(Degree::new(2).unwrap_or(Degree::ZERO).min(series.degree()));
        scale(&mut diffuse, &[1.0, 2.0 / 3.0, 0.25]);
        Ok(Self { widths, levels, normals, lights: lights.to_vec(), diffuse })
    }

    /// The widths of the levels.
    pub fn widths(&self) -> Widths {
        self.widths
    }

    /// The levels, the sharpest first.
    pub fn levels(&self) -> &[CubeMap] {
        &self.levels
    }

    /// The lights beside the levels.
    pub fn lights(&self) -> &[Light] {
        &self.lights
    }

    /// The radiance of a white diffuse surface by its normal, as a series of degree 2; without the lights.
    pub fn diffuse(&self) -> &Expansion {
        &self.diffuse
    }

    /// The light about normals: a cube for each kernel.
    pub fn normals(&self) -> &[CubeMap] {
        &self.normals
    }

    /// H(N, y): bilinear in the maps of two kernels, linear in y between them; y = 1 is the radiance of a white
    /// diffuse surface.
    pub fn about_normal(&self, normal: Direction, y: f64) -> [f64; 3] {
        let last = (NORMAL_KERNELS - 1) as f64;
        let x = (y * last).clamp(0.0, last - 1e-6);
        mixed(&self.normals[x as usize..], normal, x.fract())
    }

    /// M(d, s): bilinear in two levels, linear in the variance between them.
    pub fn blurred(&self, direction: Direction, std: f64) -> [f64; 3] {
        let x = self.widths.place(std);
        mixed(&self.levels[x as usize..], direction, share(x.fract()))
    }
}

/// A bilinear look-up in two cubes, and the share of the second.
fn mixed(cubes: &[CubeMap], direction: Direction, share: f64) -> [f64; 3] {
    let [a, b] = [&cubes[0], &cubes[1]].map(|cube| cube.cube().taps(direction).blend(cube.pixels()));
    std::array::from_fn(|channel| a[channel] + share * (b[channel] - a[channel]))
}

/// The degree that a Gaussian of a width needs.
fn degree(std: f64) -> usize {
    let needed = (SPECTRUM / std).ceil() as usize;
    if std > CUT { needed.max(HORIZON) } else { needed }
}

/// The series of an environment to a degree. An image of too few pixels for it is interpolated to more.
fn series(environment: &Environment, degree: usize) -> Result<Expansion, ScaleSpaceError> {
    let degree = Degree::new(degree).unwrap_or(Degree::MAX);
    let grid = environment.grid();
    if grid.width > 2 * degree.get() && grid.height > degree.get() {
        return Ok(Transform::new(grid, degree)?.analyse(environment.pixels()));
    }
    let finer = environment.resized(LatLong::with_rows((degree.get() + 1).next_power_of_two()))?;
    Ok(Transform::new(finer.grid(), degree)?.analyse(finer.pixels()))
}

/// Multiplies the terms of degree l by `factors[l]`.
fn scale(series: &mut Expansion, factors: &[f64]) {
    let rows = series.coefficients_mut();
    for (l, factor) in factors.iter().enumerate() {
        let Some(rows) = rows.get_mut(l * l..(l + 1) * (l + 1)) else { return };
        rows.as_flattened_mut().iter_mut().for_each(|value| *value *= factor);
    }
}
