//! Skins (section 3.7.3.3): vertices where their joints take them. All joints are as they rest.

use glam::{DAffine3, DMat3};
use mesh::Parts;

use super::accessors::Accessors;
use super::document::{Document, Primitive};
use super::in_our_frame;
use crate::error::Error;

/// Where the joints of a skin take what hangs on them.
pub(super) struct Pose {
    /// For each joint, the map from the mesh's coordinates to the scene's.
    joints: Vec<DAffine3>,
}

impl Pose {
    /// The pose of a skin among nodes that are where they are.
    pub(super) fn new(
        document: &Document,
        accessors: &Accessors<'_>,
        skin: usize,
        nodes: &[Option<DAffine3>],
    ) -> Result<Self, Error> {
        let skin = document.skins.get(skin).ok_or_else(|| Error::damaged("there is no such skin"))?;
        let place = |(joint, &node): (usize, &usize)| {
            nodes.get(node).copied().flatten().ok_or_else(|| {
                Error::damaged(format!("joints[{joint}]: there is no node {node} in the scene"))
            })
        };
        let mut joints = skin.joints.iter().enumerate().map(place).collect::<Result<Vec<_>, _>>()?;
        if let Some(accessor) = skin.inverse_bind_matrices {
            let inverse = accessors.matrices(accessor, joints.len());
            let inverse = inverse.map_err(|error| error.within("inverseBindMatrices"))?;
            for (joint, m) in joints.iter_mut().zip(inverse) {
                let columns = [0, 4, 8, 12].map(|at| [m[at], m[at + 1], m[at + 2]].map(f64::from));
                *joint *= in_our_frame(DAffine3::from_cols_array_2d(&columns));
            }
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
        let four = |name: &str| {
            let accessor = primitive.attributes.get(name).ok_or_else(|| {
                Error::damaged(format!("attributes.{name} is missing, and a node gives the mesh a skin"))
            })?;
            let read = accessors.vectors::<4>(*accessor, Some(count));
            read.map_err(|error| error.within(format!("attributes.{name}")))
        };
        let mut maps = vec![(DAffine3::from_mat3(DMat3::ZERO), 0.0); count];
        let sets =
            (0..).take_while(|set| *set == 0 || primitive.attributes.contains_key(&format!("JOINTS_{set}")));
        for set in sets {
            let (joints, weights) = (four(&format!("JOINTS_{set}"))?, four(&format!("WEIGHTS_{set}"))?);
            for ((map, sum), (joints, weights)) in maps.iter_mut().zip(joints.into_iter().zip(weights)) {
                for (joint, weight) in joints.into_iter().zip(weights.map(f64::from)) {
                    if weight == 0.0 {
                        continue;
                    }
                    let by = self.joints.get(joint as usize).ok_or_else(|| {
                        let known = self.joints.len();
                        Error::damaged(format!("attributes.JOINTS_{set}: joint {joint} of a skin of {known}"))
                    })?;
                    map.matrix3 += by.matrix3 * weight;
                    map.translation += by.translation * weight;
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
