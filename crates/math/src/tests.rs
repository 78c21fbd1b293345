//! Accuracy against std, exact values, and the bits.

#![allow(clippy::disallowed_methods)] // std is what the functions are compared with

use super::*;

/// A function of this crate and that of std, and what it maps into its domain.
struct Case<R> {
    name: &'static str,
    ours: fn(R, R) -> R,
    std: fn(R, R) -> R,
    /// Maps (0, 1) into the domain.
    domain: fn(f64) -> f64,
    /// The largest difference to std in units in the last place, of the two libraries together.
    ulp: u64,
    /// The digest of the values' bits.
    digest: u64,
}

/// The cases of a type, each with the largest difference and the digest.
macro_rules! cases {
    ($real:ty: $($name:ident $std:ident $domain:expr, $ulp:literal, $digest:literal;)*
     $(& $pair:ident $of_two:ident $both:expr, $most:literal, $bits:literal;)*) => {
        [
            $(Case::<$real> {
                name: stringify!($name),
                ours: |x, _| $name(x),
                std: |x, _| x.$std(),
                domain: $domain,
                ulp: $ulp,
                digest: $digest,
            },)*
            $(Case::<$real> {
                name: stringify!($pair),
                ours: |x, y| $pair(x, y),
                std: |x, y| x.$of_two(y),
                domain: $both,
                ulp: $most,
                digest: $bits,
            },)*
        ]
    };
}

/// Asserts the differences and the digests of cases.
macro_rules! assert_agree {
    ($cases:ident, $real:ty) => {
        let mut errors = Vec::new();
        for Case { name, ours, std, domain, ulp, digest } in $cases {
            let (mut most, mut at, mut bits) = (0, Default::default(), Digest::new());
            for (u, v) in places() {
                let (x, y) = (domain(u) as $real, domain(v) as $real);
                let (found, expected) = (ours(x, y), std(x, y));
                let steps = found.to_bits().abs_diff(expected.to_bits()) as u64;
                if steps > most && found != expected {
                    (most, at) = (steps, (x, y));
                }
                bits.add(&found.to_bits().to_le_bytes());
            }
            // std of Windows with MinGW errs by hundreds of the last place.
            if most > ulp && !cfg!(windows) || bits.0 != digest {
                errors.push(format!("{name}: {most} ulp at {at:?}; digest {:#018x}", bits.0));
            }
        }
        assert!(errors.is_empty(), "{errors:#?}");
    };
}

const PLACES: u32 = 20_000;

/// Numbers in (0, 1) with bits in every place.
fn places() -> impl Iterator<Item = (f64, f64)> {
    let fraction = |seed: u32, factor: f64| (f64::from(seed) * factor).fract().max(1e-9);
    (1..=PLACES)
        .map(move |seed| (fraction(seed, 0.618_033_988_749_894_9), fraction(seed, 0.754_877_666_246_692_7)))
}

const ANGLE: fn(f64) -> f64 = |u| 40.0 * u - 20.0;
const UNIT: fn(f64) -> f64 = |u| 2.0 * u - 1.0;
const POSITIVE: fn(f64) -> f64 = |u| u / (1.0 - u);

/// The digests are those of every machine. If one changes, so do the results of nearly all kinds, whose
/// revisions must be raised.
#[test]
fn double_precision_agrees_with_std_and_has_these_bits_everywhere() {
    let cases = cases! { f64:
        sin sin ANGLE, 1, 0xc69e_6229_db6d_d485;
        cos cos ANGLE, 1, 0x76d1_dd1d_683f_5d03;
        tan tan ANGLE, 1, 0x77d2_2267_ea39_6677;
        asin asin UNIT, 1, 0x7146_3d38_018a_bc42;
        acos acos UNIT, 1, 0xbdbd_34fb_be79_80bb;
        atan atan ANGLE, 1, 0x07e5_b573_ce06_dbe7;
        sinh sinh ANGLE, 2, 0xafce_7836_b421_43d5;
        cosh cosh ANGLE, 2, 0x8bcd_9dcd_e58d_32bc;
        tanh tanh ANGLE, 2, 0xf8ff_0270_32fc_0f50;
        asinh asinh ANGLE, 2, 0xc6ab_27c5_78b1_6375;
        exp exp |u| 1600.0 * u - 800.0, 1, 0x5e96_6fc9_b127_a94e;
        exp2 exp2 |u| 2400.0 * u - 1200.0, 1, 0xf81d_f242_a10c_b3b1;
        exp_m1 exp_m1 UNIT, 1, 0x9086_21ba_0293_5cd7;
        ln ln POSITIVE, 1, 0x2f5f_01fc_d467_75f3;
        ln_1p ln_1p POSITIVE, 1, 0x021e_a8f7_e8e7_7386;
        log2 log2 POSITIVE, 1, 0xe7a7_b00b_4931_0b23;
        log10 log10 POSITIVE, 2, 0x5b34_3efd_9515_244d;
        cbrt cbrt ANGLE, 1, 0xee1c_2903_0ce4_0cf3;
        & atan2 atan2 ANGLE, 1, 0x5348_0478_46f6_1f75;
        & hypot hypot ANGLE, 1, 0xaa48_4ac4_57bf_2d46;
        & pow powf POSITIVE, 1, 0xe60e_61e6_ad7b_4fba;
    };
    assert_agree!(cases, f64);
}

