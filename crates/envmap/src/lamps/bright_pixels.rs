//! The bright pixels of an environment, and the groups that they form.
//!
//! A pixel has to be compared with the centres of groups that are near it alone. Those of a square of the
//! image are near each other, so that most of these comparisons are made once for each square.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use rayon::prelude::*;
use sh::{Light, Stop, Stopped};
use sphere::{DVec3, Direction, LatLong, NearestDirection};

use crate::Environment;
use crate::row_sums::radiance;

/// The number of times that the groups' centres are moved to the mean of their pixels.
const ROUNDS: usize = 4;

/// Pixels that are handled between two questions whether to stop.
const CHUNK: usize = 1 << 14;

/// The edge of a square of the image, in pixels.
const SQUARE: usize = 16;

/// More than the rounding of a distance between two directions.
const ROUNDING: f64 = 1e-7;

/// A bright pixel.
#[derive(Clone, Copy)]
pub(super) struct Bright {
    pub(super) pixel: u32,
    pub(super) rgb: [f32; 3],
}

impl Bright {
    pub(super) fn radiance(self) -> f64 {
        radiance(self.rgb)
    }
}

/// The radiance of a pixel above the threshold, times its solid angle.
#[derive(Clone, Copy)]
struct Excess {
    direction: DVec3,
    flux: [f64; 3],
    solid_angle: f64,
}

/// The bright pixels of an environment, the brightest first; of equal ones the first.
pub(super) struct BrightPixels {
    grid: LatLong,
    threshold: f64,
    pub(super) pixels: Vec<Bright>,
    squares: Vec<Square>,
    /// Sines and cosines of the rows' and columns' angles.
    thetas: Vec<(f64, f64)>,
    phis: Vec<(f64, f64)>,
    solid_angles: Vec<f64>,
}

/// The bright pixels of a square of the image.
struct Square {
    /// The indices of [`BrightPixels::pixels`], ascending.
    pixels: Vec<u32>,
    /// The direction of the first, and the greatest distance of another from it.
    first: DVec3,
    spread: f64,
}

/// The pixels of a square that may begin groups.
struct Left {
    /// The pixels that no centre before number `checked` reaches.
    pixels: Vec<u32>,
    checked: usize,
}

/// The sums over the pixels of a light.
#[derive(Clone, Copy, Default)]
pub(super) struct Group {
    pub(super) pixels: usize,
    pub(super) flux: [f64; 3],
    /// The sum of directions, weighted by flux.
    directions: DVec3,
}

impl Group {
    /// The mean direction, weighted by flux.
    fn centre(&self) -> DVec3 {
        self.directions.normalize_or(DVec3::Z)
    }
}

impl BrightPixels {
    pub(super) fn new(environment: &Environment, threshold: f64, stop: Stop<'_>) -> Result<Self, Stopped> {
        let grid = environment.grid();
        let found = environment.map_brighter_rows(threshold, stop, |row, pixels| {
            let bright = pixels
                .iter()
                .enumerate()
                .map(|(index, rgb)| Bright { pixel: (row * grid.width + index) as u32, rgb: *rgb });
            let is_bright = |bright: &Bright| bright.radiance() > threshold && threshold > 0.0;
            bright.filter(is_bright).collect::<Vec<_>>()
        })?;
        let mut pixels = found.concat();
        drop(found);
        stop.check()?;
        pixels.par_sort_unstable_by(|a, b| b.radiance().total_cmp(&a.radiance()).then(a.pixel.cmp(&b.pixel)));
        stop.check()?;
        let (rows, columns) = (0..grid.height, 0..grid.width);
        let mut bright = Self {
            grid,
            threshold,
            pixels,
            squares: Vec::new(),
            thetas: rows.clone().map(|row| math::sin_cos(grid.theta(row))).collect(),
            phis: columns.map(|column| math::sin_cos(grid.phi(column))).collect(),
            solid_angles: rows.map(|row| grid.solid_angle(row)).collect(),
        };
        bright.squares = bright.in_squares();
        stop.check()?;
        Ok(bright)
    }

    fn in_squares(&self) -> Vec<Square> {
        let across = self.grid.width.div_ceil(SQUARE);
        let square_of = |bright: &Bright| {
            let (row, column) = self.place(*bright);
            (row / SQUARE * across + column / SQUARE) as u32
        };
        let mut numbered: Vec<(u32, u32)> = self.pixels.iter().map(square_of).zip(0..).collect();
        numbered.par_sort_unstable();
        let squares: Vec<&[(u32, u32)]> = numbered.chunk_by(|a, b| a.0 == b.0).collect();
        let square = |pixels: &&[(u32, u32)]| {
            let pixels: Vec<u32> = pixels.iter().map(|(_, index)| *index).collect();
            let first = self.direction_of(pixels[0]);
            let distance = |index: &u32| (self.direction_of(*index) - first).length();
            let spread = pixels.iter().map(distance).fold(0.0, f64::max);
            Square { pixels, first, spread }
        };
        squares.par_iter().map(square).collect()
    }

