//! Compact maps: `scale-space`, `fit-taps` and `export-taps`.

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
        (
            "export-taps",
            "format = \"exr\"\nlayout = \"cube-array\"",
            "layout: OpenEXR has no arrays of cubes; it holds an atlas",
        ),
        ("export-taps", "preset = \"three\"\nformat = \"dds\"", "format: the preset already sets it"),
        (
            "export-taps",
            "format = \"exr\"\ntexels = \"half\"",
            "texels: only format = \"ktx2\" or \"dds\" uses it",
        ),
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
    let sharp = || brdf::Material::Microfacet(sharp);
    let [loose, strict] = ["error = 5.0", "error = 0.0001"].map(|error| taps(error, sharp()));
    assert_eq!([loose, strict], [1, 4]);
}

#[test]
fn a_material_about_its_tangent_is_a_warning() {
    let hair = brdf::Material::KajiyaKay(brdf::KajiyaKay::new(16.0, [1.0; 3]).unwrap());
    let strand = case("fit-taps", "taps = 1").input("material", Material(hair));
    let warnings = strand.run().unwrap().warnings;
    assert!(warnings.iter().any(|text| text.contains("mean over all rotations")), "{warnings:?}");
}

/// Brushed metal has taps that know its tangent, also in the shader of a preset.
#[test]
fn brushed_metal_has_taps_that_know_its_tangent() {
    let brushed = brdf::Material::Ward(brdf::Ward::new([0.2, 0.5], [0.6, 0.5, 0.3]).unwrap());
    let fitted = case("fit-taps", "taps = 4").input("material", Material(brushed));
    assert!(fitted.run().unwrap().warnings.is_empty());
    let taps = fitted.artifact::<Taps>();
    assert_eq!(taps.0.facets.len(), 1);
    let space = scale_space("resolution = 32").artifact::<ScaleSpace>();
    let pair = |parameters: &str| {
        case("export-taps", parameters).input("scale-space", (*space).clone()).input("taps", (*taps).clone())
    };
    let ran = pair("accept = [0.2, 0.4]\nlights = \"all\"").run().unwrap();
    assert!(ran.warnings.is_empty(), "{:?}", ran.warnings);
    let description = describe(&pair("format = \"safetensors\"").files()[0]).unwrap();
    let shape = |name: &str| {
        description.tensors.iter().find(|(tensor, ..)| tensor == name).map(|found| found.2.clone())
    };
    assert_eq!(shape("taps"), Some(vec![25, 25, 4, 6]));
    assert_eq!(shape("normals"), Some(vec![25, 25, 1, 4]));
    let texture = containers::read_texture(&pair("").files()[2]).unwrap().texture;
    assert_eq!([texture.width, texture.height], [25, 25 * (2 * 4 + 1)]);
    let preset = pair("preset = \"three\"\naccept = [0.2, 0.4]\nlights = \"all\"");
    let warnings = preset.run().unwrap().warnings;
    assert!(warnings.is_empty(), "{warnings:?}");
    let files = preset.files();
    assert_eq!(containers::read_texture(&files[2]).unwrap().texture.width, 25);
    let shader = String::from_utf8(files[4].clone()).unwrap();
    assert!(shader.contains("tap_reflected(vec3 N, vec3 T, vec3 V)"), "{shader}");
}

#[test]
fn a_pair_is_measured_and_its_file_has_every_tensor() {
    let description = describe(&pair("format = \"safetensors\"").files()[0]).unwrap();
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
    let told = "`accept` is [0.001, 0.002]; what may help: ";
    assert!(strict.iter().any(|text| text.contains(told)), "{strict:?}");
    assert!(strict.iter().any(|text| text.contains("resolution = 32 of scale-space")), "{strict:?}");
    assert!(pair("accept = [3, 5]").run().unwrap().warnings.is_empty());
}

