//! The sums over texels for the models whose rho_hat is a few instructions, eight texels or more at a time in
//! f32.
//!
//! A texel costs its direction's dot products, rho_hat and three fused multiply-adds. Powers of whole
//! exponents are repeated squares; others and the Gaussian of equation 11 are 2^y, with y's whole part put
//! into the exponent's bits and polynomials for the rest (fitted to the least largest relative error, which
//! their comments give). f32 rounding of a cosine c costs c^s a relative error of s * 6e-8 and the Gaussian
//! one of 6e-8 / sigma^2; [`Lobe::of`] accepts a model only if that stays below 1e-4 for a single texel.
//! Sums are carried to f64 every thousand texels.

use brdf::Material;
use pulp::Simd;
use sh::f64x4::SimdLevel;
use sphere::DVec3;

use super::lit_texels::{LitTexels, Row, Span};

/// A rho_hat that is computed in vectors, up to a factor for each channel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Lobe {
    /// max(0, C . L)^s, s a whole number.
    WholePower(u32),
    /// max(0, C . L)^s.
    Power(f32),
    /// e^(-(theta_h / sigma)^2) above the horizon.
    Gaussian { sigma: f32 },
}

impl Lobe {
    /// The lobe of a material and its factors; `None` if it has none or f32 is not accurate enough.
    pub(super) fn of(material: &Material) -> Option<(Self, [f64; 3])> {
        match material {
            Material::Lambert(lambert) => {
                Some((Self::WholePower(1), lambert.albedo().map(|albedo| albedo / std::f64::consts::PI)))
            }
            Material::Phong(phong) => {
                let s = phong.exponent();
                let scale = phong.specular().map(|specular| specular * (s + 1.0) / std::f64::consts::TAU);
                let whole = s >= 1.0 && s.fract() == 0.0;
                let shape = if whole { Self::WholePower(s as u32) } else { Self::Power(s as f32) };
                (s <= 1024.0).then_some((shape, scale))
            }
            Material::Microfacet(microfacet) => {
                let sigma = microfacet.sigma();
                let peak = 1.0 / (4.0 * std::f64::consts::PI * sigma * sigma);
                let scale = microfacet.specular().map(|specular| specular * peak);
                (sigma >= 0.03).then_some((Self::Gaussian { sigma: sigma as f32 }, scale))
            }
            _ => None,
        }
    }
}

/// The sum over texels of radiance, solid angle and weight; `weight` is rho_hat up to a factor.
pub(super) struct LobeSum<'a, W> {
    pub(super) texels: &'a LitTexels,
    pub(super) spans: &'a [Span],
    /// The column coordinate of the central direction.
    pub(super) column: f64,
    pub(super) weight: W,
}

impl LobeSum<'_, WholePower> {
    /// The sum, compiled for the exponents that are powers of two.
    pub(super) fn run(self, level: SimdLevel) -> [f64; 3] {
        let LobeSum { texels, spans, column, weight } = self;
        let axis = weight.axis;
        macro_rules! squares {
            ($($times:literal)*) => {
                match weight.exponent.trailing_zeros() {
                    $($times if weight.exponent.is_power_of_two() => {
                        level.run(LobeSum { texels, spans, column, weight: Squares::<$times> { axis } })
                    })*
                    _ => level.run(self),
                }
            };
        }
        squares!(0 1 2 3 4 5 6 7 8 9 10)
    }
}

/// Vectors between two carries to f64.
const CARRY: usize = 128;

impl<W: Weight> pulp::WithSimd for LobeSum<'_, W> {
    type Output = [f64; 3];

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> [f64; 3] {
        let mut total = [0.0; 3];
        let mut sums = [simd.splat_f32s(0.0); 3];
        let mut pending = 0;
        for &span in self.spans {
            let row = self.weight.row(simd, self.texels.row(span.row));
            for segment in self.texels.segments(span, self.column, S::F32_LANES) {
                if segment.is_empty() {
                    continue;
                }
                // Vectors past the end meet texels of this row beside the cap, with their true weight, or
                // dark ones.
                let reach = segment.start..segment.start + segment.len().next_multiple_of(S::F32_LANES);
                let vectors = |numbers| S::as_simd_f32s(numbers).0;
                let cosine = vectors(&self.texels.cosine[reach.clone()]);
                let sine = vectors(&self.texels.sine[reach.clone()]);
                let [red, green, blue] = &self.texels.rgb;
                let red = vectors(&red[reach.clone()]);
                let green = vectors(&green[reach.clone()]);
                let blue = vectors(&blue[reach]);
                let colours = red.iter().zip(green).zip(blue);
                for ((&cosine, &sine), ((&red, &green), &blue)) in cosine.iter().zip(sine).zip(colours) {
                    let weight = self.weight.at(simd, row, cosine, sine);
                    sums[0] = simd.mul_add_f32s(weight, red, sums[0]);
                    sums[1] = simd.mul_add_f32s(weight, green, sums[1]);
                    sums[2] = simd.mul_add_f32s(weight, blue, sums[2]);
                }
                pending += cosine.len();
            }
            if pending >= CARRY {
                pending = 0;
                for (total, sum) in total.iter_mut().zip(&mut sums) {
                    *total += f64::from(simd.reduce_sum_f32s(*sum));
                    *sum = simd.splat_f32s(0.0);
                }
            }
        }
        for (total, sum) in total.iter_mut().zip(sums) {
            *total += f64::from(simd.reduce_sum_f32s(sum));
        }
        total
    }
}

