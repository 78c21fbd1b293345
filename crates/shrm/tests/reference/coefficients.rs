//! The whole chain: reflected light evaluated from coefficients, against brute-force integrals that
//! know no spherical harmonics.

use brdf::{Choice, project};
use serde_json::Value;
use sh::{Expansion, Stop};
use shrm::Reflection;
use test_data::reference;

use crate::given::{degree, direction, lighting, material, triple};

/// The degree past which about 1e-9 of the lighting is left: its sharpness is up to 22, so e^(-l^2 / 44).
const F: usize = 30;

/// The RMS error over all rows and channels, divided by the RMS radiance, for degrees P in the view.
fn errors(file: &Value, light: &Expansion, ps: &[usize]) -> Vec<f64> {
    let material = material(file);
    let rows = file["rows"].as_array().unwrap();
    assert_eq!(rows.len(), 24);
    let error = |&p: &usize| {
        let brdf = project(&material, Choice::Degree { f: degree(F), p: degree(p) }, Stop::NEVER).unwrap();
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
    let found = errors(&file, &lighting(&light, F), &[2, 4, 8, 12]);
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
        let found = errors(&file, &lighting(&light, F), &[0, 2, 5]);
        println!("{name}: {found:.6?}");
        assert!(found.iter().all(|error| *error < 1e-6), "{name}: {found:?}");
    }
}