/// Fewer taps and lights are taken where they are accurate enough; what is not kept is in the levels.
#[test]
fn a_pair_takes_the_cheapest_taps_and_lights() {
    let space = scale_space("resolution = 32").artifact::<ScaleSpace>();
    let rough = brdf::Microfacet::new(0.3, [1.0; 3]).unwrap();
    let taps =
        case("fit-taps", "error = 0.0001").input("material", Material(brdf::Material::Microfacet(rough)));
    let taps = taps.artifact::<Taps>();
    let (most, all) = (taps.0.fitted.table.taps(), space.0.space.lights().len());
    assert!(most > 2 && all > 1 && taps.0.others.len() > 1, "{most} {all}");
    let chosen = |parameters: &str| {
        let parameters = format!("format = \"safetensors\"\n{parameters}");
        let case = case("export-taps", &parameters)
            .input("scale-space", (*space).clone())
            .input("taps", (*taps).clone());
        let description = describe(&case.files()[0]).unwrap();
        let rows = |name: &str, axis: usize| {
            description.tensors.iter().find(|(tensor, ..)| tensor == name).map_or(0, |found| found.2[axis])
        };
        ([rows("taps", 1), rows("lights", 0)], case.run().unwrap().notes.join(" "))
    };
    assert_eq!(chosen("accept = [9, 9]").0, [1, 0]);
    assert_eq!(chosen("accept = [9, 9]\nlights = \"all\"").0, [1, all]);
    let ([taps, _], _) = chosen("accept = [0.001, 0.001]");
    assert!(taps > 1, "{taps}");
    let ([taps, lights], notes) = chosen("accept = [0.4, 1.0]");
    assert!(20 * taps + 35 * lights < 20 * most + 35 * all, "{taps} {lights} {notes}");
}

#[test]
fn either_may_be_written_alone_and_nothing_is_an_error() {
    let space = scale_space("resolution = 16").artifact::<ScaleSpace>();
    let alone = case("export-taps", "format = \"safetensors\"").input("scale-space", (*space).clone());
    let files = alone.files();
    let names: Vec<String> =
        describe(&files[0]).unwrap().tensors.into_iter().map(|tensor| tensor.0).collect();
    assert!(names.contains(&"level_00".into()) && !names.contains(&"taps".into()), "{names:?}");
    assert_eq!(case("export-taps", "").input_errors(), ["inputs: connect scale-space, taps, or both"]);
    let textures = case("export-taps", "").input("scale-space", (*space).clone());
    assert_eq!(textures.endings(), ["/levels.ktx2", "/normals.ktx2", "/taps.json"]);
    let errors =
        case("export-taps", "preset = \"three\"").input("scale-space", (*space).clone()).input_errors();
    assert_eq!(errors, ["preset: a shader is made for a pair: connect both scale-space and taps"]);
}

/// The levels come back from an array of cubes, and the table from its texture.
#[test]
fn textures_hold_the_levels_and_the_table() {
    let space = scale_space("resolution = 16").artifact::<ScaleSpace>();
    for (format, texels, allowed) in
        [("ktx2", "half", 1e-3), ("ktx2", "rgb9e5", 0.01), ("ktx2", "bc6h", 0.5), ("dds", "rgb9e5", 0.01)]
    {
        let case = pair(&format!("format = \"{format}\"\ntexels = \"{texels}\"\nlights = \"all\""));
        let files = case.files();
        let levels = containers::read_texture(&files[0]).unwrap().texture;
        assert_eq!(
            [levels.width, levels.layers, levels.faces, 1 + levels.smaller_levels.len()],
            [16, 4, 6, 4]
        );
        for (k, map) in space.0.space.levels().iter().enumerate() {
            let edge = map.cube().edge;
            let mip = if k < 4 { &levels.pixels } else { &levels.smaller_levels[k / 4 - 1] };
            let layer = &mip[k % 4 * 6 * edge * edge..][..6 * edge * edge];
            for (found, expected) in layer.iter().zip(map.pixels()) {
                let largest = expected.iter().copied().fold(0.0, f32::max);
                for (found, expected) in found.iter().zip(expected) {
                    assert!((found - expected).abs() <= allowed * largest, "{format} {texels} {k}");
                }
            }
        }
        let table = containers::read_texture(&files[2]).unwrap().texture;
        assert_eq!([table.width, table.height], [65, 5]);
        let numbers: serde_json::Value = serde_json::from_slice(&files[3]).unwrap();
        let delta = numbers["table"][40]["taps"][1]["delta"].as_f64().unwrap();
        assert!((f64::from(table.pixels[2 * 65 + 40][0]) - delta).abs() < 1e-3);
    }
}

