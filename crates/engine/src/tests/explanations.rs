//! Why something ran or would run: told from the far end of the chain.

use std::fmt::Write;

use expect_test::expect;

use super::*;
use crate::{Cause, FileState, Reason};

const PAIRS: &str = r#"
schema = 1
out = "out"

[stage.light]
kind = "text-source"
source = "light/*.txt"

[stage.paint]
kind = "text-source"
source = "paint/*.txt"

[stage.loud]
kind = "upper"
input = "paint"

[stage.lit]
kind = "concat"
inputs = { left = "light", right = "loud" }

[stage.file]
kind = "write"
input = "lit"
"#;

fn pairs() -> Project {
    let project = Project::new(PAIRS);
    project.write("light/sky.txt", "blue ");
    project.write("light/sun.txt", "white ");
    project.write("paint/gold.txt", "gold");
    project.build();
    project
}

fn cause(cause: &Cause) -> String {
    let chain = cause.chain.iter().filter(|_| cause.chain.len() > 1).map(|item| format!(" -> {item}"));
    format!("{}{}", reason(&cause.reason), chain.collect::<String>())
}

/// What is told of a target: of each item whether it would run and what began it, and what began its last run.
fn told(project: &Project, target: &str) -> String {
    let mut text = String::new();
    for found in project.explain(target) {
        let causes = |causes: &[Cause]| causes.iter().map(cause).collect::<Vec<_>>().join("; ");
        let verdict = match (found.would_run, found.restored) {
            (true, _) => format!("would run: {}", causes(&found.causes)),
            (false, true) => "restored".into(),
            (false, false) => "up to date".into(),
        };
        let _ = writeln!(text, "{} {verdict}", found.item);
        if let Some(last) = &found.last {
            let _ = writeln!(text, "  ran: {}", causes(&last.causes));
        }
    }
    text
}

