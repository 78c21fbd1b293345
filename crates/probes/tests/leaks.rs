//! What leaks through a wall, next to what the side of the wall says.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

use std::sync::atomic::{AtomicUsize, Ordering::SeqCst};

use probes::{Blend, Lattice, Material, Part, ProbePlaces, Scene, SceneParts, Surfaces, Volume, leaks};
use sh::{Stop, Stopped};

/// The six sides of a box, with their fronts outside, or inside of a room.
fn sides(least: [f32; 3], most: [f32; 3], is_room: bool) -> Vec<[[f32; 3]; 3]> {
    let corner = |k: usize| [0, 1, 2].map(|axis| if k >> axis & 1 == 0 { least[axis] } else { most[axis] });
    let faces = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let triangles = faces.iter().flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]]);
    let turned = |[a, b, c]: [usize; 3]| if is_room { [a, c, b] } else { [a, b, c] };
    triangles.map(|corners| turned(corners).map(corner)).collect()
}

const ROOM: [[f32; 3]; 2] = [[-2.0, -2.0, 0.0], [2.0, 2.0, 2.5]];

/// A room with a wall of 2 cm across its middle.
fn two_rooms() -> Scene {
    let triangles =
        [sides(ROOM[0], ROOM[1], true), sides([-2.0, -0.01, 0.0], [2.0, 0.01, 2.5], false)].concat();
    let count = triangles.len();
    Scene::new(SceneParts {
        triangles,
        material_of: vec![0; count],
        attributes_of: vec![SceneParts::NONE; count],
        materials: vec![Material::default()],
        parts: vec![Part { name: "rooms".into(), triangles: count }],
        ..SceneParts::default()
    })
    .unwrap()
}

fn placed(surfaces: &Surfaces<'_>, boxes: &[[[f32; 3]; 2]], lattice: Lattice) -> ProbePlaces {
    let volume = |bounds: &[[f32; 3]; 2]| Volume::with_spacing("box".into(), *bounds, 0.5, lattice).unwrap();
    ProbePlaces::new(surfaces, boxes.iter().map(volume).collect(), &[], Stop::NEVER).unwrap()
}

/// The weight of a blend that belongs to the other side of the wall: for each probe the product along the
/// axes of 1 - distance in spacings, for a place that is clamped between the outer probes.
fn other_side(places: &ProbePlaces, point: [f32; 3], normal: [f32; 3], offset: f32) -> f32 {
    let volume = &places.volumes()[0];
    let spacing = volume.spacing();
    let (first, last) = (places.grid()[0], places.grid()[places.len() - 1]);
    let at = [0, 1, 2]
        .map(|axis| (point[axis] + offset * spacing[axis] * normal[axis]).clamp(first[axis], last[axis]));
    let weight = |probe: &[f32; 3]| -> f32 {
        (0..3).map(|axis| (1.0 - (probe[axis] - at[axis]).abs() / spacing[axis]).max(0.0)).product()
    };
    let side = |y: f32| y > 0.0;
    // The wall's own points are on the side that they face.
    let own = side(point[1] + 0.005 * normal[1]);
    places.grid().iter().filter(|probe| side(probe[1]) != own).map(weight).sum()
}

#[test]
fn what_leaks_is_the_weight_of_the_other_side() {
    let scene = two_rooms();
    let surfaces = Surfaces::new(&scene);
    let places = placed(&surfaces, &[ROOM], Lattice::Centres);
    for (blend, offset) in [(Blend::Three, 0.5), (Blend::Bevy, 0.0)] {
        let found = leaks(&surfaces, &places, blend, 2000, Stop::NEVER).unwrap();
        // Only the ends of the wall are in the walls of the room, and face away from it.
        assert!(found.points.len() > 1980 && found.points.len() + found.hidden == 2000, "{}", found.hidden);
        for leak in &found.points {
            let expected = other_side(&places, leak.point, leak.normal, offset);
            assert!((leak.share - expected).abs() < 1e-5, "{blend:?} {leak:?}: {expected}");
            let side = |y: f32| y > 0.0;
            let own = side(leak.point[1] + 0.005 * leak.normal[1]);
            assert!(leak.probes.iter().all(|(probe, _)| side(places.grid()[*probe as usize][1]) != own));
        }
        // Beside the wall, half of the cells next to it leak up to a half: a few percent of the whole.
        assert!((0.01..0.2).contains(&found.mean()), "{blend:?}: {}", found.mean());
        let worst = found.worst();
        assert!(worst[0].share >= worst[1].share && worst[0].share > 0.4, "{:?}", worst[0]);
    }
}

