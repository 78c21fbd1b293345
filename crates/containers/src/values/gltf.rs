//! glTF 2.0: the meshes of a `.gltf` or `.glb` file as one, and its materials; a mesh as a `.glb`, or numbers
//! at the vertices of such a file.
//!
//! Read after the Khronos Group's *glTF 2.0 Specification* (ISO/IEC 12113:2022). Files have +Y up and look
//! along +Z; what is given is in Specula's frame, (x, y, z) = (z_file, x_file, y_file), so that the front of
//! a model looks along +X.
//!
//! All meshes of the default scene are read where their nodes put them: triangles, strips and fans, of any
//! component type, sparse or not, quantised (`KHR_mesh_quantization`) and compressed
//! (`EXT_meshopt_compression`) or not, once or for each of its instances (`EXT_mesh_gpu_instancing`). What
//! moves is read at rest: vertices follow the joints of their skin; animations and morph targets are not
//! read, nor are cameras and lights. Of a material, a mesh needs only its name and the set of coordinates of
//! its normal texture, by which tangents are made if the file has none; `materials.rs` reads the rest.
//!
//! The `gltf` crate parses and validates the document. Its readers of accessors are not used: they panic on
//! counts that a damaged file may hold. Every range is checked here when it is used.

use std::collections::BTreeSet;
use std::io::{Read, Seek};
use std::sync::Arc;

use ::gltf::json::mesh::{Mode, Primitive, Semantic};
use ::gltf::json::validation::Checked;
use ::gltf::json::{Accessor, Index, Node};
use glam::{DAffine3, DQuat, Vec3};
use mesh::{MaterialRange, Mesh, Parts};

use crate::error::{Error, ErrorKind};

mod accessors;
mod anisotropy;
mod base_color;
mod buffers;
mod document;
mod element;
mod extensions;
mod frame;
mod image_based_light;
mod instances;
mod materials;
mod meshopt;
mod sampler;
mod scene;
mod scene_lamps;
mod scene_materials;
mod skins;
mod texels;
mod texture_transform;
mod write;
mod write_back;

use accessors::Accessors;
use buffers::Buffers;
use document::{Document, NAMED};
use frame::{affine, in_our_frame, vector};
use instances::Instances;
use skins::Pose;

pub use anisotropy::{Anisotropy, read_gltf_anisotropy};
pub use buffers::ReadBeside;
pub(crate) use image_based_light::is_gltf_image_based_light;
pub use image_based_light::{
    GltfLighting, ImageBasedLight, read_gltf_image_based_light, read_gltf_lighting,
    write_gltf_image_based_light,
};
pub(super) use materials::find as find_material;
pub use materials::{GltfMaterial, MaterialChoice, check_gltf_material, gltf_materials, read_gltf_material};
pub use scene::{GltfScene, SceneOptions, read_gltf_scene};
pub use scene_materials::{Metals, Transmission};
pub use write::{GlbText, VertexAttribute, write_glb};
pub(crate) use write::{is_glb, read_recipe};
pub use write_back::{AssetFile, write_into_gltf};

/// The most triangles that are read of a file, and a third of the most vertices, each instance counted.
pub const MAX_TRIANGLES: usize = 1 << 22;

/// The meshes of a file, and what its user should know of them.
#[derive(Clone, Debug, PartialEq)]
pub struct Model {
    /// All triangles of the default scene, in Specula's frame.
    pub mesh: Mesh,
    /// Notes of what was ignored, and of what was made because it was missing.
    pub notes: Vec<String>,
}

/// The JSON of a `.gltf` or a `.glb`; `None` if the bytes are neither.
pub fn gltf_document(bytes: &[u8]) -> Option<serde_json::Value> {
    document::read(bytes).ok().map(|chunks| chunks.json.into())
}

/// Reads the meshes of the default scene, or of the first if none is named.
///
/// Other files that the document names are read through `read`: their paths are relative to the file's
/// folder, decoded, and do not leave it. Only files that hold vertices or indices are read.
///
/// # Errors
/// If `read` fails; if the file is not glTF 2.0, is damaged, or needs an extension that is not read here. The
/// message names the place in the file.
pub fn read_gltf<E: From<Error>>(bytes: &[u8], read: &mut ReadBeside<'_, E>) -> Result<Model, E> {
    Ok(read_with(bytes, None, read)?.model)
}

