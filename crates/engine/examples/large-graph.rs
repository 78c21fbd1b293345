//! The cost of a build of a large graph: 200 texts joined with 200 others and exported, 80,800 items and
//! 40,000 files.
//!
//! ```sh
//! cargo run --release -p engine --example large-graph -- make FOLDER
//! cargo run --release -p engine --example large-graph -- build FOLDER         # again: nothing to do
//! cargo run --release -p engine --example large-graph -- watch FOLDER 20      # so many edits of one text
//! ```
//!
//! It prints milliseconds and the process's peak memory.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::mpsc::channel;
use std::time::{Duration, Instant};

// The kinds expect the engine's names at the root of the crate.
#[allow(unused_imports, reason = "some of them")]
use engine::*;

#[path = "../benches/large/mod.rs"]
mod large;
#[path = "../src/testkit.rs"]
#[allow(dead_code, reason = "the kinds of the engine's own tests, which need more of it")]
mod testkit;

fn main() {
    let arguments = std::env::args().skip(1).collect::<Vec<_>>();
    match arguments.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        ["make", folder] => large::make(Path::new(folder)),
        ["build", folder] => build(&Path::new(folder).join("pipeline.toml")),
        ["watch", folder, edits] => watch(Path::new(folder), number(edits), 1500),
        ["watch", folder, edits, pause] => watch(Path::new(folder), number(edits), number(pause) as u64),
        _ => println!("large-graph make FOLDER | build FOLDER | watch FOLDER EDITS [MILLISECONDS BETWEEN]"),
    }
}

fn number(text: &str) -> usize {
    text.parse().expect("a number")
}

fn build(manifest: &Path) {
    let clock = Instant::now();
    let plan = Plan::load(manifest, &testkit::kinds()).expect("the manifest has no errors");
    let loaded = milliseconds(clock.elapsed());
    let options = BuildOptions { keep_going: true, ..BuildOptions::default() };
    let summary = engine::build(&plan, &options, &Cancel::default(), &|_| {}).expect("the build goes on");
    println!(
        "{} items: {} ran; {:.0} ms, {loaded:.0} of them for the plan; {} MiB",
        plan.items.len(),
        summary.ran,
        milliseconds(clock.elapsed()),
        peak_memory() >> 10,
    );
}

/// Edits one text repeatedly; prints the time from the edit to the end of the build.
fn watch(folder: &Path, edits: usize, pause: u64) {
    let manifest: PathBuf = folder.join("pipeline.toml");
    let options = WatchOptions {
        build: BuildOptions { keep_going: true, ..BuildOptions::default() },
        debounce: Duration::from_millis(20),
        poll: None,
        once: false,
        memory: 1 << 30,
        cache_limit: None,
    };
    let cancel = Cancel::default();
    let (sender, receiver) = channel();
    std::thread::scope(|scope| {
        let watcher = scope.spawn(|| {
            let events = |event: Event| {
                if matches!(event, Event::Ended(_) | Event::Watching { .. }) {
                    let _ = sender.send((Instant::now(), event));
                }
            };
            engine::watch(
                &engine::ManifestFile::of(&manifest),
                &testkit::kinds(),
                &options,
                &cancel,
                &events,
            )
            .expect("it watches");
        });
        while let Ok((_, event)) = receiver.recv() {
            if matches!(event, Event::Watching { .. }) {
                break;
            }
        }
        let mut times = Vec::new();
        for edit in 0..edits {
            std::thread::sleep(Duration::from_millis(pause));
            while receiver.try_recv().is_ok() {}
            let began = Instant::now();
            let name = format!("left/{:03}.txt", (edit * 7) % 200);
            fs::write(folder.join(name), format!("edit {edit} of {}", std::process::id())).expect("an edit");
            let ended = loop {
                match receiver.recv().expect("the watcher goes on") {
                    (time, Event::Ended(summary)) if summary.ran > 0 => {
                        println!("{} items ran, {} files", summary.ran, summary.published);
                        break time;
                    }
                    _ => {}
                }
            };
            times.push(milliseconds(ended - began));
        }
        cancel.cancel();
        watcher.join().expect("it ends");
        times.sort_by(f64::total_cmp);
        println!(
            "{edits} edits: median {:.0} ms, longest {:.0} ms; {} MiB",
            times[times.len() / 2],
            times.last().copied().unwrap_or_default(),
            peak_memory() >> 10,
        );
    });
}

fn milliseconds(time: Duration) -> f64 {
    time.as_secs_f64() * 1e3
}

/// The peak resident memory so far, in KiB; 0 if the system does not report it.
fn peak_memory() -> u64 {
    let status = fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    line.and_then(|line| line.trim().trim_end_matches(" kB").parse().ok()).unwrap_or_default()
}
