//! Facet taps of materials that depend on their tangent.

#![allow(clippy::unwrap_used)] // a test may panic

use brdf::{Fresnel, Ggx, Lambert, Material, MeasuredAnisotropic, Ward, from_half_and_difference};
use envmap::Environment;
use sh::Stop;
use sphere::{DVec3, Direction, LatLong};
use taps::{LightPoints, ScaleSpace, SurfaceFrame, Truth, Widths, fit, fit_facets};

fn ward(roughness: [f64; 2]) -> Material {
    Material::Ward(Ward::new(roughness, [0.6, 0.5, 0.3]).unwrap())
}

fn copper(roughness: [f64; 2]) -> Material {
    let copper = Fresnel::Conductor { n: [0.27, 0.68, 1.32], k: [3.61, 2.63, 2.29] };
    Material::Ggx(Ggx::stretched(roughness, copper, [1.0; 3]).unwrap())
}

/// A room: a dim wall, a window and a row of lamps.
fn room() -> Environment {
    let grid = LatLong::with_rows(128);
    let texel = |index: usize| {
        let v = grid.direction(index / grid.width, index % grid.width).vector();
        let is_window = v.x > 0.8 && v.z.abs() < 0.4;
        let is_lamp = (0..5).any(|k| v.dot(Direction::from_angles(0.5, f64::from(k)).vector()) > 0.9985);
        let extra = if is_lamp { 300.0 } else { f64::from(u8::from(is_window)) * 6.0 };
        [0.3 + 0.2 * v.z, 0.3, 0.25 - 0.1 * v.y].map(|wall| (wall + extra) as f32)
    };
    Environment::new(grid, (0..grid.len()).map(texel).collect()).unwrap()
}

fn widths() -> Widths {
    Widths::new(64).unwrap()
}

/// The errors (95 of 100 views) in a room with its lamps beside the map: of facet taps, and of the mean over
/// all turns.
fn errors(material: &Material, taps: usize) -> [f64; 2] {
    let room = room();
    let lamps = room.separate_lamps(Stop::NEVER).unwrap().lights;
    let space = ScaleSpace::new(&room, &lamps, widths(), Stop::NEVER).unwrap();
    let points = LightPoints::new(&room).unwrap();
    let truth = Truth::turned(&points, material, 400, Stop::NEVER).unwrap();
    let facets = fit_facets(material, taps, widths(), Stop::NEVER).unwrap();
    let mean = fit(material, taps, widths(), Stop::NEVER).unwrap();
    let found =
        [truth.error(&facets.table, &space, material).p95, truth.error(&mean.table, &space, material).p95];
    eprintln!("{}: {found:?}, residual {}", material.name(), facets.rms);
    found
}

#[test]
fn brushed_metal_keeps_its_look() {
    for (material, taps, most) in [(ward([0.15, 0.4]), 6, 0.15), (copper([0.3, 0.5]), 8, 0.25)] {
        let [facets, mean] = errors(&material, taps);
        assert!(facets < most && facets < 0.25 * mean, "{facets} {mean}");
    }
}

/// With nearly equal widths the taps are facets all the same; those about R are as good.
#[test]
fn a_round_highlight_is_fitted_as_well_as_without_a_tangent() {
    let material = copper([0.4, 0.4001]);
    let [facets, mean] = errors(&material, 4);
    assert!(facets < 1.3 * mean + 0.01, "{facets} {mean}");
}

/// The table of a highlight that is turned by half a radian has no mirror images in its axes.
#[test]
fn a_material_without_mirror_images_is_fitted_over_all_views() {
    let shape = [16, 24, 8, 12];
    let (sine, cosine) = 0.5_f64.sin_cos();
    let turned = |direction: Direction| {
        let v = direction.vector();
        Direction::normalised(DVec3::new(cosine * v.x - sine * v.y, sine * v.x + cosine * v.y, v.z))
    };
    let source = ward([0.25, 0.5]);
    let value = |index: usize| {
        let entry = [index / (24 * 8 * 12), index / (8 * 12) % 24, index / 12 % 8, index % 12];
        let [incident, outgoing] = from_half_and_difference(MeasuredAnisotropic::node(shape, entry));
        let cosine = incident.vector().z;
        let is_seen = cosine > 0.02 && outgoing.vector().z > 0.02;
        let rho = if is_seen { source.rho_hat(turned(incident), turned(outgoing)) } else { [0.0; 3] };
        rho.map(|rho| (rho / cosine.max(0.02)).clamp(0.0, 50.0) as f32)
    };
    let values = (0..shape.iter().product()).map(value).collect();
    let material = Material::MeasuredAnisotropic(MeasuredAnisotropic::new(shape, values).unwrap());
    let [facets, mean] = errors(&material, 3);
    assert!(facets < 0.5 * mean, "{facets} {mean}");
}

