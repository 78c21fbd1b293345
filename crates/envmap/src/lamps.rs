//! The suns and lamps of an environment, taken out of the image.
//!
//! Photographs hold suns 10^5 times brighter than their mean, around which every truncated series rings. A
//! pixel whose radiance is more than [`BRIGHTER`] times the mean over the sphere is cut down to that, colour
//! kept, and what is cut off is gathered into [`Light`]s, each from the pixels that are nearest to it. From
//! the brightest pixel on, one that is farther than [`REACH`] from all others begins a group; then the
//! groups' centres move to the mean of their pixels' directions, weighted by flux, and weaker ones within
//! [`REACH`] of a stronger one join it ([`ROUNDS`] times). A light's radius is that of the disk with the
//! spread of its pixels. Groups with little flux ([`MIN_FLUX`]) ring so little that their pixels stay in the
//! image. If large lamps become more than [`MAX_LAMPS`] lights, groups reach farther.
//!
//! The soft image and the lights together have the integral of the environment.

use rayon::prelude::*;
use sh::{Light, Stop, Stopped};
use sphere::{DVec3, Direction, LatLong, NearestDirection};

use crate::Environment;

/// Raised when the results of this kernel change: every kind of stage that calls it adds this to its own
/// revision.
pub const REVISION: u32 = 1;

/// Pixels that are more than this many times brighter than the mean over the sphere are cut down to that.
const BRIGHTER: f64 = 10.0;

/// The angle within which pixels belong to one light, in radians: 1.75 degrees. A light is reflected as a
/// round disk, which a lamp is only in small pieces.
const REACH: f64 = 1.75 * std::f64::consts::PI / 180.0;

/// The number of times that the groups' centres are moved to the mean of their pixels.
const ROUNDS: usize = 4;

/// The least flux of a light, in sr times the mean radiance over the sphere.
const MIN_FLUX: f64 = 0.02;

/// The share of [`MIN_FLUX`] from which a group may be a piece of a large lamp.
const PIECE: f64 = 0.25;

/// The most lights: a renderer that adds them up visits each at every pixel.
const MAX_LAMPS: usize = 64;

/// The factor by which groups reach farther if there are more than [`MAX_LAMPS`].
const FARTHER: f64 = 1.25;

/// An environment in two parts.
#[derive(Clone, Debug)]
pub struct Separated {
    /// The image without its lamps.
    pub soft: Environment,
    /// The lamps, the strongest first.
    pub lights: Vec<Light>,
}

/// A bright pixel.
#[derive(Clone, Copy)]
struct Bright {
    pixel: u32,
    rgb: [f32; 3],
}

