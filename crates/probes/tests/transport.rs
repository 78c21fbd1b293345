//! Transport in scenes whose light is known, and what must hold in any.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

use std::f64::consts::PI;

use probes::{
    Alpha, BakeError, BakeOptions, Emission, Lamp, LampKind, Lattice, LitProbes, Material, Part, PlacesError,
    ProbePlaces, Repair, Scene, SceneError, SceneLighting, SceneParts, Surfaces, Volume, bake, bake_lamp,
};
use sh::{Degree, Expansion, Stop};

/// The six sides of a box, with their fronts outside, or inside of a room.
fn sides(least: [f32; 3], most: [f32; 3], is_room: bool) -> Vec<[[f32; 3]; 3]> {
    let corner = |k: usize| [0, 1, 2].map(|axis| if k >> axis & 1 == 0 { least[axis] } else { most[axis] });
    let faces = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let triangles = faces.iter().flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]]);
    let turned = |[a, b, c]: [usize; 3]| if is_room { [a, c, b] } else { [a, b, c] };
    triangles.map(|corners| turned(corners).map(corner)).collect()
}

/// A floor or a sheet at a height, 400 m wide, that faces up.
fn sheet(height: f32) -> Vec<[[f32; 3]; 3]> {
    let at = |x: f32, y: f32| [200.0 * x, 200.0 * y, height];
    vec![[at(-1.0, -1.0), at(1.0, -1.0), at(1.0, 1.0)], [at(-1.0, -1.0), at(1.0, 1.0), at(-1.0, 1.0)]]
}

fn scene(pieces: &[(Vec<[[f32; 3]; 3]>, Material)]) -> Scene {
    let mut parts = SceneParts::default();
    for (k, (triangles, material)) in pieces.iter().enumerate() {
        parts.material_of.extend(vec![k as u32; triangles.len()]);
        parts.attributes_of.extend(vec![SceneParts::NONE; triangles.len()]);
        parts.parts.push(Part { name: format!("part {k}"), triangles: triangles.len() });
        parts.triangles.extend(triangles);
        parts.materials.push(material.clone());
    }
    Scene::new(parts).unwrap()
}

fn matte(albedo: f32) -> Material {
    Material { base: [albedo, albedo, albedo, 1.0], ..Material::default() }
}

fn lamp(kind: LampKind) -> Lamp {
    let (position, direction) = ([0.0, 0.0, 5.0], [0.0, 0.0, -1.0]);
    Lamp { name: "lamp".into(), kind, position, direction, color: [1.0; 3], intensity: 1.0, range: None }
}

/// An endless floor of the albedo a under a white sky sends a up to a probe above it. The floor here ends
/// half a percent of the sphere below the horizon, and 4096 paths leave some noise.
#[test]
fn a_floor_reflects_its_albedo_of_a_white_sky() {
    let scene = scene(&[(sheet(0.0), matte(0.6))]);
    let baked =
        bake(&Surfaces::new(&scene), &[[0.0, 0.0, 1.0]], &BakeOptions::default(), Stop::NEVER).unwrap();
    let white = Expansion::from_coefficients(Degree::ZERO, vec![[2.0 * PI.sqrt(); 3]]).unwrap();
    let mut rows = vec![[0.0; 3]; 9];
    baked.add_sky(0, &white, &mut rows);
    // Half of the sphere is 1, half is 0.6.
    let mean = rows[0][0] / (2.0 * PI.sqrt());
    assert!((mean - 0.8).abs() < 0.01, "{mean}");
    let up = rows[2][0] / (0.5 * (3.0 / PI).sqrt() * PI);
    assert!((up - 0.4).abs() < 0.03, "{up}");
    assert!(rows[1][0].abs() < 0.05 && baked.errors()[0] < 0.02, "{rows:?} {:?}", baked.errors());
}

/// Light of a lamp through a sheet: 1 - alpha of it, or what of it is transmitted, in its colour.
#[test]
fn light_passes_what_it_may() {
    let base = [1.0, 0.5, 0.25, 0.25];
    let blend = Material { base, alpha: Alpha::Blend, ..Material::default() };
    let clear = Material { base, transmission: 0.5, ..Material::default() };
    let cut = Material { base, alpha: Alpha::Mask(0.5), ..Material::default() };
    let kept = Material { base, alpha: Alpha::Mask(0.2), ..Material::default() };
    let unobstructed = [1.0; 3];
    for (material, expected) in [
        (blend, [0.75; 3]),
        (clear, [0.5, 0.25, 0.125]),
        (cut, unobstructed),
        (kept, [0.0; 3]),
        (matte(0.5), [0.0; 3]),
    ] {
        let scene = scene(&[(sheet(2.0), material.clone())]);
        let surfaces = Surfaces::new(&scene);
        for kind in [LampKind::Point, LampKind::Directional, LampKind::Spot { inner: 0.1, outer: 0.2 }] {
            let at = [[0.1, 0.0, 0.0]];
            let columns =
                bake_lamp(&surfaces, &lamp(kind), &at, &BakeOptions::default(), Stop::NEVER).unwrap();
            let full = if kind == LampKind::Directional { 1.0 } else { 1.0 / 25.01 };
            for channel in 0..3 {
                let found = columns.direct[channel] / (0.5 / PI.sqrt()) as f32;
                assert!((found - full * expected[channel]).abs() < 1e-6, "{material:?} {kind:?}: {found}");
            }
        }
        // Rays pass at random, in the mean by as much.
        let baked = bake(
            &surfaces,
            &[[0.1, 0.0, 1.9]],
            &BakeOptions { bounces: Some(0), ..BakeOptions::default() },
            Stop::NEVER,
        )
        .unwrap();
        for channel in 0..baked.channels() {
            // Half of the rays go down, where nothing is.
            let found = f64::from(baked.sky()[channel]);
            assert!((found - 0.5 - 0.5 * f64::from(expected[channel])).abs() < 0.03, "{material:?}: {found}");
        }
    }
}

