//! Writing numbers of one's own at the vertices of a glTF file's own primitives.
//!
//! The rest of the document passes through as it is: what has no new numbers is copied as text. The result is
//! one binary file, so its buffers become one, and pictures in files beside it become parts of that buffer.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use ::mesh::Mesh;
use serde::de::DeserializeOwned;
use serde_json::value::{RawValue, to_raw_value};
use serde_json::{Map, Value};

use super::buffers::{Buffers, COMPRESSIONS, find_beside};
use super::write::{
    ARRAY_BUFFER, GlbText, VertexAttribute, check, container, float_accessor, unwritable, view,
};
use super::{PlacedPrimitive, ReadBeside, document, read_with};
use crate::error::{Error, ErrorKind};
use crate::recipe::KEY;

/// A glTF file with more numbers at its vertices.
#[derive(Clone, Debug, PartialEq)]
pub struct AssetFile {
    /// The bytes of the file, a `.glb`.
    pub bytes: Vec<u8>,
    /// Notes of what became of the asset.
    pub notes: Vec<String>,
    /// Warnings of numbers that the asset's vertices cannot hold as they are.
    pub warnings: Vec<String>,
    /// The number of the asset's vertices that are several of the mesh, and have the mean of different
    /// numbers.
    pub means: usize,
}

/// Numbers whose distance is less than this share of the attribute's largest are the same.
const SAME: f32 = 1e-6;

/// An object whose members are copied as text.
type Object = BTreeMap<String, Box<RawValue>>;

/// Writes a `.glb` of another glTF file, `.gltf` or `.glb`, with attributes at its own vertices. `mesh` is
/// what [`read_gltf`](super::read_gltf) makes of the file, and has as many vertices as the attributes.
///
/// Everything else of the file stays: nodes, names, materials, textures, animations, skins, extensions and
/// extras. Its numbers stay byte for byte. Further buffers are appended to the first, and files of buffers
/// and pictures beside the file, which `read` gives, become part of it.
///
/// A vertex of the file may be several of the mesh: a corner of each triangle if the file has no normals, or
/// one for each tangent that is made. It gets their mean, and a warning says how far they are from it. A
/// vertex of which the mesh has none gets zeros. If several nodes show one mesh, each after the first shows a
/// copy of it, of the same positions and with numbers of its own. `text.unlit` does not matter: the materials
/// are those of the file.
///
/// # Errors
/// The errors of [`read_gltf`](super::read_gltf) and [`write_glb`](super::write_glb); if the file holds
/// another mesh; if a node shows several instances of its mesh (`EXT_mesh_gpu_instancing`), whose vertices
/// cannot differ; if a picture beside the file is in a format that glTF does not know.
pub fn write_into_gltf<E: From<Error>>(
    bytes: &[u8],
    mesh: &Mesh,
    attributes: &[VertexAttribute],
    text: GlbText<'_>,
    read: &mut ReadBeside<'_, E>,
) -> Result<AssetFile, E> {
    check(mesh, attributes, text.recipe)?;
    let scene = read_with(bytes, None, read)?;
    let there = &scene.model.mesh;
    if there.positions() != mesh.positions() || there.triangles() != mesh.triangles() {
        let [found, expected] = [there, mesh].map(|mesh| mesh.positions().len());
        let counts = format!("it has {found} vertices, and the mesh {expected}");
        let message =
            format!("the file holds another mesh ({counts}); name the one that the mesh was read from");
        return Err(unwritable(message).into());
    }
    if let Some(placed) = scene.primitives.iter().find(|placed| placed.is_instance) {
        let message = "EXT_mesh_gpu_instancing shows one mesh at several places, and each would need numbers \
                       of its own; export the file without instances";
        return Err(Error::unsupported(message).within(format!("nodes[{}]", placed.node)).into());
    }
    let (document, chunk) = document::open(bytes, None)?;
    let buffers = Buffers::load_all(&document, chunk, read)?;
    let json = if bytes.starts_with(b"glTF") { document::chunks(bytes)?.0 } else { bytes };
    let mut asset = Asset::new(json.strip_prefix(b"\xef\xbb\xbf").unwrap_or(json))?;
    asset.join_buffers(&buffers)?;
    asset.embed_images(read)?;
    asset.add(&scene.primitives, attributes, text.extras)?;
    Ok(asset.file(text.recipe)?)
}

/// A document in the making.
struct Asset {
    members: Object,
    buffers: Vec<Object>,
    views: Vec<Box<RawValue>>,
    bytes: Vec<u8>,
    notes: Vec<String>,
    warnings: Vec<String>,
    means: usize,
}

