//! The models against radiances that were integrated without the code of this project.
//!
//! `lighting.json` gives the light in closed form; each file gives, for some central directions and views,
//! the integral of light times rho_hat over the sphere.

#![allow(clippy::unwrap_used, clippy::disallowed_methods, reason = "a test may panic")]

use brdf::{
    KajiyaKay, Lafortune, LafortuneLobe, Lambert, Material, Microfacet, Phong, Visibility, environment_brdf,
    sheen_albedo,
};
use glam::{DMat3, DVec3};
use serde_json::Value;
use sphere::Direction;
use test_data::reference;

fn numbers<const N: usize>(value: &Value) -> [f64; N] {
    std::array::from_fn(|index| value[index].as_f64().unwrap())
}

fn vector(value: &Value) -> DVec3 {
    DVec3::from_array(numbers(value))
}

/// constant + sum of amplitude * exp(sharpness * (w . direction - 1)).
struct Light {
    constant: [f64; 3],
    lobes: Vec<(DVec3, f64, [f64; 3])>,
}

impl Light {
    fn parse(json: &Value) -> Self {
        let lobe = |lobe: &Value| {
            (vector(&lobe["direction"]), lobe["sharpness"].as_f64().unwrap(), numbers(&lobe["amplitude"]))
        };
        let lobes = json["lobes"].as_array().unwrap().iter().map(lobe).collect();
        Self { constant: numbers(&json["constant"]), lobes }
    }

    fn radiance(&self, w: DVec3) -> [f64; 3] {
        let mut sum = self.constant;
        for (direction, sharpness, amplitude) in &self.lobes {
            let value = (sharpness * (w.dot(*direction) - 1.0)).exp();
            (0..3).for_each(|channel| sum[channel] += amplitude[channel] * value);
        }
        sum
    }
}

/// The model that a reference file names.
fn material(model: &str, parameters: &Value) -> Material {
    let number = |name: &str| parameters[name].as_f64().unwrap();
    match model {
        "lambert" => Material::Lambert(Lambert::new([number("albedo"); 3]).unwrap()),
        "phong" => Material::Phong(Phong::new(number("exponent"), [1.0; 3]).unwrap()),
        "microfacet" => Material::Microfacet(Microfacet::new(number("sigma"), [1.0; 3]).unwrap()),
        "kajiya-kay" => Material::KajiyaKay(KajiyaKay::new(number("exponent"), [1.0; 3]).unwrap()),
        "lafortune" => {
            let lobes = parameters["lobes"].as_array().unwrap().iter().map(|lobe| LafortuneLobe {
                cx: lobe["cx"].as_f64().unwrap(),
                cz: lobe["cz"].as_f64().unwrap(),
                n: lobe["n"].as_f64().unwrap(),
                weight: [1.0; 3],
            });
            Material::Lafortune(Lafortune::new([number("diffuse"); 3], lobes.collect()).unwrap())
        }
        other => panic!("no model {other} here"),
    }
}

/// Axes whose third is `z`; the others are turned about it by an arbitrary angle, which must not matter.
fn axes(z: DVec3) -> DMat3 {
    let x = z.any_orthonormal_vector();
    DMat3::from_cols(x, z.cross(x), z)
}

/// Gauss-Legendre nodes in cos(theta) on each side of the equator, where the horizon may have a kink, and
/// equal steps in phi: the directions and their weights.
fn nodes(pole: DVec3, rows: usize) -> Vec<(DVec3, f64)> {
    let (nodes, weights) = sh::quadrature::gauss_legendre(rows);
    let (columns, axes) = (2 * rows, axes(pole));
    let mut all = Vec::new();
    for side in [1.0, -1.0] {
        for (theta, weight) in nodes.iter().zip(&weights) {
            let z = side * (theta.cos() + 1.0) / 2.0;
            for column in 0..columns {
                let phi = std::f64::consts::TAU * column as f64 / columns as f64;
                let (sine, cosine) = phi.sin_cos();
                let w = axes * DVec3::new((1.0 - z * z).sqrt() * cosine, (1.0 - z * z).sqrt() * sine, z);
                all.push((w, weight / 2.0 * std::f64::consts::TAU / columns as f64));
            }
        }
    }
    all
}

