//! Precomputed radiance transfer: what light of the world arrives at each vertex, past the mesh itself.
//!
//! > T_ij = integral of V(s) Y_i(R_p s) Y_j(s) ds
//!
//! (section 5 of the paper), with V(s) = 1 where the vertex sees the sky: (T L)_i are the coefficients of the
//! light that arrives, in the vertex' frame. Below the vertex' own horizon V = 1, always: rho_hat is zero
//! there, so that an open vertex has T = R, the rotation, and shading with and without transfer agree.
//!
//! What is blocked is taken from that: with v_k = integral of (1 - V) Y_k, its (O + F + 1)^2 coefficients,
//!
//! > T = R (1 - sum over k of v_k G_k), G_ijk = integral of Y_i Y_j Y_k,
//!
//! which is the same sum over rays in other words, and takes 81 products for each ray that is blocked rather
//! than 625 (O = F = 4).

use rayon::prelude::*;
use sh::Degree;

use crate::directions::Directions;
use crate::frames::{Frames, LANES};
use crate::occluders::Occluders;
use crate::rotation::FrameRotation;
use crate::triple_products::TripleProducts;

/// Raised when the results of this kernel change: every kind of stage that calls it adds this to its own
/// revision.
pub const REVISION: u32 = 0;

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
    #[error("{vertices} matrices of {rows} x {columns} are {bytes} bytes, more than {MOST_BYTES}")]
    TooLarge {
        /// V.
        vertices: usize,
        /// (O+1)^2.
        rows: usize,
        /// (F+1)^2.
        columns: usize,
        /// Their size.
        bytes: usize,
    },
    /// The directions are not exact to degree O + F.
    #[error("directions that are exact to degree {found} are too few; expected degree {expected}")]
    Directions {
        /// The degree to which they are exact.
        found: usize,
        /// O + F.
        expected: usize,
    },
    /// It was stopped before its end.
    #[error("the transfer was stopped")]
    Stopped,
}

/// The most bytes of all matrices: 4 GB.
pub const MOST_BYTES: usize = 4_000_000_000;

impl Transfer {
    /// Matrices from their values; `None` if the length is not a multiple of (O+1)^2 (F+1)^2.
    pub fn new(output: Degree, input: Degree, values: Vec<f32>) -> Option<Self> {
        values.len().is_multiple_of(output.rows() * input.rows()).then_some(Self { output, input, values })
    }

    /// O, the degree of the light that arrives.
    pub fn output(&self) -> Degree {
        self.output
    }

    /// F, the degree of the light of the world.
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
///
/// # Errors
/// If the matrices are larger than [`MOST_BYTES`], or the directions are not exact to degree O + F.
pub fn precompute(
    frames: &Frames,
    occluders: &Occluders,
    directions: &Directions,
    (output, input): (Degree, Degree),
) -> Result<(Transfer, usize), TransferError> {
    precompute_unless(frames, occluders, directions, (output, input), &|| false)
}

/// [`precompute`], which ends early once `stop` says so. It is asked for every eight vertices, on every
/// thread.
///
/// # Errors
/// As [`precompute`]; [`TransferError::Stopped`] if it was stopped.
pub fn precompute_unless(
    frames: &Frames,
    occluders: &Occluders,
    directions: &Directions,
    (output, input): (Degree, Degree),
    stop: &(dyn Fn() -> bool + Sync),
) -> Result<(Transfer, usize), TransferError> {
    let (rows, columns) = (output.rows(), input.rows());
    let bytes = frames.len().saturating_mul(rows * columns * size_of::<f32>());
    if bytes > MOST_BYTES {
        return Err(TransferError::TooLarge { vertices: frames.len(), rows, columns, bytes });
    }
    let (found, expected) = (directions.degree().get(), output.get() + input.get());
    if found < expected {
        return Err(TransferError::Directions { found, expected });
    }
    let products = TripleProducts::new(output, input);
    let rotation = FrameRotation::new(output);
    let kept = Degree::new(expected).map_or(directions.degree().rows(), |degree| degree.rows());
    let mut values = vec![0.0; frames.len() * rows * columns];
    let blocks = values.par_chunks_mut(LANES * rows * columns).enumerate();
    let blind = blocks.map(|(block, values)| {
        if stop() {
            return Err(TransferError::Stopped);
        }
        let first = block * LANES;
        let mut blind = 0;
        let mut worlds = vec![vec![0.0; rows * columns]; values.len() / (rows * columns)];
        for (lane, world) in worlds.iter_mut().enumerate() {
            let (position, normal) = (frames.positions()[first + lane], frames.normal(first + lane));
            let mut hidden = vec![0.0; kept];
            let mut open = directions.directions().len();
            for index in occluders.blocked(position, normal, directions.directions()) {
                hidden.iter_mut().zip(directions.weighted(index)).for_each(|(sum, y)| *sum += y);
                open -= 1;
            }
            let up = glam::DVec3::from_array(normal.map(f64::from));
            let below = directions.directions().iter().filter(|direction| direction.vector().dot(up) <= 0.0);
            blind += usize::from(open == below.count());
            (0..rows.min(columns)).for_each(|k| world[k * columns + k] = 1.0);
            for &(entry, k, integral) in &products.terms {
                world[entry as usize] -= integral * hidden[k as usize];
            }
        }
        let angles = &frames.blocks()[block].angles;
        let (mut lanes, mut work) = (vec![[0.0; LANES]; rows], vec![[0.0; LANES]; rows]);
        for column in 0..columns {
            for (row, lanes) in lanes.iter_mut().enumerate() {
                for (lane, world) in worlds.iter().enumerate() {
                    lanes[lane] = world[row * columns + column] as f32;
                }
            }
            rotation.to_local(angles, &mut lanes, &mut work);
            for (lane, matrix) in values.chunks_exact_mut(rows * columns).enumerate() {
                for (row, lanes) in lanes.iter().enumerate() {
                    matrix[row * columns + column] = lanes[lane];
                }
            }
        }
        Ok(blind)
    });
    let blind = blind.collect::<Result<Vec<usize>, TransferError>>()?.into_iter().sum();
    Ok((Transfer { output, input, values }, blind))
}
