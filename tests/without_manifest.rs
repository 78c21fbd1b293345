//! What works without a manifest, or without typing where it is.

use std::fs;

use crate::support::{Project, SMALL, STUDIO, assert_has, files_below, root};

#[test]
fn files_are_previewed_without_a_manifest() {
    let project = Project::assets_alone();
    let mut command = project.command(&[
        "preview",
        STUDIO,
        "assets/materials/gold.toml",
        "--still",
        "gold.png",
        "--size",
        "64x48",
    ]);
    let cache = project.path("cache");
    let drawn = command.env("XDG_CACHE_HOME", &cache).output().unwrap();
    let text = String::from_utf8(drawn.stderr).unwrap();
    assert!(drawn.status.success() && text.contains("gold.png: gold under studio on sphere"), "{text}");
    assert!(project.path("gold.png").exists() && !project.path(".specula").exists());
    // The same files find what was made for them, and others stand in for what is not named.
    let drawn = project
        .command(&[
            "preview",
            STUDIO,
            "--item",
            "material=chrome",
            "--still",
            "chrome.png",
            "--size",
            "64x48",
        ])
        .env("XDG_CACHE_HOME", &cache)
        .output()
        .unwrap();
    assert!(drawn.status.success(), "{}", String::from_utf8_lossy(&drawn.stderr));
    // Windows has one cache for a user, wherever these variables point.
    if cfg!(unix) {
        assert_eq!(fs::read_dir(cache.join("specula/preview")).unwrap().count(), 2);
    }
    let text = project.ok(&["preview", STUDIO, "assets/materials/gold.toml", "--manifest"]).stdout;
    project.write("pipeline.toml", &text);
    project.ok(&["build"]);
    project.specula(&["preview", "notes.txt"]).ends(2, []);
}

#[test]
fn init_writes_a_manifest_for_what_is_in_a_folder() {
    let project = Project::assets_alone();
    fs::remove_dir_all(project.path("assets/finishes")).unwrap();
    fs::remove_file(project.path("assets/white.toml")).unwrap();
    project.specula(&["init"]).ends(0, ["The manifest names 2 environments, 7 materials and 1 mesh file."]);
    // The lamps below assets/lights are a TOML file too, and no material.
    project.ok(&["check"]);
    project.ok(&["build", "map [studio, gold]", "map [sky, steel]"]);
    assert_eq!(project.outputs().len(), 2 * 6);
}

#[test]
fn presets_are_inspected_by_name_and_written_as_files() {
    let project = Project::assets_alone();
    for folder in ["finishes", "materials", "brushed"] {
        fs::remove_dir_all(project.path("assets").join(folder)).unwrap();
    }
    fs::remove_file(project.path("assets/white.toml")).unwrap();
    let text = project.ok(&["inspect", "copper"]).stdout;
    assert!(
        text.starts_with("material      copper: a satin metal that reflects 0.932 0.623 0.522 "),
        "{text}"
    );
    assert!(text.lines().last().unwrap().starts_with("  angle 89"), "{text}");
    project.specula(&["inspect", "coper"]).ends(2, ["did you mean \"copper\"?"]);
    project.specula(&["preview", "coper", "--still", "a.png"]).ends(2, ["did you mean \"copper\"?"]);
    project.specula(&["preview", "copper", "--manifest"]).ends(2, ["copper is a preset"]);

    project.specula(&["init", "--materials"]).ends(0, ["material.schema.json", "pipeline.toml"]);
    let copper = fs::read_to_string(project.path("assets/materials/copper.toml")).unwrap();
    assert!(copper.contains("\n# base_color ") && copper.contains("Johnson and Christy"), "{copper}");
    let manifest = fs::read_to_string(project.path("pipeline.toml")).unwrap();
    assert!(manifest.contains("source = \"assets/materials/*.toml\""), "{manifest}");
    // Beside a manifest, files that exist stay as they are.
    project.write("assets/materials/copper.toml", "material = \"copper\"\nroughness = 0.5\n");
    fs::remove_file(project.path("assets/materials/gold.toml")).unwrap();
    let again = project.specula(&["init", "--materials"]).ends(0, ["kept  ", "wrote "]);
    assert_eq!(again.stderr.matches("wrote ").count(), 1, "{}", again.stderr);
    project.write(
        "pipeline.toml",
        "schema = 1\n[stage]\nmaterial = { kind = \"import-material\", source = \"assets/materials/*.toml\" }\n\
         pot = { kind = \"import-material\", material = \"copper\" }\n",
    );
    let run = project.ok(&["build"]);
    assert!(run.stderr.contains("21 items ran"), "{}", run.stderr);
}

