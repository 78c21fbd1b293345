//! Why did this rerun? `explain`, `verify` and `check`, as a user runs them.

use std::fs;

use crate::support::{Project, SMALL, assert_has, copy_folder, files_below};

const GOLD: &str = "assets/materials/gold.toml";

/// [`Project::small`], built, after which gold was changed.
fn edited() -> Project {
    let project = Project::small();
    project.ok(&["build"]);
    project.write(GOLD, "model = \"phong\"\nexponent = 7\nspecular = [1, 0.8, 0.3]\n");
    project
}

#[test]
fn the_first_line_names_the_file_that_changed_before_and_after_the_build() {
    let project = edited();
    let chain =
        " -> material [gold] -> coefficients [gold] -> reflection [studio, gold] -> map [studio, gold]";
    let first = |project: &Project| {
        let text = project.ok(&["explain", "maps/gold.exr"]).stdout;
        text.lines().next().unwrap().to_owned()
    };
    let before = first(&project);
    assert!(before.starts_with(&format!("map [studio, gold]: would run: {GOLD} changed (")), "{before}");
    assert!(before.ends_with(chain), "{before}");
    assert!(before.contains(" UTC to ") && before.contains(" UTC)"), "both times are given: {before}");
    let digests = before.split(" of ").filter_map(|part| part.rsplit([' ', '(']).next());
    assert!(digests.take(2).all(|digest| digest.len() == 12), "{before}");

    project.ok(&["build"]);
    let after = first(&project);
    assert!(after.starts_with("map [studio, gold]: up to date; it last ran because: "), "{after}");
    assert_eq!(
        after.split_once("because: "),
        before
            .split_once("would run: ")
            .map(|(_, why)| { ("map [studio, gold]: up to date; it last ran ", why) })
    );
}

#[test]
fn a_file_that_a_person_deleted_or_changed_is_in_the_first_line() {
    let project = Project::small();
    project.ok(&["build"]);
    let first = || project.ok(&["explain", "maps/gold.exr"]).stdout.lines().next().unwrap().to_owned();
    fs::write(project.path("out/maps/gold.exr"), "mine").unwrap();
    assert_has(first(), ["up to date, but maps/gold.exr is changed by another program since"]);
    fs::remove_file(project.path("out/maps/gold.exr")).unwrap();
    assert_has(first(), ["up to date, but maps/gold.exr is gone since it was published"]);
}

#[test]
fn digests_are_explained_by_the_files_behind_them() {
    let project = Project::small();
    project.ok(&["build"]);
    fs::copy(project.path("out/maps/chalk.exr"), project.path("out/maps/gold.exr")).unwrap();
    let text = project.ok(&["explain", "out/maps/gold.exr"]).stdout;
    let (studio, chalk) = ("assets/environments/studio.exr", "assets/materials/chalk.toml");
    let copied = format!(", the result of map [studio, chalk], from {studio}, {chalk} (a build restores it)");
    assert!(text.lines().next().unwrap().contains(&copied), "{text}");
    let line = |begin: &str| text.lines().find(|line| line.trim().starts_with(begin)).unwrap().to_owned();
    let of_gold = format!(", from {studio}, {GOLD}");
    assert!(line("made ").ends_with(&format!(" maps/gold.exr{of_gold}")), "{text}");
    assert!(line("input ").ends_with(&format!(" reflection = reflection [studio, gold]{of_gold}")), "{text}");
    let artifact = project.ok(&["explain", "reflection [studio, gold]"]).stdout;
    assert!(artifact.contains(&format!(" brdf = coefficients [gold], from {GOLD}\n")), "{artifact}");
}

