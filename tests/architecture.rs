//! The invariants of `ARCHITECTURE.md`, held against the dependency graph and the sources.

#![cfg(unix)] // the sources are the same on every system, and Wine has no cargo
#![allow(clippy::unwrap_used, reason = "a test may panic")]

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

mod selections;

const KERNELS: [&str; 11] =
    ["math", "sphere", "sh", "sampling", "envmap", "brdf", "shrm", "taps", "mesh", "transfer", "probes"];

/// What computes numbers of artifacts, beside the kernels.
const COMPUTING: [&str; 5] = ["containers", "preview", "stages", "mesh-stages", "probe-stages"];

/// Words of names that only code about light and meshes needs.
const OF_LIGHT: [&str; 8] = ["brdf", "lamp", "light", "luminance", "radiance", "reflect", "shrm", "texel"];

/// What only a window or a graphics device needs.
const WINDOW: [&str; 7] = ["eframe", "egui", "naga", "preview-window", "wgpu", "wgpu-hal", "winit"];

/// What only a network needs.
const NETWORK: [&str; 7] = ["bazel-remote-apis", "hyper", "prost", "remote", "rustls", "tokio", "tonic"];

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// What `cargo tree` lists below a crate of the workspace with these features, dependencies of tests left
/// out; `None` if cargo has not downloaded a crate that only these features need, and cannot now.
fn dependencies(package: &str, features: &[&str]) -> Option<BTreeSet<String>> {
    let output = Command::new(env!("CARGO"))
        .args(["tree", "--locked", "--edges", "normal,build", "--prefix", "none"])
        .args(["--format", "{p}", "--package", package, "--features", &features.join(",")])
        .current_dir(root())
        .output()
        .unwrap();
    let (text, errors) =
        (String::from_utf8(output.stdout).unwrap(), String::from_utf8_lossy(&output.stderr).into_owned());
    if !output.status.success() && errors.contains("failed to download") {
        test_data::skip(
            "architecture",
            &format!("`cargo fetch` gets what {package} needs with the features {features:?}"),
        );
        return None;
    }
    assert!(output.status.success(), "{package}: {errors}");
    let mut names = text.lines().map(|line| line.split(' ').next().unwrap().to_owned());
    assert_eq!(names.next().as_deref(), Some(package));
    Some(names.collect())
}

/// Asserts that a crate with these features depends on none of these.
fn assert_absent(package: &str, features: &[&str], forbidden: &[&str]) {
    let Some(found) = dependencies(package, features) else { return };
    let found: Vec<_> = forbidden.iter().filter(|name| found.contains(**name)).collect();
    assert!(found.is_empty(), "{package} must not depend on {found:?}");
}

/// The names of the crates below a folder of the workspace.
fn crates(folder: &str) -> BTreeSet<String> {
    let entries = fs::read_dir(root().join(folder)).unwrap().map(|entry| entry.unwrap());
    let crates = entries.filter(|entry| entry.path().join("Cargo.toml").exists());
    crates.map(|entry| entry.file_name().into_string().unwrap()).collect()
}

#[test]
fn kernels_need_no_serialisation_and_no_graphics_device() {
    for kernel in KERNELS {
        assert_absent(kernel, &[], &["serde", "serde_json", "toml", "engine", "containers", "stages", "cli"]);
        assert_absent(kernel, &[], &WINDOW);
    }
}

