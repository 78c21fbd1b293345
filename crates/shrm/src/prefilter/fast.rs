//! Fast prefiltering for sharp lobes: sums over the levels of a chain of ever coarser cubes.
//!
//! After J. Manson and P.-P. Sloan 2016, "Fast Filtering of Reflection Probes": a chain of cubes, each half
//! of the one before by a quadratic B-spline that minds the cube's metric, and then a few fetches from its
//! levels whose weights are fitted to the lobe and depend on the place on the face. That is theirs; the rest
//! is ours.
//!
//! They look each texel up in many directions, since their coarse texels are not round spots on the sphere.
//! Our chain has faces that are even in angle ([`even_cube`]), and each of its levels is spread until a
//! point of light is a round spot in it, as large everywhere but for a seventh. Then a lobe is a sum of
//! spots about one direction, one of each level: a GGX lobe in the tangent plane, (1 + x^2)^-2 with x =
//! tan(theta / 2) / a, is the mean of Gaussians of variance 1 / (2 s) over s that is distributed
//! exponentially. What weight a level gets depends on t = log2(spot / 2 a) alone, the spot's deviation
//! relative to the lobe: one table ([`table::WEIGHTS`]) for every roughness, found by least squares over
//! degrees and over phases of t.
//!
//! The sum goes from coarse to fine, by the subdivision of quadratic B-splines, and costs a few operations a
//! texel. Its fourth channel is the sum of weights, so that a constant sky stays constant.
//!
//! A chain samples: how wide a spot is depends a little on where it lies between texels, and three faces
//! that meet in a corner are not one plane. From roughness 0.105 to 0.124 that costs 0.02 to 0.3 percent of
//! a level (RMS) in soft light, 0.3 to 1.2 in photographs without a sun, 2 to 4 where one pixel is nearly
//! all the light, and 4 to 9 if that lies in a corner of the cube. Up to degree [`FastChain::SERIES_DEGREE`]
//! [`super::prefilter_series`] takes little more time, and wider lobes see more of the corners.

mod even_cube;
mod table;

use std::f64::consts::FRAC_PI_4;

use envmap::CubeMap;
use rayon::prelude::*;
use sphere::Cube;

use super::{Distribution, PrefilterKernel};
use even_cube::{EvenCube, Texel, from_even, to_even};
use table::{FIRST, PER_OCTAVE, WEIGHTS};

/// An environment as a chain of cubes, for [`FastChain::prefilter`].
#[derive(Debug)]
pub struct FastChain {
    /// The levels of the chain, the coarsest first with 2 texels along an edge; spread to round spots.
    levels: Vec<EvenCube>,
}

impl FastChain {
    /// The highest degree that is left to [`super::prefilter_series`].
    pub const SERIES_DEGREE: usize = 320;

    /// The largest cube that a chain is made from.
    const MAX_CUBE: usize = 2048;

    /// The edge of the cube that a chain has to be made from for a kernel: the least power of two whose spots
    /// are as sharp as the table asks for, and at least 4. `None` if the kernel is not GGX, so wide that the
    /// series is as fast, or sharper than cubes of a sensible size.
    pub fn edge(kernel: &PrefilterKernel) -> Option<usize> {
        let is_sharp = kernel.degree() > Self::SERIES_DEGREE && kernel.distribution() == Distribution::Ggx;
        // Spots finer than by an octave than this one have no weight.
        let edge = ((2.2 / kernel.alpha()).ceil() as usize).next_power_of_two().max(4);
        Some(edge).filter(|edge| is_sharp && *edge <= Self::MAX_CUBE)
    }

    /// The chain of a cube whose edge is a power of two, such as [`FastChain::edge`]. `pixel` is the size,
    /// in radians, of the pixels between which the cube was interpolated, as by
    /// [`envmap::Environment::cube_map`]: that blurs, and is undone. 0 if there are none.
    pub fn new(map: &CubeMap, pixel: f64) -> Self {
        let mut cube = EvenCube::of(map);
        let mut levels = vec![cube.rounded(0, pixel)];
        while cube.edge() > 2 {
            cube = cube.halved();
            levels.push(cube.rounded(levels.len(), pixel));
        }
        levels.reverse();
        Self { levels }
    }

