//! The graphics device draws the same pictures as the CPU: in every mode, and with every setting of a shot.

#![allow(clippy::unwrap_used, clippy::disallowed_methods, reason = "a test may panic")]

mod compared;
mod corpus;
mod scenes;

use std::f64::consts::PI;
use std::sync::Arc;

use envmap::ToneMap;
use glam::{DAffine3, DQuat};
use mesh::{MaterialRange, Mesh};
use preview::{Background, Camera, Look, Mode, Object, PointSet, RenderError, Scene, ScenePart, Shot, Show};
use sphere::Rotation;

use compared::Compared;

/// A shot of a scene that lavapipe draws in some hundredths of a second.
fn shot(scene: &Scene, show: Show) -> Shot {
    Shot {
        size: [96, 96],
        samples: 1,
        camera: Camera { yaw: 0.4, pitch: 0.3, ..Camera::new(scene.framing()) },
        turn: Rotation::IDENTITY,
        show,
        background: Background::Environment,
        exposure: 0.0,
        tone: ToneMap::Filmic,
        light_samples: 40,
        points: PointSet::Even,
    }
}

#[test]
fn every_mode_under_every_environment_with_every_material() {
    let Some(mut compared) = Compared::new("every_mode_under_every_environment_with_every_material") else {
        return;
    };
    let meshes = ["sphere", "torus-knot"].map(|name| (name, Arc::new(mesh::shape(name).unwrap())));
    for (names, look) in scenes::looks() {
        for (shape, mesh) in &meshes {
            let scene = Scene::of(Arc::clone(mesh), Arc::clone(look));
            for mode in Mode::ALL.into_iter().filter(|mode| scene.offers(*mode)) {
                if mode == Mode::ShadowedBruteForce && names.ends_with("gold") {
                    continue;
                }
                compared.add(
                    mode.name(),
                    &format!("{shape} {names}"),
                    &scene,
                    &shot(&scene, Show::One(mode)),
                );
            }
        }
    }
    compared.finish();
}

#[test]
fn tables_transfer_and_traced_shadows() {
    let Some(mut compared) = Compared::new("tables_transfer_and_traced_shadows") else { return };
    let modes = [Mode::Table, Mode::Transfer, Mode::BruteForce, Mode::ShadowedBruteForce];
    for shape in ["sphere", "torus-knot", "plane"] {
        let mesh = Arc::new(mesh::shape(shape).unwrap());
        let transfer = scenes::transfer(&mesh);
        for (names, look) in scenes::tabulated() {
            let scene = Scene::of(Arc::clone(&mesh), Arc::clone(look));
            let scene = scene.with_transfer(Some(Arc::clone(&transfer)));
            for mode in modes {
                assert!(scene.offers(mode));
                let shot = shot(&scene, Show::One(mode));
                compared.add(mode.name(), &format!("{shape} {names}"), &scene, &shot);
            }
        }
    }
    compared.finish();
}

/// Under every environment, turned; side by side, as a difference, and two objects that share a scale space.
#[test]
fn compact_maps() {
    let Some(mut compared) = Compared::new("compact_maps") else { return };
    let knot = Arc::new(mesh::shape("torus-knot").unwrap());
    let looks = scenes::compact();
    let turn = Rotation::from_yaw_pitch_roll(0.7, -0.4, 0.2);
    for (names, look) in looks {
        let scene = Scene::of(Arc::clone(&knot), Arc::clone(look));
        assert!(scene.offers(Mode::Taps));
        let shot = Shot { turn, ..shot(&scene, Show::One(Mode::Taps)) };
        compared.add("taps", names, &scene, &shot);
    }
    let object = |y: f64, look: usize| Object {
        mesh: Arc::clone(&knot),
        whole: None,
        place: DAffine3::from_translation([0.0, y, 0.0].into()),
        look: Arc::clone(&looks[look].1),
        transfer: None,
        blend: None,
    };
    let scene =
        Scene { light: Arc::clone(looks[3].1.light()), objects: vec![object(-0.8, 3), object(0.8, 4)] };
    let split = Show::Split { left: Mode::Taps, right: Mode::BruteForce, at: 0.5 };
    let difference = Show::Difference { of: Mode::Taps, from: Mode::BruteForce, amplify: 1.0 };
    for (name, show) in
        [("two objects", Show::One(Mode::Taps)), ("a split", split), ("a difference", difference)]
    {
        compared.add(name, "", &scene, &Shot { size: [128, 80], samples: 2, ..shot(&scene, show) });
    }
    compared.finish();
}

