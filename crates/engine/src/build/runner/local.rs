//! A pool of threads on this machine.

use super::{Job, Runner, Threads};
use crate::build::run::RunContext;

/// A pool of threads of the build.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Pool {
    /// The pool for items that nobody waits for.
    Others,
    /// The pool for items that somebody looks at.
    Wanted,
}

/// Does tasks on the threads of one pool.
pub(crate) struct Local<'a> {
    context: &'a RunContext<'a>,
    pool: Pool,
    jobs: usize,
    first_worker: usize,
    /// The number of tasks in work.
    busy: usize,
}

impl<'a> Local<'a> {
    /// The threads of a pool, of which there are `jobs`.
    pub(crate) fn new(context: &'a RunContext<'a>, pool: Pool, jobs: usize, first_worker: usize) -> Self {
        Self { context, pool, jobs, first_worker, busy: 0 }
    }

    pub(super) fn workers(&self) -> usize {
        self.jobs
    }

    pub(super) fn is_idle(&self) -> bool {
        self.busy == 0
    }

    pub(super) fn has(&self, worker: usize) -> bool {
        (self.first_worker..self.first_worker + self.jobs).contains(&worker)
    }

    /// Starts a task. What is `kept` is dropped when it ends.
    pub(super) fn start_keeping<T: Send + 'a>(&mut self, job: Job, kept: T, threads: &Threads<'_, 'a>) {
        self.busy += 1;
        let (context, first_worker) = (self.context, self.first_worker);
        let scope = match self.pool {
            Pool::Others => threads.others,
            Pool::Wanted => threads.wanted,
        };
        scope.spawn(move |_| {
            let worker = first_worker + rayon::current_thread_index().unwrap_or(0);
            job.work(worker, |request| {
                let _kept = kept;
                request.perform(context)
            });
        });
    }
}

impl<'a> Runner<'a> for Local<'a> {
    fn can_start(&self, _: bool) -> bool {
        self.busy < self.jobs
    }

    fn start(&mut self, job: Job, threads: &Threads<'_, 'a>) {
        self.start_keeping(job, (), threads);
    }

    fn ended(&mut self, _: usize) {
        self.busy -= 1;
    }
}
