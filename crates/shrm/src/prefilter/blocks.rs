//! Prefiltering by quadrature: light in blocks of blocks, each as small as the lobe asks for where it lies.
//!
//! The sphere is divided anew for each texel: into pixels, or parts of pixels, where the lobe peaks, and into
//! ever larger blocks with the distance from there. A block counts with its whole light, so that no sun is
//! missed however far it is from the lobe; samples would miss it. Its weight is the mean of K over light that
//! is spread with variance v about its mean direction, to second order:
//!
//! > K(mu) + v / 4 d/dmu ((1 - mu^2) dK/dmu).
//!
//! The sum of the weights is that of the same blocks about their centres, so that a constant sky stays
//! constant. Blocks are of 2 x 2 blocks of a lat-long image; a block of extent s is split if s > t (w + d),
//! where w is 2 a, at most a half, d the distance from the peak (GGX) or from the horizon (Charlie), and t
//! [`LightBlocks::SHARE`].

use std::f64::consts::{PI, TAU};

use envmap::Environment;
use rayon::prelude::*;
use sh::{Stop, Stopped};
use sphere::{Cube, DVec3, Direction, Face, LatLong};

use super::{Distribution, PrefilterKernel};

/// An environment in blocks of blocks.
#[derive(Debug)]
pub struct LightBlocks<'a> {
    environment: &'a Environment,
    rows: Vec<GridRow>,
    /// The sine and the cosine of each column's azimuth.
    columns: Vec<(f64, f64)>,
    /// The levels above the pixels, the finest first.
    levels: Vec<Level>,
}

/// The place and size that the pixels of a row have in common.
#[derive(Debug)]
struct GridRow {
    sin_theta: f64,
    cos_theta: f64,
    solid_angle: f32,
    /// The variance of a pixel's directions, as in [`Spread`].
    variance: f32,
}

#[derive(Debug)]
struct Level {
    grid: LatLong,
    blocks: Vec<Block>,
}

/// Light that comes from one block.
#[derive(Clone, Copy, Debug, Default)]
struct Block {
    /// Radiance times solid angle.
    flux: [f32; 3],
    /// Where the light comes from; the block's `area` if there is no light.
    light: Spread,
    solid_angle: f32,
    area: Spread,
}

/// A mean direction, of length 1, and the sum of the variances along two axes, in square radians.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Spread {
    direction: [f32; 3],
    variance: f32,
}

impl Spread {
    fn direction(&self) -> DVec3 {
        DVec3::from_array(self.direction.map(f64::from))
    }

    /// Combines parts with weights: the variances within the parts and between them. `None` without weight.
    fn of(parts: impl Iterator<Item = (Self, f64)> + Clone) -> Option<Self> {
        let (mut sum, mut weight, mut within) = (DVec3::ZERO, 0.0, 0.0);
        for (part, share) in parts.clone() {
            sum += part.direction() * share;
            within += f64::from(part.variance) * share;
            weight += share;
        }
        let mean = sum.try_normalize().filter(|_| weight > 0.0)?;
        let between: f64 = parts.map(|(part, share)| share * part.direction().distance_squared(mean)).sum();
        let variance = ((within + between) / weight) as f32;
        Some(Self { direction: mean.as_vec3().to_array(), variance })
    }
}

impl Block {
    /// Combines several blocks into one. Negative light has no place.
    fn of(parts: &[Self]) -> Self {
        let (mut flux, mut solid_angle) = ([0.0_f64; 3], 0.0);
        for part in parts {
            (0..3).for_each(|channel| flux[channel] += f64::from(part.flux[channel]));
            solid_angle += f64::from(part.solid_angle);
        }
        let brightness = |part: &Self| part.flux.iter().map(|value| f64::from(value.max(0.0))).sum::<f64>();
        let area = Spread::of(parts.iter().map(|part| (part.area, f64::from(part.solid_angle))));
        let area = area.unwrap_or_default();
        let light = Spread::of(parts.iter().map(|part| (part.light, brightness(part)))).unwrap_or(area);
        Self { flux: flux.map(|value| value as f32), light, solid_angle: solid_angle as f32, area }
    }
}

