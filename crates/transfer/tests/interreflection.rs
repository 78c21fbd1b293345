//! Light that a mesh reflects onto itself, against values that were integrated without the code of this
//! project: `prt-interreflection.json`.

#![allow(clippy::unwrap_used, clippy::disallowed_methods, reason = "a test may panic")]

use brdf::{BrdfTable, Lambert, Material, Ward, tabulate};
use mesh::Mesh;
use serde_json::Value;
use sh::{Degree, Expansion, Stop};
use sphere::{DVec3, Direction};
use transfer::{
    Directions, Frames, MatteTransfer, Occluders, ReflectingMesh, Transfer, TransferDegrees, Viewer,
    interreflect, interreflect_matte, precompute, shade_with_transfer,
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

fn lambert(albedo: f64) -> Material {
    Material::Lambert(Lambert::new([albedo; 3]).unwrap())
}

/// The tables of several materials as one.
fn tables(materials: &[Material], output: usize) -> BrdfTable {
    let tables: Vec<BrdfTable> = materials
        .iter()
        .map(|material| tabulate(material, degree(output), 64, Stop::NEVER).unwrap().0)
        .collect();
    let values = tables.iter().flat_map(|table| table.values()).copied().collect();
    BrdfTable::new(degree(output), 64, tables[0].channels(), tables[0].below(), values).unwrap()
}

/// A flat grid: a vertex at `origin` + a x + b y for every a of `along` and b of `across`, x and y at right
/// angles; its normal is x cross y, its tangent x.
fn grid(origin: DVec3, [x, y]: [DVec3; 2], along: &[f64], across: &[f64]) -> Mesh {
    let single = |v: DVec3| v.as_vec3().to_array();
    let [tx, ty, tz] = single(x);
    let positions: Vec<_> =
        across.iter().flat_map(|b| along.iter().map(|a| single(origin + x * *a + y * *b))).collect();
    let (count, width) = (positions.len(), along.len() as u32);
    let mut triangles = Vec::new();
    for row in 0..across.len() as u32 - 1 {
        for first in (row * width..(row + 1) * width).take(along.len() - 1) {
            triangles.push([first, first + 1, first + 1 + width]);
            triangles.push([first, first + 1 + width, first + width]);
        }
    }
    let (normals, tangents) = (vec![single(x.cross(y)); count], vec![[tx, ty, tz, 1.0]; count]);
    Mesh::new(positions, normals, tangents, None, triangles).unwrap()
}

/// 0 and the powers of 4 up to 4^last, and their negatives if wanted.
fn powers(last: i32, both: bool) -> Vec<f64> {
    let up: Vec<f64> = [0.0].into_iter().chain((0..=last).map(|k| 4f64.powi(k))).collect();
    if !both {
        return up;
    }
    up.iter().skip(1).rev().map(|a| -a).chain(up.iter().copied()).collect()
}

/// A mesh of two parts with a material each, and its transfer.
struct Scene {
    frames: Frames,
    occluders: Occluders,
    table: BrdfTable,
    directions: Directions,
    shadows: Transfer,
}

impl Scene {
    fn new(parts: &[Mesh], materials: &[Material], output: usize, count: usize) -> Self {
        let mesh = Mesh::joined(parts).unwrap();
        let places =
            parts.iter().enumerate().flat_map(|(k, part)| vec![[k as f32, 0.0]; part.positions().len()]);
        let places: Vec<[f32; 2]> = places.collect();
        let frames = Frames::of(&mesh).unwrap().with_blend(&places);
        let occluders = Occluders::of(&mesh);
        let directions = Directions::new(count, degree(output + 4)).unwrap();
        let degrees = TransferDegrees { output: degree(output), input: degree(4) };
        let (shadows, _) = precompute(&frames, &occluders, &directions, degrees, Stop::NEVER).unwrap();
        let table = tables(materials, output);
        Self { frames, occluders, table, directions, shadows }
    }

    fn mesh(&self) -> ReflectingMesh<'_> {
        let Self { frames, occluders, table, directions, .. } = self;
        ReflectingMesh { frames, occluders, directions, table }
    }

    fn bounced(&self, bounces: usize) -> Transfer {
        let found = interreflect(self.mesh(), &self.shadows, bounces, Stop::NEVER);
        found.unwrap().remove(0)
    }

    /// What a white matte surface in the place of each vertex would send out under each Y_j.
    fn matte(&self, bounces: usize) -> MatteTransfer {
        let found = interreflect_matte(self.mesh(), degree(4), bounces, Stop::NEVER);
        found.unwrap().unwrap().0.remove(0)
    }
}

