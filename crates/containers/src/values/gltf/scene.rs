//! glTF 2.0: a scene as light sees it, for light probes.
//!
//! All triangles of the nodes of a scene, with matte materials of them, their textures, what they emit, and
//! the lamps of `KHR_lights_punctual`. A node whose transform mirrors turns the order of corners (section
//! 3.7.4), so that a front is always where corners are counter-clockwise. Normals and roughness have no part
//! in it: a file that differs in these alone gives the same scene.

use std::collections::{BTreeMap, BTreeSet};

use ::gltf::json::accessor::Type;
use ::gltf::json::mesh::{Primitive, Semantic};
use ::gltf::json::validation::Checked;
use glam::{DAffine3, DVec3};
use mesh::Parts;
use probes::{Corner, NamedBox, Part, Scene, SceneParts};
use serde_json::{Map, Value};

use super::accessors::Accessors;
use super::buffers::{Buffers, ReadBeside};
use super::document::{self, Document};
use super::element::Element;
use super::frame::vector;
use super::materials;
use super::scene_lamps::{dark_lamps, lamps};
use super::scene_materials::{Coordinates, Materials, Metals, Transmission};
use super::skins::Pose;
use super::{Placed, PlacedMesh, attribute, check_counts, primitives_of, triangles};
use crate::error::{Error, ErrorKind};

/// The member of a node's `extras` that makes it a box for probes.
const BOX: &str = "specula_probes";

/// What is read of a file.
#[derive(Clone, Copy, Default)]
pub struct SceneOptions<'a> {
    /// The scene of this name; `None` for the default one.
    pub scene: Option<&'a str>,
    /// What metals reflect.
    pub metals: Metals,
    /// What `KHR_materials_transmission` lets through.
    pub transmission: Transmission,
    /// The names of nodes that are boxes for probes, beside those with `extras.specula_probes`.
    pub is_box: Option<&'a dyn Fn(&str) -> bool>,
    /// The names of nodes that are the places of single probes, unless they are boxes.
    pub is_point: Option<&'a dyn Fn(&str) -> bool>,
}

/// A scene, and what its user should know of it.
#[derive(Clone, Debug, PartialEq)]
pub struct GltfScene {
    /// The scene, in Specula's frame.
    pub scene: Scene,
    /// Notes of what was left out or changed.
    pub notes: Vec<String>,
}

/// Reads a scene. Other files are read through `read`: see [`read_gltf`](super::read_gltf).
///
/// A node of a box has no part in the scene otherwise: the box is that around its mesh or, without one,
/// around the cube from -1 to 1 in its coordinates, as Blender draws an empty. A node of a single probe has
/// no part in it either: the probe is at its origin.
///
/// # Errors
/// If `read` fails; if the file is not glTF 2.0, is damaged, or needs an extension that is not read here; if
/// there is no such scene or it has no triangles, or a number is not finite. The message names the place.
pub fn read_gltf_scene<E: From<Error>>(
    bytes: &[u8],
    options: &SceneOptions<'_>,
    read: &mut ReadBeside<'_, E>,
) -> Result<GltfScene, E> {
    let chunks = materials::open(bytes)?;
    let (mut json, chunk) = (chunks.json, chunks.binary);
    choose_scene(&mut json, options.scene)?;
    refuse_glossiness(&json)?;
    let document = document::of_json(json.clone(), None)?;
    let placed = Placed::of(&document)?;
    check_counts(&document, &placed.meshes)?;
    let needed = placed.meshes.iter().flat_map(|mesh| mesh.accessors(&document));
    let colours = placed.meshes.iter().flat_map(|placed| {
        let colour = |primitive| Document::attribute(primitive, Semantic::Colors(0));
        primitives_of(&document, placed.mesh).filter_map(move |(primitive, _)| colour(primitive))
    });
    let buffers = Buffers::load(&document, needed.chain(colours), chunk, read)?;
    let accessors = Accessors { document: &document, buffers: &buffers };
    let boxes = Boxes { json: &json, is_box: options.is_box };
    let is_point = |node: usize| {
        options.is_point.is_some_and(|is_point| is_named(&json, node, is_point)) && !boxes.contains(node)
    };
    let in_scene = |mesh: &&PlacedMesh| !boxes.contains(mesh.node) && !is_point(mesh.node);
    let used: BTreeSet<Option<usize>> = placed
        .meshes
        .iter()
        .filter(in_scene)
        .flat_map(|placed| {
            let material =
                |(primitive, _): (&Primitive, _)| primitive.material.map(|material| material.value());
            primitives_of(&document, placed.mesh).map(material)
        })
        .collect();
    let materials = Materials::read(&json, &used, chunk, options.metals, options.transmission, read)?;
    let mut builder = Builder {
        document: &document,
        accessors: &accessors,
        json: &json,
        materials: &materials,
        parts: SceneParts::default(),
        flat: 0,
    };
    for mesh in placed.meshes.iter().filter(in_scene) {
        builder.add(mesh, &placed.nodes)?;
    }
    let Builder { mut parts, flat, .. } = builder;
    parts.boxes = boxes.all(&document, &accessors, &placed)?;
    let places = placed.nodes.iter().enumerate().filter(|(node, _)| is_point(*node));
    let points = places.filter_map(|(_, place)| Some(place.as_ref()?.translation.as_vec3().to_array()));
    parts.points = points.collect();
    parts.lamps = lamps(&json, &placed.nodes)?;
    let mut notes = materials.notes.clone();
    notes.extend(dark_lamps(&parts.lamps));
    if flat > 0 && parts.triangles.is_empty() {
        return Err(Error::damaged(format!("none of the {flat} triangles of the scene has an area")).into());
    }
    if flat > 0 {
        notes.push(format!("{flat} triangles without an area are left out"));
    }
    (parts.materials, parts.textures) = (materials.materials, materials.textures);
    let scene = Scene::new(parts).map_err(|error| Error::damaged(error.to_string()))?;
    Ok(GltfScene { scene, notes })
}

