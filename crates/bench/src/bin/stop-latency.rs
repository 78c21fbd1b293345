//! Measures how soon items stop that nobody wants any more, and prints a table.
//!
//! `cargo run --release -p bench --bin stop-latency MANIFEST [STOPS]`: builds the manifest in a folder of its
//! own, and then each item that took more than 50 ms again and again, cancelled at STOPS (12) moments spread
//! over its run time. The table has, for each kind, the longest run of an item, and the longest time
//! from a cancellation to the end of the build: by the clock, and by the processor's time, which is an upper
//! bound for a machine that does nothing else.

use std::collections::{BTreeMap, HashMap};
use std::path::PathBuf;
use std::sync::mpsc::channel;
use std::time::{Duration, Instant};

use engine::{BuildOptions, Cancel, Event, Plan, build};
use rustix::time::{ClockId, clock_gettime};

/// Items that take less are not stopped.
const SHORT: Duration = Duration::from_millis(50);

/// The longest times of a kind.
#[derive(Default)]
struct Longest {
    run: Duration,
    clock: Duration,
    processor: Duration,
    item: String,
}

fn main() {
    let mut arguments = std::env::args().skip(1);
    let manifest = PathBuf::from(arguments.next().expect("a manifest"));
    let stops = arguments.next().map_or(12, |stops| stops.parse().expect("a number of stops"));
    let folder = tempfile::tempdir().expect("a folder");
    let manifest = manifest.canonicalize().expect("the manifest exists");
    let kinds = mesh_stages::add_to(stages::kinds());
    let mut plan = Plan::load(&manifest, &kinds).expect("the manifest is valid");
    let place = |plan: &mut Plan, name: &str| {
        plan.state = folder.path().join(name);
        plan.out = folder.path().join(name).join("out");
    };

    place(&mut plan, "whole");
    let times = run_times(&plan);
    place(&mut plan, "stopped");
    let mut kinds = BTreeMap::<String, Longest>::new();
    for index in 0..plan.items.len() {
        let name = plan.item_name(index);
        let run = times[&name.to_string()];
        let kind = plan.stages[plan.items[index].stage].kind.name();
        let longest = kinds.entry(kind.to_owned()).or_default();
        longest.run = longest.run.max(run);
        if run < SHORT {
            continue;
        }
        let options = options(vec![name.to_string()]);
        for stop in 0..stops {
            let delay = run.mul_f64((f64::from(stop) + 0.5) / f64::from(stops));
            let Some([clock, processor]) = stop_after(&plan, &options, &name.to_string(), delay) else {
                break;
            };
            if processor > longest.processor {
                longest.item = format!("{name}, after {:.2} s", delay.as_secs_f64());
            }
            longest.clock = longest.clock.max(clock);
            longest.processor = longest.processor.max(processor);
        }
        // The items after it need it.
        build(&plan, &options, &Cancel::default(), &|_| {}).expect("the build begins");
    }
    println!("| kind | run, s | to stop, ms | processor, ms | item |\n| --- | --- | --- | --- | --- |");
    for (kind, longest) in kinds {
        let [clock, processor] = [longest.clock, longest.processor].map(|time| time.as_secs_f64() * 1e3);
        println!(
            "| {kind} | {:.2} | {clock:.0} | {processor:.0} | {} |",
            longest.run.as_secs_f64(),
            longest.item
        );
    }
}

fn options(stages: Vec<String>) -> BuildOptions {
    BuildOptions { stages, keep_going: true, ..BuildOptions::default() }
}

/// Builds everything, one item after the other; the time that each took.
fn run_times(plan: &Plan) -> HashMap<String, Duration> {
    let (sender, events) = channel();
    let options = BuildOptions { wanted: engine::Wanted::default(), ..options(Vec::new()) };
    let send = |event| _ = sender.send(event);
    build(plan, &options, &Cancel::default(), &send).expect("the build begins");
    let time = |event| match event {
        Event::Finished { item, milliseconds, .. } => {
            Some((item.to_string(), Duration::from_secs_f64(milliseconds / 1e3)))
        }
        Event::Failed { item, error, .. } => panic!("{item}: {error:?}"),
        _ => None,
    };
    events.try_iter().filter_map(time).collect()
}

/// Cancels a build so long after an item has started; the clock's and the processor's time from then to its
/// end, or `None` if it ended before.
fn stop_after(plan: &Plan, options: &BuildOptions, item: &str, delay: Duration) -> Option<[Duration; 2]> {
    let (cancel, (sender, started)) = (Cancel::default(), channel());
    let canceller = {
        let cancel = cancel.clone();
        std::thread::spawn(move || {
            started.recv().ok()?;
            std::thread::sleep(delay);
            cancel.cancel();
            Some((Instant::now(), processor_time()))
        })
    };
    let events = |event| {
        if matches!(&event, Event::Started { item: started, .. } if started.to_string() == item) {
            let _ = sender.send(());
        }
    };
    let summary = build(plan, options, &cancel, &events).expect("the build begins");
    let (end, processor) = (Instant::now(), processor_time());
    drop(sender);
    let (cancelled, before) = canceller.join().expect("the canceller does not panic")?;
    summary.cancelled.then(|| [end.saturating_duration_since(cancelled), processor.saturating_sub(before)])
}

/// The time that all threads have had on processors.
fn processor_time() -> Duration {
    let time = clock_gettime(ClockId::ProcessCPUTime);
    Duration::new(time.tv_sec.unsigned_abs(), time.tv_nsec.unsigned_abs() as u32)
}