#[test]
fn single_precision_agrees_with_std_and_has_these_bits_everywhere() {
    let cases = cases! { f32:
        sin sin ANGLE, 1, 0xbf2b_a955_bb4c_fdfc;
        cos cos ANGLE, 1, 0xbcf8_cf51_b5e8_dae7;
        tan tan ANGLE, 1, 0xdd3d_1b7b_8cde_6a81;
        asin asin UNIT, 2, 0xdb52_60f9_64dd_0cc4;
        acos acos UNIT, 2, 0x5fe3_7f90_43d8_0bab;
        atan atan ANGLE, 1, 0xb192_9ef3_9344_7736;
        sinh sinh ANGLE, 2, 0xc175_f2eb_9b49_27a9;
        cosh cosh ANGLE, 2, 0x6d47_8962_e8bf_c494;
        tanh tanh ANGLE, 2, 0xff27_700a_d76e_a506;
        asinh asinh ANGLE, 2, 0xebb6_4691_c106_aa75;
        exp exp |u| 220.0 * u - 110.0, 1, 0xa5da_201c_c70f_9e47;
        exp2 exp2 |u| 320.0 * u - 160.0, 1, 0x2e1e_0a99_103f_2ae5;
        exp_m1 exp_m1 UNIT, 1, 0x5721_a690_ba15_ed03;
        ln ln POSITIVE, 1, 0x96c6_468a_54cd_bcaa;
        ln_1p ln_1p POSITIVE, 1, 0x959b_1ece_798d_eab7;
        log2 log2 POSITIVE, 1, 0xab7e_8068_a2b6_a774;
        log10 log10 POSITIVE, 2, 0x19fd_30fc_db39_e427;
        cbrt cbrt ANGLE, 1, 0x9745_d025_2a34_f2c1;
        & atan2 atan2 ANGLE, 1, 0x0cda_6ba7_dc45_40eb;
        & hypot hypot ANGLE, 1, 0x6919_4e16_f073_8c1b;
        & pow powf POSITIVE, 1, 0x3e99_78ae_fb5f_e4f0;
    };
    assert_agree!(cases, f32);
}

/// The 64-bit FNV-1a hash.
struct Digest(u64);

impl Digest {
    fn new() -> Self {
        Self(0xcbf2_9ce4_8422_2325)
    }

    fn add(&mut self, bytes: &[u8]) {
        for byte in bytes {
            self.0 = (self.0 ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3);
        }
    }
}

#[test]
fn rare_arguments_have_the_values_of_std() {
    let rare = [
        0.0,
        -0.0,
        1.0,
        -1.0,
        0.5,
        2.0,
        -2.0,
        3.0,
        -3.0,
        1e-310,
        -1e-310,
        1e-20,
        709.0,
        746.0,
        -746.0,
        1e20,
        1e300,
        f64::MIN_POSITIVE,
        f64::MAX,
        f64::INFINITY,
        f64::NEG_INFINITY,
        f64::NAN,
    ];
    let near = |found: f64, expected: f64| {
        found == expected
            || found.is_nan() && expected.is_nan()
            || found.is_sign_positive() == expected.is_sign_positive()
                && found.to_bits().abs_diff(expected.to_bits()) <= 1
    };
    for x in rare {
        assert!(near(exp(x), x.exp()), "exp({x}) = {}", exp(x));
        assert!(near(exp2(x), x.exp2()), "exp2({x}) = {}", exp2(x));
        assert!(near(ln(x), x.ln()), "ln({x}) = {}", ln(x));
        let single = x as f32;
        let near_single = |found: f32, expected: f32| {
            found == expected
                || found.is_nan() && expected.is_nan()
                || found.to_bits().abs_diff(expected.to_bits()) <= 1
        };
        assert!(near_single(exp(single), single.exp()), "exp({single}) = {}", exp(single));
        assert!(near_single(exp2(single), single.exp2()), "exp2({single}) = {}", exp2(single));
        assert!(near_single(ln(single), single.ln()), "ln({single}) = {}", ln(single));
        assert!(near_single(log2(single), single.log2()), "log2({single}) = {}", log2(single));
        assert!(near_single(log10(single), single.log10()), "log10({single}) = {}", log10(single));
        for y in rare {
            assert!(near(pow(x, y), x.powf(y)), "pow({x}, {y}) = {}", pow(x, y));
            assert!(near(hypot(x, y), x.hypot(y)), "hypot({x}, {y}) = {}", hypot(x, y));
            let (found, expected) = (pow(single, y as f32), single.powf(y as f32));
            assert!(near_single(found, expected), "pow({single}, {y}) = {found}");
        }
    }
}

#[test]
fn powers_of_integers_are_exact() {
    for x in -9_i64..=9 {
        for n in 0..=12 {
            assert_eq!(powi(x as f64, n), x.pow(n as u32) as f64);
        }
    }
    assert_eq!(powi(2.0_f64, -1074), 0.0, "2^1074 overflows");
    assert_eq!(powi(0.5_f64, -3), 8.0);
    assert_eq!(powi(0.0_f64, 0), 1.0);
    assert_eq!(powi(2.0_f64, i32::MIN), 0.0);
    assert_eq!([log2(8.0_f32), exp2(5.0), log10(1000.0), pow(10.0, 4.0)], [3.0, 32.0, 3.0, 1e4]);
    assert_eq!([exp2(5.0_f64), pow(3.0, 2.0), pow(4.0, 0.5)], [32.0, 9.0, 2.0]);
}

#[test]
fn sine_and_cosine_together_are_those_alone() {
    for (u, _) in places() {
        let x = ANGLE(u);
        assert_eq!(sin_cos(x), (sin(x), cos(x)));
        assert_eq!(sin_cos(x as f32), (sin(x as f32), cos(x as f32)));
    }
}
