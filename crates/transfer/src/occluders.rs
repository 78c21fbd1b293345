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
    /// The triangles, in the order of the leaves.
    pub(crate) triangles: Vec<Facet>,
    /// The vertices of each triangle.
    pub(crate) corners: Vec<[u32; 3]>,
    /// The ball around all triangles: rays are cast in its coordinates, so that tolerances are shares of it.
    centre: DVec3,
    radius: f64,
}

/// A box around two others or around triangles.
pub(crate) struct Node {
    /// The least and the greatest coordinates of the box.
    pub(crate) bounds: [[f32; 3]; 2],
    /// The first box in this one, which the second one follows, or the first triangle.
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

/// How far rays start above a point, along its normal, in roundings (2^-24) of the numbers there: of the
/// point's coordinates, and of the size of the triangles that it lies on, from whose corners its height above
/// them is computed. So a triangle seen from a point on it does not block, however large the rest of the mesh
/// is (as in Wächter and Binder, "A Fast and Robust Method for Avoiding Self-Intersection", Ray Tracing Gems,
/// 2019).
const ROUNDINGS: f32 = 8.0;

/// How much farther a point may be from the plane of a triangle that it lies on.
const ON: f32 = 4.0;

/// How much farther rays start inside the edge of a surface: at the edge itself, where a floor meets a wall,
/// they would start in the wall's plane and pass it.
const INSIDE: f64 = 2.0;

/// How far beyond a triangle's edges a ray still hits it, as a share of the triangle: rounding must not let
/// rays pass between two triangles with a common edge.
pub(crate) const WIDER: f32 = 1e-5;

/// The growth of boxes on each side, as a share of the radius of all triangles: rounding must not lose what
/// lies in a flat one.
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
        self.block_from(self.above(position, normal), direction)
    }

    /// Where the rays of a point of the mesh start, in the coordinates of the ball: so high above it that
    /// rounding does not bring it below the triangles that it lies on.
    pub fn above(&self, position: [f32; 3], normal: [f32; 3]) -> Vec3 {
        let normal = DVec3::from_array(normal.map(f64::from));
        (self.scaled(position) + normal * self.clearance(position)).as_vec3()
    }

    /// Whether a ray from a place that [`Occluders::above`] found hits a triangle.
    pub fn block_from(&self, origin: Vec3, direction: Direction) -> bool {
        if self.is_empty() {
            return false;
        }
        let ray = Ray::new(origin.into(), single(direction).into(), 0.0, f32::INFINITY);
        !self.tree.ray_traverse_miss(ray, |ray, index| self.triangles[index].distance(ray))
    }

    /// How far above a point rays start, in the coordinates of the ball.
    fn clearance(&self, position: [f32; 3]) -> f64 {
        let point = self.scaled(position).as_vec3();
        let given = position.iter().fold(0.0_f32, |most, x| most.max(x.abs())) / self.radius as f32;
        let number = point.abs().max_element().max(given);
        f64::from(clearance(number, self.size_at(point, number)))
    }

    /// The longest edge of the triangles that a point lies on, which has coordinates up to `number`; 0 if
    /// there are none.
    fn size_at(&self, point: Vec3, number: f32) -> f32 {
        let (mut size, mut open) = (0.0_f32, Vec::new());
        open.extend(self.nodes.first());
        while let Some(node) = open.pop() {
            let slack = Vec3::splat(ON * clearance(number, 0.0));
            let [least, most] = node.bounds.map(Vec3::from);
            if point.cmplt(least - slack).any() || point.cmpgt(most + slack).any() {
                continue;
            }
            let first = node.first as usize;
            if node.count == 0 {
                open.extend(&self.nodes[first..first + 2]);
                continue;
            }
            for triangle in &self.triangles[first..][..node.count as usize] {
                let own = triangle.size();
                let height = (point - triangle.corner).dot(triangle.normal) / triangle.normal.length();
                if height.abs() <= ON * clearance(number, own) {
                    size = size.max(own);
                }
            }
        }
        size
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
        let position = frames.positions()[vertex];
        let (inward, clearance) = (inward / self.radius, self.clearance(position));
        let most = INSIDE * clearance;
        let step = inward * (most / inward.length().max(most).max(f64::MIN_POSITIVE));
        (self.scaled(position) + step + normal * clearance).as_vec3()
    }
}

