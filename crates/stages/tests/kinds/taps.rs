//! Compact maps: `scale-space`, `fit-taps` and `export-taps`.

use brdf::Model as _;
use containers::tensors::describe;
use stages::artifacts::{Material, ScaleSpace, Taps};

use crate::fixture::{Case, case, environment, lambert, phong, sky};

/// A sky with a sun of a few pixels.
fn sunny() -> stages::artifacts::Environment {
    environment(64, |w| if w.x > 0.999 { [900.0, 800.0, 700.0] } else { sky(w) })
}

pub(crate) fn scale_space(parameters: &str) -> Case {
    case("scale-space", parameters).input("environment", sunny())
}

pub(crate) fn fit_taps(parameters: &str) -> Case {
    case("fit-taps", parameters).input("material", Material(phong(20.0)))
}

/// Both of a pair.
pub(crate) fn pair(parameters: &str) -> Case {
    case("export-taps", parameters)
        .input("scale-space", (*scale_space("resolution = 16").artifact::<ScaleSpace>()).clone())
        .input("taps", (*fit_taps("taps = 2").artifact::<Taps>()).clone())
}

#[test]
fn a_sun_is_kept_beside_the_levels_or_is_in_them() {
    let brightest = |parameters: &str| {
        let space = scale_space(parameters).artifact::<ScaleSpace>();
        let largest = space.0.space.levels()[0].pixels().as_flattened().iter().copied().fold(0.0, f32::max);
        (space.0.space.lights().len(), largest)
    };
    let (kept, soft) = brightest("resolution = 32");
    let (none, baked) = brightest("resolution = 32\nlights = 0");
    let (all, same) = brightest("resolution = 32\nlights = \"all\"");
    assert!(kept > 0 && none == 0 && all == kept, "{kept} {none} {all}");
    assert!(baked > 5.0 * soft && same == soft, "{baked} {soft} {same}");
}

#[test]
fn parameters_that_are_wrong_are_named() {
    for (kind, parameters, expected) in [
        ("scale-space", "resolution = 48", "resolution: expected a power of two; the nearest is 64"),
        ("scale-space", "lights = -1", "lights: -1 is not a whole number of lights, 0 or more, or \"all\""),
        (
            "scale-space",
            "lights = \"many\"",
            "lights: \"many\" is not a whole number of lights, 0 or more, or \"all\"",
        ),
        ("export-taps", "accept = [0.1]", "accept: an array is not [p95, p99], two numbers of stops above 0"),
        ("export-taps", "accept = 0.1", "accept: 0.1 is not [p95, p99], two numbers of stops above 0"),
    ] {
        assert_eq!(case(kind, parameters).errors(), [expected]);
    }
}

#[test]
fn the_number_of_taps_is_the_least_that_fits() {
    let taps = |parameters: &str, material: brdf::Material| {
        let case = case("fit-taps", parameters).input("material", Material(material));
        case.artifact::<Taps>().0.fitted.table.taps()
    };
    assert_eq!(taps("", lambert(0.5)), 0, "a matte surface looks about its normal alone");
    assert_eq!(taps("taps = 5", phong(20.0)), 5);
    let sharp = brdf::Microfacet::new(0.2, [1.0; 3]).unwrap();
    let sharp = || brdf::Material::Microfacet(sharp.clone());
    let [loose, strict] = ["error = 5.0", "error = 0.0001"].map(|error| taps(error, sharp()));
    assert_eq!([loose, strict], [1, 4]);
}

#[test]
fn a_material_that_depends_on_its_tangent_is_a_warning() {
    let hair = brdf::Material::KajiyaKay(brdf::KajiyaKay::new(16.0, [1.0; 3]).unwrap());
    let values = brdf::Ward::examples().unwrap().into_iter().map(brdf::Material::Ward);
    let ward = values.into_iter().find(|ward| !ward.is_isotropic()).unwrap();
    for material in [hair, ward] {
        let brushed = case("fit-taps", "taps = 1").input("material", Material(material));
        let warnings = brushed.run().unwrap().warnings;
        assert!(warnings.iter().any(|text| text.contains("mean over all turns")), "{warnings:?}");
    }
}

#[test]
fn a_pair_is_measured_and_its_file_has_every_tensor() {
    let description = describe(&pair("").files()[0]).unwrap();
    let shape = |name: &str| {
        let found = description.tensors.iter().find(|(tensor, ..)| tensor == name);
        found.unwrap_or_else(|| panic!("no {name}: {description:?}")).2.clone()
    };
    assert_eq!(shape("taps"), [65, 2, 5]);
    assert_eq!(shape("normals"), [65, 1, 4]);
    assert_eq!(shape("level_00"), [6, 16, 16, 3]);
    assert_eq!(shape("level_15"), [6, 2, 2, 3]);
    assert_eq!(shape("normal_3"), [6, 16, 16, 3]);
    assert_eq!(shape("std"), [16]);
    assert_eq!(shape("diffuse"), [9, 3]);
    let strict = pair("accept = [0.001, 0.002]").run().unwrap().warnings;
    assert!(strict.iter().any(|text| text.contains("`accept` is [0.001, 0.002]")), "{strict:?}");
    assert!(pair("accept = [3, 5]").run().unwrap().warnings.is_empty());
}

#[test]
fn either_may_be_written_alone_and_nothing_is_an_error() {
    let space = scale_space("resolution = 16").artifact::<ScaleSpace>();
    let alone = case("export-taps", "").input("scale-space", (*space).clone());
    let files = alone.files();
    let names: Vec<String> =
        describe(&files[0]).unwrap().tensors.into_iter().map(|tensor| tensor.0).collect();
    assert!(names.contains(&"level_00".into()) && !names.contains(&"taps".into()), "{names:?}");
    let text = case("export-taps", "").failure();
    assert!(text.contains("neither scale-space nor taps is connected"), "{text}");
}
