//! The trace: Chrome's Trace Event Format, which Perfetto and chrome://tracing read.
//!
//! Google, "Trace Event Format": `X` is a complete event with `ts` and `dur` in microseconds, those of one `tid` nest;
//! `i` is an instant; `M` names processes and threads. Thread 0 is the scheduler, which finds what is up to date.

use engine::Work;
use serde_json::{Value, json};

use super::{Fate, Nanoseconds, Timeline};

const PROCESS: u32 = 1;

/// The trace as JSON, an event on each line.
pub(super) fn trace(timeline: &Timeline) -> String {
    let mut events = vec![
        named("process_name", 0, &format!("specula build {}", timeline.manifest)),
        named("thread_name", 0, "up to date"),
    ];
    events.extend(
        (0..timeline.workers()).map(|worker| named("thread_name", worker + 1, &format!("worker {worker}"))),
    );
    for spell in &timeline.spells {
        let (node, fate) = (&timeline.nodes[spell.item], &timeline.fates[spell.item]);
        let mut arguments = json!({ "kind": node.kind });
        if spell.work == Work::Run {
            arguments["because"] = timeline.reasons[spell.item].as_str().into();
            arguments["outcome"] = outcome(fate).into();
            if let Fate::Failed(error) = fate {
                arguments["error"] = error.as_str().into();
            }
        }
        events.push(json!({
            "name": node.name,
            "cat": category(spell.work),
            "ph": "X",
            "pid": PROCESS,
            "tid": spell.worker + 1,
            "ts": microseconds(spell.start),
            "dur": microseconds(spell.end - spell.start),
            "args": arguments,
        }));
    }
    for (node, fate) in timeline.nodes.iter().zip(&timeline.fates) {
        if let Fate::Current(time) = fate {
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

/// What became of an item, in few words.
pub(super) fn outcome(fate: &Fate) -> &'static str {
    match fate {
        Fate::Untouched => "not reached",
        Fate::Current(_) => "up to date",
        Fate::Ran { changed: true } => "ran",
        Fate::Ran { changed: false } => "ran, the same result as before",
        Fate::Failed(_) => "failed",
        Fate::Skipped(Some(_)) => "not run",
        Fate::Skipped(None) => "stopped",
    }
}

fn microseconds(time: Nanoseconds) -> f64 {
    time as f64 / 1e3
}
