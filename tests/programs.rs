//! Programs that `exec` runs: where PATH leads is a thing that an item depends on, like a file.

use std::env;
use std::fs;
use std::os::unix::fs::{PermissionsExt, symlink};
use std::process::{Command, Stdio};

use crate::support::{Project, Run, Watcher, assert_has};

const GRADE: &str = r#"
schema = 1

[stage.graded]
kind = "exec"
command = ["grade", "{output}"]
output = { type = "file", format = "txt" }
path = "graded"

[stage.other]
kind = "exec"
command = ["sh", "-c", "echo sh > $0", "{output}"]
output = { type = "file", format = "txt" }
path = "other"
"#;

/// A project with the folders `one` and `two`, each with its own program `grade`.
fn project() -> Project {
    let project = Project::new(GRADE);
    program(&project, "one/grade", "one");
    program(&project, "two/grade", "two");
    project
}

/// Writes a program that writes a word to the file of its last argument.
fn program(project: &Project, name: &str, word: &str) {
    script(project, name, &format!("#!/bin/sh\necho {word} > \"$1\"\n"));
}

fn script(project: &Project, name: &str, text: &str) {
    project.write(name, text);
    mode(project, name, 0o755);
}

fn mode(project: &Project, name: &str, mode: u32) {
    fs::set_permissions(project.path(name), fs::Permissions::from_mode(mode)).unwrap();
}

/// PATH with these folders of the project before those of the test.
fn path(project: &Project, folders: &[&str]) -> std::ffi::OsString {
    let own = env::var_os("PATH").unwrap();
    env::join_paths(folders.iter().map(|name| project.path(name)).chain(env::split_paths(&own))).unwrap()
}

fn specula(project: &Project, folders: &[&str], arguments: &[&str]) -> Run {
    project.command(arguments).env("PATH", path(project, folders)).output().unwrap().into()
}

/// What the stage `graded` published after a build that succeeded, and how many items ran.
fn build(project: &Project, folders: &[&str]) -> (String, usize) {
    let run = specula(project, folders, &["build", "--json"]);
    assert_eq!(run.code, Some(0), "{}{}", run.stdout, run.stderr);
    (graded(project), run.stdout.matches("\"event\":\"finished\"").count())
}

fn graded(project: &Project) -> String {
    fs::read_to_string(project.path("out/graded.txt")).unwrap().trim_end().to_owned()
}

#[test]
fn another_program_of_that_name_reruns_the_item() {
    let project = project();
    assert_eq!(build(&project, &["one"]), ("one".into(), 2));
    assert_eq!(build(&project, &["one"]), ("one".into(), 0));
    assert_eq!(build(&project, &["one", "two"]), ("one".into(), 0), "one/grade is still the first");
    assert_eq!(build(&project, &["missing", "one"]), ("one".into(), 0));
    assert_eq!(build(&project, &["two", "one"]), ("two".into(), 1), "it is hidden");
    assert_eq!(build(&project, &["one", "two"]), ("one".into(), 0), "the result is in the cache");
    fs::remove_file(project.path("one/grade")).unwrap();
    assert_eq!(build(&project, &["one", "two"]), ("two".into(), 0), "it is gone");
    program(&project, "one/grade", "three");
    assert_eq!(build(&project, &["one", "two"]), ("three".into(), 1), "it is back");
    mode(&project, "one/grade", 0o644);
    assert_eq!(build(&project, &["one", "two"]), ("two".into(), 0), "it cannot be run");
    mode(&project, "one/grade", 0o755);
    assert_eq!(build(&project, &["one", "two"]), ("three".into(), 0), "it can be run again");
    fs::rename(project.path("one"), project.path("real")).unwrap();
    symlink("real", project.path("one")).unwrap();
    assert_eq!(build(&project, &["one", "two"]), ("three".into(), 0), "by way of a link");
    fs::remove_file(project.path("one")).unwrap();
    symlink("two", project.path("one")).unwrap();
    assert_eq!(build(&project, &["one"]), ("two".into(), 1), "the link leads elsewhere");
}