#[test]
fn init_writes_the_sample_with_its_assets() {
    let project = Project::assets_alone();
    project.ok(&["init", "--sample", "sample"]);
    for file in ["pipeline.toml", STUDIO, "assets/finishes/copper.toml", "assets/white.toml"] {
        let (written, own) = (project.path("sample").join(file), root().join(file));
        assert!(fs::read(written).unwrap() == fs::read(own).unwrap(), "{file}");
    }
    project.ok(&["-C", "sample", "check"]);
}

#[test]
fn the_manifest_is_found_from_a_folder_below_it() {
    let project = Project::small();
    let below = project.path("assets/materials");
    let run = project.command(&["build", "lighting"]).current_dir(&below).output().unwrap();
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    let run =
        project.command(&["explain", "lighting"]).current_dir(below.parent().unwrap()).output().unwrap();
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    let nowhere = tempfile::tempdir().unwrap();
    let run = project.command(&["build"]).current_dir(nowhere.path()).output().unwrap();
    assert_eq!(run.status.code(), Some(3), "there is none around it");
    project.specula(&["-C", "nowhere", "build"]).ends(2, ["cannot work in nowhere"]);
}

#[test]
fn one_item_is_built_with_what_it_needs() {
    let project = Project::small();
    project.specula(&["build", "map [studio, gold]", "-j", "1"]).ends(0, ["6 items ran"]);
    assert_eq!(project.outputs().into_keys().collect::<Vec<_>>(), ["maps/gold.exr"]);
    // The rest stays as it is when one of its items is built again.
    project.ok(&["build"]);
    let all = project.outputs();
    project.ok(&["build", "map [studio, gold]", "faces[studio,chalk]"]);
    assert_eq!(project.outputs(), all);
    project
        .specula(&["build", "map [studio, silver]"])
        .ends(2, ["no item \"map [studio, silver]\"", "map [studio, chalk]"]);
}

#[test]
fn a_quiet_build_shows_warnings_and_failures_alone() {
    let project = Project::small();
    let warned = project.ok(&["build", "-q"]).stderr;
    assert!(warned.lines().all(|line| line.contains("  warning  ")), "{warned}");
    assert_eq!(project.ok(&["build", "-q", "environment"]).stderr, "");
    project.write("assets/materials/gold.toml", "model = \"fong\"\n");
    let run = project.specula(&["build", "--quiet"]);
    assert!(run.stderr.contains("FAILED") && run.stderr.contains("did you mean \"phong\""), "{}", run.stderr);
}

#[test]
fn first_failures_do_not_speak_of_last_good_outputs() {
    let project = Project::small();
    project.write("assets/materials/gold.toml", "model = \"fong\"\n");
    let kept = "The last good outputs of the items that did not run are kept.";
    assert!(!project.specula(&["build"]).stderr.contains(kept), "there are none");
    project.write("assets/materials/gold.toml", "model = \"phong\"\nexponent = 7\n");
    project.ok(&["build"]);
    project.write("assets/materials/gold.toml", "model = \"fong\"\n");
    assert!(project.specula(&["build"]).stderr.contains(kept));
}

#[test]
fn warnings_of_results_that_are_up_to_date_are_repeated() {
    let project = Project::small();
    // A PNG holds no light brighter than its white.
    project.write("pipeline.toml", &SMALL.replace("studio.exr", "studio.png"));
    project.ok(&["convert", STUDIO, "-o", "assets/environments/studio.png"]);
    let first = project.ok(&["build"]).stderr;
    let warnings = |text: &str| -> Vec<String> {
        text.lines().filter(|line| line.contains("  warning  ")).map(str::to_owned).collect()
    };
    assert!(warnings(&first).iter().any(|line| line.contains("environment")), "{first}");
    let second = project.ok(&["build"]).stderr;
    assert!(second.contains("Up to date"), "{second}");
    let sorted = |mut lines: Vec<String>| {
        lines.sort();
        lines
    };
    assert_eq!(sorted(warnings(&second)), sorted(warnings(&first)));
}

