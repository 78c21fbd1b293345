//! Probes as points of a binary glTF, with the attributes of `export-gltf`.

use std::ops::Range;

use engine::Failure;
use probes::ProbePlaces;
use serde_json::{Value, json};

use super::axes::OF_FILES;
use super::columns::{Columns, ROWS};
use super::light::ProbeLight;

/// The description of the coefficients in the file.
const BASIS: &str = "radiance; real orthonormal spherical harmonics without Condon-Shortley phase, row l*l + \
                     l + m, of the directions (x, y, z) = (z, x, y) of this file: +Z is up";

/// The primitive mode of points, the component type of 32-bit floats and the target of vertices.
const POINTS: u32 = 0;
const FLOAT: u32 = 5126;
const ARRAY_BUFFER: u32 = 34962;

/// The description of the transport in the file.
const TRANSFER: &str = "number j % 4 of attribute j / 4 is number j of the matrix [row, column]: radiance that arrives, for a \
                        coefficient of the sky, a radiance of an emissive material, or a colour times intensity of a lamp, \
                        of 1; zeros after the last";

/// The binary glTF of all probes: a node with a mesh of points for each volume, and one for scattered points.
///
/// # Errors
/// If the recipe is not JSON, which never happens, or the file is larger than 4 GiB.
pub(crate) fn file(light: &ProbeLight<'_>, recipe: &str) -> Result<Vec<u8>, Failure> {
    let mut gltf = Points::default();
    for (name, range, extras) in parts(light.places) {
        gltf.add(light, &name, range, extras);
    }
    gltf.finish(serde_json::from_str(recipe)?)
}

/// The binary glTF of the transport to all probes, with the same nodes.
///
/// # Errors
/// The errors of [`file`].
pub(crate) fn transport_file(
    columns: &[Columns; 3],
    places: &ProbePlaces,
    recipe: &str,
) -> Result<Vec<u8>, Failure> {
    let mut gltf = Points::default();
    for (name, range, extras) in parts(places) {
        gltf.add_transport(columns, places, &name, range, extras);
    }
    gltf.finish(serde_json::from_str(recipe)?)
}

