//! What Windows has and Unix has not: files that others do not share, marks of version control, drives, other
//! separators, scripts of `cmd`, and its ways to interrupt a program.

use std::fs::{self, File};
use std::io::Write as _;
use std::os::windows::fs::OpenOptionsExt;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use crate::support::{Project, Run, Watcher, assert_has};

const GOLD: &str = "assets/materials/gold.toml";

/// A manifest whose only file is the text that a tool writes.
fn tool(command: &str) -> String {
    format!(
        "schema = 1\n[stage.graded]\nkind = \"exec\"\ncommand = {command}\n\
         output = {{ type = \"file\", format = \"txt\" }}\npath = \"graded\"\n"
    )
}

fn graded(project: &Project) -> String {
    fs::read_to_string(project.path("out/graded.txt")).unwrap().trim_end().to_owned()
}

/// Opens a file as programs do that let nobody else read (0) or replace (1) it.
fn hold(path: &Path, share: u32) -> File {
    File::options().read(true).share_mode(share).open(path).unwrap()
}

fn mark_read_only(path: &Path, is_marked: bool) {
    let mut permissions = fs::metadata(path).unwrap().permissions();
    permissions.set_readonly(is_marked);
    fs::set_permissions(path, permissions).unwrap();
}

/// Standard error as it is, with the system's separators.
fn messages(command: &mut Command) -> String {
    String::from_utf8(command.output().unwrap().stderr).unwrap()
}

#[test]
fn people_see_backslashes_and_manifests_records_and_events_have_slashes() {
    let project = Project::small();
    let events = project.events(&[]);
    assert!(events.iter().any(|event| event["event"] == "published" && event["file"] == "maps/chalk.exr"));
    fs::remove_dir_all(project.path(".specula")).unwrap();
    fs::remove_dir_all(project.path("out")).unwrap();
    let text = messages(&mut project.command(&["build", "--verbose"]));
    assert_has(&text, ["published  maps\\gold.exr"]);
    assert!(!text.lines().any(|line| line.contains("maps/")), "{text}");
    project.write(GOLD, "model = \"fong\"\n");
    let text = messages(&mut project.command(&["build"]));
    assert_has(&text, ["assets\\materials\\gold.toml"]);
    assert!(!text.contains("assets\\materials/") && !text.contains("assets/"), "{text}");
    let journal = fs::read_to_string(project.path(".specula/journal")).unwrap();
    assert!(journal.contains("maps/gold.exr") && !journal.contains("maps\\\\gold.exr"));
    assert!(journal.contains("\"assets/materials/gold.toml\""));
}

#[test]
fn an_output_that_another_program_has_open_stays_and_is_published_when_it_is_let_go() {
    let project = Project::small();
    project.ok(&["build"]);
    let before = project.outputs();
    let held = hold(&project.path("out/maps/gold.exr"), 1);
    project.write(GOLD, "model = \"phong\"\nexponent = 5\nspecular = 1\n");
    let run = project.specula(&["build"]);
    assert_ne!(run.code, Some(0));
    assert_has(
        &run.stderr,
        ["cannot write", "maps/gold.exr", "has it open", "close the file in that program"],
    );
    assert_eq!(project.outputs()["maps/gold.exr"], before["maps/gold.exr"]);
    let mut build = project.start(&["build"]);
    std::thread::sleep(Duration::from_millis(700));
    drop(held);
    assert_eq!(build.wait().unwrap().code(), Some(0), "it waits for a while");
    assert_ne!(project.outputs()["maps/gold.exr"], before["maps/gold.exr"]);
}

#[test]
fn a_watcher_publishes_once_the_output_is_let_go_and_reads_once_the_source_is() {
    let project = Project::small();
    let mut watcher = project.watch(&[]);
    watcher.wait_until_it_watches();
    let before = map_of_gold(&project);
    let held = hold(&project.path("out/maps/gold.exr"), 1);
    project.write(GOLD, "model = \"phong\"\nexponent = 5\nspecular = 1\n");
    watcher.wait("failed", |failed| failed.to_string().contains("has it open"));
    drop(held);
    until_map_differs(&mut watcher, &project, &before);
    let before = map_of_gold(&project);
    project.write(GOLD, "model = \"phong\"\nexponent = 9\nspecular = 1\n");
    let held = hold(&project.path(GOLD), 0);
    std::thread::sleep(Duration::from_millis(2500));
    drop(held);
    until_map_differs(&mut watcher, &project, &before);
}

