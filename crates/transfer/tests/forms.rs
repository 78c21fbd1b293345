//! The forms of a transfer: what they hold, and that they shade as its matrices do.

#![allow(clippy::unwrap_used, clippy::disallowed_methods, reason = "a test may panic")]

use brdf::{AshikhminShirley, Lambert, Material, tabulate};
use mesh::Mesh;
use sh::{Degree, Expansion, Stop};
use transfer::{
    Directions, Form, Frames, HalfTransfer, MatteTransfer, Occluders, StoredTransfer, Transfer,
    TransferDegrees, Viewer, Visibility, precompute, shade_with_transfer,
};

fn degree(l: usize) -> Degree {
    Degree::new(l).unwrap()
}

fn light() -> Expansion {
    let value = |row: usize, channel: usize| {
        ((row * 3 + channel) as f64 * 12.9898).sin() / (1.0 + row.isqrt() as f64)
    };
    let rows =
        (0..25).map(|row| [0, 1, 2].map(|channel| value(row, channel) + f64::from(row == 0))).collect();
    Expansion::from_coefficients(degree(4), rows).unwrap()
}

/// Every 16th vertex of the knot, in the shadow of all of it.
fn knot() -> (Frames, Occluders) {
    let knot = mesh::shape("torus-knot").unwrap();
    let some = |count: usize| (0..count).step_by(16);
    let count = knot.positions().len();
    let mesh = Mesh::new(
        some(count).map(|vertex| knot.positions()[vertex]).collect(),
        some(count).map(|vertex| knot.normals()[vertex]).collect(),
        some(count).map(|vertex| knot.tangents()[vertex]).collect(),
        None,
        Vec::new(),
    );
    (Frames::of(&mesh.unwrap()).unwrap(), Occluders::of(&knot))
}

fn rms(found: &[f32], expected: &[f32]) -> f64 {
    assert_eq!(found.len(), expected.len());
    let square = |value: f32| f64::from(value).powi(2);
    let difference: f64 = found.iter().zip(expected).map(|(a, b)| square(a - b)).sum();
    (difference / expected.iter().map(|value| square(*value)).sum::<f64>()).sqrt()
}

const VIEWER: Viewer = Viewer::At([3.0, 1.0, 0.5]);

fn metal(specular: [f64; 3]) -> brdf::BrdfTable {
    let metal = AshikhminShirley::new([24.0, 8.0], [0.0; 3], specular).unwrap();
    tabulate(&Material::AshikhminShirley(metal), degree(4), 32, Stop::NEVER).unwrap().0
}

/// The whole of the shadows is in (O + F + 1)^2 numbers, also where O and F differ; half floats round.
#[test]
fn visibility_and_halves_hold_the_matrices() {
    let (frames, occluders) = knot();
    for (output, input) in [(4, 4), (4, 2), (2, 4)] {
        let degrees = TransferDegrees { output: degree(output), input: degree(input) };
        let directions = Directions::new(256, degree(output + input)).unwrap();
        let (matrices, blind) = precompute(&frames, &occluders, &directions, degrees, Stop::NEVER).unwrap();
        let (visibility, same) =
            Visibility::precompute(&frames, &occluders, &directions, degrees, Stop::NEVER).unwrap();
        assert_eq!(blind, same);
        assert_eq!(visibility.values().len(), frames.len() * (output + input + 1).pow(2));
        let expanded = visibility.matrices(&frames).unwrap();
        let worst = expanded.values().iter().zip(matrices.values());
        let worst = worst.fold(0.0f32, |worst, (a, b)| worst.max((a - b).abs()));
        assert!(worst < 2e-6, "{worst}");
        let (half, _) =
            HalfTransfer::precompute(&frames, &occluders, &directions, degrees, Stop::NEVER).unwrap();
        assert!(half == HalfTransfer::of(&matrices));
        for specular in [[0.9; 3], [0.9, 0.5, 0.2]] {
            let table = metal(specular);
            let expected = shade_with_transfer(&frames, &table, VIEWER, &matrices, &light());
            let found = visibility.shade(&frames, &table, VIEWER, &light());
            let error = rms(found.as_flattened(), expected.as_flattened());
            assert!(error < 1e-5, "{error}");
            let found = half.shade(&frames, &table, VIEWER, &light());
            let error = rms(found.as_flattened(), expected.as_flattened());
            assert!(error > 0.0 && error < 5e-4, "{error}");
        }
    }
}

