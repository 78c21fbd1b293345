//! Measures the time from a save to the published exports under `watch`, and prints it as JSON.
//!
//! `cargo run --release -p bench --bin watch-latency [EDITS [PHOTOGRAPH]]`: EDITS (200) of materials, and as
//! many of environments, of two projects. Each figure is in milliseconds; of each part the p50, p95 and p99
//! are its own, so that they do not add up.
//!
//! The first project has two environments and four materials with given degrees, and its figures are these
//! parts of the time:
//!
//! | part | from | to |
//! | --- | --- | --- |
//! | notice | the save has ended | the watcher reports the change: debounce and system |
//! | decide | | the first item begins: manifest, digests, what is out of date |
//! | compute | | the last export is computed |
//! | publish | | the last export is in `out`: stored, written, renamed |
//!
//! The second, `defaults`, has one environment, PHOTOGRAPH if there is one, one metal and nothing but
//! defaults. Its figures are the time until the map and until the SHRM is in `out`, and that of each item.

use std::collections::{BTreeMap, HashMap, HashSet};
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::time::{Duration, Instant};

use bench::latency::{DEFAULT_EXPORTS, DefaultsProject, Edit, Project};
use engine::{BuildOptions, Cancel, Event, ItemName, WatchOptions, watch};
use serde_json::{Value, json};

const DEBOUNCE: Duration = Duration::from_millis(20);
/// Longer than any edit takes, unless it was missed.
const TIMEOUT: Duration = Duration::from_secs(30);
/// The pause before each edit of the defaults, as a person makes it.
const REST: Duration = Duration::from_millis(250);

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

/// A watcher that runs, and the events that it sends.
struct RunningWatcher {
    events: Receiver<Heard>,
    cancel: Cancel,
    thread: std::thread::JoinHandle<Result<(), engine::Error>>,
}

impl RunningWatcher {
    /// Starts a watcher, and waits until the first build has ended and it listens.
    fn start(manifest: PathBuf) -> Self {
        let (sender, events) = channel::<Heard>();
        let cancel = Cancel::default();
        let stop = cancel.clone();
        let thread = std::thread::spawn(move || {
            let options = WatchOptions {
                build: BuildOptions { keep_going: true, ..BuildOptions::default() },
                debounce: DEBOUNCE,
                poll: None,
                once: false,
                memory: 512 << 20,
                cache_limit: Some(2 << 30),
            };
            let send = |event| _ = sender.send((Instant::now(), event));
            watch(&engine::ManifestFile::of(&manifest), &stages::kinds(), &options, &stop, &send)
        });
        await_watcher(&events);
        Self { events, cancel, thread }
    }

    fn stop(self) {
        self.cancel.cancel();
        self.thread.join().expect("the watcher does not panic").expect("the watcher ends well");
    }
}

fn main() {
    let edits = std::env::args().nth(1).map_or(200, |count| count.parse().expect("a number of edits"));
    let photograph = std::env::args().nth(2).map(PathBuf::from);
    let mut project = Project::new().expect("the project can be written");
    let watcher = RunningWatcher::start(project.manifest());
    let materials =
        (0..edits).map(|_| measure(&project.next_material().expect("a material"), &watcher.events));
    let materials = materials.collect::<Vec<_>>();
    let environments =
        (0..edits).map(|_| measure(&project.next_environment(), &watcher.events)).collect::<Vec<_>>();
    watcher.stop();
    let report = json!({
        "debounce_ms": DEBOUNCE.as_millis(),
        "threads": std::thread::available_parallelism().map_or(0, usize::from),
        "material": statistics(&materials),
        "environment": statistics(&environments),
        "defaults": defaults(edits, photograph.as_deref()),
    });
    println!("{report:#}");
}

/// Measures the project of nothing but defaults.
fn defaults(edits: u32, photograph: Option<&Path>) -> Value {
    let mut project = DefaultsProject::new(photograph).expect("the project can be written");
    let watcher = RunningWatcher::start(project.manifest());
    let material = |_| stage_times(&project.next_material().expect("a material"), &watcher.events);
    let materials = (0..edits).map(material).collect::<Vec<_>>();
    let lights = (0..edits).map(|_| stage_times(&project.next_light(), &watcher.events)).collect::<Vec<_>>();
    watcher.stop();
    json!({ "material": of_stages(&materials), "light": of_stages(&lights) })
}

/// Saves an edit and waits for the end of its build; the milliseconds until each export was published, and
/// those of each item.
fn stage_times(edit: &Edit, events: &Receiver<Heard>) -> BTreeMap<String, f64> {
    std::thread::sleep(REST);
    edit.save().expect("the edit can be saved");
    let saved = Instant::now();
    let mut times = BTreeMap::new();
    loop {
        let (when, event) = events.recv_timeout(TIMEOUT).expect("an edit is built");
        match event {
            Event::Finished { item, milliseconds, .. } => {
                times.insert(format!("item {}", item.stage), milliseconds);
            }
            Event::Published { item, .. } => {
                times.insert(format!("until {}", item.stage), 1e3 * (when - saved).as_secs_f64());
            }
            Event::Failed { item, error, .. } => panic!("{item} failed: {error:?}"),
            Event::Ended(_)
                if DEFAULT_EXPORTS.iter().all(|name| times.contains_key(&format!("until {name}"))) =>
            {
                return times;
            }
            _ => {}
        }
    }
}

/// The statistics of each time.
fn of_stages(times: &[BTreeMap<String, f64>]) -> Value {
    let names = times.iter().flat_map(BTreeMap::keys).collect::<std::collections::BTreeSet<_>>();
    let of_name = |name: &String| {
        (name.clone(), percentiles(times.iter().filter_map(|times| times.get(name).copied()).collect()))
    };
    Value::Object(names.into_iter().map(of_name).collect())
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
    let mut exports = HashSet::new();
    loop {
        let (when, event) = match events.recv_timeout(TIMEOUT) {
            Ok(heard) => heard,
            Err(RecvTimeoutError::Timeout) => {
                panic!("an edit was missed: {} of {}", exports.len(), edit.exports)
            }
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
            // A material of two parts has two files.
            Event::Published { item, .. } => {
                exports.insert(item);
                published = Some(when);
            }
            Event::Failed { item, error, .. } => panic!("{item} failed: {error:?}"),
            Event::Ended(_) if exports.len() >= edit.exports => break,
            _ => {}
        }
    }
    assert_eq!(exports.len(), edit.exports, "the maps that depend on the edit are published");
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
    let of = |part: fn(&Parts) -> f64| percentiles(parts.iter().map(part).collect());
    json!({
        "edits": parts.len(),
        "total_ms": of(|parts| parts.total),
        "notice_ms": of(|parts| parts.notice),
        "decide_ms": of(|parts| parts.decide),
        "compute_ms": of(|parts| parts.compute),
        "publish_ms": of(|parts| parts.publish),
    })
}

/// The least figures that half, 95 and 99 % of these do not pass.
fn percentiles(mut figures: Vec<f64>) -> Value {
    figures.sort_by(f64::total_cmp);
    let percentile = |share: f64| {
        let rank = (share * figures.len() as f64).ceil() as usize;
        figures.get(rank.saturating_sub(1)).map(|figure| (10.0 * figure).round() / 10.0)
    };
    json!({ "p50": percentile(0.50), "p95": percentile(0.95), "p99": percentile(0.99) })
}
