//! Rays for eight vertices at a time and in one direction.
//!
//! The direction is nearly all that is to be known of a triangle: its three products with it serve all eight
//! rays, and boxes are compared with all of them at once. Neighbouring vertices see nearly the same boxes.
//! Directions are taken so that each is near the one before it ([`rays`]): the triangle that blocked that one
//! is tried first.

use std::f64::consts::PI;

use glam::Vec3;
use obvhs::ray::safe_inverse;
use pulp::{Simd, WithSimd};
use sh::f64x4::SimdLevel;
use sphere::Direction;

use crate::directions::Directions;
use crate::frames::{Frames, LANES, single};
use crate::occluders::{Facet, Node, Occluders, WIDER};
use crate::vectors::load;

/// A direction of rays.
#[derive(Clone, Copy)]
pub(crate) struct Towards {
    pub(crate) direction: Vec3,
    inverse: Vec3,
    /// For each axis, whether rays enter boxes at the greatest coordinate.
    down: [usize; 3],
}

/// Eight rays of one direction, and what they met.
pub(crate) struct Packet {
    /// The places where the rays start: x, y and z of each.
    pub(crate) origins: [[f32; LANES]; 3],
    /// The length of each ray; below zero if it is not cast, or was stopped by the first thing it met.
    pub(crate) reach: [f32; LANES],
    /// The triangle that each ray met, or [`NONE`].
    met: [u32; LANES],
    /// The weights of the triangle's second and third corner.
    weights: [[f32; LANES]; 2],
    /// The triangle that was found last, which may block the next direction too.
    blocker: u32,
}

/// The rays of a packet in registers.
struct Rays<S: Simd> {
    origins: [S::f32s; 3],
    /// The inverse of the direction, and the product of the origins and it.
    inverse: [S::f32s; 3],
    scaled: [S::f32s; 3],
    reach: S::f32s,
    met: S::u32s,
    weights: [S::f32s; 2],
}

/// The place at which a ray meets the nearest triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Hit {
    /// The vertices of the triangle.
    pub(crate) corners: [u32; 3],
    /// The weight of each corner; they sum to 1.
    pub(crate) weights: [f32; 3],
    /// Whether the ray comes from the side from which the corners are counter-clockwise.
    pub(crate) front: bool,
}

/// The index that stands for no triangle.
const NONE: u32 = u32::MAX;

impl Towards {
    pub(crate) fn new(direction: Direction) -> Self {
        let direction = single(direction);
        let inverse = direction.to_array().map(safe_inverse);
        let down = inverse.map(|inverse| usize::from(inverse < 0.0));
        Self { direction, inverse: Vec3::from_array(inverse), down }
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
            blocker: NONE,
        }
    }

    /// Lets the rays that `is_cast` names reach so far; the others are not cast. Returns whether any is cast.
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

    /// Returns the place at which a ray met a triangle, if it did.
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
    pub(crate) fn trace<S: Simd, const ANY: bool>(
        &mut self,
        simd: S,
        occluders: &Occluders,
        towards: &Towards,
        open: &mut Vec<u32>,
    ) {
        let mut rays = Rays::<S>::new(simd, self, towards);
        self.blocker = rays.trace::<ANY>(simd, occluders, towards, self.blocker, open);
        self.reach = pulp::cast(rays.reach);
        self.met = pulp::cast(rays.met);
        self.weights = rays.weights.map(pulp::cast);
    }
}

impl<S: Simd> Rays<S> {
    #[inline(always)]
    fn new(simd: S, packet: &Packet, towards: &Towards) -> Self {
        let origins = packet.origins.map(|origins| load(simd, &origins));
        let inverse = towards.inverse.to_array().map(|inverse| simd.splat_f32s(inverse));
        let scaled = [0, 1, 2].map(|axis| simd.mul_f32s(origins[axis], inverse[axis]));
        Self {
            origins,
            inverse,
            scaled,
            reach: load(simd, &packet.reach),
            met: simd.splat_u32s(NONE),
            weights: [simd.splat_f32s(0.0); 2],
        }
    }

