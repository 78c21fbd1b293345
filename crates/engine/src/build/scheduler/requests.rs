//! What a task needs: the artifacts and outputs of items as they are known when it starts.

use std::sync::Arc;

use super::Scheduler;
use super::places::Next;
use super::tasks::Task;
use crate::build::run::RunRequest;
use crate::build::runner::{Request, Threads};
use crate::event::{Event, Reason};
use crate::key::Digest;
use crate::kinds::Product;
use crate::plan::ItemIndex;
use crate::storage::{Blob, Cause};

impl<'a> Scheduler<'a, '_> {
    pub(super) fn start(&mut self, next: Next, threads: &Threads<'_, 'a>) {
        let request = match next.task {
            Task::Fetch(item) => Request::Fetch(item, self.outputs(item).to_vec()),
            Task::Find(item) => Request::Find(item, self.key(item)),
            Task::Publish(item) => Request::Publish(item, self.outputs(item).to_vec()),
            Task::Run(item) => {
                let request = self.run_request(item, next.is_wanted);
                self.items[item].causes.clone_from(&request.causes);
                self.running.started(item, Arc::clone(&request.share), self.clock.elapsed());
                let (name, reasons) = (self.check.name(item), request.reasons.clone());
                self.report(Event::Started { item: name, reasons, host: self.places.host(next.place) });
                Request::Run(request)
            }
        };
        self.places.start(next, request, threads);
    }

    fn run_request(&self, item: ItemIndex, is_wanted: bool) -> RunRequest {
        let plan = self.check.plan;
        let this = &plan.items[item];
        let files = &self.check.stages[this.stage].files_taken;
        let ports = plan.stages[this.stage].inputs.iter().zip(files).zip(&this.inputs);
        let handles = ports.map(|(((port, _), file), inputs)| {
            let handles = inputs.iter().filter_map(|input| {
                let outputs = self.outputs(*input);
                let handle = match (&plan.stages[plan.items[*input].stage].product, file) {
                    (Product::Artifact(_), _) => Arc::clone(self.items[*input].handle.as_ref()?),
                    (Product::Files(_), Some(place)) => self.context.exported_file(outputs.get(*place)?),
                    (Product::Files(_), None) => self.context.exported_files(*input, outputs),
                };
                Some((plan.items[*input].key.clone(), handle))
            });
            (port.clone(), handles.collect())
        });
        let reasons = if self.items[item].lost {
            vec![Reason::ResultLost]
        } else {
            self.check.reasons(item, |input| Some(self.outputs(input)))
        };
        let causes = self.check.causes(item, &reasons, |input| self.causes(input));
        RunRequest {
            item,
            key: self.key(item),
            inputs: self.check.inputs(item, |input| self.outputs(input)),
            handles: handles.collect(),
            reasons,
            causes,
            is_wanted,
            why_here: self.items[item].why_here.clone(),
            share: Arc::default(),
        }
    }

    /// The causes of an item's present artifact: those of this build, or of the build that ran it last.
    pub(super) fn causes(&self, item: ItemIndex) -> Vec<Cause> {
        match &self.items[item].causes[..] {
            [] => self.check.last_causes(item),
            causes => causes.to_vec(),
        }
    }

    pub(super) fn key(&self, item: ItemIndex) -> Digest {
        self.check.key(item, |input| self.outputs(input))
    }

    pub(super) fn outputs(&self, item: ItemIndex) -> &[Blob] {
        match &self.items[item].outputs {
            Some(outputs) => outputs,
            None => self.check.latest(item).map_or(&[], |latest| latest.outputs()),
        }
    }
}