#[test]
fn what_would_run_is_followed_to_the_file_that_changed_and_so_is_what_ran() {
    let project = pairs();
    project.write("paint/gold.txt", "brass");
    expect![[r#"
        file [sky, gold] would run: file paint/gold.txt some -> some -> paint [gold] -> loud [gold] -> lit [sky, gold] -> file [sky, gold]
          ran: never built
        file [sun, gold] would run: file paint/gold.txt some -> some -> paint [gold] -> loud [gold] -> lit [sun, gold] -> file [sun, gold]
          ran: never built
    "#]]
    .assert_eq(&told(&project, "file"));
    project.build();
    expect![[r#"
        file [sky, gold] up to date
          ran: file paint/gold.txt some -> some -> paint [gold] -> loud [gold] -> lit [sky, gold] -> file [sky, gold]
    "#]]
    .assert_eq(&told(&project, "file [sky, gold]"));
}

#[test]
fn what_began_the_last_run_is_still_known_when_the_item_further_up_has_run_again() {
    let project = pairs();
    project.write("paint/gold.txt", "brass");
    project.build();
    let before = told(&project, "file [sky, gold]");
    let digest =
        |project: &Project| match &project.explain("file [sky, gold]")[0].last.as_ref().unwrap().causes[..] {
            [Cause { reason: Reason::File { old, new, .. }, .. }] => (*old, *new),
            other => panic!("{other:?}"),
        };
    let contents = (Some(crate::Digest::of(b"gold")), Some(crate::Digest::of(b"brass")));
    assert_eq!(digest(&project), contents);
    // The paint runs for another reason, and the loud one makes what it made before.
    project.write("paint/gold.txt", "Brass");
    assert!(project.build().contains("2 ran"));
    assert_eq!(told(&project, "file [sky, gold]"), before);
    assert_eq!(digest(&project), contents);
}

#[test]
fn every_cause_is_told_once_however_many_ways_it_came() {
    let project = pairs();
    project.write("light/sky.txt", "grey ");
    project.write("paint/gold.txt", "brass");
    expect![[r#"
        lit [sky, gold] would run: file light/sky.txt some -> some -> light [sky] -> lit [sky, gold]; file paint/gold.txt some -> some -> paint [gold] -> loud [gold] -> lit [sky, gold]
          ran: never built
        lit [sun, gold] would run: file paint/gold.txt some -> some -> paint [gold] -> loud [gold] -> lit [sun, gold]
          ran: never built
    "#]]
    .assert_eq(&told(&project, "lit"));
    // One file that arrives at two ports.
    project.edit(
        "[stage.file]",
        "[stage.twice]\nkind = \"concat\"\ninputs = { left = \"loud\", right = \"paint\" }\n[stage.file]",
    );
    project.build();
    project.write("paint/gold.txt", "tin");
    project.build();
    expect![[r#"
        twice [gold] up to date
          ran: file paint/gold.txt some -> some -> paint [gold] -> loud [gold] -> twice [gold]
    "#]]
    .assert_eq(&told(&project, "twice"));
}

#[test]
fn a_build_that_was_cut_short_does_not_hide_what_began_it() {
    let mut project = pairs();
    project.write("paint/gold.txt", "brass");
    project.options.stages = vec!["loud".into()];
    project.build();
    expect![[r#"
        file [sky, gold] would run: file paint/gold.txt some -> some -> paint [gold] -> loud [gold] -> lit [sky, gold] -> file [sky, gold]
          ran: never built
    "#]]
    .assert_eq(&told(&project, "file [sky, gold]"));
    project.options.stages = Vec::new();
    project.build();
    expect![[r#"
        file [sky, gold] up to date
          ran: file paint/gold.txt some -> some -> paint [gold] -> loud [gold] -> lit [sky, gold] -> file [sky, gold]
    "#]]
    .assert_eq(&told(&project, "file [sky, gold]"));
}

#[test]
fn an_edit_taken_back_is_a_result_restored_and_what_it_reaches_knows_the_file() {
    let mut project = pairs();
    project.options.stages = vec!["loud".into()];
    project.write("paint/gold.txt", "brass");
    project.build();
    project.options.stages = Vec::new();
    project.write("paint/gold.txt", "gold");
    assert!(told(&project, "loud").starts_with("loud [gold] restored\n"), "{}", told(&project, "loud"));
    // The lit ones never saw the brass, so that they are as they were.
    assert!(told(&project, "lit [sky, gold]").starts_with("lit [sky, gold] up to date\n"));
    project.build();
    project.write("paint/gold.txt", "brass");
    expect![[r#"
        lit [sky, gold] would run: file paint/gold.txt some -> some -> paint [gold] -> loud [gold] -> lit [sky, gold]
          ran: never built
    "#]]
    .assert_eq(&told(&project, "lit [sky, gold]"));
    project.build();
    expect![[r#"
        lit [sky, gold] up to date
          ran: file paint/gold.txt some -> some -> paint [gold] -> loud [gold] -> lit [sky, gold]
    "#]]
    .assert_eq(&told(&project, "lit [sky, gold]"));
}

#[test]
fn a_changed_file_is_told_with_the_times_at_which_it_was_written() {
    let project = pairs();
    let hour =
        |hour: u64| std::time::UNIX_EPOCH + std::time::Duration::from_secs(1_700_000_000 + 3600 * hour);
    let set = |time| {
        let file = std::fs::File::options().append(true).open(project.path("paint/gold.txt")).unwrap();
        file.set_modified(time).unwrap();
    };
    project.write("paint/gold.txt", "brass");
    set(hour(1));
    project.build();
    let read = project.explain("paint")[0].last.as_ref().unwrap().reads[1].clone();
    assert_eq!(read.modified.unwrap().to_string(), "2023-11-14 23:13:20 UTC");
    project.write("paint/gold.txt", "copper");
    set(hour(2));
    let times = |found: &Explanation| match &found.causes[..] {
        [Cause { reason: Reason::File { old_time, new_time, .. }, .. }] => {
            (old_time.unwrap().to_string(), new_time.unwrap().to_string())
        }
        other => panic!("{other:?}"),
    };
    let wanted = ("2023-11-14 23:13:20 UTC".to_owned(), "2023-11-15 00:13:20 UTC".to_owned());
    assert_eq!(times(&project.explain("file [sky, gold]")[0]), wanted);
    // The time enters no key.
    project.write("paint/gold.txt", "brass");
    assert!(project.build().contains("0 ran"));
}

#[test]
fn a_missing_output_is_told_from_one_that_a_person_changed_and_from_a_lost_result() {
    let project = pairs();
    let file = project.explain("file [sky, gold]")[0].files[0].file.clone();
    let state = |project: &Project| project.explain("file [sky, gold]")[0].files[0].state.clone();
    assert_eq!(state(&project), FileState::AsPublished);
    project.write(&format!("out/{file}"), "mine");
    let FileState::Altered { digest, modified } = state(&project) else { panic!("{:?}", state(&project)) };
    assert_eq!(digest, Some(crate::Digest::of(b"mine")));
    assert!(modified.is_some());
    project.remove(&format!("out/{file}"));
    assert_eq!(state(&project), FileState::Gone);
    std::fs::remove_file(project.blob("blue GOLD")).unwrap();
    let reasons = project.explain("file [sky, gold]")[0].reasons.iter().map(reason).collect::<Vec<_>>();
    assert_eq!(reasons, ["value after lit [sky, gold]"]);
    assert!(told(&project, "lit [sky, gold]").contains("would run: result lost"));
}

#[test]
fn a_record_from_before_times_and_causes_is_still_read() {
    let record = r#"{"manifest":"pipeline.toml","item":{"stage":"loud","key":{}},"key":"0000000000000000000000000000000000000000000000000000000000000000","version":"0.1.0",
        "kind":"upper","revision":1,"parameters":{},"source":null,"inputs":[],
        "reads":[{"path":"a.txt","listing":false,"digest":null}],"outputs":[],"started":0,"milliseconds":1.0,
        "reasons":[{"reason":"file","path":"a.txt","old":null,"new":null}],
        "warnings":[],"notes":[],"failure":null}"#;
    let record = serde_json::from_str::<crate::record::Record>(record).unwrap();
    assert_eq!((record.reads[0].modified, &record.causes[..]), (None, &[][..]));
}
