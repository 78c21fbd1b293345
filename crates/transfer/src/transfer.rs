//! Precomputed radiance transfer: what light of the world arrives at each vertex, past the mesh itself.
//!
//! > T_ij = integral of V(s) Y_i(R_p s) Y_j(s) ds
//!
//! [KSS02, sec. 5], with V(s) = 1 where the vertex sees the sky: (T L)_i are the coefficients of the light
//! that arrives, in the vertex' frame. Below the vertex' own horizon V = 1, always: rho_hat is zero there, so
//! that an open vertex has T = R, the rotation, and shading with and without transfer agree.
//!
//! What is blocked is taken from that: with v_k = integral of (1 - V) Y_k, its (O + F + 1)^2 coefficients,
//!
//! > T = R (1 - sum over k of v_k G_k), G_ijk = integral of Y_i Y_j Y_k,
//!
//! which is the same sum over rays in other words, and takes 81 products for each ray that is blocked rather
//! than 625 (O = F = 4).

use rayon::prelude::*;
use sh::{Degree, Stop, Stopped};

use crate::directions::Directions;
use crate::frames::{Angles, Frames, LANES};
use crate::occluders::Occluders;
use crate::packet::{Blocked, Towards, rays};
use crate::rotation::FrameRotation;
use crate::triple_products::TripleProducts;

/// Raised when the results of this kernel change: every kind of stage that calls it adds this to its own
/// revision.
pub const REVISION: u32 = 1;

/// A transfer matrix for each vertex.
///
/// `values` has shape [V, (O+1)^2, (F+1)^2]: rows in the frame of the vertex, columns in the world.
#[derive(Clone, Debug, PartialEq)]
pub struct Transfer {
    output: Degree,
    input: Degree,
    values: Vec<f32>,
}

/// Why there is no transfer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum TransferError {
    /// The matrices would take too much memory.
    #[error("the transfer of {vertices} vertices takes {bytes} bytes, more than {MOST_BYTES}")]
    TooLarge {
        /// The number of vertices V.
        vertices: usize,
        /// The size of the matrices in bytes.
        bytes: usize,
    },
    /// The directions are not exact to degree O + F.
    #[error("directions that are exact to degree {found} are too few; expected degree {expected}")]
    Directions {
        /// The degree to which the directions are exact.
        found: usize,
        /// The degree O + F that is needed.
        expected: usize,
    },
    /// The bake was stopped before its end.
    #[error(transparent)]
    Stopped(#[from] Stopped),
}

/// The most bytes of a transfer, and of what is in memory while light is reflected: 4 GB.
pub const MOST_BYTES: usize = 4_000_000_000;

impl Transfer {
    /// Matrices from their values; `None` if the length is not a multiple of (O+1)^2 (F+1)^2.
    pub fn new(output: Degree, input: Degree, values: Vec<f32>) -> Option<Self> {
        values.len().is_multiple_of(output.rows() * input.rows()).then_some(Self { output, input, values })
    }

    /// The degree O of the light that arrives.
    pub fn output(&self) -> Degree {
        self.output
    }

    /// The degree F of the light of the world.
    pub fn input(&self) -> Degree {
        self.input
    }

    /// The number of vertices.
    pub fn len(&self) -> usize {
        self.values.len() / (self.output.rows() * self.input.rows())
    }

    /// Whether there is no vertex.
    pub fn is_empty(&self) -> bool {
        self.values.is_empty()
    }

    /// All matrices: [V, (O+1)^2, (F+1)^2].
    pub fn values(&self) -> &[f32] {
        &self.values
    }

    /// The matrix of a vertex.
    pub fn matrix(&self, vertex: usize) -> &[f32] {
        let length = self.output.rows() * self.input.rows();
        &self.values[vertex * length..][..length]
    }
}

/// The transfer of shadows, and the number of vertices that see nothing of the sky above their horizon.
///
/// The accuracy is that of the rays: next to a sphere, entries are within 5e-3 with 4,096 directions and
/// 1.5e-3 with 16,384 (`tests/transfer.rs`). Uses all threads; the result does not depend on their number.
/// `stop` is asked for every eight vertices, on every thread.
///
/// # Errors
/// If the matrices are larger than [`MOST_BYTES`], the directions are not exact to degree O + F, or it was
/// stopped.
pub fn precompute(
    frames: &Frames,
    occluders: &Occluders,
    directions: &Directions,
    degrees: TransferDegrees,
    stop: Stop<'_>,
) -> Result<(Transfer, usize), TransferError> {
    let TransferDegrees { output, input } = degrees;
    let length = output.rows() * input.rows();
    let copy = |matrix: &[f32], values: &mut [f32]| values.copy_from_slice(matrix);
    let rays = MeshRays { frames, occluders, directions };
    let (values, blind) = bake(rays, degrees, length, 0.0, stop, &copy)?;
    Ok((Transfer { output, input, values }, blind))
}

/// The degrees of the light that a transfer takes and makes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TransferDegrees {
    /// The degree O of the light that arrives at a vertex.
    pub output: Degree,
    /// The degree F of the light from far away.
    pub input: Degree,
}

