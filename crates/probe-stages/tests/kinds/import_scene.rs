//! What a scene is, and what does not change it.

use probes::ScenePart;
use serde_json::json;
use stages::artifacts;

use crate::fixture::{case, part};
use crate::room::Room;

#[test]
fn a_scene_has_surfaces_emission_lamps_and_boxes() {
    let room = Room::new().with(|json| {
        let nodes = json["nodes"].as_array_mut().unwrap();
        nodes.push(json!({ "name": "hall", "scale": [1, 2, 3], "extras": { "specula_probes": true } }));
        nodes.push(json!({ "name": "probes_1", "translation": [0, 1, 0] }));
        json["scenes"][0]["nodes"].as_array_mut().unwrap().extend([json!(5), json!(6)]);
    });
    let ran = room.import("volumes = \"probes_*\"").run::<artifacts::Scene>().unwrap();
    let parts = ran.value.0.scene.parts();
    assert_eq!(parts.triangles.len(), 12 + 10 + 2);
    let names: Vec<&str> = parts.lamps.iter().map(|lamp| lamp.name.as_str()).collect();
    assert_eq!(names, ["bulb", "sun"]);
    let boxes: Vec<(&str, [[f32; 3]; 2])> =
        parts.boxes.iter().map(|named| (named.name.as_str(), named.bounds)).collect();
    // (x, y, z) of ours is (z, x, y) of the file.
    let hall = [[-3.0, -1.0, -2.0], [3.0, 1.0, 2.0]];
    assert_eq!(boxes, [("hall", hall), ("probes_1", [[-1.0, -1.0, 0.0], [1.0, 1.0, 2.0]])]);
    assert_eq!(ran.notes, [""; 0]);
    assert_eq!(ran.reads.len(), 2);
}

/// Roughness, normals and occlusion are not light on matte surfaces: their pictures are not even read.
#[test]
fn a_roughness_or_normal_map_changes_no_byte() {
    let plain = Room::new();
    let changed = plain.clone().with(|json| {
        json["images"] = json!([{ "uri": "rough.png" }, { "uri": "normal.png" }]);
        json["textures"] = json!([{ "source": 0 }, { "source": 1 }]);
        let wood = &mut json["materials"][0];
        wood["pbrMetallicRoughness"]["roughnessFactor"] = json!(0.9);
        wood["pbrMetallicRoughness"]["metallicRoughnessTexture"] = json!({ "index": 0 });
        wood["normalTexture"] = json!({ "index": 1 });
        wood["occlusionTexture"] = json!({ "index": 0 });
    });
    let [plain, changed] = [plain, changed].map(|room| room.import("").run::<artifacts::Scene>().unwrap());
    assert!(plain.bytes == changed.bytes);
    assert_eq!(plain.reads, changed.reads);
}

#[test]
fn parts_of_a_scene_keep_what_their_readers_read() {
    let scene = Room::new().scene();
    for (word, which) in
        [("shape", ScenePart::Shape), ("surfaces", ScenePart::Surfaces), ("lamps", ScenePart::Lamps)]
    {
        let found = part(&scene, word);
        assert_eq!(found.0.scene, scene.0.scene.part(which));
        assert_eq!(found.0.surfaces.is_empty(), which == ScenePart::Shape);
        // A part of that part is itself.
        assert_eq!(part(&found, word), found);
    }
    let shape = part(&scene, "shape");
    let failure = case("scene-part", "part = \"lamps\"").input("scene", &*shape).failure();
    let expected = "port scene has the part \"shape\" of a scene, which lacks what is read here | connect the \
                    stage of import-scene, or scene-part with part = \"lamps\"";
    assert_eq!(failure, expected);
}

#[test]
fn bright_albedos_are_clamped_and_counted() {
    let room = Room::new().with(|json| {
        json["materials"][1]["pbrMetallicRoughness"]["baseColorFactor"] = json!([1.0, 1.0, 1.0, 1.0]);
    });
    let notes = room.import("").run::<artifacts::Scene>().unwrap().notes;
    assert_eq!(notes, ["the albedo of 1 of 3 materials is above 0.95 and taken as that: plaster"]);
}
