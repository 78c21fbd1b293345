//! Where a build's events go.

use std::time::Instant;

use crate::event::{Event, Summary};

#[derive(Clone, Copy)]
pub(crate) struct BuildReporter<'e> {
    pub(crate) clock: Instant,
    pub(crate) events: &'e (dyn Fn(Event) + Sync),
}

impl<'e> BuildReporter<'e> {
    pub(crate) fn new(events: &'e (dyn Fn(Event) + Sync)) -> Self {
        Self { clock: Instant::now(), events }
    }

    pub(crate) fn end(self, mut summary: Summary) -> Summary {
        summary.milliseconds = self.clock.elapsed().as_secs_f64() * 1e3;
        (self.events)(Event::Ended(summary.clone()));
        summary
    }
}
