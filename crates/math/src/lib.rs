//! Elementary functions with the same bits on every machine.
//!
//! The methods of `f64` and `f32` (`sin`, `exp`, `powf` ...) call the system's library, which rounds in
//! another way with and without fused multiply-add and from one version to the next, and the compiler may
//! compute a constant call with a third library. What reaches an artifact therefore uses these functions,
//! which are plain Rust: additions, multiplications, divisions and square roots, each rounded as IEEE 754
//! says, never fused. `sqrt`, `mul_add`, `abs`, `floor`, `round` and `%` are exact, and stay those of std.
//!
//! Most functions are those of crate `libm`, a port of musl's. Exponentials, logarithms and powers, on which
//! whole kernels wait, are those of `exponential.rs`, and `hypot.rs` has a length that is rounded correctly
//! nearly always.
//!
//! ```
//! // A right angle in a circle of radius 5.
//! assert_eq!(math::hypot(3.0, 4.0), 5.0);
//! assert_eq!(math::powi(2.0_f32, -3), 0.125);
//! ```

#![cfg_attr(not(test), warn(clippy::disallowed_methods))] // tests may compute with std

mod exponential;
mod hypot;
mod tables;

/// `f32` or `f64`.
pub trait Real: sealed::Sealed + Copy {}

impl Real for f32 {}
impl Real for f64 {}

mod sealed {
    /// The functions of one type.
    pub trait Sealed: Sized {
        fn sin(self) -> Self;
        fn cos(self) -> Self;
        fn tan(self) -> Self;
        fn sin_cos(self) -> (Self, Self);
        fn asin(self) -> Self;
        fn acos(self) -> Self;
        fn atan(self) -> Self;
        fn atan2(self, x: Self) -> Self;
        fn sinh(self) -> Self;
        fn cosh(self) -> Self;
        fn tanh(self) -> Self;
        fn asinh(self) -> Self;
        fn exp(self) -> Self;
        fn exp2(self) -> Self;
        fn exp_m1(self) -> Self;
        fn ln(self) -> Self;
        fn ln_1p(self) -> Self;
        fn log2(self) -> Self;
        fn log10(self) -> Self;
        fn pow(self, y: Self) -> Self;
        fn powi(self, n: i32) -> Self;
        fn cbrt(self) -> Self;
        fn hypot(self, y: Self) -> Self;
    }
}

/// The functions of a type, by the names of its implementations.
macro_rules! functions {
    ($real:ty, $($name:ident = $implementation:path),*; $($pair:ident = $of_two:path),*; $sin_cos:path) => {
        impl sealed::Sealed for $real {
            $(
                #[inline]
                fn $name(self) -> Self {
                    $implementation(self)
                }
            )*
            $(
                #[inline]
                fn $pair(self, other: Self) -> Self {
                    $of_two(self, other)
                }
            )*
            #[inline]
            fn sin_cos(self) -> (Self, Self) {
                $sin_cos(self)
            }
            #[inline]
            fn powi(self, n: i32) -> Self {
                let (mut power, mut rest, mut result) = (self, n.unsigned_abs(), 1.0);
                loop {
                    if rest & 1 == 1 {
                        result *= power;
                    }
                    rest >>= 1;
                    if rest == 0 {
                        break;
                    }
                    power *= power;
                }
                if n < 0 { 1.0 / result } else { result }
            }
        }
    };
}

functions!(
    f64,
    sin = libm::sin, cos = libm::cos, tan = libm::tan, asin = libm::asin, acos = libm::acos, atan = libm::atan,
    sinh = libm::sinh, cosh = libm::cosh, tanh = libm::tanh, asinh = libm::asinh,
    exp = exponential::exp, exp2 = exponential::exp2, exp_m1 = libm::expm1,
    ln = exponential::ln, ln_1p = libm::log1p, log2 = libm::log2, log10 = libm::log10, cbrt = libm::cbrt;
    atan2 = libm::atan2, pow = exponential::pow, hypot = hypot::hypot;
    libm::sincos
);

functions!(
    f32,
    sin = libm::sinf, cos = libm::cosf, tan = libm::tanf, asin = libm::asinf, acos = libm::acosf, atan = libm::atanf,
    sinh = libm::sinhf, cosh = libm::coshf, tanh = libm::tanhf, asinh = libm::asinhf,
    exp = exponential::single::exp, exp2 = exponential::single::exp2, exp_m1 = libm::expm1f,
    ln = exponential::single::ln, ln_1p = libm::log1pf, log2 = exponential::single::log2, log10 = exponential::single::log10, cbrt = libm::cbrtf;
    atan2 = libm::atan2f, pow = exponential::single::pow, hypot = libm::hypotf;
    libm::sincosf
);

/// Public functions of one argument.
macro_rules! of_one {
    ($($(#[$docs:meta])* $name:ident),* $(,)?) => {
        $(
            $(#[$docs])*
            #[inline]
            pub fn $name<R: Real>(x: R) -> R {
                sealed::Sealed::$name(x)
            }
        )*
    };
}

of_one! {
    /// The sine of an angle in radians.
    sin,
    /// The cosine of an angle in radians.
    cos,
    /// The tangent of an angle in radians.
    tan,
    /// The angle in [-pi/2, pi/2] with this sine.
    asin,
    /// The angle in [0, pi] with this cosine.
    acos,
    /// The angle in [-pi/2, pi/2] with this tangent.
    atan,
    /// The hyperbolic sine.
    sinh,
    /// The hyperbolic cosine.
    cosh,
    /// The hyperbolic tangent.
    tanh,
    /// The inverse of the hyperbolic sine.
    asinh,
    /// e^x.
    exp,
    /// 2^x.
    exp2,
    /// e^x - 1, accurate near 0.
    exp_m1,
    /// The natural logarithm.
    ln,
    /// ln(1 + x), accurate near 0.
    ln_1p,
    /// The logarithm to base 2.
    log2,
    /// The logarithm to base 10.
    log10,
    /// The cube root.
    cbrt,
}

/// The sine and the cosine of an angle in radians.
#[inline]
pub fn sin_cos<R: Real>(x: R) -> (R, R) {
    sealed::Sealed::sin_cos(x)
}

/// The angle of the vector (x, y) in [-pi, pi].
#[inline]
pub fn atan2<R: Real>(y: R, x: R) -> R {
    sealed::Sealed::atan2(y, x)
}

/// x^y.
#[inline]
pub fn pow<R: Real>(x: R, y: R) -> R {
    sealed::Sealed::pow(x, y)
}

/// x^n by repeated squaring, from the lowest bit of n to the highest; a negative power is the reciprocal of
/// the positive one. Exact where all powers are.
#[inline]
pub fn powi<R: Real>(x: R, n: i32) -> R {
    sealed::Sealed::powi(x, n)
}

/// The length of the vector (x, y), without overflow.
#[inline]
pub fn hypot<R: Real>(x: R, y: R) -> R {
    sealed::Sealed::hypot(x, y)
}

#[cfg(test)]
mod tests;