/// White metal under a light alone: by the levels of an engine's cube, whole ones and between two, under each
/// environment, turned; side by side with brute force, and as a difference from it.
#[test]
fn a_light_alone() {
    let Some(mut compared) = Compared::new("a_light_alone") else { return };
    let ball = Arc::new(mesh::shape("sphere").unwrap());
    let turn = Rotation::from_yaw_pitch_roll(0.7, -0.4, 0.2);
    for (name, looks) in scenes::white_metals() {
        let scene = Scene::row(Arc::clone(looks[0].light()), &ball, looks);
        assert!(scene.shows_light() && scene.first_mode() == Mode::Prefiltered);
        let one = shot(&scene, Show::One(Mode::Prefiltered));
        compared.add("one", name, &scene, &Shot { size: [320, 160], turn, ..one.clone() });
        let split = Show::Split { left: Mode::Prefiltered, right: Mode::BruteForce, at: 0.5 };
        let difference = Show::Difference { of: Mode::Prefiltered, from: Mode::BruteForce, amplify: 1.0 };
        for (kind, show) in [("a split", split), ("a difference", difference)] {
            compared.add(kind, name, &scene, &Shot { size: [240, 96], show, ..one.clone() });
        }
    }
    compared.finish();
}

/// Two brushed knots, one of which is a mirror image, under a turned light, from outside and inside.
#[test]
fn every_setting_of_a_shot_by_tables() {
    let Some(mut compared) = Compared::new("every_setting_of_a_shot_by_tables") else { return };
    let knot = Arc::new(mesh::shape("torus-knot").unwrap());
    let transfer = scenes::transfer(&knot);
    let looks = scenes::tabulated();
    let several = looks.len() - 1;
    let place = |vertex: usize| [(vertex % 128) as f32 / 127.0, (vertex % 96) as f32 / 95.0];
    let blend = Arc::new((0..knot.positions().len()).map(place).collect::<Vec<_>>());
    let object = |scale: [f64; 3], at: [f64; 3], look: usize| Object {
        transfer: Some(Arc::clone(&transfer)),
        blend: Some(Arc::clone(&blend)),
        ..placed(&knot, &looks[look].1, (scale, 0.4, at))
    };
    let objects =
        vec![object([0.8; 3], [0.0, -0.8, 0.0], 0), object([-0.6, 0.6, 0.6], [0.5, 0.6, 0.3], several)];
    let scene = Scene { light: Arc::clone(looks[0].1.light()), objects };
    let turn = Rotation::from_yaw_pitch_roll(0.7, -0.4, 0.2);
    let plain = Shot { size: [128, 80], turn, ..shot(&scene, Show::One(Mode::Table)) };
    let split = Show::Split { left: Mode::Table, right: Mode::Transfer, at: 0.5 };
    let difference = Show::Difference { of: Mode::Transfer, from: Mode::Table, amplify: 4.0 };
    let shadows = Show::Difference { of: Mode::Transfer, from: Mode::ShadowedBruteForce, amplify: 1.0 };
    let inside = Camera { framing: preview::Framing { radius: 0.12, ..scene.framing() }, ..plain.camera };
    let near = Camera { zoom: 4.0, ..plain.camera };
    let cases = [
        ("a table", plain.clone()),
        ("transfer", Shot { show: Show::One(Mode::Transfer), ..plain.clone() }),
        ("a split", Shot { show: split, ..plain.clone() }),
        ("a difference in 2 x 2 samples", Shot { show: difference, samples: 2, ..plain.clone() }),
        ("a difference from shadowed brute force", Shot { show: shadows, ..plain.clone() }),
        ("near", Shot { camera: near, ..plain.clone() }),
        ("from inside", Shot { camera: inside, ..plain.clone() }),
    ];
    for (name, shot) in cases {
        compared.add(name, "", &scene, &shot);
    }
    compared.finish();
}

/// An object of a scale, turned about y, at a place.
fn placed(mesh: &Arc<Mesh>, look: &Arc<Look>, (scale, turn, at): ([f64; 3], f64, [f64; 3])) -> Object {
    let turn = DQuat::from_rotation_y(turn);
    Object {
        mesh: Arc::clone(mesh),
        whole: None,
        place: DAffine3::from_scale_rotation_translation(scale.into(), turn, at.into()),
        look: Arc::clone(look),
        transfer: None,
        blend: None,
    }
}