impl Asset {
    fn new(json: &[u8]) -> Result<Self, Error> {
        let mut members: Object = parsed(serde_json::from_slice(json))?;
        let (buffers, views) = (taken(&mut members, "buffers")?, taken(&mut members, "bufferViews")?);
        let (bytes, notes, warnings) = (Vec::new(), Vec::new(), Vec::new());
        Ok(Self { members, buffers, views, bytes, notes, warnings, means: 0 })
    }

    /// Appends bytes, and gives the place where they begin: at a multiple of four, as every number needs it.
    fn append(&mut self, bytes: &[u8]) -> usize {
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        let start = self.bytes.len();
        self.bytes.extend(bytes);
        start
    }

    /// Adds a view of bytes that are appended.
    fn add_view(&mut self, bytes: &[u8], target: Option<u32>) -> Result<usize, Error> {
        let start = self.append(bytes);
        self.views.push(raw(&view(start, bytes.len(), target))?);
        Ok(self.views.len() - 1)
    }

    /// Makes one buffer of all those that have bytes.
    fn join_buffers(&mut self, buffers: &Buffers<'_>) -> Result<(), Error> {
        // Where the bytes of each buffer are now: the buffer, and its first byte there.
        let mut moved = Vec::new();
        let mut joined = Object::new();
        let mut without_bytes = Vec::new();
        for (index, mut buffer) in std::mem::take(&mut self.buffers).into_iter().enumerate() {
            match buffers.whole(index) {
                Some(bytes) => {
                    moved.push((0, self.append(bytes)));
                    buffer.remove("uri");
                    if index == 0 {
                        joined = buffer;
                    }
                }
                None => {
                    without_bytes.push(buffer);
                    moved.push((without_bytes.len(), 0));
                }
            }
        }
        if moved.len() > without_bytes.len() + 1 {
            let count = moved.len() - without_bytes.len();
            self.notes.push(format!("{count} buffers of the asset become one"));
        }
        self.buffers = [vec![joined], without_bytes].concat();
        for raw_view in &mut self.views {
            let mut view: Map<String, Value> = parsed(serde_json::from_str(raw_view.get()))?;
            let mut is_moved = move_place(&mut view, &moved);
            for name in COMPRESSIONS {
                let extension = view.get_mut("extensions").and_then(|extensions| extensions.get_mut(name));
                if let Some(extension) = extension.and_then(Value::as_object_mut) {
                    is_moved |= move_place(extension, &moved);
                }
            }
            if is_moved {
                *raw_view = raw(&view)?;
            }
        }
        Ok(())
    }

    /// Takes the pictures in files beside the document into the buffer.
    fn embed_images<E: From<Error>>(&mut self, read: &mut ReadBeside<'_, E>) -> Result<(), E> {
        let mut images: Vec<Box<RawValue>> = taken(&mut self.members, "images")?;
        let mut embedded = BTreeMap::new();
        for (index, raw_image) in images.iter_mut().enumerate() {
            let mut image: Map<String, Value> = parsed(serde_json::from_str(raw_image.get()))?;
            let Some(uri) = image.get("uri").and_then(Value::as_str).filter(|uri| !uri.starts_with("data:"))
            else {
                continue;
            };
            let here = |error: Error| error.within(format!("images[{index}]"));
            let (view, mime) = match embedded.get(uri) {
                Some(&known) => known,
                None => {
                    let (bytes, path): (Arc<Vec<u8>>, String) = find_beside(uri, &here, read)?;
                    let unknown = || {
                        let message = format!("{path} is not PNG, JPEG, WebP, KTX2 or DDS");
                        here(Error::new(ErrorKind::UnknownFormat, message))
                    };
                    let mime = mime_type(&bytes).ok_or_else(unknown)?;
                    let view = self.add_view(&bytes, None)?;
                    embedded.insert(uri.to_owned(), (view, mime));
                    (view, mime)
                }
            };
            image.remove("uri");
            image.insert("bufferView".into(), view.into());
            image.entry("mimeType").or_insert_with(|| mime.into());
            *raw_image = raw(&image)?;
        }
        match embedded.len() {
            0 => {}
            1 => self.notes.push("1 picture beside the asset becomes part of the file".into()),
            count => self.notes.push(format!("{count} pictures beside the asset become part of the file")),
        }
        self.put("images", &images)?;
        Ok(())
    }

