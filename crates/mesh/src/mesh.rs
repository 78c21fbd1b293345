//! A triangle mesh in the world's frame (right-handed, +Z up).

use crate::material_range::Materials;

/// A triangle mesh with a normal and a tangent at every vertex.
///
/// Triangles are counter-clockwise as seen from outside. All vectors have as many entries as there are
/// vertices; every index is below that number, and every value is finite. A mesh may have no triangles.
#[derive(Clone, Debug, PartialEq)]
pub struct Mesh {
    positions: Vec<[f32; 3]>,
    normals: Vec<[f32; 3]>,
    tangents: Vec<[f32; 4]>,
    coordinates: Option<Vec<[f32; 2]>>,
    triangles: Vec<[u32; 3]>,
    pub(crate) materials: Materials,
}

/// A list of `width` numbers for each vertex.
pub(crate) struct List<'a> {
    name: &'static str,
    width: usize,
    numbers: &'a [f32],
}

impl<'a> List<'a> {
    pub(crate) fn of<const N: usize>(name: &'static str, vectors: &'a [[f32; N]]) -> Self {
        Self { name, width: N, numbers: vectors.as_flattened() }
    }
}

/// Checks that every list has an entry for each of `count` vertices and finite numbers, and that every corner
/// is a vertex.
pub(crate) fn check(count: usize, lists: &[List<'_>], triangles: &[[u32; 3]]) -> Result<(), MeshError> {
    for &List { name, width, numbers } in lists {
        let length = numbers.len() / width;
        if length != count {
            return Err(MeshError(format!("{length} {name} for {count} positions")));
        }
        if let Some(first) = numbers.iter().position(|number| !number.is_finite()) {
            let vertex = first / width;
            return Err(MeshError(format!("the {name} of vertex {vertex} hold a number that is not finite")));
        }
    }
    match triangles.iter().position(|corners| corners.iter().any(|&vertex| vertex as usize >= count)) {
        None => Ok(()),
        Some(triangle) => {
            let corners = triangles[triangle];
            Err(MeshError(format!(
                "triangle {triangle} has corners {corners:?}, and there are {count} vertices"
            )))
        }
    }
}

/// Why data is not a mesh.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct MeshError(pub String);

impl Mesh {
    /// A mesh of complete parts: normals and tangents of length 1; a tangent's fourth number is the sign of
    /// the bitangent, w (N x T).
    ///
    /// # Errors
    /// If the numbers of entries differ, an index has no vertex, or a number is not finite; the message names
    /// the first error.
    pub fn new(
        positions: Vec<[f32; 3]>,
        normals: Vec<[f32; 3]>,
        tangents: Vec<[f32; 4]>,
        coordinates: Option<Vec<[f32; 2]>>,
        triangles: Vec<[u32; 3]>,
    ) -> Result<Self, MeshError> {
        let mut lists = vec![
            List::of("positions", &positions),
            List::of("normals", &normals),
            List::of("tangents", &tangents),
        ];
        lists.extend(coordinates.as_deref().map(|coordinates| List::of("coordinates", coordinates)));
        check(positions.len(), &lists, &triangles)?;
        Ok(Self::from_complete(positions, normals, tangents, coordinates, triangles))
    }

    /// A mesh of parts that are known to satisfy [`Mesh::new`].
    pub(crate) fn from_complete(
        positions: Vec<[f32; 3]>,
        normals: Vec<[f32; 3]>,
        tangents: Vec<[f32; 4]>,
        coordinates: Option<Vec<[f32; 2]>>,
        triangles: Vec<[u32; 3]>,
    ) -> Self {
        Self { positions, normals, tangents, coordinates, triangles, materials: Materials::default() }
    }

    /// The positions of the vertices.
    pub fn positions(&self) -> &[[f32; 3]] {
        &self.positions
    }

    /// The normal at each vertex, of length 1.
    pub fn normals(&self) -> &[[f32; 3]] {
        &self.normals
    }

    /// The tangent at each vertex, of length 1 and at a right angle to the normal, and the sign of the
    /// bitangent.
    pub fn tangents(&self) -> &[[f32; 4]] {
        &self.tangents
    }

    /// Texture coordinates, if there are any.
    pub fn coordinates(&self) -> Option<&[[f32; 2]]> {
        self.coordinates.as_deref()
    }

    /// The vertices of each triangle.
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// All meshes as one, in their order. It has coordinates if every mesh has them, and no materials.
    ///
    /// # Errors
    /// If there are more vertices than 32 bits can count.
    pub fn joined(meshes: &[Self]) -> Result<Self, MeshError> {
        let count: usize = meshes.iter().map(|mesh| mesh.positions.len()).sum();
        if u32::try_from(count).is_err() {
            return Err(MeshError(format!("{count} vertices are more than 32 bits can count")));
        }
        let mut first = 0;
        let mut triangles = Vec::new();
        for mesh in meshes {
            triangles.extend(mesh.triangles.iter().map(|corners| corners.map(|vertex| vertex + first)));
            first += mesh.positions.len() as u32;
        }
        let coordinates: Option<Vec<&[[f32; 2]]>> = meshes.iter().map(Self::coordinates).collect();
        Ok(Self {
            positions: meshes.iter().flat_map(|mesh| &mesh.positions).copied().collect(),
            normals: meshes.iter().flat_map(|mesh| &mesh.normals).copied().collect(),
            tangents: meshes.iter().flat_map(|mesh| &mesh.tangents).copied().collect(),
            coordinates: coordinates.map(|lists| lists.concat()),
            triangles,
            materials: Materials::default(),
        })
    }

    /// A ball around all vertices that triangles use: its centre, which is the middle of their bounding box,
    /// and its radius, which is 0 for a mesh without triangles.
    pub fn bounds(&self) -> ([f64; 3], f64) {
        let used =
            || self.triangles.iter().flatten().map(|&vertex| self.positions[vertex as usize].map(f64::from));
        let (mut least, mut most) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for position in used() {
            for axis in 0..3 {
                least[axis] = least[axis].min(position[axis]);
                most[axis] = most[axis].max(position[axis]);
            }
        }
        if self.triangles.is_empty() {
            return ([0.0; 3], 0.0);
        }
        let centre = [0, 1, 2].map(|axis| (least[axis] + most[axis]) / 2.0);
        let far = |p: [f64; 3]| (0..3).map(|axis| math::powi(p[axis] - centre[axis], 2)).sum::<f64>();
        (centre, used().map(far).fold(0.0, f64::max).sqrt())
    }
}
