//! Killing the process at any moment loses nothing and corrupts nothing.

use std::collections::BTreeSet;
use std::time::Instant;

use crate::support::{Project, assert_whole, uniform};
use test_data::length;

fn edit(project: &Project, version: u64) {
    let exponent = 4.0 + version as f64 / 8.0;
    project.write(
        "assets/materials/gold.toml",
        &format!("model = \"phong\"\nexponent = {exponent}\nspecular = 1\n"),
    );
}

/// Kills so many builds while they run, each after another edit; after every `between` rounds a build must
/// give what a clean one gives.
fn kill(kills: u64, between: u64) {
    let (project, clean) = (Project::small(), Project::small());
    let mut known = BTreeSet::new();
    let (mut round, mut killed) = (0, 0);
    while killed < kills {
        edit(&clean, round);
        let start = Instant::now();
        clean.ok(&["build"]);
        let whole = start.elapsed();
        let wanted = clean.outputs();
        known.extend(wanted.clone());

        edit(&project, round);
        let mut child = project.start(&["build"]);
        std::thread::sleep(whole.mul_f64(uniform(round)));
        killed += u64::from(child.try_wait().unwrap().is_none());
        child.kill().unwrap();
        child.wait().unwrap();
        assert_whole(&project, &known, &format!("killed in round {round}"));

        round += 1;
        assert!(
            round < 10 * kills,
            "only {killed} of {round} builds were still running when they were killed"
        );
        if round % between == 0 {
            let run = project.ok(&["build"]);
            assert_eq!(project.outputs(), wanted, "before round {round}\n{}", run.stderr);
        }
    }
}

#[test]
fn a_kill_at_any_moment_leaves_every_output_whole_and_the_next_build_correct() {
    const TEST: &str = "a_kill_at_any_moment_leaves_every_output_whole_and_the_next_build_correct";
    kill(length(TEST, "kills", 80, 10), 1);
}

#[test]
fn one_build_repairs_what_several_kills_left() {
    kill(length("one_build_repairs_what_several_kills_left", "kills", 30, 10), 5);
}