/// The content of a map of gold, if it is there at this moment.
fn map_of_gold(project: &Project) -> Option<Vec<u8>> {
    fs::read(project.path("out/maps/gold.exr")).ok()
}

fn until_map_differs(watcher: &mut Watcher, project: &Project, before: &Option<Vec<u8>>) {
    until(watcher, || map_of_gold(project).is_some_and(|map| before.as_ref() != Some(&map)));
}

fn until(watcher: &mut Watcher, is_so: impl Fn() -> bool) {
    let deadline = Instant::now() + Duration::from_secs(60);
    while !is_so() {
        assert!(watcher.lives() && Instant::now() < deadline);
        std::thread::sleep(Duration::from_millis(20));
    }
}

#[test]
fn a_source_that_another_program_keeps_to_itself_is_named_with_that_program() {
    let project = Project::small();
    let held = hold(&project.path(GOLD), 0);
    let run = project.specula(&["build"]);
    assert_ne!(run.code, Some(0));
    assert_has(&run.stderr, ["cannot read", "assets/materials/gold.toml", "has it open"]);
    drop(held);
    project.ok(&["build"]);
}

#[test]
fn an_output_that_is_marked_read_only_is_replaced_or_the_error_says_what_to_do() {
    let project = Project::small();
    project.ok(&["build"]);
    let before = project.outputs();
    let place = project.path("out/maps/gold.exr");
    mark_read_only(&place, true);
    project.write(GOLD, "model = \"phong\"\nexponent = 5\nspecular = 1\n");
    let run = project.specula(&["build"]);
    if run.code != Some(0) {
        assert_has(&run.stderr, ["the file is marked read-only", "check it out of version control"]);
        assert_eq!(project.outputs(), before_but(&before, &project));
        mark_read_only(&place, false);
        project.ok(&["build"]);
    }
    assert_ne!(project.outputs()["maps/gold.exr"], before["maps/gold.exr"]);
    // A source may be marked.
    mark_read_only(&project.path(GOLD), true);
    project.ok(&["build", "--force"]);
    mark_read_only(&project.path(GOLD), false);
}

type Files = std::collections::BTreeMap<String, Vec<u8>>;

/// What was there, with the faces of gold that the failed build made.
fn before_but(before: &Files, project: &Project) -> Files {
    let mut expected = before.clone();
    let now = project.outputs();
    expected.extend(now.into_iter().filter(|(name, _)| name.starts_with("faces/gold/")));
    expected
}

#[test]
fn drives_in_either_case_and_verbatim_paths_lead_to_one_project() {
    let project = Project::small();
    project.ok(&["build"]);
    let plain = project.path("pipeline.toml").to_str().unwrap().to_owned();
    let (drive, rest) = plain.split_at(1);
    let spellings = [
        format!("{}{rest}", drive.to_lowercase()),
        format!("{}{rest}", drive.to_uppercase()),
        plain.replace('\\', "/"),
        format!(r"\\?\{plain}"),
    ];
    for (exponent, path) in spellings.iter().enumerate() {
        let run = project.specula(&["build", "--json", "--manifest", path]);
        assert_eq!(run.code, Some(0), "{path}: {}", run.stderr);
        assert!(!run.stdout.contains("\"event\":\"finished\""), "{path}: {}", run.stdout);
        let mut watcher = project.watch(&["--manifest", path]);
        watcher.wait_until_it_watches();
        project.write(GOLD, &format!("model = \"phong\"\nexponent = {}\nspecular = 1\n", exponent + 3));
        watcher.wait("finished", |finished| finished["item"]["stage"] == "map");
        drop(watcher);
        project.ok(&["build"]);
    }
}