/// A block's place: its level (0: pixels), row and column.
#[derive(Clone, Copy)]
struct Place {
    level: usize,
    row: usize,
    column: usize,
}

/// Sums of weights times light, and of weights.
#[derive(Clone, Copy, Default)]
struct Sum {
    light: [f64; 3],
    weight: f64,
}

impl Sum {
    /// Adds a block: its light with the weight `of_light`, and its area with `of_area`.
    fn add(&mut self, block: &Block, of_light: f64, of_area: f64) {
        (0..3).for_each(|channel| self.light[channel] += of_light * f64::from(block.flux[channel]));
        self.weight += of_area * f64::from(block.solid_angle);
    }
}

impl<'a> LightBlocks<'a> {
    /// The largest extent of a block as a share of its distance plus the lobe's width.
    pub const SHARE: f64 = 0.3;

    /// The width of a lobe past which blocks grow no more: light is rarely smoother than this, in radians.
    const WIDEST: f64 = 0.5;

    /// The most parts of a pixel along a side.
    const MOST_PARTS: f64 = 32.0;

    /// The blocks of an environment.
    pub fn new(environment: &'a Environment) -> Self {
        let grid = environment.grid();
        let row = |row: usize| {
            let (sin_theta, cos_theta) = math::sin_cos(grid.theta(row));
            let (down, across) = (PI / grid.height as f64, TAU / grid.width as f64 * sin_theta);
            let variance = ((down * down + across * across) / 12.0) as f32;
            GridRow { sin_theta, cos_theta, solid_angle: grid.solid_angle(row) as f32, variance }
        };
        let rows = (0..grid.height).map(row).collect();
        let columns = (0..grid.width).map(|column| math::sin_cos(grid.phi(column))).collect();
        let mut blocks = Self { environment, rows, columns, levels: Vec::new() };
        loop {
            let below = blocks.grid(blocks.levels.len());
            if below.height <= 4 {
                return blocks;
            }
            let grid = LatLong { width: below.width.div_ceil(2), height: below.height.div_ceil(2) };
            let level = blocks.levels.len();
            let block = |index: usize| {
                let place = Place { level: level + 1, row: index / grid.width, column: index % grid.width };
                let (mut parts, mut count) = ([Block::default(); 4], 0);
                for part in blocks.parts(place) {
                    parts[count] = blocks.block(part);
                    count += 1;
                }
                Block::of(&parts[..count])
            };
            let blocks_of_level = (0..grid.len()).into_par_iter().map(block).collect();
            blocks.levels.push(Level { grid, blocks: blocks_of_level });
        }
    }

    fn grid(&self, level: usize) -> LatLong {
        if level == 0 { self.environment.grid() } else { self.levels[level - 1].grid }
    }

    fn block(&self, Place { level, row, column }: Place) -> Block {
        if level > 0 {
            let Level { grid, blocks } = &self.levels[level - 1];
            return blocks[row * grid.width + column];
        }
        let &GridRow { sin_theta, cos_theta, solid_angle, variance } = &self.rows[row];
        let (sin_phi, cos_phi) = self.columns[column];
        let direction = [sin_theta * cos_phi, sin_theta * sin_phi, cos_theta].map(|value| value as f32);
        let area = Spread { direction, variance };
        let pixel = self.environment.pixels()[row * self.columns.len() + column];
        let flux = pixel.map(|value| value * solid_angle);
        Block { flux, light: area, solid_angle, area }
    }

    /// The blocks under a block.
    fn parts(&self, Place { level, row, column }: Place) -> impl Iterator<Item = Place> + use<> {
        let below = self.grid(level - 1);
        let rows = 2 * row..(2 * row + 2).min(below.height);
        rows.flat_map(move |row| {
            let columns = 2 * column..(2 * column + 2).min(below.width);
            columns.map(move |column| Place { level: level - 1, row, column })
        })
    }

