//! `build --timings`: what every worker did when, as a page for people and as a trace for Perfetto.
//!
//! The events say it all: this listens to them, and writes two files at the end, also where items failed or the build
//! was stopped. Times are whole nanoseconds since the build began, so that what a worker did one after another never
//! overlaps by rounding.

mod bars;
mod page;
#[cfg(test)]
mod tests;
mod trace;

use std::collections::HashMap;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::time::Instant;

use engine::{Event, ItemName, Plan, Summary, Timestamp, Work};

use crate::reasons;

/// A time or a duration in nanoseconds.
type Nanoseconds = u64;

/// Where an item stands in the plan.
type Index = usize;

/// What is known of an item before the build.
#[derive(Clone, Debug)]
struct Node {
    name: String,
    kind: String,
    /// The items that it needs; each stands before it.
    needs: Vec<Index>,
}

/// What became of an item.
#[derive(Clone, Debug, PartialEq)]
enum Fate {
    /// It was not asked for, or not reached.
    Untouched,
    /// Its result was in the cache, as was known at this time.
    Current(Nanoseconds),
    /// It ran; whether its result changed.
    Ran { changed: bool },
    /// It failed, because of this.
    Failed(String),
    /// It was not run, or stopped; the item that failed, where that is why.
    Skipped(Option<String>),
}

/// A piece of work of one worker.
#[derive(Clone, Debug)]
struct WorkSpan {
    item: Index,
    work: Work,
    worker: usize,
    start: Nanoseconds,
    end: Nanoseconds,
    /// How many pieces of work of the same worker it lies in.
    depth: usize,
    /// Its time less that of what lies in it.
    own: Nanoseconds,
}

/// A build as its events told it.
pub(crate) struct Timeline {
    manifest: String,
    began: Timestamp,
    clock: Instant,
    places: HashMap<ItemName, Index>,
    nodes: Vec<Node>,
    fates: Vec<Fate>,
    /// Why each item ran, in words.
    reasons: Vec<String>,
    spells: Vec<WorkSpan>,
    summary: Summary,
}

impl Timeline {
    /// A build that begins now.
    pub(crate) fn new(plan: &Plan) -> Self {
        let stage = |index: usize| &plan.stages[index];
        let names = plan
            .items
            .iter()
            .map(|item| ItemName { stage: stage(item.stage).name.clone(), key: item.key.clone() });
        let names = names.collect::<Vec<_>>();
        let nodes = plan.items.iter().zip(&names).map(|(item, name)| Node {
            name: name.to_string(),
            kind: stage(item.stage).kind.name().to_owned(),
            needs: item.inputs.iter().flatten().copied().collect(),
        });
        let nodes = nodes.collect::<Vec<_>>();
        Self {
            manifest: plan.manifest.file_name().unwrap_or_default().to_string_lossy().into_owned(),
            began: Timestamp::now(),
            clock: Instant::now(),
            places: names.into_iter().zip(0..).collect(),
            fates: vec![Fate::Untouched; nodes.len()],
            reasons: vec![String::new(); nodes.len()],
            nodes,
            spells: Vec::new(),
            summary: Summary::default(),
        }
    }

    /// Hears one event.
    pub(crate) fn hear(&mut self, event: &Event) {
        let place = |item: &ItemName| self.places.get(item).copied();
        match event {
            Event::Planned { .. } => self.clock = Instant::now(),
            Event::TaskTimed { item, work, worker, start_milliseconds, milliseconds } => {
                let Some(item) = place(item) else { return };
                let start = nanoseconds(*start_milliseconds);
                let end = start + nanoseconds(*milliseconds);
                self.spells.push(WorkSpan {
                    item,
                    work: *work,
                    worker: *worker,
                    start,
                    end,
                    depth: 0,
                    own: 0,
                });
            }
            Event::Started { item, reasons } => {
                let Some(item) = place(item) else { return };
                self.reasons[item] = reasons::lines(reasons).join("; ");
            }
            Event::UpToDate { item } => {
                let now = nanoseconds(self.clock.elapsed().as_secs_f64() * 1e3);
                self.set(item, Fate::Current(now));
            }
            Event::Finished { item, changed, .. } => self.set(item, Fate::Ran { changed: *changed }),
            Event::Failed { item, error, .. } => self.set(item, Fate::Failed(error.join(": "))),
            Event::Skipped { item, because } => {
                self.set(item, Fate::Skipped(because.as_ref().map(ItemName::to_string)));
            }
            Event::Ended(summary) => self.summary = summary.clone(),
            _ => {}
        }
    }

