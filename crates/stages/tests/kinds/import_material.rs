use stages::artifacts::Material;

use crate::fixture::{Case, case};

fn import(text: &str) -> Case {
    case("import-material", "").file("materials/gold.toml", text).source("materials/gold.toml")
}

#[test]
fn models_take_their_parameters() {
    let lambert = import("model = \"lambert\"\nalbedo = 0.5\n").artifact::<Material>();
    assert_eq!(lambert.0, brdf::Material::Lambert(brdf::Lambert::new([0.5; 3]).unwrap()));
    let phong = import("exponent = 64\nmodel = \"phong\"\nspecular = [1, 0.77, 0.34]").artifact::<Material>();
    assert_eq!(phong.0, brdf::Material::Phong(brdf::Phong::new(64.0, [1.0, 0.77, 0.34]).unwrap()));
}

#[test]
fn all_faults_are_told_each_with_its_place() {
    let failure = import("model = \"phong\"\nexponant = 4\nspecular = [1, 2]\n").run().err().unwrap();
    assert_eq!(
        failure.chain,
        [
            "gold.toml: 3 faults",
            "gold.toml:1:1: \"exponent\" is missing; expected exponent = a finite number",
            "gold.toml:2:1: unknown key \"exponant\"; expected one of: exponent, specular; did you mean \"exponent\"?",
            "gold.toml:3:12: specular: 2 numbers are not a colour; expected a colour: [red, green, blue] or one \
             number for a grey, each 0 or more",
        ]
    );
}

#[test]
fn one_fault_stands_alone() {
    for (text, expected) in [
        (
            "model = \"fong\"",
            "gold.toml:1:9: there is no model \"fong\"; expected one of: lambert, phong; did you mean \"phong\"?",
        ),
        ("albedo = 1", "gold.toml:1:1: \"model\" is missing; expected one of: lambert, phong"),
        ("model = 3", "gold.toml:1:9: 3 is not a string; expected one of: lambert, phong"),
        ("model = \"phong\"\nexponent = -1", "gold.toml:2:12: exponent: -1 is not a number from 0 to 1e9"),
        (
            "model = \"lambert\"\nalbedo = 2e6",
            "gold.toml:2:10: albedo: 2000000 is not a number from 0 to 1e6",
        ),
    ] {
        assert_eq!(import(text).failure(), expected);
    }
    let failure = import("model = \n").failure();
    assert!(failure.starts_with("gold.toml:1:9: a value is missing"), "{failure}");
}

#[test]
fn a_material_that_makes_light_is_warned_of() {
    let ran = import("model = \"lambert\"\nalbedo = [0.5, 1.5, 0.5]\n").run().unwrap();
    assert_eq!(
        ran.warnings,
        ["albedo 1.5 is more than 1: the material reflects more light than falls on it"]
    );
}

#[test]
fn a_folder_is_no_material() {
    let folder = case("import-material", "").file("materials/gold.toml", "").source("materials");
    let failure = folder.run().err().unwrap();
    assert_eq!(failure.chain, ["materials is a folder, not a material"]);
    assert!(failure.help.unwrap().contains("*.toml"));
}
