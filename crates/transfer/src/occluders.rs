//! What rays may hit: the triangles of a mesh in a hierarchy of boxes (obvhs).

use glam::{DVec3, Vec3};
use mesh::Mesh;
use obvhs::BvhBuildParams;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::builder::build_bvh2_from_tris;
use obvhs::bvh2::node::Bvh2Node;
use obvhs::ray::Ray;
use obvhs::triangle::Triangle;
use sphere::Direction;

use crate::frames::{Frames, single};

/// Triangles that block light from both sides.
pub struct Occluders {
    tree: Bvh2,
    /// The nodes of the tree, as packets of rays read them.
    pub(crate) nodes: Vec<Node>,
    /// In the order of the leaves.
    pub(crate) triangles: Vec<Facet>,
    /// The vertices of each.
    pub(crate) corners: Vec<[u32; 3]>,
    /// The ball around all triangles: rays are cast in its coordinates, so that tolerances are shares of it.
    centre: DVec3,
    radius: f64,
}

/// A box around two others or around triangles.
pub(crate) struct Node {
    /// The least and the greatest coordinates.
    pub(crate) bounds: [[f32; 3]; 2],
    /// The first box in it, which the second one follows, or the first triangle.
    pub(crate) first: u32,
    /// The number of triangles; 0 for a box around boxes.
    pub(crate) count: u32,
}

/// A triangle: a corner, the edges from it, and their cross product.
#[derive(Clone, Copy)]
pub(crate) struct Facet {
    pub(crate) corner: Vec3,
    pub(crate) along: Vec3,
    pub(crate) across: Vec3,
    pub(crate) normal: Vec3,
}

/// How far rays start above a vertex, along its normal, as a share of the radius of all triangles: rounding
/// of positions is 1e-7 of it, and a triangle seen at its own vertices must not block.
const OFFSET: f64 = 5e-5;

/// The most that rays start inside the edge of a surface, as a share of the radius: at the edge itself, where
/// a floor meets a wall, they would start in the wall's plane and pass it.
const INSIDE: f64 = 1e-4;

/// How far beyond a triangle's edges a ray still hits it, as a share of the triangle: rounding must not let
/// rays pass between two triangles with a common edge.
pub(crate) const WIDER: f32 = 1e-5;

/// By how much boxes grow on each side, as a share of the radius of all triangles: rounding must not lose
/// what lies in a flat one.
const GROWN: f32 = 1e-6;

impl Occluders {
    /// The triangles of a mesh; those without an area block nothing and are left out.
    pub fn of(mesh: &Mesh) -> Self {
        let (centre, radius) = mesh.bounds();
        let (centre, radius) = (DVec3::from_array(centre), if radius > 0.0 { radius } else { 1.0 });
        let (tree, nodes) = (Bvh2::default(), Vec::new());
        let none = Self { tree, nodes, triangles: Vec::new(), corners: Vec::new(), centre, radius };
        let corner = |vertex: u32| none.scaled(mesh.positions()[vertex as usize]).as_vec3a();
        let triangles = mesh.triangles().iter().map(|corners| {
            let [v0, v1, v2] = corners.map(corner);
            (Triangle { v0, v1, v2 }, *corners)
        });
        let solid = |(triangle, _): &(Triangle, [u32; 3])| {
            (triangle.v1 - triangle.v0).cross(triangle.v2 - triangle.v0).length_squared() > 0.0
        };
        let (triangles, corners): (Vec<Triangle>, Vec<[u32; 3]>) = triangles.filter(solid).unzip();
        if triangles.is_empty() {
            return none;
        }
        let params =
            BvhBuildParams { pre_split: false, max_prims_per_leaf: 4, ..BvhBuildParams::medium_build() };
        let tree = build_bvh2_from_tris(&triangles, params, &mut std::time::Duration::default());
        let order = || tree.primitive_indices.iter().map(|index| *index as usize);
        let facet = |index: usize| {
            let Triangle { v0, v1, v2 } = triangles[index];
            let (along, across) = (v1 - v0, v2 - v0);
            Facet {
                corner: v0.into(),
                along: along.into(),
                across: across.into(),
                normal: along.cross(across).into(),
            }
        };
        let (facets, corners): (Vec<Facet>, Vec<[u32; 3]>) =
            order().map(|index| (facet(index), corners[index])).unzip();
        let nodes = tree.nodes.iter().map(Node::of).collect();
        Self { tree, nodes, triangles: facets, corners, centre, radius }
    }