#[test]
fn the_engine_knows_nothing_of_light() {
    assert_absent("engine", &[], &KERNELS);
    assert_absent("engine", &[], &["containers", "preview", "stages", "cli"]);
    assert_absent("preview", &["gpu"], &["engine", "containers", "stages", "cli", "eframe", "winit"]);
    let folder = root().join("crates/engine/src");
    let mut found = Vec::new();
    for file in rust_files(&folder) {
        let path = file.strip_prefix(&folder).unwrap().to_string_lossy().replace('\\', "/");
        if path.contains("tests/") || path.ends_with("tests.rs") || path.ends_with("testkit.rs") {
            continue;
        }
        let text = shipped(&fs::read_to_string(&file).unwrap()).to_lowercase();
        let code = text.lines().filter(|line| !line.trim_start().starts_with("//"));
        let of_light = code.filter(|line| OF_LIGHT.iter().any(|word| line.contains(word)));
        found.extend(of_light.map(|line| format!("{path}: {}", line.trim())));
    }
    assert!(found.is_empty(), "the engine must not know:\n{}", found.join("\n"));
}

#[test]
fn nothing_compiles_a_window_that_did_not_ask_for_one() {
    for package in ["engine", "stages", "custom-kind", "cli"] {
        assert_absent(package, &[], &WINDOW);
    }
    assert_absent("cli", &["gpu"], &["eframe", "egui", "preview-window", "winit"]);
    let Some(asked) = dependencies("cli", &["window"]) else { return };
    assert!(WINDOW.iter().all(|name| asked.contains(*name)), "the names above are those of today: {asked:?}");
}

#[test]
fn nothing_compiles_a_network_that_did_not_ask_for_one() {
    for package in ["engine", "stages", "custom-kind", "cli", "bench"] {
        assert_absent(package, &[], &NETWORK);
    }
    assert_absent("remote", &["client"], &["stages", "containers", "cli"]);
    let Some(asked) = dependencies("cli", &["remote"]) else { return };
    assert!(
        NETWORK.iter().all(|name| asked.contains(*name)),
        "the names above are those of today: {asked:?}"
    );
    let manifest = |name: &String| fs::read_to_string(root().join("crates").join(name).join("Cargo.toml"));
    let names = |manifest: &str| ["tokio", "tonic", "prost"].iter().any(|name| manifest.contains(*name));
    let naming: Vec<_> =
        crates("crates").into_iter().filter(|name| names(&manifest(name).unwrap())).collect();
    assert_eq!(naming, ["remote"]);
}

#[test]
fn only_the_preview_and_its_window_name_a_graphics_device() {
    let names = |manifest: &str| ["wgpu", "eframe", "winit"].iter().any(|name| manifest.contains(*name));
    let manifest = |name: &String| fs::read_to_string(root().join("crates").join(name).join("Cargo.toml"));
    let naming: Vec<_> =
        crates("crates").into_iter().filter(|name| names(&manifest(name).unwrap())).collect();
    assert_eq!(naming, ["preview", "preview-window"]);
}

/// The Rust files of a folder and of the folders in it.
fn rust_files(folder: &Path) -> Vec<PathBuf> {
    let mut files = Vec::new();
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            files.extend(rust_files(&path));
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            files.push(path);
        }
    }
    files
}

/// A file without its items that only tests have: each item after `#[cfg(test)]`, up to the line that ends
/// it.
fn shipped(text: &str) -> String {
    let mut kept = String::new();
    let mut lines = text.lines();
    while let Some(line) = lines.next() {
        if line.trim_start() != "#[cfg(test)]" {
            kept += line;
            kept.push('\n');
            continue;
        }
        let indent = &line[..line.len() - line.trim_start().len()];
        let (block, closed) = (format!("{indent}}}"), |line: &str| line.ends_with([';', ',', '}']));
        let mut item = lines.by_ref().skip_while(|line| line.trim_start().starts_with("#["));
        if item.next().is_some_and(|first| !closed(first)) {
            item.find(|line| *line == block);
        }
    }
    kept
}

#[test]
fn what_only_tests_have_is_left_out_and_nothing_after_it() {
    let text = "one\n#[cfg(test)]\nmod tests;\ntwo\n    #[cfg(test)]\n    fn three() {\n        x\n    }\n    four\n";
    assert_eq!(shipped(text), "one\ntwo\n    four\n");
}

