//! The trace: Chrome's Trace Event Format, which Perfetto and chrome://tracing read.
//!
//! Google, "Trace Event Format": `X` is a complete event with `ts` and `dur` in microseconds, and those of
//! one `tid` nest; `i` is an instant; `M` names processes and threads. Thread 0 is the scheduler, which finds
//! the items that are up to date.

use engine::Work;
use serde_json::{Value, json};

use super::timeline::{ItemOutcome, Nanoseconds, Timeline};

const PROCESS: u32 = 1;

/// The trace as JSON, an event on each line.
pub(super) fn trace(timeline: &Timeline) -> String {
    let mut events = vec![
        named("process_name", 0, &format!("specula build {}", timeline.manifest)),
        named("thread_name", 0, "up to date"),
    ];
    let workers = timeline.workers().into_iter();
    events.extend(workers.map(|(worker, name)| named("thread_name", worker + 1, &name)));
    for span in &timeline.spans {
        let (node, outcome) = (&timeline.nodes[span.item], &timeline.outcomes[span.item]);
        let mut arguments = json!({ "kind": node.kind });
        if span.work == Work::Run {
            arguments["because"] = timeline.reasons[span.item].as_str().into();
            arguments["outcome"] = describe(outcome).into();
            if let ItemOutcome::Failed { error, .. } = outcome {
                arguments["error"] = error.as_str().into();
            }
        }
        events.push(json!({
            "name": node.name,
            "cat": category(span.work),
            "ph": "X",
            "pid": PROCESS,
            "tid": span.worker + 1,
            "ts": microseconds(span.start),
            "dur": microseconds(span.end - span.start),
            "args": arguments,
        }));
    }
    for (node, outcome) in timeline.nodes.iter().zip(&timeline.outcomes) {
        if let ItemOutcome::UpToDate(time) = outcome {
            events.push(json!({
                "name": node.name,
                "cat": "up-to-date",
                "ph": "i",
                "s": "t",
                "pid": PROCESS,
                "tid": 0,
                "ts": microseconds(*time),
                "args": { "kind": node.kind },
            }));
        }
    }
    let lines = events.iter().map(Value::to_string).collect::<Vec<_>>().join(",\n");
    format!("{{\"displayTimeUnit\":\"ms\",\"traceEvents\":[\n{lines}\n]}}\n")
}

fn named(what: &str, thread: usize, name: &str) -> Value {
    json!({ "name": what, "ph": "M", "pid": PROCESS, "tid": thread, "args": { "name": name } })
}

pub(super) fn category(work: Work) -> &'static str {
    match work {
        Work::Run => "run",
        Work::Fetch => "fetch",
        Work::Publish => "publish",
    }
}

/// The outcome of an item in a few words.
pub(super) fn describe(outcome: &ItemOutcome) -> &'static str {
    match outcome {
        ItemOutcome::NotReached => "not reached",
        ItemOutcome::UpToDate(_) => "up to date",
        ItemOutcome::Ran { changed: true } => "ran",
        ItemOutcome::Ran { changed: false } => "ran, same result as before",
        ItemOutcome::Failed { .. } => "failed",
        ItemOutcome::Skipped(Some(_)) => "not run",
        ItemOutcome::Skipped(None) => "stopped",
    }
}

fn microseconds(time: Nanoseconds) -> f64 {
    time as f64 / 1e3
}
