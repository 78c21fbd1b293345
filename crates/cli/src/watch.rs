//! `specula watch`: keeps the outputs fresh while files change.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use engine::{BuildOptions, Cancel, Event, Kinds, WatchOptions};

use crate::arguments::WatchArguments;
use crate::build::{exit_of, stop_on_interrupt};
use crate::screen::Screen;
use crate::session::{Moment, Session};
use crate::{Exit, exit, print, terminal};

pub(crate) fn run(arguments: &WatchArguments, kinds: &Kinds) -> Exit {
    let options = WatchOptions {
        build: BuildOptions {
            stages: arguments.stages.clone(),
            jobs: arguments.jobs.map(usize::from),
            keep_going: true,
            ..BuildOptions::default()
        },
        debounce: Duration::from_millis(arguments.debounce),
        poll: arguments.poll.map(Duration::from_millis),
        once: arguments.once,
        memory: arguments.memory,
        cache_limit: arguments.max_cache,
    };
    let cancel = Cancel::default();
    stop_on_interrupt(&cancel);
    let start = Instant::now();
    let session = Session::new(arguments.verbose, Screen::new(!arguments.json), move || Moment {
        milliseconds: start.elapsed().as_secs_f64() * 1e3,
        time: terminal::time_of_day(),
    });
    // Whether events could not be written; told once.
    let lost = AtomicBool::new(false);
    // How the last build ended.
    let last = Mutex::new(Exit::Success);
    let events = |event: Event| {
        match &event {
            Event::Ended(summary) => *last.lock().unwrap_or_else(PoisonError::into_inner) = exit_of(summary),
            Event::Rejected { .. } => {
                *last.lock().unwrap_or_else(PoisonError::into_inner) = Exit::Manifest;
            }
            Event::Hindered { .. } => {
                *last.lock().unwrap_or_else(PoisonError::into_inner) = Exit::Machine;
            }
            _ => {}
        }
        if !arguments.json {
            session.tell(&event);
        } else if !lost.load(Ordering::Relaxed) && print::event(event) != Exit::Success {
            lost.store(true, Ordering::Relaxed);
        }
    };
    let watched = engine::watch(&arguments.manifest.manifest, kinds, &options, &cancel, &events);
    session.close();
    match watched {
        Err(error) => exit::of_error(&error),
        Ok(()) if lost.into_inner() => Exit::Machine,
        Ok(()) if !arguments.once => Exit::Success,
        Ok(()) if cancel.is_cancelled() => Exit::Interrupted,
        Ok(()) => last.into_inner().unwrap_or_else(PoisonError::into_inner),
    }
}
