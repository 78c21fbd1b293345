//! Probes as points of a binary glTF, with the attributes of `export-gltf`.

use engine::Failure;
use serde_json::{Value, json};

use super::axes::OF_FILES;
use super::light::ProbeLight;

/// The description of the coefficients in the file.
const BASIS: &str = "radiance; real orthonormal spherical harmonics without Condon-Shortley phase, row l*l + \
                     l + m, of the directions (x, y, z) = (z, x, y) of this file: +Z is up";

/// The primitive mode of points, the component type of 32-bit floats and the target of vertices.
const POINTS: u32 = 0;
const FLOAT: u32 = 5126;
const ARRAY_BUFFER: u32 = 34962;

/// The binary glTF of all probes: a node with a mesh of points for each volume, and one for scattered points.
///
/// # Errors
/// If the recipe is not JSON, which never happens, or the file is larger than 4 GiB.
pub(crate) fn file(light: &ProbeLight<'_>, recipe: &str) -> Result<Vec<u8>, Failure> {
    let mut first = 0;
    let mut parts: Vec<(String, std::ops::Range<usize>, Value)> = Vec::new();
    for volume in light.places.volumes() {
        let end = first + volume.len();
        let extras =
            json!({ "counts": volume.counts, "order": "x, y, z of Specula's frame; x changes fastest" });
        parts.push((volume.name.clone(), first..end, extras));
        first = end;
    }
    if light.places.scattered() > 0 {
        parts.push(("points".into(), first..light.places.len(), json!({})));
    }
    let mut gltf = Points::default();
    for (name, range, extras) in parts {
        gltf.add(light, &name, range, extras);
    }
    let recipe: Value = serde_json::from_str(recipe)?;
    gltf.finish(recipe)
}

/// A file as it grows.
#[derive(Default)]
struct Points {
    buffer: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
    meshes: Vec<Value>,
    nodes: Vec<Value>,
}

impl Points {
    /// Adds an attribute and returns the index of its accessor.
    fn attribute(&mut self, values: &[[f32; 3]], has_bounds: bool) -> usize {
        let offset = self.buffer.len();
        self.buffer.extend(values.as_flattened().iter().flat_map(|value| value.to_le_bytes()));
        let length = self.buffer.len() - offset;
        let view = self.views.len();
        self.views
            .push(json!({ "buffer": 0, "byteOffset": offset, "byteLength": length, "target": ARRAY_BUFFER }));
        let mut accessor =
            json!({ "bufferView": view, "componentType": FLOAT, "count": values.len(), "type": "VEC3" });
        if has_bounds {
            let end = |take: fn(f32, f32) -> f32| {
                [0, 1, 2].map(|k| values.iter().map(|value| value[k]).reduce(take).unwrap_or(0.0))
            };
            accessor["min"] = json!(end(f32::min));
            accessor["max"] = json!(end(f32::max));
        }
        self.accessors.push(accessor);
        self.accessors.len() - 1
    }

    /// Adds the points of some probes.
    fn add(&mut self, light: &ProbeLight<'_>, name: &str, range: std::ops::Range<usize>, mut extras: Value) {
        let in_file = |place: &[f32; 3]| OF_FILES.vector(*place).map(|x| x as f32);
        let positions: Vec<_> = light.places.grid()[range.clone()].iter().map(in_file).collect();
        let mut attributes = json!({ "POSITION": self.attribute(&positions, true) });
        for row in 0..9 {
            let l = [0, 1, 1, 1, 2, 2, 2, 2, 2][row];
            let values: Vec<_> = light.rows[range.clone()].iter().map(|rows| rows[row]).collect();
            attributes[format!("_SH_DEGREE_{l}_COEF_{}", row - l * l)] =
                self.attribute(&values, false).into();
        }
        // Validity has three numbers, as all attributes have: Blender before 5.1 cannot read a mixture.
        let validity = light.valid[range].iter().map(|valid| [f32::from(u8::from(*valid)), 0.0, 0.0]);
        let validity: Vec<_> = validity.collect();
        attributes["_VALIDITY"] = self.attribute(&validity, false).into();
        extras["basis"] = BASIS.into();
        self.nodes.push(json!({ "name": name, "mesh": self.meshes.len() }));
        self.meshes.push(json!({
            "name": name,
            "primitives": [{ "attributes": attributes, "mode": POINTS }],
            "extras": extras,
        }));
    }

    /// The bytes of the file.
    fn finish(mut self, recipe: Value) -> Result<Vec<u8>, Failure> {
        let nodes: Vec<usize> = (0..self.nodes.len()).collect();
        let document = json!({
            "asset": { "version": "2.0", "generator": "specula", "extras": { "specula": recipe } },
            "scene": 0,
            "scenes": [{ "nodes": nodes }],
            "nodes": self.nodes,
            "meshes": self.meshes,
            "accessors": self.accessors,
            "bufferViews": self.views,
            "buffers": [{ "byteLength": self.buffer.len() }],
        });
        let mut text = serde_json::to_vec(&document)?;
        text.resize(text.len().next_multiple_of(4), b' ');
        self.buffer.resize(self.buffer.len().next_multiple_of(4), 0);
        let word = |length: usize| u32::try_from(length).map(u32::to_le_bytes);
        let mut bytes = b"glTF\x02\0\0\0".to_vec();
        bytes.extend(word(12 + 8 + text.len() + 8 + self.buffer.len())?);
        bytes.extend(word(text.len())?);
        bytes.extend(b"JSON");
        bytes.extend(text);
        bytes.extend(word(self.buffer.len())?);
        bytes.extend(b"BIN\0");
        bytes.extend(self.buffer);
        Ok(bytes)
    }
}
