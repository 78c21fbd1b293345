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

use sh::{Light, Stop, Stopped};
use sphere::{DVec3, Direction, NearestDirection};

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

/// A bright pixel: its radiance above the threshold, times its solid angle.
#[derive(Clone, Copy)]
struct Excess {
    pixel: usize,
    direction: DVec3,
    flux: [f64; 3],
    solid_angle: f64,
}

/// The pixels of a light.
#[derive(Clone, Default)]
struct Group {
    pixels: Vec<Excess>,
}

/// Bright pixels, the brightest first, as groups about centres that are at least `reach` apart, in radians.
fn grouped(bright: &[Excess], reach: f64, stop: Stop<'_>) -> Result<Vec<Group>, Stopped> {
    let far =
        |kept: &[DVec3], direction: DVec3| kept.iter().all(|kept| kept.dot(direction) < math::cos(reach));
    let mut centres: Vec<DVec3> = Vec::new();
    for excess in bright {
        if far(&centres, excess.direction) {
            centres.push(excess.direction);
        }
    }
    let mut groups = nearest(bright, &centres);
    for _ in 0..ROUNDS {
        stop.check()?;
        groups.sort_by(|a, b| mean(b.flux()).total_cmp(&mean(a.flux())));
        centres.clear();
        for group in &groups {
            if far(&centres, group.centre()) {
                centres.push(group.centre());
            }
        }
        groups = nearest(bright, &centres);
    }
    groups.retain(|group| !group.pixels.is_empty());
    Ok(groups)
}

/// Assigns the pixels to the nearest of the centres.
fn nearest(bright: &[Excess], centres: &[DVec3]) -> Vec<Group> {
    let mut groups = vec![Group::default(); centres.len()];
    let centres = NearestDirection::new(centres);
    for excess in bright {
        if let Some(index) = centres.nearest(excess.direction) {
            groups[index].pixels.push(*excess);
        }
    }
    groups
}

impl Environment {
    /// Takes the suns and lamps out of the image. `stop` is asked every few milliseconds.
    ///
    /// # Errors
    /// If it was stopped.
    pub fn separate_lamps(&self, stop: Stop<'_>) -> Result<Separated, Stopped> {
        let (bright, least) = (self.bright(), MIN_FLUX * self.mean());
        let (mut reach, mut groups) = (REACH, Vec::new());
        while reach < std::f64::consts::PI {
            groups = grouped(&bright, reach, stop)?;
            // The pieces of a large lamp may be weak: counted too, they grow with the reach.
            if groups.iter().filter(|group| mean(group.flux()) >= PIECE * least).count() <= MAX_LAMPS {
                break;
            }
            reach *= FARTHER;
        }
        groups.retain(|group| mean(group.flux()) >= least);
        groups.sort_by(|a, b| mean(b.flux()).total_cmp(&mean(a.flux())));

        let threshold = BRIGHTER * self.mean();
        let mut pixels = self.pixels().to_vec();
        for excess in groups.iter().flat_map(|group| &group.pixels) {
            let pixel = &mut pixels[excess.pixel];
            let share = threshold / mean(pixel.map(f64::from));
            *pixel = pixel.map(|value| (f64::from(value) * share) as f32);
        }
        let lights = groups.iter().map(Group::light).collect();
        // The values only became smaller.
        let soft = Self::new(self.grid(), pixels).unwrap_or_else(|| self.clone());
        Ok(Separated { soft, lights })
    }

    /// The mean radiance over the sphere and the three channels.
    fn mean(&self) -> f64 {
        mean(self.integral()) / (4.0 * std::f64::consts::PI)
    }

    /// The bright pixels, the brightest first; of equal ones the first.
    fn bright(&self) -> Vec<Excess> {
        let (grid, threshold) = (self.grid(), BRIGHTER * self.mean());
        let mut bright: Vec<(f64, Excess)> = Vec::new();
        for (row, pixels) in self.pixels().chunks(grid.width).enumerate() {
            let solid_angle = grid.solid_angle(row);
            for (column, rgb) in pixels.iter().enumerate() {
                let rgb = rgb.map(f64::from);
                let radiance = mean(rgb);
                if radiance > threshold && threshold > 0.0 {
                    let flux = rgb.map(|value| value * (1.0 - threshold / radiance) * solid_angle);
                    let direction = grid.direction(row, column).vector();
                    bright.push((
                        radiance,
                        Excess { pixel: row * grid.width + column, direction, flux, solid_angle },
                    ));
                }
            }
        }
        bright.sort_by(|a, b| b.0.total_cmp(&a.0));
        bright.into_iter().map(|(_, excess)| excess).collect()
    }
}

impl Group {
    fn flux(&self) -> [f64; 3] {
        self.pixels.iter().fold([0.0; 3], |sum, excess| std::array::from_fn(|c| sum[c] + excess.flux[c]))
    }

    /// The mean direction, weighted by flux.
    fn centre(&self) -> DVec3 {
        let sum: DVec3 = self.pixels.iter().map(|excess| excess.direction * mean(excess.flux)).sum();
        sum.normalize_or(DVec3::Z)
    }

    fn light(&self) -> Light {
        let weight = |excess: &Excess| mean(excess.flux);
        let total: f64 = self.pixels.iter().map(weight).sum();
        let centre = self.centre();
        // A disk of radius a has the mean square distance a^2 / 2 from its centre; a pixel has its own
        // spread.
        let spread = |excess: &Excess| {
            let apart = (excess.direction - centre).length_squared();
            weight(excess) * (apart + excess.solid_angle / (2.0 * std::f64::consts::PI))
        };
        let square = self.pixels.iter().map(spread).sum::<f64>() / total;
        Light::from_flux(Direction::normalised(centre), (2.0 * square).sqrt().min(1.0), self.flux())
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
