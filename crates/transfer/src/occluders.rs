//! What rays may hit: the triangles of a mesh in a hierarchy of boxes (obvhs).
//!
//! Rays are cast for eight vertices at a time and in one direction, which is nearly all that is to be known
//! of a triangle: its three products with the direction serve all eight, and boxes are compared with all of
//! them at once. Neighbouring vertices see nearly the same boxes.

use glam::{DVec3, Vec3};
use mesh::Mesh;
use obvhs::BvhBuildParams;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::builder::build_bvh2_from_tris;
use obvhs::bvh2::node::Bvh2Node;
use obvhs::ray::{Ray, safe_inverse};
use obvhs::triangle::Triangle;
use pulp::{Simd, WithSimd};
use sh::f64x4::SimdLevel;
use sphere::Direction;

use crate::frames::{Frames, LANES, single};

/// Triangles that block light from both sides.
pub struct Occluders {
    tree: Bvh2,
    /// In the order of the leaves.
    triangles: Vec<Facet>,
    /// The vertices of each.
    corners: Vec<[u32; 3]>,
    /// The ball around all triangles: rays are cast in its coordinates, so that tolerances are shares of it.
    centre: DVec3,
    radius: f64,
}

/// A triangle: a corner, the edges from it, and their cross product.
#[derive(Clone, Copy)]
struct Facet {
    corner: Vec3,
    along: Vec3,
    across: Vec3,
    normal: Vec3,
}

/// A direction of rays.
#[derive(Clone, Copy)]
pub(crate) struct Towards {
    pub(crate) direction: Vec3,
    inverse: Vec3,
}

/// Eight rays of one direction, and what they met.
pub(crate) struct Packet {
    /// Where they start: x, y and z of each.
    pub(crate) origins: [[f32; LANES]; 3],
    /// How far each reaches; below zero if it is not cast, or was stopped by the first thing it met.
    pub(crate) reach: [f32; LANES],
    /// The triangle that each met, or [`NONE`].
    met: [u32; LANES],
    /// The weights of the triangle's second and third corner.
    weights: [[f32; LANES]; 2],
}

/// The place at which a ray meets the nearest triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Hit {
    /// The vertices of the triangle.
    pub(crate) corners: [u32; 3],
    /// The weight of each; they sum to 1.
    pub(crate) weights: [f32; 3],
    /// Whether the ray comes from the side from which the corners are counter-clockwise.
    pub(crate) front: bool,
}

/// How far rays start above a vertex, along its normal, as a share of the radius of all triangles: rounding
/// of positions is 1e-7 of it, and a triangle seen at its own vertices must not block.
const OFFSET: f64 = 5e-5;

/// The most that rays start inside the edge of a surface, as a share of the radius: at the edge itself, where
/// a floor meets a wall, they would start in the wall's plane and pass it.
const INSIDE: f64 = 1e-4;

/// No triangle.
const NONE: u32 = u32::MAX;

