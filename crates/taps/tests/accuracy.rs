//! Taps against sums over the pixels of environments that their fit has not seen.

#![allow(clippy::unwrap_used)] // a test may panic

use brdf::{
    Fresnel, Ggx, Lambert, Material, Microfacet, OrenNayar, Part, Standard, StandardParameters, Visibility,
    environment_brdf,
};
use containers::{ReadOptions, read_image};
use envmap::{Environment, Layout};
use sh::Stop;
use sphere::{Direction, LatLong};
use taps::{Accuracy, LightPoints, ScaleSpace, Truth, Weights, Widths, fit, fit_by_reflectance, fit_varied};

fn copper(roughness: f64) -> Material {
    let copper = Fresnel::Conductor { n: [0.27, 0.68, 1.32], k: [3.61, 2.63, 2.29] };
    Material::Ggx(Ggx::new(roughness, copper, [1.0; 3]).unwrap())
}

fn microfacet(sigma: f64) -> Material {
    Material::Microfacet(Microfacet::new(sigma, [1.0; 3]).unwrap())
}

/// A room: a dim wall, a window and a row of lamps.
fn room() -> Environment {
    let grid = LatLong::with_rows(128);
    let texel = |index: usize| {
        let v = grid.direction(index / grid.width, index % grid.width).vector();
        let is_window = v.x > 0.8 && v.z.abs() < 0.4;
        let lamps = (0..5).any(|k| v.dot(Direction::from_angles(0.5, f64::from(k)).vector()) > 0.9985);
        let wall = [0.3 + 0.2 * v.z, 0.3, 0.25 - 0.1 * v.y];
        let extra = if lamps {
            300.0
        } else if is_window {
            6.0
        } else {
            0.0
        };
        wall.map(|wall| (wall + extra) as f32)
    };
    Environment::new(grid, (0..grid.len()).map(texel).collect()).unwrap()
}

/// The error of a material's taps with the strongest lights beside the scale space.
fn accuracy(environment: &Environment, material: &Material, taps: usize, lights: usize) -> Accuracy {
    let widths = Widths::new(64).unwrap();
    let fitted = fit(material, taps, widths, Stop::NEVER).unwrap();
    let lamps = environment.separate_lamps(Stop::NEVER).unwrap().lights;
    let kept = &lamps[..lights.min(lamps.len())];
    let space = ScaleSpace::new(environment, kept, widths, Stop::NEVER).unwrap();
    let points = LightPoints::new(environment).unwrap();
    let truth = Truth::new(&points, material, 600, Stop::NEVER).unwrap();
    truth.error(&fitted.table, &space, material)
}

/// The bounds are a tenth above what was seen.
#[test]
fn six_taps_are_within_a_tenth_of_a_stop_in_a_room() {
    let room = room();
    for (name, material, taps, lights, [p95, p99]) in [
        ("copper 0.3", copper(0.3), 6, 8, [0.07, 0.22]),
        ("copper 0.3, all in the map", copper(0.3), 6, 0, [0.12, 0.31]),
        ("copper 1", copper(1.0), 4, 8, [0.036, 0.065]),
        ("microfacet 0.2", microfacet(0.2), 4, 8, [0.06, 0.21]),
        (
            "oren-nayar",
            Material::OrenNayar(OrenNayar::new([0.8, 0.4, 0.2], 30.0).unwrap()),
            4,
            8,
            [0.14, 0.32],
        ),
        ("lambert", Material::Lambert(Lambert::new([0.8, 0.4, 0.2]).unwrap()), 4, 8, [0.036, 0.05]),
    ] {
        let found = accuracy(&room, &material, taps, lights);
        eprintln!("{name}: {found:?}");
        assert!(found.p95 < p95 && found.p99 < p99, "{name}: {found:?}");
    }
}

