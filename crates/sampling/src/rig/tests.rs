use std::f64::consts::FRAC_PI_2;

use envmap::Environment;
use sh::{Degree, Expansion, Lighting};
use sphere::LatLong;

use super::*;
use crate::Error;

fn count(lights: u32) -> NonZeroU32 {
    NonZeroU32::new(lights).unwrap()
}

fn environment(rows: usize, radiance: impl Fn(DVec3) -> [f32; 3]) -> Environment {
    let grid = LatLong::with_rows(rows);
    let looks = |index: usize| grid.direction(index / grid.width, index % grid.width).vector();
    Environment::new(grid, (0..grid.len()).map(|index| radiance(looks(index))).collect()).unwrap()
}

/// A sky above dark ground, and a sun of 3 degrees that holds about half of the light.
fn sunny(rows: usize) -> Environment {
    let sun = Direction::from_angles(0.9, 2.0).vector();
    environment(rows, |w| match w.dot(sun) > 3f64.to_radians().cos() {
        true => [700.0, 600.0, 400.0],
        false => [0.3, 0.5, 1.0].map(|sky: f32| if w.z > 0.0 { sky + 0.4 * w.z as f32 } else { 0.1 }),
    })
}

fn total(lights: &[Light]) -> [f64; 3] {
    lights.iter().fold([0.0; 3], |sum, light| {
        let flux = light.flux();
        std::array::from_fn(|c| sum[c] + flux[c])
    })
}

#[track_caller]
fn assert_close(found: [f64; 3], expected: [f64; 3], tolerance: f64) {
    for c in 0..3 {
        assert!((found[c] - expected[c]).abs() <= tolerance * expected[c].abs(), "{found:?} {expected:?}");
    }
}

#[test]
fn the_lights_together_have_the_flux_of_the_whole() {
    let sky = sunny(64);
    let masses = LightMasses::of_environment(&sky).unwrap();
    assert_close(masses.total(), sky.integral(), 1e-12);
    assert_eq!(masses.negative_share(), 0.0);
    for method in Method::ALL {
        for lights in [1, 2, 3, 7, 64, 500] {
            let rig = rig(&masses, count(lights), method);
            assert!(
                rig.len() <= lights as usize && (method == Method::Warped || rig.len() == lights as usize)
            );
            assert_close(total(&rig), sky.integral(), 1e-12);
            let fluxes: Vec<f64> = rig.iter().map(|light| mean(light.flux())).collect();
            assert!(fluxes.is_sorted_by(|a, b| a >= b) && rig.iter().all(|light| light.radius <= FRAC_PI_2));
        }
    }
}

/// The irradiance of a surface, over the centres of 512 rows of texels.
fn brute_force(sky: &Environment, normal: Direction) -> [f64; 3] {
    let grid = sky.grid();
    let mut sum = [0.0; 3];
    for (index, rgb) in sky.pixels().iter().enumerate() {
        let (row, column) = (index / grid.width, index % grid.width);
        let cosine = grid.direction(row, column).dot(normal).max(0.0) * grid.solid_angle(row);
        (0..3).for_each(|c| sum[c] += f64::from(rgb[c]) * cosine);
    }
    sum
}

#[test]
fn irradiance_tends_to_brute_force_as_lights_are_added() {
    let sky = sunny(128);
    let masses = LightMasses::of_environment(&sky).unwrap();
    let irradiance = Irradiance::of(&masses);
    let normals: Vec<Direction> = (0..40)
        .map(|k| Direction::from_angles((1.0 - (2.0 * f64::from(k) + 1.0) / 40.0).acos(), 2.4 * f64::from(k)))
        .collect();
    let expected: Vec<[f64; 3]> = normals.iter().map(|normal| brute_force(&sky, *normal)).collect();
    for method in Method::ALL {
        let mut errors = Vec::new();
        for lights in [4, 16, 64, 256] {
            let rig = rig(&masses, count(lights), method);
            // The lights as disks, whose parts below the horizon are hidden, and without size.
            let (mut disks, mut points, mut sum) = (0.0, 0.0, 0.0);
            for (normal, expected) in normals.iter().zip(&expected) {
                for c in 0..3 {
                    let disk: f64 = rig.iter().map(|light| light.irradiance_on(*normal)[c]).sum();
                    let cosine = |light: &Light| light.direction.dot(*normal).max(0.0);
                    let point: f64 = rig.iter().map(|light| light.irradiance[c] * cosine(light)).sum();
                    disks += (disk - expected[c]).powi(2);
                    points += (point - expected[c]).powi(2);
                    sum += expected[c];
                }
            }
            let [disks, points] = [disks, points].map(|square| (square * 120.0).sqrt() / sum);
            let told = irradiance.error(&rig);
            assert!((told / points - 1.0).abs() < 0.5, "{method:?} {lights}: {told} {points}");
            errors.push([points, disks]);
        }
        for pair in errors.windows(2) {
            assert!(pair[1][0] < 0.75 * pair[0][0], "{method:?} {errors:?}");
        }
        assert!(errors[3][0] < 0.02 && errors[3][1] < 0.02, "{method:?} {errors:?}");
    }
}

