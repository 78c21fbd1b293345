//! Killing the watcher at any moment, while files are edited, loses nothing and corrupts nothing.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::time::{Duration, Instant};

use crate::support::{Project, assert_whole, uniform};
use test_data::{length, say};

/// The number of versions of the material.
const VERSIONS: u64 = 12;

fn material(version: u64) -> String {
    format!("model = \"phong\"\nexponent = {}\nspecular = 1\n", 4.0 + version as f64 / 2.0)
}

/// Edits the material: in place, or by a rename as most editors do.
fn edit(project: &Project, version: u64, in_place: bool) {
    let name = "assets/materials/gold.toml";
    if in_place {
        return project.write(name, &material(version));
    }
    let temporary = project.path("assets/materials/.gold.toml.new");
    fs::write(&temporary, material(version)).unwrap();
    // On Windows a watcher that reads the file is in the way for a moment.
    let deadline = Instant::now() + Duration::from_secs(10);
    while let Err(error) = fs::rename(&temporary, project.path(name)) {
        assert!(Instant::now() < deadline, "{error}");
    }
}

/// What a clean build of each version writes, and how long one takes.
fn clean_builds() -> (Vec<BTreeMap<String, Vec<u8>>>, Duration) {
    let clean = Project::small();
    let start = Instant::now();
    let outputs = (0..VERSIONS).map(|version| {
        edit(&clean, version, true);
        clean.ok(&["build"]);
        clean.outputs()
    });
    let outputs = outputs.collect::<Vec<_>>();
    (outputs, start.elapsed() / u32::try_from(VERSIONS).unwrap())
}

#[test]
fn a_kill_of_a_watcher_at_any_moment_leaves_every_output_whole_and_the_next_start_correct() {
    const TEST: &str =
        "a_kill_of_a_watcher_at_any_moment_leaves_every_output_whole_and_the_next_start_correct";
    let kills = length(TEST, "kills", 120, 15);
    let (clean, build) = clean_builds();
    let known = clean.iter().flatten().map(|(name, bytes)| (name.clone(), bytes.clone()));
    let known = known.collect::<BTreeSet<_>>();
    let project = Project::small();
    let (mut version, mut edits) = (0, 0_u64);
    edit(&project, version, true);
    for round in 0..kills {
        let mut watcher = project.watch(&["--debounce", "5"]);
        // Every third one is killed while it starts; the others must first repair what the last kill left.
        if round % 3 != 0 {
            watcher.wait_for_build();
            let wanted = &clean[usize::try_from(version).unwrap()];
            assert!(project.outputs() == *wanted, "the start of round {round} did not repair out/");
        }
        let end = Instant::now() + build.mul_f64(2.0 * uniform(round));
        while Instant::now() < end {
            edits += 1;
            version = (uniform(1000 + edits) * VERSIONS as f64) as u64;
            edit(&project, version, edits % 2 == 0);
            std::thread::sleep(build.mul_f64(0.3 * uniform(9000 + edits)));
        }
        assert!(watcher.lives(), "the watcher of round {round} ended by itself");
        watcher.kill();
        assert_whole(&project, &known, &format!("killed in round {round}"));
    }
    project.ok(&["build"]);
    assert!(project.outputs() == clean[usize::try_from(version).unwrap()], "the last build is not correct");
    assert!(edits > kills / 2, "{edits} edits were made");
    say(&format!("{kills} kills among {edits} edits"));
}
