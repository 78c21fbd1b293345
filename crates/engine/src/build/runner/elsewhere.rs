//! Other machines, on each of whose items a thread here waits.

use std::time::Instant;

use super::{Candidate, Job, Request, Runner, TaskResult, Threads};
use crate::build::outcome::{Outcome, Refusal};
use crate::build::run::RunContext;
use crate::build::session::WORKER;
use crate::error::{Error, ErrorKind};
use crate::event::Event;
use crate::shared::ExecutorOptions;

/// Lets the machines of a server run items.
pub(crate) struct Elsewhere<'a> {
    context: &'a RunContext<'a>,
    options: &'a ExecutorOptions,
    /// Whether the build must not go on without the machines.
    is_required: bool,
    first_worker: usize,
    /// The threads that wait: whether each does now.
    waiting: Vec<bool>,
    /// Whether it was said that items cannot run there.
    has_told: bool,
}

impl<'a> Elsewhere<'a> {
    pub(crate) fn new(
        context: &'a RunContext<'a>,
        options: &'a ExecutorOptions,
        is_required: bool,
        first_worker: usize,
    ) -> Self {
        Self { context, options, is_required, first_worker, waiting: Vec::new(), has_told: false }
    }

    /// A number for a thread that waits, which no other has now.
    fn free_thread(&mut self) -> usize {
        let free = self.waiting.iter().position(|is_used| !is_used).unwrap_or(self.waiting.len());
        self.waiting.resize(self.waiting.len().max(free + 1), false);
        self.waiting[free] = true;
        free
    }
}

impl<'a> Runner<'a> for Elsewhere<'a> {
    fn can_start(&self, _: bool) -> bool {
        self.waiting.iter().filter(|is_used| **is_used).count() < self.options.jobs
    }

    fn start(&mut self, job: Job, threads: &Threads<'_, 'a>) {
        let (context, options) = (self.context, self.options);
        let worker = self.first_worker + self.free_thread();
        let receipt = job.receipt.clone();
        let item = receipt.item;
        let act = move || {
            job.work(worker, |request| match request {
                Request::Run(request) => TaskResult::Ran(item, context.run_elsewhere(request, options)),
                other => other.perform(context),
            });
        };
        if let Err(error) = (threads.waiting)(format!("{WORKER} e{worker}"), Box::new(act)) {
            let refusal = Refusal::by_fault(format!("a thread cannot be started: {error}"));
            receipt.send(worker, Instant::now(), TaskResult::Ran(item, Ok(Outcome::Refused(refusal))));
        }
    }

    fn ended(&mut self, worker: usize) {
        self.waiting[worker - self.first_worker] = false;
    }

    fn host(&self) -> Option<String> {
        Some(self.options.executor.host())
    }

    fn refuses(&self, Candidate { item, is_wanted, is_lost }: Candidate) -> Option<Refusal> {
        let executor = &self.options.executor;
        if is_wanted {
            Some(Refusal::of_item("a preview shows it"))
        } else if is_lost {
            Some(Refusal::of_item("its result was lost"))
        } else if !executor.is_available() {
            let because = format!("{} cannot be used", executor.host());
            Some(Refusal { because, trouble: executor.trouble() })
        } else {
            self.context.why_here(item, self.options).map(Refusal::of_item)
        }
    }

    fn unable(&mut self, trouble: &str) -> Result<Option<Event>, Error> {
        let host = self.options.executor.host();
        if self.is_required {
            let error =
                Error::new(ErrorKind::Io, format!("an item cannot run on a machine of {host}: {trouble}"));
            return Err(error.with_help("without --remote-required it would run on this machine"));
        }
        let is_new = !std::mem::replace(&mut self.has_told, true);
        let message = format!("{trouble}; items that cannot run there run on this machine");
        Ok(is_new.then_some(Event::SharedCache { host, message }))
    }
}
