//! Explicit maps from spherical harmonic reflection maps and back.

#![allow(clippy::unwrap_used, clippy::disallowed_methods)] // a test may panic

use std::f64::consts::{PI, TAU};

use brdf::{BrdfCoefficients, Centre};
use sh::{Degree, Expansion, Stop};
use shrm::{
    FitError, MapGrid, MapViews, Reflection, Shrm, Terms, View, ViewSet, azimuthal_share, fit_angles,
    fit_views, frame, from_sphere_maps, icosahedron, sphere_map_axes, sphere_map_rows, sphere_maps,
};
use sphere::{Cube, Direction, LatLong, MirrorBall};

const GRIDS: [MapGrid; 2] =
    [MapGrid::LatLong(LatLong { width: 10, height: 6 }), MapGrid::Cube(Cube { edge: 4 })];

/// Values are sums of some 50 coefficients up to 1 with factors up to 1, kept as f32: 6e-8 of numbers up to
/// 10.
const F32: f64 = 2e-6;

fn view_set(map: &Shrm, views: MapViews) -> ViewSet {
    ViewSet::from_shrm(map, views, Stop::NEVER).unwrap().unwrap()
}

fn cabral(map: &Shrm) -> ViewSet {
    view_set(map, MapViews::Icosahedron)
}

fn view_maps(map: &Shrm, side: usize) -> ViewSet {
    view_set(map, MapViews::Table { side, view: map.view() })
}

/// Numbers in [-1, 1] that look random, the same each time.
fn noise() -> impl FnMut() -> f64 {
    let mut state = 0x9e37_79b9_7f4a_7c15_u64;
    move || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }
}

/// A reflection of degrees F = 5 and P by a BRDF with terms up to |q| = `azimuth`.
fn reflection(p: usize, azimuth: usize) -> Reflection {
    let (f, mut next) = (Degree::new(5).unwrap(), noise());
    let rows = (0..f.rows()).map(|_| [next(), next(), next()]).collect();
    let lighting = Expansion::from_coefficients(f, rows).unwrap();
    let mut rho = Vec::new();
    for l in 0..=5 {
        for k in 0..(p + 1) * (p + 1) {
            let (p, q) = (k / (p + 1), k % (p + 1));
            let value = [next(), next(), next()].map(|v| v / (1.0 + p as f64));
            rho.push(if q <= l && q <= p && q <= azimuth { value } else { [0.0; 3] });
        }
    }
    let brdf = BrdfCoefficients::new(Centre::Reflection, f, Degree::new(p).unwrap(), rho).unwrap();
    Reflection::convolve(&lighting, &brdf)
}

/// The local map, texel by texel from the reflection's own coefficients.
fn map(reflection: &Reflection, grid: MapGrid) -> Shrm {
    let coefficients = (0..grid.len()).flat_map(|texel| reflection.coefficients(grid.direction(texel)));
    let values = coefficients.map(|row| row.map(|v| v as f32)).collect();
    Shrm::new(grid, View::Local, Centre::Reflection, reflection.brdf().p(), Terms::All, values).unwrap()
}

fn difference<A: Copy + Into<f64>, B: Copy + Into<f64>>(a: &[[A; 3]], b: &[[B; 3]]) -> f64 {
    assert_eq!(a.len(), b.len());
    let pairs = a.as_flattened().iter().zip(b.as_flattened());
    pairs.map(|(&a, &b)| (a.into() - b.into()).abs()).fold(0.0, f64::max)
}

#[test]
fn cabrals_maps_are_the_reflection_seen_from_the_vertices() {
    for grid in GRIDS {
        let reflection = reflection(3, 3);
        let local = map(&reflection, grid);
        for cabral in [cabral(&local), cabral(&local.to_global())] {
            for (k, vertex) in icosahedron::vertices().into_iter().enumerate() {
                let expected: Vec<_> =
                    (0..grid.len()).map(|texel| reflection.evaluate(grid.direction(texel), vertex)).collect();
                assert!(difference(cabral.map(k), &expected) < F32);
                let found = cabral.radiance(grid.direction(7), vertex);
                assert!(difference(&[found], &[expected[7]]) < F32);
            }
        }
    }
}

