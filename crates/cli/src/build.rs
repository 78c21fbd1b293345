//! `specula build`: runs what is out of date.

use std::path::Path;
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
    let mut timeline = None;
    let built = build(arguments, kinds, &mut timeline);
    let mut timeline = timeline.map(Mutex::into_inner);
    timeline.iter_mut().for_each(Timeline::settle);
    let timings = match (&timeline, &arguments.timings, &built) {
        (Some(timeline), Some(folder), Ok(_)) => write_timings(timeline, folder.as_deref(), arguments),
        _ => Ok(()),
    };
    let junit = match &arguments.junit {
        Some(file) => write_junit(file, timeline.as_ref(), built.as_ref().err(), arguments),
        None => Ok(()),
    };
    let errors = [timings, junit].into_iter().filter_map(Result::err);
    match built {
        // The items' failures decide the exit code.
        Ok(exit) => Ok(errors.fold(exit, |exit, error| {
            let of_error = error.report(arguments.json.then_some(JsonOutput::Events));
            if exit == Exit::Success { of_error } else { exit }
        })),
        Err(error) => {
            errors.for_each(|error| _ = error.print());
            Err(error)
        }
    }
}

/// Builds, and records the course of the build if a report of it is wanted.
fn build(
    arguments: &BuildArguments,
    kinds: &Kinds,
    timeline: &mut Option<Mutex<Timeline>>,
) -> Result<Exit, CommandError> {
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
    let is_recorded = arguments.timings.is_some() || arguments.junit.is_some();
    *timeline = is_recorded.then(|| Mutex::new(Timeline::new(&plan)));
    let events = |event: Event| {
        if let Some(timeline) = &*timeline {
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
    Ok(match exit_of(&summary) {
        Exit::Success if stream.failed() => Exit::System,
        exit => exit,
    })
}

/// The wait that `--wait`, `--wait=SECONDS` or neither asks for.
fn lock_timeout(wait: Option<Option<u32>>) -> LockTimeout {
    match wait {
        None => LockTimeout::default(),
        Some(None) => LockTimeout::ENDLESS,
        Some(Some(seconds)) => LockTimeout(Some(Duration::from_secs(seconds.into()))),
    }
}

fn write_timings(
    timeline: &Timeline,
    folder: Option<&Path>,
    arguments: &BuildArguments,
) -> Result<(), CommandError> {
    let beside = arguments.manifest.manifest.with_file_name(".specula");
    let [page, trace] = timings::write(timeline, folder.unwrap_or(&beside)).map_err(|(path, error)| {
        CommandError::system(format!("cannot write timings to {}", path_text(path)), &error)
    })?;
    say!("Wrote timings to {}, and for Perfetto to {}.", path_text(page), path_text(trace));
    Ok(())
}

fn write_junit(
    file: &Path,
    timeline: Option<&Timeline>,
    error: Option<&CommandError>,
    arguments: &BuildArguments,
) -> Result<(), CommandError> {
    timings::write_junit(file, &arguments.manifest.manifest, timeline, error).map_err(|error| {
        CommandError::system(format!("cannot write the JUnit report {}", path_text(file)), &error)
    })?;
    say!("Wrote the JUnit report {}.", path_text(file));
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
