//! Four doubles at a time: the one SIMD layer of the kernels.
//!
//! A kernel is a [`pulp::WithSimd`] over vectors of four `f64` (or eight `f32`). It is compiled twice: with
//! AVX2 and FMA, and in plain Rust for every other CPU. Both have the same lanes, and multiply-adds are fused
//! in both, so that their results are the same to the last bit. An x86 CPU without FMA computes them in
//! software, slowly.
//!
//! The sums of the transform have eight lanes of `f64`: one register of AVX-512, two of the other levels.
//! These kernels are compiled a third time.

use pulp::{Scalar256b, Simd, WithSimd};

/// The number of doubles in a vector, on every CPU.
pub const LANES: usize = 4;

/// Four doubles in memory.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C, align(32))]
pub struct F64x4(pub [f64; LANES]);

impl F64x4 {
    /// Four zeros.
    pub const ZERO: Self = Self([0.0; LANES]);

    /// Makes a vector from a lane-by-lane function.
    #[inline(always)]
    pub fn from_fn(f: impl FnMut(usize) -> f64) -> Self {
        Self(std::array::from_fn(f))
    }
}

/// Loads a vector from memory into a register of a kernel.
#[inline(always)]
pub fn load<S: Simd>(_: S, value: &F64x4) -> S::f64s {
    pulp::cast(value.0)
}

/// Stores a register of a kernel in memory.
#[inline(always)]
pub fn store<S: Simd>(_: S, vector: S::f64s, value: &mut F64x4) {
    value.0 = pulp::cast(vector);
}

/// The instructions that kernels run on.
#[derive(Clone, Copy, Debug)]
pub enum SimdLevel {
    /// AVX-512, found on this CPU.
    #[cfg(target_arch = "x86_64")]
    V4(pulp::x86::V4),
    /// AVX2 and FMA, found on this CPU.
    #[cfg(target_arch = "x86_64")]
    V3(pulp::x86::V3),
    /// Any CPU.
    Portable,
}

impl SimdLevel {
    /// The best level of this CPU. A build with debug assertions takes no better one than the environment
    /// variable `SPECULA_SIMD_LEVEL` names, `portable` or `v3`, by which tests compare the levels; a release
    /// reads none.
    pub fn detect() -> Self {
        #[cfg(target_arch = "x86_64")]
        {
            let highest = highest();
            if highest >= 4
                && let Some(v4) = pulp::x86::V4::try_new()
            {
                return Self::V4(v4);
            }
            if highest >= 3
                && let Some(v3) = pulp::x86::V3::try_new()
            {
                return Self::V3(v3);
            }
        }
        Self::Portable
    }

    /// Runs a kernel compiled for this level, with registers of 256 bits. Everything that it calls with
    /// vectors is `#[inline(always)]`.
    #[inline]
    pub fn run<K: WithSimd>(self, kernel: K) -> K::Output {
        match self {
            #[cfg(target_arch = "x86_64")]
            Self::V4(v4) => Simd::vectorize(*v4, kernel),
            #[cfg(target_arch = "x86_64")]
            Self::V3(v3) => Simd::vectorize(v3, kernel),
            Self::Portable => Scalar256b.vectorize(kernel),
        }
    }

    /// Runs a kernel whose registers may also have 512 bits.
    #[inline]
    pub(crate) fn run_wide<K: WithSimd>(self, kernel: K) -> K::Output {
        match self {
            #[cfg(target_arch = "x86_64")]
            Self::V4(v4) => Simd::vectorize(v4, kernel),
            narrow => narrow.run(kernel),
        }
    }
}

/// The version of x86-64 that a level may have at most.
#[cfg(all(target_arch = "x86_64", debug_assertions))]
fn highest() -> u32 {
    static HIGHEST: std::sync::LazyLock<u32> = std::sync::LazyLock::new(|| {
        #[allow(clippy::disallowed_methods)] // not in a release
        let level = std::env::var_os("SPECULA_SIMD_LEVEL");
        match level.as_deref().and_then(|level| level.to_str()) {
            Some("portable") => 0,
            Some("v3") => 3,
            _ => 4,
        }
    });
    *HIGHEST
}

#[cfg(all(target_arch = "x86_64", not(debug_assertions)))]
const fn highest() -> u32 {
    4
}
