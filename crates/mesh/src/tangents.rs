//! Tangents that are missing in a file: by MikkTSpace if there are coordinates.
//!
//! Morten Mikkelsen, *Simulation of Wrinkled Surfaces Revisited* (2008), which glTF requires: the derivative
//! of position by u of each triangle, summed over the triangles around a vertex that show the picture with
//! the same orientation, weighted by angle. Coordinates run downward in v, as in glTF files; the bitangent N
//! x T times the sign points up the picture.

use std::collections::HashMap;

use bevy_mikktspace::{Geometry, Ops, TangentSpace, generate_tangents};
use glam::DVec3;

use crate::normals::{double, unit};

/// Raised when the results of this kernel change: every kind of stage that calls it adds this to its own
/// revision.
pub const REVISION: u32 = 1;

/// The most triangles around a vertex for which MikkTSpace is used: its time is quadratic in their number,
/// and its stack linear. A mesh with more gets tangents as if it had no coordinates.
const MOST_AROUND: u32 = 1024;

/// The default tangent: Z x N, toward the east, or X at a pole.
fn east(normal: [f32; 3]) -> [f32; 4] {
    let toward = DVec3::Z.cross(double(normal));
    let found = unit(toward).filter(|_| toward.length_squared() > 1e-14);
    let [x, y, z] = found.unwrap_or([1.0, 0.0, 0.0]);
    [x, y, z, 1.0]
}

/// The tangent of length 1, orthogonal to the normal.
fn beside(normal: [f32; 3], [x, y, z, sign]: [f32; 4]) -> [f32; 4] {
    let (up, tangent) = (double(normal), double([x, y, z]));
    let level = tangent - up * (up.dot(tangent) / up.length_squared());
    // If the tangent lies along the normal, the rest is rounding.
    match unit(level).filter(|_| level.length() > 1e-4 * tangent.length()) {
        Some([x, y, z]) => [x, y, z, if sign < 0.0 { -1.0 } else { 1.0 }],
        None => east(normal),
    }
}

/// The tangents of a file, normalised and orthogonal to the normals.
pub(crate) fn unit_tangents(tangents: &[[f32; 4]], normals: &[[f32; 3]]) -> Vec<[f32; 4]> {
    tangents.iter().zip(normals).map(|(&tangent, &normal)| beside(normal, tangent)).collect()
}

/// Tangents toward the east.
pub(crate) fn without_coordinates(normals: &[[f32; 3]]) -> Vec<[f32; 4]> {
    normals.iter().map(|&normal| east(normal)).collect()
}

/// Tangents from coordinates, and the additional vertices that they need.
pub(crate) struct Made {
    /// The tangent of each vertex; those of `copied` follow the others.
    pub(crate) tangents: Vec<[f32; 4]>,
    /// The vertices that must be duplicated.
    pub(crate) copied: Vec<u32>,
    /// The triangles over all vertices.
    pub(crate) triangles: Vec<[u32; 3]>,
}

