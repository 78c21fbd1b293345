//! Shading under light that differs from vertex to vertex.

#![allow(clippy::unwrap_used, clippy::disallowed_methods, reason = "a test may panic")]

use brdf::{BrdfTable, Lambert, Material, Ward, tabulate};
use mesh::Mesh;
use sh::{Degree, Expansion, Stop};
use sphere::{DMat3, DQuat, DVec3, Direction, Rotation};
use transfer::{
    Directions, Form, Frames, HalfTransfer, LightField, LightFieldError, MatteTransfer, Occluders,
    StoredTransfer, TransferDegrees, Viewer, Visibility, precompute, shade,
};

fn degree(l: usize) -> Degree {
    Degree::new(l).unwrap()
}

/// Numbers that look random, other ones for each `seed`.
fn light(degree: Degree, seed: f64) -> Expansion {
    let value = |row: usize, channel: usize| {
        ((row * 3 + channel) as f64 * 12.9898 + seed).sin() / (1.0 + row.isqrt() as f64)
    };
    let rows = (0..degree.rows()).map(|row| [0, 1, 2].map(|channel| value(row, channel))).collect();
    Expansion::from_coefficients(degree, rows).unwrap()
}

const POINTS: [[f64; 3]; 4] = [[1.0, 0.2, 0.1], [-1.2, 0.4, 0.3], [0.1, -0.9, 2.0], [0.0, 0.0, -0.5]];
const VIEWER: Viewer = Viewer::At([2.0, -1.0, 0.5]);

fn field() -> LightField {
    LightField::new(POINTS.to_vec(), (0..4).map(|k| light(degree(4), f64::from(k))).collect()).unwrap()
}

fn ward(specular: [f64; 3]) -> BrdfTable {
    tabulate(&Material::Ward(Ward::new([0.3, 0.6], specular).unwrap()), degree(4), 32, Stop::NEVER).unwrap().0
}

/// Every 31st vertex of the knot, in the shadow of all of it.
fn knot() -> (Mesh, Occluders) {
    let knot = mesh::shape("torus-knot").unwrap();
    let some = || (0..knot.positions().len()).step_by(31);
    let mesh = Mesh::new(
        some().map(|vertex| knot.positions()[vertex]).collect(),
        some().map(|vertex| knot.normals()[vertex]).collect(),
        some().map(|vertex| knot.tangents()[vertex]).collect(),
        None,
        Vec::new(),
    );
    (mesh.unwrap(), Occluders::of(&knot))
}

/// sum of w_k L_k with w_k as the formula has it, in double precision.
fn blend(place: [f32; 3]) -> Expansion {
    let distance = |point: [f64; 3]| -> f64 {
        (0..3).map(|axis| (point[axis] - f64::from(place[axis])).powi(2)).sum::<f64>().sqrt()
    };
    let weights = POINTS.map(|point| distance(point).powi(-2));
    let total: f64 = weights.iter().sum();
    let mut sum = Expansion::zero(degree(4));
    for (k, weight) in weights.into_iter().enumerate() {
        for (sum, row) in sum.coefficients_mut().iter_mut().zip(light(degree(4), k as f64).coefficients()) {
            (0..3).for_each(|channel| sum[channel] += weight / total * row[channel]);
        }
    }
    sum
}

fn double(v: [f32; 3]) -> DVec3 {
    DVec3::from_array(v.map(f64::from))
}

/// c_i toward the viewer and the rotation into the frame of a vertex.
fn seen(mesh: &Mesh, vertex: usize, table: &BrdfTable) -> (Vec<f32>, Rotation) {
    let [x, y, z, _] = mesh.tangents()[vertex];
    let (n, x) = (double(mesh.normals()[vertex]), double([x, y, z]));
    let q = DQuat::from_mat3(&DMat3::from_cols(x, n.cross(x), n).transpose());
    let into_frame = Rotation::from_quaternion(q.x, q.y, q.z, q.w).unwrap();
    let Viewer::At(place) = VIEWER else { panic!("a place") };
    let view = Direction::new(DVec3::from_array(place) - double(mesh.positions()[vertex])).unwrap();
    let mut c = vec![0.0; table.texel()];
    table.lookup_into(0, into_frame.apply(view), &mut c);
    (c, into_frame)
}

