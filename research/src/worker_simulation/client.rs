//! The build, and what its process needed.

use std::collections::{BTreeMap, HashMap};
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use engine::serde_json::{Value, json};
use engine::{
    BuildOptions, Cancel, Event, ExecutorOptions, ItemName, Plan, SharedCacheOptions, Summary, serde_json,
};
use remote::{Address, Program, RemoteCache, RemoteExecutor, RemoteOptions, TlsFiles, UploadChoice};

use super::kinds;
use super::process::{memory, processor_seconds, seconds_by_thread};

/// How often the memory is looked at.
const LOOK: Duration = Duration::from_millis(500);

/// How to build.
#[derive(Clone, Debug)]
pub struct Client {
    /// The server.
    pub address: String,
    /// How many items run on workers at a time.
    pub jobs: usize,
    /// Whether items may run; if not, all have to be in the cache.
    pub runs: bool,
}

/// Builds the project of a folder, and says what that took.
///
/// # Errors
/// If the build fails, or an item did not end as it should.
pub fn build(folder: &Path, client: &Client) -> Result<Value, Box<dyn std::error::Error>> {
    let plan = Plan::load(&folder.join("pipeline.toml"), &kinds()).map_err(|errors| format!("{errors:?}"))?;
    let planned = memory("VmRSS");
    let options = RemoteOptions {
        address: Address::parse(&client.address)?,
        instance: String::new(),
        headers: Vec::new(),
        tls: TlsFiles::default(),
        timeout: Duration::from_secs(60),
        upload: UploadChoice::Always,
        compress: false,
    };
    let cache = RemoteCache::new(options.clone())?;
    let executor = match client.runs {
        false => None,
        true => {
            let program = Program::There("specula".into());
            let executor = RemoteExecutor::new(&cache, options, program, Vec::new())?;
            Some(ExecutorOptions { executor: Arc::new(executor), jobs: client.jobs, most_bytes: 64 << 20 })
        }
    };
    let shared = SharedCacheOptions {
        cache: Arc::new(cache),
        version: "simulation".into(),
        machine: "the client".into(),
        download_all: false,
        is_required: true,
        executor,
        programs: Vec::new(),
    };
    let options = BuildOptions { shared: Some(shared), ..BuildOptions::default() };
    let (failure, times) = (Mutex::new(None), Mutex::new(Vec::new()));
    let by_thread = Mutex::new(BTreeMap::new());
    let event = |event: Event| match event {
        Event::Failed { item, error, .. } => {
            let text = format!("{item:?}: {error:?}");
            failure.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(text);
        }
        Event::Finished { item, milliseconds, .. } => {
            times.lock().unwrap_or_else(PoisonError::into_inner).push((item, milliseconds));
        }
        _ => {}
    };
    let is_done = AtomicBool::new(false);
    let (used, clock) = (processor_seconds(), Instant::now());
    let (summary, memories) = std::thread::scope(|scope| {
        let looking = scope.spawn(|| {
            let mut memories = Vec::new();
            while !is_done.load(Ordering::Relaxed) {
                memories.push(memory("VmRSS").round());
                *by_thread.lock().unwrap_or_else(PoisonError::into_inner) = seconds_by_thread();
                std::thread::sleep(LOOK);
            }
            memories
        });
        let summary = engine::build(&plan, &options, &Cancel::default(), &event);
        is_done.store(true, Ordering::Relaxed);
        (summary, looking.join().unwrap_or_default())
    });
    let (seconds, used) = (clock.elapsed().as_secs_f64(), processor_seconds() - used);
    let summary = summary?;
    if let Some(failure) = failure.into_inner().unwrap_or_else(PoisonError::into_inner) {
        return Err(failure.into());
    }
    check(&summary, plan.items.len(), client.runs)?;
    let (total, critical) = path(&plan, &times.into_inner().unwrap_or_else(PoisonError::into_inner));
    Ok(json!({
        "items": plan.items.len(),
        "seconds": seconds,
        "processor_seconds": used,
        "seconds_by_thread": by_thread.into_inner().unwrap_or_else(PoisonError::into_inner),
        "planned_mebibytes": planned,
        "most_mebibytes": memory("VmHWM"),
        "mebibytes": memories,
        "work_seconds": total,
        "critical_seconds": critical,
        "summary": serde_json::to_value(&summary)?,
    }))
}

fn check(summary: &Summary, items: usize, runs: bool) -> Result<(), String> {
    let expected = match runs {
        true => summary.ran == items && summary.ran_elsewhere == items,
        false => summary.shared == items,
    };
    if expected && summary.failed == 0 { Ok(()) } else { Err(format!("of {items} items: {summary:?}")) }
}

/// The time of all items together, and that of those that wait for each other, in seconds.
fn path(plan: &Plan, times: &[(ItemName, f64)]) -> (f64, f64) {
    let by_key = |name: &ItemName| (name.stage.clone(), format!("{:?}", name.key));
    let times = times.iter().map(|(name, time)| (by_key(name), *time)).collect::<HashMap<_, _>>();
    let mut ends = vec![0.0; plan.items.len()];
    let mut total = 0.0;
    for (index, item) in plan.items.iter().enumerate() {
        let time = times.get(&by_key(&plan.item_name(index))).copied().unwrap_or(0.0);
        let begin = item.inputs.iter().flatten().map(|input| ends[*input]).fold(0.0, f64::max);
        ends[index] = begin + time;
        total += time;
    }
    (total / 1e3, ends.into_iter().fold(0.0, f64::max) / 1e3)
}
