//! Builds that a change makes out of date while they run.

use std::collections::{BTreeMap, BTreeSet};
use std::time::{Duration, Instant};

use parking_lot::{Condvar, Mutex, MutexGuard};

use super::*;
use crate::build::BuildSession;
use crate::event::ItemName;
use crate::key::ItemKey;
use crate::parameters;

/// A place where running items wait until they are let through or stopped.
struct Gate {
    /// The items that have arrived, and those that may pass, each with the project's folder: tests run in
    /// parallel.
    state: Mutex<(BTreeSet<String>, BTreeSet<String>)>,
    changed: Condvar,
}

static GATE: Gate = Gate { state: Mutex::new((BTreeSet::new(), BTreeSet::new())), changed: Condvar::new() };

/// Nothing here takes this long: a test that hangs fails.
const LONG: Duration = Duration::from_secs(120);

impl Gate {
    fn pass(&self, name: &str, is_stopped: impl Fn() -> Result<(), Failure>) -> Result<(), Failure> {
        let clock = Instant::now();
        let mut state = self.state.lock();
        state.0.insert(name.into());
        self.changed.notify_all();
        while !state.1.contains(name) {
            // An item may pause there, and others pass this gate meanwhile.
            MutexGuard::unlocked(&mut state, &is_stopped)?;
            if clock.elapsed() > LONG {
                return Err(Failure::new(format!("nobody let {name} through")));
            }
            self.changed.wait_for(&mut state, Duration::from_millis(1));
        }
        Ok(())
    }

    fn await_arrival(&self, name: &str) {
        let mut state = self.state.lock();
        let waited = self.changed.wait_while_for(&mut state, |state| !state.0.contains(name), LONG);
        assert!(!waited.timed_out(), "{name} did not come");
    }

    fn open(&self, name: &str) {
        self.state.lock().1.insert(name.into());
        self.changed.notify_all();
    }
}

/// Reads its source, then waits at the gate of that path.
struct SlowSource;

impl TextKind for SlowSource {
    type Parameters = Nothing;
    const NAME: &'static str = "slow-source";
    const SOURCE: bool = true;

    fn make(_: &Nothing, text: &str, context: &Context<'_>) -> Result<String, Failure> {
        let gate = test_data::unix_paths(path_text(context.files.source()?));
        if text == "bad" {
            // It ignores the request to stop, and fails in the end.
            GATE.pass(&gate, || Ok(()))?;
            return Err(Failure::new("half a text"));
        }
        GATE.pass(&gate, || context.reporter.check_cancelled())?;
        Ok(text.into())
    }
}

parameters! {
    /// Parameters of `slow-suffix`.
    struct SuffixParameters {
        /// What is added.
        text: String,
        /// The gate, with a slash and the text that arrives.
        gate: String,
    }
}

/// Waits at a gate, then adds to a text.
struct SlowSuffix;

impl TextKind for SlowSuffix {
    type Parameters = SuffixParameters;
    const NAME: &'static str = "slow-suffix";

    fn make(parameters: &SuffixParameters, text: &str, context: &Context<'_>) -> Result<String, Failure> {
        GATE.pass(&format!("{}/{text}", parameters.gate), || context.reporter.check_cancelled())?;
        Ok(format!("{text}{}", parameters.text))
    }
}

impl Project {
    /// A project with the kinds that wait, built by two threads.
    fn slow(manifest: &str) -> Self {
        let mut project = Project::new(manifest);
        project.edit("GATE", &project.unix_path("gate"));
        project.kinds = kinds().with(SlowSource).with(SlowSuffix);
        project.options.jobs = Some(2);
        project
    }

    /// Builds, and does something meanwhile. Returns the events as sorted lines, and the summary.
    fn build_and(&self, meanwhile: impl FnOnce(&BuildSession)) -> (BTreeSet<String>, Summary) {
        let session = BuildSession::new(self.options.jobs, 0).unwrap();
        let events = Mutex::new(Vec::new());
        let report = |event| events.lock().push(event);
        let summary = std::thread::scope(|scope| {
            let build =
                scope.spawn(|| session.build(&self.plan(), &self.options, &self.cancel, &report).unwrap());
            meanwhile(&session);
            build.join().unwrap()
        });
        (log(&events.into_inner()).lines().map(str::to_owned).collect(), summary)
    }

