//! What the formulas of materials share: the half vector, powers of cosines, Fresnel's shares and the masking
//! of facets. They know nothing of words; the same functions are in terms.wgsl.

use std::f32::consts::TAU;

use glam::{Vec2, Vec3};

use crate::shading::angles::{angle, circle};
use crate::shading::shader_constants::shader_constants;

shader_constants!("MATERIAL_":
    /// Light nearer to the horizon than this counts as below it: products of two such cosines are still
    /// normal numbers.
    pub(super) HORIZON: f32 = 1e-12;
    /// The square of a sum of light and view below which they count as opposite.
    pub(super) OPPOSITE: f32 = 1e-20;
    /// The square of a sine below which the logarithm of the cosine comes from a series.
    pub(super) NEAR: f32 = 0.1;
    /// A number with a logarithm that is less than any cosine that matters.
    pub(super) TINY: f32 = 1e-30;
);

/// The text of the shader: its constants and terms.wgsl.
pub(super) fn shader() -> String {
    [WGSL_CONSTANTS, include_str!("terms.wgsl")].concat()
}

/// The half vector of light and view over the surface.
#[derive(Clone, Copy)]
pub(super) struct Half {
    /// The sum L + V.
    pub(super) sum: Vec3,
    /// |L + V|^2, above 0.
    pub(super) length_squared: f32,
    /// N.L, above 0.
    pub(super) light: f32,
    /// N.V, 0 or more.
    pub(super) view: f32,
    /// 1 - (L.h)^2 = |L - V|^2 / 4.
    pub(super) turn: f32,
}

impl Half {
    /// Makes the half vector; `None` if the light is below the horizon, or light and view are opposite.
    pub(super) fn new(light: Vec3, view: Vec3) -> Option<Self> {
        let sum = light + view;
        let length_squared = sum.dot(sum);
        let seen = light.z > HORIZON && sum.z > HORIZON && length_squared > OPPOSITE;
        let difference = light - view;
        let turn = 0.25 * difference.dot(difference);
        seen.then_some(Self { sum, length_squared, light: light.z, view: view.z.max(0.0), turn })
    }

    /// The square of the part of L + V along the surface.
    pub(super) fn across(self) -> f32 {
        self.sum.x * self.sum.x + self.sum.y * self.sum.y
    }

    /// The light that GGX's facets reflect if their Fresnel is 1, over alpha^2 / (2 pi).
    pub(super) fn facets(self, alpha2: f32) -> f32 {
        let across = (self.across() + alpha2 * self.sum.z * self.sum.z) / self.length_squared;
        let masked = |cosine: f32| (alpha2 + (1.0 - alpha2) * cosine * cosine).sqrt();
        let visible = self.light / (self.light * masked(self.view) + self.view * masked(self.light));
        visible / (across * across)
    }

    /// The cosine L.h.
    pub(super) fn facet(self) -> f32 {
        0.5 * self.length_squared.sqrt()
    }

    /// (N.h)^(2 s).
    pub(super) fn power(self, s: f32) -> f32 {
        let sin2 = self.across() / self.length_squared;
        let cos2 = self.sum.z * self.sum.z / self.length_squared;
        let ln = if sin2 < NEAR { 2.0 * ln_cosine(sin2) } else { math::ln(cos2.max(TINY)) };
        bounded_exp(s * ln)
    }
}

/// cos^s, or 0 if the cosine is not above 0; `sin2` is the square of the sine.
pub(in crate::shading) fn power(cosine: f32, sin2: f32, s: f32) -> f32 {
    if cosine <= 0.0 {
        return 0.0;
    }
    let ln = if sin2 < NEAR { ln_cosine(sin2) } else { math::ln(cosine.max(TINY)) };
    bounded_exp(s * ln)
}

/// base^n, or 0 if the base is not above 0.
pub(super) fn power_of(base: f32, n: f32) -> f32 {
    if base <= 0.0 {
        return 0.0;
    }
    let from_one = (1.0 - base) * (1.0 + base);
    let ln = if from_one.abs() < NEAR { ln_cosine(from_one) } else { math::ln(base.max(TINY)) };
    bounded_exp(n * ln)
}

/// ln(sqrt(1 - x)) for |x| below [`NEAR`]: the series of ln(1 - x), whose next term is below 2e-8 of it.
pub(super) fn ln_cosine(x: f32) -> f32 {
    let series = 1.0 / 6.0 + x * (1.0 / 7.0);
    let series = 0.25 + x * (0.2 + x * series);
    -0.5 * x * (1.0 + x * (0.5 + x * (1.0 / 3.0 + x * series)))
}