    /// The number of levels of the chain that have a weight in a kernel.
    pub fn taps(&self, kernel: &PrefilterKernel) -> usize {
        self.levels.iter().filter(|level| has_weight(kernel, level.edge())).count()
    }

    /// The prefilter at the centres of a cube's texels: six faces in file order, rows from the top.
    ///
    /// # Example: a constant sky stays constant
    /// ```
    /// use shrm::{Distribution, FastChain, PrefilterKernel};
    /// let kernel = PrefilterKernel::new(Distribution::Ggx, 0.12)?;
    /// let cube = sphere::Cube { edge: FastChain::edge(&kernel).unwrap() };
    /// let sky = envmap::CubeMap::new(cube, vec![[1.0; 3]; cube.len()]).unwrap();
    /// let texels = FastChain::new(&sky, 0.0).prefilter(&kernel, sphere::Cube { edge: 8 });
    /// assert!(texels.iter().flatten().all(|value| (value - 1.0).abs() < 1e-5));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn prefilter(&self, kernel: &PrefilterKernel, cube: Cube) -> Vec<[f32; 3]> {
        let edge = cube.edge;
        let (coarse, fine) = self.levels.split_at(self.levels.partition_point(|level| level.edge() <= edge));
        let mut sum = EvenCube::black(1);
        for level in coarse {
            let size = level.edge();
            let weights = has_weight(kernel, size).then(|| {
                let even = |index: usize| from_even((index as f64 + 0.5) / size as f64);
                weights(kernel, size, size, even)
            });
            sum = sum.doubled(weights.as_deref().map(|weights| (level, weights)));
        }
        // What is coarse was summed on even texels; all is looked up where the cube has its own.
        let ordinary = |index: usize| (index as f64 + 0.5) / edge as f64;
        let fine = fine.iter().filter(|level| has_weight(kernel, level.edge()));
        let fine = fine.map(|level| (level, weights(kernel, level.edge(), edge, ordinary)));
        let parts: Vec<(&EvenCube, Vec<f32>, Vec<Taps>)> = std::iter::once((&sum, vec![1.0; edge * edge]))
            .chain(fine)
            .map(|(level, weights)| {
                let taps = (0..edge).map(|index| Taps::new(ordinary(index), level.edge())).collect();
                (level, weights, taps)
            })
            .collect();
        let mut out = vec![[0.0; 3]; cube.len()];
        out.par_chunks_mut(edge.max(1)).enumerate().with_min_len(8).for_each(|(index, texels)| {
            let (face, row) = (index / edge, index % edge);
            let mut sums = vec![[0.0; 4]; edge];
            for (level, weights, taps) in &parts {
                let down = &taps[row];
                let rows: [&[Texel]; 3] = std::array::from_fn(|k| level.row(face, down.first + k));
                for ((sum, weight), across) in sums.iter_mut().zip(&weights[row * edge..]).zip(taps) {
                    for (k, share) in across.shares.iter().enumerate() {
                        let [a, b, c] = rows.map(|row| &row[across.first + k]);
                        let scale = weight * share;
                        for lane in 0..4 {
                            let [a, b, c] = [
                                a[lane] * down.shares[0],
                                b[lane] * down.shares[1],
                                c[lane] * down.shares[2],
                            ];
                            sum[lane] += scale * (a + b + c);
                        }
                    }
                }
            }
            for (texel, [r, g, b, weight]) in texels.iter_mut().zip(sums) {
                *texel = [r / weight, g / weight, b / weight];
            }
        });
        out
    }
}

/// log2 of a level's spot relative to the lobe, in the middle of a face.
fn octave(kernel: &PrefilterKernel, edge: usize) -> f64 {
    let spot = EvenCube::VARIANCE.sqrt() * FRAC_PI_4 * 2.0 / edge as f64;
    math::log2(spot / (2.0 * kernel.alpha()))
}

/// Spots in the corner of a face are larger by this many octaves, log2(4 / 3) / 2.
const CORNER: f64 = 0.2076;

/// Whether the level with `edge` has a weight anywhere.
fn has_weight(kernel: &PrefilterKernel, edge: usize) -> bool {
    let (t, last) = (octave(kernel, edge), FIRST + (WEIGHTS.len() - 1) as f64 / PER_OCTAVE);
    t + CORNER > FIRST && t < last
}

