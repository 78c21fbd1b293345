//! `pipeline/sample_cold`: the sample environments and four materials, from an empty cache to published
//! files.
//!
//! The manifest and the materials beside this file are frozen: they stay as they are when the project's own
//! `pipeline.toml` grows, so that figures can be compared over time. The environments are the project's own.

use std::fs;
use std::path::Path;

use criterion::{BatchSize, Criterion, criterion_group, criterion_main};
use engine::{BuildOptions, Cancel, Plan};
use tempfile::TempDir;

/// A folder with the frozen manifest, and nothing built.
fn cold() -> TempDir {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    let folder = tempfile::tempdir().expect("a temporary folder");
    copy(&here.join("frozen"), folder.path());
    copy(&here.join("../../assets/environments"), &folder.path().join("environments"));
    folder
}

fn copy(from: &Path, to: &Path) {
    fs::create_dir_all(to).expect("a folder can be made");
    for entry in fs::read_dir(from).expect("the folder is there") {
        let entry = entry.expect("the folder can be read");
        if entry.path().is_dir() {
            copy(&entry.path(), &to.join(entry.file_name()));
        } else {
            fs::copy(entry.path(), to.join(entry.file_name())).expect("the file can be copied");
        }
    }
}

fn build(folder: &TempDir) {
    let plan =
        Plan::load(&folder.path().join("pipeline.toml"), &stages::kinds()).expect("the manifest is good");
    let options = BuildOptions::default();
    let summary =
        engine::build(&plan, &options, &Cancel::default(), &|_| {}).expect("the build goes to its end");
    assert!(summary.ran == plan.items.len() && summary.failed == 0, "{summary:?}");
}

fn pipeline(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("pipeline");
    group.sample_size(10);
    group.bench_function("sample_cold", |bencher| {
        bencher.iter_batched_ref(cold, |folder| build(folder), BatchSize::PerIteration);
    });
    group.finish();
}

criterion_group!(benches, pipeline);
criterion_main!(benches);