/// Weights at the middle of an edge are a half each.
#[test]
fn between_two_vertices_cabrals_maps_are_averaged() {
    let grid = GRIDS[1];
    let cabral = cabral(&map(&reflection(2, 2), grid));
    let [a, b, ..] = icosahedron::vertices();
    let middle = Direction::normalised(a.vector() + b.vector());
    let found = cabral.radiance(grid.direction(3), middle);
    let mean = [0, 1, 2].map(|c| (cabral.map(0)[3][c] + cabral.map(1)[3][c]) / 2.0);
    assert!(difference(&[found], &[mean]) < 1e-6);
}

#[test]
fn twelve_views_hold_a_global_map_of_degree_2() {
    for (p, grid) in [(0, GRIDS[0]), (1, GRIDS[0]), (2, GRIDS[0]), (2, GRIDS[1])] {
        let local = map(&reflection(p, p), grid);
        let cabral = cabral(&local);
        let fit = cabral.fit(None).unwrap();
        assert_eq!((fit.map.p().get(), fit.map.view(), fit.map.terms()), (2, View::Global, Terms::All));
        // A design of degree 5: the harmonics up to degree 2 are orthogonal on it.
        assert!((fit.condition - 1.0).abs() < 1e-12 && fit.residual < 1e-7, "{fit:?}");
        let same = cabral.fit(Some(local.p())).unwrap();
        let error = difference(same.map.values(), local.to_global().values());
        assert!(error < F32, "P = {p}: {error:e}");
    }
    let failure = cabral(&map(&reflection(2, 2), GRIDS[0])).fit(Degree::new(3).ok()).unwrap_err();
    assert_eq!(failure.to_string(), "degree P = 3 has 16 coefficients, more than 12 views determine");
}

/// Degree 3 is orthogonal to degrees 0 to 2 on the vertices (their products have degree 5): what is lost is
/// the residual.
#[test]
fn twelve_views_lose_degree_3_and_say_how_much() {
    let local = map(&reflection(3, 3), GRIDS[1]);
    let fit = cabral(&local).fit(None).unwrap();
    let global = local.to_global();
    let kept: Vec<_> = (0..global.grid().len()).flat_map(|texel| global.texel(texel)[..9].to_vec()).collect();
    assert!(difference(fit.map.values(), &kept) < F32);
    assert!(fit.residual > 0.05 && fit.residual < 0.9, "{}", fit.residual);
    // The residual is what degree 3 has at the vertices, over all that is there.
    let cabral = cabral(&local);
    let (mut left, mut all) = (0.0, 0.0);
    for (k, vertex) in icosahedron::vertices().into_iter().enumerate() {
        let fitted = fit.map.view_map(vertex);
        for texel in 0..fitted.len() {
            for channel in 0..3 {
                let value = f64::from(cabral.map(k)[texel][channel]);
                let solid_angle = local.grid().solid_angle(texel);
                left += solid_angle * (value - f64::from(fitted[texel][channel])).powi(2);
                all += solid_angle * value.powi(2);
            }
        }
    }
    assert!((fit.residual / f64::sqrt(left / all) - 1.0).abs() < 1e-5);
}

/// The mean over phi_o by 16 points, exact for |q| <= 3, against the slices; from local and global maps.
#[test]
fn slices_are_the_mean_around_the_central_direction() {
    let slices = MapViews::even_angles(5);
    let angles = slices.angles();
    assert_eq!((angles[0], angles[2], angles[4]), (0.0, PI / 2.0, PI));
    for grid in GRIDS {
        let reflection = reflection(3, 3);
        let local = map(&reflection, grid);
        for map in [local.to_global(), local] {
            let texture = view_set(&map, slices.clone());
            for (k, &angle) in angles.iter().enumerate() {
                for texel in (0..grid.len()).step_by(7) {
                    let central = grid.direction(texel);
                    let mut mean = [0.0; 3];
                    for step in 0..16 {
                        let outgoing = Direction::from_angles(angle, TAU * f64::from(step) / 16.0);
                        let value = reflection.evaluate(central, frame(central).apply(outgoing));
                        (0..3).for_each(|channel| mean[channel] += value[channel] / 16.0);
                    }
                    assert!(difference(&[texture.map(k)[texel]], &[mean]) < F32);
                    // At a texel and the angle of a slice, nothing is interpolated.
                    let view = frame(central).apply(Direction::from_angles(angle, 1.0));
                    assert!(difference(&[texture.radiance(central, view)], &[mean]) < 2.0 * F32);
                }
            }
        }
    }
}