#[test]
fn out_and_sources_may_be_on_other_drives() {
    let project = Project::small();
    let Some(other) = other_drive() else {
        return test_data::skip("out_and_sources_may_be_on_other_drives", "there is one drive");
    };
    let materials = other.path().join("materials");
    crate::support::copy_folder(&project.path("assets/materials"), &materials);
    let source = materials.to_str().unwrap().replace('\\', "/");
    let manifest = fs::read_to_string(project.path("pipeline.toml")).unwrap();
    project.write("pipeline.toml", &manifest.replace("assets/materials", &source));
    let mut watcher = project.watch(&[]);
    watcher.wait_until_it_watches();
    let before = map_of_gold(&project);
    fs::write(materials.join("gold.toml"), "model = \"phong\"\nexponent = 5\nspecular = 1\n").unwrap();
    until_map_differs(&mut watcher, &project, &before);
}

/// A folder on another drive than the folder for temporary files.
fn other_drive() -> Option<tempfile::TempDir> {
    let temporary = std::env::temp_dir();
    let drives = ('C'..='Z').map(|letter| PathBuf::from(format!("{letter}:\\")));
    let others = drives.filter(|drive| drive.exists() && !temporary.starts_with(drive));
    others.flat_map(|drive| [drive.join("tmp"), drive]).find_map(|folder| tempfile::tempdir_in(folder).ok())
}

#[test]
fn paths_of_more_than_260_characters_are_read_written_and_watched() {
    let project = Project::small();
    let deep = (0..8).map(|level| format!("{level}-{}", "x".repeat(40))).collect::<Vec<_>>().join("/");
    assert!(project.path(&deep).as_os_str().len() > 300);
    let folder = project.path(&deep);
    fs::create_dir_all(&folder).unwrap();
    fs::copy(project.path(GOLD), folder.join("gold.toml")).unwrap();
    let manifest = fs::read_to_string(project.path("pipeline.toml")).unwrap();
    let manifest = manifest.replace("assets/materials/*.toml", &format!("{deep}/*.toml"));
    project.write(
        "pipeline.toml",
        &manifest.replace("\"maps/{material}\"", &format!("\"{deep}/{{material}}\"")),
    );
    project.ok(&["build"]);
    let place = format!("{deep}/gold.exr");
    let before = project.outputs();
    assert!(before.contains_key(&place), "{:?}", before.keys());
    let mut watcher = project.watch(&["--poll"]);
    watcher.wait_until_it_watches();
    fs::write(folder.join("gold.toml"), "model = \"phong\"\nexponent = 5\nspecular = 1\n").unwrap();
    let map = || fs::read(project.path("out").join(&place)).ok();
    until(&mut watcher, || map().is_some_and(|map| map != before[&place]));
}

#[test]
fn a_manifest_with_crlf_and_a_byte_order_mark_is_the_same_manifest() {
    let project = Project::small();
    project.ok(&["build"]);
    let manifest = fs::read_to_string(project.path("pipeline.toml")).unwrap();
    for text in [manifest.replace('\n', "\r\n"), format!("\u{feff}{}", manifest.replace('\n', "\r\n"))] {
        project.write("pipeline.toml", &text);
        let gold = fs::read_to_string(project.path(GOLD)).unwrap().replace("\r\n", "\n");
        project.write(GOLD, &gold.replace('\n', "\r\n"));
        let run = project.ok(&["build", "--json"]);
        assert!(!run.stdout.contains("\"event\":\"published\""), "{}", run.stdout);
    }
    project
        .write("pipeline.toml", &manifest.replace('\n', "\r\n").replace("degree = 8\r\n", "degre = 8\r\n"));
    let text = messages(&mut project.command(&["build"]));
    assert!(text.contains("unknown key \"degre\"") && !text.contains("\\r"), "{text}");
}

#[test]
fn a_source_that_is_renamed_in_case_alone_is_built_again_under_its_name() {
    let project = Project::small();
    let has = |folder: &str, name: &str| {
        fs::read_dir(project.path(folder)).unwrap().any(|entry| entry.unwrap().file_name() == name)
    };
    let mut watcher = project.watch(&[]);
    watcher.wait_until_it_watches();
    fs::rename(project.path(GOLD), project.path("assets/materials/Gold.toml")).unwrap();
    if !has("assets/materials", "Gold.toml") {
        const TEST: &str = "a_source_that_is_renamed_in_case_alone_is_built_again_under_its_name";
        return test_data::skip(TEST, "this system does not rename a file in case alone");
    }
    until(&mut watcher, || has("out/maps", "Gold.exr") && !has("out/maps", "gold.exr"));
}

