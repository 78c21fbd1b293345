//! Decides which item does what, and when.
//!
//! One thread (the caller's) schedules and reports events; a pool of threads works. That one thread also
//! decides whether a failure counts, and records it, because it is told what a watcher hears. An item is
//! checked when all its inputs are finished; if its result is not in the cache, it becomes a task. Before the
//! task runs, the stored artifacts that it needs are fetched, each once; one that turns out to be lost is
//! made again first. `runner.rs` says where tasks are done, `tasks.rs` which of the ready ones is next, and
//! `wanted.rs` what becomes of those that somebody waits for. An artifact is kept in memory only while an
//! item may need it, except for those that the session keeps.
//!
//! No thread ever waits for the result of another item: kernels share the pool, and the waiting thread could
//! be the one that has to do the work.

use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::time::{Duration, Instant};

use rayon::ThreadPool;

use super::heard::HeardChanges;
use super::outcome::Refusal;
use super::reporter::BuildReporter;
use super::run::RunContext;
use super::runner::{Act, Candidate, Runner, Threads};
use super::running::Dependencies;
use super::up_to_date::{Freshness, UpToDateCheck};
use crate::error::Error;
use crate::event::{Event, Summary, Work};
use crate::parallel;
use crate::plan::{ItemIndex, Selection};
use crate::storage::{Blob, Record};

mod items;
mod outcomes;
mod places;
mod progress;
mod reports;
mod requests;
mod tasks;

use items::{Phase, Progress, distinct, items_of};
use places::{Next, RunnerPlaces};
use progress::RunningItems;
use tasks::Task;

pub(crate) use reports::event_of;

/// How often a build that works looks at what is wanted.
const WANTED_INTERVAL: Duration = Duration::from_millis(20);

pub(crate) struct Scheduler<'a, 'e> {
    context: &'a RunContext<'a>,
    check: &'a UpToDateCheck<'a>,
    keep_going: bool,
    /// The version of what is wanted that this is: whether each item is.
    wanted_version: Option<u64>,
    is_wanted: Vec<bool>,
    /// Started at the begin of the build.
    clock: Instant,
    events: &'e (dyn Fn(Event) + Sync),
    /// What a watcher has heard of: failures on it are not reported.
    heard: HeardChanges,
    items: Vec<Progress>,
    selected: Vec<ItemIndex>,
    /// Whether nothing has to be done for an item.
    was_complete: Vec<bool>,
    to_check: BinaryHeap<Reverse<ItemIndex>>,
    places: RunnerPlaces<'a>,
    running: RunningItems,
    pub(crate) summary: Summary,
    /// The items that failed, except for those that failed because of the system.
    pub(crate) failed: Vec<ItemIndex>,
    fatal: Option<Error>,
}

impl<'a, 'e> Scheduler<'a, 'e> {
    pub(crate) fn new(
        context: &'a RunContext<'a>,
        selected: &Selection,
        keep_going: bool,
        runners: Vec<Box<dyn Runner<'a> + 'a>>,
        reporter: BuildReporter<'e>,
        heard: HeardChanges,
    ) -> Self {
        let check = context.check;
        let plan = check.plan;
        // For most items of most builds this is the only check, so all are checked in parallel.
        let is_complete = parallel::map(plan.items.len(), &|item| {
            check.is_complete(item)
                || check.is_current(item)
                    && context.is_published(item, check.latest(item).map_or(&[], |latest| latest.outputs()))
        });
        let items = items_of(plan, selected, &is_complete);
        let chosen = (0..plan.items.len()).filter(|item| selected.has(*item)).collect::<Vec<_>>();
        let is_first = |item: &ItemIndex| !is_complete[*item] && items[*item].waiting == 0;
        let to_check = chosen.iter().copied().filter(is_first).map(Reverse).collect();
        Self {
            context,
            check,
            keep_going,
            wanted_version: None,
            is_wanted: vec![false; plan.items.len()],
            clock: reporter.clock,
            events: reporter.events,
            heard,
            items,
            selected: chosen,
            was_complete: is_complete,
            to_check,
            places: RunnerPlaces::new(runners),
            running: RunningItems::default(),
            summary: Summary::default(),
            failed: Vec::new(),
            fatal: None,
        }
    }

