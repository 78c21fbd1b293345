//! Events that are lost or never arrive.

use super::*;
use crate::watch::WatchMessage;

/// `notify`'s full debouncer reports nothing here, which is why it is not used.
#[test]
fn a_file_renamed_over_another_and_removed_at_once() {
    let project = capitals();
    let watched = Watched::new(&project, Way::Listening);
    project.write("in/rain.txt", "grey");
    project.rename("in/rain.txt", "in/sky.txt");
    project.remove("in/sky.txt");
    watched.until_out(&[("gold.txt", "WARM")]);
}

#[test]
fn a_file_renamed_and_removed_at_once() {
    let project = capitals();
    let watched = Watched::new(&project, Way::Listening);
    project.rename("in/sky.txt", "in/rain.txt");
    project.remove("in/rain.txt");
    watched.until_out(&[("gold.txt", "WARM")]);
}

#[test]
fn after_an_overflow_of_the_queue_everything_is_checked() {
    let project = capitals();
    let options = Way::Listening.options();
    let collector = ChangeCollector::without_listener(options.debounce);
    let system = collector.sender();
    let watched = Watched::with(&project, options, collector);
    watched.until_watching();
    watched.until_out(&[("gold.txt", "WARM"), ("sky.txt", "BLUE")]);

    project.write("in/sky.txt", "grey");
    project.write("in/rain.txt", "wet");
    system.send(WatchMessage::EventsLost).unwrap();
    watched.until_out(&[("gold.txt", "WARM"), ("rain.txt", "WET"), ("sky.txt", "GREY")]);
    assert_eq!(watched.noticed(), [(".".into(), Changed::Unknown)]);
}

#[test]
fn after_an_overflow_folders_that_were_replaced_meanwhile_are_watched() {
    let project = capitals();
    let options = Way::Listening.options();
    let collector = ChangeCollector::new(options.debounce, None, Duration::from_secs(3600));
    let system = collector.sender();
    let watched = Watched::with(&project, options, collector);
    watched.until_watching();
    for text in ["one", "two"] {
        system.send(WatchMessage::EventsLost).unwrap();
        project.remove("in");
        project.write("in/sky.txt", text);
        watched.until_out(&[("sky.txt", &text.to_uppercase())]);
    }
}

#[test]
fn if_no_event_arrives_the_watcher_polls() {
    let project = capitals();
    let options = Way::Listening.options();
    let collector = ChangeCollector::with_silent_listener(options.debounce, Duration::from_millis(25));
    let watched = Watched::with(&project, options, collector);
    let mode = |events: &[Event]| {
        events.iter().find_map(|event| match event {
            Event::Watching { poll_milliseconds, because, .. } => Some((*poll_milliseconds, because.clone())),
            _ => None,
        })
    };
    watched.until("the mode", |events| mode(events).is_some());
    let (poll, because) = mode(&watched.events()).unwrap();
    assert_eq!(poll, Some(25.0));
    assert_has(because.unwrap(), ["no event arrived within"]);
    project.write("in/sky.txt", "grey");
    watched.until_out(&[("gold.txt", "WARM"), ("sky.txt", "GREY")]);
}

#[test]
fn every_root_is_probed_and_no_probe_file_is_left() {
    let project = capitals();
    project.write("in/.specula-probe-1", "of a watcher that was killed");
    let watched = Watched::new(&project, Way::Listening);
    let events = watched.events();
    let mode = events.iter().find(|event| matches!(event, Event::Watching { .. })).unwrap();
    assert!(
        matches!(mode, Event::Watching { poll_milliseconds: None, because: None, folders } if *folders >= 3),
        "{mode:?}"
    );
    for folder in ["", "in"] {
        let names = std::fs::read_dir(project.path(folder)).unwrap().map(|entry| entry.unwrap().file_name());
        let left = names.filter(|name| name.to_string_lossy().contains("probe")).collect::<Vec<_>>();
        assert!(left.is_empty(), "{left:?}");
    }
}
