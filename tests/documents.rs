//! The documents say what is true.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

fn read(name: &str) -> String {
    fs::read_to_string(root().join(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
}

/// The text of every Rust file of a crate.
fn sources(krate: &str) -> String {
    let mut text = String::new();
    let mut folders = vec![root().join("crates").join(krate)];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|extension| extension == "rs") {
                text += &fs::read_to_string(path).unwrap();
            }
        }
    }
    text
}

#[test]
fn every_convention_is_pinned_by_a_test_that_exists() {
    let table = read("CONVENTIONS.md");
    let mut pinned = 0;
    for row in table.lines().filter(|line| line.starts_with("| ") && !line.starts_with("| ---")).skip(1) {
        let tests = row.trim_end_matches([' ', '|']).rsplit('|').next().unwrap();
        let names: Vec<&str> = tests.split('`').skip(1).step_by(2).collect();
        assert!(!names.is_empty(), "no test pins: {row}");
        for name in names {
            let (krate, test) =
                name.split_once(": ").unwrap_or_else(|| panic!("`crate: test` wanted, not {name:?}"));
            assert!(sources(krate).contains(&format!("fn {test}()")), "{name} does not exist");
            pinned += 1;
        }
    }
    assert!(pinned >= 15, "{pinned} tests were found in the table");
}

#[test]
fn the_readme_gives_the_two_commands_that_ci_runs() {
    let readme = read("README.md");
    // What the first builds is built by a test of the second, with the program that the tests have anyway.
    let [build, test] = ["cargo run --release -- build", "cargo test --workspace"];
    for command in [build, test] {
        assert!(readme.contains(command), "README.md says {command}");
    }
    assert!(read(".ci/run").lines().any(|line| line.starts_with(test)), ".ci/run runs {test}");
    assert!(read("tests/sample.rs").contains("fn the_sample_builds_and_is_then_up_to_date()"));
}

/// The Markdown files of the project, with their paths in it.
fn documents() -> Vec<String> {
    let (mut found, mut folders) = (Vec::new(), vec![root()]);
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            let name = path.file_name().unwrap().to_str().unwrap().to_owned();
            if path.is_dir() && !name.starts_with('.') && !["out", "target", "node_modules"].contains(&&*name)
            {
                folders.push(path);
            } else if name.ends_with(".md") {
                found.push(path.strip_prefix(root()).unwrap().to_str().unwrap().to_owned());
            }
        }
    }
    found
}

#[test]
fn links_in_documents_lead_somewhere() {
    let documents = documents();
    assert!(documents.len() >= 20, "{documents:?}");
    for document in documents {
        let folder = root().join(&document).parent().unwrap().to_path_buf();
        for target in read(&document).split("](").skip(1).filter_map(|rest| rest.split(')').next()) {
            let target = target.split('#').next().unwrap();
            if !target.is_empty() && !target.starts_with("http") {
                assert!(folder.join(target).exists(), "{document} links to {target}");
            }
        }
    }
}

#[test]
fn programs_of_research_are_listed_and_those_that_documents_name_exist() {
    let programs = root().join("research/src/bin");
    let list = read("research/README.md");
    for entry in fs::read_dir(&programs).unwrap() {
        let file = entry.unwrap().path();
        let name = file.file_stem().unwrap().to_str().unwrap();
        assert!(list.contains(&format!("| `{name}` |")), "research/README.md lists {name}");
    }
    let mut named = 0;
    for document in documents().iter().filter(|document| document.starts_with("docs")) {
        for command in read(document).split("--manifest-path research/Cargo.toml --bin ").skip(1) {
            let name = command.split(|c: char| c.is_whitespace() || c == '`').next().unwrap();
            assert!(programs.join(name).with_extension("rs").exists(), "{document} names {name}");
            named += 1;
        }
    }
    assert!(named >= 2, "{named} commands were found");
}

