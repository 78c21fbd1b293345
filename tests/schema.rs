//! The JSON Schemas that `specula schema` prints agree with what the program reads and writes.

use std::fs;

use crate::support::{Project, SMALL, files_below, root};
use engine::{ErasedKind, Field, Table};
use jsonschema::Validator;
use serde_json::{Value, json};

/// Editors know different drafts of JSON Schema, so a schema must mean the same in both.
struct Schema([Validator; 2]);

impl Schema {
    fn new(schema: &Value) -> Self {
        assert!(jsonschema::meta::is_valid(schema), "a schema of draft 2020-12");
        let mut older = schema.clone();
        older["$schema"] = "http://json-schema.org/draft-07/schema#".into();
        Self([jsonschema::draft202012::new(schema).unwrap(), jsonschema::draft7::new(&older).unwrap()])
    }

    /// What is wrong; nothing if the value is valid.
    fn errors(&self, value: &Value) -> Vec<String> {
        let [new, old] = &self.0;
        assert_eq!(new.is_valid(value), old.is_valid(value), "the drafts differ about {value:#}");
        new.iter_errors(value).map(|error| format!("{}: {error}", error.instance_path())).collect()
    }

    fn accepts(&self, value: &Value) -> bool {
        self.errors(value).is_empty()
    }

    fn check(&self, name: &str, toml: &str) {
        let errors = self.errors(&parsed(toml));
        assert!(errors.is_empty(), "{name}: {errors:#?}");
    }
}

fn parsed(toml: &str) -> Value {
    toml::from_str(toml).unwrap_or_else(|error| panic!("{error} in\n{toml}"))
}

fn pipeline() -> Schema {
    Schema::new(&cli::kinds().schema())
}

/// The stages of the example in a kind's manual.
fn example(kind: &dyn ErasedKind) -> Value {
    let manual = kind.manual();
    let examples = manual.split("```toml\n").skip(1).filter_map(|rest| rest.split("```").next());
    let mut stages = json!({});
    for example in examples.filter(|text| text.contains("[stage.")) {
        stages.as_object_mut().unwrap().extend(parsed(example)["stage"].as_object().unwrap().clone());
    }
    stages
}

#[test]
fn every_manifest_of_the_project_is_valid() {
    let schema = pipeline();
    let readme = fs::read_to_string(root().join("README.md")).unwrap();
    let manual = fs::read_to_string(root().join("docs/manifest.md")).unwrap();
    let first = |text: &str| text.split("```toml\n").nth(1).unwrap().split("```").next().unwrap().to_owned();
    schema.check("pipeline.toml", &fs::read_to_string(root().join("pipeline.toml")).unwrap());
    let examples = readme.split("```toml\n").skip(1).map(|text| text.split("```").next().unwrap());
    schema.check("README.md", &examples.collect::<String>());
    schema.check("docs/manifest.md", &first(&manual));
    schema.check("the tests' manifest", SMALL);
    for kind in cli::kinds().iter() {
        let stages = example(kind.as_ref());
        let own = |stage: &Value| stage["kind"] == kind.name();
        assert!(stages.as_object().unwrap().values().any(own), "{} has an example", kind.name());
        let errors = schema.errors(&json!({ "schema": 1, "stage": stages }));
        assert!(errors.is_empty(), "the example of {}: {errors:#?}", kind.name());
    }
}

#[test]
fn mistakes_in_a_manifest_are_refused_by_the_schema_as_by_the_program() {
    let schema = pipeline();
    let mistakes = [
        ("degree = 8\n", "degre = 8\n"),
        ("degree = 8\n", "degree = \"eight\"\n"),
        ("degree = 8\n", "degree = 4000\n"),
        ("degree = [8, 0]", "degree = [8]"),
        ("degree = [8, 0]", "degree = [8, true]"),
        ("layout = \"cube\"", "layout = \"cub\""),
        ("kind = \"convolve\"", "kind = \"convole\""),
        ("kind = \"convolve\"", "sort = \"convolve\""),
        ("lighting = \"lighting\", brdf", "light = \"lighting\", brdf"),
        ("lighting = \"lighting\", brdf", "brdf"),
        ("inputs = { lighting = \"lighting\", brdf = \"coefficients\" }", "input = \"lighting\""),
        ("input = \"material\"", "input = \"material\"\ninputs = { material = \"material\" }"),
        ("input = \"material\"", "# no input"),
        ("input = \"material\"", "input = [\"material\"]"),
        ("source = \"assets/materials/*.toml\"", "# no source"),
        ("source = \"assets/materials/*.toml\"", "source = 1"),
        ("degree = 8\n", "degree = 8\nsource = \"a\"\n"),
        ("degree = 8\n", "degree = 8\nper = [\"environment\"]\n"),
        ("degree = 8\n", "degree = 8\npath = \"a\"\n"),
        ("schema = 1", "schema = 2"),
        ("schema = 1", "# none"),
        ("out = \"out\"", "out = 1"),
        ("out = \"out\"", "output = \"out\""),
        ("[stage.sh]", "[stage.\"s h\"]"),
        ("[stage.sh]", "[stages.sh]"),
    ];
    let project = Project::small();
    let load = || engine::Plan::load(&project.path("pipeline.toml"), &cli::kinds());
    assert!(load().is_ok());
    for (right, wrong) in mistakes {
        assert!(SMALL.contains(right), "{right}");
        let text = SMALL.replacen(right, wrong, 1);
        project.write("pipeline.toml", &text);
        assert!(load().is_err(), "the program accepts {wrong}");
        assert!(!schema.accepts(&parsed(&text)), "the schema accepts {wrong}");
    }
}

