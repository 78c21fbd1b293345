//! With `--json`, a command that fails says why on standard output too, for programs.

use std::collections::BTreeSet;
use std::fs::{self, File};
use std::process::Command;

use crate::support::{Project, Run, SMALL};
use engine::EventLine;
use serde_json::Value;

/// The commands that take `--json`, each with arguments that it cannot do without.
const COMMANDS: &[&[&str]] = &[
    &["build"],
    &["watch"],
    &["explain", "map"],
    &["verify", "out/maps/gold.exr"],
    &["check"],
    &["inspect", "assets/environments/studio.exr"],
    &["cache", "stats"],
    &["cache", "gc"],
    &["cache", "verify"],
    &["prune"],
];

/// The commands whose help names `--json`.
fn with_json() -> BTreeSet<Vec<String>> {
    let names = |of: &[String]| {
        let output = Command::new(env!("CARGO_BIN_EXE_specula")).args(of).arg("--help").output().unwrap();
        let help = String::from_utf8(output.stdout).unwrap();
        let listed = help.lines().skip_while(|line| *line != "Commands:").skip(1);
        let listed = listed.take_while(|line| !line.is_empty());
        let names = listed.filter_map(|line| line.split_whitespace().next()).filter(|name| *name != "help");
        (
            names.map(str::to_owned).collect::<Vec<_>>(),
            help.lines().any(|line| line.trim_start().starts_with("--json")),
        )
    };
    let (mut open, mut found) = (vec![Vec::new()], BTreeSet::new());
    while let Some(command) = open.pop() {
        let (below, takes_json) = names(&command);
        if takes_json {
            found.insert(command.clone());
        }
        open.extend(below.into_iter().map(|name| [&command[..], &[name]].concat()));
    }
    found
}

/// The last line on standard output of a command that failed, which must be an error as data.
fn error_of(run: &Run, command: &[&str]) -> Value {
    let lines = run.stdout.lines().map(|line| serde_json::from_str(line).unwrap());
    let lines: Vec<Value> = lines.collect();
    let last = lines.last().unwrap_or_else(|| panic!("{command:?} prints nothing: {run:?}"));
    if ["build", "watch"].contains(&command[0]) {
        let schema = jsonschema::draft202012::new(&EventLine::schema()).unwrap();
        assert!(lines.iter().all(|line| schema.is_valid(line)), "{lines:#?}");
        assert!(["rejected", "build-error"].contains(&last["event"].as_str().unwrap()), "{last:#}");
    } else {
        assert_eq!((lines.len(), &last["v"]), (1, &1.into()), "{command:?}: {lines:#?}");
        assert!(!last["error"].as_array().unwrap().is_empty(), "{last:#}");
    }
    assert!(!run.stderr.is_empty(), "people read it too: {run:?}");
    last.clone()
}

/// Runs all commands that are not among `except`, with `--json` and further arguments: each must fail with
/// this exit code and say why.
fn check(project: &Project, except: &[&str], further: &[&str], code: i32) -> Vec<Value> {
    let commands = COMMANDS.iter().filter(|command| !except.contains(&command[0]));
    let errors = commands.map(|command| {
        let run = project.specula(&[command, &["--json"][..], further].concat());
        assert_eq!(run.code, Some(code), "{command:?}: {run:?}");
        error_of(&run, command)
    });
    errors.collect()
}

#[test]
fn the_list_of_commands_is_complete() {
    let words = |command: &&[&str]| command.iter().map(|word| (*word).to_owned()).collect::<Vec<_>>();
    let listed = COMMANDS.iter().map(words).map(|mut words| {
        words.truncate(if words[0] == "cache" { 2 } else { 1 });
        words
    });
    assert_eq!(listed.collect::<BTreeSet<_>>(), with_json());
}

/// `watch` waits for a valid manifest, and these need none.
const WITHOUT_MANIFEST: [&str; 4] = ["watch", "cache", "prune", "inspect"];

#[test]
fn errors_of_the_manifest_have_a_place_and_help() {
    let project = Project::small();
    project.write("pipeline.toml", &SMALL.replace("degree = 8\n", "degre = 8\n"));
    for error in check(&project, &WITHOUT_MANIFEST, &[], 3) {
        let diagnostics = &error["diagnostics"];
        assert_eq!(diagnostics["file"], "pipeline.toml", "{error:#}");
        let found = diagnostics["errors"].as_array().unwrap();
        let found = found.iter().find(|found| found["message"].as_str().unwrap().contains("degre")).unwrap();
        assert_eq!(found["help"], "did you mean \"degree\"?", "{found:#}");
        let text = fs::read_to_string(project.path("pipeline.toml")).unwrap();
        let span = [0, 1].map(|end| found["span"][end].as_u64().unwrap() as usize);
        assert_eq!(&text[span[0]..span[1]], "degre");
        let before = &text[..span[0]];
        assert_eq!(found["line"], before.matches('\n').count() + 1);
        assert_eq!(found["column"], 1);
    }
    fs::remove_file(project.path("pipeline.toml")).unwrap();
    for error in check(&project, &WITHOUT_MANIFEST, &[], 3) {
        assert!(error["diagnostics"]["errors"][0]["line"].is_null(), "{error:#}");
    }
}

