//! Where a task is done: on threads here, or on another machine.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::mpsc::Sender;
use std::time::{Duration, Instant};

use rayon::Scope;

use super::tasks::{Lane, Task};
use super::{Message, Scheduler, WorkSpan};
use crate::build::outcome::Outcome;
use crate::build::run::message_of;
use crate::build::session::WORKER;
use crate::error::{Error, ErrorKind};
use crate::event::{Event, Work};
use crate::own_time::own_time;
use crate::plan::ItemIndex;
use crate::shared::ExecutorOptions;

impl<'a> Scheduler<'a, '_> {
    /// The most urgent task, if a thread is free for it, and its lane.
    pub(super) fn next_task(&mut self) -> Option<(Task, Lane)> {
        let [others, wanted, elsewhere] = self.busy;
        if self.is_stopping() {
            return None;
        }
        if let Some(options) = self.executor()
            && elsewhere < options.jobs
            && let Some((task, _)) = self.elsewhere.pop()
        {
            return Some((task, Lane::Elsewhere));
        }
        let may_start = if self.tasks.has_wanted() {
            wanted < self.jobs
        } else {
            // Others would pause at once.
            wanted == 0 && others < self.jobs
        };
        let (task, is_wanted) = if may_start { self.tasks.pop() } else { None }?;
        Some((task, if is_wanted { Lane::Wanted } else { Lane::Others }))
    }

    /// The machines that run items.
    pub(super) fn executor(&self) -> Option<&'a ExecutorOptions> {
        self.context.shared.and_then(|shared| shared.executor.as_ref())
    }

    /// Starts a task in a lane: on a thread of a pool, or on one of its own that waits for another machine.
    pub(super) fn start<'s, 't>(
        &mut self,
        task: Task,
        lane: Lane,
        [others, wanted]: [&Scope<'s>; 2],
        waiting: &'t std::thread::Scope<'t, '_>,
        sender: &Sender<(WorkSpan, Message)>,
    ) where
        'a: 's + 't,
    {
        let context = self.context;
        let sender = sender.clone();
        self.busy[lane as usize] += 1;
        let is_wanted = lane == Lane::Wanted;
        let gate = is_wanted.then(|| self.context.gate.close());
        let first_worker = self.first_worker(lane);
        let (item, work, act): (_, _, Box<dyn FnOnce() -> Message + Send + 'a>) = match task {
            Task::Fetch(item) => {
                let digest = self.digest(item);
                (item, Work::Fetch, Box::new(move || Message::Fetched(item, context.fetch(item, digest))))
            }
            Task::Find(item) => {
                let key = self.key(item);
                (
                    item,
                    Work::Fetch,
                    Box::new(move || Message::Found(item, context.find(item, key).map(Box::new))),
                )
            }
            Task::Publish(item) => {
                let outputs = self.outputs(item).to_vec();
                let act = move || {
                    let mut events = Vec::new();
                    let result = context.publish(item, &outputs, None, &mut events);
                    Message::Published(item, events, result)
                };
                (item, Work::Publish, Box::new(act))
            }
            Task::Run(item) => {
                let request = self.request(item, is_wanted);
                self.items[item].causes.clone_from(&request.causes);
                self.running.started(item, Arc::clone(&request.share), self.clock.elapsed());
                let elsewhere = self.executor().filter(|_| lane == Lane::Elsewhere);
                let host = elsewhere.map(|options| options.executor.host());
                let (name, reasons) = (self.check.name(item), request.reasons.clone());
                self.report(Event::Started { item: name, reasons, host });
                let act: Box<dyn FnOnce() -> Message + Send + 'a> = match elsewhere {
                    None => Box::new(move || Message::Ran(item, context.run(request))),
                    Some(options) => {
                        Box::new(move || Message::Ran(item, context.run_elsewhere(request, options)))
                    }
                };
                (item, Work::Run, act)
            }
        };
        let unstarted = sender.clone();
        let act = move |worker: usize| {
            let begun = Instant::now();
            let (message, _) = own_time(|| catch_unwind(AssertUnwindSafe(act)));
            let message = message
                .unwrap_or_else(|panic| Message::Panicked(item, message_of(panic.as_ref()).to_owned()));
            drop(gate);
            let span = WorkSpan { item, work, lane, worker, begun, took: begun.elapsed() };
            let _ = sender.send((span, message));
        };
        let of_pool = move || first_worker + rayon::current_thread_index().unwrap_or(0);
        match lane {
            Lane::Others => others.spawn(move |_| act(of_pool())),
            Lane::Wanted => wanted.spawn(move |_| act(of_pool())),
            Lane::Elsewhere => {
                let worker = first_worker + self.free_thread();
                let thread = std::thread::Builder::new().name(format!("{WORKER} e{worker}"));
                if let Err(error) = thread.spawn_scoped(waiting, move || act(worker)) {
                    let because = format!("a thread cannot be started: {error}");
                    let span =
                        WorkSpan { item, work, lane, worker, begun: Instant::now(), took: Duration::ZERO };
                    let _ = unstarted.send((span, Message::Ran(item, Ok(Outcome::NoMachine { because }))));
                }
            }
        }
    }

    pub(super) fn first_worker(&self, lane: Lane) -> usize {
        lane as usize * self.jobs
    }

    /// A number for a thread that waits for another machine, which no other has now.
    fn free_thread(&mut self) -> usize {
        let free = self.waiting.iter().position(|is_used| !is_used).unwrap_or(self.waiting.len());
        self.waiting.resize(self.waiting.len().max(free + 1), false);
        self.waiting[free] = true;
        free
    }

    /// Whether an item may run elsewhere; if not, remembers why.
    pub(super) fn runs_elsewhere(&mut self, item: ItemIndex) -> bool {
        let Some(options) = self.executor() else { return false };
        if self.items[item].why_here.is_some() {
            return false;
        }
        let why = if self.is_wanted[item] {
            Some("somebody looks at it".into())
        } else if self.items[item].lost || !self.items[item].fetchers.is_empty() {
            Some("its result was lost".into())
        } else if !options.executor.is_available() {
            if let Some(trouble) = options.executor.trouble() {
                self.report_unable(&trouble);
            }
            Some(format!("{} cannot be used", options.executor.host()))
        } else {
            self.context.why_here(item, options)
        };
        self.items[item].why_here = why;
        self.items[item].why_here.is_none()
    }

    /// Reports, once in a build, that items cannot run elsewhere; if they have to, the build ends.
    pub(super) fn report_unable(&mut self, why: &str) {
        let Some(options) = self.context.shared else { return };
        let Some(executor) = &options.executor else { return };
        let host = executor.executor.host();
        if options.is_required {
            let error =
                Error::new(ErrorKind::Io, format!("an item cannot run on a machine of {host}: {why}"));
            self.fatal = Some(error.with_help("without --remote-required it runs here"));
        } else if !std::mem::replace(&mut self.has_told, true) {
            let message = format!("{why}; what cannot run there runs here");
            self.report(Event::SharedCache { host, message });
        }
    }

    pub(super) fn has_run_elsewhere(&self, item: ItemIndex) -> bool {
        self.executor().is_some() && self.items[item].why_here.is_none()
    }
}
