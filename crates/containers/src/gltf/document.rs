//! The JSON of a glTF file, as much of it as meshes need, and the two chunks of a binary one.

use std::collections::BTreeMap;

use serde::Deserialize;
use serde::de::IgnoredAny;

use crate::error::{Error, ErrorKind};
use crate::format::refuse_non_files;

pub(super) const TRIANGLES: u32 = 4;
pub(super) const STRIP: u32 = 5;
pub(super) const FAN: u32 = 6;

/// Extensions whose need does not touch meshes, or that are read.
const HARMLESS: [&str; 8] = [
    "KHR_mesh_quantization",
    "KHR_materials_",
    "KHR_texture_",
    "KHR_lights_",
    "KHR_xmp",
    "EXT_texture_",
    "EXT_lights_",
    "MSFT_texture_dds",
];

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Document {
    asset: Asset,
    #[serde(default)]
    extensions_required: Vec<String>,
    pub(super) scene: Option<usize>,
    #[serde(default)]
    pub(super) scenes: Vec<Scene>,
    #[serde(default)]
    pub(super) nodes: Vec<Node>,
    #[serde(default)]
    pub(super) meshes: Vec<MeshPrimitives>,
    #[serde(default)]
    pub(super) accessors: Vec<Accessor>,
    #[serde(default)]
    pub(super) buffer_views: Vec<BufferView>,
    #[serde(default)]
    pub(super) buffers: Vec<Buffer>,
    #[serde(default)]
    pub(super) materials: Vec<Material>,
    #[serde(default)]
    pub(super) skins: Vec<Skin>,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
struct Asset {
    version: String,
    min_version: Option<String>,
}

#[derive(Debug, Deserialize)]
pub(super) struct Scene {
    #[serde(default)]
    pub(super) nodes: Vec<usize>,
}

#[derive(Debug, Deserialize)]
pub(super) struct Node {
    #[serde(default)]
    pub(super) children: Vec<usize>,
    pub(super) mesh: Option<usize>,
    pub(super) skin: Option<usize>,
    pub(super) matrix: Option<[f64; 16]>,
    pub(super) translation: Option<[f64; 3]>,
    pub(super) rotation: Option<[f64; 4]>,
    pub(super) scale: Option<[f64; 3]>,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Skin {
    pub(super) inverse_bind_matrices: Option<usize>,
    pub(super) joints: Vec<usize>,
}

#[derive(Debug, Deserialize)]
pub(super) struct MeshPrimitives {
    #[serde(default)]
    pub(super) primitives: Vec<Primitive>,
}

#[derive(Debug, Deserialize)]
pub(super) struct Primitive {
    #[serde(default)]
    pub(super) attributes: BTreeMap<String, usize>,
    pub(super) indices: Option<usize>,
    pub(super) material: Option<usize>,
    #[serde(default = "triangles")]
    pub(super) mode: u32,
    #[serde(default)]
    pub(super) targets: Vec<IgnoredAny>,
}

fn triangles() -> u32 {
    TRIANGLES
}

impl Primitive {
    /// Whether it has triangles; else it is points or lines.
    pub(super) fn has_triangles(&self) -> bool {
        [TRIANGLES, STRIP, FAN].contains(&self.mode)
    }
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Material {
    normal_texture: Option<Texture>,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
struct Texture {
    #[serde(default)]
    tex_coord: usize,
}

impl Material {
    /// The set of coordinates that tangents are made of, where it is named.
    pub(super) fn tangent_set(&self) -> Option<usize> {
        self.normal_texture.as_ref().map(|texture| texture.tex_coord)
    }
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Accessor {
    pub(super) buffer_view: Option<usize>,
    #[serde(default)]
    pub(super) byte_offset: usize,
    pub(super) component_type: u32,
    #[serde(default)]
    pub(super) normalized: bool,
    pub(super) count: usize,
    #[serde(rename = "type")]
    pub(super) shape: String,
    pub(super) sparse: Option<Sparse>,
}

#[derive(Debug, Deserialize)]
pub(super) struct Sparse {
    pub(super) count: usize,
    pub(super) indices: SparseIndices,
    pub(super) values: SparseValues,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct SparseIndices {
    pub(super) buffer_view: usize,
    #[serde(default)]
    pub(super) byte_offset: usize,
    pub(super) component_type: u32,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct SparseValues {
    pub(super) buffer_view: usize,
    #[serde(default)]
    pub(super) byte_offset: usize,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct BufferView {
    pub(super) buffer: usize,
    #[serde(default)]
    pub(super) byte_offset: usize,
    pub(super) byte_length: usize,
    pub(super) byte_stride: Option<usize>,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Buffer {
    pub(super) uri: Option<String>,
    pub(super) byte_length: usize,
}

/// The document of a file, and the second chunk of a binary one.
pub(super) fn open(bytes: &[u8]) -> Result<(Document, Option<&[u8]>), Error> {
    refuse_non_files(bytes)?;
    let (json, chunk) = match bytes.starts_with(b"glTF") {
        true => chunks(bytes)?,
        false => (bytes, None),
    };
    let text = json.strip_prefix(b"\xef\xbb\xbf").unwrap_or(json);
    if !text.trim_ascii_start().starts_with(b"{") {
        return Err(Error::new(
            ErrorKind::UnknownFormat,
            "this is no glTF file: it is neither JSON nor does it begin with the letters glTF",
        ));
    }
    let document: Document = serde_json::from_slice(text)
        .map_err(|error| Error::damaged(format!("the JSON is not that of glTF 2.0: {error}")))?;
    let Asset { version, min_version } = &document.asset;
    let needed = min_version.as_ref().unwrap_or(version);
    if needed.split('.').next() != Some("2") || min_version.as_ref().is_some_and(|least| least != "2.0") {
        return Err(Error::unsupported(format!("the file is of glTF {needed}; 2.0 is read")));
    }
    let is_read = |name: &&String| HARMLESS.iter().any(|harmless| name.starts_with(harmless));
    let missing: Vec<&String> = document.extensions_required.iter().filter(|name| !is_read(name)).collect();
    match missing.is_empty() {
        true => Ok((document, chunk)),
        false => {
            let names: Vec<_> = missing.into_iter().map(String::as_str).collect();
            Err(Error::unsupported(format!(
                "the file needs {}, which is not read here; export it without (compression of meshes switched off)",
                names.join(", ")
            )))
        }
    }
}

/// The JSON and the binary chunk of a `.glb` (section 4.4).
fn chunks(bytes: &[u8]) -> Result<(&[u8], Option<&[u8]>), Error> {
    let word = |at: usize| {
        let word = bytes.get(at..at + 4).and_then(|word| word.try_into().ok()).map(u32::from_le_bytes);
        word.ok_or_else(|| {
            Error::truncated(format!("the file ends at byte {}, within a header", bytes.len()))
        })
    };
    let version = word(4)?;
    if version != 2 {
        return Err(Error::unsupported(format!("the file is of binary glTF {version}; 2 is read")));
    }
    let length = word(8)? as usize;
    if length > bytes.len() {
        return Err(Error::truncated(format!(
            "the header tells of {length} bytes, and there are {}",
            bytes.len()
        )));
    }
    let (mut json, mut binary, mut at) = (None, None, 12);
    while at < length {
        let (size, kind) = (word(at)? as usize, word(at + 4)?.to_le_bytes());
        let chunk =
            bytes.get(..length).and_then(|bytes| bytes.get(at + 8..)?.get(..size)).ok_or_else(|| {
                Error::truncated(format!("the chunk at byte {at} tells of {size} bytes, more than there are"))
            })?;
        match (&kind, json) {
            (b"JSON", None) => json = Some(chunk),
            (b"BIN\0", Some(_)) if binary.is_none() => binary = Some(chunk),
            // Chunks of other kinds are to be ignored.
            (_, Some(_)) => {}
            (_, None) => return Err(Error::damaged("the first chunk is not JSON")),
        }
        at += 8 + size;
    }
    let json = json.ok_or_else(|| Error::damaged("there is no chunk of JSON"))?;
    Ok((json, binary))
}
