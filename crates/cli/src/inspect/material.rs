//! How `specula inspect` describes materials: material files, measured files and material artifacts.

use std::path::Path;
use std::sync::Arc;

use brdf::{Centre, Checks, Material};
use containers::measured::MeasuredFormat;
use containers::tensors;
use engine::{Failure, path_text};
use serde_json::{Value, json};
use stages::MaterialFile;

use super::facts::Facts;
use super::in_words::in_words;

/// The material of a file; `None` if its name is not that of a material file.
pub(super) fn read(file: &Path, bytes: &[u8]) -> Option<Result<MaterialFile, Failure>> {
    let name = file.file_name()?.to_string_lossy();
    let toml = file.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("toml"));
    let is_material = toml || stages::is_measured_file(&name) || stages::is_materialx_file(&name);
    is_material.then(|| {
        let folder = file.parent().unwrap_or(Path::new(""));
        let read = |path: &Path| {
            let path = folder.join(path);
            let cannot = |error| Failure::from(error).context(format!("cannot read {}", path_text(&path)));
            engine::read_file(&path).map(Arc::new).map_err(cannot)
        };
        if toml && is_manifest(&name, bytes) {
            return Err(Failure::new(format!("{name} is a manifest, not a material"))
                .help("`specula graph` shows its stages"));
        }
        stages::read_material(&name, bytes, None, &read)
    })
}

/// The material that an artifact holds; `None` if it is none.
pub(super) fn of_artifact(bytes: &[u8]) -> Option<Material> {
    tensors::decode_material(bytes).ok()
}

pub(super) fn facts(file: &Path, bytes: &[u8], found: &MaterialFile) -> Facts {
    let name = file.file_name().unwrap_or_default().to_string_lossy();
    let format = match MeasuredFormat::of_name(&name) {
        Some(measured) => measured.name(),
        None if stages::is_materialx_file(&name) => "MaterialX",
        None => "TOML",
    };
    let stem = file.file_stem().unwrap_or_default().to_string_lossy();
    let mut facts: Facts = vec![
        ("material", format!("{stem}: {}", in_words(&found.material)).into()),
        ("what", "material".into()),
        ("format", format.into()),
        ("bytes", bytes.len().into()),
    ];
    for (label, texts) in [("notes", &found.notes), ("warnings", &found.warnings)] {
        if !texts.is_empty() {
            facts.push((label, json!(texts)));
        }
    }
    facts.extend(checked(&found.material));
    facts
}

/// Whether a TOML file has stages.
fn is_manifest(name: &str, bytes: &[u8]) -> bool {
    engine::Document::parse(name, bytes).is_ok_and(|document| document.table.get("stage").is_some())
}

/// The models of a material, and the result of [`brdf::checks`]; the table of albedos is last.
pub(super) fn checked(material: &Material) -> Facts {
    let checks = brdf::checks(material);
    let greatest = checks.greatest();
    vec![
        ("models", models(material)),
        (
            "centre",
            match material.centre() {
                Centre::Reflection => "the reflection vector",
                Centre::Normal => "the normal",
                Centre::Tangent => "the tangent",
            }
            .into(),
        ),
        ("isotropic", checks.isotropic.into()),
        ("reciprocity", reciprocity(&checks).into()),
        ("greatest", albedo_of(&greatest, checks.isotropic)),
        (
            "energy",
            match checks.makes_light() {
                true => "above 1: for some view, more light is reflected than arrives",
                false => "at most 1",
            }
            .into(),
        ),
        ("albedo", checks.albedo.iter().map(|albedo| albedo_of(albedo, checks.isotropic)).collect()),
    ]
}

/// The models with their parameters, as a material artifact holds them.
fn models(material: &Material) -> Value {
    let described = tensors::encode_material(material, None).and_then(|bytes| tensors::describe(&bytes));
    let text = described.ok().and_then(|mut description| description.metadata.remove("material"));
    let mut models =
        text.and_then(|text| serde_json::from_str(&text).ok()).unwrap_or_else(|| material.name().into());
    add_shapes(&mut models, material);
    models
}

/// Replaces the number of each measured table by its shape, [theta_h, theta_d, phi_d] or [theta_h, phi_h,
/// theta_d, psi].
fn add_shapes(models: &mut Value, material: &Material) {
    let mut set = |shape: Value| models.get_mut("table").map_or((), |table| *table = shape);
    match material {
        Material::Measured(measured) => set(json!(measured.shape())),
        Material::MeasuredAnisotropic(measured) => set(json!(measured.shape())),
        Material::Layers(layers) => {
            let parts = models.get_mut("layers").and_then(Value::as_array_mut);
            parts.into_iter().flatten().zip(layers).for_each(|(models, layer)| add_shapes(models, layer));
        }
        _ => {}
    }
}