/// A command with a target that needs features names them: without them Cargo refuses it.
#[test]
fn programs_and_benchmarks_that_documents_name_exist_and_have_the_features_that_they_need() {
    let output = Command::new(env!("CARGO"))
        .args(["metadata", "--no-deps", "--format-version", "1", "--locked", "--offline"])
        .current_dir(root())
        .output()
        .unwrap();
    let metadata: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let packages = metadata["packages"].as_array().unwrap();
    let mut named = 0;
    for document in documents() {
        let text = read(&document);
        let commands = text.split(['`', '\n']).filter(|command| command.trim().starts_with("cargo "));
        for command in commands.filter(|command| !command.contains("--manifest-path")) {
            let words: Vec<&str> = command.split_whitespace().collect();
            let after = |option: &str| words.windows(2).find(|pair| pair[0] == option).map(|pair| pair[1]);
            let (Some(krate), Some((kind, name))) = (
                after("-p"),
                ["bin", "bench", "test", "example"]
                    .iter()
                    .find_map(|kind| after(&format!("--{kind}")).map(|name| (kind, name))),
            ) else {
                continue;
            };
            let package = packages.iter().find(|package| package["name"] == krate);
            let targets = package.map(|package| package["targets"].as_array().unwrap());
            let target = targets.into_iter().flatten().find(|target| {
                target["name"] == name && target["kind"].as_array().unwrap().iter().any(|of| of == kind)
            });
            let target = target.unwrap_or_else(|| panic!("{document}: {command}: there is no such target"));
            let features: Vec<&str> =
                after("--features").map_or(Vec::new(), |list| list.split(',').collect());
            for needed in target["required-features"].as_array().into_iter().flatten() {
                assert!(features.iter().any(|feature| needed == feature), "{document}: {command}: {needed}");
            }
            named += 1;
        }
    }
    assert!(named >= 10, "{named} commands were found");
}

#[test]
fn help_lists_the_exit_codes() {
    let output = Command::new(env!("CARGO_BIN_EXE_specula")).arg("--help").output().unwrap();
    let text = String::from_utf8(output.stdout).unwrap();
    for code in ["  0 ", "  1 ", "  2 ", "  3 ", "  4 ", "  130 "] {
        assert!(text.contains(code), "{text}");
    }
}

/// Checks that a manual names every option in the help of its command, and that these are at least `least`.
fn assert_named(command: &str, manual: &str, least: usize) {
    let output = Command::new(env!("CARGO_BIN_EXE_specula")).args([command, "--help"]).output().unwrap();
    let (help, text) = (String::from_utf8(output.stdout).unwrap(), read(manual));
    let options = help.split_whitespace().filter(|word| word.starts_with("--") && word.len() > 2);
    let options = options.map(|word| word.trim_end_matches(|c: char| !c.is_ascii_alphanumeric()));
    let mut named = 0;
    // Every command has these; docs/features.md describes them.
    for option in options.filter(|option| !["--help", "--color"].contains(option)) {
        assert!(text.contains(&format!("`{option}")), "{manual} names {option}");
        named += 1;
    }
    assert!(named >= least, "{named} options were found in\n{help}");
}

#[test]
fn the_manuals_of_watching_and_of_the_preview_name_every_option() {
    assert_named("watch", "docs/watch.md", 10);
    assert_named("preview", "docs/preview.md", 12);
}

#[test]
fn the_manual_of_the_preview_names_every_mode_and_shape() {
    let manual = read("docs/preview.md");
    for name in preview::Mode::ALL.map(preview::Mode::name).iter().chain(&mesh::SHAPES) {
        assert!(manual.contains(&format!("`{name}`")), "docs/preview.md names {name}");
    }
}

/// The list of features has the models in their order, in which errors and the manual list them, too.
#[test]
fn the_list_of_features_names_every_reflection_model() {
    let features = read("docs/features.md");
    let (_, rest) = features.split_once("| materials | TOML files: ").unwrap();
    let (list, _) = rest.split_once(", and layers of them").unwrap();
    // A name stands between two marks, and beside `standard` is a remark.
    let listed: Vec<_> = list.split('`').skip(1).step_by(2).collect();
    let models: Vec<_> = brdf::MODELS.iter().map(|model| model.name).collect();
    assert_eq!(listed, models, "docs/features.md lists the models");
}

#[test]
fn the_manual_of_engines_says_of_each_how_its_facts_are_known() {
    let manual = read("docs/engines.md");
    let (_, table) = manual.split_once("| preset | how its facts are known |").unwrap();
    let rows = table.lines().skip(1).take_while(|line| line.starts_with("| "));
    let named: Vec<&str> =
        rows.flat_map(|row| row.split('|').nth(1).unwrap().split(", ")).map(str::trim).collect();
    for engine in stages::ENGINES {
        let name = format!("`{}`", engine.name);
        assert!(named.contains(&name.as_str()), "docs/engines.md has a row for {name}: {named:?}");
    }
}

#[test]
fn the_features_list_every_command() {
    let output = Command::new(env!("CARGO_BIN_EXE_specula")).arg("--help").output().unwrap();
    let (help, features) = (String::from_utf8(output.stdout).unwrap(), read("docs/features.md"));
    let listed = help.lines().skip_while(|line| *line != "Commands:").skip(1);
    let commands = listed.take_while(|line| !line.is_empty());
    let commands = commands.filter_map(|line| line.split_whitespace().next()).filter(|name| *name != "help");
    let commands = commands.collect::<Vec<_>>();
    assert!(commands.len() >= 12, "{commands:?}");
    for command in commands {
        assert!(features.contains(&format!("| `specula {command}")), "docs/features.md lists {command}");
    }
}
