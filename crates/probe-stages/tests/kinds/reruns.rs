//! What an edit of a scene reruns, on the disk.

use std::collections::BTreeSet;
use std::path::Path;

use engine::{BuildOptions, Cancel, Event, Plan, build};
use parking_lot::Mutex;
use serde_json::json;
use tempfile::TempDir;

use crate::fixture::kinds;
use crate::room::Room;

const MANIFEST: &str = r#"schema = 1
out = "out"

[stage.scene]
kind = "import-scene"
source = "room.gltf"

[stage.shape]
kind = "scene-part"
input = "scene"
part = "shape"

[stage.surfaces]
kind = "scene-part"
input = "scene"
part = "surfaces"

[stage.lamp-shapes]
kind = "scene-part"
input = "scene"
part = "lamps"

[stage.places]
kind = "place-probes"
input = "shape"

[stage.transport]
kind = "bake-probes"
inputs = { scene = "surfaces", places = "places" }
paths = 16

[stage.lamp-light]
kind = "bake-lamps"
inputs = { scene = "lamp-shapes", places = "places" }
paths = 16

[stage.probes]
kind = "light-probes"
inputs = { transport = "transport", lamps = "lamp-light", scene = "scene" }
"#;

/// Writes a room, builds, and gives the stages that ran.
fn build_with(folder: &Path, room: &Room, threads: usize) -> BTreeSet<String> {
    built(folder, room, BuildOptions { jobs: Some(threads), ..BuildOptions::default() }).0
}

/// Writes a room, builds, and gives the stages that ran and the notes of the bakes.
fn built(folder: &Path, room: &Room, options: BuildOptions) -> (BTreeSet<String>, Vec<String>) {
    std::fs::write(folder.join("pipeline.toml"), MANIFEST).unwrap();
    std::fs::write(folder.join("room.gltf"), room.json.to_string()).unwrap();
    std::fs::write(folder.join("room.bin"), &room.buffer).unwrap();
    let plan =
        Plan::load(&folder.join("pipeline.toml"), &kinds()).unwrap_or_else(|errors| panic!("{errors}"));
    let (ran, notes) = (Mutex::new(BTreeSet::new()), Mutex::new(Vec::new()));
    let record = |event: Event| match event {
        Event::Started { item, .. } => {
            ran.lock().insert(item.stage);
        }
        Event::Note { item, message } if ["lamp-light", "transport"].contains(&item.stage.as_str()) => {
            notes.lock().push(message);
        }
        Event::Failed { item, error, .. } => panic!("{item}: {}", error.join(": ")),
        _ => {}
    };
    build(&plan, &options, &Cancel::default(), &record).unwrap();
    (ran.into_inner(), notes.into_inner())
}

/// The digests of all that a build has stored.
fn stored(folder: &Path) -> BTreeSet<String> {
    let of = |folder: &Path| -> Vec<_> {
        std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect()
    };
    let blobs = of(&folder.join(".specula/blobs")).into_iter().flat_map(|folder| of(&folder));
    blobs.map(|blob| blob.file_name().unwrap().to_string_lossy().into_owned()).collect()
}

/// In another process, too: each build here has a session of its own.
#[test]
fn only_the_lamp_that_moved_is_traced_and_all_bytes_are_those_of_a_full_bake() {
    let (folder, fresh) = (TempDir::new().unwrap(), TempDir::new().unwrap());
    let plain = Room::new();
    let moved = plain.clone().with(|json| json["nodes"][3]["translation"] = json!([1, 2, 0]));
    let as_before = |notes: &[String]| {
        let note = notes.iter().find(|note| note.contains("were not traced"));
        note.map(|note| note.split(" are").next().unwrap_or_default().to_owned())
    };
    let options = BuildOptions::default;
    let (_, notes) = built(folder.path(), &plain, options());
    assert_eq!(as_before(&notes), None);
    let (ran, notes) = built(folder.path(), &moved, options());
    assert!(ran.contains("lamp-light"));
    assert_eq!(as_before(&notes).as_deref(), Some("1 of 2 lamps"));
    built(fresh.path(), &moved, options());
    let lost: Vec<_> = stored(fresh.path()).difference(&stored(folder.path())).cloned().collect();
    assert!(lost.is_empty(), "{lost:?}");
    // What is forced is made from nothing.
    let (_, notes) = built(folder.path(), &moved, BuildOptions { force: true, ..options() });
    assert_eq!(as_before(&notes), None);
    // An albedo changes the light of every lamp.
    let dark = moved.with(|json| {
        json["materials"][0]["pbrMetallicRoughness"]["baseColorFactor"] = json!([0.1, 0.1, 0.1, 1]);
    });
    let (ran, notes) = built(folder.path(), &dark, options());
    assert!(ran.contains("lamp-light") && as_before(&notes).is_none());
}