#[test]
fn a_result_from_the_cache_is_explained_with_its_cause_and_the_run_that_made_it() {
    let project = Project::small();
    let brass = "assets/materials/brass.toml";
    project.write(brass, "model = \"phong\"\nexponent = 3\n");
    project.ok(&["build"]);
    project.write(brass, &fs::read_to_string(project.path(GOLD)).unwrap());
    project.ok(&["build"]);
    let text = project.ok(&["explain", "maps/brass.exr"]).stdout;
    let first = text.lines().next().unwrap();
    let came =
        format!("map [studio, brass]: up to date; its result came from the cache because: {brass} changed (");
    assert!(first.starts_with(&came) && !text.contains("gold.toml"), "{text}");
    assert!(text.contains("\n  came from the cache ") && !text.contains("last ran"), "{text}");
    assert!(text.contains("\n  made by map [studio, gold], which ran "), "{text}");
    let text = project.ok(&["verify", "maps/brass.exr"]).stdout;
    assert!(text.contains("  made by   map [studio, gold], in the run of "), "{text}");
    assert!(text.contains("; map [studio, brass] took it from the cache\n"), "{text}");
    assert!(text.contains(&format!("unchanged {brass} (")) && !text.contains("gold.toml"), "{text}");

    // Nothing that is said of gold belongs to brass, even after gold comes back.
    let gold = fs::read_to_string(project.path(GOLD)).unwrap();
    project.write(GOLD, "model = \"phong\"\nexponent = 7\n");
    project.ok(&["build"]);
    project.write(GOLD, &gold);
    project.ok(&["build"]);
    let text = project.ok(&["explain", "maps/gold.exr"]).stdout;
    assert!(text.contains("came from the cache because: assets/materials/gold.toml changed"), "{text}");
    assert!(text.contains("\n  made by map [studio, gold], which ran ") && !text.contains("brass"), "{text}");
}

#[test]
fn items_with_the_same_explanation_share_a_line() {
    let project = edited();
    let text = project.ok(&["explain", "map"]).stdout;
    let lines = text.lines().collect::<Vec<_>>();
    assert!(lines[0].ends_with(" items, 1 would run"), "{text}");
    assert_eq!(lines.len(), 3, "one line for gold, one for the others:\n{text}");
    let gold = lines.iter().find(|line| line.starts_with("  [studio, gold]: would run: ")).unwrap();
    assert!(gold.contains("gold.toml changed"), "{text}");
    assert!(
        lines.iter().any(|line| line.ends_with("up to date; it last ran because: never built")),
        "{text}"
    );
    let full = project.ok(&["explain", "map", "--verbose"]).stdout;
    assert!(full.contains("  last ran ") && full.lines().count() > 10, "{full}");
}

#[test]
fn an_unknown_target_is_reported_with_a_known_one() {
    let project = edited();
    let exact = project.ok(&["explain", "map [studio, gold]"]).stdout;
    assert_eq!(project.ok(&["explain", "map[studio,gold]"]).stdout, exact, "spaces are optional");
    let item = project.ok(&["explain", "material [gold]"]).stdout;
    assert_eq!(project.ok(&["explain", GOLD]).stdout, item, "a source stands for its item");
    for (target, hint) in [
        ("map [gold]", "hint: the stage's first item is \"map [studio, "),
        ("mpa", "hint: did you mean \"map\"?"),
        ("nothing-like-it", "hint: name a stage, "),
    ] {
        let run = project.specula(&["explain", target]).ends(2, []);
        assert!(run.stderr.contains(hint), "{target}: {}", run.stderr);
    }
}

#[test]
fn explain_prints_json_for_programs() {
    let project = edited();
    let text = project.ok(&["explain", "map [studio, gold]", "--json"]).stdout;
    let json: serde_json::Value = serde_json::from_str(&text).unwrap();
    assert_eq!(json["v"], 1);
    let item = &json["items"][0];
    assert_eq!(
        (&item["would_run"], &item["files"][0]["state"]["state"]),
        (&true.into(), &"as-published".into())
    );
    assert_eq!(item["reasons"][0]["reason"], "awaits");
    let cause = &item["causes"][0];
    assert_eq!((&cause["reason"]["reason"], &cause["reason"]["path"]), (&"file".into(), &GOLD.into()));
    assert!(cause["reason"]["new_time"].as_u64().unwrap() > 1_600_000_000_000, "{cause}");
    assert_eq!(cause["chain"].as_array().unwrap().len(), 4);
}