#[test]
fn each_preset_writes_a_shader_and_the_code_that_loads_it() {
    for (preset, files) in [
        (
            "three",
            ["/levels.ktx2", "/normals.ktx2", "/table.ktx2", "/taps.json", "/taps-three.js", "/README.txt"],
        ),
        (
            "godot",
            ["/levels.exr", "/normals.exr", "/table.exr", "/taps.json", "/taps.gdshader", "/README.txt"],
        ),
    ] {
        let case = pair(&format!("preset = \"{preset}\""));
        assert_eq!(case.endings(), files);
        let written = case.files();
        let [shader, readme] = [4, 5].map(|index| String::from_utf8(written[index].clone()).unwrap());
        assert!(shader.contains("tap_reflected") && !shader.contains("__"), "{shader}");
        assert!(!readme.contains("__"), "{readme}");
    }
    let blender = case("export-taps", "preset = \"blender\"").errors();
    assert_eq!(blender, ["preset: there is no shader of taps for blender"]);
}

/// The table over roughness for all metals and dielectrics that docs/taps.md ships is what the program makes.
#[test]
fn the_shipped_table_of_standard_is_made_anew() {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/taps/standard.ktx2");
    let made = case("dfg", "form = \"taps\"").files()[0].clone();
    if std::env::var_os("UPDATE_EXPECT").is_some() {
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(&path, &made).unwrap();
    }
    // The texels are the end of the file; before them are a header and the recipe of who made it.
    let texels = 7 * 33 * 65 * 8;
    let shipped = std::fs::read(&path).unwrap();
    assert!(shipped.len() > texels && shipped.len() < 200_000, "{} bytes", shipped.len());
    assert!(shipped.ends_with(&made[made.len() - texels..]), "UPDATE_EXPECT=1 makes {} anew", path.display());
    let found = containers::read_ktx2(&shipped).unwrap();
    assert_eq!((found.width, found.height, found.layers), (65, 33, 7));
    for (parameters, expected) in [
        ("form = \"taps\"\nsheen = true", "sheen: only form = \"albedo\" uses it"),
        (
            "form = \"taps\"\nformat = \"exr\"",
            "format: OpenEXR has no arrays of pictures; expected \"ktx2\" or \"dds\"",
        ),
        ("taps = 4", "taps: only form = \"taps\" uses it"),
    ] {
        assert_eq!(case("dfg", parameters).errors(), [expected]);
    }
}

/// Tables over a parameter are one texture, one file of numbers, or tensors with one more size.
#[test]
fn taps_are_fitted_over_a_parameter() {
    let metal = || {
        Material(brdf::Material::Ggx(brdf::Ggx::new(0.5, brdf::Fresnel::Dielectric(1.5), [1.0; 3]).unwrap()))
    };
    let fit = |parameters: &str| {
        case("fit-taps", &format!("taps = 2\nvary-rows = 3\nvary-from = 0.4\n{parameters}"))
            .input("material", metal())
    };
    let taps = fit("vary = \"roughness\"").artifact::<Taps>();
    let varied = taps.0.varied.as_ref().unwrap();
    assert_eq!((varied.parameter.as_str(), varied.fitted.table.range()), ("roughness", [0.4, 1.0]));
    let export = |parameters: &str| {
        case("export-taps", &format!("varied = true\n{parameters}")).input("taps", (*taps).clone())
    };
    let files = export("").files();
    let texture = containers::read_ktx2(&files[0]).unwrap();
    assert_eq!((texture.width, texture.height, texture.layers), (65, 3, 5));
    let numbers: serde_json::Value = serde_json::from_slice(&files[1]).unwrap();
    assert_eq!(numbers["range"], serde_json::json!([0.4, 1.0]));
    let widths = [0, 1, 2].map(|row: usize| numbers["tables"][row][0]["taps"][0]["std"].as_f64().unwrap());
    assert!(widths.windows(2).all(|pair| pair[0] < pair[1]), "{widths:?}");
    let description = describe(&export("format = \"safetensors\"").files()[0]).unwrap();
    assert_eq!(description.tensors[0].2, [3, 65, 2, 5]);

    let alone =
        export("").input("scale-space", (*scale_space("resolution = 16").artifact::<ScaleSpace>()).clone());
    assert!(alone.input_errors()[0].starts_with("varied: tables over a parameter are written separately"));
    let plain = case("export-taps", "varied = true").input("taps", (*fit("").artifact::<Taps>()).clone());
    let plain = plain.run().err().unwrap().to_string();
    assert!(plain.contains("a single material"), "{plain}");
    assert_eq!(
        fit("vary = \"roughness\"\nvary-to = 0.3").errors(),
        ["vary-to: expected a number above `vary-from`"]
    );
    let unknown = fit("vary = \"sigma\"").run().err().unwrap().to_string();
    assert!(unknown.contains("no numeric parameter \"sigma\""), "{unknown}");
}
