//! A manifest with many errors: all are reported at once, each with its place.

use crate::support::Project;

#[test]
fn all_errors_are_reported_at_once_with_place_expectation_and_nearest_spelling() {
    let project = Project::new(
        r#"
schema = 1
outt = "out"

[stage.environment]
kind = "import-enviroment"
source = "assets/environments/*.exr"

[stage.material]
kind = "import-material"
source = "assets/nowhere/*.toml"

[stage.lighting]
kind = "project-sh"
input = "material"
degre = 4
tolerance = "small"

[stage.map]
kind = "export-reflection-map"
input = "reflexion"
path = "../elsewhere"
"#,
    );
    let run = project.specula(&["build"]).ends(3, []);
    for word in [
        "outt",
        "import-environment",
        "nowhere",
        "degre",
        "degree",
        "tolerance",
        "reflexion",
        "elsewhere",
        "pipeline.toml",
    ] {
        assert!(run.stderr.contains(word), "no {word:?} in:\n{}", run.stderr);
    }
    assert!(run.stderr.contains("nothing ran"), "{}", run.stderr);
    assert!(!project.path("out").exists() && !project.path(".specula").exists());
}

#[test]
fn a_key_that_was_renamed_is_an_error_that_names_the_new_one() {
    let manifest = "
schema = 1

[stage.lamps]
kind = \"circular-lights\"
source = \"assets/lights/*.toml\"
lights = \"series\"
";
    let run = Project::new(manifest).specula(&["build"]).ends(3, []);
    for text in ["pipeline.toml:7:1", "unknown key \"lights\"", "it is now called \"lamps\""] {
        assert!(run.stderr.contains(text), "no {text:?} in:\n{}", run.stderr);
    }
}

#[test]
fn a_missing_manifest_is_an_error_with_a_hint() {
    let project = Project::new("");
    let run = project
        .specula(&["build", "--manifest", "nowhere.toml"])
        .ends(3, ["nowhere.toml", "contains pipeline.toml"]);
    assert!(!run.stderr.contains("init"), "init would not write over it: {}", run.stderr);
    std::fs::remove_file(project.path("pipeline.toml")).unwrap();
    project.specula(&["build"]).ends(3, ["hint: `specula init` writes"]);
}

#[test]
fn an_empty_manifest_is_an_error_that_names_the_first_line() {
    Project::new("").specula(&["build"]).ends(3, ["expected schema = 1"]);
}

#[test]
fn an_unknown_stage_is_a_usage_error_with_the_nearest_name() {
    let project = Project::small();
    project.specula(&["build", "lightning"]).ends(2, ["\"lighting\""]);
}

#[test]
fn of_thousands_of_errors_the_first_are_drawn_and_the_others_counted() {
    let stages = (0..5000).map(|n| format!("[stage.s{n}]\nkind = \"project-hs\"\ninput = \"t{n}\"\n"));
    let project = Project::new(&format!("schema = 1\n{}", stages.collect::<String>()));
    let run = project.specula(&["check"]).ends(3, []);
    assert!(run.stderr.ends_with("\n... and 9950 more errors\npipeline.toml: 10000 errors; nothing ran.\n"));
    assert_eq!(run.stderr.matches("pipeline.toml:").count(), 51, "50 places and the count:\n{}", run.stderr);
    assert_eq!(run.stderr.matches("did you mean \"project-sh\"?").count(), 25, "in order of their place");
    assert!(run.stderr.len() < 40_000, "{} bytes", run.stderr.len());
}
