//! Single rays against triangles, for paths: what a ray meets first, and whether anything blocks it.
//!
//! The tree of obvhs is collapsed to nodes of four boxes, and a leaf holds up to four triangles side by side
//! (Wald, Benthin and Boulos, "Getting rid of packets", 2008), so that each step is four-wide without the
//! rays having anything in common. Single precision; a ray may hit a triangle 1e-5 of its size beyond its
//! edges, so that none passes between two triangles with a common edge.
//!
//! What a ray meets does not depend on the tree, nor on triangles that it does not come near: boxes are wide
//! enough for all places at which a ray hits a triangle in them.

use std::cmp::Reverse;

use glam::{Vec3, Vec4};
use obvhs::BvhBuildParams;
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::builder::build_bvh2;
use obvhs::bvh2::node::Bvh2Node;
use obvhs::ray::safe_inverse;
use obvhs::triangle::Triangle;

/// How far beyond a triangle's edges a ray still hits it, as a share of the triangle.
const WIDER: f32 = 1e-5;

/// The least weight of a corner in [`RayHit::weights`]: places on an edge are moved inside, so that a ray
/// that leaves from the foot of a wall does not start in the plane of the wall.
const LEAST_WEIGHT: f32 = 4.0 * WIDER;

/// How far rays start above a surface, in roundings (2^-24) of the coordinates there and of the size of the
/// triangle (Wächter and Binder, "A Fast and Robust Method for Avoiding Self-Intersection", 2019).
const ROUNDINGS: f32 = 8.0;

/// How much wider boxes are for the rounding of coordinates, as a share of the largest of a triangle, and of
/// the origin of a ray.
const BOX_ROUNDING: f32 = ROUNDINGS * f32::EPSILON;

/// Distances that differ by less than this share are one. Of the triangles in one place the ray meets the
/// largest, which the others lie on, as a box stands on the ground; of those that are as large, one that
/// shows its front, as a wall of two sides does; else the first.
const SAME_DISTANCE: f32 = 1e-6;

/// The digits of a size, in bits, that make no triangle larger than another one: sizes are in steps of 1/64.
const BITS_BELOW_SIZE_STEP: u32 = f32::MANTISSA_DIGITS - 1 - 6;

/// How much later rays leave boxes than computed, as a factor: rounding must not lose what lies in a flat
/// one.
const LATER: f32 = 1.000_000_5;

/// Boxes that may wait to be entered before memory is allocated for more.
const WAITING: usize = 64;

const LEAF: u32 = 1 << 31;

/// Triangles that rays are cast against.
pub struct RayCaster {
    nodes: Vec<Node>,
    leaves: Vec<Leaf>,
    /// The longest edge of each triangle, in the caller's order.
    sizes: Vec<f32>,
}

/// Four boxes.
struct Node {
    /// The least and the greatest coordinates along each axis.
    bounds: [[Vec4; 3]; 2],
    /// The node in each box, or the leaf with the bit [`LEAF`]. An empty box is inside out.
    child: [u32; 4],
}

/// Up to four triangles: a corner, the edges from it, and their cross product. A place without a triangle has
/// edges of length 0.
struct Leaf {
    corner: [Vec4; 3],
    along: [Vec4; 3],
    across: [Vec4; 3],
    normal: [Vec4; 3],
    triangle: [u32; 4],
}

/// The place at which a ray meets a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RayHit {
    /// The triangle, by its place in what [`RayCaster::new`] was given.
    pub triangle: u32,
    /// The weights of the triangle's second and third corner.
    pub weights: [f32; 2],
    /// The distance from the origin, in lengths of the direction.
    pub distance: f32,
    /// Whether the ray comes from the side from which the corners are counter-clockwise.
    pub front: bool,
}