/// The rays that the vertices of a mesh cast.
#[derive(Clone, Copy)]
pub(crate) struct MeshRays<'a> {
    /// The vertices.
    pub(crate) frames: &'a Frames,
    /// What the rays may hit.
    pub(crate) occluders: &'a Occluders,
    /// The directions of the rays of each vertex.
    pub(crate) directions: &'a Directions,
}

/// Hands each vertex' matrix to `write`, with `length` numbers of its own to fill, which are `zero` before;
/// also the number of vertices that see nothing.
pub(crate) fn bake<T: Copy + Send>(
    MeshRays { frames, occluders, directions }: MeshRays<'_>,
    degrees: TransferDegrees,
    length: usize,
    zero: T,
    stop: Stop<'_>,
    write: &(dyn Fn(&[f32], &mut [T]) + Sync),
) -> Result<(Vec<T>, usize), TransferError> {
    let TransferDegrees { output, input } = degrees;
    let (rows, columns) = (output.rows(), input.rows());
    let bytes = frames.len().saturating_mul(length * size_of::<T>());
    if bytes > MOST_BYTES {
        return Err(TransferError::TooLarge { vertices: frames.len(), bytes });
    }
    let (found, expected) = (directions.degree().get(), output.get() + input.get());
    if found < expected {
        return Err(TransferError::Directions { found, expected });
    }
    let products = TripleProducts::new(output, input);
    let rotation = FrameRotation::new(output);
    let shadows = Shadows::new(frames, occluders, directions, expected);
    let mut values = vec![zero; frames.len() * length];
    let blocks = values.par_chunks_mut(LANES * length).enumerate();
    let blind = blocks.map(|(block, values)| {
        stop.check()?;
        let (hidden, blind) = shadows.block(block);
        let world = |hidden: &Vec<f64>| {
            let mut world = vec![0.0; rows * columns];
            (0..rows.min(columns)).for_each(|k| world[k * columns + k] = 1.0);
            for &(entry, k, integral) in &products.terms {
                world[entry as usize] -= integral * hidden[k as usize];
            }
            world
        };
        let worlds: Vec<Vec<f64>> = hidden.iter().map(world).collect();
        let mut matrices = vec![0.0; worlds.len() * rows * columns];
        turn_rows(&rotation, rows, &frames.blocks()[block].angles, &worlds, &mut matrices);
        let vertices = values.chunks_exact_mut(length).zip(matrices.chunks_exact(rows * columns));
        vertices.for_each(|(values, matrix)| write(matrix, values));
        Ok(blind)
    });
    let blind = blind.collect::<Result<Vec<usize>, TransferError>>()?.into_iter().sum();
    Ok((values, blind))
}

/// The directions that the vertices of a mesh do not see.
pub(crate) struct Shadows<'a> {
    frames: &'a Frames,
    occluders: &'a Occluders,
    directions: &'a Directions,
    rays: Vec<(usize, Towards)>,
    rows: usize,
}

impl<'a> Shadows<'a> {
    /// Prepares the coefficients of the shadows up to a degree, at most that of the directions.
    pub(crate) fn new(
        frames: &'a Frames,
        occluders: &'a Occluders,
        directions: &'a Directions,
        degree: usize,
    ) -> Self {
        let rows = Degree::new(degree).map_or(directions.degree().rows(), |degree| degree.rows());
        Self { frames, occluders, directions, rays: rays(directions), rows }
    }

    /// The coefficients of 1 - V of each of a block of eight vertices, in the world, and the number of those
    /// that see nothing above their horizon.
    pub(crate) fn block(&self, block: usize) -> (Vec<Vec<f64>>, usize) {
        let Self { frames, occluders, directions, rays, .. } = self;
        let first = block * LANES;
        let count = LANES.min(frames.len() - first);
        let mut hidden = vec![vec![0.0; self.rows]; count];
        let mut blocked = [0; LANES];
        let found = |lane: usize, index: usize| {
            hidden[lane].iter_mut().zip(directions.weighted(index)).for_each(|(sum, y)| *sum += y);
            blocked[lane] += 1;
        };
        let cast = Blocked { occluders, frames, rays, first, count, found }.run();
        let blind = (0..count).filter(|lane| blocked[*lane] == cast[*lane]).count();
        (hidden, blind)
    }
}

/// Turns the rows of the matrices of eight vertices from the world into their frames.
pub(crate) fn turn_rows(
    rotation: &FrameRotation,
    rows: usize,
    angles: &Angles,
    worlds: &[Vec<f64>],
    values: &mut [f32],
) {
    let columns = worlds[0].len() / rows;
    // A function for each column.
    let mut lanes = vec![[0.0; LANES]; columns * rows];
    for (lane, world) in worlds.iter().enumerate() {
        for (row, world) in world.chunks_exact(columns).enumerate() {
            (0..columns).for_each(|column| lanes[column * rows + row][lane] = world[column] as f32);
        }
    }
    rotation.turn_to_local(angles, &mut lanes);
    for (lane, matrix) in values.chunks_exact_mut(rows * columns).enumerate() {
        for (row, values) in matrix.chunks_exact_mut(columns).enumerate() {
            (0..columns).for_each(|column| values[column] = lanes[column * rows + row][lane]);
        }
    }
}