/// A number for each vertex of the mesh that [`read_gltf`] makes of the same file: that of an attribute, such
/// as `_BLEND`, or the first of one with several, such as `COLOR_0`.
///
/// # Errors
/// The errors of [`read_gltf`], and an error if a primitive lacks the attribute.
pub fn read_gltf_attribute<E: From<Error>>(
    bytes: &[u8],
    name: &str,
    read: &mut ReadBeside<'_, E>,
) -> Result<Vec<f32>, E> {
    Ok(read_with(bytes, Some(name), read)?.numbers)
}

/// Checks the JSON of a file for a mesh, but none of its vertices: `find` gives the length of each file
/// beside it that is needed.
///
/// # Errors
/// If `find` fails, or for what [`read_gltf`] refuses, if the JSON shows it.
pub fn check_gltf<E: From<Error>>(
    file: &mut (impl Read + Seek),
    find: &mut dyn FnMut(&str) -> Result<u64, E>,
) -> Result<(), E> {
    let (json, has_chunk) = document::read_json(file)?;
    let document = document::of_json(json, None)?;
    let scene = Placed::of(&document)?;
    check_counts(&document, &scene.meshes)?;
    let needed = scene.meshes.iter().flat_map(|mesh| mesh.accessors(&document));
    Buffers::check(&document, needed, has_chunk, find)
}

/// Whether the default scene of a file has triangles, as its JSON says: a file may hold lights or materials
/// alone.
///
/// # Errors
/// The errors of [`check_gltf`], but for those of the files that hold vertices.
pub fn gltf_has_triangles(file: &mut (impl Read + Seek)) -> Result<bool, Error> {
    let (json, _) = document::read_json(file)?;
    let document = document::of_json(json, None)?;
    let scene = Placed::of(&document)?;
    Ok(scene.meshes.iter().any(|placed| primitives_of(&document, placed.mesh).next().is_some()))
}

/// The meshes of a file, and where its vertices came from.
struct Scene {
    model: Model,
    /// A number for each vertex if an attribute was wanted.
    numbers: Vec<f32>,
    /// The primitives that the mesh was made of, in the order of its vertices.
    primitives: Vec<PlacedPrimitive>,
}

/// A primitive of a file, as a node places it.
struct PlacedPrimitive {
    node: usize,
    mesh: usize,
    /// The place of the primitive in its mesh.
    primitive: usize,
    /// Whether it is one of several instances of its node.
    is_instance: bool,
    /// How many vertices it has in the file.
    vertices: usize,
    /// For each vertex of ours, the vertex of the file that it was made of.
    sources: Arc<[u32]>,
}

/// Reads a file with a number for each vertex if an attribute is wanted.
fn read_with<E: From<Error>>(
    bytes: &[u8],
    attribute: Option<&str>,
    read: &mut ReadBeside<'_, E>,
) -> Result<Scene, E> {
    let (document, chunk) = document::open(bytes, attribute)?;
    let scene = Placed::of(&document)?;
    check_counts(&document, &scene.meshes)?;
    let needed = scene.meshes.iter().flat_map(|mesh| mesh.accessors(&document));
    let buffers = Buffers::load(&document, needed, chunk, read)?;
    let accessors = Accessors { document: &document, buffers: &buffers };
    Ok(model(&document, &accessors, &scene, attribute)?)
}

/// The nodes of the scene and their places, in Specula's frame.
struct Placed {
    meshes: Vec<PlacedMesh>,
    /// The maps from each node's own coordinates to the scene's; `None` for a node that is not in the scene.
    nodes: Vec<Option<DAffine3>>,
}

struct PlacedMesh {
    node: usize,
    mesh: usize,
    skin: Option<usize>,
    place: DAffine3,
    instances: Option<Instances>,
}

