//! Eight floats at a time: the vectors of this crate's kernels, which run at a level of [`sh::f64x4`].

use pulp::Simd;

/// The number of floats in a vector, on every CPU.
pub(crate) const LANES: usize = 8;

/// Eight floats in memory.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C, align(32))]
pub(crate) struct F32x8(pub(crate) [f32; LANES]);

impl F32x8 {
    pub(crate) const ZERO: Self = Self([0.0; LANES]);
}

/// Loads a vector from memory into a register of a kernel.
#[inline(always)]
pub(crate) fn load<S: Simd>(_: S, value: &F32x8) -> S::f32s {
    pulp::cast(value.0)
}

/// Stores a register of a kernel in memory.
#[inline(always)]
pub(crate) fn store<S: Simd>(_: S, vector: S::f32s, value: &mut F32x8) {
    value.0 = pulp::cast(vector);
}