#[test]
fn between_slices_the_texture_is_linear() {
    let grid = GRIDS[0];
    let slices = [1.0, 3.0].iter().flat_map(|&value| vec![[value; 3]; grid.len()]).collect();
    let angles = |angles: [f64; 2]| MapViews::Angles(angles.into());
    let texture = ViewSet::new(angles([0.5, 1.5]), grid, Centre::Reflection, slices).unwrap();
    for (angle, expected) in [(0.0, 1.0), (0.5, 1.0), (0.75, 1.5), (1.5, 3.0), (3.0, 3.0)] {
        let found = texture.radiance(Direction::Z, Direction::from_angles(angle, 0.3));
        assert!(difference(&[found], &[[expected; 3]]) < 1e-6, "{angle}: {found:?}");
    }
    assert_eq!(ViewSet::new(angles([1.0, 1.0]), grid, Centre::Reflection, vec![[0.0; 3]; 120]), None);
}

#[test]
fn a_texture_holds_a_zonal_map_and_no_other() {
    for grid in GRIDS {
        let zonal = map(&reflection(4, 0), grid);
        let share = |map: &Shrm| azimuthal_share(map, None, Stop::NEVER).unwrap();
        assert!(share(&zonal) < 1e-12);
        let texture = view_set(&zonal, MapViews::even_angles(7));
        assert_eq!(texture.fit(None).unwrap().map.p().get(), 6);
        let fit = texture.fit(Some(zonal.p())).unwrap();
        assert_eq!((fit.map.view(), fit.map.terms(), fit.map.rows()), (View::Local, Terms::Zonal, 5));
        let kept: Vec<_> =
            (0..grid.len()).flat_map(|texel| (0..=4).map(move |p| (texel, p * p + p))).collect();
        let kept: Vec<_> = kept.into_iter().map(|(texel, row)| zonal.texel(texel)[row]).collect();
        assert!(difference(fit.map.values(), &kept) < F32 && fit.residual < 1e-6, "{}", fit.residual);
        // What q > 0 holds, counted from the coefficients.
        let whole = map(&reflection(4, 4), grid);
        let (mut lost, mut all) = (0.0, 0.0);
        for texel in 0..grid.len() {
            for (row, value) in whole.texel(texel).iter().enumerate() {
                let energy: f64 = value.iter().map(|&v| f64::from(v).powi(2)).sum();
                let p = (row as f64).sqrt() as usize;
                lost += grid.solid_angle(texel) * if row == p * p + p { 0.0 } else { energy };
                all += grid.solid_angle(texel) * energy;
            }
        }
        assert!(lost / all > 0.1);
        assert!((share(&whole) - lost / all).abs() < 1e-9);
        assert!((share(&whole.to_global()) - lost / all).abs() < 1e-6);
    }
}

#[test]
fn a_table_holds_the_map_at_its_views() {
    for grid in GRIDS {
        let reflection = reflection(3, 3);
        let local = map(&reflection, grid);
        for map in [local.to_global(), local] {
            let table = view_maps(&map, 5);
            let mut lookup = map.lookup();
            for (k, view) in table.views().directions().into_iter().enumerate() {
                for texel in (0..grid.len()).step_by(5) {
                    let central = grid.direction(texel);
                    let world = map.view().to_world(central, view);
                    let expected = reflection.evaluate(central, world);
                    assert!(difference(&[table.map(k)[texel]], &[expected]) < F32);
                    assert!(difference(&[table.map(k)[texel]], &[lookup.texel(texel, world)]) < F32);
                    assert!(difference(&[table.radiance(central, world)], &[expected]) < 2.0 * F32);
                }
            }
        }
    }
    let local = map(&reflection(1, 1), GRIDS[0]);
    for (side, view) in [(0, View::Local), (2, View::Global)] {
        let none = ViewSet::from_shrm(&local, MapViews::Table { side, view }, Stop::NEVER);
        assert_eq!(none, Ok(None), "no view, or those of another frame");
    }
}

