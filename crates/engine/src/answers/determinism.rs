//! Checks that the outputs of stages do not depend on the number of threads.
//!
//! The stages run several times from nothing, each time with another number of threads, and their outputs are
//! compared byte for byte. Everything is written to a temporary folder: the project's own state and `out` do
//! not change.

use std::collections::{HashMap, HashSet};
use std::sync::Arc;

use serde::Serialize;
use tempfile::TempDir;

use crate::build::{BuildOptions, BuildSession, UpToDateCheck};
use crate::cancel::Cancel;
use crate::error::Error;
use crate::event::{Event, ItemName, Summary};
use crate::kinds::Product;
use crate::plan::{ItemIndex, Plan, Selection};
use crate::storage::{Disk, Record, State};

/// The result of running stages with several numbers of threads.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Determinism {
    /// The numbers of threads, in the order of the runs.
    pub threads: Vec<usize>,
    /// The number of items that were compared.
    pub items: usize,
    /// The number of outputs of the compared items.
    pub outputs: usize,
    /// The outputs that differ, in the order of the graph.
    pub differences: Vec<Difference>,
    /// The runs that failed, which cannot be compared.
    pub failures: Vec<FailedRun>,
    /// The files that changed between the runs: the check has to be repeated.
    pub disturbed: Vec<String>,
    /// Whether the check was stopped before it was done.
    pub cancelled: bool,
}

impl Determinism {
    /// Whether everything could be compared and is the same.
    pub fn is_proven(&self) -> bool {
        self.differences.is_empty()
            && self.failures.is_empty()
            && self.disturbed.is_empty()
            && !self.cancelled
    }
}

/// An output that differs between two runs.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Difference {
    /// The item that made the output.
    pub item: ItemName,
    /// The exported file, relative to `out`, or the type of the artifact.
    pub output: String,
    /// The numbers of threads of the two runs.
    pub threads: [usize; 2],
    /// The sizes of the two outputs in bytes.
    pub bytes: [u64; 2],
    /// The first byte that differs, counted from 0.
    pub at: u64,
    /// The first item whose output differed, if this output differs because of it; `None` if the difference
    /// begins here, with equal inputs.
    pub because: Option<ItemName>,
}

/// An item that failed.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FailedRun {
    /// The item.
    pub item: ItemName,
    /// The number of threads of the run.
    pub threads: usize,
    /// What happened and its causes.
    pub error: Vec<String>,
}

/// The numbers of threads that show differences best: one, two, and one more than there are processors.
pub fn default_threads() -> Vec<usize> {
    let processors = std::thread::available_parallelism().map_or(1, usize::from);
    let mut threads = vec![1, 2, processors + 1];
    threads.dedup();
    threads
}

/// Runs stages with everything that they need (empty: all stages) from nothing, once with each number of
/// threads, and compares their outputs with those of the first run.
///
/// `events` is called with the events of each run and its number of threads. The temporary folder is in the
/// system's (`TMPDIR`); it contains the results of two runs at a time and is removed at the end.
///
/// # Errors
/// The errors of [`crate::build::build`], and an error if the temporary folder cannot be written.
pub fn determinism(
    plan: &Plan,
    stages: &[String],
    threads: &[usize],
    cancel: &Cancel,
    events: &(dyn Fn(usize, Event) + Sync),
) -> Result<Determinism, Error> {
    let selected = Selection::of(plan, stages)?;
    let mut found = Determinism { threads: threads.to_vec(), ..Determinism::default() };
    let mut reported = HashSet::new();
    let mut first = None;
    for &threads in threads {
        let (trial, summary) = Trial::run(plan, stages, threads, cancel, events)?;
        if summary.cancelled {
            found.cancelled = true;
            break;
        }
        let results = trial.results(&selected)?;
        found.failures.extend(results.failures(plan, threads));
        match &first {
            None => {
                found.items = results.records.iter().flatten().count();
                found.outputs = results.records.iter().flatten().map(|record| record.outputs.len()).sum();
                // The files of the results are closed before their folder is removed.
                first = Some((results, trial));
            }
            Some((before, trial)) => {
                compare(plan, (trial.threads, before), (threads, &results), &mut reported, &mut found)?;
            }
        }
    }
    found.differences.sort_by_key(|difference| {
        (0..plan.items.len()).find(|item| plan.item_name(*item) == difference.item)
    });
    Ok(found)
}

