//! The places where tasks are done, each with the tasks that are ready for it.

use std::sync::mpsc::{Receiver, Sender, channel};
use std::time::Duration;

use super::tasks::{Task, Tasks};
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
}

/// A task that can start, and its place.
#[derive(Clone, Copy)]
pub(super) struct Next {
    pub(super) task: Task,
    pub(super) place: usize,
    pub(super) is_wanted: bool,
}

impl<'a> RunnerPlaces<'a> {
    pub(super) fn new(runners: Vec<Box<dyn Runner<'a> + 'a>>) -> Self {
        let places = runners.into_iter().map(|runner| RunnerPlace { runner, tasks: Tasks::default() });
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
        self.places.iter_mut().enumerate().find_map(|(index, RunnerPlace { runner, tasks })| {
            let can_start = runner.can_start(tasks.has_wanted());
            let (task, is_wanted) = if can_start { tasks.pop() } else { None }?;
            Some(Next { task, place: index, is_wanted })
        })
    }

    pub(super) fn start(&mut self, next: Next, request: Request, threads: &Threads<'_, 'a>) {
        let Next { place, is_wanted, .. } = next;
        self.busy += 1;
        let job = Job::new(request, is_wanted, place, self.sender.clone());
        self.places[place].runner.start(job, threads);
    }

    pub(super) fn are_idle(&self) -> bool {
        self.busy == 0
    }

    pub(super) fn wait(&mut self, most: Duration) -> Option<Ended> {
        let ended = self.receiver.recv_timeout(most).ok()?;
        self.busy -= 1;
        self.places[ended.place].runner.ended(ended.worker);
        Some(ended)
    }
}