/// Whether a call of `stderr()` asks whether it is a terminal, or how wide.
fn asks_the_terminal(call: &str) -> bool {
    ["stderr().is_terminal()", "stderr().size_checked()", "stderr().features()"]
        .iter()
        .any(|question| call.starts_with(question))
}

#[test]
fn only_one_module_of_the_command_line_prints() {
    let Some(linked) = dependencies("cli", &["window"]) else { return };
    let shipping: Vec<_> =
        crates("crates").into_iter().filter(|name| name == "cli" || linked.contains(name)).collect();
    assert!(shipping.len() >= 12, "what the binary is made of: {shipping:?}");
    let mut printing = BTreeSet::new();
    for name in shipping {
        let folder = root().join("crates").join(&name).join("src");
        for file in rust_files(&folder) {
            let path = file.strip_prefix(&folder).unwrap().to_string_lossy().replace('\\', "/");
            let is_test =
                path.contains("tests/") || path.ends_with("tests.rs") || path.ends_with("testkit.rs");
            let text = shipped(&fs::read_to_string(&file).unwrap());
            let prints = ["print!(", "println!(", "stdout()", "stderr()"].iter().any(|call| {
                let mut calls = text.match_indices(call);
                calls.any(|(at, _)| !asks_the_terminal(&text[at..]))
            });
            if prints && !is_test {
                printing.insert(format!("{name}/{path}"));
            }
        }
    }
    assert_eq!(printing.into_iter().collect::<Vec<_>>(), ["cli/print.rs"]);
}

#[test]
fn the_map_names_every_crate_and_no_other() {
    let map = fs::read_to_string(root().join("ARCHITECTURE.md")).unwrap();
    let named: BTreeSet<String> = map
        .lines()
        .filter_map(|line| line.strip_prefix("| `crates/").or(line.strip_prefix("| `examples/")))
        .filter_map(|line| line.split_once('`'))
        .map(|(name, _)| name.to_owned())
        .collect();
    let all: BTreeSet<String> = crates("crates").into_iter().chain(crates("examples")).collect();
    assert_eq!(named, all, "the crate table of ARCHITECTURE.md");
}

/// The crates of the workspace that each of its crates depends on, those of tests and build scripts left out.
fn uses_of_crates() -> BTreeMap<String, BTreeSet<String>> {
    let output = Command::new(env!("CARGO"))
        .args(["metadata", "--no-deps", "--format-version", "1", "--locked", "--offline"])
        .current_dir(root())
        .output()
        .unwrap();
    let metadata: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let text = |value: &serde_json::Value| value.as_str().unwrap().to_owned();
    let packages = metadata["packages"].as_array().unwrap();
    let names: BTreeSet<String> = packages.iter().map(|package| text(&package["name"])).collect();
    let uses = |package: &serde_json::Value| {
        let all = package["dependencies"].as_array().unwrap().iter();
        let normal = all.filter(|used| used["kind"].is_null()).map(|used| text(&used["name"]));
        normal.filter(|name| names.contains(name)).collect()
    };
    packages.iter().map(|package| (text(&package["name"]), uses(package))).collect()
}

/// CI checks `research` with `--locked`, late, which fails if its lock file lacks a dependency of ours.
#[test]
fn the_lock_of_research_knows_the_dependencies_of_our_crates() {
    let read = |path: PathBuf| fs::read_to_string(path).ok().map(|text| text.parse::<toml::Table>().unwrap());
    let lock = read(root().join("research/Cargo.lock")).unwrap();
    let mut checked = 0;
    for package in lock["package"].as_array().unwrap() {
        let name = package["name"].as_str().unwrap();
        let Some(manifest) = read(root().join("crates").join(name).join("Cargo.toml")) else { continue };
        let known = package.get("dependencies").and_then(toml::Value::as_array).into_iter().flatten();
        let known: Vec<&str> = known.map(|of| of.as_str().unwrap().split(' ').next().unwrap()).collect();
        for (dependency, of) in
            manifest.get("dependencies").and_then(toml::Value::as_table).into_iter().flatten()
        {
            let is_known = of.get("optional").is_some() || known.contains(&dependency.as_str());
            assert!(
                is_known,
                "{name} needs {dependency}: `cargo metadata --offline` in research/ writes its lock"
            );
            checked += 1;
        }
    }
    assert!(checked > 50, "{checked} dependencies");
}

