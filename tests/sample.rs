//! The sample pipeline, as a user runs it.

use std::collections::BTreeMap;
use std::fs;

use crate::support::{Project, SMALL, assert_has, copy_folder, files_below, ran, root};

#[test]
fn the_sample_builds_and_is_then_up_to_date() {
    let project = Project::sample();
    let first = project.ok(&["build", "--jobs", "2"]);
    let outputs = project.outputs();
    assert!(outputs.keys().any(|name| name.ends_with(".exr")), "{:?}", outputs.keys());
    assert!(outputs.keys().any(|name| name.ends_with(".json")), "{:?}", outputs.keys());
    assert!(outputs.keys().any(|name| name.ends_with(".png")), "{:?}", outputs.keys());
    assert!(first.stderr.contains("published"), "{}", first.stderr);

    project.specula(&["build"]).ends(0, ["Up to date: all "]);
    assert_eq!(project.outputs(), outputs);
    // Building the sample takes long, so other checks of a whole build use this one.
    every_digest_is_that_of_every_machine(&project);
    every_output_can_be_inspected(&project);
    a_dry_run_distinguishes_an_input_that_is_gone_from_one_that_would_run(&project);
    one_thread_gives_the_same_bytes_as_two(&outputs);
}

fn one_thread_gives_the_same_bytes_as_two(outputs: &BTreeMap<String, Vec<u8>>) {
    let project = Project::sample();
    // Without the report, which takes longest; a test of its kind has other numbers of threads.
    project.ok(&["build", "--jobs", "1", "map", "shrm", "sheet", "preview", "shaded-mesh"]);
    let found = project.outputs();
    assert!(found.len() > 20, "{:?}", found.keys());
    for (name, bytes) in found {
        assert!(outputs[&name] == bytes, "{name}: one thread and two, each from an empty cache");
    }
}

/// `sample_digests.txt` has a line for each item: the digests of its artifact or of its files, as the journal
/// records them. They are the same on every machine; kinds that change their output on purpose have a new
/// revision, and `UPDATE_EXPECT=1` writes the file.
fn every_digest_is_that_of_every_machine(project: &Project) {
    let journal = fs::read_to_string(project.path(".specula/journal")).unwrap();
    let records = journal.lines().filter_map(|line| line.splitn(4, ' ').nth(3));
    let records = records.filter_map(|json| serde_json::from_str::<serde_json::Value>(json).ok());
    let mut lines = BTreeMap::new();
    for record in records.filter(|record| record["outputs"].is_array()) {
        let stems = record["item"]["key"].as_object().unwrap().values().map(|stem| stem.as_str().unwrap());
        let item = format!(
            "{} [{}]",
            record["item"]["stage"].as_str().unwrap(),
            stems.collect::<Vec<_>>().join(", ")
        );
        let outputs = record["outputs"].as_array().unwrap().iter();
        let digests: Vec<_> = outputs.map(|output| output["digest"].as_str().unwrap()).collect();
        lines.insert(item, digests.join(" "));
    }
    assert!(lines.len() > 100, "{} items in the journal", lines.len());
    let found: String = lines.iter().map(|(item, digests)| format!("{item} {digests}\n")).collect();
    expect_test::expect_file!["sample_digests.txt"].assert_eq(&found);
}

fn every_output_can_be_inspected(project: &Project) {
    for name in project.outputs().keys() {
        let text = project.ok(&["inspect", &format!("out/{name}")]).stdout;
        // DDS cannot store text: its recipe is in the index beside it, which is one of these outputs.
        let expected = if name.ends_with(".dds") { "see the .json beside it" } else { "revision" };
        assert!(text.contains("recipe") && text.contains(expected), "{name}:\n{text}");
    }
}

fn a_dry_run_distinguishes_an_input_that_is_gone_from_one_that_would_run(project: &Project) {
    fs::remove_file(project.path("assets/materials/gold.toml")).unwrap();
    project.write("assets/materials/chalk.toml", "model = \"lambert\"\nalbedo = 0.25\n");
    let why = "reflection [sky, gold] is no longer an input; after reflection [sky, chalk]";
    assert_has(project.ok(&["build", "--dry-run"]).stderr, [&format!("sheet [sky]: {why}")]);
    let explained = project.ok(&["explain", "sky/sheet.png"]).stdout;
    for line in why.split("; ") {
        assert!(explained.contains(&format!("    {line}\n")), "{explained}");
    }
}