/// A zonal map keeps P + 1 rows; its table is that of the map with the zeros.
#[test]
fn zonal_maps_make_the_same_table() {
    let grid = GRIDS[0];
    let all = map(&reflection(3, 0), grid);
    let rows = (0..grid.len()).flat_map(|texel| (0..=3).map(move |p| (texel, p * p + p)));
    let values = rows.map(|(texel, row)| all.texel(texel)[row]).collect();
    let zonal = Shrm::new(grid, View::Local, Centre::Reflection, all.p(), Terms::Zonal, values).unwrap();
    let (a, b) = (view_maps(&all, 4), view_maps(&zonal, 4));
    assert!(difference(a.maps(), b.maps()) < F32);
    let (a, b) = (cabral(&all), cabral(&zonal));
    assert!(difference(a.maps(), b.maps()) < F32);
}

#[test]
fn a_table_of_t_views_holds_half_as_many_degrees() {
    for (side, p) in [(1, 0), (2, 0), (3, 1), (4, 1), (5, 2), (6, 2), (7, 3), (8, 3), (9, 4)] {
        let local = map(&reflection(p, p), GRIDS[1]);
        for map in [local.to_global(), local] {
            let table = view_maps(&map, side);
            let most = table.fit(None).unwrap();
            assert!(most.map.p().get() == p && most.residual < 1e-6, "T = {side}");
            let fit = table.fit(Some(map.p())).unwrap();
            assert_eq!((fit.map.view(), fit.map.terms()), (map.view(), Terms::All));
            let error = difference(fit.map.values(), map.values());
            assert!(error < F32 * fit.condition && fit.residual < 1e-6, "T = {side}: {error:e}");
        }
    }
}

#[test]
fn a_fit_that_is_not_determined_is_an_error() {
    let grid = GRIDS[0];
    let fit = |views: &[Direction], maps: &[[f32; 3]], p: usize| {
        fit_views(grid, Centre::Normal, View::Global, views, maps, Degree::new(p).ok())
    };
    let circle: Vec<_> = (0..12).map(|k| Direction::from_angles(1.0, 0.5 * f64::from(k))).collect();
    let black = vec![[0.0; 3]; 12 * grid.len()];
    // Views on one circle do not determine the degrees of q = 0.
    assert!(matches!(
        fit(&circle, &black, 2).unwrap_err(),
        FitError::Undetermined { p: 2, views: 12, condition } if condition.is_infinite()
    ));
    assert_eq!(
        fit(&circle, &black[1..], 0).unwrap_err(),
        FitError::Count { found: 719, views: 12, texels: 60 }
    );
    let mut bad = black.clone();
    bad[60 + 7][1] = f32::NAN;
    assert!(matches!(fit(&circle, &bad, 0).unwrap_err(), FitError::NotFinite { map: 1, texel: 7, .. }));
    assert!(matches!(fit(&[], &[], 0).unwrap_err(), FitError::TooFewViews { p: 0, rows: 1, views: 0 }));
    let none = fit_angles(grid, Centre::Normal, &[0.0, 1.0], &black[..120], Degree::new(2).ok()).unwrap_err();
    assert_eq!(none.to_string(), "degree P = 2 has 3 coefficients, more than 2 views determine");
    let found = fit(&circle, &black, 0).unwrap();
    assert_eq!((found.residual, found.map.values()[0]), (0.0, [0.0; 3]));
}

#[test]
fn conversions_are_the_same_with_any_number_of_threads() {
    let local = map(&reflection(2, 2), GRIDS[1]);
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let table = view_maps(&local, 6);
            let texture = view_set(&local, MapViews::even_angles(4));
            (cabral(&local).fit(None).unwrap(), table.fit(None).unwrap(), texture.fit(None).unwrap())
        })
    };
    assert_eq!(with(1), with(3));
}