#[test]
fn current_stale_and_altered_files_are_distinguished() {
    let project = Project::small();
    project.ok(&["build"]);
    for name in project.outputs().keys() {
        let text = project.ok(&["verify", &format!("out/{name}")]).stdout;
        assert!(text.contains(": current: ") && text.contains("recipe    as recorded"), "{text}");
        assert!(text.contains("unchanged assets/environments/studio.exr ("), "{text}");
    }
    let gold = fs::read_to_string(project.path(GOLD)).unwrap();
    project.write(GOLD, "model = \"phong\"\nexponent = 7\nspecular = [1, 0.8, 0.3]\n");
    let stale = project.specula(&["verify", "maps/gold.exr"]).ends(1, []);
    assert!(stale.stdout.contains(": stale: its sources have changed since\n"), "{}", stale.stdout);
    assert!(stale.stdout.contains(&format!("  changed   {GOLD} (")), "{}", stale.stdout);
    assert!(stale.stdout.contains("  unchanged assets/environments/studio.exr ("), "{}", stale.stdout);
    project.ok(&["verify", "maps/chalk.exr"]);
    project.write(GOLD, &gold);
    project.ok(&["verify", "maps/gold.exr"]);

    project.write("pipeline.toml", &SMALL.replace("degree = 8\n", "degree = 6\n"));
    let revised = project.specula(&["verify", "maps/gold.exr"]).ends(1, []);
    let line = "  revised   lighting: degree changed from 8 to 6 -> reflection [studio, gold] -> map [studio, gold]\n";
    let line = line.replace("lighting:", "lighting [studio]:");
    assert!(revised.stdout.contains(&line), "{}", revised.stdout);
    project.write("pipeline.toml", SMALL);

    let mut bytes = fs::read(project.path("out/maps/gold.exr")).unwrap();
    *bytes.last_mut().unwrap() ^= 1;
    fs::write(project.path("out/maps/gold.exr"), &bytes).unwrap();
    let altered = project.specula(&["verify", "out/maps/gold.exr"]).ends(1, []);
    assert!(
        altered.stdout.contains(": ALTERED: its bytes differ from the published ones\n"),
        "{}",
        altered.stdout
    );
    assert!(altered.stdout.contains("recipe    as recorded"), "{}", altered.stdout);

    // Under another name in another folder, its recipe still identifies it.
    fs::write(project.path("moved.exr"), &bytes).unwrap();
    let moved = project.specula(&["verify", "moved.exr", "--json"]);
    let moved: serde_json::Value = serde_json::from_str(&moved.stdout).unwrap();
    assert_eq!((&moved["v"], &moved["current"]), (&1.into(), &false.into()));
    assert_eq!(moved["verification"]["content"]["content"], "altered");
    assert_eq!(moved["verification"]["item"]["key"]["material"], "gold");
}

#[test]
fn a_copy_in_another_folder_is_recognised_and_an_old_one_is_stale() {
    let project = Project::small();
    project.ok(&["build"]);
    fs::copy(project.path("out/maps/gold.exr"), project.path("kept.exr")).unwrap();
    let text = project.ok(&["verify", "kept.exr"]).stdout;
    assert!(text.contains("kept.exr: current: ") && text.contains("made by   map [studio, gold]"), "{text}");

    project.write(GOLD, "model = \"phong\"\nexponent = 7\nspecular = [1, 0.8, 0.3]\n");
    project.ok(&["build"]);
    let old = project.specula(&["verify", "kept.exr"]).ends(1, []);
    assert!(old.stdout.contains("kept.exr: stale: its item has a newer result\n"), "{}", old.stdout);
    assert!(old.stdout.contains(&format!("  changed   {GOLD} (")), "{}", old.stdout);

    fs::remove_file(project.path(GOLD)).unwrap();
    project.ok(&["build"]);
    let gone = project.specula(&["verify", "kept.exr"]).ends(1, []);
    assert!(gone.stdout.contains(&format!("  gone      {GOLD} (was ")), "{}", gone.stdout);

    project.specula(&["verify", "assets/environments/studio.exr"]).ends(2, ["hint: name an exported file"]);
    let folder = project.specula(&["verify", "assets/environments"]);
    assert_eq!(folder.code, Some(0), "files that nothing published are no difference: {folder:?}");
    assert!(folder.stdout.contains("studio.exr: not published by this manifest\n"), "{}", folder.stdout);
}

