//! The icosahedron whose twelve vertices are the views of Cabral's maps, and how a view lies between them
//! (Cabral, Olano and Nemec 1999; [RH02, app. C]).
//!
//! Vertex 0 is +Z and vertex 11 is -Z. Vertices 1 to 5 lie at z = 1 / sqrt(5), at azimuths 0, 72, 144, 216
//! and 288 degrees: vertex 1 is above +X. Vertices 6 to 10 lie at z = -1 / sqrt(5), at azimuths 36, 108, 180,
//! 252 and 324 degrees.
//!
//! The weights of a view are those of the point where its ray meets the flat triangle (a, b, c):
//!
//! > w_a = V.(b x c) / s,  w_b = V.(c x a) / s,  w_c = V.(a x b) / s,  s the sum of the three numerators.
//!
//! On an edge the third weight is 0 and the other two depend on the edge alone, so that weights are
//! continuous; at a vertex its weight is 1.

use sphere::{DVec3, Direction};

/// sin and cos of the colatitudes, times those of 72 and 36 degrees.
const Z: f64 = 0.447_213_595_499_958;
const R: f64 = 0.894_427_190_999_915_9;
const R_COS_72: f64 = 0.276_393_202_250_021;
const R_SIN_72: f64 = 0.850_650_808_352_039_9;
const R_COS_36: f64 = 0.723_606_797_749_979;
const R_SIN_36: f64 = 0.525_731_112_119_133_6;

const POINTS: [DVec3; 12] = [
    DVec3::new(0.0, 0.0, 1.0),
    DVec3::new(R, 0.0, Z),
    DVec3::new(R_COS_72, R_SIN_72, Z),
    DVec3::new(-R_COS_36, R_SIN_36, Z),
    DVec3::new(-R_COS_36, -R_SIN_36, Z),
    DVec3::new(R_COS_72, -R_SIN_72, Z),
    DVec3::new(R_COS_36, R_SIN_36, -Z),
    DVec3::new(-R_COS_72, R_SIN_72, -Z),
    DVec3::new(-R, 0.0, -Z),
    DVec3::new(-R_COS_72, -R_SIN_72, -Z),
    DVec3::new(R_COS_36, -R_SIN_36, -Z),
    DVec3::new(0.0, 0.0, -1.0),
];

/// The twenty triangles, each with its vertices counter-clockwise as seen from outside.
pub const TRIANGLES: [[usize; 3]; 20] = [
    [0, 1, 2],
    [0, 2, 3],
    [0, 3, 4],
    [0, 4, 5],
    [0, 5, 1],
    [1, 6, 2],
    [2, 7, 3],
    [3, 8, 4],
    [4, 9, 5],
    [5, 10, 1],
    [6, 7, 2],
    [7, 8, 3],
    [8, 9, 4],
    [9, 10, 5],
    [10, 6, 1],
    [11, 7, 6],
    [11, 8, 7],
    [11, 9, 8],
    [11, 10, 9],
    [11, 6, 10],
];

/// The twelve vertices, in Specula's frame.
pub fn vertices() -> [Direction; 12] {
    POINTS.map(Direction::from_unit)
}

/// The three vertices around a view and their weights.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Corners {
    /// The index in [`TRIANGLES`] of the triangle that holds the view.
    pub triangle: usize,
    /// The triangle's vertices.
    pub vertices: [usize; 3],
    /// The share of each vertex, 0 or more to rounding; they sum to 1.
    pub weights: [f64; 3],
}

