//! Transfer and shading against values that were integrated without the code of this project:
//! `prt-transfer.json` and `prt-vertices.json`.

#![allow(clippy::unwrap_used, clippy::disallowed_methods, reason = "a test may panic")]

use brdf::{AshikhminShirley, Material, Ward, tabulate};
use mesh::Mesh;
use serde_json::Value;
use sh::{Degree, Expansion, Stop};
use sphere::{DVec3, Direction};
use transfer::{
    Directions, Frames, Occluders, Transfer, TransferDegrees, Viewer, precompute, shade, shade_with_transfer,
};

fn list(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|number| number.as_f64().unwrap()).collect()
}

fn numbers<const N: usize>(value: &Value) -> [f64; N] {
    list(value).try_into().unwrap()
}

fn degree(l: usize) -> Degree {
    Degree::new(l).unwrap()
}

/// The built-in sphere, 65,536 triangles, at another place and size.
fn ball(sphere: &Value) -> Occluders {
    let (centre, radius) = (numbers::<3>(&sphere["centre"]), sphere["radius"].as_f64().unwrap());
    let unit = mesh::shape("sphere").unwrap();
    let place = |p: &[f32; 3]| [0, 1, 2].map(|axis| (centre[axis] + radius * f64::from(p[axis])) as f32);
    let positions = unit.positions().iter().map(place).collect();
    let (normals, tangents) = (unit.normals().to_vec(), unit.tangents().to_vec());
    Occluders::of(&Mesh::new(positions, normals, tangents, None, unit.triangles().to_vec()).unwrap())
}

/// A mesh of one vertex without triangles: its tangent turned about the normal toward w (N x T).
fn vertex(case: &Value) -> Frames {
    let [x, y, z, w] = numbers::<4>(&case["tangent"]);
    let (normal, t) = (DVec3::from_array(numbers(&case["normal"])).normalize(), DVec3::new(x, y, z));
    let (sine, cosine) = case["turn"].as_f64().unwrap_or(0.0).to_radians().sin_cos();
    let tangent = t * cosine + normal.cross(t) * (w * sine);
    let single = |v: DVec3| v.as_vec3().to_array();
    let [tx, ty, tz] = single(tangent);
    let position = single(DVec3::from_array(numbers(&case["position"])));
    let mesh = Mesh::new(vec![position], vec![single(normal)], vec![[tx, ty, tz, w as f32]], None, vec![]);
    Frames::of(&mesh.unwrap()).unwrap()
}

/// The matrix of 25 x 25 of a case: in the frame of its vertex, or where that is the world's as the lower
/// triangle of a symmetric one.
fn matrix(case: &Value) -> Vec<f64> {
    if let Some(rows) = case["open_local"].as_array() {
        return rows.iter().flat_map(list).collect();
    }
    let triangle = list(&case["open"]);
    let entry = |row: usize, column: usize| triangle[row * (row + 1) / 2 + column];
    (0..625).map(|k| (k / 25, k % 25)).map(|(i, j)| entry(i.max(j), i.min(j))).collect()
}

fn bake(case: &Value, sphere: &Value, count: usize, output: usize) -> Transfer {
    let directions = Directions::new(count, degree(output + 4)).unwrap();
    let degrees = TransferDegrees { output: degree(output), input: degree(4) };
    let (transfer, _) = precompute(&vertex(case), &ball(sphere), &directions, degrees, Stop::NEVER).unwrap();
    transfer
}

#[test]
fn matrices_are_the_integrals() {
    let Some(reference) = test_data::reference("matrices_are_the_integrals", "prt-transfer.json") else {
        return;
    };
    let cases = reference["cases"].as_array().unwrap();
    assert_eq!(cases.len(), 3);
    for (count, limit) in [(4096, 5e-3), (16384, 1.5e-3)] {
        for case in cases {
            let transfer = bake(case, &case["sphere"], count, 4);
            let expected = matrix(case);
            assert_eq!(expected.len(), 625);
            let pairs = transfer.matrix(0).iter().zip(&expected);
            let worst = pairs.fold(0.0, |worst: f64, (a, b)| worst.max((f64::from(*a) - b).abs()));
            eprintln!("{} with {count} directions: {worst:.1e}", case["name"]);
            assert!(worst < limit, "{} with {count} directions: {worst:e}", case["name"]);
        }
    }
}