/// Makes the scene of a name the default one.
fn choose_scene(json: &mut Map<String, Value>, name: Option<&str>) -> Result<(), Error> {
    let Some(name) = name else { return Ok(()) };
    let scenes = Element::of(json, "scenes");
    let mut names = Vec::new();
    for index in 0..scenes.count() {
        names.push(scenes.at(index)?.get("name").text()?.unwrap_or_default().to_owned());
    }
    match names.iter().position(|other| other == name) {
        Some(index) => {
            json.insert("scene".into(), index.into());
            Ok(())
        }
        None => Err(Error::new(
            ErrorKind::NoSuchLayer,
            format!("there is no scene {name:?}; expected one of: {}", names.join(", ")),
        )),
    }
}

fn refuse_glossiness(json: &Map<String, Value>) -> Result<(), Error> {
    let required = Element::of(json, "extensionsRequired");
    for index in 0..required.count() {
        if required.element(index).text()? == Some("KHR_materials_pbrSpecularGlossiness") {
            return Err(Error::unsupported(
                "the file requires KHR_materials_pbrSpecularGlossiness, which is not read here; convert its \
                 materials to metallic and roughness, for example with `gltf-transform metalrough`",
            ));
        }
    }
    Ok(())
}

/// The name of a node; its place if it has none.
fn node_name(json: &Map<String, Value>, node: usize) -> String {
    let name = Element::of(json, "nodes").element(node).get("name").text().ok().flatten();
    name.map_or_else(|| format!("nodes[{node}]"), str::to_owned)
}

/// Whether a node has a name, and the name is one of those that are meant.
fn is_named(json: &Map<String, Value>, node: usize, is_meant: &dyn Fn(&str) -> bool) -> bool {
    let name = json.get("nodes").and_then(|nodes| nodes.get(node)).and_then(|node| node.get("name"));
    name.and_then(Value::as_str).is_some_and(is_meant)
}

/// The nodes that are boxes for probes.
struct Boxes<'a> {
    json: &'a Map<String, Value>,
    is_box: Option<&'a dyn Fn(&str) -> bool>,
}