    /// The prefiltered radiance about one direction. `share` is the largest extent of a block relative to its
    /// distance plus the lobe's width: [`LightBlocks::SHARE`], or less for a smaller error.
    pub fn prefilter_at(&self, kernel: &PrefilterKernel, normal: Direction, share: f64) -> [f64; 3] {
        let normal = normal.vector();
        let top = self.levels.len();
        let grid = self.grid(top);
        let mut sum = Sum::default();
        let mut open: Vec<Place> = (0..grid.len())
            .map(|index| Place { level: top, row: index / grid.width, column: index % grid.width })
            .collect();
        while let Some(place) = open.pop() {
            let block = self.block(place);
            let mu = normal.dot(block.area.direction());
            let extent = self.extent(place);
            if mu < -extent {
                continue;
            }
            let distance = match kernel.distribution() {
                Distribution::Ggx => (2.0 - 2.0 * mu).max(0.0).sqrt(),
                Distribution::Charlie | Distribution::Lambert => mu.abs(),
            };
            let resolved =
                share * ((2.0 * kernel.alpha()).min(Self::WIDEST) + (distance - extent / 2.0).max(0.0));
            if extent <= resolved {
                let of_area = mean_weight(kernel, mu, block.area.variance);
                let of_light = if block.light == block.area {
                    of_area
                } else {
                    mean_weight(kernel, normal.dot(block.light.direction()), block.light.variance)
                };
                sum.add(&block, of_light, of_area);
            } else if place.level > 0 {
                open.extend(self.parts(place));
            } else {
                let parts = (extent / resolved).ceil().min(Self::MOST_PARTS) as usize;
                let weight = self.weight_of_pixel(kernel, normal, place, parts);
                sum.add(&block, weight, weight);
            }
        }
        if sum.weight > 0.0 { sum.light.map(|light| light / sum.weight) } else { [0.0; 3] }
    }

    /// The larger side of a block, in radians.
    fn extent(&self, Place { level, row, .. }: Place) -> f64 {
        let (pixels, scale) = (self.environment.grid(), f64::from(1_u32 << level.min(31)));
        let down = PI / pixels.height as f64 * scale;
        let middle = ((row as f64 + 0.5) * down).min(PI);
        let widest = (math::sin(middle) + down / 2.0).min(1.0);
        down.max(TAU / pixels.width as f64 * scale * widest)
    }

    /// The mean of the weight over a pixel, from `parts` x `parts` places.
    fn weight_of_pixel(&self, kernel: &PrefilterKernel, normal: DVec3, place: Place, parts: usize) -> f64 {
        let grid = self.environment.grid();
        let offset = |part: usize| (part as f64 + 0.5) / parts as f64 - 0.5;
        let mut sum = 0.0;
        for down in 0..parts {
            for across in 0..parts {
                let (row, column) = (place.row as f64 + offset(down), place.column as f64 + offset(across));
                sum += kernel.weight(normal.dot(grid.direction_at(column, row).vector()));
            }
        }
        sum / (parts * parts) as f64
    }

    /// The prefilter at the centres of a cube's texels: six faces in file order, rows from the top. `stop` is
    /// asked for each row.
    ///
    /// # Errors
    /// If it was stopped.
    pub fn prefilter(
        &self,
        kernel: &PrefilterKernel,
        cube: Cube,
        stop: Stop<'_>,
    ) -> Result<Vec<[f32; 3]>, Stopped> {
        let edge = cube.edge;
        let mut out = vec![[0.0; 3]; cube.len()];
        out.par_chunks_mut(edge.max(1)).enumerate().try_for_each(|(row, texels)| {
            stop.check()?;
            for (column, texel) in texels.iter_mut().enumerate() {
                let direction = cube.direction(Face::ALL[row / edge], row % edge, column);
                *texel = self.prefilter_at(kernel, direction, Self::SHARE).map(|value| value as f32);
            }
            Ok(())
        })?;
        Ok(out)
    }
}

