//! Taking given lights out of an environment.
//!
//! A light that shines beside the image, or as a light of the renderer's own, must not be in the image too.
//! Each light takes its flux from the texels within a circle about its direction, the strongest light first:
//! what is above a level is cut off, per channel, and the level is the one at which exactly the light's flux
//! is cut. So its brightest texels go first, and what remains is even.
//!
//! The circle has twice the light's angular radius (a disk with the spread of a Gaussian has twice its
//! standard deviation as its radius). If the level would be below the mean of the ring around the circle, the
//! circle grows to at most [`WIDEST`] radii: a light may be a little larger than its disk. After that it
//! grows only if the circle has less light than the light itself.

use std::collections::BTreeMap;
use std::f64::consts::PI;

use sh::Light;
use sphere::{DVec3, Direction};

use crate::Environment;

/// Raised when the results of this kernel change: every kind of stage that calls it adds this to its own
/// revision.
pub const REVISION: u32 = 1;

/// The radius of the first circle, in radii of the light.
const CIRCLE: f64 = 2.0;

/// The widest circle that is tried for the sake of an even level, in radii of the light.
const WIDEST: f64 = 4.0;

/// The factor by which circles grow, and the width of the ring around them.
const STEP: f64 = 1.25;

/// An environment whose lights were taken out.
#[derive(Clone, Debug)]
pub struct WithoutLights {
    /// The image without the lights.
    pub rest: Environment,
    /// The light that was taken out, RGB: the integral of the difference. It is less than the flux of the
    /// lights if these have more light than the image.
    pub taken: [f64; 3],
}

impl Environment {
    /// The environment without these lights: `rest` and the lights have the integral of the environment, up
    /// to the rounding of 32-bit texels, if it has as much light as they.
    ///
    /// No texel becomes brighter, or negative unless it was.
    ///
    /// # Example: a light of half of the sky's flux leaves the other half
    /// ```
    /// use std::f64::consts::PI;
    /// let grid = sphere::LatLong::with_rows(16);
    /// let sky = envmap::Environment::new(grid, vec![[1.0; 3]; grid.len()]).expect("all texels");
    /// let light = sh::Light::from_flux(sphere::Direction::Z, PI / 4.0, [2.0 * PI; 3]);
    /// let rest = sky.without_lights(&[light]).rest;
    /// assert!((rest.integral()[0] - 2.0 * PI).abs() < 1e-4);
    /// ```
    pub fn without_lights(&self, lights: &[Light]) -> WithoutLights {
        let grid = self.grid();
        let mut cut = BTreeMap::new();
        let mut strongest: Vec<&Light> = lights.iter().collect();
        strongest.sort_by(|a, b| sum(b.flux()).total_cmp(&sum(a.flux())));
        for light in strongest {
            let texel = math::hypot(PI / grid.height as f64, 2.0 * PI / grid.width as f64);
            let radius = light.radius.max(texel);
            let mut circle = CIRCLE * radius;
            let mut levels = [0.0; 3];
            loop {
                let flux = light.flux();
                let within = self.circle(&cut, light.direction, 0.0..circle);
                let ring = self.circle(&cut, light.direction, circle..STEP * circle);
                let mut grow = false;
                for c in 0..3 {
                    let level = level(&within, c, flux[c]);
                    let area: f64 = ring.iter().map(|texel| texel.solid_angle).sum();
                    let around =
                        ring.iter().map(|texel| texel.rgb[c] * texel.solid_angle).sum::<f64>() / area;
                    grow |= level.is_none()
                        || (level.is_some_and(|level| level < 0.99 * around)
                            && STEP * circle <= WIDEST * radius);
                    levels[c] = level.unwrap_or(0.0);
                }
                if !grow || circle >= PI {
                    break;
                }
                circle = (STEP * circle).min(PI);
            }
            for texel in self.circle(&cut, light.direction, 0.0..circle) {
                let rgb: [f32; 3] = std::array::from_fn(|c| {
                    let value = texel.rgb[c];
                    if value > levels[c] { levels[c] as f32 } else { value as f32 }
                });
                if rgb.map(f64::from) != texel.rgb {
                    cut.insert(texel.index, rgb);
                }
            }
        }
        let before = self.integral();
        // The values only became smaller, and stay finite.
        let rest = self.replaced(cut.into_iter().collect());
        let after = rest.integral();
        WithoutLights { rest, taken: std::array::from_fn(|c| before[c] - after[c]) }
    }