/// The manifests of `examples/brushed` with smaller pictures, and with measured surfaces if there are any.
#[test]
fn the_brushed_examples_build() {
    let project = Project::new("schema = 1\n");
    let example = "examples/brushed";
    copy_folder(&root().join(example), &project.path(example));
    for folder in ["out", ".specula", "measured/out", "measured/.specula", "measured/brdf"] {
        let _ = fs::remove_dir_all(project.path(example).join(folder));
    }
    let smaller = |name: &str| {
        let path = format!("{example}/{name}");
        let manifest = fs::read_to_string(project.path(&path)).unwrap();
        let small = [
            ("size = 240", "size = 24"),
            ("resolution = 32", "resolution = 8"),
            ("directions = 512", "directions = 192"),
            ("sphere = 64", "sphere = 32"),
        ];
        let manifest = small.iter().fold(manifest, |manifest, (large, small)| manifest.replace(large, small));
        assert!(manifest.contains("size = 24\n") && manifest.contains("resolution = 8"), "{manifest}");
        project.write(&path, &manifest);
    };
    smaller("pipeline.toml");
    project.ok(&["-C", example, "build"]);
    let outputs = files_below(&project.path("examples/brushed/out"));
    for name in ["degrees.html", "environments/sky.png", "shadows/head-brushed.png", "varying/exponent.png"] {
        assert!(outputs.contains_key(name), "no {name} in {:?}", outputs.keys());
    }
    let Some(corpus) = test_data::folder("the_brushed_examples_build", "SPECULA_CORPUS") else { return };
    let measured = project.path("examples/brushed/measured/brdf");
    fs::create_dir_all(&measured).unwrap();
    for name in ["garnet_red.brdf", "krylon_blue.brdf"] {
        fs::copy(corpus.join("brdf/measured").join(name), measured.join(name)).unwrap();
    }
    smaller("measured/pipeline.toml");
    project.ok(&["-C", "examples/brushed/measured", "build"]);
    let outputs = files_below(&project.path("examples/brushed/measured/out"));
    assert!(outputs.contains_key("lamps/head-garnet_red.png"), "{:?}", outputs.keys());
}

/// The manifests of `examples/frequency-space` with small spheres and few materials, and with the photograph
/// if there is one.
#[test]
fn the_frequency_space_examples_build() {
    let project = Project::new("schema = 1\n");
    let example = "examples/frequency-space";
    copy_folder(&root().join(example), &project.path(example));
    for folder in ["out", ".specula", "grace/out", "grace/.specula"] {
        let _ = fs::remove_dir_all(project.path(example).join(folder));
    }
    let mut manifest = fs::read_to_string(project.path(example).join("pipeline.toml")).unwrap();
    for (large, small) in [
        ("sphere = 72", "sphere = 24\nresolution = 16"),
        ("sphere = 96", "sphere = 24\nresolution = 16"),
        ("sphere = 32", "sphere = 24\nresolution = 16"),
        ("figure-5/*.toml", "figure-5/*32.toml"),
        ("figure-8/*.toml", "figure-8/c*.toml"),
        ("environments/*.exr", "environments/sky.exr"),
    ] {
        assert!(manifest.contains(large), "{large}");
        manifest = manifest.replace(large, small);
    }
    project.write(&format!("{example}/pipeline.toml"), &manifest);
    project.ok(&["-C", example, "build"]);
    let outputs = files_below(&project.path(example).join("out"));
    for figure in ["figure-5", "figure-7", "figure-8"] {
        let page = outputs.get(&format!("{figure}.html")).map(|page| String::from_utf8_lossy(page));
        assert!(page.is_some_and(|page| page.contains("Energy kept in %, by F")), "{figure}");
    }
    let Some(corpus) = test_data::folder("the_frequency_space_examples_build", "SPECULA_CORPUS") else {
        return;
    };
    let probe = corpus.join("env/probes/grace_probe.hdr");
    fs::copy(probe, project.path(&format!("{example}/grace/grace_probe.hdr"))).unwrap();
    project.ok(&["-C", &format!("{example}/grace"), "build"]);
    let figures = fs::read(project.path(&format!("{example}/grace/out/figure-6.json"))).unwrap();
    let figures: serde_json::Value = serde_json::from_slice(&figures).unwrap();
    // Every estimate of [RH02, fig. 6] is on the safe side, but for what the truth's samples leave open.
    for cut in figures["degrees"]["pairs"][0]["by_f"].as_array().unwrap() {
        let [truth, min, bound] = ["truth", "min", "bound"].map(|name| cut[name].as_f64().unwrap());
        assert!(truth < 1.1 * min + 1e-3 && truth < 1.1 * bound + 1e-3, "{cut}");
    }
}