/// Photographs with suns and lamps: eight lights beside the map, none, and eight with a narrower lobe. The
/// bounds are a tenth above what was seen.
#[test]
fn photographs_with_lamps_are_within_a_tenth_of_a_stop() {
    const TEST: &str = "photographs_with_lamps_are_within_a_tenth_of_a_stop";
    for (name, cases) in [
        ("studio", [[0.085, 0.16], [0.262, 0.71], [0.055, 0.13]]),
        ("sunrise", [[0.028, 0.064], [0.16, 0.305], [0.022, 0.05]]),
        ("forest", [[0.09, 0.178], [0.078, 0.162], [0.06, 0.15]]),
    ] {
        let Some(path) = test_data::folder(TEST, "SPECULA_CORPUS") else { return };
        let image = read_image(
            &std::fs::read(path.join(format!("env/cc0/{name}.hdr"))).unwrap(),
            &ReadOptions::default(),
        )
        .unwrap()
        .image;
        let environment = Environment::from_image(image, Layout::LatLong, None).unwrap();
        let found = [
            accuracy(&environment, &copper(0.3), 6, 8),
            accuracy(&environment, &copper(0.3), 6, 0),
            accuracy(&environment, &microfacet(0.2), 4, 8),
        ];
        eprintln!("{name}: {found:?}");
        for (found, [p95, p99]) in found.iter().zip(cases) {
            assert!(found.p95 < p95 && found.p99 < p99, "{name}: {found:?}");
        }
    }
}

/// Under a constant sky a material reflects its albedo, exactly, toward every view.
#[test]
fn a_white_furnace_shows_the_albedo() {
    let grid = LatLong::with_rows(32);
    let sky = Environment::new(grid, vec![[1.0; 3]; grid.len()]).unwrap();
    let widths = Widths::new(16).unwrap();
    let space = ScaleSpace::new(&sky, &[], widths, Stop::NEVER).unwrap();
    let white = Material::Lambert(Lambert::new([1.0, 0.5, 0.25]).unwrap());
    for material in [white, microfacet(0.2), copper(0.4)] {
        let fitted = fit(&material, 3, widths, Stop::NEVER).unwrap();
        for row in [0, 20, 50] {
            let cosine = 1.0 - f64::from(row) / 64.0;
            let view = Direction::from_angles(cosine.acos(), 0.4);
            let found = fitted.table.radiance(&space, Direction::Z, view);
            let albedo = brdf::albedo(&material, Direction::from_angles(cosine.acos(), 0.0));
            for channel in 0..3 {
                let error = found[channel] / albedo[channel] - 1.0;
                assert!(error.abs() < 5e-3, "{} at {cosine}: {found:?} {albedo:?}", material.name());
            }
        }
    }
}

#[test]
fn the_fit_is_the_same_on_any_number_of_threads() {
    let widths = Widths::new(64).unwrap();
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| fit(&copper(0.4), 2, widths, Stop::NEVER).unwrap())
    };
    assert_eq!(on(1), on(3));
}

#[test]
fn hair_is_the_mean_of_all_turns_and_a_stop_is_obeyed() {
    let hair = Material::KajiyaKay(brdf::KajiyaKay::new(16.0, [1.0; 3]).unwrap());
    let found = accuracy(&room(), &hair, 4, 8);
    eprintln!("{found:?}");
    assert!(found.p95 < 0.73 && found.p99 < 0.9, "{found:?}");
    let stopped = fit(&copper(0.3), 4, Widths::new(64).unwrap(), Stop::when(&|| true));
    assert_eq!(stopped, Err(sh::Stopped));
}

/// The highlight of a surface of `standard`.
fn highlight(roughness: f64, reflectance: f64) -> Material {
    let parameters = StandardParameters {
        base_color: [reflectance; 3],
        metallic: 1.0,
        roughness,
        ..StandardParameters::default()
    };
    Material::Standard(Standard::new(parameters).unwrap()).part(Part::Specular).unwrap()
}