/// The mean of the weight over directions of a variance (of two axes) about a cosine.
fn mean_weight(kernel: &PrefilterKernel, mu: f64, variance: f32) -> f64 {
    let variance = f64::from(variance);
    // As wide as an even spread of this variance. At the horizon the mean of max(mu, 0) replaces mu.
    let half = (1.5 * variance).sqrt();
    if mu.abs() < half {
        let ramp = math::powi(mu + half, 2) / (4.0 * half);
        let away = mu.max(0.5 * half);
        return ramp * kernel.weight(away) / away;
    }
    let weight = kernel.weight(mu);
    (weight + variance / 4.0 * kernel.laplacian(mu)).clamp(0.5 * weight, 2.0 * weight)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sky(rows: usize, radiance: impl Fn(Direction) -> [f32; 3]) -> Environment {
        let grid = LatLong::with_rows(rows);
        let pixels = (0..grid.len())
            .map(|index| radiance(grid.direction(index / grid.width, index % grid.width)))
            .collect();
        Environment::new(grid, pixels).unwrap()
    }

    /// Every pixel, in 8 x 8 parts.
    fn brute_force(environment: &Environment, kernel: &PrefilterKernel, normal: Direction) -> [f64; 3] {
        let blocks = LightBlocks::new(environment);
        let grid = environment.grid();
        let mut sum = Sum::default();
        for row in 0..grid.height {
            for column in 0..grid.width {
                let place = Place { level: 0, row, column };
                let weight = blocks.weight_of_pixel(kernel, normal.vector(), place, 8);
                sum.add(&blocks.block(place), weight, weight);
            }
        }
        sum.light.map(|light| light / sum.weight)
    }

    /// Texels are 3 degrees wide here, and the sun is one or two of them.
    #[test]
    fn blocks_give_what_all_pixels_give() {
        let sun = Direction::from_angles(1.0, 0.4);
        let environment = sky(64, |direction| {
            let glow = (20.0 * (direction.dot(sun) - 1.0)).exp() as f32;
            let disk = if direction.dot(sun) > 0.998 { 3000.0 } else { 0.0 };
            [1.0 + glow + disk, 1.0 + direction.vector().x as f32, 0.5 + disk / 2.0]
        });
        let blocks = LightBlocks::new(&environment);
        for (distribution, roughness) in [
            (Distribution::Ggx, 0.1),
            (Distribution::Ggx, 0.2),
            (Distribution::Ggx, 0.6),
            (Distribution::Charlie, 0.4),
            (Distribution::Lambert, 1.0),
        ] {
            let kernel = PrefilterKernel::new(distribution, roughness).unwrap();
            let mut worst = 0.0_f64;
            let mut peak = brute_force(&environment, &kernel, sun)[0];
            for index in 0..24 {
                let normal = if index < 12 {
                    Direction::from_angles(1.0 + 0.03 * f64::from(index), 0.4)
                } else {
                    sphere::spiral(index as usize, 24)
                };
                let expected = brute_force(&environment, &kernel, normal);
                let found = blocks.prefilter_at(&kernel, normal, LightBlocks::SHARE);
                peak = peak.max(expected[0]);
                (0..3).for_each(|channel| worst = worst.max((found[channel] - expected[channel]).abs()));
            }
            assert!(worst < 8e-3 * peak, "{distribution:?} {roughness}: {:e}", worst / peak);
        }
    }

    #[test]
    fn a_constant_sky_stays_constant() {
        let environment = sky(33, |_| [0.25, 1.0, 7.0]);
        let kernel = PrefilterKernel::new(Distribution::Ggx, 0.05).unwrap();
        let texels = LightBlocks::new(&environment).prefilter(&kernel, Cube { edge: 8 }, Stop::NEVER);
        for texel in texels.unwrap() {
            let expected: [f32; 3] = [0.25, 1.0, 7.0];
            (0..3).for_each(|c| assert!((texel[c] / expected[c] - 1.0).abs() < 1e-5, "{texel:?}"));
        }
    }
}