    /// Casts the rays; returns the triangle that was found last, at first `blocker`.
    #[inline(always)]
    fn trace<const ANY: bool>(
        &mut self,
        simd: S,
        occluders: &Occluders,
        towards: &Towards,
        mut blocker: u32,
        open: &mut Vec<u32>,
    ) -> u32 {
        if let Some(triangle) = occluders.triangles.get(blocker as usize).filter(|_| ANY) {
            self.meet::<ANY>(simd, triangle, blocker, towards.direction);
            if self.is_done(simd) {
                return blocker;
            }
        }
        let nodes = occluders.nodes.as_slice();
        open.clear();
        open.extend(nodes.first().filter(|root| self.cross(simd, root, towards)).map(|_| 0));
        while let Some(index) = open.pop() {
            let mut node = &nodes[index as usize];
            while node.count == 0 {
                let (a, b) = (&nodes[node.first as usize], &nodes[node.first as usize + 1]);
                match (self.cross(simd, a, towards), self.cross(simd, b, towards)) {
                    (true, true) => {
                        // The nearer one is looked into first.
                        let far = usize::from(!is_far(a, b, towards.direction));
                        open.push(node.first + far as u32);
                        node = [a, b][1 - far];
                    }
                    (true, false) => node = a,
                    (false, true) => node = b,
                    (false, false) => break,
                }
            }
            let triangles = occluders.triangles[node.first as usize..].iter().zip(node.first..);
            for (triangle, index) in triangles.take(node.count as usize) {
                if self.meet::<ANY>(simd, triangle, index, towards.direction) {
                    blocker = index;
                }
            }
            if ANY && self.is_done(simd) {
                break;
            }
        }
        blocker
    }

    /// Whether all rays have ended.
    #[inline(always)]
    fn is_done(&self, simd: S) -> bool {
        !any(simd, simd.greater_than_or_equal_f32s(self.reach, simd.splat_f32s(0.0)))
    }

    /// Whether any ray passes a box.
    #[inline(always)]
    fn cross(&self, simd: S, node: &Node, towards: &Towards) -> bool {
        let (mut enters, mut leaves) = (simd.splat_f32s(0.0), self.reach);
        for axis in 0..3 {
            let down = towards.down[axis];
            let place = |bound: usize| {
                let bound = simd.splat_f32s(node.bounds[bound & 1][axis]);
                simd.mul_add_f32s(bound, self.inverse[axis], simd.neg_f32s(self.scaled[axis]))
            };
            enters = simd.max_f32s(enters, place(down));
            leaves = simd.min_f32s(leaves, place(1 - down));
        }
        any(simd, simd.less_than_or_equal_f32s(enters, leaves))
    }

    /// Looks where the rays hit a triangle, from either side (Möller and Trumbore, "Fast, Minimum Storage
    /// Ray/Triangle Intersection", 1997, with the products regrouped by what the rays have in common).
    /// Whether any does.
    #[inline(always)]
    fn meet<const ANY: bool>(&mut self, simd: S, triangle: &Facet, index: u32, direction: Vec3) -> bool {
        let scale = -1.0 / triangle.normal.dot(direction);
        // Rays in the triangle's plane hit nothing.
        if !scale.is_finite() {
            return false;
        }
        let corner = triangle.corner.to_array();
        let from = [0, 1, 2].map(|axis| simd.sub_f32s(self.origins[axis], simd.splat_f32s(corner[axis])));
        let product = |vector: Vec3| {
            let vector = vector.to_array().map(|value| simd.splat_f32s(value));
            let sum = simd.mul_add_f32s(from[1], vector[1], simd.mul_f32s(from[0], vector[0]));
            simd.mul_add_f32s(from[2], vector[2], sum)
        };
        let u = product(direction.cross(triangle.across) * scale);
        let v = product(triangle.along.cross(direction) * scale);
        let t = product(triangle.normal * scale);
        let least = simd.splat_f32s(-WIDER);
        let inside = simd.less_than_or_equal_f32s(simd.add_f32s(u, v), simd.splat_f32s(1.0 + WIDER));
        let inside = simd.and_m32s(inside, simd.greater_than_or_equal_f32s(u, least));
        let inside = simd.and_m32s(inside, simd.greater_than_or_equal_f32s(v, least));
        let near = simd.less_than_f32s(t, self.reach);
        let near = simd.and_m32s(near, simd.greater_than_or_equal_f32s(t, simd.splat_f32s(0.0)));
        let met = simd.and_m32s(inside, near);
        if !any(simd, met) {
            return false;
        }
        self.met = simd.select_u32s(met, simd.splat_u32s(index), self.met);
        self.reach = simd.select_f32s(met, if ANY { simd.splat_f32s(-1.0) } else { t }, self.reach);
        if !ANY {
            self.weights[0] = simd.select_f32s(met, u, self.weights[0]);
            self.weights[1] = simd.select_f32s(met, v, self.weights[1]);
        }
        true
    }
}