impl PlacedMesh {
    /// The accessors that the mesh is read from.
    fn accessors<'a>(&'a self, document: &'a Document) -> impl Iterator<Item = usize> + 'a {
        let is_read = |semantic: &Checked<Semantic>| match semantic {
            Checked::Valid(Semantic::Joints(_) | Semantic::Weights(_)) => self.skin.is_some(),
            Checked::Valid(Semantic::Colors(set)) => *set == NAMED,
            Checked::Invalid => false,
            Checked::Valid(_) => true,
        };
        let numbers = primitives_of(document, self.mesh).flat_map(move |(primitive, _)| {
            let read = primitive.attributes.iter().filter(move |(semantic, _)| is_read(semantic));
            read.map(|(_, &accessor)| accessor).chain(primitive.indices)
        });
        let skin = self.skin.and_then(|skin| document.root.skins.get(skin)?.inverse_bind_matrices);
        let instances = self.instances.iter().flat_map(Instances::accessors);
        numbers.chain(skin).map(|accessor: Index<Accessor>| accessor.value()).chain(instances)
    }
}

impl Placed {
    fn of(document: &Document) -> Result<Self, Error> {
        let root = &document.root;
        let roots: Vec<usize> = match root.scenes.get(root.scene.map_or(0, |scene| scene.value())) {
            Some(scene) => scene.nodes.iter().map(Index::value).collect(),
            None => {
                let children: BTreeSet<usize> = root.nodes.iter().flat_map(children).collect();
                (0..root.nodes.len()).filter(|node| !children.contains(node)).collect()
            }
        };
        let (mut meshes, mut nodes) = (Vec::new(), vec![None; root.nodes.len()]);
        let mut open: Vec<(usize, DAffine3)> =
            roots.into_iter().rev().map(|node| (node, DAffine3::IDENTITY)).collect();
        while let Some((index, above)) = open.pop() {
            let node = root.nodes.get(index);
            let node = node.ok_or_else(|| Error::damaged(format!("nodes: there is no node {index}")))?;
            if nodes[index].is_some() {
                return Err(Error::damaged(format!(
                    "nodes[{index}]: the node is reached twice; nodes must form a tree without cycles"
                )));
            }
            let place = above * transform(node).map_err(|error| error.within(format!("nodes[{index}]")))?;
            nodes[index] = Some(place);
            if let Some(mesh) = node.mesh {
                let skin = node.skin.map(|skin| skin.value());
                let instances = Instances::of(document, index, node)?;
                meshes.push(PlacedMesh { node: index, mesh: mesh.value(), skin, place, instances });
            }
            let children: Vec<usize> = children(node).collect();
            open.extend(children.into_iter().rev().map(|child| (child, place)));
        }
        Ok(Self { meshes, nodes })
    }
}

/// The nodes below a node.
fn children(node: &Node) -> impl Iterator<Item = usize> + '_ {
    node.children.iter().flatten().map(Index::value)
}

/// The primitives of a mesh that have triangles, and how they are listed.
fn primitives_of(document: &Document, mesh: usize) -> impl Iterator<Item = (&Primitive, Mode)> {
    let primitives = document.root.meshes.get(mesh).into_iter().flat_map(|mesh| &mesh.primitives);
    primitives.filter_map(|primitive| Some((primitive, Document::triangle_mode(primitive)?)))
}

/// The map from a node's coordinates to those of its parent, in Specula's frame.
fn transform(node: &Node) -> Result<DAffine3, Error> {
    if let Some(matrix) = node.matrix {
        return Ok(affine(matrix));
    }
    let rotation = DQuat::from_array(node.rotation.unwrap_or_default().0.map(f64::from));
    if !(rotation.length() > 1e-6 && rotation.is_finite()) {
        return Err(Error::damaged(format!("the rotation {rotation} is not a quaternion of length 1")));
    }
    Ok(in_our_frame(DAffine3::from_scale_rotation_translation(
        node.scale.unwrap_or([1.0; 3]).map(f64::from).into(),
        rotation.normalize(),
        node.translation.unwrap_or([0.0; 3]).map(f64::from).into(),
    )))
}