impl Boxes<'_> {
    fn contains(&self, node: usize) -> bool {
        let place = self.json.get("nodes").and_then(|nodes| nodes.get(node));
        let extras = place.and_then(|place| place.get("extras")).and_then(|extras| extras.get(BOX));
        let is_named = || self.is_box.is_some_and(|is_box| is_named(self.json, node, is_box));
        match extras {
            Some(Value::Bool(flag)) => *flag,
            Some(Value::Number(number)) => number.as_f64() != Some(0.0),
            Some(Value::Null) | None => is_named(),
            Some(_) => true,
        }
    }

    /// The boxes of the scene, in the order of its nodes.
    fn all(
        &self,
        document: &Document,
        accessors: &Accessors<'_>,
        placed: &Placed,
    ) -> Result<Vec<NamedBox>, Error> {
        let mut boxes = Vec::new();
        for (node, place) in placed.nodes.iter().enumerate() {
            let Some(place) = place.filter(|_| self.contains(node)) else { continue };
            let mut corners = Vec::new();
            for mesh in placed.meshes.iter().filter(|mesh| mesh.node == node) {
                for (primitive, _) in primitives_of(document, mesh.mesh) {
                    let positions = attribute::<3>(accessors, primitive, Semantic::Positions, None)?;
                    corners.extend(
                        positions.into_iter().flatten().map(|at| DVec3::from(vector(at).map(f64::from))),
                    );
                }
            }
            if corners.is_empty() {
                let side = |k: u32, axis: u32| if k >> axis & 1 == 0 { -1.0 } else { 1.0 };
                corners.extend((0..8).map(|k| DVec3::new(side(k, 0), side(k, 1), side(k, 2))));
            }
            let there = corners.into_iter().map(|corner| place.transform_point3(corner).as_vec3());
            let none = [glam::Vec3::INFINITY, glam::Vec3::NEG_INFINITY];
            let bounds = there.fold(none, |[least, most], at| [least.min(at), most.max(at)]);
            boxes.push(NamedBox { name: node_name(self.json, node), bounds: bounds.map(|at| at.to_array()) });
        }
        Ok(boxes)
    }
}

/// A primitive in the coordinates of its mesh.
#[derive(Clone)]
struct Shape {
    positions: Vec<[f32; 3]>,
    triangles: Vec<[u32; 3]>,
    corners: Option<Vec<Corner>>,
    material: u32,
}

/// A scene that is being read.
struct Builder<'a> {
    document: &'a Document,
    accessors: &'a Accessors<'a>,
    json: &'a Map<String, Value>,
    materials: &'a Materials,
    parts: SceneParts,
    /// Triangles without an area.
    flat: usize,
}