/// A ray as boxes and triangles read it.
struct Ray {
    origin: [Vec4; 3],
    /// The origin, moved forward and backward along each axis by its rounding.
    moved: [[Vec4; 3]; 2],
    direction: [Vec4; 3],
    inverse: [Vec4; 3],
    /// 1 for each axis along which the ray enters boxes at the greatest coordinate.
    down: [usize; 3],
}

impl Ray {
    fn new(origin: Vec3, direction: Vec3) -> Self {
        let inverse = direction.to_array().map(safe_inverse);
        let rounding = BOX_ROUNDING * origin.abs().max_element();
        let moved = [rounding, -rounding].map(|rounding| {
            let along = |k: usize| origin[k] + rounding.copysign(rounding * inverse[k]);
            [0, 1, 2].map(|k| Vec4::splat(along(k)))
        });
        Self {
            origin: origin.to_array().map(Vec4::splat),
            moved,
            direction: direction.to_array().map(Vec4::splat),
            inverse: inverse.map(Vec4::splat),
            down: inverse.map(|inverse| usize::from(inverse < 0.0)),
        }
    }
}

impl RayCaster {
    /// Triangles by their corners; those without an area are never hit.
    pub fn new(triangles: &[[[f32; 3]; 3]]) -> Self {
        let size = |&[a, b, c]: &[[f32; 3]; 3]| {
            let [a, b, c] = [a, b, c].map(Vec3::from);
            (b - a).length().max((c - a).length()).max((c - b).length())
        };
        let mut caster =
            Self { nodes: Vec::new(), leaves: Vec::new(), sizes: triangles.iter().map(size).collect() };
        let of = |&[v0, v1, v2]: &[[f32; 3]; 3]| Triangle { v0: v0.into(), v1: v1.into(), v2: v2.into() };
        let has_area = |&(_, Triangle { v0, v1, v2 }): &(u32, Triangle)| {
            let area = (v1 - v0).cross(v2 - v0).length_squared();
            area > 0.0 && area.is_finite()
        };
        let all = (0..).zip(triangles.iter().map(of));
        let (indices, solid): (Vec<u32>, Vec<Triangle>) = all.filter(has_area).unzip();
        if solid.is_empty() {
            return caster;
        }
        let params =
            BvhBuildParams { pre_split: false, max_prims_per_leaf: 4, ..BvhBuildParams::medium_build() };
        let boxes: Vec<Aabb> = solid.iter().map(around).collect();
        let tree = build_bvh2(&boxes, params, &mut std::time::Duration::default());
        caster.collapse(&tree, &solid, &indices);
        caster
    }

    /// Makes nodes of four boxes: of the boxes in a node, the largest is replaced by the two in it until
    /// there are four.
    fn collapse(&mut self, tree: &Bvh2, solid: &[Triangle], indices: &[u32]) {
        // Where the tree's nodes come from: a box in a node of ours.
        let mut open: Vec<(usize, Option<(usize, usize)>)> = vec![(0, None)];
        while let Some((index, place)) = open.pop() {
            let node = &tree.nodes[index];
            if let (Some((own, lane)), true) = (place, node.prim_count > 0) {
                let leaf = Leaf::of(tree, node, solid, indices);
                self.nodes[own].child[lane] = LEAF | self.leaves.len() as u32;
                self.leaves.push(leaf);
                continue;
            }
            let mut inside = if node.prim_count > 0 {
                vec![index]
            } else {
                vec![node.first_index as usize, node.first_index as usize + 1]
            };
            while inside.len() < 4 {
                let area = |&&index: &&usize| tree.nodes[index].aabb.half_area();
                let inner = inside.iter().filter(|index| tree.nodes[**index].prim_count == 0);
                let Some(&largest) = inner.max_by(|a, b| area(a).total_cmp(&area(b))) else { break };
                inside.retain(|index| *index != largest);
                let first = tree.nodes[largest].first_index as usize;
                inside.extend([first, first + 1]);
            }
            let own = self.nodes.len();
            if let Some((above, lane)) = place {
                self.nodes[above].child[lane] = own as u32;
            }
            let mut four = Node { bounds: [[Vec4::INFINITY; 3], [Vec4::NEG_INFINITY; 3]], child: [LEAF; 4] };
            for (lane, &index) in inside.iter().enumerate() {
                let Bvh2Node { aabb, .. } = &tree.nodes[index];
                for axis in 0..3 {
                    four.bounds[0][axis][lane] = aabb.min[axis];
                    four.bounds[1][axis][lane] = aabb.max[axis];
                }
                open.push((index, Some((own, lane))));
            }
            self.nodes.push(four);
        }
    }

