//! Where tasks are done: on threads here, or on other machines.
//!
//! A [`Runner`] is a place that can do tasks. The scheduler has a list of them and knows nothing else of
//! them: an item runs in the first place that does not refuse it, and the last place, which refuses nothing,
//! does everything else. [`Local`] has a pool of threads, [`WatchedFirst`] two of them, so that what somebody
//! looks at does not wait for anything else, and [`Elsewhere`] sends items to other machines.

use std::io;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::mpsc::Sender;
use std::time::{Duration, Instant};

use rayon::Scope;

use super::outcome::{Outcome, Refusal};
use super::publish::{PublishError, PublishEvent};
use super::run::{RunContext, RunRequest, message_of};
use crate::error::Error;
use crate::event::{Event, Work};
use crate::key::Digest;
use crate::kinds::Handle;
use crate::own_time::own_time;
use crate::plan::ItemIndex;
use crate::storage::{Blob, Record};

mod elsewhere;
mod local;
mod watched_first;

pub(crate) use elsewhere::Elsewhere;
pub(crate) use local::{Local, Pool};
pub(crate) use watched_first::WatchedFirst;

/// A place where tasks are done.
pub(crate) trait Runner<'a>: Send {
    /// Whether a task can start now: one of an item that somebody looks at, or another.
    fn can_start(&self, is_wanted: bool) -> bool;

    /// Starts a task, after [`Runner::can_start`] said that it can. It is done by a worker, of which no other
    /// place has the number.
    fn start(&mut self, job: Job, threads: &Threads<'_, 'a>);

    fn ended(&mut self, worker: usize);

    /// The server whose machines do the tasks, for messages; `None`: they are done on this machine.
    fn host(&self) -> Option<String> {
        None
    }

    /// Why an item does not run in this place; `None` if it may.
    fn refuses(&self, _: Candidate) -> Option<Refusal> {
        None
    }

    /// What is reported if something is wrong with the place, so that its items go to the next one.
    ///
    /// # Errors
    /// If the build must not go on without the place.
    fn unable(&mut self, _trouble: &str) -> Result<Option<Event>, Error> {
        Ok(None)
    }
}

/// An item for which a place is chosen.
#[derive(Clone, Copy)]
pub(crate) struct Candidate {
    pub(crate) item: ItemIndex,
    pub(crate) is_wanted: bool,
    /// Whether it has to run again because its stored result is lost.
    pub(crate) is_lost: bool,
}

/// A task of an item, with what it needs.
pub(crate) enum Request {
    Run(RunRequest),
    /// Read the stored artifact of the item, or the files that are read, for those that need it.
    Fetch(ItemIndex, Vec<Blob>),
    /// Ask other machines for the result with this key.
    Find(ItemIndex, Digest),
    Publish(ItemIndex, Vec<Blob>),
}

impl Request {
    fn item(&self) -> ItemIndex {
        match self {
            Self::Run(request) => request.item,
            Self::Fetch(item, _) | Self::Publish(item, _) | Self::Find(item, _) => *item,
        }
    }

    fn work(&self) -> Work {
        match self {
            Self::Run(_) => Work::Run,
            Self::Fetch(..) | Self::Find(..) => Work::Fetch,
            Self::Publish(..) => Work::Publish,
        }
    }

    /// Does the task on this machine.
    fn perform(self, context: &RunContext<'_>) -> TaskResult {
        match self {
            Self::Run(request) => TaskResult::Ran(request.item, context.run(request)),
            Self::Fetch(item, outputs) => TaskResult::Fetched(item, context.fetch(item, &outputs)),
            Self::Find(item, key) => TaskResult::Found(item, context.find(item, key).map(Box::new)),
            Self::Publish(item, outputs) => {
                let mut events = Vec::new();
                let result = context.publish(item, &outputs, None, &mut events);
                TaskResult::Published(item, events, result)
            }
        }
    }
}

/// What became of a task.
pub(crate) enum TaskResult {
    Fetched(ItemIndex, Result<Option<Arc<Handle>>, Error>),
    Found(ItemIndex, Option<Box<Record>>),
    Ran(ItemIndex, Result<Outcome, Error>),
    Published(ItemIndex, Vec<PublishEvent>, Result<(), PublishError>),
    /// The engine itself panicked in a task, with this message.
    Panicked(ItemIndex, String),
}

pub(crate) struct Ended {
    pub(crate) item: ItemIndex,
    pub(crate) work: Work,
    pub(crate) place: usize,
    pub(crate) worker: usize,
    pub(crate) begun: Instant,
    pub(crate) took: Duration,
    pub(crate) message: TaskResult,
}

pub(crate) struct Job {
    pub(crate) request: Request,
    pub(crate) is_wanted: bool,
    pub(crate) receipt: Receipt,
}

impl Job {
    /// A task for the place of this index; `sender` gets what becomes of it.
    pub(crate) fn new(request: Request, is_wanted: bool, place: usize, sender: Sender<Ended>) -> Self {
        let receipt = Receipt { item: request.item(), work: request.work(), place, sender };
        Self { request, is_wanted, receipt }
    }

    /// Does the task by `act` on the thread of a worker.
    fn work(self, worker: usize, act: impl FnOnce(Request) -> TaskResult) {
        let Self { request, receipt, .. } = self;
        let begun = Instant::now();
        let (message, _) = own_time(|| catch_unwind(AssertUnwindSafe(|| act(request))));
        let message = message.unwrap_or_else(|panic| {
            TaskResult::Panicked(receipt.item, message_of(panic.as_ref()).to_owned())
        });
        receipt.send(worker, begun, message);
    }
}

/// Sends what becomes of a task.
#[derive(Clone)]
pub(crate) struct Receipt {
    item: ItemIndex,
    work: Work,
    place: usize,
    sender: Sender<Ended>,
}

impl Receipt {
    fn send(self, worker: usize, begun: Instant, message: TaskResult) {
        let Self { item, work, place, sender } = self;
        let _ = sender.send(Ended { item, work, place, worker, begun, took: begun.elapsed(), message });
    }
}

/// A task on its way to a thread.
pub(crate) type Act<'a> = Box<dyn FnOnce() + Send + 'a>;

pub(crate) struct Threads<'t, 'a> {
    /// The threads for items that nobody waits for.
    pub(crate) others: &'t Scope<'a>,
    /// The threads for items that somebody looks at.
    pub(crate) wanted: &'t Scope<'a>,
    /// Starts a thread of this name that only waits.
    pub(crate) waiting: &'t dyn Fn(String, Act<'a>) -> io::Result<()>,
}