#[test]
fn the_map_says_what_each_crate_uses() {
    let map = fs::read_to_string(root().join("ARCHITECTURE.md")).unwrap();
    let uses = uses_of_crates();
    let rows = map.lines().filter(|line| line.starts_with("| `crates/") || line.starts_with("| `examples/"));
    let mut checked = 0;
    for row in rows {
        let cells: Vec<&str> = row.split('|').map(str::trim).collect();
        let name = cells[1].trim_matches('`').rsplit('/').next().unwrap();
        let named = cells[3].split(", ").filter(|name| !name.is_empty()).map(str::to_owned);
        assert_eq!(named.collect::<BTreeSet<_>>(), uses[name], "what {name} uses, in ARCHITECTURE.md");
        checked += 1;
    }
    assert_eq!(checked, uses.len());
}

#[test]
fn what_reaches_artifacts_has_no_function_of_the_system() {
    let list = fs::read_to_string(root().join("clippy.toml")).unwrap();
    assert!(list.contains("\"f64::powf\""), "std's functions are forbidden");
    for name in KERNELS.into_iter().chain(COMPUTING) {
        let text = fs::read_to_string(root().join("crates").join(name).join("src/lib.rs")).unwrap();
        let lint = "#![cfg_attr(not(test), warn(clippy::disallowed_methods))]";
        assert!(text.contains(lint), "{name} turns the lint on");
    }
}

#[test]
fn kernels_touch_no_file_clock_environment_or_thread() {
    let mut found = Vec::new();
    for kernel in KERNELS {
        let folder = root().join("crates").join(kernel).join("src");
        for file in rust_files(&folder) {
            let path = file.strip_prefix(&folder).unwrap().to_string_lossy().replace('\\', "/");
            if path.contains("tests/") || path.ends_with("tests.rs") || path.ends_with("testkit.rs") {
                continue;
            }
            let text = shipped(&fs::read_to_string(&file).unwrap());
            for name in
                ["std::fs", "Instant", "SystemTime", "std::env", "std::thread", "std::process", "std::net"]
            {
                if text.lines().any(|line| !line.trim_start().starts_with("//") && line.contains(name)) {
                    found.push(format!("{kernel}/{path}: {name}"));
                }
            }
        }
    }
    // By which tests choose the instructions, in builds with debug assertions.
    assert_eq!(found, ["sh/f64x4.rs: std::env"]);
}

/// The paths that a file uses, one by one, and whether each is a re-export.
fn uses(text: &str) -> Vec<(bool, String)> {
    fn expand(prefix: &str, tree: &str, found: &mut Vec<String>) {
        let Some((path, list)) = tree.split_once('{') else {
            let path = tree.split(" as ").next().unwrap().trim();
            let path =
                if path == "self" { prefix.trim_end_matches("::").into() } else { format!("{prefix}{path}") };
            return found.push(path);
        };
        let prefix = format!("{prefix}{}", path.trim());
        // Words of a text that begin as a statement does have no end.
        let Some(list) = list.trim_end().strip_suffix('}') else { return };
        let (mut depth, mut start) = (0, 0);
        for (at, letter) in list.char_indices().chain([(list.len(), ',')]) {
            match letter {
                '{' => depth += 1,
                '}' => depth -= 1,
                ',' if depth == 0 => {
                    let tree = list[start..at].trim();
                    if !tree.is_empty() {
                        expand(&prefix, tree, found);
                    }
                    start = at + 1;
                }
                _ => {}
            }
        }
    }
    let mut found = Vec::new();
    let mut lines = text.lines();
    while let Some(line) = lines.next() {
        let words = line.trim_start();
        let tree = ["use ", "pub use ", "pub(crate) use ", "pub(super) use "]
            .iter()
            .find_map(|start| words.strip_prefix(start));
        let Some(tree) = tree else { continue };
        let mut tree = tree.to_owned();
        while !tree.ends_with(';') {
            let Some(line) = lines.next() else { break };
            tree += line.trim();
        }
        let mut paths = Vec::new();
        expand("", tree.trim_end_matches(';'), &mut paths);
        found.extend(paths.into_iter().map(|path| (words.starts_with("pub"), path)));
    }
    found
}

