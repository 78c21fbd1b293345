//! The timeline of a build, recorded from its events, even if items fail or the build is stopped.
//!
//! Times are whole nanoseconds since the build began, so that rounding never makes consecutive work of one
//! worker overlap.

use std::collections::{BTreeMap, HashMap};
use std::time::Instant;

use engine::{Event, ItemName, Plan, Summary, Timestamp, Work};

use crate::reasons;

/// A time or a duration in nanoseconds.
pub(super) type Nanoseconds = u64;

/// The index of an item in the plan.
pub(super) type Index = usize;

#[derive(Clone, Debug)]
pub(super) struct TimelineItem {
    pub(super) stage: String,
    pub(super) name: String,
    pub(super) kind: String,
    /// The items that it needs; each has a lower index.
    pub(super) needs: Vec<Index>,
}

#[derive(Clone, Debug, PartialEq)]
pub(super) enum ItemOutcome {
    /// The item was not selected, or not reached.
    NotReached,
    /// The item's result was in the cache, as was known at this time.
    UpToDate(Nanoseconds),
    Ran {
        changed: bool,
    },
    Failed {
        error: String,
        hint: Option<String>,
    },
    /// The item was not run because the named item failed, or it was stopped.
    Skipped(Option<String>),
}

/// Work of one worker for one item.
#[derive(Clone, Debug)]
pub(super) struct WorkSpan {
    pub(super) item: Index,
    pub(super) work: Work,
    pub(super) worker: usize,
    /// Whether the worker waited for another machine.
    pub(super) is_elsewhere: bool,
    pub(super) start: Nanoseconds,
    pub(super) end: Nanoseconds,
    /// The number of spans of the same worker that contain this one.
    pub(super) depth: usize,
    /// The duration without that of the spans that this one contains.
    pub(super) own: Nanoseconds,
}

/// The course of a build by its events: its items and workers.
pub(crate) struct Timeline {
    pub(super) manifest: String,
    pub(super) began: Timestamp,
    pub(super) clock: Instant,
    pub(super) indices: HashMap<ItemName, Index>,
    pub(super) nodes: Vec<TimelineItem>,
    pub(super) outcomes: Vec<ItemOutcome>,
    /// Why each item ran, in words.
    pub(super) reasons: Vec<String>,
    /// Whether each item runs on another machine.
    pub(super) is_elsewhere: Vec<bool>,
    pub(super) spans: Vec<WorkSpan>,
    pub(super) summary: Summary,
}

impl Timeline {
    /// The timeline of a build that begins now.
    pub(crate) fn new(plan: &Plan) -> Self {
        let stage = |index: usize| &plan.stages[index];
        let names = plan
            .items
            .iter()
            .map(|item| ItemName { stage: stage(item.stage).name.clone(), key: item.key.clone() });
        let names = names.collect::<Vec<_>>();
        let nodes = plan.items.iter().zip(&names).map(|(item, name)| TimelineItem {
            stage: name.stage.clone(),
            name: name.to_string(),
            kind: stage(item.stage).kind.name().to_owned(),
            needs: item.inputs.iter().flatten().copied().collect(),
        });
        let nodes = nodes.collect::<Vec<_>>();
        Self {
            manifest: plan.manifest.file_name().unwrap_or_default().to_string_lossy().into_owned(),
            began: Timestamp::now(),
            clock: Instant::now(),
            indices: names.into_iter().zip(0..).collect(),
            outcomes: vec![ItemOutcome::NotReached; nodes.len()],
            reasons: vec![String::new(); nodes.len()],
            is_elsewhere: vec![false; nodes.len()],
            nodes,
            spans: Vec::new(),
            summary: Summary::default(),
        }
    }