#[test]
fn the_sampling_example_builds() {
    let project = Project::new("schema = 1\n");
    let example = "examples/sampling";
    copy_folder(&root().join(example), &project.path(example));
    for folder in ["out", ".specula"] {
        let _ = fs::remove_dir_all(project.path(example).join(folder));
    }
    project.ok(&["-C", example, "build"]);
    let outputs = files_below(&project.path("examples/sampling/out"));
    for name in [
        "sky/light.csv",
        "sky/texels.json",
        "copper/lobe.csv",
        "silk/talk.csv",
        "studio/lacquer/product.safetensors",
        "copper/lobe-density.exr",
        "sky/silk/product-density.exr",
    ] {
        assert!(outputs.contains_key(name), "no {name} in {:?}", outputs.keys());
    }
}

#[test]
fn the_probes_example_lights_one_bake_by_each_sky() {
    let project = Project::new("schema = 1\n");
    let example = "examples/probes";
    copy_folder(&root().join(example).join("skies"), &project.path(&format!("{example}/skies")));
    fs::copy(root().join(example).join("room.glb"), project.path(&format!("{example}/room.glb"))).unwrap();
    let manifest = fs::read_to_string(root().join(example).join("pipeline.toml")).unwrap();
    assert!(manifest.contains("spacing = 0.4\n"), "{manifest}");
    let manifest = manifest.replace("spacing = 0.4\n", "spacing = 0.8\n");
    project.write(&format!("{example}/pipeline.toml"), &manifest);
    let first = ran(&project.events(&["-C", example]));
    assert_eq!([first["transport"], first["probes"]], [1, 3], "{first:?}");
    let outputs = files_below(&project.path("examples/probes/out"));
    for hour in ["morning", "noon", "evening"] {
        for name in ["probes.bin", "probes.js", "sky.json"] {
            assert!(outputs.contains_key(&format!("{hour}/{name}")), "{:?}", outputs.keys());
        }
    }
    let night = "[[light]]\ndirection = [0, 0, 1]\nangular_radius = 90.0\nradiance = 0.01\n";
    project.write(&format!("{example}/skies/night.toml"), night);
    let second = ran(&project.events(&["-C", example]));
    assert_eq!([second.get("transport"), second.get("probes")], [None, Some(&1)], "{second:?}");
}

#[test]
fn a_changed_material_runs_only_what_depends_on_it() {
    let project = Project::small();
    project.ok(&["build"]);
    project
        .write("assets/materials/gold.toml", "model = \"phong\"\nexponent = 7\nspecular = [1, 0.8, 0.3]\n");
    let one = |names: &[&str]| names.iter().map(|name| ((*name).to_owned(), 1)).collect::<BTreeMap<_, _>>();
    let expected = one(&["material", "coefficients", "reflection", "map", "faces"]);
    assert_eq!(ran(&project.events(&[])), expected);

    let why = project.ok(&["explain", "maps/gold.exr"]).stdout;
    assert!(why.contains("gold.toml") || why.contains("reflection"), "{why}");
}

#[test]
fn an_edit_that_changes_nothing_stops_at_once() {
    let project = Project::small();
    project.ok(&["build"]);
    let gold = fs::read_to_string(project.path("assets/materials/gold.toml")).unwrap();
    project.write("assets/materials/gold.toml", &format!("# a comment\n{gold}"));
    assert_eq!(ran(&project.events(&[])).into_keys().collect::<Vec<_>>(), ["material"]);
}

