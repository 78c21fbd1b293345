//! `specula build`: runs what is out of date.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use engine::{BuildOptions, Cancel, Event, Kinds, Patience, Summary};

use crate::arguments::BuildArguments;
use crate::print::say;
use crate::progress::Progress;
use crate::{Exit, exit, manifest, print};

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
        patience: patience(arguments.wait),
        ..BuildOptions::default()
    };
    let cancel = Cancel::default();
    stop_on_interrupt(&cancel);
    let progress = Progress::new(arguments.verbose, arguments.dry_run, !arguments.json && !arguments.dry_run);
    // Whether events could not be written; told once.
    let lost = AtomicBool::new(false);
    let events = |event: Event| {
        if !arguments.json {
            progress.tell(&event);
        } else if !lost.load(Ordering::Relaxed) && print::event(event) != Exit::Success {
            lost.store(true, Ordering::Relaxed);
        }
    };
    match engine::build(&plan, &options, &cancel, &events) {
        Ok(summary) => {
            if !arguments.json {
                progress.summarise(&summary, &plan.out);
            }
            match exit_of(&summary) {
                Exit::Success if lost.into_inner() => Exit::Machine,
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
fn patience(wait: Option<Option<u32>>) -> Patience {
    match wait {
        None => Patience::default(),
        Some(None) => Patience::ENDLESS,
        Some(Some(seconds)) => Patience(Some(Duration::from_secs(seconds.into()))),
    }
}

pub(crate) fn exit_of(summary: &Summary) -> Exit {
    if summary.cancelled {
        Exit::Interrupted
    } else if summary.failed + summary.skipped > 0 {
        Exit::ItemsFailed
    } else {
        Exit::Success
    }
}

/// The first Ctrl-C stops the build at its next step, the second the process.
pub(crate) fn stop_on_interrupt(cancel: &Cancel) {
    let cancel = cancel.clone();
    let handler = move || {
        if cancel.is_cancelled() {
            std::process::exit(Exit::Interrupted as i32);
        }
        cancel.cancel();
    };
    if let Err(error) = ctrlc::set_handler(handler) {
        say!("warning: Ctrl-C will stop the process at once: {error}");
    }
}
