//! The frame of each vertex: R_p with the rows x, y and N.

use glam::{DMat3, DVec3, Vec3};
use mesh::Mesh;
use sphere::Direction;

/// The vertices that a kernel handles at once.
pub(crate) const LANES: usize = 8;

/// Where a mesh is seen from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Viewer {
    /// The viewer is far away, in this direction.
    Distant(Direction),
    /// The viewer is at a place.
    At([f64; 3]),
}

/// The frames of a mesh's vertices.
///
/// x is the tangent, z the normal and y = N x x, also where the tangent's sign w is -1: the table's frame is
/// always right-handed.
#[derive(Clone, Debug, PartialEq)]
pub struct Frames {
    /// The position of each vertex.
    positions: Vec<[f32; 3]>,
    /// The way from each vertex into the surface: in its plane, toward the centres of its triangles.
    inward: Vec<[f32; 3]>,
    /// The vertices in eights; the last vertex is repeated to fill them.
    blocks: Vec<Block>,
}

/// Eight vertices, as kernels take them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Block {
    /// The positions of the vertices: x, y and z.
    positions: [[f32; LANES]; 3],
    /// The axes x, y and N of the frames: x, y and z of each.
    axes: [[[f32; LANES]; 3]; 3],
    pub(crate) angles: Angles,
    /// The vertices' places among the materials of a table, for each parameter from 0, the first, to 1.
    pub(crate) blend: [[f32; LANES]; 2],
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

    /// The frames of points without a mesh, at the origin: matrices whose columns are x, y = N x x, and N.
    pub fn from_axes(axes: &[DMat3]) -> Self {
        Self::new(vec![[0.0; 3]; axes.len()], axes)
    }

    /// Frames as matrices whose columns are x, y and N.
    pub(crate) fn new(positions: Vec<[f32; 3]>, to_world: &[DMat3]) -> Self {
        let blocks = to_world.chunks(LANES).enumerate().map(|(index, frames)| {
            let mut block = Block {
                positions: [[0.0; LANES]; 3],
                axes: [[[0.0; LANES]; 3]; 3],
                angles: Angles {
                    alpha: [[1.0; LANES], [0.0; LANES]],
                    beta: [[1.0; LANES], [0.0; LANES]],
                    gamma: [[1.0; LANES], [0.0; LANES]],
                },
                blend: [[0.0; LANES]; 2],
            };
            for lane in 0..LANES {
                let filled = lane.min(frames.len() - 1);
                let (frame, position) = (frames[filled], positions[index * LANES + filled]);
                for component in 0..3 {
                    block.positions[component][lane] = position[component];
                    for (axis, vector) in [frame.x_axis, frame.y_axis, frame.z_axis].into_iter().enumerate() {
                        block.axes[axis][component][lane] = vector[component] as f32;
                    }
                }
                let angles = [&mut block.angles.alpha, &mut block.angles.beta, &mut block.angles.gamma];
                for (angle, found) in angles.into_iter().zip(zyz(frame)) {
                    (angle[0][lane], angle[1][lane]) = (math::cos(found) as f32, math::sin(found) as f32);
                }
            }
            block
        });
        let blocks = blocks.collect();
        let inward = vec![[0.0; 3]; positions.len()];
        Self { positions, inward, blocks }
    }

    /// Returns the same frames for a table of several materials: where each vertex is between the first, 0,
    /// and the last, 1, along both parameters of the table.
    ///
    /// # Panics
    /// If the places are not as many as the vertices.
    #[must_use]
    pub fn with_blend(mut self, blend: &[[f32; 2]]) -> Self {
        assert_eq!(blend.len(), self.len(), "two numbers for each vertex");
        for (block, blend) in self.blocks.iter_mut().zip(blend.chunks(LANES)) {
            block.blend = [0, 1].map(|k| std::array::from_fn(|lane| blend[lane.min(blend.len() - 1)][k]));
        }
        self
    }

    /// Where a vertex is between the first material of a table, 0, and the last, 1, along both parameters.
    pub fn blend(&self, vertex: usize) -> [f32; 2] {
        self.blocks[vertex / LANES].blend.map(|lanes| lanes[vertex % LANES])
    }

    /// The number of vertices.
    pub fn len(&self) -> usize {
        self.positions.len()
    }

    /// Whether there is no vertex.
    pub fn is_empty(&self) -> bool {
        self.positions.is_empty()
    }

    /// The position of each vertex.
    pub fn positions(&self) -> &[[f32; 3]] {
        &self.positions
    }

    /// The way from a vertex into the surface, of the length of its triangles at its edge and shorter inside.
    pub(crate) fn inward(&self, vertex: usize) -> [f32; 3] {
        self.inward[vertex]
    }

    /// The normal of a vertex.
    pub fn normal(&self, vertex: usize) -> [f32; 3] {
        self.blocks[vertex / LANES].axes[2].map(|component| component[vertex % LANES])
    }

    /// The axes x, y and N of a vertex.
    pub fn axes(&self, vertex: usize) -> [[f32; 3]; 3] {
        self.blocks[vertex / LANES].axes.map(|axis| axis.map(|component| component[vertex % LANES]))
    }

    /// All vertices, eight at a time.
    pub(crate) fn blocks(&self) -> &[Block] {
        &self.blocks
    }
}

