//! The scale space of an environment: its light, blurred by Gaussians of many widths.
//!
//! > M(d, s) = integral of L(w) g_s(angle(w, d)) dw
//!
//! and the same with the kernels about the normal (`kernels.rs` has both). Each is a zonal convolution, one
//! factor for each degree and level: M_lm(s) = g_l(s) L_lm. It knows no material: one scale space serves all
//! of them.

use std::f64::consts::{FRAC_PI_2, PI};

use envmap::{CubeMap, Environment, Texels};
use rayon::prelude::*;
use sh::{Degree, Expansion, Light, Stop, Transform, TransformError, interpolate_cube};
use sphere::{Cube, Direction, Face, LatLong};

use crate::kernels::{Gaussian, NORMAL_KERNELS, about_normal, gaussian_factors, normal_factors};
use crate::widths::{Widths, share};

/// Raised when the results of this kernel change: every kind of stage that calls it adds this to its own
/// revision.
pub const REVISION: u32 = 1;

/// The light of an environment at every width.
#[derive(Clone, Debug, PartialEq)]
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

/// The standard deviations of a Gaussian's spectrum that a series keeps: what is cut is e^-10 of a lamp's
/// peak.
const SPECTRUM: f64 = 4.5;

/// The degree that the cut of a wide Gaussian at 90 degrees asks for.
const HORIZON: usize = 74;

/// The edge of the maps of light about normals.
const NORMAL_EDGE: usize = 16;

/// What a white diffuse surface makes of the terms of each degree.
const COSINE: [f64; 3] = [1.0, 2.0 / 3.0, 0.25];

