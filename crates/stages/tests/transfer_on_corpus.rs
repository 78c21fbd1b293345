//! Real meshes under real light: precomputed transfer against radiance that was traced and integrated
//! directly.

#![allow(clippy::unwrap_used, clippy::disallowed_methods)] // a test may panic

use std::path::Path;

use brdf::{AshikhminShirley, Material, tabulate};
use containers::ReadOptions;
use envmap::{Environment, Layout};
use mesh::Mesh;
use sh::{Basis, Degree, Expansion, Stop, Transform};
use sphere::{DMat3, DVec3, Direction, LatLong};
use transfer::{Directions, Frames, Occluders, TransferDegrees, Viewer, precompute, shade_with_transfer};

/// The degree of the light.
const LIGHT: usize = 4;
/// The rows of the environments, and of the rule with which radiance is integrated.
const ROWS: usize = 32;
/// The vertices of each mesh that are looked at, about.
const VERTICES: usize = 300;

fn degree(l: usize) -> Degree {
    Degree::new(l).unwrap()
}

fn metal() -> Material {
    Material::AshikhminShirley(AshikhminShirley::new([24.0, 8.0], [0.2; 3], [0.5; 3]).unwrap())
}

fn imported(corpus: &Path, file: &str) -> Mesh {
    let path = corpus.join("mesh").join(file);
    let folder = path.parent().unwrap();
    let mut beside =
        |name: &str| Ok::<_, containers::Error>(std::fs::read(folder.join(name)).unwrap().into());
    containers::read_gltf(&std::fs::read(&path).unwrap(), &mut beside).unwrap().mesh
}

fn environment(corpus: &Path, file: &str, layout: Layout) -> Environment {
    let bytes = std::fs::read(corpus.join("env").join(file)).unwrap();
    let image = containers::read_image(&bytes, &ReadOptions::default()).unwrap().image;
    Environment::from_image(image, layout, Some(LatLong::with_rows(ROWS))).unwrap()
}

/// Some vertices that face the camera, without triangles.
fn some(mesh: &Mesh, camera: DVec3) -> Mesh {
    let double = |v: [f32; 3]| DVec3::from_array(v.map(f64::from));
    let faces = |vertex: &usize| {
        let away = (camera - double(mesh.positions()[*vertex])).normalize();
        away.dot(double(mesh.normals()[*vertex])) > 0.1
    };
    let step = (mesh.positions().len() / 2 / VERTICES).max(1);
    let chosen: Vec<usize> = (0..mesh.positions().len()).filter(faces).step_by(step).collect();
    let of = |list: &[[f32; 3]]| chosen.iter().map(|vertex| list[*vertex]).collect::<Vec<_>>();
    let tangents = chosen.iter().map(|vertex| mesh.tangents()[*vertex]).collect();
    Mesh::new(of(mesh.positions()), of(mesh.normals()), tangents, None, Vec::new()).unwrap()
}

/// V rho_hat of each vertex at each texel, times the texel's solid angle: [vertex][texel], grey.
fn traced(mesh: &Mesh, occluders: &Occluders, camera: DVec3, grid: LatLong) -> Vec<Vec<f64>> {
    let double = |v: [f32; 3]| DVec3::from_array(v.map(f64::from));
    let material = metal();
    let one = |vertex: usize| {
        let (place, normal) = (mesh.positions()[vertex], mesh.normals()[vertex]);
        let [x, y, z, _] = mesh.tangents()[vertex];
        let (n, t) = (double(normal).normalize(), double([x, y, z]));
        let x = (t - n * n.dot(t)).normalize();
        let local = DMat3::from_cols(x, n.cross(x), n).transpose();
        let view = Direction::normalised(local * (camera - double(place)));
        let texel = |index: usize| {
            let direction = grid.direction(index / grid.width, index % grid.width);
            let incident = Direction::normalised(local * direction.vector());
            let rho_hat = material.rho_hat(incident, view)[0];
            let hidden = rho_hat > 0.0 && occluders.block(place, normal, direction);
            if hidden { 0.0 } else { rho_hat * grid.solid_angle(index / grid.width) }
        };
        (0..grid.len()).map(texel).collect()
    };
    (0..mesh.positions().len()).map(one).collect()
}

/// The radiance under light of these pixels.
fn lit(traced: &[Vec<f64>], pixels: &[[f64; 3]]) -> Vec<[f64; 3]> {
    let one = |weights: &Vec<f64>| {
        let mut sum = [0.0; 3];
        for (weight, rgb) in weights.iter().zip(pixels) {
            (0..3).for_each(|channel| sum[channel] += weight * rgb[channel]);
        }
        sum
    };
    traced.iter().map(one).collect()
}

