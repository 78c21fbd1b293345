//! Radially symmetric reflection against brute force, and what it must do to any light.

use std::f64::consts::PI;

use brdf::{BrdfCoefficients, Centre, Choice, Lambert, Material, Phong, project};
use serde_json::Value;
use sh::{Basis, Degree, Expansion, Stop};
use shrm::{Reflection, ViewDependent};
use sphere::Direction;
use test_data::reference;

use crate::given::{degree, direction, lighting, lobe, triple};

fn lambert(albedo: [f64; 3]) -> Material {
    Material::Lambert(Lambert::new(albedo).unwrap())
}

fn phong(exponent: f64, specular: [f64; 3]) -> Material {
    Material::Phong(Phong::new(exponent, specular).unwrap())
}

fn coefficients(material: &Material, f: usize) -> BrdfCoefficients {
    project(material, Choice::Degree { f: degree(f), p: Degree::ZERO }, Stop::NEVER).unwrap().coefficients
}

#[test]
fn the_reference_lighting_has_its_published_coefficients() {
    let test = "the_reference_lighting_has_its_published_coefficients";
    let Some(file) = reference(test, "lighting.json") else { return };
    let found = lighting(&file, 12);
    let expected: Vec<_> = file["sh"].as_array().unwrap().iter().map(triple).collect();
    assert_eq!(expected.len(), 169);
    for (row, (found, expected)) in found.coefficients().iter().zip(&expected).enumerate() {
        for channel in 0..3 {
            assert!((found[channel] - expected[channel]).abs() < 1e-12, "row {row}: {found:?} {expected:?}");
        }
    }
}

/// The lobes' coefficients fall faster than any power: past degree 40 nothing is left of sharpness 22.
fn agrees_with_brute_force(test: &str, name: &str, model: impl Fn(&Value) -> Material) {
    let (Some(light), Some(file)) = (reference(test, "lighting.json"), reference(test, name)) else { return };
    let material = model(&file["parameters"]);
    let reflection = Reflection::convolve(&lighting(&light, 40), &coefficients(&material, 60));
    let field = reflection.radial().unwrap();
    let basis = Basis::new(field.degree());
    let rows = file["rows"].as_array().unwrap();
    assert_eq!(rows.len(), 24);
    let mut worst: f64 = 0.0;
    for row in rows {
        let found = basis.evaluate(&field, direction(&row["central"]));
        let expected = triple(&row["radiance"]);
        for channel in 0..3 {
            worst = worst.max((found[channel] / expected[channel] - 1.0).abs());
        }
    }
    println!("{name}: largest relative error {worst:e}");
    assert!(worst < 1e-10, "{name}: {worst:e}");
}

#[test]
fn lambert_agrees_with_brute_force() {
    agrees_with_brute_force("lambert_agrees_with_brute_force", "lambert-0.json", |parameters| {
        lambert([parameters["albedo"].as_f64().unwrap(); 3])
    });
}

#[test]
fn phong_agrees_with_brute_force() {
    agrees_with_brute_force("phong_agrees_with_brute_force", "phong-1.json", |parameters| {
        phong(parameters["exponent"].as_f64().unwrap(), [1.0; 3])
    });
}

/// Any light, made of lobes, without the reference files.
fn some_light(top: usize, gain: f64) -> Expansion {
    let u = lobe(6.0, top);
    let mut light = Expansion::zonal(Direction::from_angles(0.7, 2.0), degree(top), |l| {
        [gain * u[l], 0.5 * u[l], 2.0 * u[l]]
    });
    light.coefficients_mut()[0][1] += 0.1;
    light
}

#[test]
fn a_furnace_reflects_the_albedo() {
    let sky = Expansion::from_coefficients(Degree::ZERO, vec![[(4.0 * PI).sqrt(); 3]])
        .unwrap()
        .to_degree(degree(9));
    for material in [lambert([0.9, 0.5, 0.0]), phong(0.0, [0.9, 0.5, 0.0]), phong(77.3, [0.9, 0.5, 0.0])] {
        let field = Reflection::convolve(&sky, &coefficients(&material, 9)).radial().unwrap();
        for theta in [0.0, 1.0, 3.0] {
            let found = field.evaluate(Direction::from_angles(theta, 5.0));
            for (found, expected) in found.into_iter().zip([0.9, 0.5, 0.0]) {
                assert!((found - expected).abs() < 1e-14, "{material:?}: {found}");
            }
        }
    }
}