#[test]
fn a_file_that_the_manifest_spells_in_another_case_is_watched() {
    let manifest = crate::support::SMALL.replace("assets/materials/*.toml", "assets/Materials/GOLD.toml");
    let project = Project::new(&manifest);
    let mut watcher = project.watch(&[]);
    watcher.wait_until_it_watches();
    let map = || {
        let mut maps = fs::read_dir(project.path("out/maps")).unwrap();
        maps.find_map(|map| fs::read(map.unwrap().path()).ok())
    };
    let before = map();
    assert!(before.is_some());
    project.write(GOLD, "model = \"phong\"\nexponent = 5\nspecular = 1\n");
    until(&mut watcher, || map().is_some_and(|map| Some(map) != before));
}

#[test]
fn names_that_windows_cannot_have_are_refused_before_anything_runs() {
    let project = Project::small();
    let manifest = fs::read_to_string(project.path("pipeline.toml")).unwrap();
    for (path, message) in [
        ("maps./{material}", "ends with a dot or a space"),
        ("maps/{material} ", "ends with a dot or a space"),
        ("aux/{material}", "a device on Windows"),
        ("a:b/{material}", "leaves \"out\""),
        ("maps/a:b{material}", "does not allow in names"),
    ] {
        project.write("pipeline.toml", &manifest.replace("maps/{material}", path));
        project.specula(&["build"]).ends(3, [message]);
    }
    assert!(!project.path("out").exists());
}

#[test]
fn sources_behind_a_junction_are_found_and_watched() {
    let project = Project::small();
    fs::rename(project.path("assets/materials"), project.path("materials of the studio")).unwrap();
    let [link, target] = ["assets/materials", "materials of the studio"].map(|name| project.path(name));
    let made = Command::new("cmd").args(["/c", "mklink", "/J"]).arg(&link).arg(&target).output().unwrap();
    if !made.status.success() || !link.exists() {
        return test_data::skip(
            "sources_behind_a_junction_are_found_and_watched",
            "mklink makes no junctions",
        );
    }
    let mut watcher = project.watch(&[]);
    watcher.wait_until_it_watches();
    let before = map_of_gold(&project);
    fs::write(target.join("gold.toml"), "model = \"phong\"\nexponent = 5\nspecular = 1\n").unwrap();
    until_map_differs(&mut watcher, &project, &before);
}