#[test]
fn a_changed_parameter_is_explained_with_old_and_new_value() {
    let project = Project::small();
    project.ok(&["build"]);
    project.write("pipeline.toml", &SMALL.replace("degree = 8\n", "degree = 6\n"));
    let before = project.ok(&["explain", "lighting"]).stdout;
    assert_has(&before, ["degree", "8", "6"]);
    project.specula(&["build", "--dry-run"]).ends(0, ["degree changed from 8 to 6"]);
    assert_eq!(project.events(&["--dry-run"])[0]["dry_run"], true);
    assert!(before.contains(concat!("by version ", env!("CARGO_PKG_VERSION"))), "{before}");
    let events = project.events(&[]);
    assert!(ran(&events).contains_key("lighting") && !ran(&events).contains_key("environment"));
}

#[test]
fn a_dry_run_says_would_and_writes_nothing() {
    let project = Project::small();
    project.ok(&["build"]);
    fs::remove_file(project.path("out/lighting.json")).unwrap();
    project.write("assets/materials/new.toml", "model = \"lambert\"\n");
    fs::remove_file(project.path("assets/materials/gold.toml")).unwrap();
    let outputs = project.outputs();
    let dry = project.ok(&["build", "--dry-run"]);
    for words in [
        "would restore  lighting.json",
        "assets/materials/gold.toml was deleted: 7 files would be removed",
        "    would run  material [new]: never built",
        "1 file would be published",
        "Nothing was written.",
    ] {
        assert!(dry.stderr.contains(words), "no {words:?} in:\n{}", dry.stderr);
    }
    for line in dry.stderr.lines().filter(|line| line.contains("  ")) {
        assert!(line.contains("would "), "{line:?} in:\n{}", dry.stderr);
    }
    assert_eq!(project.outputs(), outputs);
}

#[test]
#[cfg(unix)]
fn an_interrupted_build_says_so_and_the_next_one_continues() {
    use std::io::{BufRead, BufReader};
    use std::process::{Command, Stdio};

    let project = Project::sample();
    let stages = ["map", "shrm"];
    let build = [&["build", "--jobs", "1", "--json"], &stages[..]].concat();
    let mut child = project.command(&build).stdout(Stdio::piped()).spawn().unwrap();
    let mut lines = BufReader::new(child.stdout.take().unwrap()).lines();
    let first =
        lines.find(|line| line.as_ref().unwrap().contains("\"event\":\"finished\"")).unwrap().unwrap();
    assert!(Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap().success());
    let last = lines.last().unwrap().unwrap();
    assert_eq!(child.wait().unwrap().code(), Some(130), "{last}");
    assert!(last.contains("\"cancelled\":true"), "{last}");

    let done: serde_json::Value = serde_json::from_str(&first).unwrap();
    let rest = project.events(&stages);
    assert!(!rest.iter().any(|event| event["event"] == "finished" && event["item"] == done["item"]));
    let clean = Project::sample();
    clean.ok(&[&["build"], &stages[..]].concat());
    assert_eq!(project.outputs(), clean.outputs());
}

#[test]
fn a_reader_that_has_gone_away_is_not_an_error() {
    let project = Project::small();
    project.ok(&["build"]);
    let commands: [&[&str]; 7] = [
        &["stages"],
        &["stages", "project-sh"],
        &["graph"],
        &["explain", "map"],
        &["inspect", "out/lighting.json", "--json"],
        &["build", "--json"],
        &["build", "--verbose"],
    ];
    for command in commands {
        let (reader, writer) = std::io::pipe().unwrap();
        drop(reader);
        let errors = writer.try_clone().unwrap();
        let status = project.command(command).stdout(writer).stderr(errors).status().unwrap();
        assert_eq!(status.code(), Some(0), "specula {command:?}");
    }
}

#[test]
#[cfg(target_os = "linux")]
fn a_result_that_cannot_be_written_is_reported_once() {
    let project = Project::small();
    for command in [&["stages"][..], &["build", "--json"]] {
        let full = fs::File::options().write(true).open("/dev/full").unwrap();
        let output = project.command(command).stdout(full).output().unwrap();
        assert_eq!(output.status.code(), Some(4), "specula {command:?}");
        let errors = String::from_utf8(output.stderr).unwrap();
        assert!(errors.starts_with("error: cannot write to standard output"), "{errors}");
        assert_eq!(errors.lines().count(), 1, "{errors}");
    }
    assert!(!project.outputs().is_empty(), "the build itself continued");
}

