//! Which items rerun, and why.

use expect_test::expect;

use super::*;

const MARKED: &str = r#"
schema = 1
out = "out"
[stage]
text = { kind = "text-source", source = "*.txt" }
loud = { kind = "upper", input = "text" }
marked = { kind = "suffix", input = "loud", text = "!" }
file = { kind = "write", input = "marked" }
"#;

fn chain() -> Project {
    two_texts(MARKED)
}

#[test]
fn a_first_build_runs_everything_and_the_next_nothing() {
    let project = chain();
    expect![[r#"
        planned 4 stages, 8 items
        run text [a]: never built
        ran text [a]
        run loud [a]: never built
        ran loud [a]
        run marked [a]: never built
        ran marked [a]
        run file [a]: never built
        ran file [a]
        published file/a.txt 4
        run text [b]: never built
        ran text [b]
        run loud [b]: never built
        ran loud [b]
        run marked [b]: never built
        ran marked [b]
        run file [b]: never built
        ran file [b]
        published file/b.txt 4
        ended: 8 ran, 0 up to date, 0 failed, 0 skipped, 2 published, 0 removed
    "#]]
    .assert_eq(&project.build());
    assert_eq!(project.read("out/file/a.txt"), "ONE!");
    expect![[r#"
        planned 4 stages, 8 items
        up to date text [a]
        up to date text [b]
        up to date loud [a]
        up to date loud [b]
        up to date marked [a]
        up to date marked [b]
        up to date file [a]
        up to date file [b]
        ended: 0 ran, 8 up to date, 0 failed, 0 skipped, 0 published, 0 removed
    "#]]
    .assert_eq(&project.build());
}

#[test]
fn a_changed_source_reruns_what_depends_on_it_and_a_revert_runs_nothing() {
    let project = chain();
    project.build();
    project.write("a.txt", "three");
    expect![[r#"
        planned 4 stages, 8 items
        up to date text [b]
        up to date loud [b]
        up to date marked [b]
        up to date file [b]
        run text [a]: file a.txt some -> some
        ran text [a]
        run loud [a]: text text [a] some -> some
        ran loud [a]
        run marked [a]: text loud [a] some -> some
        ran marked [a]
        run file [a]: value marked [a] some -> some
        ran file [a]
        published file/a.txt 6
        ended: 4 ran, 4 up to date, 0 failed, 0 skipped, 1 published, 0 removed
    "#]]
    .assert_eq(&project.build());
    project.write("a.txt", "one");
    expect![[r#"
        planned 4 stages, 8 items
        up to date text [b]
        up to date loud [b]
        up to date marked [b]
        up to date file [b]
        up to date text [a]
        up to date loud [a]
        up to date marked [a]
        up to date file [a]
        published file/a.txt 4
        ended: 0 ran, 8 up to date, 0 failed, 0 skipped, 1 published, 0 removed
    "#]]
    .assert_eq(&project.build());
    assert_eq!(project.read("out/file/a.txt"), "ONE!");
    assert_has(project.build(), ["ended: 0 ran, 8 up to date, 0 failed, 0 skipped, 0 published, 0 removed"]);
}

#[test]
fn an_edit_that_leaves_a_result_unchanged_stops_there() {
    let project = chain();
    project.build();
    project.write("a.txt", "oNe");
    expect![[r#"
        planned 4 stages, 8 items
        up to date text [b]
        up to date loud [b]
        up to date marked [b]
        up to date file [b]
        run text [a]: file a.txt some -> some
        ran text [a]
        run loud [a]: text text [a] some -> some
        ran loud [a], the same result
        up to date marked [a]
        up to date file [a]
        ended: 2 ran, 6 up to date, 0 failed, 0 skipped, 0 published, 0 removed
    "#]]
    .assert_eq(&project.build());
}

#[test]
fn a_touched_file_is_up_to_date() {
    let project = chain();
    project.build();
    let file = std::fs::File::options().append(true).open(project.path("a.txt")).unwrap();
    file.set_modified(std::time::SystemTime::now() + std::time::Duration::from_secs(3600)).unwrap();
    assert!(project.build().contains("ended: 0 ran, 8 up to date"));
    // The same size and time of change: contents decide.
    let time = std::fs::metadata(project.path("a.txt")).unwrap().modified().unwrap();
    project.write("a.txt", "six");
    std::fs::File::options().append(true).open(project.path("a.txt")).unwrap().set_modified(time).unwrap();
    assert!(project.build().contains("ended: 4 ran, 4 up to date"));
}

#[test]
fn old_files_are_compared_by_their_stamps_and_recent_ones_by_their_contents() {
    let project = chain();
    let old = std::time::SystemTime::now() - std::time::Duration::from_secs(3600);
    std::fs::File::options().append(true).open(project.path("a.txt")).unwrap().set_modified(old).unwrap();
    project.build();
    let stamps =
        || project.read(".specula/journal").lines().filter(|line| line[16..].starts_with(" s ")).count();
    if cfg!(unix) {
        // Their times of modification are old and recent, but a's metadata changed recently: neither stamp
        // can be trusted yet.
        assert_eq!(stamps(), 0);
        std::thread::sleep(std::time::Duration::from_millis(2100));
        assert!(project.build().contains("0 ran, 8 up to date"));
        assert_eq!(stamps(), 2);
        assert!(project.build().contains("0 ran, 8 up to date"));
        assert_eq!(stamps(), 2);
        project.write("a.txt", "ten");
        assert!(project.build().contains("4 ran, 4 up to date"));
        // Restored from an archive, with its size and its time of modification: only the time of change of
        // its metadata shows it.
        let before = std::fs::metadata(project.path("b.txt")).unwrap();
        project.write("b.txt", "six");
        let file = std::fs::File::options().append(true).open(project.path("b.txt")).unwrap();
        file.set_modified(before.modified().unwrap()).unwrap();
        let after = std::fs::metadata(project.path("b.txt")).unwrap();
        assert_eq!(
            (before.len(), before.modified().unwrap(), identity(&before)),
            (after.len(), after.modified().unwrap(), identity(&after))
        );
        assert!(project.build().contains("4 ran, 4 up to date"));
        assert_eq!(project.read("out/file/b.txt"), "SIX!");
    }
}

#[cfg(unix)]
fn identity(metadata: &std::fs::Metadata) -> u64 {
    std::os::unix::fs::MetadataExt::ino(metadata)
}

#[cfg(not(unix))]
fn identity(_: &std::fs::Metadata) -> u64 {
    0
}

#[test]
fn a_changed_parameter_is_reported_with_old_and_new_value() {
    let project = chain();
    project.build();
    project.edit("text = \"!\"", "text = \"?\", times = 2");
    let log = project.build();
    let line = log.lines().find(|line| line.starts_with("run marked [a]")).unwrap();
    assert_eq!(line, r#"run marked [a]: text "!" -> "?"; times 1 -> 2"#);
    assert_has(&log, ["4 ran, 4 up to date"]);
    project.edit("times = 2", "times = 1");
    assert_has(project.build(), ["run marked [a]: times 2 -> 1"]);
    // Removing a default from the manifest changes nothing.
    project.edit(", times = 1", "");
    assert!(project.build().contains("0 ran, 8 up to date"));
}

#[test]
fn the_latest_record_is_compared_not_the_last_run() {
    let project = chain();
    project.build();
    project.edit("\"!\"", "\"?\"");
    project.build();
    project.edit("\"?\"", "\"!\"");
    assert!(project.build().contains("0 ran"));
    project.edit("\"!\"", "\".\"");
    assert!(project.build().contains(r#"run marked [a]: text "!" -> ".""#));
}

struct Revised;

impl TextKind for Revised {
    type Parameters = Nothing;
    const NAME: &'static str = "upper";
    const REVISION: u32 = 2;

    fn make(_: &Nothing, text: &str, context: &Context<'_>) -> Result<String, Failure> {
        context.reporter.warn("bold is loud");
        context.reporter.note("two stars");
        Ok(format!("*{}*", text.to_uppercase()))
    }
}

#[test]
fn a_raised_revision_reruns_and_its_warnings_are_kept_for_explain() {
    let mut project = chain();
    project.remove("b.txt");
    project.build();
    project.kinds = replacing(Revised);
    expect![[r#"
        planned 4 stages, 4 items
        up to date text [a]
        run loud [a]: kind upper 1 -> upper 2
        warning loud [a]: bold is loud
        note loud [a]: two stars
        ran loud [a]
        run marked [a]: text loud [a] some -> some
        ran marked [a]
        run file [a]: value marked [a] some -> some
        ran file [a]
        published file/a.txt 6
        ended: 3 ran, 1 up to date, 0 failed, 0 skipped, 1 published, 0 removed
    "#]]
    .assert_eq(&project.build());
    assert!(!project.build().contains("warning"));
    let loud = &project.explain("loud")[0];
    assert!(!loud.would_run);
    let last = loud.last.as_ref().unwrap();
    assert_eq!(
        (&last.warnings[..], &last.notes[..]),
        (&["bold is loud".into()][..], &["two stars".into()][..])
    );
    assert_eq!(reason(&last.reasons[0]), "kind upper 1 -> upper 2");
    assert_eq!(last.inputs[0].used.item.to_string(), "text [a]");
    assert_eq!(last.results, [crate::Digest::of(b"*ONE*")]);
}

#[test]
fn files_that_a_source_names_and_folders_that_it_lists_count() {
    let project = Project::new(
        "schema = 1\n[stage]\ntext = { kind = \"text-source\", source = \"main.txt\" }\n\
         names = { kind = \"text-source\", source = \"faces\" }\n",
    );
    project.write("main.txt", "include part.inc\n");
    project.write("part.inc", "part");
    project.write("faces/px.exr", "");
    project.build();
    assert!(project.build().contains("0 ran, 2 up to date"));
    project.write("part.inc", "whole");
    assert_has(project.build(), ["run text [main]: file part.inc some -> some\nran text [main]\n"]);
    project.write("faces/nx.exr", "");
    assert!(project.build().contains("run names [faces]: file faces some -> some\nran names [faces]\n"));
    // The content of the faces was not read.
    project.write("faces/px.exr", "x");
    assert!(project.build().contains("0 ran, 2 up to date"));
    project.remove("part.inc");
    assert_has(
        project.build(),
        ["run text [main]: file part.inc some -> none\nFAILED text [main]: source main.txt: cannot read"],
    );
    project.write("part.inc", "third");
    assert_has(
        project.build(),
        ["run text [main]: failed before; file part.inc none -> some\nran text [main]\n"],
    );
    project.write("part.inc", "whole");
    assert!(project.build().contains("0 ran, 2 up to date"));
}

const GATHER: &str = r#"
schema = 1
[stage]
text = { kind = "text-source", source = "*.txt" }
sheet = { kind = "collect", input = "text", per = [] }
file = { kind = "write", input = "sheet" }
"#;

#[test]
fn a_gather_reruns_when_a_member_joins_leaves_or_is_renamed() {
    let project = Project::new(GATHER);
    project.write("a.txt", "one");
    project.build();
    assert_eq!(project.read("out/file.txt"), "a=one\n");
    project.write("b.txt", "two");
    assert_has(project.build(), ["run sheet: texts text [b] none -> some\n"]);
    assert_eq!(project.read("out/file.txt"), "a=one\nb=two\n");
    std::fs::rename(project.path("b.txt"), project.path("c.txt")).unwrap();
    assert_has(project.build(), ["run sheet: texts text [c] none -> some; texts text [b] some -> none\n"]);
    assert_eq!(project.read("out/file.txt"), "a=one\nc=two\n");
    project.remove("c.txt");
    let log = project.build();
    assert!(log.contains("0 ran, 3 up to date"), "the sheet of a alone is in the cache: {log}");
    assert_eq!(project.read("out/file.txt"), "a=one\n");
}

#[test]
fn a_selected_stage_builds_what_it_needs_and_no_more() {
    let mut project = chain();
    project.options.stages = vec!["loud".into()];
    assert!(
        project
            .build()
            .ends_with("ended: 4 ran, 0 up to date, 0 failed, 0 skipped, 0 published, 0 removed\n")
    );
    project.options.stages = vec!["maked".into()];
    let error = project.try_build().1.unwrap_err();
    assert_eq!(error.kind(), crate::ErrorKind::UnknownTarget);
    assert_eq!(error.help(), Some("did you mean \"marked\"?"));
}

#[test]
fn a_dry_run_reports_and_writes_nothing() {
    let mut project = chain();
    project.options.dry_run = true;
    assert!(project.build().contains("run text [a]: never built\n"));
    assert!(!project.exists(".specula") && !project.exists("out"));
    project.options.dry_run = false;
    project.build();
    project.options.dry_run = true;
    project.write("a.txt", "three");
    project.remove("out/file/b.txt");
    let before = project.files("");
    expect![[r#"
        planned 4 stages, 8 items
        run text [a]: file a.txt some -> some
        up to date text [b]
        run loud [a]: text after text [a]
        up to date loud [b]
        run marked [a]: text after loud [a]
        up to date marked [b]
        run file [a]: value after marked [a]
        up to date file [b]
        restored file/b.txt 4
        ended: 4 ran, 4 up to date, 0 failed, 0 skipped, 1 published, 0 removed
    "#]]
    .assert_eq(&project.build());
    assert_eq!(project.files(""), before);
}

#[test]
fn explain_finds_a_file_by_any_of_its_names() {
    let project = chain();
    project.build();
    let absolute = project.path("out/file/a.txt");
    for target in ["file/a.txt", absolute.to_str().unwrap()] {
        let found = project.explain(target);
        assert_eq!(found.len(), 1);
        assert_eq!(found[0].item.to_string(), "file [a]");
        assert_eq!(found[0].files[0].state, crate::FileState::AsPublished);
        let recipe = &found[0].last.as_ref().unwrap().recipe;
        let digest = crate::Digest::of(b"ONE!");
        assert_eq!(
            *recipe,
            format!(r#"{{"inputs":{{"value":"{digest}"}},"kind":"write","parameters":{{}},"revision":1}}"#)
        );
    }
    assert_eq!(project.explain("text").len(), 2);
    let error = crate::answers::explain(&project.plan(), "fil/a.txt").unwrap_err();
    assert_eq!(error.help(), Some("did you mean \"file/a.txt\"?"));
    project.edit("\"!\"", "\"?\"");
    let reasons = |target| project.explain(target)[0].reasons.iter().map(reason).collect::<Vec<_>>();
    assert_eq!(reasons("marked"), [r#"text "!" -> "?""#]);
    assert_eq!(reasons("file"), ["value after marked [a]"]);
    assert!(reasons("loud").is_empty());
}

#[test]
fn results_do_not_depend_on_the_number_of_jobs() {
    let mut outs = Vec::new();
    for jobs in [1, 2, 7] {
        let mut project = Project::new(GATHER);
        project.options.jobs = Some(jobs);
        for n in 0..40 {
            project.write(&format!("{n}.txt"), &format!("text {n}"));
        }
        let log = project.build();
        assert!(log.contains("42 ran, 0 up to date"));
        assert!(project.build().contains("0 ran, 42 up to date"));
        outs.push((project.files("out"), project.files(".specula/blobs")));
    }
    assert_eq!(outs[0], outs[1]);
    assert_eq!(outs[0], outs[2]);
}

#[test]
fn manifests_that_share_a_folder_share_results() {
    let project = chain();
    project.build();
    project.write("other.toml", &MARKED.replace("\"out\"", "\"other\""));
    let plan = Plan::load(&project.path("other.toml"), &project.kinds).unwrap();
    let summary = crate::build::build(&plan, &project.options, &project.cancel, &|_| {}).unwrap();
    assert_eq!((summary.ran, summary.up_to_date, summary.published), (0, 8, 2));
    assert!(project.build().contains("0 ran, 8 up to date, 0 failed, 0 skipped, 0 published, 0 removed"));
}

#[test]
fn every_task_reports_its_worker_and_time() {
    let mut project = chain();
    project.options.jobs = Some(2);
    let spells = || {
        let (events, summary) = project.try_build();
        let (events, whole) = (events.into_iter(), summary.unwrap().milliseconds);
        let spells = events.filter_map(|event| match event {
            Event::TaskTimed { item, work, worker, start_milliseconds: start, milliseconds } => {
                assert!(
                    worker < 2 && start >= 0.0 && start + milliseconds <= whole,
                    "{item} {start} {whole}"
                );
                Some((worker, start, start + milliseconds, format!("{work:?} {item}")))
            }
            _ => None,
        });
        spells.collect::<Vec<_>>()
    };
    let names = |spells: &[(usize, f64, f64, String)]| {
        let mut names = spells.iter().map(|spell| spell.3.clone()).collect::<Vec<_>>();
        names.sort();
        names
    };
    let first = spells();
    let stages = ["file", "loud", "marked", "text"];
    let runs = stages.iter().flat_map(|stage| ["a", "b"].map(|key| format!("Run {stage} [{key}]")));
    assert_eq!(names(&first), runs.collect::<Vec<_>>());
    for (index, a) in first.iter().enumerate() {
        for b in first[index + 1..].iter().filter(|b| b.0 == a.0) {
            let apart = a.2 <= b.1 || b.2 <= a.1;
            let nested = (a.1 <= b.1 && b.2 <= a.2) || (b.1 <= a.1 && a.2 <= b.2);
            assert!(apart || nested, "one worker did {a:?} and {b:?}");
        }
    }
    assert!(spells().is_empty(), "nothing is done for what is up to date");
    project.edit("text = \"!\"", "text = \"?\"");
    let again = [
        "Fetch loud [a]",
        "Fetch loud [b]",
        "Run file [a]",
        "Run file [b]",
        "Run marked [a]",
        "Run marked [b]",
    ];
    assert_eq!(names(&spells()), again);
    project.remove("out");
    assert_eq!(names(&spells()), ["Publish file [a]", "Publish file [b]"]);
}

/// Writes a text, and takes some time.
struct Elaborate;

impl Kind for Elaborate {
    type Parameters = Nothing;
    const NAME: &'static str = "elaborate";
    const REVISION: u32 = 1;
    const TEXT: &'static str = "//! Writes a text, slowly.\n";

    fn ports() -> Vec<Port> {
        vec![Port::one::<Text>("text")]
    }

    fn product(_: &Nothing, _: &[(&str, &'static str)]) -> Product {
        Product::Files(vec![".txt".into()])
    }

    fn run(_: &Nothing, context: &Context<'_>) -> Result<Output, Failure> {
        std::thread::sleep(std::time::Duration::from_millis(300));
        Ok(Output::files(vec![context.inputs.get::<Text>("text")?.0.clone().into_bytes()]))
    }
}

#[test]
fn a_slow_export_waits_for_the_fast_ones() {
    let mut project =
        Project::new(&format!("{MARKED}report = {{ kind = \"elaborate\", input = \"marked\" }}\n"));
    project.kinds = project.kinds.with(Elaborate);
    project.write("a.txt", "one");
    let order = |log: &str| {
        let lines = log.lines().filter(|line| line.starts_with("published")).map(str::to_owned);
        lines.collect::<Vec<_>>()
    };
    assert_eq!(order(&project.build()), ["published report/a.txt 4", "published file/a.txt 4"]);
    project.write("a.txt", "three");
    assert_eq!(order(&project.build()), ["published file/a.txt 6", "published report/a.txt 6"]);
}

/// With two threads both could be in work at once, as they are while nobody knows how long they take.
#[test]
fn a_slow_export_starts_when_the_fast_ones_are_published() {
    let mut project =
        Project::new(&format!("{MARKED}report = {{ kind = \"elaborate\", input = \"marked\" }}\n"));
    project.kinds = project.kinds.with(Elaborate);
    project.options.jobs = Some(2);
    let starts_beside_another = |project: &Project| {
        let events = Mutex::new(Vec::new());
        let report = |event| events.lock().push(event);
        crate::build::build(&project.plan(), &project.options, &project.cancel, &report).unwrap();
        let events = events.into_inner();
        let place = |is_it: &dyn Fn(&Event) -> bool| events.iter().position(is_it).unwrap();
        let started = place(&|event| matches!(event, Event::Started { item, .. } if item.stage == "report"));
        started < place(&|event| matches!(event, Event::Published { item, .. } if item.stage == "file"))
    };
    project.write("a.txt", "one");
    assert!(starts_beside_another(&project));
    // On a machine that is busy with something else the fast one may take long, and is not waited for then.
    let mut edits = ["three", "four", "five", "six", "seven"].into_iter();
    assert!(edits.any(|text| {
        project.write("a.txt", text);
        !starts_beside_another(&project)
    }));
}
