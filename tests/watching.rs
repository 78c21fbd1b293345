//! `specula watch` end to end: what it reports and publishes, how it shares a folder, and how it ends.

use std::io::{BufRead, BufReader};
use std::process::Stdio;
use std::time::{Duration, Instant};

use crate::support::{Project, SMALL, TIMEOUT, assert_has, ran};
use serde_json::Value;

/// The number of files that depend on one material: a map and six faces.
const PUBLISHED: u64 = 7;

const GOLD: &str = "assets/materials/gold.toml";

fn phong(exponent: u32) -> String {
    format!("model = \"phong\"\nexponent = {exponent}\nspecular = 1\n")
}

/// Waits until `out` equals that of a clean build of the same sources.
fn await_clean_outputs(project: &Project, manifest: &str, gold: &str) {
    let clean = Project::new(manifest);
    clean.write(GOLD, gold);
    clean.ok(&["build"]);
    let (wanted, deadline) = (clean.outputs(), Instant::now() + TIMEOUT);
    while project.outputs() != wanted {
        assert!(Instant::now() < deadline, "out/ does not become that of a clean build");
        std::thread::sleep(Duration::from_millis(20));
    }
}

fn names<'a>(events: &'a [Value], event: &str, field: &str) -> Vec<&'a str> {
    let found = events.iter().filter(|found| found["event"] == event);
    found.map(|found| found[field].as_str().unwrap()).collect()
}

#[test]
fn after_an_edit_of_a_material_only_what_depends_on_it_runs_and_is_published() {
    let project = Project::small();
    let mut watcher = project.watch(&[]);
    watcher.wait_until_it_watches();
    // An edit that comes before everything is watched is built without a `noticed` event.
    let (exponent, events) = (9..12)
        .map(|exponent| {
            project.write(GOLD, &phong(exponent));
            (
                exponent,
                watcher.wait("ended", |end| end["cancelled"] == false && end["published"] == PUBLISHED),
            )
        })
        .find(|(_, events)| events.iter().any(|event| event["event"] == "noticed"))
        .unwrap();
    let noticed = events.iter().find(|event| event["event"] == "noticed").unwrap();
    assert_eq!(noticed["changes"][0]["path"], GOLD);
    assert_eq!(noticed["changes"][0]["what"], "changed");
    let stages = ran(&events);
    for stage in ["material", "coefficients", "reflection", "map", "faces"] {
        assert_eq!(stages.get(stage), Some(&1), "{stage}: {stages:?}");
    }
    assert!(!stages.contains_key("environment") && !stages.contains_key("lighting"), "{stages:?}");
    let mut published = names(&events, "published", "file");
    published.sort_unstable();
    let faces = ["nx", "ny", "nz", "px", "py", "pz"].map(|face| format!("faces/gold/{face}.exr"));
    assert_eq!(published[..6], faces);
    assert_eq!(published[6..], ["maps/gold.exr"]);
    await_clean_outputs(&project, SMALL, &phong(exponent));
}

#[test]
fn errors_of_a_manifest_are_reported_and_the_last_valid_one_is_used_until_they_are_corrected() {
    let project = Project::small();
    let mut watcher = project.watch(&[]);
    watcher.wait_until_it_watches();
    project.write("pipeline.toml", &SMALL.replace("resolution = 16", "resolutoin = 16"));
    let events = watcher.wait("rejected", |event| event.to_string().contains("resolutoin"));
    assert_has(events[events.len() - 1].to_string(), ["did you mean"]);
    // Meanwhile edits are built with the last valid manifest.
    project.write(GOLD, &phong(7));
    watcher.wait("ended", |end| end["cancelled"] == false && end["published"] == PUBLISHED);
    let corrected = SMALL.replace("resolution = 16", "resolution = 8");
    project.write("pipeline.toml", &corrected);
    watcher.wait("accepted", |_| true);
    watcher.wait_for_build();
    await_clean_outputs(&project, &corrected, &phong(7));
}

#[test]
fn an_item_that_fails_keeps_its_last_good_outputs_until_it_succeeds() {
    let project = Project::small();
    let mut watcher = project.watch(&[]);
    watcher.wait_until_it_watches();
    let good = project.outputs();
    project.write(GOLD, "model = \"phong\"\nexponent = -1\n");
    watcher.wait("failed", |event| event["error"].to_string().contains("exponent"));
    watcher.wait_for_build();
    assert_eq!(project.outputs(), good);
    project.write(GOLD, &phong(3));
    watcher.wait("ended", |end| end["cancelled"] == false && end["published"] == PUBLISHED);
    await_clean_outputs(&project, SMALL, &phong(3));
}

