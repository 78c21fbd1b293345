//! `.ci/run` builds tests twice, with other features, and must not compile every crate twice.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::process::Command;

use crate::root;

/// Crates whose features the second build selects, which is what it is for.
const SELECTED: [&str; 4] = ["cli", "preview", "preview-window", "remote"];

/// The features of every library that cargo compiles for tests with these options; `None` if cargo has not
/// downloaded a crate, and cannot now.
fn features(options: &[&str]) -> Option<BTreeMap<String, BTreeSet<String>>> {
    let output = Command::new(env!("CARGO"))
        .args(["tree", "--locked", "--edges", "normal,build,dev", "--prefix", "none", "--format", "{p}#{f}"])
        .args(options)
        .current_dir(root())
        .output()
        .unwrap();
    let errors = String::from_utf8_lossy(&output.stderr);
    if !output.status.success() && errors.contains("failed to download") {
        test_data::skip("selections", &format!("`cargo fetch` gets what {options:?} need"));
        return None;
    }
    assert!(output.status.success(), "{options:?}: {errors}");
    let mut found: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    for line in String::from_utf8(output.stdout).unwrap().lines() {
        let Some((package, features)) = line.trim_end_matches(" (*)").split_once('#') else { continue };
        let name_and_version = package.split(' ').take(2).collect::<Vec<_>>().join(" ");
        let features = features.split(',').filter(|name| !name.is_empty()).map(str::to_owned);
        found.entry(name_and_version).or_default().extend(features);
    }
    Some(found)
}

/// A library with another feature is compiled again, and so is all that depends on it.
#[test]
fn both_builds_of_tests_have_the_same_libraries() {
    let script = fs::read_to_string(root().join(".ci/run")).unwrap();
    let line = script.lines().find_map(|line| line.strip_prefix("with_features=(")).unwrap();
    let words: Vec<&str> = line.trim_end_matches(')').split(' ').collect();
    let options: Vec<&str> = words.into_iter().skip_while(|word| *word != "--features").collect();
    let (Some(one), Some(other)) = (features(&["--workspace"]), features(&options)) else { return };
    let mut compared = 0;
    for (package, of) in &one {
        let name = package.split(' ').next().unwrap();
        let Some(with) = other.get(package).filter(|_| !SELECTED.contains(&name)) else { continue };
        assert_eq!(of, with, "features of {package}: crates/bench/Cargo.toml gives both builds the same");
        compared += 1;
    }
    assert!(compared > 200, "{compared} libraries");
}