/// A run in a folder of its own.
struct Trial {
    threads: usize,
    plan: Plan,
    /// Removed with the trial.
    _folder: TempDir,
}

struct Results {
    records: Vec<Option<Record>>,
    state: State,
}

impl Trial {
    fn run(
        plan: &Plan,
        stages: &[String],
        threads: usize,
        cancel: &Cancel,
        events: &(dyn Fn(usize, Event) + Sync),
    ) -> Result<(Self, Summary), Error> {
        let folder = tempfile::Builder::new().prefix("specula-check-").tempdir();
        let folder =
            folder.map_err(|error| Error::io(&error, "create a folder in", &std::env::temp_dir()))?;
        let (out, state) = (folder.path().join("out"), folder.path().to_path_buf());
        let plan = Plan { out, state, ..plan.clone() };
        let options = BuildOptions {
            stages: stages.to_vec(),
            jobs: Some(threads),
            keep_going: true,
            ..BuildOptions::default()
        };
        let session = BuildSession::new(Some(threads), 0)?;
        let summary = session.build(&plan, &options, cancel, &|event| events(threads, event))?;
        Ok((Self { threads, plan, _folder: folder }, summary))
    }

    fn results(&self, selected: &Selection) -> Result<Results, Error> {
        let state = State::read(&self.plan.state)?;
        let disk = Disk::new(state.now, Arc::default(), &Cancel::default());
        let check = UpToDateCheck::new(&self.plan, &state, &disk, selected);
        let records = (0..self.plan.items.len()).map(|item| check.record(item)).collect();
        Ok(Results { records, state })
    }
}

impl Results {
    fn failures(&self, plan: &Plan, threads: usize) -> Vec<FailedRun> {
        let failed = self.records.iter().enumerate().filter_map(|(item, record)| {
            let error = record.as_ref()?.failure.clone()?;
            Some(FailedRun { item: plan.item_name(item), threads, error })
        });
        failed.collect()
    }
}

fn compare(
    plan: &Plan,
    (threads_before, before): (usize, &Results),
    (threads, after): (usize, &Results),
    reported: &mut HashSet<(ItemIndex, usize)>,
    found: &mut Determinism,
) -> Result<(), Error> {
    // The items whose outputs differ, each with the item where the difference begins.
    let mut origins = HashMap::<ItemName, ItemName>::new();
    for item in 0..plan.items.len() {
        let (Some(old), Some(new)) = (&before.records[item], &after.records[item]) else { continue };
        if old.failure.is_some() || new.failure.is_some() {
            continue;
        }
        for (old, new) in old.reads.iter().zip(&new.reads) {
            if old.path == new.path && old.digest != new.digest && !found.disturbed.contains(&old.path) {
                found.disturbed.push(old.path.clone());
            }
        }
        let name = plan.item_name(item);
        let differing = old.inputs.iter().zip(&new.inputs).find(|(old, new)| old.digest != new.digest);
        let because = differing.map(|(input, _)| origins.get(&input.item).unwrap_or(&input.item).clone());
        for (output, (one, other)) in old.outputs.iter().zip(&new.outputs).enumerate() {
            if one.digest == other.digest {
                continue;
            }
            origins.insert(name.clone(), because.clone().unwrap_or_else(|| name.clone()));
            if !reported.insert((item, output)) {
                continue;
            }
            found.differences.push(Difference {
                item: name.clone(),
                output: output_name(plan, item, output),
                threads: [threads_before, threads],
                bytes: [one.bytes, other.bytes],
                at: first_difference(
                    before.state.store.get(one.digest)?,
                    after.state.store.get(other.digest)?,
                ),
                because: because.clone(),
            });
        }
    }
    Ok(())
}

fn output_name(plan: &Plan, item: ItemIndex, output: usize) -> String {
    let item = &plan.items[item];
    match &plan.stages[item.stage].product {
        Product::Artifact(name) => (*name).to_owned(),
        Product::Files(_) => item.files.get(output).cloned().unwrap_or_default(),
    }
}

/// The first byte that differs; if one is the beginning of the other, the first byte after it.
fn first_difference(one: Option<Vec<u8>>, other: Option<Vec<u8>>) -> u64 {
    let (one, other) = (one.unwrap_or_default(), other.unwrap_or_default());
    let same = one.iter().zip(&other).take_while(|(one, other)| one == other).count();
    same as u64
}