    fn gate(&self, name: &str) -> String {
        self.unix_path(name)
    }
}

const SOURCES: &str = r#"
# GATE
schema = 1
[stage]
text = { kind = "slow-source", source = "*.txt" }
file = { kind = "write", input = "text" }
"#;

fn sources() -> Project {
    let project = Project::slow(SOURCES);
    for (name, text) in [("a.txt", "one"), ("b.txt", "two"), ("c.txt", "three")] {
        project.write(name, text);
    }
    project
}

#[test]
fn an_edit_stops_the_item_that_read_it_and_not_its_neighbour() {
    let project = sources();
    let (a, b, c) = (project.gate("a.txt"), project.gate("b.txt"), project.gate("c.txt"));
    let (log, summary) = project.build_and(|session| {
        GATE.await_arrival(&a);
        GATE.await_arrival(&b);
        // No item has read it yet, so this is not a reason to stop.
        project.write("c.txt", "four");
        session.outdate(&[project.path("c.txt")], None);
        project.write("a.txt", "bad");
        session.outdate(&[project.path("a.txt")], Some(&project.plan()));
        GATE.open(&b);
    });
    assert!(log.contains("skipped text [a]") && log.contains("ran text [b]"), "{log:?}");
    assert_eq!((summary.ran, summary.failed, summary.skipped, summary.cancelled), (1, 0, 5, true));
    assert!(!project.cancel.is_cancelled());
    assert!(project.explain("text")[0].last.is_none(), "what was interrupted is not remembered");
    assert!(!project.blob("one").exists() && project.blob("two").exists());

    project.write("a.txt", "six");
    GATE.open(&a);
    GATE.open(&c);
    let (log, summary) = project.build_and(|_| {});
    assert!(log.contains("up to date text [b]"), "{log:?}");
    assert_eq!((summary.ran, summary.up_to_date, summary.cancelled), (5, 1, false));
    let texts = ["a", "b", "c"].map(|name| project.read(&format!("out/file/{name}.txt")));
    assert_eq!(texts, ["six", "two", "four"]);
}

#[test]
fn a_touch_without_change_stops_nothing() {
    let project = sources();
    let gates = ["a.txt", "b.txt", "c.txt"].map(|name| project.gate(name));
    let (_, summary) = project.build_and(|session| {
        GATE.await_arrival(&gates[0]);
        GATE.await_arrival(&gates[1]);
        project.write("a.txt", "one");
        // The file, its folder, and the manifest, from which the same plan is made.
        let paths = ["a.txt", "", "pipeline.toml", "../x"].map(|name| project.path(name));
        session.outdate(&paths, Some(&project.plan()));
        gates.iter().for_each(|gate| GATE.open(gate));
    });
    assert_eq!((summary.ran, summary.skipped, summary.cancelled), (6, 0, false));
}

#[test]
fn an_unusable_file_that_is_still_being_written_is_not_a_failure() {
    let project = sources();
    project.write("a.txt", "bad");
    let gates = ["a.txt", "b.txt", "c.txt"].map(|name| project.gate(name));
    let (log, summary) = project.build_and(|session| {
        GATE.await_arrival(&gates[0]);
        project.write("a.txt", "bad luck");
        session.outdate(&[project.path("a.txt")], None);
        gates.iter().for_each(|gate| GATE.open(gate));
    });
    assert!(log.contains("skipped text [a]"), "{log:?}");
    assert_eq!((summary.failed, summary.cancelled), (0, true));
    assert!(project.explain("text")[0].last.is_none());
    assert_eq!(project.build_and(|_| {}).1.failed, 0);
    assert_eq!(project.read("out/file/a.txt"), "bad luck");
}

/// The items of these texts.
fn items(stage: &str, names: &[&str]) -> Vec<ItemName> {
    let name = |name: &&str| ItemName { stage: stage.into(), key: ItemKey::from_iter([("text", *name)]) };
    names.iter().map(name).collect()
}

