//! A manifest before and after the light of its first subject was turned.

use std::fs;
use std::path::Path;

use super::*;

const SOURCES: &str = r#"schema = 1

[stage.environment]   # items: studio
kind = "import-environment"
source = "studio.exr"

[stage.material]
kind = "import-material"
source = "gold.toml"

[stage.lighting]
kind = "project-sh"
input = "environment"   # suns and lamps stay beside the series

[stage.coefficients]
kind = "project-brdf"
input = "material"
"#;

/// The light is turned by a `rotate` stage.
const TURNED: &str = r#"
# A set that faces another way.
[stage.turned]
kind = "rotate"
yaw = 30.0     # degrees
input = "lighting"

[stage.reflection]
kind = "convolve"
inputs = { lighting = "turned", brdf = "coefficients" }
"#;

const REFLECTION: &str = r#"
[stage.reflection]
kind = "convolve"
inputs = { lighting = "lighting", brdf = "coefficients" } # both
"#;

fn catalog(text: &str) -> PreviewCatalog {
    let folder = tempfile::tempdir().unwrap();
    let manifest = folder.path().join("pipeline.toml");
    fs::write(&manifest, text).unwrap();
    let assets = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets");
    let sources =
        ["environments/sky.exr", "environments/studio.exr", "materials/gold.toml", "lights/lamps.toml"];
    for source in sources {
        let source = assets.join(source);
        fs::copy(&source, folder.path().join(source.file_name().unwrap())).unwrap();
    }
    let plan = Plan::load(&manifest, &crate::kinds()).unwrap_or_else(|errors| panic!("{errors}"));
    PreviewCatalog::of(plan)
}

/// The text of a manifest of the sample's assets.
fn manifest(stages: &str) -> String {
    format!("{SOURCES}{stages}")
}

/// The first subject of a catalog.
fn entry(catalog: &PreviewCatalog) -> &CatalogEntry {
    let (environment, material) = (&catalog.environments()[0], &catalog.materials()[0]);
    catalog.entry(environment, material).unwrap().unwrap()
}

fn turned(text: &str, degrees: [f64; 2]) -> LightEdit {
    let catalog = catalog(text);
    let [yaw, pitch] = degrees.map(f64::to_radians);
    catalog.with_turned_light(entry(&catalog), Aim { yaw, pitch }, text).unwrap()
}

/// Turns the light of a manifest, and checks that it turns as the window's does.
#[track_caller]
fn check(text: &str, degrees: [f64; 2]) -> LightEdit {
    let edit = turned(text, degrees);
    let [yaw, pitch] = degrees.map(f64::to_radians);
    let of = |text: &str| entry(&catalog(text)).turn;
    let expected = Rotation::from_yaw_pitch_roll(yaw, pitch, 0.0).after(of(text));
    let difference = (of(&edit.text).matrix() - expected.matrix()).to_cols_array();
    assert!(difference.iter().all(|value| value.abs() < 5e-4), "{}\n{difference:?}", edit.text);
    edit
}

#[test]
fn a_stage_that_turns_the_light_gets_the_sum_of_both_yaws() {
    let text = manifest(TURNED);
    let edit = check(&text, [45.0, 0.0]);
    assert_eq!(edit.text, text.replace("yaw = 30.0 ", "yaw = 75.0 "));
    assert_eq!(edit.changes, ["[stage.turned] gets yaw = 75.0 (now 30.0)"]);
    // Angles stay between -180 and 180 degrees, and a hand is not more accurate than a hundredth of one.
    assert_eq!(check(&text, [170.004, 0.0]).text, text.replace("yaw = 30.0 ", "yaw = -160.0 "));
    // Written twice, it is turned twice, and back again it is as before.
    let twice = check(&edit.text, [10.0, 0.0]).text;
    assert_eq!(twice, text.replace("yaw = 30.0 ", "yaw = 85.0 "));
    assert_eq!(check(&twice, [-55.0, 0.0]).text, text);
}

