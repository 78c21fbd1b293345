//! Maps against the coefficients at each texel's own central direction.

use sh::Stop;
use shrm::{MapGrid, Reflection, Shrm, SynthesisError, Terms, View, frame, into_frame};
use sphere::{Cube, Direction, LatLong};

use crate::materials::reflection;

const GRIDS: [MapGrid; 9] = [
    MapGrid::LatLong(LatLong { width: 16, height: 8 }),
    MapGrid::LatLong(LatLong { width: 14, height: 7 }),
    MapGrid::LatLong(LatLong { width: 5, height: 3 }),
    MapGrid::LatLong(LatLong { width: 1, height: 1 }),
    MapGrid::Cube(Cube { edge: 1 }),
    MapGrid::Cube(Cube { edge: 2 }),
    MapGrid::Cube(Cube { edge: 5 }),
    MapGrid::Cube(Cube { edge: 8 }),
    MapGrid::Cube(Cube { edge: 11 }),
];

/// The largest difference between a local map's texels and the coefficients at their own central directions,
/// relative to the largest coefficient.
fn error(reflection: &Reflection, map: &Shrm) -> f64 {
    let (mut worst, mut largest) = (0.0_f64, 0.0_f64);
    for texel in 0..map.grid().len() {
        let expected = reflection.coefficients(map.grid().direction(texel));
        for (row, expected) in expected.iter().enumerate() {
            let p = row.isqrt();
            let found = match map.terms() {
                Terms::All => map.texel(texel)[row],
                Terms::Zonal if row == p * p + p => map.texel(texel)[p],
                Terms::Zonal => [0.0; 3],
            };
            for channel in 0..3 {
                largest = largest.max(expected[channel].abs());
                let difference = (f64::from(found[channel]) - expected[channel]).abs();
                worst = if difference.is_nan() { f64::INFINITY } else { worst.max(difference) };
            }
        }
    }
    worst / largest.max(1e-300)
}

/// f32 rounds by 6e-8 of a value, in each of four sums.
#[test]
fn every_texel_has_the_coefficients_of_its_own_direction() {
    for (f, p) in [(0, 0), (0, 2), (1, 1), (2, 5), (3, 2), (7, 0), (7, 3), (12, 2), (16, 8), (31, 5), (60, 4)]
    {
        let reflection = reflection(f, p, true);
        for grid in GRIDS {
            let map = reflection.synthesise(grid, View::Local, Stop::NEVER).unwrap();
            let error = error(&reflection, &map);
            assert!(error < 1e-6, "F {f}, P {p}, {grid:?}: {error:e}");
        }
    }
}

#[test]
fn a_material_without_azimuth_keeps_zonal_terms() {
    for (f, p) in [(0, 2), (5, 3), (12, 8)] {
        let reflection = reflection(f, p, false);
        for grid in GRIDS {
            let map = reflection.synthesise(grid, View::Local, Stop::NEVER).unwrap();
            assert_eq!((map.terms(), map.rows()), (Terms::Zonal, p + 1));
            let error = error(&reflection, &map);
            assert!(error < 1e-6, "F {f}, P {p}, {grid:?}: {error:e}");
            let global = reflection.synthesise(grid, View::Global, Stop::NEVER).unwrap();
            assert_eq!((global.terms(), global.rows()), (Terms::All, (p + 1) * (p + 1)));
        }
    }
}

/// A global map's rows are those of a function of V that the local coefficients are at R^-1 V.
#[test]
fn global_coefficients_give_the_same_radiance() {
    for (f, p) in [(3, 0), (6, 1), (9, 4), (12, 8)] {
        let reflection = reflection(f, p, true);
        for grid in [GRIDS[1], GRIDS[6]] {
            let local = reflection.synthesise(grid, View::Local, Stop::NEVER).unwrap();
            let global = reflection.synthesise(grid, View::Global, Stop::NEVER).unwrap();
            assert_eq!(global, local.to_global());
            assert_eq!(global.to_global(), global);
            let (mut a, mut b) = (local.lookup(), global.lookup());
            for texel in 0..grid.len() {
                for k in 0..5 {
                    let view = Direction::from_angles(0.3 + 0.6 * f64::from(k), 2.0 * f64::from(k));
                    let (a, b) = (a.texel(texel, view), b.texel(texel, view));
                    for channel in 0..3 {
                        // Both maps are f32: 6e-8 for each of (P+1)^2 terms of size 1.
                        assert!((a[channel] - b[channel]).abs() < 2e-6, "P {p}, {grid:?}: {a:?} {b:?}");
                    }
                }
            }
        }
    }
}

#[test]
fn a_view_map_holds_the_radiance_of_every_texel() {
    let reflection = reflection(8, 3, true);
    let view = Direction::from_angles(1.0, -0.6);
    for grid in [GRIDS[0], GRIDS[7]] {
        for space in [View::Local, View::Global] {
            let map = reflection.synthesise(grid, space, Stop::NEVER).unwrap().view_map(view);
            for (texel, value) in map.iter().enumerate() {
                let expected = reflection.evaluate(grid.direction(texel), view);
                for channel in 0..3 {
                    assert!((f64::from(value[channel]) - expected[channel]).abs() < 2e-6);
                }
            }
        }
    }
}

#[test]
fn maps_are_the_same_with_any_number_of_threads() {
    let reflection = reflection(12, 2, true);
    for grid in [MapGrid::LatLong(LatLong::with_rows(33)), MapGrid::Cube(Cube { edge: 37 })] {
        for view in [View::Local, View::Global] {
            let with = |threads: usize| {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
                pool.install(|| {
                    let map = reflection.synthesise(grid, view, Stop::NEVER).unwrap();
                    (map.view_map(Direction::X), map)
                })
            };
            assert_eq!(with(1), with(2));
        }
    }
}

#[test]
fn maps_that_cannot_be_are_errors() {
    let reflection = reflection(2, 1, true);
    for grid in [
        MapGrid::Cube(Cube { edge: 0 }),
        MapGrid::LatLong(LatLong { width: 4, height: 0 }),
        MapGrid::LatLong(LatLong { width: 0, height: 4 }),
    ] {
        assert_eq!(reflection.synthesise(grid, View::Local, Stop::NEVER), Err(SynthesisError::Empty(grid)));
    }
    for edge in [1 << 20, usize::MAX] {
        let error =
            reflection.synthesise(MapGrid::Cube(Cube { edge }), View::Local, Stop::NEVER).unwrap_err();
        assert!(matches!(error, SynthesisError::TooLarge { rows: 4, .. }), "{error}");
    }
}

#[test]
fn frames_at_the_poles_have_beta_0() {
    assert_eq!(frame(Direction::Z).matrix(), sphere::DMat3::IDENTITY);
    let reflection = reflection(6, 2, true);
    let map = reflection.synthesise(MapGrid::Cube(Cube { edge: 3 }), View::Local, Stop::NEVER).unwrap();
    // The middle texel of the top face looks along +Z.
    let texel = 2 * 9 + 4;
    assert_eq!(map.grid().direction(texel), Direction::Z);
    let view = Direction::from_angles(0.8, 1.9);
    assert!((into_frame(Direction::Z, view).vector() - view.vector()).length() < 1e-15);
    let expected = reflection.evaluate(Direction::Z, view);
    let found = map.radiance(Direction::Z, view);
    for channel in 0..3 {
        assert!((f64::from(found[channel]) - expected[channel]).abs() < 1e-6);
    }
}
