//! Builds that know what has changed check nothing else.

use super::*;

const MANIFEST: &str = r#"
schema = 1
[stage]
left = { kind = "text-source", source = "left/*.txt" }
right = { kind = "text-source", source = "right/*.txt" }
pair = { kind = "concat", inputs = { left = "left", right = "right" } }
file = { kind = "write", input = "pair", path = "{left}/{right}" }
"#;

struct Builds {
    project: Project,
    session: BuildSession,
    plan: Plan,
}

fn builds() -> Builds {
    let project = Project::new(MANIFEST);
    for side in ["left", "right"] {
        for name in ["a", "b"] {
            project.write(&format!("{side}/{name}.txt"), &format!("{side} {name}\n"));
        }
    }
    let (session, plan) = (BuildSession::new(Some(1), 0).unwrap(), project.plan());
    let builds = Builds { project, session, plan };
    assert!(builds.build(None).contains("12 ran"));
    builds
}

impl Builds {
    /// Builds the same plan; `changed` are the only files that changed.
    fn build(&self, changed: Option<&[&str]>) -> String {
        let changed = changed.map(|names| names.iter().map(|name| self.project.path(name)).collect());
        let options = BuildOptions { changed, ..self.project.options.clone() };
        self.project.build_of(&self.session, &self.plan, &options)
    }
}

#[test]
fn an_edit_runs_the_items_that_it_affects_and_reports_no_other() {
    let builds = builds();
    builds.project.write("left/a.txt", "edited\n");
    let log = builds.build(Some(&["left/a.txt"]));
    assert_has(&log, ["5 ran, 7 up to date", "2 published"]);
    assert!(!log.contains("up to date left [b]") && !log.contains("[b, a]"), "{log}");
    assert_eq!(builds.project.read("out/a/b.txt"), "edited\nright b\n");
    // Nothing changed, or a file that no item reads.
    for changed in [&[][..], &["left/a.txt"], &["elsewhere"]] {
        assert_has(builds.build(Some(changed)), ["0 ran, 12 up to date", "0 published"]);
    }
}

#[test]
fn an_unreported_change_is_found_by_the_next_build_that_checks_everything() {
    let builds = builds();
    builds.project.remove("out/b/b.txt");
    builds.project.write("right/b.txt", "unheard\n");
    builds.project.write("left/a.txt", "edited\n");
    let log = builds.build(Some(&["left/a.txt"]));
    assert!(!builds.project.exists("out/b/b.txt"), "{log}");
    assert_has(builds.build(None), ["5 ran"]);
    assert_eq!(builds.project.read("out/b/b.txt"), "left b\nunheard\n");
    assert_eq!(builds.project.read("out/a/b.txt"), "edited\nunheard\n");
}

#[test]
fn another_plan_or_another_process_makes_a_build_check_everything() {
    let mut builds = builds();
    builds.project.remove("out/b/b.txt");
    builds.plan = builds.project.plan();
    assert!(builds.build(Some(&[])).contains("restored b/b.txt"), "the same manifest, loaded again");
    builds.project.remove("out/b/b.txt");
    builds.project.write("left/b.txt", "theirs\n");
    builds.project.build();
    builds.project.remove("out/a/b.txt");
    assert!(builds.build(Some(&[])).contains("restored a/b.txt"), "somebody else has built");
}

#[test]
fn an_item_that_failed_or_was_not_reached_is_checked_again() {
    let builds = builds();
    builds.project.remove("out/a/a.txt");
    builds.project.write("out/a/a.txt/inside", "a folder in the way");
    builds.project.write("left/a.txt", "edited\n");
    assert!(builds.build(Some(&["left/a.txt"])).contains("FAILED file [a, a]"));
    assert!(builds.build(Some(&[])).contains("FAILED file [a, a]"));
    builds.project.remove("out/a/a.txt");
    assert_has(builds.build(Some(&[])), ["published a/a.txt", "up to date file [a, a]"]);
    assert!(!builds.build(Some(&[])).contains("file [a, a]"));
}

#[test]
fn a_stopped_build_leaves_the_rest_to_the_next() {
    let mut builds = builds();
    builds.project.write("left/a.txt", "edited\n");
    builds.project.cancel.cancel();
    assert_has(builds.build(Some(&["left/a.txt"])), ["cancelled", "0 ran"]);
    builds.project.cancel = Cancel::default();
    builds.project.write("right/b.txt", "edited too\n");
    let log = builds.build(Some(&["right/b.txt"]));
    assert!(log.contains("8 ran, 4 up to date"), "what was reported first is not forgotten: {log}");
    assert_eq!(builds.project.read("out/a/b.txt"), "edited\nedited too\n");
}

/// Random edits, of which some builds know all and some are stopped: the last one leaves what a clean build
/// makes.
#[test]
fn builds_that_know_all_changes_leave_what_a_clean_build_makes() {
    let mut builds = builds();
    let mut random = 1_u32;
    let mut roll = |sides: u32| {
        random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (random >> 16) % sides
    };
    let mut pending = Vec::new();
    for round in 0..200 {
        for _ in 0..roll(3) {
            let name = ["left/a.txt", "left/b.txt", "right/a.txt", "right/b.txt"][roll(4) as usize];
            let text = ["one\n".to_owned(), "two\n".to_owned(), format!("round {round}\n")][roll(3) as usize]
                .clone();
            builds.project.write(name, &text);
            pending.push(name);
        }
        let is_stopped = roll(4) == 0;
        if is_stopped {
            builds.project.cancel.cancel();
        }
        builds.build(if roll(10) == 0 { None } else { Some(&pending) });
        pending.clear();
        builds.project.cancel = Cancel::default();
    }
    builds.build(Some(&[]));
    let made = builds.project.files("out");
    builds.project.remove("out");
    builds.project.remove(".specula");
    builds.project.build();
    assert_eq!(made, builds.project.files("out"));
}
