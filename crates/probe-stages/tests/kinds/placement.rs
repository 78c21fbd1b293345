//! Rooms and scattered points: what engines show of probes that were placed so.

use std::sync::Arc;

use serde_json::Value;
use sh::{Degree, Expansion};
use stages::artifacts::{Lighting, ProbeLamps, ProbePlaces, ProbeTransport, Probes, Scene};

use crate::fixture::{Ran, case, part};
use crate::reference::{numbers, scene};
use crate::room::Room;
use crate::shaders::{Bevy, Three};

/// A place on a surface of a reference scene, and what arrives there.
struct Receiver {
    at: [f64; 3],
    normal: [f64; 3],
    sky: [f64; 3],
    all: [f64; 3],
}

fn receivers(json: &Value) -> Vec<Receiver> {
    let three = |value: &Value| <[f64; 3]>::try_from(numbers(value)).unwrap();
    let receiver = |value: &Value| Receiver {
        at: three(&value["position"]),
        normal: three(&value["normal"]),
        sky: three(&value["irradiance"]["all_of_the_sky"]),
        all: three(&value["irradiance"]["all"]),
    };
    json["receivers"].as_array().unwrap().iter().map(receiver).collect()
}

fn place(scene: &Scene, parameters: &str) -> Ran<ProbePlaces> {
    case("place-probes", parameters).input("scene", &*part(scene, "shape")).run().unwrap()
}

/// Probes under the sky of a reference scene alone, and under its lamps alone.
fn lit(json: &Value, scene: &Scene, places: &ProbePlaces) -> [Arc<Probes>; 2] {
    let bake =
        |kind, of: &str| case(kind, "paths = 1024").input("scene", &*part(scene, of)).input("places", places);
    let transport: Arc<ProbeTransport> = bake("bake-probes", "surfaces").artifact();
    let lamps: Arc<ProbeLamps> = bake("bake-lamps", "lamps").artifact();
    let light = |parameters: &str| {
        case("light-probes", parameters)
            .input("transport", &*transport)
            .input("lamps", &*lamps)
            .input("scene", scene)
    };
    let sky = numbers(&json["lighting"]["sky"]).as_chunks::<3>().0.to_vec();
    let sky = Expansion::from_coefficients(Degree::new(2).unwrap(), sky).unwrap();
    [
        light("lamps-scale = 0.0\nemission-scale = 0.0").input("lighting", &Lighting(sky.into())).artifact(),
        light("lamps = \"all\"\nemission-scale = 0.0").artifact(),
    ]
}

fn three(probes: &Probes) -> Three {
    Three::new(
        &case("export-probes", "preset = \"three\"\nformat = \"float\"")
            .input("probes", probes)
            .files_of()
            .unwrap()
            .0,
    )
}

fn bevy(probes: &Probes) -> Bevy {
    let exported = case("export-probes", "preset = \"bevy\"").input("probes", probes).files_of().unwrap();
    Bevy::new(&exported.0, &probes.0.places)
}

/// The RMS error of the sky's light on surfaces, relative to its RMS.
fn error(receivers: &[Receiver], light: impl Fn(&Receiver) -> Option<[f64; 3]>) -> f64 {
    let (mut difference, mut size) = (0.0, 0.0);
    for receiver in receivers {
        let found = light(receiver).unwrap_or_else(|| panic!("{:?} is in no volume", receiver.at));
        for (found, expected) in found.iter().zip(receiver.sky) {
            difference += (found - expected).powi(2);
            size += expected * expected;
        }
    }
    (difference / size).sqrt()
}

/// Steps are a tenth of a metre up to two million places, and a note says if they are longer.
#[test]
fn long_steps_between_rooms_are_noted() {
    let scene = Room::new().scene();
    let noted = |to: f64| {
        let boxes = format!("boxes = [{{ name = \"site\", from = [-2, -2, 0], to = [{to}, {to}, 4] }}]");
        let notes = place(&scene, &format!("{boxes}\nspacing = 2.0\nsplit = \"rooms\"")).notes;
        notes.into_iter().filter(|note| note.contains("steps")).collect::<Vec<_>>()
    };
    assert_eq!(noted(2.0), [""; 0]);
    let expected = "site is large: its rooms are found in steps of 0.12 m, where 0.1 is usual, and spaces less wide \
                    than a few of them may be missed; smaller `boxes` have shorter steps";
    assert_eq!(noted(21.0), [expected]);
}

