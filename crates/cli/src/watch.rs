//! `specula watch`: keeps the outputs fresh while files change.

use std::time::{Duration, Instant};

use engine::{BuildOptions, Cancel, Event, Kinds, WatchOptions};
use parking_lot::Mutex;

use crate::arguments::WatchArguments;
use crate::build::{exit_of, stop_on_interrupt};
use crate::print::EventStream;
use crate::screen::Screen;
use crate::session::{Moment, Session};
use crate::{Exit, exit, preview, terminal};

pub(crate) fn run(arguments: &WatchArguments, kinds: &Kinds) -> Exit {
    if arguments.preview {
        return preview::beside_watch(arguments, kinds);
    }
    let cancel = Cancel::default();
    stop_on_interrupt(&cancel, || {});
    keep_fresh(arguments, kinds, &cancel, &|_| {})
}

/// Watches until it is cancelled, and tells people or programs what happens; `also` hears it before them.
pub(crate) fn keep_fresh(
    arguments: &WatchArguments,
    kinds: &Kinds,
    cancel: &Cancel,
    also: &(dyn Fn(&Event) + Sync),
) -> Exit {
    let way = &arguments.way;
    let options = WatchOptions {
        build: BuildOptions {
            stages: arguments.stages.clone(),
            jobs: way.jobs.map(usize::from),
            keep_going: true,
            ..BuildOptions::default()
        },
        debounce: Duration::from_millis(way.debounce),
        poll: way.poll.map(Duration::from_millis),
        once: arguments.once,
        memory: way.memory,
        cache_limit: way.max_cache,
    };
    let start = Instant::now();
    let session = Session::new(way.verbose, Screen::new(!arguments.json), move || Moment {
        milliseconds: start.elapsed().as_secs_f64() * 1e3,
        time: terminal::time_of_day(),
    });
    let stream = EventStream::default();
    // How the last build ended, and whether the manifest is sound.
    let last = Mutex::new((Exit::Success, true));
    let events = |event: Event| {
        also(&event);
        match &event {
            Event::Ended(summary) => last.lock().0 = exit_of(summary),
            Event::BuildError { .. } => last.lock().0 = Exit::Machine,
            // What is built from now on is the last good graph, not what was asked for.
            Event::Rejected { .. } => last.lock().1 = false,
            Event::Accepted => last.lock().1 = true,
            _ => {}
        }
        if arguments.json {
            stream.write(event);
            // Nobody would ever end it.
            if stream.is_unheard() {
                cancel.cancel();
            }
        } else {
            session.tell(&event);
        }
    };
    let watched = engine::watch(&arguments.manifest.manifest, kinds, &options, cancel, &events);
    session.close();
    match watched {
        Err(error) => exit::of_error(&error),
        Ok(()) if stream.is_torn() => Exit::Machine,
        Ok(()) if !arguments.once => Exit::Success,
        Ok(()) if cancel.is_cancelled() => Exit::Interrupted,
        Ok(()) => match *last.lock() {
            (_, false) => Exit::Manifest,
            (exit, true) => exit,
        },
    }
}