    /// The row and column of a pixel.
    fn place(&self, bright: Bright) -> (usize, usize) {
        (bright.pixel as usize / self.grid.width, bright.pixel as usize % self.grid.width)
    }

    fn direction(&self, bright: Bright) -> DVec3 {
        let (row, column) = self.place(bright);
        let ((sin_theta, cos_theta), (sin_phi, cos_phi)) = (self.thetas[row], self.phis[column]);
        DVec3::new(sin_theta * cos_phi, sin_theta * sin_phi, cos_theta)
    }

    fn direction_of(&self, index: u32) -> DVec3 {
        self.direction(self.pixels[index as usize])
    }

    fn excess(&self, bright: Bright) -> Excess {
        let solid_angle = self.solid_angles[bright.pixel as usize / self.grid.width];
        let share = 1.0 - self.threshold / bright.radiance();
        let flux = bright.rgb.map(|value| f64::from(value) * share * solid_angle);
        Excess { direction: self.direction(bright), flux, solid_angle }
    }

    /// The pixels as groups about centres that are at least `reach` apart, in radians: the sums of each
    /// group, and the number of each pixel's group.
    pub(super) fn grouped(&self, reach: f64, stop: Stop<'_>) -> Result<(Vec<Group>, Vec<u32>), Stopped> {
        let least = math::cos(reach);
        let mut centres = self.centres(reach, stop)?;
        let mut nearest = self.nearest(&centres, stop)?;
        for _ in 0..ROUNDS {
            let groups = &mut nearest.0;
            groups.sort_by(|a, b| mean(b.flux).total_cmp(&mean(a.flux)));
            centres.clear();
            for group in groups {
                let centre = group.centre();
                if centres.iter().all(|kept| kept.dot(centre) < least) {
                    centres.push(centre);
                }
            }
            nearest = self.nearest(&centres, stop)?;
        }
        Ok(nearest)
    }

    /// From the brightest pixel on, each that is farther than `reach` from all before it.
    fn centres(&self, reach: f64, stop: Stop<'_>) -> Result<Vec<DVec3>, Stopped> {
        let least = math::cos(reach);
        let chord = 2.0 * math::sin(0.5 * reach);
        let mut left: Vec<Left> =
            (self.squares.iter()).map(|square| Left { pixels: square.pixels.clone(), checked: 0 }).collect();
        // Each square by the first pixel that was left when it was last looked at.
        let mut queue: BinaryHeap<Reverse<(u32, usize)>> =
            self.squares.iter().enumerate().map(|(k, square)| Reverse((square.pixels[0], k))).collect();
        let mut centres: Vec<DVec3> = Vec::new();
        for step in 0_usize.. {
            if step.is_multiple_of(CHUNK) {
                stop.check()?;
            }
            let Some(Reverse((pixel, k))) = queue.pop() else { break };
            let (square, left) = (&self.squares[k], &mut left[k]);
            for centre in &centres[left.checked..] {
                let distance = (*centre - square.first).length();
                if distance > chord + square.spread + ROUNDING {
                    continue;
                }
                if distance < chord - square.spread - ROUNDING {
                    left.pixels.clear();
                    break;
                }
                left.pixels.retain(|index| centre.dot(self.direction_of(*index)) < least);
            }
            left.checked = centres.len();
            match left.pixels.first() {
                None => {}
                Some(first) if *first == pixel => {
                    centres.push(self.direction_of(pixel));
                    queue.push(Reverse((pixel, k)));
                }
                Some(first) => queue.push(Reverse((*first, k))),
            }
        }
        Ok(centres)
    }

