//! Builds that find nothing to do, or one changed file: the manifest is read, every file checked, every
//! result looked up. `again` is the same with a session that has built before and knows the journal.

use std::fs;
use std::hint::black_box;
use std::path::{Path, PathBuf};
use std::time::Duration;

use criterion::{BatchSize, Criterion, criterion_group, criterion_main};
// The kinds expect the engine's names at the root of the crate.
use engine::*;
use tempfile::TempDir;
use testkit::kinds;

mod large;
#[path = "../src/testkit.rs"]
#[allow(dead_code, reason = "the kinds of the engine's own tests, which need more of it")]
mod testkit;

const MANIFEST: &str = r#"
schema = 1
[stage]
text = { kind = "text-source", source = "texts/*.txt" }
loud = { kind = "suffix", input = "text", text = "!" }
louder = { kind = "suffix", input = "loud", text = "!!" }
file = { kind = "write", input = "louder" }
"#;

const SHORT: &str = r#"
schema = 1
[stage]
text = { kind = "text-source", source = "texts/*.txt" }
file = { kind = "write", input = "text" }
"#;

/// Reads the manifest and builds; returns how many items ran.
fn run(folder: &Path, kinds: &Kinds) -> usize {
    run_on(&BuildSession::new(None, 0).expect("threads"), folder, kinds)
}

fn run_on(session: &BuildSession, folder: &Path, kinds: &Kinds) -> usize {
    let plan = Plan::load(&folder.join("pipeline.toml"), kinds).expect("the manifest has no errors");
    let options = BuildOptions { keep_going: true, ..BuildOptions::default() };
    let ran = session.build(&plan, &options, &Cancel::default(), &|event| _ = black_box(event));
    ran.expect("the build runs").ran
}

/// An up-to-date project of so many sources.
fn project(manifest: &str, sources: usize, items: usize) -> TempDir {
    let folder = tempfile::tempdir().expect("a temporary folder");
    fs::create_dir(folder.path().join("texts")).expect("a folder");
    fs::write(folder.path().join("pipeline.toml"), manifest).expect("the manifest");
    for n in 0..sources {
        write_source(folder.path(), n, &format!("text {n}"));
    }
    assert_eq!(run(folder.path(), &kinds()), items);
    // The stamps of files that are two seconds old are trusted.
    std::thread::sleep(Duration::from_millis(2100));
    assert_eq!(run(folder.path(), &kinds()), 0);
    folder
}

fn write_source(folder: &Path, n: usize, text: &str) {
    fs::write(folder.join(format!("texts/{n:05}.txt")), text).expect("a source");
}

fn noop(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("engine");
    group.sample_size(20);
    for items in [1000, 10_000] {
        let folder = project(MANIFEST, items / 4, items);
        group.bench_function(format!("noop_{items}_items"), |bencher| {
            bencher.iter(|| run(folder.path(), &kinds()));
        });
        let session = BuildSession::new(None, 0).expect("threads");
        group.bench_function(format!("noop_{items}_items_again"), |bencher| {
            bencher.iter(|| run_on(&session, folder.path(), &kinds()));
        });
    }
    group.finish();
}

/// One source of 10,000 changes: it is found, and its two items run.
fn one_changed(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("engine");
    let folder = project(SHORT, 10_000, 20_000);
    let mut edits = 0;
    let mut edit = || {
        edits += 1;
        write_source(folder.path(), 7919 * edits % 10_000, &format!("edit {edits}"));
    };
    group.sample_size(20);
    group.bench_function("one_changed_of_10000", |bencher| {
        let find = |()| assert_eq!(run(folder.path(), &kinds()), 2);
        bencher.iter_batched(&mut edit, find, BatchSize::PerIteration);
    });
    let session = BuildSession::new(None, 0).expect("threads");
    group.bench_function("one_changed_of_10000_again", |bencher| {
        let find = |()| assert_eq!(run_on(&session, folder.path(), &kinds()), 2);
        bencher.iter_batched(&mut edit, find, BatchSize::PerIteration);
    });
    group.finish();
}

/// 40,000 exports: nothing to do, or one text of 400 edited, so that 402 items run, as a watcher builds them.
fn large_graph(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("engine");
    let folder = tempfile::tempdir().expect("a temporary folder");
    large::make(folder.path());
    assert_eq!(run(folder.path(), &kinds()), 80_800);
    std::thread::sleep(Duration::from_millis(2100));
    group.sample_size(10);
    group.bench_function("noop_80800_items", |bencher| {
        bencher.iter(|| assert_eq!(run(folder.path(), &kinds()), 0));
    });
    let session = BuildSession::new(None, 0).expect("threads");
    let plan =
        Plan::load(&folder.path().join("pipeline.toml"), &kinds()).expect("the manifest has no errors");
    let text = plan.manifest.with_file_name("left").join("007.txt");
    let build = |changed: Option<Vec<PathBuf>>| {
        let options = BuildOptions { keep_going: true, changed, ..BuildOptions::default() };
        session.build(&plan, &options, &Cancel::default(), &|_| {}).expect("the build runs").ran
    };
    assert_eq!(build(None), 0);
    let mut edits = 0;
    let mut edit = || {
        edits += 1;
        fs::write(&text, format!("edit {edits} of {}", std::process::id())).expect("an edit");
    };
    let find = |()| assert_eq!(build(Some(vec![text.clone()])), 402);
    group.bench_function("one_edit_of_80800_items_again", |bencher| {
        bencher.iter_batched(&mut edit, find, BatchSize::PerIteration);
    });
    group.finish();
}

criterion_group!(benches, noop, one_changed, large_graph);
criterion_main!(benches);