#[test]
fn colour_is_as_it_is_asked_for() {
    let project = Project::new("schema = 1\n[stage.x]\nkind = \"nothing\"\n");
    let run = |colour: &str| {
        let output = project.command(&["--color", colour, "build"]).output().unwrap();
        String::from_utf8(output.stderr).unwrap()
    };
    assert!(run("always").contains("\u{1b}["));
    assert!(!run("never").contains('\u{1b}') && !run("auto").contains('\u{1b}'));
}

#[test]
fn shells_and_man_know_every_command() {
    let project = Project::assets_alone();
    // `completions.rs` tries the other shells themselves.
    for shell in ["powershell", "elvish"] {
        let script = project.ok(&["completions", shell]).stdout;
        for word in ["convert", "preview", "completions"] {
            assert!(script.contains(word), "{shell}: {word}");
        }
    }
    project.ok(&["man", "man"]);
    let page = |name: &str| fs::read_to_string(project.path("man").join(name)).unwrap();
    assert!(page("specula.1").contains("reflection maps") && page("specula-convert.1").contains("yaw"));
}

#[test]
fn a_test_pattern_is_written_for_each_engine() {
    let project = Project::assets_alone();
    for (preset, files) in [
        ("three", &["README.txt", "pattern-axes-irradiance.json", "pattern-axes.ktx2"][..]),
        ("babylon", &["README.txt", "pattern-axes.env", "pattern-lod.env"]),
        ("unreal", &["README.txt", "pattern-axes-irradiance.json", "pattern-axes.hdr"]),
    ] {
        project.ok(&["test-pattern", "--preset", preset, "-r", "32", preset]);
        let found: Vec<_> = files_below(&project.path(preset)).into_keys().collect();
        assert_eq!(found[..3], *files, "{found:?}");
    }
    for (preset, files) in [
        ("three", &["README.txt", "probes.bin", "probes.js", "probes.json"][..]),
        ("bevy", &["README.txt", "light_probes.rs", "volume-0.ktx2"]),
        ("godot", &["README.txt", "light_probes.tscn", "places.tscn", "volume-0.tres"]),
        ("unity", &["README.txt", "SpeculaLightProbes.cs", "probes.json"]),
        ("vrc-light-volumes", &["README.txt", "SpeculaLightVolumes.cs", "volumes.bytes", "volumes.json"]),
        ("gltf", &["probes.glb"]),
    ] {
        let folder = format!("probes-{preset}");
        project.ok(&["test-pattern", "--probes", "--preset", preset, &folder]);
        let found: Vec<_> = files_below(&project.path(&folder)).into_keys().collect();
        assert_eq!(found, *files);
    }
    let run = project.specula(&["test-pattern", "--preset", "quake", "out"]);
    assert_eq!(run.code, Some(2));
    assert!(run.stderr.contains("\"quake\" is not \"three\" or \"filament\""), "{}", run.stderr);
    assert!(!project.path("out").exists() && !project.path(".specula").exists());
}