    /// Assigns the pixels to the nearest of the centres.
    fn nearest(&self, centres: &[DVec3], stop: Stop<'_>) -> Result<(Vec<Group>, Vec<u32>), Stopped> {
        let nearest = NearestDirection::new(centres);
        let of_square = |square: &Square| {
            let candidates = nearest.candidates(square.first, square.spread);
            let find = |pixel: &u32| {
                let direction = self.direction_of(*pixel);
                let cosines = candidates.iter().map(|(centre, index)| (centre.dot(direction), *index));
                let best = cosines.max_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
                best.map_or(0, |(_, index)| index as u32)
            };
            match &candidates[..] {
                [(_, only)] => vec![*only as u32; square.pixels.len()],
                _ => square.pixels.iter().map(find).collect(),
            }
        };
        let mut of_pixels = vec![0; self.pixels.len()];
        for squares in self.squares.chunks(CHUNK / SQUARE) {
            stop.check()?;
            let found: Vec<Vec<u32>> = squares.par_iter().map(of_square).collect();
            for (square, found) in squares.iter().zip(found) {
                let pixels = square.pixels.iter().zip(found);
                pixels.for_each(|(pixel, group)| of_pixels[*pixel as usize] = group);
            }
        }
        let mut groups = vec![Group::default(); centres.len()];
        let mut excesses = Vec::new();
        for (pixels, of_pixels) in self.pixels.chunks(CHUNK).zip(of_pixels.chunks(CHUNK)) {
            stop.check()?;
            pixels.par_iter().map(|bright| self.excess(*bright)).collect_into_vec(&mut excesses);
            for (excess, group) in excesses.iter().zip(of_pixels) {
                let group = &mut groups[*group as usize];
                group.pixels += 1;
                (0..3).for_each(|c| group.flux[c] += excess.flux[c]);
                group.directions += excess.direction * mean(excess.flux);
            }
        }
        Ok((groups, of_pixels))
    }

    /// The lights of the groups, of which `of_pixels` has the number of each pixel's.
    pub(super) fn lights(&self, groups: &[Group], of_pixels: &[u32]) -> Vec<Light> {
        let mut totals = vec![[-0.0; 2]; groups.len()];
        let centres: Vec<DVec3> = groups.iter().map(Group::centre).collect();
        for (bright, group) in self.pixels.iter().zip(of_pixels) {
            let (excess, group) = (self.excess(*bright), *group as usize);
            // A disk of radius a has the mean square distance a^2 / 2 from its centre; a pixel has its own
            // spread.
            let apart = (excess.direction - centres[group]).length_squared();
            let weight = mean(excess.flux);
            totals[group][0] += weight;
            totals[group][1] += weight * (apart + excess.solid_angle / (2.0 * std::f64::consts::PI));
        }
        let light = |((group, centre), [total, spread]): ((&Group, DVec3), [f64; 2])| {
            let square = spread / total;
            Light::from_flux(Direction::normalised(centre), (2.0 * square).sqrt().min(1.0), group.flux)
        };
        groups.iter().zip(centres).zip(totals).map(light).collect()
    }
}

pub(super) fn mean(rgb: [f64; 3]) -> f64 {
    rgb.iter().sum::<f64>() / 3.0
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Lamps of all sizes, and sparkle everywhere, also at the poles and across the image's edge.
    fn bright() -> BrightPixels {
        let grid = LatLong::with_rows(96);
        let mut state = 7_u32;
        let mut noise = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            f64::from(state >> 8) / f64::from(1 << 24)
        };
        let lamps: Vec<_> = (0..12).map(|k| (sphere::spiral(k, 12), 0.02 + 0.03 * k as f64)).collect();
        let mut texel = |i: usize| {
            let direction = grid.direction(i / grid.width, i % grid.width);
            let is_lit = |(lamp, radius): &(Direction, f64)| lamp.dot(direction) > radius.cos();
            let value = if lamps.iter().any(is_lit) || noise() > 0.97 { 20.0 + 30.0 * noise() } else { 0.1 };
            [value as f32; 3]
        };
        let texels = (0..grid.len()).map(&mut texel).collect();
        BrightPixels::new(&Environment::new(grid, texels).unwrap(), 1.0, Stop::NEVER).unwrap()
    }

    #[test]
    fn the_search_by_squares_finds_the_centres_and_groups_of_all_comparisons() {
        let bright = bright();
        assert!(bright.pixels.len() > 1000 && bright.squares.len() > 50);
        for reach in [0.03_f64, 0.2, 1.0] {
            let mut expected: Vec<DVec3> = Vec::new();
            for pixel in &bright.pixels {
                let direction = bright.direction(*pixel);
                if expected.iter().all(|centre| centre.dot(direction) < reach.cos()) {
                    expected.push(direction);
                }
            }
            let centres = bright.centres(reach, Stop::NEVER).unwrap();
            assert_eq!(centres, expected);
            let (groups, of_pixels) = bright.nearest(&centres, Stop::NEVER).unwrap();
            assert_eq!(groups.iter().map(|group| group.pixels).sum::<usize>(), bright.pixels.len());
            for (pixel, group) in bright.pixels.iter().zip(of_pixels) {
                let direction = bright.direction(*pixel);
                let most = centres.iter().map(|centre| centre.dot(direction)).fold(-1.0, f64::max);
                assert_eq!(centres[group as usize].dot(direction), most);
            }
        }
    }
}
