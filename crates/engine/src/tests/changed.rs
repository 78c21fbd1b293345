//! Builds that are told what has changed look at nothing else.

use super::*;

const MANIFEST: &str = r#"
schema = 1
out = "out"

[stage.left]
kind = "text-source"
source = "left/*.txt"

[stage.right]
kind = "text-source"
source = "right/*.txt"

[stage.pair]
kind = "concat"
inputs = { left = "left", right = "right" }

[stage.file]
kind = "write"
input = "pair"
path = "{left}/{right}"
"#;

struct Told {
    project: Project,
    bench: BuildSession,
    plan: Plan,
}

fn told() -> Told {
    let project = Project::new(MANIFEST);
    for side in ["left", "right"] {
        for name in ["a", "b"] {
            project.write(&format!("{side}/{name}.txt"), &format!("{side} {name}\n"));
        }
    }
    let (bench, plan) = (BuildSession::new(Some(1), 0).unwrap(), project.plan());
    let told = Told { project, bench, plan };
    assert!(told.build(None).contains("12 ran"));
    told
}

impl Told {
    /// Builds the same plan; `changed` are the only files that changed.
    fn build(&self, changed: Option<&[&str]>) -> String {
        let changed = changed.map(|names| names.iter().map(|name| self.project.path(name)).collect());
        let options = BuildOptions { changed, ..self.project.options.clone() };
        let events = Mutex::new(Vec::new());
        let built = self.bench.build(&self.plan, &options, &self.project.cancel, &|event| {
            events.lock().push(event);
        });
        built.unwrap();
        log(&events.into_inner())
    }
}

#[test]
fn an_edit_runs_what_it_concerns_and_names_nothing_else() {
    let told = told();
    told.project.write("left/a.txt", "edited\n");
    let log = told.build(Some(&["left/a.txt"]));
    assert!(log.contains("5 ran, 7 up to date") && log.contains("2 published"), "{log}");
    assert!(!log.contains("up to date left [b]") && !log.contains("[b, a]"), "{log}");
    assert_eq!(told.project.read("out/a/b.txt"), "edited\nright b\n");
    // Nothing changed, or something that nobody reads.
    for changed in [&[][..], &["left/a.txt"], &["elsewhere"]] {
        let log = told.build(Some(changed));
        assert!(log.contains("0 ran, 12 up to date") && log.contains("0 published"), "{log}");
    }
}

#[test]
fn what_is_not_told_is_found_by_the_next_build_that_looks_at_everything() {
    let told = told();
    told.project.remove("out/b/b.txt");
    told.project.write("right/b.txt", "unheard\n");
    told.project.write("left/a.txt", "edited\n");
    let log = told.build(Some(&["left/a.txt"]));
    assert!(!told.project.exists("out/b/b.txt"), "{log}");
    let log = told.build(None);
    assert!(log.contains("5 ran"), "{log}");
    assert_eq!(told.project.read("out/b/b.txt"), "left b\nunheard\n");
    assert_eq!(told.project.read("out/a/b.txt"), "edited\nunheard\n");
}

#[test]
fn another_plan_or_another_process_makes_it_look_at_everything() {
    let mut told = told();
    told.project.remove("out/b/b.txt");
    told.plan = told.project.plan();
    assert!(told.build(Some(&[])).contains("restored b/b.txt"), "the same manifest, loaded again");
    told.project.remove("out/b/b.txt");
    told.project.write("left/b.txt", "theirs\n");
    told.project.build();
    told.project.remove("out/a/b.txt");
    assert!(told.build(Some(&[])).contains("restored a/b.txt"), "somebody else has built");
}

#[test]
fn an_item_that_failed_or_was_not_reached_is_done_again() {
    let told = told();
    told.project.remove("out/a/a.txt");
    told.project.write("out/a/a.txt/inside", "a folder in the way");
    told.project.write("left/a.txt", "edited\n");
    assert!(told.build(Some(&["left/a.txt"])).contains("FAILED file [a, a]"));
    assert!(told.build(Some(&[])).contains("FAILED file [a, a]"));
    told.project.remove("out/a/a.txt");
    let log = told.build(Some(&[]));
    assert!(log.contains("published a/a.txt") && log.contains("up to date file [a, a]"), "{log}");
    assert!(!told.build(Some(&[])).contains("file [a, a]"));
}

#[test]
fn a_build_that_was_stopped_leaves_the_rest_to_the_next() {
    let mut told = told();
    told.project.write("left/a.txt", "edited\n");
    told.project.cancel.cancel();
    let log = told.build(Some(&["left/a.txt"]));
    assert!(log.contains("cancelled") && log.contains("0 ran"), "{log}");
    told.project.cancel = Cancel::default();
    told.project.write("right/b.txt", "edited too\n");
    let log = told.build(Some(&["right/b.txt"]));
    assert!(log.contains("8 ran, 4 up to date"), "what was told first is not forgotten: {log}");
    assert_eq!(told.project.read("out/a/b.txt"), "edited\nedited too\n");
}

/// Random edits of which some builds are told all, some are stopped: the last one leaves what a clean build makes.
#[test]
fn builds_that_are_told_everything_leave_what_a_clean_build_makes() {
    let mut told = told();
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
            told.project.write(name, &text);
            pending.push(name);
        }
        let is_stopped = roll(4) == 0;
        if is_stopped {
            told.project.cancel.cancel();
        }
        told.build(if roll(10) == 0 { None } else { Some(&pending) });
        pending.clear();
        told.project.cancel = Cancel::default();
    }
    told.build(Some(&[]));
    let made = told.project.files("out");
    told.project.remove("out");
    told.project.remove(".specula");
    told.project.build();
    assert_eq!(made, told.project.files("out"));
}
