//! Another base colour than that of the material by which a surface was shaded.
//!
//! Every mode shades with one material, whose base colour c0 is the mean of its texture. From the radiance L0
//! that it gives, the base colour c of a sample makes, channel by channel,
//!
//! > L = L0 (c D + S R(c) / R(c0)) / (c0 D + S),  S = max(0, L0 - c0 D)
//!
//! D is what a matte base of colour 1 reflects of the light of degree 2 (Ramamoorthi and Hanrahan 2001),
//! and R what all but the matte base reflects of a uniform light ([`brdf::BaseColorResponse`]). So L is
//! exact under a uniform light, and for a dielectric under every light of degree 2. Where more light is
//! missing than S has, as in shadows, L is L0 c / c0. It is L0 where c is c0.

use brdf::{BaseColorResponse, BaseColorTexture, Standard};
use glam::Vec3;
use sh::Expansion;

use super::surface::Surface;
use super::texture::PackedTexture;

/// The texels of [`PackedResponse::texels`] before those of nodes.
pub const NUMBERS: usize = 13;

/// The texture of a look, and how its material responds to it.
#[derive(Clone, Debug, PartialEq)]
pub struct BaseColorMap {
    /// The texture.
    pub texture: PackedTexture,
    /// The response of the material under the light.
    pub response: PackedResponse,
}

/// The response of a material under a light to its base colour.
#[derive(Clone, Debug, PartialEq)]
pub struct PackedResponse {
    /// The factors of 1, y, z, x, xy, yz, 3zz - 1, xz and xx - yy in D, without t (1 - `metallic`).
    light: [Vec3; 9],
    response: BaseColorResponse,
}

/// The factors of the polynomials in real harmonics of degree 0 to 2, row l*l + l + m.
const HARMONICS: [f64; 9] = [
    0.282_094_791_773_878_14,
    0.488_602_511_902_919_9,
    0.488_602_511_902_919_9,
    0.488_602_511_902_919_9,
    1.092_548_430_592_079_2,
    1.092_548_430_592_079_2,
    0.315_391_565_252_520_05,
    1.092_548_430_592_079_2,
    0.546_274_215_296_039_6,
];

impl BaseColorMap {
    /// The texture of a material under a light with these coefficients; those that it lacks up to degree 2
    /// are 0.
    pub fn new(texture: &BaseColorTexture, material: &Standard, lighting: &Expansion) -> Self {
        let response = PackedResponse::new(material.base_color_response(), lighting);
        Self { texture: PackedTexture::new(texture), response }
    }
}

impl PackedResponse {
    fn new(response: BaseColorResponse, lighting: &Expansion) -> Self {
        let mut light = [Vec3::ZERO; 9];
        for (row, (value, out)) in lighting.coefficients().iter().zip(&mut light).enumerate() {
            let scale = HARMONICS[row] * response.matte[row.isqrt()];
            *out = Vec3::from_array(value.map(|value| (value * scale) as f32));
        }
        Self { light, response }
    }

    /// The numbers for shaders: [`NUMBERS`] texels, then two for each node.
    pub fn texels(&self) -> Vec<[f32; 4]> {
        let of = &self.response;
        let colours = [
            (of.base_color, of.metallic),
            (of.dielectric, of.f_90),
            (of.sheen, of.whole),
            (of.dielectric_several, 0.0),
        ];
        let colours = colours.map(|([red, green, blue], number)| [red, green, blue, number]);
        let nodes = of.nodes.iter();
        let nodes = nodes.flat_map(|&[t, w, a, b, coat, fibres]| [[t, w, a, b], [coat, fibres, 0.0, 0.0]]);
        let numbers = colours.into_iter().chain(nodes).map(|texel| texel.map(|number| number as f32));
        self.light.iter().map(|rgb| rgb.extend(0.0).to_array()).chain(numbers).collect()
    }
}

/// The radiance toward the viewer, if the base colour is `color` in place of the material's, by which it is
/// `radiance`.
pub fn base_color(response: &PackedResponse, color: Vec3, radiance: Vec3, surface: &Surface) -> Vec3 {
    let Vec3 { x, y, z } = surface.normal;
    let polynomials = [1.0, y, z, x, x * y, y * z, 3.0 * z * z - 1.0, x * z, x * x - y * y];
    let light = response.light.iter().zip(polynomials).fold(Vec3::ZERO, |sum, (rgb, p)| sum + *rgb * p);
    let light = light.max(Vec3::ZERO);
    let cosine = f64::from(surface.normal.dot(surface.view));
    let of = |color: Vec3| {
        let albedo = response.response.albedo(color.to_array().map(f64::from), cosine);
        albedo.map(|rgb| Vec3::from_array(rgb.map(|value| value as f32)))
    };
    let mean = Vec3::from_array(response.response.base_color.map(|value| value as f32));
    let ([matte_of_mean, rest_of_mean], [matte, rest]) = (of(mean), of(color));
    let channel = |k: usize| {
        let base = light[k] * matte_of_mean[k];
        let beside = (radiance[k] - base).max(0.0);
        let whole = base + beside;
        if whole > 0.0 {
            let ratio = if rest_of_mean[k] > 0.0 { rest[k] / rest_of_mean[k] } else { 1.0 };
            radiance[k] * ((light[k] * matte[k] + beside * ratio) / whole)
        } else {
            radiance[k]
        }
    };
    Vec3::new(channel(0), channel(1), channel(2))
}

#[cfg(test)]
mod tests {
    use brdf::{Material, StandardParameters, albedo};
    use sh::Degree;
    use sphere::Direction;

