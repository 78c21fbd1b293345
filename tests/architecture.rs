//! The invariants of `ARCHITECTURE.md`, held against the dependency graph.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use cargo_metadata::{DependencyKind, MetadataCommand};

const KERNELS: [&str; 7] = ["sphere", "sh", "sampling", "envmap", "brdf", "shrm", "mesh"];

/// The normal and build dependencies of every crate of the workspace, direct and indirect, by name.
fn reach() -> BTreeMap<String, BTreeSet<String>> {
    let root = concat!(env!("CARGO_MANIFEST_DIR"), "/../../Cargo.toml");
    let metadata =
        MetadataCommand::new().manifest_path(root).other_options(["--locked".into()]).exec().unwrap();
    let resolve = metadata.resolve.as_ref().unwrap();
    let nodes: BTreeMap<_, _> = resolve.nodes.iter().map(|node| (&node.id, node)).collect();
    let members = metadata.workspace_packages();
    let mut reach = BTreeMap::new();
    for member in members {
        let (mut seen, mut open) = (BTreeSet::new(), vec![&member.id]);
        while let Some(id) = open.pop() {
            for dependency in &nodes[id].deps {
                let shipped =
                    dependency.dep_kinds.iter().any(|kind| kind.kind != DependencyKind::Development);
                if shipped && seen.insert(&dependency.pkg) {
                    open.push(&dependency.pkg);
                }
            }
        }
        let names = seen.iter().map(|id| metadata[*id].name.to_string()).collect();
        reach.insert(member.name.to_string(), names);
    }
    assert!(reach.len() >= 9, "the workspace was read: {reach:?}");
    reach
}

fn assert_absent(reach: &BTreeMap<String, BTreeSet<String>>, from: &str, forbidden: &[&str]) {
    for name in forbidden {
        assert!(!reach[from].contains(*name), "{from} must not depend on {name}");
    }
}

#[test]
fn kernels_touch_no_serialisation_and_no_gpu() {
    let reach = reach();
    for kernel in KERNELS.into_iter().filter(|kernel| reach.contains_key(*kernel)) {
        assert_absent(
            &reach,
            kernel,
            &["serde", "serde_json", "toml", "wgpu", "engine", "containers", "stages", "cli"],
        );
    }
}

#[test]
fn the_engine_knows_nothing_of_light() {
    let reach = reach();
    assert_absent(&reach, "engine", &KERNELS);
    assert_absent(&reach, "engine", &["containers", "stages", "cli", "wgpu"]);
}

#[test]
fn only_the_preview_names_wgpu_and_windows() {
    let root = concat!(env!("CARGO_MANIFEST_DIR"), "/../../Cargo.toml");
    let metadata = MetadataCommand::new().manifest_path(root).no_deps().exec().unwrap();
    let naming: Vec<_> = metadata
        .packages
        .iter()
        .filter(|package| {
            package
                .dependencies
                .iter()
                .any(|named| ["wgpu", "eframe", "winit"].contains(&named.name.as_str()))
        })
        .map(|package| package.name.to_string())
        .collect();
    assert_eq!(naming, ["preview"]);
    let reach = reach();
    assert_absent(&reach, "engine", &["wgpu"]);
    assert_absent(&reach, "containers", &["wgpu"]);
    assert_absent(&reach, "preview", &["engine", "containers", "stages", "cli"]);
}

/// The Rust files of a folder, and of the folders in it.
fn rust_files(folder: &Path) -> Vec<PathBuf> {
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            files.extend(rust_files(&path));
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            files.push(path);
        }
    }
    files
}

#[test]
fn only_one_module_of_the_command_line_prints() {
    let crates = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let mut printing = BTreeSet::new();
    let reach = reach();
    let linked = |krate: &str| krate == "cli" || reach["cli"].contains(krate);
    let shipped: Vec<&String> = reach.keys().filter(|krate| linked(krate)).collect();
    assert!(shipped.len() >= 9, "what the binary is made of: {shipped:?}");
    for krate in shipped {
        let folder = crates.join(krate).join("src");
        for file in rust_files(&folder) {
            let name = file.strip_prefix(&folder).unwrap().to_string_lossy().replace('\\', "/");
            let is_test =
                name.contains("tests/") || name.ends_with("tests.rs") || name.ends_with("testkit.rs");
            let text = std::fs::read_to_string(&file).unwrap();
            let shipped = text.split("#[cfg(test)]").next().unwrap();
            let prints = ["print!(", "println!(", "stdout()", "stderr()"].iter().any(|call| {
                shipped
                    .match_indices(call)
                    .any(|(at, _)| !shipped[at..].starts_with("stderr().is_terminal()"))
            });
            if prints && !is_test {
                printing.insert(format!("{krate}/{name}"));
            }
        }
    }
    assert_eq!(printing.into_iter().collect::<Vec<_>>(), ["cli/print.rs"]);
}

#[test]
fn the_map_names_every_crate_and_no_other() {
    let root = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");
    let map = std::fs::read_to_string(format!("{root}/ARCHITECTURE.md")).unwrap();
    let named: BTreeSet<String> = map
        .lines()
        .filter_map(|line| line.strip_prefix("| `crates/").or(line.strip_prefix("| `examples/")))
        .filter_map(|line| line.split_once('`'))
        .map(|(name, _)| name.to_owned())
        .collect();
    assert_eq!(named, reach().keys().cloned().collect(), "the crate table of ARCHITECTURE.md");
}

#[test]
fn the_kernels_share_one_list_of_forbidden_calls() {
    let root = concat!(env!("CARGO_MANIFEST_DIR"), "/..");
    let list = |kernel: &str| std::fs::read_to_string(format!("{root}/{kernel}/clippy.toml"));
    let first = list("sphere").unwrap();
    for name in ["std::fs::File", "std::time::Instant", "std::time::SystemTime", "std::env::var"] {
        assert!(first.contains(name), "{name} is forbidden in kernels");
    }
    for kernel in KERNELS.into_iter().filter(|kernel| reach().contains_key(*kernel)) {
        assert_eq!(list(kernel).unwrap(), first, "clippy.toml of {kernel}");
    }
}