#[test]
fn outputs_of_a_removed_stage_go_and_foreign_files_stay() {
    let project = Project::small();
    project.ok(&["build"]);
    project.write("out/maps/notes.txt", "mine");
    let without = SMALL.split("[stage.map]").next().unwrap().to_owned();
    project.write("pipeline.toml", &without);
    project.ok(&["build"]);
    assert_eq!(project.outputs().into_keys().collect::<Vec<_>>(), ["maps/notes.txt"]);
}

#[test]
fn a_deleted_output_comes_back_without_any_stage_running() {
    let project = Project::small();
    project.ok(&["build"]);
    let outputs = project.outputs();
    fs::remove_dir_all(project.path("out")).unwrap();
    assert!(ran(&project.events(&[])).is_empty());
    assert_eq!(project.outputs(), outputs);
}

#[test]
fn one_failing_item_stops_only_its_dependants() {
    let project = Project::small();
    project.ok(&["build"]);
    let outputs = project.outputs();
    project.write("assets/materials/gold.toml", "model = \"fong\"\nexponent = -3\n");
    project.write("assets/materials/chalk.toml", "model = \"lambert\"\nalbedo = 0.25\n");
    let run = project.specula(&["build"]).ends(1, []);
    for word in ["gold.toml", "fong", "phong", "not run because of it", "reflection [studio, gold]"] {
        assert!(run.stderr.contains(word), "no {word:?} in:\n{}", run.stderr);
    }
    let after = project.outputs();
    assert_eq!(after["maps/gold.exr"], outputs["maps/gold.exr"], "the last good output stays");
    assert_ne!(after["maps/chalk.exr"], outputs["maps/chalk.exr"], "items that do not depend on it run");
    assert_eq!(project.specula(&["build"]).code, Some(1), "a failure is not cached");
}

#[test]
fn every_artifact_in_the_cache_can_be_inspected() {
    let project = Project::small();
    project.ok(&["build"]);
    let blobs = files_below(&project.path(".specula/blobs"));
    let texts = blobs.keys().map(|name| project.ok(&["inspect", &format!(".specula/blobs/{name}")]).stdout);
    let texts = texts.collect::<Vec<_>>();
    for what in ["material", "environment", "lighting", "brdf", "reflection", "image"] {
        let line = format!("{:<13} {what}", "what");
        assert!(texts.iter().any(|text| text.lines().any(|found| found == line)), "no {what} in {texts:#?}");
    }
}

#[test]
fn graphs_and_manual_pages_are_printed() {
    let project = Project::sample();
    assert!(project.ok(&["graph"]).stdout.starts_with("flowchart LR\n"));
    assert!(project.ok(&["graph", "--format", "dot"]).stdout.starts_with("digraph"));
    let kinds = project.ok(&["stages"]).stdout;
    for line in kinds.lines() {
        let kind = line.split_whitespace().next().unwrap();
        assert_has(project.ok(&["stages", kind]).stdout, ["## Parameters", "```toml"]);
    }
    project.specula(&["stages", "projct-sh"]).ends(2, ["project-sh"]);
}

#[test]
fn a_new_project_builds_once_it_has_an_environment() {
    let project = Project::new("");
    let made = project.path("made");
    project.ok(&["init", made.to_str().unwrap()]);
    let manifest = made.join("pipeline.toml");
    let manifest = manifest.to_str().unwrap();
    let run = project.specula(&["build", "--manifest", manifest]);
    assert_eq!(run.code, Some(3), "no environment yet: {run:?}");
    fs::copy(project.path("assets/environments/studio.exr"), made.join("assets/environments/studio.exr"))
        .unwrap();
    project.ok(&["build", "--manifest", manifest]);
    assert!(made.join("out/studio/sheet.png").exists());
    let again = project.specula(&["init", made.to_str().unwrap()]);
    assert_eq!(again.code, Some(2), "an existing manifest is kept: {again:?}");
}

#[test]
fn the_pipeline_of_the_readme_builds() {
    let readme = fs::read_to_string(root().join("README.md")).unwrap();
    let examples = readme.split("```toml\n").skip(1).map(|rest| rest.split("```").next().unwrap());
    let project = Project::new(&examples.collect::<String>());
    project.ok(&["build"]);
    for file in ["sky/gold/reflection/px.exr", "sky/three/environment.ktx2"] {
        assert!(project.outputs().contains_key(file), "{:?}", project.outputs().keys());
    }
}
