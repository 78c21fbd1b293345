//! Writing a binary glTF: one mesh, with numbers of one's own at its vertices.
//!
//! Each attribute has a buffer view of its own, in the order in which it is given, after those of the mesh;
//! indices are last. All numbers are 32 bits wide, so that everything is aligned.

use mesh::Mesh;
use serde::Deserialize;
use serde_json::value::RawValue;
use serde_json::{Map, Value, json};
use sphere::DVec3;

use super::document;
use crate::error::{Error, ErrorKind};
use crate::recipe;
use crate::recipe::KEY;

const FLOAT: u32 = 5126;
const UNSIGNED_INT: u32 = 5125;
pub(super) const ARRAY_BUFFER: u32 = 34962;
const ELEMENT_ARRAY_BUFFER: u32 = 34963;

/// Numbers at each vertex, for an attribute of a glTF file.
#[derive(Clone, Debug, PartialEq)]
pub struct VertexAttribute {
    /// The name; what is not of the specification begins with an underscore.
    pub name: String,
    /// How many numbers a vertex has, 1 to 4.
    pub width: usize,
    /// [V, width].
    pub values: Vec<f32>,
}

/// The texts of a glTF file beside its numbers.
#[derive(Clone, Copy, Debug, Default)]
pub struct GlbText<'a> {
    /// Whether the material is unlit (`KHR_materials_unlit`): viewers show `COLOR_0` as it is. If not, it is
    /// matte.
    pub unlit: bool,
    /// The members of the mesh's `extras`.
    pub extras: &'a [(&'a str, &'a str)],
    /// How the file was made, for `asset.extras`.
    pub recipe: Option<&'a str>,
}

/// Writes a `.glb` of a mesh, turned into the file's frame (+Y up): `POSITION`, `NORMAL`, `TANGENT`,
/// `TEXCOORD_0` if the mesh has coordinates, and the given attributes, whose numbers stay as they are.
///
/// # Errors
/// If the mesh has no triangles; if an attribute has not `width` numbers for each vertex, or one that is not
/// finite; if the file would be longer than the 4 GB that its header can state.
///
/// # Example: a sphere comes back
/// ```
/// use containers::{GlbText, read_gltf, write_glb};
/// let sphere = mesh::shape("sphere").unwrap();
/// let file = write_glb(&sphere, &[], GlbText::default())?;
/// let read = read_gltf::<containers::Error>(&file, &mut |_| unreachable!())?.mesh;
/// assert_eq!((read.positions(), read.triangles()), (sphere.positions(), sphere.triangles()));
/// # Ok::<(), containers::Error>(())
/// ```
pub fn write_glb(mesh: &Mesh, attributes: &[VertexAttribute], text: GlbText<'_>) -> Result<Vec<u8>, Error> {
    check(mesh, attributes, text.recipe)?;
    let mut file = GltfFile::default();
    let positions: Vec<[f32; 3]> = mesh.positions().iter().map(|place| turned(*place)).collect();
    let tangent = |&[x, y, z, w]: &[f32; 4]| {
        let [x, y, z] = turned([x, y, z]);
        [x, y, z, w]
    };
    let tangents: Vec<[f32; 4]> = mesh.tangents().iter().map(tangent).collect();
    let normals: Vec<[f32; 3]> = mesh.normals().iter().map(|normal| turned(*normal)).collect();
    file.attribute("POSITION", 3, positions.as_flattened());
    file.bounds(&positions);
    file.attribute("NORMAL", 3, normals.as_flattened());
    file.attribute("TANGENT", 4, tangents.as_flattened());
    if let Some(coordinates) = mesh.coordinates() {
        file.attribute("TEXCOORD_0", 2, coordinates.as_flattened());
    }
    for VertexAttribute { name, width, values } in attributes {
        file.attribute(name, *width, values);
    }
    let indices = file.indices(mesh.triangles());
    file.container(indices, text)
}