/// Four objects with all materials: one is mirrored, one is occluded, one is cut by the picture's edge.
fn group() -> Scene {
    let looks = scenes::looks();
    let knot = Arc::new(mesh::shape("torus-knot").unwrap());
    let plane = Arc::new(mesh::shape("plane").unwrap());
    let object = |mesh, place, look: usize| placed(mesh, &looks[look].1, place);
    let objects = vec![
        object(&knot, ([0.8; 3], 0.3, [0.0, -0.8, 0.0]), 1),
        object(&knot, ([-0.6, 0.6, 0.6], -0.4, [0.5, 0.6, 0.3]), 6),
        object(&plane, ([1.4; 3], 0.1, [0.0, 0.0, -0.7]), 3),
        object(&knot, ([0.5; 3], 1.0, [-0.8, 2.2, 0.0]), 11),
    ];
    Scene { light: Arc::clone(looks[0].1.light()), objects }
}

#[test]
fn every_setting_of_a_shot() {
    let Some(mut compared) = Compared::new("every_setting_of_a_shot") else { return };
    let scene = group();
    let mut plain = Shot { size: [128, 80], ..shot(&scene, Show::One(Mode::LocalShrm)) };
    plain.camera.zoom = 2.0;
    let turn = Rotation::from_yaw_pitch_roll(0.7, -0.4, 0.2);
    let split = |at| Show::Split { left: Mode::LocalShrm, right: Mode::KautzMcCool, at };
    let brute = Show::Split { left: Mode::BruteForce, right: Mode::Irradiance, at: 0.6 };
    let difference = Show::Difference { of: Mode::Cabral, from: Mode::LocalShrm, amplify: 8.0 };
    let from_brute = Show::Difference { of: Mode::GlobalShrm, from: Mode::BruteForce, amplify: 1.0 };
    let samples = Show::Split { left: Mode::Samples, right: Mode::LocalShrm, at: 0.6 };
    let none = Show::Difference { of: Mode::Mirror, from: Mode::Mirror, amplify: 2.0 };
    let wide = Camera { field: 1.9, zoom: 1.5, yaw: 2.0, pitch: -0.8, ..plain.camera };
    let inside = Camera { framing: preview::Framing { radius: 0.12, ..scene.framing() }, ..plain.camera };
    let cases = [
        ("one", plain.clone()),
        ("a split", Shot { show: split(0.37), ..plain.clone() }),
        ("a split at the left edge", Shot { show: split(0.0), ..plain.clone() }),
        ("a split at the right edge", Shot { show: split(1.0), ..plain.clone() }),
        ("a split of brute force", Shot { show: brute, samples: 2, ..plain.clone() }),
        ("samples", Shot { show: Show::One(Mode::Samples), turn, ..plain.clone() }),
        ("samples beside a map", Shot { show: samples, samples: 2, ..plain.clone() }),
        ("a difference", Shot { show: difference, ..plain.clone() }),
        ("a difference in 2 x 2 samples", Shot { show: difference, samples: 2, ..plain.clone() }),
        ("a difference from brute force", Shot { show: from_brute, ..plain.clone() }),
        ("a difference from itself", Shot { show: none, ..plain.clone() }),
        ("a background of harmonics", Shot { background: Background::Harmonics, ..plain.clone() }),
        ("a flat background", Shot { background: Background::Flat([0.1, 0.4, 0.9]), ..plain.clone() }),
        ("a turned light", Shot { turn, ..plain.clone() }),
        ("a turned light, global", Shot { turn, show: Show::One(Mode::GlobalShrm), ..plain.clone() }),
        ("a turned light, brute", Shot { turn, show: Show::One(Mode::BruteForce), ..plain.clone() }),
        ("a turned light, harmonics", Shot { turn, background: Background::Harmonics, ..plain.clone() }),
        ("2 x 2 samples", Shot { samples: 2, ..plain.clone() }),
        ("3 x 3 samples", Shot { samples: 3, show: Show::One(Mode::Mirror), ..plain.clone() }),
        ("4 x 4 samples", Shot { samples: 4, size: [101, 77], ..plain.clone() }),
        ("a plain tone, brighter", Shot { tone: ToneMap::Plain, exposure: 1.3, ..plain.clone() }),
        ("darker", Shot { exposure: -4.0, ..plain.clone() }),
        ("a wide view from below", Shot { camera: wide, show: Show::One(Mode::Cabral), ..plain.clone() }),
        ("from inside", Shot { camera: inside, show: Show::One(Mode::Prefiltered), ..plain.clone() }),
        ("one pixel", Shot { size: [1, 1], ..plain.clone() }),
        ("one row", Shot { size: [130, 1], ..plain }),
    ];
    for (name, shot) in cases {
        compared.add(name, "", &scene, &shot);
    }
    compared.finish();
}

