//! A bake that is stopped in the middle ends at once, in every form.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

use std::sync::atomic::{AtomicUsize, Ordering};

use brdf::{BrdfTable, Lambert, Material, Ward, tabulate};
use mesh::Mesh;
use sh::{Degree, Stop};
use transfer::{
    Directions, Frames, HalfTransfer, MatteTransfer, Occluders, ReflectingMesh, TransferDegrees,
    TransferError, Visibility, interreflect, interreflect_matte, precompute,
};

fn degree(l: usize) -> Degree {
    Degree::new(l).unwrap()
}

/// How often `work` asks whether to stop, and that it stops whenever the answer is yes.
fn asked<T: std::fmt::Debug>(what: &str, work: &dyn Fn(Stop<'_>) -> Option<T>) -> usize {
    let run = |last: usize| {
        let count = AtomicUsize::new(0);
        let done = work(Stop::when(&|| count.fetch_add(1, Ordering::Relaxed) >= last)).is_some();
        (done, count.into_inner())
    };
    let (done, all) = run(usize::MAX);
    assert!(done && all > 10, "{what} asks {all} times");
    for last in [0, all / 2, all - 1] {
        let (done, count) = run(last);
        // Each thread ends when it is told to, or when it sees that another was.
        let most = last + 2 * rayon::current_num_threads();
        assert!(!done && count <= most, "{what} asked {count} times, to be stopped after {last}");
    }
    all
}

/// What was baked, if it was not stopped.
fn unless<T>(found: Result<T, TransferError>) -> Option<T> {
    match found {
        Ok(found) => Some(found),
        Err(TransferError::Stopped(_)) => None,
        Err(other) => panic!("{other}"),
    }
}

fn table(material: Material) -> BrdfTable {
    tabulate(&material, degree(1), 8, Stop::NEVER).unwrap().0
}

#[test]
fn every_form_and_bounce_asks_whether_to_stop() {
    let planes = Mesh::joined(&vec![mesh::shape("plane").unwrap(); 100]).unwrap();
    let (frames, occluders) = (Frames::of(&planes).unwrap(), Occluders::of(&planes));
    let (one, directions) = (degree(1), Directions::new(32, degree(2)).unwrap());
    let degrees = TransferDegrees { output: one, input: one };
    let blocks = frames.len().div_ceil(8);
    let matrices =
        asked("matrices", &|stop| unless(precompute(&frames, &occluders, &directions, degrees, stop)));
    let half = asked("half", &|stop| {
        unless(HalfTransfer::precompute(&frames, &occluders, &directions, degrees, stop))
    });
    let visibility = asked("visibility", &|stop| {
        unless(Visibility::precompute(&frames, &occluders, &directions, degrees, stop))
    });
    let matte = asked("matte", &|stop| {
        unless(MatteTransfer::precompute(&frames, &occluders, &directions, one, stop))
    });
    assert_eq!([matrices, half, visibility, matte], [blocks; 4]);
    let (shadows, _) = precompute(&frames, &occluders, &directions, degrees, Stop::NEVER).unwrap();
    let metal = table(Material::Ward(Ward::new([0.3, 0.6], [1.0; 3]).unwrap()));
    let chalk = table(Material::Lambert(Lambert::new([0.5; 3]).unwrap()));
    for (name, table, expected) in [("metal", &metal, 2 * blocks), ("chalk", &chalk, 3 * blocks)] {
        let bounces = asked(name, &|stop| {
            let mesh =
                ReflectingMesh { frames: &frames, occluders: &occluders, directions: &directions, table };
            unless(interreflect(mesh, &shadows, 2, stop))
        });
        assert_eq!(bounces, expected, "{name}");
    }
    let bounces = asked("matte bounces", &|stop| {
        let table = &chalk;
        let mesh = ReflectingMesh { frames: &frames, occluders: &occluders, directions: &directions, table };
        unless(interreflect_matte(mesh, one, 2, stop))
    });
    assert_eq!(bounces, 3 * blocks);
}
