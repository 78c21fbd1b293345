//! Samples of the directions that a material reflects from, and their density.
//!
//! The samples need not follow rho_hat; they must only be dense where it is large. A poor choice costs
//! samples, it does not change the result. Each layer of a material has one or two lobes
//! (`brdf::Material::lobes`), and all lobes have equal shares of the samples:
//!
//! | lobe | density over incident directions | for |
//! | --- | --- | --- |
//! | cosine | cos(theta_i) / pi | matte layers, and what others have beside their highlight |
//! | power | (n + 1) / (2 pi) cos^n from the axis (cx V_x, cx V_y, cz V_z) | phong, lafortune |
//! | facets | D(h) / (2 (N.V + sqrt(a_x^2 V_x^2 + a_y^2 V_y^2 + (N.V)^2))) | all models of small facets, measured tables |
//! | band | Cauchy's in theta_i - theta_o, angles from the tangent, over 2 pi sin(theta_i) | kajiya-kay |
//!
//! D is GGX of the widths (a_x, a_y). The facets are sampled as the viewer sees them (Heitz 2018, "Sampling
//! the GGX Distribution of Visible Normals") with Dupuy and Benyoub's cap of the sphere ("Sampling Visible
//! GGX Normals with Spherical Caps", 2023). GGX has the longest tails, so no model is ever much denser than
//! its lobe.
//!
//! Words: the share of light samples (an f32), the number of lobes; per lobe its number, its share of the
//! rest (an f32), and three f32 parameters (unused ones are 0).

use std::f32::consts::{FRAC_1_PI, PI, TAU};

use brdf::{Lobe, Material};
use glam::{Vec2, Vec3};

use super::angles::{angle, circle};
use super::material::terms::power;
use super::shader_constants::shader_constants;
use super::surface::unit_or;

shader_constants!("LOBE_SAMPLING_":
    COSINE: u32 = 1;
    POWER: u32 = 2;
    FACETS: u32 = 3;
    BAND: u32 = 4;
);

/// The text of the shader: its constants and lobe_sampling.wgsl.
pub fn shader() -> String {
    [WGSL_CONSTANTS, include_str!("lobe_sampling.wgsl")].concat()
}

/// The lobes of a material, and how the lobes and the light share the samples.
#[derive(Clone, Debug, PartialEq)]
pub struct LobeSampling {
    light: f32,
    shares: Vec<(Lobe, f32)>,
}

impl LobeSampling {
    /// The lobes of a material, with equal shares; `light` is the share of samples of the light.
    pub fn new(material: &Material, light: f32) -> Self {
        let lobes = material.lobes();
        let share = 1.0 / lobes.len() as f32;
        Self { light, shares: lobes.into_iter().map(|lobe| (lobe, share)).collect() }
    }

    /// The share of samples that are of the light.
    pub fn light(&self) -> f32 {
        self.light
    }

    /// The incident direction for a point of the unit square, in the frame of the surface; it may lie below
    /// the horizon. The first coordinate chooses the lobe.
    pub fn sample(&self, point: [f32; 2], view: Vec3) -> Vec3 {
        let [mut left, along] = point;
        for (lobe, share) in &self.shares {
            if left < *share {
                return sample(*lobe, [left / share, along], view);
            }
            left -= share;
        }
        // Rounding may keep the sum of the shares below 1.
        self.shares.last().map_or(Vec3::Z, |(lobe, _)| sample(*lobe, [0.0, along], view))
    }

    /// The density of [`LobeSampling::sample`] at an incident direction, in 1/sr.
    pub fn density(&self, incident: Vec3, view: Vec3) -> f32 {
        self.shares.iter().map(|(lobe, share)| share * density(*lobe, incident, view)).sum()
    }

    /// The words, for the buffer `lobe_sampling` of the shader.
    pub fn words(&self) -> Vec<u32> {
        let mut words = vec![self.light.to_bits(), self.shares.len() as u32];
        for (lobe, share) in &self.shares {
            let (number, parameters) = match *lobe {
                Lobe::Cosine => (COSINE, [0.0; 3]),
                Lobe::Power { cx, cz, n } => (POWER, [cx, cz, n]),
                Lobe::Facets { x, y } => (FACETS, [x, y, 0.0]),
                Lobe::Band { width } => (BAND, [width, 0.0, 0.0]),
            };
            words.extend([number, share.to_bits()]);
            words.extend(parameters.map(f32::to_bits));
        }
        words
    }
}

