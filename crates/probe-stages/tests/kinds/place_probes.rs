//! Where probes stand, and what is said of repairs.

use probes::Repair;
use serde_json::json;
use stages::artifacts::ProbePlaces;

use crate::fixture::{case, part};
use crate::room::Room;

#[test]
fn volumes_come_from_the_manifest_from_nodes_or_from_the_scene() {
    let place = |room: &Room, parameters: &str| {
        let scene = part(&room.scene(), "shape");
        case("place-probes", parameters).input("scene", &*scene).run::<ProbePlaces>().unwrap()
    };
    let plain = Room::new();
    let ran = place(&plain, "");
    let volume = &ran.value.0.volumes()[0];
    assert_eq!((volume.name.as_str(), volume.counts), ("scene", [4, 4, 3]));
    assert_eq!(ran.notes[0], "48 probes in one box, the bounds of the scene");
    let ran = place(
        &plain,
        "counts = [2, 3, 1]\npoints = [[0.5, 1.5, 1.75]]\nboxes = [{ from = [-1, -1, 1], to = [1, 1, 2] }]",
    );
    assert_eq!(ran.notes[0], "7 probes in a box of the manifest, 1 of them at points");
    assert_eq!((ran.value.0.len(), ran.value.0.points()), (7, &[[0.5, 1.5, 1.75]][..]));
    let boxed = plain.with(|json| {
        json["nodes"][3]["extras"] = json!({ "specula_probes": 1 });
    });
    let ran = place(&boxed, "lattice = \"corners\"");
    assert_eq!(
        (ran.value.0.volumes()[0].counts, ran.notes[0].as_str()),
        ([3; 3], "27 probes in a box of nodes")
    );
}

#[test]
fn repaired_probes_are_named_with_what_they_are_inside_of() {
    let scene = Room::new().scene();
    let ran = case("place-probes", "spacing = 0.5").input("scene", &*scene).run::<ProbePlaces>().unwrap();
    let places = &ran.value.0;
    let moved = places.repairs().iter().filter(|repair| **repair == Repair::Moved).count();
    let filled = places.repairs().iter().filter(|repair| matches!(repair, Repair::Filled(_))).count();
    // The crate's sides have 1.1 m: it holds 2 or 3 probes along each axis.
    assert!((8..=27).contains(&(moved + filled)), "{moved} {filled}");
    let repaired: Vec<&String> = ran.notes.iter().filter(|note| note.contains(": ")).collect();
    let note = repaired.iter().find(|note| note.contains("were moved")).unwrap();
    assert!(note.starts_with("inside crate, material wood: ") && note.contains(" (scene ["), "{note}");
    // Every repaired probe is in one of the notes, with its number and what was done.
    let named = |note: &&&String| note.matches(" (scene [").count();
    assert_eq!(repaired.iter().map(|note| named(&note)).sum::<usize>(), moved + filled, "{repaired:?}");
    for (probe, repair) in places.repairs().iter().enumerate().filter(|(_, repair)| **repair != Repair::None)
    {
        let volume = &places.volumes()[0];
        let [x, y, z] = volume.cell(probe);
        let name = format!(" {probe} (scene [{x}, {y}, {z}]) ");
        let note = repaired.iter().find(|note| note.contains(&name)).unwrap();
        let detail = note.split(&name).nth(1).unwrap().split(',').next().unwrap();
        match repair {
            Repair::Moved => {
                let way = (0..3).map(|axis| places.positions()[probe][axis] - places.grid()[probe][axis]);
                assert_eq!(detail, format!("{:.2} m", way.map(|x| x * x).sum::<f32>().sqrt()));
            }
            Repair::Filled(sources) => assert_eq!(detail, format!("from {}", sources.len())),
            other => panic!("{other:?}"),
        }
    }
    assert_eq!(ran.warnings, [""; 0]);
}

/// A new albedo, emission or lamp leaves the places as they are, even if the whole scene is connected.
#[test]
fn albedo_and_light_have_no_part_in_places() {
    let place = |room: &Room| {
        let scene = room.scene();
        case("place-probes", "").input("scene", &*scene).run::<ProbePlaces>().unwrap().bytes
    };
    let changed = Room::new().with(|json| {
        json["materials"][0]["pbrMetallicRoughness"]["baseColorFactor"] = json!([0.1, 0.2, 0.9, 1.0]);
        json["materials"][2]["emissiveFactor"] = json!([0.1, 0.2, 0.9]);
        json["nodes"][3]["translation"] = json!([0, 1, 0]);
    });
    assert!(place(&Room::new()) == place(&changed));
}

/// What leaks past the limit fails with the worst points; the file has the mean of all.
#[test]
fn leaks_above_the_limit_are_an_error() {
    let scene = part(&Room::new().scene(), "shape");
    let places = case("place-probes", "spacing = 1").input("scene", &*scene).artifact::<ProbePlaces>();
    let check = |parameters: &str| {
        let leaks = case("check-probes", &format!("points = 500\n{parameters}"));
        leaks.input("places", &*places).input("scene", &*scene).files_of()
    };
    let (files, notes) = check("").unwrap();
    let json: serde_json::Value = serde_json::from_slice(files[0].as_ref().unwrap()).unwrap();
    let number = |key: &str| json[key].as_f64().unwrap();
    let worst = json["worst"].as_array().unwrap();
    assert!(worst.len() < 100 && number("points") + number("hidden") == 500.0, "{json}");
    let sum: f64 = worst.iter().map(|point| point["share"].as_f64().unwrap()).sum();
    assert!(number("mean") > 0.0 && (sum / number("points") - number("mean")).abs() < 1e-6, "{json}");
    assert!(
        notes[0].contains("% of the probes' light leaks, by weight (three.js 187)")
            && notes[0].contains("from probe")
    );
    let limit = |factor: f64| check(&format!("leak-limit = {}", factor * number("mean")));
    assert!(limit(1.001).is_ok());
    let failure = limit(0.999).unwrap_err();
    assert!(failure.to_string().contains("; leak-limit is 0.0"), "{failure}");
    // Our own blend leaves out what cannot see the point.
    let (files, _) = check("blend = \"visible\"").unwrap();
    let visible: serde_json::Value = serde_json::from_slice(files[0].as_ref().unwrap()).unwrap();
    assert!(visible["mean"].as_f64().unwrap() < 0.2 * number("mean"), "{visible}");
}