/// Under a constant sky a material reflects its albedo, exactly, toward the views of the table's nodes.
#[test]
fn a_white_furnace_shows_the_albedo() {
    let grid = LatLong::with_rows(32);
    let sky = Environment::new(grid, vec![[1.0; 3]; grid.len()]).unwrap();
    let widths = Widths::new(16).unwrap();
    let space = ScaleSpace::new(&sky, &[], widths, Stop::NEVER).unwrap();
    let matte = Material::Lambert(Lambert::new([0.3, 0.1, 0.2]).unwrap());
    let round = copper([0.4, 0.4]);
    for material in [ward([0.2, 0.5]), Material::layers(vec![copper([0.3, 0.5]), matte, round]).unwrap()] {
        let fitted = fit_facets(&material, 2, widths, Stop::NEVER).unwrap();
        for (x, y) in [(0.0, 0.0), (8.0, 0.0), (5.0, -9.0), (-11.0, 4.0)] {
            let (x, y): (f64, f64) = (x / 24.0, y / 24.0);
            let z = (1.0 - x * x - y * y).powi(2);
            let view = Direction::from_angles(z.acos(), y.atan2(x));
            let frame = SurfaceFrame::new(Direction::Z, Direction::X);
            let found = fitted.table.radiance(&space, frame, view);
            let albedo = brdf::albedo(&material, view);
            for channel in 0..3 {
                let error = found[channel] / albedo[channel] - 1.0;
                assert!(error.abs() < 5e-3, "{} at {x} {y}: {found:?} {albedo:?}", material.name());
            }
        }
    }
}

/// Views on both sides of the axes see the same to within their distance, and broken frames and views below
/// the horizon see something.
#[test]
fn there_is_no_seam_and_no_hole() {
    let fitted = fit_facets(&ward([0.15, 0.4]), 5, widths(), Stop::NEVER).unwrap();
    let space = ScaleSpace::new(&room(), &[], widths(), Stop::NEVER).unwrap();
    let normal = Direction::from_angles(0.6, 0.9);
    let frame = SurfaceFrame::new(normal, Direction::from_angles(1.3, -0.4));
    let toward = |theta: f64, phi: f64| {
        let view = frame.to_world(Direction::from_angles(theta, phi));
        fitted.table.radiance(&space, frame, view)
    };
    for theta in [0.0, 0.02, 0.5, 1.0, 1.4, 1.55] {
        for quarter in 0..4 {
            let phi = std::f64::consts::FRAC_PI_2 * f64::from(quarter);
            let [before, after] = [-1e-6, 1e-6].map(|step| toward(theta, phi + step));
            for channel in 0..3 {
                let step = (after[channel] / before[channel] - 1.0).abs();
                assert!(step < 1e-4, "{theta} {phi}: {before:?} {after:?}");
            }
        }
    }
    for (tangent, view) in [
        (normal, Direction::from_angles(0.3, 0.0)),
        (normal, normal),
        (Direction::X, normal),
        (Direction::X, Direction::normalised(-normal.vector())),
        (Direction::X, Direction::from_angles(3.0, 0.0)),
    ] {
        let found = fitted.table.radiance(&space, SurfaceFrame::new(normal, tangent), view);
        assert!(found.iter().all(|value| value.is_finite() && *value > 0.0), "{found:?}");
    }
}

#[test]
fn the_fit_is_the_same_on_any_number_of_threads_and_can_be_stopped() {
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| fit_facets(&ward([0.2, 0.5]), 3, widths(), Stop::NEVER).unwrap())
    };
    assert_eq!(on(1), on(3));
    let stopped = fit_facets(&ward([0.2, 0.5]), 3, widths(), Stop::when(&|| true));
    assert_eq!(stopped, Err(sh::Stopped));
}

/// What bilinear look-ups lose: half way between nodes, taps are those of the polynomials, as a table of
/// every other node shows.
#[test]
fn interpolation_loses_little() {
    let material = ward([0.15, 0.4]);
    let table = fit_facets(&material, 5, widths(), Stop::NEVER).unwrap().table;
    let side = table.side();
    let node = |row: usize, column: usize| &table.nodes()[row * side + column];
    for row in (0..side - 2).step_by(2) {
        for column in (1..side - 1).step_by(2) {
            // Beyond the rim of the disc and in the last cells before it, nodes are those at the rim.
            if (row + 2).pow(2) + (column + 3).pow(2) > (side - 1).pow(2) {
                continue;
            }
            let [before, found, after] = [column - 1, column, column + 1].map(|column| node(row, column));
            for j in 0..table.taps() {
                let [a, b, c] = [before, found, after].map(|node| node.taps[j]);
                // Four times what is lost between neighbours.
                let bend = |a: f64, b: f64, c: f64| (b - 0.5 * (a + c)).abs() / 4.0;
                for axis in 0..2 {
                    assert!(bend(a.slope[axis], b.slope[axis], c.slope[axis]) < 0.01);
                }
                assert!(bend(a.std.log2(), b.std.log2(), c.std.log2()) < 0.05);
                assert!(bend(a.weight[0], b.weight[0], c.weight[0]) < 0.01);
            }
        }
    }
}