    pub(crate) fn record(&mut self, event: &Event) {
        let index = |item: &ItemName| self.indices.get(item).copied();
        match event {
            Event::Planned { .. } => self.clock = Instant::now(),
            Event::TaskTimed { item, work, worker, start_milliseconds, milliseconds } => {
                let Some(item) = index(item) else { return };
                let start = nanoseconds(*start_milliseconds);
                let end = start + nanoseconds(*milliseconds);
                self.spans.push(WorkSpan {
                    item,
                    work: *work,
                    worker: *worker,
                    is_elsewhere: self.is_elsewhere[item] && *work == Work::Run,
                    start,
                    end,
                    depth: 0,
                    own: 0,
                });
            }
            Event::Started { item, reasons, host } => {
                let Some(item) = index(item) else { return };
                self.is_elsewhere[item] = host.is_some();
                self.reasons[item] = reasons::lines(reasons).join("; ");
            }
            Event::UpToDate { item, .. } => {
                let now = nanoseconds(self.clock.elapsed().as_secs_f64() * 1e3);
                self.set(item, ItemOutcome::UpToDate(now));
            }
            Event::Finished { item, changed, .. } => self.set(item, ItemOutcome::Ran { changed: *changed }),
            Event::Failed { item, error, help } => {
                self.set(item, ItemOutcome::Failed { error: error.join(": "), hint: help.clone() });
            }
            Event::Skipped { item, because } => {
                self.set(item, ItemOutcome::Skipped(because.as_ref().map(ItemName::to_string)));
            }
            Event::Ended(summary) => self.summary = summary.clone(),
            _ => {}
        }
    }

    fn set(&mut self, item: &ItemName, outcome: ItemOutcome) {
        if let Some(item) = self.indices.get(item) {
            self.outcomes[*item] = outcome;
        }
    }

    /// Sorts the spans by worker and time, and finds which span contains which.
    pub(crate) fn settle(&mut self) {
        // Of two spans that begin at the same time, the longer contains the other.
        self.spans.sort_by_key(|span| (span.worker, span.start, std::cmp::Reverse(span.end)));
        let mut around = Vec::<Index>::new();
        for index in 0..self.spans.len() {
            let WorkSpan { worker, start, end, .. } = self.spans[index];
            while let Some(&outer) = around.last()
                && (self.spans[outer].worker != worker || self.spans[outer].end <= start)
            {
                around.pop();
            }
            self.spans[index].depth = around.len();
            self.spans[index].own = end - start;
            if let Some(&outer) = around.last() {
                self.spans[outer].own = self.spans[outer].own.saturating_sub(end - start);
            }
            around.push(index);
        }
    }

    /// The duration of the build.
    pub(super) fn total(&self) -> Nanoseconds {
        let last = self.spans.iter().map(|span| span.end).max().unwrap_or(0);
        nanoseconds(self.summary.milliseconds).max(last)
    }

    /// The workers that did something, in order, each with its name: `worker 0`, and for those that waited
    /// for another machine `elsewhere 0`.
    pub(super) fn workers(&self) -> Vec<(usize, String)> {
        let mut workers = BTreeMap::<usize, bool>::new();
        for span in &self.spans {
            *workers.entry(span.worker).or_default() |= span.is_elsewhere;
        }
        let first = workers.iter().find(|(_, is_elsewhere)| **is_elsewhere);
        let first = first.map_or(0, |(worker, _)| *worker);
        let name = |(worker, is_elsewhere): (usize, bool)| match is_elsewhere {
            true => (worker, format!("elsewhere {}", worker - first)),
            false => (worker, format!("worker {worker}")),
        };
        workers.into_iter().map(name).collect()
    }

    /// How long a worker worked on items.
    pub(super) fn busy(&self, worker: usize) -> Nanoseconds {
        let outer = self.spans.iter().filter(|span| span.worker == worker && span.depth == 0);
        outer.map(|span| span.end - span.start).sum()
    }

    /// The own time of each item's runs.
    pub(super) fn costs(&self) -> Vec<Nanoseconds> {
        let mut costs = vec![0; self.nodes.len()];
        for span in self.spans.iter().filter(|span| span.work == Work::Run) {
            costs[span.item] += span.own;
        }
        costs
    }

    /// The chain of items that need each other whose runs took longest, and how long they took.
    pub(super) fn critical_path(&self) -> (Vec<Index>, Nanoseconds) {
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

    /// For each kind that ran: its name, the number of runs, the sum of their own times, and the longest of
    /// these; the slowest kind first.
    pub(super) fn kinds(&self) -> Vec<(&str, usize, Nanoseconds, Nanoseconds)> {
        let mut kinds = HashMap::<&str, (usize, Nanoseconds, Nanoseconds)>::new();
        for span in self.spans.iter().filter(|span| span.work == Work::Run) {
            let (runs, time, most) = kinds.entry(&self.nodes[span.item].kind).or_default();
            (*runs, *time, *most) = (*runs + 1, *time + span.own, span.own.max(*most));
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
