//! A ball with Phong's lobe about the reflection vector, by samples of the product of light and lobe.
//!
//! With harmonics, one lobe is turned to each pixel's reflection vector. Wavelets cannot be turned: the lobe
//! is stored for several reflection vectors, and a pixel draws from the product with the nearest of them. It
//! weighs by the exact lobe and the exact light in both, so that what differs is how well the density fits,
//! and what it misses.

use envmap::{Environment, ToneMap, to_srgb8};
use rayon::prelude::*;
use sampling::{Points, ProductOptions, ProductSampler, ProductTables, SUM, Sample, Tables, TexelLight};
use sh::Degree;
use sphere::{DVec3, Direction, LatLong, NearestDirection, spiral};

use super::equal_size::{GRID, texel_sampler, wavelets};
use super::phong::Phong;
use super::picture::Picture;
use super::vector;

/// Phong's exponent, and the degree of its series.
const EXPONENT: u32 = 20;
const DEGREE: usize = 12;

/// Samples of a pixel.
pub const SAMPLES: usize = 64;

/// The width of a picture in pixels.
const SIZE: usize = 160;

/// A wavelet: its value in 32 bits, its place in 16.
const BYTES_PER_WAVELET: usize = 6;

/// How many numbers are stored for the lobe by wavelets.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Stored {
    /// Reflection vectors.
    pub orientations: usize,
    /// Wavelets for each.
    pub wavelets: usize,
}

impl Stored {
    /// Bytes of the lobe.
    pub fn bytes(self) -> usize {
        self.orientations * self.wavelets * BYTES_PER_WAVELET
    }
}

/// Bytes of the lobe in harmonics, 32 bits for each.
pub const BYTES_OF_HARMONICS: usize = (DEGREE + 1) * (DEGREE + 1) * 4;

/// Radiance of the pixels of a ball; black around it.
#[derive(Clone, Debug)]
pub struct Render(Vec<[f32; 3]>);

/// Light on a ball.
pub struct Scene {
    environment: Environment,
    light: TexelLight,
    /// The reflected direction of each pixel that sees the ball.
    reflections: Vec<(usize, Direction)>,
}

impl Scene {
    /// Any environment, averaged to the texels of the wavelets.
    ///
    /// # Errors
    /// If it is black.
    pub fn new(environment: &Environment) -> Result<Self, Box<dyn std::error::Error>> {
        let environment = environment.resized(GRID)?;
        let light = TexelLight::new(&environment, SUM)?;
        // The eye looks along +X's opposite; +Z is up.
        let (eye, right, up) = (DVec3::X, DVec3::Y, DVec3::Z);
        let radius = SIZE as f64 / 2.0 - 1.0;
        let reflection = |index: usize| {
            let x = ((index % SIZE) as f64 + 0.5 - SIZE as f64 / 2.0) / radius;
            let y = (SIZE as f64 / 2.0 - (index / SIZE) as f64 - 0.5) / radius;
            let square = 1.0 - x * x - y * y;
            (square > 0.0).then(|| {
                let normal = right * x + up * y + eye * square.sqrt();
                (index, Direction::normalised(normal * (2.0 * normal.dot(eye)) - eye))
            })
        };
        let reflections = (0..SIZE * SIZE).filter_map(reflection).collect();
        Ok(Self { environment, light, reflections })
    }

    fn texel(&self, w: Direction) -> [f64; 3] {
        let (column, row) = GRID.position(w);
        let inside = |x: f64, count: usize| ((x + 0.5).max(0.0) as usize).min(count - 1);
        let index = inside(row, GRID.height) * GRID.width + inside(column, GRID.width);
        self.environment.pixels()[index].map(f64::from)
    }

    fn render(&self, of: impl Fn(usize, Direction) -> [f64; 3] + Sync) -> Render {
        let mut pixels = vec![[0.0; 3]; SIZE * SIZE];
        let values: Vec<_> = self.reflections.par_iter().map(|(index, r)| (*index, of(*index, *r))).collect();
        for (index, rgb) in values {
            pixels[index] = rgb.map(|value| value as f32);
        }
        Render(pixels)
    }

