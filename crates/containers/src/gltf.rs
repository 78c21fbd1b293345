//! glTF 2.0: the meshes of a `.gltf` or `.glb` file as one.
//!
//! Read after the Khronos Group's *glTF 2.0 Specification* (ISO/IEC 12113:2022). Files have +Y up and look along +Z; what is
//! given is in Specula's frame, (x, y, z) = (z_file, x_file, y_file), so that the front of a model looks along +X.
//!
//! All meshes of the default scene are read where their nodes put them: triangles, strips and fans, of any component
//! type, sparse or not, quantised or not (`KHR_mesh_quantization`). What moves is seen as it rests: skins take vertices where
//! their joints are; animations and morph targets are not read, nor are materials, textures, cameras and lights. Of a
//! material only the set of coordinates of its normal texture counts, by which tangents are made where the file has none.
//!
//! The `gltf` crate is not used: it refuses files for faults of materials, and its accessors panic on counts that a
//! damaged file may hold. What is needed here is small, and every index and range is checked where it is used.

use std::collections::BTreeSet;
use std::sync::Arc;

use glam::{DAffine3, DMat3, DQuat, DVec3, Vec3};
use mesh::{Mesh, Parts};

use crate::error::{Error, ErrorKind};

mod accessors;
mod buffers;
mod document;
mod skins;

use accessors::Accessors;
use buffers::Buffers;
use document::{Document, Node, Primitive};
use skins::Pose;

/// The most triangles that are read of a file, and a third of the most vertices, each instance counted.
pub const MAX_TRIANGLES: usize = 1 << 22;

/// How a file beside another is had, by its path.
pub type ReadBeside<'a, E> = dyn FnMut(&str) -> Result<Arc<Vec<u8>>, E> + 'a;

/// The meshes of a file, and what its user should know of them.
#[derive(Clone, Debug, PartialEq)]
pub struct Model {
    /// All triangles of the default scene, in Specula's frame.
    pub mesh: Mesh,
    /// What was ignored, and what was made because it was missing.
    pub notes: Vec<String>,
}

/// Reads the meshes of the default scene, or of the first where none is named.
///
/// Other files that it names are had through `read`: their paths are relative to the file's folder, decoded, and do not
/// leave it. Only those that hold vertices or indices are asked for.
///
/// # Errors
/// What `read` says; where the file is not glTF 2.0, is damaged, or needs an extension that is not read here: the
/// message names the place in the file.
pub fn read_gltf<E: From<Error>>(bytes: &[u8], read: &mut ReadBeside<'_, E>) -> Result<Model, E> {
    let (document, chunk) = document::open(bytes)?;
    let scene = Placed::of(&document)?;
    check_counts(&document, &scene.meshes)?;
    let needed = scene.meshes.iter().flat_map(|mesh| mesh.accessors(&document));
    let buffers = Buffers::load(&document, needed, chunk, read)?;
    let accessors = Accessors { document: &document, buffers: &buffers };
    Ok(model(&document, &accessors, &scene)?)
}

/// What the nodes of the scene are and where, in Specula's frame.
struct Placed {
    meshes: Vec<PlacedMesh>,
    /// Of each node that is in the scene, the map from its own coordinates to the scene's.
    nodes: Vec<Option<DAffine3>>,
}

struct PlacedMesh {
    mesh: usize,
    skin: Option<usize>,
    place: DAffine3,
}

impl PlacedMesh {
    /// The accessors that it is read from.
    fn accessors<'a>(&'a self, document: &'a Document) -> impl Iterator<Item = usize> + 'a {
        let is_read = |name: &str| {
            ["POSITION", "NORMAL", "TANGENT"].contains(&name)
                || name.starts_with("TEXCOORD_")
                || self.skin.is_some() && (name.starts_with("JOINTS_") || name.starts_with("WEIGHTS_"))
        };
        let primitives = document.meshes[self.mesh].primitives.iter();
        let numbers = primitives.filter(|primitive| primitive.has_triangles()).flat_map(move |primitive| {
            let read = primitive.attributes.iter().filter(move |(name, _)| is_read(name));
            read.map(|(_, &accessor)| accessor).chain(primitive.indices)
        });
        let skin = self.skin.and_then(|skin| document.skins.get(skin)?.inverse_bind_matrices);
        numbers.chain(skin)
    }
}