/// The root of the mean square of the difference of two lists, relative to that of the second.
fn rms(found: &[f64], expected: &[f64]) -> f64 {
    assert_eq!(found.len(), expected.len());
    let difference: f64 = found.iter().zip(expected).map(|(a, b)| (a - b).powi(2)).sum();
    (difference / expected.iter().map(|value| value * value).sum::<f64>()).sqrt()
}

/// Compares what a matte vertex sends out under each harmonic, and under the light, cut at degree 4.
#[track_caller]
fn check_matte(white: &MatteTransfer, vertex: usize, albedo: f64, case: &Value, name: &str, what: &str) {
    const LIMIT: f64 = 0.01;
    let found = white.values()[vertex * 25..][..25].iter().map(|t| albedo * f64::from(*t));
    let found: Vec<f64> = found.collect();
    let error = rms(&found, &list(&case["basis"][name]));
    let light = test_data::reference(what, "lighting.json").unwrap();
    let rows: Vec<[f64; 3]> = light["sh"].as_array().unwrap().iter().take(25).map(numbers).collect();
    let lit: Vec<f64> =
        (0..3).map(|channel| found.iter().zip(&rows).map(|(t, row)| t * row[channel]).sum()).collect();
    let under_light = rms(&lit, &list(&case["degree_4"][name]));
    eprintln!("{what}, {name}: {:.2} % of the basis, {:.2} % lit", 100.0 * error, 100.0 * under_light);
    assert!(error < LIMIT && under_light < LIMIT, "{what} {name}: {error} {under_light}");
}

/// Compares a matrix of a vertex whose frame is that of the world.
#[track_caller]
fn check_matrix(transfer: &Transfer, vertex: usize, expected: &Value) {
    let found: Vec<f64> = transfer.matrix(vertex).iter().map(|entry| f64::from(*entry)).collect();
    let expected: Vec<f64> = expected.as_array().unwrap().iter().flat_map(list).collect();
    let error = rms(&found, &expected);
    eprintln!("matrix: {:.2} %", 100.0 * error);
    assert!(error < 0.01, "{error}");
}

/// Floor and wall of 4^last and twice that; the vertex is the one at x = `place` in the middle of the floor.
/// Beyond their ends, the vertex sees a share of place / 4^last of what it should not see.
fn corner(last: i32) -> ([Mesh; 2], impl Fn(f64) -> usize) {
    let (near, wide) = (powers(last, false), powers(last, true));
    let floor = grid(DVec3::ZERO, [DVec3::X, DVec3::Y], &near, &wide);
    let wall = grid(DVec3::ZERO, [DVec3::Z, -DVec3::Y], &near, &wide);
    let wall_frame = wall.normals()[0];
    assert_eq!(wall_frame, [1.0, 0.0, 0.0]);
    let (width, middle) = (near.len(), wide.len() / 2);
    let vertex = move |place: f64| middle * width + near.iter().position(|x| *x == place).unwrap();
    ([floor, wall], vertex)
}

#[test]
fn a_matte_corner_lights_itself() {
    const TEST: &str = "a_matte_corner_lights_itself";
    let Some(reference) = test_data::reference(TEST, "prt-interreflection.json") else { return };
    let case = &reference["corner"];
    let [floor, wall] = ["floor_albedo", "wall_albedo"].map(|name| case[name].as_f64().unwrap());
    let (parts, vertex) = corner(8);
    let count = parts[0].positions().len();
    let scene = Scene::new(&parts, &[lambert(floor), lambert(wall)], 4, 8192);
    let [direct, one, all] = [0, 1, 5].map(|bounces| scene.matte(bounces));
    // Every point of a plane receives the same, also where they meet.
    for place in [16.0, 64.0, 0.0] {
        check_matte(&direct, vertex(place), floor, case, "direct", TEST);
        check_matte(&one, vertex(place), floor, case, "one_bounce", TEST);
        check_matte(&all, vertex(place), floor, case, "all_bounces", TEST);
        check_matte(&direct, count + vertex(place), wall, case, "wall_direct", TEST);
        check_matte(&all, count + vertex(place), wall, case, "wall_all_bounces", TEST);
    }
    check_matrix(&scene.bounced(5), vertex(16.0), &case["matrix_all_bounces"]);
}

