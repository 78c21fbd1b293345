//! The frame of each vertex: R_p with the rows x, y and N.

use glam::{DMat3, DVec3, Vec3};
use mesh::Mesh;
use sphere::Direction;

/// The vertices that a kernel handles at once.
pub(crate) const LANES: usize = 8;

/// The frames of a mesh's vertices.
///
/// x is the tangent, z the normal and y = N x x, also where the tangent's sign w is -1: the table's frame is
/// always right-handed.
#[derive(Clone, Debug, PartialEq)]
pub struct Frames {
    /// Where each vertex is.
    positions: Vec<[f32; 3]>,
    /// The way from each vertex into the surface: in its plane, toward the centres of its triangles.
    inward: Vec<[f32; 3]>,
    /// x, y and N of each vertex.
    axes: Vec<[[f32; 3]; 3]>,
    /// The angles of each eight vertices; the last are repeated to fill them.
    angles: Vec<Angles>,
}

/// The ZYZ angles of the rotation from the frames of eight vertices to the world, [x y N] = R_z(alpha)
/// R_y(beta) R_z(gamma): cosine and sine of each.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Angles {
    pub(crate) alpha: [[f32; LANES]; 2],
    pub(crate) beta: [[f32; LANES]; 2],
    pub(crate) gamma: [[f32; LANES]; 2],
}

/// Why vertices have no frames.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("vertex {0} has a normal and a tangent that are not at a right angle, or not of length 1")]
pub struct FramesError(pub usize);

/// How far a mesh's vectors may be from length 1 and a right angle.
const TOLERANCE: f64 = 1e-3;

impl Frames {
    /// The frames of a mesh: its normals and tangents.
    ///
    /// # Errors
    /// If a normal and a tangent are not orthonormal; it names the first such vertex.
    pub fn of(mesh: &Mesh) -> Result<Self, FramesError> {
        let frames = mesh.normals().iter().zip(mesh.tangents()).enumerate();
        let frames = frames.map(|(vertex, (normal, [x, y, z, _]))| {
            let (normal, tangent) = (double(*normal), double([*x, *y, *z]));
            let off = [normal.length() - 1.0, tangent.length() - 1.0, normal.dot(tangent)];
            if !off.iter().all(|off| off.abs() < TOLERANCE) {
                return Err(FramesError(vertex));
            }
            Ok(orthonormal(normal, tangent))
        });
        let frames: Vec<DMat3> = frames.collect::<Result<_, _>>()?;
        Ok(Self { inward: inward(mesh, &frames), ..Self::new(mesh.positions().to_vec(), &frames) })
    }

    /// Frames as matrices whose columns are x, y and N.
    pub(crate) fn new(positions: Vec<[f32; 3]>, to_world: &[DMat3]) -> Self {
        let angles = to_world.chunks(LANES).map(|block| {
            let mut angles = Angles {
                alpha: [[1.0; LANES], [0.0; LANES]],
                beta: [[1.0; LANES], [0.0; LANES]],
                gamma: [[1.0; LANES], [0.0; LANES]],
            };
            for lane in 0..LANES {
                let zyz = zyz(block[lane.min(block.len() - 1)]);
                for (angle, found) in
                    [&mut angles.alpha, &mut angles.beta, &mut angles.gamma].into_iter().zip(zyz)
                {
                    (angle[0][lane], angle[1][lane]) = (found.cos() as f32, found.sin() as f32);
                }
            }
            angles
        });
        let axes = |matrix: &DMat3| {
            [matrix.x_axis, matrix.y_axis, matrix.z_axis].map(|axis| axis.as_vec3().to_array())
        };
        let inward = vec![[0.0; 3]; positions.len()];
        Self { positions, inward, axes: to_world.iter().map(axes).collect(), angles: angles.collect() }
    }

    /// The number of vertices.
    pub fn len(&self) -> usize {
        self.axes.len()
    }

    /// Whether there is no vertex.
    pub fn is_empty(&self) -> bool {
        self.axes.is_empty()
    }

    /// Where each vertex is.
    pub fn positions(&self) -> &[[f32; 3]] {
        &self.positions
    }

    /// The way from a vertex into the surface, of the length of its triangles at its edge and shorter inside.
    pub(crate) fn inward(&self, vertex: usize) -> [f32; 3] {
        self.inward[vertex]
    }

    /// The normal of a vertex.
    pub fn normal(&self, vertex: usize) -> [f32; 3] {
        self.axes[vertex][2]
    }

    /// A direction of the world in the frame of a vertex.
    pub(crate) fn local(&self, vertex: usize, direction: Vec3) -> Vec3 {
        Vec3::from(self.axes[vertex].map(|axis| Vec3::from(axis).dot(direction)))
    }

    pub(crate) fn angles(&self) -> &[Angles] {
        &self.angles
    }
}

/// For each vertex the mean way to the centres of its triangles, without its part along the normal.
fn inward(mesh: &Mesh, frames: &[DMat3]) -> Vec<[f32; 3]> {
    let mut ways = vec![(DVec3::ZERO, 0.0); frames.len()];
    for corners in mesh.triangles() {
        let places = corners.map(|vertex| double(mesh.positions()[vertex as usize]));
        let centre = (places[0] + places[1] + places[2]) / 3.0;
        for (vertex, place) in corners.iter().zip(places) {
            let (way, count) = &mut ways[*vertex as usize];
            (*way, *count) = (*way + centre - place, *count + 1.0);
        }
    }
    let mean = |((way, count), frame): (&(DVec3, f64), &DMat3)| {
        let way = *way / count.max(1.0);
        (way - frame.z_axis * way.dot(frame.z_axis)).as_vec3().to_array()
    };
    ways.iter().zip(frames).map(mean).collect()
}

fn double(v: [f32; 3]) -> DVec3 {
    Vec3::from(v).as_dvec3()
}

/// The matrix of x, y and N: the normal exactly, the tangent at a right angle to it.
fn orthonormal(normal: DVec3, tangent: DVec3) -> DMat3 {
    let z = normal.normalize();
    let x = (tangent - z * z.dot(tangent)).normalize();
    DMat3::from_cols(x, z.cross(x), z)
}

/// alpha, beta and gamma of a rotation matrix R_z(alpha) R_y(beta) R_z(gamma).
fn zyz(matrix: DMat3) -> [f64; 3] {
    let (x, y, z) = (matrix.x_axis, matrix.y_axis, matrix.z_axis);
    let sine = z.x.hypot(z.y);
    // Near a pole only the sum or the difference of the other two is known well; that is all that counts.
    if sine < 1e-9 {
        let beta = if z.z > 0.0 { 0.0 } else { std::f64::consts::PI };
        return [0.0, beta, if z.z > 0.0 { x.y.atan2(x.x) } else { x.y.atan2(y.y) }];
    }
    [z.y.atan2(z.x), sine.atan2(z.z), y.z.atan2(-x.z)]
}

/// A direction as numbers that kernels take.
pub(crate) fn single(direction: Direction) -> Vec3 {
    direction.vector().as_vec3()
}