/// rho_hat up to a factor, about one central direction and toward one view.
pub(super) trait Weight: Copy {
    /// The values that the texels of a row share.
    type Row<S: Simd>: Copy;

    fn row<S: Simd>(&self, simd: S, row: Row) -> Self::Row<S>;

    /// The weights of texels of a row by cosine and sine of their azimuths.
    fn at<S: Simd>(&self, simd: S, row: Self::Row<S>, cosine: S::f32s, sine: S::f32s) -> S::f32s;
}

/// A direction's dot products with the texels of a row: z cos(theta), x sin(theta), y sin(theta).
#[inline(always)]
fn dot_row<S: Simd>(simd: S, axis: DVec3, row: Row) -> [S::f32s; 3] {
    [axis.z * row.cos_theta, axis.x * row.sin_theta, axis.y * row.sin_theta]
        .map(|part| simd.splat_f32s(part as f32))
}

#[inline(always)]
fn clamped_dot<S: Simd>(simd: S, row: [S::f32s; 3], cosine: S::f32s, sine: S::f32s) -> S::f32s {
    let dot = simd.mul_add_f32s(row[2], sine, simd.mul_add_f32s(row[1], cosine, row[0]));
    simd.max_f32s(dot, simd.splat_f32s(0.0))
}

/// max(0, axis . L)^exponent, exponent from 1.
#[derive(Clone, Copy)]
pub(super) struct WholePower {
    pub(super) axis: DVec3,
    pub(super) exponent: u32,
}

impl Weight for WholePower {
    type Row<S: Simd> = [S::f32s; 3];

    #[inline(always)]
    fn row<S: Simd>(&self, simd: S, row: Row) -> Self::Row<S> {
        dot_row(simd, self.axis, row)
    }

    #[inline(always)]
    fn at<S: Simd>(&self, simd: S, row: Self::Row<S>, cosine: S::f32s, sine: S::f32s) -> S::f32s {
        let mut square = clamped_dot(simd, row, cosine, sine);
        let mut exponent = self.exponent;
        while exponent & 1 == 0 {
            square = simd.mul_f32s(square, square);
            exponent >>= 1;
        }
        let mut power = square;
        while exponent > 1 {
            square = simd.mul_f32s(square, square);
            exponent >>= 1;
            if exponent & 1 == 1 {
                power = simd.mul_f32s(power, square);
            }
        }
        power
    }
}

/// max(0, axis . L)^(2^TIMES): repeated squares whose number the compiler knows, which saves the loop of
/// [`WholePower`], half of a texel's time.
#[derive(Clone, Copy)]
pub(super) struct Squares<const TIMES: u32> {
    pub(super) axis: DVec3,
}

impl<const TIMES: u32> Weight for Squares<TIMES> {
    type Row<S: Simd> = [S::f32s; 3];

    #[inline(always)]
    fn row<S: Simd>(&self, simd: S, row: Row) -> Self::Row<S> {
        dot_row(simd, self.axis, row)
    }

    #[inline(always)]
    fn at<S: Simd>(&self, simd: S, row: Self::Row<S>, cosine: S::f32s, sine: S::f32s) -> S::f32s {
        let mut power = clamped_dot(simd, row, cosine, sine);
        for _ in 0..TIMES {
            power = simd.mul_f32s(power, power);
        }
        power
    }
}

/// max(0, axis . L)^exponent, 0 if the cosine is not above 0.
#[derive(Clone, Copy)]
pub(super) struct Power {
    pub(super) axis: DVec3,
    pub(super) exponent: f32,
}

