//! `specula build`: runs what is out of date.

use std::time::Duration;

use engine::{BuildOptions, Cancel, Event, Kinds, LockTimeout, Summary};
use parking_lot::Mutex;

use crate::arguments::BuildArguments;
use crate::print::{EventStream, say};
use crate::progress::Progress;
use crate::timings::Timeline;
use crate::{Exit, exit, manifest};

pub(crate) fn run(arguments: &BuildArguments, kinds: &Kinds) -> Exit {
    let plan = match manifest::load(&arguments.manifest, kinds) {
        Ok(plan) => plan,
        Err(exit) => return exit,
    };
    let options = BuildOptions {
        stages: arguments.stages.clone(),
        jobs: arguments.jobs.map(usize::from),
        keep_going: !arguments.fail_fast,
        dry_run: arguments.dry_run,
        lock_timeout: lock_timeout(arguments.wait),
        ..BuildOptions::default()
    };
    let cancel = Cancel::default();
    stop_on_interrupt(&cancel, || {});
    let progress = Progress::new(arguments.verbose, arguments.dry_run, !arguments.json && !arguments.dry_run);
    let stream = EventStream::default();
    let timeline = arguments.timings.as_ref().map(|_| Mutex::new(Timeline::new(&plan)));
    let events = |event: Event| {
        if let Some(timeline) = &timeline {
            timeline.lock().hear(&event);
        }
        if arguments.json {
            stream.write(event);
        } else {
            progress.tell(&event);
        }
    };
    match engine::build(&plan, &options, &cancel, &events) {
        Ok(summary) => {
            if !arguments.json {
                progress.summarise(&summary, &plan.out);
            }
            let timeline = timeline.map(Mutex::into_inner);
            let drawn = timeline.is_none_or(|timeline| draw(timeline, arguments));
            match exit_of(&summary) {
                Exit::Success if stream.is_torn() || !drawn => Exit::Machine,
                exit => exit,
            }
        }
        Err(error) => {
            progress.tell_failures();
            exit::of_error(&error)
        }
    }
}

/// What `--wait`, `--wait=SECONDS` or neither asks for.
fn lock_timeout(wait: Option<Option<u32>>) -> LockTimeout {
    match wait {
        None => LockTimeout::default(),
        Some(None) => LockTimeout::ENDLESS,
        Some(Some(seconds)) => LockTimeout(Some(Duration::from_secs(seconds.into()))),
    }
}

/// Writes what `--timings` asks for; whether that could be done.
fn draw(timeline: Timeline, arguments: &BuildArguments) -> bool {
    let beside = || arguments.manifest.manifest.with_file_name(".specula");
    let folder = arguments.timings.clone().flatten().unwrap_or_else(beside);
    match timeline.write(&folder) {
        Ok([page, trace]) => {
            say!("Timings in {}, and for Perfetto in {}.", page.display(), trace.display());
            true
        }
        Err((path, error)) => {
            say!("error: cannot write timings to {}: {error}", path.display());
            false
        }
    }
}

pub(crate) fn exit_of(summary: &Summary) -> Exit {
    if summary.cancelled {
        Exit::Interrupted
    } else if summary.system_errors > 0 {
        // Whatever else failed: once the system is mended, another build says what is wrong with the project.
        Exit::Machine
    } else if summary.failed + summary.skipped > 0 {
        Exit::Failed
    } else {
        Exit::Success
    }
}

/// The first Ctrl-C stops the build at its next step, and whatever `also` does; the second the process.
pub(crate) fn stop_on_interrupt(cancel: &Cancel, also: impl Fn() + Send + 'static) {
    let cancel = cancel.clone();
    let handler = move || {
        if cancel.is_cancelled() {
            std::process::exit(Exit::Interrupted as i32);
        }
        cancel.cancel();
        also();
    };
    if let Err(error) = ctrlc::set_handler(handler) {
        say!("warning: Ctrl-C will stop the process at once: {error}");
    }
}
