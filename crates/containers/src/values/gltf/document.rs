//! The JSON of a glTF file, as much of it as meshes need, and the two chunks of a binary one.

use std::io::{Read, Seek};
use std::ops::Range;

use gltf::json::mesh::{Mode, Primitive, Semantic};
use gltf::json::validation::{Checked, Error as Flaw, Validate};
use gltf::json::{Accessor, Path, Root};
use serde_json::{Map, Value, json};

use super::extensions::check_for_meshes;
use crate::error::{Error, ErrorKind};
use crate::file_part::{beginning, bytes_at, length};
use crate::format::refuse_non_files;

/// Parts of a document that meshes do not need. A mistake there does not matter.
const UNUSED: [&str; 7] = ["animations", "cameras", "extensions", "extras", "images", "samplers", "textures"];

/// The set of colours that an attribute becomes which is read by its name: whatever that is, the `gltf` crate
/// takes it for one that it knows.
pub(super) const NAMED: u32 = 4096;

/// Mistakes that are listed in a message.
const LISTED: usize = 5;

/// A document whose references all lead somewhere.
pub(super) struct Document {
    pub(super) root: Root,
    /// The names of the materials; for one without a name, its number.
    pub(super) materials: Vec<String>,
    /// For each material, the set of texture coordinates of its normal texture, if it has one.
    pub(super) normal_sets: Vec<Option<u32>>,
    /// For each material, whether its normal texture is turned or mirrored by KHR_texture_transform.
    pub(super) turned_normals: Vec<bool>,
}

impl Document {
    /// The accessor of an attribute of a primitive.
    pub(super) fn attribute(primitive: &Primitive, semantic: Semantic) -> Option<usize> {
        primitive.attributes.get(&Checked::Valid(semantic)).map(|index| index.value())
    }

    /// How the triangles of a primitive are listed; `None` for points and lines.
    pub(super) fn triangle_mode(primitive: &Primitive) -> Option<Mode> {
        match primitive.mode {
            Checked::Valid(mode @ (Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan)) => Some(mode),
            _ => None,
        }
    }

    /// An accessor and how many elements it has.
    pub(super) fn accessor(&self, index: usize) -> Result<(&Accessor, usize), Error> {
        let accessor = self.root.accessors.get(index);
        let accessor = accessor.ok_or_else(|| Error::damaged(format!("there is no accessor {index}")))?;
        Ok((accessor, size(accessor.count.0)))
    }
}

/// A number of the document in memory; one that is too large is larger than all that is there.
pub(super) fn size(number: u64) -> usize {
    usize::try_from(number).unwrap_or(usize::MAX)
}

/// The JSON of a file, and the second chunk of a binary one.
pub(super) struct Chunks<'a> {
    pub(super) json: Map<String, Value>,
    pub(super) binary: Option<&'a [u8]>,
}

/// The JSON of a file, and whether it has a binary chunk, which is not read.
pub(super) fn read_json(file: &mut (impl Read + Seek)) -> Result<(Map<String, Value>, bool), Error> {
    /// As many bytes as tell a Git LFS pointer from a file.
    const SIGNATURE: u64 = 64;
    let length = length(file)?;
    let start = beginning(file, SIGNATURE)?;
    refuse_non_files(&start)?;
    if !start.starts_with(b"glTF") {
        return Ok((parse(&beginning(file, u64::MAX)?)?, false));
    }
    let (json, binary) = chunk_places(length, |at| {
        let [a, b, c, d, ..] = bytes_at(file, at, 4)?;
        Some(u32::from_le_bytes([a, b, c, d]))
    })?;
    let bytes = beginning(file, json.end as u64)?;
    Ok((parse(bytes.get(json).unwrap_or_default())?, binary.is_some()))
}

/// The chunks of a file; the JSON may be anything.
pub(super) fn read(bytes: &[u8]) -> Result<Chunks<'_>, Error> {
    refuse_non_files(bytes)?;
    let (json, binary) = match bytes.starts_with(b"glTF") {
        true => chunks(bytes)?,
        false => (bytes, None),
    };
    Ok(Chunks { json: parse(json)?, binary })
}