fn material(case: &Value) -> Material {
    let parameter = |name: &str, default: f64| case["parameters"][name].as_f64().unwrap_or(default);
    let pair = |name: &str| ["x", "y"].map(|axis| parameter(&format!("{name}_{axis}"), f64::NAN));
    match case["model"].as_str().unwrap() {
        "ward" => Material::Ward(Ward::new(pair("roughness"), [1.0; 3]).unwrap()),
        "ashikhmin-shirley" => {
            let (diffuse, specular) = ([parameter("diffuse", 0.0); 3], [parameter("specular", 1.0); 3]);
            Material::AshikhminShirley(AshikhminShirley::new(pair("exponent"), diffuse, specular).unwrap())
        }
        other => panic!("no model {other} here"),
    }
}

/// The root of the mean squared difference of `found` and `expected`, relative to that of `expected`.
fn rms(pairs: &[([f32; 3], [f64; 3])]) -> f64 {
    let (mut difference, mut size) = (0.0, 0.0);
    for (found, expected) in pairs {
        for channel in 0..3 {
            difference += (f64::from(found[channel]) - expected[channel]).powi(2);
            size += expected[channel].powi(2);
        }
    }
    (difference / size).sqrt()
}

/// With O = F = 4 against the steps of [KSS02, secs. 4 and 5] in exact arithmetic, within 1 percent; and
/// against radiance that was integrated with the shadow, from which the matrix' output cut at degree O takes
/// 1.1, 0.6 and 0.15 percent.
#[test]
fn shadowed_vertices_have_the_radiance_that_they_should() {
    const TEST: &str = "shadowed_vertices_have_the_radiance_that_they_should";
    let Some(reference) = test_data::reference(TEST, "prt-vertices.json") else { return };
    let light = test_data::reference(TEST, "lighting.json").unwrap();
    let rows: Vec<[f64; 3]> = light["sh"].as_array().unwrap().iter().take(25).map(numbers).collect();
    let light = Expansion::from_coefficients(degree(4), rows).unwrap();
    let materials = reference["materials"].as_array().unwrap();
    for (output, limit) in [(4, 0.013), (6, 0.008), (8, 0.004)] {
        let tables = materials.iter().map(|case| {
            (
                case["model"].as_str().unwrap(),
                tabulate(&material(case), degree(output), 128, Stop::NEVER).unwrap().0,
            )
        });
        let tables: Vec<_> = tables.collect();
        let (mut by_matrix, mut open, mut shadowed) = (Vec::new(), Vec::new(), Vec::new());
        for case in reference["vertices"].as_array().unwrap() {
            let (frames, transfer) = (vertex(case), bake(case, &reference["sphere"], 16384, output));
            for view in case["shades"].as_array().unwrap() {
                let (_, table) = tables.iter().find(|(name, _)| view["material"] == *name).unwrap();
                let viewer = Viewer::Distant(Direction::normalised(numbers(&view["view"]).into()));
                let found = shade_with_transfer(&frames, table, viewer, &transfer, &light)[0];
                by_matrix.push((found, numbers(&view["by_matrix"]["open"])));
                shadowed.push((found, numbers(&view["shadowed"]["degree_4"])));
                let lit = shade(&frames, table, viewer, &light)[0];
                open.push((lit, numbers(&view["unshadowed"]["degree_4"])));
            }
        }
        assert_eq!(by_matrix.len(), 24);
        let [by_matrix, open, shadowed] = [by_matrix, open, shadowed].map(|pairs| rms(&pairs));
        eprintln!("O = {output}: by matrix {by_matrix:.1e}, unshadowed {open:.1e}, shadowed {shadowed:.2e}");
        assert!(output > 4 || by_matrix < 0.01, "{by_matrix}");
        assert!(open < 1e-3 && shadowed < limit, "{open} {shadowed}");
    }
}