/// The weight of a level with `of` at `edge` x `edge` places of a face; `place` gives their s or t.
fn weights(kernel: &PrefilterKernel, of: usize, edge: usize, place: impl Fn(usize) -> f64) -> Vec<f32> {
    let squares: Vec<f64> = (0..edge).map(|index| math::powi(2.0 * place(index) - 1.0, 2)).collect();
    let middle = octave(kernel, of);
    let mut weights = Vec::with_capacity(edge * edge);
    for v2 in &squares {
        for u2 in &squares {
            let larger = (1.0 + u2) * (1.0 + v2) / (1.0 + u2 + v2);
            weights.push(weight(middle + 0.5 * math::log2(larger)));
        }
    }
    weights
}

/// The table at t, linear between its entries and 0 outside.
fn weight(t: f64) -> f32 {
    let x = PER_OCTAVE * (t - FIRST);
    if x < 0.0 || x >= (WEIGHTS.len() - 1) as f64 {
        return 0.0;
    }
    let (before, share) = (x as usize, x.fract());
    ((1.0 - share) * WEIGHTS[before] + share * WEIGHTS[before + 1]) as f32
}

/// Where a place lies between three texels of an even row, for a quadratic B-spline.
struct Taps {
    /// The first of the three texels, counted from the border.
    first: usize,
    shares: [f32; 3],
}

impl Taps {
    /// The taps at s (or t) in a row of `edge` texels.
    fn new(s: f64, edge: usize) -> Self {
        let x = to_even(s) * edge as f64;
        let middle = (x as usize).min(edge - 1);
        let f = x - middle as f64 - 0.5;
        let shares = [0.5 * math::powi(0.5 - f, 2), 0.75 - f * f, 0.5 * math::powi(0.5 + f, 2)];
        Self { first: middle, shares: shares.map(|share| share as f32) }
    }
}

#[cfg(test)]
mod tests {
    use envmap::Environment;
    use sphere::{DVec3, Face, LatLong};

    use super::*;
    use crate::prefilter_series;

    fn kernel(roughness: f64) -> PrefilterKernel {
        PrefilterKernel::new(Distribution::Ggx, roughness).unwrap()
    }

    fn environment(radiance: impl Fn(DVec3) -> [f64; 3]) -> Environment {
        let grid = LatLong::with_rows(512);
        let pixel = |index: usize| {
            let w = grid.direction(index / grid.width, index % grid.width).vector();
            radiance(w).map(|value| value as f32)
        };
        Environment::new(grid, (0..grid.len()).map(pixel).collect()).unwrap()
    }

    fn chain(environment: &Environment) -> FastChain {
        FastChain::new(&environment.cube_map(Cube { edge: 256 }).unwrap(), std::f64::consts::PI / 512.0)
    }

    /// The RMS difference from the series, and the difference in energy, as shares of its RMS.
    fn errors(environment: &Environment, chain: &FastChain, roughness: f64, cube: Cube) -> [(f64, f64); 3] {
        let kernel = kernel(roughness);
        let degree = sh::Degree::new(kernel.degree()).unwrap();
        let series = sh::Transform::new(environment.grid(), degree).unwrap().analyse(environment.pixels());
        let expected = prefilter_series(&series, &kernel, cube).unwrap();
        let found = chain.prefilter(&kernel, cube);
        std::array::from_fn(|channel| {
            let (mut square, mut of_error, mut sum) = (0.0, 0.0, 0.0);
            for (index, (found, expected)) in found.iter().zip(&expected).enumerate() {
                let texel = cube.solid_angle(index / cube.edge % cube.edge, index % cube.edge);
                let error = f64::from(found[channel]) - f64::from(expected[channel]);
                square += texel * f64::from(expected[channel]).powi(2);
                of_error += texel * error * error;
                sum += texel * error;
            }
            ((of_error / square).sqrt(), sum / (square * 4.0 * std::f64::consts::PI).sqrt())
        })
    }

    /// Red is smooth, green waves of 0.2 rad, blue a sun of one pixel (0.006 rad) in a sky that has twice
    /// its light.
    fn lit(sun: DVec3) -> Environment {
        environment(|w| {
            let spot = ((w.dot(sun) - 1.0) / (2.0 * 0.006_f64.powi(2))).exp();
            let waves = (30.0 * w.y).sin() * (25.0 * w.x + 10.0 * w.z).cos();
            [1.0 + 0.5 * w.x + 0.4 * (9.0 * w.y).sin(), 0.5 + 0.4 * waves, 0.3 + 8000.0 * spot]
        })
    }

