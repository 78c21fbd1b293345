//! Killing the process at any moment loses nothing and corrupts nothing.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

mod support;

use std::collections::BTreeSet;
use std::time::{Duration, Instant};

use support::Project;

const KILLS: u64 = 200;

/// A fixed sequence of numbers in [0, 1): splitmix64.
fn uniform(seed: u64) -> f64 {
    let mut z = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15).wrapping_add(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
}

fn edit(project: &Project, version: u64) {
    let exponent = 4.0 + version as f64 / 8.0;
    project.write(
        "assets/materials/gold.toml",
        &format!("model = \"phong\"\nexponent = {exponent}\nspecular = 1\n"),
    );
}

/// Every file of `out` is one that a whole build wrote; temporary files are hidden and are swept later.
fn assert_whole(project: &Project, known: &BTreeSet<(String, Vec<u8>)>, moment: &str) {
    for (name, bytes) in project.outputs() {
        let hidden = name.rsplit('/').next().unwrap().starts_with('.');
        let size = bytes.len();
        assert!(
            hidden || known.contains(&(name.clone(), bytes)),
            "{name} ({size} bytes) is no output of a whole build, {moment}"
        );
    }
}

#[test]
fn two_hundred_kills_leave_every_output_whole_and_the_next_build_correct() {
    let (project, clean) = (Project::small(), Project::small());
    let mut known = BTreeSet::new();
    let mut longest = Duration::ZERO;
    let mut killed = 0;
    for round in 0..KILLS {
        edit(&clean, round);
        let start = Instant::now();
        clean.ok(&["build"]);
        longest = longest.max(start.elapsed());
        let wanted = clean.outputs();
        known.extend(wanted.clone());

        edit(&project, round);
        let mut child = project.start(&["build"]);
        std::thread::sleep(longest.mul_f64(uniform(round)));
        killed += u64::from(child.try_wait().unwrap().is_none());
        child.kill().unwrap();
        child.wait().unwrap();
        assert_whole(&project, &known, &format!("killed in round {round}"));

        // Between builds that succeed, several kills follow each other.
        if round % 3 == 2 {
            let run = project.ok(&["build"]);
            assert_eq!(project.outputs(), wanted, "after round {round}\n{}", run.stderr);
        }
    }
    assert!(killed > KILLS / 4, "only {killed} of {KILLS} builds were still running when they were killed");
    eprintln!("{killed} of {KILLS} builds were killed while running");
}
