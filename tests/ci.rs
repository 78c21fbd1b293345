//! The jobs of docs/ci.md run, and their reports, caches and files are where they say.

#![cfg(unix)]

use std::fs;
use std::process::Command;

use roxmltree::Document;
use serde_json::Value;

use crate::support::{Project, root};

/// The blocks of docs/ci.md in YAML, in their order.
fn jobs() -> [Value; 2] {
    let page = fs::read_to_string(root().join("docs/ci.md")).unwrap();
    let blocks = page.split("```yaml\n").skip(1).map(|rest| rest.split_once("```").unwrap().0);
    let jobs: Vec<Value> = blocks.map(|text| yaml_serde::from_str(text).unwrap()).collect();
    jobs.try_into().unwrap()
}

/// Runs the lines of a job as CI servers do: one after the other, until one fails.
fn run(project: &Project, lines: &[Value]) {
    let program = std::path::Path::new(env!("CARGO_BIN_EXE_specula")).parent().unwrap();
    let path = std::env::var_os("PATH").unwrap();
    let folders = [program.to_path_buf()].into_iter().chain(std::env::split_paths(&path));
    let path = std::env::join_paths(folders).unwrap();
    for line in lines {
        let mut command = Command::new("bash");
        command.args(["-eo", "pipefail", "-c", line.as_str().unwrap()]).env("PATH", &path);
        let output = command.current_dir(project.path("")).output().unwrap();
        assert!(output.status.success(), "{line}: {}", String::from_utf8_lossy(&output.stderr));
    }
}

/// Runs a job twice, as two checkouts that share the folders of its cache do: the second runs no item.
fn check(lines: &[Value], cache: &Value, files: &[&str], report: &str) {
    assert!(lines.len() >= 2, "{lines:?}");
    let project = Project::small();
    run(&project, lines);
    let built = project.outputs();
    let again = Project::small();
    let cache = cache.as_str().unwrap();
    fs::rename(project.path(cache), again.path(cache)).unwrap();
    run(&again, lines);
    assert_eq!(again.outputs(), built);
    for file in files {
        assert!(again.path(file).exists(), "the job makes {file}");
    }
    let text = fs::read_to_string(again.path(report)).unwrap();
    let report = Document::parse(&text).unwrap();
    let cases = report.descendants().filter(|node| node.has_tag_name("testcase")).collect::<Vec<_>>();
    assert!(cases.len() > 5, "{text}");
    for case in cases {
        let note = case.first_element_child().and_then(|note| note.text());
        assert_eq!(note, Some("up to date"), "{text}");
    }
}

#[test]
fn the_job_for_github_runs_and_keeps_its_cache() {
    let [job, _] = jobs();
    let steps = job["jobs"]["light"]["steps"].as_array().unwrap();
    let uses = |action: &str| {
        let is_it = |step: &&Value| step["uses"].as_str().is_some_and(|uses| uses.starts_with(action));
        &steps.iter().find(is_it).unwrap_or_else(|| panic!("{action} is used"))["with"]["path"]
    };
    let files = uses("actions/upload-artifact").as_str().unwrap();
    let files = files.split_whitespace().collect::<Vec<_>>();
    let lines = steps.iter().filter_map(|step| step.get("run").cloned()).collect::<Vec<_>>();
    check(&lines, uses("actions/cache"), &files, files[1]);
}

#[test]
fn the_job_for_gitlab_runs_and_keeps_its_cache() {
    let [_, job] = jobs();
    let job = &job["light"];
    let artifacts = &job["artifacts"];
    let files = [&artifacts["paths"][0], &artifacts["reports"]["junit"]].map(|file| file.as_str().unwrap());
    check(job["script"].as_array().unwrap(), &job["cache"]["paths"][0], &files, files[1]);
}