impl Placed {
    fn of(document: &Document) -> Result<Self, Error> {
        let roots = match document.scene.or((!document.scenes.is_empty()).then_some(0)) {
            Some(scene) => document
                .scenes
                .get(scene)
                .ok_or_else(|| Error::damaged(format!("scene: there is no scene {scene}")))?
                .nodes
                .clone(),
            None => {
                let children: BTreeSet<usize> =
                    document.nodes.iter().flat_map(|node| &node.children).copied().collect();
                (0..document.nodes.len()).filter(|node| !children.contains(node)).collect()
            }
        };
        let (mut meshes, mut nodes) = (Vec::new(), vec![None; document.nodes.len()]);
        let mut open: Vec<(usize, DAffine3)> =
            roots.into_iter().rev().map(|node| (node, DAffine3::IDENTITY)).collect();
        while let Some((index, above)) = open.pop() {
            let node = document
                .nodes
                .get(index)
                .ok_or_else(|| Error::damaged(format!("nodes: there is no node {index}")))?;
            if nodes[index].is_some() {
                return Err(Error::damaged(format!(
                    "nodes[{index}]: the node is reached twice; nodes must form a tree without cycles"
                )));
            }
            let place = above * transform(node).map_err(|error| error.within(format!("nodes[{index}]")))?;
            nodes[index] = Some(place);
            if let Some(mesh) = node.mesh {
                if mesh >= document.meshes.len() {
                    return Err(Error::damaged(format!("nodes[{index}].mesh: there is no mesh {mesh}")));
                }
                meshes.push(PlacedMesh { mesh, skin: node.skin, place });
            }
            open.extend(node.children.iter().rev().map(|&child| (child, place)));
        }
        Ok(Self { meshes, nodes })
    }
}

/// A map of the file's coordinates as one of Specula's.
fn in_our_frame(map: DAffine3) -> DAffine3 {
    let axes = [DVec3::X, DVec3::Y, DVec3::Z].map(sphere::from_file);
    let frame = DAffine3::from_mat3(DMat3::from_cols(axes[0], axes[1], axes[2]));
    frame * map * DAffine3::from_mat3(frame.matrix3.transpose())
}

/// The map from a node's coordinates to those of its parent, in Specula's frame.
fn transform(node: &Node) -> Result<DAffine3, Error> {
    if let Some(m) = node.matrix {
        // By columns; the last row of an affine map is 0 0 0 1.
        let columns = [0, 4, 8, 12].map(|at| [m[at], m[at + 1], m[at + 2]]);
        return Ok(in_our_frame(DAffine3::from_cols_array_2d(&columns)));
    }
    let rotation = DQuat::from_array(node.rotation.unwrap_or([0.0, 0.0, 0.0, 1.0]));
    if !(rotation.length() > 1e-6 && rotation.is_finite()) {
        return Err(Error::damaged(format!("the rotation {rotation} is no quaternion of length 1")));
    }
    Ok(in_our_frame(DAffine3::from_scale_rotation_translation(
        node.scale.unwrap_or([1.0; 3]).into(),
        rotation.normalize(),
        node.translation.unwrap_or([0.0; 3]).into(),
    )))
}

fn model(document: &Document, accessors: &Accessors<'_>, scene: &Placed) -> Result<Model, Error> {
    let mut completed: Vec<Option<Vec<Mesh>>> = vec![None; document.meshes.len()];
    let (mut meshes, mut notes) = (Vec::new(), Notes::default());
    for &PlacedMesh { mesh: index, skin, place } in &scene.meshes {
        if let Some(skin) = skin {
            // Its joints say where it is, and its node does not.
            let pose = Pose::new(document, accessors, skin, &scene.nodes);
            let pose = pose.map_err(|error| error.within(format!("skins[{skin}]")))?;
            meshes.extend(primitives(document, accessors, index, Some(&pose), &mut notes)?);
            continue;
        }
        let primitives = match &mut completed[index] {
            Some(primitives) => primitives,
            none => none.insert(primitives(document, accessors, index, None, &mut notes)?),
        };
        for mesh in primitives {
            let there = mesh.transformed(&place);
            let there = there.map_err(|error| Error::damaged(error.to_string()));
            meshes.push(there.map_err(|error| error.within(format!("meshes[{index}]")))?);
        }
    }
    let mesh = Mesh::joined(&meshes).map_err(|error| Error::damaged(error.to_string()))?;
    Ok(Model { mesh, notes: notes.told() })
}

/// Compares what the document tells of itself with [`MAX_TRIANGLES`], before anything of that size is allocated.
fn check_counts(document: &Document, placed: &[PlacedMesh]) -> Result<(), Error> {
    let count = |accessor: Option<usize>| Some(document.accessors.get(accessor?)?.count);
    let (mut corners, mut vertices) = (0_usize, 0_usize);
    for &PlacedMesh { mesh, .. } in placed {
        for primitive in document.meshes[mesh].primitives.iter().filter(|primitive| primitive.has_triangles())
        {
            let here = count(primitive.attributes.get("POSITION").copied()).unwrap_or(0);
            let each = if primitive.mode == document::TRIANGLES { 1 } else { 3 };
            vertices = vertices.saturating_add(here);
            corners = corners.saturating_add(count(primitive.indices).unwrap_or(here).saturating_mul(each));
        }
    }
    if corners.max(vertices) <= 3 * MAX_TRIANGLES {
        return Ok(());
    }
    Err(Error::new(
        ErrorKind::TooLarge,
        format!(
            "the scene tells of {} triangles and {vertices} vertices, each instance counted; at most {MAX_TRIANGLES} triangles are read",
            corners / 3
        ),
    ))
}