    /// Finishes every item, on the threads of these pools; `wanted` is for those that somebody looks at.
    ///
    /// # Errors
    /// If the journal cannot be written.
    pub(crate) fn finish_all(&mut self, pool: &ThreadPool, wanted: &ThreadPool) -> Result<(), Error> {
        for index in 0..self.selected.len() {
            let item = self.selected[index];
            if self.is_stopping() {
                break;
            }
            if !self.was_complete[item] {
                continue;
            }
            self.items[item].phase = Phase::Done;
            self.summary.up_to_date += 1;
            if !self.check.is_complete(item) {
                self.report_up_to_date(item);
            }
        }
        std::thread::scope(|scope| {
            let waiting = |name, act: Act<'a>| {
                std::thread::Builder::new().name(name).spawn_scoped(scope, act).map(drop)
            };
            pool.in_place_scope(|others| {
                wanted.in_place_scope(|wanted| {
                    self.run_tasks(&Threads { others, wanted, waiting: &waiting });
                });
            });
        });
        if let Some(error) = self.fatal.take() {
            return Err(error);
        }
        self.skip_the_rest();
        Ok(())
    }

    fn run_tasks(&mut self, threads: &Threads<'_, 'a>) {
        loop {
            self.look();
            self.report_progress();
            while let Some(item) = self.next_to_check() {
                self.check_item(item);
            }
            while let Some(next) = self.next_task() {
                self.start(next, threads);
            }
            if self.places.are_idle() {
                break;
            }
            // Meanwhile something else may be wanted.
            if let Some(ended) = self.places.wait(WANTED_INTERVAL) {
                if ended.work == Work::Run {
                    self.running.ended(ended.item);
                }
                self.report_time(&ended);
                self.handle(ended.message);
            }
        }
    }

    /// Which items have complete results and files. For an item that a stopped build did not reach, `before`
    /// says so.
    pub(crate) fn complete_items(&self, before: Option<&[bool]>) -> Vec<bool> {
        let had = |item: ItemIndex| before.is_some_and(|before| before[item]);
        let items = self.items.iter().enumerate();
        let is_complete = items.map(|(item, progress)| match progress.phase {
            Phase::Done => true,
            Phase::Waiting => had(item),
            _ => false,
        });
        is_complete.collect()
    }

    pub(crate) fn into_summary(self) -> Summary {
        self.summary
    }

    /// The items of selected stages for which something had to be done.
    pub(crate) fn handled_items(&self) -> impl Iterator<Item = ItemIndex> {
        self.selected.iter().copied().filter(|item| !self.was_complete[*item])
    }

    fn is_stopping(&self) -> bool {
        self.fatal.is_some() || self.is_cancelled() || (!self.keep_going && self.summary.failed > 0)
    }

    /// Whether the build was cancelled, or a change has made it out of date.
    fn is_cancelled(&self) -> bool {
        self.context.cancel.is_cancelled() || self.context.running.is_outdated()
    }

    /// Sees what is wanted now.
    fn look(&mut self) {
        let version = self.context.wanted.version();
        if self.wanted_version != Some(version) {
            self.wanted_version = Some(version);
            self.is_wanted = self.context.wanted.among(self.check.plan);
            self.places.want(&self.is_wanted);
        }
    }

    fn next_to_check(&mut self) -> Option<ItemIndex> {
        if self.is_stopping() { None } else { self.to_check.pop().map(|Reverse(item)| item) }
    }

    fn next_task(&mut self) -> Option<Next> {
        if self.is_stopping() { None } else { self.places.next() }
    }

    fn check_item(&mut self, item: ItemIndex) {
        if let Some(root) = self.failed_input(item) {
            return self.skip(item, Some(root));
        }
        let dependent = self.context.running.depend(item, self.check.recorded_dependencies(item));
        match self.check.freshness(&dependent, self.key(item)) {
            Freshness::Run => {
                self.context.running.set_dependencies(item, Dependencies::None);
                let is_missed = |item: ItemIndex| self.items[item].is_missed;
                let in_vain = self.check.is_missed(item, is_missed);
                if !in_vain && self.check.may_be_shared(item) {
                    self.items[item].phase = Phase::Busy;
                    self.push(item, Task::Find(item));
                } else {
                    self.items[item].is_missed = in_vain;
                    self.run_when_ready(item);
                }
            }
            Freshness::Current { outputs, restored, host } => {
                self.take_result(item, outputs, restored, host);
            }
        }
    }

    /// Gives an item the outputs of an earlier run, or of another item or machine, whose server is `host`.
    fn take_result(
        &mut self,
        item: ItemIndex,
        outputs: Vec<Blob>,
        restored: Option<Box<Record>>,
        host: Option<String>,
    ) {
        if let Some(found) = restored {
            let record = self.restore(item, &found);
            self.context.running.set_dependencies(item, self.check.dependencies(record.reads()));
        }
        let is_published = self.context.is_published(item, &outputs);
        self.items[item].outputs = Some(outputs);
        self.items[item].found_at = host;
        if is_published {
            self.up_to_date(item, Vec::new());
        } else {
            self.items[item].phase = Phase::Busy;
            self.push(item, Task::Publish(item));
        }
    }

    /// Makes a result that was found the item's latest record.
    fn restore(&mut self, item: ItemIndex, found: &Record) -> Record {
        let reasons = self.check.reasons(item, |input| Some(self.outputs(input)));
        let causes = self.check.causes(item, &reasons, |input| self.causes(input));
        let record = self.check.restored(item, found, reasons, &causes, |input| self.outputs(input));
        self.items[item].causes = causes;
        if let Err(error) = self.check.record_restored(item, found, &record) {
            self.fatal = Some(error);
        }
        record
    }

    /// Runs an item as soon as the artifacts that it needs are in memory, or on another machine.
    fn run_when_ready(&mut self, item: ItemIndex) {
        self.items[item].phase = Phase::Busy;
        let place = self.place(item);
        if self.places.host(place).is_some() {
            return self.places.push(place, item, Task::Run(item), self.check, &self.is_wanted);
        }
        let read = self.check.stored_arrivals(item).map(|arrival| arrival.from);
        for input in distinct(read) {
            if self.items[input].handle.is_none() && self.items[input].phase == Phase::Done {
                self.items[input].handle = self.context.value_in_memory(input, self.outputs(input));
            }
            if self.items[input].handle.is_some() {
                continue;
            }
            self.items[item].missing += 1;
            self.items[input].fetchers.push(item);
            if self.items[input].fetchers.len() == 1 && self.items[input].phase == Phase::Done {
                self.push(item, Task::Fetch(input));
            }
        }
        if self.items[item].missing == 0 {
            self.push(item, Task::Run(item));
        }
    }

    /// The place where an item runs: the first that does not refuse it.
    fn place(&mut self, item: ItemIndex) -> usize {
        loop {
            let Progress { place, lost, fetchers, .. } = &self.items[item];
            let (place, is_lost) = (*place, *lost || !fetchers.is_empty());
            let candidate = Candidate { item, is_wanted: self.is_wanted[item], is_lost };
            match self.places.refuses(place, candidate) {
                Some(refusal) => self.refused(item, refusal),
                None => return place,
            }
        }
    }

    /// Sends an item to the next place.
    fn refused(&mut self, item: ItemIndex, Refusal { because, trouble }: Refusal) {
        let place = self.items[item].place;
        match trouble.map_or(Ok(None), |trouble| self.places.unable(place, &trouble)) {
            Ok(event) => event.into_iter().for_each(|event| self.report(event)),
            Err(error) => self.fatal = Some(error),
        }
        self.items[item].why_here = Some(because);
        self.items[item].place = place + 1;
    }

    fn has_run_elsewhere(&self, item: ItemIndex) -> bool {
        self.places.host(self.items[item].place).is_some()
    }

    /// Adds a task that is done on this machine.
    fn push(&mut self, item: ItemIndex, task: Task) {
        self.places.push(self.places.last(), item, task, self.check, &self.is_wanted);
    }
}
