//! Pictures of light that no environment made: series, and disks of constant radiance.

use std::f64::consts::PI;

use envmap::Environment;
use rayon::prelude::*;
use sh::Lighting;
use sphere::LatLong;

/// The number of rows of the picture of light that has no other.
const ROWS: usize = 256;

/// The number of samples along each side of a texel that the edge of a disk may cross.
const SAMPLES: usize = 4;

/// The environment of light without one. A series that rings is black where it is negative. `None` if a
/// radiance is not finite.
pub(crate) fn image(lighting: &Lighting) -> Option<Environment> {
    let grid = LatLong::with_rows(ROWS);
    let is_dark = lighting.series.coefficients().iter().flatten().all(|value| *value == 0.0);
    let texel = |k: usize| {
        if is_dark {
            return [0.0; 3];
        }
        let direction = grid.direction(k / grid.width, k % grid.width);
        lighting.series.evaluate(direction).map(|value| value.max(0.0) as f32)
    };
    let pixels = (0..grid.len()).into_par_iter().map(texel).collect();
    with_lights(grid, pixels, lighting)
}

/// An environment with the lights of a lighting, and its series where that is positive. `None` if a radiance
/// is not finite.
pub fn lit(environment: &Environment, lighting: &Lighting) -> Option<Environment> {
    let grid = environment.grid();
    let is_dark = lighting.series.coefficients().iter().flatten().all(|value| *value == 0.0);
    let texel = |(k, rgb): (usize, &[f32; 3])| {
        if is_dark {
            return *rgb;
        }
        let added = lighting.series.evaluate(grid.direction(k / grid.width, k % grid.width));
        [0, 1, 2].map(|channel| rgb[channel] + added[channel].max(0.0) as f32)
    };
    let pixels = environment.pixels().par_iter().enumerate().map(texel).collect();
    with_lights(grid, pixels, lighting)
}

/// Adds disks to an image. Each has its whole flux, however few texels it covers.
fn with_lights(grid: LatLong, mut pixels: Vec<[f32; 3]>, lighting: &Lighting) -> Option<Environment> {
    for light in &lighting.lights {
        let centre = light.direction.vector();
        let texel = PI / grid.height as f64;
        let (edge, near) = (math::cos(light.radius), math::cos((light.radius + texel).min(PI)));
        let covered = |k: usize| {
            let (row, column) = (k / grid.width, k % grid.width);
            if grid.direction(row, column).vector().dot(centre) < near {
                return 0.0;
            }
            let inside = (0..SAMPLES * SAMPLES).filter(|sample| {
                let aside = |k: usize| (k as f64 + 0.5) / SAMPLES as f64;
                let theta = texel * (row as f64 + aside(sample / SAMPLES));
                let phi = 2.0 * PI * (0.5 - (column as f64 + aside(sample % SAMPLES)) / grid.width as f64);
                sphere::Direction::from_angles(theta, phi).vector().dot(centre) >= edge
            });
            inside.count() as f64 / (SAMPLES * SAMPLES) as f64
        };
        let mut covered: Vec<(usize, f64)> = (0..grid.len())
            .into_par_iter()
            .map(|k| (k, covered(k)))
            .filter(|(_, share)| *share > 0.0)
            .collect();
        if covered.is_empty() {
            let nearest = |a: &usize, b: &usize| {
                let cosine = |k: usize| grid.direction(k / grid.width, k % grid.width).vector().dot(centre);
                cosine(*a).total_cmp(&cosine(*b))
            };
            covered.extend((0..grid.len()).max_by(nearest).map(|k| (k, 1.0)));
        }
        let solid_angle: f64 =
            covered.iter().map(|(k, share)| share * grid.solid_angle(k / grid.width)).sum();
        let radiance = light.flux().map(|flux| flux / solid_angle);
        for (k, share) in covered {
            (0..3).for_each(|channel| pixels[k][channel] += (radiance[channel] * share) as f32);
        }
    }
    Environment::new(grid, pixels)
}

#[cfg(test)]
mod tests {
    use sh::{Degree, Expansion, Light};
    use sphere::Direction;

    use super::*;

    fn lighting(radius: f64, series: Expansion) -> Lighting {
        let light = Light::from_flux(Direction::from_angles(1.0, 2.0), radius, [3.0, 2.0, 1.0]);
        Lighting { series, lights: vec![light] }
    }

    /// A disk's flux is exact whatever its size: a point, a disk between texels, a large one.
    #[test]
    fn a_disk_keeps_its_flux_and_its_place() {
        for radius in [0.0, 1e-4, 0.02, 0.3, 1.5] {
            let light = lighting(radius, Expansion::zero(Degree::ZERO));
            let image = image(&light).unwrap();
            for (found, expected) in image.integral().into_iter().zip([3.0, 2.0, 1.0]) {
                assert!((found - expected).abs() < 1e-5 * expected, "{radius}: {found}");
            }
            let centre = light.lights[0].direction;
            assert!(
                image.radiance(centre)[0] > 0.0
                    && image.radiance(Direction::normalised(-centre.vector()))[0] == 0.0
            );
        }
    }

    #[test]
    fn a_series_and_an_environment_are_added() {
        let constant = Expansion::from_coefficients(Degree::ZERO, vec![[(4.0 * PI).sqrt(); 3]]).unwrap();
        let grey = image(&lighting(0.1, constant.clone())).unwrap();
        assert!((grey.radiance(Direction::Z)[1] - 1.0).abs() < 1e-6);
        let both = lit(&grey, &Lighting::from(constant)).unwrap();
        assert!((both.radiance(Direction::Z)[1] - 2.0).abs() < 1e-6);
        assert!((both.integral()[1] - grey.integral()[1] - 4.0 * PI).abs() < 1e-4);
        let infinite = Light::from_flux(Direction::Z, 0.1, [f64::INFINITY; 3]);
        let lights = vec![infinite];
        assert_eq!(image(&Lighting { series: Expansion::zero(Degree::ZERO), lights }), None);
    }
}