#[test]
fn a_surface_that_sees_a_whole_region_has_its_exact_irradiance() {
    let up = environment(64, |w| if w.z > 0.8 { [1.0 + w.x as f32, 2.0, 3.0] } else { [0.0; 3] });
    let masses = LightMasses::of_environment(&up).unwrap();
    for method in Method::ALL {
        for lights in [1, 5] {
            let rig = rig(&masses, count(lights), method);
            let found = rig.iter().fold([0.0; 3], |sum, light| {
                let rgb = light.irradiance.map(|value| value * light.direction.vector().z);
                std::array::from_fn(|c| sum[c] + rgb[c])
            });
            let exact = masses.irradiance(DVec3::Z);
            assert!((mean(found) / mean(exact) - 1.0).abs() < 1e-12, "{method:?} {found:?} {exact:?}");
        }
    }
}

#[test]
fn a_sun_alone_is_a_disk_of_its_size_in_its_place() {
    let (sun, radius) = (Direction::from_angles(1.1, -0.4), 0.1f64);
    let lit = environment(256, |w| if w.dot(sun.vector()) > radius.cos() { [5.0; 3] } else { [0.0; 3] });
    let masses = LightMasses::of_environment(&lit).unwrap();
    for method in Method::ALL {
        let [light] = rig(&masses, count(1), method)[..] else { panic!("one light") };
        assert!(light.direction.dot(sun) > 0.999_999 && (light.radius - radius).abs() < 2e-3, "{light:?}");
    }
}

#[test]
fn median_cuts_divide_flux_evenly() {
    let smooth = environment(128, |w| [1.0 + 0.8 * w.x as f32, 1.0 + 0.5 * w.z as f32, 1.0]);
    let masses = LightMasses::of_environment(&smooth).unwrap();
    let rig = rig(&masses, count(64), Method::MedianCut);
    let share = |light: &Light| 64.0 * mean(light.flux()) / mean(masses.total());
    assert!(rig.iter().all(|light| (share(light) - 1.0).abs() < 0.1));
}

#[test]
fn there_are_no_more_lights_than_lit_texels() {
    let mut pixels = vec![[0.0; 3]; 128];
    for (texel, radiance) in [(17, 1.0), (40, 2.0), (41, 3.0)] {
        pixels[texel] = [radiance; 3];
    }
    let dots = Environment::new(LatLong::with_rows(8), pixels).unwrap();
    let masses = LightMasses::of_environment(&dots).unwrap();
    for method in Method::ALL {
        let rig = rig(&masses, count(50), method);
        assert_eq!(rig.len(), 3, "{method:?}");
        assert_close(total(&rig), dots.integral(), 1e-12);
    }
}

fn series(rows: &[f64]) -> Lighting {
    let degree = Degree::new(rows.len().isqrt() - 1).unwrap();
    Expansion::from_coefficients(degree, rows.iter().map(|row| [*row; 3]).collect()).unwrap().into()
}

