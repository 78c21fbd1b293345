//! Measures the time from a save to the published SHRM exports under `watch`, and prints it as JSON.
//!
//! `cargo run --release -p bench --bin watch-latency [EDITS]`: EDITS (200) of materials, and as many of
//! environments. Each figure is in milliseconds; of each part the p50, p95 and p99 are its own, so that they
//! do not add up.
//!
//! | part | from | to |
//! | --- | --- | --- |
//! | notice | the save has ended | the watcher reports the change: debounce and system |
//! | decide | | the first item begins: manifest, digests, what is out of date |
//! | compute | | the last export is computed |
//! | publish | | the last export is in `out`: stored, written, renamed |

use std::collections::HashMap;
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::time::{Duration, Instant};

use bench::latency::{Edit, Project};
use engine::{BuildOptions, Cancel, Event, ItemName, WatchOptions, watch};
use serde_json::{Value, json};

const DEBOUNCE: Duration = Duration::from_millis(20);
/// Longer than any edit takes, unless it was missed.
const TIMEOUT: Duration = Duration::from_secs(30);

/// An event and when it was heard.
type Heard = (Instant, Event);

/// The parts of one edit's time, in milliseconds.
struct Parts {
    notice: f64,
    decide: f64,
    compute: f64,
    publish: f64,
    total: f64,
}

fn main() {
    let edits = std::env::args().nth(1).map_or(200, |count| count.parse().expect("a number of edits"));
    let mut project = Project::new().expect("the project can be written");
    let manifest = project.manifest();
    let (sender, events) = channel::<Heard>();
    let cancel = Cancel::default();
    let watcher = {
        let cancel = cancel.clone();
        std::thread::spawn(move || {
            let options = WatchOptions {
                build: BuildOptions { keep_going: true, ..BuildOptions::default() },
                debounce: DEBOUNCE,
                poll: None,
                once: false,
                memory: 512 << 20,
                cache_limit: Some(2 << 30),
            };
            let send = |event| _ = sender.send((Instant::now(), event));
            watch(&engine::ManifestFile::of(&manifest), &stages::kinds(), &options, &cancel, &send)
        })
    };
    await_watcher(&events);
    let materials = (0..edits).map(|_| measure(&project.next_material().expect("a material"), &events));
    let materials = materials.collect::<Vec<_>>();
    let environments = (0..edits).map(|_| measure(&project.next_environment(), &events)).collect::<Vec<_>>();
    cancel.cancel();
    watcher.join().expect("the watcher does not panic").expect("the watcher ends well");
    let report = json!({
        "debounce_ms": DEBOUNCE.as_millis(),
        "threads": std::thread::available_parallelism().map_or(0, usize::from),
        "material": statistics(&materials),
        "environment": statistics(&environments),
    });
    println!("{report:#}");
}

/// Waits until the first build has ended and the watcher listens.
fn await_watcher(events: &Receiver<Heard>) {
    let (mut built, mut listening) = (false, false);
    while !(built && listening) {
        match events.recv_timeout(TIMEOUT).expect("the watcher starts").1 {
            Event::Ended(summary) => {
                assert!(summary.failed + summary.skipped == 0, "{summary:?}");
                built = true;
            }
            Event::Watching { poll_milliseconds, because, .. } => {
                assert!(poll_milliseconds.is_none(), "events do not arrive here: {because:?}");
                listening = true;
            }
            _ => {}
        }
    }
}

/// Saves an edit and waits until its exports are published and the build is at its end.
fn measure(edit: &Edit, events: &Receiver<Heard>) -> Parts {
    edit.save().expect("the edit can be saved");
    let saved = Instant::now();
    let (mut noticed, mut begun, mut computed, mut published) = (None, None, None, None);
    let mut starts = HashMap::<ItemName, Instant>::new();
    let mut exports = 0;
    loop {
        let (when, event) = match events.recv_timeout(TIMEOUT) {
            Ok(heard) => heard,
            Err(RecvTimeoutError::Timeout) => panic!("an edit was missed: {exports} of {}", edit.exports),
            Err(RecvTimeoutError::Disconnected) => panic!("the watcher ended"),
        };
        match event {
            Event::Noticed { .. } => noticed = noticed.or(Some(when)),
            Event::Started { item, .. } => {
                begun = begun.or(Some(when));
                starts.insert(item, when);
            }
            Event::Finished { item, milliseconds, .. } if item.stage == "shrm" => {
                let end = starts[&item] + Duration::from_secs_f64(1e-3 * milliseconds);
                computed = computed.max(Some(end));
            }
            Event::Published { .. } => {
                exports += 1;
                published = Some(when);
            }
            Event::Failed { item, error, .. } => panic!("{item} failed: {error:?}"),
            Event::Ended(_) if exports >= edit.exports => break,
            _ => {}
        }
    }
    assert_eq!(exports, edit.exports, "each export is published once");
    let stations =
        [Some(saved), noticed, begun, computed, published].map(|when| when.expect("it was reported"));
    let between = |from: usize, to: usize| 1e3 * (stations[to] - stations[from]).as_secs_f64();
    Parts {
        notice: between(0, 1),
        decide: between(1, 2),
        compute: between(2, 3),
        publish: between(3, 4),
        total: between(0, 4),
    }
}

fn statistics(parts: &[Parts]) -> Value {
    let of = |part: fn(&Parts) -> f64| {
        let mut sorted = parts.iter().map(part).collect::<Vec<_>>();
        sorted.sort_by(f64::total_cmp);
        // The least figure that so large a share of the edits does not pass.
        let percentile = |share: f64| {
            let rank = (share * sorted.len() as f64).ceil() as usize;
            sorted.get(rank.saturating_sub(1)).map(|figure| (10.0 * figure).round() / 10.0)
        };
        json!({ "p50": percentile(0.50), "p95": percentile(0.95), "p99": percentile(0.99) })
    };
    json!({
        "edits": parts.len(),
        "total_ms": of(|parts| parts.total),
        "notice_ms": of(|parts| parts.notice),
        "decide_ms": of(|parts| parts.decide),
        "compute_ms": of(|parts| parts.compute),
        "publish_ms": of(|parts| parts.publish),
    })
}
