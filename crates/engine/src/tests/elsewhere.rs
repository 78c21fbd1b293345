//! Items that run on other machines, which are folders here.

use std::fmt::Write as _;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::time::Duration;

use expect_test::expect;
use parking_lot::Mutex;

use super::exported_files::Bodies;
use super::shared::{Memory, with_cache};
use super::{PROGRAM, Project, assert_has, log};
use crate::build::{BuildSession, run_item};
use crate::kinds::Kinds;
use crate::shared::{Executor, ExecutorOptions, RemoteEnd, RemoteError, RemoteRun, SharedBlob};
use crate::testkit::kinds;

/// A machine that has nothing but what it is sent.
struct Worker {
    memory: Arc<Memory>,
    kinds: Kinds,
    runs: AtomicUsize,
    /// The files of each run.
    sent: Mutex<Vec<Vec<String>>>,
    fault: Fault,
    has_told: AtomicBool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Fault {
    None,
    /// The worker cannot run the program.
    NoProgram,
    /// The worker says that failures are known from before.
    KnownFailures,
    /// The worker does not keep what was made.
    Forgets,
    /// The run never ends.
    Hangs,
    /// The server of the worker does not answer.
    Gone,
}

impl std::fmt::Debug for Worker {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Worker")
    }
}

impl Executor for Worker {
    fn host(&self) -> String {
        "cluster".into()
    }

    fn is_available(&self) -> bool {
        self.fault != Fault::Gone
    }

    fn trouble(&self) -> Option<String> {
        (self.fault == Fault::Gone && !self.has_told.swap(true, Ordering::Relaxed))
            .then(|| "it is gone".into())
    }

    fn blob(&self, bytes: &[u8]) -> SharedBlob {
        Memory::name(bytes)
    }

    fn run(&self, run: &RemoteRun<'_>, stop: &dyn Fn() -> bool) -> Result<RemoteEnd, RemoteError> {
        if stop() {
            return Err(RemoteError::Stopped);
        }
        self.runs.fetch_add(1, Ordering::Relaxed);
        if self.fault == Fault::Hangs {
            while !stop() {
                std::thread::sleep(Duration::from_millis(1));
            }
            return Err(RemoteError::Stopped);
        }
        if self.fault == Fault::NoProgram {
            let message = "libc.so.6: version GLIBC_9.9 not found".into();
            let outputs = vec![None; run.outputs.len()];
            return Ok(RemoteEnd { exit_code: 127, message, outputs, ..RemoteEnd::default() });
        }
        let folder = tempfile::tempdir().unwrap();
        let mut names = Vec::new();
        for (index, file) in run.files.iter().enumerate() {
            let bytes = self.memory.bytes(file.blob).or_else(|| (run.read)(index));
            let bytes = bytes.ok_or(RemoteError::InputGone(index))?;
            assert_eq!(Memory::name(&bytes), file.blob);
            self.memory.keep(&bytes);
            let place = folder.path().join(&file.path);
            std::fs::create_dir_all(place.parent().unwrap()).unwrap();
            std::fs::write(place, bytes).unwrap();
            names.push(file.path.clone());
        }
        self.sent.lock().push(names);
        assert_eq!(run.arguments, ["run-item", "item.json"]);
        let failed = run_item(folder.path(), &self.kinds).unwrap();
        let outputs = run.outputs.iter().map(|output| {
            let bytes = std::fs::read(folder.path().join(output)).ok()?;
            let is_kept = self.fault != Fault::Forgets || output.ends_with(".json");
            is_kept.then(|| self.memory.keep(&bytes)).or(Some(Memory::name(&bytes)))
        });
        let is_known = self.fault == Fault::KnownFailures && failed.is_some() && !run.is_fresh;
        Ok(RemoteEnd {
            outputs: outputs.collect(),
            exit_code: i32::from(failed.is_some()),
            worker: "rack 7".into(),
            is_known,
            ..RemoteEnd::default()
        })
    }
}

const MANIFEST: &str = r#"
schema = 1
[stage]
text = { kind = "text-source", source = "texts/*.txt" }
loud = { kind = "upper", input = "text" }
marked = { kind = "suffix", input = "loud", text = "!" }
file = { kind = "write", input = "marked", path = "{text}" }
"#;

fn project(fault: Fault) -> (Project, Arc<Worker>) {
    project_of(MANIFEST, kinds(), fault)
}

fn project_of(manifest: &str, kinds: Kinds, fault: Fault) -> (Project, Arc<Worker>) {
    let memory = Arc::<Memory>::default();
    let mut project = with_cache(&memory, manifest);
    project.kinds = kinds.clone();
    let worker = Arc::new(Worker {
        memory,
        kinds,
        runs: AtomicUsize::new(0),
        sent: Mutex::default(),
        fault,
        has_told: AtomicBool::new(false),
    });
    let executor = Arc::clone(&worker) as Arc<dyn Executor>;
    let options = ExecutorOptions { executor, jobs: 1, most_bytes: 1000 };
    project.options.shared.as_mut().unwrap().executor = Some(options);
    project.write("texts/a.txt", "light");
    (project, worker)
}