#[test]
fn a_program_that_is_gone_fails_the_item_and_its_output_stays() {
    let project = project();
    build(&project, &["one"]);
    specula(&project, &[], &["build"]).ends(1, ["there is no program \"grade\" in PATH"]);
    assert_eq!(graded(&project), "one");
    assert_eq!(build(&project, &["one"]), ("one".into(), 0));
}

#[test]
fn dry_runs_explain_and_verify_say_what_path_finds() {
    let project = project();
    build(&project, &["one"]);
    let text = |folders: &[&str], arguments: &[&str]| {
        let run = specula(&project, folders, arguments);
        run.stdout + &run.stderr
    };
    let expected = "PATH finds two/grade instead of one/grade";
    assert_has(text(&["two", "one"], &["build", "--dry-run", "--verbose"]), [expected]);
    let explained = text(&["two", "one"], &["explain", "graded"]);
    assert!(explained.contains(expected), "{explained}");
    assert!(explained.contains("PATH finds one/grade for grade"), "{explained}");
    let verified = text(&["two", "one"], &["verify", "out/graded.txt"]);
    assert!(verified.contains(&format!("changed   {expected}")), "{verified}");
    let verified = text(&[], &["verify", "out/graded.txt"]);
    assert!(verified.contains("PATH finds no grade any more; it found one/grade"), "{verified}");
    let verified = text(&["one"], &["verify", "out/graded.txt"]);
    assert!(verified.starts_with("out/graded.txt: current"), "{verified}");

    let json = specula(&project, &["two"], &["verify", "--json", "out/graded.txt"]).stdout;
    let json: serde_json::Value = serde_json::from_str(&json).unwrap();
    let sources = json["verification"]["sources"].as_array().unwrap_or_else(|| panic!("{json:#}"));
    let found = sources.iter().find(|source| source["lookup"] == true).unwrap();
    assert_eq!(
        (&found["path"], &found["listing"], &found["old_found"], &found["new_found"]),
        (&"grade".into(), &false.into(), &"one/grade".into(), &"two/grade".into())
    );
}

/// A watcher whose PATH begins with these folders.
fn watch(project: &Project, folders: &[&str], arguments: &[&str]) -> Watcher {
    let mut command = project.command(&[&["watch", "--json"], arguments].concat());
    command.env("PATH", path(project, folders)).stdout(Stdio::piped()).stderr(Stdio::null());
    let mut watcher = Watcher::new(command.spawn().unwrap());
    watcher.wait_until_it_watches();
    watcher
}

/// Waits until a build has published this word.
fn expect(project: &Project, watcher: &mut Watcher, word: &str) {
    while graded(project) != word {
        watcher.wait_for_build();
    }
}

#[test]
fn a_watcher_notices_what_path_finds() {
    for arguments in [&[][..], &["--poll", "100"]] {
        let project = project();
        fs::rename(project.path("two"), project.path("later")).unwrap();
        let mut watcher = watch(&project, &["missing", "two", "one"], arguments);
        assert_eq!(graded(&project), "one");
        fs::rename(project.path("later"), project.path("two")).unwrap();
        // A folder of PATH appeared.
        expect(&project, &mut watcher, "two");
        mode(&project, "two/grade", 0o644);
        // It cannot be run.
        expect(&project, &mut watcher, "one");
        program(&project, "missing/grade", "missing");
        expect(&project, &mut watcher, "missing");
        program(&project, "missing/grade", "edited");
        expect(&project, &mut watcher, "edited");
        fs::remove_dir_all(project.path("missing")).unwrap();
        // The first folder is gone.
        expect(&project, &mut watcher, "one");
        mode(&project, "two/grade", 0o755);
        expect(&project, &mut watcher, "two");
    }
}