    /// Bounds are a fifth above what was seen, which was 0.0008 of red and 0.0027 of green.
    #[test]
    fn errors_are_some_percent_of_a_sun_and_less_of_skies() {
        let suns = [
            ("in a face", DVec3::new(-0.33, 0.56, 0.76), [2.9e-2, 3.2e-2]),
            ("in the middle of a face", DVec3::Z, [4.6e-2, 3.6e-2]),
            ("on an edge", DVec3::new(1.0, 0.0, 1.0), [3.3e-2, 3.3e-2]),
            ("in a corner", DVec3::ONE, [5.4e-2, 10.6e-2]),
        ];
        for (name, sun, bounds) in suns {
            let environment = lit(sun.normalize());
            let chain = chain(&environment);
            for (roughness, edge, bound) in [(0.105, 128, bounds[0]), (0.124, 64, bounds[1])] {
                let found = errors(&environment, &chain, roughness, Cube { edge });
                let [(red, _), (green, _), (blue, energy)] = found;
                assert!(red < 1e-3 && green < 3.2e-3, "{name}, {roughness}: {found:?}");
                assert!(blue < bound && energy.abs() < 5e-3, "{name}, {roughness}: {found:?}");
            }
        }
    }

    #[test]
    fn a_constant_sky_stays_constant() {
        let chain =
            FastChain::new(&CubeMap::new(Cube { edge: 256 }, vec![[1.0, 2.0, 0.5]; 6 << 16]).unwrap(), 0.01);
        for (roughness, edge) in [(0.1, 128), (0.12, 256), (0.124, 1), (0.124, 5)] {
            for found in chain.prefilter(&kernel(roughness), Cube { edge }) {
                let errors = [found[0] - 1.0, found[1] / 2.0 - 1.0, found[2] * 2.0 - 1.0];
                assert!(errors.iter().all(|error| error.abs() < 1e-5), "{roughness}, {edge}: {found:?}");
            }
        }
    }

    /// The step from the last texel of a face to the next face's first is no larger, relative to what the
    /// series has there, than steps within a face.
    #[test]
    fn edges_between_faces_do_not_show() {
        let environment = lit(DVec3::new(1.0, 0.3, 0.93).normalize());
        let (kernel, cube) = (kernel(0.124), Cube { edge: 64 });
        let found = chain(&environment).prefilter(&kernel, cube);
        let degree = sh::Degree::new(kernel.degree()).unwrap();
        let series = sh::Transform::new(environment.grid(), degree).unwrap().analyse(environment.pixels());
        let expected = prefilter_series(&series, &kernel, cube).unwrap();
        // +Z's right column touches +X's left one, row by row.
        let at = |face: Face, row: usize, column: usize| (face as usize * 64 + row) * 64 + column;
        let step = |a: usize, b: usize| (found[a][2] - found[b][2]) - (expected[a][2] - expected[b][2]);
        let worst = |steps: &mut dyn Iterator<Item = f32>| steps.fold(0.0_f32, |a, b| a.max(b.abs()));
        let across =
            worst(&mut (0..64).map(|row| step(at(Face::PositiveZ, row, 63), at(Face::PositiveX, row, 0))));
        let inside = worst(&mut (0..64 * 16).map(|index| {
            let (row, column) = (index / 16, 46 + index % 16);
            step(at(Face::PositiveZ, row, column), at(Face::PositiveZ, row, column + 1))
        }));
        assert!(across < 1.2 * inside, "{across} across, {inside} inside");
    }

    #[test]
    fn only_sharp_lobes_are_for_a_chain() {
        assert_eq!(FastChain::edge(&kernel(0.1)), Some(256));
        assert_eq!(FastChain::edge(&kernel(0.05)), Some(1024));
        assert_eq!(FastChain::edge(&kernel(0.02)), None);
        assert_eq!(FastChain::edge(&kernel(0.2)), None);
        assert_eq!(FastChain::edge(&PrefilterKernel::new(Distribution::Charlie, 0.1).unwrap()), None);
    }
}
