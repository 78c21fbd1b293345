//! Manifests that are edited, broken and repaired, and builds that fail as a whole.

use super::*;
use crate::error::ErrorKind;
use crate::storage::{LockPurpose, LockRequest, LockTimeout, State};

fn rejected(events: &[Event]) -> Vec<String> {
    let rejected = events.iter().filter_map(|event| match event {
        Event::Rejected { diagnostics } => Some(diagnostics.to_string()),
        _ => None,
    });
    rejected.collect()
}

each_way! {
    fn an_edited_manifest_is_reloaded(way: Way) {
        let project = capitals();
        let watched = Watched::new(&project, way);
        project.edit("{text}", "{text}-loud");
        watched.until_out(&[("gold-loud.txt", "WARM"), ("sky-loud.txt", "BLUE")]);
        project.write("more/rain.txt", "wet");
        project.edit("in/*.txt", "more/*.txt");
        watched.until_out(&[("rain-loud.txt", "WET")]);
        project.write("more/rain.txt", "dry");
        watched.until_out(&[("rain-loud.txt", "DRY")]);
    }

    fn errors_of_a_manifest_are_reported_and_the_last_valid_one_stays_in_use(way: Way) {
        let project = capitals();
        let watched = Watched::new(&project, way);
        project.edit("kind = \"upper\"", "kind = \"uper\"");
        watched.until("the rejection", |events| !rejected(events).is_empty());
        let errors = rejected(&watched.events()).remove(0);
        assert_has(&errors, ["pipeline.toml:5:18: there is no kind \"uper\""]);
        project.write("in/sky.txt", "grey");
        project.write("in/rain.txt", "wet");
        let after = [("gold.txt", "WARM"), ("rain.txt", "WET"), ("sky.txt", "GREY")];
        watched.until_out(&after);
        assert_eq!(rejected(&watched.events()).len(), 1, "the same errors are reported once");
        project.edit("kind = \"uper\"", "kind = \"upper\"");
        watched.until("it is accepted", |events| events.contains(&Event::Accepted));
        project.write("in/sky.txt", "red");
        watched.until_out(&[after[0], after[1], ("sky.txt", "RED")]);
    }

    fn a_watcher_waits_for_a_manifest_that_is_invalid_at_the_start(way: Way) {
        let project = capitals();
        project.edit("schema = 1", "schema = ");
        let watched = Watched::start(&project, way.options());
        watched.until("the rejection", |events| !rejected(events).is_empty());
        project.edit("schema = ", "schema = 1");
        watched.until_out(&[("gold.txt", "WARM"), ("sky.txt", "BLUE")]);
    }

    fn a_watcher_waits_for_a_manifest_that_does_not_exist(way: Way) {
        let project = capitals();
        project.remove("pipeline.toml");
        let watched = Watched::start(&project, way.options());
        watched.until("the rejection", |events| !rejected(events).is_empty());
        project.write("pipeline.toml", CAPITALS);
        watched.until_out(&[("gold.txt", "WARM"), ("sky.txt", "BLUE")]);
    }

    fn two_files_with_one_stem_are_an_error_until_one_is_removed(way: Way) {
        let project = Project::new(&CAPITALS.replace("*.txt", "*.{txt,md}"));
        project.write("in/sky.txt", "blue");
        let watched = Watched::new(&project, way);
        project.write("in/sky.md", "grey");
        watched.until("the rejection", |events| !rejected(events).is_empty());
        assert!(rejected(&watched.events())[0].contains("have the stem \"sky\""));
        project.remove("in/sky.txt");
        watched.until_out(&[("sky.txt", "GREY")]);
        assert!(watched.events().contains(&Event::Accepted));
    }

    fn a_watcher_waits_for_the_lock_of_another_build(way: Way) {
        let project = capitals();
        let request = LockRequest {
            purpose: LockPurpose::Collect,
            timeout: LockTimeout::NONE,
            cancel: &Cancel::default(),
            waiting: &|_| {},
        };
        let other = State::lock(&project.path(""), &request).unwrap();
        let watched = Watched::start(&project, way.options());
        watched.until("it waits", |events| {
            events.iter().any(|event| matches!(event, Event::Waiting { .. }))
        });
        drop(other);
        watched.until_out(&[("gold.txt", "WARM"), ("sky.txt", "BLUE")]);
    }

    fn once_ends_after_the_first_rebuild_that_a_change_caused(way: Way) {
        let project = capitals();
        let watched = Watched::start(&project, WatchOptions { once: true, ..way.options() });
        watched.until_watching();
        project.write("in/sky.txt", "grey");
        watched.ended().unwrap();
        assert_eq!(texts(&project)[1], ("sky.txt".into(), "GREY".into()));
    }
}

/// A folder that cannot be written stands for a full disk: builds fail as a whole.
#[cfg(unix)]
#[test]
fn a_failed_build_is_reported_and_tried_again_at_the_next_change() {
    let project = capitals();
    project.write(".specula", "not a folder");
    let watched = Watched::start(&project, Way::Listening.options());
    let failed =
        |events: &[Event]| events.iter().filter(|event| matches!(event, Event::BuildError { .. })).count();
    watched.until("the error", |events| failed(events) == 1);
    project.write("in/sky.txt", "grey");
    watched.until("the error again", |events| failed(events) >= 2);
    project.remove(".specula");
    project.write("in/sky.txt", "red");
    watched.until_out(&[("gold.txt", "WARM"), ("sky.txt", "RED")]);
}

#[test]
fn a_stage_that_does_not_exist_ends_the_watcher_at_the_start() {
    let project = capitals();
    let mut options = Way::Listening.options();
    options.build.stages = vec!["wirte".into()];
    let ended = Watched::start(&project, options).ended();
    assert_eq!(ended.unwrap_err().kind(), ErrorKind::UnknownTarget);
}

#[test]
fn only_the_stages_that_were_asked_for_are_built() {
    let project = capitals();
    let mut options = Way::Listening.options();
    options.build.stages = vec!["upper".into()];
    let watched = Watched::start(&project, options);
    watched.until("it is built", |events| summaries(events).next().is_some());
    project.write("in/sky.txt", "grey");
    watched.until("two builds", |events| summaries(events).filter(|summary| summary.ran > 0).count() == 2);
    assert_eq!(texts(&project), []);
}

#[test]
fn errors_of_a_manifest_are_reported_while_a_build_runs() {
    let project = Project::new(&CAPITALS.replace("kind = \"upper\"", "kind = \"wait-for-file\""));
    project.write("in/gold.txt", &format!("wait {}", project.path("go").display()));
    let watched = Watched::start(&project, Way::Listening.options());
    watched.until("the build runs", |events| {
        let is_wait = |event: &Event| matches!(event, Event::Started { item, .. } if item.stage == "upper");
        events.iter().any(is_wait)
    });
    let built = summaries(&watched.events()).count();
    let valid = project.read("pipeline.toml");
    project.write("pipeline.toml", "schema = ");
    watched.until("the rejection", |events| !rejected(events).is_empty());
    project.write("pipeline.toml", &valid);
    watched.until("it is accepted", |events| events.contains(&Event::Accepted));
    assert_eq!(summaries(&watched.events()).count(), built, "the build still runs");
    project.write("go", "");
    watched.until("the build ends", |events| summaries(events).count() > built);
    assert_eq!(rejected(&watched.events()).len(), 1);
}
