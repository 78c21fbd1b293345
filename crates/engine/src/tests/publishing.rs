//! Which files are in `out`, and which are left alone.

use expect_test::expect;

use super::*;

const PAIR: &str = r#"
schema = 1
out = "out"
[stage]
text = { kind = "text-source", source = "*.txt" }
pair = { kind = "write-pair", input = "text", path = "pairs/{text}" }
loud = { kind = "upper", input = "text" }
file = { kind = "write", input = "loud", path = "loud/{text}" }
"#;

fn pair() -> Project {
    let project = Project::new(PAIR);
    project.write("a.txt", "one");
    project
}

/// The events of a build about files, and its warnings.
fn events(project: &Project) -> String {
    let log = project.build();
    let lines = log.lines().filter(|line| {
        ["published", "restored", "removed", "warning", "FAILED", "run"]
            .iter()
            .any(|word| line.starts_with(word))
    });
    lines.map(|line| format!("{line}\n")).collect()
}

#[test]
fn the_index_is_published_last() {
    let project = pair();
    expect![[r#"
        run text [a]: never built
        run pair [a]: never built
        published pairs/a/body.txt 3
        published pairs/a/index.txt 1
        run loud [a]: never built
        run file [a]: never built
        published loud/a.txt 3
    "#]]
    .assert_eq(&events(&project));
}

#[test]
fn a_file_that_its_item_leaves_out_is_removed_and_comes_back() {
    let project = pair();
    project.build();
    project.write("a.txt", "");
    assert_has(events(&project), ["published pairs/a/index.txt 1\nremoved pairs/a/body.txt\n"]);
    assert!(!project.exists("out/pairs/a/body.txt"));
    let explained = project.explain("pair");
    let files: Vec<_> = explained[0].files.iter().map(|file| file.file.as_str()).collect();
    assert_eq!(files, ["pairs/a/index.txt"]);
    assert_eq!((events(&project), project.rehearse().1.published), (String::new(), 0));
    project.write("a.txt", "one");
    assert_has(events(&project), ["published pairs/a/body.txt 3\n"]);
    // Nothing runs: both results are in the cache.
    project.write("a.txt", "");
    let foreseen = project.rehearse().1;
    assert_eq!((foreseen.ran, foreseen.removed), (0, 1));
    assert!(events(&project).contains("removed pairs/a/body.txt\n"));
    // A file of someone else in the same place is left alone.
    project.write("out/pairs/a/body.txt", "theirs");
    assert_eq!(events(&project), "");
    assert_eq!(project.read("out/pairs/a/body.txt"), "theirs");
}

#[test]
fn a_deleted_file_is_restored_without_a_run() {
    let project = pair();
    project.build();
    project.remove("out/pairs/a/body.txt");
    assert_eq!(project.explain("pairs/a/body.txt")[0].files[0].state, crate::FileState::Gone);
    assert_eq!(events(&project), "restored pairs/a/body.txt 3\n");
    project.remove("out");
    expect![[r#"
        restored loud/a.txt 3
        restored pairs/a/body.txt 3
        restored pairs/a/index.txt 1
    "#]]
    .assert_eq(&events(&project));
    assert_eq!(events(&project), "");
}

#[test]
fn a_changed_file_is_put_back_with_a_warning() {
    let project = pair();
    project.build();
    project.write("out/loud/a.txt", "mine");
    let events_now = events(&project);
    assert!(events_now.starts_with("warning file [a]: "), "{events_now}");
    assert!(events_now.contains("a.txt had changed since it was published; the published file was restored"));
    assert!(events_now.ends_with("restored loud/a.txt 3\n"));
    assert_eq!(project.read("out/loud/a.txt"), "ONE");
    // Written again with the same content: nothing to do, nothing to report.
    project.remove("out/loud/a.txt");
    project.write("out/loud/a.txt", "ONE");
    assert_eq!(project.explain("loud/a.txt")[0].files[0].state, crate::FileState::AsPublished);
    assert_eq!(project.rehearse().1.published, 0);
    assert_eq!(events(&project), "");
}

#[test]
fn an_unpublished_file_in_the_way_is_an_error_and_survives() {
    let project = pair();
    project.write("out/pairs/a/body.txt", "theirs");
    let events_now = events(&project);
    let line = events_now.lines().find(|line| line.starts_with("FAILED pair [a]")).unwrap();
    assert_has(
        line,
        ["body.txt is in the way: it was not published by this manifest", "move it away or delete it"],
    );
    assert_eq!(project.read("out/pairs/a/body.txt"), "theirs");
    assert!(!project.exists("out/pairs/a/index.txt"), "all of an item's files or none");
    project.remove("out/pairs/a/body.txt");
    // The result was good and is in the cache: it only has to be published.
    assert_eq!(events(&project), "published pairs/a/body.txt 3\npublished pairs/a/index.txt 1\n");
}

#[test]
fn an_unpublished_file_with_the_same_content_is_adopted() {
    let project = pair();
    project.write("out/loud/a.txt", "ONE");
    assert!(!events(&project).contains("loud/a.txt"));
    project.remove("a.txt");
    project.write("b.txt", "two");
    assert!(events(&project).contains("removed loud/a.txt"));
}

#[test]
fn a_file_where_a_folder_has_to_be_and_the_other_way_round() {
    let project = pair();
    project.write("out/pairs", "a file");
    project.write("out/loud/a.txt/inside", "a folder");
    let log = project.build();
    assert_has(&log, ["FAILED pair [a]", "FAILED file [a]"]);
    assert_eq!(log.matches("is in the way").count(), 2);
    assert_eq!(project.read("out/loud/a.txt/inside"), "a folder");
}

#[test]
fn files_of_a_removed_item_or_stage_are_removed_with_their_folders() {
    let mut project = pair();
    project.write("b.txt", "two");
    project.build();
    project.write("out/pairs/b/mine.txt", "keep me");
    project.remove("b.txt");
    project.options.stages = vec!["loud".into()];
    assert_eq!(events(&project), "", "their stages are not selected");
    project.options.stages = vec!["pair".into()];
    assert_eq!(events(&project), "removed pairs/b/body.txt\nremoved pairs/b/index.txt\n");
    assert!(project.exists("out/pairs/b/mine.txt"));
    project.options.stages.clear();
    assert_eq!(events(&project), "removed loud/b.txt\n");
    project.edit("pair = { kind = \"write-pair\", input = \"text\", path = \"pairs/{text}\" }\n", "");
    project.options.stages = vec!["file".into()];
    assert_eq!(events(&project), "", "a stage that has gone is not selected by name");
    project.options.stages.clear();
    assert_eq!(events(&project), "removed pairs/a/body.txt\nremoved pairs/a/index.txt\n");
    assert!(!project.exists("out/pairs/a") && project.exists("out/pairs/b/mine.txt"));
    assert!(project.exists("out/loud/a.txt"));
}

#[test]
fn a_changed_file_of_a_removed_item_is_left_alone() {
    let project = pair();
    project.write("b.txt", "two");
    project.build();
    project.write("out/loud/b.txt", "mine now");
    project.remove("b.txt");
    assert_has(events(&project), ["warning file [b]: ", "so it stays"]);
    assert_eq!(project.read("out/loud/b.txt"), "mine now");
    assert_eq!(events(&project), "");
}

/// The files that a dry run would remove, those that the next build removes, and the counts of both
/// summaries.
fn foreseen_and_removed(project: &Project) -> [(Vec<String>, usize); 2] {
    [true, false].map(|dry_run| {
        let options = BuildOptions { dry_run, ..project.options.clone() };
        let (events, summary) = project.try_build_of(&project.plan(), &options);
        let removed = events.into_iter().filter_map(|event| match event {
            Event::Removed { file, .. } => Some(file),
            _ => None,
        });
        let mut removed = removed.collect::<Vec<_>>();
        removed.sort();
        (removed, summary.unwrap().removed)
    })
}

#[test]
fn a_dry_run_reports_removals_but_not_of_missing_or_changed_files() {
    let project = pair();
    project.write("b.txt", "two");
    project.write("c.txt", "three");
    project.build();
    project.remove("out/pairs/b/body.txt");
    project.write("out/loud/b.txt", "mine now");
    // Written again with the same content, it is still the published file.
    project.remove("out/loud/c.txt");
    project.write("out/loud/c.txt", "THREE");
    project.remove("b.txt");
    project.remove("c.txt");
    let removed = ["loud/c.txt", "pairs/b/index.txt", "pairs/c/body.txt", "pairs/c/index.txt"];
    let [foreseen, done] = foreseen_and_removed(&project);
    assert_eq!(done, (removed.map(str::to_owned).to_vec(), 4));
    assert_eq!(foreseen, done);
    assert_eq!(project.read("out/loud/b.txt"), "mine now");
    assert_eq!(foreseen_and_removed(&project), [(Vec::new(), 0), (Vec::new(), 0)]);
}

#[test]
fn a_dry_run_reports_the_removals_of_an_item_whose_path_changed() {
    let mut project = pair();
    project.write("b.txt", "two");
    project.build();
    project.edit("loud/{text}", "quiet/{text}");
    project.remove("out/loud/a.txt");
    project.options.stages = vec!["pair".into()];
    assert_eq!(
        foreseen_and_removed(&project),
        [(Vec::new(), 0), (Vec::new(), 0)],
        "another stage is selected"
    );
    project.options.stages.clear();
    let [foreseen, done] = foreseen_and_removed(&project);
    assert_eq!(done, (vec!["loud/b.txt".to_owned()], 1));
    assert_eq!(foreseen, done);
}

#[cfg(unix)]
#[test]
fn a_dry_run_does_not_report_a_removal_behind_a_link() {
    let project = pair();
    project.write("b.txt", "two");
    project.build();
    project.remove("b.txt");
    let elsewhere = tempfile::tempdir().unwrap();
    std::fs::rename(project.path("out/loud"), elsewhere.path().join("loud")).unwrap();
    std::os::unix::fs::symlink(elsewhere.path().join("loud"), project.path("out/loud")).unwrap();
    let [foreseen, done] = foreseen_and_removed(&project);
    assert_eq!(foreseen, done);
    assert!(elsewhere.path().join("loud/b.txt").exists());
}

#[test]
fn a_changed_path_moves_the_files_without_a_run() {
    let project = pair();
    project.build();
    project.edit("loud/{text}", "loud/{text}.txt/deep");
    expect![[r#"
        removed loud/a.txt
        published loud/a.txt/deep.txt 3
    "#]]
    .assert_eq(&events(&project));
    project.edit("loud/{text}.txt/deep", "loud/{text}");
    expect![[r#"
        removed loud/a.txt/deep.txt
        published loud/a.txt 3
    "#]]
    .assert_eq(&events(&project));
    project.edit("loud/{text}", "quiet/{text}");
    expect![[r#"
        published quiet/a.txt 3
        removed loud/a.txt
    "#]]
    .assert_eq(&events(&project));
    assert!(!project.exists("out/loud"));
}

#[test]
fn a_stage_with_a_new_name_takes_over_its_files() {
    let project = pair();
    project.build();
    project.edit("file = ", "shout = ");
    assert_eq!(events(&project), "");
    assert!(project.build().contains("0 ran, 4 up to date"));
    project.remove("a.txt");
    project.write("b.txt", "two");
    assert!(events(&project).contains("removed loud/a.txt"));
}

#[cfg(unix)]
#[test]
fn a_link_that_leads_out_is_not_followed() {
    let project = pair();
    let elsewhere = tempfile::tempdir().unwrap();
    std::fs::create_dir(project.path("out")).unwrap();
    std::os::unix::fs::symlink(elsewhere.path(), project.path("out/pairs")).unwrap();
    assert_has(project.build(), ["FAILED pair [a]: ", "is a link that leads out of"]);
    assert_eq!(std::fs::read_dir(elsewhere.path()).unwrap().count(), 0);
    std::fs::create_dir(project.path("out/real")).unwrap();
    project.remove_link("out/pairs");
    std::os::unix::fs::symlink(project.path("out/real"), project.path("out/pairs")).unwrap();
    assert!(events(&project).contains("published pairs/a/index.txt"));
    assert!(project.exists("out/real/a/index.txt"));
}

#[cfg(unix)]
#[test]
fn a_link_in_place_of_a_file_is_replaced_not_followed() {
    let project = pair();
    project.build();
    project.write("precious.txt.keep", "precious");
    project.remove("out/loud/a.txt");
    std::os::unix::fs::symlink(project.path("precious.txt.keep"), project.path("out/loud/a.txt")).unwrap();
    assert!(events(&project).contains("warning file [a]"));
    assert_eq!(project.read("out/loud/a.txt"), "ONE");
    assert_eq!(project.read("precious.txt.keep"), "precious");
}

/// The journal of a build that was killed after it had recorded what it was about to publish, before the file
/// appeared.
fn cut_after_intent(project: &Project) {
    let journal = project.read(".specula/journal");
    let intent = journal.rfind("\"stamp\":null").unwrap();
    let end = intent + journal[intent..].find('\n').unwrap() + 1;
    project.write(".specula/journal", &journal[..end]);
}

#[test]
fn a_build_killed_while_it_puts_a_changed_file_back_is_continued() {
    let project = pair();
    project.build();
    project.write("out/loud/a.txt", "mine");
    project.build();
    // Twice, because the second build starts with what the first left in the journal.
    for _ in 0..2 {
        cut_after_intent(&project);
        project.write("out/loud/a.txt", "mine");
        let events_now = events(&project);
        assert_has(&events_now, ["the published file was restored"]);
        assert!(!events_now.contains("FAILED"), "{events_now}");
        assert_eq!(project.read("out/loud/a.txt"), "ONE");
    }
    // When the item no longer exists, the changed file is left alone, even after a kill.
    cut_after_intent(&project);
    project.write("out/loud/a.txt", "mine");
    project.remove("a.txt");
    project.write("b.txt", "two");
    assert!(events(&project).contains("so it stays"));
    assert_eq!(project.read("out/loud/a.txt"), "mine");
}

#[test]
fn a_folder_in_place_of_a_file_is_in_the_way() {
    let project = pair();
    project.build();
    project.remove("out/loud/a.txt");
    project.write("out/loud/a.txt/inside", "a folder");
    for _ in 0..2 {
        let events_now = events(&project);
        assert_has(&events_now, ["FAILED file [a]", "is in the way"]);
        assert!(!events_now.contains("put back"), "{events_now}");
        assert_eq!(project.read("out/loud/a.txt/inside"), "a folder");
    }
    project.remove("out/loud/a.txt");
    assert_eq!(events(&project), "restored loud/a.txt 3\n");
}

#[test]
fn a_file_that_could_not_be_put_back_is_not_reported_as_put_back() {
    let project = pair();
    project.build();
    project.write("out/pairs/a/body.txt", "mine");
    project.remove("out/pairs/a/index.txt");
    project.write("out/pairs/a/index.txt/inside", "a folder");
    let events_now = events(&project);
    assert!(events_now.contains("FAILED pair [a]") && !events_now.contains("put back"), "{events_now}");
    assert_eq!(project.read("out/pairs/a/body.txt"), "mine");
}

/// Shortly after a file was written, another write of the same size may not show in its time of change,
/// because the clock of the file system advances only every few milliseconds. In each round such a write
/// follows as soon as the file exists.
#[test]
fn a_file_that_is_changed_right_after_it_was_published_is_put_back() {
    let project = Project::new(PAIR);
    for round in 0..50 {
        project.write("a.txt", &format!("{round:03}"));
        let place = project.path("out/loud/a.txt");
        let report = |event| {
            if matches!(&event, Event::Published { file, .. } if file == "loud/a.txt") {
                std::fs::write(&place, "???").unwrap();
            }
        };
        crate::build::build(&project.plan(), &project.options, &project.cancel, &report).unwrap();
        let events_now = events(&project);
        assert!(events_now.contains("restored loud/a.txt 3"), "round {round}: {events_now}");
        assert_eq!(project.read("out/loud/a.txt"), format!("{round:03}"));
        assert_eq!(events(&project), "", "and then it is known, without being read again");
    }
}

/// Another thread changes the file, perhaps before the build reads the file's stamp again.
#[test]
fn a_file_that_is_changed_while_it_is_published_is_put_back() {
    let project = Project::new(PAIR);
    let place = project.path("out/loud/a.txt");
    for round in 0..50 {
        let text = format!("{round:03}");
        project.write("a.txt", &text);
        let has_ended = std::sync::atomic::AtomicBool::new(false);
        std::thread::scope(|scope| {
            scope.spawn(|| {
                while !has_ended.load(std::sync::atomic::Ordering::Acquire) {
                    if std::fs::read(&place).is_ok_and(|bytes| bytes == text.as_bytes()) {
                        return std::fs::write(&place, "???").unwrap();
                    }
                }
            });
            project.build();
            has_ended.store(true, std::sync::atomic::Ordering::Release);
        });
        project.build();
        assert_eq!(project.read("out/loud/a.txt"), text, "round {round}");
    }
}

/// Kinds whose exports hold a recipe: here the whole file.
fn with_recipes(project: &mut Project) {
    project.kinds = project.kinds.clone().with_recipe_reader(|bytes| String::from_utf8(bytes.to_vec()).ok());
}

#[test]
fn exports_whose_records_are_lost_are_recognized_by_their_recipes() {
    let mut project = pair();
    with_recipes(&mut project);
    let recipe = |kind: &str| format!(r#"{{"inputs":{{}},"kind":{kind:?},"parameters":{{}},"revision":1}}"#);
    project.build();
    // As an earlier version of the kind would have left them; only the index of a pair holds the recipe.
    project.write("out/loud/a.txt", &recipe("write"));
    project.write("out/pairs/a/body.txt", "no recipe");
    project.write("out/pairs/a/index.txt", &recipe("write-pair"));
    project.remove(".specula");
    let log = project.build();
    assert_has(&log, ["0 failed", "3 published"]);
    assert_eq!(log.matches("its recipe says that an earlier build published it").count(), 3, "{log}");
    assert_eq!(project.read("out/loud/a.txt"), "ONE");
    // They are in the ledger again.
    project.remove("a.txt");
    project.write("b.txt", "two");
    assert!(events(&project).contains("removed loud/a.txt"));
}

#[test]
fn a_recipe_of_another_kind_or_of_another_manifest_s_file_proves_nothing() {
    let mut project = pair();
    with_recipes(&mut project);
    let recipe = r#"{"inputs":{},"kind":"write","parameters":{},"revision":1}"#;
    for theirs in
        [&recipe.replace("write", "write-pair"), "{}", &recipe.replace(",\"revision\":1", ""), "write"]
    {
        project.write("out/loud/a.txt", theirs);
        assert!(events(&project).contains("a.txt is in the way"), "{theirs}");
        assert_eq!(project.read("out/loud/a.txt"), theirs);
        project.remove(".specula");
    }
    project.remove("out");
    project.write("other.toml", &project.read("pipeline.toml"));
    let other = Plan::load(&project.path("other.toml"), &project.kinds).unwrap();
    crate::build::build(&other, &project.options, &project.cancel, &|_| {}).unwrap();
    project.write("out/loud/a.txt", recipe);
    assert!(events(&project).contains("a.txt is in the way"));
    assert_eq!(project.read("out/loud/a.txt"), recipe);
}

/// The error of a build as a whole, with what to do.
fn refused(project: &Project) -> String {
    let (events, summary) = project.try_build();
    let error = summary.unwrap_err();
    assert_eq!(log(&events), "", "nothing ran");
    format!("{error} ({})", error.help().unwrap_or_default())
}

#[test]
fn a_file_in_place_of_out_is_one_error() {
    let project = pair();
    project.write("out", "a file");
    let error = "out is a file, not a folder for exports (move it away or delete it, or set another folder \
                 as out in pipeline.toml)";
    assert_eq!(refused(&project), error);
    assert_eq!(project.read("out"), "a file");
    project.edit("out = \"out\"", "out = \"out/below/it\"");
    assert_eq!(refused(&project), error);
    project.remove("out");
    assert!(events(&project).contains("published loud/a.txt"));
}

#[cfg(unix)]
#[test]
fn an_out_that_links_to_no_folder_is_one_error() {
    use std::os::unix::fs::symlink;

    let project = pair();
    let elsewhere = "remove the link: out is a folder inside the manifest's folder; to keep exports on another \
                     disk, mount the disk there";
    let link = |target: &str| {
        let _ = std::fs::remove_file(project.path("out"));
        symlink(target, project.path("out")).unwrap();
    };
    link("/nowhere/scratch");
    let missing = format!("out is a link to /nowhere/scratch, which does not exist ({elsewhere})");
    assert_eq!(refused(&project), missing);
    link("../scratch/x");
    assert_eq!(
        refused(&project),
        format!("out is a link to ../scratch/x, which does not exist ({elsewhere})")
    );
    link("a.txt");
    assert_eq!(refused(&project), "out is a link to a.txt, which is a file, not a folder (remove the link)");
    link("out");
    let error = refused(&project);
    assert!(error.starts_with("out is a link to out, which cannot be followed: "), "{error}");
    link("later");
    let error = refused(&project);
    let create = format!("(create the folder {}, or remove the link)", project.path("later").display());
    assert_eq!(error, format!("out is a link to later, which does not exist {create}"));
    std::fs::create_dir(project.path("later")).unwrap();
    assert!(events(&project).contains("published loud/a.txt"));
    // A folder on the way.
    project.remove_link("out");
    symlink("/nowhere", project.path("a")).unwrap();
    project.edit("out = \"out\"", "out = \"a/b\"");
    assert_eq!(refused(&project), format!("a is a link to /nowhere, which does not exist ({elsewhere})"));
    // Nothing is exported.
    let (source, _) = PAIR.split_once("pair = ").unwrap();
    project.write("pipeline.toml", &source.replace("out = \"out\"", "out = \"a/b\""));
    assert_eq!(events(&project), "");
}
