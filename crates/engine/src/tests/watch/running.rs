//! Changes during a build.

use std::path::Path;

use super::*;

/// Passes a text on; `wait PATH` only after a file exists at that path.
pub(super) struct WaitForFile;

impl TextKind for WaitForFile {
    type Parameters = Nothing;
    const NAME: &'static str = "wait-for-file";

    fn make(_: &Nothing, text: &str, context: &Context<'_>) -> Result<String, Failure> {
        if let Some(path) = text.strip_prefix("wait ") {
            let deadline = Instant::now() + 2 * DEADLINE;
            while !Path::new(path).exists() {
                context.reporter.check_cancelled()?;
                if Instant::now() > deadline {
                    return Err(Failure::new("the file did not appear"));
                }
                std::thread::sleep(Duration::from_millis(1));
            }
        }
        Ok(text.chars().take(4).collect())
    }
}

fn starts(events: &[Event], item: &str) -> usize {
    let is =
        |event: &&Event| matches!(event, Event::Started { item: started, .. } if started.to_string() == item);
    events.iter().filter(is).count()
}

fn waiting() -> Project {
    let project = Project::new(&CAPITALS.replace("kind = \"upper\"", "kind = \"wait-for-file\""));
    project.write("in/sky.txt", "blue");
    project.write("in/gold.txt", &format!("wait {}", project.path("go").display()));
    project
}

each_way! {
    fn an_edit_stops_what_it_makes_stale_at_once(way: Way) {
        let project = waiting();
        let watched = Watched::start(&project, way.options());
        watched.until("gold runs", |events| starts(events, "upper [gold]") == 1);
        project.write("in/gold.txt", "warm");
        watched.until_out(&[("gold.txt", "warm"), ("sky.txt", "blue")]);
        assert!(summaries(&watched.events()).any(|summary| summary.cancelled), "{}", log(&watched.events()));
    }

    fn a_manifest_edited_meanwhile_stops_the_items_that_it_removes(way: Way) {
        let project = waiting();
        let watched = Watched::start(&project, way.options());
        watched.until("gold runs", |events| starts(events, "upper [gold]") == 1);
        project.edit("wait-for-file", "upper");
        let waited = format!("WAIT {}", project.path("go").display().to_string().to_uppercase());
        watched.until_out(&[("gold.txt", &waited), ("sky.txt", "BLUE")]);
    }

    fn a_source_deleted_meanwhile_stops_its_item(way: Way) {
        let project = waiting();
        let watched = Watched::start(&project, way.options());
        watched.until("gold runs", |events| starts(events, "upper [gold]") == 1);
        project.remove("in/gold.txt");
        watched.until_out(&[("sky.txt", "blue")]);
    }

    fn an_edit_of_something_else_neither_stops_a_run_nor_is_lost(way: Way) {
        let project = waiting();
        let watched = Watched::start(&project, way.options());
        watched.until("gold runs", |events| starts(events, "upper [gold]") == 1);
        watched.until_out_holds("sky.txt", "blue");
        project.write("in/sky.txt", "grey");
        // In most runs the event arrives within this time; the outcome is the same if it does not.
        std::thread::sleep(QUIET * 5);
        project.write("go", "");
        watched.until_out(&[("gold.txt", "wait"), ("sky.txt", "grey")]);
        assert_eq!(starts(&watched.events(), "upper [gold]"), 1, "{}", log(&watched.events()));
    }

    fn a_watcher_that_is_cancelled_stops_its_build(way: Way) {
        let project = waiting();
        let watched = Watched::start(&project, way.options());
        watched.until("gold runs", |events| starts(events, "upper [gold]") == 1);
        watched.cancel.cancel();
        watched.ended().unwrap();
    }

    fn an_export_deleted_before_its_folder_is_watched_is_restored(way: Way) {
        let project = waiting();
        project.edit("{text}", "{text}/loud");
        let watched = Watched::start(&project, way.options());
        watched.until_out_holds("sky/loud.txt", "blue");
        watched.until("gold runs", |events| starts(events, "upper [gold]") == 1);
        project.remove("out/sky");
        project.write("go", "");
        watched.until_out(&[("gold/loud.txt", "wait"), ("sky/loud.txt", "blue")]);
    }

    /// The deletion is not a change of the graph, but after a rebuild for another reason everything is
    /// checked.
    fn a_deleted_export_is_restored_after_the_next_rebuild(way: Way) {
        let project = Project::new(CAPITALS);
        project.write("in/sky.txt", "blue");
        project.write("in/sea.txt", "deep");
        let watched = Watched::new(&project, way);
        project.remove("out/sea.txt");
        project.write("in/sky.txt", "grey");
        watched.until_out(&[("sea.txt", "DEEP"), ("sky.txt", "GREY")]);
    }
}
