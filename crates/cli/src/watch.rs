//! `specula watch`: keeps the outputs up to date while files change.

use std::time::{Duration, Instant};

use engine::{BuildOptions, Cancel, Event, Kinds, ManifestFile, Wanted, WatchOptions};
use parking_lot::Mutex;

use crate::arguments::{JsonOutput, WatchArguments};
use crate::build::{exit_of, stop_on_interrupt};
use crate::command_error::CommandError;
use crate::exit::Exit;
use crate::print::EventStream;
use crate::remote_options::shared_cache_of_watcher;
use crate::screen::Screen;
use crate::watch_reporter::{Moment, WatchReporter};
use crate::{terminal, working_folder};

pub(crate) fn run(arguments: &WatchArguments, kinds: &Kinds) -> Exit {
    let cancel = Cancel::default();
    stop_on_interrupt(&cancel, || {});
    watch(arguments, kinds, &cancel, &Wanted::default(), &|_| {})
}

/// Watches until it is cancelled, and reports each event; `listener` gets it first. What is `wanted` goes
/// first.
pub(crate) fn watch(
    arguments: &WatchArguments,
    kinds: &Kinds,
    cancel: &Cancel,
    wanted: &Wanted,
    listener: &(dyn Fn(&Event) + Sync),
) -> Exit {
    let watching = &arguments.watching;
    let json = arguments.json.then_some(JsonOutput::Events);
    let shared = match shared_cache_of_watcher(&watching.remote, &arguments.manifest.manifest) {
        Ok(shared) => shared,
        Err(error) => return error.report(json),
    };
    let options = WatchOptions {
        build: BuildOptions {
            stages: arguments.stages.clone(),
            force: arguments.force,
            jobs: watching.jobs.map(usize::from),
            keep_going: true,
            keep_scratch: arguments.keep_scratch,
            wanted: wanted.clone(),
            shared,
            all_local: true,
            ..BuildOptions::default()
        },
        debounce: Duration::from_millis(watching.debounce),
        poll: watching.poll.map(Duration::from_millis),
        once: arguments.once,
        memory: watching.memory,
        cache_limit: watching.max_cache,
    };
    let start = Instant::now();
    let reporter = WatchReporter::new(watching.verbose, Screen::new(!arguments.json), move || Moment {
        milliseconds: start.elapsed().as_secs_f64() * 1e3,
        time: terminal::time_of_day(),
    });
    let stream = EventStream::default();
    // How the last build ended, and whether the manifest is valid.
    let last = Mutex::new((Exit::Success, true));
    let events = |event: Event| {
        listener(&event);
        match &event {
            Event::Ended(summary) => last.lock().0 = exit_of(summary),
            Event::BuildError { .. } => last.lock().0 = Exit::System,
            // From now on builds use the last valid manifest, which is not the one that was asked for.
            Event::Rejected { .. } => last.lock().1 = false,
            Event::Accepted => last.lock().1 = true,
            _ => {}
        }
        if arguments.json {
            stream.write(event);
            // Nobody would ever stop this process.
            if stream.reader_gone() {
                cancel.cancel();
            }
        } else {
            reporter.show(&event);
        }
    };
    let manifest = &arguments.manifest.manifest;
    let manifest =
        ManifestFile { name: working_folder::name(manifest), path: working_folder::path(manifest) };
    let result = engine::watch(&manifest, kinds, &options, cancel, &events);
    reporter.close();
    match result {
        Err(error) => CommandError::from(error).report(json),
        Ok(()) if stream.failed() => Exit::System,
        Ok(()) if !arguments.once => Exit::Success,
        Ok(()) if cancel.is_cancelled() => Exit::Interrupted,
        Ok(()) => match *last.lock() {
            (_, false) => Exit::Manifest,
            (exit, true) => exit,
        },
    }
}
