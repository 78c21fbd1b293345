//! Rooms in buildings whose walls are known.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

use std::sync::atomic::{AtomicUsize, Ordering::SeqCst};

use probes::{Material, Part, Scene, SceneParts, Surfaces, rooms};
use sh::{Stop, Stopped};

type Bounds = [[f32; 3]; 2];

/// The six sides of a box, with their fronts outside.
fn sides([least, most]: Bounds) -> Vec<[[f32; 3]; 3]> {
    let corner = |k: usize| [0, 1, 2].map(|axis| if k >> axis & 1 == 0 { least[axis] } else { most[axis] });
    let faces = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let triangles = faces.iter().flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]]);
    triangles.map(|corners| corners.map(corner)).collect()
}

fn scene(solids: &[Bounds]) -> Scene {
    let triangles: Vec<_> = solids.iter().flat_map(|solid| sides(*solid)).collect();
    let count = triangles.len();
    Scene::new(SceneParts {
        triangles,
        material_of: vec![0; count],
        attributes_of: vec![SceneParts::NONE; count],
        materials: vec![Material::default()],
        parts: vec![Part { name: "house".into(), triangles: count }],
        ..SceneParts::default()
    })
    .unwrap()
}

/// The walls of 20 cm around rooms of 6 x 4 x 2.6 m, and what is in them.
fn house(inside: &[Bounds]) -> Scene {
    let around: [Bounds; 6] = [
        [[-0.2, -0.2, -0.2], [6.2, 4.2, 0.0]],
        [[-0.2, -0.2, 2.6], [6.2, 4.2, 2.8]],
        [[-0.2, -0.2, 0.0], [0.0, 4.2, 2.6]],
        [[6.0, -0.2, 0.0], [6.2, 4.2, 2.6]],
        [[0.0, -0.2, 0.0], [6.0, 0.0, 2.6]],
        [[0.0, 4.0, 0.0], [6.0, 4.2, 2.6]],
    ];
    scene(&[&around, inside].concat())
}

/// The rooms of a house, sorted by their places.
fn found(scene: &Scene) -> Vec<Bounds> {
    let mut found = rooms(&Surfaces::new(scene), scene.bounds(), 1.25, Stop::NEVER).unwrap();
    found.sort_by(|a, b| a.partial_cmp(b).unwrap());
    found
}

fn assert_boxes(found: &[Bounds], expected: &[Bounds]) {
    assert_eq!(found.len(), expected.len(), "{found:?}");
    for (found, expected) in found.iter().zip(expected) {
        for (found, expected) in found.as_flattened().iter().zip(expected.as_flattened()) {
            assert!((found - expected).abs() < 1e-4, "{found:?} {expected:?}");
        }
    }
}

/// The box of a room ends in the middle of the walls.
#[test]
fn a_house_of_one_room_is_a_room() {
    assert_boxes(&found(&house(&[])), &[[[-0.1, -0.1, -0.1], [6.1, 4.1, 2.7]]]);
    // A table of 75 cm in it, and a column, are no walls.
    let table = [[[1.0, 1.0, 0.7], [2.6, 1.8, 0.75]], [[4.4, 3.0, 0.0], [4.7, 3.3, 2.6]]];
    assert_boxes(&found(&house(&table)), &[[[-0.1, -0.1, -0.1], [6.1, 4.1, 2.7]]]);
}

/// A door of 90 cm by 2 m is open in a wall of 10 cm, whose boxes meet in it.
#[test]
fn rooms_end_at_walls_with_a_door() {
    let wall = [
        [[2.5, 0.0, 0.0], [2.6, 1.5, 2.6]],
        [[2.5, 2.4, 0.0], [2.6, 4.0, 2.6]],
        [[2.5, 1.5, 2.0], [2.6, 2.4, 2.6]],
    ];
    let expected = [[[-0.1, -0.1, -0.1], [2.55, 4.1, 2.7]], [[2.55, -0.1, -0.1], [6.1, 4.1, 2.7]]];
    assert_boxes(&found(&house(&wall)), &expected);
}

