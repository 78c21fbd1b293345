//! Events that are lost, or do not come at all.

use super::*;
use crate::watch::Message;

/// `notify`'s full debouncer tells nothing of this, which is why it is not used.
#[test]
fn a_file_renamed_over_another_and_removed_at_once() {
    let project = capitals();
    let watched = Watched::new(&project, Way::Listening);
    project.write("in/rain.txt", "grey");
    rename(&project, "in/rain.txt", "in/sky.txt");
    project.remove("in/sky.txt");
    watched.until_out(&[("gold.txt", "WARM")]);
}

#[test]
fn a_file_renamed_and_removed_at_once() {
    let project = capitals();
    let watched = Watched::new(&project, Way::Listening);
    rename(&project, "in/sky.txt", "in/rain.txt");
    project.remove("in/rain.txt");
    watched.until_out(&[("gold.txt", "WARM")]);
}

#[test]
fn a_queue_that_overflowed_leads_to_a_look_at_everything() {
    let project = capitals();
    let options = Way::Listening.options();
    let collector = ChangeCollector::without_listener(options.debounce);
    let system = collector.sender();
    let watched = Watched::with(&project, options, collector);
    watched.until_out(&[("gold.txt", "WARM"), ("sky.txt", "BLUE")]);
    watched.until("it rests", |events| summaries(events).next().is_some());
    project.write("in/sky.txt", "grey");
    project.write("in/rain.txt", "wet");
    system.send(Message::EventsLost).unwrap();
    watched.until_out(&[("gold.txt", "WARM"), ("rain.txt", "WET"), ("sky.txt", "GREY")]);
    assert_eq!(watched.noticed(), [(".".into(), Changed::Unknown)]);
}

#[test]
fn after_an_overflow_folders_that_were_replaced_unheard_are_listened_to() {
    let project = capitals();
    let options = Way::Listening.options();
    let collector = ChangeCollector::new(options.debounce, None, Duration::from_secs(3600));
    let system = collector.sender();
    let watched = Watched::with(&project, options, collector);
    watched.until("it watches", |events| events.iter().any(|event| matches!(event, Event::Watching { .. })));
    for text in ["one", "two"] {
        system.send(Message::EventsLost).unwrap();
        project.remove("in");
        project.write("in/sky.txt", text);
        watched.until_out(&[("sky.txt", &text.to_uppercase())]);
    }
}

#[test]
fn where_no_event_arrives_polling_takes_over() {
    let project = capitals();
    let options = Way::Listening.options();
    let collector = ChangeCollector::with_silent_listener(options.debounce, Duration::from_millis(25));
    let watched = Watched::with(&project, options, collector);
    let way = |events: &[Event]| {
        events.iter().find_map(|event| match event {
            Event::Watching { poll_milliseconds, because, .. } => Some((*poll_milliseconds, because.clone())),
            _ => None,
        })
    };
    watched.until("the way", |events| way(events).is_some());
    let (poll, because) = way(&watched.events()).unwrap();
    assert_eq!(poll, Some(25.0));
    let because = because.unwrap();
    assert!(because.contains("no event of a file that was written to"), "{because}");
    project.write("in/sky.txt", "grey");
    watched.until_out(&[("gold.txt", "WARM"), ("sky.txt", "GREY")]);
}

#[test]
fn probes_prove_every_root_and_leave_nothing() {
    let project = capitals();
    project.write("in/.specula-probe-1", "of a watcher that was killed");
    let watched = Watched::new(&project, Way::Listening);
    let told = watched.events();
    let way = told.iter().find(|event| matches!(event, Event::Watching { .. })).unwrap();
    assert!(
        matches!(way, Event::Watching { poll_milliseconds: None, because: None, folders } if *folders >= 3),
        "{way:?}"
    );
    for folder in ["", "in"] {
        let names = std::fs::read_dir(project.path(folder)).unwrap().map(|entry| entry.unwrap().file_name());
        let left = names.filter(|name| name.to_string_lossy().contains("probe")).collect::<Vec<_>>();
        assert!(left.is_empty(), "{left:?}");
    }
}
