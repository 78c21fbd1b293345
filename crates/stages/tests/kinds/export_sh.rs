use engine::Product;
use serde_json::Value;
use stages::artifacts::Lighting;

use crate::fixture::{Case, case, environment, kinds, sky, sky_lighting};

fn export(parameters: &str) -> Case {
    case("export-sh", parameters).input("lighting", sky_lighting())
}

fn json(case: &Case) -> Value {
    serde_json::from_slice(&case.files()[0]).unwrap()
}

#[test]
fn json_and_safetensors_hold_every_coefficient() {
    let expected = sky_lighting().0.series;
    assert_eq!(export("").product(), Product::Files(vec![".json".into()]));
    assert_eq!(containers::lighting_json::decode(&export("").files()[0]).unwrap(), expected);
    let case = export("format = \"safetensors\"");
    assert_eq!(case.product(), Product::Files(vec![".safetensors".into()]));
    let file = &case.files()[0];
    assert_eq!(containers::tensors::decode_lighting(file).unwrap().series, expected);
    assert_eq!(containers::read_recipe(file).as_deref(), Some("{\"kind\":\"export-sh\"}"));
}

#[test]
fn a_preset_takes_the_degrees_that_it_holds_and_says_so() {
    let lighting =
        case("project-sh", "degree = 5").input("environment", environment(16, sky)).artifact::<Lighting>();
    let export = case("export-sh", "preset = \"three\"").input("lighting", (*lighting).clone());
    assert_eq!(export.run().unwrap().notes, ["preset three holds degree 2: the first 9 of 36 coefficients"]);
    let rows = json(&export)["coefficients"].as_array().unwrap().clone();
    assert_eq!(rows.len(), 9);
    // three.js has our +Z as +Y: its row 1 (y) is our row 2 (z).
    let found = rows[1][0].as_f64().unwrap();
    assert!((found - lighting.0.series.coefficients()[2][0]).abs() < 1e-12, "{found}");
}

#[test]
fn every_preset_is_written() {
    for preset in containers::lighting_json::Preset::ALL {
        let file = json(&export(&format!("preset = \"{}\"", preset.name())));
        assert_eq!(file["preset"], preset.name());
        assert_eq!(file["specula"]["kind"], "export-sh");
    }
}

#[test]
fn safetensors_take_no_preset() {
    let errors = case("export-sh", "format = \"safetensors\"\npreset = \"unity\"").errors();
    assert_eq!(
        errors,
        ["preset: format = \"safetensors\" holds coefficients in Specula's own convention only"]
    );
}

/// The manual describes each preset as its files do.
#[test]
fn the_manual_holds_every_preset_in_full() {
    let manual = kinds().get("export-sh").unwrap().manual();
    let manual = manual.split_whitespace().collect::<Vec<_>>().join(" ");
    for preset in containers::lighting_json::Preset::ALL {
        let definition = preset.definition();
        let message = format!(
            "`{}` - frame: {} - yaw: {} - signs: {} - scale: {} - source: {}",
            preset.name(),
            definition.frame,
            definition.yaw,
            definition.signs,
            definition.scale,
            definition.source
        );
        assert!(manual.contains(&message), "{message}");
    }
}