#[test]
fn errors_of_the_command_line_are_data_too() {
    let project = Project::small();
    for error in check(&project, &[], &["--bogus"], 2) {
        assert!(error["error"][0].as_str().unwrap().contains("'--bogus'"), "{error:#}");
    }
    check(&project, &[], &["-C", "nowhere"], 2);
    for command in COMMANDS {
        let before = project.specula(&[&["-C", "nowhere"][..], command, &["--json"][..]].concat());
        error_of(&before, command);
    }
    for (arguments, named) in [
        (&["build", "lightning", "--json"][..], "lighting"),
        (&["watch", "lightning", "--json"], "lighting"),
        (&["explain", "lightning", "--json"], "lighting"),
        (&["verify", "nowhere.exr", "--json"], "specula build"),
        (&["inspect", "pipeline.toml", "--json"], "specula graph"),
    ] {
        let run = project.specula(arguments).ends(2, []);
        let error = error_of(&run, arguments);
        assert!(error["help"].as_str().unwrap().contains(named), "{error:#}");
    }
}

#[test]
fn errors_of_the_system_are_data_too() {
    let project = Project::small();
    project.ok(&["build"]);
    let lock = File::options().write(true).open(project.path(".specula/lock")).unwrap();
    lock.lock().unwrap();
    let run = project.specula(&["build", "--json", "--wait=0"]).ends(4, []);
    assert!(error_of(&run, &["build"])["error"][0].as_str().unwrap().contains("already running"), "{run:?}");
    drop(lock);

    project.write("taken", "a file, not a folder");
    let run = project.specula(&["build", "--json", "--timings=taken"]).ends(4, []);
    assert!(error_of(&run, &["build"])["error"][0].as_str().unwrap().contains("timings"), "{run:?}");

    fs::remove_dir_all(project.path(".specula")).unwrap();
    project.write(".specula", "a file, not a folder");
    // A watcher tries again.
    check(&project, &["watch", "check", "inspect"], &[], 4);
}

#[test]
fn settings_that_cannot_be_read_stop_nothing_and_those_with_errors_stop_a_build() {
    let project = Project::small();
    project.write("file", "");
    fs::create_dir(project.path("home")).unwrap();
    let build = |variables: &[(&str, &str)]| {
        let mut command = project.command(&["build", "--json"]);
        for name in ["HOME", "XDG_CONFIG_HOME"] {
            command.env_remove(name);
        }
        for (name, value) in variables {
            command.env(name, if *value == "file" { project.path("file") } else { (*value).into() });
        }
        Run::from(command.output().unwrap())
    };
    let long = "/x".repeat(3000);
    for variables in [
        &[][..],
        &[("HOME", "")],
        &[("HOME", "/dev/null")],
        &[("HOME", "file")],
        &[("HOME", "/nowhere/at/all")],
        &[("HOME", "nowhere")],
        &[("HOME", &long)],
        &[("XDG_CONFIG_HOME", "file")],
        &[("XDG_CONFIG_HOME", "/dev/null")],
        &[("XDG_CONFIG_HOME", "")],
    ] {
        let run = build(variables);
        assert_eq!((run.code, run.stderr.as_str()), (Some(0), ""), "{variables:?}");
    }
    fs::create_dir(project.path("specula.toml")).unwrap();
    let run = build(&[]);
    assert_eq!(run.code, Some(0), "{run:?}");
    assert!(run.stderr.starts_with("warning: specula.toml is ignored, because "), "{}", run.stderr);
    fs::remove_dir(project.path("specula.toml")).unwrap();

    project.write("specula.toml", "[remote]\nuplaod = \"never\"\n");
    let run = build(&[]);
    assert_eq!(run.code, Some(3), "{run:?}");
    let place = "error: specula.toml:2:1: unknown key \"uplaod\"";
    assert!(run.stderr.starts_with(place), "{}", run.stderr);
    assert!(run.stderr.contains("did you mean \"upload\"?"), "{}", run.stderr);
    let found = &error_of(&run, &["build"])["diagnostics"];
    assert_eq!((&found["file"], &found["errors"][0]["line"]), (&"specula.toml".into(), &2.into()));
}

#[test]
fn colours_are_forced_or_forbidden_by_the_environment() {
    let project = Project::new("schema = 1\n[stage.a]\nkind = \"project-hs\"\n");
    let has_colour = |arguments: &[&str], variables: &[(&str, &str)]| {
        let mut command = project.command(arguments);
        command.env_remove("NO_COLOR").envs(variables.iter().copied());
        command.output().unwrap().stderr.contains(&0x1b)
    };
    // The errors of the manifest, and those of the command line, which clap prints.
    for arguments in [&["check"][..], &["check", "--bogus"]] {
        let with = |more: &[&'static str], variables: &[(&str, &str)]| {
            has_colour(&[arguments, more].concat(), variables)
        };
        assert!(!with(&[], &[]), "standard error is not a terminal");
        assert!(with(&[], &[("FORCE_COLOR", "1")]), "{arguments:?}");
        assert!(with(&[], &[("CLICOLOR_FORCE", "1")]), "{arguments:?}");
        assert!(!with(&[], &[("FORCE_COLOR", "1"), ("NO_COLOR", "1")]), "{arguments:?}");
        assert!(!with(&["--color=never"], &[("FORCE_COLOR", "1")]), "{arguments:?}");
    }
    assert!(has_colour(&["check", "--color=always"], &[("NO_COLOR", "1")]));
    assert!(has_colour(&["--color=always", "check", "--bogus"], &[("NO_COLOR", "1")]));
}