#[test]
fn items_run_elsewhere_and_only_their_files_come_back() {
    let (project, worker) = project(Fault::None);
    expect![[r"
        planned 4 stages, 4 items
        run text [a] at cluster: never built
        ran text [a]
        run loud [a] at cluster: never built
        ran loud [a]
        run marked [a] at cluster: never built
        ran marked [a]
        run file [a] at cluster: never built
        ran file [a]
        published a.txt 6
        ended: 4 ran, 0 up to date, 0 failed, 0 skipped, 1 published, 0 removed
    "]]
    .assert_eq(&project.build());
    assert_eq!(project.read("out/a.txt"), "LIGHT!");
    assert!(!project.blob("LIGHT").exists(), "nobody here needs it");
    expect![[r#"
        item.json files/texts/a.txt
        item.json artifacts
        item.json artifacts
        item.json artifacts
    "#]]
    .assert_eq(&worker.sent.lock().iter().fold(String::new(), |mut text, names| {
        let short = names.iter().map(|name| if name.starts_with("artifacts/") { "artifacts" } else { name });
        let _ = writeln!(text, "{}", short.collect::<Vec<_>>().join(" "));
        text
    }));
    expect![[r"
        planned 4 stages, 4 items
        up to date text [a]
        up to date loud [a]
        up to date marked [a]
        up to date file [a]
        ended: 0 ran, 4 up to date, 0 failed, 0 skipped, 0 published, 0 removed
    "]]
    .assert_eq(&project.build());
    let last = project.explain("file [a]").remove(0).last.unwrap();
    let place = serde_json::to_string(&last.place).unwrap();
    assert_eq!(place, r#"{"worker":{"host":"cluster","name":"rack 7"}}"#);
}

#[test]
fn an_exported_file_is_sent_with_the_item_that_reads_it() {
    let manifest = r#"
schema = 1
[stage]
text = { kind = "text-source", source = "texts/*.txt" }
pair = { kind = "write-pair", input = "text" }
bodies = { kind = "bodies", input = "pair" }
"#;
    let (project, _) = project_of(manifest, kinds().with(Bodies), Fault::None);
    project.write("texts/b.txt", "");
    assert_has(project.build(), ["run bodies at cluster: never built\n", "5 ran"]);
    assert_eq!(project.read("out/bodies.txt"), "a: light\n", "an empty text has no body");
    // Other bytes of the same number.
    project.write("texts/a.txt", "sound");
    assert_has(project.build(), ["run bodies at cluster: body pair [a]"]);
    assert_eq!(project.read("out/bodies.txt"), "a: sound\n");
}

#[test]
fn results_are_those_of_this_machine() {
    let (there, _) = project(Fault::None);
    there.build();
    let here = with_cache(&Arc::default(), MANIFEST);
    here.write("texts/a.txt", "light");
    here.build();
    assert_eq!(there.files("out"), here.files("out"));
    let digests = |project: &Project| project.explain("marked [a]").remove(0).last.unwrap().results;
    assert_eq!(digests(&there), digests(&here));
}

#[test]
fn files_that_an_item_names_while_it_runs_are_sent_with_it_again() {
    let (project, worker) = project(Fault::None);
    project.write("texts/a.txt", "include ../more/b\ninclude c\n");
    project.write("more/b", "one ");
    project.write("texts/c", "two");
    project.build();
    assert_eq!(project.read("out/a.txt"), "ONE TWO!");
    let sent = worker.sent.lock().iter().take(3).map(Vec::len).collect::<Vec<_>>();
    assert_eq!(sent, [2, 3, 4]);
    let reads = project.explain("text [a]").remove(0).last.unwrap().reads;
    let names = reads.iter().map(|read| read.path.as_str()).collect::<Vec<_>>();
    assert_eq!(names, ["texts/a.txt", "texts/a.txt", "texts/../more/b", "texts/c"]);

    // Now they are expected, and a change of one is seen.
    worker.sent.lock().clear();
    project.write("texts/c", "three");
    assert!(project.build().contains("run text [a] at cluster: file texts/c"));
    assert_eq!(worker.sent.lock()[0].len(), 4);
    assert_eq!(project.read("out/a.txt"), "ONE THREE!");
}

#[test]
fn a_program_that_is_found_at_the_same_place_there_is_that_of_this_machine() {
    let (project, worker) = project(Fault::None);
    project.write("texts/a.txt", &format!("program {PROGRAM}\n"));
    assert_has(project.build(), ["run text [a] at cluster"]);
    assert_eq!(project.read("out/a.txt"), "FOUND!");
    assert_eq!(worker.sent.lock()[0], ["item.json", "files/texts/a.txt"], "programs are not sent");
    assert!(project.build().contains("0 ran"));
    let reads = project.explain("text [a]").remove(0).last.unwrap().reads;
    let read = reads.iter().find(|read| read.kind == crate::ReadKind::Lookup).unwrap();
    let found = read.found.as_deref().unwrap();
    assert!(read.path == PROGRAM && found.rsplit('/').next().unwrap().starts_with(PROGRAM), "{read:?}");
}

#[test]
fn a_file_of_somebody_else_is_not_sent() {
    let (project, worker) = project(Fault::None);
    let other = tempfile::NamedTempFile::new().unwrap();
    std::fs::write(other.path(), "secret").unwrap();
    project.write("texts/a.txt", &format!("include {}\n", other.path().display()));
    project.build();
    assert_eq!(project.read("out/a.txt"), "SECRET!", "it runs here instead");
    assert!(worker.sent.lock().iter().flatten().all(|name| !name.starts_with("elsewhere")));
    let last = project.explain("text [a]").remove(0).last.unwrap();
    let place = serde_json::to_string(&last.place).unwrap();
    assert_eq!(place, r#"{"here":{"because":"it reads files outside the project"}}"#);
}

#[test]
fn large_files_are_read_here() {
    let (project, _) = project(Fault::None);
    project.write("texts/a.txt", &"x".repeat(1001));
    let log = project.build();
    assert_has(&log, ["run text [a]: never built\n", "run loud [a] at cluster: never built\n"]);
}

#[test]
fn a_failure_names_its_machine_and_its_file() {
    for fault in [Fault::None, Fault::KnownFailures] {
        let (project, worker) = project(fault);
        std::fs::write(project.path("texts/a.txt"), b"\xff").unwrap();
        let (events, _) = project.try_build();
        let log = log(&events);
        let expected = "FAILED text [a]: source texts/a.txt: on rack 7 of cluster: invalid utf-8 sequence";
        assert_has(&log, [expected]);
        // What is known of a failure is not believed.
        assert_eq!(worker.runs.load(Ordering::Relaxed), if fault == Fault::None { 1 } else { 2 });
    }
}

#[test]
fn what_cannot_run_there_runs_here_and_is_said_once() {
    for fault in [Fault::NoProgram, Fault::Forgets, Fault::Gone] {
        let (project, _) = project(fault);
        let log = project.build();
        assert_eq!(project.read("out/a.txt"), "LIGHT!", "{log}");
        let told = usize::from(fault != Fault::Forgets);
        assert_eq!(log.matches("trouble at cluster").count(), told, "{fault:?}: {log}");
        assert!(log.contains("ended: 4 ran, 0 up to date, 0 failed"), "{fault:?}: {log}");
    }
    for (fault, expected) in [(Fault::NoProgram, "GLIBC_9.9"), (Fault::Gone, "it is gone")] {
        let (mut project, _) = project(fault);
        project.options.shared.as_mut().unwrap().is_required = true;
        let error = project.try_build().1.unwrap_err();
        assert!(error.to_string().contains(expected), "{error}");
    }
}

#[test]
fn a_result_that_was_made_elsewhere_is_in_the_cache_for_others() {
    let (project, worker) = project(Fault::None);
    project.build();
    let other = with_cache(&worker.memory, MANIFEST);
    other.write("texts/a.txt", "light");
    assert_has(other.build(), ["ended: 0 ran, 4 up to date"]);
    assert_eq!(other.files("out"), project.files("out"));
}

#[test]
fn an_edit_makes_a_run_elsewhere_stale() {
    let (project, worker) = project(Fault::Hangs);
    let session = BuildSession::new(Some(1), 0).unwrap();
    let plan = project.plan();
    let summary = std::thread::scope(|scope| {
        let build = scope.spawn(|| session.build(&plan, &project.options, &project.cancel, &|_| {}));
        while worker.runs.load(Ordering::Relaxed) == 0 {
            std::thread::sleep(Duration::from_millis(1));
        }
        // Of no concern to the item.
        project.write("texts/other", "dark");
        session.outdate(&[project.path("texts/other")], None);
        std::thread::sleep(Duration::from_millis(50));
        assert!(!build.is_finished());
        project.write("texts/a.txt", "dark");
        session.outdate(&[project.path("texts/a.txt")], None);
        build.join().unwrap().unwrap()
    });
    assert!(summary.cancelled && summary.ran == 0, "{summary:?}");
}

#[test]
fn a_cancelled_build_stops_what_runs_elsewhere() {
    let (project, worker) = project(Fault::None);
    project.cancel.cancel();
    let summary = project.try_build().1.unwrap();
    assert!(summary.cancelled);
    assert_eq!(worker.runs.load(Ordering::Relaxed), 0);
}