impl Weight for Power {
    type Row<S: Simd> = [S::f32s; 3];

    #[inline(always)]
    fn row<S: Simd>(&self, simd: S, row: Row) -> Self::Row<S> {
        dot_row(simd, self.axis, row)
    }

    #[inline(always)]
    fn at<S: Simd>(&self, simd: S, row: Self::Row<S>, cosine: S::f32s, sine: S::f32s) -> S::f32s {
        let dot = clamped_dot(simd, row, cosine, sine);
        let power = exp2(simd, simd.mul_f32s(simd.splat_f32s(self.exponent), log2(simd, dot)));
        let zero = simd.splat_f32s(0.0);
        simd.select_f32s(simd.less_than_f32s(zero, dot), power, zero)
    }
}

/// e^(-(theta_h / sigma)^2) if N . L > 0, otherwise 0; theta_h lies between N and H = (L + V) / |L + V|.
#[derive(Clone, Copy)]
pub(super) struct Gaussian {
    pub(super) normal: DVec3,
    pub(super) view: DVec3,
    pub(super) sigma: f32,
}

impl Weight for Gaussian {
    /// sin(theta), the square of the z part of L + V, and the z part's share of N . (L + V).
    type Row<S: Simd> = [S::f32s; 3];

    #[inline(always)]
    fn row<S: Simd>(&self, simd: S, row: Row) -> Self::Row<S> {
        let z = row.cos_theta + self.view.z;
        [row.sin_theta, z * z, self.normal.z * z].map(|part| simd.splat_f32s(part as f32))
    }

    #[inline(always)]
    fn at<S: Simd>(&self, simd: S, row: Self::Row<S>, cosine: S::f32s, sine: S::f32s) -> S::f32s {
        let splat = |value: f64| simd.splat_f32s(value as f32);
        let [sin_theta, zz, nz] = row;
        let x = simd.mul_add_f32s(sin_theta, cosine, splat(self.view.x));
        let y = simd.mul_add_f32s(sin_theta, sine, splat(self.view.y));
        let squared = simd.mul_add_f32s(x, x, simd.mul_add_f32s(y, y, zz));
        let along =
            simd.mul_add_f32s(splat(self.normal.x), x, simd.mul_add_f32s(splat(self.normal.y), y, nz));
        let one = simd.splat_f32s(1.0);
        let cosine_h = simd.min_f32s(simd.div_f32s(along, simd.sqrt_f32s(squared)), one);
        let below = simd.sub_f32s(one, cosine_h);
        let steep = -std::f32::consts::LOG2_E / (self.sigma * self.sigma);
        let exponent =
            simd.mul_f32s(simd.mul_f32s(simd.splat_f32s(steep), below), angle_squared(simd, below));
        let weight = exp2(simd, exponent);
        let above = simd.less_than_f32s(splat(self.normal.dot(self.view)), along);
        simd.select_f32s(above, weight, simd.splat_f32s(0.0))
    }
}

/// Horner's rule, the highest coefficient last.
#[inline(always)]
fn polynomial<S: Simd, const N: usize>(simd: S, coefficients: [f32; N], x: S::f32s) -> S::f32s {
    let mut sum = simd.splat_f32s(coefficients[N - 1]);
    for &coefficient in coefficients[..N - 1].iter().rev() {
        sum = simd.mul_add_f32s(sum, x, simd.splat_f32s(coefficient));
    }
    sum
}

/// arccos(1 - u)^2 / u for u in [0, 1], within 3e-7.
#[inline(always)]
fn angle_squared<S: Simd>(simd: S, u: S::f32s) -> S::f32s {
    const A: [f32; 7] =
        [2.000_000_6, 0.333_280_3, 0.089_691_18, 0.024_094_58, 0.021_714_49, -0.010_598_38, 0.009_217_67];
    polynomial(simd, A, u)
}

/// 2^y for y from -126 to 126, within 2e-7; below that it is 2^-126, which adds nothing.
#[inline(always)]
fn exp2<S: Simd>(simd: S, y: S::f32s) -> S::f32s {
    // 2^f for |f| <= 1/2, within 8e-8.
    #[allow(clippy::approx_constant)] // fitted, and near Taylor's
    const A: [f32; 6] = [1.0, 0.693_147, 0.240_221_2, 0.055_507_13, 0.009_675_54, 0.001_327_65];
    // Adding 1.5 * 2^23 rounds to a whole number and leaves it in the low bits.
    let shift = simd.splat_f32s(12_582_912.0);
    let y = simd.max_f32s(y, simd.splat_f32s(-126.0));
    let shifted = simd.add_f32s(y, shift);
    let part = simd.sub_f32s(y, simd.sub_f32s(shifted, shift));
    let whole = simd.wrapping_dyn_shl_u32s(simd.transmute_u32s_f32s(shifted), simd.splat_u32s(23));
    let power = simd.transmute_u32s_f32s(polynomial(simd, A, part));
    simd.transmute_f32s_u32s(simd.add_u32s(power, whole))
}

