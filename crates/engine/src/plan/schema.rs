//! The JSON Schema of a manifest, made from the kinds, for completion, descriptions and errors in editors.
//!
//! It describes what can be checked in one table; only the parser checks what needs the graph or the disk
//! (names of stages, types of connections, ranges that depend on another parameter). It is never stricter
//! than the parser.
//!
//! Its keywords mean the same in draft 7 and draft 2020-12, because editors support different drafts. A stage
//! is a `oneOf` over the kinds, distinguished by `kind`: Tombi completes the branch that fits, Taplo (Even
//! Better TOML) offers the keys of all branches; neither completes through `if` and `then`.

use serde_json::{Map, Value, json};

use super::manifest::SCHEMA;
use crate::kinds::{ErasedKind, Kinds, Port, Product};
use crate::manifest::{Field, Table};

impl Kinds {
    /// The JSON Schema (draft 2020-12) of manifests that name these kinds.
    pub fn schema(&self) -> Value {
        let branches = self.iter().map(|kind| json!({ "$ref": format!("#/$defs/{}", kind.name()) }));
        let stage = json!({
            "type": "object",
            "description": "A stage: a step of the pipeline. Its `kind` says what it does.",
            "oneOf": branches.collect::<Vec<_>>(),
        });
        let kinds = self.iter().map(|kind| (kind.name().to_owned(), of_kind(kind.as_ref())));
        let definitions = [("stage".to_owned(), stage)].into_iter().chain(kinds).collect::<Map<_, _>>();
        json!({
            "$schema": "https://json-schema.org/draft/2020-12/schema",
            "title": "A pipeline of Specula",
            "type": "object",
            "properties": {
                "schema": { "const": SCHEMA, "description": "The version of the format: 1." },
                "out": {
                    "type": "string",
                    "default": "out",
                    "description": "The folder for exported files, relative to the manifest and below its \
                                    folder.",
                },
                "stage": {
                    "type": "object",
                    "description": "The stages, each `[stage.NAME]` with a name of your choice.",
                    "minProperties": 1,
                    "patternProperties": { "^[A-Za-z0-9_-]+$": { "$ref": "#/$defs/stage" } },
                    "additionalProperties": false,
                },
            },
            "required": ["schema", "stage"],
            "additionalProperties": false,
            "$defs": definitions,
        })
    }
}

/// The schema of a parameter, with its manual text and its default.
fn of_field(field: &Field) -> Value {
    let mut schema = match &field.schema {
        Value::Object(schema) => schema.clone(),
        _ => Map::new(),
    };
    let mut description = field.doc.clone();
    if let Some(Value::String(more)) = schema.get("description") {
        description += &format!("\n\n{more}");
    }
    schema.insert("description".into(), description.into());
    if let Some(default) = field.default.as_ref().filter(|default| !default.is_null()) {
        schema.insert("default".into(), default.clone());
    }
    schema.into()
}

fn of_kind(kind: &dyn ErasedKind) -> Value {
    let summary = kind.summary();
    let mut properties = Map::new();
    let mut required = vec!["kind".to_owned()];
    properties.insert("kind".into(), json!({ "const": kind.name(), "description": summary }));
    if kind.has_source() {
        let description = "The files to read, relative to the manifest: one path, a glob (`*`, `**/`, \
                           `{a,b}`) with an item for each file, or a list of them; `!` excludes an entry.";
        let text = json!({ "type": "string", "minLength": 1 });
        let several = json!({ "type": "array", "items": text, "minItems": 1 });
        properties.insert("source".into(), json!({ "anyOf": [text, several], "description": description }));
        if kind.built_in_parameter().is_none() {
            required.push("source".into());
        }
    }
    let connections = connections(kind, &mut properties, &mut required);
    if kind.ports().iter().any(|port| port.many) {
        let description = "The keys that the stage keeps: it has one item for each combination of them. Default: those of \
                           its ports that take one item.";
        let names = json!({ "type": "array", "items": { "type": "string" }, "description": description });
        properties.insert("per".into(), names);
    }
    if exports(kind) {
        let description = "The path of the files in `out`, without the extension. `{NAME}` stands for the \
                           item's file of the source stage NAME. Default: the stage's name and the keys.";
        properties.insert("path".into(), json!({ "type": "string", "description": description }));
    }
    for field in kind.fields() {
        properties.insert(field.name.clone(), of_field(&field));
        if field.default.is_none() {
            required.push(field.name);
        }
    }
    let mut schema = json!({
        "type": "object",
        "description": summary,
        "properties": properties,
        "required": required,
        "additionalProperties": false,
    });
    if let (Value::Object(schema), Some((keyword, rule))) = (&mut schema, connections) {
        schema.insert(keyword.into(), rule);
    }
    // A kind with a source has no ports, and so no rule for connections.
    if let Some(name) = kind.built_in_parameter() {
        schema["anyOf"] = json!([{ "required": ["source"] }, { "required": [name] }]);
    }
    schema
}

/// Adds `input` and `inputs`, and returns the rule for the two of them.
fn connections(
    kind: &dyn ErasedKind,
    properties: &mut Map<String, Value>,
    required: &mut Vec<String>,
) -> Option<(&'static str, Value)> {
    let ports = kind.ports();
    let first = ports.first()?;
    let wanted = ports.iter().filter(|port| !port.optional).map(|port| port.name.clone());
    let wanted = wanted.collect::<Vec<_>>();
    let named = ports.iter().map(|port| (port.name.clone(), of_port(port))).collect::<Map<_, _>>();
    let description = "The stages that feed the ports.";
    let mut inputs = json!({ "type": "object", "description": description, "properties": named });
    if let Value::Object(inputs) = &mut inputs {
        // A kind whose user chooses its ports accepts any name.
        let any = "any-name-at-all";
        if kind.ports_named(&[any]).iter().any(|port| port.name == any) {
            inputs.insert("additionalProperties".into(), json!({ "type": "string" }));
        } else {
            inputs.insert("required".into(), json!(wanted));
            inputs.insert("additionalProperties".into(), json!(false));
        }
    }
    properties.insert("inputs".into(), inputs);
    if wanted.iter().any(|port| *port != first.name) {
        required.push("inputs".into());
        return None;
    }
    properties.insert("input".into(), of_port(first));
    Some(match wanted.is_empty() {
        true => ("not", json!({ "required": ["input", "inputs"] })),
        false => ("oneOf", json!([{ "required": ["input"] }, { "required": ["inputs"] }])),
    })
}

fn of_port(port: &Port) -> Value {
    let takes = port.takes_text();
    let many = if port.many { ", all matching items" } else { "" };
    let optional = if port.optional { "; optional" } else { "" };
    let description = format!("The stage connected to `{}`: {takes}{many}{optional}.", port.name);
    json!({ "type": "string", "description": description })
}

/// Whether stages of this kind may export files, and so have a `path`.
fn exports(kind: &dyn ErasedKind) -> bool {
    let ports = kind.ports();
    let types = ports.iter().filter_map(|port| Some((port.name.as_str(), port.types().next()?)));
    match kind.configure(&Table::default()) {
        Ok(configured) => matches!(configured.product(&types.collect::<Vec<_>>()), Product::Files(_)),
        // Its product may depend on required parameters.
        Err(_) => true,
    }
}