#[track_caller]
fn check(found: &[[f32; 3]], expected: &[[f64; 3]], limit: f64, what: &str) {
    assert_eq!(found.len(), expected.len());
    let size = expected.as_flattened().iter().fold(0.0f64, |most, value| most.max(value.abs()));
    let pairs = found.as_flattened().iter().zip(expected.as_flattened());
    let worst = pairs.fold(0.0f64, |most, (a, b)| most.max((f64::from(*a) - b).abs())) / size;
    assert!(size > 0.1 && worst < limit, "{what}: {worst:e} of {size}");
}

/// Each vertex by itself: the blend of the light, turned by `sh::rotate`, times the table.
#[test]
fn a_vertex_is_lit_by_the_light_at_its_place() {
    let (mesh, _) = knot();
    let frames = Frames::of(&mesh).unwrap();
    for specular in [[1.0; 3], [1.0, 0.5, 0.2]] {
        let table = ward(specular);
        let expected = |vertex: usize| {
            let (c, into_frame) = seen(&mesh, vertex, &table);
            let local = sh::rotate(&blend(mesh.positions()[vertex]), into_frame);
            [0, 1, 2].map(|channel| {
                let c = c[channel.min(table.channels() - 1)..].iter().step_by(table.channels());
                local.coefficients().iter().zip(c).map(|(light, c)| light[channel] * f64::from(*c)).sum()
            })
        };
        let expected: Vec<[f64; 3]> = (0..frames.len()).map(expected).collect();
        check(&field().shade(&frames, &table, VIEWER), &expected, 1e-5, "near light");
    }
}

/// Each vertex by itself: c T L of its own light, with the matrices that each form stands for.
#[test]
fn shadows_fall_in_near_light_in_every_form() {
    let (mesh, occluders) = knot();
    let frames = Frames::of(&mesh).unwrap();
    let directions = Directions::new(256, degree(8)).unwrap();
    let degrees = TransferDegrees { output: degree(4), input: degree(4) };
    let (matrices, _) = precompute(&frames, &occluders, &directions, degrees, Stop::NEVER).unwrap();
    let (visibility, _) =
        Visibility::precompute(&frames, &occluders, &directions, degrees, Stop::NEVER).unwrap();
    let forms = [Form::Matrices(HalfTransfer::of(&matrices)), Form::Visibility(visibility)];
    let table = ward([1.0, 0.5, 0.2]);
    for form in forms {
        let stored = StoredTransfer::new(vec![form]).unwrap();
        let matrices = stored.matrices(&frames).unwrap().remove(0);
        let expected = |vertex: usize| {
            let (c, _) = seen(&mesh, vertex, &table);
            let light = blend(mesh.positions()[vertex]);
            [0, 1, 2].map(|channel| {
                let arrives = matrices.matrix(vertex).chunks_exact(25).map(|row| -> f64 {
                    row.iter().zip(light.coefficients()).map(|(t, l)| f64::from(*t) * l[channel]).sum()
                });
                c.chunks_exact(3).zip(arrives).map(|(c, light)| f64::from(c[channel]) * light).sum()
            })
        };
        let expected: Vec<[f64; 3]> = (0..frames.len()).map(expected).collect();
        let found = field().shade_with_transfer(&frames, &table, VIEWER, &stored).unwrap();
        check(&found, &expected, 2e-5, "transfer");
    }
    // A matte one has the albedo times t L.
    let (matte, _) =
        MatteTransfer::precompute(&frames, &occluders, &directions, degree(4), Stop::NEVER).unwrap();
    let chalk = Material::Lambert(Lambert::new([0.8, 0.4, 0.1]).unwrap());
    let (chalk, _) = tabulate(&chalk, degree(4), 16, Stop::NEVER).unwrap();
    let expected = |vertex: usize| {
        let (t, light) = (&matte.values()[vertex * 25..][..25], blend(mesh.positions()[vertex]));
        [(0, 0.8), (1, 0.4), (2, 0.1)].map(|(channel, albedo)| {
            let pairs = t.iter().zip(light.coefficients());
            albedo * pairs.map(|(t, light)| f64::from(*t) * light[channel]).sum::<f64>()
        })
    };
    let expected: Vec<[f64; 3]> = (0..frames.len()).map(expected).collect();
    let stored = StoredTransfer::new(vec![Form::Matte(matte)]).unwrap();
    check(&field().shade_with_transfer(&frames, &chalk, VIEWER, &stored).unwrap(), &expected, 1e-5, "matte");
    assert!(field().shade_with_transfer(&frames, &table, VIEWER, &stored).is_err());
}