#[test]
fn a_build_beside_a_watcher_and_two_watchers_get_along() {
    let project = Project::small();
    let (mut first, mut second) = (project.watch(&[]), project.watch(&[]));
    first.wait_until_it_watches();
    second.wait_until_it_watches();
    // An idle watcher does not hold the lock.
    project.specula(&["build"]).ends(0, ["Up to date: all "]);
    for exponent in 10..15 {
        project.write(GOLD, &phong(exponent));
        // One of them runs the items, the other finds them up to date. The build may find the folder locked.
        let run = project.specula(&["build"]);
        assert!(matches!(run.code, Some(0 | 4)), "{}", run.stderr);
        assert!(run.code == Some(0) || run.stderr.contains("another build"), "{}", run.stderr);
    }
    await_clean_outputs(&project, SMALL, &phong(14));
    assert!(first.lives() && second.lives());
}

#[test]
fn once_returns_after_the_first_rebuild_with_its_exit_code() {
    for (text, code) in [(phong(9), 0), ("model = \"phong\"\nexponent = -1\n".into(), 1)] {
        let project = Project::small();
        let mut watcher = project.watch(&["--once"]);
        watcher.wait_until_it_watches();
        // Replaced in one step, because a truncated file would be a change of its own.
        project.write("assets/materials/.new", &text);
        std::fs::rename(project.path("assets/materials/.new"), project.path(GOLD)).unwrap();
        watcher.wait_for_build();
        assert_eq!(watcher.wait_for_exit(), Some(code));
    }
}

#[test]
fn once_says_that_the_change_broke_the_manifest() {
    let project = Project::small();
    let mut watcher = project.watch(&["--once"]);
    watcher.wait_until_it_watches();
    project.write("new", &SMALL.replace("resolution = 16", "resolutoin = 16"));
    std::fs::rename(project.path("new"), project.path("pipeline.toml")).unwrap();
    watcher.wait("rejected", |_| true);
    assert_eq!(watcher.wait_for_exit(), Some(3));
}

#[test]
fn polling_finds_changes() {
    let project = Project::small();
    let mut watcher = project.watch(&["--poll", "50"]);
    let events = watcher.wait("watching", |_| true);
    assert_eq!(events[events.len() - 1]["poll_milliseconds"], 50.0);
    project.write(GOLD, &phong(9));
    watcher.wait("ended", |end| end["cancelled"] == false && end["published"] == PUBLISHED);
    await_clean_outputs(&project, SMALL, &phong(9));
}

#[test]
fn an_unknown_stage_ends_the_watcher_with_the_nearest_name() {
    Project::small().specula(&["watch", "reflecton"]).ends(2, ["did you mean \"reflection\""]);
}

#[test]
fn a_watcher_ends_when_its_reader_has_gone() {
    let project = Project::small();
    let mut child = project.command(&["watch", "--json"]).stdout(Stdio::piped()).spawn().unwrap();
    let mut lines = BufReader::new(child.stdout.take().unwrap()).lines();
    assert!(lines.any(|line| line.unwrap().contains("\"event\":\"watching\"")));
    drop(lines);
    let deadline = Instant::now() + TIMEOUT;
    for exponent in 9.. {
        project.write(GOLD, &phong(exponent));
        std::thread::sleep(Duration::from_millis(200));
        if let Some(status) = child.try_wait().unwrap() {
            assert_eq!(status.code(), Some(0));
            return;
        }
        assert!(Instant::now() < deadline, "it goes on without a reader");
    }
}

/// Sends a signal to a process, as Ctrl-C does.
#[cfg(unix)]
fn interrupt(process: u32) {
    let sent =
        std::process::Command::new("sh").args(["-c", &format!("kill -INT {process}")]).status().unwrap();
    assert!(sent.success());
}

#[cfg(unix)]
#[test]
fn control_c_ends_watching_with_success() {
    for (arguments, code) in [(&[][..], 0), (&["--once"], 130)] {
        let project = Project::small();
        let mut watcher = project.watch(arguments);
        watcher.wait_until_it_watches();
        interrupt(watcher.id());
        assert_eq!(watcher.wait_for_exit(), Some(code), "{arguments:?}");
    }
}