/// Whether the program accepts the form of a value, without regard to other parameters.
fn parser_accepts(kind: &dyn ErasedKind, required: &[(String, String)], field: &Field, value: &str) -> bool {
    let given = required.iter().filter(|(name, _)| *name != field.name);
    let mut text: String = given.map(|(name, value)| format!("{name} = {value}\n")).collect();
    text += &format!("{} = {value}\n", field.name);
    let found = kind.configure(&Table::parse(&text).unwrap());
    // Errors of form say what was expected; errors of several parameters together do not.
    found.err().is_none_or(|found| found.iter().all(|diagnostic| diagnostic.expected.is_none()))
}

/// For every parameter of every kind, the parser and the schema accept the same values of every type.
#[test]
fn the_parser_and_the_schema_agree_on_every_parameter() {
    let (mut accepted, mut refused) = (0, 0);
    let schema = pipeline();
    for kind in cli::kinds().iter() {
        let stages = example(kind.as_ref());
        let own = stages.as_object().unwrap().values().find(|stage| stage["kind"] == kind.name()).unwrap();
        let fields = kind.fields();
        let given = fields.iter().filter(|field| field.default.is_none());
        let required: Vec<_> =
            given.map(|field| (field.name.clone(), written(&own[field.name.as_str()]))).collect();
        for field in &fields {
            let default = field.default.as_ref().filter(|default| !default.is_null()).map(written);
            let samples =
                ["true", "7", "-7", "0.5", "\"zzz\"", "[]", "[7]", "[7, 7]", "[0.5, 7, 7]", "[\"a\"]", "{}"];
            let samples = samples.map(str::to_owned).into_iter().chain(default.clone());
            let mut counts = (0, 0);
            for sample in samples {
                let parser = parser_accepts(kind.as_ref(), &required, field, &sample);
                let mut stage = own.clone();
                stage[&field.name] = parsed(&format!("v = {sample}"))["v"].clone();
                let errors = schema.errors(&json!({ "schema": 1, "stage": { "it": stage } }));
                let what = format!("{}: {} = {sample}", kind.name(), field.name);
                assert_eq!(parser, errors.is_empty(), "{what}: the parser and the schema differ: {errors:?}");
                assert!(parser || default.as_ref() != Some(&sample), "{what}: the default is refused");
                if parser { counts.0 += 1 } else { counts.1 += 1 }
            }
            // A word is only accepted if it is the default.
            assert!(counts.1 > 0, "{}: {} accepts everything", kind.name(), field.name);
            accepted += counts.0;
            refused += counts.1;
        }
    }
    assert!(accepted > 50 && refused > 300, "{accepted} values accepted, {refused} refused");
}

/// A JSON value as TOML.
fn written(value: &Value) -> String {
    match value {
        Value::Object(object) => {
            let pairs = object.iter().map(|(key, value)| format!("{key:?} = {}", written(value)));
            format!("{{ {} }}", pairs.collect::<Vec<_>>().join(", "))
        }
        Value::Array(values) => format!("[{}]", values.iter().map(written).collect::<Vec<_>>().join(", ")),
        plain => plain.to_string(),
    }
}

#[test]
fn every_parameter_of_every_kind_has_a_description() {
    let schema = cli::kinds().schema();
    for kind in cli::kinds().iter() {
        let definition = &schema["$defs"][kind.name()];
        assert_eq!(definition["properties"]["kind"]["const"], kind.name());
        for field in kind.fields() {
            let property = &definition["properties"][&field.name];
            let description = property["description"].as_str().unwrap();
            assert!(description.starts_with(&field.doc) && !field.doc.is_empty(), "{property:#}");
            let typed = property["type"] != Value::Null || property["oneOf"].is_array();
            assert!(typed, "{}: {property:#} accepts every type", kind.name());
            assert_eq!(property["default"], field.default.unwrap_or_default());
        }
    }
}

