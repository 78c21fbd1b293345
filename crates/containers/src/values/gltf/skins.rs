//! Skins (section 3.7.3.3): vertices follow their joints, which are all at rest.

use glam::{DAffine3, DMat3};
use gltf::json::mesh::{Primitive, Semantic};
use gltf::json::{Index, Node};
use mesh::Parts;

use super::accessors::Accessors;
use super::document::Document;
use super::frame::affine;
use crate::error::Error;

/// The places of a skin's joints.
pub(super) struct Pose {
    /// For each joint, the map from the mesh's coordinates to the scene's.
    joints: Vec<DAffine3>,
}

impl Pose {
    /// The pose of a skin, among nodes at their places in the scene.
    pub(super) fn new(
        document: &Document,
        accessors: &Accessors<'_>,
        skin: usize,
        nodes: &[Option<DAffine3>],
    ) -> Result<Self, Error> {
        let skin = document.root.skins.get(skin).ok_or_else(|| Error::damaged("there is no such skin"))?;
        let place = |(joint, node): (usize, &Index<Node>)| {
            nodes.get(node.value()).copied().flatten().ok_or_else(|| {
                Error::damaged(format!("joints[{joint}]: there is no node {node} in the scene"))
            })
        };
        let mut joints = skin.joints.iter().enumerate().map(place).collect::<Result<Vec<_>, _>>()?;
        if let Some(accessor) = skin.inverse_bind_matrices {
            let inverse = accessors.matrices(accessor.value(), joints.len());
            let inverse = inverse.map_err(|error| error.within("inverseBindMatrices"))?;
            joints.iter_mut().zip(inverse).for_each(|(joint, matrix)| *joint *= affine(matrix));
        }
        Ok(Self { joints })
    }

    /// A primitive in this pose: each vertex by the mean of its joints' maps, by their weights.
    pub(super) fn take(
        &self,
        parts: Parts,
        accessors: &Accessors<'_>,
        primitive: &Primitive,
    ) -> Result<Parts, Error> {
        let count = parts.positions.len();
        let four = |semantic: Semantic| {
            let name = semantic.to_string();
            let accessor = Document::attribute(primitive, semantic).ok_or_else(|| {
                Error::damaged(format!("attributes.{name} is missing, and a node gives the mesh a skin"))
            })?;
            let read = accessors.vectors::<4>(accessor, Some(count));
            read.map_err(|error| error.within(format!("attributes.{name}")))
        };
        let mut maps = vec![(DAffine3::from_mat3(DMat3::ZERO), 0.0); count];
        let has_set = |set: &u32| Document::attribute(primitive, Semantic::Joints(*set)).is_some();
        for set in (0..).take_while(|set| *set == 0 || has_set(set)) {
            let (joints, weights) = (four(Semantic::Joints(set))?, four(Semantic::Weights(set))?);
            for ((map, sum), (joints, weights)) in maps.iter_mut().zip(joints.into_iter().zip(weights)) {
                for (joint, weight) in joints.into_iter().zip(weights.map(f64::from)) {
                    if weight == 0.0 {
                        continue;
                    }
                    let map_of_joint = self.joints.get(joint as usize).ok_or_else(|| {
                        let known = self.joints.len();
                        Error::damaged(format!("attributes.JOINTS_{set}: joint {joint} of a skin of {known}"))
                    })?;
                    map.matrix3 += map_of_joint.matrix3 * weight;
                    map.translation += map_of_joint.translation * weight;
                    *sum += weight;
                }
            }
        }
        // Weights sum to 1 but for rounding; a vertex of no joint stays where the mesh has it.
        Ok(parts.posed(|vertex| match maps[vertex] {
            (_, 0.0) => DAffine3::IDENTITY,
            (map, sum) => DAffine3 { matrix3: map.matrix3 * sum.recip(), translation: map.translation / sum },
        }))
    }
}
