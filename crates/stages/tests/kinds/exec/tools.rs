//! What a command line reads beside its inputs: which edits rerun it, what it may not read, what cannot be
//! told.

use std::fs;
use std::os::unix::fs::{PermissionsExt, symlink};
use std::process::Command;

use engine::{BuildOptions, Event, Plan};

use super::{Built, Project};

/// A stage without inputs that runs these words after `sh`, and adds lines of its own.
fn stage(words: &[&str], lines: &str) -> String {
    let words = words.iter().map(|word| format!("{word:?}")).collect::<Vec<_>>().join(", ");
    format!("command = [\"sh\", {words}]\noutput = {{ type = \"file\", format = \"txt\" }}\n{lines}\n")
}

/// Prints every file that its arguments name, alone or after a `=`; the last argument is the output.
const PRINT: &str = "for word; do last=$word; done
for word; do
    word=${word#--*=}
    if [ -d \"$word\" ]; then cat \"$word\"/* >> $last; elif [ -f \"$word\" ]; then cat \"$word\" >> $last; fi
done; echo >> $last; true";

const FILES: [(&str, &str); 5] = [
    ("tools/print.sh", PRINT),
    ("tools/film.cube", "one"),
    ("tools/my lut.cube", "spaced"),
    ("luts/a.cube", "a"),
    ("tools/run.sh", "echo run > $1"),
];

fn warnings(built: &Built) -> Vec<String> {
    let warned = built.events.iter().filter_map(|event| match event {
        Event::Warning { message, .. } => Some(message.clone()),
        _ => None,
    });
    warned.collect()
}

/// The number of items that a build ran after an edit of a file.
fn ran_after(project: &Project, file: &str, text: &str) -> usize {
    project.write(file, text.as_bytes());
    project.build().graded().len()
}

#[test]
fn every_path_that_an_argument_names_is_tracked() {
    let script = |script: &'static str| vec!["-c", script, "{output}"];
    for (words, file) in [
        (vec!["tools/print.sh", "--lut={folder}/tools/film.cube", "{output}"], "tools/film.cube"),
        (vec!["tools/print.sh", "--lut=tools/film.cube", "{output}"], "tools/film.cube"),
        (vec!["tools/print.sh", "{folder}/tools/film.cube", "{output}"], "tools/film.cube"),
        (vec!["tools/print.sh", "tools/my lut.cube", "{output}"], "tools/my lut.cube"),
        (vec!["tools/print.sh", "--lut={folder}/tools/my lut.cube", "{output}"], "tools/my lut.cube"),
        (vec!["tools/print.sh", "{folder}/luts", "{output}"], "luts/a.cube"),
        (vec!["tools/print.sh", "luts", "{output}"], "luts/a.cube"),
        (vec!["tools/print.sh", "./luts/", "{output}"], "luts/new.cube"),
        (vec!["tools/print.sh", "--luts={folder}/luts", "{output}"], "luts/deep/new.cube"),
        (vec!["tools/print.sh", "{folder}/tools/run.sh,{folder}/luts/a.cube", "{output}"], "luts/a.cube"),
        (vec!["tools/print.sh", "--lut={folder}/tools/late.cube", "{output}"], "tools/late.cube"),
        (vec!["tools/print.sh", "tools/late.cube", "{output}"], "tools/late.cube"),
        (vec!["tools/print.sh", "{folder}/late", "{output}"], "late/new.cube"),
        (vec!["-c", "sh {folder}/tools/run.sh {output}"], "tools/run.sh"),
        (vec!["-c", "sh '{folder}/tools/run.sh' {output}; true"], "tools/run.sh"),
        (vec!["-c", "sh \"{folder}\"/tools/run.sh {output}"], "tools/run.sh"),
        (script("cat \"{folder}/tools/my lut.cube\" > $0"), "tools/my lut.cube"),
        (script("(cat {folder}/tools/film.cube {folder}/luts/a.cube)>$0"), "luts/a.cube"),
        (script("cat {folder}/tools/film.cube;cat {folder}/luts/a.cube >$0"), "tools/film.cube"),
        (script("echo `cat {folder}/tools/film.cube` > $0"), "tools/film.cube"),
    ] {
        let project = Project::new(&stage(&words, ""), &FILES);
        let built = project.build();
        assert_eq!((built.failures(), warnings(&built)), (vec![], vec![]), "{words:?}");
        assert_eq!(project.build().graded().len(), 0, "{words:?} is up to date");
        assert_eq!(ran_after(&project, file, "echo edited > $1"), 1, "{words:?} reads {file}");
        assert_eq!(ran_after(&project, "other.txt", "other"), 0, "{words:?}");
    }
}

#[test]
fn what_cannot_be_told_is_a_warning_that_tools_silence() {
    for (words, tools, parts) in [
        (
            vec!["-c", "sh {folder}/tools/run.sh $0; cat tools/film.cube", "{output}"],
            "tools",
            "tools/film.cube",
        ),
        (vec!["-c", "cat {folder}/luts/$1.cube > $0", "{output}", "a"], "luts", "names luts"),
        (vec!["-c", "cat {folder}/luts/*.cube > $0", "{output}"], "luts/a.cube\", \"./luts", "names luts"),
        (
            vec!["-c", "cd {folder} && cat luts/a.cube > $OLDPWD/$0", "{output}"],
            "luts",
            "the manifest's folder",
        ),
        (vec!["tools/print.sh", "--root={folder}", "{output}"], "tools/lib", "the manifest's folder"),
    ] {
        let project = Project::new(&stage(&words, ""), &FILES);
        project.write("tools/lib/x", b"");
        let found = warnings(&project.build());
        assert!(found.iter().any(|warning| warning.contains(parts)), "{words:?}: {found:?}");
        for warning in &found {
            assert!(warning.starts_with("the argument \"") && warning.contains("tools = ["), "{warning}");
        }
        let project = Project::new(&stage(&words, &format!("tools = [\"{tools}\"]")), &FILES);
        project.write("tools/lib/x", b"");
        assert_eq!(warnings(&project.build()), Vec::<String>::new(), "{words:?}");
    }
}

#[test]
fn a_folder_outside_the_project_is_not_read() {
    let outside = tempfile::tempdir().unwrap();
    let words = ["tools/print.sh", outside.path().to_str().unwrap(), "{output}"];
    let project = Project::new(&stage(&words, ""), &FILES);
    fs::write(outside.path().join("x"), "x").unwrap();
    let found = warnings(&project.build());
    assert!(found.len() == 1 && found[0].contains(words[1]), "{found:?}");
    fs::write(outside.path().join("x"), "y").unwrap();
    assert_eq!(project.build().graded().len(), 0);
    let project = Project::new(&stage(&words, &format!("tools = [{:?}]", words[1])), &FILES);
    assert_eq!(warnings(&project.build()), Vec::<String>::new());
    fs::write(outside.path().join("x"), "z").unwrap();
    assert_eq!(project.build().graded().len(), 1);
}

#[test]
fn a_folder_that_contains_out_is_not_read() {
    for words in [
        ["tools/print.sh", "{folder}", "{output}"],
        ["tools/print.sh", "{folder}/.", "{output}"],
        ["tools/print.sh", "{folder}/tools/..", "{output}"],
        ["tools/print.sh", "all", "{output}"],
    ] {
        let project = Project::new(&stage(&words, ""), &FILES);
        symlink(".", project.path("all")).unwrap();
        let built = project.build();
        assert_eq!(warnings(&built).len(), 1, "{words:?}");
        assert_eq!(ran_after(&project, "luts/a.cube", "edited"), 0, "{words:?} is not tracked");
    }
    let project = Project::new(&stage(&["tools/print.sh", "{output}"], "tools = [\"luts\", \".\"]"), &FILES);
    let errors = project.errors();
    assert!(errors.contains("tools: \".\" contains \"out\", the folder for exports"), "{errors}");
}

#[test]
fn a_link_to_a_folder_above_is_followed_once() {
    let project = Project::new(&stage(&["tools/print.sh", "{output}"], "tools = [\"tools\"]"), &FILES);
    symlink("../tools", project.path("luts/up")).unwrap();
    symlink("../luts", project.path("tools/luts")).unwrap();
    symlink(".", project.path("tools/self")).unwrap();
    assert_eq!(project.build().failures(), Vec::<String>::new());
    assert_eq!(project.build().graded().len(), 0);
    assert_eq!(ran_after(&project, "luts/a.cube", "edited"), 1);
}

#[test]
fn nothing_in_out_is_read() {
    let told = "is inside \"out\", the folder for exports";
    for (words, tools) in [
        (vec!["tools/print.sh", "{folder}/out/x.txt", "{output}"], ""),
        (vec!["tools/print.sh", "out/x.txt", "{output}"], ""),
        (vec!["tools/print.sh", "./out/../out/x.txt", "{output}"], ""),
        (vec!["tools/print.sh", "tools/../out/x.txt", "{output}"], ""),
        (vec!["tools/print.sh", "--lut={folder}/tools/../out/x.txt", "{output}"], ""),
        (vec!["tools/print.sh", "--lut=out/x.txt", "{output}"], ""),
        (vec!["tools/print.sh", "{folder}/out", "{output}"], ""),
        (vec!["-c", "cat {folder}/out/x.txt > $0", "{output}"], ""),
        (vec!["-c", "cat \"{folder}\"/out/$1.txt > $0", "{output}"], ""),
        (vec!["tools/print.sh", "link/x.txt", "{output}"], ""),
        (vec!["tools/print.sh", "{folder}/tools/file.txt", "{output}"], ""),
        (vec!["tools/print.sh", "word", "{output}"], ""),
        (vec!["tools/print.sh", "ABSOLUTE/out/x.txt", "{output}"], ""),
        (vec!["tools/print.sh", "{output}"], "out"),
        (vec!["tools/print.sh", "{output}"], "./out/x.txt"),
        (vec!["tools/print.sh", "{output}"], "tools/../out/x.txt"),
        (vec!["tools/print.sh", "{output}"], "ABSOLUTE/out/x.txt"),
        (vec!["tools/print.sh", "{output}"], "link"),
        (vec!["tools/print.sh", "{output}"], "tools/file.txt"),
        (vec!["out/x.txt", "{output}"], ""),
    ] {
        let lines = if tools.is_empty() { String::new() } else { format!("tools = [{tools:?}]") };
        let project = Project::new("", &FILES);
        let text = stage(&words, &lines)
            .replace("ABSOLUTE", project.path("").to_str().unwrap().trim_end_matches('/'));
        project.write("pipeline.toml", super::manifest(&text).as_bytes());
        // Neither `out` nor the file exists yet.
        symlink("out", project.path("link")).unwrap();
        symlink("../link/x.txt", project.path("tools/file.txt")).unwrap();
        symlink("link/x.txt", project.path("word")).unwrap();
        let errors = project.errors();
        assert!(errors.contains(told) && errors.contains("inputs = {"), "{words:?} {tools:?}: {errors}");
        assert!(errors.starts_with("pipeline.toml:") || errors.contains("pipeline.toml:1"), "{errors}");
    }
    // In a line of shell such a word is a warning once the file is there.
    let project = Project::new(
        &stage(
            &["-c", "cd {folder}/tools; cat ../out/x.txt; echo out/x.txt; echo > $OLDPWD/$0", "{output}"],
            "",
        ),
        &FILES,
    );
    project.write("out/x.txt", b"exported");
    let warnings = warnings(&project.build());
    assert!(
        warnings.len() == 1 && warnings.iter().all(|text| text.contains("a file in \"out\"")),
        "{warnings:?}"
    );
    // A mode may have the name of the folder.
    let project = Project::new(&stage(&["tools/print.sh", "out", "--mode=out", "{output}"], ""), &FILES);
    project.build();
    let plan: Plan = project.plan().unwrap();
    let again = project.build_plan(&plan, BuildOptions { force: true, ..BuildOptions::default() });
    assert_eq!(again.summary.failed, 0);
    assert!(again.summary.ran > 0);
}

#[test]
fn an_absolute_path_in_a_line_of_shell_is_a_warning() {
    let project = Project::new(&stage(&["tools/print.sh", "HERE", "{output}"], ""), &FILES);
    let manifest = fs::read_to_string(project.path("pipeline.toml")).unwrap();
    let line = format!("cat {}", project.path("tools/film.cube").display());
    project.write("pipeline.toml", manifest.replace("HERE", &line).as_bytes());
    let warnings = warnings(&project.build());
    assert!(warnings.iter().any(|text| text.contains("{folder}/tools/film.cube")), "{warnings:?}");
}

#[test]
fn a_word_becomes_a_path_when_a_file_has_its_name() {
    let project = Project::new(&stage(&["tools/print.sh", "film", "{output}"], ""), &FILES);
    project.build();
    assert_eq!(project.build().summary.ran, 0);
    project.write("film", b"a file");
    assert_eq!(project.build().summary.ran, 1);
}

#[test]
fn a_link_into_out_that_is_made_later_fails_the_item() {
    let words = ["tools/print.sh", "--lut={folder}/tools/film.cube", "{output}"];
    for lines in ["", "tools = [\"tools\"]"] {
        let project = Project::new(&stage(&words, lines), &FILES);
        project.write("out/x.txt", b"exported");
        let plan: Plan = project.plan().unwrap();
        fs::remove_file(project.path("tools/film.cube")).unwrap();
        symlink("../out/x.txt", project.path("tools/film.cube")).unwrap();
        let built = project.build_plan(&plan, BuildOptions::default());
        let failure = built.failures().remove(0);
        assert!(failure.contains("film.cube is inside \"out\", the folder for exports"), "{failure}");
    }
}

#[test]
fn the_interpreters_of_a_script_are_tools() {
    let stage = "command = [\"./tools/grade\", \"{output}\"]\noutput = { type = \"file\", format = \"txt\" }";
    let project = Project::new(stage, &[]);
    let script = |name: &str, text: &str| {
        project.write(name, text.as_bytes());
        fs::set_permissions(project.path(name), fs::Permissions::from_mode(0o755)).unwrap();
    };
    let interpreter = |name: &str| format!("#!{}\n", project.path(name).display());
    script("tools/second", "#!/bin/sh\necho one > $3\n");
    script("tools/first", &interpreter("tools/second"));
    script("tools/grade", &interpreter("tools/first"));
    assert_eq!(project.build().failures(), Vec::<String>::new());
    assert_eq!(project.read("out/graded.txt"), "one\n");
    script("tools/second", "#!/bin/sh\necho two > $3\n");
    assert_eq!(project.build().graded().len(), 1);
    assert_eq!(project.read("out/graded.txt"), "two\n");
    // In a line of shell, too.
    let words = ["-c", "cd {folder}/tools && {folder}/tools/grade \"$OLDPWD/$0\"", "{output}"];
    project.write("pipeline.toml", super::manifest(&self::stage(&words, "")).as_bytes());
    let failures = project.build().failures();
    assert!(failures.is_empty(), "{failures:?}");
    script("tools/second", "#!/bin/sh\necho three > $3\n");
    assert_eq!(project.build().graded().len(), 1);
    project.write("pipeline.toml", super::manifest(stage).as_bytes());
    // One that is missing fails the item until it appears.
    script("tools/grade", &interpreter("tools/third"));
    assert_eq!(project.build().summary.failed, 1);
    // The first line of a script that `sh` reads is a comment.
    let project = Project::new(&self::stage(&["tools/run.sh", "{output}"], ""), &[]);
    project
        .write("tools/run.sh", format!("#!{}\necho > $1", project.path("interpreter").display()).as_bytes());
    project.build();
    assert_eq!(ran_after(&project, "interpreter", "appears"), 0);
}

/// The failure of a stage whose script is `tools/fail.sh`, in a build with or without kept folders.
fn failure(project: &Project, keep_scratch: bool) -> String {
    let options = BuildOptions { keep_scratch, keep_going: true, ..BuildOptions::default() };
    project.build_plan(&project.plan().unwrap(), options).failures().remove(0)
}

#[test]
fn a_failed_command_can_be_run_by_hand() {
    let stage = "command = [\"sh\", \"tools/fail.sh\", \"{input}\", \"--note=it's $HOME\", \"{output}\"]
input = \"sky\"
output = { type = \"file\", format = \"txt\" }
env = [\"CARGO_PKG_DESCRIPTION\", \"CARGO_PKG_NAME\"]";
    // It succeeds if it is run in the same surroundings, but for the file `fail`.
    let script = "test -s $1 && test \"$LANG\" = C.UTF-8 && test -d \"$HOME\" && test \"$2\" = \"--note=it's \\$HOME\" \\
        && test \"$CARGO_PKG_NAME\" = stages && test ! -e $(dirname $0)/fail && echo right > $3";
    let project = Project::new(stage, &[("tools/fail.sh", script), ("tools/fail", "")]);
    let plain = failure(&project, false);
    let command = format!(
        "sh {}/tools/fail.sh input/input.exr '--note=it'\\''s $HOME' output.txt",
        project.path("").display().to_string().trim_end_matches('/')
    );
    let command = &command[2..];
    assert!(plain.contains(command) && plain.contains("--keep-scratch"), "{plain}");
    assert!(!project.path(".specula/kept").exists());

    let kept = failure(&project, true);
    let line = kept.lines().find(|line| line.starts_with("cd ")).unwrap();
    let line = line.split(": it wrote nothing").next().unwrap();
    assert!(line.contains("CARGO_PKG_NAME=\"$CARGO_PKG_NAME\"") && !line.contains("=stages"), "{line}");
    let folders = || fs::read_dir(project.path(".specula/kept")).unwrap().map(|entry| entry.unwrap().path());
    assert_eq!(folders().count(), 2, "one for each item");
    let named = folders().find(|folder| kept.contains(folder.to_str().unwrap())).unwrap();
    assert!(named.join("work/input/input.exr").exists() && named.join("stderr").exists());
    // It fails by hand, too, until it is mended.
    let by_hand = || Command::new("sh").args(["-c", line]).status().unwrap().success();
    assert!(!by_hand());
    fs::remove_file(project.path("tools/fail")).unwrap();
    assert!(by_hand(), "{line}");
    assert_eq!(fs::read_to_string(named.join("work/output.txt")).unwrap(), "right\n");
    // They stay until the item fails again under the option.
    project.write("tools/fail", b"");
    failure(&project, false);
    assert_eq!(folders().count(), 2);
    failure(&project, true);
    assert_eq!(folders().count(), 2);
    assert!(!named.join("work/output.txt").exists(), "the folder is new");
    let options = engine::cache::CollectOptions::default();
    let freed = engine::cache::collect(&project.path(""), &options, &|_| {}).unwrap();
    assert!(freed.temporary.count > 0 && !project.path(".specula/kept").exists());
}