/// A primitive with everything that its vertices lacked.
#[derive(Clone)]
struct Complete {
    mesh: Mesh,
    /// A number for each vertex if an attribute is wanted.
    numbers: Vec<f32>,
    primitive: usize,
    vertices: usize,
    sources: Arc<[u32]>,
}

impl Complete {
    fn placed(&self, node: usize, mesh: usize, is_instance: bool) -> PlacedPrimitive {
        let &Self { primitive, vertices, ref sources, .. } = self;
        PlacedPrimitive { node, mesh, primitive, is_instance, vertices, sources: Arc::clone(sources) }
    }
}

fn model(
    document: &Document,
    accessors: &Accessors<'_>,
    scene: &Placed,
    attribute: Option<&str>,
) -> Result<Scene, Error> {
    let mut placed = Vec::new();
    let mut completed: Vec<Option<Vec<Complete>>> = vec![None; document.root.meshes.len()];
    let (mut meshes, mut numbers, mut notes) = (Vec::new(), Vec::new(), Notes::default());
    for &PlacedMesh { node, mesh: index, skin, place, ref instances } in &scene.meshes {
        if let Some(skin) = skin {
            notes.instanced_skins += usize::from(instances.is_some());
            // Its joints say where it is; its node does not.
            let pose = Pose::new(document, accessors, skin, &scene.nodes);
            let pose = pose.map_err(|error| error.within(format!("skins[{skin}]")))?;
            for posed in primitives(document, accessors, index, Some(&pose), attribute, &mut notes)? {
                placed.push(posed.placed(node, index, false));
                meshes.push(posed.mesh);
                numbers.extend(posed.numbers);
            }
            continue;
        }
        let primitives = match &mut completed[index] {
            Some(primitives) => primitives,
            none => none.insert(primitives(document, accessors, index, None, attribute, &mut notes)?),
        };
        let places = match instances {
            Some(instances) => instances.places(accessors)?.into_iter().map(|there| place * there).collect(),
            None => vec![place],
        };
        let is_instance = places.len() > 1;
        for place in places {
            for complete in &*primitives {
                placed.push(complete.placed(node, index, is_instance));
                numbers.extend_from_slice(&complete.numbers);
                let there = complete.mesh.transformed(&place);
                let there = there.map_err(|error| Error::damaged(error.to_string()));
                meshes.push(there.map_err(|error| error.within(format!("meshes[{index}]")))?);
            }
        }
    }
    let material = |placed: &PlacedPrimitive| {
        let primitive = document.root.meshes.get(placed.mesh)?.primitives.get(placed.primitive)?;
        Some(primitive.material?.value() as u32)
    };
    let range = |(placed, mesh): (&PlacedPrimitive, &Mesh)| MaterialRange {
        material: material(placed),
        triangles: mesh.triangles().len(),
    };
    let ranges: Vec<MaterialRange> = placed.iter().zip(&meshes).map(range).collect();
    let mesh = Mesh::joined(&meshes)
        .and_then(|mesh| mesh.with_materials(document.materials.clone(), &ranges))
        .map_err(|error| Error::damaged(error.to_string()))?;
    Ok(Scene { model: Model { mesh, notes: notes.sentences() }, numbers, primitives: placed })
}

/// Compares what the document declares with [`MAX_TRIANGLES`], before anything of that size is allocated.
fn check_counts(document: &Document, placed: &[PlacedMesh]) -> Result<(), Error> {
    let count = |accessor: Option<usize>| Some(document.accessor(accessor?).ok()?.1);
    let (mut corners, mut vertices, mut places) = (0_usize, 0_usize, 0_usize);
    for PlacedMesh { mesh, instances, .. } in placed {
        let times = instances.as_ref().map_or(1, |instances| instances.count);
        places = places.saturating_add(times);
        for (primitive, mode) in primitives_of(document, *mesh) {
            let here = count(Document::attribute(primitive, Semantic::Positions)).unwrap_or(0);
            let each = if mode == Mode::Triangles { 1 } else { 3 };
            let indices = count(primitive.indices.map(|indices| indices.value()));
            vertices = vertices.saturating_add(here.saturating_mul(times));
            let corners_here = indices.unwrap_or(here).saturating_mul(each);
            corners = corners.saturating_add(corners_here.saturating_mul(times));
        }
    }
    if places > MAX_TRIANGLES {
        let message = format!(
            "the scene declares {places} meshes, each instance counted; at most {MAX_TRIANGLES} are read"
        );
        return Err(Error::new(ErrorKind::TooLarge, message));
    }
    if corners.max(vertices) <= 3 * MAX_TRIANGLES {
        return Ok(());
    }
    Err(Error::new(
        ErrorKind::TooLarge,
        format!(
            "the scene declares {} triangles and {vertices} vertices, each instance counted; at most {MAX_TRIANGLES} triangles are read",
            corners / 3
        ),
    ))
}