    /// Adds attributes to the primitives that the mesh was made of.
    fn add(
        &mut self,
        primitives: &[PlacedPrimitive],
        attributes: &[VertexAttribute],
        extras: &[(&str, &str)],
    ) -> Result<(), Error> {
        let mut accessors: Vec<Box<RawValue>> = taken(&mut self.members, "accessors")?;
        let mut nodes: Vec<Box<RawValue>> = taken(&mut self.members, "nodes")?;
        let mut meshes: Vec<Box<RawValue>> = taken(&mut self.members, "meshes")?;
        let (originals, mut spread) = (meshes.clone(), Spread::default());
        let (mut seen, mut replaced) = (BTreeSet::new(), BTreeSet::new());
        let (mut first, mut copies) = (0, 0);
        for placed in primitives.chunk_by(|one, other| one.node == other.node) {
            let PlacedPrimitive { node, mesh: index, .. } = placed[0];
            let mut mesh: Value = parsed(serde_json::from_str(originals[index].get()))?;
            for primitive in placed {
                let means = spread.means(primitive, first, attributes);
                first += primitive.sources.len();
                let slot = &mut mesh["primitives"][primitive.primitive]["attributes"];
                for (attribute, values) in attributes.iter().zip(means) {
                    let bytes: Vec<u8> = values.iter().flat_map(|value| value.to_le_bytes()).collect();
                    let view = self.add_view(&bytes, Some(ARRAY_BUFFER))?;
                    if slot.get(&attribute.name).is_some() {
                        replaced.insert(attribute.name.as_str());
                    }
                    slot[&attribute.name] = accessors.len().into();
                    accessors.push(raw(&float_accessor(view, attribute.width, primitive.vertices))?);
                }
            }
            if !extras.is_empty() && matches!(mesh.get("extras"), None | Some(Value::Object(_))) {
                extras.iter().for_each(|&(key, value)| mesh["extras"][key] = value.into());
            }
            if seen.insert(index) {
                meshes[index] = raw(&mesh)?;
            } else {
                let mut of_node: Map<String, Value> = parsed(serde_json::from_str(nodes[node].get()))?;
                of_node.insert("mesh".into(), meshes.len().into());
                nodes[node] = raw(&of_node)?;
                meshes.push(raw(&mesh)?);
                copies += 1;
            }
        }
        match copies {
            0 => {}
            1 => self.notes.push(
                "1 further node shows a mesh that another shows, and gets a copy of it with numbers of its own".into(),
            ),
            _ => self.notes.push(format!(
                "{copies} further nodes show a mesh that another shows, and get copies of it with numbers of their own"
            )),
        }
        if !replaced.is_empty() {
            let names: Vec<&str> = replaced.into_iter().collect();
            self.warnings.push(format!("the asset's own {} is replaced", names.join(", ")));
        }
        self.warnings.extend(spread.sentence());
        self.means = spread.differing;
        self.put("accessors", &accessors)?;
        self.put("nodes", &nodes)?;
        self.put("meshes", &meshes)
    }

    /// Puts an array back, unless it is empty, which glTF does not allow.
    fn put(&mut self, name: &str, elements: &[Box<RawValue>]) -> Result<(), Error> {
        if !elements.is_empty() {
            self.members.insert(name.to_owned(), raw(&elements)?);
        }
        Ok(())
    }

    fn file(mut self, recipe: Option<&str>) -> Result<AssetFile, Error> {
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        self.buffers[0].insert("byteLength".into(), raw(&self.bytes.len())?);
        self.members.insert("buffers".into(), raw(&self.buffers)?);
        let views = std::mem::take(&mut self.views);
        self.put("bufferViews", &views)?;
        if let Some(recipe) = recipe {
            let asset = self.members.get("asset").map_or("{}", |asset| asset.get());
            let mut asset: Object = parsed(serde_json::from_str(asset))?;
            let extras = asset.get("extras").map(|extras| serde_json::from_str::<Object>(extras.get()));
            // Extras may be anything; what is not an object cannot take a member.
            if let Ok(mut extras) = extras.unwrap_or_else(|| Ok(Object::new())) {
                extras.insert(KEY.into(), parsed(RawValue::from_string(recipe.to_owned()))?);
                asset.insert("extras".into(), raw(&extras)?);
                self.members.insert("asset".into(), raw(&asset)?);
            }
        }
        let json = parsed(serde_json::to_vec(&self.members))?;
        let Self { bytes, notes, warnings, means, .. } = self;
        Ok(AssetFile { bytes: container(json, &bytes)?, notes, warnings, means })
    }
}

