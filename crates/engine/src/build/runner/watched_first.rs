//! Prefers what somebody looks at; `wanted.rs` says what becomes of the rest.

use std::sync::Arc;

use super::{Job, Local, Pool, Runner, Threads};
use crate::build::run::RunContext;
use crate::kinds::Gate;

/// Does tasks on two pools of threads, of which one is for items that somebody looks at. While that one has
/// tasks, no others start, and those that run pause at a gate.
pub(crate) struct WatchedFirst<'a> {
    wanted: Local<'a>,
    others: Local<'a>,
    gate: Arc<Gate>,
}

impl<'a> WatchedFirst<'a> {
    /// The threads of a build, of which both pools have `jobs`. The workers are numbered from 0.
    pub(crate) fn new(context: &'a RunContext<'a>, jobs: usize) -> Self {
        let others = Local::new(context, Pool::Others, jobs, 0);
        let wanted = Local::new(context, Pool::Wanted, jobs, jobs);
        Self { wanted, others, gate: Arc::clone(&context.gate) }
    }

    pub(crate) fn workers(&self) -> usize {
        self.others.workers() + self.wanted.workers()
    }
}

impl<'a> Runner<'a> for WatchedFirst<'a> {
    fn can_start(&self, is_wanted: bool) -> bool {
        if is_wanted {
            self.wanted.can_start(true)
        } else {
            // Others would pause at once.
            self.wanted.is_idle() && self.others.can_start(false)
        }
    }

    fn start(&mut self, job: Job, threads: &Threads<'_, 'a>) {
        if job.is_wanted {
            self.wanted.start_keeping(job, self.gate.close(), threads);
        } else {
            self.others.start(job, threads);
        }
    }

    fn ended(&mut self, worker: usize) {
        let pool = if self.wanted.has(worker) { &mut self.wanted } else { &mut self.others };
        pool.ended(worker);
    }
}