/// The primitives of a mesh that have triangles, in a pose if it has a skin.
fn primitives(
    document: &Document,
    accessors: &Accessors<'_>,
    mesh: usize,
    pose: Option<&Pose>,
    attribute: Option<&str>,
    notes: &mut Notes,
) -> Result<Vec<Complete>, Error> {
    let mut meshes = Vec::new();
    for (index, primitive) in document.root.meshes[mesh].primitives.iter().enumerate() {
        notes.primitives += 1;
        let Some(mode) = Document::triangle_mode(primitive) else {
            notes.without_triangles += 1;
            continue;
        };
        let targets = primitive.targets.as_ref().is_some_and(|targets| !targets.is_empty());
        notes.with_targets += usize::from(targets);
        let has = |semantic| Document::attribute(primitive, semantic).is_some();
        notes.with_colours += usize::from(has(Semantic::Colors(0)));
        notes.with_sets += usize::from(has(Semantic::TexCoords(0)) && has(Semantic::TexCoords(1)));
        let material = primitive.material.map(|material| material.value());
        let is_turned = material.and_then(|material| document.turned_normals.get(material)) == Some(&true);
        let parts = parts(document, accessors, primitive, mode).and_then(|parts| match pose {
            Some(pose) => pose.take(parts, accessors, primitive),
            None => Ok(parts),
        });
        let complete = parts.and_then(|parts| {
            notes.without_normals += usize::from(parts.normals.is_none());
            notes.without_tangents += usize::from(parts.tangents.is_none());
            notes.with_turned_normals += usize::from(parts.tangents.is_none() && is_turned);
            let vertices = parts.positions.len();
            let given = numbers_of(accessors, primitive, attribute, vertices)?;
            let (mesh, sources) =
                parts.complete_with_sources().map_err(|error| Error::damaged(error.to_string()))?;
            let numbers = given.map(|given| sources.iter().map(|&source| given[source as usize]).collect());
            let (numbers, sources) = (numbers.unwrap_or_default(), sources.into());
            Ok(Complete { mesh, numbers, primitive: index, vertices, sources })
        });
        meshes.push(complete.map_err(|error| error.within(format!("meshes[{mesh}].primitives[{index}]")))?);
    }
    Ok(meshes)
}

/// The parts of a primitive that the file holds, in Specula's frame.
fn parts(
    document: &Document,
    accessors: &Accessors<'_>,
    primitive: &Primitive,
    mode: Mode,
) -> Result<Parts, Error> {
    // The specification lets extensions provide positions; none that does is read.
    let missing = || Error::damaged("attributes.POSITION is missing");
    let positions = attribute::<3>(accessors, primitive, Semantic::Positions, None)?.ok_or_else(missing)?;
    let count = Some(positions.len());
    let normals = attribute::<3>(accessors, primitive, Semantic::Normals, count)?;
    let tangents = attribute::<4>(accessors, primitive, Semantic::Tangents, count)?;
    let material = primitive.material.and_then(|material| document.normal_sets.get(material.value()));
    let set = material
        .copied()
        .flatten()
        .filter(|&set| Document::attribute(primitive, Semantic::TexCoords(set)).is_some());
    let semantic = Semantic::TexCoords(set.unwrap_or(0));
    let indices = match primitive.indices {
        Some(accessor) => accessors.indices(accessor.value()).map_err(|error| error.within("indices"))?,
        None => (0..positions.len() as u32).collect(),
    };
    Ok(Parts {
        triangles: triangles(mode, &indices)?,
        coordinates: attribute::<2>(accessors, primitive, semantic, count)?,
        positions: positions.into_iter().map(vector).collect(),
        normals: normals.map(|normals| normals.into_iter().map(vector).collect()),
        tangents: tangents.map(|tangents| {
            let tangent = |[x, y, z, sign]: [f32; 4]| Vec3::from(vector([x, y, z])).extend(sign).to_array();
            tangents.into_iter().map(tangent).collect()
        }),
    })
}