/// From the rows that hold degree F + P every texel of a sphere map is the reflection at its central
/// direction, where a viewer sees it: the centre is the view itself, right and up as the axes say. From a
/// cube it is interpolated.
#[test]
fn sphere_maps_are_the_reflection_as_a_ball_shows_it() {
    let reflection = reflection(2, 2);
    let rows = sphere_map_rows(reflection.brdf().f(), reflection.brdf().p());
    let local = map(&reflection, MapGrid::LatLong(LatLong::with_rows(rows)));
    let vertices = icosahedron::vertices();
    let edge = 9;
    let maps = sphere_maps(&local, &vertices, edge, Stop::NEVER).unwrap();
    let ball = MirrorBall { edge };
    for (k, &view) in vertices.iter().enumerate() {
        let [right, up, toward] = sphere_map_axes(view);
        assert!((right.vector().cross(up.vector()) - toward.vector()).length() < 1e-15);
        for texel in 0..edge * edge {
            let Some(inside) = ball.direction(texel / edge, texel % edge) else { continue };
            let [x, y, z] = inside.vector().to_array();
            let central = toward.vector() * x + right.vector() * y + up.vector() * z;
            let expected = reflection.evaluate(Direction::normalised(central), view);
            assert!(difference(&[maps[k * 81 + texel]], &[expected]) < F32, "{k} {texel}");
        }
        let rim = reflection.evaluate(Direction::normalised(-view.vector()), view);
        assert!(difference(&[maps[k * 81]], &[rim]) < F32);
    }
    // Coarse texels of a cube: second order in 2 / 32, times the square of degree 7.
    let cube = map(&reflection, MapGrid::Cube(Cube { edge: 32 }));
    let rough = sphere_maps(&cube, &vertices, edge, Stop::NEVER).unwrap();
    assert!(difference(&rough, &maps) < 0.1 && difference(&rough, &maps) > 1e-4);
}

/// A ball of N texels has 4 / N radians a texel in its middle, and interpolation is off by h^2 / 8 times l^2
/// = 49 of values around 2. The last texel before the rim is sqrt(8 x 2 / N) = 0.25 radians wide.
#[test]
fn sphere_maps_come_back_to_a_grid() {
    let reflection = reflection(2, 2);
    let rows = sphere_map_rows(reflection.brdf().f(), reflection.brdf().p());
    let local = map(&reflection, MapGrid::LatLong(LatLong::with_rows(rows)));
    let vertices = icosahedron::vertices();
    let maps = sphere_maps(&local, &vertices, 256, Stop::NEVER).unwrap();
    let grid = GRIDS[1];
    let axes = vertices.map(sphere_map_axes);
    let back = from_sphere_maps(256, &axes, &maps, grid);
    let direct = cabral(&map(&reflection, grid));
    for (k, view) in vertices.into_iter().enumerate() {
        for texel in 0..grid.len() {
            let error = difference(&[back[k * grid.len() + texel]], &[direct.map(k)[texel]]);
            let limit = if view.dot(grid.direction(texel)) > -0.9 { 0.01 } else { 0.5 };
            assert!(error < limit, "{k} {texel}: {error}");
        }
    }
}

/// At the texels of the old grid nothing is interpolated; between them error falls with the square of their
/// size.
#[test]
fn a_map_moves_to_another_grid() {
    let reflection = reflection(2, 2);
    let fine = GRIDS[1];
    for (terms, source) in [(2, 16), (2, 64), (0, 64)] {
        let reflection = if terms == 0 { self::reflection(2, 0) } else { reflection.clone() };
        let local = map(&reflection, MapGrid::Cube(Cube { edge: source }));
        assert_eq!(local.resampled(local.grid(), View::Local), local);
        let (global, back) = (local.to_global(), local.to_global().resampled(local.grid(), View::Local));
        assert_eq!(local.resampled(local.grid(), View::Global), global);
        assert!(difference(back.values(), local.values()) < F32);
        let expected = map(&reflection, fine);
        let limit = if source == 16 { 0.1 } else { 0.1 / 16.0 };
        for (moved, expected) in [
            (local.resampled(fine, View::Local), expected.clone()),
            (global.resampled(fine, View::Local), expected.clone()),
            (local.resampled(fine, View::Global), expected.to_global()),
            (global.resampled(fine, View::Global), expected.to_global()),
        ] {
            assert_eq!(moved.view(), expected.view());
            let error = difference(moved.values(), expected.values());
            assert!(error < limit, "{source}: {error}");
        }
    }
}
