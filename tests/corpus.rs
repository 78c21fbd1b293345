//! The whole pipeline on real environments: photographed lat-longs, light probes and a cube map.

use crate::support::{Project, copy_folder};

const MANIFEST: &str = r#"
schema = 1
[stage]
photograph = { kind = "import-environment", source = "{corpus}/env/cc0/*.hdr", resolution = 256 }
cube = { kind = "import-environment", source = "{corpus}/env/pisa_cube", resolution = 256 }
material = { kind = "import-material", source = "assets/materials/*.toml" }
photograph-lighting = { kind = "project-sh", input = "photograph" }
probe-lighting = { kind = "project-sh", input = "probe", degree = 30, window = "non-negative" }
cube-lighting = { kind = "project-sh", input = "cube", degree = 30 }
turned = { kind = "rotate", input = "cube-lighting", yaw = 30.0 }
coefficients = { kind = "project-brdf", input = "material" }
probe-reflection = { kind = "convolve", inputs = { lighting = "probe-lighting", brdf = "coefficients" } }
cube-reflection = { kind = "convolve", inputs = { lighting = "turned", brdf = "coefficients" } }
photograph-sh = { kind = "export-sh", input = "photograph-lighting" }
[stage.probe]
kind = "import-environment"
source = "{corpus}/env/probes/*.hdr"
layout = "probe"
resolution = 256
[stage.photograph-reflection]
kind = "convolve"
inputs = { lighting = "photograph-lighting", brdf = "coefficients" }
[stage.photograph-map]
kind = "export-reflection-map"
input = "photograph-reflection"
layout = "cube"
resolution = 32
[stage.cube-map]
kind = "export-reflection-map"
input = "cube-reflection"
layout = "lat-long"
resolution = 64
format = "rgbe"
[stage.photograph-sheet]
kind = "contact-sheet"
inputs = { environment = "photograph", lighting = "photograph-lighting", reflection = "photograph-reflection" }
path = "sheets/{photograph}"
[stage.probe-sheet]
kind = "contact-sheet"
inputs = { environment = "probe", lighting = "probe-lighting", reflection = "probe-reflection" }
path = "sheets/{probe}"
[stage.cube-sheet]
kind = "contact-sheet"
inputs = { environment = "cube", lighting = "cube-lighting", reflection = "cube-reflection" }
path = "sheets/{cube}"
"#;

#[test]
fn the_corpus_builds_and_rebuilds() {
    let Some(corpus) = test_data::folder("the_corpus_builds_and_rebuilds", "SPECULA_CORPUS") else { return };
    let corpus = engine::canonicalize(corpus).unwrap().to_str().unwrap().replace('\\', "/");
    let project = Project::new(&MANIFEST.replace("{corpus}", &corpus));
    project.ok(&["build"]);
    let sheets = project.outputs().into_keys().filter(|name| name.starts_with("sheets/")).collect::<Vec<_>>();
    let wanted =
        ["apartment", "forest", "grace_probe", "night", "pisa_cube", "rnl_probe", "studio", "sunrise"];
    assert_eq!(sheets, wanted.map(|name| format!("sheets/{name}.png")));
    // SPECULA_KEEP names a folder to copy the outputs to, for people to look at.
    if let Some(folder) = std::env::var_os("SPECULA_KEEP") {
        copy_folder(&project.path("out"), folder.as_ref());
    }
    assert!(project.ok(&["build"]).stderr.contains("Up to date: all "));
}
