//! The places where tasks are done, each with the tasks that are ready for it.

use std::sync::mpsc::{Receiver, Sender, channel};
use std::time::{Duration, Instant};

use super::tasks::{FirstTask, Length, Task, Tasks};
use crate::build::outcome::Refusal;
use crate::build::runner::{Candidate, Ended, Job, Request, Runner, Threads};
use crate::build::up_to_date::UpToDateCheck;
use crate::error::Error;
use crate::event::Event;
use crate::plan::ItemIndex;

/// The places of a build, the preferred ones first.
pub(super) struct RunnerPlaces<'a> {
    places: Vec<RunnerPlace<'a>>,
    /// The number of tasks in work.
    busy: usize,
    sender: Sender<Ended>,
    receiver: Receiver<Ended>,
}

struct RunnerPlace<'a> {
    runner: Box<dyn Runner<'a> + 'a>,
    tasks: Tasks,
    in_work: Vec<ItemInWork>,
}

struct ItemInWork {
    item: ItemIndex,
    is_wanted: bool,
    length: Length,
    begun: Instant,
}

impl RunnerPlace<'_> {
    /// Whether the most urgent task can start.
    fn can_start(&self) -> bool {
        let Some(FirstTask { is_wanted, length, .. }) = self.tasks.first() else { return false };
        // The tasks of another machine share no threads with those of this one, and it orders its own.
        let waits = |other: &ItemInWork| {
            other.is_wanted == is_wanted && length.waits_for(other.length, other.begun.elapsed())
        };
        let is_held = self.runner.host().is_none() && self.in_work.iter().any(waits);
        !is_held && self.runner.can_start(is_wanted)
    }
}

/// A task that can start, and its place.
#[derive(Clone, Copy)]
pub(super) struct Next {
    pub(super) task: Task,
    pub(super) place: usize,
    pub(super) is_wanted: bool,
    length: Length,
}

impl<'a> RunnerPlaces<'a> {
    pub(super) fn new(runners: Vec<Box<dyn Runner<'a> + 'a>>) -> Self {
        let places = runners.into_iter().map(|runner| RunnerPlace {
            runner,
            tasks: Tasks::default(),
            in_work: Vec::new(),
        });
        let (sender, receiver) = channel();
        Self { places: places.collect(), busy: 0, sender, receiver }
    }

    /// The last place: it takes every item, and all tasks that run none.
    pub(super) fn last(&self) -> usize {
        self.places.len() - 1
    }

    /// The server whose machines are a place, if it is not this machine.
    pub(super) fn host(&self, place: usize) -> Option<String> {
        self.places[place].runner.host()
    }

    pub(super) fn refuses(&self, place: usize, candidate: Candidate) -> Option<Refusal> {
        self.places[place].runner.refuses(candidate)
    }

    pub(super) fn unable(&mut self, place: usize, trouble: &str) -> Result<Option<Event>, Error> {
        self.places[place].runner.unable(trouble)
    }

    /// Adds a task of an item that is ready for a place.
    pub(super) fn push(
        &mut self,
        place: usize,
        item: ItemIndex,
        task: Task,
        check: &UpToDateCheck<'_>,
        wanted: &[bool],
    ) {
        self.places[place].tasks.push(item, task, check, wanted);
    }

    /// Sorts the tasks again: other items are wanted.
    pub(super) fn want(&mut self, wanted: &[bool]) {
        self.places.iter_mut().for_each(|place| place.tasks.want(wanted));
    }

    /// Takes the most urgent task of the first place that can start one.
    pub(super) fn next(&mut self) -> Option<Next> {
        self.places.iter_mut().enumerate().find_map(|(index, place)| {
            let first = if place.can_start() { place.tasks.pop() } else { None };
            first.map(|FirstTask { task, is_wanted, length }| Next { task, place: index, is_wanted, length })
        })
    }

    pub(super) fn start(&mut self, next: Next, request: Request, threads: &Threads<'_, 'a>) {
        let Next { task, place, is_wanted, length } = next;
        self.busy += 1;
        let job = Job::new(request, is_wanted, place, self.sender.clone());
        let place = &mut self.places[place];
        if let Task::Run(item) = task {
            place.in_work.push(ItemInWork { item, is_wanted, length, begun: Instant::now() });
        }
        place.runner.start(job, threads);
    }

    pub(super) fn are_idle(&self) -> bool {
        self.busy == 0
    }

    pub(super) fn wait(&mut self, most: Duration) -> Option<Ended> {
        let ended = self.receiver.recv_timeout(most).ok()?;
        self.busy -= 1;
        let place = &mut self.places[ended.place];
        place.in_work.retain(|other| other.item != ended.item);
        place.runner.ended(ended.worker);
        Some(ended)
    }
}
