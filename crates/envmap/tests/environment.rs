//! The environment as a function: radiance, rotation, other grids, cube maps.

#![allow(clippy::unwrap_used, clippy::disallowed_methods)] // a test may panic

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use envmap::{Environment, Error};
use proptest::prelude::*;
use sh::Stop;
use sphere::{Cube, DVec3, Direction, Face, LatLong, Rotation};

/// An environment that samples a function at the centres of texels.
fn sampled(grid: LatLong, f: impl Fn(Direction) -> f64) -> Environment {
    let pixels = (0..grid.len())
        .map(|texel| {
            let value = f(grid.direction(texel / grid.width, texel % grid.width));
            [value as f32, 1.0, (2.0 * value) as f32]
        })
        .collect();
    Environment::new(grid, pixels).unwrap()
}

/// Legendre's P_l.
fn legendre(l: usize, x: f64) -> f64 {
    let (mut previous, mut current) = (1.0, x);
    for k in 1..l {
        let next = ((2 * k + 1) as f64 * x * current - k as f64 * previous) / (k + 1) as f64;
        (previous, current) = (current, next);
    }
    if l == 0 { previous } else { current }
}

fn axis() -> Direction {
    Direction::normalised(DVec3::new(0.3, -0.8, 0.45))
}

#[test]
fn an_environment_holds_finite_values_only() {
    let grid = LatLong::with_rows(1);
    assert!(Environment::new(grid, vec![[1.0; 3]; 2]).is_some());
    assert!(Environment::new(grid, vec![[1.0; 3]; 3]).is_none());
    assert!(Environment::new(grid, vec![[1.0; 3], [0.0, f32::INFINITY, 0.0]]).is_none());
    assert!(Environment::new(LatLong::with_rows(0), vec![]).is_none());
    assert!(Environment::new(LatLong { width: usize::MAX, height: 2 }, vec![]).is_none());
}

