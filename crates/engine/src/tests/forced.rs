//! What runs although it is up to date, because it was asked for.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use expect_test::expect;

use super::shared::{Memory, with_cache};
use super::*;
use crate::error::ErrorKind;

/// A chain over two texts that is built, and of which these stages and items are forced from now on.
fn built(forced: &[&str]) -> Project {
    let mut project = two_texts(CHAIN);
    project.build();
    force(&mut project, forced);
    project
}

/// Forces these stages and items from now on.
fn force(project: &mut Project, names: &[&str]) {
    project.options.force = true;
    project.options.stages = names.iter().map(|name| (*name).to_owned()).collect();
}

/// The events of items that run because they are forced, and make what they made before.
fn forced(items: &[&str]) -> String {
    items.iter().map(|item| format!("run {item}: forced\nran {item}, the same result\n")).collect()
}

#[test]
fn without_names_everything_runs_and_equal_results_are_not_published_again() {
    let all = ["text [a]", "loud [a]", "file [a]", "text [b]", "loud [b]", "file [b]"];
    let end = "ended: 6 ran, 0 up to date, 0 failed, 0 skipped, 0 published, 0 removed\n";
    assert_eq!(built(&[]).build(), format!("planned 3 stages, 6 items\n{}{end}", forced(&all)));
}

#[test]
fn what_a_named_item_needs_is_not_forced() {
    let project = built(&["file [a]", "loud"]);
    let begin = "planned 3 stages, 5 items\nup to date text [a]\nup to date text [b]\n";
    let end = "ended: 3 ran, 2 up to date, 0 failed, 0 skipped, 0 published, 0 removed\n";
    let ran = forced(&["loud [a]", "file [a]", "loud [b]"]);
    assert_eq!(project.build(), format!("{begin}{ran}{end}"));
    let found = project.explain("loud [a]").remove(0);
    assert!(!found.would_run, "the next build is not forced");
    assert_eq!(found.last.unwrap().reasons, [Reason::Forced]);
}

#[test]
fn a_dry_run_shows_what_is_forced_and_what_may_follow() {
    let mut project = built(&["loud [a]", "file [a]"]);
    project.options.dry_run = true;
    expect![[r#"
        planned 3 stages, 3 items
        up to date text [a]
        run loud [a]: forced
        run file [a]: value after loud [a]; forced
        ended: 2 ran, 1 up to date, 0 failed, 0 skipped, 0 published, 0 removed
    "#]]
    .assert_eq(&project.build());
}

#[test]
fn other_reasons_are_reported_too() {
    let project = built(&["text [a]"]);
    project.write("a.txt", "new");
    assert_has(project.build(), ["run text [a]: file a.txt some -> some; forced\n"]);
}

#[test]
fn an_unknown_name_is_an_error() {
    let (_, built) = built(&["lood"]).try_build();
    assert_eq!(built.unwrap_err().kind(), ErrorKind::UnknownTarget);
}

/// How often [`Counted`] ran: something that the engine cannot know.
static RUNS: AtomicUsize = AtomicUsize::new(0);

/// Writes how often it ran.
struct Counted;

impl TextKind for Counted {
    type Parameters = Nothing;
    const NAME: &'static str = "counted";

    fn make(_: &Nothing, _: &str, _: &Context<'_>) -> Result<String, Failure> {
        Ok(format!("{} runs", RUNS.fetch_add(1, Ordering::Relaxed) + 1))
    }
}

#[test]
fn what_comes_after_a_forced_item_runs_if_its_result_differs() {
    let mut project = Project::new(&CHAIN.replace("\"upper\"", "\"counted\""));
    project.kinds = kinds().with(Counted);
    project.write("a.txt", "one");
    project.build();
    force(&mut project, &["loud"]);
    project.build();
    project.options.force = false;
    project.options.stages = Vec::new();
    expect![[r#"
        planned 3 stages, 3 items
        up to date text [a]
        up to date loud [a]
        run file [a]: value loud [a] some -> some
        ran file [a]
        published file/a.txt 6
        ended: 1 ran, 2 up to date, 0 failed, 0 skipped, 1 published, 0 removed
    "#]]
    .assert_eq(&project.build());
    assert_eq!(project.read("out/file/a.txt"), "2 runs");
}

#[test]
fn a_shared_cache_answers_for_what_is_not_forced_only() {
    let memory = Arc::<Memory>::default();
    let make = || {
        let project = with_cache(&memory, CHAIN);
        project.write("a.txt", "one");
        project
    };
    make().build();
    let mut other = make();
    force(&mut other, &["loud"]);
    expect![[r#"
        planned 2 stages, 2 items
        from memory text [a]
        run loud [a]: never built
        ran loud [a]
        ended: 1 ran, 1 up to date, 0 failed, 0 skipped, 0 published, 0 removed
    "#]]
    .assert_eq(&other.build());
}