    use super::*;

    fn constant() -> Expansion {
        let radiance = (4.0 * std::f64::consts::PI).sqrt();
        Expansion::from_coefficients(Degree::ZERO, vec![[radiance; 3]]).unwrap()
    }

    fn surface(cosine: f64) -> Surface {
        let ray = -Direction::from_angles(cosine.acos(), 0.4).vector().as_vec3();
        Surface::new(Vec3::Z, Vec3::X, ray, true)
    }

    /// The oracle is the albedo of the material with the other base colour, integrated from its formula. The
    /// tolerance is that of its tables.
    #[test]
    fn another_base_colour_is_exact_under_a_uniform_light() {
        let coated = StandardParameters {
            clearcoat: 0.7,
            sheen: [0.3, 0.1, 0.2],
            specular_color: [1.0, 0.5, 0.2],
            ..StandardParameters::default()
        };
        for metallic in [0.0, 0.5, 1.0] {
            for roughness in [0.2, 0.6, 1.0] {
                let with = |base_color: [f64; 3]| {
                    let parameters = StandardParameters { base_color, metallic, roughness, ..coated };
                    Standard::new(parameters).unwrap()
                };
                let of_mean = with([0.5, 0.2, 0.8]);
                let response = PackedResponse::new(of_mean.base_color_response(), &constant());
                for color in [[0.0; 3], [0.9, 0.4, 0.1], [1.0; 3]] {
                    for cosine in [0.2_f64, 0.5, 0.9] {
                        let view = Direction::from_angles(cosine.acos(), 0.4);
                        let of = |standard: &Standard| albedo(&Material::Standard(standard.clone()), view);
                        let radiance = Vec3::from_array(of(&of_mean).map(|value| value as f32));
                        let rgb = Vec3::from_array(color.map(|value| value as f32));
                        let found = base_color(&response, rgb, radiance, &surface(cosine));
                        for (channel, expected) in of(&with(color)).into_iter().enumerate() {
                            let error = (f64::from(found[channel]) - expected).abs();
                            assert!(
                                error < 6e-3,
                                "{metallic} {roughness} {color:?} {cosine}: {found} {expected}"
                            );
                        }
                    }
                }
            }
        }
    }

    /// A dielectric with another base colour, under a light of degree 2, against the integral of its formula.
    #[test]
    fn a_dielectric_is_exact_under_a_light_of_degree_2() {
        let rows = (0..9).map(|row| [2.0, 0.3, -0.2, 0.5, 0.1, 0.4, -0.3, 0.2, 0.25][row]);
        let lighting =
            Expansion::from_coefficients(Degree::new(2).unwrap(), rows.map(|value| [value; 3]).collect());
        let lighting = lighting.unwrap();
        let with = |base_color: f64| {
            let parameters =
                StandardParameters { base_color: [base_color; 3], ..StandardParameters::default() };
            Standard::new(parameters).unwrap()
        };
        let view = Direction::from_angles(0.8, 0.4);
        let radiance = |standard: &Standard| {
            let material = Material::Standard(standard.clone());
            let (rows, columns) = (400, 400);
            let mut sum = 0.0;
            for cell in 0..rows * columns {
                let cosine = (f64::from(cell / columns) + 0.5) / f64::from(rows);
                let phi = std::f64::consts::TAU * (f64::from(cell % columns) + 0.5) / f64::from(columns);
                let light = Direction::from_angles(cosine.acos(), phi);
                sum += material.rho_hat(light, view)[0] * lighting.evaluate(light)[0];
            }
            sum * std::f64::consts::TAU / f64::from(rows * columns)
        };
        let of_mean = radiance(&with(0.4));
        let response = PackedResponse::new(with(0.4).base_color_response(), &lighting);
        for color in [0.0, 0.1, 0.4, 0.9] {
            let rgb = Vec3::splat(color as f32);
            let found = base_color(&response, rgb, Vec3::splat(of_mean as f32), &surface(0.8_f64.cos())).x;
            let expected = radiance(&with(color));
            // The highlight of half a percent of the cells is integrated to about 1e-3.
            assert!((f64::from(found) - expected).abs() < 2e-3, "{color}: {found} {expected}");
        }
    }

    /// In shadow, a darker base colour is darker by its share; and black, negative and missing light stay.
    #[test]
    fn shadows_keep_the_share_of_the_colours() {
        let parameters = StandardParameters { base_color: [0.5, 0.5, 0.0], ..StandardParameters::default() };
        let response = Standard::new(parameters).unwrap().base_color_response();
        let lit = PackedResponse::new(response.clone(), &constant());
        let at =
            |response: &PackedResponse, color, radiance| base_color(response, color, radiance, &surface(0.7));
        let dim = at(&lit, Vec3::new(0.25, 1.0, 0.0), Vec3::splat(0.1));
        assert!((dim - Vec3::new(0.05, 0.2, 0.1)).length() < 1e-6, "{dim}");
        let negative = at(&lit, Vec3::new(0.25, 1.0, 0.0), Vec3::splat(-0.1));
        assert!((negative - Vec3::new(-0.05, -0.2, -0.1)).length() < 1e-6, "{negative}");
        assert_eq!(at(&lit, Vec3::ONE, Vec3::ZERO), Vec3::ZERO);
        let dark = PackedResponse::new(response, &Expansion::zero(Degree::ZERO));
        assert_eq!(at(&dark, Vec3::ONE, Vec3::ZERO), Vec3::ZERO);
        assert_eq!(at(&dark, Vec3::ONE, Vec3::splat(0.3)), Vec3::splat(0.3));
    }
}
