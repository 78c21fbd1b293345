//! `specula build`: runs what is out of date.

use std::time::Duration;

use engine::{BuildOptions, Cancel, Event, Kinds, LockTimeout, Summary};
use parking_lot::Mutex;

use crate::arguments::BuildArguments;
use crate::build_reporter::BuildReporter;
use crate::exit::Exit;
use crate::print::{EventStream, say};
use crate::remote_options::shared_cache;
use crate::timings::{self, Timeline};
use crate::{manifest, print};

pub(crate) fn run(arguments: &BuildArguments, kinds: &Kinds) -> Result<Exit, Exit> {
    let plan = manifest::load(&arguments.manifest, kinds)?;
    let options = BuildOptions {
        stages: arguments.stages.clone(),
        jobs: arguments.jobs.map(usize::from),
        keep_going: !arguments.fail_fast,
        dry_run: arguments.dry_run,
        keep_scratch: arguments.keep_scratch,
        lock_timeout: lock_timeout(arguments.wait),
        repeat_warnings: true,
        shared: shared_cache(&arguments.remote, &arguments.manifest.manifest)?,
        ..BuildOptions::default()
    };
    let cancel = Cancel::default();
    stop_on_interrupt(&cancel, || {});
    let reporter = BuildReporter::new(arguments);
    let stream = EventStream::default();
    let timeline = arguments.timings.as_ref().map(|_| Mutex::new(Timeline::new(&plan)));
    let events = |event: Event| {
        if let Some(timeline) = &timeline {
            timeline.lock().record(&event);
        }
        if arguments.json {
            stream.write(event);
        } else {
            reporter.show(&event);
        }
    };
    let summary = engine::build(&plan, &options, &cancel, &events).map_err(|error| {
        reporter.show_failures();
        print::failure(error)
    })?;
    if !arguments.json {
        reporter.summarise(&summary, &plan.out);
    }
    let timeline = timeline.map(Mutex::into_inner);
    let is_written = timeline.is_none_or(|timeline| write_timings(timeline, arguments));
    Ok(match exit_of(&summary) {
        Exit::Success if stream.failed() || !is_written => Exit::System,
        exit => exit,
    })
}

/// What `--wait`, `--wait=SECONDS` or neither asks for.
fn lock_timeout(wait: Option<Option<u32>>) -> LockTimeout {
    match wait {
        None => LockTimeout::default(),
        Some(None) => LockTimeout::ENDLESS,
        Some(Some(seconds)) => LockTimeout(Some(Duration::from_secs(seconds.into()))),
    }
}

/// Writes the files of `--timings`; returns whether that succeeded.
fn write_timings(timeline: Timeline, arguments: &BuildArguments) -> bool {
    let beside = || arguments.manifest.manifest.with_file_name(".specula");
    let folder = arguments.timings.clone().flatten().unwrap_or_else(beside);
    match timings::write(timeline, &folder) {
        Ok([page, trace]) => {
            say!("Wrote timings to {}, and for Perfetto to {}.", page.display(), trace.display());
            true
        }
        Err((path, error)) => {
            say!("error: cannot write timings to {}: {error}", path.display());
            false
        }
    }
}

/// The exit code of a build.
pub(crate) fn exit_of(summary: &Summary) -> Exit {
    if summary.cancelled {
        Exit::Interrupted
    } else if summary.system_errors > 0 {
        // Other failures may follow from this one: a build after it is fixed reports those that are left.
        Exit::System
    } else if summary.failed + summary.skipped > 0 {
        Exit::Failed
    } else {
        Exit::Success
    }
}

/// The first Ctrl-C stops the build at its next step and calls `on_interrupt`; the second ends the process.
pub(crate) fn stop_on_interrupt(cancel: &Cancel, on_interrupt: impl Fn() + Send + 'static) {
    let cancel = cancel.clone();
    let handler = move || {
        if cancel.is_cancelled() {
            std::process::exit(Exit::Interrupted as i32);
        }
        cancel.cancel();
        on_interrupt();
    };
    if let Err(error) = ctrlc::set_handler(handler) {
        say!("warning: Ctrl-C will stop the process at once: {error}");
    }
}