/// A light probe, six faces, a cross, a damaged image, a texture that is no environment, a measured BRDF, a
/// mesh without normals, and documents that hold no mesh: all that can be read is built, and the rest is
/// named.
#[test]
fn init_writes_no_stage_that_fails_on_what_is_there() {
    let project = Project::assets_alone();
    for folder in ["meshes", "finishes", "materials", "lights", "brushed"] {
        let _ = fs::remove_dir_all(project.path("assets").join(folder));
    }
    project.ok(&["convert", STUDIO, "-o", "cubes/faces", "--layout", "cube", "-r", "16"]);
    project.ok(&["convert", STUDIO, "-o", "cross.exr", "--layout", "cube-cross", "-r", "16"]);
    project.ok(&["convert", STUDIO, "-o", "sky.exr", "-r", "32"]);
    project.ok(&["convert", STUDIO, "-o", "sky.hdr", "-r", "32"]);
    let face = fs::read(project.path("cubes/faces/px.exr")).unwrap();
    fs::write(project.path("uffizi_probe.exr"), &face).unwrap();
    fs::create_dir(project.path("half")).unwrap();
    fs::write(project.path("half/a_px.exr"), &face).unwrap();
    let strange = fs::read(project.path(STUDIO)).unwrap();
    fs::write(project.path("cut.exr"), &strange[..strange.len() / 2]).unwrap();
    project.write("broken.hdr", "#?RADIANCE\n");
    project.write("paint.brdf", "no BRDF");
    project.write("table.csv", "name,price\nchair,3\n");
    project.write("photo.jpg", "no environment");
    let asset = r#""asset": { "version": "2.0" }"#;
    project.write("light.gltf", &format!("{{ {asset} }}"));
    let positions = "AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA";
    let triangle = |required: &str| {
        format!(
            r#"{{ {asset}, {required} "nodes": [{{ "mesh": 0 }}], "meshes": [{{ "primitives": [{{ "attributes": {{ "POSITION": 0 }} }}] }}],
            "accessors": [{{ "bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3" }}],
            "bufferViews": [{{ "buffer": 0, "byteLength": 36 }}],
            "buffers": [{{ "uri": "data:application/octet-stream;base64,{positions}", "byteLength": 36 }}] }}"#
        )
    };
    project.write("bare.gltf", &triangle(""));
    project.write("hairy.gltf", &triangle(r#""extensionsRequired": ["VENDOR_hair"],"#));
    let run = project.ok(&["init"]);
    let manifest = fs::read_to_string(project.path("pipeline.toml")).unwrap();
    for (file, reason) in [
        ("half/a_px.exr", "one face of a cube, but the other faces are missing"),
        ("cut.exr", "OpenEXR"),
        ("broken.hdr", ""),
        ("paint.brdf", ""),
        ("table.csv", ""),
        ("light.gltf", "its scene has no triangles"),
        ("hairy.gltf", "requires VENDOR_hair"),
        ("sky.hdr", "has the same name, \"sky\""),
    ] {
        for (place, text) in [("terminal", &run.stderr), ("manifest", &manifest)] {
            let mut lines = text.lines();
            let line = lines.find(|line| line.contains(&format!("{file}: ")));
            assert!(line.is_some_and(|line| line.contains(reason)), "{place}, {file}:\n{text}");
        }
    }
    for line in
        ["layout = \"probe\"", "layout = \"cube\"", "layout = \"cube-cross\"", "source = \"cubes/faces\""]
    {
        assert!(manifest.contains(line), "no {line} in\n{manifest}");
    }
    assert!(!manifest.contains("photo.jpg"), "{manifest}");
    let built = project.specula(&["build"]);
    assert_eq!(built.code, Some(0), "{}\n{manifest}", built.stderr);
    let files = project.outputs();
    for file in [
        "probe/uffizi_probe/sheet.png",
        "cube/faces/sh.json",
        "cube-cross/cross/sh.json",
        "sky/sh.json",
        "studio/sh.json",
    ] {
        assert!(files.contains_key(file), "no {file} among {:?}", files.keys());
    }
}

/// Without material files, each material of a mesh gets one, which follows the asset.
#[test]
fn init_writes_the_materials_of_meshes() {
    let project = Project::assets_alone();
    for folder in ["meshes", "finishes", "materials", "lights", "brushed"] {
        fs::remove_dir_all(project.path("assets").join(folder)).unwrap();
    }
    fs::remove_file(project.path("assets/white.toml")).unwrap();
    let asset = r#"{ "asset": { "version": "2.0" }, "nodes": [{ "mesh": 0 }],
        "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0 }, "material": 1 }] }],
        "materials": [{ "name": "Red/paint", "pbrMetallicRoughness": { "baseColorFactor": [0.25, 0.5, 1, 1],
            "metallicFactor": 0, "roughnessFactor": 0.5 } }, {}],
        "accessors": [{ "bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3" }],
        "bufferViews": [{ "buffer": 0, "byteLength": 36 }],
        "buffers": [{ "uri": "data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA",
            "byteLength": 36 }] }"#;
    project.write("models/car.gltf", asset);
    let said = "The manifest names 2 environments, 2 materials of glTF files and 1 mesh file.";
    project.specula(&["init"]).ends(0, [said]);
    let text = fs::read_to_string(project.path("assets/materials/Red-paint.toml")).unwrap();
    for line in ["model = \"gltf\"", "file = \"../../models/car.gltf\"", "material = \"Red/paint\""] {
        assert!(text.lines().any(|found| found == line), "no {line} in\n{text}");
    }
    let manifest = fs::read_to_string(project.path("pipeline.toml")).unwrap();
    assert!(manifest.contains("source = \"assets/materials/*.toml\""), "{manifest}");
    project.ok(&["check"]);
    let inspected = project.ok(&["inspect", "assets/materials/Red-paint.toml"]).stdout;
    for number in ["0.25", "0.5"] {
        assert!(inspected.contains(number), "no {number} in\n{inspected}");
    }
    assert!(project.ok(&["inspect", "models/car.gltf"]).stdout.contains("Red/paint, 1"));
}