#[test]
fn nothing_leaks_by_visibility_or_between_boxes_that_end_at_the_wall() {
    let scene = two_rooms();
    let surfaces = Surfaces::new(&scene);
    let one = placed(&surfaces, &[ROOM], Lattice::Centres);
    let found = leaks(&surfaces, &one, Blend::Visible, 2000, Stop::NEVER).unwrap();
    assert!(found.mean() == 0.0 && found.points.len() > 1980, "{:?}", found.worst());
    let [least, most] = ROOM;
    let halves = [[least, [2.0, -0.005, 2.5]], [[-2.0, 0.005, 0.0], most]];
    for lattice in [Lattice::Centres, Lattice::Corners] {
        let two = placed(&surfaces, &halves, lattice);
        for blend in [Blend::Three, Blend::Bevy] {
            let found = leaks(&surfaces, &two, blend, 2000, Stop::NEVER).unwrap();
            // Boxes of corners grow by half a cell: they reach through the wall, and Bevy means both.
            let is_tight = lattice == Lattice::Centres;
            assert_eq!(found.mean() == 0.0, is_tight, "{lattice:?} {blend:?}: {}", found.mean());
            assert!(found.points.len() > 1900, "{}", found.points.len());
        }
    }
}

/// The points are the first of one sequence, and spread over the area: as many in each half of the room.
#[test]
fn points_are_spread_over_the_area() {
    let scene = two_rooms();
    let surfaces = Surfaces::new(&scene);
    let places = placed(&surfaces, &[ROOM], Lattice::Centres);
    let of = |count| leaks(&surfaces, &places, Blend::Bevy, count, Stop::NEVER).unwrap().points;
    let (few, many) = (of(100), of(2000));
    assert_eq!(few[..], many[..few.len()]);
    let [x, y, z] = [0, 1, 2].map(|axis| ROOM[1][axis] - ROOM[0][axis]);
    let all = 2.0 * (x * y + y * z + z * x) + 2.0 * x * z;
    let on = |axis: usize, at: f32| many.iter().filter(|leak| leak.point[axis] == at).count() as f32;
    for (found, area) in [(on(2, 0.0), x * y), (on(0, 2.0), y * z), (on(1, 0.01), x * z)] {
        let expected = 2000.0 * area / all;
        assert!((found - expected).abs() < 0.05 * expected, "{found} {expected}");
    }
}

/// Most of the points that are tried may be in no volume: they ask whether to stop as well.
#[test]
fn the_choice_of_points_stops() {
    let scene = two_rooms();
    let surfaces = Surfaces::new(&scene);
    let nowhere = placed(&surfaces, &[[[-0.5, 1.0, 1.0], [0.5, 1.5, 1.5]]], Lattice::Centres);
    let found = leaks(&surfaces, &nowhere, Blend::Bevy, 100, Stop::NEVER).unwrap();
    assert_eq!((found.points.len(), found.hidden), (0, 0));
    let asked = AtomicUsize::new(0);
    let ends = || asked.fetch_add(1, SeqCst) >= 20;
    assert_eq!(leaks(&surfaces, &nowhere, Blend::Bevy, 10_000, Stop::when(&ends)), Err(Stopped));
    // Two threads or a hundred: each of them asks once more at most.
    assert!(asked.into_inner() < 1000);
}