#[test]
fn batch_files_are_tools_by_their_name_their_path_and_their_ending() {
    for (name, command) in [
        ("tools/grade.bat", r#"["tools/grade.bat", "{output}", "a word"]"#),
        ("tools/grade.CMD", r#"["tools/grade.CMD", "{output}", "a word"]"#),
        ("bin/grade.cmd", r#"["grade", "{output}", "a word"]"#),
        ("bin/grade.bat", r#"["grade.bat", "{output}", "a word"]"#),
    ] {
        let project = Project::new(&tool(command));
        project.write(name, "@echo off\r\necho one %~2> \"%~1\"\r\n");
        let build = || -> Run {
            let path = std::env::var("PATH").unwrap();
            let path = format!("{};{path}", project.path("bin").display());
            project.command(&["build", "--json"]).env("PATH", path).output().unwrap().into()
        };
        let run = build();
        assert_eq!(run.code, Some(0), "{name}: {}{}", run.stdout, run.stderr);
        assert_eq!(graded(&project), "one a word", "{name}");
        assert!(!build().stdout.contains("\"event\":\"finished\""), "{name}");
        project.write(name, "@echo off\r\necho two %~2> \"%~1\"\r\n");
        assert!(build().stdout.contains("\"event\":\"finished\""), "{name}");
        assert_eq!(graded(&project), "two a word", "{name}");
    }
}

#[test]
fn pathext_says_which_endings_are_programs() {
    let project = Project::new(&tool(r#"["grade", "{output}"]"#));
    project.write("bin/grade.bat", "@echo bat> \"%~1\"\r\n");
    project.write("bin/grade.cmd", "@echo cmd> \"%~1\"\r\n");
    for (endings, expected) in [(".BAT;.CMD", "bat"), (".cmd;.bat", "cmd"), (".EXE", "")] {
        let path = format!("{};{}", project.path("bin").display(), std::env::var("PATH").unwrap());
        let mut command = project.command(&["build"]);
        let run = Run::from(command.env("PATH", path).env("PATHEXT", endings).output().unwrap());
        match expected {
            "" => assert_has(&run.stderr, ["\"grade\""]),
            _ => assert_eq!((run.code, graded(&project).as_str()), (Some(0), expected), "{}", run.stderr),
        }
    }
}

#[test]
fn a_script_without_an_interpreter_is_an_error_that_says_so() {
    let project = Project::new(&tool(r##"["tools/grade.sh", "{output}"]"##));
    project.write("tools/grade.sh", "#!/bin/sh\necho x > \"$1\"\n");
    let run = project.specula(&["build"]);
    assert_ne!(run.code, Some(0));
    assert_has(&run.stderr, ["tools/grade.sh", "name the interpreter of a script first"]);
}

#[test]
fn the_children_of_a_tool_that_takes_too_long_end_with_it() {
    let manifest = tool(r#"["tools/slow.bat", "{output}"]"#) + "timeout = 2\n";
    let project = Project::new(&manifest);
    let alive = project.path("alive");
    // A child of its own, which would write for ever.
    project.write(
        "tools/slow.bat",
        &format!("@echo off\r\ncmd /c \"for /l %%i in (0,0,1) do @echo x> \"{}\"\"\r\n", alive.display()),
    );
    let run = project.specula(&["build"]);
    assert_has(&run.stderr, ["did not end within 2 s and was killed"]);
    std::thread::sleep(Duration::from_millis(500));
    let _ = fs::remove_file(&alive);
    std::thread::sleep(Duration::from_millis(1000));
    assert!(!alive.exists(), "its child goes on");
}

#[test]
fn control_c_and_control_break_end_a_build_and_a_watcher() {
    /// The exit code of the program that could not send it.
    const NOT_SENT: i32 = 4;
    const TEST: &str = "control_c_and_control_break_end_a_build_and_a_watcher";
    let Some(interrupt) = std::env::var_os("SPECULA_INTERRUPT") else {
        return test_data::skip(
            TEST,
            "SPECULA_INTERRUPT does not name the program that tests/windows.sh builds",
        );
    };
    for event in ["c", "break"] {
        for (arguments, code) in [(&["watch", "--json"][..], 0), (&["watch", "--json", "--once"][..], 130)] {
            let project = Project::small();
            let specula = project.command(arguments);
            let mut command = Command::new(&interrupt);
            command.arg(event).arg(specula.get_program()).args(arguments).current_dir(project.path(""));
            command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::null());
            let mut child = command.spawn().unwrap();
            let mut input = child.stdin.take().unwrap();
            let mut watcher = Watcher::new(child);
            watcher.wait_until_it_watches();
            input.write_all(b"now\n").unwrap();
            match watcher.wait_for_exit() {
                Some(NOT_SENT) => test_data::skip(TEST, "this system does not send Ctrl-Break"),
                ended => assert_eq!(ended, Some(code), "{event} {arguments:?}"),
            }
        }
    }
}

#[test]
fn what_is_not_a_terminal_gets_no_escapes_and_no_lines() {
    let project = Project::small();
    project.write("pipeline.toml", &crate::support::SMALL.replace("degree = 8\n", "degre = 8\n"));
    let mut command = project.command(&["build"]);
    ["NO_COLOR", "LANG", "LC_ALL", "LC_CTYPE"].map(|name| _ = command.env_remove(name));
    let text = messages(&mut command);
    assert!(!text.contains('\x1b'), "{text:?}");
    assert!(text.is_ascii(), "a legacy code page would show other characters: {text}");
}