/// The last line of `specula verify` with these arguments, and its exit code.
fn summary(project: &Project, arguments: &[&str]) -> (String, Option<i32>) {
    let run = project.specula(&[&["verify"], arguments].concat());
    (run.stdout.lines().last().unwrap_or_default().to_owned(), run.code)
}

#[test]
fn all_of_out_is_verified_without_arguments() {
    let project = Project::small();
    assert_eq!(project.specula(&["verify"]).code, Some(1), "nothing is built yet");
    project.ok(&["build"]);
    let all = project.outputs().len();
    assert_eq!(summary(&project, &[]), (format!("{all} files: {all} current"), Some(0)));

    project.write("out/notes/mine.txt", "of somebody");
    let noted = project.ok(&["verify"]).stdout;
    assert!(noted.starts_with("notes/mine.txt: not published by this manifest\n"), "{noted}");
    fs::remove_file(project.path("out/maps/gold.exr")).unwrap();
    fs::write(project.path("out/maps/chalk.exr"), "altered").unwrap();
    project.write("assets/materials/satin.toml", "model = \"lambert\"\nalbedo = 0.25\n");
    fs::remove_file(project.path("assets/materials/chrome.toml")).unwrap();
    project.write("assets/materials/brass.toml", "model = \"lambert\"\nalbedo = 0.5\n");
    let run = project.specula(&["verify"]).ends(1, []);
    for line in [
        "maps/chalk.exr: ALTERED: its bytes differ from the published ones",
        "maps/satin.exr: stale: its sources have changed since (assets/materials/satin.toml)",
        "maps/gold.exr: gone since it was published; a build restores it (map [studio, gold])",
        "maps/brass.exr: not published yet (map [studio, brass])",
        "maps/chrome.exr: left over: nothing exports it any more",
        "notes/mine.txt: not published by this manifest",
    ] {
        assert!(run.stdout.lines().any(|found| found == line), "{line}\n{}", run.stdout);
    }
    let json = project.specula(&["verify", "--json"]).ends(1, []);
    let json: serde_json::Value = serde_json::from_str(&json.stdout).unwrap();
    let found = &json["verifications"];
    assert_eq!((&json["v"], &json["current"]), (&1.into(), &false.into()));
    assert_eq!(found["missing"][0]["item"]["key"]["material"], "brass", "{:#}", found["missing"]);
    assert_eq!(found["unknown"], serde_json::json!(["notes/mine.txt"]));
    assert!(found["left_over"].as_array().unwrap().contains(&"maps/chrome.exr".into()));
    let altered = found["files"].as_array().unwrap().iter().find(|file| file["file"] == "maps/chalk.exr");
    assert_eq!(altered.unwrap()["content"]["content"], "altered");

    project.ok(&["build"]);
    assert_eq!(summary(&project, &[]).1, Some(0), "the build has mended all of it");
}

#[test]
fn folders_globs_and_several_files_are_verified() {
    let project = Project::small();
    project.ok(&["build"]);
    let maps = project.outputs().keys().filter(|name| name.starts_with("maps/")).count();
    let current = |count: usize| {
        let files = if count == 1 { "file" } else { "files" };
        (format!("{count} {files}: {count} current"), Some(0))
    };
    for arguments in
        [&["out/maps"][..], &["maps"], &["maps/"], &["out/maps/*"], &["maps/*.exr"], &["**/maps/*"]]
    {
        assert_eq!(summary(&project, arguments), current(maps), "{arguments:?}");
    }
    let absolute = project.path("out/maps");
    assert_eq!(summary(&project, &[absolute.to_str().unwrap()]), current(maps));
    assert_eq!(summary(&project, &["maps/gold.exr", "out/lighting.json"]), current(2));
    assert_eq!(summary(&project, &["maps/gold.exr", "out/maps/gold.exr"]), current(1), "it is one file");
    copy_folder(&project.path("out/maps"), &project.path("copies"));
    for arguments in [&["copies"][..], &["copies/*.exr"], &["cop*/*"]] {
        assert_eq!(summary(&project, arguments), current(maps), "{arguments:?}");
    }
    fs::remove_dir_all(project.path("out/maps")).unwrap();
    let gone = (format!("{maps} files: 0 current, {maps} gone"), Some(1));
    for arguments in [&["out/maps"][..], &["maps"], &["out/maps/*"]] {
        assert_eq!(summary(&project, arguments), gone, "{arguments:?}");
    }
    for arguments in [&["nowhere", "maps"][..], &["out/nothing*"], &["out/{"]] {
        let run = project.specula(&[&["verify"], arguments].concat());
        assert_eq!((run.code, run.stdout.as_str()), (Some(2), ""), "{run:?}");
    }
}