#[test]
fn the_same_light_at_all_points_is_light_from_far_away() {
    let frames = Frames::of(&knot().0).unwrap();
    let table = ward([1.0; 3]);
    let far: Vec<[f64; 3]> =
        shade(&frames, &table, VIEWER, &light(degree(4), 0.5)).iter().map(|rgb| rgb.map(f64::from)).collect();
    for count in [1, 4] {
        let same = vec![light(degree(4), 0.5); count];
        let field = LightField::new(POINTS[..count].to_vec(), same).unwrap();
        check(&field.shade(&frames, &table, VIEWER), &far, 1e-5, "the same light");
    }
    // What is added everywhere is added to each; zeros continue the lower degree.
    let (first, rest) = (light(degree(4), 0.5), light(degree(2), 0.7));
    let field = LightField::new(POINTS.to_vec(), vec![first.clone(); 4]).unwrap().plus(&rest);
    let mut sum = rest.to_degree(degree(4));
    for (sum, row) in sum.coefficients_mut().iter_mut().zip(first.coefficients()) {
        (0..3).for_each(|channel| sum[channel] += row[channel]);
    }
    assert_eq!(field.lights(), [sum.clone(), sum.clone(), sum.clone(), sum]);
}

#[test]
fn a_blend_is_exact_at_the_points_and_smooth_between_them() {
    let field = field();
    for (k, point) in POINTS.iter().enumerate() {
        assert_eq!(field.at(*point), field.lights()[k]);
        let near = field.at(point.map(|x| x + 1e-7));
        let off = near.coefficients()[0][0] - field.lights()[k].coefficients()[0][0];
        assert!(off.abs() < 1e-9, "{off}");
    }
    let far = field.at([1e9, 0.0, 0.0]).coefficients()[3][1];
    let mean = field.lights().iter().map(|light| light.coefficients()[3][1]).sum::<f64>() / 4.0;
    assert!((far - mean).abs() < 1e-6, "{far} {mean}");
    assert!(field.at([1e200, -1e200, f64::MAX]).coefficients().as_flattened().iter().all(|x| x.is_finite()));
}

#[test]
fn results_are_the_same_with_any_number_of_threads() {
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| field().shade(&Frames::of(&knot().0).unwrap(), &ward([1.0; 3]), VIEWER))
    };
    assert!(with(1) == with(3));
}

#[test]
fn points_without_light_are_refused() {
    let new = |points: &[[f64; 3]], lights: usize| {
        LightField::new(points.to_vec(), vec![light(degree(1), 0.0); lights])
    };
    assert_eq!(new(&[], 0), Err(LightFieldError::Empty));
    assert_eq!(new(&POINTS, 3), Err(LightFieldError::Count { points: 4, lights: 3 }));
    assert_eq!(new(&[[0.0; 3], [0.0, f64::NAN, 0.0]], 2), Err(LightFieldError::NotFinite(1)));
    assert_eq!(new(&[[0.0; 3], [1.0; 3], [0.0; 3]], 3), Err(LightFieldError::SamePlace(0, 2)));
    let mixed = LightField::new(POINTS[..2].to_vec(), vec![light(degree(1), 0.0), light(degree(3), 0.0)]);
    assert_eq!(mixed.unwrap().degree(), degree(3));
}