/// Between the rooms is a wall of 2 cm. With a volume for each, the dark room has nothing of the sky, and the
/// other nothing of the lamp, in the shaders of three.js and Bevy, which see no walls.
#[test]
fn no_light_passes_between_rooms_that_are_split() {
    const TEST: &str = "no_light_passes_between_rooms_that_are_split";
    let Some((json, scene)) = scene(TEST, "rooms") else { return };
    let receivers = receivers(&json);
    let places = place(&scene, "spacing = 0.5\nsplit = \"rooms\"");
    let names: Vec<&str> = places.value.0.volumes().iter().map(|volume| volume.name.as_str()).collect();
    assert_eq!(names, ["scene, room 1", "scene, room 2"]);
    let [sky, lamp] = lit(&json, &scene, &places.value);
    let (mut dark, mut bright) = (0, 0);
    for (name, lights) in [
        (
            "three",
            [&sky, &lamp].map(|probes| {
                let three = three(probes);
                Box::new(move |at, normal| three.irradiance(at, normal))
                    as Box<dyn Fn(_, _) -> Option<[f64; 3]>>
            }),
        ),
        (
            "bevy",
            [&sky, &lamp].map(|probes| {
                let bevy = bevy(probes);
                Box::new(move |at, normal| bevy.irradiance(at, normal))
                    as Box<dyn Fn(_, _) -> Option<[f64; 3]>>
            }),
        ),
    ] {
        for Receiver { at, normal, sky, all } in &receivers {
            let [of_sky, of_lamp] = lights
                .each_ref()
                .map(|light| light(*at, *normal).unwrap_or_else(|| panic!("{name}: {at:?} is in no volume")));
            if *sky == [0.0; 3] {
                assert_eq!(of_sky, [0.0; 3], "{name} {at:?}");
                assert!(of_lamp[0] > 0.0, "{name} {at:?}");
                dark += 1;
            }
            if all == sky {
                assert_eq!(of_lamp, [0.0; 3], "{name} {at:?}");
                assert!(of_sky[0] > 0.0, "{name} {at:?}");
                bright += 1;
            }
        }
    }
    assert!(dark > 80 && bright > 80 && dark + bright == 2 * receivers.len(), "{dark} {bright}");
    // What is left are the window's frame and corners, inside of a room.
    let note = &places.notes[0];
    let shares: Vec<f64> = note.split(' ').filter_map(|word| word.parse().ok()).collect();
    // Between the shares is the revision of three.js, and behind them the number of boxes.
    let [three_before, _, bevy_before, three_after, _, bevy_after, 2.0] = shares[..] else {
        panic!("{note}")
    };
    assert!(three_before > 5.0 && bevy_before > 5.0 && three_after < 0.2 && bevy_after < 0.4, "{note}");
    assert!(note.ends_with(" in the 2 boxes of rooms"), "{note}");
    let three = three(&sky);
    let found = error(&receivers, |at| three.irradiance(at.at, at.normal));
    println!("three.js after the split, 0.5 m: {:.1} %; {note}", 100.0 * found);
    // In one box, a plain try in the same shader has 19.6 percent.
    assert!(found < 0.196, "{found}");
}