#[test]
fn pitch_and_roll_are_kept_and_a_turn_with_a_pitch_changes_what_it_must() {
    let tilted = manifest(&TURNED.replace("yaw = 30.0", "pitch = 20\nroll = 5.5\nyaw = 30"));
    assert_eq!(check(&tilted, [45.0, 0.0]).text, tilted.replace("yaw = 30 ", "yaw = 75 "));
    let edit = check(&tilted, [45.0, 10.0]);
    assert!(edit.changes[0].starts_with("[stage.turned] gets yaw = "), "{:?}", edit.changes);
    assert!(edit.changes[0].contains("(now 20.0), roll = "), "{:?}", edit.changes);
    let level = manifest(&TURNED.replace("yaw = 30.0     # degrees", "# Nothing yet."));
    let edit = check(&level, [0.0, -15.0]);
    assert_eq!(
        edit.text,
        level.replace("input = \"lighting\"\n\n[stage.r", "input = \"lighting\"\npitch = -15.0\n\n[stage.r")
    );
}

#[test]
fn a_quaternion_stays_one() {
    let text = manifest(&TURNED.replace("yaw = 30.0 ", "quaternion = [0, 0, 0, 2] "));
    let edit = check(&text, [90.0, 0.0]);
    assert!(edit.text.contains("quaternion = [0.0, 0.0, 0.707107, 0.707107]     # degrees"), "{}", edit.text);
}

#[test]
fn without_a_stage_that_turns_the_light_one_is_added_for_its_reflections() {
    let text = manifest(REFLECTION);
    let edit = check(&text, [45.0, 0.0]);
    let new = "# suns and lamps stay beside the series\n\n\
               [stage.lighting-turned]\nkind = \"rotate\"\ninput = \"lighting\"\nyaw = 45.0\n";
    let expected = text.replace("# suns and lamps stay beside the series\n", new);
    let expected =
        expected.replace("{ lighting = \"lighting\", brdf", "{ lighting = \"lighting-turned\", brdf");
    assert_eq!(edit.text, expected);
    let new = "[stage.lighting-turned] is new: it turns lighting (yaw = 45.0) for reflection";
    assert_eq!(edit.changes, [new]);
    // The next turn changes that stage.
    let again = check(&edit.text, [-5.0, 0.0]);
    assert_eq!(again.text, expected.replace("yaw = 45.0", "yaw = 40.0"));
    // And both angles are written where there are both.
    let both = check(&text, [-30.0, 12.5]);
    assert!(both.text.contains("yaw = -30.0\npitch = 12.5\n"), "{}", both.text);
}

