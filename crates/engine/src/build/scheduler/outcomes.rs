//! Handles what workers report: what becomes of the item, and of the items that wait for it.

use std::any::Any;
use std::cmp::Reverse;
use std::sync::Arc;

use super::Scheduler;
use super::items::{Phase, distinct};
use super::tasks::Task;
use crate::build::outcome::Outcome;
use crate::build::publish::{PublishError, PublishEvent};
use crate::build::run::failure_of;
use crate::build::runner::TaskResult;
use crate::error::{Error, ErrorKind};
use crate::event::{Event, ItemName};
use crate::kinds::Failure;
use crate::plan::ItemIndex;
use crate::storage::Blob;

impl Scheduler<'_, '_> {
    pub(super) fn handle(&mut self, message: TaskResult) {
        match message {
            TaskResult::Fetched(item, Ok(Some(handle))) => {
                // Its consumers may have been skipped meanwhile.
                if self.items[item].users > 0 {
                    self.items[item].handle = Some(handle);
                }
                self.release_fetchers(item);
            }
            TaskResult::Fetched(item, Ok(None)) => self.make_again(item),
            TaskResult::Fetched(item, Err(error)) => {
                self.reopen(item);
                self.fail(item, &failure_of(error));
            }
            TaskResult::Found(item, None) => {
                self.items[item].is_missed = true;
                self.run_when_ready(item);
            }
            TaskResult::Found(item, Some(record)) => {
                let host = record.shared.as_ref().map(|shared| shared.host.clone());
                self.take_result(item, record.outputs.clone(), Some(record), host);
            }
            TaskResult::Ran(item, Ok(outcome)) => self.handle_outcome(item, outcome),
            TaskResult::Ran(_, Err(error)) => self.fatal = Some(error),
            TaskResult::Published(item, events, Ok(())) => self.up_to_date(item, events),
            TaskResult::Published(item, _, Err(PublishError::ResultLost)) => {
                self.items[item].lost = true;
                self.run_when_ready(item);
            }
            TaskResult::Published(item, events, Err(PublishError::Error(error))) => {
                self.report_all(item, events);
                self.fail(item, &failure_of(error));
            }
            TaskResult::Panicked(item, message) => {
                let name = self.check.name(item);
                let error = Error::new(ErrorKind::Io, format!("the engine panicked at {name}: {message}"));
                self.fatal = Some(error.with_help(
                    "this is a bug in Specula; please report it with the output of RUST_BACKTRACE=1",
                ));
            }
        }
    }

    fn handle_outcome(&mut self, item: ItemIndex, outcome: Outcome) {
        match outcome {
            Outcome::Stopped => self.stopped(item),
            Outcome::Failed { failure, paths, .. } if !failure.system_error && self.heard.affect(&paths) => {
                self.stopped(item);
            }
            Outcome::Failed { failure, warnings, notes, lines, .. } => {
                if let Err(error) = self.check.state.journal.append(&lines) {
                    self.fatal = Some(error);
                    return;
                }
                self.report_messages(item, warnings, notes);
                self.fail(item, &failure);
            }
            Outcome::Made { outputs, value, milliseconds, warnings, notes, events, unpublished } => {
                self.summary.ran_elsewhere += usize::from(self.has_run_elsewhere(item));
                self.report_messages(item, warnings, notes);
                if let Some(error) = unpublished {
                    self.report_all(item, events);
                    return self.fail(item, &unpublished_failure(error));
                }
                let before = self.check.latest(item).map(|latest| latest.outputs());
                let changed = before != Some(outputs.as_slice());
                self.summary.ran += 1;
                self.report(Event::Finished { item: self.check.name(item), milliseconds, changed });
                self.report_all(item, events);
                self.keep_result(item, outputs, value);
                self.complete(item);
                self.release_fetchers(item);
            }
            Outcome::Refused(refusal) => {
                self.refused(item, refusal);
                self.run_when_ready(item);
            }
        }
    }

    fn stopped(&mut self, item: ItemIndex) {
        // Even if nothing else is stopped, because only this item's file is being written.
        self.summary.cancelled = true;
        self.skip(item, None);
    }

    /// Keeps the outputs of an item that ran, and its value for those who may still need it.
    fn keep_result(
        &mut self,
        item: ItemIndex,
        outputs: Vec<Blob>,
        value: Option<Arc<dyn Any + Send + Sync>>,
    ) {
        let artifact = self.check.stages[self.check.plan.items[item].stage].artifact;
        let progress = &mut self.items[item];
        progress.ran = true;
        if let (Some(value), Some((type_name, _)), true) = (value, artifact, progress.users > 0) {
            let handle = self.context.handle(type_name, outputs[0].digest).with_value(value);
            progress.handle = Some(Arc::new(handle));
        }
        progress.outputs = Some(outputs);
    }