fn parse(json: &[u8]) -> Result<Map<String, Value>, Error> {
    let text = json.strip_prefix(b"\xef\xbb\xbf").unwrap_or(json);
    if !text.trim_ascii_start().starts_with(b"{") {
        return Err(Error::new(
            ErrorKind::UnknownFormat,
            "this is not a glTF file: it is not JSON, and does not begin with the letters glTF",
        ));
    }
    serde_json::from_slice(text).map_err(|error| {
        let line = text.split(|byte| *byte == b'\n').nth(error.line().saturating_sub(1)).unwrap_or_default();
        let rest = line.get(error.column().saturating_sub(2)..).unwrap_or_default();
        let word = String::from_utf8_lossy(&rest[..rest.len().min(10)]);
        let is_number = ["NaN", "Infinity"].iter().any(|known| word.contains(known));
        let error = not_gltf(error);
        if is_number { Error::damaged(format!("{error}; JSON has no NaN and no Infinity")) } else { error }
    })
}

fn not_gltf(error: serde_json::Error) -> Error {
    Error::damaged(format!("the JSON is not that of glTF 2.0: {error}"))
}

/// The document of a file, and the second chunk of a binary one. An attribute of vertices that is wanted
/// becomes the set of colours [`NAMED`].
pub(super) fn open<'a>(
    bytes: &'a [u8],
    attribute: Option<&str>,
) -> Result<(Document, Option<&'a [u8]>), Error> {
    let Chunks { json, binary } = read(bytes)?;
    Ok((of_json(json, attribute)?, binary))
}

/// The document of a file's JSON.
pub(super) fn of_json(mut parts: Map<String, Value>, attribute: Option<&str>) -> Result<Document, Error> {
    let materials = elements(&mut parts, "materials").enumerate().map(|(index, material)| {
        let name = material.get("name").and_then(Value::as_str);
        name.map_or_else(|| index.to_string(), str::to_owned)
    });
    let materials = materials.collect();
    let (normal_sets, turned_normals) = keep_meshes(&mut parts, attribute);
    let root: Root = serde_json::from_value(Value::Object(parts)).map_err(not_gltf)?;
    let (version, least) = (&root.asset.version, root.asset.min_version.as_ref());
    check_version(version, least.map(String::as_str))?;
    check_for_meshes(&root.extensions_required)?;
    validate(&root)?;
    Ok(Document { root, materials, normal_sets, turned_normals })
}

/// Refuses a file of another version, or one that needs a later version.
pub(super) fn check_version(version: &str, least: Option<&str>) -> Result<(), Error> {
    let needed = least.unwrap_or(version);
    if needed.split('.').next() != Some("2") || least.is_some_and(|least| least != "2.0") {
        return Err(Error::unsupported(format!("the file is of glTF {needed}; 2.0 is read")));
    }
    Ok(())
}

/// Removes what meshes do not need, and what the `gltf` crate refuses although the specification allows it.
/// Gives the sets of coordinates of the materials' normal textures, and whether these are turned.
fn keep_meshes(parts: &mut Map<String, Value>, attribute: Option<&str>) -> (Vec<Option<u32>>, Vec<bool>) {
    UNUSED.iter().for_each(|part| drop(parts.remove(*part)));
    let (mut normal_sets, mut turned_normals) = (Vec::new(), Vec::new());
    for material in elements(parts, "materials") {
        let texture = material.get("normalTexture");
        let transform = texture.and_then(|texture| texture.pointer("/extensions/KHR_texture_transform"));
        let set = |texture: &Value| texture.get("texCoord").and_then(Value::as_u64);
        let set = |texture: &Value| transform.and_then(set).or_else(|| set(texture)).unwrap_or(0) as u32;
        normal_sets.push(texture.map(set));
        let scale = transform.and_then(|transform| transform.get("scale")).and_then(Value::as_array);
        let is_negative = |value: &Value| value.as_f64().is_some_and(|value| value < 0.0);
        let rotation = transform.and_then(|transform| transform.get("rotation")).and_then(Value::as_f64);
        let is_turned = rotation.is_some_and(|rotation| rotation != 0.0)
            || scale.is_some_and(|scale| scale.iter().any(is_negative));
        turned_normals.push(is_turned);
        *material = json!({});
    }
    for part in ["accessors", "buffers", "bufferViews", "meshes", "nodes", "scenes", "skins"] {
        for element in elements(parts, part) {
            let Value::Object(element) = element else { continue };
            element.remove("extras");
            element.remove("camera");
            if let Some(extensions) = element.get_mut("extensions").and_then(Value::as_object_mut) {
                // The lights themselves are removed above.
                extensions.remove("KHR_lights_punctual");
            }
            if part == "scenes" {
                element.entry("nodes").or_insert_with(|| json!([]));
            }
            for primitive in elements(element, "primitives") {
                if let Value::Object(primitive) = primitive {
                    primitive.remove("extras");
                    if let Some(attributes) = primitive.get_mut("attributes").and_then(Value::as_object_mut)
                        && let Some(accessor) = attribute.and_then(|name| attributes.get(name)).cloned()
                    {
                        attributes.insert(format!("COLOR_{NAMED}"), accessor);
                    }
                }
            }
        }
    }
    (normal_sets, turned_normals)
}

