//! Why an item ran, would run, or has its result from the cache: the causes. And what a file was made from.

use std::fmt::Write;

use expect_test::expect;

use super::*;
use crate::answers::FileState;
use crate::event::Reason;
use crate::storage::{Cause, ReadKind};

const PAIRS: &str = r#"
schema = 1
[stage]
light = { kind = "text-source", source = "light/*.txt" }
paint = { kind = "text-source", source = "paint/*.txt" }
loud = { kind = "upper", input = "paint" }
lit = { kind = "concat", inputs = { left = "light", right = "loud" } }
file = { kind = "write", input = "lit" }
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

/// The explanation of a target: for each item whether it would run and its causes, and the causes of its last
/// run.
fn explained(project: &Project, target: &str) -> String {
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
            let how = match &last.from_cache {
                None => "ran".into(),
                Some(from) => format!("from the cache, made by {}", from.item),
            };
            let _ = writeln!(text, "  {how}: {}", causes(&last.causes));
        }
    }
    text
}

#[test]
fn the_causes_of_past_and_future_runs_are_the_changed_files() {
    let project = pairs();
    project.write("paint/gold.txt", "brass");
    expect![[r#"
        file [sky, gold] would run: file paint/gold.txt some -> some -> paint [gold] -> loud [gold] -> lit [sky, gold] -> file [sky, gold]
          ran: never built
        file [sun, gold] would run: file paint/gold.txt some -> some -> paint [gold] -> loud [gold] -> lit [sun, gold] -> file [sun, gold]
          ran: never built
    "#]]
    .assert_eq(&explained(&project, "file"));
    project.build();
    expect![[r#"
        file [sky, gold] up to date
          ran: file paint/gold.txt some -> some -> paint [gold] -> loud [gold] -> lit [sky, gold] -> file [sky, gold]
    "#]]
    .assert_eq(&explained(&project, "file [sky, gold]"));
}

#[test]
fn the_causes_of_the_last_run_are_known_even_after_its_inputs_ran_again() {
    let project = pairs();
    project.write("paint/gold.txt", "brass");
    project.build();
    let before = explained(&project, "file [sky, gold]");
    let digest =
        |project: &Project| match &project.explain("file [sky, gold]")[0].last.as_ref().unwrap().causes[..] {
            [Cause { reason: Reason::File { old, new, .. }, .. }] => (*old, *new),
            other => panic!("{other:?}"),
        };
    let contents = (Some(crate::Digest::of(b"gold")), Some(crate::Digest::of(b"brass")));
    assert_eq!(digest(&project), contents);
    // The paint runs for another reason, and the loud one makes the same as before.
    project.write("paint/gold.txt", "Brass");
    assert!(project.build().contains("2 ran"));
    assert_eq!(explained(&project, "file [sky, gold]"), before);
    assert_eq!(digest(&project), contents);
}

#[test]
fn every_cause_is_reported_once_even_if_it_came_in_several_ways() {
    let project = pairs();
    project.write("light/sky.txt", "grey ");
    project.write("paint/gold.txt", "brass");
    expect![[r#"
        lit [sky, gold] would run: file light/sky.txt some -> some -> light [sky] -> lit [sky, gold]; file paint/gold.txt some -> some -> paint [gold] -> loud [gold] -> lit [sky, gold]
          ran: never built
        lit [sun, gold] would run: file paint/gold.txt some -> some -> paint [gold] -> loud [gold] -> lit [sun, gold]
          ran: never built
    "#]]
    .assert_eq(&explained(&project, "lit"));
    // One file at two ports.
    project.edit(
        "file = ",
        "twice = { kind = \"concat\", inputs = { left = \"loud\", right = \"paint\" } }\nfile = ",
    );
    project.build();
    project.write("paint/gold.txt", "tin");
    project.build();
    expect![[r#"
        twice [gold] up to date
          ran: file paint/gold.txt some -> some -> paint [gold] -> loud [gold] -> twice [gold]
    "#]]
    .assert_eq(&explained(&project, "twice"));
}

#[test]
fn a_stopped_build_does_not_hide_the_causes() {
    let mut project = pairs();
    project.write("paint/gold.txt", "brass");
    project.options.stages = vec!["loud".into()];
    project.build();
    expect![[r#"
        file [sky, gold] would run: file paint/gold.txt some -> some -> paint [gold] -> loud [gold] -> lit [sky, gold] -> file [sky, gold]
          ran: never built
    "#]]
    .assert_eq(&explained(&project, "file [sky, gold]"));
    project.options.stages = Vec::new();
    project.build();
    expect![[r#"
        file [sky, gold] up to date
          ran: file paint/gold.txt some -> some -> paint [gold] -> loud [gold] -> lit [sky, gold] -> file [sky, gold]
    "#]]
    .assert_eq(&explained(&project, "file [sky, gold]"));
}

#[test]
fn after_an_undone_edit_the_restored_results_name_the_file_as_cause() {
    let mut project = pairs();
    project.options.stages = vec!["loud".into()];
    project.write("paint/gold.txt", "brass");
    project.build();
    project.options.stages = Vec::new();
    project.write("paint/gold.txt", "gold");
    assert!(
        explained(&project, "loud").starts_with("loud [gold] restored\n"),
        "{}",
        explained(&project, "loud")
    );
    // The lit ones never got the brass, so they are unchanged.
    assert!(explained(&project, "lit [sky, gold]").starts_with("lit [sky, gold] up to date\n"));
    project.build();
    project.write("paint/gold.txt", "brass");
    expect![[r#"
        lit [sky, gold] would run: file paint/gold.txt some -> some -> paint [gold] -> loud [gold] -> lit [sky, gold]
          ran: never built
    "#]]
    .assert_eq(&explained(&project, "lit [sky, gold]"));
    project.build();
    expect![[r#"
        lit [sky, gold] up to date
          ran: file paint/gold.txt some -> some -> paint [gold] -> loud [gold] -> lit [sky, gold]
    "#]]
    .assert_eq(&explained(&project, "lit [sky, gold]"));
}

#[test]
fn a_changed_file_is_reported_with_its_times_of_modification() {
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
    // The time is not part of the key.
    project.write("paint/gold.txt", "brass");
    assert!(project.build().contains("0 ran"));
}

#[test]
fn missing_outputs_altered_outputs_and_lost_results_are_distinguished() {
    let project = pairs();
    let file = project.explain("file [sky, gold]")[0].files[0].file.clone();
    let state = |project: &Project| project.explain("file [sky, gold]")[0].files[0].state.clone();
    assert_eq!(state(&project), FileState::AsPublished);
    project.write(&format!("out/{file}"), "mine");
    let FileState::Altered { digest, modified, .. } = state(&project) else {
        panic!("{:?}", state(&project))
    };
    assert_eq!(digest, Some(crate::Digest::of(b"mine")));
    assert!(modified.is_some());
    project.remove(&format!("out/{file}"));
    assert_eq!(state(&project), FileState::Gone);
    std::fs::remove_file(project.blob("blue GOLD")).unwrap();
    let reasons = project.explain("file [sky, gold]")[0].reasons.iter().map(reason).collect::<Vec<_>>();
    assert_eq!(reasons, ["value after lit [sky, gold]"]);
    assert!(explained(&project, "lit [sky, gold]").contains("would run: result lost"));
}

#[test]
fn a_record_from_before_times_and_causes_is_still_read() {
    let record = r#"{"manifest":"pipeline.toml","item":{"stage":"loud","key":{}},"key":"0000000000000000000000000000000000000000000000000000000000000000","version":"0.1.0",
        "kind":"upper","revision":1,"parameters":{},"source":null,"inputs":[],
        "reads":[{"path":"a.txt","listing":false,"digest":null}],"outputs":[],"started":0,"milliseconds":1.0,
        "reasons":[{"reason":"file","path":"a.txt","old":null,"new":null}],
        "warnings":[],"notes":[],"failure":null}"#;
    let record = serde_json::from_str::<crate::storage::Record>(record).unwrap();
    assert_eq!((record.reads[0].modified, &record.causes[..]), (None, &[][..]));
}

const TWINS: &str = r#"
schema = 1
[stage]
paint = { kind = "text-source", source = "paint/*.txt" }
loud = { kind = "upper", input = "paint" }
file = { kind = "write", input = "loud", path = "{paint}" }
"#;

/// Two paints with these texts: if the texts are equal, everything made from them has the same key.
fn twins(a: &str, b: &str) -> Project {
    let project = Project::new(TWINS);
    project.write("paint/a.txt", a);
    project.write("paint/b.txt", b);
    project.build();
    project
}

/// The verification of a file: its item, the item that made it, its sources, and what is no longer known.
fn verified(project: &Project, file: &str) -> String {
    let path = project.path(file);
    let found =
        crate::answers::verify(&project.plan(), &path, &std::fs::read(&path).unwrap(), &|_| None).unwrap();
    let item = found.item.as_ref().map_or("an item that is gone".into(), ToString::to_string);
    let content = match found.content {
        crate::ContentState::Current => "the last",
        crate::ContentState::Earlier => "an earlier",
        crate::ContentState::Altered { .. } => "no",
    };
    let current = if found.is_current() { "current" } else { "stale" };
    let mut text = format!("{file}: {current}, {content} result of {item}, made by {}\n", found.maker);
    for source in
        found.sources.iter().filter(|source| source.kind == ReadKind::Content && source.old.is_some())
    {
        let is = if source.old == source.new { "as it was" } else { "changed" };
        let _ = writeln!(text, "  {is} {}", source.path);
    }
    for (what, names) in [("gone", &found.gone), ("forgotten", &found.forgotten)] {
        names.iter().for_each(|name| _ = writeln!(text, "  {what} {name}"));
    }
    text
}

#[test]
fn a_result_of_another_item_has_this_items_own_file_as_cause() {
    let project = twins("grey", "blue");
    project.write("paint/a.txt", "gold");
    project.build();
    project.write("paint/b.txt", "gold");
    assert!(project.build().contains("ended: 1 ran,"), "the rest is taken from the cache");
    let of_b = || format!("{}{}", explained(&project, "loud [b]"), explained(&project, "b.txt"));
    let before = of_b();
    expect![[r#"
        loud [b] up to date
          from the cache, made by loud [a]: file paint/b.txt some -> some -> paint [b] -> loud [b]
        file [b] up to date
          from the cache, made by file [a]: file paint/b.txt some -> some -> paint [b] -> loud [b] -> file [b]
    "#]]
    .assert_eq(&before);
    expect![[r#"
        out/b.txt: current, the last result of file [b], made by file [a]
          as it was paint/b.txt
    "#]]
    .assert_eq(&verified(&project, "out/b.txt"));
    let used = &project.explain("b.txt")[0].last.clone().unwrap().inputs;
    assert_eq!(used.iter().map(|used| used.used.item.to_string()).collect::<Vec<_>>(), ["loud [b]"]);

    // Whatever happens to the other one.
    project.write("paint/a.txt", "tin");
    project.build();
    assert_eq!(of_b(), before);
    project.remove("paint/a.txt");
    project.build();
    assert_eq!(of_b(), before);
    expect![[r#"
        out/b.txt: current, the last result of file [b], made by file [a]
          as it was paint/b.txt
    "#]]
    .assert_eq(&verified(&project, "out/b.txt"));
}

#[test]
fn an_undone_edit_is_explained_by_the_edited_item_and_its_own_run() {
    // Both are made, as neither was in the cache; b does not change.
    let project = twins("gold", "gold");
    project.write("paint/a.txt", "tin");
    project.build();
    project.write("paint/a.txt", "gold");
    project.build();
    expect![[r#"
        loud [a] up to date
          from the cache, made by loud [a]: file paint/a.txt some -> some -> paint [a] -> loud [a]
        loud [b] up to date
          ran: never built
    "#]]
    .assert_eq(&explained(&project, "loud"));
    project.write("paint/b.txt", "tin");
    project.build();
    project.write("paint/b.txt", "gold");
    project.build();
    expect![[r#"
        loud [a] up to date
          from the cache, made by loud [a]: file paint/a.txt some -> some -> paint [a] -> loud [a]
        loud [b] up to date
          from the cache, made by loud [b]: file paint/b.txt some -> some -> paint [b] -> loud [b]
    "#]]
    .assert_eq(&explained(&project, "loud"));
    for stem in ["a", "b"] {
        let whole = format!(
            "out/{stem}.txt: current, the last result of file [{stem}], made by file [{stem}]\n  as it was paint/{stem}.txt\n"
        );
        assert_eq!(verified(&project, &format!("out/{stem}.txt")), whole);
    }
}

#[test]
fn a_copied_source_is_new_and_the_cause_of_what_is_made_from_it() {
    let project = twins("grey", "blue");
    project.write("paint/a.txt", "gold");
    project.build();
    project.write("paint/c.txt", "gold");
    project.build();
    expect![[r#"
        file [c] up to date
          from the cache, made by file [a]: never built
    "#]]
    .assert_eq(&explained(&project, "c.txt"));
    // An earlier file of the copy belongs to the copy, in its place and elsewhere, even when both have
    // changed since.
    std::fs::copy(project.path("out/c.txt"), project.path("kept")).unwrap();
    std::fs::create_dir(project.path("kept-folder")).unwrap();
    std::fs::copy(project.path("out/c.txt"), project.path("kept-folder/c.txt")).unwrap();
    project.write("paint/c.txt", "brass");
    project.build();
    std::fs::copy(project.path("kept"), project.path("out/c.txt")).unwrap();
    expect![[r#"
        out/c.txt: stale, an earlier result of file [c], made by file [a]
          changed paint/c.txt
    "#]]
    .assert_eq(&verified(&project, "out/c.txt"));
    // It contains what a has now: a copy of the present result.
    assert!(verified(&project, "kept").starts_with("kept: current, the last result of file [a]"));
    project.write("paint/a.txt", "tin");
    project.build();
    expect![[r#"
        kept-folder/c.txt: stale, an earlier result of file [c], made by file [a]
          changed paint/c.txt
    "#]]
    .assert_eq(&verified(&project, "kept-folder/c.txt"));
}

#[test]
fn without_its_own_record_an_item_does_not_report_another_items_files() {
    let project = twins("grey", "blue");
    project.write("paint/a.txt", "gold");
    project.build();
    project.write("paint/b.txt", "gold");
    project.build();
    std::fs::copy(project.path("out/b.txt"), project.path("kept")).unwrap();
    project.write("paint/b.txt", "brass");
    project.build();
    project.write("paint/a.txt", "tin");
    project.build();
    // As in a compacted journal, or in one from before results were recorded for each item.
    let journal = project.read(".specula/journal");
    let is_forgotten =
        |line: &str| line.get(17..19) == Some("r ") && line.contains(r#""key":{"paint":"b"}},"key""#);
    let kept = journal.lines().filter(|line| !is_forgotten(line)).map(|line| format!("{line}\n"));
    let kept = kept.collect::<String>();
    assert!(kept.len() < journal.len());
    project.write(".specula/journal", &kept);
    std::fs::copy(project.path("kept"), project.path("out/b.txt")).unwrap();
    expect![[r#"
        out/b.txt: stale, an earlier result of file [b], made by file [a]
          forgotten loud [b]
    "#]]
    .assert_eq(&verified(&project, "out/b.txt"));
}

#[test]
fn an_unchanged_item_that_returns_has_returned_as_reason() {
    let project = twins("gold", "tin");
    project.remove("paint/b.txt");
    project.build();
    project.write("paint/b.txt", "tin");
    assert!(project.build().contains("ended: 0 ran,"));
    expect![[r#"
        paint [b] up to date
          from the cache, made by paint [b]: returned
        file [b] up to date
          from the cache, made by file [b]: returned
    "#]]
    .assert_eq(&format!("{}{}", explained(&project, "paint [b]"), explained(&project, "b.txt")));
}

#[test]
fn results_that_are_restored_repeatedly_do_not_displace_others() {
    let project = twins("gold", "red");
    project.write("paint/a.txt", "tin");
    project.build();
    for _ in 0..10 {
        for text in ["gold", "silver"] {
            project.write("paint/a.txt", text);
            project.build();
        }
    }
    let journal = project.read(".specula/journal");
    project.write("paint/a.txt", "tin");
    assert!(project.build().contains("ended: 0 ran,"), "{journal}");
}