/// Points are a spacing apart at surfaces and up to four in the open, and none is inside of the crate.
#[test]
fn scattered_points_are_denser_at_surfaces() {
    let scene = Room::new().scene();
    let ran = place(&scene, "spacing = 0.25\nscatter = \"adaptive\"");
    let places = &ran.value.0;
    assert_eq!((places.volumes().len(), places.points().len()), (0, places.len()));
    assert!(ran.notes[0].ends_with(&format!(
        "{0} probes in the octree of one box, the bounds of the scene, {0} of them at points",
        places.len()
    )));
    // The crate has its corner at (-0.75, -0.75, 0), and sides of 1.1 m.
    let is_in_crate =
        |at: &[f32; 3]| (0..3).all(|k| at[k] > [-0.75, -0.75, 0.0][k] && at[k] < [0.35, 0.35, 1.1][k]);
    assert!(!places.points().iter().any(is_in_crate));
    let nearest = |at: &[f32; 3]| {
        let distance = |other: &[f32; 3]| (0..3).map(|k| (at[k] - other[k]).powi(2)).sum::<f32>().sqrt();
        let others = places.points().iter().filter(|other| *other != at);
        others.map(distance).fold(f32::INFINITY, f32::min)
    };
    let (mut beside, mut open) = (Vec::new(), Vec::new());
    for at in places.points() {
        let wall = (2.0 - at[0].abs()).min(2.0 - at[1].abs()).min(at[2]);
        if wall < 0.2 {
            beside.push(nearest(at));
        } else if wall > 0.5 && at[2] > 1.7 {
            open.push(nearest(at));
        }
    }
    assert!(beside.len() > 300 && beside.iter().all(|distance| *distance <= 0.2501), "{}", beside.len());
    assert!(open.iter().filter(|distance| **distance > 0.4).count() > 10, "{open:?}");
    // They are baked, lit and exported.
    let transport: Arc<ProbeTransport> = case("bake-probes", "paths = 16")
        .input("scene", &*part(&scene, "surfaces"))
        .input("places", &*ran.value)
        .artifact();
    let probes: Arc<Probes> =
        case("light-probes", "").input("transport", &*transport).input("scene", &*scene).artifact();
    for (preset, is_loaded) in [
        ("unity", true),
        ("gltf", true),
        ("godot", true),
        ("three", false),
        ("bevy", false),
        ("vrc-light-volumes", false),
        ("ktx2", false),
    ] {
        let exported =
            case("export-probes", &format!("preset = \"{preset}\"")).input("probes", &*probes).files_of();
        assert_eq!(exported.is_ok(), is_loaded, "{preset}");
        match exported {
            Err(failure) => assert!(failure.to_string().contains("are scattered points"), "{failure}"),
            Ok((files, _)) if preset == "godot" => {
                // The one resource has the probes, and the corners of the box around them.
                let is_resource = |text: &&str| text.starts_with("[gd_resource");
                let texts = files.iter().flatten().filter_map(|file| std::str::from_utf8(file).ok());
                let [resource] = texts.filter(is_resource).collect::<Vec<_>>()[..] else { panic!("one") };
                let points = resource.lines().find(|line| line.starts_with("\"points\"")).unwrap();
                assert_eq!(points.split(", ").count(), 3 * (8 + places.len()));
            }
            Ok(_) => (),
        }
    }
}

/// A node named like `points` of `import-scene` is a probe at its origin, and nothing else.
#[test]
fn nodes_are_single_probes() {
    let room = Room::new().with(|json| {
        json["nodes"][2]["name"] = "probe.001".into();
        json["nodes"][3]["name"] = "probe.002".into();
    });
    let plain: Arc<Scene> = Room::new().scene();
    let scene: Arc<Scene> = room.import("points = \"probe.*\"").artifact();
    // In our axes, those of the file are y, z and x.
    assert_eq!(scene.0.scene.parts().points, [[0.5, 0.5, 1.2], [-1.0, 1.0, 2.0]]);
    // The panel is no surface any more.
    assert_eq!(scene.0.scene.parts().triangles.len(), plain.0.scene.parts().triangles.len() - 2);
    let ran = place(&scene, "points = [[0.5, 1.5, 1.75]]");
    assert_eq!(ran.notes[0], "3 probes in no box, 3 of them at points");
    assert_eq!(ran.value.0.points(), [[0.5, 1.5, 1.75], [0.5, 0.5, 1.2], [-1.0, 1.0, 2.0]]);
}

#[test]
fn parameters_that_have_no_effect_are_refused() {
    let errors = |parameters: &str| case("place-probes", parameters).errors();
    for (parameters, expected) in [
        ("counts = [2, 2, 2]\nsplit = \"rooms\"", "counts: are those of a box as it is; give spacing"),
        ("counts = [2, 2, 2]\nscatter = \"adaptive\"", "counts: are those of a box as it is; give spacing"),
        (
            "scatter = \"adaptive\"\nsplit = \"rooms\"",
            "split: has no effect on scattered points, which are in no volume",
        ),
        ("opening = 2.0", "opening: has an effect only with split = \"rooms\""),
    ] {
        assert_eq!(errors(parameters), [expected]);
    }
}