/// A knot in three looks, each on triangles all along it.
#[test]
fn a_mesh_of_several_materials() {
    let Some(mut compared) = Compared::new("a_mesh_of_several_materials") else { return };
    let knot = mesh::shape("torus-knot").unwrap();
    let range = |triangle: usize| MaterialRange { material: Some((triangle / 64 % 3) as u32), triangles: 1 };
    let ranges: Vec<MaterialRange> = (0..knot.triangles().len()).map(range).collect();
    let names = ["one", "two", "three"].map(str::to_owned).to_vec();
    let whole = Arc::new(knot.with_materials(names, &ranges).unwrap());
    let looks = scenes::looks();
    let part = |(material, look): (u32, usize)| ScenePart {
        mesh: Arc::new(whole.of_materials(|of| of == Some(material)).0),
        look: Arc::clone(&looks[look].1),
        transfer: None,
        blend: None,
    };
    let parts = (0..).zip([1, 3, 2]).map(part).collect();
    let scene = Scene::of_parts(&whole, Arc::clone(looks[1].1.light()), parts);
    let modes = [Mode::LocalShrm, Mode::Prefiltered, Mode::BruteForce, Mode::ShadowedBruteForce];
    for mode in modes.into_iter().filter(|mode| scene.offers(*mode)) {
        compared.add(mode.name(), "", &scene, &shot(&scene, Show::One(mode)));
    }
    compared.finish();
}

#[test]
fn a_map_of_each_part() {
    let Some(mut compared) = Compared::new("a_map_of_each_part") else { return };
    let modes = [Mode::LocalShrm, Mode::GlobalShrm, Mode::Cabral, Mode::KautzMcCool, Mode::Prefiltered];
    for (name, look) in scenes::of_two_parts() {
        let scene = Scene::of(Arc::new(mesh::shape("torus-knot").unwrap()), look);
        for mode in modes {
            compared.add(mode.name(), name, &scene, &shot(&scene, Show::One(mode)));
        }
    }
    compared.finish();
}

/// Textures near and far, from outside and inside, in every mode that shows them and beside those that do
/// not; and three objects, of which one has no texture.
#[test]
fn textures_of_base_colours() {
    let Some(mut compared) = Compared::new("textures_of_base_colours") else { return };
    let looks = scenes::textured();
    let modes = [Mode::LocalShrm, Mode::Prefiltered, Mode::BruteForce, Mode::ShadowedBruteForce];
    for shape in ["sphere", "torus-knot", "plane"] {
        let mesh = Arc::new(mesh::shape(shape).unwrap());
        for (names, look) in &looks[..looks.len() - 1] {
            let scene = Scene::of(Arc::clone(&mesh), Arc::clone(look));
            // Under noise, some light samples fall on other texels of the light: a knot of metal has 0.018 of
            // outliers by brute force without any texture.
            let is_noisy = |mode: Mode| mode.is_brute_force() && names.starts_with("noise");
            for mode in modes.into_iter().filter(|mode| !is_noisy(*mode)) {
                compared.add(
                    mode.name(),
                    &format!("{shape} {names}"),
                    &scene,
                    &shot(&scene, Show::One(mode)),
                );
            }
        }
    }
    let knot = Arc::new(mesh::shape("torus-knot").unwrap());
    let object = |scale: [f64; 3], at: [f64; 3], look: usize| placed(&knot, &looks[look].1, (scale, 0.4, at));
    let objects = vec![
        object([0.8; 3], [0.0, -0.8, 0.0], 0),
        object([-0.6, 0.6, 0.6], [0.5, 0.6, 0.3], 1),
        object([0.5; 3], [0.3, 0.1, 0.9], looks.len() - 1),
    ];
    let scene = Scene { light: Arc::clone(looks[0].1.light()), objects };
    let turn = Rotation::from_yaw_pitch_roll(0.7, -0.4, 0.2);
    let plain = Shot { size: [128, 80], turn, ..shot(&scene, Show::One(Mode::LocalShrm)) };
    let split = Show::Split { left: Mode::LocalShrm, right: Mode::Irradiance, at: 0.5 };
    let mirror = Show::Split { left: Mode::Mirror, right: Mode::GlobalShrm, at: 0.5 };
    let difference = Show::Difference { of: Mode::LocalShrm, from: Mode::Irradiance, amplify: 1.0 };
    let inside = Camera { framing: preview::Framing { radius: 0.12, ..scene.framing() }, ..plain.camera };
    let near = Camera { zoom: 4.0, ..plain.camera };
    let far = Camera { zoom: 0.15, ..plain.camera };
    let cases = [
        ("three objects", plain.clone()),
        ("a split", Shot { show: split, ..plain.clone() }),
        ("a split beside a mirror", Shot { show: mirror, ..plain.clone() }),
        ("a difference in 2 x 2 samples", Shot { show: difference, samples: 2, ..plain.clone() }),
        ("4 x 4 samples", Shot { samples: 4, ..plain.clone() }),
        ("near", Shot { camera: near, ..plain.clone() }),
        ("far", Shot { camera: far, ..plain.clone() }),
        ("from inside", Shot { camera: inside, ..plain.clone() }),
    ];
    for (name, shot) in cases {
        compared.add(name, "", &scene, &shot);
    }
    compared.finish();
}

