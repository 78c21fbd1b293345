//! A watcher that runs all day does not grow: resident memory after a thousand rebuilds is within a tenth of
//! that after the first hundred. Without `CI` it is 250 rebuilds, and `SPECULA_MEMORY_REBUILDS` sets any
//! other number:
//!
//! `SPECULA_MEMORY_REBUILDS=10000 cargo test --release -p engine --test flat_memory`

#![allow(clippy::unwrap_used, reason = "a test may panic")]

#[path = "../src/testkit.rs"]
#[allow(dead_code, reason = "the kinds of the engine's own tests, which need more of it")]
mod testkit;
mod watching;

use std::fs;

// The kinds expect the engine's names at the root of the crate.
#[allow(unused_imports, reason = "some of them")]
use engine::*;
use test_data::{length, say, skip};
use watching::Watcher;

const TEST: &str = "resident_memory_stays_flat_over_a_thousand_rebuilds";

const MANIFEST: &str = r#"
schema = 1
[stage]
text = { kind = "text-source", source = "texts/*.txt" }
word = { kind = "text-source", source = "words/*.txt" }
upper = { kind = "upper", input = "text" }
pair = { kind = "concat", inputs = { left = "upper", right = "word" } }
file = { kind = "write", input = "pair", path = "{text}/{word}" }
"#;

/// The KiB that the index of earlier results may take; it reaches this limit after some 200 rebuilds
/// (`retention.rs`): twice the lines of 1200 results and 100 others, and 1000 more, of 150 bytes each. So
/// 1000 rebuilds that leak 2 KiB each fail, and 250 that leak 10 KiB each.
const INDEX: f64 = 3600.0 * 150.0 / 1024.0;

/// The memory of this process that is in RAM, in KiB; `None` if the system does not report it.
fn resident() -> Option<u64> {
    let status = fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"))?;
    line.trim().trim_end_matches("kB").trim().parse().ok()
}

#[test]
fn resident_memory_stays_flat_over_a_thousand_rebuilds() {
    if resident().is_none() {
        return skip(TEST, "this system does not report the memory of a process");
    }
    let rebuilds = std::env::var("SPECULA_MEMORY_REBUILDS").ok().map(|text| text.parse().unwrap());
    let rebuilds = rebuilds.unwrap_or_else(|| length(TEST, "rebuilds", 1000, 250));
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| {
        let path = folder.path().join(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        // Replaced in one step, so that each edit triggers one rebuild.
        let temporary = path.with_file_name(".new");
        fs::write(&temporary, text).unwrap();
        fs::rename(temporary, path).unwrap();
    };
    write("pipeline.toml", MANIFEST);
    for index in 0..4 {
        write(&format!("texts/t{index}.txt"), &"text ".repeat(200));
        write(&format!("words/w{index}.txt"), &"word ".repeat(200));
    }
    // So little memory for artifacts that its limit is reached soon.
    let manifest = folder.path().join("pipeline.toml");
    let mut watcher = Watcher::start(manifest, testkit::kinds(), None, 64 << 10);
    watcher.wait("start", |event| matches!(event, Event::Watching { .. }));
    let mut early = 0;
    for rebuild in 1..=rebuilds {
        write(&format!("texts/t{}.txt", rebuild % 4), &format!("{rebuild} ").repeat(200));
        watcher.wait_for_build();
        if rebuild == 100 {
            early = resident().unwrap();
        }
        if rebuild % 500 == 0 {
            say(&format!("after {rebuild} rebuilds: {} KiB", resident().unwrap()));
        }
    }
    let late = resident().unwrap();
    watcher.stop();
    say(&format!("resident memory: {early} KiB after 100 rebuilds, {late} KiB after {rebuilds}"));
    assert!(
        late as f64 <= 1.1 * early as f64 + INDEX,
        "{early} KiB after 100 rebuilds, {late} after {rebuilds}"
    );
}