    /// Whether there is nothing that could be hit.
    pub fn is_empty(&self) -> bool {
        self.nodes.is_empty()
    }

    /// The first triangle that a ray meets of those that `meets` does not let it pass.
    ///
    /// `meets` is asked in no particular order, also for triangles behind the first.
    pub fn closest(
        &self,
        origin: Vec3,
        direction: Vec3,
        mut meets: impl FnMut(&RayHit) -> bool,
    ) -> Option<RayHit> {
        let ray = Ray::new(origin, direction);
        let (mut nearest, mut reach, mut is_one): (Option<RayHit>, f32, bool) = (None, f32::INFINITY, true);
        self.traverse(&ray, reach, |hit| {
            let is_nearer = nearest.is_none_or(|nearest| hit.distance < nearest.distance);
            let is_near = nearest.is_some_and(|nearest| {
                (hit.distance - nearest.distance).abs() <= SAME_DISTANCE * nearest.distance
            });
            if (is_nearer || is_near) && meets(&hit) {
                is_one &= !is_near;
                if is_nearer {
                    nearest = Some(hit);
                    reach = hit.distance * (1.0 + SAME_DISTANCE);
                }
            }
            reach
        });
        if is_one {
            return nearest;
        }
        let mut first: Option<RayHit> = None;
        self.traverse(&ray, reach, |hit| {
            if first.is_none_or(|first| self.order(&hit) < self.order(&first)) && meets(&hit) {
                first = Some(hit);
            }
            reach
        });
        first
    }

    /// What orders triangles in one place: a ray meets the least.
    fn order(&self, hit: &RayHit) -> (Reverse<u32>, bool, u32) {
        let size = self.sizes.get(hit.triangle as usize).copied().unwrap_or(0.0);
        (Reverse(size.to_bits() >> BITS_BELOW_SIZE_STEP), !hit.front, hit.triangle)
    }

    /// Whether a ray meets a triangle before `reach`, of those that `meets` does not let it pass.
    pub fn is_blocked(
        &self,
        origin: Vec3,
        direction: Vec3,
        reach: f32,
        mut meets: impl FnMut(&RayHit) -> bool,
    ) -> bool {
        let mut blocked = false;
        self.traverse(&Ray::new(origin, direction), reach, |hit| {
            blocked |= meets(&hit);
            if blocked { f32::NEG_INFINITY } else { reach }
        });
        blocked
    }

