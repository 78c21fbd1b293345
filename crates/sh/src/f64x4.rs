//! Four doubles at a time: the one SIMD layer of the kernels.
//!
//! A kernel is a [`pulp::WithSimd`], or a [`WithLanes`], over vectors of four `f64` (or eight `f32`). It is
//! compiled twice: with AVX2 and FMA, and in plain Rust for every other CPU. Both have the same lanes, and
//! multiply-adds are fused in both, so that their results are the same to the last bit. An x86 CPU without
//! FMA computes them in software, slowly.
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

/// The operations on the lanes of one vector that kernels need beside those of [`Simd`].
pub trait Lanes: Simd {
    /// A table of eight rows and eight columns with rows and columns exchanged.
    fn transpose_f32s(self, rows: [[f32; 8]; 8]) -> [[f32; 8]; 8];

    /// The number of the values that are at most `v`.
    fn count_up_to(self, values: &[f32; 8], v: f32) -> usize;
}

#[cfg(target_arch = "x86_64")]
impl Lanes for pulp::x86::V3 {
    #[inline(always)]
    fn transpose_f32s(self, rows: [[f32; 8]; 8]) -> [[f32; 8]; 8] {
        let avx = self.avx;
        let [a, b, c, d, e, f, g, h] = rows;
        let (a, b, c, d) = (pulp::cast(a), pulp::cast(b), pulp::cast(c), pulp::cast(d));
        let (e, f, g, h) = (pulp::cast(e), pulp::cast(f), pulp::cast(g), pulp::cast(h));
        // In each half of a register: two columns of two rows, then one column of four.
        let (ab, ab_high) = (avx._mm256_unpacklo_ps(a, b), avx._mm256_unpackhi_ps(a, b));
        let (cd, cd_high) = (avx._mm256_unpacklo_ps(c, d), avx._mm256_unpackhi_ps(c, d));
        let (ef, ef_high) = (avx._mm256_unpacklo_ps(e, f), avx._mm256_unpackhi_ps(e, f));
        let (gh, gh_high) = (avx._mm256_unpacklo_ps(g, h), avx._mm256_unpackhi_ps(g, h));
        let (first_0, last_0) =
            (avx._mm256_shuffle_ps::<0x44>(ab, cd), avx._mm256_shuffle_ps::<0x44>(ef, gh));
        let (first_1, last_1) =
            (avx._mm256_shuffle_ps::<0xee>(ab, cd), avx._mm256_shuffle_ps::<0xee>(ef, gh));
        let (first_2, last_2) = (
            avx._mm256_shuffle_ps::<0x44>(ab_high, cd_high),
            avx._mm256_shuffle_ps::<0x44>(ef_high, gh_high),
        );
        let (first_3, last_3) = (
            avx._mm256_shuffle_ps::<0xee>(ab_high, cd_high),
            avx._mm256_shuffle_ps::<0xee>(ef_high, gh_high),
        );
        [
            pulp::cast(avx._mm256_permute2f128_ps::<0x20>(first_0, last_0)),
            pulp::cast(avx._mm256_permute2f128_ps::<0x20>(first_1, last_1)),
            pulp::cast(avx._mm256_permute2f128_ps::<0x20>(first_2, last_2)),
            pulp::cast(avx._mm256_permute2f128_ps::<0x20>(first_3, last_3)),
            pulp::cast(avx._mm256_permute2f128_ps::<0x31>(first_0, last_0)),
            pulp::cast(avx._mm256_permute2f128_ps::<0x31>(first_1, last_1)),
            pulp::cast(avx._mm256_permute2f128_ps::<0x31>(first_2, last_2)),
            pulp::cast(avx._mm256_permute2f128_ps::<0x31>(first_3, last_3)),
        ]
    }

    #[inline(always)]
    fn count_up_to(self, values: &[f32; 8], v: f32) -> usize {
        // An ordered comparison: false for NaN, as in Rust.
        let is_below = self.avx._mm256_cmp_ps::<0x12>(pulp::cast(*values), self.avx._mm256_set1_ps(v));
        self.avx._mm256_movemask_ps(is_below).count_ones() as usize
    }
}

impl Lanes for Scalar256b {
    #[inline(always)]
    fn transpose_f32s(self, rows: [[f32; 8]; 8]) -> [[f32; 8]; 8] {
        transposed(rows)
    }

    #[inline(always)]
    fn count_up_to(self, values: &[f32; 8], v: f32) -> usize {
        values.iter().map(|&value| u32::from(value <= v)).sum::<u32>() as usize
    }
}

/// [`Lanes::transpose_f32s`] in plain Rust, for any numbers.
#[inline(always)]
pub(crate) fn transposed<T: Copy + Default>(rows: [[T; 8]; 8]) -> [[T; 8]; 8] {
    let mut columns = [[T::default(); 8]; 8];
    for i in 0..8 {
        for j in 0..8 {
            columns[i][j] = rows[j][i];
        }
    }
    columns
}

/// A kernel that needs [`Lanes`].
pub trait WithLanes {
    /// What the kernel returns.
    type Output;

    /// Runs the kernel. Everything that it calls with vectors is `#[inline(always)]`, as it is itself.
    fn with_lanes<L: Lanes>(self, lanes: L) -> Self::Output;
}

struct KernelAtLevel<K, L>(K, L);

impl<K: WithLanes, L: Lanes> WithSimd for KernelAtLevel<K, L> {
    type Output = K::Output;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> K::Output {
        self.0.with_lanes(self.1)
    }
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

    /// [`SimdLevel::run`] for a kernel that needs [`Lanes`].
    #[inline]
    pub fn run_lanes<K: WithLanes>(self, kernel: K) -> K::Output {
        match self {
            #[cfg(target_arch = "x86_64")]
            Self::V4(v4) => Simd::vectorize(*v4, KernelAtLevel(kernel, *v4)),
            #[cfg(target_arch = "x86_64")]
            Self::V3(v3) => Simd::vectorize(v3, KernelAtLevel(kernel, v3)),
            Self::Portable => Scalar256b.vectorize(KernelAtLevel(kernel, Scalar256b)),
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