type Module = Vec<String>;

/// The modules of a crate that have a file, tests left out, with the paths that each uses.
fn modules(source: &Path) -> BTreeMap<Module, Vec<(bool, String)>> {
    let mut modules = BTreeMap::new();
    for file in rust_files(source) {
        let path = file.strip_prefix(source).unwrap().with_extension("");
        let mut module: Module = path.iter().map(|part| part.to_str().unwrap().to_owned()).collect();
        if module.iter().any(|part| ["tests", "testkit", "bin", "main"].contains(&part.as_str())) {
            continue;
        }
        module.retain(|part| part != "lib");
        modules.insert(module, uses(&shipped(&fs::read_to_string(&file).unwrap())));
    }
    modules
}

/// Which module of a crate uses which, by files. An item that a module re-exports belongs to the file that it
/// comes from.
fn arrows(source: &Path) -> BTreeSet<(Module, Module)> {
    let modules = modules(source);
    let absolute = |module: &Module, path: &str| -> Option<Module> {
        let mut parts = path.split("::").map(str::to_owned).peekable();
        let mut base = match parts.peek()?.as_str() {
            "crate" => Module::new(),
            "self" | "super" => module.clone(),
            first if modules.contains_key(&[&module[..], &[first.to_owned()]].concat()) => {
                return Some([&module[..], &parts.collect::<Vec<_>>()].concat());
            }
            _ => return None,
        };
        while let Some(part) = parts.next_if(|part| ["crate", "self", "super"].contains(&part.as_str())) {
            if part == "super" {
                base.pop();
            }
        }
        base.extend(parts);
        Some(base)
    };
    let mut exports = BTreeMap::new();
    for (module, used) in &modules {
        for path in
            used.iter().filter(|(is_public, _)| *is_public).filter_map(|(_, path)| absolute(module, path))
        {
            exports.insert([&module[..], &[path.last().cloned().unwrap_or_default()]].concat(), path);
        }
    }
    let home = |mut path: Module| loop {
        let length = (0..=path.len()).rev().find(|length| modules.contains_key(&path[..*length])).unwrap();
        match path.get(..=length).and_then(|item| exports.get(item)) {
            Some(original) if *original != path => path = [&original[..], &path[length + 1..]].concat(),
            _ => return path[..length].to_vec(),
        }
    };
    let mut arrows = BTreeSet::new();
    for (module, used) in &modules {
        for (_, path) in used.iter().filter(|(is_public, path)| !is_public && !path.ends_with('*')) {
            if let Some(path) = absolute(module, path).map(home).filter(|path| path != module) {
                arrows.insert((module.clone(), path));
            }
        }
    }
    arrows
}

/// Which folder, or file beside the folders, uses which.
fn between_rooms(arrows: BTreeSet<(Module, Module)>) -> BTreeSet<(Module, Module)> {
    let room = |module: &Module| module[..module.len().min(1)].to_vec();
    let rooms = arrows.iter().map(|(user, used)| (room(user), room(used)));
    rooms.filter(|(user, used)| user != used && !used.is_empty() && !user.is_empty()).collect()
}

