//! What a watcher does when files change as editors, exporters and version control change them.
//!
//! Each test watches a project, changes files as some program does, and waits until `out` has the right
//! content. Those in `each_way!` run twice: listening and polling.

mod editors;
mod folders;
mod loops;
mod loss;
mod manifests;
mod outputs;
mod reads;
mod retries;
mod running;
mod writing;

use std::fs::{self, File};
use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use parking_lot::{Condvar, Mutex};

use super::{CAPITALS, Project, TextKind, assert_has, log, remove_tree};
use crate::cancel::Cancel;
use crate::error::Error;
use crate::event::{Change, Changed, Event, Summary};
use crate::kinds::{Context, Failure};
use crate::plan::ManifestFile;
use crate::testkit::{Nothing, kinds};
use crate::watch::{Backoff, ChangeCollector, WatchOptions, Watcher};

const DEADLINE: Duration = Duration::from_secs(60);
/// Why a test is skipped.
const KEPT: &str = "this system does not remove a folder that is watched";
const QUIET: Duration = Duration::from_millis(20);
/// The first and the longest pause before another try: so short that tests need not wait.
const TRIES: [Duration; 2] = [Duration::from_millis(2), Duration::from_millis(20)];

/// Declares each test twice.
macro_rules! each_way {
    ($($(#[$meta:meta])* fn $name:ident($way:ident: Way) $body:block)*) => {
        mod listening { $($(#[$meta])* #[test] fn $name() { super::$name(super::Way::Listening) })* }
        mod polling { $($(#[$meta])* #[test] fn $name() { super::$name(super::Way::Polling) })* }
        $($(#[$meta])* fn $name($way: Way) $body)*
    };
}
use each_way;

#[derive(Clone, Copy, PartialEq)]
enum Way {
    Listening,
    Polling,
}

impl Way {
    fn options(self) -> WatchOptions {
        WatchOptions {
            build: crate::build::BuildOptions { jobs: Some(2), keep_going: true, ..Default::default() },
            debounce: QUIET,
            poll: (self == Way::Polling).then_some(Duration::from_millis(25)),
            once: false,
            memory: 1 << 20,
            cache_limit: None,
        }
    }
}

#[derive(Default)]
struct EventLog {
    events: Mutex<Vec<Event>>,
    changed: Condvar,
}

struct Watched<'a> {
    project: &'a Project,
    log: Arc<EventLog>,
    cancel: Cancel,
    thread: Option<JoinHandle<Result<(), Error>>>,
}

impl<'a> Watched<'a> {
    /// Starts a watcher, and waits until it watches.
    fn new(project: &'a Project, way: Way) -> Self {
        let watched = Self::start(project, way.options());
        watched.until_watching();
        watched
    }

    fn start(project: &'a Project, options: WatchOptions) -> Self {
        let collector = ChangeCollector::new(options.debounce, options.poll, Duration::from_millis(25));
        Self::with(project, options, collector)
    }

    fn with(project: &'a Project, options: WatchOptions, collector: ChangeCollector) -> Self {
        Self::trying(project, options, collector, TRIES)
    }

    /// A watcher with these pauses, the first and the longest, before what the system refused is tried again.
    fn trying(
        project: &'a Project,
        options: WatchOptions,
        collector: ChangeCollector,
        [first, longest]: [Duration; 2],
    ) -> Self {
        let (log, cancel) = (Arc::new(EventLog::default()), Cancel::default());
        let manifest = ManifestFile::of(&project.path("pipeline.toml"));
        let (writer, stop) = (Arc::clone(&log), cancel.clone());
        let thread = std::thread::spawn(move || {
            let events = |event| {
                writer.events.lock().push(event);
                writer.changed.notify_all();
            };
            let kinds = kinds()
                .with(running::WaitForFile)
                .with(retries::Refused)
                .with(writing::Sentence)
                .with(loops::Meddler);
            let mut watcher = Watcher::new(&manifest, &kinds, &options, &stop, &events, collector)?;
            watcher.retry = Backoff::new(first, longest);
            watcher.run()
        });
        Self { project, log, cancel, thread: Some(thread) }
    }

    /// Waits until the first build has ended and the watcher has said whether it listens or polls.
    fn until_watching(&self) {
        self.until("it watches", |events| {
            let watches = events.iter().any(|event| matches!(event, Event::Watching { .. }));
            watches && summaries(events).next().is_some()
        });
    }

    /// Waits until the events fulfil a condition.
    fn until(&self, what: &str, is_so: impl Fn(&[Event]) -> bool) {
        let deadline = Instant::now() + DEADLINE;
        let mut events = self.log.events.lock();
        while !is_so(&events) {
            let left = deadline.saturating_duration_since(Instant::now());
            assert!(!left.is_zero(), "waited for: {what}; the events were:\n{}", log(&events));
            self.log.changed.wait_for(&mut events, left);
        }
    }

    /// Waits until `out` has exactly these files with these texts and the build that made them has ended.
    fn until_out(&self, expected: &[(&str, &str)]) {
        let deadline = Instant::now() + DEADLINE;
        let mut expected =
            expected.iter().map(|(name, text)| ((*name).into(), (*text).into())).collect::<Vec<_>>();
        expected.sort();
        loop {
            let found = texts(self.project);
            if found == expected {
                return self.until("the build ends", |events| {
                    let last = |is: fn(&Event) -> bool| events.iter().rposition(is);
                    let ended = last(|event| matches!(event, Event::Ended(_)));
                    ended > last(|event| matches!(event, Event::Planned { .. }))
                });
            }
            let events = || log(&self.events());
            assert!(Instant::now() < deadline, "out has {found:?}, expected {expected:?}:\n{}", events());
            std::thread::sleep(Duration::from_millis(5));
        }
    }

    /// Waits until `out` has a file with this text.
    fn until_out_holds(&self, name: &str, text: &str) {
        self.until("the file", |_| texts(self.project).contains(&(name.into(), text.into())));
    }

    fn events(&self) -> Vec<Event> {
        self.log.events.lock().clone()
    }

    /// The changes that were reported, without repetitions.
    fn noticed(&self) -> Vec<(String, Changed)> {
        let mut changes = changes(&self.events()).collect::<Vec<_>>();
        changes.dedup();
        changes
    }

    /// Waits until the watcher ends by itself.
    fn ended(mut self) -> Result<(), Error> {
        let deadline = Instant::now() + DEADLINE;
        let thread = self.thread.take().unwrap();
        while !thread.is_finished() {
            assert!(Instant::now() < deadline, "it goes on; the events were:\n{}", log(&self.events()));
            std::thread::sleep(Duration::from_millis(5));
        }
        thread.join().unwrap()
    }
}

impl Drop for Watched<'_> {
    fn drop(&mut self) {
        self.cancel.cancel();
        if let Some(thread) = self.thread.take() {
            let ended = thread.join();
            if !std::thread::panicking() {
                ended.unwrap().unwrap();
            }
        }
    }
}

fn texts(project: &Project) -> Vec<(String, String)> {
    let files = project.files("out").into_iter();
    files.map(|(name, bytes)| (name, String::from_utf8_lossy(&bytes).into_owned())).collect()
}

fn changes(events: &[Event]) -> impl Iterator<Item = (String, Changed)> {
    let noticed = events.iter().filter_map(|event| match event {
        Event::Noticed { changes, .. } => Some(changes),
        _ => None,
    });
    noticed.flatten().map(|Change { path, what }| (path.clone(), *what))
}

fn summaries(events: &[Event]) -> impl Iterator<Item = &Summary> {
    events.iter().filter_map(|event| match event {
        Event::Ended(summary) => Some(summary),
        _ => None,
    })
}

fn capitals() -> Project {
    let project = Project::new(CAPITALS);
    project.write("in/sky.txt", "blue");
    project.write("in/gold.txt", "warm");
    project
}

fn set_modified(project: &Project, name: &str, time: std::time::SystemTime) {
    File::options().write(true).open(project.path(name)).unwrap().set_modified(time).unwrap();
}

/// Replaces a file in one step, so that it is never incomplete.
fn save(project: &Project, name: &str, text: &str) {
    let beside = format!("{name}.tmp");
    project.write(&beside, text);
    project.rename(&beside, name);
}

#[test]
fn only_the_first_build_of_a_watcher_is_forced() {
    let project = Project::new(CAPITALS);
    project.write("in/a.txt", "one");
    project.write("in/b.txt", "two");
    project.build();
    let mut options = Way::Listening.options();
    options.build.force = true;
    let watch = Watched::start(&project, options);
    watch.until_watching();
    let ran = |events: &[Event]| summaries(events).map(|summary| summary.ran).collect::<Vec<_>>();
    assert_eq!(ran(&watch.events())[0], 6);
    project.write("in/a.txt", "new");
    watch.until_out(&[("a.txt", "NEW"), ("b.txt", "TWO")]);
    assert!(ran(&watch.events())[1..].iter().sum::<usize>() == 3, "{}", log(&watch.events()));
}
