//! Pages that show what a report measured.

use std::fs;
use std::sync::LazyLock;

use engine::{
    Artifact, BuildOptions, Cancel, Context, Digest, ExportedFiles, Failure, Kind, Kinds, Output, Plan, Port,
    Product, build, parameters,
};
use serde_json::{Value, json};
use stages::artifacts::{Environment, Material, Reflection};

use crate::export_page::{page, read};
use crate::fixture::{Case, case, environment, exr, kinds, phong, reflection, sky};
use crate::report::SMALL;

/// Pages that measure nothing.
const QUICK: &str = "resolution = 8\nslices = 4\nmeasure = false";

/// The JSON of a report on the pair of [`page`], with a recipe as the engine makes it.
static REPORT: LazyLock<Value> = LazyLock::new(|| {
    let pair = [("environment", "day"), ("material", "copper")];
    let made = case("report", SMALL)
        .keyed_input("environment", &pair[..1], environment(64, sky))
        .keyed_input("material", &pair[1..], Material(phong(20.0)))
        .keyed_input("reflection", &pair, reflection(phong(20.0), 4));
    let mut report: Value = serde_json::from_slice(&made.files()[0]).unwrap();
    let digest = |type_name: &str| json!([Digest::of(type_name.as_bytes()).to_string()]);
    let types = [Environment::TYPE, Material::TYPE, Reflection::TYPE];
    report["specula"]["inputs"] = types.map(|name| (name.to_owned(), digest(name))).into_iter().collect();
    report
});

fn with_report(page: Case, report: &Value) -> Case {
    page.keyed_bytes::<ExportedFiles>("report", &[], serde_json::to_vec(report).unwrap())
}

/// The view of a form of the only pair.
fn view<'d>(data: &'d Value, form: &str) -> &'d Value {
    let is_of = |view: &&Value| data["modes"][view["mode"].as_u64().unwrap() as usize]["name"] == form;
    data["pairs"][0]["views"].as_array().unwrap().iter().find(is_of).unwrap()
}

fn export<'r>(report: &'r mut Value, method: &str) -> &'r mut Value {
    let exports = report["pairs"][0]["exports"].as_array_mut().unwrap();
    exports.iter_mut().find(|export| export["method"] == method).unwrap()
}

#[test]
fn a_page_shows_the_stops_and_sizes_that_a_report_measured() {
    let mut report = REPORT.clone();
    export(&mut report, "cabral")["file"] = json!(12_345);
    let case = with_report(page("resolution = 8\nslices = 4", "copper"), &report);
    let (text, data) = read(&case);
    for (form, method) in [
        ("taps", "taps"),
        ("local-shrm", "shrm"),
        ("cabral", "cabral"),
        ("kautz-mccool", "kautz-mccool"),
        ("prefiltered", "reflection-map"),
    ] {
        let (view, export) = (view(&data, form), export(&mut report, method));
        assert_eq!(
            [&view["error"]["p95"], &view["error"]["p99"]],
            [&export["p95"], &export["p99"]],
            "{form}"
        );
        assert_eq!(view["error"]["by"], "report");
        let said = format!("the report measured {}", export["texture"].as_str().unwrap());
        assert!(view["note"].as_str().unwrap().ends_with(&said), "{form}: {}", view["note"]);
    }
    assert_eq!(
        (&view(&data, "cabral")["bytes"], &view(&data, "taps")["bytes"]),
        (&json!(12_345), &Value::Null)
    );
    // No report measures a table of the page.
    assert_eq!(view(&data, "table")["error"]["by"], "page");
    assert!(view(&data, "mirror")["error"].is_null());
    assert_eq!(text.matches("<img").count(), 1);
    let ran = case.run().unwrap();
    assert!(ran.warnings.is_empty(), "{:?}", ran.warnings);
    let said = "the stops of 5 forms are those of the report, and 1 were measured here";
    assert!(ran.notes.iter().any(|note| note == said), "{:?}", ran.notes);

    // They cost no measurement.
    let (text, data) = read(&with_report(page(QUICK, "copper"), &report));
    assert_eq!(view(&data, "taps")["error"]["by"], "report");
    assert!(view(&data, "table")["error"].is_null() && !text.contains("<img"));
}

#[test]
fn a_report_on_something_else_is_not_quoted() {
    let is_not_quoted = |name: &str, report: &Value| {
        let case = with_report(page(QUICK, name), report);
        let (_, data) = read(&case);
        assert!(view(&data, "taps")["error"].is_null() && view(&data, "taps")["note"] == "2 taps here");
        let warnings = case.run().unwrap().warnings;
        assert_eq!(warnings, ["the report is of other environments, materials or exports than the page"]);
    };
    is_not_quoted("brass", &REPORT);
    // Light of the same name that was turned, and another material.
    for port in ["environment", "material", "reflection"] {
        let mut other = REPORT.clone();
        other["specula"]["inputs"][port] = json!(["00"]);
        is_not_quoted("copper", &other);
    }
    // A report on light probes has no pairs.
    let mut empty = REPORT.clone();
    empty["pairs"] = json!([]);
    is_not_quoted("copper", &empty);
}