/// Two closed rooms, in one of which the crate is moved: the bricks of the other are kept, and all bytes are
/// those of a build from nothing.
#[test]
fn bricks_that_do_not_see_a_change_are_kept() {
    let (folder, fresh) = (TempDir::new().unwrap(), TempDir::new().unwrap());
    let rooms = Room::new().with(|json| {
        // The top of each room is the panel, seen from below; the second room is as the first, 4.2 m away.
        let top = json!({ "mesh": 2, "translation": [-2, 1.5, -2], "scale": [4, 1, 4] });
        let moved = |node: &serde_json::Value| {
            let mut node = node.clone();
            node["translation"][0] = json!(node["translation"][0].as_f64().unwrap() + 4.2);
            node
        };
        json["nodes"][2] = top;
        for k in 0..3 {
            let node = moved(&json["nodes"][k]);
            json["nodes"].as_array_mut().unwrap().push(node);
        }
        json["scenes"][0]["nodes"] = json!([0, 1, 2, 3, 4, 5, 6, 7]);
    });
    let moved = rooms.clone().with(|json| json["nodes"][0]["translation"] = json!([-0.7, 0, -0.75]));
    let kept = |notes: &[String]| notes.iter().find(|note| note.contains("bricks of probes")).cloned();
    let options = BuildOptions::default;
    let (_, notes) = built(folder.path(), &rooms, options());
    assert_eq!(kept(&notes), None);
    let (_, notes) = built(folder.path(), &moved, options());
    let note = kept(&notes).unwrap();
    let counts: Vec<usize> = note.split(' ').filter_map(|word| word.parse().ok()).collect();
    assert!(0 < counts[0] && counts[0] < counts[1], "{note}");
    built(fresh.path(), &moved, options());
    let lost: Vec<_> = stored(fresh.path()).difference(&stored(folder.path())).cloned().collect();
    assert!(lost.is_empty(), "{lost:?}");
    // What is forced is made from nothing, and another emissive material is one for all.
    let (_, notes) = built(folder.path(), &moved, BuildOptions { force: true, ..options() });
    assert_eq!(kept(&notes), None);
    let dark = moved.with(|json| json["materials"][2]["emissiveFactor"] = json!([0, 0, 0]));
    let (_, notes) = built(folder.path(), &dark, options());
    assert!(kept(&notes).is_some_and(|note| note.starts_with("all ")), "{notes:?}");
}

#[test]
fn only_what_reads_a_change_runs() {
    let folder = TempDir::new().unwrap();
    let plain = Room::new();
    let all = ["lamp-light", "lamp-shapes", "places", "probes", "scene", "shape", "surfaces", "transport"];
    assert_eq!(build_with(folder.path(), &plain, 2), BTreeSet::from(all.map(String::from)));
    assert_eq!(build_with(folder.path(), &plain, 2), BTreeSet::new());
    let parts = ["scene", "shape", "surfaces", "lamp-shapes"];
    type Change = fn(&mut serde_json::Value);
    let cases: [(&str, Change, &[&str]); 6] = [
        (
            "a roughness map",
            |json| json["materials"][0]["pbrMetallicRoughness"]["roughnessFactor"] = json!(0.1),
            &["scene"],
        ),
        (
            "the colour of a lamp",
            |json| json["extensions"]["KHR_lights_punctual"]["lights"][0]["color"] = json!([0.1, 1, 1]),
            &[&parts[..], &["probes"]].concat(),
        ),
        (
            "a lamp that is switched off",
            |json| json["extensions"]["KHR_lights_punctual"]["lights"][1]["intensity"] = json!(0),
            &[&parts[..], &["probes"]].concat(),
        ),
        (
            "the strength of emission",
            |json| json["materials"][2]["emissiveFactor"] = json!([0.2, 0.2, 0.2]),
            &[&parts[..], &["probes"]].concat(),
        ),
        (
            "a lamp that is moved",
            |json| json["nodes"][3]["translation"] = json!([1, 2, 0]),
            &[&parts[..], &["lamp-light", "probes"]].concat(),
        ),
        (
            "an albedo",
            |json| {
                json["materials"][0]["pbrMetallicRoughness"]["baseColorFactor"] = json!([0.1, 0.1, 0.1, 1])
            },
            &[&parts[..], &["transport", "lamp-light", "probes"]].concat(),
        ),
    ];
    for (what, change, expected) in cases {
        build_with(folder.path(), &plain, 2);
        let expected: BTreeSet<String> = expected.iter().map(|stage| (*stage).to_owned()).collect();
        assert_eq!(build_with(folder.path(), &plain.clone().with(change), 2), expected, "{what}");
    }
}
