//! Two processes in one folder: one holds the lock, the other waits or fails with the name of the first.

use std::fs::File;
use std::io::{BufRead, BufReader};
use std::process::{Child, Stdio};

use crate::support::Project;

/// Holds the lock of the folder as a watcher would.
fn hold(project: &Project) -> File {
    project.ok(&["build"]);
    let lock = File::options().write(true).open(project.path(".specula/lock")).unwrap();
    lock.lock().unwrap();
    project.write(".specula/holder", r#"{"process":77,"since":1772357405000,"purpose":"watch"}"#);
    lock
}

/// Starts a command, and returns when it reports that it waits.
fn waiting(project: &Project, arguments: &[&str]) -> Child {
    let mut child = project.command(arguments).stderr(Stdio::piped()).spawn().unwrap();
    let mut lines = BufReader::new(child.stderr.take().unwrap()).lines();
    let line = lines.find(|line| line.as_ref().unwrap().contains("waiting")).expect("it waits").unwrap();
    assert!(line.contains("for specula watch (process 77, since 2026-03-01 09:30:05 UTC)"), "{line}");
    // The command goes on writing, so its pipe must be read.
    std::thread::spawn(move || lines.for_each(drop));
    child
}

#[test]
fn a_build_that_does_not_wait_names_the_holder_of_the_lock() {
    let project = Project::small();
    let lock = hold(&project);
    let run = project.specula(&["build", "--wait=0"]).ends(4, []);
    let who = "error: specula watch (process 77, since 2026-03-01 09:30:05 UTC) is already running in ";
    assert!(run.stderr.contains(who) && run.stderr.contains("hint: "), "{}", run.stderr);
    // Commands that only read do not need the lock.
    project.ok(&["build", "--dry-run"]);
    project.ok(&["explain", "map"]);
    drop(lock);
    project.ok(&["build", "--wait=0"]);
}

#[test]
fn a_build_waits_until_the_lock_is_free() {
    let project = Project::small();
    for wait in ["--wait", "--wait=600"] {
        let lock = hold(&project);
        let mut child = waiting(&project, &["build", wait]);
        assert!(child.try_wait().unwrap().is_none());
        drop(lock);
        assert!(child.wait().unwrap().success());
    }
}

#[cfg(unix)]
#[test]
fn ctrl_c_ends_the_wait() {
    let project = Project::small();
    let _lock = hold(&project);
    let mut child = waiting(&project, &["build", "--wait"]);
    let kill = std::process::Command::new("kill").args(["-INT", &child.id().to_string()]).status();
    assert!(kill.unwrap().success());
    assert_eq!(child.wait().unwrap().code(), Some(130));
}

#[test]
fn builds_at_the_same_time_all_succeed() {
    let (project, clean) = (Project::small(), Project::small());
    for round in 0..3 {
        for project in [&project, &clean] {
            let exponent = 1.0 + f64::from(round);
            project.write(
                "assets/materials/gold.toml",
                &format!("model = \"phong\"\nexponent = {exponent}\nspecular = 1\n"),
            );
        }
        let children = (0..4).map(|_| project.start(&["build", "--wait"])).collect::<Vec<_>>();
        for mut child in children {
            assert_eq!(child.wait().unwrap().code(), Some(0));
        }
        clean.ok(&["build"]);
        assert_eq!(project.outputs(), clean.outputs());
    }
}
