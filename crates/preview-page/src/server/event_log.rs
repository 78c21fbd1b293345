//! The events that pages are sent, in order. An event of a state replaces the one before it of the same
//! name, so that a page that opens gets the present and not the past.

use std::collections::VecDeque;

/// What happens once is kept for pages that reconnect: this many of each name.
const KEPT: usize = 16;

#[derive(Clone, Debug, PartialEq)]
pub(super) struct Event {
    pub(super) number: u64,
    pub(super) name: &'static str,
    /// One line of JSON.
    pub(super) data: String,
    /// What a state is of; `None` of what happens once.
    of: Option<String>,
}

#[derive(Debug, Default)]
pub(super) struct EventLog {
    events: VecDeque<Event>,
    last: u64,
}

impl EventLog {
    /// Adds a state.
    pub(super) fn set(&mut self, name: &'static str, data: String) {
        self.set_of(name, "", data);
    }

    /// Adds the state of one of several things.
    pub(super) fn set_of(&mut self, name: &'static str, of: &str, data: String) {
        self.events.retain(|event| event.name != name || event.of.as_deref() != Some(of));
        self.push(name, data, Some(of.to_owned()));
    }

    /// Replaces the data of a state for pages that open later; those that are open know it.
    pub(super) fn amend(&mut self, name: &'static str, of: &str, data: String) {
        let is_it = |event: &&mut Event| event.name == name && event.of.as_deref() == Some(of);
        if let Some(event) = self.events.iter_mut().find(is_it) {
            event.data = data;
        }
    }

    /// Adds what happens once.
    pub(super) fn tell(&mut self, name: &'static str, data: String) {
        self.push(name, data, None);
        let is_alike = |event: &&Event| event.of.is_none() && event.name == name;
        let once: Vec<u64> = self.events.iter().filter(is_alike).map(|event| event.number).collect();
        if let Some(oldest) = once.len().checked_sub(KEPT + 1).map(|place| once[place]) {
            self.events.retain(|event| event.of.is_some() || event.name != name || event.number > oldest);
        }
    }

    fn push(&mut self, name: &'static str, data: String, of: Option<String>) {
        self.last += 1;
        self.events.push_back(Event { number: self.last, name, data, of });
    }

    /// The events after a number; for a page that has just opened, `None`, all states.
    pub(super) fn after(&self, number: Option<u64>) -> Vec<Event> {
        // A number of a server before this one says nothing here.
        let number = number.filter(|number| *number <= self.last);
        let is_new = |event: &&Event| number.map_or(event.of.is_some(), |number| event.number > number);
        self.events.iter().filter(is_new).cloned().collect()
    }

    pub(super) fn last(&self) -> u64 {
        self.last
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(events: &[Event]) -> Vec<(&str, &str)> {
        events.iter().map(|event| (event.name, event.data.as_str())).collect()
    }

    #[test]
    fn a_state_replaces_the_one_before_and_what_happens_once_is_not_told_to_newcomers() {
        let mut log = EventLog::default();
        log.set("status", "1".into());
        log.tell("toast", "2".into());
        log.set("scene", "3".into());
        log.set("status", "4".into());
        assert_eq!(names(&log.after(None)), [("scene", "3"), ("status", "4")]);
        assert_eq!(names(&log.after(Some(1))), [("toast", "2"), ("scene", "3"), ("status", "4")]);
        assert_eq!(names(&log.after(Some(3))), [("status", "4")]);
        assert!(log.after(Some(log.last())).is_empty());
        assert_eq!(log.after(Some(99)), log.after(None), "a number of another server");
        log.set_of("material", "gold", "5".into());
        log.set_of("material", "tin", "6".into());
        log.set_of("material", "gold", "7".into());
        assert_eq!(names(&log.after(Some(4))), [("material", "6"), ("material", "7")]);
        log.amend("material", "tin", "8".into());
        log.amend("material", "lead", "9".into());
        assert_eq!(names(&log.after(Some(5))), [("material", "8"), ("material", "7")]);
        assert_eq!(names(&log.after(Some(6))), [("material", "7")]);
    }

    #[test]
    fn only_the_latest_of_what_happens_once_are_kept() {
        let mut log = EventLog::default();
        log.set("catalog", "0".into());
        (0..100).for_each(|k| log.tell("toast", k.to_string()));
        assert_eq!(log.events.len(), 1 + KEPT);
        assert_eq!(log.events.back().unwrap().data, "99");
    }
}