/// How far numbers are from the mean that a vertex of the file gets instead.
#[derive(Default)]
struct Spread {
    /// The vertices of the file that are several of ours, with different numbers.
    differing: usize,
    vertices: usize,
    /// The largest distance of a number from the mean, and the name of its attribute.
    most: f32,
    of: String,
}

impl Spread {
    /// The numbers of a primitive's own vertices: the means of ours, which begin at `first`.
    fn means(
        &mut self,
        primitive: &PlacedPrimitive,
        first: usize,
        attributes: &[VertexAttribute],
    ) -> Vec<Vec<f32>> {
        let &PlacedPrimitive { vertices, ref sources, .. } = primitive;
        let mut counts = vec![0_u32; vertices];
        sources.iter().for_each(|&source| counts[source as usize] += 1);
        let mut differs = vec![false; vertices];
        let means = attributes.iter().map(|VertexAttribute { name, width, values }| {
            let ours = || values[first * width..].chunks_exact(*width).zip(sources.iter());
            let mut sums = vec![0.0; vertices * width];
            for (numbers, &source) in ours() {
                let sums = sums[source as usize * width..].iter_mut().zip(numbers);
                sums.for_each(|(sum, number)| *sum += f64::from(*number));
            }
            let mean = |(index, sum): (usize, &f64)| (sum / f64::from(counts[index / width].max(1))) as f32;
            let means: Vec<f32> = sums.iter().enumerate().map(mean).collect();
            // Numbers that differ by less are the same but for their rounding.
            let largest = values.iter().fold(0.0, |most: f32, value| most.max(value.abs()));
            for (numbers, &source) in ours() {
                for (number, mean) in numbers.iter().zip(&means[source as usize * width..]) {
                    let distance = (number - mean).abs();
                    differs[source as usize] |= distance > SAME * largest;
                    if distance > self.most {
                        (self.most, self.of) = (distance, name.clone());
                    }
                }
            }
            means
        });
        let means = means.collect();
        self.vertices += vertices;
        self.differing += differs.iter().filter(|differs| **differs).count();
        means
    }

    fn sentence(&self) -> Option<String> {
        let Self { differing, vertices, most, of } = self;
        (*differing > 0).then(|| {
            format!(
                "{differing} of {vertices} vertices of the asset are several here, with different numbers, because it lacks \
                 normals or tangents: each gets their mean, off by at most {most:.1e} ({of}); give the asset both to avoid it"
            )
        })
    }
}

/// Moves what names a part of a buffer to where that part is now; says whether anything changed.
fn move_place(place: &mut Map<String, Value>, moved: &[(usize, usize)]) -> bool {
    let number = |key: &str| place.get(key).and_then(Value::as_u64).unwrap_or(0) as usize;
    let (buffer, offset) = (number("buffer"), number("byteOffset"));
    let Some(&(to, by)) = moved.get(buffer) else { return false };
    if (to, by) == (buffer, 0) {
        return false;
    }
    place.insert("buffer".into(), to.into());
    place.insert("byteOffset".into(), (offset + by).into());
    true
}

/// The media type of a picture, by its first bytes.
fn mime_type(bytes: &[u8]) -> Option<&'static str> {
    let known: [(&[u8], &str); 4] = [
        (b"\x89PNG", "image/png"),
        (b"\xff\xd8", "image/jpeg"),
        (b"\xabKTX 20", "image/ktx2"),
        (b"DDS ", "image/vnd-ms.dds"),
    ];
    let is_webp = bytes.starts_with(b"RIFF") && bytes.get(8..12) == Some(b"WEBP");
    let found = known.iter().find(|(start, _)| bytes.starts_with(start));
    found.map(|(_, mime)| *mime).or(is_webp.then_some("image/webp"))
}

/// Takes an array out of the document; an empty one if there is none.
fn taken<T: DeserializeOwned>(members: &mut Object, name: &str) -> Result<Vec<T>, Error> {
    let Some(array) = members.remove(name) else { return Ok(Vec::new()) };
    parsed(serde_json::from_str(array.get())).map_err(|error| error.within(name))
}

fn raw(value: &impl serde::Serialize) -> Result<Box<RawValue>, Error> {
    parsed(to_raw_value(value))
}

fn parsed<T>(parsed: serde_json::Result<T>) -> Result<T, Error> {
    parsed.map_err(|error| Error::damaged(format!("the JSON is not that of glTF 2.0: {error}")))
}
