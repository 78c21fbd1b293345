//! `specula cache` through the binary: what it prints, its exit codes, and that it may be killed at any time.

use std::time::Duration;

use crate::support::{Project, files_below, ran};
use serde_json::Value;

/// Changes the material; each number gives another one.
fn edit(project: &Project, n: u32) {
    let text = format!("model = \"phong\"\nexponent = {}\nspecular = 1\n", 1.0 + f64::from(n) / 8.0);
    project.write("assets/materials/gold.toml", &text);
}

/// A project after this many edits and builds.
fn edited(edits: u32) -> Project {
    let project = Project::small();
    for n in 0..edits {
        edit(&project, n);
        project.ok(&["build"]);
    }
    project
}

fn json(project: &Project, arguments: &[&str]) -> Value {
    serde_json::from_str(&project.ok(arguments).stdout).unwrap()
}

#[test]
fn stats_and_gc_say_what_they_found_and_freed() {
    let project = edited(3);
    let stats = json(&project, &["cache", "stats", "--json"]);
    assert_eq!(stats["garbage"]["count"], 0);
    let earlier = stats["earlier"]["bytes"].as_u64().unwrap();
    let in_effect = stats["in_effect"]["bytes"].as_u64().unwrap();
    assert!(earlier > 0 && in_effect > 0);
    let text = project.ok(&["cache", "stats"]).stdout;
    for words in ["in effect", "earlier", "garbage", "journal", "stage reflection (pipeline.toml)"] {
        assert!(text.contains(words), "no {words:?} in:\n{text}");
    }
    let size = format!("{}", in_effect + earlier / 2);
    let dry = json(&project, &["cache", "gc", "--max-size", &size, "--dry-run", "--json"]);
    assert_eq!(json(&project, &["cache", "stats", "--json"]), stats);
    let freed = json(&project, &["cache", "gc", "--max-size", &size, "--json"]);
    assert_eq!(freed, dry);
    let left = freed["left"]["bytes"].as_u64().unwrap();
    assert!(left <= in_effect + earlier / 2 && left > in_effect, "{freed}");
    let text = project.ok(&["cache", "gc", "--max-size=1kB"]).stdout;
    assert!(text.contains("this is more than 1.0 kB, because the last good outputs always stay"), "{text}");
    let events = project.events(&[]);
    assert!(ran(&events).is_empty(), "the last good outputs are all there");
}

#[test]
fn verify_names_what_it_removes_and_the_next_build_restores_it() {
    let project = edited(1);
    let outputs = project.outputs();
    assert!(project.ok(&["cache", "verify"]).stdout.contains(": all intact"));
    let explained = project.ok(&["explain", "lighting"]).stdout;
    let recipe = json(&project, &["cache", "verify", "--json"]);
    assert_eq!(recipe["lost"], Value::Array(Vec::new()), "{explained}");
    let blobs = files_below(&project.path(".specula/blobs"));
    let largest = blobs.iter().max_by_key(|(_, bytes)| bytes.len()).unwrap().0;
    let mut bytes = blobs[largest].clone();
    let middle = bytes.len() / 2;
    bytes[middle] ^= 1;
    std::fs::write(project.path(&format!(".specula/blobs/{largest}")), bytes).unwrap();
    let run = project.specula(&["cache", "verify"]).ends(1, []);
    assert!(run.stdout.contains("damaged, removed: ") && run.stdout.contains(" the result of "), "{run:?}");
    assert!(!project.path(&format!(".specula/blobs/{largest}")).exists());
    project.ok(&["build"]);
    assert!(project.path(&format!(".specula/blobs/{largest}")).exists(), "the build made it again");
    project.ok(&["cache", "verify"]);
    assert_eq!(project.outputs(), outputs);
}

#[test]
fn a_folder_without_a_cache_and_an_invalid_size_are_reported() {
    let project = Project::small();
    for arguments in [["cache", "stats"], ["cache", "gc"], ["cache", "verify"]] {
        project.specula(&arguments).ends(2, ["there is no cache", "hint: "]);
    }
    project.specula(&["cache", "gc", "--max-size", "much"]).ends(2, ["such as 500M"]);
    assert!(!project.path(".specula").exists());
}

#[test]
fn gc_waits_for_a_build_and_names_itself_to_others() {
    let project = edited(2);
    let children = (0..6).map(|n| match n % 2 {
        0 => project.start(&["build", "--wait"]),
        _ => project.start(&["cache", "gc", "--max-size", "0"]),
    });
    for mut child in children.collect::<Vec<_>>() {
        assert!(child.wait().unwrap().success());
    }
    let holder = std::fs::read_to_string(project.path(".specula/holder")).unwrap();
    assert!(
        holder.contains("\"purpose\":\"build\"") || holder.contains("\"purpose\":\"collect\""),
        "{holder}"
    );
}

#[test]
fn a_killed_collection_leaves_a_valid_cache() {
    let (project, clean) = (edited(1), Project::small());
    for round in 1..25_u32 {
        edit(&project, round);
        project.ok(&["build"]);
        let mut child = project.start(&["cache", "gc", "--max-size", "0"]);
        std::thread::sleep(Duration::from_micros(u64::from(round * 7919 % 12_000)));
        child.kill().unwrap();
        child.wait().unwrap();
        let events = project.events(&[]);
        assert!(ran(&events).is_empty(), "round {round}: the results in effect are kept");
        if round % 8 == 0 {
            edit(&clean, round);
            clean.ok(&["build"]);
            assert_eq!(project.outputs(), clean.outputs(), "round {round}");
        }
    }
    project.ok(&["cache", "gc"]);
    project.ok(&["cache", "verify"]);
}

#[test]
fn prune_removes_what_a_change_of_out_left_behind() {
    let project = edited(1);
    let manifest = std::fs::read_to_string(project.path("pipeline.toml")).unwrap();
    let before = project.outputs();
    assert!(manifest.contains("out = \"out\""), "{manifest}");
    project.write("pipeline.toml", &manifest.replace("out = \"out\"", "out = \"dist\""));
    let files = before.len();
    let warning =
        format!("{files} files in out are no longer exported (published by pipeline.toml): `specula prune`");
    for _ in 0..2 {
        let run = project.ok(&["build", "-q"]);
        assert_eq!(run.stderr.matches(&warning).count(), 1, "{run:?}");
    }
    let left = project.events(&[]).into_iter().find(|event| event["event"] == "leftovers").unwrap();
    assert_eq!((&left["folder"], &left["files"]), (&"out".into(), &files.into()));
    let dry = json(&project, &["prune", "--dry-run", "--json"]);
    assert_eq!(project.outputs(), before);
    let pruned = json(&project, &["prune", "--json"]);
    assert_eq!(dry, pruned);
    assert_eq!(pruned["removed"].as_array().unwrap().len(), files);
    assert!(!project.path("out").exists());
    assert!(project.ok(&["prune"]).stdout.starts_with("nothing to remove"));
    assert!(!project.ok(&["build", "-q"]).stderr.contains("no longer exported"));
}