#[test]
fn a_file_whose_format_cannot_hold_a_recipe_is_recognised_by_the_file_beside_it() {
    let manifest = format!(
        "{}\n[stage.cabral]\nkind = \"export-cabral\"\ninput = \"reflection\"\nformat = \"dds\"\nresolution = 4\n\
         path = \"cabral/{{material}}\"\n",
        SMALL
    );
    let project = Project::new(&manifest);
    project.ok(&["build", "cabral"]);
    let outputs = project.outputs();
    let dds =
        outputs.keys().find(|name| name.ends_with(".dds")).unwrap_or_else(|| panic!("{:?}", outputs.keys()));
    assert_has(project.ok(&["verify", &format!("out/{dds}")]).stdout, ["recipe    as recorded, in "]);
}

#[test]
fn a_valid_manifest_is_described_and_an_invalid_one_is_not() {
    let project = Project::small();
    let text = project.ok(&["check"]).stdout;
    assert!(text.starts_with("pipeline.toml is valid: 8 stages, ") && text.ends_with(" in out\n"), "{text}");
    assert!(!project.path(".specula").exists() && !project.path("out").exists(), "nothing is written");
    project.write("assets/materials/copper.toml", "model = \"ggx\"\nior = 1.5\n");
    project.write("assets/materials/tin.toml", "model = \"tin\"\n");
    let run = project.specula(&["check"]).ends(1, []);
    assert!(run.stdout.ends_with(" in out; the sources of 2 items have errors\n"), "{run:?}");
    for words in [
        "error: material [copper] would fail\n  copper.toml:1:1: \"roughness\" is missing",
        "no model \"tin\"",
    ] {
        assert!(run.stderr.contains(words), "{run:?}");
    }
    let run = project.specula(&["check", "--json"]);
    let found: serde_json::Value = serde_json::from_str(&run.stdout).unwrap();
    assert_eq!((run.code, &found["sound"]), (Some(1), &false.into()));
    let sources = found["source_errors"].as_array().unwrap().iter().map(|error| &error["source"]);
    assert!(sources.eq(["assets/materials/copper.toml", "assets/materials/tin.toml"]), "{found}");
    assert!(!project.path(".specula").exists());
    project.write("pipeline.toml", &SMALL.replace("degree = 8\n", "degre = 8\n"));
    assert_eq!(project.specula(&["check"]).code, Some(3));
    let usage = project.specula(&["check", "map"]);
    assert_eq!(usage.code, Some(2), "stages can only be named with --determinism: {usage:?}");
}

#[test]
fn outputs_do_not_depend_on_threads_and_the_check_leaves_nothing_behind() {
    let project = Project::small();
    let temporary = project.path("temporary");
    fs::create_dir(&temporary).unwrap();
    let before = files_below(&project.path(""));
    let output = project
        .command(&["check", "--determinism", "map", "--threads", "1,3"])
        .env("TMPDIR", &temporary)
        .env("TEMP", &temporary)
        .env("TMP", &temporary)
        .output()
        .unwrap();
    let text = String::from_utf8(output.stdout).unwrap();
    assert_eq!(output.status.code(), Some(0), "{text}{}", String::from_utf8_lossy(&output.stderr));
    assert!(text.ends_with(" are the same with 1, 3 threads, byte for byte.\n"), "{text}");
    assert_eq!(files_below(&project.path("")), before);
    assert_eq!(fs::read_dir(&temporary).unwrap().count(), 0);
}