impl Occluders {
    /// The triangles of a mesh; those without an area block nothing and are left out.
    pub fn of(mesh: &Mesh) -> Self {
        let (centre, radius) = mesh.bounds();
        let (centre, radius) = (DVec3::from_array(centre), if radius > 0.0 { radius } else { 1.0 });
        let none = Self { tree: Bvh2::default(), triangles: Vec::new(), corners: Vec::new(), centre, radius };
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
        Self { tree, triangles: facets, corners, centre, radius }
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
    fn origin(&self, frames: &Frames, vertex: usize) -> Vec3 {
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

impl Facet {
    /// Where along a ray it is hit, from either side; infinite if it is not ([`Packet::meet`]).
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

impl Towards {
    pub(crate) fn new(direction: Direction) -> Self {
        let direction = single(direction);
        Self { direction, inverse: Vec3::from_array(direction.to_array().map(safe_inverse)) }
    }
}

impl Packet {
    /// Rays from up to eight vertices, not yet aimed.
    pub(crate) fn new(occluders: &Occluders, frames: &Frames, first: usize, count: usize) -> Self {
        let origins: [Vec3; LANES] =
            std::array::from_fn(|lane| occluders.origin(frames, first + lane.min(count - 1)));
        Self {
            origins: [0, 1, 2].map(|axis| origins.map(|origin| origin[axis])),
            reach: [-1.0; LANES],
            met: [NONE; LANES],
            weights: [[0.0; LANES]; 2],
        }
    }

    /// Lets those that `is_cast` names reach so far; the others are not cast. Whether any is cast.
    #[inline(always)]
    pub(crate) fn aim(&mut self, reach: f32, is_cast: impl Fn(usize) -> bool) -> bool {
        self.met = [NONE; LANES];
        for lane in 0..LANES {
            self.reach[lane] = if is_cast(lane) { reach } else { -1.0 };
        }
        self.reach.iter().any(|reach| *reach >= 0.0)
    }

    /// Whether a ray met a triangle.
    #[inline(always)]
    pub(crate) fn is_blocked(&self, lane: usize) -> bool {
        self.met[lane] != NONE
    }

    /// What a ray met.
    #[inline(always)]
    pub(crate) fn hit(&self, occluders: &Occluders, towards: &Towards, lane: usize) -> Option<Hit> {
        let index = self.met[lane] as usize;
        let triangle = occluders.triangles.get(index)?;
        // Rays may pass just beyond an edge.
        let [u, v] = self.weights.map(|weights| weights[lane].clamp(0.0, 1.0));
        let sum = (u + v).max(1.0);
        let (u, v) = (u / sum, v / sum);
        let front = triangle.normal.dot(towards.direction) < 0.0;
        Some(Hit { corners: occluders.corners[index], weights: [1.0 - u - v, u, v], front })
    }

    /// Casts the rays: with `ANY` each ends at the first triangle that is found, else at the nearest. `open`
    /// is room for the boxes that are still to be looked into.
    #[inline(always)]
    pub(crate) fn trace<const ANY: bool>(
        &mut self,
        occluders: &Occluders,
        towards: &Towards,
        open: &mut Vec<u32>,
    ) {
        open.clear();
        if let Some(root) = occluders.tree.nodes.first()
            && self.crosses(root, towards)
        {
            open.push(0);
        }
        while let Some(index) = open.pop() {
            let node = &occluders.tree.nodes[index as usize];
            let first = node.first_index as usize;
            if node.prim_count > 0 {
                for triangle in first..first + node.prim_count as usize {
                    self.meet::<ANY>(&occluders.triangles[triangle], triangle as u32, towards.direction);
                }
                if ANY && self.reach.iter().all(|reach| *reach < 0.0) {
                    return;
                }
                continue;
            }
            let (a, b) = (&occluders.tree.nodes[first], &occluders.tree.nodes[first + 1]);
            let apart = a.aabb.min + a.aabb.max - b.aabb.min - b.aabb.max;
            let far = if Vec3::from(apart).dot(towards.direction) > 0.0 { 0 } else { 1 };
            // The nearer one is looked into first.
            for child in [far, 1 - far] {
                if self.crosses(&occluders.tree.nodes[first + child], towards) {
                    open.push((first + child) as u32);
                }
            }
        }
    }

    /// Whether any ray passes a box.
    #[inline(always)]
    fn crosses(&self, node: &Bvh2Node, towards: &Towards) -> bool {
        let (least, most) = (node.aabb.min.to_array(), node.aabb.max.to_array());
        let (mut enters, mut leaves) = ([0.0f32; LANES], self.reach);
        for axis in 0..3 {
            let inverse = towards.inverse[axis];
            let up = inverse > 0.0;
            let near = if up { least[axis] } else { most[axis] };
            let far = if up { most[axis] } else { least[axis] };
            for lane in 0..LANES {
                let enter = (near - self.origins[axis][lane]) * inverse;
                let leave = (far - self.origins[axis][lane]) * inverse;
                enters[lane] = if enter > enters[lane] { enter } else { enters[lane] };
                leaves[lane] = if leave < leaves[lane] { leave } else { leaves[lane] };
            }
        }
        let mut any = false;
        for lane in 0..LANES {
            any |= enters[lane] <= leaves[lane] * ROUNDED;
        }
        any
    }

    /// Looks where the rays hit a triangle, from either side (Möller and Trumbore, "Fast, Minimum Storage
    /// Ray/Triangle Intersection", 1997, with the products regrouped by what the rays have in common).
    #[inline(always)]
    fn meet<const ANY: bool>(&mut self, triangle: &Facet, index: u32, direction: Vec3) {
        let scale = -1.0 / triangle.normal.dot(direction);
        // Rays in the triangle's plane hit nothing.
        if !scale.is_finite() {
            return;
        }
        let u = (direction.cross(triangle.across) * scale).to_array();
        let v = (triangle.along.cross(direction) * scale).to_array();
        let t = (triangle.normal * scale).to_array();
        let corner = triangle.corner.to_array();
        let mut products = [[0.0f32; LANES]; 3];
        for axis in 0..3 {
            for lane in 0..LANES {
                let from = self.origins[axis][lane] - corner[axis];
                products[0][lane] += from * u[axis];
                products[1][lane] += from * v[axis];
                products[2][lane] += from * t[axis];
            }
        }
        let [u, v, t] = products;
        for lane in 0..LANES {
            let inside = (u[lane] >= -WIDER) & (v[lane] >= -WIDER) & (u[lane] + v[lane] <= 1.0 + WIDER);
            let met = inside & (t[lane] >= 0.0) & (t[lane] < self.reach[lane]);
            self.met[lane] = if met { index } else { self.met[lane] };
            self.reach[lane] = match (met, ANY) {
                (true, true) => -1.0,
                (true, false) => t[lane],
                _ => self.reach[lane],
            };
            if !ANY {
                self.weights[0][lane] = if met { u[lane] } else { self.weights[0][lane] };
                self.weights[1][lane] = if met { v[lane] } else { self.weights[1][lane] };
            }
        }
    }
}

/// How far beyond a triangle's edges a ray still hits it, as a share of the triangle: rounding must not let
/// rays pass between two triangles with a common edge.
const WIDER: f32 = 1e-5;

/// Boxes are this much longer along a ray: rounding must not lose what lies in a flat one.
const ROUNDED: f32 = 1.0 + 1e-6;

/// The directions above the horizons of up to eight vertices that are blocked.
pub(crate) struct Blocked<'a, F> {
    pub(crate) occluders: &'a Occluders,
    pub(crate) frames: &'a Frames,
    pub(crate) rays: &'a [Towards],
    pub(crate) first: usize,
    pub(crate) count: usize,
    /// Told each one: the vertex, counted from `first`, and the direction, in the order of directions.
    pub(crate) found: F,
}

impl<F: FnMut(usize, usize)> Blocked<'_, F> {
    /// The number of rays that were cast for each vertex.
    pub(crate) fn run(self) -> [usize; LANES] {
        SimdLevel::detect().run(self)
    }
}

impl<F: FnMut(usize, usize)> WithSimd for Blocked<'_, F> {
    type Output = [usize; LANES];

    #[inline(always)]
    fn with_simd<S: Simd>(mut self, _: S) -> [usize; LANES] {
        let mut cast = [0; LANES];
        let mut packet = Packet::new(self.occluders, self.frames, self.first, self.count);
        let mut open = Vec::new();
        for (index, towards) in self.rays.iter().enumerate() {
            let above = above(self.frames, self.first, self.count, towards);
            if !packet.aim(f32::INFINITY, |lane| above[lane]) {
                continue;
            }
            packet.trace::<true>(self.occluders, towards, &mut open);
            for lane in 0..self.count {
                cast[lane] += usize::from(above[lane]);
                if packet.is_blocked(lane) {
                    (self.found)(lane, index);
                }
            }
        }
        cast
    }
}

/// Whether a direction is above the horizon of each of up to eight vertices.
#[inline(always)]
pub(crate) fn above(frames: &Frames, first: usize, count: usize, towards: &Towards) -> [bool; LANES] {
    std::array::from_fn(|lane| {
        lane < count && Vec3::from(frames.normal(first + lane)).dot(towards.direction) > 0.0
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A ray toward a sphere of radius 1 about the origin hits it if its line passes within 1.
    #[test]
    fn rays_hit_what_is_in_their_way() {
        let sphere = Occluders::of(&mesh::shape("sphere").unwrap());
        let bare = Frames::new(vec![[0.0, 0.0, 3.0], [0.0; 3]], &[glam::DMat3::IDENTITY; 2]);
        let mut hits = 0;
        for k in 0..2000 {
            let direction =
                Direction::from_angles(std::f64::consts::PI * (f64::from(k) * 0.618).fract(), f64::from(k));
            let v = direction.vector();
            // From (0, 0, 3): the nearest point is at -3 z, at a distance of 3 sin from the centre.
            let far = 3.0 * v.x.hypot(v.y);
            if (far - 1.0).abs() < 0.01 {
                continue;
            }
            let expected = v.z < 0.0 && far < 1.0;
            assert_eq!(sphere.block([0.0, 0.0, 3.0], [0.0, 0.0, 1.0], direction), expected, "{v}");
            let nearest = |vertex| {
                let (mut packet, towards) = (Packet::new(&sphere, &bare, vertex, 1), Towards::new(direction));
                packet.aim(f32::INFINITY, |lane| lane == 3);
                packet.trace::<false>(&sphere, &towards, &mut Vec::new());
                assert_eq!(packet.hit(&sphere, &towards, 2), None, "a ray that is not cast");
                packet.hit(&sphere, &towards, 3)
            };
            let hit = nearest(0);
            assert!(!nearest(1).unwrap().front);
            assert_eq!(hit.is_some(), expected);
            hits += usize::from(expected);
            if let Some(hit) = hit {
                assert!(hit.front);
                // From the front: the blended place is where the line meets the sphere, but for its facets.
                let unit = mesh::shape("sphere").unwrap();
                let place: DVec3 =
                    hit.corners.iter().zip(hit.weights).fold(DVec3::ZERO, |sum, (k, weight)| {
                        let corner = unit.positions()[*k as usize].map(f64::from);
                        sum + DVec3::from_array(corner) * f64::from(weight)
                    });
                let t = -3.0 * v.z - (1.0 - far * far).sqrt();
                assert!((place - (DVec3::new(0.0, 0.0, 3.0) + v * t)).length() < 0.02, "{place}");
            }
        }
        assert!(hits > 20);
    }

    /// Tolerances are shares of the mesh: a small mesh, or one far away, is not another.
    #[test]
    fn size_and_place_do_not_count() {
        let unit = mesh::shape("torus-knot").unwrap();
        let directions: Vec<_> =
            (0..200).map(|k| Direction::from_angles(0.015 * f64::from(k), f64::from(k))).collect();
        let found = |scale: f32, shift: f32| {
            let place = |p: &[f32; 3]| p.map(|x| x * scale + shift);
            let mesh = Mesh::new(
                unit.positions().iter().map(place).collect(),
                unit.normals().to_vec(),
                unit.tangents().to_vec(),
                None,
                unit.triangles().to_vec(),
            )
            .unwrap();
            let (frames, occluders) = (Frames::of(&mesh).unwrap(), Occluders::of(&mesh));
            let mut blocked = Vec::new();
            let rays: Vec<_> = directions.iter().map(|direction| Towards::new(*direction)).collect();
            for first in (0..frames.len()).step_by(1000) {
                let count = LANES.min(frames.len() - first);
                let found = |lane, index| blocked.push((first + lane, index));
                Blocked { occluders: &occluders, frames: &frames, rays: &rays, first, count, found }.run();
            }
            blocked
        };
        let expected = found(1.0, 0.0);
        assert!(expected.len() > 2000, "{}", expected.len());
        for (scale, shift) in [(1e-4, 0.0), (1e4, 0.0), (1.0, 8.0)] {
            let found = found(scale, shift);
            let same = found.iter().filter(|pair| expected.contains(pair)).count();
            let most = expected.len().max(found.len());
            assert!(most - same < most / 100, "{scale} {shift}: {same} of {most}");
        }
    }

    #[test]
    fn nothing_and_slivers_block_nothing() {
        let line = Mesh::new(
            vec![[0.0, 0.0, 1.0], [1.0, 0.0, 1.0], [2.0, 0.0, 1.0]],
            vec![[0.0, 0.0, 1.0]; 3],
            vec![[1.0, 0.0, 0.0, 1.0]; 3],
            None,
            vec![[0, 1, 2], [0, 0, 1]],
        );
        let empty = Occluders::of(&line.unwrap());
        assert!(empty.is_empty() && !empty.block([0.5, 0.0, 0.0], [0.0, 0.0, 1.0], Direction::Z));
        assert!(Occluders::of(&Mesh::joined(&[]).unwrap()).is_empty());
        // A convex surface does not block its own vertices.
        let sphere = mesh::shape("sphere").unwrap();
        let occluders = Occluders::of(&sphere);
        let directions: Vec<_> =
            (0..500).map(|k| Direction::from_angles(0.006 * f64::from(k), f64::from(k))).collect();
        let rays: Vec<_> = directions.iter().map(|direction| Towards::new(*direction)).collect();
        let frames = Frames::of(&sphere).unwrap();
        let mut found = 0;
        for first in (0..frames.len()).step_by(997) {
            let count = LANES.min(frames.len() - first);
            let found = |_, _| found += 1;
            Blocked { occluders: &occluders, frames: &frames, rays: &rays, first, count, found }.run();
        }
        assert_eq!(found, 0);
    }
}
