//! `specula check`: whether the manifest and what it names is valid, and with `--determinism` whether
//! outputs depend on the number of threads.

use std::collections::HashMap;
use std::fmt::Write;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use engine::{Cancel, Determinism, Event, Kinds, Plan, SourceError, path_text};
use serde_json::json;

use crate::arguments::CheckArguments;
use crate::command_error::CommandError;
use crate::exit::Exit;
use crate::lists::{NAMED, SHOWN, list, more};
use crate::print::say;
use crate::quantity::{count, duration};
use crate::{build, manifest, print};

pub(crate) fn run(arguments: &CheckArguments, kinds: &Kinds) -> Result<Exit, CommandError> {
    let plan = manifest::load(&arguments.query.manifest, kinds)?;
    if !arguments.determinism {
        let errors = engine::check_sources(&plan)?;
        let printed = describe_plan(arguments, &plan, &errors);
        return Ok(if printed == Exit::Success && !errors.is_empty() { Exit::Failed } else { printed });
    }
    let threads = if arguments.threads.is_empty() {
        engine::default_threads()
    } else {
        arguments.threads.iter().copied().map(usize::from).collect()
    };
    let cancel = Cancel::default();
    build::stop_on_interrupt(&cancel, || {});
    let system_error = AtomicBool::new(false);
    let failed = AtomicUsize::new(0);
    let events = |threads: usize, event: Event| match event {
        Event::Planned { items, .. } => {
            failed.store(0, Ordering::Relaxed);
            say!("{}: {} from scratch", count(threads, "thread"), count(items, "item"))
        }
        Event::Failed { item, error, .. } if failed.fetch_add(1, Ordering::Relaxed) < SHOWN => {
            say!("  FAILED {item}: {}", error.join(": "));
        }
        Event::Ended(summary) => {
            system_error.fetch_or(summary.system_errors > 0, Ordering::Relaxed);
            let more = more(failed.load(Ordering::Relaxed).saturating_sub(SHOWN), "more failed item");
            more.iter().for_each(|more| say!("  {more}"));
            say!("  {}", duration(summary.milliseconds));
        }
        _ => {}
    };
    let found = engine::determinism(&plan, &arguments.stages, &threads, &cancel, &events)?;
    let printed = match arguments.query.json {
        true => print::json(json!({ "proven": found.is_proven(), "determinism": found })),
        false => print::data(&describe(&found)),
    };
    Ok(match printed {
        Exit::Success if found.cancelled => Exit::Interrupted,
        Exit::Success if !found.is_proven() && system_error.into_inner() => Exit::System,
        Exit::Success if !found.is_proven() => Exit::Failed,
        exit => exit,
    })
}

/// Prints what a valid manifest holds, and the errors in the sources of its items.
fn describe_plan(arguments: &CheckArguments, plan: &Plan, errors: &[SourceError]) -> Exit {
    let (stages, items) = (plan.stages.len(), plan.items.len());
    let files = plan.items.iter().map(|item| item.files.len()).sum::<usize>();
    if arguments.query.json {
        let sound = errors.is_empty();
        return print::json(json!({
            "sound": sound,
            "stages": stages,
            "items": items,
            "files": files,
            "source_errors": errors,
            "warnings": plan.warnings,
        }));
    }
    plan.warnings.to_string().lines().for_each(|line| say!("warning: {line}"));
    for SourceError { item, error, help, .. } in errors.iter().take(SHOWN) {
        say!("error: {item} would fail");
        error.iter().for_each(|cause| say!("  {}", cause.replace('\n', "\n  ")));
        help.iter().for_each(|help| say!("  hint: {help}"));
        say!("");
    }
    let more = more(errors.len().saturating_sub(SHOWN), "more item that would fail");
    more.iter().for_each(|more| say!("{more}; --json lists all"));
    let failing = match errors.len() {
        0 => String::new(),
        1 => "; the source of 1 item has errors".to_owned(),
        items => format!("; the sources of {items} items have errors"),
    };
    print::data(&format!(
        "{} is valid: {}, {}, {} in out{failing}\n",
        path_text(&arguments.query.manifest.manifest),
        count(stages, "stage"),
        count(items, "item"),
        count(files, "file")
    ))
}

fn describe(found: &Determinism) -> String {
    let threads = found.threads.iter().map(ToString::to_string).collect::<Vec<_>>();
    let threads = format!("{} threads", threads.join(", "));
    let (items, outputs) = (count(found.items, "item"), count(found.outputs, "output"));
    let mut text = String::new();
    let mut after = HashMap::<_, Vec<_>>::new();
    for difference in &found.differences {
        after.entry(difference.because.as_ref()).or_default().push(difference.item.to_string());
    }
    let origins = found.differences.iter().filter(|difference| difference.because.is_none());
    for difference in origins.clone().take(SHOWN) {
        let [one, other] = difference.threads;
        let [bytes, other_bytes] = difference.bytes;
        let size = if bytes == other_bytes {
            format!("{bytes} bytes")
        } else {
            format!(
                "{bytes} bytes with {}, {other_bytes} with {}",
                count(one, "thread"),
                count(other, "thread")
            )
        };
        let _ = writeln!(
            text,
            "{}: {} differs between {} and {}, from byte {} on ({size}); its inputs were the same",
            difference.item,
            difference.output,
            count(one, "thread"),
            count(other, "thread"),
            difference.at
        );
        if let Some(after) = after.get(&Some(&difference.item)) {
            let _ = writeln!(text, "  differ only because of it: {}", list(after, "; ", NAMED));
        }
    }
    for failed in found.failures.iter().take(SHOWN) {
        let threads = count(failed.threads, "thread");
        let _ = writeln!(text, "{} failed with {threads}: {}", failed.item, failed.error.join(": "));
    }
    for (number, what) in [(origins.count(), "more difference"), (found.failures.len(), "more failure")] {
        let more = more(number.saturating_sub(SHOWN), what);
        let _ = more.map_or(Ok(()), |more| writeln!(text, "{more}; --json lists all"));
    }
    for path in &found.disturbed {
        let _ = writeln!(text, "{path} changed during the check: run it again");
    }
    text += &match found {
        _ if found.cancelled => "Stopped before the end.\n".to_owned(),
        _ if found.is_proven() => {
            format!("The {outputs} of {items} are the same with {threads}, byte for byte.\n")
        }
        _ if found.differences.is_empty() => {
            format!("Not all of {items} could be compared with {threads}.\n")
        }
        _ => format!("{} of {outputs} differ between {threads}.\n", found.differences.len()),
    };
    text
}