/// An L around a closed room, in two boxes; none of them holds a part of the room.
#[test]
fn a_room_in_the_form_of_an_l_has_two_boxes() {
    let walls = [[[3.0, 0.0, 0.0], [3.02, 2.0, 2.6]], [[3.0, 2.0, 0.0], [6.0, 2.02, 2.6]]];
    let found = found(&house(&walls));
    assert_eq!(found.len(), 3, "{found:?}");
    let volume = |[least, most]: &Bounds| -> f32 { (0..3).map(|k| most[k] - least[k]).product() };
    let common = |a: &Bounds, b: &Bounds| -> f32 {
        (0..3).map(|k| (a[1][k].min(b[1][k]) - a[0][k].max(b[0][k])).max(0.0)).product()
    };
    let all: f32 = found.iter().map(volume).sum();
    let whole = volume(&[[-0.1, -0.1, -0.1], [6.1, 4.1, 2.7]]);
    assert!((all / whole - 1.0).abs() < 1e-3, "{found:?}");
    assert!(
        common(&found[0], &found[1]) + common(&found[1], &found[2]) + common(&found[0], &found[2]) < 1e-3
    );
    let room = [[3.02, 0.0, 0.0], [6.0, 2.0, 2.6]];
    let holding: Vec<&Bounds> = found.iter().filter(|own| common(own, &room) > 0.0).collect();
    assert_boxes(&[*holding[0]], &[[[3.01, -0.1, -0.1], [6.1, 2.01, 2.7]]]);
    assert_eq!(holding.len(), 1);
}

/// A corridor of 1 m, too narrow for the cube that finds rooms, between two of them, with doors.
#[test]
fn a_corridor_is_a_room() {
    let wall = |x: f32| {
        [
            [[x, 0.0, 0.0], [x + 0.1, 1.0, 2.6]],
            [[x, 1.9, 0.0], [x + 0.1, 4.0, 2.6]],
            [[x, 1.0, 2.0], [x + 0.1, 1.9, 2.6]],
        ]
    };
    let found = found(&house(&[wall(2.4), wall(3.5)].concat()));
    let expected = [
        [[-0.1, -0.1, -0.1], [2.45, 4.1, 2.7]],
        [[2.45, -0.1, -0.1], [3.55, 4.1, 2.7]],
        [[3.55, -0.1, -0.1], [6.1, 4.1, 2.7]],
    ];
    assert_boxes(&found, &expected);
}

/// A massive block is no room, and there is none where nothing is as wide as half a metre.
#[test]
fn solids_are_no_rooms() {
    let surfaces = scene(&[[[0.0; 3], [3.0, 3.0, 3.0]]]);
    assert_boxes(&rooms(&Surfaces::new(&surfaces), surfaces.bounds(), 1.25, Stop::NEVER).unwrap(), &[]);
}

/// Steps of the lattice are a little shorter along an axis that is no multiple of them: 13 nominal ones are
/// 1.3 m, and 13 of those across this building 1.244 m, less than the opening.
#[test]
fn rooms_end_at_an_opening_that_is_a_little_too_narrow() {
    let wide = 2.01;
    let around: [Bounds; 6] = [
        [[-0.2, 0.0, -0.2], [6.2, wide, 0.0]],
        [[-0.2, 0.0, 2.6], [6.2, wide, 2.8]],
        [[-0.2, 0.0, 0.0], [0.0, wide, 2.6]],
        [[6.0, 0.0, 0.0], [6.2, wide, 2.6]],
        [[0.0, 0.0, 0.0], [6.0, 0.1, 2.6]],
        [[0.0, wide - 0.1, 0.0], [6.0, wide, 2.6]],
    ];
    let with_opening = |from: f32, to: f32| {
        let wall = [[[2.93, 0.1, 0.0], [3.03, from, 2.6]], [[2.93, to, 0.0], [3.03, wide - 0.1, 2.6]]];
        found(&scene(&[&around[..], &wall].concat())).len()
    };
    assert_eq!(with_opening(0.333, 1.582), 2);
    assert_eq!(with_opening(0.233, 1.682), 1);
}

/// Asking to stop ends every part of the search: none of them is without a question.
#[test]
fn the_search_stops_wherever_it_is() {
    let scene = house(&[[[2.5, 0.0, 0.0], [2.6, 1.5, 2.6]], [[2.5, 2.4, 0.0], [2.6, 4.0, 2.6]]]);
    let surfaces = Surfaces::new(&scene);
    let asked = AtomicUsize::new(0);
    let count = || {
        asked.fetch_add(1, SeqCst);
        false
    };
    rooms(&surfaces, scene.bounds(), 1.25, Stop::when(&count)).unwrap();
    let all = asked.into_inner();
    for before in 0..all {
        let asked = AtomicUsize::new(0);
        let ends = || asked.fetch_add(1, SeqCst) >= before;
        assert_eq!(rooms(&surfaces, scene.bounds(), 1.25, Stop::when(&ends)), Err(Stopped));
    }
    // A layer of the lattice, 4096 places at a time of two looks at them, and the boxes.
    assert!(all > 30 + 2 * (65 * 44 * 30 / 4096), "{all}");
}