/// How far rays start above a point with coordinates up to `number` on triangles up to a size.
fn clearance(number: f32, size: f32) -> f32 {
    ROUNDINGS * 0.5 * f32::EPSILON * (number + size)
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
    /// The length of the triangle's longest edge.
    fn size(&self) -> f32 {
        self.along.length().max(self.across.length()).max((self.across - self.along).length())
    }

    /// The distance along a ray at which the triangle is hit, from either side; infinite if it is not (as
    /// packets do).
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

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use glam::DMat3;

    use super::*;
    use crate::packet::{Blocked, Towards};

    const HEIGHT: f64 = 1.8;
    const HALF: f64 = 2.5;
    const BEFORE: f64 = 0.9;

    /// A wall that stands on a floor, whose middle is `beside` away, and a point of the floor before the
    /// wall; a vertex of the wall's foot is the next one. All are turned, scaled and then moved.
    fn wall(floor: f64, beside: f64, turn: DMat3, scale: f64, shift: f64) -> Mesh {
        let at = |x: f64, y: f64, z: f64| {
            ((turn * DVec3::new(x, y, z)) * scale + DVec3::splat(shift)).as_vec3().to_array()
        };
        let (a, b, f) = (beside - floor, beside + floor, floor);
        let positions = vec![
            at(0.0, 0.0, 0.0),
            at(BEFORE, -HALF, 0.0),
            at(BEFORE, HALF, 0.0),
            at(BEFORE, HALF, HEIGHT),
            at(BEFORE, -HALF, HEIGHT),
            at(a, -f, 0.0),
            at(b, -f, 0.0),
            at(b, f, 0.0),
            at(a, f, 0.0),
        ];
        let (up, along) = ((turn * DVec3::Z).as_vec3(), (turn * DVec3::X).as_vec3());
        let count = positions.len();
        let triangles = vec![[1, 2, 3], [1, 3, 4], [0, 5, 6], [0, 6, 7], [0, 7, 8], [0, 8, 5]];
        let (normals, tangents) = (vec![up.to_array(); count], vec![along.extend(1.0).to_array(); count]);
        Mesh::new(positions, normals, tangents, None, triangles).unwrap()
    }

    /// Whether the wall hides a direction from the point; `None` if that is within 1e-3 of its edges.
    fn hides(v: DVec3) -> Option<bool> {
        let reach = BEFORE / v.x;
        let inside = |slack: f64| {
            v.x > 0.0 && (reach * v.y).abs() < HALF + slack && reach * v.z < HEIGHT + slack && v.z > 0.0
        };
        (inside(-2e-3) == inside(2e-3)).then_some(inside(0.0))
    }

    /// The share of directions that are hidden by mistake or seen by mistake, of those that the wall hides.
    fn mistakes(floor: f64, beside: f64, turn: DMat3, scale: f64, shift: f64) -> f64 {
        let mesh = wall(floor, beside, turn, scale, shift);
        let (frames, occluders) = (Frames::of(&mesh).unwrap(), Occluders::of(&mesh));
        let local: Vec<DVec3> = (0..4000)
            .map(|k| {
                let theta = math::acos(0.999 - 0.998 * (f64::from(k) * 0.618_034).fract());
                Direction::from_angles(theta, 2.0 * PI * f64::from(k) / 4000.0).vector()
            })
            .collect();
        let rays: Vec<_> =
            local.iter().map(|v| Towards::new(Direction::normalised(turn * *v))).enumerate().collect();
        let mut blocked = vec![false; rays.len()];
        let found = |_, index: usize| blocked[index] = true;
        Blocked { occluders: &occluders, frames: &frames, rays: &rays, first: 0, count: 1, found }.run();
        let (mut wrong, mut hidden) = (0, 0);
        for (v, blocked) in local.iter().zip(blocked) {
            if let Some(expected) = hides(*v) {
                hidden += usize::from(expected);
                let single =
                    occluders.block(mesh.positions()[0], mesh.normals()[0], Direction::normalised(turn * *v));
                wrong += usize::from(blocked != expected) + usize::from(single != expected);
            }
        }
        assert!(hidden > 800, "{hidden}");
        wrong as f64 / (2 * hidden) as f64
    }

    /// A floor up to 20,000 times as large as the wall, in the middle of it and at its edge, turned, in tiny
    /// and in huge units, and as far away as single precision still has the wall to a thousandth.
    #[test]
    fn the_shadow_of_a_wall_does_not_depend_on_the_size_of_the_floor() {
        let turned = DMat3::from_rotation_z(0.7) * DMat3::from_rotation_x(1.1);
        for turn in [DMat3::IDENTITY, turned] {
            for floor in [4.0, 40.0, 400.0, 4000.0, 36_000.0] {
                for beside in [0.0, floor - 3.0] {
                    // Heights above the floor are computed to some 2^-24 of its size.
                    let allowed = 0.001 + 2e-6 * floor / HEIGHT;
                    for scale in [1e-9, 1.0, 1e9] {
                        let found = mistakes(floor, beside, turn, scale, 0.0);
                        assert!(found < allowed, "{floor} {beside} {scale}: {found}");
                    }
                }
            }
            for shift in [100.0, 1000.0] {
                let found = mistakes(4.0, 0.0, turn, 1.0, shift);
                assert!(found < 0.005, "{shift}: {found}");
            }
        }
    }

    /// The floor is 8000 wide, so its heights are computed to about a hundredth; the wall is small.
    #[test]
    fn a_point_lies_on_the_triangles_around_it_and_on_no_others() {
        let mesh = wall(4000.0, 0.0, DMat3::IDENTITY, 1.0, 0.0);
        let occluders = Occluders::of(&mesh);
        let clearance = |position| occluders.clearance(position) * occluders.radius;
        let [on_floor, on_wall, in_air] = [[0.0, 0.0, 0.0], [0.9, 0.1, 0.9], [0.5, 0.0, 0.5]].map(clearance);
        assert!(on_floor > 1e-3 && on_floor < 1e-2, "{on_floor}");
        assert!(on_wall < 1e-5 && in_air < 1e-5, "{on_wall} {in_air}");
    }
}