#[test]
fn what_is_wanted_runs_although_every_thread_is_busy() {
    let project = sources();
    let gates = ["a.txt", "b.txt", "c.txt"].map(|name| project.gate(name));
    let (log, summary) = project.build_and(|_| {
        GATE.await_arrival(&gates[0]);
        GATE.await_arrival(&gates[1]);
        project.options.wanted.set(items("file", &["c"]));
        GATE.await_arrival(&gates[2]);
        GATE.open(&gates[2]);
        let clock = Instant::now();
        while !project.exists("out/file/c.txt") {
            assert!(clock.elapsed() < LONG, "c is not published");
            std::thread::sleep(Duration::from_millis(1));
        }
        assert!(!project.exists("out/file/a.txt") && !project.exists("out/file/b.txt"));
        gates.iter().for_each(|gate| GATE.open(gate));
    });
    assert_eq!((summary.ran, summary.skipped, summary.cancelled), (6, 0, false), "{log:?}");
}

#[test]
fn an_edit_of_what_is_wanted_stops_everything_else() {
    let project = sources();
    let gates = ["a.txt", "b.txt", "c.txt"].map(|name| project.gate(name));
    let (log, summary) = project.build_and(|session| {
        GATE.await_arrival(&gates[0]);
        GATE.await_arrival(&gates[1]);
        project.options.wanted.set(items("file", &["a"]));
        project.write("a.txt", "four");
        session.outdate(&[project.path("a.txt")], None);
    });
    assert!(log.contains("skipped text [a]") && log.contains("skipped text [b]"), "{log:?}");
    assert_eq!((summary.ran, summary.cancelled), (0, true));
    gates.iter().for_each(|gate| GATE.open(gate));
    assert_eq!(project.build_and(|_| {}).1.ran, 6);
    assert_eq!(project.read("out/file/a.txt"), "four");
}

#[test]
fn what_is_wanted_goes_first() {
    let mut project = sources();
    ["a.txt", "b.txt", "c.txt"].iter().for_each(|name| GATE.open(&project.gate(name)));
    project.options.jobs = Some(1);
    let first = |project: &Project, words: &str| {
        let (events, summary) = project.try_build();
        summary.unwrap();
        log(&events).lines().position(|line| line == words).unwrap()
    };
    project.options.wanted.set(items("file", &["b"]));
    let wanted = first(&project, "ran file [b]");
    assert!(wanted < 6, "{wanted}");
    project.remove(".specula");
    project.options.wanted.set(Vec::new());
    assert!(first(&project, "ran file [b]") > wanted);
}

const CHAINS: &str = r#"
schema = 1
[stage]
text = { kind = "text-source", source = "*.txt" }
left = { kind = "slow-suffix", input = "text", text = "<", gate = "GATE left" }
right = { kind = "slow-suffix", input = "text", text = ">", gate = "GATE right" }
file = { kind = "write", input = "left" }
"#;

/// One source, and two items that use it at the same time.
fn chains() -> (Project, String, String) {
    let project = Project::slow(&CHAINS.replace("GATE right", "right GATE"));
    project.write("a.txt", "one");
    let gate = project.gate("gate");
    (project, format!("{gate} left/one"), format!("right {gate}/one"))
}

#[test]
fn an_edited_parameter_stops_its_stage_and_those_after_it() {
    let (project, left, right) = chains();
    let (log, summary) = project.build_and(|session| {
        GATE.await_arrival(&left);
        GATE.await_arrival(&right);
        project.edit("text = \"<\"", "text = \"[\"");
        session.outdate(&[project.path("pipeline.toml")], Some(&project.plan()));
        GATE.open(&right);
    });
    assert!(log.contains("skipped left [a]") && log.contains("ran right [a]"), "{log:?}");
    assert!(log.contains("skipped file [a]"), "{log:?}");
    assert_eq!((summary.ran, summary.skipped, summary.cancelled), (2, 2, true));
    GATE.open(&left);
    let (_, summary) = project.build_and(|_| {});
    assert_eq!((summary.ran, summary.up_to_date), (2, 2));
    assert_eq!(project.read("out/file/a.txt"), "one[");
}