    /// Visits the triangles on a ray up to a distance; `visit` returns how far it is still of interest.
    #[inline]
    fn traverse(&self, ray: &Ray, reach: f32, mut visit: impl FnMut(RayHit) -> f32) {
        let mut reach = reach;
        let (mut waiting, mut count, mut more) = ([(0_u32, 0.0_f32); WAITING], 0, Vec::new());
        let mut next = if self.nodes.is_empty() { None } else { Some(0_u32) };
        while let Some(at) = next {
            if at & LEAF != 0 {
                self.leaves[(at & !LEAF) as usize].visit(ray, &mut reach, &mut visit);
                if reach == f32::NEG_INFINITY {
                    return;
                }
                next = None;
            } else {
                let node = &self.nodes[at as usize];
                let (near, mask) = node.entered(ray, reach);
                let (mut mask, mut entered) = (mask, [(0_u32, 0.0_f32); 4]);
                let mut length = 0;
                while mask != 0 {
                    let lane = mask.trailing_zeros() as usize;
                    mask &= mask - 1;
                    let (child, distance) = (node.child[lane & 3], near[lane & 3]);
                    // Sorted by insertion: the farthest first.
                    let mut place = length;
                    while place > 0 && entered[place - 1].1 < distance {
                        entered[place & 3] = entered[place - 1];
                        place -= 1;
                    }
                    entered[place & 3] = (child, distance);
                    length += 1;
                }
                next = None;
                for (index, entry) in entered[..length].iter().enumerate() {
                    if index + 1 == length {
                        next = Some(entry.0);
                    } else if count < WAITING {
                        waiting[count] = *entry;
                        count += 1;
                    } else {
                        more.push(*entry);
                    }
                }
            }
            while next.is_none() {
                let (child, distance) = match more.pop() {
                    Some(entry) => entry,
                    None if count > 0 => {
                        count -= 1;
                        waiting[count]
                    }
                    None => return,
                };
                if distance <= reach {
                    next = Some(child);
                }
            }
        }
    }

    /// How far above a place on a triangle rays start, so that rounding does not bring them below it.
    pub fn clearance(&self, triangle: u32, position: Vec3) -> f32 {
        let size = self.sizes.get(triangle as usize).copied().unwrap_or(0.0);
        ROUNDINGS * 0.5 * f32::EPSILON * (position.abs().max_element() + size)
    }
}

/// A box around all places at which a ray may hit a triangle, but for the rounding of the ray's origin.
fn around(Triangle { v0, v1, v2 }: &Triangle) -> Aabb {
    let (least, most) = (v0.min(*v1).min(*v2), v0.max(*v1).max(*v2));
    let largest = least.abs().max(most.abs()).max_element();
    let beyond = 3.0 * WIDER * (most - least) + BOX_ROUNDING * largest;
    Aabb::new(least - beyond, most + beyond)
}

impl std::fmt::Debug for RayCaster {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("RayCaster").field("triangles", &self.sizes.len()).finish_non_exhaustive()
    }
}

impl Node {
    /// The distances at which a ray enters the boxes, and a bit for each that it enters before `reach`.
    #[inline(always)]
    fn entered(&self, ray: &Ray, reach: f32) -> (Vec4, u32) {
        let along = |side: usize, axis: usize| {
            (self.bounds[side ^ ray.down[axis]][axis] - ray.moved[side][axis]) * ray.inverse[axis]
        };
        let near = along(0, 0).max(along(0, 1)).max(along(0, 2)).max(Vec4::ZERO);
        let far = along(1, 0).min(along(1, 1)).min(along(1, 2)) * LATER;
        (near, near.cmple(far.min(Vec4::splat(reach))).bitmask())
    }
}

impl Leaf {
    fn of(tree: &Bvh2, node: &Bvh2Node, solid: &[Triangle], indices: &[u32]) -> Self {
        let zero = [Vec4::ZERO; 3];
        let mut leaf = Self { corner: zero, along: zero, across: zero, normal: zero, triangle: [0; 4] };
        let first = node.first_index as usize;
        for lane in 0..(node.prim_count as usize).min(4) {
            let index = tree.primitive_indices[first + lane] as usize;
            let Triangle { v0, v1, v2 } = solid[index];
            let (along, across) = (v1 - v0, v2 - v0);
            let normal = along.cross(across);
            for axis in 0..3 {
                leaf.corner[axis][lane] = v0[axis];
                leaf.along[axis][lane] = along[axis];
                leaf.across[axis][lane] = across[axis];
                leaf.normal[axis][lane] = normal[axis];
            }
            leaf.triangle[lane] = indices[index];
        }
        leaf
    }