/// log2(x) for x from 2^-126 to 2^126, within 1e-7 + 1e-7 |log2(x)|; about -127 for 0.
#[inline(always)]
fn log2<S: Simd>(simd: S, x: S::f32s) -> S::f32s {
    // log2(1 + t) / t for 1 + t from sqrt(1/2) to sqrt(2), within 3e-8.
    #[allow(clippy::approx_constant)] // as above
    const A: [f32; 9] = [
        1.442_695,
        -0.721_347_35,
        0.480_910_64,
        -0.360_703_68,
        0.287_916_25,
        -0.238_944_83,
        0.215_715_62,
        -0.207_269_69,
        0.125_836_9,
    ];
    // The bits of sqrt(1/2), and 2^23 as a float, whose low bits then hold a whole number.
    const HALF_ROOT: u32 = 0x3f35_04f3;
    const WHOLE: u32 = 0x4b00_0000;
    // 128 is added to the exponent, so that it is never negative.
    let bits = simd.add_u32s(simd.transmute_u32s_f32s(x), simd.splat_u32s((128 << 23) - HALF_ROOT));
    let exponent = simd.wrapping_dyn_shr_u32s(bits, simd.splat_u32s(23));
    let whole = simd.transmute_f32s_u32s(simd.or_u32s(exponent, simd.splat_u32s(WHOLE)));
    let whole = simd.sub_f32s(whole, simd.splat_f32s(8_388_608.0 + 128.0));
    let mantissa =
        simd.add_u32s(simd.and_u32s(bits, simd.splat_u32s(0x007f_ffff)), simd.splat_u32s(HALF_ROOT));
    let t = simd.sub_f32s(simd.transmute_f32s_u32s(mantissa), simd.splat_f32s(1.0));
    simd.mul_add_f32s(t, polynomial(simd, A, t), whole)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Applies a function of vectors to numbers.
    struct Apply<'a>(&'a [f32], fn(f32) -> f64, u8);

    impl pulp::WithSimd for Apply<'_> {
        type Output = f64;

        #[inline(always)]
        fn with_simd<S: Simd>(self, simd: S) -> f64 {
            let (vectors, _) = S::as_simd_f32s(self.0);
            let mut worst = 0.0_f64;
            for (vector, numbers) in vectors.iter().zip(self.0.chunks_exact(S::F32_LANES)) {
                let found = match self.2 {
                    0 => exp2(simd, *vector),
                    1 => log2(simd, *vector),
                    _ => angle_squared(simd, *vector),
                };
                let mut lanes = vec![0.0; S::F32_LANES];
                simd.partial_store_f32s(&mut lanes, found);
                for (found, &x) in lanes.iter().zip(numbers) {
                    let expected = (self.1)(x);
                    worst = worst.max((f64::from(*found) - expected).abs() / expected.abs().max(1e-3));
                }
            }
            worst
        }
    }

    fn grid(from: f32, to: f32) -> Vec<f32> {
        (0..4096).map(|i| from + (to - from) * i as f32 / 4096.0).collect()
    }

    /// The polynomials' errors, and a few roundings of f32 (6e-8 each).
    #[test]
    fn powers_logarithms_and_angles_are_those_of_the_standard_library() {
        for level in [SimdLevel::detect(), SimdLevel::Portable] {
            let exp2 = level.run(Apply(&grid(-20.0, 0.0), |y| f64::from(y).exp2(), 0));
            // Relative, down to 1e-3 of absolute error near x = 1.
            let log2 = level.run(Apply(&grid(1e-6, 1.0), |x| f64::from(x).log2(), 1));
            let angle = |u| {
                let u = f64::from(u);
                // arccos(1 - u) = 2 arcsin(sqrt(u / 2)).
                (2.0 * (u / 2.0).sqrt().asin()).powi(2) / u
            };
            let angle = level.run(Apply(&grid(1e-4, 1.0), angle, 2));
            eprintln!("exp2 {exp2:.1e}, log2 {log2:.1e}, angle {angle:.1e}");
            assert!(exp2 < 3e-7 && log2 < 3e-7 && angle < 5e-7);
        }
    }
}