/// The arrows in a circle, and those between two circles.
fn circle(mut arrows: BTreeSet<(Module, Module)>) -> Vec<String> {
    // What uses nothing that is left, or is used by nothing that is left, is in no circle.
    loop {
        let (from, to): (BTreeSet<_>, BTreeSet<_>) = arrows.iter().cloned().unzip();
        let before = arrows.len();
        arrows.retain(|(user, used)| to.contains(user) && from.contains(used));
        if arrows.len() == before {
            let text =
                |(user, used): &(Module, Module)| format!("{} uses {}", user.join("::"), used.join("::"));
            return arrows.iter().map(text).collect();
        }
    }
}

/// The number of floors: each room is above all that it uses.
fn floors(arrows: &BTreeSet<(Module, Module)>) -> usize {
    fn floor(room: &Module, arrows: &BTreeSet<(Module, Module)>) -> usize {
        arrows
            .iter()
            .filter(|(user, _)| user == room)
            .map(|(_, used)| 1 + floor(used, arrows))
            .max()
            .unwrap_or(1)
    }
    arrows.iter().map(|(user, _)| floor(user, arrows)).max().unwrap_or(1)
}

#[test]
fn no_files_of_a_crate_use_each_other_in_a_circle() {
    let mut circles = Vec::new();
    for name in crates("crates") {
        let found = circle(arrows(&root().join("crates").join(&name).join("src")));
        circles.extend(found.into_iter().map(|edge| format!("{name}: {edge}")));
    }
    circles.extend(circle(arrows(&root().join("research/src"))));
    assert!(circles.is_empty(), "{}", circles.join("\n"));
}

#[test]
fn rooms_are_few_and_use_each_other_in_one_direction() {
    for (name, most_rooms, most_floors) in [("engine", 20, 10), ("stages", 10, 6), ("containers", 20, 8)] {
        let arrows = between_rooms(arrows(&root().join("crates").join(name).join("src")));
        let rooms: BTreeSet<&Module> = arrows.iter().flat_map(|(user, used)| [user, used]).collect();
        let found = circle(arrows.clone());
        assert!(found.is_empty(), "{name}: {}", found.join("\n"));
        let floors = floors(&arrows);
        eprintln!("{name}: {} rooms, {floors} floors, {} arrows, no circle", rooms.len(), arrows.len());
        assert!((4..=most_rooms).contains(&rooms.len()), "{name} has {} rooms: {rooms:?}", rooms.len());
        assert!(floors <= most_floors, "{name} has {floors} floors");
    }
}

#[test]
fn the_scheduler_knows_no_place_and_no_cache_by_name() {
    let arrows = arrows(&root().join("crates/engine/src"));
    let is_in = |module: &Module, path: &[&str]| {
        module.len() >= path.len() && module.iter().zip(path).all(|(one, other)| one == other)
    };
    let used: Vec<&Module> = arrows
        .iter()
        .filter(|(user, _)| is_in(user, &["build", "scheduler"]))
        .map(|(_, used)| used)
        .collect();
    assert!(used.iter().any(|used| used.join("/") == "build/runner"), "{used:?}");
    let files = fs::read_dir(root().join("crates/engine/src/build/runner")).unwrap().count();
    assert!(files >= 3, "each place is a file");
    let is_known = |used: &&&Module| {
        let is_place = used.len() > 2 && is_in(used, &["build", "runner"]);
        let others = [&["shared"][..], &["build", "shared_results"], &["build", "run_elsewhere"]];
        is_place || others.iter().any(|path| is_in(used, path))
    };
    let known: Vec<String> = used.iter().filter(is_known).map(|used| used.join("::")).collect();
    assert!(known.is_empty(), "the scheduler uses {known:?}");
}