/// The volumes and the scattered points: their names, their probes, and what is said of them.
fn parts(places: &ProbePlaces) -> Vec<(String, Range<usize>, Value)> {
    let mut first = 0;
    let mut parts: Vec<(String, Range<usize>, Value)> = Vec::new();
    for volume in places.volumes() {
        let end = first + volume.len();
        let extras =
            json!({ "counts": volume.counts, "order": "x, y, z of Specula's frame; x changes fastest" });
        parts.push((volume.name.clone(), first..end, extras));
        first = end;
    }
    if places.scattered() > 0 {
        parts.push(("points".into(), first..places.len(), json!({})));
    }
    parts
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
    fn attribute<const N: usize>(&mut self, values: &[[f32; N]], has_bounds: bool) -> usize {
        let offset = self.buffer.len();
        self.buffer.extend(values.as_flattened().iter().flat_map(|value| value.to_le_bytes()));
        let length = self.buffer.len() - offset;
        let view = self.views.len();
        self.views
            .push(json!({ "buffer": 0, "byteOffset": offset, "byteLength": length, "target": ARRAY_BUFFER }));
        let mut accessor = json!({ "bufferView": view, "componentType": FLOAT, "count": values.len(), "type": format!("VEC{N}") });
        if has_bounds {
            let end = |take: fn(f32, f32) -> f32| {
                let of = |k: usize| values.iter().map(|value| value[k]).reduce(take).unwrap_or(0.0);
                (0..N).map(of).collect::<Vec<f32>>()
            };
            accessor["min"] = json!(end(f32::min));
            accessor["max"] = json!(end(f32::max));
        }
        self.accessors.push(accessor);
        self.accessors.len() - 1
    }

    /// Adds the places of some probes, as the first of their attributes.
    fn positions(&mut self, places: &ProbePlaces, range: Range<usize>) -> Value {
        let in_file = |place: &[f32; 3]| OF_FILES.vector(*place).map(|x| x as f32);
        let positions: Vec<_> = places.grid()[range].iter().map(in_file).collect();
        json!({ "POSITION": self.attribute(&positions, true) })
    }

    /// Adds a mesh of points with some attributes.
    fn mesh(&mut self, name: &str, attributes: &Value, extras: &Value) {
        self.nodes.push(json!({ "name": name, "mesh": self.meshes.len() }));
        self.meshes.push(json!({
            "name": name,
            "primitives": [{ "attributes": attributes, "mode": POINTS }],
            "extras": extras,
        }));
    }

    /// Adds the points of some probes.
    fn add(&mut self, light: &ProbeLight<'_>, name: &str, range: Range<usize>, mut extras: Value) {
        let mut attributes = self.positions(light.places, range.clone());
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
        self.mesh(name, &attributes, &extras);
    }

    /// Adds the points of some probes with their matrices, four numbers an attribute.
    fn add_transport(
        &mut self,
        columns: &[Columns; 3],
        places: &ProbePlaces,
        name: &str,
        range: Range<usize>,
        mut extras: Value,
    ) {
        let mut attributes = self.positions(places, range.clone());
        let is_grey = columns.iter().all(|columns| columns.count == 0 || columns.channels == 1);
        let colours: &[&str] = if is_grey { &[""] } else { &["_RED", "_GREEN", "_BLUE"] };
        let numbers = ROWS * columns.iter().map(|columns| columns.count).sum::<usize>();
        for (channel, colour) in colours.iter().enumerate() {
            let matrix = |probe: usize| -> Vec<f32> {
                let row = |row: usize| columns.iter().flat_map(move |own| own.row(probe, row, channel));
                (0..ROWS).flat_map(row).collect()
            };
            let matrices: Vec<Vec<f32>> = range.clone().map(matrix).collect();
            for part in 0..numbers.div_ceil(4) {
                let four = |matrix: &Vec<f32>| {
                    [0, 1, 2, 3].map(|k| matrix.get(4 * part + k).copied().unwrap_or(0.0))
                };
                let values: Vec<[f32; 4]> = matrices.iter().map(four).collect();
                attributes[format!("{colour}_TRANSFER_{part}")] = self.attribute(&values, false).into();
            }
        }
        let valid = |probe: usize| [f32::from(u8::from(places.is_valid(probe))), 0.0, 0.0, 0.0];
        attributes["_VALIDITY"] = self.attribute(&range.map(valid).collect::<Vec<_>>(), false).into();
        let [sky, emission, lamps] = columns;
        let of = |lights: &Columns| json!({ "columns": lights.count, "names": lights.names });
        extras["basis"] = BASIS.into();
        extras["transfer"] = TRANSFER.into();
        extras["rows"] = ROWS.into();
        extras["sky"] = json!({ "columns": sky.count });
        extras["emission"] = of(emission);
        extras["lamps"] = of(lamps);
        self.mesh(name, &attributes, &extras);
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

#[cfg(test)]
mod tests {
    use probes::{Lattice, Volume};

    use super::*;
    use crate::testkit::{noise, places};

    /// The numbers of the attributes are the matrices, in colours only if a column has them.
    #[test]
    fn attributes_are_the_matrices() {
        let volume = Volume::new("a".into(), [[0.0; 3], [1.0; 3]], [3, 1, 1], Lattice::Centres).unwrap();
        let places = places(vec![volume], vec![[0.5; 3]]);
        for emitters in [0, 2] {
            let of = |count: usize, channels: usize, first: usize| Columns {
                count,
                channels,
                names: vec!["lamp".into(); count],
                numbers: (0..4 * ROWS * count * channels).map(|k| noise(first + k)).collect(),
            };
            let columns = [of(9, 1, 0), of(emitters, 3, 1000), of(0, 3, 0)];
            let bytes = transport_file(&columns, &places, "{}").unwrap();
            let length = u32::from_le_bytes(bytes[12..16].try_into().unwrap()) as usize;
            let json: Value = serde_json::from_slice(&bytes[20..20 + length]).unwrap();
            let begin = 28 + length;
            for (mesh, probes) in [(0, 0..3), (1, 3..4)] {
                let mesh = &json["meshes"][mesh];
                let attributes = &mesh["primitives"][0]["attributes"];
                let number = |name: &str, point: usize, k: usize| {
                    let accessor = &json["accessors"][attributes[name].as_u64().unwrap() as usize];
                    assert_eq!(
                        (&accessor["type"], &accessor["count"]),
                        (&"VEC4".into(), &probes.len().into())
                    );
                    let view = &json["bufferViews"][accessor["bufferView"].as_u64().unwrap() as usize];
                    let at = begin + view["byteOffset"].as_u64().unwrap() as usize + 4 * (4 * point + k);
                    f32::from_le_bytes(bytes[at..at + 4].try_into().unwrap())
                };
                let colours = if emitters == 0 { vec![""] } else { vec!["_RED", "_GREEN", "_BLUE"] };
                assert_eq!(attributes.get("_TRANSFER_0").is_some(), emitters == 0);
                for (point, probe) in probes.clone().enumerate() {
                    for (channel, colour) in colours.iter().enumerate() {
                        for row in 0..ROWS {
                            for column in 0..9 + emitters {
                                let j = row * (9 + emitters) + column;
                                let found = number(&format!("{colour}_TRANSFER_{}", j / 4), point, j % 4);
                                let expected = match column.checked_sub(9) {
                                    None => noise((probe * ROWS + row) * 9 + column),
                                    Some(emitter) => {
                                        noise(1000 + ((probe * ROWS + row) * 2 + emitter) * 3 + channel)
                                    }
                                };
                                assert_eq!(found, expected, "{probe} {row} {column}");
                            }
                        }
                    }
                    assert_eq!(number("_VALIDITY", point, 0), 1.0);
                }
                assert_eq!(mesh["extras"]["emission"]["columns"], emitters);
            }
        }
    }
}