impl Block {
    /// The direction to the viewer from each vertex, in its frame: x, y and z. One who stands at a vertex
    /// looks along its normal.
    #[inline(always)]
    pub(crate) fn views(&self, viewer: Viewer) -> [[f32; LANES]; 3] {
        let mut away = [[0.0; LANES]; 3];
        match viewer {
            Viewer::Distant(direction) => {
                let direction = direction.vector().as_vec3().to_array();
                for (lanes, value) in away.iter_mut().zip(direction) {
                    *lanes = [value; LANES];
                }
            }
            Viewer::At(place) => {
                for (component, lanes) in away.iter_mut().enumerate() {
                    let place = place[component] as f32;
                    *lanes = self.positions[component].map(|position| place - position);
                }
                let mut square = [0.0; LANES];
                for lanes in away {
                    for lane in 0..LANES {
                        square[lane] += lanes[lane] * lanes[lane];
                    }
                }
                for (component, lanes) in away.iter_mut().enumerate() {
                    for lane in 0..LANES {
                        let normal = self.axes[2][component][lane];
                        let unit = lanes[lane] / square[lane].sqrt();
                        lanes[lane] = if square[lane] > 0.0 { unit } else { normal };
                    }
                }
            }
        }
        let mut views = [[0.0; LANES]; 3];
        for (view, axis) in views.iter_mut().zip(&self.axes) {
            for (axis, away) in axis.iter().zip(&away) {
                for lane in 0..LANES {
                    view[lane] += axis[lane] * away[lane];
                }
            }
        }
        views
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

/// The ZYZ angles alpha, beta and gamma of a rotation matrix R_z(alpha) R_y(beta) R_z(gamma).
fn zyz(matrix: DMat3) -> [f64; 3] {
    let (x, y, z) = (matrix.x_axis, matrix.y_axis, matrix.z_axis);
    let sine = math::hypot(z.x, z.y);
    // Near a pole only the sum or the difference of the other two is known well; that is all that counts.
    if sine < 1e-9 {
        let beta = if z.z > 0.0 { 0.0 } else { std::f64::consts::PI };
        return [0.0, beta, if z.z > 0.0 { math::atan2(x.y, x.x) } else { math::atan2(x.y, y.y) }];
    }
    [math::atan2(z.y, z.x), math::atan2(sine, z.z), math::atan2(y.z, -x.z)]
}

/// A direction as numbers that kernels take.
pub(crate) fn single(direction: Direction) -> Vec3 {
    direction.vector().as_vec3()
}
