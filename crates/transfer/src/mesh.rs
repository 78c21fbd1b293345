//! A triangle mesh in the world's frame (right-handed, +Z up).

/// A triangle mesh with a normal and a tangent at every vertex.
///
/// Triangles are counter-clockwise as seen from outside. All vectors have as many entries as there are vertices; every
/// index is below that, every number is finite. It may have no triangle at all.
#[derive(Clone, Debug, PartialEq)]
pub struct Mesh {
    positions: Vec<[f32; 3]>,
    normals: Vec<[f32; 3]>,
    tangents: Vec<[f32; 4]>,
    coordinates: Option<Vec<[f32; 2]>>,
    triangles: Vec<[u32; 3]>,
}

/// Why numbers are no mesh.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct MeshError(pub String);

impl Mesh {
    /// A mesh of complete parts: normals and tangents of length 1; a tangent's fourth number is the sign of the
    /// bitangent, w (N x T).
    ///
    /// # Errors
    /// Where numbers of entries differ, an index has no vertex, or a number is not finite; the message names the first.
    pub fn new(
        positions: Vec<[f32; 3]>,
        normals: Vec<[f32; 3]>,
        tangents: Vec<[f32; 4]>,
        coordinates: Option<Vec<[f32; 2]>>,
        triangles: Vec<[u32; 3]>,
    ) -> Result<Self, MeshError> {
        let count = positions.len();
        let lengths = [
            ("normals", normals.len()),
            ("tangents", tangents.len()),
            ("coordinates", coordinates.as_ref().map_or(count, Vec::len)),
        ];
        for (name, length) in lengths {
            if length != count {
                return Err(MeshError(format!("{length} {name} for {count} positions")));
            }
        }
        if let Some(triangle) =
            triangles.iter().position(|corners| corners.iter().any(|&k| k as usize >= count))
        {
            let corners = triangles[triangle];
            return Err(MeshError(format!(
                "triangle {triangle} has corners {corners:?} of {count} vertices"
            )));
        }
        let finite = |values: &[f32]| values.iter().all(|value| value.is_finite());
        for vertex in 0..count {
            let at = coordinates.as_ref().is_none_or(|coordinates| finite(&coordinates[vertex]));
            if !(finite(&positions[vertex]) && finite(&normals[vertex]) && finite(&tangents[vertex]) && at) {
                return Err(MeshError(format!("vertex {vertex} holds a number that is not finite")));
            }
        }
        Ok(Self { positions, normals, tangents, coordinates, triangles })
    }

    /// A mesh of parts that are known to be what [`Mesh::new`] asks for.
    pub(crate) fn from_complete(
        positions: Vec<[f32; 3]>,
        normals: Vec<[f32; 3]>,
        tangents: Vec<[f32; 4]>,
        coordinates: Option<Vec<[f32; 2]>>,
        triangles: Vec<[u32; 3]>,
    ) -> Self {
        Self { positions, normals, tangents, coordinates, triangles }
    }

    /// Where the vertices are.
    pub fn positions(&self) -> &[[f32; 3]] {
        &self.positions
    }

    /// The normal at each vertex, of length 1.
    pub fn normals(&self) -> &[[f32; 3]] {
        &self.normals
    }

    /// The tangent at each vertex, of length 1 and at a right angle to the normal, and the sign of the bitangent.
    pub fn tangents(&self) -> &[[f32; 4]] {
        &self.tangents
    }

    /// Texture coordinates, where there are any.
    pub fn coordinates(&self) -> Option<&[[f32; 2]]> {
        self.coordinates.as_deref()
    }

    /// The vertices of each triangle.
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// A ball around all vertices that triangles use: its centre, the middle of the box around them, and its radius. A
    /// mesh without triangles has radius 0.
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
        let far = |p: [f64; 3]| (0..3).map(|axis| (p[axis] - centre[axis]).powi(2)).sum::<f64>();
        (centre, used().map(far).fold(0.0, f64::max).sqrt())
    }
}
