//! Exponentials, logarithms and powers, by tables of 128 intervals.
//!
//! The method and the constants are those of Arm's optimized routines (`math/exp.c`, `math/exp2.c` and
//! `math/pow.c`: Copyright (c) 2018-2026, Arm Limited; used under the MIT License, see `LICENSE-ARM`), which
//! the C libraries of Linux use too, without fused multiply-add:
//!
//! - e^x = 2^(k / N) e^r, with r at most ln(2) / 2 N; 2^(k / N) comes from a table, e^r from a polynomial.
//! - ln(x) = k ln(2) + ln(c) + ln(1 + r), x = 2^k z, r = z / c - 1; 1 / c and ln(c) come from a table.
//! - x^y = e^(y ln(x)), with ln(x) as a sum of two doubles.
//!
//! Errors are below 0.55 units in the last place. What is rare (zeros, infinities, NaN, negative bases,
//! results that overflow or are tiny) is computed by `libm`.

use crate::tables::{EXP, LOG, N};

const N_BY_LN2: f64 = N as f64 * std::f64::consts::LOG2_E;
/// -ln(2) / N: the upper bits, and the rest.
const MINUS_LN2_BY_N: [f64; 2] = [-0.005415212348111709, -1.2864023111638346e-14];
/// A number which, added to another and subtracted again, leaves the nearest integer, which is also in the
/// lowest bits of the sum.
const SHIFT: f64 = 1.5 * (1_u64 << 52) as f64;
/// The coefficients of r^2 to r^5 in e^r.
const EXP_TERMS: [f64; 4] =
    [0.49999999999996786, 0.16666666666665886, 0.0416666808410674, 0.008333335853059549];
/// The coefficients of r to r^5 in 2^r.
const EXP2_TERMS: [f64; 5] = [
    std::f64::consts::LN_2,
    0.24022650695909065,
    0.0555041086686087,
    0.009618131975721055,
    0.0013332074570119598,
];
/// Where the intervals of the table of logarithms begin: the bits of 0x1.69555p-1.
const LOG_START: u64 = 0x3fe6_9555_0000_0000;
/// ln(2) in two parts: so many bits that k times them is exact, and the rest.
const LN2: [f64; 2] = [0.6931471805598903, 5.497923018708371e-14];
/// The coefficients of r^3 to r^8 in ln(1 + r), each times that power of -2 with which it is evaluated.
const LN_TERMS: [f64; 6] = [
    -0.6666666666666679,
    0.5000000000000007,
    0.7999999995323976,
    -0.6666666663487739,
    -1.142909628459501,
    1.0000415263675542,
];

/// The bits of 1.0, of infinity and of the smallest normal number.
const INFINITY: u64 = 0x7ff << 52;
const SMALLEST: u64 = 1 << 52;

/// Whether a number is positive, normal and finite.
#[inline]
fn is_plain(bits: u64) -> bool {
    bits.wrapping_sub(SMALLEST) < INFINITY - SMALLEST
}

/// 2^(k / N) (1 + rest + the table's error), for the integer in the lowest bits of k.
#[inline]
fn scaled(k: u64, rest: impl FnOnce(f64) -> f64) -> f64 {
    let (error, bits) = EXP[k as usize % N];
    let scale = f64::from_bits(bits.wrapping_add(k << (52 - 7)));
    scale + scale * rest(f64::from_bits(error))
}

/// e^(x + tail) for |x| < 512 and a tail that is much smaller than 1 / N.
#[inline]
fn exp_of_sum(x: f64, tail: f64) -> f64 {
    let shifted = x * N_BY_LN2 + SHIFT;
    let k = shifted - SHIFT;
    let r = x + k * MINUS_LN2_BY_N[0] + k * MINUS_LN2_BY_N[1] + tail;
    let r2 = r * r;
    let [c2, c3, c4, c5] = EXP_TERMS;
    scaled(shifted.to_bits(), |error| error + r + r2 * (c2 + r * c3) + r2 * r2 * (c4 + r * c5))
}

#[inline]
pub(crate) fn exp(x: f64) -> f64 {
    if x.abs() < 512.0 { exp_of_sum(x, 0.0) } else { libm::exp(x) }
}

/// 2^x for |x| < 512.
#[inline]
fn exp2_of(x: f64) -> f64 {
    let shift = SHIFT / N as f64;
    let shifted = x + shift;
    let r = x - (shifted - shift);
    let r2 = r * r;
    let [c1, c2, c3, c4, c5] = EXP2_TERMS;
    scaled(shifted.to_bits(), |error| error + r * c1 + r2 * (c2 + r * c3) + r2 * r2 * (c4 + r * c5))
}

#[inline]
pub(crate) fn exp2(x: f64) -> f64 {
    if x.abs() < 512.0 { exp2_of(x) } else { libm::exp2(x) }
}

/// Splits the bits of a plain number x = 2^k z into k and z; returns them with 1 / c, ln(c) and the rest that
/// ln(c) leaves out.
#[inline]
fn interval(bits: u64) -> (f64, u64, &'static (f64, f64, f64)) {
    let above = bits.wrapping_sub(LOG_START);
    let k = (above as i64) >> 52;
    (k as f64, bits.wrapping_sub(above & (0xfff << 52)), &LOG[(above >> (52 - 7)) as usize % N])
}

