//! A room without a ceiling, with a crate, a glowing panel and two lamps, as glTF text.

use std::sync::Arc;

use serde_json::{Value, json};
use stages::artifacts;

use crate::fixture::{Case, case};

/// The corners of the cube from 0 to 1, and its faces, counter-clockwise as seen from outside: bottom, top
/// and the four sides.
const FACES: [[[f32; 3]; 4]; 6] = [
    [[0., 0., 0.], [1., 0., 0.], [1., 0., 1.], [0., 0., 1.]],
    [[0., 1., 0.], [0., 1., 1.], [1., 1., 1.], [1., 1., 0.]],
    [[0., 0., 0.], [0., 1., 0.], [1., 1., 0.], [1., 0., 0.]],
    [[0., 0., 1.], [1., 0., 1.], [1., 1., 1.], [0., 1., 1.]],
    [[0., 0., 0.], [0., 0., 1.], [0., 1., 1.], [0., 1., 0.]],
    [[1., 0., 0.], [1., 1., 0.], [1., 1., 1.], [1., 0., 1.]],
];

/// A room of 4 x 4 m with walls of 2.5 m, in the frame of the file (+Y up).
#[derive(Clone)]
pub(crate) struct Room {
    pub(crate) json: Value,
    pub(crate) buffer: Vec<u8>,
}

impl Room {
    pub(crate) fn new() -> Self {
        let mut buffer = Vec::new();
        for face in FACES {
            face.as_flattened().iter().for_each(|x| buffer.extend(x.to_le_bytes()));
        }
        let of_positions = buffer.len();
        let outside = |face: u16| [0, 1, 2, 0, 2, 3].map(|corner| 4 * face + corner);
        let inside = |face: u16| [0, 2, 1, 0, 3, 2].map(|corner| 4 * face + corner);
        // The crate, the room without its top, and a panel, which is a top seen from below.
        let crates: Vec<u16> = (0..6).flat_map(outside).collect();
        let room: Vec<u16> = [0, 2, 3, 4, 5].into_iter().flat_map(inside).collect();
        let lists = [crates, room, inside(1).to_vec()];
        let mut views = vec![json!({ "buffer": 0, "byteOffset": 0, "byteLength": of_positions })];
        let mut accessors = vec![json!({
            "bufferView": 0, "componentType": 5126, "type": "VEC3", "count": 24,
            "min": [0, 0, 0], "max": [1, 1, 1],
        })];
        for list in lists {
            let (offset, count) = (buffer.len(), list.len());
            list.iter().for_each(|corner| buffer.extend(corner.to_le_bytes()));
            accessors.push(json!({
                "bufferView": views.len(), "componentType": 5123, "type": "SCALAR", "count": count,
            }));
            views.push(json!({ "buffer": 0, "byteOffset": offset, "byteLength": 2 * count }));
        }
        let mesh = |indices: usize, material: usize| {
            let primitive =
                json!({ "attributes": { "POSITION": 0 }, "indices": indices, "material": material });
            json!({ "primitives": [primitive] })
        };
        let matte = |name: &str, color: [f64; 4]| {
            let base = json!({ "baseColorFactor": color, "metallicFactor": 0, "roughnessFactor": 0.5 });
            json!({ "name": name, "pbrMetallicRoughness": base })
        };
        let mut panel = matte("panel", [0.0, 0.0, 0.0, 1.0]);
        panel["emissiveFactor"] = json!([1.0, 0.5, 0.25]);
        panel["extensions"] = json!({ "KHR_materials_emissive_strength": { "emissiveStrength": 3.0 } });
        let lamp = |index: usize| json!({ "KHR_lights_punctual": { "light": index } });
        let light = |name: &str, kind: &str| json!({ "name": name, "type": kind, "color": [1.0, 0.8, 0.6], "intensity": 5.0 });
        let json = json!({
            "asset": { "version": "2.0" },
            "scene": 0,
            "scenes": [{ "name": "main", "nodes": [0, 1, 2, 3, 4] }],
            "nodes": [
                { "name": "crate", "mesh": 0, "translation": [-0.75, 0, -0.75], "scale": [1.1, 1.1, 1.1] },
                { "name": "room", "mesh": 1, "translation": [-2, 0, -2], "scale": [4, 2.5, 4] },
                { "name": "panel", "mesh": 2, "translation": [0.5, 1.2, 0.5], "scale": [0.5, 1, 0.5] },
                { "name": "bulb", "translation": [1, 2, -1], "extensions": lamp(0) },
                { "name": "sun", "rotation": [-0.6, 0, 0, 0.8], "extensions": lamp(1) },
            ],
            "meshes": [mesh(1, 0), mesh(2, 1), mesh(3, 2)],
            "materials": [matte("wood", [0.5, 0.3, 0.1, 1.0]), matte("plaster", [0.7, 0.7, 0.7, 1.0]), panel],
            "extensions": { "KHR_lights_punctual": { "lights": [light("a", "point"), light("b", "directional")] } },
            "accessors": accessors,
            "bufferViews": views,
            "buffers": [{ "uri": "room.bin", "byteLength": buffer.len() }],
        });
        Self { json, buffer }
    }

    /// The room after a change of its JSON.
    pub(crate) fn with(mut self, change: impl FnOnce(&mut Value)) -> Self {
        change(&mut self.json);
        self
    }

    /// The case that imports it.
    pub(crate) fn import(&self, parameters: &str) -> Case {
        case("import-scene", parameters)
            .file("room.gltf", self.json.to_string())
            .file("room.bin", self.buffer.clone())
            .source("room.gltf")
    }

    pub(crate) fn scene(&self) -> Arc<artifacts::Scene> {
        self.import("").artifact()
    }
}
