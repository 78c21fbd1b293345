//! The three ways of shading, and transfer without an occluder.

#![allow(clippy::unwrap_used, clippy::disallowed_methods, reason = "a test may panic")]

use brdf::{BrdfTable, Material, Ward, tabulate};
use sh::{Degree, Expansion, Stop};
use sphere::Direction;
use transfer::{
    Directions, FixedLight, FixedView, Frames, Occluders, Transfer, TransferDegrees, Viewer, precompute,
    shade, shade_with_transfer,
};

fn degree(l: usize) -> Degree {
    Degree::new(l).unwrap()
}

/// Numbers that look random, less for higher degrees.
fn light(degree: Degree) -> Expansion {
    let value = |row: usize, channel: usize| {
        let l = row.isqrt() as f64;
        ((row * 3 + channel) as f64 * 12.9898).sin() / (1.0 + l)
    };
    let rows = (0..degree.rows()).map(|row| [0, 1, 2].map(|channel| value(row, channel))).collect();
    Expansion::from_coefficients(degree, rows).unwrap()
}

fn table(specular: [f64; 3], l: usize) -> BrdfTable {
    tabulate(&Material::Ward(Ward::new([0.3, 0.6], specular).unwrap()), degree(l), 32, Stop::NEVER).unwrap().0
}

fn knot() -> Frames {
    Frames::of(&mesh::shape("torus-knot").unwrap()).unwrap()
}

#[track_caller]
fn check_same(a: &[[f32; 3]], b: &[[f32; 3]], what: &str) {
    assert_eq!(a.len(), b.len());
    let size = a.as_flattened().iter().fold(0.0f32, |most, value| most.max(value.abs()));
    let pairs = a.as_flattened().iter().zip(b.as_flattened());
    let worst = pairs.fold(0.0f32, |most, (a, b)| most.max((a - b).abs())) / size;
    assert!(size > 0.1 && worst < 1e-5, "{what}: {worst:e} of {size}");
}

#[test]
fn all_three_ways_agree() {
    let frames = knot();
    assert!(!frames.len().is_multiple_of(8), "the last block is not full: {}", frames.len());
    for (specular, l) in [([1.0; 3], 4), ([1.0, 0.5, 0.2], 4), ([1.0; 3], 0), ([1.0; 3], 7)] {
        let (table, light) = (table(specular, l), light(degree(l)));
        for viewer in [Viewer::Distant(Direction::from_angles(1.0, 2.0)), Viewer::At([2.0, -1.0, 0.5])] {
            let both = shade(&frames, &table, viewer, &light);
            check_same(&both, &FixedLight::new(&frames, &light).shade(&frames, &table, viewer), "light");
            check_same(&both, &FixedView::new(&frames, &table, viewer).shade(&light), "view");
        }
    }
}

/// sum of L_i c_i with the light turned by `sh::rotate`, in double precision.
#[test]
fn a_vertex_has_the_sum_of_light_and_table_in_its_frame() {
    let (knot, table, light) = (mesh::shape("torus-knot").unwrap(), table([1.0; 3], 4), light(degree(4)));
    let view = Direction::from_angles(0.4, -1.0);
    let found = shade(&Frames::of(&knot).unwrap(), &table, Viewer::Distant(view), &light);
    for vertex in (0..found.len()).step_by(1009) {
        let double = |v: [f32; 3]| sphere::DVec3::from_array(v.map(f64::from));
        let [x, y, z, _] = knot.tangents()[vertex];
        let (n, x) = (double(knot.normals()[vertex]), double([x, y, z]));
        let matrix = sphere::DMat3::from_cols(x, n.cross(x), n).transpose();
        let q = sphere::DQuat::from_mat3(&matrix);
        let to_local = sphere::Rotation::from_quaternion(q.x, q.y, q.z, q.w).unwrap();
        let mut c = vec![0.0; 25];
        table.lookup_into(0, to_local.apply(view), &mut c);
        let local = sh::rotate(&light, to_local);
        for channel in 0..3 {
            let pairs = local.coefficients().iter().zip(&c);
            let sum: f64 = pairs.map(|(light, c)| light[channel] * f64::from(*c)).sum();
            let error = (sum - f64::from(found[vertex][channel])).abs();
            assert!(error < 2e-5, "{vertex}: {error:e}");
        }
    }
}

/// An open vertex has T = R, so that nothing changes; degrees that differ are cut to the lower.
#[test]
fn without_an_occluder_transfer_changes_nothing() {
    let plane = mesh::shape("plane").unwrap();
    let (frames, occluders) = (Frames::of(&plane).unwrap(), Occluders::of(&plane));
    let (table, light) = (table([1.0, 0.5, 0.2], 4), light(degree(4)));
    let viewer = Viewer::At([0.3, 0.2, 2.0]);
    for (output, input) in [(4, 4), (6, 4), (4, 2)] {
        let directions = Directions::new(512, degree(output + input)).unwrap();
        let degrees = TransferDegrees { output: degree(output), input: degree(input) };
        let (transfer, blind) = precompute(&frames, &occluders, &directions, degrees, Stop::NEVER).unwrap();
        assert_eq!((transfer.len(), blind), (4, 0));
        let found = shade_with_transfer(&frames, &table, viewer, &transfer, &light);
        check_same(&shade(&frames, &table, viewer, &light.to_degree(degree(input))), &found, "open");
    }
}