/// One table over roughness serves every reflectance nearly as well as a fit to each, also between its rows.
#[test]
fn a_table_over_roughness_is_as_good_as_a_fit_to_each() {
    const ROUGHNESSES: usize = 33;
    let varied = fit_by_reflectance(ROUGHNESSES, 6, Widths::FINEST, Stop::NEVER).unwrap().table;
    let half = 0.5 / (ROUGHNESSES - 1) as f64;
    let room = room();
    let widths = Widths::new(64).unwrap();
    let lamps = room.separate_lamps(Stop::NEVER).unwrap().lights;
    let space = ScaleSpace::new(&room, &lamps[..lamps.len().min(8)], widths, Stop::NEVER).unwrap();
    let points = LightPoints::new(&room).unwrap();
    let mut whole = [0.0; 2];
    for (roughness, reflectance) in
        [(0.3125, 1.0), (0.375, 0.04), (0.5, 1.0), (0.625, 0.04), (0.75, 0.5), (0.9375, 1.0)]
    {
        let roughness = roughness - half;
        let material = highlight(roughness, reflectance);
        let truth = Truth::new(&points, &material, 300, Stop::NEVER).unwrap();
        let direct = fit(&material, 6, Widths::FINEST, Stop::NEVER).unwrap();
        let direct = truth.error(&direct.table, &space, &material);
        let found = truth.error(&varied.at_reflectance(roughness, [reflectance; 3]), &space, &material);
        eprintln!("{roughness} {reflectance}: {found:?}, {direct:?}");
        assert!(found.p95 < 1.3 * direct.p95, "{roughness} {reflectance}: {found:?} {direct:?}");
        whole[0] += found.p95;
        whole[1] += direct.p95;
    }
    assert!(whole[0] < 1.1 * whole[1], "{whole:?}");
}

/// The weights add up to what a DFG table holds, so that a white furnace shows it exactly.
#[test]
fn a_table_over_roughness_holds_a_dfg_table() {
    let varied = fit_by_reflectance(3, 2, Widths::new(16).unwrap(), Stop::NEVER).unwrap().table;
    assert_eq!((varied.weights(), varied.taps(), varied.normals()), (Weights::ScaleBias, 2, 1));
    for (table, roughness) in varied.tables().iter().zip([0.01, 0.5, 1.0]) {
        for (index, row) in table.rows().iter().enumerate() {
            let weights =
                row.taps.iter().map(|tap| tap.weight).chain(row.normals.iter().map(|tap| tap.weight));
            let sum = weights.fold([0.0; 3], |sum, weight| [0, 1, 2].map(|k: usize| sum[k] + weight[k]));
            let cosine = (1.0 - index as f64 / 64.0).max(1e-3);
            let dfg = environment_brdf(Visibility::Correlated, roughness, cosine);
            let errors = [sum[0] - dfg.scale, sum[1] - dfg.bias, sum[2]];
            assert!(errors.iter().all(|error| error.abs() < 1e-9), "{roughness} {cosine}: {errors:?}");
            // From water to a mirror no weight is below 0.
            for weight in row.taps.iter().map(|tap| tap.weight) {
                assert!([0.02, 1.0].iter().all(|f0| f0 * weight[0] + weight[1] > -1e-12), "{weight:?}");
            }
        }
    }
}

/// Materials that differ in roughness have tables that a look-up may interpolate; their parts have to agree.
#[test]
fn materials_over_roughness_are_one_family() {
    let widths = Widths::new(16).unwrap();
    let members = [0.4, 0.5, 0.6].map(copper);
    let family = fit_varied(&members, [0.4, 0.6], 3, widths, Stop::NEVER).unwrap().unwrap();
    assert_eq!((family.table.taps(), family.table.normals(), family.rms.len()), (3, 1, 3));
    let direct = fit(&copper(0.55), 3, widths, Stop::NEVER).unwrap().table;
    let found = family.table.at(0.55);
    for (found, direct) in found.rows().iter().zip(direct.rows()) {
        let albedo = |row: &taps::TapRow| -> f64 {
            row.taps.iter().map(|tap| tap.weight[0]).sum::<f64>()
                + row.normals.iter().map(|tap| tap.weight[0]).sum::<f64>()
        };
        assert!((albedo(found) / albedo(direct) - 1.0).abs() < 0.01);
    }
    let lambert = Material::Lambert(Lambert::new([0.5; 3]).unwrap());
    let mixed = [copper(0.5), lambert];
    assert!(fit_varied(&mixed, [0.0, 1.0], 2, widths, Stop::NEVER).unwrap().is_none());
}