    /// Visits those of the triangles that a ray hits before `reach`, as [`RayCaster::traverse`] does.
    #[inline(always)]
    fn visit(&self, ray: &Ray, reach: &mut f32, visit: &mut impl FnMut(RayHit) -> f32) {
        let dot = |a: &[Vec4; 3], b: &[Vec4; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
        let [dx, dy, dz] = ray.direction;
        let from = [0, 1, 2].map(|axis| ray.origin[axis] - self.corner[axis]);
        let [fx, fy, fz] = from;
        let turned = [fy * dz - fz * dy, fz * dx - fx * dz, fx * dy - fy * dx];
        let cosine = dot(&self.normal, &ray.direction);
        let scale = -cosine.recip();
        let (u, v) = (dot(&turned, &self.across) * scale, -dot(&turned, &self.along) * scale);
        let distance = dot(&from, &self.normal) * scale;
        let least = Vec4::splat(-WIDER);
        let inside = u.cmpge(least) & v.cmpge(least) & (u + v).cmple(Vec4::splat(1.0 + WIDER));
        let between = distance.cmpgt(Vec4::ZERO) & distance.cmple(Vec4::splat(*reach));
        // A ray in the plane of a triangle does not hit it, nor does any ray hit a place without one.
        let mut mask = (inside & between & cosine.abs().cmpgt(Vec4::ZERO)).bitmask();
        while mask != 0 {
            let lane = mask.trailing_zeros() as usize & 3;
            mask &= mask - 1;
            if distance[lane] > *reach {
                continue;
            }
            let [w, u, v] = [1.0 - u[lane] - v[lane], u[lane], v[lane]].map(|w| w.max(LEAST_WEIGHT));
            let sum = w + u + v;
            *reach = visit(RayHit {
                triangle: self.triangle[lane],
                weights: [u / sum, v / sum],
                distance: distance[lane],
                front: cosine[lane] < 0.0,
            });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Numbers in [0, 1) that look random.
    fn numbers() -> impl FnMut() -> f32 {
        let mut state = 1_u32;
        move || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 8) as f32 / (1 << 24) as f32
        }
    }

    fn vector(next: &mut impl FnMut() -> f32) -> Vec3 {
        Vec3::new(next(), next(), next()) - 0.5
    }

    #[test]
    fn the_closest_triangle_is_that_of_all_triangles_one_by_one() {
        let mut next = numbers();
        let triangles: Vec<[[f32; 3]; 3]> = (0..500)
            .map(|_| {
                let at = vector(&mut next) * 4.0;
                [0; 3].map(|_| (at + vector(&mut next)).to_array())
            })
            .collect();
        let caster = RayCaster::new(&triangles);
        let single: Vec<RayCaster> = triangles.iter().map(|one| RayCaster::new(&[*one])).collect();
        let mut hits = 0;
        for _ in 0..2000 {
            let (origin, direction) = (vector(&mut next) * 3.0, vector(&mut next).normalize());
            let all = single.iter().filter_map(|one| one.closest(origin, direction, |_| true));
            let expected = all.map(|hit| hit.distance).reduce(f32::min);
            let found = caster.closest(origin, direction, |_| true);
            assert_eq!(found.map(|hit| hit.distance), expected);
            if let Some(hit) = found {
                hits += 1;
                let [a, b, c] = triangles[hit.triangle as usize].map(Vec3::from);
                let [u, v] = hit.weights;
                let there = a + (b - a) * u + (c - a) * v;
                assert!((there - origin - direction * hit.distance).length() < 2e-4);
                assert_eq!(hit.front, (b - a).cross(c - a).dot(direction) < 0.0);
                assert!(caster.is_blocked(origin, direction, hit.distance * 1.001, |_| true));
                assert!(!caster.is_blocked(origin, direction, hit.distance * 0.999, |_| true));
                let behind = caster.closest(origin, direction, |other| other.triangle != hit.triangle);
                assert!(behind.is_none_or(|behind| behind.distance >= hit.distance));
            }
        }
        assert!(hits > 1000, "{hits}");
    }

    /// A square as four triangles around its middle: rays at its edges and at its middle pass nowhere.
    #[test]
    fn rays_do_not_pass_between_neighbours() {
        let rim = [[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [1.0, 1.0, 0.0], [-1.0, 1.0, 0.0]];
        let triangles: Vec<_> = (0..4).map(|k| [[0.1, 0.2, 0.0], rim[k], rim[(k + 1) % 4]]).collect();
        let caster = RayCaster::new(&triangles);
        for k in 0..1000 {
            let share = k as f32 / 1000.0;
            let on_edge = Vec3::new(0.1, 0.2, 0.0).lerp(Vec3::from(rim[k % 4]), share * 0.999);
            let origin = Vec3::new(0.3, -0.1, 1.0);
            let hit = caster.closest(origin, (on_edge - origin).normalize(), |_| true);
            assert!(hit.is_some_and(|hit| hit.front && hit.weights.iter().all(|w| *w > 0.0)), "{k}");
        }
    }

    #[test]
    fn of_two_triangles_in_one_place_the_front_is_met() {
        let [a, b, c] = [[-1.0, -1.0, 0.5], [1.0, -1.0, 0.5], [0.0, 1.0, 0.5]];
        for triangles in [[[a, b, c], [a, c, b]], [[c, b, a], [b, c, a]]] {
            let caster = RayCaster::new(&triangles);
            for (origin, direction) in [(Vec3::ZERO, Vec3::Z), (Vec3::Z, Vec3::NEG_Z)] {
                assert!(caster.closest(origin, direction, |_| true).is_some_and(|hit| hit.front));
            }
        }
    }

    /// Three triangles lie in one place, each about as large as the next one: a ray meets the same of them in
    /// every tree.
    #[test]
    fn what_is_met_does_not_depend_on_the_tree() {
        let mut next = numbers();
        let of = |size: f32| [[-size, -size, 0.5], [size, -size, 0.5], [0.0, size, 0.5]];
        let own = [1.0, 1.007, 1.014].map(of);
        let mut met = Vec::new();
        for round in 0..200 {
            let far = |_| {
                let at = Vec3::splat(20.0) + 8.0 * vector(&mut next);
                [0; 3].map(|_| (at + vector(&mut next)).to_array())
            };
            let mut triangles: Vec<[[f32; 3]; 3]> = (0..round % 31).map(far).collect();
            let count = triangles.len() as u32;
            triangles.extend(own);
            let caster = RayCaster::new(&triangles);
            let (origin, direction) = (Vec3::new(0.01, -0.2, 3.0), Vec3::new(0.02, 0.03, -1.0).normalize());
            met.push(caster.closest(origin, direction, |_| true).map(|hit| hit.triangle - count));
        }
        met.dedup();
        assert!(met.len() == 1 && met[0].is_some(), "{met:?}");
    }

    #[test]
    fn a_box_stands_on_the_ground() {
        let ground = [[-5.0, -5.0, 0.5], [5.0, -5.0, 0.5], [0.0, 5.0, 0.5]];
        let foot = [[-1.0, -1.0, 0.5], [0.0, 1.0, 0.5], [1.0, -1.0, 0.5]];
        for triangles in [[ground, foot], [foot, ground]] {
            let caster = RayCaster::new(&triangles);
            for (origin, direction, front) in [(Vec3::ZERO, Vec3::Z, false), (Vec3::Z, Vec3::NEG_Z, true)] {
                let hit = caster.closest(origin, direction, |_| true).unwrap();
                assert!(triangles[hit.triangle as usize] == ground && hit.front == front);
            }
        }
    }

    #[test]
    fn triangles_without_area_are_never_hit() {
        let caster = RayCaster::new(&[[[0.0; 3], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0]]]);
        assert!(caster.is_empty() && caster.closest(Vec3::Z, Vec3::NEG_Z, |_| true).is_none());
        assert!(RayCaster::new(&[]).is_empty());
    }
}