/// Light and lobe are nowhere negative, so that their convolution is not either; past degree 60 the light has
/// nothing left, so that no ringing hides that.
#[test]
fn positive_light_is_reflected_as_positive_light() {
    let light = some_light(60, 1.0);
    let basis = Basis::new(degree(60));
    for material in [lambert([1.0; 3]), phong(3.0, [1.0; 3]), phong(500.0, [1.0; 3])] {
        let field = Reflection::convolve(&light, &coefficients(&material, 60)).radial().unwrap();
        for i in 0..500 {
            let w = Direction::from_angles(f64::from(i) * PI / 500.0, f64::from(i) * 2.4);
            assert!(basis.evaluate(&field, w).into_iter().all(|value| value > -1e-13), "{material:?}");
        }
    }
}

#[test]
fn reflection_is_linear_in_the_light() {
    let (a, b) = (some_light(12, 1.0), some_light(12, -3.0));
    let brdf = coefficients(&phong(20.0, [0.1, 0.5, 1.0]), 12);
    let reflect = |light: &Expansion| Reflection::convolve(light, &brdf).radial().unwrap();
    let mut sum = a.clone();
    for (row, add) in sum.coefficients_mut().iter_mut().zip(b.coefficients()) {
        for channel in 0..3 {
            row[channel] += 2.0 * add[channel];
        }
    }
    let (fa, fb, fsum) = (reflect(&a), reflect(&b), reflect(&sum));
    for ((a, b), sum) in fa.coefficients().iter().zip(fb.coefficients()).zip(fsum.coefficients()) {
        for channel in 0..3 {
            assert!((a[channel] + 2.0 * b[channel] - sum[channel]).abs() < 1e-14);
        }
    }
}

/// Turning the light turns the reflection.
#[test]
fn reflection_commutes_with_rotation() {
    let light = some_light(20, 1.0);
    let brdf = coefficients(&phong(20.0, [0.1, 0.5, 1.0]), 20);
    let rotation = sphere::Rotation::from_yaw_pitch_roll(0.3, 1.0, -2.0);
    let reflect = |light: &Expansion| Reflection::convolve(light, &brdf).radial().unwrap();
    let (before, after) = (reflect(&sh::rotate(&light, rotation)), sh::rotate(&reflect(&light), rotation));
    for (before, after) in before.coefficients().iter().flatten().zip(after.coefficients().iter().flatten()) {
        assert!((before - after).abs() < 1e-13);
    }
}

#[test]
fn the_smaller_degree_is_taken() {
    let light = some_light(12, 1.0);
    let low = Reflection::convolve(&light, &coefficients(&lambert([1.0; 3]), 4));
    assert_eq!((low.lighting().degree(), low.brdf().f()), (degree(4), degree(4)));
    let high = Reflection::convolve(&light, &coefficients(&lambert([1.0; 3]), 40));
    assert_eq!((high.lighting().degree(), high.brdf().f()), (degree(12), degree(12)));
}

#[test]
fn a_material_that_depends_on_the_view_has_no_radial_field() {
    let mut rho = vec![[0.0; 3]; 2 * 9];
    rho[9 + 3] = [0.1; 3]; // l = 1, p = 1, q = 0
    let brdf = BrdfCoefficients::new(Centre::Reflection, degree(1), degree(2), rho.clone()).unwrap();
    let error = Reflection::convolve(&some_light(3, 1.0), &brdf).radial().unwrap_err();
    assert_eq!(error, ViewDependent { p: 1 });
    rho[9 + 3] = [0.0; 3];
    rho[9] = [0.1; 3];
    let brdf = BrdfCoefficients::new(Centre::Reflection, degree(1), degree(2), rho).unwrap();
    assert!(
        Reflection::convolve(&some_light(3, 1.0), &brdf).radial().is_ok(),
        "all entries with p > 0 are zero"
    );
}