    /// The texels at these angles from a direction, of which some have been cut already.
    fn circle(&self, cut: &Cut, centre: Direction, angles: std::ops::Range<f64>) -> Vec<Texel> {
        let grid = self.grid();
        let row_of = |theta: f64| (theta.clamp(0.0, PI) / PI * grid.height as f64) as usize;
        let (first, last) = (row_of(centre.theta() - angles.end), row_of(centre.theta() + angles.end));
        let least = if angles.end >= PI { -2.0 } else { math::cos(angles.end) };
        let most = if angles.start <= 0.0 { 2.0 } else { math::cos(angles.start.min(PI)) };
        let rows = first..(last + 1).min(grid.height);
        let mut scratch = Vec::new();
        let pixels = self.rows(rows.clone(), &mut scratch);
        let mut texels = Vec::new();
        for row in rows.clone() {
            let (solid_angle, (sine, z)) = (grid.solid_angle(row), math::sin_cos(grid.theta(row)));
            for column in 0..grid.width {
                let (y, x) = math::sin_cos(grid.phi(column));
                let cosine = centre.vector().dot(DVec3::new(sine * x, sine * y, z));
                if cosine > least && cosine <= most {
                    let index = row * grid.width + column;
                    let rgb = cut.get(&(index as u32)).unwrap_or(&pixels[index - rows.start * grid.width]);
                    texels.push(Texel { index: index as u32, solid_angle, rgb: rgb.map(f64::from) });
                }
            }
        }
        texels
    }
}

/// The texels that lights have been cut from, by their numbers.
type Cut = BTreeMap<u32, [f32; 3]>;

/// A texel in a circle.
struct Texel {
    index: u32,
    solid_angle: f64,
    rgb: [f64; 3],
}

/// The level, at least 0, above which the texels have this flux in a channel; `None` if all of their light is
/// less.
fn level(texels: &[Texel], channel: usize, flux: f64) -> Option<f64> {
    if flux <= 0.0 {
        return Some(f64::INFINITY);
    }
    let mut values: Vec<(f64, f64)> = texels
        .iter()
        .map(|texel| (texel.rgb[channel], texel.solid_angle))
        .filter(|(value, _)| *value > 0.0)
        .collect();
    values.sort_by(|a, b| b.0.total_cmp(&a.0));
    let (mut light, mut area) = (0.0, 0.0);
    for (index, (value, solid_angle)) in values.iter().enumerate() {
        light += value * solid_angle;
        area += solid_angle;
        let level = (light - flux) / area;
        let next = values.get(index + 1).map_or(0.0, |next| next.0);
        if level >= next {
            return Some(level);
        }
    }
    None
}

fn sum(rgb: [f64; 3]) -> f64 {
    rgb.iter().sum()
}

#[cfg(test)]
mod tests {
    use sh::Stop;
    use sphere::LatLong;

    use super::*;

    fn sky(rows: usize, radiance: impl Fn(Direction) -> [f32; 3]) -> Environment {
        let grid = LatLong::with_rows(rows);
        let texels = (0..grid.len()).map(|k| radiance(grid.direction(k / grid.width, k % grid.width)));
        Environment::new(grid, texels.collect()).unwrap()
    }

    fn flux(lights: &[Light]) -> [f64; 3] {
        lights.iter().fold([0.0; 3], |all, light| {
            let flux = light.flux();
            std::array::from_fn(|c| all[c] + flux[c])
        })
    }