    pub(super) fn up_to_date(&mut self, item: ItemIndex, events: Vec<PublishEvent>) {
        self.summary.up_to_date += 1;
        self.summary.shared += usize::from(self.items[item].found_at.is_some());
        self.report_up_to_date(item);
        self.report_all(item, events);
        self.complete(item);
    }

    /// The artifact of an item that was up to date is no longer in the store.
    fn make_again(&mut self, item: ItemIndex) {
        self.reopen(item);
        self.items[item].lost = true;
        self.run_when_ready(item);
    }

    /// Undoes that an item was finished.
    fn reopen(&mut self, item: ItemIndex) {
        if self.items[item].ran {
            self.summary.ran -= 1;
            self.summary.ran_elsewhere -= usize::from(self.has_run_elsewhere(item));
        } else {
            self.summary.up_to_date -= 1;
            self.summary.shared -= usize::from(self.items[item].found_at.is_some());
        }
        for input in distinct(self.check.plan.items[item].inputs.iter().flatten().copied()) {
            self.items[input].users += 1;
        }
    }

    fn fail(&mut self, item: ItemIndex, failure: &Failure) {
        let name = self.check.name(item);
        self.summary.failed += 1;
        self.count_kept(item);
        if failure.system_error {
            self.summary.system_errors += 1;
        } else {
            self.failed.push(item);
        }
        let (error, help) = (failure.chain.clone(), failure.help.clone());
        self.report(Event::Failed { item: name.clone(), error, help });
        self.finish_without_result(item, &name);
    }

    pub(super) fn skip(&mut self, item: ItemIndex, because: Option<ItemName>) {
        let name = self.check.name(item);
        self.summary.skipped += 1;
        self.count_kept(item);
        self.report(Event::Skipped { item: name.clone(), because: because.clone() });
        match because {
            Some(root) => self.finish_without_result(item, &root),
            // The build is being stopped: the rest is skipped at its end.
            None => self.items[item].phase = Phase::Stopped,
        }
    }

    /// Counts an item that did not run and has outputs of an earlier run.
    fn count_kept(&mut self, item: ItemIndex) {
        let is_kept = self.check.latest(item).is_some_and(|latest| !latest.outputs().is_empty());
        self.summary.kept += usize::from(is_kept);
    }

    fn finish_without_result(&mut self, item: ItemIndex, root: &ItemName) {
        self.items[item].phase = Phase::Failed(root.clone());
        self.finish(item);
        for waiter in std::mem::take(&mut self.items[item].fetchers) {
            if self.items[waiter].phase == Phase::Busy {
                self.skip(waiter, Some(root.clone()));
            }
        }
    }

    fn complete(&mut self, item: ItemIndex) {
        self.items[item].phase = Phase::Done;
        self.finish(item);
    }

    /// Informs the consumers of a finished item, and drops the artifacts that only it still needed.
    fn finish(&mut self, item: ItemIndex) {
        for input in distinct(self.check.plan.items[item].inputs.iter().flatten().copied()) {
            let input = &mut self.items[input];
            input.users = input.users.saturating_sub(1);
            if input.users == 0 {
                input.handle = None;
            }
        }
        if std::mem::replace(&mut self.items[item].announced, true) {
            return;
        }
        for index in 0..self.items[item].consumers.len() {
            let consumer = self.items[item].consumers[index];
            self.items[consumer].waiting -= 1;
            if self.items[consumer].waiting == 0 {
                self.to_check.push(Reverse(consumer));
            }
        }
    }

    fn release_fetchers(&mut self, item: ItemIndex) {
        for waiter in std::mem::take(&mut self.items[item].fetchers) {
            self.items[waiter].missing -= 1;
            if self.items[waiter].missing == 0 && self.items[waiter].phase == Phase::Busy {
                self.push(waiter, Task::Run(waiter));
            }
        }
    }

    pub(super) fn skip_the_rest(&mut self) {
        self.summary.cancelled |= self.is_cancelled();
        for index in 0..self.selected.len() {
            let item = self.selected[index];
            if matches!(self.items[item].phase, Phase::Waiting | Phase::Busy) {
                let root = self.failed_input(item);
                self.summary.skipped += 1;
                self.count_kept(item);
                let name = self.check.name(item);
                if let Some(root) = &root {
                    self.items[item].phase = Phase::Failed(root.clone());
                }
                self.report(Event::Skipped { item: name, because: root });
            }
        }
    }

    /// The failed item because of which this one cannot run.
    pub(super) fn failed_input(&self, item: ItemIndex) -> Option<ItemName> {
        let inputs = self.check.plan.items[item].inputs.iter().flatten();
        inputs.into_iter().find_map(|input| match &self.items[*input].phase {
            Phase::Failed(root) => Some(root.clone()),
            _ => None,
        })
    }
}

/// The failure of an item whose outputs were made, and whose files could not be published.
fn unpublished_failure(error: PublishError) -> Failure {
    match error {
        PublishError::ResultLost => Failure::new("a result that was just stored is gone").system_error(),
        PublishError::Error(error) => failure_of(error),
    }
}
