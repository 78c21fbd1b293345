//! Whose files are in `out` after a manifest was renamed, or its `out` changed.

use expect_test::expect;

use super::*;
use crate::answers::{Pruned, prune};
use crate::storage::LockTimeout;

const TWO: &str = r#"
schema = 1
out = "out"
[stage]
text = { kind = "text-source", source = "*.txt" }
loud = { kind = "suffix", input = "text", text = "!" }
file = { kind = "write", input = "loud", path = "loud/{text}" }
copy = { kind = "write", input = "text", path = "copy/{text}" }
"#;

fn project() -> Project {
    let project = Project::new(TWO);
    project.write("a.txt", "a");
    project.write("b.txt", "b");
    project
}

/// What a build of a manifest reports about files.
fn build(project: &Project, manifest: &str) -> String {
    build_with(project, manifest, &project.options)
}

fn build_with(project: &Project, manifest: &str, options: &BuildOptions) -> String {
    let plan = Plan::load(&project.path(manifest), &project.kinds).unwrap();
    let (events, summary) = project.try_build_of(&plan, options);
    summary.unwrap();
    let shown = ["published", "restored", "removed", "warning", "FAILED", "left over", "note"];
    let log = log(&events).replace(&project.unix_path(""), "");
    let lines = log.lines().filter(|line| shown.iter().any(|word| line.starts_with(word)));
    lines.map(|line| format!("{line}\n")).collect()
}

fn edit(project: &Project, manifest: &str, old: &str, new: &str) {
    let text = project.read(manifest);
    assert!(text.contains(old), "{old:?} is not in {manifest}");
    project.write(manifest, &text.replace(old, new));
}

fn names(project: &Project, folder: &str) -> Vec<String> {
    project.files(folder).into_iter().map(|(name, _)| name).collect()
}

fn pruned(project: &Project, dry_run: bool) -> Pruned {
    prune(&project.path(""), dry_run, LockTimeout::NONE, &|_| {}).unwrap()
}

#[test]
fn a_renamed_manifest_keeps_its_files() {
    let project = project();
    build(&project, "pipeline.toml");
    project.rename("pipeline.toml", "light.toml");
    assert_eq!(build(&project, "light.toml"), "");
    // As under the old name, files of items that no longer exist are removed.
    project.remove("b.txt");
    assert_eq!(build(&project, "light.toml"), "removed copy/b.txt\nremoved loud/b.txt\n");
    project.rename("light.toml", "pipeline.toml");
    assert_eq!(build(&project, "pipeline.toml"), "");
    assert_eq!(pruned(&project, false), Pruned::default());
}