/// The light of an engine is the first that a new manifest makes, and what shaders look up is for it, too.
#[test]
fn init_writes_a_manifest_for_an_engine() {
    for (name, light, taps) in [
        ("three", "studio/three/environment-skybox.ktx2", Some("studio/white/taps/taps-three.js")),
        ("blender", "studio/blender/environment.exr", None),
    ] {
        let project = Project::assets_alone();
        for folder in ["meshes", "finishes", "materials", "lights", "brushed", "graphics"] {
            let _ = fs::remove_dir_all(project.path("assets").join(folder));
        }
        fs::remove_file(project.path("assets/environments/sky.exr")).unwrap();
        project.ok(&["init", "--engine", name]);
        let manifest = fs::read_to_string(project.path("pipeline.toml")).unwrap();
        let place = |text: &str| manifest.find(text).unwrap_or_else(|| panic!("no {text} in {manifest}"));
        assert!(place("kind = \"export-engine\"") < place("kind = \"import-material\""));
        project.ok(&["build"]);
        let files = project.outputs();
        for file in [light].into_iter().chain(taps) {
            assert!(files.contains_key(file), "no {file} among {:?}", files.keys());
        }
    }
    Project::new("").specula(&["init", "--engine", "thre"]).ends(2, ["did you mean \"three\"?"]);
    Project::new("").specula(&["init", "--engine", "three", "--sample"]).ends(2, ["cannot be used with"]);
}

#[test]
fn the_version_is_one_line_and_verbose_says_from_what_it_was_built() {
    let project = Project::assets_alone();
    let line = format!("specula {}\n", env!("CARGO_PKG_VERSION"));
    let mut texts = Vec::new();
    for flag in ["--version", "-V"] {
        assert_eq!(project.ok(&[flag]).stdout, line);
        texts.extend([project.ok(&[flag, "--verbose"]).stdout, project.ok(&["--verbose", flag]).stdout]);
    }
    assert!(texts.iter().all(|text| *text == texts[0] && text.starts_with(&line)), "{texts:?}");
    let text = &texts[0];
    let switch = |is_on| if is_on { "on" } else { "off" };
    let [gpu, window, remote] = [cfg!(feature = "gpu"), cfg!(feature = "window"), cfg!(feature = "remote")];
    let features =
        format!("features: gpu {}, window {}, remote {}\n", switch(gpu), switch(window), switch(remote));
    assert_has(text, ["\ncommit: ", &features, "\nlicence: MIT OR Apache-2.0\n"]);
    // A crate is in the lock file with this version.
    let lock = fs::read_to_string(root().join("Cargo.lock")).unwrap();
    let mut known = 0;
    for named in text.lines().filter_map(|line| line.strip_prefix("  ")).flat_map(|line| line.split(',')) {
        let Some((name, version)) = named.trim().split_once(' ') else { continue };
        assert!(lock.contains(&format!("name = \"{name}\"\nversion = \"{version}\"\n")), "{named}");
        known += 1;
    }
    assert!(known > 200, "{known} crates are listed");
    project.specula(&["--verbose", "stages"]).ends(2, ["--version"]);
}