/// The triangle that a view lies in, and the weights of its vertices.
///
/// # Example: a view at a vertex is that vertex
/// ```
/// let up = shrm::icosahedron::corners(sphere::Direction::Z);
/// assert_eq!((up.vertices[0], up.weights), (0, [1.0, 0.0, 0.0]));
/// ```
pub fn corners(view: Direction) -> Corners {
    let v = view.vector();
    let dots = POINTS.map(|point| point.dot(v));
    // All triangles are alike: a view lies in the one whose middle is nearest.
    let middle = |triangle: usize| TRIANGLES[triangle].iter().map(|&k| dots[k]).sum::<f64>();
    let mut triangle = 0;
    for k in 1..TRIANGLES.len() {
        if middle(k) > middle(triangle) {
            triangle = k;
        }
    }
    let vertices = TRIANGLES[triangle];
    let [a, b, c] = vertices.map(|k| POINTS[k]);
    let parts = [v.dot(b.cross(c)), v.dot(c.cross(a)), v.dot(a.cross(b))].map(|part| part.max(0.0));
    let sum = parts[0] + parts[1] + parts[2];
    Corners { triangle, vertices, weights: parts.map(|part| part / sum) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeMap;

    /// Twelve unit vectors; each has five others at the angle acos(1 / sqrt 5), its neighbours.
    #[test]
    fn the_solid_is_an_icosahedron() {
        for a in POINTS {
            assert!((a.length() - 1.0).abs() < 1e-15);
            let near = POINTS.iter().filter(|b| (a.dot(**b) - Z).abs() < 1e-14).count();
            assert_eq!(near, 5);
        }
        let mut edges = BTreeMap::new();
        for triangle in TRIANGLES {
            let [a, b, c] = triangle.map(|k| POINTS[k]);
            assert!(a.dot(b.cross(c)) > 0.5, "{triangle:?} is counter-clockwise");
            for (from, to) in [(0, 1), (1, 2), (2, 0)] {
                assert!((POINTS[triangle[from]].dot(POINTS[triangle[to]]) - Z).abs() < 1e-14);
                *edges.entry((triangle[from], triangle[to])).or_insert(0) += 1;
            }
        }
        // Each of the 30 edges is passed once in each direction: the surface is closed.
        assert_eq!(edges.len(), 60);
        assert!(edges.iter().all(|(&(a, b), &count)| count == 1 && edges.contains_key(&(b, a))));
    }

    #[test]
    fn weights_are_exact_at_vertices_and_find_the_ray() {
        for (k, vertex) in vertices().into_iter().enumerate() {
            let found = corners(vertex);
            for (vertex, weight) in found.vertices.into_iter().zip(found.weights) {
                assert!((weight - if vertex == k { 1.0 } else { 0.0 }).abs() < 1e-15);
            }
        }
        for k in 0..2000 {
            let view = Direction::from_angles(0.001_57 * f64::from(k), 2.4 * f64::from(k));
            let found = corners(view);
            assert!((found.weights.iter().sum::<f64>() - 1.0).abs() < 1e-15);
            let point: DVec3 = found.vertices.iter().zip(found.weights).map(|(&k, w)| POINTS[k] * w).sum();
            assert!((point.normalize() - view.vector()).length() < 1e-14, "{view:?}");
        }
    }

    /// Across an edge a function of the vertices moves no more than its slope allows: the flat triangles have
    /// an inner radius of 0.3 in units of the sphere, so that weights change by less than 1 / 0.3 x 2 per
    /// radian.
    #[test]
    fn weights_are_continuous_across_edges() {
        let value = |view: Direction| -> f64 {
            let found = corners(view);
            found.vertices.iter().zip(found.weights).map(|(&k, w)| w * ((k * 7) % 12) as f64).sum()
        };
        let mut crossed = 0;
        for triangle in TRIANGLES {
            for (a, b, c) in
                [(0, 1, 2), (1, 2, 0), (2, 0, 1)].map(|(a, b, c)| (triangle[a], triangle[b], triangle[c]))
            {
                for share in [0.1, 0.5, 0.9] {
                    let edge = POINTS[a] * share + POINTS[b] * (1.0 - share);
                    let step = (POINTS[c] - edge) * 1e-9;
                    let (inside, outside) =
                        (Direction::normalised(edge + step), Direction::normalised(edge - step));
                    crossed += usize::from(corners(inside).triangle != corners(outside).triangle);
                    assert!((value(inside) - value(outside)).abs() < 2e-9 * 12.0 * 7.0);
                }
            }
        }
        assert_eq!(crossed, 180);
    }
}