/// The page and the report each have the export of a map: the same one, or two of the same size.
#[test]
fn figures_of_another_export_are_not_quoted() {
    let own = json!([Digest::of(ExportedFiles::TYPE.as_bytes()).to_string()]);
    for (used, is_quoted) in [(own, true), (json!(["00"]), false), (json!([]), false)] {
        let mut report = REPORT.clone();
        export(&mut report, "cabral")["file"] = json!(700);
        report["specula"]["inputs"]["cabral"] = used;
        let files =
            ExportedFiles { kind: "export-cabral".into(), bytes: vec![300, 400], ..Default::default() };
        let (_, data) = read(&with_report(page(QUICK, "copper").input("cabral", files), &report));
        let cabral = view(&data, "cabral");
        assert_eq!((cabral["error"].is_object(), &cabral["bytes"]), (is_quoted, &json!(700)));
    }
}

#[test]
fn lamps_in_a_map_and_beside_it_are_different_forms() {
    let mut report = REPORT.clone();
    let beside =
        json!({ "method": "shrm-separate", "p95": 0.5, "p99": 0.75, "texture": "4 coefficients, 1 light" });
    report["pairs"][0]["exports"].as_array_mut().unwrap().push(beside);
    let case = |report| with_report(page(QUICK, "copper"), report);
    let (_, data) = read(&case(&report));
    assert_eq!(view(&data, "local-shrm")["error"]["p95"], 0.5);
}

#[test]
fn files_that_are_not_of_a_report_are_errors() {
    let failure = |report: &Value| with_report(page(QUICK, "copper"), report).failure();
    let mut old = REPORT.clone();
    old["schema"] = json!(3);
    old.as_object_mut().unwrap().remove("pairs");
    assert_eq!(failure(&old), "the port report: the report has version 3 of its JSON, not 4");
    let foreign = "the port report: the file is not that of a report";
    assert_eq!(failure(&json!({ "schema": 4, "specula": { "kind": "export-sh" } })), foreign);
    assert_eq!(failure(&json!([1, 2])), foreign);
    let mut broken = REPORT.clone();
    broken["pairs"][0]["exports"][0]["p95"] = json!("small");
    assert!(
        failure(&broken).starts_with("the port report: the report's JSON: invalid type"),
        "{}",
        failure(&broken)
    );
}

parameters! {
    /// Parameters of [`Quoted`].
    struct NoParameters {}
}

/// A report whose figures are those of a file.
struct Quoted;

impl Kind for Quoted {
    type Parameters = NoParameters;
    const NAME: &'static str = "report";
    const REVISION: u32 = 1;
    const TEXT: &'static str = "//! Quotes a file.";
    const SOURCE: bool = true;

    fn ports() -> Vec<Port> {
        vec![Port::many::<Environment>("environment")]
    }

    fn product(_: &NoParameters, _: &[(&str, &'static str)]) -> Product {
        Product::Files(vec![".json".into(), ".html".into()])
    }

    fn run(_: &NoParameters, context: &Context<'_>) -> Result<Output, Failure> {
        let mut report: Value = serde_json::from_slice(&context.files.read(context.files.source()?)?)?;
        report["specula"] = serde_json::from_str(context.recipe())?;
        Ok(Output::files(vec![serde_json::to_vec(&report)?, b"page".to_vec()]))
    }
}

#[test]
fn a_number_that_changes_in_a_report_of_the_same_size_changes_the_page() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, bytes: &[u8]| fs::write(folder.path().join(name), bytes).unwrap();
    let figures = |p95: f64| {
        let export = json!({ "method": "shrm", "p95": p95, "p99": 0.75, "texture": "a cube" });
        let pair = json!({ "environment": "day", "material": "clay", "exports": [export] });
        json!({ "schema": 4, "pairs": [pair] }).to_string()
    };
    let manifest = r#"
schema = 1
[stage]
environment = { kind = "import-environment", source = "day.exr" }
material = { kind = "import-material", source = "clay.toml" }
lighting = { kind = "project-sh", input = "environment", degree = 4 }
coefficients = { kind = "project-brdf", input = "material", degree = [2, 0] }
reflection = { kind = "convolve", inputs = { lighting = "lighting", brdf = "coefficients" } }
figures = { kind = "report", source = "figures.json", inputs = { environment = "environment" } }

[stage.page]
kind = "export-page"
inputs = { environment = "environment", reflection = "reflection", report = "figures" }
resolution = 8
path = "page"
"#;
    write("pipeline.toml", manifest.as_bytes());
    write("day.exr", &exr(32, 16, vec![[1.0, 0.5, 0.25]; 512]));
    write("clay.toml", b"model = \"lambert\"\nalbedo = 0.5\n");
    let others = kinds().iter().filter(|kind| kind.name() != "report").cloned().collect::<Vec<_>>();
    let kinds = others.into_iter().fold(Kinds::new(), Kinds::with_erased).with(Quoted);
    let built = |p95: f64| {
        write("figures.json", figures(p95).as_bytes());
        let plan = Plan::load(&folder.path().join("pipeline.toml"), &kinds).unwrap_or_else(|e| panic!("{e}"));
        let summary = build(&plan, &BuildOptions::default(), &Cancel::default(), &|event| {
            if let engine::Event::Failed { error, .. } = event {
                panic!("{error:?}");
            }
        });
        let page = fs::read_to_string(folder.path().join("out/page.html")).unwrap();
        (
            summary.unwrap().ran,
            fs::metadata(folder.path().join("out/figures/figures.json")).unwrap().len(),
            page,
        )
    };
    let (_, size, before) = built(0.25);
    assert!(before.contains(r#""error":{"p95":0.25,"p99":0.75,"by":"report"}"#));
    let (ran, same_size, after) = built(0.26);
    assert_eq!((ran, same_size), (2, size));
    assert!(after.contains(r#""error":{"p95":0.26,"p99":0.75,"by":"report"}"#));
    assert_eq!(built(0.26).0, 0);
}
