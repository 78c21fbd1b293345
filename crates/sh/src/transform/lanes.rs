//! Four doubles at a time: AVX2 with fused multiply-add where the CPU has it, plain arrays elsewhere.
//!
//! A kernel is written once over [`Simd`] and compiled for each level. On one level its results are the same
//! everywhere; levels differ by the rounding of a * b + c.

/// Lanes in a vector, on every level.
pub(crate) const LANES: usize = 4;

/// Four doubles in memory.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C, align(32))]
pub(crate) struct Lane(pub(crate) [f64; LANES]);

impl Lane {
    pub(crate) const ZERO: Self = Self([0.0; LANES]);
}

/// What a kernel needs of a SIMD level.
pub(crate) trait Simd: Copy {
    /// Four doubles in registers.
    type Vector: Copy;

    fn load(self, lane: &Lane) -> Self::Vector;
    fn store(self, vector: Self::Vector, lane: &mut Lane);
    fn splat(self, value: f64) -> Self::Vector;
    fn add(self, a: Self::Vector, b: Self::Vector) -> Self::Vector;
    fn sub(self, a: Self::Vector, b: Self::Vector) -> Self::Vector;
    fn mul(self, a: Self::Vector, b: Self::Vector) -> Self::Vector;
    /// a * b + c, fused where that is one instruction.
    fn mul_add(self, a: Self::Vector, b: Self::Vector, c: Self::Vector) -> Self::Vector;
    /// Whether the size of any lane is above a limit.
    fn any_beyond(self, vector: Self::Vector, limit: f64) -> bool;
}

/// A computation that any level can run. Implementations are `#[inline(always)]`, so that they are compiled
/// with the instructions of their level.
pub(crate) trait Kernel {
    type Output;
    fn run<S: Simd>(self, simd: S) -> Self::Output;
}

/// The instruction set that kernels run on.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Level {
    /// AVX2 and FMA, found on this CPU.
    #[cfg(target_arch = "x86_64")]
    V3(pulp::x86::V3),
    /// Any CPU.
    Portable,
}

impl Level {
    /// The best level of this CPU.
    pub(crate) fn detect() -> Self {
        #[cfg(target_arch = "x86_64")]
        if let Some(v3) = pulp::x86::V3::try_new() {
            return Self::V3(v3);
        }
        Self::Portable
    }

    /// Runs a kernel compiled for this level.
    pub(crate) fn run<K: Kernel>(self, kernel: K) -> K::Output {
        match self {
            #[cfg(target_arch = "x86_64")]
            Self::V3(v3) => v3.vectorize(v3::Call { v3, kernel }),
            Self::Portable => kernel.run(Portable),
        }
    }
}

#[derive(Clone, Copy)]
pub(crate) struct Portable;

impl Simd for Portable {
    type Vector = [f64; LANES];

    #[inline(always)]
    fn load(self, lane: &Lane) -> Self::Vector {
        lane.0
    }

    #[inline(always)]
    fn store(self, vector: Self::Vector, lane: &mut Lane) {
        lane.0 = vector;
    }

    #[inline(always)]
    fn splat(self, value: f64) -> Self::Vector {
        [value; LANES]
    }

    #[inline(always)]
    fn add(self, a: Self::Vector, b: Self::Vector) -> Self::Vector {
        std::array::from_fn(|i| a[i] + b[i])
    }

    #[inline(always)]
    fn sub(self, a: Self::Vector, b: Self::Vector) -> Self::Vector {
        std::array::from_fn(|i| a[i] - b[i])
    }

    #[inline(always)]
    fn mul(self, a: Self::Vector, b: Self::Vector) -> Self::Vector {
        std::array::from_fn(|i| a[i] * b[i])
    }

    #[inline(always)]
    fn mul_add(self, a: Self::Vector, b: Self::Vector, c: Self::Vector) -> Self::Vector {
        std::array::from_fn(|i| a[i] * b[i] + c[i])
    }

    #[inline(always)]
    fn any_beyond(self, vector: Self::Vector, limit: f64) -> bool {
        vector.iter().any(|value| value.abs() > limit)
    }
}

#[cfg(target_arch = "x86_64")]
mod v3 {
    use core::arch::x86_64::{__m256d, _CMP_GT_OQ};

    use pulp::x86::V3;

    use super::{Kernel, LANES, Lane, Simd};

    pub(super) struct Call<K> {
        pub(super) v3: V3,
        pub(super) kernel: K,
    }

    impl<K: Kernel> pulp::NullaryFnOnce for Call<K> {
        type Output = K::Output;

        #[inline(always)]
        fn call(self) -> K::Output {
            self.kernel.run(self.v3)
        }
    }

    impl Simd for V3 {
        type Vector = __m256d;

        #[inline(always)]
        fn load(self, lane: &Lane) -> __m256d {
            pulp::cast::<[f64; LANES], __m256d>(lane.0)
        }

        #[inline(always)]
        fn store(self, vector: __m256d, lane: &mut Lane) {
            lane.0 = pulp::cast::<__m256d, [f64; LANES]>(vector);
        }

        #[inline(always)]
        fn splat(self, value: f64) -> __m256d {
            self.avx._mm256_set1_pd(value)
        }

        #[inline(always)]
        fn add(self, a: __m256d, b: __m256d) -> __m256d {
            self.avx._mm256_add_pd(a, b)
        }

        #[inline(always)]
        fn sub(self, a: __m256d, b: __m256d) -> __m256d {
            self.avx._mm256_sub_pd(a, b)
        }

        #[inline(always)]
        fn mul(self, a: __m256d, b: __m256d) -> __m256d {
            self.avx._mm256_mul_pd(a, b)
        }

        #[inline(always)]
        fn mul_add(self, a: __m256d, b: __m256d, c: __m256d) -> __m256d {
            self.fma._mm256_fmadd_pd(a, b, c)
        }

        #[inline(always)]
        fn any_beyond(self, vector: __m256d, limit: f64) -> bool {
            let size = self.avx._mm256_andnot_pd(self.splat(-0.0), vector);
            let above = self.avx._mm256_cmp_pd::<_CMP_GT_OQ>(size, self.splat(limit));
            self.avx._mm256_movemask_pd(above) != 0
        }
    }
}
