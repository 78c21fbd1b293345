//! What the reference files hold: directions, the lighting, the materials.

use std::f64::consts::PI;

use brdf::{KajiyaKay, Lafortune, LafortuneLobe, Lambert, Material, Microfacet, Phong};
use serde_json::Value;
use sh::{Degree, Expansion};
use sphere::{DVec3, Direction};

pub(crate) fn degree(l: usize) -> Degree {
    Degree::new(l).unwrap()
}

pub(crate) fn triple(value: &Value) -> [f64; 3] {
    [0, 1, 2].map(|i| value[i].as_f64().unwrap())
}

pub(crate) fn direction(value: &Value) -> Direction {
    Direction::normalised(DVec3::from(triple(value)))
}

/// exp(k (cos - 1)) = sum of u_l Y_l0: u_l = 2 pi sqrt((2l+1) / (4 pi)) times the integral over [-1, 1] of
/// exp(k (x - 1)) P_l(x), by Gauss-Legendre, which is exact to rounding here (the integrand is entire).
pub(crate) fn lobe(sharpness: f64, top: usize) -> Vec<f64> {
    let (nodes, weights) = sh::quadrature::gauss_legendre(200);
    let mut y_l0 = vec![0.0; top + 1];
    let mut u = vec![0.0; top + 1];
    for (theta, weight) in nodes.into_iter().zip(weights) {
        let x = theta.cos();
        sh::zonal_into(x, &mut y_l0);
        for (u, y) in u.iter_mut().zip(&y_l0) {
            *u += 2.0 * PI * weight * (sharpness * (x - 1.0)).exp() * y;
        }
    }
    u
}

/// The reference lighting: a constant and six lobes.
pub(crate) fn lighting(file: &Value, top: usize) -> Expansion {
    let constant = triple(&file["constant"]);
    let mut sum = Expansion::zero(degree(top));
    sum.coefficients_mut()[0] = constant.map(|v| v * (4.0 * PI).sqrt());
    for part in file["lobes"].as_array().unwrap() {
        let (amplitude, u) = (triple(&part["amplitude"]), lobe(part["sharpness"].as_f64().unwrap(), top));
        let part =
            Expansion::zonal(direction(&part["direction"]), degree(top), |l| amplitude.map(|a| a * u[l]));
        for (row, add) in sum.coefficients_mut().iter_mut().zip(part.coefficients()) {
            for channel in 0..3 {
                row[channel] += add[channel];
            }
        }
    }
    sum
}

/// The material of a file.
pub(crate) fn material(file: &Value) -> Material {
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