/// 160 rows per hemisphere resolve the sharpest lobe here, e^-(theta_h / 0.2)^2 or cos^32, up to rounding;
/// kinks of the horizon lie between rows. The kink of Phong and of Kajiya and Kay (at a cosine of 0, to the
/// power 32) is negligible. Other errors are below 1e-9; the files state their own as at most 2e-9.
#[test]
fn models_are_those_of_the_reference_values() {
    const TEST: &str = "models_are_those_of_the_reference_values";
    let Some(lighting) = test_data::reference(TEST, "lighting.json") else { return };
    let light = Light::parse(&lighting);
    let files = ["lambert-0", "phong-1", "microfacet-2", "microfacet-3", "kajiya-kay-4", "lafortune-5"];
    for file in files {
        let reference = test_data::reference(TEST, &format!("{file}.json")).unwrap();
        let material = material(reference["model"].as_str().unwrap(), &reference["parameters"]);
        let rows = reference["rows"].as_array().unwrap();
        assert_eq!(rows.len(), 24, "{file}");
        let mut worst: f64 = 0.0;
        for row in rows.iter().step_by(3) {
            let (central, view) = (vector(&row["central"]), vector(&row["view"]));
            let to_local = axes(central).transpose();
            let outgoing = Direction::normalised(to_local * view);
            // The pole of the nodes is the normal if there is a horizon, and otherwise the centre.
            let pole = match material.centre() {
                brdf::Centre::Reflection if file != "phong-1" => (central + view).normalize(),
                _ => central,
            };
            let mut sum = [0.0; 3];
            for (w, weight) in nodes(pole, 160) {
                let rho_hat = material.rho_hat_about_centre(Direction::normalised(to_local * w), outgoing);
                let radiance = light.radiance(w);
                (0..3).for_each(|channel| sum[channel] += radiance[channel] * rho_hat[channel] * weight);
            }
            let expected: [f64; 3] = numbers(&row["radiance"]);
            for channel in 0..3 {
                worst = worst.max((sum[channel] / expected[channel] - 1.0).abs());
            }
        }
        eprintln!("{file}: {worst:.1e}");
        assert!(worst < 1e-8, "{file}: {worst:e}");
    }
}

/// `engines/dfg.json`: the directional albedos that engines keep in a table.
#[test]
fn directional_albedos_are_those_of_the_reference() {
    let Some(file) = reference("directional_albedos", "engines/dfg.json") else { return };
    let rows = file["rows"].as_array().unwrap();
    let mut largest = 0.0_f64;
    for row in rows {
        let number = |value: &Value| value.as_f64().unwrap();
        let (roughness, view) = (number(&row["roughness"]), number(&row["NoV"]));
        let mut check = |name: &str, found: f64, expected: f64| {
            // Relative where a value passes 1.
            let error = (found - expected).abs() / expected.max(1.0);
            assert!(
                error < 1e-5,
                "{name} at roughness {roughness}, n.v {view}: {found} instead of {expected}"
            );
            largest = largest.max(error);
        };
        for (name, visibility) in [
            ("correlated", Visibility::Correlated),
            ("uncorrelated", Visibility::Uncorrelated),
            ("karis", Visibility::Karis),
        ] {
            let found = environment_brdf(visibility, roughness, view);
            check(name, found.scale, number(&row[name]["scale"]));
            check(name, found.bias, number(&row[name]["bias"]));
        }
        check("charlie", sheen_albedo(roughness, view), number(&row["charlie"]));
    }
    eprintln!("{} rows, largest error {largest:.1e}", rows.len());
}