/// The logarithm of a plain number, as a sum of two doubles.
#[inline]
fn ln_in_two(bits: u64) -> (f64, f64) {
    let (k, z_bits, &(inverse, ln_c, ln_c_tail)) = interval(bits);
    let z = f64::from_bits(z_bits);
    // The upper part has so few bits that its product with 1 / c and the square of r are exact.
    let z_upper = f64::from_bits(z_bits.wrapping_add(1 << 31) & (u64::MAX << 32));
    let (r_upper, r_lower) = (z_upper * inverse - 1.0, (z - z_upper) * inverse);
    let r = r_upper + r_lower;
    let sum = k * LN2[0] + ln_c;
    let with_r = sum + r;
    let (lost, lost_r) = (k * LN2[1] + ln_c_tail, sum - with_r + r);
    let (half, half_upper) = (-0.5 * r, -0.5 * r_upper);
    let (half_r2, half_upper_r2) = (r * half, r_upper * half_upper);
    let upper = with_r + half_upper_r2;
    let (lost_r2, lost_sum) = (r_lower * (half + half_upper), with_r - upper + half_upper_r2);
    let [c3, c4, c5, c6, c7, c8] = LN_TERMS;
    let higher = r * half_r2 * (c3 + r * c4 + half_r2 * (c5 + r * c6 + half_r2 * (c7 + r * c8)));
    let lower = lost + lost_r + lost_r2 + lost_sum + higher;
    let ln = upper + lower;
    (ln, upper - ln + lower)
}

#[inline]
pub(crate) fn ln(x: f64) -> f64 {
    let bits = x.to_bits();
    if is_plain(bits) { ln_of_plain(bits) } else { libm::log(x) }
}

/// The logarithm of a plain number, computed like [`ln_in_two`] but with an r that is rounded.
#[inline]
fn ln_of_plain(bits: u64) -> f64 {
    let (k, z_bits, &(inverse, ln_c, ln_c_tail)) = interval(bits);
    let z = f64::from_bits(z_bits);
    let z_upper = f64::from_bits(z_bits.wrapping_add(1 << 31) & (u64::MAX << 32));
    let r = (z_upper * inverse - 1.0) + (z - z_upper) * inverse;
    let sum = k * LN2[0] + ln_c;
    let upper = sum + r;
    let lower = k * LN2[1] + ln_c_tail + (sum - upper + r);
    let half_r2 = -0.5 * (r * r);
    let [c3, c4, c5, c6, c7, c8] = LN_TERMS;
    let higher = r * half_r2 * (c3 + r * c4 + half_r2 * (c5 + r * c6 + half_r2 * (c7 + r * c8)));
    upper + (lower + half_r2 + higher)
}

#[inline]
pub(crate) fn pow(x: f64, y: f64) -> f64 {
    let bits = x.to_bits();
    if is_plain(bits) {
        let (ln, tail) = ln_in_two(bits);
        // Halves of 26 bits, whose products are exact.
        let upper = |value: f64| f64::from_bits(value.to_bits() & (u64::MAX << 27));
        let (y_upper, ln_upper) = (upper(y), upper(ln));
        let product = y_upper * ln_upper;
        let lower = (y - y_upper) * ln_upper + y * (ln - ln_upper + tail);
        if product.abs() < 512.0 {
            return exp_of_sum(product, lower);
        }
    }
    libm::pow(x, y)
}

/// The functions of single precision: computed in double precision with fewer terms, and rounded once.
pub(crate) mod single {
    use std::f64::consts::{LN_2, LOG2_E, LOG10_E};

    use super::{MINUS_LN2_BY_N, N_BY_LN2, SHIFT, interval, scaled};

    /// e^x to 37 bits, at least; beyond what single precision holds, the value at 200 or -200.
    #[inline]
    fn exp_of(x: f64) -> f64 {
        let x = if x.abs() < 200.0 { x } else { x.clamp(-200.0, 200.0) };
        let shifted = x * N_BY_LN2 + SHIFT;
        let r = x + (shifted - SHIFT) * (MINUS_LN2_BY_N[0] + MINUS_LN2_BY_N[1]);
        scaled(shifted.to_bits(), |_| r + r * r * (0.5 + r * (1.0 / 6.0)))
    }

    /// ln(x) to 37 bits, at least, for a positive number of single precision.
    #[inline]
    fn ln_of(x: f32) -> f64 {
        let (k, z, &(inverse, ln_c, _)) = interval(f64::from(x).to_bits());
        // Exact: x has 24 bits, 1 / c has 9.
        let r = f64::from_bits(z) * inverse - 1.0;
        let r2 = r * r;
        k * LN_2 + ln_c + (r + r2 * (r * (1.0 / 3.0) - 0.5 + r2 * (r * 0.2 - 0.25)))
    }

    #[inline]
    fn is_plain(x: f32) -> bool {
        x > 0.0 && x < f32::INFINITY
    }

    #[inline]
    pub(crate) fn exp(x: f32) -> f32 {
        exp_of(x.into()) as f32
    }

    #[inline]
    pub(crate) fn exp2(x: f32) -> f32 {
        exp_of(f64::from(x) * LN_2) as f32
    }

    #[inline]
    pub(crate) fn ln(x: f32) -> f32 {
        if is_plain(x) { ln_of(x) as f32 } else { libm::logf(x) }
    }

    #[inline]
    pub(crate) fn log2(x: f32) -> f32 {
        if is_plain(x) { (ln_of(x) * LOG2_E) as f32 } else { libm::logf(x) }
    }

    #[inline]
    pub(crate) fn log10(x: f32) -> f32 {
        if is_plain(x) { (ln_of(x) * LOG10_E) as f32 } else { libm::logf(x) }
    }

    #[inline]
    pub(crate) fn pow(x: f32, y: f32) -> f32 {
        if is_plain(x) && y.is_finite() { exp_of(f64::from(y) * ln_of(x)) as f32 } else { libm::powf(x, y) }
    }
}