/// Whether one of eight is true.
#[inline(always)]
fn any<S: Simd>(simd: S, mask: S::m32s) -> bool {
    let lanes: [u32; LANES] =
        pulp::cast(simd.select_u32s(mask, simd.splat_u32s(u32::MAX), simd.splat_u32s(0)));
    lanes.iter().fold(0, |any, lane| any | lane) != 0
}

/// Whether the centre of a box is farther along a direction than that of another.
#[inline(always)]
fn is_far(a: &Node, b: &Node, direction: Vec3) -> bool {
    let centre = |node: &Node| Vec3::from(node.bounds[0]) + Vec3::from(node.bounds[1]);
    (centre(a) - centre(b)).dot(direction) > 0.0
}

/// The directions of rays, each near the one before it, which the same triangle often blocks: along bands of
/// nearly the same height, to and fro.
pub(crate) fn rays(directions: &Directions) -> Vec<(usize, Towards)> {
    let bands = (directions.directions().len() as f64).sqrt();
    let key = |index: usize| {
        let direction = directions.directions()[index];
        let band = (direction.theta() / PI * bands) as usize;
        (band, if band.is_multiple_of(2) { direction.phi() } else { -direction.phi() })
    };
    let mut order: Vec<(usize, (usize, f64))> =
        (0..directions.directions().len()).map(|index| (index, key(index))).collect();
    order.sort_by(|(_, a), (_, b)| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
    order.into_iter().map(|(index, _)| (index, Towards::new(directions.directions()[index]))).collect()
}

/// The directions above the horizons of up to eight vertices that are blocked.
pub(crate) struct Blocked<'a, F> {
    pub(crate) occluders: &'a Occluders,
    pub(crate) frames: &'a Frames,
    /// The directions in the order of [`rays`].
    pub(crate) rays: &'a [(usize, Towards)],
    pub(crate) first: usize,
    pub(crate) count: usize,
    /// The function that is told each one: the vertex, counted from `first`, and the direction, in the order
    /// of the rays.
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
    fn with_simd<S: Simd>(mut self, simd: S) -> [usize; LANES] {
        let mut cast = [0; LANES];
        let mut packet = Packet::new(self.occluders, self.frames, self.first, self.count);
        let mut open = Vec::new();
        for (index, towards) in self.rays {
            let above = above(self.frames, self.first, self.count, towards);
            if !packet.aim(f32::INFINITY, |lane| above[lane]) {
                continue;
            }
            packet.trace::<S, true>(simd, self.occluders, towards, &mut open);
            for lane in 0..self.count {
                cast[lane] += usize::from(above[lane]);
                if packet.is_blocked(lane) {
                    (self.found)(lane, *index);
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
    use glam::DVec3;
    use mesh::Mesh;

    use super::*;

    struct TraceNearest<'a>(&'a mut Packet, &'a Occluders, &'a Towards);

    impl WithSimd for TraceNearest<'_> {
        type Output = ();

        #[inline(always)]
        fn with_simd<S: Simd>(self, simd: S) {
            self.0.trace::<S, false>(simd, self.1, self.2, &mut Vec::new());
        }
    }

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
                SimdLevel::detect().run(TraceNearest(&mut packet, &sphere, &towards));
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
            let rays: Vec<_> =
                directions.iter().map(|direction| Towards::new(*direction)).enumerate().collect();
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
        let rays: Vec<_> = directions.iter().map(|direction| Towards::new(*direction)).enumerate().collect();
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