/// The seam and poles of a lat-long image and the corners of a cube are difficult places of a background.
#[test]
fn the_background_in_all_directions() {
    let Some(mut compared) = Compared::new("the_background_in_all_directions") else { return };
    for (names, look) in scenes::looks().iter().step_by(4) {
        let scene = Scene { light: Arc::clone(look.light()), objects: vec![] };
        for background in [Background::Environment, Background::Harmonics] {
            for (yaw, pitch) in [(0.0, 0.0), (PI, 0.1), (PI / 2.0, 0.6), (0.3, 1.57), (0.3, -1.57)] {
                let mut shot = Shot { background, ..shot(&scene, Show::One(Mode::Mirror)) };
                shot.camera = Camera { yaw, pitch, field: 1.6, ..shot.camera };
                compared.add("background", &format!("{names} {yaw} {pitch}"), &scene, &shot);
            }
        }
    }
    compared.finish();
}

#[test]
fn a_scene_without_maps() {
    let Some(mut compared) = Compared::new("a_scene_without_maps") else { return };
    let mesh = Arc::new(mesh::shape("torus-knot").unwrap());
    for (names, look) in scenes::looks().iter().step_by(3) {
        let material = look.material().unwrap().clone();
        let bare = Look::without_maps(Arc::clone(look.light()), material, look.sizes());
        let scene = Scene::of(Arc::clone(&mesh), Arc::new(bare));
        for mode in [Mode::LocalShrm, Mode::GlobalShrm, Mode::Prefiltered, Mode::Irradiance, Mode::Mirror] {
            let shot = shot(&scene, scene.available(Show::One(mode)));
            compared.add(mode.name(), names, &scene, &shot);
        }
        let split = Show::Split { left: Mode::Irradiance, right: Mode::Cabral, at: 0.4 };
        compared.add("a split", names, &scene, &shot(&scene, scene.available(split)));
    }
    // Both renderers replace the mode themselves.
    let (_, look) = &scenes::looks()[0];
    let bare = Look::without_maps(Arc::clone(look.light()), look.material().unwrap().clone(), look.sizes());
    let scene = Scene::of(mesh, Arc::new(bare));
    let [brute, replaced] = [Mode::BruteForce, Mode::KautzMcCool]
        .map(|mode| compared.both(&scene, &shot(&scene, Show::One(mode))).map(Result::unwrap));
    assert!(brute.iter().zip(&replaced).all(|(brute, replaced)| brute.codes == replaced.codes));
    compared.finish();
}

#[test]
fn a_missing_material_is_the_same_error() {
    let Some(mut compared) = Compared::new("a_missing_material_is_the_same_error") else { return };
    let look = scenes::without_material();
    let scene = Scene::of(Arc::new(mesh::shape("plane").unwrap()), look);
    let shot = shot(&scene, Show::One(Mode::BruteForce));
    let [cpu, gpu] = compared.both(&scene, &shot).map(Result::unwrap_err);
    assert!(matches!(cpu, RenderError::Missing { .. }), "{cpu}");
    assert_eq!(cpu, gpu);
}
