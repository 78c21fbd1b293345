//! `specula build`: runs what is out of date.

use std::time::Duration;

use engine::{BuildOptions, Cancel, Event, Kinds, LockTimeout, Summary, path_text};
use parking_lot::Mutex;

use crate::arguments::{BuildArguments, JsonOutput};
use crate::build_reporter::BuildReporter;
use crate::command_error::CommandError;
use crate::exit::Exit;
use crate::manifest;
use crate::print::{EventStream, say};
use crate::remote_options::shared_cache;
use crate::timings::{self, Timeline};

pub(crate) fn run(arguments: &BuildArguments, kinds: &Kinds) -> Result<Exit, CommandError> {
    let plan = manifest::load(&arguments.manifest, kinds)?;
    let options = BuildOptions {
        stages: arguments.stages.clone(),
        force: arguments.force,
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
    let summary =
        engine::build(&plan, &options, &cancel, &events).inspect_err(|_| reporter.show_failures())?;
    if !arguments.json {
        reporter.summarise(&summary, &plan.out);
    }
    let timeline = timeline.map(Mutex::into_inner);
    let written = timeline.map_or(Ok(()), |timeline| write_timings(timeline, arguments));
    match (exit_of(&summary), written) {
        (Exit::Success, Ok(())) if stream.failed() => Ok(Exit::System),
        (Exit::Success, written) => written.map(|()| Exit::Success),
        // The items' failures decide the exit code.
        (exit, written) => Ok(written.err().map_or(exit, |error| {
            error.report(arguments.json.then_some(JsonOutput::Events));
            exit
        })),
    }
}

/// The wait that `--wait`, `--wait=SECONDS` or neither asks for.
fn lock_timeout(wait: Option<Option<u32>>) -> LockTimeout {
    match wait {
        None => LockTimeout::default(),
        Some(None) => LockTimeout::ENDLESS,
        Some(Some(seconds)) => LockTimeout(Some(Duration::from_secs(seconds.into()))),
    }
}

fn write_timings(timeline: Timeline, arguments: &BuildArguments) -> Result<(), CommandError> {
    let beside = || arguments.manifest.manifest.with_file_name(".specula");
    let folder = arguments.timings.clone().flatten().unwrap_or_else(beside);
    let [page, trace] = timings::write(timeline, &folder).map_err(|(path, error)| {
        CommandError::system(format!("cannot write timings to {}", path_text(path)), &error)
    })?;
    say!("Wrote timings to {}, and for Perfetto to {}.", path_text(page), path_text(trace));
    Ok(())
}

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