/// The primitives of a mesh that have triangles, in a pose where it has a skin.
fn primitives(
    document: &Document,
    accessors: &Accessors<'_>,
    mesh: usize,
    pose: Option<&Pose>,
    notes: &mut Notes,
) -> Result<Vec<Mesh>, Error> {
    let mut meshes = Vec::new();
    for (index, primitive) in document.meshes[mesh].primitives.iter().enumerate() {
        notes.primitives += 1;
        if !primitive.has_triangles() {
            notes.without_triangles += 1;
            continue;
        }
        notes.with_targets += usize::from(!primitive.targets.is_empty());
        let parts = parts(document, accessors, primitive).and_then(|parts| match pose {
            Some(pose) => pose.take(parts, accessors, primitive),
            None => Ok(parts),
        });
        let complete = parts.and_then(|parts| {
            notes.without_normals += usize::from(parts.normals.is_none());
            notes.without_tangents += usize::from(parts.tangents.is_none());
            parts.complete().map_err(|error| Error::damaged(error.to_string()))
        });
        meshes.push(complete.map_err(|error| error.within(format!("meshes[{mesh}].primitives[{index}]")))?);
    }
    Ok(meshes)
}

/// What the file holds of a primitive, in Specula's frame.
fn parts(document: &Document, accessors: &Accessors<'_>, primitive: &Primitive) -> Result<Parts, Error> {
    let attribute = |name: &str| primitive.attributes.get(name).copied();
    let Some(positions) = attribute("POSITION") else {
        // The specification lets extensions provide them, and none that does is read.
        return Err(Error::damaged("attributes.POSITION is missing"));
    };
    let positions =
        accessors.vectors(positions, None).map_err(|error| error.within("attributes.POSITION"))?;
    let count = Some(positions.len());
    let place = |name: &str| format!("attributes.{name}");
    let vectors = attribute("NORMAL").map(|accessor| accessors.vectors(accessor, count));
    let normals = vectors.transpose().map_err(|error| error.within(place("NORMAL")))?;
    let vectors = attribute("TANGENT").map(|accessor| accessors.vectors(accessor, count));
    let tangents = vectors.transpose().map_err(|error| error.within(place("TANGENT")))?;
    let set =
        primitive.material.and_then(|material| document.materials.get(material)?.tangent_set()).unwrap_or(0);
    let sets = [format!("TEXCOORD_{set}"), "TEXCOORD_0".into()];
    let pairs = sets.iter().find_map(|name| Some((name, attribute(name)?)));
    let pairs = pairs.map(|(name, accessor)| {
        accessors.vectors(accessor, count).map_err(|error| error.within(place(name)))
    });
    let indices = match primitive.indices {
        Some(accessor) => accessors.indices(accessor).map_err(|error| error.within("indices"))?,
        None => (0..positions.len() as u32).collect(),
    };
    Ok(Parts {
        triangles: triangles(primitive.mode, &indices)?,
        coordinates: pairs.transpose()?,
        positions: positions.into_iter().map(turned).collect(),
        normals: normals.map(|normals| normals.into_iter().map(turned).collect()),
        tangents: tangents.map(|tangents| {
            let turned = |[x, y, z, sign]: [f32; 4]| Vec3::from(turned([x, y, z])).extend(sign).to_array();
            tangents.into_iter().map(turned).collect()
        }),
    })
}

/// A vector of the file in Specula's frame.
fn turned(vector: [f32; 3]) -> [f32; 3] {
    sphere::from_file(Vec3::from(vector).as_dvec3()).as_vec3().to_array()
}

/// The triangles of a list, a strip or a fan (section 3.7.2.1).
fn triangles(mode: u32, indices: &[u32]) -> Result<Vec<[u32; 3]>, Error> {
    let count = indices.len();
    Ok(match mode {
        document::STRIP => (2..count)
            .map(|k| match k % 2 {
                0 => [indices[k - 2], indices[k - 1], indices[k]],
                _ => [indices[k - 2], indices[k], indices[k - 1]],
            })
            .collect(),
        document::FAN => (2..count).map(|k| [indices[k - 1], indices[k], indices[0]]).collect(),
        _ => match indices.as_chunks() {
            (triangles, []) => triangles.to_vec(),
            _ => return Err(Error::damaged(format!("{count} corners are no whole triangles"))),
        },
    })
}

/// What is told of a file, in numbers of primitives.
#[derive(Default)]
struct Notes {
    primitives: usize,
    without_triangles: usize,
    without_normals: usize,
    without_tangents: usize,
    with_targets: usize,
}

impl Notes {
    fn told(&self) -> Vec<String> {
        let all = self.primitives;
        [
            (self.without_triangles, "points or lines, which are left out"),
            (self.without_normals, "without normals: every triangle is flat"),
            (self.without_tangents, "without tangents: they are made"),
            (self.with_targets, "with morph targets, which are left out"),
        ]
        .into_iter()
        .filter(|(count, _)| *count > 0)
        .map(|(count, what)| {
            format!("{count} of {all} primitives {} {what}", if count == 1 { "is" } else { "are" })
        })
        .collect()
    }
}
