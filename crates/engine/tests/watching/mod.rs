//! A watcher in a thread of its own, its events, and the files around it.

#![allow(dead_code, reason = "each test file uses its own part")]

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use engine::{BuildOptions, Cancel, Error, Event, Kinds, Plan, Summary, WatchOptions};

pub(crate) const TIMEOUT: Duration = Duration::from_secs(60);

pub(crate) struct Watcher {
    cancel: Cancel,
    thread: Option<JoinHandle<Result<(), Error>>>,
    events: Receiver<Event>,
    /// The last events, for messages of tests that fail.
    recent: Vec<Event>,
}

impl Watcher {
    /// Watches a manifest, with a minimal debounce so that tests are quick.
    pub(crate) fn start(manifest: PathBuf, kinds: Kinds, poll: Option<Duration>, memory: u64) -> Self {
        let (sender, events) = channel();
        let cancel = Cancel::default();
        let thread = {
            let cancel = cancel.clone();
            std::thread::spawn(move || {
                let options = WatchOptions {
                    build: BuildOptions { jobs: Some(2), keep_going: true, ..BuildOptions::default() },
                    debounce: Duration::from_millis(2),
                    poll,
                    once: false,
                    memory,
                    cache_limit: None,
                };
                engine::watch(&engine::ManifestFile::of(&manifest), &kinds, &options, &cancel, &|event| {
                    _ = sender.send(event)
                })
            })
        };
        Self { cancel, thread: Some(thread), events, recent: Vec::new() }
    }

    /// The next event, if one comes in time.
    pub(crate) fn next(&mut self, within: Duration) -> Option<Event> {
        let event = self.events.recv_timeout(within).ok()?;
        if self.recent.len() == 400 {
            self.recent.drain(..200);
        }
        self.recent.push(event.clone());
        Some(event)
    }

    pub(crate) fn wait(&mut self, what: &str, wanted: impl Fn(&Event) -> bool) -> Event {
        let deadline = Instant::now() + TIMEOUT;
        while let Some(event) = self.next(deadline.saturating_duration_since(Instant::now())) {
            if wanted(&event) {
                return event;
            }
        }
        panic!("no {what} came within {TIMEOUT:?}; the last events were\n{}", self.log());
    }

    /// Waits for the end of a build that was not stopped.
    pub(crate) fn wait_for_build(&mut self) -> Summary {
        match self.wait("end of a build", |event| matches!(event, Event::Ended(end) if !end.cancelled)) {
            Event::Ended(summary) => summary,
            other => panic!("{other:?} is not an end"),
        }
    }

    /// The last events, a line each.
    pub(crate) fn log(&self) -> String {
        let events = self.recent.iter().filter(|event| !matches!(event, Event::UpToDate { .. }));
        events.map(|event| format!("{event:?}\n")).collect()
    }

    /// Stops the watcher as Ctrl-C does.
    pub(crate) fn stop(mut self) {
        self.cancel.cancel();
        if let Some(thread) = self.thread.take() {
            thread.join().unwrap().unwrap();
        }
    }
}

impl Drop for Watcher {
    fn drop(&mut self) {
        self.cancel.cancel();
    }
}

/// Every file below a folder, by its path there, except those that are removed meanwhile.
pub(crate) fn files_below(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let (mut found, mut open) = (BTreeMap::new(), vec![folder.to_path_buf()]);
    while let Some(next) = open.pop() {
        for entry in fs::read_dir(&next).into_iter().flatten().flatten() {
            let path = entry.path();
            if path.is_dir() {
                open.push(path);
            } else if let Ok(bytes) = fs::read(&path) {
                found.insert(path.strip_prefix(folder).unwrap().to_path_buf(), bytes);
            }
        }
    }
    found
}

/// The summary and the files of a build of the project in an empty folder.
pub(crate) fn clean_build(project: &Path, kinds: &Kinds) -> (Summary, BTreeMap<PathBuf, Vec<u8>>) {
    let copy = tempfile::tempdir().unwrap();
    copy_sources(project, copy.path());
    let plan = Plan::load(&copy.path().join("pipeline.toml"), kinds).unwrap();
    let options = BuildOptions { jobs: Some(2), keep_going: true, ..BuildOptions::default() };
    let summary = engine::build(&plan, &options, &Cancel::default(), &|_| ()).unwrap();
    (summary, files_below(&copy.path().join("out")))
}

/// Copies a project without what builds made of it.
pub(crate) fn copy_sources(from: &Path, to: &Path) {
    fs::create_dir_all(to).unwrap();
    for entry in fs::read_dir(from).unwrap() {
        let entry = entry.unwrap();
        let (source, target) = (entry.path(), to.join(entry.file_name()));
        let kind = entry.file_type().unwrap();
        // The watcher's probes come and go.
        let name = entry.file_name();
        if name == "out" || name.to_string_lossy().starts_with(".specula") {
            continue;
        } else if kind.is_dir() {
            copy_sources(&source, &target);
        } else if kind.is_symlink() {
            #[cfg(unix)]
            std::os::unix::fs::symlink(fs::read_link(&source).unwrap(), target).unwrap();
        } else {
            fs::copy(source, target).unwrap();
        }
    }
}

/// Random numbers from a seed: splitmix64.
pub(crate) struct Random(pub(crate) u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    pub(crate) fn below(&mut self, bound: usize) -> usize {
        (self.next() % bound as u64) as usize
    }

    pub(crate) fn one_of<'a, T>(&mut self, things: &'a [T]) -> &'a T {
        &things[self.below(things.len())]
    }
}
