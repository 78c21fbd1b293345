//! A small simulation of many workers: all items run, and what they make depends on them alone.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::time::Duration;

use engine::{Digest, Plan};
use research::worker_simulation::server::{ModelServer, Workers};
use research::worker_simulation::{Client, Measured, Project, build, kinds};

/// The digest of each file below a folder, by its path.
fn files(folder: &Path) -> BTreeMap<String, String> {
    let (mut found, mut folders) = (BTreeMap::new(), vec![folder.to_path_buf()]);
    while let Some(next) = folders.pop() {
        for entry in fs::read_dir(next).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else {
                let name = path.strip_prefix(folder).unwrap().to_str().unwrap().to_owned();
                found.insert(name, Digest::of(&fs::read(path).unwrap()).to_string());
            }
        }
    }
    found
}

#[test]
fn all_items_run_and_two_simulations_make_the_same() {
    let project = Project::of_items(100);
    let simulate = || {
        let folder = tempfile::tempdir().unwrap();
        project.write(folder.path(), 0.01).unwrap();
        let plan = Plan::load(&folder.path().join("pipeline.toml"), &kinds()).unwrap();
        let workers = Workers { count: 10, times: 0.01, share: 0.01 };
        let measured = Measured::new(&plan).unwrap();
        let server = ModelServer::start(workers, measured, Duration::from_millis(1)).unwrap();
        let client = Client { address: server.address(), jobs: 10, runs: true };
        // It fails unless each item runs on a worker.
        let outcome = build(folder.path(), &client).unwrap();
        assert_eq!(outcome["items"], project.items());
        let report = server.report();
        assert_eq!(report["calls"]["UpdateActionResult"], project.items());
        assert!(report["actions"].as_u64().unwrap() >= project.items() as u64, "{report}");
        // Another folder has nothing, and gets all of it from the cache.
        let other = tempfile::tempdir().unwrap();
        project.write(other.path(), 0.01).unwrap();
        build(other.path(), &Client { runs: false, ..client }).unwrap();
        let made = files(&folder.path().join("out"));
        assert_eq!(made, files(&other.path().join("out")));
        server.stop();
        made
    };
    let made = simulate();
    assert!(made.len() > 200, "{} files", made.len());
    assert_eq!(made, simulate());
}