/// The width of the kernels about the normal for which a light may be taken as a few points.
const NORMAL_WIDTH: f64 = 0.3;

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
        scale(&mut diffuse, &COSINE);
        Ok(Self { widths, levels, normals, lights: lights.to_vec(), diffuse })
    }

    /// A scale space of cubes; `None` if their number or an edge is not that of the widths, or the series is
    /// of another degree than 2.
    pub fn from_parts(
        widths: Widths,
        levels: Vec<CubeMap>,
        normals: Vec<CubeMap>,
        diffuse: Expansion,
        lights: Vec<Light>,
    ) -> Option<Self> {
        let edges = levels.iter().map(|level| level.cube().edge);
        let is_whole = edges.eq((0..widths.len()).map(|k| widths.edge_of(k)))
            && normals.len() == NORMAL_KERNELS
            && normals.iter().all(|map| map.cube().edge == NORMAL_EDGE)
            && diffuse.degree().get() == 2;
        is_whole.then_some(Self { widths, levels, normals, lights, diffuse })
    }

    /// The scale space with only the first `count` of its lights beside it; the others are in it.
    pub fn keeping(&self, count: usize) -> Self {
        let (kept, moved) = self.lights.split_at(count.min(self.lights.len()));
        let level = |(k, level): (usize, &CubeMap)| {
            let gaussian = Gaussian::new(self.widths.texel_std(k));
            with_lights(level, moved, [gaussian.reach(), gaussian.std()], |cosine| gaussian.at(cosine))
        };
        let normal = |(kernel, map): (usize, &CubeMap)| {
            let y = kernel as f64 / (NORMAL_KERNELS - 1) as f64;
            with_lights(map, moved, [FRAC_PI_2, NORMAL_WIDTH], |cosine| about_normal(y, cosine))
        };
        let mut diffuse = self.diffuse.clone();
        for light in moved {
            let mut series = light.series(diffuse.degree());
            scale(&mut series, &COSINE);
            let sums = diffuse.coefficients_mut().iter_mut().zip(series.coefficients());
            sums.for_each(|(sum, added)| (0..3).for_each(|channel| sum[channel] += added[channel]));
        }
        Self {
            widths: self.widths,
            levels: self.levels.par_iter().enumerate().map(level).collect(),
            normals: self.normals.par_iter().enumerate().map(normal).collect(),
            lights: kept.to_vec(),
            diffuse,
        }
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

    /// H(N, y): bilinear in the maps of two kernels, linear in y between them; y = 1 is the radiance of a
    /// white diffuse surface.
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

/// A map of blurred light with more lights in it: `kernel` is a function of the cosine of an angle, 0 past
/// the angle `reach`, and does not change much within `width`.
fn with_lights(
    map: &CubeMap,
    lights: &[Light],
    [reach, width]: [f64; 2],
    kernel: impl Fn(f64) -> f64 + Sync,
) -> CubeMap {
    let cube = map.cube();
    let mut texels = map.pixels().to_vec();
    let direction = |index: usize| {
        let (face, within) = (index / (cube.edge * cube.edge), index % (cube.edge * cube.edge));
        cube.direction(Face::ALL[face], within / cube.edge, within % cube.edge)
    };
    let directions: Vec<Direction> = (0..texels.len()).map(direction).collect();
    for light in lights {
        let (points, flux) = (light.points(width), light.flux());
        let farthest = math::cos((reach + light.radius).min(PI));
        for (texel, at) in texels.iter_mut().zip(&directions) {
            if at.dot(light.direction) < farthest {
                continue;
            }
            let seen: f64 = points.iter().map(|(point, share)| share * kernel(at.dot(*point))).sum();
            (0..3).for_each(|channel| texel[channel] += (seen * flux[channel]) as f32);
        }
    }
    CubeMap::new(cube, texels).unwrap_or_else(|| unreachable!("the cube has a texel for each"))
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

#[cfg(test)]
mod tests {
    use sphere::DVec3;

    use super::*;

    fn sky(rows: usize, radiance: impl Fn(Direction) -> [f32; 3]) -> Environment {
        let grid = LatLong::with_rows(rows);
        let texel = |index: usize| radiance(grid.direction(index / grid.width, index % grid.width));
        Environment::new(grid, (0..grid.len()).map(texel).collect()).unwrap()
    }

    fn space(environment: &Environment, lights: &[Light], edge: usize) -> ScaleSpace {
        ScaleSpace::new(environment, lights, Widths::new(edge).unwrap(), Stop::NEVER).unwrap()
    }

    #[test]
    fn a_constant_sky_stays_constant() {
        let space = space(&sky(64, |_| [1.0, 2.0, 0.5]), &[], 32);
        for cube in space.levels().iter().chain(space.normals()) {
            for texel in cube.pixels() {
                let errors = [texel[0] - 1.0, texel[1] / 2.0 - 1.0, texel[2] * 2.0 - 1.0];
                assert!(errors.iter().all(|error| error.abs() < 1e-5), "{texel:?}");
            }
        }
        let white = space.diffuse().evaluate(Direction::X);
        assert!((white[1] - 2.0).abs() < 1e-6, "{white:?}");
    }

    /// A lamp of a few pixels, 1000 times as bright as a sky that changes: the kernels themselves, summed
    /// over pixels. Within 1 % of the level's largest value for Gaussians, which are smooth, and also
    /// relative to the sum where that is small: what a cut rings is below 1 % of the sky. The step of the
    /// hemisphere's kernel is left out.
    #[test]
    fn levels_are_sums_over_pixels() {
        let lamp = Direction::from_angles(1.0, 0.7);
        let environment = sky(128, |d| {
            let glow = if d.dot(lamp) > 0.06_f64.cos() { 1000.0 } else { 0.0 };
            [1.0 + 0.5 * d.vector().z as f32 + glow, 1.0, 0.2 + 0.1 * (6.0 * d.vector().x).sin() as f32]
        });
        let space = space(&environment, &[], 64);
        let grid = environment.grid();
        let sum = |kernel: &dyn Fn(f64) -> f64, at: Direction| {
            let (mut sum, mut whole) = ([0.0; 3], 0.0);
            for (index, rgb) in environment.pixels().iter().enumerate() {
                let (row, column) = (index / grid.width, index % grid.width);
                let angle = grid.direction(row, column).dot(at).clamp(-1.0, 1.0).acos();
                let weight = if angle < std::f64::consts::FRAC_PI_2 { kernel(angle) } else { 0.0 };
                let weight = weight * grid.solid_angle(row);
                (0..3).for_each(|channel| sum[channel] += weight * f64::from(rgb[channel]));
                whole += weight;
            }
            sum.map(|value| value / whole)
        };
        let directions = [
            lamp,
            Direction::from_angles(1.05, 0.8),
            Direction::from_angles(1.6, 0.7),
            Direction::Z,
            Direction::normalised(DVec3::new(-1.0, 0.3, -0.5)),
        ];
        for k in [0, 5, 9, 14] {
            let cube = &space.levels()[k];
            let largest = cube.pixels().iter().map(|texel| texel[0]).fold(0.0, f32::max);
            for at in directions {
                // At a texel's own centre nothing is interpolated.
                let (face, s, t) = cube.cube().position(at);
                let [row, column] = [t, s].map(|part| (part * cube.cube().edge as f64) as usize);
                let centre = cube.cube().direction(face, row, column);
                let found =
                    cube.pixels()[(face as usize * cube.cube().edge + row) * cube.cube().edge + column];
                let std = space.widths().texel_std(k);
                let expected = sum(&|angle| (-0.5 * (angle / std).powi(2)).exp(), centre);
                for channel in 0..3 {
                    let error = (f64::from(found[channel]) - expected[channel]).abs();
                    let allowed =
                        0.01 * expected[channel] + if channel == 0 { 3e-5 * f64::from(largest) } else { 0.0 };
                    assert!(error < allowed, "level {k}, channel {channel}: {found:?} {expected:?}");
                }
            }
        }
        for kernel in [1, 2, 3] {
            let y = kernel as f64 / 3.0;
            let cube = &space.normals()[kernel];
            let at = cube.cube().direction(sphere::Face::PositiveX, 3, 9);
            let expected = sum(&|angle| angle.cos() / (angle.cos() * (1.0 - y) + y), at);
            let found = cube.pixels()[3 * 16 + 9];
            for channel in 0..3 {
                let error = f64::from(found[channel]) / expected[channel] - 1.0;
                assert!(error.abs() < 0.01, "kernel {kernel}: {found:?} {expected:?}");
            }
        }
    }

    #[test]
    fn lights_beside_it_are_not_in_it() {
        let lamp = Direction::from_angles(0.8, 2.0);
        let environment = sky(128, |d| if d.dot(lamp) > 0.03_f64.cos() { [3000.0; 3] } else { [1.0; 3] });
        let lights = environment.separate_lamps(Stop::NEVER).unwrap().lights;
        let space = space(&environment, &lights, 32);
        let most = space.levels()[0].pixels().iter().map(|texel| texel[0]).fold(0.0, f32::max);
        assert!(most < 11.0, "{most}");
        assert_eq!(space.lights(), lights);
    }

    #[test]
    fn lights_that_are_not_kept_are_in_it() {
        let lamps = [(0.8, 2.0, 0.03), (1.4, 4.0, 0.02)]
            .map(|(theta, phi, radius)| (Direction::from_angles(theta, phi), radius));
        let inside = |d: Direction| lamps.iter().any(|(lamp, radius)| d.dot(*lamp) > f64::cos(*radius));
        let environment = sky(256, |d| if inside(d) { [3000.0, 2000.0, 1000.0] } else { [1.0; 3] });
        let lights = environment.separate_lamps(Stop::NEVER).unwrap().lights;
        assert_eq!(lights.len(), 2);
        let apart = space(&environment, &lights, 32);
        for count in [0, 1] {
            let [found, expected] = [apart.keeping(count), space(&environment, &lights[..count], 32)];
            assert_eq!(found.lights(), expected.lights());
            let maps = |space: &ScaleSpace| [space.levels(), space.normals()].concat();
            let hemisphere = found.levels().len();
            for (index, (found, expected)) in maps(&found).iter().zip(maps(&expected)).enumerate() {
                let pairs = || found.pixels().as_flattened().iter().zip(expected.pixels().as_flattened());
                let most = pairs().map(|(_, expected)| *expected).fold(0.0, f32::max);
                let error = pairs().map(|(a, b)| (a - b).abs()).fold(0.0, f32::max) / most;
                // The series of an environment is too short for the step at the hemisphere's edge.
                let allowed = if index == hemisphere { 0.1 } else { 0.015 };
                assert!(error < allowed, "map {index} with {count} lights: {error}");
            }
            let pairs = found.diffuse().coefficients().iter().zip(expected.diffuse().coefficients());
            for (found, expected) in pairs {
                assert!(
                    (found[0] - expected[0]).abs() < 0.01 * expected[0].abs() + 0.02,
                    "{found:?} {expected:?}"
                );
            }
        }
        assert_eq!(apart.keeping(2), apart);
    }

    #[test]
    fn a_small_image_is_interpolated() {
        let environment = sky(8, |d| [2.0 + d.vector().z as f32, 1.0, 1.0]);
        let space = space(&environment, &[], 64);
        let up = space.blurred(Direction::Z, space.widths().std(3));
        assert!((up[0] - 3.0).abs() < 0.1 && (up[1] - 1.0).abs() < 1e-4, "{up:?}");
    }
}