impl Bright {
    fn radiance(self) -> f64 {
        mean(self.rgb.map(f64::from))
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
struct BrightPixels {
    grid: LatLong,
    threshold: f64,
    pixels: Vec<Bright>,
    /// The indices of `pixels` in the order of the image.
    in_rows: Vec<u32>,
    /// Sines and cosines of the rows' and columns' angles.
    thetas: Vec<(f64, f64)>,
    phis: Vec<(f64, f64)>,
    solid_angles: Vec<f64>,
}

/// Pixels that are handled between two questions whether to stop.
const CHUNK: usize = 1 << 14;

/// Pixels that are side by side, as a rule, of which only few centres can be nearest.
const TILE: usize = 16;

/// The sums over the pixels of a light.
#[derive(Clone, Copy, Default)]
struct Group {
    pixels: usize,
    flux: [f64; 3],
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
    fn new(environment: &Environment, threshold: f64, stop: Stop<'_>) -> Result<Self, Stopped> {
        let grid = environment.grid();
        let found = environment.map_rows(stop, |row, pixels| {
            let bright = pixels
                .iter()
                .enumerate()
                .map(|(index, rgb)| Bright { pixel: (row * grid.width + index) as u32, rgb: *rgb });
            let is_bright = |bright: &Bright| bright.radiance() > threshold && threshold > 0.0;
            bright.filter(is_bright).collect::<Vec<_>>()
        })?;
        let mut pixels = found.concat();
        drop(found);
        pixels.par_sort_by(|a, b| b.radiance().total_cmp(&a.radiance()));
        let mut in_rows: Vec<u32> = (0..pixels.len() as u32).collect();
        in_rows.par_sort_unstable_by_key(|index| pixels[*index as usize].pixel);
        let (rows, columns) = (0..grid.height, 0..grid.width);
        Ok(Self {
            grid,
            threshold,
            pixels,
            in_rows,
            thetas: rows.clone().map(|row| math::sin_cos(grid.theta(row))).collect(),
            phis: columns.map(|column| math::sin_cos(grid.phi(column))).collect(),
            solid_angles: rows.map(|row| grid.solid_angle(row)).collect(),
        })
    }

    fn direction(&self, bright: Bright) -> DVec3 {
        let (row, column) =
            (bright.pixel as usize / self.grid.width, bright.pixel as usize % self.grid.width);
        let ((sin_theta, cos_theta), (sin_phi, cos_phi)) = (self.thetas[row], self.phis[column]);
        DVec3::new(sin_theta * cos_phi, sin_theta * sin_phi, cos_theta)
    }

    fn excess(&self, bright: Bright) -> Excess {
        let solid_angle = self.solid_angles[bright.pixel as usize / self.grid.width];
        let share = 1.0 - self.threshold / bright.radiance();
        let flux = bright.rgb.map(|value| f64::from(value) * share * solid_angle);
        Excess { direction: self.direction(bright), flux, solid_angle }
    }

    /// The pixels as groups about centres that are at least `reach` apart, in radians: the sums of each
    /// group, and the number of each pixel's group.
    fn grouped(&self, reach: f64, stop: Stop<'_>) -> Result<(Vec<Group>, Vec<u32>), Stopped> {
        let least = math::cos(reach);
        let far = |kept: &[DVec3], direction: DVec3| kept.iter().all(|kept| kept.dot(direction) < least);
        let mut centres: Vec<DVec3> = Vec::new();
        for pixels in self.pixels.chunks(CHUNK) {
            stop.check()?;
            let earlier = NearestDirection::new(&centres);
            let directions = pixels.par_iter().map(|bright| self.direction(*bright));
            let is_far = |direction: &DVec3| {
                let nearest = earlier.nearest(*direction).map(|index| centres[index]);
                nearest.is_none_or(|nearest| far(&[nearest], *direction))
            };
            let outside: Vec<DVec3> = directions.filter(is_far).collect();
            let first = centres.len();
            for direction in outside {
                if far(&centres[first..], direction) {
                    centres.push(direction);
                }
            }
        }
        let mut nearest = self.nearest(&centres, stop)?;
        for _ in 0..ROUNDS {
            let groups = &mut nearest.0;
            groups.sort_by(|a, b| mean(b.flux).total_cmp(&mean(a.flux)));
            centres.clear();
            for group in groups {
                if far(&centres, group.centre()) {
                    centres.push(group.centre());
                }
            }
            nearest = self.nearest(&centres, stop)?;
        }
        Ok(nearest)
    }

    /// Assigns the pixels to the nearest of the centres.
    fn nearest(&self, centres: &[DVec3], stop: Stop<'_>) -> Result<(Vec<Group>, Vec<u32>), Stopped> {
        let nearest = NearestDirection::new(centres);
        let tile = |tile: &[u32]| {
            let direction = |index: u32| self.direction(self.pixels[index as usize]);
            let first = direction(tile[0]);
            let spread = tile.iter().map(|index| (direction(*index) - first).length()).fold(0.0, f64::max);
            let candidates = nearest.candidates(first, spread);
            let find = |pixel: &u32| {
                let direction = direction(*pixel);
                let cosines = candidates.iter().map(|(centre, index)| (centre.dot(direction), *index));
                let best = cosines.max_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
                (*pixel, best.map_or(0, |(_, index)| index as u32))
            };
            tile.iter().map(find).collect::<Vec<_>>()
        };
        let mut of_pixels = vec![0; self.pixels.len()];
        let mut found = Vec::new();
        for pixels in self.in_rows.chunks(CHUNK) {
            stop.check()?;
            found.clear();
            found.par_extend(pixels.par_chunks(TILE).flat_map_iter(tile));
            found.iter().for_each(|(pixel, group): &(u32, u32)| of_pixels[*pixel as usize] = *group);
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
    fn lights(&self, groups: &[Group], of_pixels: &[u32]) -> Vec<Light> {
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

impl Environment {
    /// Takes the suns and lamps out of the image. `stop` is asked every few milliseconds.
    ///
    /// # Errors
    /// If it was stopped.
    pub fn separate_lamps(&self, stop: Stop<'_>) -> Result<Separated, Stopped> {
        let average = mean(self.integral_until(stop)?) / (4.0 * std::f64::consts::PI);
        let (threshold, least) = (BRIGHTER * average, MIN_FLUX * average);
        let bright = BrightPixels::new(self, threshold, stop)?;
        let (mut reach, mut found) = (REACH, (Vec::new(), Vec::new()));
        while reach < std::f64::consts::PI {
            found = bright.grouped(reach, stop)?;
            // The pieces of a large lamp may be weak: counted too, they grow with the reach.
            let groups = found.0.iter().filter(|group| group.pixels > 0 && mean(group.flux) >= PIECE * least);
            if groups.count() <= MAX_LAMPS {
                break;
            }
            reach *= FARTHER;
        }
        let (groups, of_pixels) = found;
        let is_light = |group: &Group| group.pixels > 0 && mean(group.flux) >= least;
        let soften = |bright: &Bright| {
            let share = threshold / bright.radiance();
            (bright.pixel, bright.rgb.map(|value| (f64::from(value) * share) as f32))
        };
        let taken =
            bright.pixels.iter().zip(&of_pixels).filter(|(_, group)| is_light(&groups[**group as usize]));
        let mut texels: Vec<(u32, [f32; 3])> = taken.map(|(bright, _)| soften(bright)).collect();
        texels.par_sort_unstable_by_key(|(pixel, _)| *pixel);
        let lights = bright.lights(&groups, &of_pixels);
        let mut lights: Vec<(f64, Light)> = groups
            .iter()
            .zip(lights)
            .filter(|(group, _)| is_light(group))
            .map(|(group, light)| (mean(group.flux), light))
            .collect();
        lights.sort_by(|a, b| b.0.total_cmp(&a.0));
        Ok(Separated {
            soft: self.replaced(&texels),
            lights: lights.into_iter().map(|(_, light)| light).collect(),
        })
    }
}

fn mean(rgb: [f64; 3]) -> f64 {
    rgb.iter().sum::<f64>() / 3.0
}

#[cfg(test)]
mod tests {
    use sphere::LatLong;

    use super::*;

    fn sky(height: usize, radiance: impl Fn(Direction) -> [f32; 3]) -> Environment {
        let grid = LatLong::with_rows(height);
        let texels = (0..grid.len()).map(|i| radiance(grid.direction(i / grid.width, i % grid.width)));
        Environment::new(grid, texels.collect()).unwrap()
    }

    /// A sun of radius 1 degree: one light of its flux in its place, whatever the grid.
    #[test]
    fn a_sun_becomes_one_light() {
        let sun = Direction::from_angles(0.9, 2.0);
        let radius = 2.0_f64.to_radians();
        for height in [256, 512] {
            let lit =
                sky(height, |d| if d.dot(sun) > radius.cos() { [9000.0, 6000.0, 3000.0] } else { [1.0; 3] });
            let Separated { soft, lights } = lit.separate_lamps(Stop::NEVER).unwrap();
            assert_eq!(lights.len(), 1, "{lights:?}");
            let light = lights[0];
            let off = light.direction.dot(sun).clamp(-1.0, 1.0).acos();
            assert!(off < 2e-3 && (light.radius - radius).abs() < 3e-3, "{off} {}", light.radius);
            let whole: f64 = lit.integral()[0];
            assert!(
                (soft.integral()[0] + light.flux()[0] - whole).abs() < 1e-5 * whole,
                "the integral stays"
            );
            assert!(light.irradiance[0] > 2.9 * light.irradiance[2], "and the colour");
            let most = soft.pixels().as_flattened().iter().fold(0.0_f32, |most, value| most.max(*value));
            let mean = lit.integral().iter().sum::<f64>() / (12.0 * std::f64::consts::PI);
            assert!(f64::from(most) < 1.51 * BRIGHTER * mean, "{most}");
        }
    }

    #[test]
    fn a_large_lamp_becomes_several_lights_that_cover_it() {
        let lamp = Direction::from_angles(1.3, -1.0);
        let lit = sky(256, |d| if d.dot(lamp) > 0.15_f64.cos() { [500.0; 3] } else { [0.1; 3] });
        let Separated { lights, .. } = lit.separate_lamps(Stop::NEVER).unwrap();
        assert!((5..60).contains(&lights.len()), "{}", lights.len());
        assert!(lights.iter().all(|light| light.direction.dot(lamp) > 0.15_f64.cos()));
    }

    /// A lamp is taken out however large it is: but for a corner or two, no part of it stays in the image
    /// beside parts that do not.
    #[test]
    fn a_ceiling_of_light_is_taken_out_whole() {
        let lit = sky(256, |d| {
            let (v, panel) = (d.vector(), |x: f64| x.abs() < 0.35);
            if v.z > 0.5 && panel(v.x) && panel(v.y) { [30.0; 3] } else { [0.1; 3] }
        });
        let Separated { soft, lights } = lit.separate_lamps(Stop::NEVER).unwrap();
        assert!((20..=MAX_LAMPS).contains(&lights.len()), "{}", lights.len());
        let [before, left] =
            [&lit, &soft].map(|image| image.pixels().iter().filter(|p| p[0] == 30.0).count());
        assert!(before > 1000 && left < before / 100, "{left} of {before}");
    }

    #[test]
    fn soft_light_and_sparkle_stay_in_the_image() {
        let even = sky(32, |_| [0.5; 3]);
        assert!(even.separate_lamps(Stop::NEVER).unwrap().lights.is_empty());
        assert_eq!(even.separate_lamps(Stop::NEVER).unwrap().soft.pixels(), even.pixels());
        let black = sky(8, |_| [0.0; 3]);
        assert!(black.separate_lamps(Stop::NEVER).unwrap().lights.is_empty());
        // 1e-4 sr at 50 times the mean, far from each other.
        let sparkle = sky(512, |d| {
            if (d.theta() * 40.0).sin() * (d.phi() * 40.0).sin() > 0.9999 { [50.0; 3] } else { [0.9; 3] }
        });
        let Separated { soft, lights } = sparkle.separate_lamps(Stop::NEVER).unwrap();
        assert!(lights.is_empty() && soft.pixels() == sparkle.pixels(), "{}", lights.len());
    }
}