/// Refuses what cannot be written: numbers that are not those of the mesh's vertices, or not finite; a mesh
/// without triangles; a recipe that is not a line of JSON.
pub(super) fn check(mesh: &Mesh, attributes: &[VertexAttribute], recipe: Option<&str>) -> Result<(), Error> {
    recipe::check(recipe).map_err(|error| error.within("glTF"))?;
    if recipe.is_some_and(|recipe| serde_json::from_str::<&RawValue>(recipe).is_err()) {
        return Err(unwritable("the recipe is not JSON".into()));
    }
    if mesh.triangles().is_empty() {
        return Err(unwritable("a mesh without triangles cannot be written".into()));
    }
    let vertices = mesh.positions().len();
    for VertexAttribute { name, width, values } in attributes {
        if !(1..=4).contains(width) || values.len() != vertices * width {
            let length = values.len();
            return Err(unwritable(format!(
                "{name}: {length} numbers, {width} each, for {vertices} vertices"
            )));
        }
        if let Some(at) = values.iter().position(|value| !value.is_finite()) {
            return Err(unwritable(format!("{name}: a number of vertex {} is not finite", at / width)));
        }
    }
    Ok(())
}

pub(super) fn unwritable(message: String) -> Error {
    Error::new(ErrorKind::Unwritable, message).within("glTF")
}

/// The view of a part of the only buffer.
pub(super) fn view(offset: usize, length: usize, target: Option<u32>) -> Value {
    let mut view = json!({ "buffer": 0, "byteOffset": offset, "byteLength": length });
    if let Some(target) = target {
        view["target"] = target.into();
    }
    view
}

/// The accessor of an attribute of 32-bit floats that has a view of its own.
pub(super) fn float_accessor(view: usize, width: usize, vertices: usize) -> Value {
    let kind = ["SCALAR", "VEC2", "VEC3", "VEC4"][width - 1];
    json!({ "bufferView": view, "componentType": FLOAT, "count": vertices, "type": kind })
}

/// A vector in the file's frame.
fn turned(vector: [f32; 3]) -> [f32; 3] {
    sphere::to_file(DVec3::from(vector.map(f64::from))).as_vec3().to_array()
}

/// A file in the making.
#[derive(Default)]
struct GltfFile {
    attributes: Map<String, Value>,
    accessors: Vec<Value>,
    views: Vec<Value>,
    bytes: Vec<u8>,
}

impl GltfFile {
    /// The view of the bytes that are written next.
    fn view(&mut self, length: usize, target: u32) -> usize {
        self.views.push(view(self.bytes.len(), length, Some(target)));
        self.views.len() - 1
    }

    fn attribute(&mut self, name: &str, width: usize, values: &[f32]) {
        let view = self.view(size_of_val(values), ARRAY_BUFFER);
        self.bytes.extend(values.iter().flat_map(|value| value.to_le_bytes()));
        self.attributes.insert(name.to_owned(), self.accessors.len().into());
        self.accessors.push(float_accessor(view, width, values.len() / width));
    }

    /// The range of the last accessor, which the specification wants of positions.
    fn bounds(&mut self, positions: &[[f32; 3]]) {
        let extreme = |pick: fn(f32, f32) -> f32, start: f32| -> Vec<f64> {
            let fold = |axis: usize| positions.iter().fold(start, |most, place| pick(most, place[axis]));
            [0, 1, 2].map(|axis| f64::from(fold(axis))).to_vec()
        };
        if let Some(accessor) = self.accessors.last_mut() {
            accessor["min"] = extreme(f32::min, f32::INFINITY).into();
            accessor["max"] = extreme(f32::max, f32::NEG_INFINITY).into();
        }
    }

    /// The accessor of the indices.
    fn indices(&mut self, triangles: &[[u32; 3]]) -> usize {
        let view = self.view(size_of_val(triangles), ELEMENT_ARRAY_BUFFER);
        self.bytes.extend(triangles.as_flattened().iter().flat_map(|corner| corner.to_le_bytes()));
        self.accessors.push(json!({
            "bufferView": view,
            "componentType": UNSIGNED_INT,
            "count": 3 * triangles.len(),
            "type": "SCALAR"
        }));
        self.accessors.len() - 1
    }

