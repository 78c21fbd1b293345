//! Numbers far below what a double holds.
//!
//! The recurrences in l for Legendre's and Wigner's functions start from powers of sines that leave the range
//! of a double and grow to matter later. So a value starts as v 2^(-160 e), and takes part in sums when e has
//! come down to 0: what is left out until then is below 2^-80 of a function of size one.

use crate::f64x4::{F64x4, LANES};

/// One unit of the exponent e; a value is kept within the square roots of it and of its inverse.
pub(crate) const UNIT: f64 = power_of_two(160);
pub(crate) const INVERSE_UNIT: f64 = power_of_two(-160);
pub(crate) const HIGH: f64 = power_of_two(80);
const LOW: f64 = power_of_two(-80);

const fn power_of_two(exponent: i64) -> f64 {
    f64::from_bits(((1023 + exponent) as u64) << 52)
}

/// Four values v 2^(-160 e).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scaled {
    pub(crate) value: F64x4,
    pub(crate) exponent: F64x4,
}

impl Scaled {
    /// Four zeros.
    pub const ZERO: Self = Self { value: F64x4::ZERO, exponent: F64x4::ZERO };

    /// Four ones.
    pub const ONE: Self = Self { value: F64x4([1.0; LANES]), exponent: F64x4::ZERO };

    /// Multiplies two vectors; v of a number that is not negative is between 2^-80 and 2^80 if e > 0.
    #[inline(always)]
    pub fn times(self, other: Self) -> Self {
        let mut product = self;
        for i in 0..LANES {
            product.value.0[i] *= other.value.0[i];
            product.exponent.0[i] += other.exponent.0[i];
            let low = product.value.0[i] < LOW;
            let high = product.value.0[i] > HIGH;
            product.value.0[i] *= if low {
                UNIT
            } else if high {
                INVERSE_UNIT
            } else {
                1.0
            };
            product.exponent.0[i] += if low {
                1.0
            } else if high {
                -1.0
            } else {
                0.0
            };
        }
        product
    }

    /// Multiplies by factors that a double holds.
    #[inline(always)]
    pub fn times_plain(self, factors: F64x4) -> Self {
        self.times(Self { value: factors, exponent: F64x4::ZERO })
    }

    /// Multiplies by 1 or -1.
    #[inline(always)]
    pub fn with_sign(mut self, sign: f64) -> Self {
        self.value.0.iter_mut().for_each(|value| *value *= sign);
        self
    }

    #[inline(always)]
    pub(crate) fn set_lane(&mut self, lane: usize, from: Self) {
        (self.value.0[lane], self.exponent.0[lane]) = (from.value.0[lane], from.exponent.0[lane]);
    }
}
