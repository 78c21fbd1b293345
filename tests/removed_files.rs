//! Files that are removed from `out`, with the cause: one line for all files of one cause.

use std::fs;

use crate::support::{Project, SMALL, assert_has};
use serde_json::{Value, json};

const MATERIALS: &str = "assets/materials";

/// A project with two more materials, which are built.
fn built() -> Project {
    let project = Project::small();
    project.write(&format!("{MATERIALS}/brass.toml"), "model = \"lambert\"\nalbedo = 0.5\n");
    project.write(&format!("{MATERIALS}/clay.toml"), "model = \"lambert\"\nalbedo = 0.25\n");
    project.ok(&["build"]);
    project
}

fn material(name: &str) -> String {
    format!("{MATERIALS}/{name}.toml")
}

/// The causes of removals that a dry run, the events of a build and its lines report; they must agree.
fn causes(project: &Project) -> Vec<(Value, usize)> {
    let count = |events: &[Value]| {
        let mut causes = Vec::<(Value, usize)>::new();
        for event in events.iter().filter(|event| event["event"] == "removed") {
            assert!(event["item"]["stage"].is_string(), "{event}");
            match causes.iter_mut().find(|(cause, _)| *cause == event["because"]) {
                Some((_, count)) => *count += 1,
                None => causes.push((event["because"].clone(), 1)),
            }
        }
        causes
    };
    let dry = count(&project.events(&["--dry-run"]));
    let found = count(&project.events(&[]));
    assert_eq!(dry, found, "a dry run reports what a build does");
    found
}

/// The lines of a build that say why files were removed, or would be.
fn lines(project: &Project, arguments: &[&str]) -> Vec<String> {
    let run = project.ok(&[&["build"], arguments].concat());
    let lines = run.stderr.lines().map(str::trim).filter(|line| line.ends_with("removed"));
    lines.map(str::to_owned).collect()
}

#[test]
fn a_deleted_source_is_named_once_with_the_number_of_its_files() {
    let project = built();
    fs::remove_file(project.path(&material("brass"))).unwrap();
    let before = project.outputs();
    let said = format!("{} was deleted: 7 files removed", material("brass"));
    assert_eq!(lines(&project, &["--dry-run"]), [said.replace("removed", "would be removed")]);
    assert_eq!(project.outputs(), before);
    assert_eq!(lines(&project, &[]), [said]);

    let project = built();
    fs::remove_file(project.path(&material("brass"))).unwrap();
    assert_has(project.ok(&["build", "--verbose"]).stderr, ["removed  maps/brass.exr\n"]);
}

#[test]
fn each_cause_is_said_as_it_is() {
    let project = built();
    for name in ["brass", "clay"] {
        fs::remove_file(project.path(&material(name))).unwrap();
    }
    let deleted = |name: &str| json!({ "cause": "source-deleted", "path": material(name) });
    assert_eq!(causes(&project), [(deleted("brass"), 7), (deleted("clay"), 7)]);

    let project = built();
    fs::rename(project.path(&material("brass")), project.path(&material("tin"))).unwrap();
    let renamed = json!({ "cause": "source-renamed", "path": material("brass"), "to": material("tin") });
    assert_eq!(causes(&project), [(renamed, 7)]);

    let project = built();
    project.write("pipeline.toml", &SMALL.replace("materials/*.toml", "materials/c*.toml"));
    let excluded =
        |name: &str| json!({ "cause": "source-excluded", "path": material(name), "stage": "material" });
    let found = causes(&project);
    assert!(found.contains(&(excluded("brass"), 7)) && found.contains(&(excluded("gold"), 7)), "{found:#?}");

    let project = built();
    let start = SMALL.find("[stage.faces]").unwrap();
    let end = SMALL.find("[stage.sh]").unwrap();
    project.write("pipeline.toml", &[&SMALL[..start], &SMALL[end..]].concat());
    let gone = json!({ "cause": "stage-gone", "stage": "faces", "manifest": "pipeline.toml" });
    let faces = project.outputs().keys().filter(|name| name.starts_with("faces/")).count();
    assert_eq!(causes(&project), [(gone, faces)]);

    let project = built();
    let maps = project.outputs().keys().filter(|name| name.starts_with("maps/")).count();
    project.write("pipeline.toml", &SMALL.replace("maps/{material}", "new/{material}"));
    let line = format!("stage map exports other files now: {maps} files removed");
    assert_eq!(lines(&project, &[]), [line]);
    project.write("pipeline.toml", SMALL);
    let moved = json!({ "cause": "files-changed", "stage": "map" });
    assert_eq!(causes(&project), [(moved, maps)]);
}

#[test]
fn a_watcher_says_it_too() {
    let project = built();
    let mut watcher = project.watch(&[]);
    watcher.wait_until_it_watches();
    fs::remove_file(project.path(&material("brass"))).unwrap();
    let events = watcher.wait("ended", |end| end["removed"] == 7);
    let removed = events.iter().find(|event| event["event"] == "removed").unwrap();
    assert_eq!(removed["because"], json!({ "cause": "source-deleted", "path": material("brass") }));
}