#[test]
fn radiance_at_a_texel_is_its_value() {
    let grid = LatLong { width: 6, height: 4 };
    let environment = sampled(grid, |w| w.vector().x + 2.0 * w.vector().y - w.vector().z);
    for texel in 0..grid.len() {
        let found = environment.radiance(grid.direction(texel / 6, texel % 6));
        for channel in 0..3 {
            let expected = f64::from(environment.pixels()[texel][channel]);
            assert!((found[channel] - expected).abs() < 1e-13);
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn radiance_is_continuous_over_the_seam_and_the_poles(
        turn in 0.0..TAU, along in 0.0..TAU, width in 1usize..9, height in 1usize..6,
        values in proptest::collection::vec(0.0..1.0f32, 80),
    ) {
        let grid = LatLong { width, height };
        let pixels = values[..grid.len()].iter().map(|&v| [v; 3]).collect();
        let environment = Environment::new(grid, pixels).unwrap();
        // Two points 2e-6 apart on either side of the pole (a step through it), or of the seam.
        let near = |theta: f64, phi: f64| environment.radiance(Direction::from_angles(theta, phi))[0];
        for (a, b) in [
            (near(1e-6, turn), near(1e-6, turn + PI)),
            (near(PI - 1e-6, turn), near(PI - 1e-6, turn + PI)),
            (near(along / 2.0, PI - 1e-6), near(along / 2.0, -PI + 1e-6)),
        ] {
            // Values differ by 1 over half a texel at most; near the pole a texel is no narrower than
            // that in theta.
            prop_assert!((a - b).abs() < 2e-6 * 16.0, "{a} {b}");
        }
    }
}

#[test]
fn the_centre_of_the_image_turns_left_with_a_positive_yaw() {
    let grid = LatLong::with_rows(8);
    let environment = sampled(grid, |w| w.dot(axis()));
    let quarter =
        environment.rotated(Rotation::from_yaw_pitch_roll(FRAC_PI_2, 0.0, 0.0), Stop::NEVER).unwrap();
    for row in 0..8 {
        for column in 0..16 {
            // The pixels at +X are exactly at +Y now, four columns to the left.
            let moved = quarter.pixels()[row * 16 + (column + 12) % 16];
            assert_eq!(moved, environment.pixels()[row * 16 + column]);
        }
    }
    assert_eq!(environment.rotated(Rotation::IDENTITY, Stop::NEVER).as_ref(), Ok(&environment));
    let back = quarter.rotated(Rotation::from_yaw_pitch_roll(-FRAC_PI_2, 0.0, 0.0), Stop::NEVER).unwrap();
    assert_eq!(back, environment);
}

#[test]
fn rotation_dims_degree_l_by_no_more_than_stated() {
    let grid = LatLong::with_rows(128);
    let h = PI / 128.0;
    for (l, yaw, pitch, roll) in
        [(1, 0.3, 0.0, 0.0), (4, 0.01, 0.2, -1.0), (10, 2.0, -1.0, 0.4), (20, 0.5, 1.5, 3.0)]
    {
        let rotation = Rotation::from_yaw_pitch_roll(yaw, pitch, roll);
        let environment = sampled(grid, |w| legendre(l, w.dot(axis())));
        let turned = environment.rotated(rotation, Stop::NEVER).unwrap();
        let there = rotation.apply(axis());
        let bound = (l * (l + 1)) as f64 * h * h / 8.0;
        let (mut worst, mut product, mut square): (f64, f64, f64) = (0.0, 0.0, 0.0);
        for texel in 0..grid.len() {
            let (row, column) = (texel / grid.width, texel % grid.width);
            let (found, w) = (turned.pixels()[texel], grid.direction(row, column));
            assert_eq!(found[1], 1.0);
            let expected = legendre(l, w.dot(there));
            // Polar texels are triangles: their mean belongs to a point g^2 / (12 tan theta) away. The
            // gradient of P_l is l (l + 1) / 2 at most.
            let shift = (h * h / (12.0 * grid.theta(row).tan().abs())) * (l * (l + 1)) as f64 / 2.0;
            worst = worst.max((f64::from(found[0]) - expected).abs() / (2.0 * bound + shift));
            product += f64::from(found[0]) * expected * grid.solid_angle(row);
            square += expected * expected * grid.solid_angle(row);
        }
        let loss = 1.0 - product / square;
        eprintln!(
            "degree {l}: dimmed by {loss:.2e}, stated {bound:.2e}; worst point {worst:.2} of its bound"
        );
        // Where a point falls on texel centres the error varies around the mean, up to h^2 / 8 twice.
        assert!(worst < 1.0, "degree {l}");
        assert!(loss > 0.0 && loss < bound, "degree {l}: {loss}");
    }
}

#[test]
fn a_turned_sun_keeps_its_energy() {
    let grid = LatLong::with_rows(64);
    for (row, column) in [(0, 5), (1, 77), (30, 0), (31, 64), (63, 127)] {
        let mut pixels = vec![[0.0; 3]; grid.len()];
        pixels[row * grid.width + column] = [1e5, 3.0, 0.0];
        let environment = Environment::new(grid, pixels).unwrap();
        for k in 0..8 {
            let rotation = Rotation::from_yaw_pitch_roll(0.3 * f64::from(k), 0.2 + 0.37 * f64::from(k), 0.1);
            let turned = environment.rotated(rotation, Stop::NEVER).unwrap();
            let (was, is) = (environment.integral(), turned.integral());
            for channel in 0..2 {
                assert!((is[channel] / was[channel] - 1.0).abs() < 2e-7, "{row} {column}: {was:?} {is:?}");
            }
            // The brightest texel holds the turned direction, or touches the one that does.
            let brightest = (0..grid.len())
                .max_by(|&a, &b| turned.pixels()[a][0].total_cmp(&turned.pixels()[b][0]))
                .unwrap();
            let away = grid
                .direction(brightest / grid.width, brightest % grid.width)
                .dot(rotation.apply(grid.direction(row, column)));
            assert!(away.clamp(-1.0, 1.0).acos() < PI / 64.0, "{row} {column}");
        }
    }
}

#[test]
fn downsampling_keeps_the_integral() {
    let grid = LatLong { width: 48, height: 30 };
    let environment = sampled(grid, |w| (5.0 * w.dot(axis())).exp());
    for onto in [
        LatLong { width: 24, height: 10 },
        LatLong { width: 7, height: 11 },
        LatLong { width: 1, height: 1 },
        LatLong { width: 50, height: 31 },
    ] {
        let small = environment.downsampled(onto).unwrap();
        assert_eq!(small.grid(), onto);
        for channel in 0..3 {
            let kept = small.integral()[channel] / environment.integral()[channel] - 1.0;
            assert!(kept.abs() < 1e-7, "{onto:?}: {kept:e}");
        }
    }
    assert_eq!(environment.downsampled(grid).unwrap(), environment);
    // A mean over four equal columns and two rows, by their solid angles.
    let half = environment.downsampled(LatLong { width: 12, height: 15 }).unwrap();
    let mut sum = 0.0;
    for row in 4..6 {
        for column in 8..12 {
            sum += f64::from(environment.pixels()[row * 48 + column][0]) * grid.solid_angle(row);
        }
    }
    let expected = sum / LatLong { width: 12, height: 15 }.solid_angle(2);
    assert!((f64::from(half.pixels()[2 * 12 + 2][0]) / expected - 1.0).abs() < 1e-7);
    let error = environment.downsampled(LatLong { width: 0, height: 1 }).unwrap_err();
    assert!(matches!(error, Error::Resolution { .. }));
}

#[test]
fn a_finer_grid_is_interpolated() {
    let environment = sampled(LatLong::with_rows(64), |w| w.dot(axis()));
    let fine = environment.resized(LatLong::with_rows(150)).unwrap();
    let (h, g) = (PI / 64.0, PI / 150.0);
    for texel in 0..fine.grid().len() {
        let w = fine.grid().direction(texel / 300, texel % 300);
        // First and second derivatives of a cosine are 1 at most; the mean of a polar texel is a triangle's.
        let bound = h * h / 4.0 + g * g / 12.0 + g * g / (12.0 * w.theta().tan().abs());
        assert!((f64::from(fine.pixels()[texel][0]) - w.dot(axis())).abs() < bound);
    }
}

#[test]
fn exposure_is_a_power_of_two() {
    let environment = sampled(LatLong::with_rows(4), |w| 1.0 + w.vector().x);
    let brighter = environment.exposed(1.5).unwrap();
    for (before, after) in environment.pixels().iter().zip(brighter.pixels()) {
        for channel in 0..3 {
            let expected = f64::from(before[channel]) * 2.0_f64.powf(1.5);
            assert!((f64::from(after[channel]) - expected).abs() <= expected * 6e-8);
        }
    }
    assert_eq!(environment.exposed(0.0).unwrap(), environment);
    assert!(environment.exposed(200.0).is_none());
    assert!(environment.exposed(f64::NAN).is_none());
}

#[test]
fn a_cube_map_shows_the_environment() {
    let environment = sampled(LatLong::with_rows(128), |w| legendre(3, w.dot(axis())));
    for edge in [1, 5, 32, 100] {
        let map = environment.cube_map(Cube { edge }).unwrap();
        let (h, g) = (PI / 128.0, 2.0 / edge as f64);
        // P_3 has derivatives of 6 at most; texels of the coarsest cubes are no longer small.
        let bound = ((h * h + g * g / 3.0) / 4.0 * 12.0).max(1e-6);
        let mut sum = 0.0;
        for (k, face) in Face::ALL.into_iter().enumerate() {
            for row in 0..edge {
                for column in 0..edge {
                    let pixel = map.pixels()[(k * edge + row) * edge + column];
                    let expected = legendre(3, Cube { edge }.direction(face, row, column).dot(axis()));
                    assert!((f64::from(pixel[0]) - expected).abs() < bound, "{edge} {face:?} {row} {column}");
                    assert_eq!(pixel[1], 1.0);
                    sum += f64::from(pixel[0]) * Cube { edge }.solid_angle(row, column);
                }
            }
        }
        // P_3 integrates to 0 over the sphere.
        assert!(sum.abs() < 1e-3, "{edge}: {sum}");
    }
    assert!(environment.cube_map(Cube { edge: 0 }).is_err());
    assert!(environment.cube_map(Cube { edge: usize::MAX }).is_err());
    let back = environment.cube_map(Cube { edge: 64 }).unwrap();
    let back = Environment::from_cube_map(&back, environment.grid()).unwrap();
    for (a, b) in back.pixels().iter().zip(environment.pixels()) {
        // Two blurs of texels of 2 / 64 at most.
        assert!((a[0] - b[0]).abs() < 0.02, "{a:?} {b:?}");
    }
}