/// The number of each vertex of a primitive, if an attribute is wanted.
fn numbers_of(
    accessors: &Accessors<'_>,
    primitive: &Primitive,
    attribute: Option<&str>,
    vertices: usize,
) -> Result<Option<Vec<f32>>, Error> {
    let Some(name) = attribute else { return Ok(None) };
    let Some(accessor) = Document::attribute(primitive, Semantic::Colors(NAMED)) else {
        return Err(Error::damaged(format!("the attribute {name} is missing")));
    };
    accessors.firsts(accessor, vertices).map(Some).map_err(|error| error.within(format!("attributes.{name}")))
}

/// An attribute of each vertex, if the primitive has it.
fn attribute<const N: usize>(
    accessors: &Accessors<'_>,
    primitive: &Primitive,
    semantic: Semantic,
    vertices: Option<usize>,
) -> Result<Option<Vec<[f32; N]>>, Error> {
    let name = semantic.to_string();
    let vectors = Document::attribute(primitive, semantic).map(|at| accessors.vectors(at, vertices));
    vectors.transpose().map_err(|error| error.within(format!("attributes.{name}")))
}

/// The triangles of a list, a strip or a fan (section 3.7.2.1).
fn triangles(mode: Mode, indices: &[u32]) -> Result<Vec<[u32; 3]>, Error> {
    let count = indices.len();
    Ok(match mode {
        Mode::TriangleStrip => (2..count)
            .map(|k| match k % 2 {
                0 => [indices[k - 2], indices[k - 1], indices[k]],
                _ => [indices[k - 2], indices[k], indices[k - 1]],
            })
            .collect(),
        Mode::TriangleFan => (2..count).map(|k| [indices[k - 1], indices[k], indices[0]]).collect(),
        _ => match indices.as_chunks() {
            (triangles, []) => triangles.to_vec(),
            _ => return Err(Error::damaged(format!("{count} corners are not whole triangles"))),
        },
    })
}

/// Counts of primitives that the user of a file should know of.
#[derive(Default)]
struct Notes {
    primitives: usize,
    without_triangles: usize,
    without_normals: usize,
    without_tangents: usize,
    with_targets: usize,
    with_turned_normals: usize,
    with_colours: usize,
    with_sets: usize,
    instanced_skins: usize,
}

impl Notes {
    fn sentences(&self) -> Vec<String> {
        const HAVE: [&str; 2] = ["has", "have"];
        let all = self.primitives;
        [
            (self.without_triangles, ["is", "are"], "points or lines, which are left out"),
            (self.without_normals, HAVE, "no normals: every triangle is flat"),
            (self.without_tangents, HAVE, "no tangents: they are made"),
            (
                self.with_turned_normals,
                HAVE,
                "a normal texture that KHR_texture_transform turns; its tangents are not turned",
            ),
            (self.with_targets, HAVE, "morph targets, which are left out"),
            (self.with_colours, HAVE, "vertex colours (COLOR_0), which are left out"),
            (
                self.with_sets,
                HAVE,
                "several sets of texture coordinates: that of the normal texture is read, or set 0",
            ),
        ]
        .into_iter()
        .filter(|(count, ..)| *count > 0)
        .map(|(count, verb, what)| match (count, all) {
            (1, 1) => format!("the primitive {} {what}", verb[0]),
            (_, _) => format!("{count} of {all} primitives {} {what}", verb[usize::from(count > 1)]),
        })
        .chain((self.instanced_skins > 0).then(|| {
            "the instances of skinned meshes are left out: the joints say where such a mesh is".to_owned()
        }))
        .collect()
    }
}