/// 1 - sin(x) / x, x of 0 to 2 pi: a series below 1.
pub(super) fn one_less_sinc(x: f32) -> f32 {
    if x >= 1.0 {
        return 1.0 - circle(x / TAU).y / x;
    }
    let x2 = x * x;
    x2 / 6.0 * (1.0 - x2 / 20.0 * (1.0 - x2 / 42.0 * (1.0 - x2 / 72.0)))
}

/// e^x, in the range of f32.
pub(super) fn bounded_exp(x: f32) -> f32 {
    math::exp(x.clamp(-80.0, 80.0))
}

/// The fifth power of a number.
pub(super) fn fifth(x: f32) -> f32 {
    let x2 = x * x;
    x2 * x2 * x
}

/// Smith's Lambda for Beckmann's facets, times the cosine.
pub(super) fn lambda_cosine(m: f32, cosine: f32) -> f32 {
    let slope = m * (1.0 - cosine * cosine).max(0.0).sqrt();
    if cosine >= 1.6 * slope {
        return 0.0;
    }
    let a = cosine / slope;
    slope * (1.0 - 1.259 * a + 0.396 * a * a).max(0.0) / (3.535 + 2.181 * a)
}

/// The share that a dielectric reflects, by Fresnel.
pub(super) fn dielectric(ior: f32, c: f32) -> f32 {
    let excess = ior * ior - 1.0;
    let sum = (excess + c * c).sqrt() + c;
    // g - c without cancellation.
    let difference = excess / sum;
    let parallel = (c * sum - 1.0) / (c * difference + 1.0);
    let share = difference / sum;
    0.5 * share * share * (1.0 + parallel * parallel)
}

/// The share that a conductor reflects, by Fresnel.
pub(super) fn conductor(n: f32, k: f32, c: f32, sin2: f32) -> f32 {
    let cos2 = c * c;
    let index = n * n - k * k;
    let real = if cos2 < 0.5 { index - 1.0 + cos2 } else { index - sin2 };
    let imaginary = 2.0 * n * k;
    let size = (real * real + imaginary * imaginary).sqrt();
    // (size + real) / 2 without cancellation.
    let part = if real >= 0.0 { 0.5 * (size + real) } else { 0.5 * imaginary * imaginary / (size - real) };
    let twice = 2.0 * c * part.sqrt();
    let s = (size + cos2 - twice).max(0.0) / (size + cos2 + twice);
    let (sum, part) = (cos2 * size + sin2 * sin2, twice * sin2);
    0.5 * s * (1.0 + (sum - part) / (sum + part))
}

/// theta_h, theta_d and phi_d, 0 to pi: see `brdf::half_difference`.
pub(super) fn half_difference(light: Vec3, view: Vec3) -> [f32; 3] {
    let (sum, difference) = (light + view, light - view);
    let across = sum.truncate().length();
    let length = sum.length();
    let (cos_phi, sin_phi) = if across > 0.0 { (sum.x / across, sum.y / across) } else { (1.0, 0.0) };
    let (cos_theta, sin_theta) = if length > 0.0 { (sum.z / length, across / length) } else { (1.0, 0.0) };
    let x = (difference.x * cos_phi + difference.y * sin_phi) * cos_theta - difference.z * sin_theta;
    let y = difference.y * cos_phi - difference.x * sin_phi;
    let turned = y < 0.0 || (y == 0.0 && x < 0.0);
    let phi_d = if turned { angle(-y, -x) } else { angle(y, x) };
    [angle(across, sum.z), angle(difference.length(), length), phi_d]
}

/// theta_h, phi_h, 0 to 2 pi, theta_d and psi, 0 to pi: see `brdf::half_and_difference`.
pub(super) fn half_and_difference(light: Vec3, view: Vec3) -> [f32; 4] {
    let (sum, difference) = (light + view, light - view);
    let across = sum.truncate().length();
    let length = sum.length();
    let away = if across > 0.0 { sum.truncate() / across } else { Vec2::X };
    let (cosine, sine) = if length > 0.0 { (sum.z / length, across / length) } else { (1.0, 0.0) };
    let along = (difference.x * away.x + difference.y * away.y) * cosine - difference.z * sine;
    let beside = difference.y * away.x - difference.x * away.y;
    let (x, y) = (away.x * along - away.y * beside, away.y * along + away.x * beside);
    let turned = y < 0.0 || (y == 0.0 && x < 0.0);
    let psi = if turned { angle(-y, -x) } else { angle(y, x) };
    let phi = angle(away.y, away.x);
    [angle(across, sum.z), if phi < 0.0 { phi + TAU } else { phi }, angle(difference.length(), length), psi]
}
