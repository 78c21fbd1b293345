//! Eight floats at a time: the vectors of this crate's kernels, which run at a level of [`sh::f64x4`].

use pulp::{Scalar256b, Simd, WithSimd};
use sh::f64x4::SimdLevel;

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

/// The operations that kernels need beside those of [`Simd`].
pub(crate) trait Lanes: Simd {
    /// The number of the values that are at most `v`.
    fn count_up_to(self, values: &[f32; LANES], v: f32) -> usize;
}

#[cfg(target_arch = "x86_64")]
impl Lanes for pulp::x86::V3 {
    #[inline(always)]
    fn count_up_to(self, values: &[f32; LANES], v: f32) -> usize {
        // An ordered comparison: false for NaN, as in Rust.
        let is_below = self.avx._mm256_cmp_ps::<0x12>(pulp::cast(*values), self.avx._mm256_set1_ps(v));
        self.avx._mm256_movemask_ps(is_below).count_ones() as usize
    }
}

impl Lanes for Scalar256b {
    #[inline(always)]
    fn count_up_to(self, values: &[f32; LANES], v: f32) -> usize {
        values.iter().map(|&value| u32::from(value <= v)).sum::<u32>() as usize
    }
}

/// A kernel that needs [`Lanes`].
pub(crate) trait WithLanes {
    type Output;

    /// Runs the kernel. Everything that it calls with vectors is `#[inline(always)]`, as it is itself.
    fn with_lanes<L: Lanes>(self, lanes: L) -> Self::Output;
}

/// Runs a kernel compiled for this level.
pub(crate) fn run<K: WithLanes>(level: SimdLevel, kernel: K) -> K::Output {
    match level {
        #[cfg(target_arch = "x86_64")]
        SimdLevel::V4(v4) => Simd::vectorize(*v4, KernelAtLevel(kernel, *v4)),
        #[cfg(target_arch = "x86_64")]
        SimdLevel::V3(v3) => Simd::vectorize(v3, KernelAtLevel(kernel, v3)),
        SimdLevel::Portable => Scalar256b.vectorize(KernelAtLevel(kernel, Scalar256b)),
    }
}

struct KernelAtLevel<K, L>(K, L);

impl<K: WithLanes, L: Lanes> WithSimd for KernelAtLevel<K, L> {
    type Output = K::Output;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> K::Output {
        self.0.with_lanes(self.1)
    }
}