fn rms(found: &[[f32; 3]], expected: &[[f64; 3]]) -> f64 {
    let pairs = found.as_flattened().iter().zip(expected.as_flattened());
    let difference: f64 = pairs.map(|(a, b)| (f64::from(*a) - b).powi(2)).sum();
    (difference / expected.as_flattened().iter().map(|value| value * value).sum::<f64>()).sqrt()
}

/// Cut at degree 4 there is what the degree O of the transfer and 1,024 rays lose; whole, what the light's
/// degree loses too.
#[test]
fn transfer_has_the_radiance_that_is_traced() {
    const TEST: &str = "transfer_has_the_radiance_that_is_traced";
    let Some(corpus) = test_data::folder(TEST, "SPECULA_CORPUS") else { return };
    let meshes = [
        ("FlightHelmet", imported(&corpus, "FlightHelmet/FlightHelmet.gltf")),
        ("SheenCloth", imported(&corpus, "SheenCloth.glb")),
        ("knot", mesh::shape("torus-knot").unwrap()),
    ];
    let environments = [
        ("apartment", environment(&corpus, "cc0/apartment.hdr", Layout::LatLong)),
        ("forest", environment(&corpus, "cc0/forest.hdr", Layout::LatLong)),
        ("grace", environment(&corpus, "probes/grace_probe.hdr", Layout::Probe)),
    ];
    let grid = LatLong::with_rows(ROWS);
    let transform = Transform::new(grid, degree(LIGHT)).unwrap();
    let basis = Basis::new(degree(LIGHT));
    let tables =
        [4, 8].map(|output| (output, tabulate(&metal(), degree(output), 32, Stop::NEVER).unwrap().0));
    let mut all = Vec::new();
    println!("mesh          light      O = 4, cut  whole   O = 8, cut  whole   (RMS in percent)");
    for (name, mesh) in &meshes {
        let (centre, radius) = mesh.bounds();
        let camera = DVec3::from_array(centre) + DVec3::new(2.0, 0.8, 0.7) * radius;
        let (some, occluders) = (some(mesh, camera), Occluders::of(mesh));
        let frames = Frames::of(&some).unwrap();
        assert!(frames.len() > VERTICES / 2 && frames.len() < 4 * VERTICES, "{name}: {}", frames.len());
        let traced = traced(&some, &occluders, camera, grid);
        let bakes = tables.each_ref().map(|(output, table)| {
            let directions = Directions::new(1024, degree(output + LIGHT)).unwrap();
            let degrees = TransferDegrees { output: degree(*output), input: degree(LIGHT) };
            (table, precompute(&frames, &occluders, &directions, degrees, Stop::NEVER).unwrap().0)
        });
        for (of, environment) in &environments {
            let light = transform.analyse(environment.pixels());
            let cut: Vec<[f64; 3]> =
                (0..grid.len()).map(|texel| value(&basis, &light, grid, texel)).collect();
            let whole: Vec<[f64; 3]> = environment.pixels().iter().map(|rgb| rgb.map(f64::from)).collect();
            let expected = [lit(&traced, &cut), lit(&traced, &whole)];
            let errors = bakes.each_ref().map(|(table, transfer)| {
                let viewer = Viewer::At(camera.to_array());
                let found = shade_with_transfer(&frames, table, viewer, transfer, &light);
                expected.each_ref().map(|expected| 100.0 * rms(&found, expected))
            });
            let [[cut4, whole4], [cut8, whole8]] = errors;
            println!("{name:12}  {of:10} {cut4:9.2} {whole4:8.2} {cut8:11.2} {whole8:8.2}");
            all.push((name, of, errors));
        }
    }
    assert_eq!(all.len(), 9);
    for (name, of, [[cut4, whole4], [cut8, whole8]]) in all {
        assert!(cut4 < 14.0 && cut8 < 3.0 && cut8 < cut4, "{name} {of}: {cut4} {cut8}");
        assert!(whole4 < 30.0 && whole8 < 30.0, "{name} {of}: {whole4} {whole8}");
    }
}

/// The light at a texel.
fn value(basis: &Basis, light: &Expansion, grid: LatLong, texel: usize) -> [f64; 3] {
    let mut row = vec![0.0; light.degree().rows()];
    basis.evaluate_into(grid.direction(texel / grid.width, texel % grid.width), &mut row);
    let mut sum = [0.0; 3];
    for (y, rgb) in row.iter().zip(light.coefficients()) {
        (0..3).for_each(|channel| sum[channel] += y * rgb[channel]);
    }
    sum
}
