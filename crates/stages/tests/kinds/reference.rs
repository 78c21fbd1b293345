//! A lighting that is known in closed form, through files and the whole path.

use serde_json::Value;
use sphere::{DVec3, Direction};
use stages::artifacts::{Brdf, Lighting, Material, Reflection};

use crate::fixture::{case, difference, environment, exr, lambert, phong};
use test_data::reference;

use crate::pipeline::Pipeline;
fn triple(value: &Value) -> [f64; 3] {
    serde_json::from_value(value.clone()).unwrap()
}

/// L(w) = constant + sum of amplitude e^(sharpness (w . direction - 1)).
fn radiance(lighting: &Value) -> impl Fn(DVec3) -> [f64; 3] {
    let constant = triple(&lighting["constant"]);
    let lobes: Vec<_> = lighting["lobes"]
        .as_array()
        .unwrap()
        .iter()
        .map(|lobe| {
            let direction = DVec3::from_array(triple(&lobe["direction"]));
            (direction, lobe["sharpness"].as_f64().unwrap(), triple(&lobe["amplitude"]))
        })
        .collect();
    move |w| {
        let mut sum = constant;
        for (direction, sharpness, amplitude) in &lobes {
            let value = (sharpness * (w.dot(*direction) - 1.0)).exp();
            sum = std::array::from_fn(|channel| sum[channel] + amplitude[channel] * value);
        }
        sum
    }
}

/// Pixels are f32, 6e-8 of the largest radiance; the quadrature is exact. 2e-6 leaves a margin.
#[test]
fn the_reference_lighting_comes_back_from_an_exr_file() {
    let Some(truth) = reference("the_reference_lighting_comes_back_from_an_exr_file", "lighting.json") else {
        return;
    };
    let environment = environment(512, radiance(&truth));
    let pipeline = Pipeline::new(
        r#"
        [stage.environment]
        kind = "import-environment"
        source = "lighting.exr"

        [stage.lighting]
        kind = "project-sh"
        input = "environment"
        degree = 12

        [stage.sh]
        kind = "export-sh"
        input = "lighting"
        format = "safetensors"
        path = "sh"
        "#,
        "".as_ref(),
    )
    .file("lighting.exr", &exr(1024, 512, environment.0.pixels().to_vec()));
    assert_eq!(pipeline.build(2).ran, 3);
    let expected: Vec<[f64; 3]> = truth["sh"].as_array().unwrap().iter().map(triple).collect();
    assert_eq!(expected.len(), 169);
    let largest = expected.as_flattened().iter().fold(0.0_f64, |a, b| a.max(b.abs()));
    let error = difference(pipeline.lighting("sh.safetensors").coefficients(), &expected) / largest;
    eprintln!("169 coefficients within {error:.1e} of the largest");
    assert!(error < 2e-6, "{error:e}");
    assert_eq!(pipeline.build(1).ran, 0, "nothing is to do again");
}

/// Radiance by brute force, made without spherical harmonics, at every row of the table. The lighting's lobes
/// fall like e^(-l^2 / (2 sharpness)): past degree 40 nothing is left, and rounding to f32 leaves 1e-7.
#[test]
fn reflected_radiance_is_that_of_brute_force() {
    for (file, material) in [("lambert-0.json", lambert(1.0)), ("phong-1.json", phong(32.0))] {
        let test = "reflected_radiance_is_that_of_brute_force";
        let (Some(truth), Some(table)) = (reference(test, "lighting.json"), reference(test, file)) else {
            return;
        };
        let lighting =
            case("project-sh", "degree = 60").input("environment", environment(256, radiance(&truth)));
        let brdf = case("project-brdf", "degree = [60, 0]").input("material", Material(material));
        let reflection = case("convolve", "")
            .input("lighting", (*lighting.artifact::<Lighting>()).clone())
            .input("brdf", (*brdf.artifact::<Brdf>()).clone())
            .artifact::<Reflection>();
        let field = reflection.0.radial().unwrap();
        let rows = table["rows"].as_array().unwrap();
        assert_eq!(rows.len(), 24);
        let mut worst = 0.0_f64;
        for row in rows {
            let central = Direction::new(DVec3::from_array(triple(&row["central"]))).unwrap();
            let (found, expected) = (field.evaluate(central), triple(&row["radiance"]));
            for channel in 0..3 {
                worst = worst.max((found[channel] / expected[channel] - 1.0).abs());
            }
        }
        eprintln!("{file}: {} rows within {worst:.1e}", rows.len());
        assert!(worst < 1e-5, "{file}: {worst:e}");
    }
}