/// The elements of an array in an object; none if there is no such array.
fn elements<'a>(
    object: &'a mut Map<String, Value>,
    key: &str,
) -> impl Iterator<Item = &'a mut Value> + use<'a> {
    object.get_mut(key).and_then(Value::as_array_mut).into_iter().flatten()
}

/// Lets the `gltf` crate check the document. What it asks for beside what meshes need (the range of
/// positions, names of attributes) is not asked here; `byteStride` is checked when it is used.
fn validate(root: &Root) -> Result<(), Error> {
    let mut mistakes = Vec::new();
    // The crate looks these up without asking whether they are there.
    for (m, mesh) in root.meshes.iter().enumerate() {
        for (p, primitive) in mesh.primitives.iter().enumerate() {
            let positions = Document::attribute(primitive, Semantic::Positions);
            if positions.is_some_and(|positions| positions >= root.accessors.len()) {
                let path = format!("meshes[{m}].primitives[{p}].attributes[\"POSITION\"]");
                mistakes.push(describe(&path, Flaw::IndexOutOfBounds));
            }
        }
    }
    if mistakes.is_empty() {
        root.validate(root, Path::new, &mut |path, flaw| {
            let Path(path) = path();
            let unused = ["min", "max", "byteStride", "target"].iter().any(|key| path.ends_with(key));
            let named = path.contains("<invalid semantic name>") && flaw == Flaw::Invalid;
            if !(unused || named || matches!(flaw, Flaw::Missing | Flaw::Unsupported)) {
                mistakes.push(describe(&path, flaw));
            }
        });
    }
    match mistakes.len() {
        0 => Ok(()),
        count => {
            let more = count.saturating_sub(LISTED);
            mistakes.truncate(LISTED);
            let more = if more > 0 { format!("; and {more} more") } else { String::new() };
            Err(Error::damaged(mistakes.join("; ") + &more))
        }
    }
}

fn describe(path: &str, flaw: Flaw) -> String {
    let what = match flaw {
        Flaw::IndexOutOfBounds => "there is nothing of this index",
        Flaw::Oversize => "the number is too large",
        _ => "the value is not one that glTF allows",
    };
    format!("{path}: {what}")
}

/// The JSON and the binary chunk of a `.glb`.
pub(super) fn chunks(bytes: &[u8]) -> Result<(&[u8], Option<&[u8]>), Error> {
    let (json, binary) = chunk_places(bytes.len(), |at| {
        let word = bytes.get(at..at.checked_add(4)?)?.try_into().ok()?;
        Some(u32::from_le_bytes(word))
    })?;
    Ok((&bytes[json], binary.map(|binary| &bytes[binary])))
}

/// The places of the JSON and of the binary chunk of a `.glb` of some length (section 4.4); `word_at` gives
/// four of its bytes.
fn chunk_places(
    file_length: usize,
    mut word_at: impl FnMut(usize) -> Option<u32>,
) -> Result<(Range<usize>, Option<Range<usize>>), Error> {
    let mut word = |at: usize| {
        word_at(at)
            .ok_or_else(|| Error::truncated(format!("the file ends at byte {file_length}, within a header")))
    };
    let version = word(4)?;
    if version != 2 {
        return Err(Error::unsupported(format!("the file is of binary glTF {version}; 2 is read")));
    }
    let length = word(8)? as usize;
    if length > file_length {
        return Err(Error::truncated(format!(
            "the header declares {length} bytes, and there are {file_length}"
        )));
    }
    let (mut json, mut binary, mut at) = (None, None, 12);
    while at < length {
        let (size, kind) = (word(at)? as usize, word(at + 4)?.to_le_bytes());
        let chunk = at + 8..at.saturating_add(8).saturating_add(size);
        if chunk.end > length {
            return Err(Error::truncated(format!(
                "the chunk at byte {at} declares {size} bytes, more than there are"
            )));
        }
        at = chunk.end;
        match (&kind, &json) {
            (b"JSON", None) => json = Some(chunk),
            (b"BIN\0", Some(_)) if binary.is_none() => binary = Some(chunk),
            // Chunks of other kinds are ignored.
            (_, Some(_)) => {}
            (_, None) => return Err(Error::damaged("the first chunk is not JSON")),
        }
    }
    let json = json.ok_or_else(|| Error::damaged("there is no chunk of JSON"))?;
    Ok((json, binary))
}