/// The incident direction for a point of the unit square, in the frame of the surface; it may lie below the
/// horizon.
fn sample(lobe: Lobe, point: [f32; 2], view: Vec3) -> Vec3 {
    let turn = circle(point[0]);
    match lobe {
        Lobe::Cosine => {
            let level = point[1].sqrt();
            (turn * level).extend((1.0 - point[1]).sqrt())
        }
        Lobe::Power { cx, cz, n } => {
            let sin2 = one_less_exp(2.0 * math::ln(1.0 - point[1]) / (n + 1.0));
            let local = (turn * sin2.sqrt()).extend((1.0 - sin2).max(0.0).sqrt());
            let axis = axis(cx, cz, view);
            let [right, up] = beside(axis);
            right * local.x + up * local.y + axis * local.z
        }
        Lobe::Facets { x, y } => {
            let flat = unit_or(Vec3::new(x * view.x, y * view.y, view.z.max(0.0)), Vec3::Z);
            let z = (1.0 - point[1]) * (1.0 + flat.z) - flat.z;
            let cap = (turn * (1.0 - z * z).max(0.0).sqrt()).extend(z);
            let facet = cap + flat;
            let facet = unit_or(Vec3::new(x * facet.x, y * facet.y, facet.z), Vec3::Z);
            facet * (2.0 * facet.dot(view)) - view
        }
        Lobe::Band { width } => {
            let theta_o = angle_from_tangent(view);
            let [low, high] = band_ends(width, theta_o);
            let away = circle((low + (high - low) * point[1]) / TAU);
            let theta = (theta_o + width * (away.y / away.x.max(1e-6))).clamp(0.0, PI);
            let around = circle(theta / TAU);
            Vec3::new(around.x, around.y * turn.x, around.y * turn.y)
        }
    }
}

/// The density of [`sample`] at an incident direction, in 1/sr.
fn density(lobe: Lobe, incident: Vec3, view: Vec3) -> f32 {
    match lobe {
        Lobe::Cosine => incident.z.max(0.0) * FRAC_1_PI,
        Lobe::Power { cx, cz, n } => {
            let axis = axis(cx, cz, view);
            let sine = incident.cross(axis);
            (n + 1.0) / TAU * power(incident.dot(axis), sine.dot(sine), n)
        }
        Lobe::Facets { x, y } => {
            let sum = incident + view;
            let length_squared = sum.dot(sum);
            if sum.z <= 0.0 || length_squared <= 1e-20 {
                return 0.0;
            }
            let (across, along) = (sum.x / x, sum.y / y);
            let spread = (across * across + along * along + sum.z * sum.z) / length_squared;
            let d = 1.0 / (PI * x * y * spread * spread);
            let height = view.z.max(0.0);
            let flat = Vec3::new(x * view.x, y * view.y, height).length();
            d / (2.0 * (height + flat)).max(1e-12)
        }
        Lobe::Band { width } => {
            let theta_o = angle_from_tangent(view);
            let [low, high] = band_ends(width, theta_o);
            let away = (angle_from_tangent(incident) - theta_o) / width;
            let sine = Vec2::new(incident.y, incident.z).length().max(1e-6);
            1.0 / (width * (1.0 + away * away) * (high - low) * TAU * sine)
        }
    }
}

/// The axis of a power lobe; the normal if it has none.
fn axis(cx: f32, cz: f32, view: Vec3) -> Vec3 {
    unit_or(Vec3::new(cx * view.x, cx * view.y, cz * view.z), Vec3::Z)
}

/// Two directions at right angles to another and to each other (Duff et al., "Building an Orthonormal Basis,
/// Revisited", 2017).
fn beside(axis: Vec3) -> [Vec3; 2] {
    let sign = if axis.z >= 0.0 { 1.0 } else { -1.0 };
    let a = -1.0 / (sign + axis.z);
    let b = axis.x * axis.y * a;
    [
        Vec3::new(1.0 + sign * axis.x * axis.x * a, sign * b, -sign * axis.x),
        Vec3::new(b, sign + axis.y * axis.y * a, -axis.y),
    ]
}

/// 1 - e^x for x of 0 or less, without cancellation.
fn one_less_exp(x: f32) -> f32 {
    if x > -0.1 { -x * (1.0 + x * (0.5 + x * (1.0 / 6.0 + x * (1.0 / 24.0)))) } else { 1.0 - math::exp(x) }
}

fn angle_from_tangent(direction: Vec3) -> f32 {
    angle(Vec2::new(direction.y, direction.z).length(), direction.x)
}

/// The arc tangents of the ends of the band, where theta_i is 0 and pi.
fn band_ends(width: f32, theta_o: f32) -> [f32; 2] {
    [-angle(theta_o, width), angle(PI - theta_o, width)]
}
