//! Where a task is done: on threads here, or on another machine.

use super::Scheduler;
use super::tasks::{Lane, Task};
use crate::error::{Error, ErrorKind};
use crate::event::Event;
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