/// What is kept while only the view or only the light moves gives the same, whichever degree is the lowest.
#[test]
fn all_three_ways_agree_with_transfer() {
    let knot = mesh::shape("torus-knot").unwrap();
    let frames = Frames::of(&knot).unwrap();
    let directions = Directions::new(128, degree(5)).unwrap();
    let degrees = TransferDegrees { output: degree(3), input: degree(2) };
    let (transfer, _) =
        precompute(&frames, &Occluders::of(&knot), &directions, degrees, Stop::NEVER).unwrap();
    let viewer = Viewer::At([2.0, -1.0, 0.5]);
    for (specular, of_table, of_light) in [([1.0; 3], 3, 2), ([1.0, 0.5, 0.2], 2, 4), ([1.0; 3], 5, 1)] {
        let (table, light) = (table(specular, of_table), light(degree(of_light)));
        let both = shade_with_transfer(&frames, &table, viewer, &transfer, &light);
        let light_kept = FixedLight::with_transfer(std::slice::from_ref(&transfer), &light);
        assert_eq!(light_kept.degree(), degree(3));
        check_same(&both, &light_kept.shade(&frames, &table, viewer), "light");
        let view_kept = FixedView::with_transfer(&frames, &table, viewer, std::slice::from_ref(&transfer));
        check_same(&both, &view_kept.shade(&light), "view");
    }
}

/// A vertex inside a closed mesh sees nothing of the sky above its horizon.
#[test]
fn a_vertex_that_sees_nothing_is_counted() {
    let shell = mesh::shape("sphere").unwrap();
    let inside = mesh::Mesh::new(
        vec![[0.1, 0.0, 0.0]],
        vec![[0.0, 0.0, 1.0]],
        vec![[1.0, 0.0, 0.0, 1.0]],
        None,
        Vec::new(),
    );
    let frames = Frames::of(&inside.unwrap()).unwrap();
    let directions = Directions::new(512, degree(8)).unwrap();
    let degrees = TransferDegrees { output: degree(4), input: degree(4) };
    let (transfer, blind) =
        precompute(&frames, &Occluders::of(&shell), &directions, degrees, Stop::NEVER).unwrap();
    assert_eq!(blind, 1);
    let dark = shade_with_transfer(
        &frames,
        &tabulate(&Material::Lambert(brdf::Lambert::new([1.0; 3]).unwrap()), degree(4), 16, Stop::NEVER)
            .unwrap()
            .0,
        Viewer::Distant(Direction::Z),
        &transfer,
        &Expansion::from_coefficients(degree(0), vec![[3.545; 3]]).unwrap(),
    );
    // What remains of a radiance of 1 is what degree 4 rings.
    assert!(dark[0][0].abs() < 0.03, "{dark:?}");
}

#[test]
fn results_are_the_same_with_any_number_of_threads() {
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let knot = mesh::shape("torus-knot").unwrap();
            let frames = Frames::of(&knot).unwrap();
            let directions = Directions::new(128, degree(2)).unwrap();
            let degrees = TransferDegrees { output: degree(1), input: degree(1) };
            let (transfer, _) =
                precompute(&frames, &Occluders::of(&knot), &directions, degrees, Stop::NEVER).unwrap();
            let viewer = Viewer::Distant(Direction::X);
            let lit = shade_with_transfer(&frames, &table([1.0; 3], 1), viewer, &transfer, &light(degree(1)));
            (transfer, lit, shade(&frames, &table([1.0; 3], 1), viewer, &light(degree(1))))
        })
    };
    assert!(with(1) == with(3));
}

#[test]
fn bad_input_is_an_error() {
    let bad = |normal: [f32; 3], tangent: [f32; 4]| {
        let mesh = mesh::Mesh::new(vec![[0.0; 3]], vec![normal], vec![tangent], None, Vec::new()).unwrap();
        Frames::of(&mesh).unwrap_err().to_string()
    };
    let expected = "vertex 0 has a normal and a tangent that are not at a right angle, or not of length 1";
    assert_eq!(bad([0.0, 0.0, 1.0], [0.0, 0.0, 1.0, 1.0]), expected);
    assert_eq!(bad([0.0, 0.0, 0.5], [1.0, 0.0, 0.0, 1.0]), expected);
    let plane = mesh::shape("plane").unwrap();
    let (frames, occluders) = (Frames::of(&plane).unwrap(), Occluders::of(&plane));
    let directions = Directions::new(512, degree(8)).unwrap();
    let degrees = TransferDegrees { output: degree(6), input: degree(4) };
    let few = precompute(&frames, &occluders, &directions, degrees, Stop::NEVER).unwrap_err();
    assert_eq!(few.to_string(), "directions that are exact to degree 8 are too few; expected degree 10");
    assert_eq!(Transfer::new(degree(1), degree(1), vec![0.0; 17]), None);
    let degrees = TransferDegrees { output: degree(4), input: degree(4) };
    let stopped = transfer::precompute(&frames, &occluders, &directions, degrees, Stop::when(&|| true));
    assert_eq!(stopped.unwrap_err(), sh::Stopped.into());
}
