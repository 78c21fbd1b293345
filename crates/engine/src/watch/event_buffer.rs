//! Holds back the events of a build that no change triggered, until one of them is news.
//!
//! A watcher builds again to make sure that it watches everything, and to retry what the system refused. If
//! such a build finds nothing to do, or fails in the same way as the one before it, it is not reported.

use std::collections::{BTreeMap, BTreeSet};

use parking_lot::Mutex;

use crate::error::Error;
use crate::event::{Event, ItemName};

/// The errors that were reported and still stand.
#[derive(Default)]
pub(super) struct OutstandingErrors {
    /// Why the last build could not go on.
    build: Option<Error>,
    /// Why items failed, and what to do about it.
    items: BTreeMap<ItemName, (Vec<String>, Option<String>)>,
}

impl OutstandingErrors {
    /// Whether this error of a build as a whole was reported and still stands.
    pub(super) fn has(&self, error: &Error) -> bool {
        self.build.as_ref() == Some(error)
    }

    /// Notes that an error of a build as a whole was reported.
    pub(super) fn build_failed(&mut self, error: Error) {
        self.build = Some(error);
    }

    fn update(&mut self, event: &Event) {
        match event {
            Event::Planned { .. } => self.build = None,
            Event::UpToDate { item, .. } | Event::Finished { item, .. } => _ = self.items.remove(item),
            Event::Failed { item, error, help } => {
                self.items.insert(item.clone(), (error.clone(), help.clone()));
            }
            _ => {}
        }
    }
}

/// Holds back the events of a build until one of them is news.
pub(super) struct EventBuffer<'a> {
    events: &'a (dyn Fn(Event) + Sync),
    /// Whether a change triggered the build: then all of it is reported.
    is_triggered: bool,
    state: Mutex<BufferState<'a>>,
}

struct BufferState<'a> {
    outstanding: &'a mut OutstandingErrors,
    /// The events that are held back; `None` after an event was news.
    held: Option<Vec<Event>>,
    failed: BTreeSet<ItemName>,
}

impl<'a> EventBuffer<'a> {
    pub(super) fn new(
        events: &'a (dyn Fn(Event) + Sync),
        is_triggered: bool,
        outstanding: &'a mut OutstandingErrors,
    ) -> Self {
        let state = BufferState { outstanding, held: Some(Vec::new()), failed: BTreeSet::new() };
        Self { events, is_triggered, state: Mutex::new(state) }
    }

    /// Reports an event and those that were held back before it, or holds it back.
    pub(super) fn push(&self, event: Event) {
        let mut state = self.state.lock();
        // A build that cannot begin reports nothing but its plan.
        let is_news =
            if self.is_triggered { !matches!(event, Event::Planned { .. }) } else { state.is_news(&event) };
        match &event {
            Event::Failed { item, .. } => _ = state.failed.insert(item.clone()),
            // The build has reported every item.
            Event::Ended(summary) if is_news && !summary.cancelled => {
                let BufferState { outstanding, failed, .. } = &mut *state;
                outstanding.items.retain(|item, _| failed.contains(item));
            }
            _ => {}
        }
        if let (Some(held), false) = (&mut state.held, is_news) {
            // The items that are up to date may be very many, and progress is of no interest later.
            if self.is_triggered || !matches!(event, Event::UpToDate { .. } | Event::Progress { .. }) {
                held.push(event);
            }
            return;
        }
        for event in state.held.take().into_iter().flatten().chain([event]) {
            state.outstanding.update(&event);
            (self.events)(event);
        }
    }

    /// Reports an event that is not one of the build.
    pub(super) fn report_now(&self, event: Event) {
        // With the lock, so that events come one at a time.
        let _state = self.state.lock();
        (self.events)(event);
    }
}

impl BufferState<'_> {
    /// Whether an event of a build that no change triggered is worth reporting.
    fn is_news(&self, event: &Event) -> bool {
        let OutstandingErrors { build, items } = &*self.outstanding;
        // If the last build failed as a whole, only the end of this one shows whether it gets further.
        let is_known = |item| build.is_some() || items.contains_key(item);
        match event {
            Event::ManifestWarnings { .. }
            | Event::Finished { .. }
            | Event::Published { .. }
            | Event::Removed { .. } => true,
            Event::UpToDate { item, .. } => items.contains_key(item),
            Event::Started { item, .. } | Event::Warning { item, .. } => !is_known(item),
            Event::Failed { item, error, help } => {
                let before = items.get(item).map(|(error, help)| (error, help));
                build.is_none() && before != Some((error, help))
            }
            Event::Ended(summary) => {
                let is_same = build.is_none() && items.keys().all(|item| self.failed.contains(item));
                !summary.cancelled && !is_same
            }
            Event::Waiting { .. } => build.is_none() && items.is_empty(),
            _ => false,
        }
    }
}