    #[track_caller]
    fn assert_whole(before: &Environment, after: &WithoutLights, lights: &[Light]) {
        let (whole, rest, flux) = (before.integral(), after.rest.integral(), flux(lights));
        for c in 0..3 {
            assert!((rest[c] + flux[c] - whole[c]).abs() < 2e-6 * whole[c], "{whole:?} {rest:?} {flux:?}");
            assert!((after.taken[c] - flux[c]).abs() < 2e-6 * whole[c], "{after:?}");
        }
        let pixels = before.pixels().as_flattened().iter().zip(after.rest.pixels().as_flattened());
        assert!(pixels.clone().all(|(before, after)| after <= before && *after >= 0.0));
    }

    /// Two lamps whose light was found by another way: the image is as soft as the one that is left there.
    #[test]
    fn lamps_that_were_found_in_an_image_are_taken_out_of_it() {
        let suns = [(0.9, 2.0, 0.028), (1.4, -1.0, 0.02)]
            .map(|(theta, phi, radius): (f64, f64, f64)| (Direction::from_angles(theta, phi), radius));
        let lit = sky(256, |d| {
            let sun = suns.iter().any(|(sun, radius)| d.dot(*sun) > radius.cos());
            if sun { [3000.0, 2000.0, 1000.0] } else { [1.0, 0.9 + 0.1 * d.vector().z as f32, 0.8] }
        });
        let separated = lit.separate_lamps(Stop::NEVER).unwrap();
        assert_eq!(separated.lights.len(), 2);
        let without = lit.without_lights(&separated.lights);
        assert_whole(&lit, &without, &separated.lights);
        let most = |image: &Environment| image.pixels().iter().map(|rgb| rgb[0]).fold(0.0, f32::max);
        assert!(
            most(&without.rest) < 1.02 * most(&separated.soft),
            "{} {}",
            most(&without.rest),
            most(&separated.soft)
        );
        // Nothing around the lamps is darker than the sky.
        let least = without.rest.pixels().iter().map(|rgb| rgb[0]).fold(f32::INFINITY, f32::min);
        assert_eq!(least, 1.0);
    }

    #[test]
    fn lights_of_all_the_light_leave_nothing() {
        let even = sky(32, |d| [1.0, 2.0 + d.vector().x as f32, 0.5]);
        let whole = even.integral();
        let half = |direction| Light::from_flux(direction, 1.0, whole.map(|value| 0.5 * value));
        let lights = [half(Direction::X), half(Direction::normalised(-DVec3::X))];
        let without = even.without_lights(&lights);
        assert_whole(&even, &without, &lights);
        assert!(without.rest.integral()[0].abs() < 2e-6 * whole[0]);
    }

    #[test]
    fn no_more_is_taken_than_there_is() {
        let dim = sky(16, |_| [0.1; 3]);
        let without = dim.without_lights(&[Light::from_flux(Direction::Z, 0.1, [100.0, 0.0, 0.1])]);
        assert_eq!(without.rest.integral()[0], 0.0);
        assert_eq!(without.rest.integral()[1], dim.integral()[1]);
        assert!((without.taken[2] - 0.1).abs() < 1e-6);
        let none = dim.without_lights(&[]);
        assert_eq!((none.rest.pixels(), none.taken), (dim.pixels(), [0.0; 3]));
    }

    #[test]
    fn a_lamp_at_the_seam_and_one_at_the_pole_leave_even_skies() {
        for lamp in [Direction::from_angles(1.2, PI), Direction::Z] {
            let lit = sky(128, |d| if d.dot(lamp) > 0.1f64.cos() { [50.0; 3] } else { [2.0; 3] });
            let excess = lit.integral()[0] - 8.0 * PI;
            let light = Light::from_flux(lamp, 0.1, [excess; 3]);
            let without = lit.without_lights(&[light]);
            assert_whole(&lit, &without, &[light]);
            assert!(without.rest.pixels().iter().all(|rgb| (rgb[0] - 2.0).abs() < 1e-3));
        }
    }
}