/// Tangents by MikkTSpace.
pub(crate) fn by_coordinates(
    positions: &[[f32; 3]],
    normals: &[[f32; 3]],
    coordinates: &[[f32; 2]],
    triangles: &[[u32; 3]],
) -> Made {
    // A degenerate triangle has no derivative, and makes MikkTSpace search all other triangles.
    let extended = |corners: &[u32; 3]| {
        let [a, b, c] = corners.map(|vertex| positions[vertex as usize]);
        a != b && b != c && c != a
    };
    let faces: Vec<usize> = (0..triangles.len()).filter(|&k| extended(&triangles[k])).collect();
    let mut surface =
        Surface { positions, normals, coordinates, triangles, found: vec![[None; 3]; faces.len()], faces };
    if surface.most_around() <= MOST_AROUND && generate_tangents::<_, Functions>(&mut surface).is_err() {
        surface.found.fill([None; 3]);
    }
    let mut of_corners = vec![[None; 3]; triangles.len()];
    for (&triangle, found) in surface.faces.iter().zip(&surface.found) {
        of_corners[triangle] = *found;
    }

    let mut tangents: Vec<Option<[f32; 4]>> = vec![None; positions.len()];
    let (mut copied, mut copies) = (Vec::new(), HashMap::new());
    let mut split = |vertex: u32, tangent: Option<[f32; 4]>| {
        let Some(tangent) = tangent.map(|tangent| beside(normals[vertex as usize], tangent)) else {
            return vertex;
        };
        let own = *tangents[vertex as usize].get_or_insert(tangent);
        if own == tangent {
            return vertex;
        }
        *copies.entry((vertex, tangent.map(f32::to_bits))).or_insert_with(|| {
            copied.push((vertex, tangent));
            (positions.len() + copied.len() - 1) as u32
        })
    };
    let triangles = triangles
        .iter()
        .zip(&of_corners)
        .map(|(corners, found)| [0, 1, 2].map(|corner| split(corners[corner], found[corner])));
    let triangles = triangles.collect();
    let own = tangents.iter().zip(normals).map(|(tangent, &normal)| tangent.unwrap_or_else(|| east(normal)));
    Made {
        tangents: own.chain(copied.iter().map(|&(_, tangent)| tangent)).collect(),
        copied: copied.iter().map(|&(vertex, _)| vertex).collect(),
        triangles,
    }
}

/// The geometry for MikkTSpace.
struct Surface<'a> {
    positions: &'a [[f32; 3]],
    normals: &'a [[f32; 3]],
    coordinates: &'a [[f32; 2]],
    triangles: &'a [[u32; 3]],
    /// The triangles that MikkTSpace sees.
    faces: Vec<usize>,
    /// The tangents of the triangles' corners.
    found: Vec<[Option<[f32; 4]>; 3]>,
}

impl Surface<'_> {
    fn vertex(&self, face: usize, corner: usize) -> usize {
        self.triangles[self.faces[face]][corner] as usize
    }

    /// The most corners at a vertex, if vertices with equal values count as one, as in MikkTSpace.
    fn most_around(&self) -> u32 {
        let mut corners = HashMap::new();
        for &vertex in self.faces.iter().flat_map(|&face| &self.triangles[face]) {
            let vertex = vertex as usize;
            let ([x, y, z], [a, b, c]) = (self.positions[vertex], self.normals[vertex]);
            let [u, v] = self.coordinates[vertex];
            *corners.entry([x, y, z, a, b, c, u, v].map(f32::to_bits)).or_insert(0) += 1;
        }
        corners.into_values().max().unwrap_or(0)
    }
}

/// The functions that MikkTSpace calls. As in its own C code, the arc cosine is that of a double.
struct Functions;

impl Ops for Functions {
    fn sqrt(x: f32) -> f32 {
        x.sqrt()
    }

    fn acos(x: f32) -> f32 {
        math::acos(f64::from(x)) as f32
    }
}

impl Geometry<Functions> for Surface<'_> {
    fn num_faces(&self) -> usize {
        self.faces.len()
    }

    fn num_vertices_of_face(&self, _: usize) -> usize {
        3
    }

    fn position(&self, face: usize, corner: usize) -> [f32; 3] {
        self.positions[self.vertex(face, corner)]
    }

    fn normal(&self, face: usize, corner: usize) -> [f32; 3] {
        self.normals[self.vertex(face, corner)]
    }

    fn tex_coord(&self, face: usize, corner: usize) -> [f32; 2] {
        // In MikkTSpace v points upward.
        let [u, v] = self.coordinates[self.vertex(face, corner)];
        [u, -v]
    }

    fn set_tangent(&mut self, space: Option<TangentSpace>, face: usize, corner: usize) {
        let encoded = space.map(|space| space.tangent_encoded());
        self.found[face][corner] = encoded.filter(|tangent| {
            tangent.iter().all(|value| value.is_finite()) && tangent[..3].iter().any(|&value| value != 0.0)
        });
    }
}
