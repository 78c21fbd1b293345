//! What rays may hit: the triangles of a mesh in a hierarchy of boxes (obvhs).

use glam::{DVec3, Vec3A};
use mesh::Mesh;
use obvhs::BvhBuildParams;
use obvhs::cwbvh::CwBvh;
use obvhs::cwbvh::builder::build_cwbvh_from_tris;
use obvhs::ray::Ray;
use obvhs::triangle::Triangle;
use sphere::Direction;

use crate::frames::single;

/// Triangles that block light from both sides.
#[derive(Debug)]
pub struct Occluders {
    tree: CwBvh,
    /// In the order in which the tree's leaves hold them.
    triangles: Vec<Triangle>,
    /// How far rays start above a vertex.
    offset: f32,
}

/// How far rays start above a vertex, along its normal, as a share of the radius of all triangles: rounding
/// of positions is 1e-7 of it, and a triangle seen at its own vertices must not block.
const OFFSET: f64 = 1e-4;

impl Occluders {
    /// The triangles of a mesh; those without an area block nothing and are left out.
    pub fn of(mesh: &Mesh) -> Self {
        let corner = |vertex: u32| Vec3A::from(mesh.positions()[vertex as usize]);
        let triangles = mesh.triangles().iter().map(|corners| {
            let [v0, v1, v2] = corners.map(corner);
            Triangle { v0, v1, v2 }
        });
        let solid = |triangle: &Triangle| {
            (triangle.v1 - triangle.v0).cross(triangle.v2 - triangle.v0).length_squared() > 0.0
        };
        let triangles: Vec<Triangle> = triangles.filter(solid).collect();
        let offset = (OFFSET * mesh.bounds().1) as f32;
        if triangles.is_empty() {
            return Self { tree: CwBvh::default(), triangles, offset };
        }
        let params = BvhBuildParams { pre_split: false, ..BvhBuildParams::medium_build() };
        let tree = build_cwbvh_from_tris(&triangles, params, &mut std::time::Duration::default());
        let triangles = tree.primitive_indices.iter().map(|index| triangles[*index as usize]).collect();
        Self { tree, triangles, offset }
    }

    /// Whether there is nothing that could be hit.
    pub fn is_empty(&self) -> bool {
        self.triangles.is_empty()
    }

    /// How far rays start above a vertex, along its normal.
    pub fn offset(&self) -> f32 {
        self.offset
    }

    pub(crate) fn triangles(&self) -> &[Triangle] {
        &self.triangles
    }

    /// Whether a ray from above a vertex hits a triangle.
    pub fn block(&self, position: [f32; 3], normal: [f32; 3], direction: Direction) -> bool {
        if self.triangles.is_empty() {
            return false;
        }
        let origin = Vec3A::from(position) + Vec3A::from(normal) * self.offset;
        let ray = Ray::new(origin, single(direction).into(), 0.0, f32::INFINITY);
        !self.tree.ray_traverse_miss(ray, |ray, index| distance(&self.triangles[index], ray))
    }

    /// The indices of the directions above a vertex's horizon that are blocked.
    pub(crate) fn blocked<'a>(
        &'a self,
        position: [f32; 3],
        normal: [f32; 3],
        directions: &'a [Direction],
    ) -> impl Iterator<Item = usize> + 'a {
        let up = DVec3::from_array(normal.map(f64::from));
        let above =
            directions.iter().enumerate().filter(move |(_, direction)| direction.vector().dot(up) > 0.0);
        above.filter(move |(_, direction)| self.block(position, normal, **direction)).map(|(index, _)| index)
    }
}

/// How far beyond a triangle's edges a ray still hits it, as a share of the triangle: rounding must not let
/// rays pass between two triangles with a common edge.
const WIDER: f32 = 1e-5;

/// Where along a ray it hits a triangle, from either side; infinite if it does not (Möller and Trumbore,
/// "Fast, Minimum Storage Ray/Triangle Intersection", 1997).
fn distance(triangle: &Triangle, ray: &Ray) -> f32 {
    let (along, across) = (triangle.v1 - triangle.v0, triangle.v2 - triangle.v0);
    let p = ray.direction.cross(across);
    let scale = 1.0 / along.dot(p);
    let from = ray.origin - triangle.v0;
    let u = from.dot(p) * scale;
    let q = from.cross(along);
    let v = ray.direction.dot(q) * scale;
    let t = across.dot(q) * scale;
    // A ray in the triangle's plane has a scale that is not finite, and hits nothing.
    let inside = u >= -WIDER && v >= -WIDER && u + v <= 1.0 + WIDER;
    if scale.is_finite() && inside && t >= ray.tmin { t } else { f32::INFINITY }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A ray toward a sphere of radius 1 about the origin hits it if its line passes within 1.
    #[test]
    fn rays_hit_what_is_in_their_way() {
        let sphere = Occluders::of(&mesh::shape("sphere").unwrap());
        let position = [0.0, 0.0, 3.0];
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
            assert_eq!(sphere.block(position, [0.0; 3], direction), expected, "{v}");
            hits += usize::from(expected);
        }
        assert!(hits > 20);
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
        for vertex in (0..sphere.positions().len()).step_by(997) {
            let (position, normal) = (sphere.positions()[vertex], sphere.normals()[vertex]);
            assert_eq!(occluders.blocked(position, normal, &directions).count(), 0, "{vertex}");
        }
    }
}