    fn container(self, indices: usize, text: GlbText<'_>) -> Result<Vec<u8>, Error> {
        // Metal without light is black, which is what a material without these numbers is.
        let matte = json!({ "metallicFactor": 0.0, "roughnessFactor": 1.0 });
        let (material, used) = match text.unlit {
            true => (
                json!({ "pbrMetallicRoughness": matte, "extensions": { "KHR_materials_unlit": {} } }),
                vec!["KHR_materials_unlit"],
            ),
            false => (json!({ "pbrMetallicRoughness": matte }), Vec::new()),
        };
        let mut mesh = json!({
            "primitives": [{ "attributes": self.attributes, "indices": indices, "material": 0, "mode": 4 }]
        });
        if !text.extras.is_empty() {
            mesh["extras"] = text.extras.iter().map(|&(key, value)| (key, value)).collect();
        }
        let asset = match text.recipe {
            // As it is given, byte for byte.
            Some(recipe) => {
                format!(r#"{{"extras":{{"{KEY}":{recipe}}},"generator":"Specula","version":"2.0"}}"#)
            }
            None => r#"{"generator":"Specula","version":"2.0"}"#.into(),
        };
        let mut members = vec![
            ("accessors", Value::from(self.accessors)),
            ("bufferViews", self.views.into()),
            ("buffers", json!([{ "byteLength": self.bytes.len() }])),
            ("materials", json!([material])),
            ("meshes", json!([mesh])),
            ("nodes", json!([{ "mesh": 0 }])),
            ("scene", 0.into()),
            ("scenes", json!([{ "nodes": [0] }])),
        ];
        if !used.is_empty() {
            members.push(("extensionsUsed", used.into()));
        }
        let members: Vec<String> =
            members.iter().map(|(name, value)| format!("{}:{value}", json!(name))).collect();
        let json = format!("{{\"asset\":{asset},{}}}", members.join(","));
        container(json.into_bytes(), &self.bytes)
    }
}

/// A binary glTF of its JSON and its bytes, which are a multiple of four (section 4.4).
pub(super) fn container(mut json: Vec<u8>, bytes: &[u8]) -> Result<Vec<u8>, Error> {
    json.resize(json.len().next_multiple_of(4), b' ');
    let word = |length: usize| {
        let word = u32::try_from(length)
            .map_err(|_| unwritable(format!("{length} bytes are more than a binary glTF can hold")));
        word.map(u32::to_le_bytes)
    };
    let length = 12 + 8 + json.len() + 8 + bytes.len();
    let mut file = Vec::with_capacity(length);
    file.extend(b"glTF");
    file.extend(2_u32.to_le_bytes());
    file.extend(word(length)?);
    for (kind, chunk) in [(b"JSON", json.as_slice()), (b"BIN\0", bytes)] {
        file.extend(word(chunk.len())?);
        file.extend(kind);
        file.extend(chunk);
    }
    Ok(file)
}

/// Whether bytes are a binary glTF.
pub(crate) fn is_glb(bytes: &[u8]) -> bool {
    bytes.starts_with(b"glTF")
}

/// The recipe of a glTF, binary or not.
pub(crate) fn read_recipe(bytes: &[u8]) -> Option<String> {
    #[derive(Deserialize)]
    struct Root<'a> {
        #[serde(borrow)]
        asset: Asset<'a>,
    }
    #[derive(Deserialize)]
    struct Asset<'a> {
        #[serde(borrow)]
        extras: Extras<'a>,
    }
    #[derive(Deserialize)]
    struct Extras<'a> {
        #[serde(borrow)]
        specula: &'a RawValue,
    }
    let json = if is_glb(bytes) { document::chunks(bytes).ok()?.0 } else { bytes };
    serde_json::from_slice::<Root<'_>>(json).ok().map(|root| root.asset.extras.specula.get().to_owned())
}