    fn set(&mut self, item: &ItemName, fate: Fate) {
        if let Some(item) = self.places.get(item) {
            self.fates[*item] = fate;
        }
    }

    /// Writes `timings.html` and `timings.json` into a folder, each whole or not at all, and returns their paths.
    ///
    /// # Errors
    /// Where the folder or a file cannot be written; the path says which.
    pub(crate) fn write(mut self, folder: &Path) -> Result<[PathBuf; 2], (PathBuf, io::Error)> {
        self.settle();
        fs::create_dir_all(folder).map_err(|error| (folder.to_path_buf(), error))?;
        let [page, trace] = ["timings.html", "timings.json"].map(|name| folder.join(name));
        for (path, text) in [(&page, page::page(&self)), (&trace, trace::trace(&self))] {
            engine::replace_file(path, text.as_bytes()).map_err(|error| (path.clone(), error))?;
        }
        Ok([page, trace])
    }

    /// Sorts the work by worker and time, and finds what lies in what.
    fn settle(&mut self) {
        // Of two that begin at one time, the longer holds the other.
        self.spells.sort_by_key(|spell| (spell.worker, spell.start, std::cmp::Reverse(spell.end)));
        let mut around = Vec::<Index>::new();
        for index in 0..self.spells.len() {
            let WorkSpan { worker, start, end, .. } = self.spells[index];
            while let Some(&outer) = around.last()
                && (self.spells[outer].worker != worker || self.spells[outer].end <= start)
            {
                around.pop();
            }
            self.spells[index].depth = around.len();
            self.spells[index].own = end - start;
            if let Some(&outer) = around.last() {
                self.spells[outer].own = self.spells[outer].own.saturating_sub(end - start);
            }
            around.push(index);
        }
    }

    /// How long the build took.
    fn total(&self) -> Nanoseconds {
        let last = self.spells.iter().map(|spell| spell.end).max().unwrap_or(0);
        nanoseconds(self.summary.milliseconds).max(last)
    }

    /// The number of workers that did something.
    fn workers(&self) -> usize {
        self.spells.iter().map(|spell| spell.worker + 1).max().unwrap_or(0)
    }

    /// How long a worker was at work on items.
    fn busy(&self, worker: usize) -> Nanoseconds {
        let outer = self.spells.iter().filter(|spell| spell.worker == worker && spell.depth == 0);
        outer.map(|spell| spell.end - spell.start).sum()
    }

    /// The own time of each item's runs.
    fn costs(&self) -> Vec<Nanoseconds> {
        let mut costs = vec![0; self.nodes.len()];
        for spell in self.spells.iter().filter(|spell| spell.work == Work::Run) {
            costs[spell.item] += spell.own;
        }
        costs
    }

    /// Of all chains of items that need each other, the one whose runs took longest, and how long.
    fn critical_path(&self) -> (Vec<Index>, Nanoseconds) {
        let costs = self.costs();
        let mut longest = costs.clone();
        let mut before = vec![None; costs.len()];
        for (item, node) in self.nodes.iter().enumerate() {
            let slowest = node.needs.iter().copied().max_by_key(|need| longest[*need]);
            if let Some(need) = slowest.filter(|need| longest[*need] > 0) {
                longest[item] += longest[need];
                before[item] = Some(need);
            }
        }
        let Some(last) = (0..costs.len()).max_by_key(|item| longest[*item]) else { return (Vec::new(), 0) };
        let mut path = std::iter::successors(Some(last), |item| before[*item]).collect::<Vec<_>>();
        path.retain(|item| costs[*item] > 0);
        path.reverse();
        (path, longest[last])
    }

    /// For each kind that ran: its name, the number of runs, their own time together and that of the longest; the slowest
    /// kind first.
    fn kinds(&self) -> Vec<(&str, usize, Nanoseconds, Nanoseconds)> {
        let mut kinds = HashMap::<&str, (usize, Nanoseconds, Nanoseconds)>::new();
        for spell in self.spells.iter().filter(|spell| spell.work == Work::Run) {
            let (runs, time, most) = kinds.entry(&self.nodes[spell.item].kind).or_default();
            (*runs, *time, *most) = (*runs + 1, *time + spell.own, spell.own.max(*most));
        }
        let mut kinds: Vec<_> =
            kinds.into_iter().map(|(kind, (runs, time, most))| (kind, runs, time, most)).collect();
        kinds.sort_by_key(|&(kind, _, time, _)| (std::cmp::Reverse(time), kind));
        kinds
    }
}

fn nanoseconds(milliseconds: f64) -> Nanoseconds {
    (milliseconds * 1e6).round() as Nanoseconds
}
