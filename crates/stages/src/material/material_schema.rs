//! The JSON Schema of material files, made from the models, for completion, descriptions and errors in
//! editors.
//!
//! Like the manifest's schema, it is never stricter than the parser and uses only keywords that draft 7 has
//! too.

use brdf::{Absent, MODELS, ModelText, Parameter, Range, ValueType};
use containers::measured::MeasuredFormat;
use engine::Parameter as _;
use serde_json::{Map, Value, json};

use super::material_file::{GLTF, LAYERS, MATERIALX, MEASURED, endings};
use super::presets::{self, PRESETS};
use crate::values::ChosenMaterial;

/// The JSON Schema (draft 2020-12) of material files.
pub fn material_schema() -> Value {
    let names = MODELS.iter().map(|model| model.name).chain([MEASURED, GLTF, MATERIALX, LAYERS, PRESET]);
    let branches = names.map(|name| json!({ "$ref": format!("#/$defs/{name}") })).collect::<Vec<_>>();
    let description = "A material: a reflection model with its parameters, a measured file, a material of a glTF or MaterialX file, a preset, or \
         layers of materials.";
    let mut definitions = Map::new();
    definitions.insert(
        "material".into(),
        json!({ "type": "object", "description": description, "oneOf": branches }),
    );
    definitions.extend(MODELS.iter().map(|model| (model.name.to_owned(), of_model(model))));
    definitions.insert(MEASURED.into(), measured());
    definitions.insert(GLTF.into(), of_several(GLTF, "glTF", ".gltf or .glb"));
    definitions.insert(MATERIALX.into(), of_several(MATERIALX, "MaterialX", ".mtlx"));
    definitions.insert(LAYERS.into(), layers());
    definitions.insert(PRESET.into(), preset());
    json!({
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "A material of Specula",
        "$ref": "#/$defs/material",
        "$defs": definitions,
    })
}

fn of_model(model: &ModelText) -> Value {
    let (mut properties, mut required) = of_parameters(model.parameters);
    properties.insert("model".into(), json!({ "const": model.name, "description": model.summary }));
    required.insert(0, "model");
    let mut schema = object(model.summary, properties, &required);
    // A model has at most one such parameter.
    for parameter in model.parameters {
        if let Absent::RequiredUnless(others) = parameter.absent {
            schema["anyOf"] = json!([{ "required": [parameter.name] }, { "required": others }]);
        }
    }
    schema
}

/// The properties of a table of parameters, and the names of the required ones.
fn of_parameters(parameters: &[Parameter]) -> (Map<String, Value>, Vec<&'static str>) {
    let properties = parameters.iter().map(|parameter| (parameter.name.to_owned(), of_parameter(parameter)));
    let required = parameters.iter().filter(|parameter| parameter.absent == Absent::Required);
    (properties.collect(), required.map(|parameter| parameter.name).collect())
}

fn of_parameter(parameter: &Parameter) -> Value {
    let mut schema = match parameter.value_type {
        ValueType::Number(range) => number(&range),
        ValueType::Colour(range) => colour(&range),
        ValueType::Records(inner) => {
            let (properties, required) = of_parameters(inner);
            json!({ "type": "array", "items": object(parameter.meaning, properties, &required) })
        }
    };
    let looks_like = match parameter.value_type {
        ValueType::Number(range) => format!(": {}", range.words),
        ValueType::Colour(range) => format!(": a colour, each {}", range.words),
        ValueType::Records(_) => String::new(),
    };
    schema["description"] = format!("{}{looks_like}.", capital(parameter.meaning)).into();
    if let Absent::Default(value) = parameter.absent {
        schema["default"] = value.into();
    }
    schema
}

fn number(range: &Range) -> Value {
    json!({ "type": "number", "minimum": range.least, "maximum": range.most })
}

/// Red, green and blue, or one number for a grey.
fn colour(range: &Range) -> Value {
    json!({
        "type": ["array", "number"],
        "items": number(range),
        "minItems": 3,
        "maxItems": 3,
        "minimum": range.least,
        "maximum": range.most,
    })
}

fn measured() -> Value {
    let summary = "a measured BRDF";
    let names = MeasuredFormat::ALL.map(MeasuredFormat::name);
    let mut scale = colour(&brdf::WEIGHT);
    scale["description"] = "The factor for the table: a colour.".into();
    scale["default"] = 1.into();
    let file = format!(
        "The measured file, from this file's folder: {}. With a sample the folder of CURET's files.",
        endings()
    );
    let sample = "The number of a sample of the CURET database.";
    let format = "The format of the file. Default: by the file's extension.";
    let properties = [
        ("model", json!({ "const": MEASURED, "description": summary })),
        ("file", json!({ "type": "string", "description": file })),
        ("format", json!({ "type": "string", "enum": names, "description": format })),
        ("sample", json!({ "type": "integer", "minimum": 1, "description": sample })),
        ("scale", scale),
    ];
    let properties = properties.map(|(name, schema)| (name.to_owned(), schema));
    object(summary, properties.into_iter().collect(), &["model", "file"])
}

/// A material of a file that may hold several.
fn of_several(model: &str, format: &str, endings: &str) -> Value {
    let summary = format!("a material of a {format} file");
    let mut material = ChosenMaterial::schema();
    material["description"] =
        "The name of the material, or its number from 0 on. Optional if the file has only one.".into();
    let file = format!("The {endings} file, from this file's folder.");
    let properties = [
        ("model", json!({ "const": model, "description": summary })),
        ("file", json!({ "type": "string", "description": file })),
        ("material", material),
    ];
    let properties = properties.map(|(name, schema)| (name.to_owned(), schema));
    object(&summary, properties.into_iter().collect(), &["model", "file"])
}

/// The name of the definition of a file that names a preset.
const PRESET: &str = "preset";

/// A preset, with any parameters of `standard`, which is the model of all presets.
fn preset() -> Value {
    let summary = "a preset, and parameters that differ from it";
    let standard = MODELS.iter().find(|model| model.name == "standard");
    let (mut properties, _) = standard.map(|model| of_parameters(model.parameters)).unwrap_or_default();
    let names = PRESETS.iter().map(|preset| preset.name).collect::<Vec<_>>();
    let words = PRESETS.iter().map(|preset| format!("{}: {}", preset.name, preset.summary()));
    let description = format!("The name of a preset.\n\n{}.", words.collect::<Vec<_>>().join(".\n"));
    properties.insert(presets::KEY.into(), json!({ "enum": names, "description": description }));
    // A preset has other values than the model.
    properties.values_mut().filter_map(Value::as_object_mut).for_each(|schema| _ = schema.remove("default"));
    object(summary, properties, &[presets::KEY])
}

fn layers() -> Value {
    let summary = "the sum of several materials";
    let each = json!({
        "type": "array",
        "items": { "$ref": "#/$defs/material" },
        "minItems": 1,
        "description": "The materials to sum, each a table with its `model`.",
    });
    let model = json!({ "const": LAYERS, "description": "Optional." });
    let properties = [("model".to_owned(), model), (LAYERS.to_owned(), each)];
    object(summary, properties.into_iter().collect(), &[LAYERS])
}

fn object(summary: &str, properties: Map<String, Value>, required: &[&str]) -> Value {
    json!({
        "type": "object",
        "description": format!("{}.", capital(summary)),
        "properties": properties,
        "required": required,
        "additionalProperties": false,
    })
}

/// A text with a capital first letter.
pub(crate) fn capital(text: &str) -> String {
    let mut characters = text.chars();
    characters.next().map_or(String::new(), |first| first.to_uppercase().chain(characters).collect())
}
