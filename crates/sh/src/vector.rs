//! The vectors of the transform: eight numbers of one precision, and four doubles, as one trait.
//!
//! Kernels at [`SimdLevel::run`] have registers of 256 bits: eight floats are one of them, eight doubles are
//! two. Those at `run_wide` may have registers of eight doubles.

use pulp::{Scalar256b, Simd, WithSimd};

use crate::f64x4::{F64x4, SimdLevel};

/// Eight numbers in memory.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C, align(32))]
pub(crate) struct Vector8<T>(pub [T; 8]);

/// Eight doubles in memory.
pub(crate) type F64x8 = Vector8<f64>;

/// The number of values in a vector of the transform.
pub(crate) const LANES: usize = 8;

impl<T: Real> Vector8<T> {
    pub(crate) const ZERO: Self = Self([T::ZERO; LANES]);

    #[inline(always)]
    pub(crate) fn from_fn(f: impl FnMut(usize) -> T) -> Self {
        Self(std::array::from_fn(f))
    }
}

/// The number of a level's registers that hold eight doubles.
pub(crate) const fn registers<S: Simd>() -> usize {
    LANES / S::F64_LANES
}

/// Loads one register of eight doubles.
#[inline(always)]
pub(crate) fn load8<S: Simd>(_: S, value: &F64x8, register: usize) -> S::f64s {
    S::as_simd_f64s(&value.0).0[register]
}

/// Stores one register of eight doubles.
#[inline(always)]
pub(crate) fn store8<S: Simd>(_: S, vector: S::f64s, value: &mut F64x8, register: usize) {
    S::as_mut_simd_f64s(&mut value.0).0[register] = vector;
}

/// The precision of a vector: `f32` or `f64`.
pub trait Real: Copy + Default + Send + Sync + 'static {
    /// A register of a kernel.
    type Register<S: Simd>: Copy;

    /// Zero.
    const ZERO: Self;

    /// The number of numbers in a register of 256 bits.
    const PER_REGISTER: usize;

    /// Converts to double precision.
    fn to_f64(self) -> f64;

    /// Converts from double precision, rounding to nearest.
    fn from_f64(value: f64) -> Self;

    /// A table of eight rows and eight columns with rows and columns exchanged.
    fn transpose<S: Transpose>(simd: S, rows: [[Self; LANES]; LANES]) -> [[Self; LANES]; LANES];

    fn load<S: Simd>(simd: S, values: &[Self], register: usize) -> Self::Register<S>;
    fn store<S: Simd>(simd: S, vector: Self::Register<S>, values: &mut [Self], register: usize);
    fn splat<S: Simd>(simd: S, value: Self) -> Self::Register<S>;
    fn add<S: Simd>(simd: S, a: Self::Register<S>, b: Self::Register<S>) -> Self::Register<S>;
    fn sub<S: Simd>(simd: S, a: Self::Register<S>, b: Self::Register<S>) -> Self::Register<S>;
    fn mul<S: Simd>(simd: S, a: Self::Register<S>, b: Self::Register<S>) -> Self::Register<S>;

    /// a b + c, rounded once.
    fn mul_add<S: Simd>(
        simd: S,
        a: Self::Register<S>,
        b: Self::Register<S>,
        c: Self::Register<S>,
    ) -> Self::Register<S>;

    /// c - a b, rounded once.
    fn negate_mul_add<S: Simd>(
        simd: S,
        a: Self::Register<S>,
        b: Self::Register<S>,
        c: Self::Register<S>,
    ) -> Self::Register<S>;
}

macro_rules! real {
    (
        $real:ty, $per_register:literal, $transpose:expr, $register:ident, $as_simd:ident,
        $as_mut_simd:ident, $splat:ident, $add:ident, $sub:ident, $mul:ident, $mul_add:ident,
        $negate_mul_add:ident
    ) => {
        impl Real for $real {
            type Register<S: Simd> = S::$register;

            const ZERO: Self = 0.0;
            const PER_REGISTER: usize = $per_register;

            #[inline(always)]
            fn to_f64(self) -> f64 {
                f64::from(self)
            }

            #[inline(always)]
            fn from_f64(value: f64) -> Self {
                value as Self
            }

            #[inline(always)]
            fn transpose<S: Transpose>(simd: S, rows: [[Self; LANES]; LANES]) -> [[Self; LANES]; LANES] {
                $transpose(simd, rows)
            }

            #[inline(always)]
            fn load<S: Simd>(_: S, values: &[Self], register: usize) -> S::$register {
                S::$as_simd(values).0[register]
            }

            #[inline(always)]
            fn store<S: Simd>(_: S, vector: S::$register, values: &mut [Self], register: usize) {
                S::$as_mut_simd(values).0[register] = vector;
            }

            #[inline(always)]
            fn splat<S: Simd>(simd: S, value: Self) -> S::$register {
                simd.$splat(value)
            }

            #[inline(always)]
            fn add<S: Simd>(simd: S, a: S::$register, b: S::$register) -> S::$register {
                simd.$add(a, b)
            }

            #[inline(always)]
            fn sub<S: Simd>(simd: S, a: S::$register, b: S::$register) -> S::$register {
                simd.$sub(a, b)
            }

            #[inline(always)]
            fn mul<S: Simd>(simd: S, a: S::$register, b: S::$register) -> S::$register {
                simd.$mul(a, b)
            }

            #[inline(always)]
            fn mul_add<S: Simd>(simd: S, a: S::$register, b: S::$register, c: S::$register) -> S::$register {
                simd.$mul_add(a, b, c)
            }

            #[inline(always)]
            fn negate_mul_add<S: Simd>(
                simd: S,
                a: S::$register,
                b: S::$register,
                c: S::$register,
            ) -> S::$register {
                simd.$negate_mul_add(a, b, c)
            }
        }
    };
}

