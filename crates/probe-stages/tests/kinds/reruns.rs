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
    std::fs::write(folder.join("pipeline.toml"), MANIFEST).unwrap();
    std::fs::write(folder.join("room.gltf"), room.json.to_string()).unwrap();
    std::fs::write(folder.join("room.bin"), &room.buffer).unwrap();
    let plan =
        Plan::load(&folder.join("pipeline.toml"), &kinds()).unwrap_or_else(|errors| panic!("{errors}"));
    let ran = Mutex::new(BTreeSet::new());
    let record = |event: Event| match event {
        Event::Started { item, .. } => {
            ran.lock().insert(item.stage);
        }
        Event::Failed { item, error, .. } => panic!("{item}: {}", error.join(": ")),
        _ => {}
    };
    let options = BuildOptions { jobs: Some(threads), ..BuildOptions::default() };
    build(&plan, &options, &Cancel::default(), &record).unwrap();
    ran.into_inner()
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
