//! Which events of a build say something new: a build that nobody asked for is reported only if it does.
//!
//! A watcher looks again to make sure that it attends to everything, and tries again what the system refused. If such a
//! build finds nothing to do, or fails as the one before it did, nobody wants to read of it.

use std::collections::{BTreeMap, BTreeSet};

use parking_lot::Mutex;

use crate::{Error, Event, ItemName};

/// The errors that were reported and still stand.
#[derive(Default)]
pub(super) struct OutstandingErrors {
    /// Why the last build could not go on.
    build: Option<Error>,
    /// Why items failed, and what to do about it.
    items: BTreeMap<ItemName, (Vec<String>, Option<String>)>,
}

impl OutstandingErrors {
    /// Whether an error of a build as a whole was reported and stands.
    pub(super) fn has(&self, error: &Error) -> bool {
        self.build.as_ref() == Some(error)
    }

    /// An error of a build as a whole is reported.
    pub(super) fn hindered(&mut self, error: Error) {
        self.build = Some(error);
    }

    /// An event is reported.
    fn take(&mut self, event: &Event) {
        match event {
            Event::Planned { .. } => self.build = None,
            Event::UpToDate { item } | Event::Finished { item, .. } => _ = self.items.remove(item),
            Event::Failed { item, error, help } => {
                self.items.insert(item.clone(), (error.clone(), help.clone()));
            }
            _ => {}
        }
    }
}

/// Holds the events of a build back until one of them says something new.
pub(super) struct EventBuffer<'a> {
    events: &'a (dyn Fn(Event) + Sync),
    /// Whether a change is known that the build is the answer to: then all of it is reported.
    is_asked_for: bool,
    state: Mutex<State<'a>>,
}

struct State<'a> {
    outstanding: &'a mut OutstandingErrors,
    /// What is held back; `None` once there was something new.
    held: Option<Vec<Event>>,
    /// The items that failed in this build.
    failed: BTreeSet<ItemName>,
}

impl<'a> EventBuffer<'a> {
    pub(super) fn new(
        events: &'a (dyn Fn(Event) + Sync),
        is_asked_for: bool,
        outstanding: &'a mut OutstandingErrors,
    ) -> Self {
        let state = State { outstanding, held: Some(Vec::new()), failed: BTreeSet::new() };
        Self { events, is_asked_for, state: Mutex::new(state) }
    }

    /// Reports an event and what was held back before it, or holds it back.
    pub(super) fn tell(&self, event: Event) {
        let mut state = self.state.lock();
        // A build that cannot begin has told its plan only.
        let is_news =
            if self.is_asked_for { !matches!(event, Event::Planned { .. }) } else { state.is_news(&event) };
        match &event {
            Event::Failed { item, .. } => _ = state.failed.insert(item.clone()),
            // The build has spoken of every item that there is.
            Event::Ended(summary) if is_news && !summary.cancelled => {
                let State { outstanding, failed, .. } = &mut *state;
                outstanding.items.retain(|item, _| failed.contains(item));
            }
            _ => {}
        }
        if let (Some(held), false) = (&mut state.held, is_news) {
            // Of a build that nobody asked for nobody wants to read what did not change, and that may be very much.
            if self.is_asked_for || !matches!(event, Event::UpToDate { .. }) {
                held.push(event);
            }
            return;
        }
        for event in state.held.take().into_iter().flatten().chain([event]) {
            state.outstanding.take(&event);
            (self.events)(event);
        }
    }
}

impl State<'_> {
    /// Whether an event of a build that nobody asked for is worth reporting.
    fn is_news(&self, event: &Event) -> bool {
        let OutstandingErrors { build, items } = &*self.outstanding;
        // Where the last build could not go on, it is known at the end only whether this one gets further.
        let is_known = |item| build.is_some() || items.contains_key(item);
        match event {
            Event::Finished { .. } | Event::Published { .. } | Event::Removed { .. } => true,
            Event::UpToDate { item } => items.contains_key(item),
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