#[test]
fn exports_of_the_light_do_not_turn_and_pictures_beside_the_reflections_do() {
    let stages = format!(
        "{REFLECTION}
[stage.probe]
kind = \"export-sh\"
input = \"lighting\"
[stage.copy]
kind = \"export-environment\"
input = \"environment\"
[stage.sheet]
kind = \"contact-sheet\"
inputs = {{ environment = \"environment\", lighting = \"lighting\", reflection = \"reflection\" }}
[stage.aside]
kind = \"rotate\"
input = \"lighting\"
yaw = 90.0
[stage.other]
kind = \"convolve\"
inputs = {{ lighting = \"aside\", brdf = \"coefficients\" }}
[stage.environment-turned]
kind = \"export-environment\"
input = \"environment\"
"
    );
    let text = manifest(&stages);
    let edit = check(&text, [45.0, 0.0]);
    assert_eq!(
        edit.changes,
        [
            "[stage.environment-turned-2] is new: it turns environment (yaw = 45.0) for sheet",
            "[stage.lighting-turned] is new: it turns lighting (yaw = 45.0) for reflection, sheet",
        ]
    );
    let sheet =
        "inputs = { environment = \"environment-turned-2\", lighting = \"lighting-turned\", reflection";
    assert!(edit.text.contains(sheet), "{}", edit.text);
    let unchanged = "[stage.probe]\nkind = \"export-sh\"\ninput = \"lighting\"\n\
                     [stage.copy]\nkind = \"export-environment\"\ninput = \"environment\"\n";
    assert!(edit.text.contains(unchanged), "{}", edit.text);
    assert!(edit.text.contains("input = \"lighting\"\nyaw = 90.0\n"), "{}", edit.text);
    let again = check(&edit.text, [10.0, 0.0]);
    assert_eq!(again.text, edit.text.replace("yaw = 45.0", "yaw = 55.0"), "both turn");
}

#[test]
fn what_else_reads_a_turned_light_is_named() {
    let text = manifest(&format!("{TURNED}\n[stage.probe]\nkind = \"export-sh\"\ninput = \"turned\"\n"));
    assert_eq!(
        check(&text, [45.0, 0.0]).changes,
        ["[stage.turned] gets yaw = 75.0 (now 30.0)", "the output of probe turns too"]
    );
    // All lights of a stage turn.
    let text = text.replace("studio.exr", "*.exr");
    assert_eq!(check(&text, [45.0, 0.0]).changes[1], "this turns the light of sky, studio");
}

/// The light passes through other stages on its way to the one that turns it.
#[test]
fn the_nearest_stage_that_turns_all_of_the_light_is_changed() {
    let before = "[stage.turned]\nkind = \"rotate\"\ninput = \"environment\"\nyaw = 30.0\n";
    let text = manifest(&format!("{before}{REFLECTION}"));
    let text = text.replace("input = \"environment\"   #", "input = \"turned\"   #");
    assert_eq!(turned(&text, [45.0, 0.0]).text, text.replace("yaw = 30.0", "yaw = 75.0"));
    // Of a sum, only the sum is all of the light.
    let sum = "[stage.lamps]\nkind = \"circular-lights\"\nsource = \"lamps.toml\"\n\
               [stage.turned]\nkind = \"rotate\"\ninput = \"lighting\"\nyaw = 30.0\n\
               [stage.sum]\nkind = \"sum-lighting\"\ninputs = { lighting = \"turned\", added = \"lamps\" }\n";
    let text = manifest(&format!("{sum}{}", REFLECTION.replace("\"lighting\", brdf", "\"sum\", brdf")));
    let edit = check(&text, [45.0, 0.0]);
    let new = "[stage.sum-turned] is new: it turns sum (yaw = 45.0) for reflection";
    assert_eq!(edit.changes, [new]);
}

#[test]
fn an_environment_that_is_turned_before_the_reflection_is_not_turned_twice_beside_it() {
    let stages = "[stage.turned]\nkind = \"rotate\"\ninput = \"environment\"\nyaw = 30.0\n\
                  [stage.further]\nkind = \"rotate\"\ninput = \"lighting\"\nyaw = 1.0\n\
                  [stage.reflection]\nkind = \"convolve\"\n\
                  inputs = { lighting = \"further\", brdf = \"coefficients\" }\n\
                  [stage.sheet]\nkind = \"contact-sheet\"\n\
                  inputs = { environment = \"turned\", reflection = \"reflection\" }\n";
    let text = manifest(stages).replace("input = \"environment\"   #", "input = \"turned\"   #");
    let edit = turned(&text, [45.0, 0.0]);
    assert_eq!(
        edit.changes,
        [
            "[stage.further] gets yaw = 46.0 (now 1.0)",
            "[stage.turned-turned] is new: it turns turned (yaw = 45.0) for sheet",
        ]
    );
}

#[test]
fn a_light_that_is_hardly_turned_is_not_written() {
    let text = manifest(TURNED);
    let catalog = catalog(&text);
    let by = Aim { yaw: 5e-5, pitch: 0.0 };
    assert_eq!(catalog.with_turned_light(entry(&catalog), by, &text), Err("the light is not turned".into()));
}
