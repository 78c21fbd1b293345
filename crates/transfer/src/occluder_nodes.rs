//! The triangles that block light as a list of boxes that a shader can walk without a stack.

use glam::Vec3;

use crate::occluders::Occluders;

/// A box around triangles, in depth-first order: a ray that meets the box goes on with the next one, another
/// with the one at `skip`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OccluderNode {
    /// The least coordinates of the box.
    pub min: [f32; 3],
    /// The greatest coordinates of the box.
    pub max: [f32; 3],
    /// The index of the next node that is not in this one's box.
    pub skip: u32,
    /// The index of the first of the box's own triangles.
    pub first: u32,
    /// The number of the box's own triangles; 0 for a box around other boxes.
    pub count: u32,
}

/// The growth of boxes on each side, as a share of the radius of all triangles: they are rounded apart from
/// what is in them.
const ROUNDED: f32 = 1e-6;

impl Occluders {
    /// All boxes, and the corners of the triangles in the order in which the boxes hold them.
    pub fn nodes(&self) -> (Vec<OccluderNode>, Vec<[[f32; 3]; 3]>) {
        let (mut nodes, mut triangles) = (Vec::new(), Vec::new());
        if self.is_empty() {
            return (nodes, triangles);
        }
        let corners: Vec<[[f32; 3]; 3]> =
            self.corners().map(|corners| corners.map(|corner| self.unscaled(corner).to_array())).collect();
        let tree = self.tree();
        // What is still to visit: a node of the tree, or the end of one in the list.
        let mut open = vec![Visit::Node(0)];
        while let Some(visit) = open.pop() {
            let index = match visit {
                Visit::Node(index) => index as usize,
                Visit::End(place) => {
                    let end = nodes.len() as u32;
                    let node: &mut OccluderNode = &mut nodes[place];
                    node.skip = end;
                    continue;
                }
            };
            let node = &tree.nodes[index];
            let first = triangles.len() as u32;
            open.push(Visit::End(nodes.len()));
            if node.is_leaf() {
                triangles.extend(&corners[node.first_index as usize..][..node.prim_count as usize]);
            } else {
                open.extend([node.first_index + 1, node.first_index].map(Visit::Node));
            }
            nodes.push(OccluderNode {
                min: self.unscaled(Vec3::from(node.aabb.min) - ROUNDED).to_array(),
                max: self.unscaled(Vec3::from(node.aabb.max) + ROUNDED).to_array(),
                skip: 0,
                first,
                count: triangles.len() as u32 - first,
            });
        }
        (nodes, triangles)
    }
}

enum Visit {
    Node(u32),
    End(usize),
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Each box lies in those around it, and each triangle in its box; no triangle is lost.
    #[test]
    fn every_triangle_lies_in_its_boxes() {
        let knot = mesh::shape("torus-knot").unwrap();
        let (nodes, triangles) = Occluders::of(&knot).nodes();
        assert_eq!(triangles.len(), knot.triangles().len());
        let inside = |node: &OccluderNode, at: [f32; 3]| {
            (0..3).all(|axis| node.min[axis] <= at[axis] && at[axis] <= node.max[axis])
        };
        let mut seen = 0;
        for (place, node) in nodes.iter().enumerate() {
            assert!(node.skip as usize > place && node.skip as usize <= nodes.len());
            for within in &nodes[place + 1..node.skip as usize] {
                assert!(inside(node, within.min) && inside(node, within.max));
            }
            assert!((node.count == 0) == (node.skip as usize > place + 1), "only leaves have triangles");
            for corner in triangles[node.first as usize..][..node.count as usize].as_flattened() {
                assert!(inside(node, *corner));
            }
            assert!(node.count == 0 || node.first == seen);
            seen += node.count;
        }
        assert_eq!(seen as usize, triangles.len());
        let empty = mesh::Mesh::joined(&[]).unwrap();
        assert!(Occluders::of(&empty).nodes().0.is_empty());
    }
}