#[test]
fn no_kind_uses_another_kinds_file() {
    let mut kinds = BTreeSet::new();
    // The files of kinds lie in folders in one crate, at the top in the others.
    for (name, depth) in [("stages", 2), ("mesh-stages", 1), ("probe-stages", 1)] {
        let source = root().join("crates").join(name).join("src");
        let is_kind = |module: &Module| {
            let file = source.join(module.join("/")).with_extension("rs");
            fs::read_to_string(file).is_ok_and(|text| text.contains("\nimpl Kind for "))
        };
        // A kind's own files lie in a folder of its name.
        let kind = |module: &Module| module.get(..depth).map(<[String]>::to_vec).filter(is_kind);
        kinds.extend(modules(&source).keys().filter_map(kind));
        for (user, used) in arrows(&source).iter().filter(|(user, _)| kind(user).is_some()) {
            if let Some(other) = kind(used) {
                assert_eq!(kind(user), Some(other), "{} uses {}", user.join("::"), used.join("::"));
            }
        }
    }
    assert!(kinds.len() >= 35, "{} kinds were found", kinds.len());
}

#[test]
fn kinds_of_other_crates_use_nothing_but_what_every_studio_is_promised() {
    let read = |name: &str| fs::read_to_string(root().join(name)).unwrap();
    let (manual, plugin) = (read("docs/plugins.md"), read("crates/stages/src/plugin.rs"));
    let promised: Vec<String> = uses(&plugin).into_iter().map(|(_, path)| path).collect();
    assert!(promised.len() >= 10, "{promised:?}");
    for path in promised {
        let name = path.rsplit("::").next().unwrap();
        assert!(manual.contains(&format!("`{name}`")), "docs/plugins.md names {name}");
    }
    for name in ["mesh-stages", "probe-stages"] {
        let crates = &uses_of_crates()[name];
        let others: Vec<_> = crates.iter().filter(|name| !KERNELS.contains(&name.as_str())).collect();
        assert_eq!(others, ["containers", "engine", "stages"]);
        for file in rust_files(&root().join("crates").join(name).join("src")) {
            let text = fs::read_to_string(&file).unwrap();
            let code = text.lines().filter(|line| !line.trim_start().starts_with("//"));
            for used in code.flat_map(|line| line.split("stages::").skip(1)) {
                let is_promised = used.starts_with("artifacts") || used.starts_with("plugin::");
                assert!(is_promised, "{} uses stages::{used}", file.display());
            }
        }
    }
}

#[test]
fn a_circle_is_found_through_lists_and_re_exports() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| fs::write(folder.path().join(name), text).unwrap();
    write("lib.rs", "mod a;\nmod b;\nmod c;\npub use b::Item;\n");
    write("a.rs", "use std::fmt;\nuse crate::{Item, c};\n");
    write("b.rs", "use super::a::Other as _;\n#[cfg(test)]\nmod tests {\n    use crate::c;\n}\n");
    write("c.rs", "// use crate::a;\n");
    assert_eq!(circle(arrows(folder.path())), ["a uses b", "b uses a"]);
    write("b.rs", "#[cfg(test)]\nuse super::a;\n");
    assert!(circle(arrows(folder.path())).is_empty());
}

#[test]
fn documentation_is_as_wide_as_code() {
    let mut wide = Vec::new();
    let folders = [
        "crates",
        "examples",
        "tests",
        "research/src",
        "research/tests",
        "research/benches",
        "research/bc6h-comparison",
    ];
    for file in folders.into_iter().flat_map(|folder| rust_files(&root().join(folder))) {
        let mut is_example = false;
        for line in fs::read_to_string(&file).unwrap().lines() {
            let Some(comment) = line.trim_start().strip_prefix("//") else { continue };
            is_example ^= comment.contains("```");
            // A row of a table cannot be broken, nor can an address.
            let can_break = !is_example && !comment.contains(" |") && !comment.contains("http");
            if can_break && line.chars().count() > 110 {
                wide.push(format!("{}: {line}", file.display()));
            }
        }
    }
    assert!(wide.is_empty(), "{} lines are wider than 110 columns:\n{}", wide.len(), wide.join("\n"));
}