#[test]
fn a_screen_lights_the_floor_before_it() {
    const TEST: &str = "a_screen_lights_the_floor_before_it";
    let Some(reference) = test_data::reference(TEST, "prt-interreflection.json") else { return };
    let case = &reference["screen"];
    let number = |name: &str| case[name].as_f64().unwrap();
    // A floor that reaches 200 to each side: the wall sees 1 percent of a degree of the sky below it.
    let far = [-200.0, -100.0, -50.0, -20.0, -10.0, -5.0, -2.0, -1.0];
    let x: Vec<f64> =
        far.into_iter().chain([0.0, 0.4, 0.8, 1.2, 2.0, 5.0, 20.0, 50.0, 100.0, 200.0]).collect();
    let y: Vec<f64> = far.into_iter().chain([0.0]).chain(far.into_iter().rev().map(|y| -y)).collect();
    let vertex = 8 * x.len() + 10;
    let floor = grid(DVec3::ZERO, [DVec3::X, DVec3::Y], &x, &y);
    assert_eq!(floor.positions()[vertex], [number("distance") as f32, 0.0, 0.0]);
    let steps = |from: f64, to: f64| (0..=12).map(move |k| from + (to - from) * f64::from(k) / 12.0);
    let up: Vec<f64> = steps(0.0, number("height")).collect();
    let side: Vec<f64> = steps(-number("half_width"), number("half_width")).collect();
    let wall = grid(DVec3::ZERO, [DVec3::Z, -DVec3::Y], &up, &side);
    let materials = ["floor_albedo", "wall_albedo"].map(|name| lambert(number(name)));
    let scene = Scene::new(&[floor, wall], &materials, 4, 4096);
    check_matte(&scene.matte(0), vertex, number("floor_albedo"), case, "direct", TEST);
    check_matte(&scene.matte(1), vertex, number("floor_albedo"), case, "one_bounce", TEST);
    check_matrix(&scene.bounced(1), vertex, &case["matrix_one_bounce"]);
}

/// The inside of a sphere, open where z is above the cosine of `opening`.
fn bowl(opening: f64) -> (Mesh, impl Fn(f64, f64) -> usize) {
    let (rows, columns) = (12, 72);
    let (mut positions, mut tangents, mut triangles) = (Vec::new(), Vec::new(), Vec::new());
    for row in 0..=rows {
        let polar = (opening + (180.0 - opening) * row as f64 / rows as f64).to_radians();
        for column in 0..=columns {
            let azimuth = (360.0 * column as f64 / columns as f64).to_radians();
            let place = Direction::from_angles(polar, azimuth).vector().as_vec3().to_array();
            positions.push(place);
            tangents.push([-azimuth.sin() as f32, azimuth.cos() as f32, 0.0, 1.0]);
            if row < rows && column < columns {
                let first = (row * (columns + 1) + column) as u32;
                let below = first + columns as u32 + 1;
                triangles.push([first, first + 1, below + 1]);
                triangles.push([first, below + 1, below]);
            }
        }
    }
    let normals = positions.iter().map(|place| place.map(|x| -x)).collect();
    let vertex = move |polar: f64, azimuth: f64| {
        let row = ((polar - opening) / (180.0 - opening) * rows as f64).round() as usize;
        row * (columns + 1) + (azimuth.rem_euclid(360.0) / 360.0 * columns as f64).round() as usize
    };
    (Mesh::new(positions, normals, tangents, None, triangles).unwrap(), vertex)
}

#[test]
fn a_matte_bowl_lights_itself() {
    const TEST: &str = "a_matte_bowl_lights_itself";
    let Some(reference) = test_data::reference(TEST, "prt-interreflection.json") else { return };
    let case = &reference["bowl"];
    let number = |case: &Value, name: &str| case[name].as_f64().unwrap();
    let (mesh, vertex) = bowl(number(case, "opening"));
    let albedo = number(case, "albedo");
    let scene = Scene::new(std::slice::from_ref(&mesh), &[lambert(albedo)], 4, 8192);
    let [direct, one, all] = [0, 1, 9].map(|bounces| scene.matte(bounces));
    for point in case["points"].as_array().unwrap() {
        let (polar, azimuth) = (number(point, "polar"), number(point, "azimuth"));
        let vertex = vertex(polar, azimuth);
        let place = Direction::from_angles(polar.to_radians(), azimuth.to_radians()).vector();
        let found = DVec3::from_array(mesh.positions()[vertex].map(f64::from));
        assert!((place - found).length() < 1e-5, "{place} {found}");
        check_matte(&direct, vertex, albedo, point, "direct", TEST);
        check_matte(&one, vertex, albedo, point, "one_bounce", TEST);
        check_matte(&all, vertex, albedo, point, "all_bounces", TEST);
    }
}