    /// Whether there is nothing that could be hit.
    pub fn is_empty(&self) -> bool {
        self.triangles.is_empty()
    }

    /// How far rays start above a point, along its normal.
    pub fn offset(&self) -> f32 {
        (OFFSET * self.radius) as f32
    }

    /// The boxes around the triangles, in the coordinates of the ball.
    pub(crate) fn tree(&self) -> &Bvh2 {
        &self.tree
    }

    /// The corners of the triangles, in the order of the leaves and in the coordinates of the ball.
    pub(crate) fn corners(&self) -> impl Iterator<Item = [Vec3; 3]> {
        let corners =
            |Facet { corner, along, across, .. }: &Facet| [*corner, *corner + *along, *corner + *across];
        self.triangles.iter().map(corners)
    }

    /// Whether a ray from above a point of the mesh hits a triangle.
    pub fn block(&self, position: [f32; 3], normal: [f32; 3], direction: Direction) -> bool {
        if self.is_empty() {
            return false;
        }
        let normal = DVec3::from_array(normal.map(f64::from));
        let origin = (self.scaled(position) + normal * OFFSET).as_vec3();
        let ray = Ray::new(origin.into(), single(direction).into(), 0.0, f32::INFINITY);
        !self.tree.ray_traverse_miss(ray, |ray, index| self.triangles[index].distance(ray))
    }

    /// A point in the coordinates of the ball.
    fn scaled(&self, position: [f32; 3]) -> DVec3 {
        (DVec3::from_array(position.map(f64::from)) - self.centre) / self.radius
    }

    /// A point given in the coordinates of the ball.
    pub(crate) fn unscaled(&self, position: Vec3) -> Vec3 {
        (position.as_dvec3() * self.radius + self.centre).as_vec3()
    }

    /// Where the rays of a vertex start.
    pub(crate) fn origin(&self, frames: &Frames, vertex: usize) -> Vec3 {
        let [normal, inward] =
            [frames.normal(vertex), frames.inward(vertex)].map(|v| DVec3::from_array(v.map(f64::from)));
        let inward = inward / self.radius;
        let step = inward * (INSIDE / inward.length().max(INSIDE));
        (self.scaled(frames.positions()[vertex]) + step + normal * OFFSET).as_vec3()
    }
}

impl std::fmt::Debug for Occluders {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Occluders").field("triangles", &self.triangles.len()).finish_non_exhaustive()
    }
}

impl Node {
    fn of(node: &Bvh2Node) -> Self {
        let (least, most) = (Vec3::from(node.aabb.min) - GROWN, Vec3::from(node.aabb.max) + GROWN);
        Self { bounds: [least.to_array(), most.to_array()], first: node.first_index, count: node.prim_count }
    }
}

impl Facet {
    /// Where along a ray it is hit, from either side; infinite if it is not (as packets do).
    fn distance(&self, ray: &Ray) -> f32 {
        let (origin, direction) = (Vec3::from(ray.origin), Vec3::from(ray.direction));
        let scale = -1.0 / self.normal.dot(direction);
        let from = origin - self.corner;
        let u = from.dot(direction.cross(self.across)) * scale;
        let v = from.dot(self.along.cross(direction)) * scale;
        let t = from.dot(self.normal) * scale;
        let inside = u >= -WIDER && v >= -WIDER && u + v <= 1.0 + WIDER;
        if scale.is_finite() && inside && t >= ray.tmin { t } else { f32::INFINITY }
    }
}
