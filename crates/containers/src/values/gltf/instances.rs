//! EXT_mesh_gpu_instancing: a node's mesh at several places, by three accessors that are all optional.

use glam::{DAffine3, DQuat};
use gltf::json::Node;
use serde_json::Value;

use super::accessors::Accessors;
use super::document::Document;
use super::frame::in_our_frame;
use crate::error::Error;

const NAME: &str = "EXT_mesh_gpu_instancing";

/// The instances of a node's mesh.
pub(super) struct Instances {
    pub(super) count: usize,
    node: usize,
    translation: Option<usize>,
    rotation: Option<usize>,
    scale: Option<usize>,
}

impl Instances {
    /// The instances that a node declares, if it does.
    pub(super) fn of(document: &Document, index: usize, node: &Node) -> Result<Option<Self>, Error> {
        let declared = node.extensions.as_ref().and_then(|extensions| extensions.others.get(NAME));
        let Some(declared) = declared else { return Ok(None) };
        let here = |error: Error| error.within(NAME).within(format!("nodes[{index}]"));
        let attributes = declared.get("attributes").and_then(Value::as_object);
        let attributes = attributes.filter(|attributes| !attributes.is_empty());
        let attributes =
            attributes.ok_or_else(|| here(Error::damaged("expected `attributes`, such as TRANSLATION")))?;
        let mut counts = Vec::new();
        for (name, accessor) in attributes {
            let accessor = accessor.as_u64().and_then(|accessor| usize::try_from(accessor).ok());
            let accessor = accessor
                .ok_or_else(|| here(Error::damaged("expected the number of an accessor").within(name)))?;
            let (_, count) = document.accessor(accessor).map_err(|error| here(error.within(name)))?;
            counts.push((name, accessor, count));
        }
        let (first, _, count) = counts[0];
        if let Some((other, _, found)) = counts.iter().find(|(_, _, found)| *found != count) {
            return Err(here(Error::damaged(format!(
                "{first} has {count} elements and {other} has {found}; expected one of each for every instance"
            ))));
        }
        let accessor =
            |wanted: &str| counts.iter().find(|(name, ..)| *name == wanted).map(|(_, accessor, _)| *accessor);
        Ok(Some(Self {
            count,
            node: index,
            translation: accessor("TRANSLATION"),
            rotation: accessor("ROTATION"),
            scale: accessor("SCALE"),
        }))
    }

    /// The accessors that the places are read from.
    pub(super) fn accessors(&self) -> impl Iterator<Item = usize> {
        [self.translation, self.rotation, self.scale].into_iter().flatten()
    }

    /// The map of each instance from the mesh's coordinates to the node's, in Specula's frame.
    pub(super) fn places(&self, accessors: &Accessors<'_>) -> Result<Vec<DAffine3>, Error> {
        let here = |error: Error| error.within(NAME).within(format!("nodes[{}]", self.node));
        let translations = vectors::<3>(accessors, "TRANSLATION", self.translation).map_err(here)?;
        let rotations = vectors::<4>(accessors, "ROTATION", self.rotation).map_err(here)?;
        let scales = vectors::<3>(accessors, "SCALE", self.scale).map_err(here)?;
        let place = |index: usize| {
            let rotation = match &rotations {
                Some(rotations) => {
                    let rotation = DQuat::from_array(rotations[index].map(f64::from));
                    if !(rotation.length() > 1e-6 && rotation.is_finite()) {
                        return Err(here(Error::damaged(format!(
                            "ROTATION: {rotation} of instance {index} is not a quaternion of length 1"
                        ))));
                    }
                    rotation.normalize()
                }
                None => DQuat::IDENTITY,
            };
            let vector = |vectors: &Option<Vec<[f32; 3]>>, default: f32| {
                vectors.as_ref().map_or([default; 3], |vectors| vectors[index]).map(f64::from).into()
            };
            Ok(in_our_frame(DAffine3::from_scale_rotation_translation(
                vector(&scales, 1.0),
                rotation,
                vector(&translations, 0.0),
            )))
        };
        (0..self.count).map(place).collect()
    }
}

/// A vector for each instance, if there is such an attribute.
fn vectors<const N: usize>(
    accessors: &Accessors<'_>,
    name: &str,
    accessor: Option<usize>,
) -> Result<Option<Vec<[f32; N]>>, Error> {
    let vectors = accessor.map(|accessor| accessors.vectors(accessor, None)).transpose();
    vectors.map_err(|error| error.within(name))
}