/// What the degree O cuts of a glossy reflection is 7, 2 and 1 percent at 4, 6 and 8.
#[test]
fn a_glossy_corner_lights_itself() {
    const TEST: &str = "a_glossy_corner_lights_itself";
    let Some(reference) = test_data::reference(TEST, "prt-interreflection.json") else { return };
    let light = test_data::reference(TEST, "lighting.json").unwrap();
    let rows: Vec<[f64; 3]> = light["sh"].as_array().unwrap().iter().take(25).map(numbers).collect();
    let light = Expansion::from_coefficients(degree(4), rows).unwrap();
    let case = &reference["glossy_corner"];
    let ward = |name: &str| {
        let parameter = |key: &str| case[name][1][key].as_f64().unwrap();
        let roughness = ["roughness_x", "roughness_y"].map(parameter);
        Material::Ward(Ward::new(roughness, [parameter("specular"); 3]).unwrap())
    };
    let (parts, vertex) = corner(6);
    for (output, limit) in [(4, 0.07), (6, 0.02), (8, 0.01)] {
        let scene = Scene::new(&parts, &[ward("floor"), ward("wall")], output, 2048);
        let transfer = scene.bounced(1);
        let floor = tabulate(&ward("floor"), degree(output), 128, Stop::NEVER).unwrap().0;
        let (mut found, mut expected) = (Vec::new(), Vec::new());
        for row in case["rows"].as_array().unwrap() {
            let viewer = Viewer::Distant(Direction::normalised(numbers(&row["view"]).into()));
            let seen = shade_with_transfer(&scene.frames, &floor, viewer, &transfer, &light);
            found.extend(seen[vertex(16.0)].map(f64::from));
            let parts = ["direct", "bounced"].map(|name| numbers::<3>(&row["degree_4"][name]));
            expected.extend((0..3).map(|channel| parts[0][channel] + parts[1][channel]));
        }
        let error = rms(&found, &expected);
        eprintln!("O = {output}: {:.2} %", 100.0 * error);
        assert!(found.len() >= 9 && error < limit, "O = {output}: {error}");
    }
}

/// Coloured materials have a transfer for each channel; no bounce is the shadows alone.
#[test]
fn each_channel_is_reflected_by_its_own_albedo() {
    let (parts, _) = corner(6);
    let mesh = Mesh::joined(&parts).unwrap();
    let (frames, occluders) = (Frames::of(&mesh).unwrap(), Occluders::of(&mesh));
    let directions = Directions::new(256, degree(4)).unwrap();
    let degrees = TransferDegrees { output: degree(2), input: degree(2) };
    let (shadows, _) = precompute(&frames, &occluders, &directions, degrees, Stop::NEVER).unwrap();
    let bounced = |albedo: [f64; 3], bounces: usize| {
        let material = Material::Lambert(Lambert::new(albedo).unwrap());
        let table = tabulate(&material, degree(2), 8, Stop::NEVER).unwrap().0;
        let (frames, occluders, directions, table) = (&frames, &occluders, &directions, &table);
        let mesh = ReflectingMesh { frames, occluders, directions, table };
        interreflect(mesh, &shadows, bounces, Stop::NEVER).unwrap()
    };
    assert!(bounced([0.5; 3], 0) == [shadows.clone()]);
    let colours = [0.8, 0.4, 0.0];
    let coloured = bounced(colours, 2);
    assert_eq!(coloured.len(), 3);
    assert!(coloured[2] == shadows);
    for (albedo, coloured) in colours.into_iter().zip(&coloured) {
        let grey = bounced([albedo; 3], 2);
        assert_eq!(grey.len(), 1);
        let pairs = grey[0].values().iter().zip(coloured.values());
        assert!(pairs.fold(0.0f32, |most, (a, b)| most.max((a - b).abs())) < 1e-6);
    }
}
