//! The vectors of the transform: eight numbers of one precision, and four doubles, as one trait.
//!
//! Kernels at [`SimdLevel::run`] have registers of 256 bits: eight floats are one of them, eight doubles are
//! two. Those at `run_wide` may have registers of eight doubles.

use pulp::Simd;

use crate::f64x4::{F64x4, Lanes, transposed};

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

    /// One of the registers that hold the vector.
    #[inline(always)]
    pub(crate) fn load<S: Simd>(&self, simd: S, register: usize) -> T::Register<S> {
        T::load(simd, &self.0, register)
    }

    /// Takes one of the registers that hold the vector.
    #[inline(always)]
    pub(crate) fn store<S: Simd>(&mut self, simd: S, vector: T::Register<S>, register: usize) {
        T::store(simd, vector, &mut self.0, register);
    }
}

/// The number of a level's registers that hold eight doubles.
pub(crate) const fn registers<S: Simd>() -> usize {
    LANES / S::F64_LANES
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
    fn transpose<S: Lanes>(simd: S, rows: [[Self; LANES]; LANES]) -> [[Self; LANES]; LANES];

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
            fn transpose<S: Lanes>(simd: S, rows: [[Self; LANES]; LANES]) -> [[Self; LANES]; LANES] {
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
    f64, 4, |_, rows| transposed(rows), f64s, as_simd_f64s, as_mut_simd_f64s, splat_f64s,
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
