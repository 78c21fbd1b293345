//! The suns and lamps of an environment, taken out of the image.
//!
//! Photographs hold suns 10^5 times brighter than their mean, around which every truncated series rings. A
//! pixel whose radiance is more than [`BRIGHTER`] times the mean over the sphere is cut down to that, colour
//! kept, and what is cut off is gathered into [`Light`]s, each from the pixels that are nearest to it. From
//! the brightest pixel on, one that is farther than [`REACH`] from all others begins a group; then, four
//! times, the groups' centres move to the mean of their pixels' directions, weighted by flux, and weaker ones
//! within [`REACH`] of a stronger one join it. A light's radius is that of the disk with the spread of its
//! pixels. Groups with little flux ([`MIN_FLUX`]) ring so little that their pixels stay in the image. If
//! large lamps become more than [`MAX_LAMPS`] lights, groups reach farther.
//!
//! The soft image and the lights together have the integral of the environment.

mod bright_pixels;

use rayon::prelude::*;
use sh::{Light, Stop, Stopped};

use crate::Environment;
use bright_pixels::{Bright, BrightPixels, Group, mean};

/// Raised when the results of this kernel change: every kind of stage that calls it adds this to its own
/// revision.
pub const REVISION: u32 = 1;

/// Pixels that are more than this many times brighter than the mean over the sphere are cut down to that.
const BRIGHTER: f64 = 10.0;

/// The angle within which pixels belong to one light, in radians: 1.75 degrees. A light is reflected as a
/// round disk, which a lamp is only in small pieces.
const REACH: f64 = 1.75 * std::f64::consts::PI / 180.0;

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
            soft: self.replaced(texels),
            lights: lights.into_iter().map(|(_, light)| light).collect(),
        })
    }
}

#[cfg(test)]
mod tests {
    use sphere::{Direction, LatLong};

    use super::*;
    use crate::CodedRows;

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

    /// The environment as blocks with their sums, and as blocks of a file, whose sums are not known.
    fn coded(plain: &Environment) -> [Environment; 2] {
        let grid = plain.grid();
        let reread = |(index, block): (usize, &CodedRows)| {
            let rows = CodedRows::rows(grid.height, index).len();
            CodedRows::from_bytes(grid.width, rows, block.bytes().to_vec()).unwrap()
        };
        let blocks = plain.blocks();
        let of_file = blocks.iter().enumerate().map(reread).collect();
        [blocks, of_file].map(|blocks| Environment::from_blocks(grid, blocks).unwrap())
    }

    /// All floats are read, but only those blocks that may have a bright pixel: the lamps, the soft image,
    /// its integral and its energy are the same to the last bit. The image has noise and a short last block.
    #[test]
    fn blocks_that_are_skipped_change_nothing() {
        let (sun, lamp) = (Direction::from_angles(0.4, 2.0), Direction::from_angles(3.0, -1.0));
        let mut state = 1_u32;
        let mut noise = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 8) as f32 / (1 << 24) as f32
        };
        let values: Vec<[f32; 3]> = (0..400 * 200).map(|_| [noise(), noise(), noise()]).collect();
        let grid = LatLong { width: 400, height: 200 };
        let texel = |index: usize| match grid.direction(index / 400, index % 400) {
            d if d.dot(sun) > 0.03_f64.cos() => [9000.0, 6000.0, 3000.1],
            d if d.dot(lamp) > 0.05_f64.cos() => [300.0, 500.0, 700.7],
            _ => values[index],
        };
        let plain = Environment::new(grid, (0..grid.len()).map(texel).collect()).unwrap();
        let before = plain.separate_lamps(Stop::NEVER).unwrap();
        assert!(before.lights.len() >= 2, "{:?}", before.lights);
        let sums = |environment: &Environment| {
            let energy = sh::image_energy_of_rows(grid, environment, Stop::NEVER).unwrap();
            (environment.integral().map(f64::to_bits), energy.map(f64::to_bits))
        };
        // The sums of what is left, added up here.
        let rows = before.soft.pixels().chunks(grid.width);
        let of_rows = rows.map(|row| [0, 1, 2].map(|c| row.iter().fold(0.0, |sum, p| sum + f64::from(p[c]))));
        let integral = of_rows.enumerate().fold([0.0; 3], |all: [f64; 3], (row, sum)| {
            [0, 1, 2].map(|c| all[c] + sum[c] * grid.solid_angle(row))
        });
        let energy = sh::image_energy(grid, before.soft.pixels());
        assert_eq!(sums(&before.soft), (integral.map(f64::to_bits), energy.map(f64::to_bits)));
        for coded in coded(&plain) {
            assert_eq!(sums(&coded), sums(&plain));
            let found = coded.separate_lamps(Stop::NEVER).unwrap();
            assert_eq!(found.lights, before.lights);
            assert_eq!(sums(&found.soft), sums(&before.soft));
            assert_eq!(found.soft.pixels(), before.soft.pixels());
            let read = |of: &Environment| of.map_brighter_rows(200.0, Stop::NEVER, |row, _| row).unwrap();
            assert_eq!(read(&plain).len(), CodedRows::count(200));
            assert_eq!(read(&coded), [0, 160, 192], "the blocks with the sun and the lamp");
        }
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