/// The matte vector is what a matte table makes of the matrix, but for what the degree O cuts of the cosine.
#[test]
fn a_matte_vector_is_what_a_matte_table_makes_of_the_matrix() {
    let (frames, occluders) = knot();
    let directions = Directions::new(1024, degree(12)).unwrap();
    let degrees = TransferDegrees { output: degree(8), input: degree(4) };
    let (matrices, _) = precompute(&frames, &occluders, &directions, degrees, Stop::NEVER).unwrap();
    let chalk = Material::Lambert(Lambert::new([0.8, 0.4, 0.1]).unwrap());
    let (table, _) = tabulate(&chalk, degree(8), 16, Stop::NEVER).unwrap();
    let expected = shade_with_transfer(&frames, &table, VIEWER, &matrices, &light());
    let (matte, _) =
        MatteTransfer::precompute(&frames, &occluders, &directions, degree(4), Stop::NEVER).unwrap();
    let error = rms(matte.shade(&frames, &table, &light()).unwrap().as_flattened(), expected.as_flattened());
    assert!(error < 0.02, "{error}");
    assert!(matte.shade(&frames, &metal([0.5; 3]), &light()).is_err());
    let of = MatteTransfer::of(&matrices);
    let error = rms(of.shade(&frames, &table, &light()).unwrap().as_flattened(), expected.as_flattened());
    assert!(error < 1e-5, "{error}");
}

/// Against `prt-transfer.json`: the visibility and the matte vector of a point next to a sphere.
#[test]
fn visibility_and_matte_vectors_are_the_integrals() {
    const TEST: &str = "visibility_and_matte_vectors_are_the_integrals";
    let Some(reference) = test_data::reference(TEST, "prt-transfer.json") else { return };
    let list = |value: &serde_json::Value| -> Vec<f64> {
        value.as_array().unwrap().iter().map(|number| number.as_f64().unwrap()).collect()
    };
    let single = |value: &serde_json::Value| -> [f32; 3] {
        <[f64; 3]>::try_from(list(value)).unwrap().map(|x| x as f32)
    };
    for case in reference["cases"].as_array().unwrap() {
        let (centre, radius) =
            (single(&case["sphere"]["centre"]), case["sphere"]["radius"].as_f64().unwrap() as f32);
        let unit = mesh::shape("sphere").unwrap();
        let place = |p: &[f32; 3]| [0, 1, 2].map(|axis| centre[axis] + radius * p[axis]);
        let positions = unit.positions().iter().map(place).collect();
        let (normals, tangents) = (unit.normals().to_vec(), unit.tangents().to_vec());
        let ball = Mesh::new(positions, normals, tangents, None, unit.triangles().to_vec()).unwrap();
        let [x, y, z, w] = <[f64; 4]>::try_from(list(&case["tangent"])).unwrap().map(|x| x as f32);
        let (position, normal) = (single(&case["position"]), single(&case["normal"]));
        let vertex = Mesh::new(vec![position], vec![normal], vec![[x, y, z, w]], None, vec![]).unwrap();
        let (frames, occluders) = (Frames::of(&vertex).unwrap(), Occluders::of(&ball));
        let directions = Directions::new(16384, degree(12)).unwrap();
        let degrees = TransferDegrees { output: degree(4), input: degree(4) };
        let (visibility, _) =
            Visibility::precompute(&frames, &occluders, &directions, degrees, Stop::NEVER).unwrap();
        let (matte, _) =
            MatteTransfer::precompute(&frames, &occluders, &directions, degree(4), Stop::NEVER).unwrap();
        for (found, name) in [(visibility.values(), "visibility"), (matte.values(), "diffuse")] {
            let Some(expected) = case.get(name) else { continue };
            let expected: Vec<f32> = list(expected).into_iter().map(|value| value as f32).collect();
            assert_eq!(found.len(), expected.len());
            let worst = found.iter().zip(&expected).fold(0.0f32, |worst, (a, b)| worst.max((a - b).abs()));
            eprintln!("{} {name}: {worst:.1e}", case["name"]);
            assert!(worst < 2e-3, "{} {name}: {worst}", case["name"]);
        }
    }
}

#[test]
fn bad_forms_are_refused() {
    let matrices = || HalfTransfer::of(&Transfer::new(degree(1), degree(1), vec![0.5; 32]).unwrap());
    let stored = |forms: Vec<Form>| StoredTransfer::new(forms).is_some();
    assert!(stored(vec![Form::Matrices(matrices())]) && stored(vec![Form::Matrices(matrices()); 3]));
    assert!(!stored(vec![]) && !stored(vec![Form::Matrices(matrices()); 2]));
    let matte = Form::Matte(MatteTransfer::new(degree(1), vec![0.5; 8]).unwrap());
    assert!(!stored(vec![Form::Matrices(matrices()), matte.clone(), matte]));
    assert!(Visibility::new(degree(9), degree(1), Vec::new()).is_none());
    assert!(Visibility::new(degree(1), degree(1), vec![0.0; 10]).is_none());
    assert!(MatteTransfer::new(degree(1), vec![0.0; 5]).is_none());
    let plane = mesh::shape("plane").unwrap();
    let (frames, occluders) = (Frames::of(&plane).unwrap(), Occluders::of(&plane));
    let directions = Directions::new(512, degree(8)).unwrap();
    let degrees = TransferDegrees { output: degree(4), input: degree(4) };
    let stopped = Visibility::precompute(&frames, &occluders, &directions, degrees, Stop::when(&|| true));
    assert_eq!(stopped.unwrap_err(), sh::Stopped.into());
    let degrees = TransferDegrees { output: degree(6), input: degree(4) };
    let few = Visibility::precompute(&frames, &occluders, &directions, degrees, Stop::NEVER);
    assert!(few.is_err());
}
