//! The check of the whole chain: reflected light evaluated from coefficients, against brute-force integrals that
//! know no spherical harmonics.

#![allow(clippy::unwrap_used, clippy::disallowed_methods)] // a test may panic, and reads reference files

use std::f64::consts::PI;

use brdf::{Choice, KajiyaKay, Lafortune, LafortuneLobe, Lambert, Material, Microfacet, Phong, project};
use oracles::reference;
use serde_json::Value;
use sh::{Degree, Expansion};
use shrm::Reflection;
use sphere::{DVec3, Direction};

/// Of the lighting (sharpness up to 22, e^(-l^2 / 44)) about 1e-9 is left past this degree.
const F: usize = 30;

fn degree(l: usize) -> Degree {
    Degree::new(l).unwrap()
}

fn triple(value: &Value) -> [f64; 3] {
    [0, 1, 2].map(|i| value[i].as_f64().unwrap())
}

fn direction(value: &Value) -> Direction {
    Direction::normalised(DVec3::from(triple(value)))
}

/// The reference lighting, a constant and lobes exp(k (cos - 1)), whose coefficients are zonal integrals.
fn lighting(file: &Value) -> Expansion {
    let (nodes, weights) = sh::quadrature::gauss_legendre(200);
    let mut sum = Expansion::zero(degree(F));
    sum.rows_mut()[0] = triple(&file["constant"]).map(|v| v * (4.0 * PI).sqrt());
    for part in file["lobes"].as_array().unwrap() {
        let (amplitude, sharpness) = (triple(&part["amplitude"]), part["sharpness"].as_f64().unwrap());
        let (mut y_l0, mut u) = ([0.0; F + 1], [0.0; F + 1]);
        for (theta, weight) in nodes.iter().zip(&weights) {
            sh::zonal_into(theta.cos(), &mut y_l0);
            for (u, y) in u.iter_mut().zip(y_l0) {
                *u += 2.0 * PI * weight * (sharpness * (theta.cos() - 1.0)).exp() * y;
            }
        }
        let lobe =
            Expansion::zonal(direction(&part["direction"]), degree(F), |l| amplitude.map(|a| a * u[l]));
        for (row, add) in sum.rows_mut().iter_mut().zip(lobe.rows()) {
            (0..3).for_each(|channel| row[channel] += add[channel]);
        }
    }
    sum
}

fn material(file: &Value) -> Material {
    let parameters = &file["parameters"];
    let number = |name: &str| parameters[name].as_f64().unwrap();
    let white = [1.0; 3];
    match file["model"].as_str().unwrap() {
        "lambert" => Material::Lambert(Lambert::new([number("albedo"); 3]).unwrap()),
        "phong" => Material::Phong(Phong::new(number("exponent"), white).unwrap()),
        "microfacet" => Material::Microfacet(Microfacet::new(number("sigma"), white).unwrap()),
        "kajiya-kay" => Material::KajiyaKay(KajiyaKay::new(number("exponent"), white).unwrap()),
        "lafortune" => {
            let lobes = parameters["lobes"].as_array().unwrap().iter().map(|lobe| {
                let number = |name: &str| lobe[name].as_f64().unwrap();
                LafortuneLobe { cx: number("cx"), cz: number("cz"), n: number("n"), weight: white }
            });
            Material::Lafortune(Lafortune::new([number("diffuse"); 3], lobes.collect()).unwrap())
        }
        other => panic!("make {other} here"),
    }
}

/// The RMS error over all rows and channels, divided by the RMS radiance, for degrees P in the view.
fn errors(file: &Value, light: &Expansion, ps: &[usize]) -> Vec<f64> {
    let material = material(file);
    let rows = file["rows"].as_array().unwrap();
    assert_eq!(rows.len(), 24);
    let error = |&p: &usize| {
        let brdf = project(&material, Choice::Degree { f: degree(F), p: degree(p) }).unwrap();
        let reflection = Reflection::convolve(light, &brdf.coefficients);
        let (mut difference, mut size) = (0.0, 0.0);
        for row in rows {
            let found = reflection.evaluate(direction(&row["central"]), direction(&row["view"]));
            for (found, expected) in found.into_iter().zip(triple(&row["radiance"])) {
                difference += (found - expected).powi(2);
                size += expected * expected;
            }
        }
        (difference / size).sqrt()
    };
    ps.iter().map(error).collect()
}

/// Within 10 percent of the figures that other code found, or lower.
fn agrees(test: &str, name: &str, expected: [f64; 4]) {
    let (Some(light), Some(file)) = (reference(test, "lighting.json"), reference(test, name)) else { return };
    let found = errors(&file, &lighting(&light), &[2, 4, 8, 12]);
    println!("{name}: {found:.6?}, expected {expected:?}");
    for (found, expected) in found.iter().zip(expected) {
        assert!(*found <= 1.1 * expected, "{name}: {found:e} {expected:e}");
    }
}

#[test]
fn microfacet_agrees_with_brute_force() {
    let test = "microfacet_agrees_with_brute_force";
    agrees(test, "microfacet-2.json", [2.1e-2, 5.9e-3, 1.6e-3, 6.5e-4]);
    agrees(test, "microfacet-3.json", [1.6e-2, 5.4e-3, 1.9e-3, 7.4e-4]);
}

#[test]
fn kajiya_kay_agrees_with_brute_force() {
    agrees("kajiya_kay_agrees_with_brute_force", "kajiya-kay-4.json", [1.0e-1, 3.0e-2, 4.0e-3, 1.1e-3]);
}

#[test]
fn lafortune_agrees_with_brute_force() {
    agrees("lafortune_agrees_with_brute_force", "lafortune-5.json", [2.0e-2, 4.2e-3, 1.6e-3, 1.0e-3]);
}

/// No view, no error: what is left is the lighting past degree 30.
#[test]
fn radially_symmetric_models_agree_at_any_p() {
    let test = "radially_symmetric_models_agree_at_any_p";
    for name in ["lambert-0.json", "phong-1.json"] {
        let (Some(light), Some(file)) = (reference(test, "lighting.json"), reference(test, name)) else {
            return;
        };
        let found = errors(&file, &lighting(&light), &[0, 2, 5]);
        println!("{name}: {found:.6?}");
        assert!(found.iter().all(|error| *error < 1e-6), "{name}: {found:?}");
    }
}