/// A room whose walls are unlit and half grey: it is what it emits, and nothing is reflected.
#[test]
fn unlit_surfaces_emit_their_colour() {
    let emission = Some(Emission { radiance: [0.5; 3], texture: None });
    let unlit = Material { is_unlit: true, emission, ..Material::default() };
    let scene = scene(&[(sides([-1.0; 3], [2.0, 1.0, 1.0], true), unlit)]);
    let baked =
        bake(&Surfaces::new(&scene), &[[0.5, 0.3, 0.0]], &BakeOptions::default(), Stop::NEVER).unwrap();
    assert!((f64::from(baked.direct()[0]) / (2.0 * PI.sqrt()) - 1.0).abs() < 1e-5, "{:?}", baked.direct());
    assert!(baked.indirect().iter().chain(baked.sky()).all(|value| *value == 0.0));
}

#[test]
fn results_do_not_depend_on_threads_nor_on_other_probes() {
    let scene =
        scene(&[(sheet(0.0), matte(0.5)), (sides([0.0, 0.0, 0.0], [1.0, 1.0, 2.0], false), matte(0.9))]);
    let surfaces = Surfaces::new(&scene);
    let at: Vec<[f32; 3]> = (0..6).map(|k| [k as f32 * 0.7 - 2.0, 1.3, 0.5]).collect();
    let options = BakeOptions { paths: 512, ..BakeOptions::default() };
    let run = |threads: usize, at: &[[f32; 3]]| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let lamp = bake_lamp(&surfaces, &lamp(LampKind::Point), at, &options, Stop::NEVER).unwrap();
            (bake(&surfaces, at, &options, Stop::NEVER).unwrap(), lamp)
        })
    };
    let one = run(1, &at);
    assert_eq!(one, run(3, &at));
    let (alone, of_lamp) = run(2, &at[4..5]);
    let length = 9 * 25;
    assert_eq!(alone.sky(), &one.0.sky()[4 * length..5 * length]);
    assert_eq!(of_lamp.indirect, one.1.indirect[4 * 27..5 * 27]);
    // Paths are doubled until the error is small enough, or there are too many.
    let exact = BakeOptions { error: Some(0.002), most_paths: 4096, ..options };
    let exact = bake(&surfaces, &at, &exact, Stop::NEVER).unwrap();
    for (paths, error) in exact.paths().iter().zip(exact.errors()) {
        assert!(*paths == 4096 || *error <= 0.002 && *paths >= 512, "{paths} {error}");
    }
    assert!(exact.paths().iter().any(|paths| *paths > 512));
}