    /// By the sum over all texels, each in 2 x 2 parts.
    pub fn exact(&self) -> Render {
        let fine = LatLong { width: 2 * GRID.width, height: 2 * GRID.height };
        let texel = |index: usize| {
            let (row, column) = (index / GRID.width, index % GRID.width);
            let parts = [(0, 0), (0, 1), (1, 0), (1, 1)].map(|(y, x)| {
                let (row, column) = (2 * row + y, 2 * column + x);
                (fine.direction(row, column).vector(), fine.solid_angle(row))
            });
            (GRID.direction(row, column).vector(), parts)
        };
        let texels: Vec<_> = (0..GRID.len()).map(texel).collect();
        self.render(|_, axis| {
            let phong = Phong { exponent: EXPONENT, axis };
            let mut sum = [0.0; 3];
            for ((centre, parts), rgb) in texels.iter().zip(self.environment.pixels()) {
                // Farther away, the lobe is below 1e-10 of its largest value.
                if axis.vector().dot(*centre) > 0.3 {
                    let mass: f64 = parts.iter().map(|(w, angle)| phong.value(*w) * angle).sum();
                    (0..3).for_each(|k| sum[k] += f64::from(rgb[k]) * mass);
                }
            }
            sum
        })
    }

    /// The mean of samples, with other random points for each pixel and the same for every method.
    fn estimate(
        &self,
        pixel: usize,
        axis: Direction,
        mut sample: impl FnMut([f32; 2]) -> Sample,
    ) -> [f64; 3] {
        let phong = Phong { exponent: EXPONENT, axis };
        let points = Points::Random { seed: pixel as u32 };
        let mut sum = [0.0; 3];
        for k in 0..SAMPLES {
            let drawn = sample(points.get(k as u64));
            if drawn.density > 0.0 {
                let w = Direction::normalised(vector(drawn.direction));
                let weight = phong.value(w.vector()) / (f64::from(drawn.density) * SAMPLES as f64);
                let rgb = self.texel(w);
                (0..3).for_each(|c| sum[c] += rgb[c] * weight);
            }
        }
        sum
    }

    /// By harmonics that are turned to each pixel.
    ///
    /// # Errors
    /// If no product is positive.
    pub fn by_harmonics(&self) -> Result<Render, Box<dyn std::error::Error>> {
        let degree = Degree::new(DEGREE)?;
        let tables = ProductTables::new(&self.light, &Tables::new(degree));
        let f = |axis| Phong { exponent: EXPONENT, axis }.coefficients(degree);
        let first = ProductSampler::new(&tables, &f(Direction::X), ProductOptions::default())?;
        Ok(self.render(|pixel, axis| {
            let mut sampler = first.clone();
            match sampler.replace(&f(axis)) {
                Ok(()) => self.estimate(pixel, axis, |point| sampler.sample(point)),
                Err(_) => [0.0; 3],
            }
        }))
    }

    /// By wavelets of the lobe for the nearest of several reflection vectors.
    pub fn by_wavelets(&self, stored: Stored) -> Render {
        let axes: Vec<Direction> =
            (0..stored.orientations).map(|index| spiral(index, stored.orientations)).collect();
        let index = NearestDirection::new(&axes.iter().map(|axis| axis.vector()).collect::<Vec<_>>());
        let samplers = axes.par_iter().map(|&axis| {
            let lobe = wavelets(&Phong { exponent: EXPONENT, axis }, stored.wavelets);
            let product = lobe.iter().enumerate().map(|(index, value)| {
                value.max(0.0) * self.light.value(index / GRID.width, index % GRID.width)
            });
            // None where the product is black.
            texel_sampler(&product.collect::<Vec<_>>()).ok()
        });
        let samplers = samplers.collect::<Vec<Option<ProductSampler>>>();
        self.render(|pixel, axis| {
            let sampler = index.nearest(axis.vector()).and_then(|nearest| samplers[nearest].as_ref());
            sampler.map_or([0.0; 3], |sampler| self.estimate(pixel, axis, |point| sampler.sample(point)))
        })
    }