impl Builder<'_> {
    /// Adds the mesh of a node, at each of its places.
    fn add(&mut self, placed: &PlacedMesh, nodes: &[Option<DAffine3>]) -> Result<(), Error> {
        let mesh = placed.mesh;
        let pose = placed.skin.map(|skin| {
            let pose = Pose::new(self.document, self.accessors, skin, nodes);
            pose.map_err(|error| error.within(format!("skins[{skin}]")))
        });
        let pose = pose.transpose()?;
        let places = match (&placed.instances, &pose) {
            (Some(instances), None) => {
                instances.places(self.accessors)?.into_iter().map(|there| placed.place * there).collect()
            }
            (None, None) => vec![placed.place],
            // Its joints say where it is; its node does not.
            (_, Some(_)) => vec![DAffine3::IDENTITY],
        };
        let before = self.parts.triangles.len();
        for (index, primitive) in self.document.root.meshes[mesh].primitives.iter().enumerate() {
            let here = |error: Error| error.within(format!("meshes[{mesh}].primitives[{index}]"));
            let Some(shape) = self.shape(primitive, pose.as_ref()).map_err(here)? else { continue };
            // Instances share what their corners have.
            let first = shape.corners.as_ref().map(|corners| {
                let first = self.parts.attributes.len() as u32;
                let of_triangle = |triangle: &[u32; 3]| triangle.map(|corner| corners[corner as usize]);
                self.parts.attributes.extend(shape.triangles.iter().map(of_triangle));
                first
            });
            for place in &places {
                self.put(&shape, first, place);
            }
        }
        let triangles = self.parts.triangles.len() - before;
        self.parts.parts.push(Part { name: node_name(self.json, placed.node), triangles });
        Ok(())
    }

    fn put(&mut self, shape: &Shape, first: Option<u32>, place: &DAffine3) {
        let mirrors = place.matrix3.determinant() < 0.0;
        for (index, triangle) in (0..).zip(&shape.triangles) {
            let at = |corner: u32| {
                let position = DVec3::from(shape.positions[corner as usize].map(f64::from));
                place.transform_point3(position).as_vec3()
            };
            let mut corners = triangle.map(at);
            let cross = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
            // What is not a number is left to be found.
            if cross.length_squared() == 0.0 {
                self.flat += 1;
                continue;
            }
            let mut attributes = first.map_or(SceneParts::NONE, |first| first + index);
            if mirrors {
                corners.swap(1, 2);
                if let Some(&[a, b, c]) = self.parts.attributes.get(attributes as usize) {
                    attributes = self.parts.attributes.len() as u32;
                    self.parts.attributes.push([a, c, b]);
                }
            }
            self.parts.triangles.push(corners.map(|corner| corner.to_array()));
            self.parts.attributes_of.push(attributes);
            self.parts.material_of.push(shape.material);
        }
    }

    /// A primitive of a mesh; `None` if it has no triangles.
    fn shape(&self, primitive: &Primitive, pose: Option<&Pose>) -> Result<Option<Shape>, Error> {
        let Some(mode) = Document::triangle_mode(primitive) else { return Ok(None) };
        let missing = || Error::damaged("attributes.POSITION is missing");
        let positions = attribute::<3>(self.accessors, primitive, Semantic::Positions, None)?;
        let positions: Vec<[f32; 3]> = positions.ok_or_else(missing)?.into_iter().map(vector).collect();
        let count = positions.len();
        let indices = match primitive.indices {
            Some(accessor) => {
                self.accessors.indices(accessor.value()).map_err(|error| error.within("indices"))?
            }
            None => (0..count as u32).collect(),
        };
        let triangles = triangles(mode, &indices)?;
        if let Some(corners) = triangles.iter().find(|corners| corners.iter().any(|at| *at as usize >= count))
        {
            return Err(Error::damaged(format!(
                "a triangle has corners {corners:?}, and there are {count} vertices"
            )));
        }
        let parts = Parts { positions, triangles, ..Parts::default() };
        let Parts { positions, triangles, .. } = match pose {
            Some(pose) => pose.take(parts, self.accessors, primitive)?,
            None => parts,
        };
        let material = self.materials.place_of(primitive.material.map(|material| material.value()));
        let corners = self.corners(primitive, count, material)?;
        Ok(Some(Shape { positions, triangles, corners, material }))
    }

    /// The colours and texture coordinates of the vertices, if the material reads them or they have colours.
    fn corners(
        &self,
        primitive: &Primitive,
        count: usize,
        material: u32,
    ) -> Result<Option<Vec<Corner>>, Error> {
        let mut corners = vec![Corner::default(); count];
        let colours = self.colours(primitive, count)?;
        let mut is_needed = colours.is_some();
        for (corner, color) in corners.iter_mut().zip(colours.into_iter().flatten()) {
            corner.color = color;
        }
        let mut sets: BTreeMap<u32, Vec<[f32; 2]>> = BTreeMap::new();
        let Coordinates { base, emission, metallic } = &self.materials.coordinates[material as usize];
        let slots: [fn(&mut Corner) -> &mut [f32; 2]; 3] =
            [|corner| &mut corner.base, |corner| &mut corner.emission, |corner| &mut corner.metallic];
        for (placement, slot) in [base, emission, metallic].into_iter().zip(slots) {
            let Some((set, transform)) = placement else { continue };
            if !sets.contains_key(set) {
                let read = attribute::<2>(self.accessors, primitive, Semantic::TexCoords(*set), Some(count))?;
                sets.insert(*set, read.unwrap_or_else(|| vec![[0.0; 2]; count]));
            }
            is_needed = true;
            for (corner, at) in corners.iter_mut().zip(sets.get(set).into_iter().flatten()) {
                *slot(corner) = transform.apply(at.map(f64::from)).map(|x| x as f32);
            }
        }
        Ok(is_needed.then_some(corners))
    }

    /// COLOR_0, linear: three numbers and an alpha of 1, or four.
    fn colours(&self, primitive: &Primitive, count: usize) -> Result<Option<Vec<[f32; 4]>>, Error> {
        let Some(accessor) = Document::attribute(primitive, Semantic::Colors(0)) else { return Ok(None) };
        let here = |error: Error| error.within("attributes.COLOR_0");
        let has_alpha =
            matches!(self.document.accessor(accessor).map_err(here)?.0.type_, Checked::Valid(Type::Vec4));
        if has_alpha {
            return self.accessors.vectors::<4>(accessor, Some(count)).map(Some).map_err(here);
        }
        let colours = self.accessors.vectors::<3>(accessor, Some(count)).map_err(here)?;
        Ok(Some(colours.into_iter().map(|[red, green, blue]| [red, green, blue, 1.0]).collect()))
    }
}