/// A crate on a floor: probes in it are moved out or filled, and none of them is black.
#[test]
fn probes_in_solids_are_repaired() {
    let scene =
        scene(&[(sheet(0.0), matte(0.5)), (sides([0.0, 0.0, 0.0], [1.2, 1.2, 1.2], false), matte(0.5))]);
    let surfaces = Surfaces::new(&scene);
    let bounds = [[-0.95, -0.95, 0.1], [2.05, 2.05, 2.1]];
    let volume = Volume::with_spacing("yard".into(), bounds, 0.5, Lattice::Corners).unwrap();
    let places = ProbePlaces::new(&surfaces, vec![volume], &[[0.6, 0.6, 0.6]], Stop::NEVER).unwrap();
    let inside = |at: &[f32; 3]| at.iter().all(|x| *x > 0.0 && *x < 1.2);
    let mut counts = [0; 3];
    for (probe, at) in places.grid().iter().enumerate() {
        assert_eq!(inside(at), places.inside_of(probe).is_some(), "{at:?}");
        match &places.repairs()[probe] {
            Repair::None => assert!(!inside(at)),
            Repair::Moved => {
                counts[0] += 1;
                assert!(!inside(&places.positions()[probe]), "{at:?}");
            }
            Repair::Filled(sources) => {
                counts[1] += 1;
                let sum: f32 = sources.iter().map(|(_, weight)| weight).sum();
                assert!(
                    (sum - 1.0).abs() < 1e-5 && sources.iter().all(|(k, _)| places.is_valid(*k as usize))
                );
            }
            Repair::Lost(source) => {
                counts[2] += 1;
                assert!(places.is_valid(*source as usize));
            }
        }
    }
    assert!(counts[0] > 0 && counts[2] == 1, "{counts:?}");
    // Both of two neighbours see each other.
    let volume = &places.volumes()[0];
    for probe in 0..volume.len() {
        for (bit, step) in probes::neighbours().enumerate() {
            if places.visible()[probe] >> bit & 1 == 1 {
                let other = volume.neighbour(volume.cell(probe), step).unwrap();
                assert!(places.visible()[other] >> (25 - bit) & 1 == 1);
            }
        }
    }
    let options = BakeOptions { paths: 256, ..BakeOptions::default() };
    let transport = bake(&surfaces, places.positions(), &options, Stop::NEVER).unwrap();
    let white = Expansion::from_coefficients(Degree::ZERO, vec![[2.0 * PI.sqrt(); 3]]).unwrap();
    let lighting = SceneLighting { sky: Some(&white), ..SceneLighting::default() };
    let lit = LitProbes::new(&places, &transport, &lighting).unwrap();
    assert!(lit.rows().iter().all(|rows| rows[0][0] > 0.3), "no probe is black");
    // The floor beside the crate, and its top, which sees the whole sky.
    let top = lit.irradiance(&places, [0.6, 0.6, 1.2], [0.0, 0.0, 1.0]).unwrap();
    assert!((top[1] / PI - 1.0).abs() < 0.08, "{top:?}");
}

#[test]
fn a_room_that_is_turned_inside_out_says_so() {
    let scene = scene(&[(sides([0.0; 3], [4.0, 3.0, 2.0], false), matte(0.5))]);
    let volume =
        Volume::with_spacing("room".into(), [[0.5; 3], [3.5, 2.5, 1.5]], 0.5, Lattice::Corners).unwrap();
    let error = ProbePlaces::new(&Surfaces::new(&scene), vec![volume], &[], Stop::NEVER).unwrap_err();
    let expected = PlacesError::AllInside { volume: "room".into(), part: "part 0".into(), share: 100 };
    assert_eq!(error, expected);
    assert!(error.to_string().contains("winding"), "{error}");
}

#[test]
fn what_cannot_be_baked_says_why() {
    let scene_of = scene(&[(sheet(0.0), matte(0.5))]);
    let surfaces = Surfaces::new(&scene_of);
    let error =
        |at: &[[f32; 3]], options: BakeOptions| bake(&surfaces, at, &options, Stop::NEVER).unwrap_err();
    let sky = Degree::new(9).unwrap();
    assert_eq!(
        error(&[[0.0; 3]], BakeOptions { sky, ..Default::default() }),
        BakeError::Degrees { arriving: 2, sky: 9 }
    );
    assert_eq!(error(&[], BakeOptions::default()), BakeError::NoProbes);
    assert_eq!(error(&[[0.0; 3], [f32::NAN; 3]], BakeOptions::default()), BakeError::NotFinite(1));
    let stopped = bake(&surfaces, &[[0.0; 3]], &BakeOptions::default(), Stop::when(&|| true));
    assert!(matches!(stopped, Err(BakeError::Stopped(_))));
    assert_eq!(Scene::new(SceneParts::default()).unwrap_err(), SceneError::NoTriangles);
    let nothing = ProbePlaces::new(&surfaces, vec![], &[], Stop::NEVER).unwrap_err();
    assert_eq!(nothing, PlacesError::Nothing);
}

/// A level has ground far outside of the room with its probes, which see no farther than the walls.
#[test]
fn a_point_far_from_all_probes_has_finite_light() {
    let lit = Material { emission: Some(Emission { radiance: [1.0; 3], texture: None }), ..matte(0.0) };
    let scene = scene(&[(sides([0.0; 3], [3.0, 3.0, 2.5], true), lit)]);
    let surfaces = Surfaces::new(&scene);
    let volume =
        Volume::with_spacing("room".into(), [[0.2; 3], [2.8, 2.8, 2.3]], 0.5, Lattice::Centres).unwrap();
    let places = ProbePlaces::new(&surfaces, vec![volume], &[], Stop::NEVER).unwrap();
    let options = BakeOptions { paths: 64, ..BakeOptions::default() };
    let transport = bake(&surfaces, places.positions(), &options, Stop::NEVER).unwrap();
    let lighting = SceneLighting { emission: &[[1.0; 3]], ..SceneLighting::default() };
    let lit = LitProbes::new(&places, &transport, &lighting).unwrap();
    for away in [10.0, 1e3, 1e5, 1e7] {
        for at in [[-away, 1.0, 0.0], [away, 1.0, 0.0], [1.0, -away, 0.0]] {
            let found = lit.irradiance(&places, at, [0.0, 0.0, 1.0]).unwrap();
            assert!(found.iter().all(|light| (light - PI).abs() < 0.3), "{at:?}: {found:?}");
        }
    }
}