#[test]
fn a_series_is_sampled_by_its_exact_masses() {
    let lamp = Light::from_flux(Direction::X, 0.2, [3.0, 2.0, 1.0]);
    let mut lighting = series(&[2.0, 0.3, 0.5, -0.2]);
    lighting.lights.push(lamp);
    let masses = LightMasses::of_lighting(&lighting).unwrap();
    let whole = (4.0 * PI).sqrt() * 2.0;
    assert_close(masses.total(), [whole + 3.0, whole + 2.0, whole + 1.0], 1e-12);
    let found = total(&rig(&masses, count(32), Method::MedianCut));
    assert_close(found, masses.total(), 1e-12);
    // The vector irradiance of the series is its first band, and that of the lamp is its irradiance.
    let moment: DVec3 = (0..masses.grid().len()).map(|texel| masses.moment_of(texel)).sum();
    let band = DVec3::new(-0.2, 0.3, 0.5) * (4.0 * PI / 3.0).sqrt();
    let expected = band + DVec3::X * mean(lamp.irradiance);
    assert!((moment - expected).length() < 1e-3, "{moment} {expected}");
}

#[test]
fn negative_parts_are_left_out_and_the_whole_is_kept() {
    // 1 + 2 z in units of Y_00: negative below z = -1/2 / sqrt(3) ...
    let masses = LightMasses::of_lighting(&series(&[1.0, 0.0, 2.0, 0.0])).unwrap();
    assert_close(masses.total(), [(4.0 * PI).sqrt(); 3], 1e-12);
    // f = a (1 + b z), b = 2 sqrt(3): -(1 - b)^2 / (2 b) and (1 + b)^2 / (2 b), integrated over z.
    let b = 2.0 * 3f64.sqrt();
    let expected = (b - 1.0).powi(2) / ((b - 1.0).powi(2) + (b + 1.0).powi(2));
    assert!((masses.negative_share() - expected).abs() < 1e-3, "{} {expected}", masses.negative_share());
    // A negative mean: what is positive.
    let masses = LightMasses::of_lighting(&series(&[-0.5, 0.0, 2.0, 0.0])).unwrap();
    assert!(masses.total()[0] > 0.0 && masses.negative_share() > 0.5);
}

#[test]
fn what_cannot_be_sampled_is_an_error() {
    let black = environment(4, |_| [0.0; 3]);
    assert_eq!(LightMasses::of_environment(&black).err(), Some(Error::NoMass));
    assert_eq!(LightMasses::of_lighting(&series(&[-1.0])).err(), Some(Error::NoMass));
    let broken = [(1, 1, -1), (3, 1, 1), (6, 2, 0)];
    for (row, l, m) in broken {
        for value in [f64::NAN, f64::INFINITY] {
            let mut rows = [1.0; 9];
            rows[row] = value;
            let error = LightMasses::of_lighting(&series(&rows)).err();
            let named = matches!(error, Some(Error::NotFinite { l: a, m: b, .. }) if (a, b) == (l, m));
            assert!(named, "{error:?}");
        }
    }
    let mut lighting = series(&[1.0]);
    lighting.lights.push(Light { direction: Direction::Z, radius: 0.1, irradiance: [1.0, f64::NAN, 0.0] });
    assert_eq!(LightMasses::of_lighting(&lighting).err(), Some(Error::LightNotFinite { index: 0 }));
}

#[test]
fn the_number_of_lights_is_doubled_until_the_error_is_small() {
    let masses = LightMasses::of_environment(&sunny(64)).unwrap();
    let found = rig_within(&masses, 0.03, count(1024), Method::MedianCut);
    let counts: Vec<u32> = found.tried.iter().map(|(count, _)| *count).collect();
    assert!(found.error <= 0.03 && counts.len() > 2, "{found:?}");
    assert!(counts.iter().enumerate().all(|(k, count)| *count == 1 << k), "{counts:?}");
    assert!(found.tried[..counts.len() - 1].iter().all(|(_, error)| *error > 0.03));
    assert_eq!(rig_within(&masses, 1e-9, count(8), Method::Warped).tried.len(), 4);
}

#[test]
fn results_do_not_depend_on_the_number_of_threads() {
    let masses = LightMasses::of_environment(&sunny(32)).unwrap();
    let run = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| Method::ALL.map(|method| rig_within(&masses, 0.05, count(64), method)))
    };
    assert_eq!(run(1), run(3));
}