#[test]
fn an_edit_of_what_was_up_to_date_stops_what_follows_from_it() {
    let (project, left, right) = chains();
    GATE.open(&left);
    GATE.open(&right);
    assert_eq!(project.build_and(|_| {}).1.ran, 4);
    project.edit("\">\"", "\"}\"");
    project.edit("\"right ", "\"again ");
    let again = right.replace("right", "again");
    let (log, summary) = project.build_and(|session| {
        GATE.await_arrival(&again);
        project.write("a.txt", "two");
        session.outdate(&[project.path("a.txt")], None);
    });
    assert!(log.contains("skipped right [a]") && log.contains("up to date text [a]"), "{log:?}");
    assert!(summary.cancelled);
    GATE.open(&left.replace("one", "two"));
    GATE.open(&again.replace("one", "two"));
    assert_eq!(project.build_and(|_| {}).1.ran, 4);
    assert_eq!(project.read("out/file/a.txt"), "two<");
}

#[test]
fn a_new_file_ends_the_build_early_and_stops_no_running_item() {
    let (project, left, right) = chains();
    let (_, summary) = project.build_and(|session| {
        GATE.await_arrival(&left);
        GATE.await_arrival(&right);
        project.write("b.txt", "two");
        session.outdate(&[project.path("b.txt")], Some(&project.plan()));
        GATE.open(&left);
        GATE.open(&right);
    });
    // Running items finish; the export does not start.
    assert_eq!((summary.ran, summary.skipped, summary.cancelled), (3, 1, true));
}

parameters! {
    /// Parameters of `restless`.
    struct RestlessParameters {
        /// The number of runs in which the source is written while it is read.
        writes: usize,
    }
}

/// Reads its source twice; another program (in fact the kind itself) may write it in between.
struct Restless;

/// The runs of `restless`, by source.
static RUNS: Mutex<BTreeMap<PathBuf, usize>> = Mutex::new(BTreeMap::new());

impl Kind for Restless {
    type Parameters = RestlessParameters;
    const NAME: &'static str = "restless";
    const REVISION: u32 = 1;
    const TEXT: &'static str = "//! Reads a text twice.\n";
    const SOURCE: bool = true;

    fn ports() -> Vec<Port> {
        Vec::new()
    }

    fn product(_: &RestlessParameters, _: &[(&str, &'static str)]) -> Product {
        Product::Files(vec![".txt".into()])
    }

    fn run(parameters: &RestlessParameters, context: &Context<'_>) -> Result<Output, Failure> {
        let source = context.files.source()?;
        let run = *RUNS.lock().entry(source.into()).and_modify(|runs| *runs += 1).or_insert(1);
        let first = context.files.read(source)?;
        if run <= parameters.writes {
            std::fs::write(source, format!("text {run}"))?;
        }
        let second = context.files.read(source)?;
        Ok(Output::files(vec![[&first[..], b", ", &second[..]].concat()]))
    }
}

#[test]
fn an_item_that_read_two_contents_of_a_file_runs_again() {
    let manifest = "schema = 1\n[stage]\nfile = { kind = \"restless\", source = \"a.txt\", writes = 2 }\n";
    let mut project = Project::new(manifest);
    project.kinds = Kinds::new().with(Restless);
    project.write("a.txt", "text 0");
    assert!(project.build().contains("1 ran, 0 up to date, 0 failed"));
    assert_eq!(project.read("out/file/a.txt"), "text 2, text 2");
    assert!(project.build().contains("0 ran, 1 up to date"));

    project.edit("writes = 2", "writes = 1000");
    for _ in 0..2 {
        let runs = RUNS.lock()[&project.path("a.txt")];
        let log = project.build();
        let path = project.unix_path("a.txt");
        let failed = format!(
            "FAILED file [a]: source a.txt: {path} changed every time it was read (build again when it is \
             complete)"
        );
        assert_has(&log, [&failed]);
        assert_eq!(RUNS.lock()[&project.path("a.txt")], runs + 3);
        assert_eq!(project.read("out/file/a.txt"), "text 2, text 2", "the last good file stays");
    }
}
