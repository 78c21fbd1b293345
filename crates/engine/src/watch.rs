//! Keeps a graph's outputs fresh: builds, and builds again when a file changes that the graph reads.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use crate::platform::Stamp;
use crate::record::path_name;
use crate::{BuildOptions, Cancel, Change, Changed, Error, ErrorKind, Event, Faults, Kinds, Plan, Workbench};

/// What a watcher is asked to do.
#[derive(Clone, Debug)]
pub struct WatchOptions {
    /// How each build is done; `dry_run` is passed over.
    pub build: BuildOptions,
    /// The quiet time after a change before it is acted on, so that a file is written to its end.
    pub debounce: Duration,
    /// To look at the files this often rather than to listen for events.
    pub poll: Option<Duration>,
    /// To return after the first rebuild that a change caused.
    pub once: bool,
    /// Decoded artifacts of at most so many encoded bytes are kept in memory.
    pub memory: u64,
    /// The size that the cache is trimmed to when nothing is to be done.
    pub cache_limit: Option<u64>,
}

/// Builds, then builds again whenever a file changes that the graph reads, until `cancel` is cancelled.
///
/// Events come one at a time. A fault of the manifest and an error of a build are told as events; the watcher goes on.
///
/// # Errors
/// Where threads cannot be started, or a stage was asked for that the first sound manifest does not have.
pub fn watch(
    manifest: &Path,
    kinds: &Kinds,
    options: &WatchOptions,
    cancel: &Cancel,
    events: &(dyn Fn(Event) + Sync),
) -> Result<(), Error> {
    let bench = Workbench::new(options.build.jobs, options.memory)?;
    let folder = manifest.parent().unwrap_or(manifest);
    let pause = options.poll.unwrap_or(Duration::from_millis(200));
    let mut rejected: Option<Faults> = None;
    let mut stamps = BTreeMap::new();
    let mut first = true;
    while !cancel.is_cancelled() {
        let plan = Plan::load(manifest, kinds);
        let now = look(manifest, plan.as_ref().ok());
        if first || now != stamps {
            let clock = Instant::now();
            if !first {
                let changes = differences(folder, &stamps, &now);
                events(Event::Noticed { changes, milliseconds: clock.elapsed().as_secs_f64() * 1e3 });
            }
            match plan {
                Ok(plan) => {
                    if rejected.take().is_some() {
                        events(Event::Accepted);
                    }
                    match bench.build(&plan, &options.build, cancel, events) {
                        Err(error) if first && error.kind() == ErrorKind::UnknownTarget => return Err(error),
                        Err(error) => {
                            let help = error.help().map(str::to_owned);
                            events(Event::Hindered { error: error.chain().to_vec(), help });
                        }
                        Ok(_) if !first && options.once => return Ok(()),
                        Ok(_) => {}
                    }
                    if first {
                        let poll_milliseconds = Some(pause.as_secs_f64() * 1e3);
                        events(Event::Watching { folders: 1, poll_milliseconds, because: None });
                    }
                    first = false;
                }
                Err(faults) if rejected.as_ref() != Some(&faults) => {
                    events(Event::Rejected { faults: faults.clone() });
                    rejected = Some(faults);
                }
                Err(_) => {}
            }
            stamps = now;
        }
        std::thread::sleep(pause);
    }
    Ok(())
}

/// What the file system says of the manifest and the sources.
fn look(manifest: &Path, plan: Option<&Plan>) -> BTreeMap<PathBuf, Option<Stamp>> {
    let sources = plan.into_iter().flat_map(|plan| plan.items.iter().filter_map(|item| item.source.clone()));
    let stamp = |path: &Path| std::fs::metadata(path).ok().map(|metadata| Stamp::of(&metadata));
    sources.chain([manifest.to_path_buf()]).map(|path| (path.clone(), stamp(&path))).collect()
}

fn differences(
    folder: &Path,
    old: &BTreeMap<PathBuf, Option<Stamp>>,
    new: &BTreeMap<PathBuf, Option<Stamp>>,
) -> Vec<Change> {
    let change = |path: &PathBuf| {
        let what = match (old.get(path).copied().flatten(), new.get(path).copied().flatten()) {
            (None, Some(_)) => Changed::Appeared,
            (Some(_), None) => Changed::Gone,
            (old, new) if old != new => Changed::Changed,
            _ => return None,
        };
        Some(Change { path: path_name(folder, path), what })
    };
    let mut changes = old.keys().chain(new.keys()).filter_map(change).collect::<Vec<_>>();
    changes.sort_unstable();
    changes.dedup();
    changes
}
