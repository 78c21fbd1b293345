//! What the scheduler reports as events.

use std::time::Duration;

use super::Scheduler;
use crate::build::publish::PublishEvent;
use crate::build::removal_cause::files_changed;
use crate::build::runner::Ended;
use crate::event::{Event, ItemName, RemovalCause};
use crate::plan::ItemIndex;

impl Scheduler<'_, '_> {
    pub(super) fn report_progress(&mut self) {
        for (item, share) in self.running.due(self.clock.elapsed()) {
            self.report(Event::Progress { item: self.check.name(item), share });
        }
    }

    pub(super) fn report_time(&mut self, ended: &Ended) {
        let milliseconds = |time: Duration| time.as_secs_f64() * 1e3;
        self.report(Event::TaskTimed {
            item: self.check.name(ended.item),
            work: ended.work,
            worker: ended.worker,
            start_milliseconds: milliseconds(ended.begun.saturating_duration_since(self.clock)),
            milliseconds: milliseconds(ended.took),
        });
    }

    pub(super) fn report_all(&mut self, item: ItemIndex, events: Vec<PublishEvent>) {
        let name = self.check.name(item);
        let plan = self.check.plan;
        for event in events {
            self.report(event_of(&name, event, || files_changed(plan, item)));
        }
    }

    /// Reports that an item is up to date, and what its run warned of.
    pub(super) fn report_up_to_date(&mut self, item: ItemIndex) {
        let name = self.check.name(item);
        let host = self.items[item].found_at.clone();
        self.report(Event::UpToDate { item: name.clone(), host });
        if self.context.repeat_warnings && self.check.latest(item).is_some_and(|latest| latest.has_warned()) {
            for message in self.check.record(item).into_iter().flat_map(|record| record.warnings) {
                self.report(Event::Warning { item: name.clone(), message });
            }
        }
    }

    pub(super) fn report_messages(&mut self, item: ItemIndex, warnings: Vec<String>, notes: Vec<String>) {
        let name = self.check.name(item);
        for message in warnings {
            self.report(Event::Warning { item: name.clone(), message });
        }
        for message in notes {
            self.report(Event::Note { item: name.clone(), message });
        }
    }

    /// Reports an event, and counts files.
    pub(crate) fn report(&mut self, event: Event) {
        match &event {
            Event::Published { .. } => self.summary.published += 1,
            Event::Removed { .. } => self.summary.removed += 1,
            _ => {}
        }
        (self.events)(event);
    }
}

/// The event for a publishing step; `because` says why a file was removed.
pub(crate) fn event_of(
    name: &ItemName,
    event: PublishEvent,
    because: impl FnOnce() -> RemovalCause,
) -> Event {
    match event {
        PublishEvent::Published { file, bytes, restored } => {
            Event::Published { item: name.clone(), file, bytes, restored }
        }
        PublishEvent::Removed { file } => Event::Removed { item: name.clone(), file, because: because() },
        PublishEvent::Warning(message) => Event::Warning { item: name.clone(), message },
        PublishEvent::Note(message) => Event::Note { item: name.clone(), message },
    }
}