#[test]
fn material_files_are_valid_and_mistakes_in_them_are_not() {
    let schema = Schema::new(&stages::material_schema());
    let mut files = 0;
    for (name, bytes) in files_below(&root().join("assets")) {
        if name.ends_with(".toml") && !name.starts_with("lights/") {
            schema.check(&name, std::str::from_utf8(&bytes).unwrap());
            files += 1;
        }
    }
    assert!(files >= 8, "{files} material files");
    let kinds = cli::kinds();
    let manual = kinds.get("import-material").unwrap().manual();
    let examples = manual.split("```toml\n").skip(1).filter_map(|rest| rest.split("```").next());
    for example in examples.filter(|text| !text.contains("[stage.")) {
        schema.check("the manual of import-material", example);
    }
    let valid = [
        "model = \"measured\"\nfile = \"a.binary\"\nscale = [1, 0.5, 0.5]",
        "model = \"layers\"\nlayers = [{ layers = [{ model = \"lambert\", albedo = 1 }] }]",
        "model = \"lafortune\"\nlobes = [{ cx = -1, cz = 1, n = 4 }]",
        "model = \"ggx\"\nroughness_x = 0.2\nroughness_y = 0.6\nior = 1.5",
        "material = \"copper\"",
        "material = \"red-paint\"\nroughness = 0.4\nclearcoat = 1",
        "layers = [{ material = \"copper\" }, { model = \"lambert\", albedo = 0.1 }]",
    ];
    let mistakes = [
        "",
        "model = \"fong\"\nexponent = 3",
        "model = \"phong\"",
        "model = \"ggx\"\nroughness_x = 0.2\nior = 1.5",
        "model = \"phong\"\nexponent = \"3\"",
        "model = \"phong\"\nexponent = -3",
        "model = \"phong\"\nexponent = 3\nsharpness = 2",
        "model = \"phong\"\nexponent = 3\nspecular = [1, 1]",
        "model = \"phong\"\nexponent = 3\nspecular = [1, 1, \"1\"]",
        "model = \"lafortune\"\nlobes = [{ cx = -1, cz = 1 }]",
        "model = \"lafortune\"\nlobes = { cx = -1, cz = 1, n = 4 }",
        "model = \"measured\"",
        "material = \"coper\"",
        "material = \"copper\"\nexponent = 3",
        "material = \"copper\"\nlayers = []",
        "model = \"measured\"\nfile = \"a.binary\"\nformat = \"mer\"",
        "layers = []",
        "layers = [{ model = \"lambert\" }]",
        "model = \"lambert\"\nalbedo = 1\nlayers = [{ model = \"lambert\", albedo = 1 }]",
    ];
    let read = |text: &str| {
        let none = |_: &std::path::Path| Err(engine::Failure::new("no file is read here"));
        stages::read_material("a.toml", text.as_bytes(), None, &none)
    };
    for text in valid {
        schema.check("a material", text);
        assert!(text.contains("measured") || read(text).is_ok(), "{text}");
    }
    for text in mistakes {
        assert!(!schema.accepts(&parsed(text)), "the schema accepts\n{text}");
        assert!(read(text).is_err(), "the program accepts\n{text}");
    }
}

#[test]
fn the_schemas_are_printed_and_a_new_project_names_them() {
    let project = Project::new("");
    let printed =
        |arguments: &[&str]| -> Value { serde_json::from_str(&project.ok(arguments).stdout).unwrap() };
    assert_eq!(printed(&["schema"]), cli::kinds().schema());
    assert_eq!(printed(&["schema", "pipeline"]), cli::kinds().schema());
    assert_eq!(printed(&["schema", "material"]), stages::material_schema());
    assert_eq!(printed(&["schema", "events"]), engine::EventLine::schema());
    assert_eq!(project.specula(&["schema", "piepline"]).code, Some(2));

    project.ok(&["init", "made"]);
    let mut named = 0;
    for (name, bytes) in files_below(&project.path("made")) {
        let Some(folder) = name.ends_with(".toml").then(|| project.path("made").join(&name)) else {
            continue;
        };
        let text = String::from_utf8(bytes).unwrap();
        let schema = text.lines().next().unwrap().strip_prefix("#:schema ").unwrap();
        let schema = fs::read_to_string(folder.parent().unwrap().join(schema)).unwrap();
        Schema::new(&serde_json::from_str(&schema).unwrap()).check(&name, &text);
        named += 1;
    }
    assert_eq!(named, 3);
}

#[test]
fn exported_probes_are_what_their_schema_says() {
    let project = Project::assets_alone();
    let schema = Schema::new(&serde_json::from_str(&project.ok(&["schema", "probes"]).stdout).unwrap());
    project.ok(&["test-pattern", "--probes", "--preset", "ktx2", "out"]);
    let text = fs::read_to_string(project.path("out/probes.json")).unwrap();
    let mut probes: Value = serde_json::from_str(&text).unwrap();
    assert_eq!(schema.errors(&probes), Vec::<String>::new());
    assert!(project.path("out/volume-0.ktx2").exists() && !project.path("out/volume-1.ktx2").exists());
    probes["volumes"][0]["lattice"] = "hexagons".into();
    assert!(!schema.accepts(&probes));
}