#[test]
fn the_interpreter_that_env_looks_up_is_a_tool() {
    for first_line in ["#!/usr/bin/env interp", "#!/usr/bin/env -S MODE=fast interp -u"] {
        let project = project();
        script(&project, "one/grade", &format!("{first_line}\n"));
        for (folder, word) in [("one", "first"), ("two", "second")] {
            // The last argument is the output.
            let text = format!("#!/bin/sh\nfor last; do :; done\necho {word} > $last\n");
            script(&project, &format!("{folder}/interp"), &text);
        }
        fs::remove_file(project.path("two/grade")).unwrap();
        assert_eq!(build(&project, &["one", "two"]), ("first".into(), 2), "{first_line}");
        assert_eq!(build(&project, &["two", "one"]), ("second".into(), 1), "{first_line}");
        assert_eq!(build(&project, &["one", "two"]), ("first".into(), 0), "{first_line}");
        let mut watcher = watch(&project, &["one", "two"], &[]);
        mode(&project, "one/interp", 0o644);
        expect(&project, &mut watcher, "second");
    }
}

#[test]
fn a_watcher_notices_files_inside_arguments() {
    let project = project();
    let command =
        r#"command = ["sh", "-c", "cat {folder}/luts/film.cube $1/* > $0", "{output}", "{folder}/more"]"#;
    project.write("pipeline.toml", &GRADE.replace(r#"command = ["grade", "{output}"]"#, command));
    project.write("luts/film.cube", "one\n");
    project.write("more/a", "a\n");
    let mut watcher = watch(&project, &[], &[]);
    assert_eq!(graded(&project), "one\na");
    project.write("luts/film.cube", "two\n");
    expect(&project, &mut watcher, "two\na");
    project.write("more/b", "b\n");
    expect(&project, &mut watcher, "two\na\nb");
    fs::remove_dir_all(project.path("more")).unwrap();
    watcher.wait("failed", |_| true);
    project.write("more/c", "c\n");
    expect(&project, &mut watcher, "two\nc");
}

#[test]
fn a_failed_program_is_kept_for_a_run_by_hand() {
    let project = project();
    script(&project, "one/grade", "#!/bin/sh\necho why >&2; exit 3\n");
    specula(&project, &["one"], &["build"]).ends(1, ["/one/grade output.txt", "--keep-scratch"]);
    let run = specula(&project, &["one"], &["build", "--keep-scratch"]);
    let line = run.stderr.lines().find(|line| line.trim_start().starts_with("cd ")).unwrap();
    assert!(line.contains(".specula/kept/graded-") && line.contains("PATH=\"$PATH\""), "{}", run.stderr);
    let again = Command::new("sh").args(["-c", line]).output().unwrap();
    assert_eq!((again.status.code(), again.stderr.as_slice()), (Some(3), &b"why\n"[..]), "{line}");
    assert!(
        specula(&project, &["one"], &["build"]).code == Some(1) && project.path(".specula/kept").exists()
    );
    project.ok(&["cache", "gc"]);
    assert!(!project.path(".specula/kept").exists());
}

#[test]
fn a_link_into_out_is_refused_until_it_leads_elsewhere() {
    let project = project();
    let command = r#"command = ["sh", "-c", "cat {folder}/film.cube > $0", "{output}"]"#;
    project.write("pipeline.toml", &GRADE.replace(r#"command = ["grade", "{output}"]"#, command));
    project.write("luts/film.cube", "one\n");
    let film = project.path("film.cube");
    symlink("luts/film.cube", &film).unwrap();
    let mut watcher = watch(&project, &[], &[]);
    assert_eq!(graded(&project), "one");
    fs::remove_file(&film).unwrap();
    symlink("out/other.txt", &film).unwrap();
    let events = watcher.wait("rejected", |_| true);
    assert_has(events.last().unwrap().to_string(), ["is inside \\\"out\\\", the folder for exports"]);
    assert_eq!(specula(&project, &[], &["check"]).code, Some(3));
    project.write("luts/film.cube", "two\n");
    fs::remove_file(&film).unwrap();
    symlink("luts/film.cube", &film).unwrap();
    watcher.wait("accepted", |_| true);
    expect(&project, &mut watcher, "two");
}
