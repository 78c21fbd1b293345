//! Transfer matrices of 16-bit numbers, as they are stored: half the memory, which is what limits shading
//! with them.
//!
//! A half has 11 bits: entries, which are at most about 1, are rounded by 2.4e-4 of themselves. Those below
//! 6.1e-5, the least that has all bits, become zero: processors are slow with numbers below it. NaN stays
//! NaN, and what is too large for a half becomes infinite, so that whoever writes a file notices both.

use brdf::BrdfTable;
use half::f16;
use half::slice::HalfFloatSliceExt;
use sh::{Degree, Expansion, Stop};

use crate::directions::Directions;
use crate::frames::{Frames, Viewer};
use crate::occluders::Occluders;
use crate::shading::shade_with_matrices;
use crate::transfer::{MeshRays, Transfer, TransferDegrees, TransferError, bake};

/// A transfer matrix for each vertex, [V, (O+1)^2, (F+1)^2].
#[derive(Clone, Debug, PartialEq)]
pub struct HalfTransfer {
    output: Degree,
    input: Degree,
    values: Vec<f16>,
}

impl HalfTransfer {
    /// Matrices from their values; `None` if the length is not a multiple of (O+1)^2 (F+1)^2.
    pub fn new(output: Degree, input: Degree, values: Vec<f16>) -> Option<Self> {
        values.len().is_multiple_of(output.rows() * input.rows()).then_some(Self { output, input, values })
    }

    /// Bakes shadows, without the matrices of all vertices in memory; also the number of vertices that see
    /// nothing.
    ///
    /// # Errors
    /// The errors of [`crate::precompute`].
    pub fn precompute(
        frames: &Frames,
        occluders: &Occluders,
        directions: &Directions,
        degrees: TransferDegrees,
        stop: Stop<'_>,
    ) -> Result<(Self, usize), TransferError> {
        let TransferDegrees { output, input } = degrees;
        let length = output.rows() * input.rows();
        let rays = MeshRays { frames, occluders, directions };
        let (values, blind) = bake(rays, degrees, length, f16::ZERO, stop, &round)?;
        Ok((Self { output, input, values }, blind))
    }

    /// Rounds matrices.
    pub fn of(transfer: &Transfer) -> Self {
        let mut values = vec![f16::ZERO; transfer.values().len()];
        round(transfer.values(), &mut values);
        Self { output: transfer.output(), input: transfer.input(), values }
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
    pub fn values(&self) -> &[f16] {
        &self.values
    }

    /// The matrices as 32-bit numbers.
    pub fn matrices(&self) -> Option<Transfer> {
        Transfer::new(self.output, self.input, self.values.to_f32_vec())
    }

    /// The radiance of each vertex, as [`crate::shade_with_transfer`] has it.
    ///
    /// # Panics
    /// If the transfer has not as many vertices as there are frames.
    pub fn shade(
        &self,
        frames: &Frames,
        table: &BrdfTable,
        viewer: Viewer,
        light: &Expansion,
    ) -> Vec<[f32; 3]> {
        let degrees = TransferDegrees { output: self.output, input: self.input };
        shade_with_matrices(frames, table, viewer, degrees, &self.values, light)
    }
}

fn round(matrix: &[f32], values: &mut [f16]) {
    values.convert_from_f32_slice(matrix);
    let subnormal = values.iter_mut().filter(|value| value.is_finite() && !value.is_normal());
    subnormal.for_each(|value| *value = f16::ZERO);
}