    /// The split of as many bytes as the harmonics have whose render is nearest to the truth, and that
    /// render.
    pub fn at_equal_memory(&self, exact: &Render) -> (Stored, Render) {
        let all = BYTES_OF_HARMONICS / BYTES_PER_WAVELET;
        let mut best: Option<(f64, Stored, Render)> = None;
        for orientations in [1, 2, 4, 7, 14, 28, 56] {
            let stored = Stored { orientations, wavelets: all / orientations };
            let render = self.by_wavelets(stored);
            let error = render.error(exact);
            if best.as_ref().is_none_or(|best| error < best.0) {
                best = Some((error, stored, render));
            }
        }
        let best = best.map(|(_, stored, render)| (stored, render));
        best.unwrap_or((Stored { orientations: 0, wavelets: 0 }, Render(vec![[0.0; 3]; SIZE * SIZE])))
    }

    /// The fewest bytes of a ladder of sizes whose render is within 5 % of an error, or the largest.
    pub fn at_equal_quality(&self, exact: &Render, error: f64) -> (Stored, Render) {
        let mut ladder: Vec<Stored> = [64, 256, 1024, 4096, 16384]
            .into_iter()
            .flat_map(|orientations| [16, 64, 256, 1024].map(|wavelets| Stored { orientations, wavelets }))
            .collect();
        ladder.sort_by_key(|stored| stored.bytes());
        let mut last = None;
        for stored in ladder {
            let render = self.by_wavelets(stored);
            let reached = render.error(exact) <= 1.05 * error;
            last = Some((stored, render));
            if reached {
                break;
            }
        }
        last.unwrap_or((Stored { orientations: 0, wavelets: 0 }, Render(vec![[0.0; 3]; SIZE * SIZE])))
    }

    /// The pictures beside each other, in the exposure of the environment.
    pub fn draw(&self, renders: &[&Render]) -> Picture {
        let stops = self.environment.exposure().stops;
        let picture = |render: &&Render| {
            let mut codes = to_srgb8(&render.0, stops, ToneMap::Filmic);
            let mut on_ball = vec![false; codes.len()];
            self.reflections.iter().for_each(|(index, _)| on_ball[*index] = true);
            codes.iter_mut().zip(on_ball).filter(|(_, on)| !on).for_each(|(code, _)| *code = [255; 3]);
            Picture::new(SIZE, SIZE, |column, row| codes[row * SIZE + column])
        };
        Picture::sheet(&[renders.iter().map(picture).collect()])
    }
}

impl Render {
    /// The root of the mean square of the difference, all channels, over that of the truth.
    pub fn error(&self, exact: &Self) -> f64 {
        let pairs = || self.0.as_flattened().iter().zip(exact.0.as_flattened());
        let square = |a: f32, b: f32| f64::from(a - b).powi(2);
        let difference: f64 = pairs().map(|(a, b)| square(*a, *b)).sum();
        let all: f64 = pairs().map(|(_, b)| square(*b, 0.0)).sum();
        (difference / all).sqrt()
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test may panic")]

    use super::*;

    /// Sky, ground and a small sun.
    fn scene() -> Scene {
        let texel = |index: usize| {
            let w = GRID.direction(index / GRID.width, index % GRID.width).vector();
            let sun = w.dot(DVec3::new(0.6, 0.5, 0.62).normalize()) > 0.99;
            [if sun {
                100.0
            } else if w.z > 0.0 {
                1.0
            } else {
                0.2
            }; 3]
        };
        let pixels = (0..GRID.len()).map(texel).collect();
        Scene::new(&Environment::new(GRID, pixels).unwrap()).unwrap()
    }

    #[test]
    fn harmonics_are_nearer_to_the_truth_than_as_many_bytes_of_wavelets() {
        let scene = scene();
        let exact = scene.exact();
        let harmonics = scene.by_harmonics().unwrap().error(&exact);
        let few = scene.by_wavelets(Stored { orientations: 7, wavelets: 16 }).error(&exact);
        let many = scene.by_wavelets(Stored { orientations: 1024, wavelets: 256 }).error(&exact);
        assert!(harmonics < 0.1 && harmonics < 0.5 * few, "{harmonics} {few}");
        assert!(many < 0.5 * few, "{many} {few}");
    }
}