#[test]
fn a_manifest_that_was_renamed_and_edited_replaces_its_files_and_removes_others() {
    let project = project();
    build(&project, "pipeline.toml");
    project.rename("pipeline.toml", "light.toml");
    edit(&project, "light.toml", "\"!\"", "\"?\"");
    edit(&project, "light.toml", "copy/{text}", "same/{text}");
    project.remove("b.txt");
    let foreseen =
        build_with(&project, "light.toml", &BuildOptions { dry_run: true, ..project.options.clone() });
    assert_eq!(foreseen.matches("removed").count(), 3, "{foreseen}");
    expect![[r#"
        removed copy/b.txt
        removed loud/b.txt
        published same/a.txt 1
        removed copy/a.txt
        published loud/a.txt 2
    "#]]
    .assert_eq(&build(&project, "light.toml"));
    assert_eq!(project.read("out/loud/a.txt"), "a?");
    assert_eq!(build(&project, "light.toml"), "");
}

#[test]
fn a_file_that_was_changed_before_its_manifest_was_renamed_is_not_touched() {
    let project = project();
    build(&project, "pipeline.toml");
    project.write("out/loud/a.txt", "mine");
    project.write("out/copy/b.txt", "mine too");
    project.rename("pipeline.toml", "light.toml");
    edit(&project, "light.toml", "\"!\"", "\"?\"");
    project.remove("b.txt");
    let events = build(&project, "light.toml");
    let why =
        "FAILED file [a]: out/loud/a.txt is in the way: it has changed since pipeline.toml published it";
    assert_has(&events, [why, "nothing exports it now, so it stays"]);
    assert_eq!(project.read("out/loud/a.txt"), "mine");
    assert_eq!(project.read("out/copy/b.txt"), "mine too");
    assert!(!project.exists("out/loud/b.txt"));
    project.remove("out/loud/a.txt");
    assert_eq!(build(&project, "light.toml"), "published loud/a.txt 2\n");
    assert_eq!(build(&project, "light.toml"), "");
}

#[test]
fn a_manifest_that_exists_keeps_its_files() {
    let project = project();
    build(&project, "pipeline.toml");
    project.write("light.toml", &TWO.replace("\"!\"", "\"?\""));
    let events = build(&project, "light.toml");
    let why = "FAILED file [a]: out/loud/a.txt is in the way: pipeline.toml published it (change the path of the \
               stage, or the out of one of the two manifests; ";
    assert_has(&events, [why]);
    assert_eq!(project.read("out/loud/a.txt"), "a!");
    // Both export these, with one content. Only one of them stops doing so.
    edit(&project, "light.toml", "copy/{text}", "same/{text}");
    assert!(!build(&project, "light.toml").contains("removed"));
    assert!(project.exists("out/copy/a.txt") && project.exists("out/same/a.txt"));
    // A manifest that cannot be read keeps its files too.
    project.write("pipeline.toml", "schema = ");
    assert!(build(&project, "light.toml").contains("pipeline.toml published it"));
    assert_eq!(pruned(&project, false), Pruned::default());
    project.remove("pipeline.toml");
    expect![[r#"
        published loud/a.txt 2
        published loud/b.txt 2
        left over in out: 2 of pipeline.toml
    "#]]
    .assert_eq(&build(&project, "light.toml"));
    // It comes back.
    project.write("pipeline.toml", TWO);
    let events = build(&project, "pipeline.toml");
    assert_eq!(events.matches("light.toml published it").count(), 2, "{events}");
    assert!(!events.contains("left over"), "{events}");
}

#[test]
fn two_manifests_swap_their_names() {
    let project = project();
    project.write("other.toml", &TWO.replace("loud/", "other/").replace("copy/", "double/"));
    build(&project, "pipeline.toml");
    build(&project, "other.toml");
    let all = names(&project, "out");
    project.rename("pipeline.toml", "between.toml");
    project.rename("other.toml", "pipeline.toml");
    project.rename("between.toml", "other.toml");
    edit(&project, "pipeline.toml", "\"!\"", "\"?\"");
    // Each is named as the one that has the other's files, until it has been built.
    assert_has(
        build(&project, "pipeline.toml"),
        ["if other.toml no longer exports the file, build other.toml first"],
    );
    assert!(!build(&project, "other.toml").contains("FAILED"));
    assert!(!build(&project, "pipeline.toml").contains("FAILED"));
    assert_eq!(names(&project, "out"), all);
    assert_eq!((build(&project, "other.toml"), build(&project, "pipeline.toml")), Default::default());
    assert_eq!(project.read("out/other/a.txt"), "a?");
    assert_eq!(project.read("out/loud/a.txt"), "a!");
}

#[test]
fn files_of_a_folder_that_out_no_longer_names_are_reported_and_pruned() {
    let project = project();
    build(&project, "pipeline.toml");
    project.write("out/mine.txt", "mine");
    project.edit("out = \"out\"", "out = \"dist\"");
    let events = build(&project, "pipeline.toml");
    assert!(events.ends_with("left over in out: 4 of pipeline.toml\n"), "{events}");
    project.write("out/loud/b.txt", "changed");
    project.remove("out/copy/a.txt");
    assert_eq!(build(&project, "pipeline.toml"), "left over in out: 2 of pipeline.toml\n");
    let expected = Pruned {
        removed: ["out/copy/b.txt", "out/loud/a.txt"].map(str::to_owned).to_vec(),
        changed: vec!["out/loud/b.txt".into()],
    };
    assert_eq!(pruned(&project, true), expected);
    assert_eq!(names(&project, "out").len(), 4);
    assert_eq!(pruned(&project, false), expected);
    assert_eq!(names(&project, "out"), ["loud/b.txt", "mine.txt"]);
    assert!(!project.exists("out/copy"));
    assert_eq!(names(&project, "dist").len(), 4);
    assert_eq!(build(&project, "pipeline.toml"), "");
    project.remove("out/mine.txt");
    project.remove("out/loud/b.txt");
    assert_eq!(pruned(&project, false), Pruned::default());
}

#[test]
fn an_out_that_is_changed_back_finds_its_files() {
    let project = project();
    build(&project, "pipeline.toml");
    project.edit("out = \"out\"", "out = \"dist\"");
    build(&project, "pipeline.toml");
    project.edit("out = \"dist\"", "out = \"out\"");
    assert_eq!(build(&project, "pipeline.toml"), "left over in dist: 4 of pipeline.toml\n");
    assert_eq!(pruned(&project, false).removed.len(), 4);
    assert!(!project.exists("dist"));
    assert_eq!(build(&project, "pipeline.toml"), "");
    assert_eq!(names(&project, "out").len(), 4);
}

#[test]
fn one_out_lies_in_the_other() {
    let project = project();
    project.edit("loud/{text}", "game/loud/{text}");
    build(&project, "pipeline.toml");
    // The file stays at its place, and its content changes.
    project.edit("game/loud/{text}", "loud/{text}");
    project.edit("out = \"out\"", "out = \"out/game\"");
    project.edit("\"!\"", "\"?\"");
    let events = build(&project, "pipeline.toml");
    assert!(events.contains("published loud/a.txt 2\n") && !events.contains("FAILED"), "{events}");
    assert!(events.ends_with("left over in out: 2 of pipeline.toml\n"), "{events}");
    assert_eq!(pruned(&project, false).removed, ["out/copy/a.txt", "out/copy/b.txt"]);
    assert_eq!(names(&project, "out/game").len(), 4);
    assert_eq!(build(&project, "pipeline.toml"), "");
    // And back.
    project.edit("out = \"out/game\"", "out = \"out\"");
    project.edit("loud/{text}", "game/loud/{text}");
    project.edit("\"?\"", "\"!\"");
    let events = build(&project, "pipeline.toml");
    assert!(events.contains("published game/loud/a.txt 2\n") && !events.contains("FAILED"), "{events}");
    assert!(events.ends_with("left over in out/game: 2 of pipeline.toml\n"), "{events}");
    // An old file where a folder has to be.
    project.edit("path = \"copy/{text}\"", "path = \"game/copy/a.txt/{text}\"");
    let events = build(&project, "pipeline.toml");
    assert!(!events.contains("FAILED") && events.contains("removed game/copy/a.txt\n"), "{events}");
}

#[cfg(unix)]
#[test]
fn another_name_of_a_folder_or_of_a_manifest_is_not_another_one() {
    let project = project();
    build(&project, "pipeline.toml");
    std::os::unix::fs::symlink("out", project.path("link")).unwrap();
    std::os::unix::fs::symlink("pipeline.toml", project.path("second.toml")).unwrap();
    project.edit("out = \"out\"", "out = \"link\"");
    project.edit("\"!\"", "\"?\"");
    assert_eq!(build(&project, "pipeline.toml"), "published loud/a.txt 2\npublished loud/b.txt 2\n");
    assert_eq!(pruned(&project, false), Pruned::default());
    project.edit("\"?\"", "\"!\"");
    let events = build(&project, "second.toml");
    assert!(events.contains("loud/a.txt 2\n") && !events.contains("FAILED"), "{events}");
    assert_eq!(names(&project, "out").len(), 4);
    // What is behind a link that leads out of the folder is not looked at.
    project.edit("out = \"link\"", "out = \"out\"");
    build(&project, "pipeline.toml");
    project.edit("out = \"out\"", "out = \"dist\"");
    let elsewhere = tempfile::tempdir().unwrap();
    std::fs::rename(project.path("out"), elsewhere.path().join("out")).unwrap();
    std::os::unix::fs::symlink(elsewhere.path().join("out"), project.path("out")).unwrap();
    assert!(!build(&project, "pipeline.toml").contains("left over"));
    assert_eq!(pruned(&project, false).removed, [""; 0]);
    assert_eq!(std::fs::read_dir(elsewhere.path().join("out")).unwrap().count(), 2);
}

#[test]
fn a_different_manifest_in_place_of_a_deleted_one_removes_nothing() {
    let project = project();
    build(&project, "pipeline.toml");
    project.remove("pipeline.toml");
    let other = TWO.replace("file = ", "shout = ").replace("copy = ", "twin = ");
    let other = other.replace("loud/", "shout/").replace("copy/", "twin/").replace("\ntext = ", "\nword = ");
    let other = other.replace("{text}", "{word}").replace("\"text\"", "\"word\"").replace("loud", "cry");
    project.write("other.toml", &other);
    let events = build(&project, "other.toml");
    assert!(events.ends_with("left over in out: 4 of pipeline.toml\n"), "{events}");
    assert_eq!(names(&project, "out").len(), 8);
    assert_eq!(pruned(&project, false).removed.len(), 4);
    assert_eq!(build(&project, "other.toml"), "");
}

#[test]
fn files_in_a_folder_with_its_own_state_belong_to_the_manifests_there() {
    let project = project();
    project.edit("out = \"out\"", "out = \"part/out\"");
    project.edit("*.txt", "part/*.txt");
    project.write("part/a.txt", "a");
    build(&project, "pipeline.toml");
    let moved = project.read("pipeline.toml").replace("part/", "");
    project.write("part/pipeline.toml", &moved);
    project.remove("pipeline.toml");
    assert_eq!(build(&project, "part/pipeline.toml"), "", "the files are taken over");
    assert_eq!(pruned(&project, false), Pruned::default());
    assert_eq!(names(&project, "part/out").len(), 2);
}

#[test]
fn a_manifest_that_now_exports_elsewhere_leaves_its_files_to_others() {
    let project = project();
    build(&project, "pipeline.toml");
    project.edit("out = \"out\"", "out = \"dist\"");
    project.write("other.toml", &TWO.replace("\"!\"", "\"?\"").replace("copy/", "same/"));
    let events = build(&project, "other.toml");
    assert!(events.contains("published loud/a.txt 2\n") && !events.contains("FAILED"), "{events}");
    assert!(!events.contains("removed"), "{events}");
    assert!(events.ends_with("left over in out: 2 of pipeline.toml\n"), "{events}");
    assert_eq!(pruned(&project, false).removed, ["out/copy/a.txt", "out/copy/b.txt"]);
    // Now the files are those of the other manifest.
    project.edit("out = \"dist\"", "out = \"out\"");
    let events = build(&project, "pipeline.toml");
    assert_eq!(events.matches("other.toml published it").count(), 2, "{events}");
}