real! {
    f64, 4, |_, rows| transpose(rows), f64s, as_simd_f64s, as_mut_simd_f64s, splat_f64s,
    add_f64s, sub_f64s, mul_f64s, mul_add_f64s, negate_mul_add_f64s
}
real! {
    f32, 8, S::transpose_f32s, f32s, as_simd_f32s, as_mut_simd_f32s, splat_f32s,
    add_f32s, sub_f32s, mul_f32s, mul_add_f32s, negate_mul_add_f32s
}

/// A vector in memory, which kernels take into one or more registers.
pub(crate) trait Vector: Copy + Send + Sync + 'static {
    /// A number of the vector.
    type Scalar: Real;

    /// Zeros.
    const ZERO: Self;

    /// The number of registers of 256 bits that hold the vector.
    const REGISTERS: usize;

    fn lanes(&self) -> &[Self::Scalar];
    fn lanes_mut(&mut self) -> &mut [Self::Scalar];
}

impl Vector for F64x4 {
    type Scalar = f64;

    const ZERO: Self = Self::ZERO;
    const REGISTERS: usize = 1;

    #[inline(always)]
    fn lanes(&self) -> &[f64] {
        &self.0
    }

    #[inline(always)]
    fn lanes_mut(&mut self) -> &mut [f64] {
        &mut self.0
    }
}

impl<T: Real> Vector for Vector8<T> {
    type Scalar = T;

    const ZERO: Self = Self::ZERO;
    const REGISTERS: usize = LANES / T::PER_REGISTER;

    #[inline(always)]
    fn lanes(&self) -> &[T] {
        &self.0
    }

    #[inline(always)]
    fn lanes_mut(&mut self) -> &mut [T] {
        &mut self.0
    }
}

/// The instructions that exchange rows and columns, beside those of [`Simd`].
pub trait Transpose: Simd {
    /// A table of eight rows and eight columns with rows and columns exchanged.
    fn transpose_f32s(self, rows: [[f32; LANES]; LANES]) -> [[f32; LANES]; LANES];
}

#[cfg(target_arch = "x86_64")]
impl Transpose for pulp::x86::V3 {
    #[inline(always)]
    fn transpose_f32s(self, rows: [[f32; LANES]; LANES]) -> [[f32; LANES]; LANES] {
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
}

impl Transpose for Scalar256b {
    #[inline(always)]
    fn transpose_f32s(self, rows: [[f32; LANES]; LANES]) -> [[f32; LANES]; LANES] {
        transpose(rows)
    }
}

#[inline(always)]
fn transpose<T: Real>(rows: [[T; LANES]; LANES]) -> [[T; LANES]; LANES] {
    let mut columns = [[T::ZERO; LANES]; LANES];
    for i in 0..LANES {
        for j in 0..LANES {
            columns[i][j] = rows[j][i];
        }
    }
    columns
}

/// A kernel that exchanges rows and columns.
pub(crate) trait WithTranspose {
    /// Runs the kernel. Everything that it calls with vectors is `#[inline(always)]`, as it is itself.
    fn with_transpose<S: Transpose>(self, simd: S);
}

/// Runs a kernel at a level.
pub(crate) fn run_transposing<K: WithTranspose>(level: SimdLevel, kernel: K) {
    match level {
        #[cfg(target_arch = "x86_64")]
        SimdLevel::V4(v4) => Simd::vectorize(*v4, KernelAtLevel(kernel, *v4)),
        #[cfg(target_arch = "x86_64")]
        SimdLevel::V3(v3) => Simd::vectorize(v3, KernelAtLevel(kernel, v3)),
        SimdLevel::Portable => Scalar256b.vectorize(KernelAtLevel(kernel, Scalar256b)),
    }
}

struct KernelAtLevel<K, S>(K, S);

impl<K: WithTranspose, S: Transpose> WithSimd for KernelAtLevel<K, S> {
    type Output = ();

    #[inline(always)]
    fn with_simd<Same: Simd>(self, _: Same) {
        self.0.with_transpose(self.1);
    }
}