fn reciprocity(checks: &Checks) -> String {
    let error = checks.reciprocity;
    match checks.is_reciprocal() {
        true => format!("reciprocal, within {error:.1e} of the BRDF's value"),
        false => format!("not reciprocal: off by up to {error:.3} of the BRDF's value"),
    }
}

/// The light that a view reflects of a constant environment of radiance 1; angles are in degrees.
fn albedo_of(albedo: &brdf::Albedo, isotropic: bool) -> Value {
    // Four significant digits.
    let rgb = albedo.rgb.map(|channel| format!("{channel:.3e}").parse().unwrap_or(channel));
    match isotropic {
        true => json!({ "angle": albedo.theta, "rgb": rgb }),
        false => json!({ "angle": albedo.theta, "azimuth": albedo.phi, "rgb": rgb }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn described(text: &str) -> std::collections::BTreeMap<&'static str, Value> {
        let (file, bytes) = (Path::new("gold.toml"), text.as_bytes());
        let found = read(file, bytes).unwrap().unwrap();
        facts(file, bytes, &found).into_iter().collect()
    }

    #[test]
    fn a_material_file_has_albedo_energy_and_reciprocity() {
        let facts = described("model = \"lambert\"\nalbedo = [0.5, 1.25, 0]");
        let words = "gold: matte, the same from every view: albedo 0.5 1.25 0 (lambert)";
        assert_eq!(facts["material"], words);
        assert_eq!(facts["models"], json!({ "albedo": [0.5, 1.25, 0.0], "model": "lambert" }));
        assert_eq!((&facts["isotropic"], &facts["centre"]), (&json!(true), &json!("the normal")));
        assert_eq!(facts["albedo"].as_array().unwrap().len(), 11);
        assert_eq!(facts["albedo"][3], json!({ "angle": 30.0, "rgb": [0.5, 1.25, 0.0] }));
        assert!(facts["energy"].as_str().unwrap().starts_with("above 1"));
        assert!(facts["reciprocity"].as_str().unwrap().starts_with("reciprocal, "));
        let faint = described("model = \"lambert\"\nalbedo = [1.23456e-5, 0, 2e4]");
        assert_eq!(faint["greatest"]["rgb"], json!([1.235e-5, 0.0, 2e4]));
        assert_eq!(faint["format"], "TOML");
        let facts = described("model = \"kajiya-kay\"\nexponent = 8\nspecular = 0.1");
        assert_eq!(facts["greatest"]["azimuth"].as_f64().map(|angle| angle < 180.0), Some(true));
        assert_eq!(facts["energy"], "at most 1");
        assert!(facts["reciprocity"].as_str().unwrap().starts_with("not reciprocal: "));
    }

    #[test]
    fn a_measured_table_has_its_shape() {
        let table = brdf::Measured::new([2, 3, 4], vec![[0.25; 3]; 24]).unwrap();
        let chalk = Material::Lambert(brdf::Lambert::new([0.5; 3]).unwrap());
        let both = Material::layers(vec![chalk, Material::Measured(table)]).unwrap();
        assert_eq!(models(&both)["layers"][1]["table"], json!([2, 3, 4]));
    }

    #[test]
    fn a_material_artifact_has_the_same_facts() {
        let chalk = Material::Lambert(brdf::Lambert::new([0.5; 3]).unwrap());
        let bytes = tensors::encode_material(&chalk, None).unwrap();
        let facts: std::collections::BTreeMap<_, _> =
            super::super::describe(&bytes).unwrap().into_iter().collect();
        assert_eq!((&facts["what"], &facts["format"]), (&json!("material"), &json!("safetensors")));
        assert_eq!(facts["energy"], "at most 1");
    }

    #[test]
    fn errors_of_a_file_are_those_of_its_import() {
        let failure = read(Path::new("a.toml"), b"model = \"fong\"").unwrap().unwrap_err();
        assert!(failure.to_string().contains("a.toml:1:9: there is no model \"fong\""));
        assert!(read(Path::new("a.exr"), b"").is_none());
        let manifest = b"schema = 1\n[stage.a]\nkind = \"rotate\"";
        let failure = read(Path::new("pipeline.toml"), manifest).unwrap().unwrap_err();
        assert_eq!(failure.chain, ["pipeline.toml is a manifest, not a material"]);
        let failure = read(Path::new("/nowhere/a.toml"), b"model = \"measured\"\nfile = \"b.csv\"");
        let failure = failure.unwrap().unwrap_err().to_string();
        assert!(test_data::unix_paths(failure).contains("/nowhere/b.csv"));
    }
}
